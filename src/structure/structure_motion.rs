//! Simulations of structures: steps with bisection, the start at rest, in equilibrium or by a recording, and the report
//! of a run.
//!
//! [`Structure::simulation`] returns a [`StructureMotion`] at t = 0, without velocity unless it starts from a
//! recording, which advances to given times (`step_to`). `shape` and `position` are those of its present state, m;
//! `taken` are the ends of all steps, s. A step that fails, or that the step control rejects, is replaced by two
//! halves, and so on. It limits rotations of edges and, by the scene of the first rod and without recorded ends only,
//! the change of the energy. [`Structure::simulation_over`] is a simulation over dual numbers, for derivatives, without
//! bisection. `equilibrium_over` is the equilibrium with derivatives. [`StructureReport`] collects times, s, energies,
//! J, and ends of the rods, m. `push` adds a state, `push_energies` its energies only; `finish` sets the status and the
//! warnings. The report warns if the change of the energy over the largest kinetic energy exceeds a limit, only without
//! damping of rods and joints and without recorded ends. In space only Newmark-beta and generalized-alpha integrate; other schemes are
//! errors, as is a scene without `[time]`.

use crate::dynamics::{
    BisectedSteps, Simulation, StepControl, StepperSettings, Work, advance, energy_warning,
};
use crate::energy::Derivatives;
use crate::error::{Error, ensure};
use crate::numerics::scalar::Nestable;
use crate::numerics::tangent::{Factors, Tangent};
use crate::rod::assembly::AssemblyFrames;
use crate::rod::{Assembly, Energies, Rod};
use crate::scene::number::Quantity;
use crate::scene::{InitialState, Scheme, StructurePoint, StructureScene, Time};
use crate::structure::blueprint::AssemblyAtRest;
use crate::structure::definition::Structure;
use crate::structure::structure_shape::StructureShape;
use crate::summary::{Summary, Tone};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A simulation of a structure, step by step.
#[derive(Clone, Debug)]
pub struct StructureMotion<'a> {
    structure: &'a Structure,
    simulation: Simulation<f64, Assembly<f64>>,
    control: StepControl,
    /// Ends of all steps taken, s.
    taken: Vec<f64>,
}

impl BisectedSteps for StructureMotion<'_> {
    type Rod = Assembly<f64>;

    /// The simulation of the assembly at its present state.
    fn simulation(&self) -> &Simulation<f64, Assembly<f64>> {
        &self.simulation
    }

    /// Makes a trial step to a time, s, without bisection. Errors are those of the step; the state is then the one
    /// before it.
    fn step_to(&mut self, time: f64) -> Result<(), Error> {
        self.simulation.step_to(time)
    }

    /// Restores the state before the last step.
    fn step_back(&mut self) {
        self.simulation.step_back();
    }

    /// Keeps the time of the end of an accepted step; always `Ok`.
    fn accepted(&mut self) -> Result<(), Error> {
        self.taken.push(self.simulation.state().time);
        Ok(())
    }

    /// The step control (energy and rotations of edges), mutable, with the simulation.
    fn control(&mut self) -> (&mut StepControl, &Simulation<f64, Assembly<f64>>) {
        (&mut self.control, &self.simulation)
    }
}

impl StructureMotion<'_> {
    /// Advances to `time`, s, in one step. A step that fails or that the step control rejects is replaced by two of
    /// half its size, and so on.
    ///
    /// # Errors
    /// Those of a step that bisection does not save; the state is then the last valid one.
    pub fn step_to(&mut self, time: f64) -> Result<(), Error> {
        advance(self, time)
    }

    /// Time of the present state, s, from t = 0 on.
    pub fn time(&self) -> f64 {
        self.simulation.state().time
    }

    /// Ends of all steps taken, s: also of those that bisection made.
    pub fn taken(&self) -> &[f64] {
        &self.taken
    }

    /// Names of the rods in the order of the scene.
    pub fn rod_names(&self) -> impl Iterator<Item = &str> {
        self.structure.scene.rods.iter().map(|rod| &rod.name[..])
    }

    /// Positions of all rods and bodies at the present state, m.
    pub fn shape(&self) -> StructureShape {
        let state = self.simulation.state();
        self.structure.shape_at(&state.q, &state.frames)
    }

    /// Position of a point at the present state, m, in world axes.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a point that the structure does not have.
    pub fn position(&self, point: &StructurePoint) -> Result<[f64; 3], Error> {
        let (structure, state) = (self.structure, self.simulation.state());
        let stencil = structure.nodes().stencil(point, "point")?;
        let motions =
            structure.node_motions(self.simulation.rod(), [&state.q, &state.v], &state.frames);
        Ok(stencil.place(|node| motions[node][0]))
    }

    /// Energies at the present state, J.
    pub fn energies(&self) -> Energies {
        self.simulation.energies()
    }

    /// The simulation of the assembly, with unknowns, velocities and frames of its present state.
    pub fn simulation(&self) -> &Simulation<f64, Assembly<f64>> {
        &self.simulation
    }
}

