//! Output of `rodfit simulate`: a CSV table of all nodes, a JSON report, and one shape as CSV.
//!
//! [`NodeTable`] writes a header row (`header`), and a row per call of `push`: time (s), and x, y, z of every node (m,
//! world axes). If requested (`with_reactions`, `with_contacts`), force (N) and moment (N m) of both supports and the
//! force (N) of each contact follow. `into_inner` returns the writer, which is not flushed. [`SimulationReport`]
//! collects a run: model, tip (m) and energies (J) per recorded step, reactions and contact forces if the run keeps
//! them, counts of work, largest strain and overlap with an obstacle; `without_series` keeps no lists that grow with
//! the steps. `assessed` overwrites resolution and warnings after a check of the numerics. `last_tip` is the last
//! recorded tip with its time. `SimulationReport::finish` sets the status, and appends warnings of large strains, deep
//! contacts and numerical damping, and of an unstable state if stability was checked. `energy_drift` is the largest
//! change of the total energy over the largest kinetic energy, 0 for a rod whose kinetic energy is at most that of a
//! displacement by `NEGLIGIBLE_DISPLACEMENT` lengths in the time of the scene. `energy_in_words` is one sentence, of
//! the first case that holds: no motion, moving supports, flow, damping or friction, numerical damping by beta above
//! 0.5 or by generalised-alpha. Otherwise the energy is conserved up to `MAX_KEPT`, or changed by the scheme.
//! [`shape_csv`] has the columns x, y, z, s (m) and a row per node; more nodes than the rod has are an error.

use crate::code::Code;
use crate::dynamics::energy_balance;
use crate::dynamics::mean_stretch::{self, MeanStretch};
use crate::dynamics::run::Snapshot;
use crate::dynamics::step::Work;
use crate::dynamics::step_error::StepError;
use crate::dynamics::trajectory::Trajectory;
use crate::error::Error;
use crate::numerics::simd::simd_level;
use crate::problem::Problem;
use crate::problem::penetration::PenetrationRecord;
use crate::problem::strain::StrainRecord;
use crate::scene::{Contact, Resolution, Scene, Scheme};
use crate::statics::{Reaction, Reactions};
use serde::{Deserialize, Serialize};
use std::io::{self, Write};

/// Change of the energy, over the largest kinetic energy, up to which the text calls the energy conserved. Affects the
/// text only.
const MAX_KEPT: f64 = 0.02;
/// Displacement over the length of a rod, in the time of the scene, up to which the rod counts as still: far above
/// rounding errors of coordinates.
const NEGLIGIBLE_DISPLACEMENT: f64 = 1e-9;

/// A CSV table with a row per step: `t`, then `x_i,y_i,z_i` of every node in world axes, m. With reactions the columns
/// `start_fx[N]` to `start_mz[N m]` and `end_fx[N]` to `end_mz[N m]` follow, then `contact_i_fx[N]` to
/// `contact_i_fz[N]` of every contact.
#[derive(Debug)]
pub struct NodeTable<W> {
    writer: W,
    nodes: usize,
    has_reactions: bool,
    contacts: usize,
}

impl<W: Write> NodeTable<W> {
    /// A table of `nodes` nodes that is written to `writer`; nothing is written yet.
    pub fn new(writer: W, nodes: usize) -> Self {
        Self { writer, nodes, has_reactions: false, contacts: 0 }
    }

    /// The table with columns of the reactions of both supports, if `has_reactions`. The run must keep reactions.
    pub fn with_reactions(self, has_reactions: bool) -> Self {
        Self { has_reactions, ..self }
    }

    /// The table with columns of the forces, N, of `contacts` contacts, in the order of the scene. The run must keep
    /// reactions.
    pub fn with_contacts(self, contacts: usize) -> Self {
        Self { contacts, ..self }
    }

