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
//! beta = 1/2 that would go on from step to step as `r1 = 2 (s1 - s0)/h - r0`, which forgets no
//! error, only turns its sign, and feeds them into a stiff wire until it shakes itself to pieces.
//! The viscous force over a step is then `eta K (d1 G1 - (1 - beta) d0 (G1 - G0))` with the mean rates
//! `d` of this step and the last and the gradients `G` of the strain at both ends: of second order at
//! beta = 1/2, and where the geometry is linear just `eta K d1 G`, which never adds energy. The first
//! step takes `d0 = 0`: that is of first order for one step, and forgets the rates of a rod that is
//! thrown while an end is held, which last for less than a step.
//!
//! # Average vector field
//!
//! beta = 1/2 takes the mean of the forces at both ends of the step and lets the energy of a stiff
//! rod grow in the long run. The mean over the straight way between them,
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
//! Newmark-beta at 1/2. On the way between them it has no business: nodes that go straight shorten
//! every edge that turns, by `alpha^2/8` in the middle of a turn by `alpha`, and the dissipation of
//! that stretching, `eta EA alpha^4/24` a step and length, is more than that of bending in a wire.

use crate::numerics::scalar::Scalar;
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
    pub memory: D,
    /// Where between start (0) and end (1) the forces are taken, and with which weight.
    pub stages: &'static [Stage],
}

/// A point on the straight way from the start of a step to its end.
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
    /// The step of length `h`, s.
    #[inline]
    pub fn new(scheme: Scheme, beta: D, h: f64) -> Self {
        match scheme {
            Scheme::AverageVectorField => Self {
                h,
                end: D::from(0.5 * h * h),
                start: D::from(0.5 * h * h),
                rate: D::from(2.0 / h),
                memory: D::from(1.0),
                stages: &AVERAGE,
            },
            // Schemes that solve no equations never ask.
            _ => {
                let rest = -beta + 1.0;
                let inverse = beta.recip();
                Self {
                    h,
                    end: beta * beta * (h * h),
                    start: beta * rest * (h * h),
                    rate: inverse * (1.0 / h),
                    memory: rest * inverse,
                    stages: &[END],
                }
            }
        }
    }

    /// Whether the forces are an average over the step.
    #[inline]
    pub fn averages(&self) -> bool {
        self.stages.len() > 1
    }

    /// Rate at the end of a quantity that changed by `change`: Eq. (6c).
    #[inline]
    pub fn rate(&self, change: D, rate0: D) -> D {
        change * self.rate - self.memory * rate0
    }

    /// The velocity that mass damping acts on: at the end, or the mean.
    #[inline]
    pub fn damped_velocity(&self, change: D, v0: D) -> D {
        if self.averages() { change * (1.0 / self.h) } else { self.rate(change, v0) }
    }

    /// Derivative of the [damped velocity](Self::damped_velocity) by the change, 1/s.
    #[inline]
    pub fn damped_velocity_slope(&self) -> D {
        if self.averages() { D::from(1.0 / self.h) } else { self.rate }
    }

    /// Residual of one degree of freedom, N s^2: the corrected Eq. (6a).
    #[inline]
    pub fn residual(&self, mass: D, change: D, v0: D, n1: D, n0: D) -> D {
        mass * (change - v0 * self.h) + self.end * n1 + self.start * n0
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
        let viscous = self.viscous(eta) * self.rate;
        if self.averages() { viscous } else { viscous + 1.0 }
    }

    /// Shift of a natural strain under Kelvin-Voigt damping.
    #[inline]
    pub fn viscous_shift(&self, eta: D, strain0: D, rate0: D) -> D {
        self.viscous(eta) * (strain0 * self.rate + self.memory * rate0)
    }

    /// The same at the start of a step, where the rate is known and the factor is 1.
    #[inline]
    pub fn viscous_shift_at(&self, eta: D, strain: D, rate: D) -> D {
        let viscous = self.viscous(eta) * rate;
        if self.averages() { strain - viscous } else { -viscous }
    }
}
