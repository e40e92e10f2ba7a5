//! Derivatives of the forces and strains of a planar rod along parameters.

use crate::energy::friction::SliderRates;
use crate::energy::{PlanarBend, Sliders, Stretch, dual_gradient_rate};
use crate::numerics::lanes::{Lanes, dot};
use crate::rod::discrete::{JointRate, RateLayout, TransposedLayout};
use crate::rod::layout::Plane;
use crate::rod::moments::{Moments, add_slopes};
use crate::rod::planar::geometry::{Geometry, Straight};
use crate::rod::planar::sweep::Elements;
use crate::rod::planar::unknowns;
use crate::rod::sensitive::FrameRate;
use crate::rod::transposed::Laws;
use num_dual::Dual64;
use std::ops::{Add, Mul};

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

impl RateLayout<2, 1> for Plane {
    type JointRate<const G: usize> = BendRate<G>;

    fn pull<const G: usize>(
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

    fn add_rates_by_duals(
        elements: Elements<'_, Dual64>,
        q: &[f64],
        (): &(),
        mut add: impl FnMut(usize, &[f64]),
    ) {
        for (i, element) in elements.stretch.iter().enumerate() {
            add(2 * i, &dual_gradient_rate(element, unknowns::<_, 4>(q, i)));
        }
        for (i, element) in elements.joint.iter().enumerate() {
            add(2 * i, &dual_gradient_rate(element, unknowns::<_, 6>(q, i)));
        }
    }

    fn add_moment_rates(moments: &Moments<Dual64>, q: &[f64], add: impl FnMut(usize, &[f64])) {
        moments.add_gradient_rate(q, add);
    }

    fn add_strain_rates<const G: usize>(
        stretch: &[Stretch<f64, 2>],
        _: &[FrameRate<G>],
        geometry: &Geometry,
        q: &[[f64; G]],
        (edges, joints): (&mut [Lanes<G>], &mut [[Lanes<G>; 1]]),
    ) {
        let count = geometry.edges.len();
        let (q, stretch) = (&q.as_chunks::<2>().0[..=count], &stretch[..count]);
        let mut before = Lanes::ZERO;
        for (j, Straight { tangent, normal, .. }) in geometry.edges.iter().enumerate() {
            let e = [Lanes(q[j + 1][0]) - Lanes(q[j][0]), Lanes(q[j + 1][1]) - Lanes(q[j][1])];
            edges[j] += dot(tangent, &e) * stretch[j].rest_length.recip();
            let turn = dot(normal, &e);
            if j > 0 {
                joints[j - 1][0] += (turn - before) * geometry.joints[j - 1][1];
            }
            before = turn;
        }
    }

    #[inline(always)]
    fn stiffness_times<T>(joint: &PlanarBend<f64>, [s]: &[T; 1], _: bool) -> [T; 1]
    where
        T: Copy + Add<Output = T> + Mul<f64, Output = T>,
    {
        [*s * joint.stiffness]
    }

    fn slip_rate<const G: usize>(
        changes: &SliderRates<G>,
        (sliders, i): (&Sliders<f64>, usize),
        _: (&PlanarBend<f64>, &BendRate<G>),
        [z]: [f64; 1],
        [rate]: [Lanes<G>; 1],
    ) -> [Lanes<G>; 1] {
        [changes.slid(sliders, i, z, rate)]
    }
}

impl TransposedLayout<2, 1> for Plane {
    fn add_to_joint(
        [w]: &[f64; 1],
        [strain]: &[f64; 1],
        [own]: &[f64; 1],
        (stiffness, offset): &mut ([f64; 6], [f64; 3]),
    ) {
        stiffness[0] += w * (strain + own);
        offset[0] += w;
    }

    fn add_to_moments(q: &[f64], d: &[f64], laws: &mut Laws) {
        add_slopes(q, d, &mut laws.moment);
    }

    fn along_moments(moments: &Moments<Dual64>, laws: &Laws) -> f64 {
        let moments = moments.list.iter().filter(|(i, _)| *i < laws.moment.len());
        moments.map(|(i, m)| m.moment.eps * laws.moment[*i]).sum()
    }
}
