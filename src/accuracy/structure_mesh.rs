//! Estimated error of the meshes of a structure, for its equilibrium and its modes.
//!
//! [`Structure::add_mesh_error`] and [`Structure::add_mesh_errors`] repeat the calculation with other meshes of all
//! rods (`mesh_comparison`). They add the estimated errors to the result, and the warning `coarse-mesh` in front of its
//! warnings if one is above the limit. Compared points of an equilibrium are the nodes of all rods that are not behind
//! walls. A mode is compared with the mode of the same number. Nothing is added where no other mesh has a solution.

use crate::accuracy::mesh_comparison::{
    ComparedPoints, FrequencyErrors, MeshComparison, PositionError, other_meshes,
};
use crate::code::Code;
use crate::scene::Point;
use crate::structure::{Structure, StructureEquilibrium, StructureModes};

/// Order of the errors of structures.
const ORDER: f64 = 2.0;
/// Smallest number of edges of a rod.
const FEWEST_EDGES: f64 = 6.0;

impl Structure {
    /// Adds the estimated error of the meshes to an equilibrium of this structure, from that on other meshes, and the
    /// warning `coarse-mesh` if it is above 2 % of the largest displacement or 1 % of the length of all rods. Without
    /// effect if there is no equilibrium on other meshes.
    pub fn add_mesh_error(&self, found: &mut StructureEquilibrium) {
        let compared = self.on_other_meshes(|comparison, other| {
            let rest = other.equilibrium().ok()?;
            let [given, other] = compared_points([self, other], [found, &rest])?;
            let error = PositionError::new(comparison, &given, &other, self.length());
            Some((comparison, error))
        });
        let Some((comparison, error)) = compared else { return };
        found.mesh_error = Some(error.report(self.segments()));
        if error.excess() > 1.0 {
            let sufficient = comparison.sufficient(error.excess());
            let sufficient = error.is_converging().then_some(sufficient);
            let words = self.coarse_mesh_warning(|mesh| error.finding(mesh), sufficient);
            found.warnings.insert(0, Code::CoarseMesh.behind(words));
        }
    }

    /// Adds the estimated errors of the meshes to modes of this structure, of which `count` were requested, about the
    /// equilibrium or with `rest` about the rest shape. It also adds the warning `coarse-mesh` if a frequency has an
    /// error above 2 %, or if there are fewer modes. Without effect if there are no modes on other meshes.
    pub fn add_mesh_errors(&self, count: usize, rest: bool, found: &mut StructureModes) {
        let compared = self.on_other_meshes(|comparison, other| {
            let others = other.modes(count, rest).ok()?.modes;
            let pairs = found.modes.iter().zip(&others);
            let errors = pairs.map(|(given, other)| {
                comparison.frequency_error(given.frequency_rad_s, other.frequency_rad_s)
            });
            let missing = others.len().saturating_sub(found.modes.len());
            let half_waves = if missing > 0 { others.len() } else { 0 };
            let errors = FrequencyErrors { errors: errors.collect(), missing, half_waves };
            Some((comparison, errors))
        });
        let Some((comparison, errors)) = compared else { return };
        for (mode, error) in found.modes.iter_mut().zip(&errors.errors) {
            mode.mesh_error = *error;
        }
        if errors.excess(count) > 1.0 {
            let sufficient = Some(errors.sufficient(count, comparison));
            let words = self.coarse_mesh_warning(|mesh| errors.finding(count, mesh), sufficient);
            found.warnings.insert(0, Code::CoarseMesh.behind(words));
        }
    }

    /// The first result of `calculate` that is one, for this structure with other meshes of all rods.
    fn on_other_meshes<T>(
        &self,
        calculate: impl Fn(MeshComparison, &Structure) -> Option<T>,
    ) -> Option<T> {
        let segments = self.segments();
        let finest = self.at_rest().meshes.iter().map(|mesh| mesh.arcs.len()).max();
        other_meshes(finest.unwrap_or(segments), ORDER).find_map(|ratio| {
            let mut scene = self.scene().clone();
            for rod in &mut scene.rods {
                let edges = rod.remeshed.unwrap_or(rod.segments) as f64;
                rod.remeshed = Some((ratio * edges).round().max(FEWEST_EDGES) as usize);
            }
            let other = Structure::new(scene).ok()?;
            let ratio = other.segments() as f64 / segments as f64;
            calculate(MeshComparison { segments, ratio, order: ORDER }, &other)
        })
    }

    /// The warning of coarse meshes: the finding about them, and a factor on the numbers of edges that suffices.
    fn coarse_mesh_warning(
        &self,
        finding: impl Fn(&str) -> String,
        sufficient: Option<usize>,
    ) -> String {
        let finding = finding(&format!("the given meshes of {} segments in all", self.segments()));
        match sufficient {
            Some(n) => {
                let factor = (10.0 * n as f64 / self.segments() as f64).ceil() / 10.0;
                format!("{finding}. Use {factor} times as many segments in each of the rods")
            }
            None => format!("{finding}. Use more segments in each of the rods"),
        }
    }
}

/// The compared points of an equilibrium on given meshes and on other ones: the nodes of the given meshes between the
/// walls. `None` if one is outside of another mesh.
fn compared_points(
    structures: [&Structure; 2],
    found: [&StructureEquilibrium; 2],
) -> Option<[ComparedPoints; 2]> {
    let given = &structures[0].at_rest().meshes;
    let of_meshes = |k: usize| {
        let (structure, found) = (structures[k], found[k]);
        let at_rest = structure.at_rest();
        let rest = structure.shape(&at_rest.q);
        let mut compared = ComparedPoints::default();
        for ((rod, mesh), given) in structure.scene().rods.iter().zip(&at_rest.meshes).zip(given) {
            let [rest, loaded] = [&rest, &found.shape].map(|shape| shape.rods.get(&rod.name));
            let (rest, loaded) = (rest?, loaded?);
            let inner = given.arc_length.iter().filter(|s| (0.0..=given.length).contains(*s));
            for s in inner {
                let stencil = Point::ArcLength(*s).stencil(mesh).ok()?;
                let [rest, loaded] = [rest, loaded].map(|rod| stencil.place(|i| rod.nodes[i]));
                compared.push(rest, loaded);
            }
        }
        Some(compared)
    };
    let [given, other] = [0, 1].map(of_meshes);
    Some([given?, other?])
}
