//! RODAS: a Rosenbrock scheme of order 4 with six stages, L-stable and stiffly accurate.
//!
//! Source: Hairer and Wanner, *Solving Ordinary Differential Equations II*, section VI.3 and the code of that name.
//! Each stage solves a linear system with the tangent `K` at the start of the step. For `q' = v`,
//! `M v' = -n(q) - c M v` the rates can be eliminated. With `u` and `w` the increments of a stage in `q` and `v`,
//! `a = gamma h`, and `r`, `s` its right-hand sides:
//!
//! ```text
//! u/a - w = r                                     (M (1 + c a) + a^2 K) u =
//! (1/a + c) M w + K u = s                 =>       a^2 s + a (1 + c a) M r
//! ```
//!
//! Input: a state and the step size `h`, s; `gamma` is 1/4. A step takes one tangent, one factorization, five more
//! gradients and six solves. Mass damping `c` is included, as are loads in time, at the times of the stages and with
//! their rates at the start; Kelvin-Voigt damping, drag and moving supports are not. Output: unknowns, velocities and
//! frames at its end, in place, over any scalar. A singular matrix is an error.

use crate::dynamics::step::{Step, System, Work};
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::{Factors, Singular, Tangent};
use crate::rod::{FactorsOf, Rod, State, UnknownForce};

/// Number of stages.
const STAGES: usize = 6;
/// Diagonal coefficient `gamma`.
const GAMMA: f64 = 0.25;
/// Weights of the increments of earlier stages in the unknowns and velocities at which a stage evaluates the forces;
/// the last row gives the end of the step.
const PLACE: [&[f64]; STAGES + 1] = [
    &[],
    &[1.544],
    &[0.946_678_528_081_582_6, 0.255_701_169_898_328_4],
    &[3.314_825_187_068_521, 2.896_124_015_972_201, 0.998_641_913_997_781_7],
    &FIFTH,
    &[FIFTH[0], FIFTH[1], FIFTH[2], FIFTH[3], 1.0],
    &[FIFTH[0], FIFTH[1], FIFTH[2], FIFTH[3], 1.0, 1.0],
];
/// Weights of the increments of the first four stages in the unknowns and velocities of the fifth.
const FIFTH: [f64; 4] =
    [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895];
/// Weights of the increments of earlier stages in the right-hand sides of a stage; they are divided by the step size.
const RATE: [&[f64]; STAGES] = [
    &[],
    &[-5.6688],
    &[-2.430_093_356_833_875, -0.206_359_915_709_191_5],
    &[-0.107_352_905_815_137_5, -9.594_562_251_023_355, -20.470_286_148_096_16],
    &[7.496_443_313_967_647, -10.246_804_314_643_52, -33.999_903_528_199_05, 11.708_908_932_061_6],
    &[
        8.083_246_795_921_522,
        -7.981_132_988_064_893,
        -31.521_594_328_743_71,
        16.319_305_431_231_36,
        -6.058_818_238_834_054,
    ],
];

/// Times of the stages as fractions of the step, at which loads in time are taken.
const TIME: [f64; STAGES] = [0.0, 0.386, 0.21, 0.63, 1.0, 1.0];
/// Factors of the step size and the derivative of the loads by time, at the start of the step, in the forces of a
/// stage.
const LEAD: [f64; STAGES] = [0.25, -0.1043, 0.1035, -0.036_200_000_000_000_23, 0.0, 0.0];

/// The stepper of rodas4: its work arrays, allocated once.
#[derive(Clone, Debug)]
pub struct Rosenbrock<D: Scalar, R: Rod<D>> {
    /// Gradient at a stage, N.
    gradient: Vec<D>,
    /// Tangent at the start of the step, N/m.
    tangent: R::Tangent,
    /// Factors of the matrix of all stages.
    factors: FactorsOf<R, D>,
    /// The increments of the stages in `q`, m.
    u: [Vec<D>; STAGES],
    /// The increments of the stages in `v`, m/s.
    w: [Vec<D>; STAGES],
    /// Unknowns at a stage, m.
    q: Vec<D>,
    /// Velocities at a stage, m/s.
    v: Vec<D>,
    /// Loads in time at a stage; empty without any.
    timed: Vec<UnknownForce<D>>,
}

impl<D: Scalar, R: Rod<D>> Rosenbrock<D, R> {
    /// The stepper with zero work arrays for the unknowns of a rod.
    pub(crate) fn new(rod: &R) -> Self {
        let (n, tangent) = (rod.mass().len(), rod.zero_tangent());
        let zero = || vec![D::from(0.0); n];
        Self {
            gradient: zero(),
            factors: tangent.new_factors(),
            tangent,
            u: std::array::from_fn(|_| zero()),
            w: std::array::from_fn(|_| zero()),
            q: zero(),
            v: zero(),
            timed: Vec::new(),
        }
    }