impl Structure {
    /// The table `[time]` of the scene: duration, step and scheme.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a scene without it.
    pub fn time(&self) -> Result<&Time, Error> {
        self.scene.time.as_ref().ok_or_else(|| {
            Error::invalid("time", "no such table", "[time] with end and step, to simulate")
                .in_file(self.scene.path.as_deref())
        })
    }

    /// A simulation at t = 0. By `initial.state` it is at rest, or in the equilibrium under the loads, without
    /// velocity, or has shape and velocities by the first two frames of the recording. The step control has the limits
    /// of the energy of the scene of the first rod, or only those of rotations of edges if an end follows a recording.
    ///
    /// # Errors
    /// A scene without `[time]` or rods, another scheme than Newmark-beta and generalized-alpha in space, and those of
    /// the [equilibrium](Self::equilibrium) or recorded start. At rest also recorded ends that are away from their
    /// markers.
    pub fn simulation(&self) -> Result<StructureMotion<'_>, Error> {
        let simulation = self.simulation_of(&self.scene)?;
        let parts = self.parts().next();
        // Damping and scheme of the structure are in the scene of each rod: the first one serves.
        let control = match parts {
            Some(scene) if self.recorded.is_empty() => StepControl::new(scene, &simulation),
            Some(scene) => StepControl::without_limits(scene, &simulation),
            None => return Err(Error::invalid("rods", "an empty list", "at least one rod")),
        };
        Ok(StructureMotion { structure: self, simulation, control, taken: Vec::new() })
    }

    /// A simulation at t = 0 over another number type `D`, without bisection of steps. `seed` returns the number for
    /// the path, value and quantity (unit and limits) of each number of the scene. With dual numbers it has the
    /// derivatives of the motion, also those of an equilibrium at the start.
    ///
    /// # Errors
    /// As [`simulation`](Self::simulation).
    pub fn simulation_over<D: Nestable>(
        &self,
        seed: impl FnMut(&str, f64, Quantity) -> D,
    ) -> Result<Simulation<D, Assembly<D>>, Error> {
        self.simulation_of(&self.scene.map_numbers(seed))
    }

    /// The assembly with its unknowns and frames at equilibrium under the loads, over another number type. `seed`
    /// returns the number of a path, value and quantity of the scene. With dual numbers it has the derivatives of the
    /// equilibrium.
    ///
    /// # Errors
    /// As [`equilibrium`](Self::equilibrium); [`Error::SingularEquilibrium`] where the tangent is singular, over dual
    /// numbers only.
    pub fn equilibrium_over<D: Nestable>(
        &self,
        seed: impl FnMut(&str, f64, Quantity) -> D,
    ) -> Result<AssemblyAtRest<D>, Error> {
        let AssemblyAtRest { assembly, frames, meshes, .. } = self.at_rest_over(seed)?;
        let (q, frames) = self.differentiated_equilibrium(&assembly, &frames)?;
        Ok(AssemblyAtRest { assembly, q, frames, meshes })
    }

    /// The simulation of a scene over any number type, at its start: rest, equilibrium or recorded start, with recorded
    /// ends as moving supports. Steps are not controlled. Errors: a scene without `[time]`, in space a scheme that does
    /// not integrate rotations of bodies, and those of the equilibrium or the recorded start.
    fn simulation_of<D: Nestable>(
        &self,
        scene: &StructureScene<D>,
    ) -> Result<Simulation<D, Assembly<D>>, Error> {
        let time = self.time()?;
        let AssemblyAtRest { assembly, mut q, mut frames, .. } = self.blueprint.build(scene)?;
        // Other schemes do not have the inertia forces of rotating bodies in their equations.
        if assembly.is_spatial() {
            check_scheme(time).map_err(|error| error.in_file(self.scene.path.as_deref()))?;
        }
        let mut start = None;
        match self.scene.initial.state {
            InitialState::Equilibrium => {
                (q, frames) = self.differentiated_equilibrium(&assembly, &frames)?;
            }
            InitialState::Recorded => {
                let found = self.recorded_start(scene, &assembly)?;
                (q, frames) = (found.q, found.frames);
                start = Some((found.change, found.interval));
            }
            _ => self.check_recorded_rest()?,
        }
        self.recorded.place(0.0, &mut q, &frames);
        let (n, assembly) = (q.len(), assembly.by_increments());
        let parameter = scene.time.as_ref().map_or(D::from(0.5), Time::parameter);
        let settings = StepperSettings {
            scheme: time.scheme,
            parameter,
            tolerance: time.tolerance,
            length: self.length(),
        };
        let (damping, derivatives) = (scene.loads.damping.clone(), self.derivatives);
        let mut simulation =
            Simulation::new(assembly, q, frames, 0..n, damping, settings, derivatives);
        if !self.recorded.is_empty() {
            simulation.move_supports(self.recorded.motion(), self.recorded.prescribed.clone());
        }
        if let Some((change, interval)) = start {
            simulation.set_velocity_from_change(&change, interval)?;
        }
        Ok(simulation)
    }

    /// Rejects a structure that starts at rest in its rest shape with a recorded end farther than [`AT_MARKERS`]
    /// lengths of the structure from its markers at t = 0.
    fn check_recorded_rest(&self) -> Result<(), Error> {
        let (rest, mut q) = (&self.at_rest.q, self.at_rest.q.clone());
        self.recorded.place(0.0, &mut q, &self.at_rest.frames);
        let away = rest.iter().zip(&q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let allowed = "initial.state = \"recorded\" or \"equilibrium\": recorded ends are away from their markers at rest";
        ensure(
            away <= AT_MARKERS * self.length(),
            "initial.state",
            format!("\"rest\" with markers {away:e} m away"),
            allowed,
        )
        .map_err(|error| error.in_file(self.scene.path.as_deref()))
    }

    /// Unknowns and frames of the equilibrium of an `assembly`, with the derivatives that its numbers carry. From the
    /// equilibrium in plain numbers, one Newton iteration over `D` is made per order of derivatives, none for `f64`.
    /// Frames at walls have the derivatives of those at `rest`. Errors: no equilibrium, [`Error::SingularEquilibrium`]
    /// for a singular tangent.
    fn differentiated_equilibrium<D: Nestable>(
        &self,
        assembly: &Assembly<D>,
        rest: &AssemblyFrames<D>,
    ) -> Result<(Vec<D>, AssemblyFrames<D>), Error> {
        let found = self.equilibrium_state()?;
        let mut q: Vec<D> = found.q.iter().map(|x| D::from(*x)).collect();
        let mut frames = found.frames.map(D::from);
        // Frames are arbitrary, except at walls, which turn with numbers of the scene.
        assembly.hold_walls(rest, &mut frames);
        let (mut change, mut tangent) = (q.clone(), assembly.zero_tangent());
        let mut factors = tangent.new_factors();
        // From the equilibrium on, every Newton iteration completes one more order of derivatives.
        for _ in 0..D::ORDER {
            assembly.tangent(&q, &frames, Derivatives::Hand, &mut change, &mut tangent);
            self.recorded.prescribed.uncouple(&mut tangent);
            self.recorded.prescribed.fill(&mut change, D::from(0.0));
            factors.factor(&tangent, 0..q.len()).map_err(|_| Error::SingularEquilibrium)?;
            factors.solve(&mut change);
            q.iter_mut().zip(&change).for_each(|(q, change)| *q -= *change);
        }
        if D::ORDER > 0 {
            // Rates of angles are spins only in frames at the present shape, with its derivatives.
            assembly.move_frames(&mut frames, &q);
        }
        Ok((q, frames))
    }
}

