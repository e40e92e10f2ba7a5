//! How the forces of a spatial rod change with parameters, and how its frames do.
//!
//! The director of an edge follows the tangent `t` from its reference `t_ref` by parallel transport,
//! and turns by `g.dx` when the edge of length `l` changes by `dx` (see [`bend_twist`]). Transport back
//! and forth is the same way, so it turns by `l g.dt_ref` when the reference changes. An edge's frame
//! has therefore one number for each parameter besides the change of its tangent: how fast its
//! directors turn about it.

use crate::energy::frame::{EdgeFrame, Frames, one_plus_dot};
use crate::energy::{Derivatives, bend_twist, dual_gradient_rate};
use crate::numerics::banded::BandMatrix;
use crate::numerics::lanes::{Lanes, dot as lanes_dot};
use crate::numerics::vector::{Vector, add, combine, cross, dot};
use crate::rod::DualFrames;
use crate::rod::sensitive::{FrameRate, Sensitive};
use crate::rod::spatial::geometry::{Bent, Geometry, Straight};
use crate::rod::spatial::{ENDS, HALF_BANDWIDTH, STRIDE, SpatialRod, around, ends};
use num_dual::Dual64;

/// How the stresses of a joint change: by the strains, the upper triangle row by row, and without.
#[derive(Clone, Copy, Debug, PartialEq)]
struct JointRate<const G: usize> {
    stiffness: [Lanes<G>; 6],
    offset: [Lanes<G>; 3],
}

impl<const G: usize> JointRate<G> {
    const ZERO: Self = Self { stiffness: [Lanes::ZERO; 6], offset: [Lanes::ZERO; 3] };

    #[inline(always)]
    fn stress(&self, [x, y, z]: [f64; 3]) -> [Lanes<G>; 3] {
        let ([k11, k12, k13, k22, k23, k33], [a, b, c]) = (self.stiffness, self.offset);
        [
            k11 * x + k12 * y + k13 * z + a,
            k12 * x + k22 * y + k23 * z + b,
            k13 * x + k23 * y + k33 * z + c,
        ]
    }
}

/// What parameters change of a spatial rod.
#[derive(Clone, Debug, Default)]
pub struct Rates<const G: usize> {
    /// Whether anything elastic.
    elastic: bool,
    /// Axial forces: by the strain, and without.
    stretch: Vec<[Lanes<G>; 2]>,
    joint: Vec<JointRate<G>>,
    load: Vec<[Lanes<G>; 3]>,
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

fn hand_rate<const G: usize>(rates: &Rates<G>, geometry: &Geometry, out: &mut [[f64; G]]) {
    let Rates { stretch, joint, load, .. } = rates;
    let Geometry { edges, joints } = geometry;
    let by_edge = |i: usize, [p, q, h]: [Lanes<G>; 3]| -> [Lanes<G>; 3] {
        let Straight { tangent, strain, across: [m1, m2], turn, .. } = &edges[i];
        let [slope, offset] = stretch[i];
        let force = slope * *strain + offset;
        let (p, q) = (p + h * turn[0], q + h * turn[1]);
        let along = |c: usize| force * tangent[c] + p * m1[c] + q * m2[c];
        [along(0), along(1), along(2)]
    };
    let (mut carried, mut open) = ([Lanes::ZERO; 3], [Lanes::ZERO; 3]);
    for (i, (law, Bent { strains, by: [by_e, by_f] })) in joint.iter().zip(joints).enumerate() {
        let w = law.stress(*strains);
        let pull =
            |[p, q, h]: &[[f64; 3]; 3]| [lanes_dot(p, &w), lanes_dot(q, &w), lanes_dot(h, &w)];
        let [p, q, h] = pull(by_e);
        let by = [open[0] + p, open[1] + q, open[2] + h];
        let force = by_edge(i, by);
        let node: &mut [[f64; G]; STRIDE] = out[STRIDE * i..].first_chunk_mut().expect("a node");
        for c in 0..3 {
            node[c] = (carried[c] - force[c] - load[i][c]).0;
        }
        node[3] = by[2].0;
        carried = force;
        open = pull(by_f);
    }
    let i = joint.len();
    let force = by_edge(i, open);
    for c in 0..3 {
        out[STRIDE * i + c] = (carried[c] - force[c] - load[i][c]).0;
        out[STRIDE * (i + 1) + c] = (force[c] - load[i + 1][c]).0;
    }
    out[STRIDE * i + 3] = open[2].0;
}

impl Sensitive<HALF_BANDWIDTH> for SpatialRod<f64> {
    type Rates<const G: usize> = Rates<G>;

