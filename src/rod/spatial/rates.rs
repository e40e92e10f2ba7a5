//! How the forces of a spatial rod change with parameters, and how its frames do.
//!
//! The director of an edge follows the tangent `t` from its reference `t_ref` by parallel transport,
//! and turns by `g.dx` when the edge of length `l` changes by `dx` (see [`bend_twist`]). Transport back
//! and forth is the same way, so it turns by `l g.dt_ref` when the reference changes. An edge's frame
//! has therefore one number for each parameter besides the change of its tangent: how fast its
//! directors turn about it.

use crate::energy::bend_twist::{self, JointLaw, Stiffness};
use crate::energy::frame::{EdgeFrame, Frames, one_plus_dot};
use crate::energy::friction::SliderRates;
use crate::energy::{Sliders, Stretch, dual_gradient_rate};
use crate::numerics::banded::BandMatrix;
use crate::numerics::lanes::{Lanes, dot as lanes_dot};
use crate::numerics::simd::with_simd_if_wide;
use crate::numerics::vector::{Vector, add, combine, components, cross, dot, map_components};
use crate::rod::discrete::{JointRate, RateLayout};
use crate::rod::edges::{HALF_BANDWIDTH, STRIDE};
use crate::rod::layout::Space;
use crate::rod::sensitive::FrameRate;
use crate::rod::spatial::geometry::{Bent, Geometry, Straight};
use crate::rod::spatial::sweep::Elements;
use crate::rod::spatial::{ENDS, around, ends};
use num_dual::Dual64;
use std::ops::{Add, Mul};

/// Derivatives of the stresses of a joint along `G` parameters: by the strains, the upper triangle row by row, and
/// without.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BendTwistRate<const G: usize> {
    pub(super) stiffness: [Lanes<G>; 6],
    offset: [Lanes<G>; 3],
}

impl<const G: usize> JointRate<JointLaw<Dual64>, 3, G> for BendTwistRate<G> {
    fn of(duals: [&JointLaw<Dual64>; G]) -> Self {
        let rates = duals.map(JointLaw::stress_rate);
        Self {
            stiffness: std::array::from_fn(|k| Lanes(components(|g| rates[g].0[k]))),
            offset: std::array::from_fn(|k| Lanes(components(|g| rates[g].1[k]))),
        }
    }

    fn is_zero(&self) -> bool {
        self.stiffness.iter().chain(&self.offset).all(|rate| *rate == Lanes::ZERO)
    }

    #[inline(always)]
    fn stiffer(&self, [x, y, z]: &[f64; 3], coupled: bool) -> [Lanes<G>; 3] {
        let [k11, k12, mut k13, k22, mut k23, k33] = self.stiffness;
        if !coupled {
            (k13, k23) = (Lanes::ZERO, Lanes::ZERO);
        }
        [
            k11 * *x + k12 * *y + k13 * *z,
            k12 * *x + k22 * *y + k23 * *z,
            k13 * *x + k23 * *y + k33 * *z,
        ]
    }

    #[inline(always)]
    fn offset(&self) -> [Lanes<G>; 3] {
        self.offset
    }

    fn along(&self, (stiffness, offset): &([f64; 6], [f64; 3])) -> Lanes<G> {
        let mut sum = Lanes::ZERO;
        self.stiffness.iter().zip(stiffness).for_each(|(rate, law)| sum += *rate * *law);
        self.offset.iter().zip(offset).for_each(|(rate, law)| sum += *rate * *law);
        sum
    }
}

/// The vector of edge `j`.
#[inline(always)]
fn edge<const G: usize>(q: &[[f64; G]], j: usize) -> [Lanes<G>; 3] {
    let own: &[[f64; G]; 7] =
        q[STRIDE * j..].first_chunk().expect("an edge's nodes are nodes of the rod");
    let along = |c: usize| Lanes(own[STRIDE + c]) - Lanes(own[c]);
    [along(0), along(1), along(2)]
}

/// `a x b` of a vector of numbers and one of lanes.
#[inline(always)]
fn lanes_cross<const G: usize>(a: &Vector<f64>, b: &[Lanes<G>; 3]) -> [Lanes<G>; 3] {
    [b[2] * a[1] - b[1] * a[2], b[0] * a[2] - b[2] * a[0], b[1] * a[0] - b[0] * a[1]]
}

/// `K s`, with what couples bending and twisting or without.
#[inline(always)]
pub(super) fn times<T>(stiffness: &Stiffness<f64>, s: &[T; 3], coupled: bool) -> [T; 3]
where
    T: Copy + Add<Output = T> + Mul<f64, Output = T>,
{
    let Stiffness { bend: [b11, b12, b22], twist, coupling } = *stiffness;
    let [c1, c2] = if coupled { coupling } else { [0.0; 2] };
    let row = |[a, b, c]: [f64; 3]| s[0] * a + s[1] * b + s[2] * c;
    [row([b11, b12, c1]), row([b12, b22, c2]), row([c1, c2, twist])]
}

