//! The equations of a step that Newton's method solves, and their numbers.
//!
//! # Newmark-beta
//!
//! The paper's scheme, Eq. (6), with its misprint corrected.
//!
//! With `n(q, v)` the elastic gradient less the loads plus the damping force, a step of length `h`
//! solves
//!
//! ```text
//! M (q1 - q0) - h M v0 + h^2 beta^2 n1 + h^2 beta (1 - beta) n0 = 0
//! v1 = (q1 - q0)/(h beta) - (1 - beta)/beta v0
//! ```
//!
//! for `beta` in [1/2, 1]: implicit Euler at 1, second order without dissipation at 1/2. The
//! printed Eq. (6a) has the two factors of `n` exchanged and contradicts both Eq. (6c) and the
//! paper's own remark that beta = 1 gives Eq. (4); it does not dissipate at any beta and is
//! explicit at beta = 1.
//!
//! Kelvin-Voigt damping stresses every strain `s` with `K (s - s_natural + eta ds/dt)`. The rate at
//! the end follows from the change over the step as the velocity does,
//! `r1 = (s1 - s0)/(h beta) - (1 - beta)/beta r0`, so a damped step is an elastic one with stiffness
//! `K c` and natural strain `(s_natural + shift)/c`, where `c = 1 + eta/(h beta)` and
//! `shift = eta (s0/(h beta) + (1 - beta)/beta r0)`. Its tangent stays symmetric.
//!
//! `r0` is the mean rate over the step before, `(s0 - s_before)/h`, and not the `r1` found there: at
//! beta = 1/2 that would continue from step to step as `r1 = 2 (s1 - s0)/h - r0`. This recursion damps
//! no error, only changes its sign, so that the errors of a stiff wire accumulate until it diverges.
//! The viscous force over a step is then `eta K (d1 G1 - (1 - beta) d0 (G1 - G0))` with the mean rates
//! `d` of this step and the last and the gradients `G` of the strain at both ends: of second order at
//! beta = 1/2, and where the geometry is linear just `eta K d1 G`, which never adds energy. The first
//! step takes `d0 = 0`: that is of first order for one step. It neglects the initial strain rates of a
//! rod that starts with a velocity while an end is held; they last for less than a step.
//!
//! # Average vector field
//!
//! beta = 1/2 takes the mean of the forces at both ends of the step and lets the energy of a stiff
//! rod grow in the long run. The mean over the straight line between them,
//!
//! ```text
//! M (q1 - q0) - h M v0 + h^2/2 int_0^1 n(q0 + s (q1 - q0)) ds = 0
//! v1 = 2 (q1 - q0)/h - v0
//! ```
//!
//! keeps the energy exactly (Quispel and McLaren 2008): its work over the step is the difference
//! of the potentials. The integral is Gauss's with four points, which is exact to rounding for the
//! rotations of reasonable steps (where it is not, the step is taken in halves; of [energies of one's
//! own](crate::energy::own), which may have corners, the energy is only kept from growing). Damping
//! acts on the mean velocity `(q1 - q0)/h`; Kelvin-Voigt stress acts at both ends of the step as in
//! Newmark-beta at 1/2. It does not act at the stages between them: nodes on straight lines shorten
//! every edge that turns, by `alpha^2/8` in the middle of a turn by `alpha`, and the dissipation of
//! that stretching, `eta EA alpha^4/24` a step and length, is more than that of bending in a wire.

//!
//! # Generalised-alpha
//!
//! Chung and Hulbert's scheme (1993), with forces and accelerations between the ends of the step,
//!
//! ```text
//! (1 - am) M a1 + am M a0 + (1 - af) n1 + af n0 = 0
//! q1 = q0 + h v0 + h^2 ((1/2 - b) a0 + b a1)
//! v1 = v0 + h ((1 - g) a0 + g a1)
//! ```
//!
//! where `am = (2 rho - 1)/(rho + 1)`, `af = rho/(rho + 1)`, `g = 1/2 - am + af` and
//! `b = (1 - am + af)^2/4` for the factor `rho` of unresolved fast modes over a step:
//! second order at every `rho`, and so little dissipation of slow modes that rods which hardly
//! stretch take large steps without spurious oscillation. Without `a1` the first line is, times
//! `b h^2/(1 - am)`, of Newmark's form with one more term, `M h^2 (am b/(1 - am) + b - 1/2) a0`.
//!
//! The rate of a strain where the forces are taken is `d1 + (1/2 - af)(d1 - d0)`, from the mean rates
//! of this step and the last, so that the rate at the end counts as
//! `((3/2 - af) d1 - d0/2)/(1 - af)` beside `d0` at the start: that of Newmark-beta at `rho = 1`,
//! and at `rho = 0` the difference formula BDF2, which is stable however stiff the damping.
//!
//! Where accelerations at the start are not known, the first step is one of implicit Euler.