    fn set_rates<const G: usize>(duals: &[SpatialRod<Dual64>; G], rates: &mut Rates<G>) {
        fn lanes<const G: usize>(
            duals: &[SpatialRod<Dual64>; G],
            of: impl Fn(&SpatialRod<Dual64>) -> f64,
        ) -> Lanes<G> {
            Lanes(std::array::from_fn(|g| of(&duals[g])))
        }
        let Rates { elastic, stretch, joint, load } = rates;
        let Some(first) = duals.first() else { return };
        let (edges, joints, nodes) =
            (0..first.stretch.len(), 0..first.joint.len(), 0..first.load.len());
        stretch.clear();
        stretch.extend(
            edges.map(|i| [0, 1].map(|k| lanes(duals, |rod| rod.stretch[i].force_rate()[k]))),
        );
        joint.clear();
        joint.extend(joints.map(|i| JointRate {
            stiffness: std::array::from_fn(|k| lanes(duals, |rod| rod.joint[i].stress_rate().0[k])),
            offset: std::array::from_fn(|k| lanes(duals, |rod| rod.joint[i].stress_rate().1[k])),
        }));
        load.clear();
        load.extend(nodes.map(|i| [0, 1, 2].map(|c| lanes(duals, |rod| rod.load[i].force[c].eps))));
        *elastic = stretch.iter().any(|law| *law != [Lanes::ZERO; 2])
            || joint.iter().any(|law| *law != JointRate::ZERO);
    }

    fn gradient_rate<const G: usize>(
        (duals, rates): (&[SpatialRod<Dual64>; G], &Rates<G>),
        geometry: &Geometry,
        (q, frames): (&[f64], &Frames<f64>),
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    ) {
        if derivatives == Derivatives::Hand && rates.elastic {
            hand_rate(rates, geometry, out);
        } else {
            out.fill([0.0; G]);
            for (i, load) in rates.load.iter().enumerate() {
                for c in 0..3 {
                    out[STRIDE * i + c] = load[c].0.map(|load| -load);
                }
            }
        }
        for (g, dual) in duals.iter().enumerate() {
            let mut add = |first: usize, local: &[f64]| {
                out[first..].iter_mut().zip(local).for_each(|(out, local)| out[g] += local);
            };
            if derivatives == Derivatives::Dual {
                for (i, element) in dual.stretch.iter().enumerate() {
                    let local = dual_gradient_rate(element, &ends(q, i));
                    (0..6).for_each(|r| add(STRIDE * i + ENDS[r], &[local[r]]));
                }
                for i in 0..dual.joint.len() {
                    let still = |v: f64| Dual64::from(v);
                    let at = [i, i + 1].map(|j| frames.edges[j].map(still));
                    let element = dual.joint[i].at(at, still(frames.twist[i]));
                    let local = bend_twist::dual_gradient(&element, &around(q, i).map(still));
                    add(STRIDE * i, &local.map(|x| x.eps));
                }
            }
            dual.own.add_gradient_rate(q, &frames.edges, derivatives, add);
        }
    }

    /// The directors turn as by a change of the angle, and they follow the edge otherwise.
    fn frame_rate<const G: usize>(
        frames: &[FrameRate<G>],
        geometry: &Geometry,
        gradient: &[f64],
        tangent: &BandMatrix<f64, HALF_BANDWIDTH>,
        out: &mut [[f64; G]],
    ) {
        for (j, (edge, rate)) in geometry.edges.iter().zip(frames).enumerate() {
            let theta = STRIDE * j + 3;
            let psi = rate.turn + lanes_dot(&edge.follow, &rate.tangent) * edge.length;
            tangent.add_column(theta, psi.0, out);
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

    fn frame_rates<const G: usize>(
        frames: [&DualFrames<Self, f64, HALF_BANDWIDTH>; G],
    ) -> Vec<FrameRate<G>> {
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
        let tangent_rate = |j: usize| rates[j].tangent.map(|x| x.0[lane]);
        let turn = |j: usize| rates[j].turn.0[lane];
        let pair =
            |x: Vector<f64>, rate: Vector<f64>| [0, 1, 2].map(|c| Dual64::new(x[c], rate[c]));
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
            let [e, f] = [i, i + 1].map(|j| frames.edges[j].tangent);
            let both = add(tangent_rate(i), tangent_rate(i + 1));
            let across = dot(cross(e, f), both) / one_plus_dot(e, f);
            *to = Dual64::new(*from, turn(i + 1) - turn(i) + across);
        }
    }
}
