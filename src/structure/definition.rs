//! The definition of a structure: its scene, its assembly at rest and its scales.
//!
//! [`Structure::new`] validates a scene of rods, bodies and joints and builds its assembly at rest, without the
//! deformation by loads. An invalid scene is an error with file and key. `at_rest_over` returns the assembly over
//! another number type, such as dual numbers, for derivatives. `with_derivatives` selects hand-derived or dual-number
//! derivatives for simulations only.
//!
//! Scales for thresholds, with L the sum of the lengths of all rods, m: `bending_frequency_squared` is the smallest `E
//! I/(rho A L^4)` of all rods, 1/s^2. Squared frequencies up to `rounding_frequency_squared` may be rounding errors. A
//! stiffness up to `negligible_stiffness`, N/m (N m for angles) per unknown, counts as zero. Equilibria, modes and
//! simulations of the structure are methods in other modules.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::problem::penetration::check_start;
use crate::rod::Rod;
use crate::scene::number::Quantity;
use crate::scene::{InitialState, Scene, StructureScene};
use crate::structure::blueprint::{AssemblyAtRest, Blueprint};
use crate::structure::marker_place::RelaxedFrames;
use crate::structure::recorded_ends::RecordedEnds;
use crate::structure::rod_surfaces::RodOverlapRecord;
use std::sync::{Arc, OnceLock};

/// A structure: its scene and its assembly.
///
/// ```
/// use rodfit::{Structure, StructureScene};
/// // A strip of two pieces, welded end to end: the frequency is that of one strip of 0.5 m.
/// let text = r#"
///     [[rods]]
///     name = "a"
///     segments = 20
///     shape = { kind = "straight", length = 0.25, direction = [1, 0, 0] }
///     section = { kind = "circle", radius = 1e-3 }
///     material = "steel"
///     [[rods]]
///     name = "b"
///     segments = 20
///     shape = { kind = "straight", length = 0.25, direction = [1, 0, 0] }
///     section = { kind = "circle", radius = 1e-3 }
///     material = "steel"
///     [[materials]]
///     name = "steel"
///     density = 7800
///     youngs_modulus = 2e11
///     [[joints]]
///     kind = "rigid"
///     connects = [{ rod = "a", at = "end" }, { rod = "b", at = "start" }]
///     [[supports]]
///     of = { rod = "a", at = "start" }
///     kind = "clamped"
/// "#;
/// let structure = Structure::new(StructureScene::from_toml(text, ".")?)?;
/// let first = structure.modes(1, true)?.modes[0].frequency_rad_s;
/// // 1.8751^2 sqrt(E I/(rho A L^4)), with I/A = r^2/4.
/// let exact = 1.875_104_f64.powi(2) * (2e11_f64 / 7800.0).sqrt() * 0.5e-3 / 0.25;
/// assert!((first / exact - 1.0).abs() < 5e-4);
/// # Ok::<(), rodfit::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Structure {
    pub(super) scene: StructureScene,
    pub(super) blueprint: Blueprint,
    pub(super) at_rest: AssemblyAtRest<f64>,
    pub(super) recorded: RecordedEnds,
    /// Relaxed shapes of the first two frames of the recording, once they are computed.
    pub(super) start: Arc<OnceLock<RelaxedFrames>>,
    pub(super) derivatives: Derivatives,
}

impl Structure {
    /// The structure of a scene, which is validated; model (planar or spatial) and assembly at rest are built.
    /// Derivatives of energies are hand-derived ones. A recording that is given as a track is examined for defects.
    ///
    /// # Errors
    /// [`Error::Invalid`] with file, key, and the found and the allowed value.
    pub fn new(mut scene: StructureScene) -> Result<Self, Error> {
        scene.validate()?;
        let file = scene.path.clone();
        let in_file = |error: Error| error.in_file(file.as_deref());
        if let Some(recording) = &mut scene.recording {
            recording.examine(&scene.supports).map_err(in_file)?;
        }
        let blueprint = Blueprint::new(&scene).map_err(in_file)?;
        let at_rest = blueprint.build(&scene).map_err(in_file)?;
        let Blueprint { plan, models, .. } = &blueprint;
        let recorded = RecordedEnds::new(&scene, plan, models, &at_rest).map_err(in_file)?;
        let (derivatives, start) = (Derivatives::Hand, Arc::default());
        let structure = Self { scene, blueprint, at_rest, recorded, start, derivatives };
        structure.check_overlaps().map_err(in_file)?;
        Ok(structure)
    }

