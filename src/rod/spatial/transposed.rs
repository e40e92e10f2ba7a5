//! The derivatives of a spatial rod's frames, transposed.

use crate::numerics::lanes::Lanes;
use crate::numerics::vector::{Vector, add, cross, dot, scale, sub};
use crate::rod::discrete::TransposedLayout;
use crate::rod::edges::STRIDE;
use crate::rod::layout::{Layout, Space};
use crate::rod::sensitive::FrameRate;
use crate::rod::spatial::geometry::{Geometry, Straight};

/// Adds what a frame counts for.
fn add_frame(frame: &mut FrameRate<1>, turn: f64, tangent: Vector<f64>) {
    frame.turn.0[0] += turn;
    for (to, from) in frame.tangent.iter_mut().zip(tangent) {
        to.0[0] += from;
    }
}

impl TransposedLayout<3, 3> for Space {
    fn add_to_joint(
        [a, b, c]: &[f64; 3],
        [x, y, z]: &[f64; 3],
        [p, q, r]: &[f64; 3],
        (stiffness, offset): &mut ([f64; 6], [f64; 3]),
    ) {
        let all = [
            a * (x + p),
            a * (y + q) + b * (x + p),
            a * z + c * x,
            b * (y + q),
            b * z + c * y,
            c * (z + r),
        ];
        stiffness.iter_mut().zip(all).for_each(|(to, from)| *to += from);
        offset.iter_mut().zip([a, b, c]).for_each(|(to, from)| *to += from);
    }

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
            let e = Space::edge(d, j);
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
}