    /// Writes the header row: `t`, then `x_i,y_i,z_i` of every node, with its index `i`, then the reactions and the
    /// forces of contacts. Error: a failed write.
    pub fn header(&mut self) -> io::Result<()> {
        write!(self.writer, "t")?;
        for i in 0..self.nodes {
            write!(self.writer, ",x_{i},y_{i},z_{i}")?;
        }
        for end in ["start", "end"].iter().filter(|_| self.has_reactions) {
            for (part, unit) in [("f", "N"), ("m", "N m")] {
                for axis in ["x", "y", "z"] {
                    write!(self.writer, ",{end}_{part}{axis}[{unit}]")?;
                }
            }
        }
        for i in 0..self.contacts {
            for axis in ["x", "y", "z"] {
                write!(self.writer, ",contact_{i}_f{axis}[N]")?;
            }
        }
        writeln!(self.writer)
    }

    /// Appends a row with the time, s, and the coordinates of all nodes, m, of a simulation's present state, separated
    /// by commas. If the table has columns for them, the reactions of the supports and the forces of the contacts
    /// follow, as in the header row. Error: a failed write.
    pub fn push(&mut self, simulation: &dyn Snapshot) -> io::Result<()> {
        write!(self.writer, "{}", simulation.time())?;
        for i in 0..self.nodes {
            let [x, y, z] = simulation.position(i);
            write!(self.writer, ",{x},{y},{z}")?;
        }
        if let Some(reactions) = simulation.reactions().filter(|_| self.has_reactions) {
            for x in reactions.parts().as_flattened().as_flattened() {
                write!(self.writer, ",{x}")?;
            }
        }
        if self.contacts > 0 {
            for x in simulation.contact_forces().as_flattened() {
                write!(self.writer, ",{x}")?;
            }
        }
        writeln!(self.writer)
    }

    /// Returns the writer, to which all rows so far have been written; it is not flushed.
    pub fn into_inner(self) -> W {
        self.writer
    }
}

/// A shape of a problem's rod as a CSV table with the columns x, y, z and s, m, and a row per node. x, y and z are
/// its position in world axes, s its arc length from the wall. `initial.shape` accepts the table as a polyline. Fewer
/// nodes than the rod has give fewer rows.
///
/// # Errors
/// [`Error::OutOfRange`] for more nodes than the rod has.
pub fn shape_csv(problem: &Problem, nodes: &[[f64; 3]]) -> Result<String, Error> {
    let mut table = String::from("x,y,z,s\n");
    let places = problem.arc_lengths();
    if nodes.len() > places.len() {
        let (at, high) = (nodes.len() as f64 - 1.0, places.len() as f64 - 1.0);
        return Err(Error::OutOfRange { what: "node", found: at, low: 0.0, high });
    }
    for ([x, y, z], s) in nodes.iter().zip(places) {
        table += &format!("{x},{y},{z},{s}\n");
    }
    Ok(table)
}

/// Result of a simulation: the JSON of `rodfit simulate --json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct SimulationReport {
    /// Model of the rod: `planar` or `spatial`.
    pub model: String,
    /// Reason for the model.
    pub model_reason: String,
    /// Number of degrees of freedom, including supported ones.
    pub dof: usize,
    /// Number of recorded steps; `work` counts halved steps too.
    pub steps: usize,
    /// Total number of Newton iterations.
    pub newton_iterations: usize,
    /// Counts of the numerical work.
    pub work: Work,
    /// Wall-clock time of the time stepping, s.
    pub wall_seconds: f64,
    /// SIMD unit of the processor that was used.
    #[serde(default)]
    pub vector_unit: String,
    /// Rows `[t, x, y, z]` of the tip from t = 0, s and m in world axes.
    pub tip: Vec<[f64; 4]>,
    /// Rows `[t, kinetic, stretch, bend, twist, potential]`, s and J; user-defined energies, tendons and
    /// contacts are part of the potential.
    pub energy: Vec<[f64; 6]>,
    /// Reactions of the supports at every step, if requested.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub reactions: Vec<ReactionSample>,
    /// Forces of the obstacles on the rod at every step, if reactions are requested and the scene has contacts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contact_forces: Vec<ContactForces>,
    /// Largest change of the total energy since the start, J.
    pub largest_energy_change: f64,
    /// Largest kinetic energy since the start, J.
    pub largest_kinetic_energy: f64,
    /// `completed`, or the reason why the run stopped.
    pub status: String,
    /// Chosen or checked mesh, step and scheme, with the estimated error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution: Option<Resolution>,
    /// Warnings of the run.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Codes of `warnings`, in the same order.
    #[serde(default)]
    pub warning_codes: Vec<Code>,
    /// Scene with all defaults.
    pub scene: Scene,
    /// Total energy at the start, J.
    #[serde(default)]
    pub start_energy: f64,
    /// Last recorded total energy, J.
    #[serde(default)]
    pub end_energy: f64,
    /// Kinetic energy below which values are rounding errors, J.
    #[serde(default)]
    pub negligible_energy: f64,
    /// Last recorded row `[t, x, y, z]` of the tip, s and m.
    #[serde(default)]
    last_tip: Option<[f64; 4]>,
    /// The largest strain so far.
    #[serde(skip)]
    strains: StrainRecord,
    /// Largest overlap with an obstacle so far.
    #[serde(skip)]
    penetration: PenetrationRecord,
    /// For the average vector field: stretching in the means of successive states.
    #[serde(skip)]
    mean_stretch: Option<MeanStretch>,
    /// Its largest energy so far, J.
    #[serde(skip)]
    largest_mean_stretch: f64,
    /// Estimate of the error of a given step.
    #[serde(skip)]
    step_error: StepError,
    /// Whether `tip`, `energy`, `reactions` and `contact_forces` are recorded.
    #[serde(default = "yes", skip_serializing_if = "is_yes")]
    has_series: bool,
}

