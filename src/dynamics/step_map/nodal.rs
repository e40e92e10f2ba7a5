//! The equations of an implicit step for one unknown, as linear maps of derivatives, each beside its transpose.
//!
//! From the derivatives `q0, v0, a0, n0` of place, velocity, acceleration and force at the start follow those at the
//! end. `f` is the derivative of the force at the end at fixed unknowns, `m` the mass, `c` the mass damping, `h` the
//! step size:
//!
//! ```text
//! n  = f + c m (d . [-q0, v0, a0])               forces with mass damping at fixed unknowns
//! r  = m (q0 + h v0 - i a0) - end n - start n0   right-hand side of J q1 = r
//! v1 = w . [q1 - q0, v0, a0]                     velocities at the end
//! a1 = b . [q1 - q0, v0, a0]                     accelerations at the end
//! n1 = n + (r - m q1)/end                        forces at the end: J = M + end dn1/dq1
//! ```
//!
//! The factors `d`, `i`, `end`, `start`, `w` and `b` are those of the [coefficients](StepCoefficients) of the step.
//! Derivatives by mass, mass damping and the scheme's parameter are separate functions. Forward functions take `G`
//! parameters in SIMD lanes; transposed ones take one derivative of a misfit by each result and return those by the
//! inputs.
//!
//! [`NodalEquations`]: `residual` is `[n, r]`, `force` is `n1`, `end` is `[v1, a1]`; each has a function
//! `.._transposed`. `with_mass_and_damping` and `with_scheme` add the parts by mass, mass damping and the scheme's
//! parameter to `[n, r]`, and `numbers_transposed` is the transpose of both. `end_by_scheme` are derivatives of `[v1,
//! a1]` by the scheme's parameter. `damped_velocity` and `damped_factors` are the velocity that mass damping and drag
//! act on, and its factors `d`.

use crate::dynamics::coefficients::StepCoefficients;
use crate::numerics::directions::Directions;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::map_components;
use num_dual::Dual64;

/// The factors of the equations of a step, or their derivatives by the scheme's parameter.
#[derive(Clone, Copy, Debug)]
struct StepFactors {
    /// Factor of the forces at the end, s^2.
    end: f64,
    /// Factor of the forces at the start, s^2.
    start: f64,
    /// Factor of mass and acceleration at the start, s^2; zero for schemes without accelerations.
    inertia: f64,
    /// Factors of change, velocity and acceleration at the start in the velocity that mass damping acts on.
    damped: [f64; 3],
    /// The same in the velocity at the end.
    velocity: [f64; 3],
    /// The same in the acceleration at the end.
    acceleration: [f64; 3],
}

/// Of one unknown: change over a step, m, velocity, m/s, and acceleration, m/s^2, at the start.
pub type StepMotion = [f64; 3];

/// The linear equations of one unknown over a step, with the same factors for all unknowns.
#[derive(Clone, Copy, Debug)]
pub struct NodalEquations {
    /// Length of the step, s.
    h: f64,
    /// Mass damping, 1/s.
    damping: f64,
    /// Factors of the equations.
    value: StepFactors,
    /// Derivatives by the scheme's parameter.
    slope: StepFactors,
    /// `1/end`, 1/s^2.
    by_end: f64,
}

/// `f0 change + f1 v0 + f2 a0`: the three `factors` times change, velocity and acceleration at the start of an unknown.
#[inline(always)]
fn dot(factors: &[f64; 3], step_motion: &StepMotion) -> f64 {
    factors[0] * step_motion[0] + factors[1] * step_motion[1] + factors[2] * step_motion[2]
}

/// [`dot`] for `G` parameters in SIMD lanes. `A` is whether the scheme has accelerations; without them the last term is
/// left out.
#[inline(always)]
fn combined<const A: bool, const G: usize>(
    factors: &[f64; 3],
    step_motion: &[Directions<G>; 3],
) -> Directions<G> {
    let sum = step_motion[0] * factors[0] + step_motion[1] * factors[1];
    if A { sum + step_motion[2] * factors[2] } else { sum }
}

impl StepFactors {
    /// The factors from the coefficients of a step; `part` selects their values or their derivatives.
    fn new<D: Scalar>(coefficients: &StepCoefficients<D>, part: fn(D) -> f64) -> Self {
        Self {
            end: part(coefficients.end),
            start: part(coefficients.start),
            inertia: coefficients.acceleration.as_ref().map_or(0.0, |a| part(a.inertia)),
            damped: map_components(&coefficients.damped_velocity_factors(), part),
            velocity: map_components(&coefficients.velocity_factors(), part),
            acceleration: map_components(&coefficients.acceleration_factors(), part),
        }
    }
}

