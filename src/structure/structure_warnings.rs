//! Warnings of structures: the recording that moves ends, motions of obstacles, units of the rods, large strains, and
//! deep contacts.
//!
//! Functions for single rods are called for each rod of a structure, as a scene of its own; messages about a rod begin
//! with its name. [`Structure`] has `motion_warnings` (codes and texts of the recording, of steps that resolve it
//! poorly, and of units), `unit_warnings`, `frictionless_warning` (equilibria and modes), and `equilibrium_warnings`
//! (texts of units, strains and contacts). [`ExtremesOfRods`] records the largest strain and overlap of each rod over
//! all states that `add` receives, and warns of strains beyond the linear range or a table, of deep contacts, and of a
//! coarse given step. Rods with a recorded end have no strains, as the distances of markers have tracking errors.

use crate::code::Code;
use crate::dynamics::StepError;
use crate::numerics::total_order;
use crate::problem::penetration::PenetrationRecord;
use crate::problem::strain::StrainRecord;
use crate::problem::{Problem, Purpose, ignored_friction, is_implausible_mass};
use crate::scene::Time;
use crate::scene::rod_contact::RodContactLaw;
use crate::structure::definition::Structure;
use crate::structure::equilibrium::StructureEquilibrium;
use crate::structure::plan::EndSupport;
use crate::structure::rod_surfaces::RodOverlapRecord;
use crate::structure::structure_shape::StructureShape;
use std::f64::consts::SQRT_2;

/// Largest strain and overlap of one rod.
#[derive(Clone, Debug)]
struct ExtremesOfRod {
    /// Name of the rod.
    name: String,
    /// Young's modulus, Pa, for the message.
    youngs_modulus: f64,
    /// The largest strain; without a gauge it records nothing.
    strain: StrainRecord,
    /// The largest overlap with an obstacle.
    penetration: PenetrationRecord,
    /// Estimate of the error of a given step; without effect if a recording moves the structure.
    step_error: StepError,
}

/// Largest strains and overlaps of the rods of a structure.
#[derive(Clone, Debug, Default)]
pub(super) struct ExtremesOfRods {
    rods: Vec<ExtremesOfRod>,
    /// The largest overlap of rods with each other; none without a structure.
    overlaps: Option<RodOverlapRecord>,
}

/// All records are equal, so that they do not distinguish reports.
impl PartialEq for ExtremesOfRods {
    /// True for any two records.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl ExtremesOfRods {
    /// Replaces the largest strain and overlap of each rod so far by that of the `shape` at a time, s, if this is
    /// larger; an equilibrium has no time. Rods that the shape lacks are left out.
    pub fn add(&mut self, shape: &StructureShape, time: Option<f64>) {
        if let Some(overlaps) = &mut self.overlaps {
            overlaps.add(|name| shape.rods.get(name).map_or(&[][..], |rod| &rod.nodes), time);
        }
        for own in &mut self.rods {
            if let Some(rod) = shape.rods.get(&own.name) {
                own.strain.add(|i| rod.nodes[i], time.unwrap_or(0.0));
                own.penetration.add(|i| rod.nodes[i], time);
                if let Some(time) = time {
                    own.step_error.add(time, |i| rod.nodes[i]);
                }
            }
        }
    }

    /// Warnings, with their codes, of each rod whose largest strain is beyond the linear range of the material, or
    /// whose curvature is beyond its table. They have the time of the strain if `is_motion`. The last one is that of a
    /// coarse step, of the rod with the largest error beyond its limit.
    pub fn warnings(&self, is_motion: bool) -> Vec<(Code, String)> {
        let of_rod = |own: &ExtremesOfRod| {
            let mut largest = own.strain.largest().unwrap_or_default();
            largest.time = largest.time.filter(|_| is_motion);
            let strained = largest.warnings(own.youngs_modulus).into_iter();
            let warnings = strained.chain(own.penetration.warning());
            let named = warnings.map(|(code, words)| (code, format!("rods.{}: {words}", own.name)));
            named.collect::<Vec<_>>()
        };
        let excess = |own: &&ExtremesOfRod| total_order(own.step_error.excess());
        let coarse = self.rods.iter().max_by_key(excess).and_then(|own| {
            let (code, words) = own.step_error.warning()?;
            Some((code, format!("rods.{}: {words}", own.name)))
        });
        let overlap = self.overlaps.as_ref().and_then(RodOverlapRecord::warning);
        self.rods.iter().flat_map(of_rod).chain(overlap).chain(coarse).collect()
    }
}

impl Structure {
    /// Warnings, with codes, of a simulation: defects of the recording that moves ends, steps that resolve it or the
    /// motions of obstacles poorly, and implausible units of each rod.
    pub(super) fn motion_warnings(&self) -> Vec<(Code, String)> {
        let mut warnings = Vec::new();
        if let Some(recording) = &self.scene.recording {
            let supports = &self.scene.supports;
            warnings.extend(recording.recording_warnings(supports));
            let step = self.scene.time.as_ref().map(Time::step_size);
            warnings.extend(step.and_then(|step| recording.step_warning(supports, step)));
        }
        if let (Some(time), Some(part)) = (&self.scene.time, self.parts().next()) {
            warnings.extend(part.motion_step_warnings(time.step_size()));
        }
        warnings.extend(self.unit_warnings());
        warnings
    }