use crate::numerics::scalar::Scalar;
use crate::numerics::vector::map_components;
use crate::scene::Scheme;

/// The numbers of one step.
#[derive(Clone, Copy, Debug)]
pub struct StepCoefficients<D> {
    /// Length of the step, s.
    pub h: f64,
    /// Factor h^2 beta^2 of the forces at the end, s^2; h^2/2 of their average.
    pub end: D,
    /// Factor h^2 beta (1 - beta) of the forces at the start, s^2; h^2/2 of the viscous ones there.
    pub start: D,
    /// 1/(h beta), 1/s.
    pub rate: D,
    /// (1 - beta)/beta.
    pub old_velocity_factor: D,
    /// Terms of the acceleration at the start, for schemes that use it.
    pub acceleration: Option<Acceleration<D>>,
    /// Factors of the changes of strains and of their rates before in the rates at the end, 1/s and 1.
    strain_rate: [D; 2],
    /// Where between start (0) and end (1) the forces are taken, and with which weight.
    pub stages: &'static [Stage],
}

/// The terms of the accelerations.
#[derive(Clone, Copy, Debug)]
pub struct Acceleration<D> {
    /// Factor of the masses and the acceleration at the start in the residual, s^2.
    pub inertia: D,
    /// Factor of the acceleration at the start in the velocity at the end, s.
    pub velocity: D,
    /// The acceleration at the end: factors of the change of place, 1/s^2, of the velocity at the start,
    /// 1/s, and of the acceleration there.
    pub end: [D; 3],
}

/// A point on the straight line from the start of a step to its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// Part of the way.
    pub place: f64,
    /// Weight of the forces there.
    pub weight: f64,
}

/// The end of a step.
pub const END: Stage = Stage { place: 1.0, weight: 1.0 };

/// Gauss-Legendre quadrature of four points on [0, 1]: exact for forces of the seventh degree.
const AVERAGE: [Stage; 4] = [
    Stage { place: 0.069_431_844_202_973_71, weight: 0.173_927_422_568_726_93 },
    Stage { place: 0.330_009_478_207_571_87, weight: 0.326_072_577_431_273_07 },
    Stage { place: 0.669_990_521_792_428_1, weight: 0.326_072_577_431_273_07 },
    Stage { place: 0.930_568_155_797_026_3, weight: 0.173_927_422_568_726_93 },
];

impl<D: Scalar> StepCoefficients<D> {
    /// The step of length `h`, s, of a scheme with its `parameter`. `knows_acceleration`: whether the
    /// accelerations at its start are known.
    #[inline]
    pub fn new(scheme: Scheme, parameter: D, knows_acceleration: bool, h: f64) -> Self {
        match scheme {
            Scheme::AverageVectorField => {
                let (rate, old_velocity_factor) = (D::from(2.0 / h), D::from(1.0));
                Self {
                    h,
                    end: D::from(0.5 * h * h),
                    start: D::from(0.5 * h * h),
                    rate,
                    old_velocity_factor,
                    acceleration: None,
                    strain_rate: [rate, old_velocity_factor],
                    stages: &AVERAGE,
                }
            }
            Scheme::GeneralisedAlpha if knows_acceleration => Self::generalised_alpha(parameter, h),
            // Implicit Euler needs no acceleration at the start.
            Scheme::GeneralisedAlpha => Self::newmark(D::from(1.0), h),
            // Schemes that solve no equations do not use the coefficients.
            _ => Self::newmark(parameter, h),
        }
    }

    /// The coefficients of the Newmark-beta scheme with parameter `beta` and step size `h`, s.
    #[inline]
    fn newmark(beta: D, h: f64) -> Self {
        let rest = -beta + 1.0;
        let inverse = beta.recip();
        let (rate, old_velocity_factor) = (inverse * (1.0 / h), rest * inverse);
        Self {
            h,
            end: beta * beta * (h * h),
            start: beta * rest * (h * h),
            rate,
            old_velocity_factor,
            acceleration: None,
            strain_rate: [rate, old_velocity_factor],
            stages: &[END],
        }
    }

