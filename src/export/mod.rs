//! Files of a rod for other simulators, from a problem.
//!
//! Input: a [`Problem`] of one rod and an [`ExportFormat`]. Output: an [`Export`] with the text of the file, and notes
//! on the parts of the scene that the file does not have or has in another form. `links` computes a chain of rigid
//! links with elastic joints (stiffnesses, masses, frames at rest). The writers use its numbers in SI units:
//!
//! - `mujoco` for links with hinges,
//! - `pyelastica` for a script with a Cosserat rod,
//! - `usd` for a curve with widths and attributes,
//! - `table` for a CSV of stiffnesses, mass per length and radius.
//!
//! Errors: a roller, a recorded end, a prescribed motion of a support, or point masses outside the rod.
//! [`Problem::export_motion`] (`vtk`) returns up to a given number of frames of a simulated motion (at least the first
//! and the last), with any supports, as files for ParaView, and their list.

mod links;
mod mujoco;
mod pyelastica;
mod table;
mod usd;
mod vtk;

pub use vtk::NamedText;

use crate::dynamics::Trajectory;
use crate::error::Error;
use crate::export::links::RodChain;
use crate::problem::Problem;
use crate::scene::{Initial, Scene, StretchLaw, Support};
use std::str::FromStr;

/// Format of an exported rod.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ExportFormat {
    /// MJCF of MuJoCo: rigid links with hinges that have springs.
    Mujoco,
    /// Python script for PyElastica: a Cosserat rod.
    Pyelastica,
    /// Text of Universal Scene Description: a curve with widths and custom attributes.
    Usd,
    /// CSV of stiffnesses and mass per length along the rod.
    Table,
}

impl FromStr for ExportFormat {
    type Err = Error;

    /// The format of a name: `mujoco`, `pyelastica`, `usd` or `csv`. Other names are an error with all of them.
    fn from_str(name: &str) -> Result<Self, Error> {
        match name {
            "mujoco" => Ok(Self::Mujoco),
            "pyelastica" => Ok(Self::Pyelastica),
            "usd" => Ok(Self::Usd),
            "csv" => Ok(Self::Table),
            _ => Err(Error::invalid("to", name, "mujoco, pyelastica, usd or csv")),
        }
    }
}

/// The text of an exported file, and its notes.
#[derive(Clone, Debug)]
pub struct Export {
    /// The whole file.
    pub text: String,
    /// What the file does not have, or has in another form; also comments in the file, except in a CSV.
    pub notes: Vec<String>,
}

