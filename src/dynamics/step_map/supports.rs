//! Derivatives of a misfit by parameters that move supports, for the adjoint method.
//!
//! Input: derivatives of the misfit by places and velocities of all unknowns at the end of each step, and for each
//! parameter the support motion over dual numbers. `add` adds a parameter, and `transpose` does the following for a
//! step. `depends_on_parameters` returns whether the motion depends on numbers of the scene. Each step adds `dm/dq
//! dq/dp + dm/dv dv/dp`, summed over the prescribed unknowns, to the sum of every parameter. The derivatives by
//! prescribed unknowns are then set to zero: their values at the end do not depend on those at the start. Those by held
//! angles are subtracted from the derivatives by the turns of the frames. If the motion depends on no number of the
//! scene, as a recording or no motion, only the derivatives by velocities of held unknowns are set to zero. Output:
//! `sums`, pairs of the index of a parameter and its sum.

use crate::dynamics::linearization::Linearization;
use crate::problem::boundary::BoundaryMotion;
use crate::rod::{DualFrames, FrameRate, RodGeometry, Transposed, set_dual_frames};
use crate::scene::prescribed_motion::MotionTime;
use num_dual::Dual64;

/// The supports of a rod with a prescribed motion, and the derivative of the misfit by each parameter that moves them.
pub struct MovingSupports<R: Transposed> {
    /// Indices of the unknowns with a prescribed motion.
    prescribed: Vec<usize>,
    /// Those of them that are angles.
    angles: Vec<usize>,
    /// The parameters with their motions.
    moved: Vec<MovingParameter<R>>,
    /// Frames without derivatives.
    still: Vec<FrameRate<1>>,
}

/// A parameter that moves supports: its index, the motion with the derivative along it, and the derivative of the
/// misfit so far.
struct MovingParameter<R: Transposed> {
    parameter: usize,
    motion: BoundaryMotion<Dual64>,
    frames: DualFrames<R, f64>,
    sum: f64,
}

impl<R: Transposed> MovingSupports<R> {
    /// Supports that move by `motion`. The lists stay empty without a motion, or if it does not depend on numbers of
    /// the scene. `still`: zero derivatives of all frames.
    pub fn new(motion: Option<&BoundaryMotion>, still: Vec<FrameRate<1>>) -> Self {
        let [prescribed, angles] = motion
            .filter(|motion| motion.has_numbers())
            .map_or([const { Vec::new() }; 2], |motion| motion.prescribed());
        Self { prescribed, angles, moved: Vec::new(), still }
    }

    /// Whether the motion of supports depends on numbers of the scene, so that parameters may move them.
    pub fn depends_on_parameters(&self) -> bool {
        !self.prescribed.is_empty()
    }

    /// Adds the parameter with index `parameter`; `motion` contains the derivatives along it, `frames` are work space.
    pub fn add(
        &mut self,
        parameter: usize,
        motion: BoundaryMotion<Dual64>,
        frames: DualFrames<R, f64>,
    ) {
        self.moved.push(MovingParameter { parameter, motion, frames, sum: 0.0 });
    }

    /// Indices of the parameters, each with the derivative of the misfit through the motion of supports.
    pub fn sums(&self) -> impl Iterator<Item = (usize, f64)> {
        self.moved.iter().map(|moved| (moved.parameter, moved.sum))
    }

    /// Adds `q dq/dp + v dv/dp`, over all prescribed unknowns, to the sum of each parameter. `q` and `v` are the
    /// derivatives of a misfit by places and velocities at the end of a step. Then sets `q` and `v` of prescribed
    /// unknowns to zero; derivatives by held angles are first subtracted from those by the turns of `frames`. Without a
    /// motion with numbers only `v` outside of the free range becomes zero.
    pub fn transpose(
        &mut self,
        step: &Linearization<'_, f64, R>,
        q: &mut [f64],
        v: &mut [f64],
        frames: &mut [FrameRate<1>],
    ) {
        if self.prescribed.is_empty() {
            // Held unknowns do not move.
            (0..v.len()).filter(|i| !step.free.contains(i)).for_each(|i| v[i] = 0.0);
            return;
        }
        let (now, moment) = (step.after, MotionTime::Time(step.after.time));
        for MovingParameter { motion, frames, sum, .. } in &mut self.moved {
            set_dual_frames(&step.before.frames, &self.still, 0, frames);
            let dual = |x: &[f64]| -> Vec<Dual64> { x.iter().map(|x| Dual64::from(*x)).collect() };
            let (mut q1, mut v1) = (dual(&now.q), dual(&now.v));
            motion.advance::<R::Dual>(moment, moment, &mut q1, frames);
            motion.velocities(now.time, &mut v1);
            *sum += self
                .prescribed
                .iter()
                .map(|i| q[*i] * q1[*i].eps + v[*i] * v1[*i].eps)
                .sum::<f64>();
        }
        // A held director turns back against a frame that turns.
        let mut turned = vec![0.0; q.len()];
        self.angles.iter().for_each(|i| turned[*i] = -q[*i]);
        step.end.turn_frames(&turned, frames);
        self.prescribed.iter().for_each(|i| (q[*i], v[*i]) = (0.0, 0.0));
    }
}
