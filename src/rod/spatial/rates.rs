//! How the forces of a spatial rod change with parameters, and how its frames do.
//!
//! The director of an edge follows the tangent `t` from its reference `t_ref` by parallel transport,
//! and turns by `g.dx` when the edge of length `l` changes by `dx` (see [`bend_twist`]). Transport back
//! and forth is the same way, so it turns by `l g.dt_ref` when the reference changes. An edge's frame
//! has therefore one number for each parameter besides the change of its tangent: how fast its
//! directors turn about it.

use crate::energy::bend_twist::Stiffness;
use crate::energy::frame::{EdgeFrame, Frames, one_plus_dot};
use crate::energy::friction::SliderRates;
use crate::energy::{Derivatives, bend_twist, dual_gradient_rate};
use crate::numerics::abreast::wide_on_the_unit;
use crate::numerics::banded::BandMatrix;
use crate::numerics::lanes::{Lanes, all, dot as lanes_dot};
use crate::numerics::vector::{Vector, add, combine, components, cross, dot, each};
use crate::rod::DualFrames;
use crate::rod::sensitive::{Counted, FrameRate, Sensitive};
use crate::rod::spatial::geometry::{Bent, Geometry, Straight};
use crate::rod::spatial::{ENDS, HALF_BANDWIDTH, STRIDE, SpatialRod, around, ends};
use num_dual::Dual64;

/// How the stresses of a joint change: by the strains, the upper triangle row by row, and without.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct JointRate<const G: usize> {
    pub(super) stiffness: [Lanes<G>; 6],
    pub(super) offset: [Lanes<G>; 3],
}

impl<const G: usize> JointRate<G> {
    const ZERO: Self = Self { stiffness: [Lanes::ZERO; 6], offset: [Lanes::ZERO; 3] };

    #[inline(always)]
    fn stress(&self, strains: [f64; 3]) -> [Lanes<G>; 3] {
        let ([a, b, c], [x, y, z]) = (self.stiffer(strains), self.offset);
        [a + x, b + y, c + z]
    }

    /// The part by the strains.
    #[inline(always)]
    fn stiffer(&self, [x, y, z]: [f64; 3]) -> [Lanes<G>; 3] {
        let [k11, k12, k13, k22, k23, k33] = self.stiffness;
        [k11 * x + k12 * y + k13 * z, k12 * x + k22 * y + k23 * z, k13 * x + k23 * y + k33 * z]
    }

    /// Without what couples bending and twisting.
    fn alone(&self) -> Self {
        let [k11, k12, _, k22, _, k33] = self.stiffness;
        Self { stiffness: [k11, k12, Lanes::ZERO, k22, Lanes::ZERO, k33], ..*self }
    }
}

