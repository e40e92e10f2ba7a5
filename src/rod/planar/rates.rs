//! Derivatives of the forces and strains of a planar rod along parameters.

use crate::energy::{PlanarBend, Stretch};
use crate::numerics::lanes::{Lanes, dot};
use crate::rod::layout::JointRate;
use crate::rod::planar::geometry::{Geometry, Straight};
use num_dual::Dual64;

/// Derivatives of the stress of a joint along `G` parameters: by the strain, and without.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendRate<const G: usize>([Lanes<G>; 2]);

impl<const G: usize> JointRate<PlanarBend<Dual64>, 1, G> for BendRate<G> {
    fn of(duals: [&PlanarBend<Dual64>; G]) -> Self {
        Self([0, 1].map(|k| Lanes(duals.map(|bend| bend.stress_rate()[k]))))
    }

    fn is_zero(&self) -> bool {
        self.0 == [Lanes::ZERO; 2]
    }

    #[inline(always)]
    fn stiffer(&self, [strain]: &[f64; 1], _: bool) -> [Lanes<G>; 1] {
        [self.0[0] * *strain]
    }

    #[inline(always)]
    fn offset(&self) -> [Lanes<G>; 1] {
        [self.0[1]]
    }

    fn along(&self, (stiffness, offset): &([f64; 6], [f64; 3])) -> Lanes<G> {
        self.0[0] * stiffness[0] + self.0[1] * offset[0]
    }
}

/// Writes the derivatives of the gradient at fixed unknowns from those of the axial forces, by the strain of an edge,
/// and of the stresses, by the curvature of a joint.
#[inline(always)]
pub(super) fn pull<const G: usize>(
    geometry: &Geometry,
    axial: impl Fn(usize, f64) -> Lanes<G>,
    stress: impl Fn(usize, &[f64; 1]) -> [Lanes<G>; 1],
    load: impl Fn(usize) -> [Lanes<G>; 2],
    out: &mut [[f64; G]],
) {
    let out = out.as_chunks_mut::<2>().0;
    let mut carried = [Lanes::ZERO; 2];
    let mut node = |i: usize, force: [Lanes<G>; 2]| {
        let load = load(i);
        for c in 0..2 {
            out[i][c] = (carried[c] - force[c] - load[c]).0;
        }
        carried = force;
    };
    let mut before = Lanes::ZERO;
    let by_edge = |i: usize, moment: Lanes<G>| -> [Lanes<G>; 2] {
        let Straight { tangent: [t0, t1], normal: [n0, n1], strain } = geometry.edges[i];
        let axial = axial(i, strain);
        [axial * t0 + moment * n0, axial * t1 + moment * n1]
    };
    for (i, [curvature, slope]) in geometry.joints.iter().enumerate() {
        let moment = stress(i, &[*curvature])[0] * *slope;
        node(i, by_edge(i, before - moment));
        before = moment;
    }
    let i = geometry.joints.len();
    node(i, by_edge(i, before));
    node(i + 1, [Lanes::ZERO; 2]);
}

/// Adds the derivatives of the strains along those of the unknowns.
#[inline(always)]
pub(super) fn add_strain_rates<const G: usize>(
    stretch: &[Stretch<f64, 2>],
    geometry: &Geometry,
    q: &[[f64; G]],
    edges: &mut [Lanes<G>],
    joints: &mut [[Lanes<G>; 1]],
) {
    let (q, _) = q.as_chunks::<2>();
    let mut before = Lanes::ZERO;
    for (j, Straight { tangent, normal, .. }) in geometry.edges.iter().enumerate() {
        let e = [0, 1].map(|c| Lanes(q[j + 1][c]) - Lanes(q[j][c]));
        edges[j] += dot(tangent, &e) * stretch[j].rest_length.recip();
        let turn = dot(normal, &e);
        if let Some(i) = j.checked_sub(1) {
            joints[i][0] += (turn - before) * geometry.joints[i][1];
        }
        before = turn;
    }
}
