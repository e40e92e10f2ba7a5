//! What the places count for that supports hold, where parameters move the supports.

use crate::dynamics::linearization::Linearization;
use crate::problem::boundary::BoundaryMotion;
use crate::rod::{DualFrames, FrameRate, Transposed};
use crate::scene::prescribed_motion::MotionTime;
use num_dual::Dual64;

/// The supports of a rod, with the parameters that move them.
pub struct MovingSupports<R: Transposed> {
    /// The unknowns that supports lead, and those of them that are angles.
    led: Vec<usize>,
    angles: Vec<usize>,
    /// By the number of the parameter.
    moved: Vec<Moved<R>>,
    still: Vec<FrameRate<1>>,
}

struct Moved<R: Transposed> {
    parameter: usize,
    motion: BoundaryMotion<Dual64>,
    frames: DualFrames<R, f64>,
    sum: f64,
}

impl<R: Transposed> MovingSupports<R> {
    /// Of a rod with this motion, if it has any that numbers say.
    pub fn new(motion: Option<&BoundaryMotion>, still: Vec<FrameRate<1>>) -> Self {
        let [led, angles] = motion
            .filter(|motion| motion.has_numbers())
            .map_or([const { Vec::new() }; 2], |motion| motion.prescribed());
        Self { led, angles, moved: Vec::new(), still }
    }

    /// Whether supports are led where numbers say.
    pub fn are_led(&self) -> bool {
        !self.led.is_empty()
    }

    /// Adds a parameter that moves them.
    pub fn add(
        &mut self,
        parameter: usize,
        motion: BoundaryMotion<Dual64>,
        frames: DualFrames<R, f64>,
    ) {
        self.moved.push(Moved { parameter, motion, frames, sum: 0.0 });
    }

    /// What each parameter's way of moving them counts for.
    pub fn sums(&self) -> impl Iterator<Item = (usize, f64)> {
        self.moved.iter().map(|moved| (moved.parameter, moved.sum))
    }

    /// Goes back over a step, at whose end places and velocities count for `q` and `v`.
    pub fn lead_back(
        &mut self,
        step: &Linearization<'_, f64, R>,
        (q, v): (&mut [f64], &mut [f64]),
        frames: &mut [FrameRate<1>],
    ) {
        if self.led.is_empty() {
            // What is held stays where it is.
            (0..v.len()).filter(|i| !step.free.contains(i)).for_each(|i| v[i] = 0.0);
            return;
        }
        let (now, moment) = (step.after, MotionTime::Time(step.after.time));
        for Moved { motion, frames, sum, .. } in &mut self.moved {
            R::set_dual_frames(&step.before.frames, &self.still, 0, frames);
            let dual = |x: &[f64]| -> Vec<Dual64> { x.iter().map(|x| Dual64::from(*x)).collect() };
            let (mut q1, mut v1) = (dual(&now.q), dual(&now.v));
            motion.advance::<R::Dual>(moment, moment, &mut q1, frames);
            motion.velocities(now.time, &mut v1);
            *sum += self.led.iter().map(|i| q[*i] * q1[*i].eps + v[*i] * v1[*i].eps).sum::<f64>();
        }
        // A held director turns back against a frame that turns.
        let mut turned = vec![0.0; q.len()];
        self.angles.iter().for_each(|i| turned[*i] = -q[*i]);
        R::turn_frames(step.end, &turned, frames);
        self.led.iter().for_each(|i| (q[*i], v[*i]) = (0.0, 0.0));
    }
}
