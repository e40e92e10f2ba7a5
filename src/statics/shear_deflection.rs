//! Additional deflection of a rod at rest by shear deformation, which the model omits (Timoshenko beam theory).
//!
//! Input: a problem, whose equilibrium is searched here. Across an element of length `l` the shear force `Q` shifts
//! the sections by `l Q/(kappa G A)` against each other. The shifts add up from a held end to a free one. Between two
//! held ends the sum is reduced by a rotation of the rod as a whole. That is exact where both ends may turn, or where
//! loads are symmetric, and an estimate elsewhere. A cantilever under its weight deflects more by
//! `4 E/(kappa G) I/(A L^2)` of its tip's deflection. Under a force at its tip the factor is 3 instead of 4.
//!
//! Output of `shear_deflections`: the displacement of every node (m, world axes) for `E/(kappa G) = 1`, to which it is
//! proportional. The bias of a fit without shear is estimated from it. `internal_forces` returns the force (N) in every
//! edge, `free_part` the fraction of an edge outside of the walls. The forces are those on the elements of the rod, so
//! that obstacles, tendons, user-defined energies and recorded markers between the ends count as external.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{add, dot, scale, sub};
use crate::problem::{AnyProblem, Discretized, Model, Problem, behind_walls};
use crate::rod::{AssembledRod, Rod, RodContacts, UserEnergies};
use crate::scene::Support;

impl Problem {
    /// Displacement of every node in world axes by shear at the equilibrium under the loads, m, for `E/(kappa G) = 1`.
    /// It is proportional to that ratio. The equilibrium is searched anew; errors are those of the search.
    pub(crate) fn shear_deflections(&self) -> Result<Vec<[f64; 3]>, Error> {
        match self.discretized() {
            AnyProblem::Planar(discretized) => deflections(&discretized),
            AnyProblem::Spatial(discretized) => deflections(&discretized),
        }
    }
}

/// Internal force in every edge, N: the force of the part before the edge on the part behind it. It is the sum of the
/// external forces `on_node(i)` (loads and reactions), N, over the nodes i up to the start of the edge. The outermost
/// edge at a clamp, which holds both of its nodes, has the force of its neighbor, if there is one.
pub(crate) fn internal_forces<M: Model, D: Scalar>(
    discretized: &Discretized<'_, M>,
    on_node: impl Fn(usize) -> [D; 3],
) -> Vec<[D; 3]> {
    let (supports, edges) = (&discretized.scene().supports, discretized.nodes() - 1);
    let mut forces = Vec::with_capacity(edges);
    let mut sum = [D::from(0.0); 3];
    for i in 0..edges {
        sum = add(sum, on_node(i));
        forces.push(sum);
    }
    // A clamp holds both nodes of the outermost edge: the force enters at the second.
    if supports.start == Support::Clamped && edges > 1 {
        forces[0] = forces[1];
    }
    if supports.end == Support::Clamped && edges > 1 {
        forces[edges - 1] = forces[edges - 2];
    }
    forces
}

/// The fraction of edge `j` outside of the walls, from 0 to 1; 1 for edges that no wall cuts.
pub(crate) fn free_part<M: Model>(discretized: &Discretized<'_, M>, j: usize) -> f64 {
    let scene = discretized.scene();
    let [start, end] = behind_walls(&scene.supports, scene.soft);
    let behind_start = if j == 0 { start } else { 0.0 };
    let behind_end = if j + 2 == discretized.nodes() { end } else { 0.0 };
    (1.0 - behind_start - behind_end).max(0.0)
}

