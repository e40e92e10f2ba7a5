//! Estimated error of the mesh that a scene of one rod gives (`rod.segments` or the points of a polyline), for its
//! equilibrium and its modes.
//!
//! [`Problem::add_mesh_error`] and [`Problem::add_mesh_errors`] repeat the calculation on another mesh
//! (`mesh_comparison`). They add the estimated errors to the result, and the warning `coarse-mesh` in front of its
//! warnings if one is above the limit. Nothing is added for a mesh that the program chose, whose error is known, and
//! where no other mesh has a solution.
//!
//! Compared points of an equilibrium are the nodes of the given mesh that are not behind walls, and the tip. A mode is
//! compared with the mode of the same number in its plane, or of the same number among those of its kind there,
//! whichever is nearer: axial modes may be between other ones than on the finer mesh. Growth rates of follower loads
//! have no estimate.

use crate::accuracy::extrapolation::smooth_mesh_order;
use crate::accuracy::mesh_comparison::{
    ComparedPoints, FrequencyErrors, MeshComparison, PositionError, other_meshes,
};
use crate::code::Code;
use crate::problem::Problem;
use crate::scene::{Point, Shape};
use crate::statics::Equilibrium;
use crate::vibration::{Mode, Modes};

/// Modes of the other mesh over the requested ones: the list of a coarse mesh has modes that are higher in reality.
const MORE_MODES: usize = 2;

