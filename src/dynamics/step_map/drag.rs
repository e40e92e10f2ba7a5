//! Derivatives of fluid drag over a step, forward and transposed.
//!
//! In the equations of a step drag depends on the velocities of mass damping: those at the end, or the mean of an
//! averaging scheme. It also depends on the unit tangents of the rod at the predicted places `q0 + h v0`. The next step
//! takes the drag at the state at the end. `add_drag` and its transpose `drag_transposed` concern the equations of the
//! step, `add_next_drag` and `next_drag_transposed` the drag at the start of the next step. Forward, input are the
//! derivatives of state and drag coefficients along parameters. The derivatives of minus the drag (N) are added to
//! those of the forces; SIMD lanes (parameters) without drag are skipped. Transposed: from derivatives `d` of a misfit
//! by the forces, those by state, numbers of drag and the scheme's parameter are added. Those by the predicted places
//! are returned, for the caller to pass on to `q0` and `v0`.

use crate::dynamics::step_map::StepMap;
use crate::dynamics::step_map::rates::{LaneDrag, ParameterRates, ParameterSlopes, StateRates};
use crate::dynamics::step_map::workspace::{DragWorkspace, Held};
use crate::rod::{ForwardSensitivity, Transposed};
use num_dual::Dual64;

/// Overwrites `to` with the numbers `x` and their derivatives in lane `g` of `rates`.
fn set_duals<const G: usize>(x: &[f64], rates: &[[f64; G]], g: usize, to: &mut Vec<Dual64>) {
    to.clear();
    to.extend(x.iter().zip(rates).map(|(x, rate)| Dual64::new(*x, rate[g])));
}

impl<R: ForwardSensitivity> StepMap<'_, R> {
    /// Adds to `out` the derivatives of minus the drag in the equations of the step, N, at fixed unknowns at the end,
    /// for each SIMD lane (parameter) with drag. They are by the predicted places `q0 + h v0`, by the velocities that
    /// mass damping acts on, and by drag coefficients. `held` are the derivatives of unknowns that supports hold; their
    /// velocity is that at the end.
    pub fn add_drag<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &StateRates<G>,
        held: &[Held<G>],
        room: &mut DragWorkspace,
        out: &mut [[f64; G]],
    ) {
        let (before, now) = (self.step.before, self.step.after);
        for LaneDrag { lane: g, drag } in &parameters.drag {
            let g = *g;
            let scheme = Dual64::new(self.step.parameter, parameters.numbers.scheme.0[g]);
            let coefficients = self.coefficients(scheme);
            let DragWorkspace { places, v, .. } = room;
            // Until they are moved on, the velocities are those at the start.
            set_duals(&before.v, &state.v, g, v);
            set_duals(&before.q, &state.q, g, places);
            for i in self.step.free.clone() {
                let a0 = match before.acceleration.get(i) {
                    Some(a0) => Dual64::new(*a0, state.acceleration[i][g]),
                    None => Dual64::from(0.0),
                };
                let (q0, v0) = (places[i], v[i]);
                places[i] = q0 + v0 * coefficients.h;
                v[i] = coefficients.damped_velocity(-q0 + now.q[i], v0, a0);
            }
            for Held { i, v: rate, .. } in held {
                places[*i] += v[*i] * coefficients.h;
                v[*i] = Dual64::new(now.v[*i], rate[g]);
            }
            room.add_rates(drag, g, out);
        }
    }

    /// Adds to `state.unbalanced` the derivatives of minus the drag at the end of the step, N, by places and velocities
    /// there and by drag numbers. It is the drag at the start of the next step.
    pub fn add_next_drag<const G: usize>(
        &self,
        parameters: &ParameterRates<R, G>,
        state: &mut StateRates<G>,
        room: &mut DragWorkspace,
    ) {
        for LaneDrag { lane: g, drag } in &parameters.drag {
            set_duals(&self.step.after.q, &state.q, *g, &mut room.places);
            set_duals(&self.step.after.v, &state.v, *g, &mut room.v);
            room.add_rates(drag, *g, &mut state.unbalanced);
        }
    }
}

impl<R: Transposed> StepMap<'_, R> {
    /// Transpose of [`add_drag`](Self::add_drag): from the derivatives `d` of a misfit by the forces, adds those by the
    /// state at the start, by drag numbers and by the scheme's parameter. Returns those by the predicted places `q0 + h
    /// v0`, one per unknown; empty without drag.
    pub fn drag_transposed(
        &self,
        d: &[f64],
        state: &mut StateRates<1>,
        slopes: &mut ParameterSlopes,
    ) -> Vec<f64> {
        let (Some(drag), Some(by_drag)) = (self.step.drag, &mut slopes.drag) else {
            return Vec::new();
        };
        let (before, h) = (self.step.before, self.nodal.h());
        let places: Vec<f64> = before.q.iter().zip(&before.v).map(|(q, v)| q + v * h).collect();
        // The velocities of the drag are those of mass damping: for an averaging scheme the mean over the step.
        let mut v = self.step.after.v.clone();
        for i in self.step.free.clone() {
            v[i] = self.nodal.damped_velocity(&self.step_motion(i))[0];
        }
        let (mut by_place, mut by_v) = (vec![0.0; v.len()], vec![0.0; v.len()]);
        drag.add_transposed_slopes([&places, &v, d], by_drag, [&mut by_place, &mut by_v]);
        for (i, by_v) in by_v.into_iter().enumerate() {
            // Held unknowns: the velocity at the end is prescribed. Free ones: it follows from change, velocity and
            // acceleration.
            if !self.step.free.contains(&i) {
                state.v[i][0] += by_v;
                continue;
            }
            let [by_change, by_v0, by_a0] = self.nodal.damped_factors();
            state.q[i][0] -= by_v * by_change;
            state.v[i][0] += by_v * by_v0;
            state.acceleration[i][0] += by_v * by_a0;
            slopes.numbers.scheme += by_v * self.nodal.damped_velocity(&self.step_motion(i))[1];
        }
        by_place
    }

    /// Transpose of [`add_next_drag`](Self::add_next_drag). Takes the derivatives `d` of a misfit by the forces at the
    /// start of the next step. Adds those by unknowns and velocities at the end of this step to `state`, and those by
    /// drag numbers to `slopes`. Nothing without drag.
    pub fn next_drag_transposed(
        &self,
        d: &[f64],
        state: &mut StateRates<1>,
        slopes: &mut ParameterSlopes,
    ) {
        if let (Some(drag), Some(slopes)) = (self.step.drag, &mut slopes.drag) {
            let at = [&self.step.after.q[..], &self.step.after.v, d];
            let [q, v] = [&mut state.q, &mut state.v].map(|list| list.as_flattened_mut());
            drag.add_transposed_slopes(at, slopes, [q, v]);
        }
    }
}
