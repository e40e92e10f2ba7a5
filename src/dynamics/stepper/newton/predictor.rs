//! Predictor of an implicit step: unknowns at its end from extrapolated velocities, from which Newton's iteration
//! starts.
//!
//! Input: the state before the step, and stored velocities at the starts of the last two accepted steps (`store`).
//! `predict` is as follows; `predict_steadily` takes constant velocities. Free unknowns move by `h (beta v1 + (1 -
//! beta) v0)` for Newmark-beta, and by the corresponding equation for generalised-alpha. The velocity `v1` at the end
//! is extrapolated linearly. It is extrapolated by a parabola if the scheme damps unresolved motion
//! (`old_velocity_factor` below `SMOOTH`) and three steps are equal within `EQUAL`. For averaging schemes, and without
//! stored velocities, it is constant. Prescribed unknowns and moving supports are set to their values at the end of the
//! step. Output: predicted unknowns and frames in the state, and whether velocities were extrapolated.

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::step::Step;
use crate::numerics::scalar::RodScalar;
use crate::rod::{Rod, State};
use crate::scene::prescribed_motion::MotionTime;

/// Largest relative difference of step sizes that are taken as equal, for the parabola: above rounding, below any
/// intended change of the step.
const EQUAL: f64 = 1e-6;
/// Largest factor of the old velocity in the new one, [`StepCoefficients::old_velocity_factor`], for a parabola through
/// three velocities. Below it unresolved motion, which alternates in sign, decays by half in each step; a parabola
/// would amplify it.
const SMOOTH: f64 = 0.5;

/// The velocities of all unknowns at one time.
#[derive(Clone, Debug)]
struct TimedVelocity<D> {
    /// Time, s.
    time: f64,
    /// Velocities, m/s (rad/s for angles).
    v: Vec<D>,
}

/// Velocities at the starts of the last two steps, oldest first, from which the next one is extrapolated.
#[derive(Clone, Debug)]
pub struct Predictor<D> {
    earlier: Vec<TimedVelocity<D>>,
    /// Prescribed unknowns at the end of the step.
    prescribed: Vec<D>,
}

impl<D: RodScalar> Predictor<D> {
    /// The predictor without stored velocities; the first step is predicted with constant velocity.
    pub fn new() -> Self {
        Self { earlier: Vec::new(), prescribed: Vec::new() }
    }

    /// Stores time and velocities at the start of an accepted step, `before`; at most the last two are kept.
    pub fn store<F>(&mut self, before: &State<D, F>) {
        if self.earlier.len() < 2 {
            self.earlier.push(TimedVelocity { time: before.time, v: before.v.clone() });
            return;
        }
        self.earlier.swap(0, 1);
        let TimedVelocity { time, v } = &mut self.earlier[1];
        *time = before.time;
        v.copy_from_slice(&before.v);
    }

    /// Overwrites `state.q` and frames with the prediction, with the supports at the end of the step. Free unknowns
    /// move by `h (beta v1 + (1 - beta) v0)`. `v1` is extrapolated linearly, or for dissipative schemes with equal
    /// steps by a parabola through three velocities. At beta = 1/2 unresolved motion changes its sign with every
    /// step, so that the last change of velocity is the best extrapolation. `steady`, or no stored velocity, keeps
    /// velocities constant. Returns whether they were extrapolated. Stored velocities of rejected steps are dropped.
    #[inline(always)]
    pub fn predict<R: Rod<D>>(
        &mut self,
        step: &Step<'_, D, R>,
        coefficients: &StepCoefficients<D>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
        steady: bool,
    ) -> bool {
        // Rejected steps are not part of the motion.
        while self.earlier.last().is_some_and(|last| last.time >= before.time) {
            self.earlier.pop();
        }
        self.predict_steadily(step, before, state);
        if steady {
            return false;
        }
        let (h, free) = (step.h, step.system.free.clone());
        self.prescribed.clear();
        self.prescribed.extend(step.system.prescribed.iter().map(|i| state.q[i]));
        let (q, v0) = (&mut state.q[free.clone()], &before.v[free.clone()]);
        // A change of velocity dv displaces the end of the step by dv h beta.
        let part = coefficients.rate.recip();
        match &self.earlier[..] {
            [TimedVelocity { time: t2, v: v2 }, TimedVelocity { time: t1, v: v1 }]
                if coefficients.old_velocity_factor.value() < SMOOTH
                    && (before.time - t1 - h).abs() < EQUAL * h
                    && (t1 - t2 - h).abs() < EQUAL * h =>
            {
                // Dissipative scheme, equal steps: parabola through three velocities.
                let (v1, v2) = (&v1[free.clone()], &v2[free.clone()]);
                for i in 0..free.len() {
                    q[i] += ((v0[i] - v1[i]) * 2.0 - (v1[i] - v2[i])) * part;
                }
            }
            [.., TimedVelocity { time: t1, v: v1 }] => {
                // Otherwise a line through two velocities, whose times may be apart by another
                // step size.
                let (v1, part) = (&v1[free.clone()], part * (h / (before.time - t1)));
                for i in 0..free.len() {
                    q[i] += (v0[i] - v1[i]) * part;
                }
            }
            [] => return false,
        }
        if let Some(acceleration) = &coefficients.acceleration {
            let (part, a0) = (part * acceleration.velocity, &before.acceleration[free]);
            for (q, a0) in q.iter_mut().zip(a0) {
                *q -= *a0 * part;
            }
        }
        step.system.prescribed.iter().zip(&self.prescribed).for_each(|(i, q)| state.q[i] = *q);
        true
    }

    /// Overwrites `state.q` with `q0 + h v0` and the frames with those of `before`. If supports move, held unknowns
    /// and their velocities are set to those at the end of the step.
    #[inline(always)]
    pub fn predict_steadily<R: Rod<D>>(
        &self,
        step: &Step<'_, D, R>,
        before: &State<D, R::Frames>,
        state: &mut State<D, R::Frames>,
    ) {
        let State { q, frames, v, .. } = state;
        frames.clone_from(&before.frames);
        for (q, (q0, v0)) in q.iter_mut().zip(before.q.iter().zip(&before.v)) {
            *q = *q0 + *v0 * step.h;
        }
        if let Some(boundary_motion) = &step.system.boundary_motion {
            // Held angles count on from where they were.
            let (start, end) = (step.system.free.start, step.system.free.end);
            q[..start].copy_from_slice(&before.q[..start]);
            q[end..].copy_from_slice(&before.q[end..]);
            let [from, to] = [before.time, step.time].map(MotionTime::Time);
            boundary_motion.advance::<R>(from, to, q, frames);
            boundary_motion.velocities(step.time, v);
        }
    }
}