impl Problem {
    /// Adds the estimated error of a given mesh to an equilibrium of this problem, from that on another mesh, and the
    /// warning `coarse-mesh` if it is above 2 % of the largest displacement or 1 % of the length. Without effect for a
    /// mesh that the program chose, and if there is no equilibrium on another mesh.
    ///
    /// ```
    /// let mut scene = rodfit::Scene::load("data/cantilever.toml")?;
    /// scene.rod.segments = Some(4);
    /// let problem = scene.problem()?;
    /// let mut rest = problem.equilibrium()?;
    /// problem.add_mesh_error(&mut rest);
    /// assert!(rest.mesh_error.is_some_and(|error| error.displacement > 1e-4)); // m
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn add_mesh_error(&self, found: &mut Equilibrium) {
        let compared = self.on_other_mesh(|comparison, other| {
            let rest = other.equilibrium().ok()?;
            let [given, other] = compared_points([self, other], [&found.nodes, &rest.nodes])?;
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
            found.warning_codes.insert(0, Code::CoarseMesh);
        }
    }

    /// Adds the estimated errors of a given mesh to modes of this problem, of which `count` were requested, from those
    /// on another mesh. It also adds the warning `coarse-mesh` if one of the first `count` frequencies has an error
    /// above 2 %, or if the mesh has fewer modes. Without effect for a mesh that the program chose, and if there are no
    /// modes on another mesh.
    pub fn add_mesh_errors(&self, count: usize, found: &mut Modes) {
        let compared = self.on_other_mesh(|comparison, other| {
            let others = other.modes(MORE_MODES * count, found.about).ok()?.modes;
            Some((comparison, frequency_errors(comparison, count, &found.modes, &others)))
        });
        let Some((comparison, errors)) = compared else { return };
        for (mode, error) in found.modes.iter_mut().zip(&errors.errors) {
            mode.mesh_error = *error;
        }
        if errors.excess(count) > 1.0 {
            let sufficient = Some(errors.sufficient(count, comparison));
            let words = self.coarse_mesh_warning(|mesh| errors.finding(count, mesh), sufficient);
            found.warnings.insert(0, Code::CoarseMesh.behind(words));
            found.warning_codes.insert(0, Code::CoarseMesh);
        }
    }

    /// The first result of `calculate` that is one, for this problem on other meshes. `None` for a mesh that the
    /// program chose.
    fn on_other_mesh<T>(
        &self,
        calculate: impl Fn(MeshComparison, &Problem) -> Option<T>,
    ) -> Option<T> {
        let (scene, segments) = (self.scene(), self.segments());
        let order = smooth_mesh_order(scene);
        if scene.chosen().segments {
            return None;
        }
        other_meshes(segments, order).find_map(|ratio| {
            let edges = (ratio * segments as f64).round();
            let other = self.with_scene(self.remeshed(edges as usize)).ok()?;
            let ratio = edges / segments as f64;
            calculate(MeshComparison { segments, ratio, order }, &other)
        })
    }

    /// The warning of a coarse mesh: the finding about a mesh, and a number of edges that suffices.
    fn coarse_mesh_warning(
        &self,
        finding: impl Fn(&str) -> String,
        sufficient: Option<usize>,
    ) -> String {
        let finding = finding(&format!("the given mesh of {} segments", self.segments()));
        // The points of a polyline are its mesh without `rod.segments`.
        let is_optional = !matches!(self.scene().rod.shape, Shape::Polyline { .. });
        let omit = "omit rod.segments to let the program choose it";
        match (sufficient, is_optional) {
            (Some(n), true) => format!("{finding}. Use rod.segments = {n} or more, or {omit}"),
            (Some(n), false) => format!("{finding}. Use rod.segments = {n} or more"),
            (None, true) => format!("{finding}. Use a larger rod.segments, or {omit}"),
            (None, false) => format!("{finding}. Use a larger rod.segments"),
        }
    }
}

/// The compared points of an equilibrium on a given mesh and on another one, from the positions of the nodes, m: the
/// nodes of the given mesh between the walls, and the tip. `None` if one is outside of the other mesh.
fn compared_points(
    problems: [&Problem; 2],
    nodes: [&Vec<[f64; 3]>; 2],
) -> Option<[ComparedPoints; 2]> {
    let given = problems[0];
    let length = given.length();
    let inner = given.arc_lengths().iter().filter(|s| (0.0..=length).contains(*s));
    let points: Vec<Point> = inner.map(|s| Point::ArcLength(*s)).chain([Point::Tip]).collect();
    let of_mesh = |mesh: usize| {
        let (problem, nodes) = (problems[mesh], nodes[mesh]);
        let mut compared = ComparedPoints::default();
        for point in &points {
            let stencil = problem.stencil(*point).ok()?;
            let rest = stencil.place(|i| problem.rest_nodes()[i]);
            compared.push(rest, stencil.place(|i| nodes[i]));
        }
        Some(compared)
    };
    let [given, other] = [0, 1].map(of_mesh);
    Some([given?, other?])
}

/// Errors of modes on a given mesh by those on another one, which are more.
fn frequency_errors(
    comparison: MeshComparison,
    count: usize,
    given: &[Mode],
    others: &[Mode],
) -> FrequencyErrors {
    // The number of a mode among those that are similar to it, from zero on.
    let number = |i: usize, is_similar: fn(&Mode, &Mode) -> bool| {
        given[..i].iter().filter(|other| is_similar(other, &given[i])).count()
    };
    let same_plane = |a: &Mode, b: &Mode| a.plane == b.plane;
    let same_kind = |a: &Mode, b: &Mode| a.plane == b.plane && a.kind == b.kind;
    let error = |i: usize| {
        let similar: [fn(&Mode, &Mode) -> bool; 2] = [same_plane, same_kind];
        let found = similar.into_iter().filter_map(|is_similar| {
            let mut partners = others.iter().filter(|other| is_similar(other, &given[i]));
            let partner = partners.nth(number(i, is_similar))?;
            comparison.frequency_error(given[i].frequency_rad_s, partner.frequency_rad_s)
        });
        found.min_by(|a, b| a.abs().total_cmp(&b.abs()))
    };
    // Modes that the given mesh does not list: it has other ones, of lower numbers or of another kind, instead.
    let is_unlisted = |i: &usize| {
        let of_kind = |modes: &[Mode]| modes.iter().filter(|m| same_kind(m, &others[*i])).count();
        of_kind(&others[..=*i]) > of_kind(given)
    };
    let requested = 0..count.min(others.len());
    let unlisted = requested.clone().filter(is_unlisted);
    FrequencyErrors {
        errors: (0..given.len()).map(error).collect(),
        missing: requested.len().saturating_sub(given.len()),
        half_waves: unlisted.filter_map(|i| others[i].number).max().unwrap_or(0),
    }
}