/// The reactions of the supports at one time of a simulation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ReactionSample {
    /// Time, s.
    pub time: f64,
    /// Reaction of the support at the first node.
    pub start: Reaction,
    /// Reaction of the support at the last node.
    pub end: Reaction,
}

/// The forces of all obstacles on the rod at one time of a simulation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ContactForces {
    /// Time, s.
    pub time: f64,
    /// The force of each obstacle in world axes, N, in the order of `[[contacts]]`.
    pub forces: Vec<[f64; 3]>,
}

/// `true`, the default of the key `has_series` in reports that do not contain it.
fn yes() -> bool {
    true
}

/// Whether `has_series` is true, its default, so that the JSON of the report omits it.
fn is_yes(has_series: &bool) -> bool {
    *has_series
}

impl SimulationReport {
    /// The report of a run before its first state: model with its reason, numerics, warnings with codes and scene of
    /// the `problem`, and the SIMD unit. The status is `started`; counts and energies are zero. [`push`](Self::push)
    /// then records the series.
    pub fn new(problem: &Problem) -> Self {
        let (model, model_reason) = problem.model();
        Self {
            model: model.into(),
            model_reason: model_reason.into(),
            dof: problem.dof(),
            steps: 0,
            newton_iterations: 0,
            work: Work::default(),
            wall_seconds: 0.0,
            vector_unit: simd_level().into(),
            tip: Vec::new(),
            energy: Vec::new(),
            reactions: Vec::new(),
            contact_forces: Vec::new(),
            largest_energy_change: 0.0,
            largest_kinetic_energy: 0.0,
            status: "started".into(),
            resolution: problem.resolution().copied(),
            warnings: problem.warnings(),
            warning_codes: problem.coded_warnings().into_iter().map(|(code, _)| code).collect(),
            scene: problem.scene().clone(),
            start_energy: 0.0,
            end_energy: 0.0,
            negligible_energy: negligible_energy(problem),
            last_tip: None,
            strains: StrainRecord::new(problem),
            penetration: PenetrationRecord::new(problem.scene()),
            mean_stretch: MeanStretch::new(problem.scene()),
            largest_mean_stretch: 0.0,
            step_error: StepError::new(problem.scene(), problem.nodes(), problem.length()),
            has_series: true,
        }
    }

    /// Overwrites resolution and warnings by those of the `problem`, after its numerics have been checked. Warnings
    /// of a finished run are lost.
    pub fn assessed(&mut self, problem: &Problem) {
        self.resolution = problem.resolution().copied();
        let warnings = Self::new(problem);
        (self.warnings, self.warning_codes) = (warnings.warnings, warnings.warning_codes);
    }

    /// The report without the series `tip`, `energy`, `reactions` and `contact_forces`, which grow with every step;
    /// [`push`](Self::push) then keeps the last tip and the extremes only.
    pub fn without_series(self) -> Self {
        Self { has_series: false, ..self }
    }