    /// Rejects a structure whose rods overlap each other or an obstacle ([`check_start`]) at rest, but for a recorded
    /// start.
    fn check_overlaps(&self) -> Result<(), Error> {
        let StructureScene { contacts, rod_contacts, initial, .. } = &self.scene;
        // A recorded start is at another place than the shapes of the scene.
        if contacts.is_empty() && rod_contacts.is_empty() || initial.state == InitialState::Recorded
        {
            return Ok(());
        }
        let shape = self.shape_at(&self.at_rest.q, &self.at_rest.frames);
        let mut record = self.rod_overlaps();
        record.add(|name| &shape.rods[name].nodes, None);
        record.check()?;
        self.scene.rods.iter().zip(self.parts()).try_for_each(|(rod, part)| {
            let nodes = &shape.rods[&rod.name].nodes;
            check_start(part, |i| nodes[i], &format!("rods.{}", rod.name))
        })
    }

    /// A record of overlaps of the rods with each other, still without a state.
    pub(super) fn rod_overlaps(&self) -> RodOverlapRecord {
        let names = self.scene.rods.iter().map(|rod| rod.name.clone()).collect();
        RodOverlapRecord::new(self.at_rest.assembly.contacts_on_nodes(), names)
    }

    /// The structure whose simulations compute gradients and Hessians of energies by hand-derived formulas or dual
    /// numbers. Equilibria and modes always take the hand-derived ones.
    pub fn with_derivatives(self, derivatives: Derivatives) -> Self {
        Self { derivatives, ..self }
    }

    /// Rejects a `[time]` that ends more than a step after the recording that moves the ends, where their motion is
    /// unknown. Accepted without `[time]`, without a recording and if no end follows it. Fits simulate up to the last
    /// sample only, and need no such check.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the key `time.end`.
    pub fn check_end(&self) -> Result<(), Error> {
        let (Some(recording), Some(time)) = (&self.scene.recording, &self.scene.time) else {
            return Ok(());
        };
        let checked = recording.check_end(&self.scene.supports, time);
        checked.map_err(|error| error.in_file(self.scene.path.as_deref()))
    }

    /// The validated scene, in plain numbers.
    pub fn scene(&self) -> &StructureScene {
        &self.scene
    }

    /// The assembly with unknowns, frames and meshes at rest, in plain numbers, without the deformation by loads.
    pub fn at_rest(&self) -> &AssemblyAtRest<f64> {
        &self.at_rest
    }

    /// The assembly at rest over another number type, with the model and joints of this structure. `seed` returns the
    /// number of type `D` for the path, value and quantity (unit and limits) of each number of the scene.
    ///
    /// # Errors
    /// Those of the assembly as in [`new`](Self::new): a joint without inertia, loads outside of rods. The numbers are
    /// not validated again.
    pub fn at_rest_over<D: RodScalar>(
        &self,
        seed: impl FnMut(&str, f64, Quantity) -> D,
    ) -> Result<AssemblyAtRest<D>, Error> {
        self.blueprint.build(&self.scene.map_numbers(seed))
    }

    /// Sum of the lengths of all rods at rest, m; the scale of lengths of the structure.
    pub fn length(&self) -> f64 {
        self.at_rest.meshes.iter().map(|mesh| mesh.length).sum()
    }

    /// Number of edges of all rods together.
    pub fn segments(&self) -> usize {
        self.at_rest.meshes.iter().map(|mesh| mesh.nodes.len() - 1).sum()
    }

