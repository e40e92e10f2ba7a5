//! The equations of an implicit time step and their coefficients: Newmark-beta, average vector field,
//! generalised-alpha.
//!
//! From the scheme, its parameter and the step size `h`, s, follow [`StepCoefficients`]: the factors of forces,
//! velocities, accelerations and strain rates at both ends of the step. Its functions, where `change` is `q1 - q0` of
//! an unknown:
//!
//! - `residual` and `residuals`: the residual of the equations (kg m), and minus the residuals of all unknowns.
//! - `velocity`, `velocities`, `accelerations` and `acceleration_at_end`: motion at the end. `velocity_factors` and
//!   `acceleration_factors` are the factors of change, velocity and acceleration at the start in it.
//! - `damped_velocity`: the velocity that mass damping and drag act on, with its factors (`damped_velocity_factors`)
//!   and its derivative by the change (`damped_velocity_slope`, 1/s). `add_damping` adds the forces of mass damping, N.
//! - `load_factor` and `load_interval`: the factor of mean loads in time in the residual, s^2, and the interval of the
//!   mean, s.
//! - `viscous_factor` and `viscous_past`: the factor of stiffnesses under Kelvin-Voigt damping, and the part of a
//!   strain's rate from the start, with minus sign.
//! - `averages`: whether forces are means over stages of the step (`Stage`: `AVERAGE` are four Gauss points, `END` is
//!   the end alone). `without_acceleration` leaves out the terms of accelerations; `map` converts the scalar type.
//!
//! Newton's method solves the equations for the unknowns `q1` at the end. `q0`, `v0`, `a0` are unknowns, velocities and
//! accelerations at the start, `M` the masses, `n(q, v)` the elastic gradient less the loads plus the damping force.
//!
//! # Newmark-beta
//!
//! The scheme of Huang and Jawed (2019), Eq. (6), with its misprint corrected. A step of length `h` solves
//!
//! ```text
//! M (q1 - q0) - h M v0 + h^2 beta^2 n1 + h^2 beta (1 - beta) n0 = 0
//! v1 = (q1 - q0)/(h beta) - (1 - beta)/beta v0
//! ```
//!
//! for `beta` in [1/2, 1]: implicit Euler at 1, second order without dissipation at 1/2. The printed Eq. (6a) has the
//! two factors of `n` exchanged. It contradicts Eq. (6c) and the paper's remark that beta = 1 gives Eq. (4); it does
//! not dissipate at any beta and is explicit at beta = 1.
//!
//! Kelvin-Voigt damping stresses every strain `s` with `K (s - s_natural + eta ds/dt)`. The rate at the end follows
//! from the change over the step as the velocity does, `r1 = (s1 - s0)/(h beta) - (1 - beta)/beta r0`. A damped
//! step is therefore an elastic one with stiffness `K c` and natural strain `(s_natural + shift)/c`, where
//! `c = 1 + eta/(h beta)` and `shift = eta (s0/(h beta) + (1 - beta)/beta r0)`. Its tangent stays symmetric.
//!
//! `r0` is the mean rate over the step before, `(s0 - s_before)/h`, and not the `r1` found there. At beta = 1/2 the
//! latter would continue from step to step as `r1 = 2 (s1 - s0)/h - r0`. This recursion damps no error, only changes
//! its sign, so that the errors of a stiff wire accumulate until it diverges. With the mean rates `d0` of the last step
//! and `d1` of this one, and the gradients `G0` and `G1` of the strain at both ends, the viscous force over a step is
//! `eta K (d1 G1 - (1 - beta) d0 (G1 - G0))`. It is of second order at beta = 1/2. Where the geometry is linear it is
//! just `eta K d1 G`, which never adds energy. The first step in general takes `d0 = 0`, which is of first order for
//! one step; a recorded start gives `d0`. It neglects the initial strain rates of a rod that starts with a velocity
//! while an end is held; they last for less than a step.
//!
//! # Average vector field
//!
//! At beta = 1/2 the mean of the forces at both ends of the step lets the energy of a stiff rod grow in long runs.
//! The mean over the straight line between them,
//!
//! ```text
//! M (q1 - q0) - h M v0 + h^2/2 int_0^1 n(q0 + s (q1 - q0)) ds = 0
//! v1 = 2 (q1 - q0)/h - v0
//! ```
//!
//! conserves the energy exactly (Quispel and McLaren 2008): its work over the step is the difference of the
//! potentials. The integral is Gauss quadrature with four points, which is exact to rounding for the rotations of
//! reasonable steps. Where it is not, the step is halved. The energy of [user-defined
//! energies](crate::energy::own), which may have corners, is only kept from growing. Mass damping acts on the mean
//! velocity `(q1 - q0)/h`; Kelvin-Voigt stress acts at both ends of the step as in Newmark-beta at 1/2. It does not
//! act at the stages in between: nodes on straight lines shorten every edge that turns, by `alpha^2/8` in the
//! middle of a turn by `alpha`. The dissipation of that stretching, `eta EA alpha^4/24` per step and length, is
//! more than that of bending in a wire.
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
//! where `am = (2 rho - 1)/(rho + 1)`, `af = rho/(rho + 1)`, `g = 1/2 - am + af` and `b = (1 - am + af)^2/4`. `rho`
//! is the factor of unresolved fast modes over a step. The scheme has second order at every `rho`. Slow modes
//! dissipate so little that rods which hardly stretch take large steps without spurious oscillation. Without `a1`
//! the first line is, times `b h^2/(1 - am)`, of Newmark's form. One term is added,
//! `M h^2 (am b/(1 - am) + b - 1/2) a0`.
//!
//! The rate of a strain where the forces are taken is `d1 + (1/2 - af)(d1 - d0)`, from the mean rates of this step
//! and the last. The rate at the end therefore counts as `((3/2 - af) d1 - d0/2)/(1 - af)`, beside `d0` at the
//! start. At `rho = 1` that is the rate of Newmark-beta, and at `rho = 0` the difference formula BDF2, which is
//! stable however stiff the damping.
//!
//! Where accelerations at the start are not known, the first step is one of implicit Euler.

