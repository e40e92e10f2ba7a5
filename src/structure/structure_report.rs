//! The report of a simulation of a structure: energies, ends of the rods, status and warnings.
//!
//! [`StructureReport`] collects times, s, energies, J, contact forces, N, and ends of the rods, m. `push` adds a state,
//! `push_energies` its time and energies only; both record the largest strain of each rod. `finish` sets the status and
//! the warnings: defects of the recording that moves ends, steps that resolve it poorly, implausible units, large
//! strains, a change of the energy, and stretching of mean states. The change of the energy is compared with the
//! largest kinetic energy, only without damping of rods and joints and without recorded ends. `summary` is the text for
//! a terminal.

use crate::dynamics::{ContactForces, MeanStretch, Work, energy_warning, mean_stretch_warning};
use crate::error::Error;
use crate::rod::Energies;
use crate::scene::rod_contact::RodContactLaw;
use crate::structure::definition::Structure;
use crate::structure::structure_motion::StructureMotion;
use crate::structure::structure_shape::StructureShape;
use crate::structure::structure_warnings::ExtremesOfRods;
use crate::summary::{Summary, Tone};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

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
    /// The forces of all obstacles on the rods at these times; empty without contacts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contact_forces: Vec<ContactForces>,
    /// Reasons to doubt the result.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// The last state.
    #[serde(flatten)]
    pub shape: StructureShape,
    /// Largest strains and overlaps so far.
    #[serde(skip)]
    extremes: ExtremesOfRods,
    /// Stretching of each rod in the means of successive states; empty for schemes without such means.
    #[serde(skip)]
    mean_stretches: Vec<MeanStretch>,
    /// The largest energy of this stretching so far, J.
    #[serde(skip)]
    largest_mean_stretch: f64,
}

impl StructureReport {
    /// A report of a structure without states: only the number of unknowns that move is set, and no strain is recorded.
    pub fn new(structure: &Structure) -> Self {
        Self {
            dof: structure.dof(),
            extremes: structure.extremes(),
            mean_stretches: structure.parts().filter_map(MeanStretch::new).collect(),
            ..Self::default()
        }
    }

    /// Adds time, energies, contact forces and the end (`tip`) of every rod of the present state of `motion`, and
    /// compares its strains with the largest ones. Its shape and work replace the previous ones.
    pub fn push(&mut self, motion: &StructureMotion<'_>) {
        let shape = motion.shape();
        self.push_state(motion, &shape);
        for (name, rod) in &shape.rods {
            self.tips.entry(name.clone()).or_default().push(rod.tip);
        }
        if !motion.structure().scene().contacts.is_empty() {
            let (time, forces) = (motion.time(), motion.contact_forces());
            self.contact_forces.push(ContactForces { time, forces });
        }
        self.shape = shape;
    }

    /// Adds time and energies of the present state of `motion`, compares its strains with the largest ones, and
    /// replaces the work by that so far. Ends and shape are unchanged.
    pub fn push_energies(&mut self, motion: &StructureMotion<'_>) {
        self.push_state(motion, &motion.shape());
    }

    /// Adds time and energies of the present state of `motion`, whose positions are `shape`, and compares its strains
    /// with the largest ones so far. The work is replaced.
    fn push_state(&mut self, motion: &StructureMotion<'_>, shape: &StructureShape) {
        self.work = motion.simulation().work();
        self.times.push(motion.time());
        self.energies.push(motion.energies());
        self.extremes.add(shape, Some(motion.time()));
        let rods = motion.rod_names().filter_map(|name| shape.rods.get(name));
        let stretches = self.mean_stretches.iter_mut().zip(rods);
        let stretch = stretches.map(|(own, rod)| own.next(rod.nodes.iter().copied())).sum();
        self.largest_mean_stretch = self.largest_mean_stretch.max(stretch);
    }

    /// Largest absolute difference of the total energy from that of the first state, J, and the largest kinetic energy,
    /// J, over all added states; zeros without any.
    fn energy_change(&self) -> [f64; 2] {
        let first = self.energies.first().map_or(0.0, Energies::total);
        let change = self.energies.iter().map(|energies| (energies.total() - first).abs());
        let kinetic = self.energies.iter().map(|energies| energies.kinetic);
        [change.fold(0.0, f64::max), kinetic.fold(0.0, f64::max)]
    }

    /// Sets the status, `completed` or the text of the error in `outcome`, and replaces the warnings: those of the
    /// scene first, then those of large strains, that of the energy, and that of stretching of mean states. The one of
    /// the energy is given if the change of the energy over the largest kinetic energy exceeds the limit for the scene
    /// of the first rod. There is none with damping of rods, joints or contacts, with recorded ends, and without
    /// kinetic energy.
    pub fn finish(&mut self, structure: &Structure, outcome: &Result<(), Error>) {
        let [change, kinetic] = self.energy_change();
        let energy =
            structure.parts().next().and_then(|scene| energy_warning(scene, change / kinetic));
        let is_conservative = structure.recorded.is_empty()
            && !structure.scene.has_damped_joints()
            && !structure.scene.rod_contacts.iter().any(RodContactLaw::is_dissipative);
        let energy = energy.filter(|_| kinetic > 0.0 && is_conservative);
        let stretched = structure
            .parts()
            .next()
            .and_then(|scene| mean_stretch_warning(scene, self.largest_mean_stretch, kinetic));
        let energy = energy.into_iter().chain(stretched);
        let warnings = structure.motion_warnings().into_iter().chain(self.extremes.warnings(true));
        self.warnings = warnings.chain(energy).map(|(code, words)| code.behind(&words)).collect();
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