    /// Number of unknowns that move: all coordinates of rods, bodies and springs but those of carried, fixed and
    /// recorded nodes and of gaps.
    pub fn dof(&self) -> usize {
        self.at_rest.q.len()
            - self.at_rest.assembly.unknowns_without_effect().count()
            - self.recorded.prescribed.iter().count()
    }

    /// The scenes of the single rods, in the order of `[[rods]]`, in plain numbers.
    pub(super) fn parts(&self) -> impl Iterator<Item = &Scene> {
        self.blueprint.parts.iter()
    }

    /// The square of the frequency scale of bending, 1/s^2: the smallest `E I/(rho A L^4)` of all rods. Material, area
    /// and smaller second moment are those halfway along each rod; L is the sum of all lengths.
    pub(super) fn bending_frequency_squared(&self) -> f64 {
        let length = self.length();
        let squared = self.parts().map(|scene| {
            let (section, material) = scene.at(0.5);
            let section = section.moments();
            let [i1, i2] = section.second_moments;
            let line = material.density * section.area * length.powi(4);
            material.youngs_modulus * i1.min(i2) / line
        });
        squared.fold(f64::INFINITY, f64::min)
    }

    /// Rounding errors of the squared frequency of a motion without resistance, 1/s^2, due to the axial stiffness of
    /// the edges: `10 eps n^2 (E/rho)/L^2`. Here `n` is the number of nodes of all rods, `E/rho` the largest of all
    /// rods halfway along them, and L the sum of all lengths.
    pub(super) fn rounding_frequency_squared(&self) -> f64 {
        let nodes: usize = self.at_rest.meshes.iter().map(|mesh| mesh.nodes.len()).sum();
        let speeds = self.parts().map(|scene| {
            let (_, material) = scene.at(0.5);
            material.youngs_modulus / material.density
        });
        let speed = speeds.fold(0.0, f64::max);
        10.0 * f64::EPSILON * (nodes as f64).powi(2) * speed / self.length().powi(2)
    }

    /// Stiffness of every unknown that counts as none: N/m, and N m for angles of edges in space. It is `f` times the
    /// mass of the unknown times the smallest `E I/(rho A L^4)` of all rods; `f` is [`NEGLIGIBLE`] plus rounding errors
    /// `10 eps n^4` for `n` nodes in all. For angles of edges it is `f G J/L` over the number of edges of the rod, with
    /// the length L of all rods. It is zero for unknowns without effect (carried, fixed, gaps) and those of recorded
    /// ends.
    pub(super) fn negligible_stiffness(&self) -> Vec<f64> {
        let nodes: usize = self.at_rest.meshes.iter().map(|mesh| mesh.nodes.len()).sum();
        // Rounding errors grow with the condition of bending, the fourth power of the number of
        // nodes.
        let noise = 10.0 * f64::EPSILON * (nodes as f64).powi(4);
        let squared = self.bending_frequency_squared() * (NEGLIGIBLE + noise);
        let assembly = &self.at_rest.assembly;
        let mut stiffness: Vec<f64> = assembly.mass().iter().map(|mass| mass * squared).collect();
        assembly.unknowns_without_effect().for_each(|i| stiffness[i] = 0.0);
        self.recorded.prescribed.fill(&mut stiffness, 0.0);
        if assembly.is_spatial() {
            // Angles of edges: the same part of the torsional stiffness of the whole, divided among the edges.
            for (range, scene) in assembly.rod_ranges().into_iter().zip(self.parts()) {
                let (section, material) = scene.at(0.5);
                let torsion = material.shear_modulus() * section.moments().torsion_constant;
                let edges = range.len() / 4;
                let own = torsion / self.length() / edges as f64 * (NEGLIGIBLE + noise);
                let angles = range.skip(3).step_by(4).filter(|i| stiffness[*i] > 0.0);
                angles.collect::<Vec<_>>().into_iter().for_each(|i| stiffness[i] = own);
            }
        }
        stiffness
    }
}

/// Negligible part of the stiffness of bending of the whole structure.
pub(super) const NEGLIGIBLE: f64 = 1e-9;