use crate::numerics::scalar::Scalar;
use crate::numerics::vector::map_components;
use crate::scene::Scheme;

/// The coefficients of the equations of one step, made of its size and the scheme's parameter.
#[derive(Clone, Copy, Debug)]
pub struct StepCoefficients<D> {
    /// Length of the step, s.
    pub h: f64,
    /// Factor of the forces at the end of the step in the residual, s^2: h^2 beta^2 of Newmark-beta, b (1 - af) h^2/(1
    /// - am) of generalised-alpha. Of the average vector field h^2/2, the factor of the mean force.
    pub end: D,
    /// Factor of the forces at the start of the step in the residual, s^2: h^2 beta (1 - beta) of Newmark-beta, b af
    /// h^2/(1 - am) of generalised-alpha. Of the average vector field h^2/2, for the viscous forces there.
    pub start: D,
    /// Factor of the change of an unknown in its velocity at the end, 1/s: 1/(h beta) of Newmark-beta, g/(b h) of
    /// generalised-alpha.
    pub rate: D,
    /// Factor of minus the velocity at the start in the velocity at the end: (1 - beta)/beta of Newmark-beta, g/b - 1
    /// of generalised-alpha.
    pub old_velocity_factor: D,
    /// Terms of the acceleration at the start, for schemes that use it.
    pub acceleration: Option<Acceleration<D>>,
    /// Fraction of the step by which the interval of mean loads in time is later than the step: the forces of
    /// generalised-alpha do not act at the middle of the step.
    pub load_shift: D,
    /// Factors in the rate of a strain at the end: of its change over the step, 1/s, and of minus its mean rate over
    /// the step before, dimensionless.
    strain_rate: [D; 2],
    /// The points between start (0) and end (1) at which the forces are evaluated, with their weights.
    pub stages: &'static [Stage],
}