    /// The coefficients of the generalised-alpha scheme with the spectral radius `rho` and step size `h`, s.
    fn generalised_alpha(rho: D, h: f64) -> Self {
        // am and af of Chung and Hulbert, then gamma and beta for second order.
        let part = (rho + 1.0).recip();
        let (masses, forces) = ((rho * 2.0 - 1.0) * part, rho * part);
        let gamma = forces - masses + 0.5;
        let beta = (forces - masses + 1.0).powi(2) * 0.25;
        let inverse = beta.recip();
        // Weight b/(1 - am), and 1 - af, the part of the forces at the end.
        let (now, weight) = (-forces + 1.0, beta / (-masses + 1.0));
        // Strain rate where the forces are taken, over the part of the forces at the end.
        let strain_rate = [-forces + 1.5, D::from(0.5)].map(|factor| factor / now);
        Self {
            h,
            end: weight * now * (h * h),
            start: weight * forces * (h * h),
            rate: gamma * inverse * (1.0 / h),
            old_velocity_factor: gamma * inverse - 1.0,
            acceleration: Some(Acceleration {
                inertia: (weight * masses + beta - 0.5) * (h * h),
                velocity: -(gamma * inverse * 0.5 - 1.0) * h,
                end: [inverse * (1.0 / (h * h)), -(inverse * (1.0 / h)), -(inverse * 0.5 - 1.0)],
            }),
            strain_rate: [strain_rate[0] * (1.0 / h), strain_rate[1]],
            stages: &[END],
        }
    }

    /// The coefficients with every number converted to another scalar type.
    pub fn map<E: Copy + From<f64>>(&self, convert: impl Fn(D) -> E + Copy) -> StepCoefficients<E> {
        StepCoefficients {
            h: self.h,
            end: convert(self.end),
            start: convert(self.start),
            rate: convert(self.rate),
            old_velocity_factor: convert(self.old_velocity_factor),
            acceleration: self.acceleration.as_ref().map(|of| Acceleration {
                inertia: convert(of.inertia),
                velocity: convert(of.velocity),
                end: map_components(&of.end, convert),
            }),
            strain_rate: map_components(&self.strain_rate, convert),
            stages: self.stages,
        }
    }

    /// Whether the forces are an average over the step.
    #[inline]
    pub fn averages(&self) -> bool {
        self.stages.len() > 1
    }

    /// The same without accelerations, so that loops over unknowns do not test for them.
    #[inline(always)]
    pub fn without_acceleration(self) -> Self {
        Self { acceleration: None, ..self }
    }

    /// Velocity at the end of an unknown that changed by `change` from the velocity `v0`, Eq. (6c), and
    /// the acceleration `a0`, of which schemes without know nothing.
    #[inline]
    pub fn velocity(&self, change: D, v0: D, a0: D) -> D {
        let v1 = change * self.rate - self.old_velocity_factor * v0;
        match &self.acceleration {
            Some(acceleration) => v1 + acceleration.velocity * a0,
            None => v1,
        }
    }

    /// Factors of the change of an unknown, of its velocity and of its acceleration at the start in the
    /// [velocity](Self::velocity) at the end.
    pub fn velocity_factors(&self) -> [D; 3] {
        let acceleration = self.acceleration.as_ref().map_or(D::from(0.0), |a| a.velocity);
        [self.rate, -self.old_velocity_factor, acceleration]
    }

    /// The same in the [velocity that mass damping acts on](Self::damped_velocity).
    pub fn damped_velocity_factors(&self) -> [D; 3] {
        // An averaging scheme damps the mean velocity, which keeps the energy balance exact.
        let [mean, zero] = [D::from(1.0 / self.h), D::from(0.0)];
        if self.averages() { [mean, zero, zero] } else { self.velocity_factors() }
    }

    /// The same in the [acceleration](Self::acceleration_at_end) at the end.
    pub fn acceleration_factors(&self) -> [D; 3] {
        let ([rate, old_velocity_factor, zero], by_h) = (self.velocity_factors(), 1.0 / self.h);
        let Some(Acceleration { end, .. }) = self.acceleration else {
            return [rate * by_h, (old_velocity_factor - 1.0) * by_h, zero];
        };
        end
    }

    /// The velocity that mass damping acts on, from the change of the unknown over the step, and its velocity and
    /// acceleration at the start: the mean velocity for an averaging scheme, that at the end for others.
    #[inline]
    pub fn damped_velocity(&self, change: D, v0: D, a0: D) -> D {
        if self.averages() { change * (1.0 / self.h) } else { self.velocity(change, v0, a0) }
    }

    /// Acceleration at the end of a step in which an unknown changed by `change`, and its velocity from
    /// `v0` to `v1`.
    #[inline]
    pub fn acceleration_at_end(&self, change: D, [v0, v1]: [D; 2], a0: D) -> D {
        match &self.acceleration {
            Some(Acceleration { end, .. }) => end[0] * change + end[1] * v0 + end[2] * a0,
            None => (v1 - v0) * (1.0 / self.h),
        }
    }