/// Displacements by shear of all nodes of a model in world axes at equilibrium, m, for `E/(kappa G) = 1`. Edge `j` adds
/// `-l Q/(E A)`, with its length `l` outside of walls and the internal force `Q` across it. The running sums begin with
/// zero at a held end, the start if both are held. Between two held ends a part that is linear in the node's index is
/// subtracted, so that both are zero. Without a held end they are zero at the last node. Errors are those of the
/// equilibrium.
fn deflections<M: Model>(discretized: &Discretized<'_, M>) -> Result<Vec<[f64; 3]>, Error> {
    let rest = discretized.equilibrium()?;
    let (rod, scene) = (discretized.rod(), discretized.scene());
    let edges = discretized.nodes() - 1;
    // Forces on the elements beside the loads: of supports, recorded markers, contacts and user-defined energies.
    let mut elements = rod.clone();
    elements.set_own(UserEnergies::default());
    elements.set_contacts(RodContacts::default());
    let mut reactions = vec![0.0; rest.q.len()];
    elements.gradient(&rest.q, &rest.frames, discretized.derivatives(), &mut reactions);
    // Without energies beside the elements they vanish on unknowns that nothing prescribes.
    if !scene.has_own_energies() {
        let prescribed = discretized.prescribed();
        for i in discretized.free().filter(|i| !prescribed.contains(*i)) {
            reactions[i] = 0.0;
        }
    }
    let loads = discretized.loads_at_state(&rod, &rest.q, &rest.frames, scene.loads.at_time);
    let on_node = |i: usize| add(loads[i], discretized.model.rate(&reactions, i));
    let forces = internal_forces(discretized, on_node);
    let held = [scene.supports.start, scene.supports.end].map(|s| s != Support::Free);
    let place = |i: usize| discretized.model.position(&rest.q, i);
    let mut shifted = vec![[0.0; 3]];
    for (j, force) in forces.iter().enumerate() {
        let chord = sub(place(j + 1), place(j));
        let length = dot(chord, chord).sqrt();
        let tangent = scale(chord, 1.0 / length);
        let shear = sub(*force, scale(tangent, dot(*force, tangent)));
        let (section, material) = scene.at((j as f64 + 0.5) / edges as f64);
        let stiffness = material.youngs_modulus * section.moments().area;
        // The force on the part behind the edge shifts it against the part before.
        let shift = scale(shear, -length * free_part(discretized, j) / stiffness);
        shifted.push(add(shifted[j], shift));
    }
    // Between two held ends the rod rotates as a whole, so that the shifts add up to zero.
    let whole = shifted[edges];
    let offset = |i: usize| match held {
        [true, false] => [0.0; 3],
        [true, true] => scale(whole, i as f64 / edges as f64),
        [false, _] => whole,
    };
    Ok(shifted.iter().enumerate().map(|(i, shift)| sub(*shift, offset(i))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Contact, Material, Point, PointForce, Scene, Section, Shape};

    const LENGTH: f64 = 0.2;

    /// A stiff bar of 200 x 20 x 10 mm.
    fn bar() -> Scene {
        let shape = Shape::Straight { length: LENGTH, direction: [1.0, 0.0, 0.0] };
        let section = Section::Rectangle { width: 0.02, height: 0.01, up: [0.0, 1.0, 0.0] };
        Scene::new(80, shape, section, Material::new(7850.0, 205e9))
    }

    fn force_at(node: Point) -> Vec<PointForce> {
        vec![PointForce {
            node,
            force: [0.0, -10.0, 0.0],
            moment: [0.0; 3],
            follower: false,
            signal: None,
        }]
    }

    /// Additional deflection of node `i` by shear, over its deflection.
    fn relative(scene: &Scene, i: usize) -> f64 {
        let problem = scene.problem().unwrap();
        let deflection = problem.equilibrium().unwrap().nodes[i][1];
        problem.shear_deflections().unwrap()[i][1] / deflection
    }

    /// 4 and 3 times I/(A L^2) at the tip of a cantilever; at the middle of a simply supported rod with a force there
    /// 12 times: (F L/(4 kappa G A))/(F L^3/(48 E I)).
    #[test]
    fn shear_deflection_agrees_with_beam_theory() {
        let unit = 0.01_f64.powi(2) / 12.0 / (LENGTH * LENGTH);
        let near = |found: f64, expected: f64| {
            assert!((found / (expected * unit) - 1.0).abs() < 0.02, "{found} {expected}")
        };
        let mut weight = bar();
        weight.loads.gravity = [0.0, -9.81, 0.0];
        near(relative(&weight, 80), 4.0);
        let mut tip = bar();
        tip.loads.point = force_at(Point::Tip);
        near(relative(&tip, 80), 3.0);
        (tip.supports.start, tip.supports.end) = (Support::Free, Support::Clamped);
        tip.loads.point = force_at(Point::Node(0));
        near(relative(&tip, 0), 3.0);
        let mut three_points = bar();
        three_points.supports.start = Support::Pinned;
        three_points.supports.end = Support::Roller;
        three_points.loads.point = force_at(Point::Node(40));
        near(relative(&three_points, 40), 12.0);
    }

    /// Behind an obstacle in its middle, a cantilever with a force F at its tip is sheared by F: over the length s by
    /// F s/(E A).
    #[test]
    fn obstacle_does_not_change_the_shear_behind_it() {
        let mut scene = bar();
        scene.material.youngs_modulus = 205e6;
        scene.loads.point =
            vec![PointForce { force: [0.0, -0.01, 0.0], ..force_at(Point::Tip).remove(0) }];
        let peg = Contact::cylinder([0.5 * LENGTH, -0.015, 0.0], [0.0, 0.0, 1.0], 0.01);
        scene.contacts = vec![peg.stiffness(1e12).contact_radius(0.005)];
        let problem = scene.problem().unwrap();
        let shifts = problem.shear_deflections().unwrap();
        let places = problem.arc_lengths();
        // The contact of 2 to 3 mm length is before node 44.
        let found = shifts[80][1] - shifts[44][1];
        let expected = -0.01 * (places[80] - places[44]) / (205e6 * 0.02 * 0.01);
        assert!((found / expected - 1.0).abs() < 0.02, "{found:e} {expected:e}");
    }
}