    /// Adds the present state of a simulation of the `problem`. Tip and energies, and reactions and contact forces if
    /// the run keeps them, are appended to the series, unless the report is [without series](Self::without_series).
    /// Updated are the largest strain, the largest overlap with an obstacle, the largest absolute change of the total
    /// energy since the first state, and the largest kinetic energy. The first call sets the energy at the start; each
    /// later one counts as a step.
    pub fn push(&mut self, problem: &Problem, simulation: &dyn Snapshot) {
        let (t, e) = (simulation.time(), simulation.energies());
        let [x, y, z] = simulation.place(&problem.tip());
        let total = e.total();
        self.strains.add(|i| simulation.position(i), t);
        self.penetration.add(|i| simulation.position(i), Some(t));
        if let Some(stretch) = &mut self.mean_stretch {
            let energy = stretch.next((0..problem.nodes()).map(|i| simulation.position(i)));
            self.largest_mean_stretch = self.largest_mean_stretch.max(energy);
        }
        self.step_error.add(t, |i| simulation.position(i));
        // The first state is the start, and no step.
        match self.last_tip {
            None => self.start_energy = total,
            Some(_) => self.steps += 1,
        }
        self.end_energy = total;
        self.last_tip = Some([t, x, y, z]);
        // Since the start, not from step to step: small changes in one direction add up.
        self.largest_energy_change =
            self.largest_energy_change.max((total - self.start_energy).abs());
        self.largest_kinetic_energy = self.largest_kinetic_energy.max(e.kinetic);
        if self.has_series {
            self.tip.push([t, x, y, z]);
            self.energy.push([t, e.kinetic, e.stretch, e.bend, e.twist, e.potential + e.own]);
            let sample = |Reactions { start, end }| ReactionSample { time: t, start, end };
            self.reactions.extend(simulation.reactions().map(sample));
            let forces = simulation.contact_forces();
            if !forces.is_empty() {
                self.contact_forces.push(ContactForces { time: t, forces });
            }
        }
    }

    /// Completes the report with the work and time of the run `trajectory` and its status: `completed`, or `stopped: `
    /// with the error of `outcome` and its code. Appends warnings about large strains, deep contacts, numerical
    /// damping, stretching of mean states, a coarse given step and an unstable state, in this order, with their codes.
    /// That of the step is only given if the error of the numerics is not known otherwise, the last one if [stability
    /// was checked](Trajectory::check_stability).
    pub fn finish(&mut self, trajectory: &Trajectory, outcome: &Result<(), Error>) {
        self.work = trajectory.work();
        self.newton_iterations = self.work.newton_iterations;
        self.wall_seconds = trajectory.stepping().as_secs_f64();
        // These warnings depend on extremes of the whole run, which are known only now.
        let modulus = self.scene.material.youngs_modulus;
        let strained =
            self.strains.largest().into_iter().flat_map(|largest| largest.warnings(modulus));
        let unbalanced = energy_balance::warning(&self.scene, self.energy_drift());
        let end = self.scene.time.as_ref().map_or(f64::INFINITY, |time| time.end);
        let stability = trajectory.record().stability.as_ref();
        let unstable = stability.and_then(|checks| checks.found).map(|state| state.warning(end));
        let deep = self.penetration.warning();
        let kinetic = self.largest_kinetic_energy;
        let stretched = mean_stretch::warning(&self.scene, self.largest_mean_stretch, kinetic);
        let is_assessed = self.resolution.is_some_and(|resolution| resolution.error.is_some());
        let coarse = self.step_error.warning().filter(|_| !is_assessed && stretched.is_none());
        let of_scheme = unbalanced.into_iter().chain(stretched).chain(coarse);
        for (code, words) in strained.chain(deep).chain(of_scheme).chain(unstable) {
            self.warnings.push(code.behind(words));
            self.warning_codes.push(code);
        }
        self.status = match outcome {
            Ok(()) => "completed".into(),
            Err(error) => {
                let words = format!("stopped: {error}");
                error.code().map_or(words.clone(), |code| code.behind(&words))
            }
        };
    }

    /// `[t, x, y, z]` of the last recorded tip, s and m; `None` before the first state.
    pub fn last_tip(&self) -> Option<[f64; 4]> {
        self.last_tip.or(self.tip.last().copied())
    }