    /// Derivative of the [damped velocity](Self::damped_velocity) by the change, 1/s.
    #[inline]
    pub fn damped_velocity_slope(&self) -> D {
        if self.averages() { D::from(1.0 / self.h) } else { self.rate }
    }

    /// Residual of one degree of freedom, N s^2: the corrected Eq. (6a).
    #[inline]
    pub fn residual(&self, mass: D, change: D, [v0, a0]: [D; 2], n1: D, n0: D) -> D {
        // Change over the step less that at constant velocity.
        let mut inertial = change - v0 * self.h;
        if let Some(acceleration) = &self.acceleration {
            inertial += acceleration.inertia * a0;
        }
        mass * inertial + self.end * n1 + self.start * n0
    }

    /// Writes minus the residuals of unknowns that go from `q0` with the velocities `v0` to `q1`, under
    /// forces `n0` at the start and `n1` at the end. The accelerations are asked for by a function, so
    /// that a scheme without does not look for them.
    #[inline(always)]
    pub fn residuals(
        self,
        mass: &[D],
        [q1, q0, v0, n1, n0]: [&[D]; 5],
        a0: impl Fn(usize) -> D,
        minus: &mut [D],
    ) {
        // Slices of one length: the compiler removes the bounds checks and vectorizes.
        let (count, mass) = (minus.len(), &mass[..minus.len()]);
        let (q1, q0, v0) = (&q1[..count], &q0[..count], &v0[..count]);
        let (n1, n0) = (&n1[..count], &n0[..count]);
        for i in 0..count {
            let (change, start) = (q1[i] - q0[i], [v0[i], a0(i)]);
            minus[i] = -self.residual(mass[i], change, start, n1[i], n0[i]);
        }
    }

    /// Adds the forces of mass damping to `n1`, likewise.
    #[inline(always)]
    pub fn add_damping(
        self,
        mass: &[D],
        damping: D,
        [q1, q0, v0]: [&[D]; 3],
        a0: impl Fn(usize) -> D,
        n1: &mut [D],
    ) {
        let (count, mass) = (n1.len(), &mass[..n1.len()]);
        let (q1, q0, v0) = (&q1[..count], &q0[..count], &v0[..count]);
        for i in 0..count {
            n1[i] += damping * mass[i] * self.damped_velocity(q1[i] - q0[i], v0[i], a0(i));
        }
    }

    /// Writes the velocities at the end, likewise.
    #[inline(always)]
    pub fn velocities(self, [q1, q0, v0]: [&[D]; 3], a0: impl Fn(usize) -> D, v1: &mut [D]) {
        let count = v1.len();
        let (q1, q0, v0) = (&q1[..count], &q0[..count], &v0[..count]);
        for i in 0..count {
            v1[i] = self.velocity(q1[i] - q0[i], v0[i], a0(i));
        }
    }

    /// Writes the accelerations at the end, likewise.
    #[inline(always)]
    pub fn accelerations(self, [q1, q0, v0, v1]: [&[D]; 4], a0: impl Fn(usize) -> D, a1: &mut [D]) {
        let count = a1.len();
        let (q1, q0, v0, v1) = (&q1[..count], &q0[..count], &v0[..count], &v1[..count]);
        for i in 0..count {
            a1[i] = self.acceleration_at_end(q1[i] - q0[i], [v0[i], v1[i]], a0(i));
        }
    }

    /// The part of the viscous stress at an end that its forces count with: an average counts both
    /// ends by half, and once.
    #[inline]
    fn viscous(&self, eta: D) -> D {
        if self.averages() { eta * 0.5 } else { eta }
    }

    /// Factor `c` of the stiffnesses under Kelvin-Voigt damping of time `eta`, s; of an average
    /// that of the viscous stress alone.
    #[inline]
    pub fn viscous_factor(&self, eta: D) -> D {
        let viscous = self.viscous(eta) * self.strain_rate[0];
        if self.averages() { viscous } else { viscous + 1.0 }
    }

    /// The part of minus a strain's rate at the end that follows from the strain and rate before, 1/s: times the time of
    /// Kelvin-Voigt damping, the shift of a natural strain.
    #[inline]
    pub fn viscous_past(&self, strain0: D, rate0: D) -> D {
        let [rate, old_velocity_factor] = self.strain_rate;
        strain0 * rate + old_velocity_factor * rate0
    }
}