/// What changes with the frames.
struct FrameChange<'a, const G: usize> {
    frames: &'a [FrameRate<G>],
    geometry: &'a Geometry,
    gradient: &'a [f64],
    tangent: &'a BandMatrix<f64, HALF_BANDWIDTH>,
    out: &'a mut [[f64; G]],
}

impl<const G: usize> pulp::NullaryFnOnce for FrameChange<'_, G> {
    type Output = ();

    /// The directors turn as by a change of the angle, and they follow the edge otherwise.
    #[inline(always)]
    fn call(self) {
        let Self { frames, geometry, gradient, tangent, out } = self;
        for (j, (edge, rate)) in geometry.edges.iter().zip(frames).enumerate() {
            let theta = STRIDE * j + 3;
            let psi = rate.turn + lanes_dot(&edge.follow, &rate.tangent) * edge.length;
            tangent.add_column_inlined(theta, psi.0, out);
            // g = t x t_ref / (l (1 + t.t_ref))
            let torque = gradient[theta];
            let sideways = torque * edge.by_chi * edge.inverse_length;
            let along = lanes_dot(&edge.tangent, &rate.tangent) * (torque * edge.by_chi);
            let turned = lanes_cross(&edge.tangent, &rate.tangent);
            for c in 0..3 {
                let force = turned[c] * sideways - along * edge.follow[c];
                let (before, after) = (STRIDE * j + c, STRIDE * (j + 1) + c);
                out[before] = (Lanes(out[before]) - force).0;
                out[after] = (Lanes(out[after]) + force).0;
            }
        }
    }
}

impl RateLayout<3, 3> for Space {
    type JointRate<const G: usize> = BendTwistRate<G>;

    fn pull<const G: usize>(
        Geometry { edges, joints }: &Geometry,
        axial: impl Fn(usize, f64) -> Lanes<G>,
        stress: impl Fn(usize, &[f64; 3]) -> [Lanes<G>; 3],
        load: impl Fn(usize) -> [Lanes<G>; 3],
        out: &mut [[f64; G]],
    ) {
        let by_edge = |i: usize, [p, q, h]: [Lanes<G>; 3]| -> [Lanes<G>; 3] {
            let Straight { tangent, strain, across: [m1, m2], turn, .. } = &edges[i];
            let force = axial(i, *strain);
            let (p, q) = (p + h * turn[0], q + h * turn[1]);
            let along = |c: usize| force * tangent[c] + p * m1[c] + q * m2[c];
            [along(0), along(1), along(2)]
        };
        let (mut carried, mut open) = ([Lanes::ZERO; 3], [Lanes::ZERO; 3]);
        for (i, Bent { strains, by: [by_e, by_f] }) in joints.iter().enumerate() {
            let w = stress(i, strains);
            let pull =
                |[p, q, h]: &[[f64; 3]; 3]| [lanes_dot(p, &w), lanes_dot(q, &w), lanes_dot(h, &w)];
            let [p, q, h] = pull(by_e);
            let by = [open[0] + p, open[1] + q, open[2] + h];
            let (force, load) = (by_edge(i, by), load(i));
            let node: &mut [[f64; G]; STRIDE] =
                out[STRIDE * i..].first_chunk_mut().expect("a node");
            for c in 0..3 {
                node[c] = (carried[c] - force[c] - load[c]).0;
            }
            node[3] = by[2].0;
            carried = force;
            open = pull(by_f);
        }
        let i = joints.len();
        let (force, loads) = (by_edge(i, open), [load(i), load(i + 1)]);
        for c in 0..3 {
            out[STRIDE * i + c] = (carried[c] - force[c] - loads[0][c]).0;
            out[STRIDE * (i + 1) + c] = (force[c] - loads[1][c]).0;
        }
        out[STRIDE * i + 3] = open[2].0;
    }

    fn add_rates_by_duals(
        elements: Elements<'_, Dual64>,
        q: &[f64],
        frames: &Frames<f64>,
        mut add: impl FnMut(usize, &[f64]),
    ) {
        for (i, element) in elements.stretch.iter().enumerate() {
            let local = dual_gradient_rate(element, &ends(q, i));
            (0..6).for_each(|r| add(STRIDE * i + ENDS[r], &[local[r]]));
        }
        for i in 0..elements.joint.len() {
            let still = |v: f64| Dual64::from(v);
            let at = [frames.edges[i].map(still), frames.edges[i + 1].map(still)];
            let element = elements.joint[i].at(at, still(frames.twist[i]));
            let local = bend_twist::dual_gradient(&element, &map_components(around(q, i), still));
            add(STRIDE * i, &map_components(&local, |x| x.eps));
        }
    }

