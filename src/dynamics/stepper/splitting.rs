//! Explicit symplectic splitting schemes, Verlet and PEFRL: kicks and drifts in turn.
//!
//! Input: a state over any scalar, the masses, and a step. A kick changes velocities of free unknowns by the forces at
//! fixed positions, `dv/dt = -gradient/m - c v`, exactly with the mass damping `c`. A drift moves positions with
//! constant velocities, and in space the frames. Verlet is kick, drift, kick (order 2, one gradient per step). PEFRL
//! has five drifts and four kicks between them (order 4; Omelyan, Mryglod and Folk 2002). Loads in time act in the
//! kicks: of Verlet their means over the half of the step next to the kick, of PEFRL their values at its time. Output:
//! the state at the end of the step, in place, and the work of loads in time in the last step (`timed_work`, J). There
//! is no error: the caller keeps the step below the stability limit.

use crate::dynamics::step::{Step, Work};
use crate::numerics::phi_function::phi1;
use crate::numerics::scalar::Scalar;
use crate::rod::{Rod, State, UnknownForce};
use crate::scene::Scheme;

/// The fractions of the step in the kicks and drifts of a scheme.
#[derive(Debug)]
struct Composition {
    /// Fractions of the kicks, one more than drifts. A last kick of zero needs no forces.
    kicks: &'static [f64],
    /// Fractions of the drifts.
    drifts: &'static [f64],
}

/// Stormer-Verlet in the velocity form.
const VERLET: Composition = Composition { kicks: &[0.5, 0.5], drifts: &[1.0] };

/// Omelyan, Mryglod and Folk (2002), Eq. (22): position-extended Forest-Ruth-like.
const PEFRL: Composition = {
    // The three numbers of the paper, all of them to 16 digits.
    const XI: f64 = 0.178_617_895_844_809_1;
    const LAMBDA: f64 = -0.212_341_831_062_605_4;
    const CHI: f64 = -0.066_264_582_669_818_5;
    Composition {
        kicks: &[0.0, 0.5 - LAMBDA, LAMBDA, LAMBDA, 0.5 - LAMBDA, 0.0],
        drifts: &[XI, CHI, 1.0 - 2.0 * (CHI + XI), CHI, XI],
    }
};

/// A splitting scheme for a rod with the given masses.
#[derive(Clone, Debug)]
pub struct Splitting<D> {
    composition: &'static Composition,
    /// 1/mass of every degree of freedom, 1/kg.
    inverse_mass: Vec<D>,
    /// Work of loads in time over the last step, J.
    timed_work: f64,
}

/// The fractions of kicks and drifts of Verlet or PEFRL; `None` for other schemes.
fn composition(scheme: Scheme) -> Option<&'static Composition> {
    match scheme {
        Scheme::Verlet => Some(&VERLET),
        Scheme::Pefrl => Some(&PEFRL),
        _ => None,
    }
}

impl<D: Scalar> Splitting<D> {
    /// The splitting of `scheme` for a rod of these masses, kg (kg m^2 for angles), whose inverses are stored; `None`
    /// for schemes other than Verlet and PEFRL.
    pub(crate) fn of(scheme: Scheme, mass: &[D]) -> Option<Self> {
        let inverse_mass = || mass.iter().map(|m| m.recip()).collect();
        composition(scheme).map(|composition| Self {
            composition,
            inverse_mass: inverse_mass(),
            timed_work: 0.0,
        })
    }

    /// Advances `state` (unknowns, velocities, frames) over a step by the kicks and drifts of the scheme. For Verlet,
    /// `state.unbalanced` must be the gradient at `state.q` before, and it is after; PEFRL leaves that of its last kick
    /// there. Adds the gradient evaluations to `work`: one for Verlet, four for PEFRL.
    pub(crate) fn step<R: Rod<D>>(
        &mut self,
        step: &Step<'_, D, R>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) {
        let Composition { kicks, drifts } = self.composition;
        self.timed_work = 0.0;
        let mut timed = TimedKicks::new(step);
        let forces = timed.next(kicks[0], 0.0, step, &state.q);
        self.kick(kicks[0], step, state, forces);
        // Fractions of the step of the drifts so far: the time at which loads act.
        let mut drifted = 0.0;
        for (kick, drift) in kicks[1..].iter().zip(*drifts) {
            drifted += drift;
            let State { q, frames, v, unbalanced, .. } = &mut *state;
            // Drift: constant velocities.
            for (q, v) in q.iter_mut().zip(v) {
                *q += *v * (drift * step.h);
            }
            // Without a kick no forces are needed: only the frames move.
            if *kick == 0.0 {
                R::update_reference_frames(frames, q);
            } else {
                step.system.rod.moved_gradient(q, frames, step.system.derivatives, unbalanced);
                work.gradients += 1;
                let forces = timed.next(*kick, drifted, step, &state.q);
                self.kick(*kick, step, state, forces);
            }
        }
    }