    /// Advances `state` (unknowns, velocities, frames) over a step: one tangent and factorization of
    /// `M (1 + a c) + a^2 K` with `a = gamma h` and the mass damping `c`, and six solves with it. Loads in time are
    /// included; Kelvin-Voigt damping, drag and moving supports have no part in it. Counts are added to `work`.
    ///
    /// # Errors
    /// [`Singular`] if that matrix is.
    pub(crate) fn step(
        &mut self,
        step: &Step<'_, D, R>,
        state: &mut State<D, R::Frames>,
        work: &mut Work,
    ) -> Result<(), Singular> {
        let System { rod, derivatives, free, damping, .. } = step.system;
        let (mass, a) = (rod.mass(), GAMMA * step.h);
        let damped = damping.mass * a + 1.0;
        // One tangent and one factorization serve all six stages.
        work.tangents += 1;
        work.factorizations += 1;
        work.gradients += STAGES - 1;
        // Matrix M (1 + a c) + a^2 K at the start of the step.
        rod.tangent(&state.q, &state.frames, *derivatives, &mut self.gradient, &mut self.tangent);
        let start = step.time - step.h;
        step.system.timed_loads.add_tangent(start, &state.q, &mut self.tangent);
        self.factors.factor_sum(mass, damped, &self.tangent, D::from(a * a), free.clone())?;
        // Stages: place from the earlier increments, forces there, increments of this stage.
        for stage in 0..STAGES {
            self.move_to(PLACE[stage], state);
            if stage > 0 {
                rod.gradient(&self.q, &state.frames, *derivatives, &mut self.gradient);
            }
            self.add_timed_loads(stage, step, &state.q);
            self.solve(stage, step, damped);
        }
        // End of the step: the scheme is stiffly accurate, so that the last row of places is its
        // result.
        self.move_to(PLACE[STAGES], state);
        state.q.copy_from_slice(&self.q);
        state.v.copy_from_slice(&self.v);
        R::update_reference_frames(&mut state.frames, &state.q);
        Ok(())
    }

    /// Subtracts the loads in time of a stage from the gradient, N: their forces at the time of the stage, and [`LEAD`]
    /// times the step size times their rate at the start of the step, at the unknowns `q0`. A Rosenbrock scheme has
    /// this second part for equations that depend on time.
    fn add_timed_loads(&mut self, stage: usize, step: &Step<'_, D, R>, q0: &[D]) {
        let loads = &step.system.timed_loads;
        if loads.is_empty() {
            return;
        }
        let start = step.time - step.h;
        let lead = [start, LEAD[stage] * step.h];
        let t = start + TIME[stage] * step.h;
        loads.set_with_rate(t, lead, [&self.q, q0], &mut self.timed);
        for UnknownForce { unknown, force } in &self.timed {
            self.gradient[*unknown] -= *force;
        }
    }

    /// Sets `q` and `v` of the stepper to those of `state` plus the increments `u` and `w` of the first stages, each
    /// times its entry of `parts`, one entry per stage.
    fn move_to<F>(&mut self, parts: &[f64], state: &State<D, F>) {
        for (to, from, stages) in
            [(&mut self.q, &state.q, &self.u), (&mut self.v, &state.v, &self.w)]
        {
            to.copy_from_slice(from);
            for (part, stage) in parts.iter().zip(stages) {
                for (to, stage) in to.iter_mut().zip(stage) {
                    *to += *stage * *part;
                }
            }
        }
    }

    /// Solves for the increments `u` (positions) and `w` (velocities) of `stage`, from the stepper's gradient and
    /// velocities there and the increments of earlier stages with the weights `RATE`. `damped` is `1 + a c` with the
    /// mass damping `c`. The velocities are eliminated as in the header. Increments of held unknowns are not computed:
    /// `u` is zero there.
    fn solve(&mut self, stage: usize, step: &Step<'_, D, R>, damped: D) {
        let a = GAMMA * step.h;
        let (earlier_u, u) = self.u.split_at_mut(stage);
        let (earlier_w, w) = self.w.split_at_mut(stage);
        let (u, w) = (&mut u[0], &mut w[0]);
        // r in w, and s/M in u.
        w.copy_from_slice(&self.v);
        u.fill(D::from(0.0));
        // Sums of earlier stages over the step size, on the right-hand sides of both equations.
        for ((rate, from_u), from_w) in RATE[stage].iter().zip(earlier_u).zip(earlier_w) {
            let rate = rate / step.h;
            for ((u, w), (from_u, from_w)) in
                u.iter_mut().zip(w.iter_mut()).zip(from_u.iter().zip(&*from_w))
            {
                *w += *from_u * rate;
                *u += *from_w * rate;
            }
        }
        let mass = step.system.rod.mass();
        // The velocities are eliminated: one system of the size of the unknowns.
        for i in step.system.free.clone() {
            let s = mass[i] * (u[i] - step.system.damping.mass * self.v[i]) - self.gradient[i];
            u[i] = s * (a * a) + mass[i] * w[i] * damped * a;
        }
        self.factors.solve(u);
        let by_a = 1.0 / a;
        // Back substitution: w = u/a - r.
        for i in step.system.free.clone() {
            w[i] = u[i] * by_a - w[i];
        }
    }
}