    fn add_strain_rates<const G: usize>(
        stretch: &[Stretch<f64, 3>],
        frames: &[FrameRate<G>],
        geometry: &Geometry,
        q: &[[f64; G]],
        (edges, joints): (&mut [Lanes<G>], &mut [[Lanes<G>; 3]]),
    ) {
        let mut before = [Lanes::ZERO; 3];
        for (j, (measured, frame)) in geometry.edges.iter().zip(frames).enumerate() {
            let Straight { length, tangent, across, turn, follow, .. } = measured;
            let e = edge(q, j);
            edges[j] += lanes_dot(tangent, &e) * stretch[j].rest_length.recip();
            let (a, b) = (lanes_dot(&across[0], &e), lanes_dot(&across[1], &e));
            let turned = frame.turn + lanes_dot(follow, &frame.tangent) * *length;
            let own = [a, b, Lanes(q[STRIDE * j + 3]) + turned + a * turn[0] + b * turn[1]];
            if let Some(i) = j.checked_sub(1) {
                let [by_e, by_f] = &geometry.joints[i].by;
                for c in 0..3 {
                    for r in 0..3 {
                        joints[i][c] += before[r] * by_e[r][c] + own[r] * by_f[r][c];
                    }
                }
            }
            before = own;
        }
    }

    #[inline(always)]
    fn stiffness_times<T>(joint: &JointLaw<f64>, s: &[T; 3], coupled: bool) -> [T; 3]
    where
        T: Copy + Add<Output = T> + Mul<f64, Output = T>,
    {
        times(&joint.stiffness, s, coupled)
    }

    fn slip_rate<const G: usize>(
        changes: &SliderRates<G>,
        (sliders, i): (&Sliders<f64>, usize),
        (joint, rate): (&JointLaw<f64>, &BendTwistRate<G>),
        z: [f64; 3],
        z_rate: [Lanes<G>; 3],
    ) -> [Lanes<G>; 3] {
        changes.slid_in_space(sliders, i, (&joint.stiffness, &rate.stiffness), (z, z_rate))
    }

    fn frame_rate<const G: usize>(
        frames: &[FrameRate<G>],
        geometry: &Geometry,
        gradient: &[f64],
        tangent: &BandMatrix<f64, HALF_BANDWIDTH>,
        out: &mut [[f64; G]],
    ) {
        with_simd_if_wide::<_, G>(FrameChange { frames, geometry, gradient, tangent, out });
    }

    fn rebase_rates<const G: usize>(
        frames: &mut [FrameRate<G>],
        geometry: &Geometry,
        q: &[[f64; G]],
    ) {
        for (j, (measured, rate)) in geometry.edges.iter().zip(frames).enumerate() {
            let e = edge(q, j);
            let along = lanes_dot(&measured.tangent, &e);
            let Straight { length, inverse_length, tangent, follow, .. } = measured;
            for c in 0..3 {
                rate.turn += (rate.tangent[c] * *length + e[c]) * follow[c];
                rate.tangent[c] = (e[c] - along * tangent[c]) * *inverse_length;
            }
        }
    }

    fn frame_rates<const G: usize>(frames: [&Frames<Dual64>; G]) -> Vec<FrameRate<G>> {
        let lanes = |of: &dyn Fn(&Frames<Dual64>) -> f64| Lanes(frames.map(of));
        let edges = frames.first().map_or(0, |frames| frames.edges.len());
        let rate = |j: usize| FrameRate {
            tangent: [0, 1, 2].map(|c| lanes(&|frames| frames.edges[j].tangent[c].eps)),
            turn: lanes(&|frames| {
                let EdgeFrame { tangent, director } = frames.edges[j];
                let second = cross(tangent.map(|x| x.re), director.map(|x| x.re));
                dot(director.map(|x| x.eps), second)
            }),
        };
        (0..edges).map(rate).collect()
    }

    fn set_dual_frames<const G: usize>(
        frames: &Frames<f64>,
        rates: &[FrameRate<G>],
        lane: usize,
        dual: &mut Frames<Dual64>,
    ) {
        let tangent_rate = |j: usize| map_components(&rates[j].tangent, |x| x.0[lane]);
        let turn = |j: usize| rates[j].turn.0[lane];
        let pair = |x: Vector<f64>, rate: Vector<f64>| components(|c| Dual64::new(x[c], rate[c]));
        for (j, (to, from)) in dual.edges.iter_mut().zip(&frames.edges).enumerate() {
            let EdgeFrame { tangent, director } = *from;
            let along = -dot(director, tangent_rate(j));
            let rate = combine(turn(j), cross(tangent, director), along, tangent);
            *to = EdgeFrame {
                tangent: pair(tangent, tangent_rate(j)),
                director: pair(director, rate),
            };
        }
        // A transported director turns as over a step.
        for (i, (to, from)) in dual.twist.iter_mut().zip(&frames.twist).enumerate() {
            let (e, f) = (frames.edges[i].tangent, frames.edges[i + 1].tangent);
            let both = add(tangent_rate(i), tangent_rate(i + 1));
            let across = dot(cross(e, f), both) / one_plus_dot(e, f);
            *to = Dual64::new(*from, turn(i + 1) - turn(i) + across);
        }
    }
}