/// Distance of recorded ends from their markers at t = 0, over the length of the structure, up to which the rest shape
/// is the initial state.
const AT_MARKERS: f64 = 1e-6;

/// Rejects every scheme but Newmark-beta and generalized-alpha, with the key `time.scheme`. It is called for structures
/// in space.
fn check_scheme(time: &Time) -> Result<(), Error> {
    let allowed = "\"newmark-beta\" or \"generalised-alpha\", for a structure in space: only these integrate rotations of bodies";
    let integrates = matches!(time.scheme, Scheme::NewmarkBeta | Scheme::GeneralisedAlpha);
    ensure(integrates, "time.scheme", format!("\"{}\"", time.scheme.name()), allowed)
}

/// The result of a simulation of a structure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct StructureReport {
    /// `completed`, or the reason of the end.
    pub status: String,
    /// Number of unknowns that move.
    pub dof: usize,
    /// Counts of the numerical work.
    pub work: Work,
    /// Times, s.
    pub times: Vec<f64>,
    /// Energies at these times, J.
    pub energies: Vec<Energies>,
    /// Positions of the ends of all rods at these times, m, by the names of the rods.
    pub tips: BTreeMap<String, Vec<[f64; 3]>>,
    /// Reasons to doubt the result.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// The last state.
    #[serde(flatten)]
    pub shape: StructureShape,
}