    /// Advances the velocities of the free unknowns by `dv/dt = -g/m - c v` over `weight` times the step, exactly:
    /// `v e^(-ch) - (g/m) (1 - e^(-ch))/c`. `g` is `state.unbalanced`, `c` the mass damping; without damping it is
    /// `v - h g/m`. The forces `timed` of loads in time, N, are added in the same way, and their work is summed.
    #[inline]
    fn kick<R, F>(
        &mut self,
        weight: f64,
        step: &Step<'_, D, R>,
        state: &mut State<D, F>,
        timed: &[UnknownForce<D>],
    ) {
        let (h, free) = (weight * step.h, step.system.free.clone());
        let forces = state.unbalanced[free.clone()].iter().zip(&self.inverse_mass[free.clone()]);
        let all = state.v[free].iter_mut().zip(forces);
        // Without damping the exponential factors are 1: v -= h g/m.
        if step.system.damping.mass.value() == 0.0 && D::ORDER == 0 {
            for (v, (gradient, by_mass)) in all {
                *v -= *gradient * *by_mass * h;
            }
            self.push(timed, D::from(h), step, [&mut state.v, &mut state.unbalanced]);
        } else {
            let x = step.system.damping.mass * h;
            // Exact solution of dv/dt = -g/m - c v over the part h: v e^(-ch) - (g/m) (1 -
            // e^(-ch))/c.
            let (decay, push) = ((-x).exp(), phi1(x) * h);
            for (v, (gradient, by_mass)) in all {
                *v = *v * decay - *gradient * *by_mass * push;
            }
            self.push(timed, push, step, [&mut state.v, &mut state.unbalanced]);
        }
    }
}

impl<D: Scalar> Splitting<D> {
    /// Work of loads in time over the last step, J: the sum of impulse times mean velocity over its kicks.
    pub(crate) fn timed_work(&self) -> f64 {
        self.timed_work
    }

    /// Adds to the velocities `v` of free unknowns the forces of loads in time over their masses, times `duration`, s.
    /// Adds their work to that of the step. `unbalanced` are the elastic forces of the same kick.
    fn push<R>(
        &mut self,
        timed: &[UnknownForce<D>],
        duration: D,
        step: &Step<'_, D, R>,
        [v, unbalanced]: [&mut [D]; 2],
    ) {
        for UnknownForce { unknown, force } in timed {
            if step.system.free.contains(unknown) {
                let gain = *force * self.inverse_mass[*unknown] * duration;
                // The elastic forces of the kick have changed the velocity already.
                let elastic = unbalanced[*unknown] * self.inverse_mass[*unknown] * duration;
                let mean = v[*unknown].value() + 0.5 * (gain + elastic).value();
                self.timed_work += (*force * duration).value() * mean;
                v[*unknown] += gain;
            }
        }
    }
}

/// Loads in time at the kicks of a step. Verlet takes their means over both halves of the step, PEFRL their values at
/// the times of its kicks.
struct TimedKicks<D> {
    start: f64,
    forces: Vec<UnknownForce<D>>,
}

impl<D: Scalar> TimedKicks<D> {
    /// The loads in time of a step, before its first kick: the start of the step, s, and no forces.
    fn new<R>(step: &Step<'_, D, R>) -> Self {
        Self { start: step.time - step.h, forces: Vec::new() }
    }

    /// The forces of a kick of this weight at the unknowns `q`, after drifts over the fraction `drifted` of the step;
    /// empty without loads in time.
    fn next<R>(
        &mut self,
        weight: f64,
        drifted: f64,
        step: &Step<'_, D, R>,
        q: &[D],
    ) -> &[UnknownForce<D>] {
        let loads = &step.system.timed_loads;
        if loads.is_empty() || weight == 0.0 {
            return &[];
        }
        // Kicks of Verlet are at both ends, and each has the impulse of the half next to it.
        let at = |part: f64| D::from(self.start + part * step.h);
        match (drifted, weight) {
            (0.0, 0.5) => loads.set_mean_at([at(0.0), at(0.5)], q, &mut self.forces),
            (1.0, 0.5) => loads.set_mean_at([at(0.5), at(1.0)], q, &mut self.forces),
            _ => loads.set_at(at(drifted), q, &mut self.forces),
        }
        &self.forces
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The trace of the step of `v' = -q` leaves [-2, 2] at the limit and not before.
    #[test]
    fn limits_of_stability() {
        let splittings = Scheme::all().filter_map(|scheme| Some((composition(scheme)?, scheme)));
        for (composition, scheme) in splittings {
            let limit = scheme.traits().stability_limit.expect("explicit schemes have one");
            let trace = |x: f64| {
                let turn = |mut q: f64, mut v: f64| {
                    v -= composition.kicks[0] * x * q;
                    for (kick, drift) in composition.kicks[1..].iter().zip(composition.drifts) {
                        q += drift * x * v;
                        v -= kick * x * q;
                    }
                    [q, v]
                };
                turn(1.0, 0.0)[0] + turn(0.0, 1.0)[1]
            };
            let bounded = |x: f64| trace(x).abs() <= 2.0 + 1e-12;
            assert!((1..=1000).all(|k| bounded(limit * f64::from(k) / 1000.0)));
            assert!(!bounded(1.002 * limit));
            assert!((composition.kicks.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            assert!((composition.drifts.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
    }
}