impl Problem {
    /// The rod of the problem, with supports, gravity and damping as far as the format has them, as a file for another
    /// program. The links are the edges of the mesh.
    ///
    /// ```
    /// use rodfit::{Scene, export::ExportFormat};
    ///
    /// let export = Scene::load("data/cantilever.toml")?.problem()?.export(ExportFormat::Mujoco)?;
    /// assert!(export.text.starts_with("<mujoco"));
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Invalid`] for recorded or moved ends, a roller, or point masses outside the rod.
    pub fn export(&self, target: ExportFormat) -> Result<Export, Error> {
        check_supports(self.scene())?;
        let chain = RodChain::of(self)?;
        let mut notes = omitted(self.scene(), target);
        let text = match target {
            ExportFormat::Mujoco => mujoco::model(&chain, &mut notes),
            ExportFormat::Pyelastica => pyelastica::script(&chain, &mut notes),
            ExportFormat::Usd => usd::stage(&chain, &notes),
            ExportFormat::Table => table::csv(&chain),
        };
        Ok(Export { text, notes })
    }
}

impl Problem {
    /// Up to `frames` frames of a motion of this problem as files for ParaView (`rod_0000.vtp` ..), and `rod.pvd`,
    /// which lists them with their times, s. The first and the last state are always frames; the others are evenly
    /// spaced steps. Frames have positions, m, velocities, m/s, and radii, m, of the nodes.
    ///
    /// # Errors
    /// Those of point masses outside the rod. [`Error::Invalid`] for a motion without times, on another mesh, or of
    /// which not all nodes were tracked.
    pub fn export_motion(
        &self,
        motion: &Trajectory,
        frames: usize,
    ) -> Result<Vec<NamedText>, Error> {
        let (nodes, tracked) = (self.mesh.nodes.len(), motion.record().tracked().len());
        if motion.times().is_empty() || motion.nodes() != nodes || tracked != nodes {
            let found =
                format!("{} times of {tracked} of {} nodes", motion.times().len(), motion.nodes());
            let allowed = format!("a motion of all {nodes} nodes with at least one time");
            return Err(Error::invalid("motion", found, allowed));
        }
        let radii: Vec<f64> = RodChain::of(self)?.links.iter().map(|link| link.radius).collect();
        Ok(vtk::animation(motion, &radii, frames))
    }
}

/// [`Error::Invalid`] for supports that no exported file can have: a roller or a recorded end, or a prescribed motion
/// in `supports.motion`.
fn check_supports(scene: &Scene) -> Result<(), Error> {
    let allowed = "free, pinned or clamped ends, for an export";
    for (key, support) in
        [("supports.start", scene.supports.start), ("supports.end", scene.supports.end)]
    {
        if matches!(support, Support::Roller | Support::Recorded) {
            return Err(Error::invalid(key, format!("{support:?}").to_lowercase(), allowed));
        }
    }
    match scene.supports.motion.is_empty() {
        true => Ok(()),
        false => Err(Error::invalid("supports.motion", "a prescribed motion", allowed)),
    }
}

/// Notes, one for each part of a scene that is present but that a file of the format `target` does not have.
fn omitted(scene: &Scene, target: ExportFormat) -> Vec<String> {
    let damping = &scene.loads.damping;
    let supports = &scene.supports;
    let is_usd = target == ExportFormat::Usd;
    let is_simulated = matches!(target, ExportFormat::Mujoco | ExportFormat::Pyelastica);
    let has_mass_damping = is_usd || target == ExportFormat::Pyelastica;
    let is_viscous = [damping.stiffness, damping.bending, damping.twisting, damping.stretching]
        .map(|time| time != 0.0);
    // The time of bending, which a curve of USD has, includes that of all strains.
    let [all, _, twisting, stretching] = is_viscous;
    let bending_law = &scene.material.bending_law;
    let has_law = scene.material.stretch_law != StretchLaw::default() || bending_law.is_some();
    let has_start = scene.initial != Initial::default();
    let is_compliant = [supports.start_compliance, supports.end_compliance]
        .iter()
        .any(|compliance| compliance.rotation != 0.0 || compliance.axial != 0.0);
    let parts = [
        (!scene.loads.point.is_empty() || !scene.loads.line.is_empty(), "forces of [loads]"),
        (scene.loads.drag.is_some(), "drag of a fluid"),
        (!damping.maxwell.is_empty(), "Maxwell branches"),
        (damping.power_law.is_some(), "relaxation by a power law"),
        (damping.friction.is_some() && target != ExportFormat::Mujoco, "internal friction"),
        (damping.mass != 0.0 && !has_mass_damping, "mass-proportional damping"),
        (
            is_viscous.contains(&true) && target != ExportFormat::Mujoco && !is_usd,
            "damping of strains",
        ),
        (is_usd && (all || twisting || stretching), "damping of twist and stretching"),
        (!scene.actuation.is_empty(), "actuators"),
        (!scene.energies.is_empty(), "user-defined energies"),
        (!scene.contacts.is_empty(), "contacts"),
        (!scene.rod.mass.is_empty() && !is_simulated, "point masses"),
        (is_compliant, "compliance of clamps"),
        (has_start, "the initial state; the motion starts at rest in the rest shape"),
        (has_law, "nonlinear laws of the material"),
    ];
    let absent = parts.into_iter().filter(|(is_there, _)| *is_there);
    absent.map(|(_, part)| format!("not in this file: {part}")).collect()
}