/// Coefficients of the accelerations, for generalised-alpha only.
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

/// A point on the straight line from the start of a step to its end, at which forces are evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// Fraction of the way from start (0) to end (1).
    pub place: f64,
    /// Weight of the forces there in the mean over the step.
    pub weight: f64,
}

/// The end of a step, with all the weight: the only stage of schemes that do not average.
pub const END: Stage = Stage { place: 1.0, weight: 1.0 };

/// Gauss-Legendre quadrature of four points on [0, 1]: exact for forces of the seventh degree.
pub const AVERAGE: [Stage; 4] = [
    Stage { place: 0.069_431_844_202_973_71, weight: 0.173_927_422_568_726_93 },
    Stage { place: 0.330_009_478_207_571_87, weight: 0.326_072_577_431_273_07 },
    Stage { place: 0.669_990_521_792_428_1, weight: 0.326_072_577_431_273_07 },
    Stage { place: 0.930_568_155_797_026_3, weight: 0.173_927_422_568_726_93 },
];

impl<D: Scalar> StepCoefficients<D> {
    /// The coefficients of a step of size `h`, s, of a scheme with its `parameter`: beta of Newmark-beta, rho of
    /// generalised-alpha, ignored by the average vector field. `knows_acceleration`: whether the accelerations at its
    /// start are known. Without them generalised-alpha takes one step of implicit Euler (Newmark-beta at beta = 1).
    /// Explicit and linearly implicit schemes get those of Newmark-beta and do not use them.
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
                    load_shift: D::from(0.0),
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