    /// Warnings, with their code, one for each rod whose numbers are implausible in SI units (as its first such message
    /// states), with its name in front, and one for each body that is too heavy for the rods. Rods whose problem cannot
    /// be built are left out.
    pub(super) fn unit_warnings(&self) -> Vec<(Code, String)> {
        let of_rod = |rod: usize| {
            let notes = self.problem_of_rod(rod)?.plausibility_notes(Purpose::Motion);
            let (code, words) =
                notes.into_iter().find(|(code, _)| *code == Code::ImplausibleUnits)?;
            Some((code, format!("rods.{}: {words}", self.scene.rods[rod].name)))
        };
        let rods: f64 = self
            .parts()
            .zip(&self.at_rest.meshes)
            .map(|(part, mesh)| {
                let (section, material) = part.at(0.5);
                material.density * section.moments().area * mesh.length
            })
            .sum();
        let heavy = self.scene.bodies.iter().filter(|body| is_implausible_mass(body.mass, rods));
        let of_body = heavy.map(|body| {
            let words = format!(
                "bodies.{}.mass of {} kg (in g?) is {:.0} times the mass of all rods: probably not in kg",
                body.name,
                body.mass,
                body.mass / rods
            );
            (Code::ImplausibleUnits, words)
        });
        (0..self.scene.rods.len()).filter_map(of_rod).chain(of_body).collect()
    }

    /// Records of the strains and overlaps of all rods, still without a state. Rods with a recorded end, and those
    /// whose problem cannot be built, have no strains.
    pub(super) fn extremes(&self) -> ExtremesOfRods {
        let of_rod = |(rod, ends): (usize, &[EndSupport; 2])| {
            let is_recorded = |end: &EndSupport| matches!(end, EndSupport::Recorded(_));
            let problem =
                if ends.iter().any(is_recorded) { None } else { self.problem_of_rod(rod) };
            let part = &self.blueprint.parts[rod];
            let mesh = &self.at_rest.meshes[rod];
            let step_error = match self.recorded.is_empty() {
                true => StepError::new(part, mesh.nodes.len(), mesh.length),
                false => StepError::default(),
            };
            ExtremesOfRod {
                name: self.scene.rods[rod].name.clone(),
                youngs_modulus: part.material.youngs_modulus,
                strain: problem.map_or_else(StrainRecord::default, |own| StrainRecord::new(&own)),
                penetration: PenetrationRecord::new(part),
                step_error,
            }
        };
        let ends = self.blueprint.plan.ends.iter().enumerate();
        let overlaps = Some(self.rod_overlaps());
        ExtremesOfRods { rods: ends.map(of_rod).collect(), overlaps }
    }

    /// The warning of an equilibrium or modes, with its code, that the friction of a contact is left out; `None`
    /// without friction.
    pub(super) fn frictionless_warning(&self) -> Option<(Code, String)> {
        let of_obstacle = ignored_friction(&self.scene.contacts);
        let of_rods = self.scene.rod_contacts.iter().position(RodContactLaw::has_friction);
        let of_rods = of_rods.map(|rough| {
            format!(
                "the friction of rod_contacts[{rough}] is ignored in equilibria and modes: the rods slide freely along \
                 each other. Simulate the motion with [time] for friction"
            )
        });
        of_obstacle.or(of_rods).map(|words| (Code::Frictionless, words))
    }

    /// Warnings of an equilibrium of this structure, each with its code in brackets at the end: those of its mesh that
    /// it already has, implausible units, large strains and deep contacts of its rods, and contacts whose friction is
    /// left out.
    pub fn equilibrium_warnings(&self, found: &StructureEquilibrium) -> Vec<String> {
        let mut extremes = self.extremes();
        extremes.add(&found.shape, None);
        let warnings = self.unit_warnings().into_iter().chain(extremes.warnings(false));
        let warnings = warnings.chain(self.frictionless_warning());
        let warnings = warnings.map(|(code, words)| code.behind(words));
        found.warnings.iter().cloned().chain(warnings).collect()
    }

    /// The problem of one rod alone, in the plane of the structure, in which its gravity then is with the same size, or
    /// in space. `None` where it cannot be built.
    fn problem_of_rod(&self, rod: usize) -> Option<Problem> {
        let mut scene = self.blueprint.parts[rod].clone();
        // Obstacles are at places of the structure, not of the rod alone.
        scene.contacts.clear();
        if let Some([x, y]) = self.plane_axes() {
            // A straight rod has the plane of its gravity, whose direction has no other effect here. Its size stays.
            let size = scene.loads.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
            let size = if size > 0.0 { size } else { 1.0 };
            let along = [0, 1, 2].map(|c| (x[c] + SQRT_2 * y[c]) / 3.0_f64.sqrt());
            scene.loads.gravity = along.map(|part| size * part);
        }
        scene.build().ok()
    }
}