impl NodalEquations {
    /// The equations with the coefficients of a step, the same with derivatives by the scheme's parameter, and the mass
    /// damping, 1/s.
    pub fn new(
        coefficients: &StepCoefficients<f64>,
        dual: &StepCoefficients<Dual64>,
        damping: f64,
    ) -> Self {
        let value = StepFactors::new(coefficients, |x| x);
        let slope = StepFactors::new(dual, |x| x.eps);
        Self { h: coefficients.h, damping, value, slope, by_end: value.end.recip() }
    }

    /// `[n, r]` of an unknown with mass `m` from `[q0, v0, a0, n0, f]`, by the first two equations of the header. `A`:
    /// whether the scheme has accelerations; without them `a0` is ignored.
    #[inline(always)]
    pub fn residual<const A: bool, const G: usize>(
        &self,
        m: f64,
        [q0, v0, a0, n0, force]: [Directions<G>; 5],
    ) -> [Directions<G>; 2] {
        let StepFactors { end, start, inertia, damped: [dq, dv, da], .. } = self.value;
        let mut n = force;
        if self.damping != 0.0 {
            n += combined::<A, G>(&[-dq, dv, da], &[q0, v0, a0]) * (self.damping * m);
        }
        let mut moved = q0 + v0 * self.h;
        if A {
            moved -= a0 * inertia;
        }
        [n, moved * m - n * end - n0 * start]
    }

    /// Transpose of [`residual`](Self::residual): from the derivatives of a number by `[n, r]`, those by
    /// `[q0, v0, a0, n0, f]`.
    #[inline(always)]
    pub fn residual_transposed(&self, m: f64, [n, r]: [f64; 2]) -> [f64; 5] {
        let StepFactors { end, start, inertia, damped: [dq, dv, da], .. } = self.value;
        // `n` is also in `r`, with the factor `-end`.
        let force = n - end * r;
        let damped = self.damping * m * force;
        [
            m * r - dq * damped,
            self.h * m * r + dv * damped,
            da * damped - inertia * m * r,
            -start * r,
            force,
        ]
    }

    /// The velocity and acceleration `[v1, a1]` at the end from `[q0, v0, a0, q1]`; `A`: whether the scheme has
    /// accelerations.
    #[inline(always)]
    pub fn end<const A: bool, const G: usize>(
        &self,
        [q0, v0, a0, q1]: [Directions<G>; 4],
    ) -> [Directions<G>; 2] {
        let step_motion = [q1 - q0, v0, a0];
        [
            combined::<A, G>(&self.value.velocity, &step_motion),
            combined::<A, G>(&self.value.acceleration, &step_motion),
        ]
    }

    /// Transpose of [`end`](Self::end): from the derivatives of a number by `[v1, a1]`, those by `[q0, v0, a0, q1]`.
    #[inline(always)]
    pub fn end_transposed(&self, [v1, a1]: [f64; 2]) -> [f64; 4] {
        let StepFactors { velocity: w, acceleration: b, .. } = &self.value;
        let change = v1 * w[0] + a1 * b[0];
        // Both depend on the difference `q1 - q0`, hence the opposite signs of its derivative.
        [-change, v1 * w[1] + a1 * b[1], v1 * w[2] + a1 * b[2], change]
    }

    /// The derivative `n1` of the force at the end of an unknown with mass `m`: `n + (r - m q1)/end`, from
    /// `[n, r, q1]`.
    #[inline(always)]
    pub fn force<const G: usize>(&self, m: f64, [n, r, q1]: [Directions<G>; 3]) -> Directions<G> {
        // The equation of the step, solved for the force: no further evaluation of forces.
        n + (r - q1 * m) * self.by_end
    }

    /// Transpose of [`force`](Self::force): from the derivative of a number by `n1`, those by `[n, r, q1]`.
    #[inline(always)]
    pub fn force_transposed(&self, m: f64, n1: f64) -> [f64; 3] {
        [n1, n1 * self.by_end, -(m * n1 * self.by_end)]
    }

    /// Of an unknown with mass `m`: the velocity that mass damping acts on, m/s; its change less that without forces,
    /// `change - h v0 + i a0`, m; the force at the end, N, which is `force` plus mass damping `c m` times the velocity.
    #[inline(always)]
    fn motion(&self, m: f64, step_motion: &StepMotion, force: f64) -> [f64; 3] {
        let velocity = dot(&self.value.damped, step_motion);
        let inertial =
            step_motion[0] - step_motion[1] * self.h + self.value.inertia * step_motion[2];
        [velocity, inertial, force + self.damping * m * velocity]
    }