    /// The coefficients of Newmark-beta with the parameter `beta` and the step size `h`, s: `end = h^2 beta^2`,
    /// `start = h^2 beta (1 - beta)`, `rate = 1/(h beta)`, `old_velocity_factor = (1 - beta)/beta`. No acceleration,
    /// one stage at the end.
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
            load_shift: D::from(0.0),
            strain_rate: [rate, old_velocity_factor],
            stages: &[END],
        }
    }

    /// The coefficients of generalised-alpha with the spectral radius `rho` and the step size `h`, s, from `am`, `af`,
    /// `g` and `b` of the header: `end = b (1 - af) h^2/(1 - am)`, `start = b af h^2/(1 - am)`, `rate = g/(b h)`,
    /// `old_velocity_factor = g/b - 1`, `load_shift = 1/2 - af`. They have the terms of accelerations, and one stage at
    /// the end.
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
            load_shift: -forces + 0.5,
            strain_rate: [strain_rate[0] * (1.0 / h), strain_rate[1]],
            stages: &[END],
        }
    }

    /// The coefficients with every number converted to another scalar type by `convert`; the step size and the stages
    /// stay.
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
            load_shift: convert(self.load_shift),
            strain_rate: map_components(&self.strain_rate, convert),
            stages: self.stages,
        }
    }

    /// Factor of the mean forces of loads in time in the residual, s^2. It is `end + start`, as these forces act with
    /// one value at both ends of the step. For an averaging scheme it is `end`, the factor of the mean force.
    pub fn load_factor(&self) -> D {
        if self.averages() { self.end } else { self.end + self.start }
    }

    /// Start and end, s, of the interval over which loads in time are averaged, for a step that begins at the time
    /// `start`, s. It is the step, for generalised-alpha later by the fraction `load_shift` of it.
    pub fn load_interval(&self, start: f64) -> [D; 2] {
        [0.0, 1.0].map(|place| (self.load_shift + place) * self.h + start)
    }

    /// Whether the forces are a mean over several stages of the step: the average vector field only.
    #[inline]
    pub fn averages(&self) -> bool {
        self.stages.len() > 1
    }

    /// A copy without the terms of accelerations. Loops over unknowns use it where these are absent, so that they do
    /// not test for them.
    #[inline(always)]
    pub fn without_acceleration(self) -> Self {
        Self { acceleration: None, ..self }
    }

    /// Velocity at the end of the step, `rate change - old_velocity_factor v0` (Eq. 6c), of an unknown that changed
    /// by `change` from the velocity `v0`. Schemes with accelerations add a multiple of the acceleration `a0` at the
    /// start; others ignore it.
    #[inline]
    pub fn velocity(&self, change: D, v0: D, a0: D) -> D {
        let v1 = change * self.rate - self.old_velocity_factor * v0;
        match &self.acceleration {
            Some(acceleration) => v1 + acceleration.velocity * a0,
            None => v1,
        }
    }

    /// Factors `[f, g, k]` of the [velocity](Self::velocity) at the end, `f change + g v0 + k a0`: of the change of
    /// an unknown, 1/s, of its velocity, and of its acceleration at the start, s. The last is zero for schemes
    /// without accelerations.
    pub fn velocity_factors(&self) -> [D; 3] {
        let acceleration = self.acceleration.as_ref().map_or(D::from(0.0), |a| a.velocity);
        [self.rate, -self.old_velocity_factor, acceleration]
    }

    /// Factors of change, velocity and acceleration at the start in the [velocity that mass damping acts
    /// on](Self::damped_velocity); `[1/h, 0, 0]` for an averaging scheme.
    pub fn damped_velocity_factors(&self) -> [D; 3] {
        // An averaging scheme damps the mean velocity, which keeps the energy balance exact.
        let [mean, zero] = [D::from(1.0 / self.h), D::from(0.0)];
        if self.averages() { [mean, zero, zero] } else { self.velocity_factors() }
    }

    /// Factors of change, 1/s^2, velocity, 1/s, and acceleration at the start in the
    /// [acceleration](Self::acceleration_at_end) at the end. For schemes without accelerations they are those of `(v1 -
    /// v0)/h` with the [velocity](Self::velocity) `v1`: `[rate/h, -(old_velocity_factor + 1)/h, 0]`.
    pub fn acceleration_factors(&self) -> [D; 3] {
        let ([rate, old_velocity_factor, zero], by_h) = (self.velocity_factors(), 1.0 / self.h);
        let Some(Acceleration { end, .. }) = self.acceleration else {
            return [rate * by_h, (old_velocity_factor - 1.0) * by_h, zero];
        };
        end
    }

    /// The velocity that mass damping and drag act on: the mean velocity `change/h` for an averaging scheme, that at
    /// the end for others. `change` is that of the unknown over the step, `v0` and `a0` are its velocity and
    /// acceleration at the start.
    #[inline]
    pub fn damped_velocity(&self, change: D, v0: D, a0: D) -> D {
        if self.averages() { change * (1.0 / self.h) } else { self.velocity(change, v0, a0) }
    }

    /// Acceleration at the end of a step in which an unknown changed by `change` and its velocity from `v0` to `v1`,
    /// with the acceleration `a0` at the start. Without accelerations in the scheme it is the mean acceleration `(v1 -
    /// v0)/h`.
    #[inline]
    pub fn acceleration_at_end(&self, change: D, [v0, v1]: [D; 2], a0: D) -> D {
        match &self.acceleration {
            Some(Acceleration { end, .. }) => end[0] * change + end[1] * v0 + end[2] * a0,
            None => (v1 - v0) * (1.0 / self.h),
        }
    }

    /// Derivative of the [damped velocity](Self::damped_velocity) by the change of the unknown, 1/s: `1/h` for an
    /// averaging scheme, `rate` for others.
    #[inline]
    pub fn damped_velocity_slope(&self) -> D {
        if self.averages() { D::from(1.0 / self.h) } else { self.rate }
    }

    /// Residual of one degree of freedom, kg m: `mass (change - h v0) + end n1 + start n0` (the corrected Eq. 6a), plus
    /// `mass` times the term of the acceleration `a0`. `n1` and `n0` are the forces at the end and at the start, N; of
    /// an averaging scheme the mean force over the step, and the viscous force at the start.
    #[inline]
    pub fn residual(&self, mass: D, change: D, [v0, a0]: [D; 2], n1: D, n0: D) -> D {
        // Change over the step less that at constant velocity.
        let mut inertial = change - v0 * self.h;
        if let Some(acceleration) = &self.acceleration {
            inertial += acceleration.inertia * a0;
        }
        mass * inertial + self.end * n1 + self.start * n0
    }

    /// Overwrites `minus` with minus the residuals, kg m, of unknowns that move from `q0` to `q1`; all lists have its
    /// length or more. Velocities at the start are `v0`, forces `n0`; forces at the end are `n1`. The function `a0`
    /// returns the acceleration of an unknown at the start; only schemes with accelerations use it.
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

    /// Adds the forces of mass damping, `c m v`, N, to `n1`. `damping` is `c`, 1/s; `v` is the [damped
    /// velocity](Self::damped_velocity) from the unknowns `q1` and `q0` at both ends and the velocities `v0` and
    /// accelerations `a0` at the start.
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

    /// Overwrites `v1` with the velocities at the end, from the unknowns `q1` at the end and `q0`, velocities `v0`
    /// and accelerations `a0` at the start: `rate (q1 - q0) - old_velocity_factor v0`, plus the term of `a0` of
    /// schemes with accelerations.
    #[inline(always)]
    pub fn velocities(self, [q1, q0, v0]: [&[D]; 3], a0: impl Fn(usize) -> D, v1: &mut [D]) {
        let count = v1.len();
        let (q1, q0, v0) = (&q1[..count], &q0[..count], &v0[..count]);
        for i in 0..count {
            v1[i] = self.velocity(q1[i] - q0[i], v0[i], a0(i));
        }
    }

    /// Overwrites `a1` with the [accelerations at the end](Self::acceleration_at_end), from unknowns and velocities
    /// at both ends and the accelerations `a0` at the start.
    #[inline(always)]
    pub fn accelerations(self, [q1, q0, v0, v1]: [&[D]; 4], a0: impl Fn(usize) -> D, a1: &mut [D]) {
        let count = a1.len();
        let (q1, q0, v0, v1) = (&q1[..count], &q0[..count], &v0[..count], &v1[..count]);
        for i in 0..count {
            a1[i] = self.acceleration_at_end(q1[i] - q0[i], [v0[i], v1[i]], a0(i));
        }
    }

    /// The viscous time `eta`, s, multiplied by the weight of an end of the step: 1/2 for an averaging scheme, which
    /// takes half of the viscous stress at each end, else 1.
    #[inline]
    fn viscous(&self, eta: D) -> D {
        if self.averages() { eta * 0.5 } else { eta }
    }

    /// Factor `c` of the stiffnesses under Kelvin-Voigt damping of time `eta`, s: `1 + eta r` with the factor `r` of a
    /// strain's change in its rate at the end, for Newmark-beta `1/(h beta)`. Averaging schemes: that of the viscous
    /// stress alone, `eta/h`.
    #[inline]
    pub fn viscous_factor(&self, eta: D) -> D {
        let viscous = self.viscous(eta) * self.strain_rate[0];
        if self.averages() { viscous } else { viscous + 1.0 }
    }

    /// Minus the part of a strain's rate at the end, 1/s, that follows from the start: from the strain `strain0` there
    /// and the mean rate `rate0` over the step before. It is `rate strain0 + old_velocity_factor rate0`, with the
    /// factors for strains. The time of Kelvin-Voigt damping multiplied by it is the shift of the natural strain.
    #[inline]
    pub fn viscous_past(&self, strain0: D, rate0: D) -> D {
        let [rate, old_velocity_factor] = self.strain_rate;
        strain0 * rate + old_velocity_factor * rate0
    }
}
