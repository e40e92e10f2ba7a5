//! The derivatives of a spatial rod's forces, and of its frames, transposed.

use crate::energy::bend_twist::Stiffness;
use crate::numerics::lanes::Lanes;
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub};
use crate::rod::sensitive::FrameRate;
use crate::rod::spatial::geometry::{Geometry, Straight};
use crate::rod::spatial::rates::{JointRate, Rates};
use crate::rod::spatial::{STRIDE, SpatialRod, edge};
use crate::rod::transposed::{Laws, Strained, Transposed};
use num_dual::Dual64;

/// `K s`.
fn times(stiffness: &Stiffness<f64>, s: [f64; 3]) -> [f64; 3] {
    let Stiffness { bend: [b11, b12, b22], twist, coupling: [c1, c2] } = *stiffness;
    [[b11, b12, c1], [b12, b22, c2], [c1, c2, twist]].map(|row| dot(row, s))
}

/// Adds what a frame counts for.
fn add_frame(frame: &mut FrameRate<1>, turn: f64, tangent: Vector<f64>) {
    frame.turn.0[0] += turn;
    for (to, from) in frame.tangent.iter_mut().zip(tangent) {
        to.0[0] += from;
    }
}

impl Transposed for SpatialRod<f64> {
    fn no_laws(&self, _: bool) -> Laws {
        Laws::new(self.stretch.len(), self.mass.len(), 0)
    }

    fn measured_strains(geometry: &Geometry, out: &mut Vec<f64>) {
        out.clear();
        out.extend(geometry.edges.iter().map(|edge| edge.strain));
        out.extend(geometry.joints.iter().flat_map(|joint| joint.strains));
    }

    fn by_length(&self, strains: &mut [f64]) {
        for (strain, law) in strains.iter_mut().zip(&self.stretch) {
            *strain *= law.rest_length;
        }
    }

    fn stiffened(&self, w: &[f64], coupled: bool, out: &mut Vec<f64>) {
        let (axial, joints) = w.split_at(self.stretch.len());
        out.clear();
        out.extend(self.stretch.iter().zip(axial).map(|(law, w)| law.stiffness * w));
        for (law, w) in self.joint.iter().zip(joints.as_chunks::<3>().0) {
            let alone = (!coupled).then(|| law.stiffness.by_kind(0.0, [1.0; 2]));
            out.extend(times(alone.as_ref().unwrap_or(&law.stiffness), *w));
        }
    }

    fn add_to_laws(&self, w: &[f64], Strained { strains, own, counted }: Strained, to: &mut Laws) {
        let edges = self.stretch.len();
        for (i, law) in self.stretch.iter().enumerate() {
            let s = strains[i] + own.get(i).copied().unwrap_or(0.0);
            to.stretch[i][0] += w[i] * s;
            to.stretch[i][1] += w[i];
            if counted {
                to.rest[i] += w[i] * law.stiffness * (s + 1.0);
            }
        }
        let [w, strains] = [w, strains].map(|list| list[edges..].as_chunks::<3>().0);
        let own = own.get(edges..).map_or(&[][..], |own| own.as_chunks::<3>().0);
        for (i, (stiffness, offset)) in to.joint.iter_mut().enumerate() {
            let ([a, b, c], [x, y, z]) = (w[i], strains[i]);
            let [p, q, r] = own.get(i).copied().unwrap_or([0.0; 3]);
            let all = [
                a * (x + p),
                a * (y + q) + b * (x + p),
                a * z + c * x,
                b * (y + q),
                b * z + c * y,
                c * (z + r),
            ];
            stiffness.iter_mut().zip(all).for_each(|(to, from)| *to += from);
            offset.iter_mut().zip(w[i]).for_each(|(to, from)| *to += from);
        }
    }

    fn add_to_moments(&self, _: &[f64], _: &[f64], _: &mut Laws) {}

    fn turn_frames(geometry: &Geometry, angles: &[f64], frames: &mut [FrameRate<1>]) {
        for (j, (measured, frame)) in geometry.edges.iter().zip(frames).enumerate() {
            let turn = angles[STRIDE * j + 3];
            add_frame(frame, turn, scale(measured.follow, measured.length * turn));
        }
    }

    fn add_to_frames(
        geometry: &Geometry,
        gradient: &[f64],
        (d, stiff): (&[f64], &[f64]),
        frames: &mut [FrameRate<1>],
    ) {
        Self::turn_frames(geometry, stiff, frames);
        for (j, (measured, frame)) in geometry.edges.iter().zip(frames).enumerate() {
            let Straight { tangent, follow, by_chi, inverse_length, .. } = measured;
            let torque = gradient[STRIDE * j + 3] * by_chi;
            let e = edge(d, j);
            let turned = scale(cross(e, *tangent), torque * inverse_length);
            let along = scale(*tangent, torque * dot(*follow, e));
            add_frame(frame, 0.0, sub(turned, along));
        }
    }

    fn rebase_back(geometry: &Geometry, frames: &mut [FrameRate<1>], q: &mut [f64]) {
        for (j, (measured, frame)) in geometry.edges.iter().zip(frames).enumerate() {
            let Straight { length, inverse_length, tangent, follow, .. } = measured;
            let (turn, by) = (frame.turn.0[0], frame.tangent.map(|x| x.0[0]));
            let across = sub(by, scale(*tangent, dot(by, *tangent)));
            let e = add(scale(*follow, turn), scale(across, *inverse_length));
            for c in 0..3 {
                q[STRIDE * j + c] -= e[c];
                q[STRIDE * (j + 1) + c] += e[c];
                frame.tangent[c] = Lanes([follow[c] * length * turn]);
            }
        }
    }

    fn along(&self, _: &SpatialRod<Dual64>, rates: &Rates<1>, laws: &Laws) -> f64 {
        let stretch = rates.stretch.iter().flatten().zip(laws.stretch.iter().flatten());
        let rest = rates.rest.iter().zip(&laws.rest);
        let load = rates.load.iter().enumerate();
        let load = load.flat_map(|(i, load)| load.iter().zip(&laws.load[STRIDE * i..]));
        let all = stretch.chain(rest).chain(load);
        all.map(|(rate, to)| rate.0[0] * to).sum::<f64>()
            + Self::along_joints(rates, laws).iter().sum::<f64>()
    }

    fn along_joints(rates: &Rates<1>, laws: &Laws) -> Vec<f64> {
        let joints = rates.joint.iter().zip(&laws.joint);
        let along = |rates: &[Lanes<1>], to: &[f64]| -> f64 {
            rates.iter().zip(to).map(|(rate, to)| rate.0[0] * to).sum()
        };
        let joint = |(rate, (k, m)): (&JointRate<1>, &([f64; 6], [f64; 3]))| {
            let JointRate { stiffness, offset } = rate;
            along(stiffness, k) + along(offset, m)
        };
        joints.map(joint).collect()
    }
}
