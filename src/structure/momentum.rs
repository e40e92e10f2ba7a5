//! Linear and angular momentum (about the origin) of a structure, kg m/s and kg m^2/s: masses of rods and bodies,
//! inertias of bodies and of sprung clamps.
//!
//! Masses of carried and fixed nodes are left out: bodies include those of carried nodes, and walls hold the fixed
//! ones. Rotational momenta of bodies and sprung clamps are included, in space also spins of free edges about their
//! tangents. `StructureMotion::momentum` returns two components and the angular momentum in the axes of the plane, NaN
//! for a structure in space. `Simulation::momentum_in_space` returns two vectors in world axes, `None` in a plane.
//! Tests of conservation use them.

use crate::dynamics::Simulation;
use crate::numerics::rotation::times;
use crate::numerics::vector::{Vector, add, cross, scale, sub, unit};
use crate::rod::assembly::{AssemblyFrames, JoinedRods};
use crate::rod::layout::{Plane, Space};
use crate::rod::{Assembly, State};
use crate::structure::structure_motion::StructureMotion;

/// The state of an assembly.
type AssemblyState = State<f64, AssemblyFrames<f64>>;

/// Linear momentum along x and y of the plane, kg m/s, and angular momentum about the origin of the plane, kg m^2/s.
/// Summed are `m v` and `x m v_y - y m v_x` of free nodes and centers of bodies, and inertia times rate of rotations of
/// bodies and springs. Nodes that are carried or fixed are left out.
fn planar_momentum(rods: &JoinedRods<f64, Plane>, state: &AssemblyState) -> [f64; 3] {
    let tied: Vec<usize> = rods.unknowns_without_effect().collect();
    let mut sum = [0.0; 3];
    let mut add = |mass: f64, x: [f64; 2], v: [f64; 2]| {
        sum[0] += mass * v[0];
        sum[1] += mass * v[1];
        sum[2] += mass * (x[0] * v[1] - x[1] * v[0]);
    };
    let place = |i: usize| ([state.q[i], state.q[i + 1]], [state.v[i], state.v[i + 1]]);
    for member in rods.members() {
        for i in member.range.clone().step_by(2).filter(|i| !tied.contains(i)) {
            let (x, v) = place(i);
            add(rods.mass()[i], x, v);
        }
    }
    let (bodies, first) = (rods.bodies(), rods.body_coordinates().start);
    for body in &bodies.bodies {
        let (x, v) = place(first + body.coordinate);
        add(body.mass, x, v);
    }
    let turns = bodies.bodies.iter().filter_map(|body| body.rotation);
    for turn in turns.chain(bodies.springs.iter().map(|spring| spring.rotation)) {
        sum[2] += turn.inertia * state.v[first + turn.coordinate] / turn.length;
    }
    sum
}

/// Linear momentum, kg m/s, and angular momentum about the origin of the world, kg m^2/s, in world axes. Summed are `m
/// v` and `x` cross `m v` of free nodes and centers of bodies, spins of free edges along their tangents, and rotations
/// of bodies and springs in their principal axes. Nodes that are carried or fixed are left out.
fn spatial_momentum(rods: &JoinedRods<f64, Space>, state: &AssemblyState) -> [Vector<f64>; 2] {
    let tied: Vec<usize> = rods.unknowns_without_effect().collect();
    let mut sums = [[0.0; 3]; 2];
    let three = |all: &[f64], i: usize| [all[i], all[i + 1], all[i + 2]];
    let mut q = state.q.clone();
    // Tangents of edges at bodies need the places of carried nodes.
    rods.place_carried(&mut q, &state.frames);
    for member in rods.members() {
        let Some(last) = member.range.end.checked_sub(3) else { continue };
        for i in member.range.clone().step_by(4) {
            let x = three(&q, i);
            if !tied.contains(&i) {
                let p = scale(three(&state.v, i), rods.mass()[i]);
                sums = [add(sums[0], p), add(sums[1], cross(x, p))];
            }
            // The spin of the edge after the node.
            if i < last && !tied.contains(&(i + 3)) {
                let tangent = unit(sub(three(&q, i + 4), x));
                let spin = rods.mass()[i + 3] * state.v[i + 3];
                sums[1] = add(sums[1], scale(tangent, spin));
            }
        }
    }
    let (bodies, first) = (rods.bodies(), rods.body_coordinates().start);
    let (z, rates) = (&q[first..], &state.v[first..]);
    for body in &bodies.bodies {
        let p = scale(three(rates, body.coordinate), body.mass);
        sums = [add(sums[0], p), add(sums[1], cross(three(z, body.coordinate), p))];
    }
    for (rotation, axes) in bodies.rotations_with_axes(z, &state.frames) {
        let rate = scale(three(rates, rotation.coordinate), 1.0 / rotation.length);
        let spin = [0, 1, 2].map(|c| rotation.inertia[c] * rate[c]);
        sums[1] = add(sums[1], times(&axes, spin));
    }
    sums
}

impl StructureMotion<'_> {
    /// Linear momentum along x and y of the plane, kg m/s, and angular momentum about the origin of the plane, kg
    /// m^2/s, at the present state. Three NaN for a structure in space; see [`Simulation::momentum_in_space`].
    pub fn momentum(&self) -> [f64; 3] {
        match self.simulation().rod() {
            Assembly::Plane(rods) => planar_momentum(rods, self.simulation().state()),
            Assembly::Space(_) => [f64::NAN; 3],
        }
    }
}

impl Simulation<f64, Assembly<f64>> {
    /// Linear momentum, kg m/s, and angular momentum about the origin, kg m^2/s, in world axes, at the present state.
    /// None for a structure in a plane.
    pub fn momentum_in_space(&self) -> Option<[Vector<f64>; 2]> {
        match self.rod() {
            Assembly::Plane(_) => None,
            Assembly::Space(rods) => Some(spatial_momentum(rods, self.state())),
        }
    }
}