    /// The derivatives by the scheme's parameter: of the residual at fixed forces, `m i' a0 + end' n1 + start' n0`, kg
    /// m, and of the mass damping force, `c m (d' . motion)`, N. `n1` and `n0`: forces at the end and at the start, N.
    /// A prime is the derivative of a factor.
    #[inline(always)]
    fn by_scheme(&self, m: f64, step_motion: &StepMotion, [n1, n0]: [f64; 2]) -> [f64; 2] {
        let StepFactors { end, start, inertia, damped, .. } = &self.slope;
        let residual = m * (inertia * step_motion[2]) + end * n1 + start * n0;
        [residual, self.damping * m * dot(damped, step_motion)]
    }

    /// Adds to the derivatives `[n, r]` the parts by those of the mass and of the mass damping, `[mass, damping]`. With
    /// the velocity `v` that mass damping acts on, and the change `x` less that without forces, the force gets `e =
    /// (damping m + mass c) v`, and the right-hand side `-mass x - end e`.
    #[inline(always)]
    pub fn with_mass_and_damping<const G: usize>(
        &self,
        m: f64,
        step_motion: &StepMotion,
        [mass, damping]: [Directions<G>; 2],
        [n, r]: [Directions<G>; 2],
    ) -> [Directions<G>; 2] {
        let [velocity, inertial, _] = self.motion(m, step_motion, 0.0);
        let rate = (damping * m + mass * self.damping) * velocity;
        [n + rate, r - mass * inertial - rate * self.value.end]
    }

    /// Adds to the derivatives `[n, r]` the parts by that of the scheme's parameter, `scheme`: the force gets the
    /// derivative of mass damping, the right-hand side minus `end` times that and minus the derivative of the residual.
    /// `forces`: those at the end without mass damping and all at the start, N.
    #[inline(always)]
    pub fn with_scheme<const G: usize>(
        &self,
        m: f64,
        step_motion: &StepMotion,
        forces: [f64; 2],
        scheme: Directions<G>,
        [n, r]: [Directions<G>; 2],
    ) -> [Directions<G>; 2] {
        let [.., n1] = self.motion(m, step_motion, forces[0]);
        let [residual, damped] = self.by_scheme(m, step_motion, [n1, forces[1]]);
        // The parameter changes the velocity that mass damping acts on, in the force and in the
        // right-hand side.
        let rate = scheme * damped;
        [n + rate, r - rate * self.value.end - scheme * residual]
    }

    /// Transpose of [`with_mass_and_damping`](Self::with_mass_and_damping) and [`with_scheme`](Self::with_scheme): from
    /// the derivatives of a number by `[n, r]`, those by mass, mass damping and the scheme's parameter, in this order.
    /// `forces` are those of `with_scheme`.
    #[inline(always)]
    pub fn numbers_transposed(
        &self,
        m: f64,
        step_motion: &StepMotion,
        forces: [f64; 2],
        [n, r]: [f64; 2],
    ) -> [f64; 3] {
        let [velocity, inertial, n1] = self.motion(m, step_motion, forces[0]);
        let [residual, damped] = self.by_scheme(m, step_motion, [n1, forces[1]]);
        // The force of mass damping is in `n`, and through `n` in `r`.
        let force = n - self.value.end * r;
        [
            self.damping * velocity * force - r * inertial,
            m * velocity * force,
            damped * force - r * residual,
        ]
    }

    /// The derivatives of velocity and acceleration at the end, `[v1, a1]`, by the scheme's parameter.
    #[inline(always)]
    pub fn end_by_scheme(&self, step_motion: &StepMotion) -> [f64; 2] {
        [dot(&self.slope.velocity, step_motion), dot(&self.slope.acceleration, step_motion)]
    }

    /// Length of the step, s.
    pub fn h(&self) -> f64 {
        self.h
    }

    /// Factors of change, 1/s, velocity and acceleration, s, at the start in the velocity that mass damping and drag
    /// act on. That is the velocity at the end, of an averaging scheme the mean velocity of the step.
    pub fn damped_factors(&self) -> [f64; 3] {
        self.value.damped
    }

    /// The velocity that mass damping and drag act on, m/s, and its derivative by the scheme's parameter.
    pub fn damped_velocity(&self, step_motion: &StepMotion) -> [f64; 2] {
        [dot(&self.value.damped, step_motion), dot(&self.slope.damped, step_motion)]
    }
}