    /// Largest absolute change of the total energy since the start over the largest kinetic energy, dimensionless; 0
    /// for a rod that does not move (kinetic energy of at most `negligible_energy`).
    pub fn energy_drift(&self) -> f64 {
        // Of a rod at rest it would be the ratio of two rounding errors.
        match self.is_still() {
            true => 0.0,
            false => self.largest_energy_change / self.largest_kinetic_energy,
        }
    }

    /// A sentence about the change of the energy. Cases, in this order: no motion; moving supports or flow (energies at
    /// start and end, J); damping, drag or losses of contacts (dissipated energy, J); numerical damping by beta above
    /// 0.5, or by generalised-alpha with any rho_inf (energy lost, as a percentage of the largest kinetic energy).
    /// Otherwise the change is an error of the scheme. It is the largest change as a percentage of the largest kinetic
    /// energy: conserved within it up to `MAX_KEPT`, else changed.
    pub fn energy_in_words(&self) -> String {
        let (scene, drift) = (&self.scene, 100.0 * self.energy_drift());
        let (start, end) = (self.start_energy, self.end_energy);
        // Moving supports, flow and damping change the energy too: only without them is a change an
        // error of the scheme.
        let time = scene.time.as_ref();
        let beta = time.filter(|t| t.scheme.takes_beta()).map_or(0.5, |t| t.beta);
        if self.is_still() {
            "the rod does not move".into()
        } else if scene.supports.move_ends() {
            format!("energy changed from {start:.3e} to {end:.3e} J, work of the supports included")
        } else if scene.loads.have_flow() {
            format!("energy changed from {start:.3e} to {end:.3e} J, work of the fluid included")
        } else if scene.is_dissipative() {
            let has_friction = scene.contacts.iter().any(Contact::has_friction);
            let has_damping =
                scene.loads.are_dissipative() || scene.contacts.iter().any(Contact::has_damping);
            let cause = match (has_damping, has_friction) {
                (true, true) => "damping and friction",
                (false, true) => "friction",
                _ => "damping",
            };
            format!("{cause} dissipated {:.3e} J", start - end)
        } else if beta > 0.5 {
            let part = percent(100.0 * (start - end) / self.largest_kinetic_energy);
            format!(
                "numerical damping (beta = {beta}) dissipated {part} of the largest kinetic \
                     energy"
            )
        } else if let Some(time) = time.filter(|t| t.scheme == Scheme::GeneralisedAlpha) {
            let part = percent(100.0 * (start - end) / self.largest_kinetic_energy);
            let rho_inf = time.rho_inf;
            format!(
                "numerical damping (rho_inf = {rho_inf}) dissipated {part} of the largest \
                     kinetic energy"
            )
        } else if self.energy_drift() <= MAX_KEPT {
            format!("energy conserved within {} of the largest kinetic energy", percent(drift))
        } else {
            let name = self.scene.scheme().name();
            format!("{name} changed the energy by {} of the largest kinetic energy", percent(drift))
        }
    }

    /// Whether the largest kinetic energy is at most [`negligible_energy`], that of displacements by rounding errors.
    fn is_still(&self) -> bool {
        self.largest_kinetic_energy <= self.negligible_energy
    }
}

/// The kinetic energy, J, of a rod that moves by [`NEGLIGIBLE_DISPLACEMENT`] of its length during the time of the
/// scene: `m/2 (1e-9 L/T)^2`. Its mass `m` is that of section and density halfway along it. Zero without `[time]`.
fn negligible_energy(problem: &Problem) -> f64 {
    let (section, material) = problem.scene().at(0.5);
    // Without `[time]` the duration is infinite, so that no motion is negligible.
    let (mass, end) = (
        material.density * section.moments().area * problem.length(),
        problem.scene().time.as_ref().map_or(f64::INFINITY, |time| time.end),
    );
    0.5 * mass * (NEGLIGIBLE_DISPLACEMENT * problem.length() / end).powi(2)
}

/// A number `x` of percent as text, such as `2.5 %`: one decimal, or scientific notation, such as `4.2e-3 %`, for an
/// absolute value below 0.1.
fn percent(x: f64) -> String {
    if x.abs() < 0.1 { format!("{x:.1e} %") } else { format!("{x:.1} %") }
}