impl StructureReport {
    /// A report of a structure without states: only the number of unknowns is set.
    pub fn new(structure: &Structure) -> Self {
        Self { dof: structure.dof(), ..Self::default() }
    }

    /// Adds time, energies and the end (`tip`) of every rod of the present state of `motion`. Its shape and work
    /// replace the previous ones.
    pub fn push(&mut self, motion: &StructureMotion<'_>) {
        self.push_energies(motion);
        self.shape = motion.shape();
        for (name, rod) in &self.shape.rods {
            self.tips.entry(name.clone()).or_default().push(rod.tip);
        }
    }

    /// Adds time and energies of the present state of `motion`, and replaces the work by that so far. Positions are
    /// unchanged.
    pub fn push_energies(&mut self, motion: &StructureMotion<'_>) {
        self.work = motion.simulation.work();
        self.times.push(motion.time());
        self.energies.push(motion.energies());
    }

    /// Largest absolute difference of the total energy from that of the first state, J, and the largest kinetic energy,
    /// J, over all added states; zeros without any.
    fn energy_change(&self) -> [f64; 2] {
        let first = self.energies.first().map_or(0.0, Energies::total);
        let change = self.energies.iter().map(|energies| (energies.total() - first).abs());
        let kinetic = self.energies.iter().map(|energies| energies.kinetic);
        [change.fold(0.0, f64::max), kinetic.fold(0.0, f64::max)]
    }

    /// Sets the status, `completed` or the text of the error in `outcome`. Replaces the warnings by that of the energy,
    /// if its change relative to the largest kinetic energy exceeds the limit for the scene of the first rod. There is
    /// none with damping of rods or joints, with recorded ends, and without kinetic energy.
    pub fn finish(&mut self, structure: &Structure, outcome: &Result<(), Error>) {
        let [change, kinetic] = self.energy_change();
        let warning =
            structure.parts().next().and_then(|scene| energy_warning(scene, change / kinetic));
        let is_conservative = structure.recorded.is_empty() && !structure.scene.has_damped_joints();
        let warning = warning.filter(|_| kinetic > 0.0 && is_conservative);
        self.warnings = warning.iter().map(|(code, words)| code.behind(words)).collect();
        self.status = match outcome {
            Ok(()) => "completed".into(),
            Err(error) => error.to_string(),
        };
    }

    /// The result as text for a terminal: status, ends of all rods at the last time, change of the energy, unknowns,
    /// steps and Newton iterations, and the warnings.
    pub fn summary(&self) -> Summary {
        let tone = Tone::of_result(self.status == "completed", !self.warnings.is_empty());
        let tips = self.shape.rods.iter().map(|(name, rod)| {
            let [x, y, z] = rod.tip;
            format!("{name} ({x:.6}, {y:.6}, {z:.6}) m")
        });
        let [change, kinetic] = self.energy_change();
        let time = self.times.last().copied().unwrap_or_default();
        Summary::new(&self.status, tone)
            .fact("Tips", format!("{} at t = {time} s", tips.collect::<Vec<_>>().join(", ")))
            .fact(
                "Energy",
                format!("changes by up to {change:.2e} J; largest kinetic energy {kinetic:.2e} J"),
            )
            .warnings(&self.warnings)
            .naming_warnings()
            .fact(
                "Numerics",
                format!(
                    "{} unknowns, {} steps, {} Newton iterations",
                    self.dof, self.work.steps, self.work.newton_iterations
                ),
            )
    }
}