/// What parameters change of a spatial rod.
#[derive(Clone, Debug, Default)]
pub struct Rates<const G: usize> {
    /// Whether anything elastic.
    elastic: bool,
    /// Axial forces: by the strain, and without.
    pub(super) stretch: Vec<[Lanes<G>; 2]>,
    /// Rest lengths, over themselves.
    pub(super) rest: Vec<Lanes<G>>,
    pub(super) joint: Vec<JointRate<G>>,
    pub(super) load: Vec<[Lanes<G>; 3]>,
    sliders: Option<SliderRates<G>>,
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

/// Writes the derivatives of the gradient at fixed unknowns and frames from those of the axial forces, by the strain
/// of an edge, of the stresses, by those of a joint, and of the loads.
#[inline(always)]
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
        let node: &mut [[f64; G]; STRIDE] = out[STRIDE * i..].first_chunk_mut().expect("a node");
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

/// What energies of one's own change.
fn add_own<const G: usize>(
    duals: &[SpatialRod<Dual64>; G],
    (q, frames): (&[f64], &Frames<f64>),
    derivatives: Derivatives,
    out: &mut [[f64; G]],
) {
    for (g, dual) in duals.iter().enumerate() {
        dual.own.add_gradient_rate(q, &frames.edges, derivatives, |first, local| {
            out[first..].iter_mut().zip(local).for_each(|(out, local)| out[g] += local);
        });
    }
}

/// Three strains from the first on, each with its rates.
#[inline(always)]
fn three<T>(strains: &[T], first: usize) -> &[T; 3] {
    strains[first..].first_chunk().expect("a joint has three strains")
}

/// `K s` of lanes.
#[inline(always)]
fn times<const G: usize>(stiffness: &Stiffness<f64>, s: &[Lanes<G>; 3]) -> [Lanes<G>; 3] {
    let Stiffness { bend: [b11, b12, b22], twist, coupling: [c1, c2] } = *stiffness;
    [lanes_dot(&[b11, b12, c1], s), lanes_dot(&[b12, b22, c2], s), lanes_dot(&[c1, c2, twist], s)]
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
            tangent.add_column_here(theta, psi.0, out);
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

impl Sensitive for SpatialRod<f64> {
    type Rates<const G: usize> = Rates<G>;

    fn set_rates<const G: usize>(duals: &[SpatialRod<Dual64>; G], rates: &mut Rates<G>) {
        fn lanes<const G: usize>(
            duals: &[SpatialRod<Dual64>; G],
            of: impl Fn(&SpatialRod<Dual64>) -> f64,
        ) -> Lanes<G> {
            Lanes(components(|g| of(&duals[g])))
        }
        let Rates { elastic, stretch, rest, joint, load, sliders } = rates;
        let Some(first) = duals.first() else { return };
        let (edges, joints, nodes) =
            (0..first.stretch.len(), 0..first.joint.len(), 0..first.load.len());
        stretch.clear();
        stretch.extend(
            edges.map(|i| [0, 1].map(|k| lanes(duals, |rod| rod.stretch[i].force_rate()[k]))),
        );
        rest.clear();
        rest.extend(first.stretch.iter().enumerate().map(|(i, law)| {
            lanes(duals, |rod| rod.stretch[i].rest_length.eps) * law.rest_length.re.recip()
        }));
        let own = all(duals.each_ref().map(|rod| Some(&*rod.sliders.as_ref()?.sliders)));
        *sliders = own.map(SliderRates::of);
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
            let Rates { stretch, joint, load, .. } = rates;
            let axial = |i: usize, strain: f64| stretch[i][0] * strain + stretch[i][1];
            pull(geometry, axial, |i, strains| joint[i].stress(*strains), |i| load[i], out);
        } else {
            out.fill([0.0; G]);
            for (i, load) in rates.load.iter().enumerate() {
                for c in 0..3 {
                    out[STRIDE * i + c] = (Lanes::ZERO - load[c]).0;
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
                    let at = [frames.edges[i].map(still), frames.edges[i + 1].map(still)];
                    let element = dual.joint[i].at(at, still(frames.twist[i]));
                    let local = bend_twist::dual_gradient(&element, &each(around(q, i), still));
                    add(STRIDE * i, &each(&local, |x| x.eps));
                }
            }
        }
        add_own(duals, (q, frames), derivatives, out);
    }

    fn kind(&self, strain: usize) -> usize {
        strain.checked_sub(self.stretch.len()).map_or(0, |own| 1 + usize::from(own % 3 == 2))
    }

    fn rest_strain_rates<const G: usize>(
        rates: &Rates<G>,
        geometry: &Geometry,
        out: &mut [Lanes<G>],
    ) {
        let (edges, joints) = out.split_at_mut(geometry.edges.len());
        for ((out, edge), rest) in edges.iter_mut().zip(&geometry.edges).zip(&rates.rest) {
            *out = *rest * -(1.0 + edge.strain);
        }
        joints.fill(Lanes::ZERO);
    }

    fn add_strain_rates<const G: usize>(
        &self,
        frames: &[FrameRate<G>],
        geometry: &Geometry,
        q: &[[f64; G]],
        out: &mut [Lanes<G>],
    ) {
        let (edges, joints) = out.split_at_mut(geometry.edges.len());
        let (joints, _) = joints.as_chunks_mut::<3>();
        let mut before = [Lanes::ZERO; 3];
        for (j, (measured, frame)) in geometry.edges.iter().zip(frames).enumerate() {
            let Straight { length, tangent, across, turn, follow, .. } = measured;
            let e = edge(q, j);
            edges[j] += lanes_dot(tangent, &e) * self.stretch[j].rest_length.recip();
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

    fn slip_rates<const G: usize>(&self, rates: &Rates<G>, z: &[f64], out: &mut [Lanes<G>]) {
        let (Some(springs), Some(changes)) = (&self.sliders, &rates.sliders) else { return };
        let (z, out) = (z.as_chunks::<3>().0, out.as_chunks_mut::<3>().0);
        for (i, (z, out)) in z.iter().zip(out).enumerate() {
            let both = (&self.joint[i].stiffness, &rates.joint[i].stiffness);
            *out = changes.slid_in_space(&springs.sliders, i, both, (*z, *out));
        }
    }

    fn stress_rates<const G: usize>(
        &self,
        rates: &Rates<G>,
        counted: &Counted<G>,
        out: &mut [Lanes<G>],
    ) {
        let edges = self.stretch.len();
        let (axial, joints) = out.split_at_mut(edges);
        let natural = if counted.natural { 1.0 } else { 0.0 };
        for (i, (out, law)) in axial.iter_mut().zip(&self.stretch).enumerate() {
            let (mut s, mut rate) = counted.strains[i];
            if let Some((own, own_rate)) = counted.own.get(i) {
                (s, rate) = (s + own, rate + *own_rate);
            }
            // Those at fixed unknowns have the change of the strain by the rest length in them.
            let shorter = rates.rest[i] * law.stiffness;
            let [slope, offset] = rates.stretch[i];
            *out = (slope + shorter) * s + rate * law.stiffness + (offset + shorter) * natural;
        }
        for (i, out) in joints.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let (law, changes) = (&self.joint[i].stiffness, &rates.joint[i]);
            let at = edges + 3 * i;
            let [(x, x_rate), (y, y_rate), (z, z_rate)] = *three(&counted.strains, at);
            let stiff = times(law, &[x_rate, y_rate, z_rate]);
            let changed = changes.stiffer([x, y, z]);
            for c in 0..3 {
                out[c] = stiff[c] + changed[c] + changes.offset[c] * natural;
            }
            if !counted.own.is_empty() {
                let alone = law.by_kind(0.0, [1.0; 2]);
                let [(x, x_rate), (y, y_rate), (z, z_rate)] = *three(&counted.own, at);
                let stiff = times(&alone, &[x_rate, y_rate, z_rate]);
                let changed = changes.alone().stiffer([x, y, z]);
                for c in 0..3 {
                    out[c] += stiff[c] + changed[c];
                }
            }
        }
    }

    fn stressed_rate<const G: usize>(
        changed: Option<(&[SpatialRod<Dual64>; G], &Rates<G>)>,
        stress: &[Lanes<G>],
        geometry: &Geometry,
        at: (&[f64], &Frames<f64>),
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    ) {
        let (axial, joints) = stress.split_at(geometry.edges.len());
        let (joints, _) = joints.as_chunks::<3>();
        let load = |i: usize| changed.map_or([Lanes::ZERO; 3], |(_, rates)| rates.load[i]);
        pull(geometry, |i, _| axial[i], |i, _| joints[i], load, out);
        if let Some((duals, _)) = changed {
            add_own(duals, at, derivatives, out);
        }
    }

    fn frame_rate<const G: usize>(
        frames: &[FrameRate<G>],
        geometry: &Geometry,
        gradient: &[f64],
        tangent: &BandMatrix<f64, HALF_BANDWIDTH>,
        out: &mut [[f64; G]],
    ) {
        wide_on_the_unit::<_, G>(FrameChange { frames, geometry, gradient, tangent, out });
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

    fn frame_rates<const G: usize>(frames: [&DualFrames<Self, f64>; G]) -> Vec<FrameRate<G>> {
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
        let tangent_rate = |j: usize| each(&rates[j].tangent, |x| x.0[lane]);
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
