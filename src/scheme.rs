//! Time stepping: the formulas of a step.
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
//! Kelvin-Voigt damping stresses every strain `s` with `K (s - s_natural + eta ds/dt)`. The rate
//! obeys the same rule as the velocity, `r1 = (s1 - s0)/(h beta) - (1 - beta)/beta r0`, so a
//! damped step is an elastic one with stiffness `K c` and natural strain
//! `(s_natural + shift)/c`, where `c = 1 + eta/(h beta)` and
//! `shift = eta (s0/(h beta) + (1 - beta)/beta r0)`. Its tangent stays symmetric.
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
//! rotations of reasonable steps. Damping acts on the mean velocity `(q1 - q0)/h`; Kelvin-Voigt
//! stress at the part `s` of the way on the mean rate so far, `(s(q_s) - s0)/(s h)`.

use crate::scalar::Scalar;
use crate::scene::Scheme;

/// The numbers of one step.
#[derive(Clone, Copy, Debug)]
pub struct Formulas<D> {
    /// Step, s.
    pub h: f64,
    /// Factor h^2 beta^2 of the forces at the end, s^2; h^2/2 of their average.
    pub end: D,
    /// Factor h^2 beta (1 - beta) of the forces at the start, s^2.
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

/// The end of the step alone.
const AT_END: [Stage; 1] = [Stage { place: 1.0, weight: 1.0 }];

/// Gauss-Legendre quadrature of four points on [0, 1]: exact for forces of the seventh degree.
const AVERAGE: [Stage; 4] = [
    Stage { place: 0.069_431_844_202_973_71, weight: 0.173_927_422_568_726_93 },
    Stage { place: 0.330_009_478_207_571_87, weight: 0.326_072_577_431_273_07 },
    Stage { place: 0.669_990_521_792_428_1, weight: 0.326_072_577_431_273_07 },
    Stage { place: 0.930_568_155_797_026_3, weight: 0.173_927_422_568_726_93 },
];

impl<D: Scalar> Formulas<D> {
    /// The step of length `h`, s.
    #[inline]
    pub fn new(scheme: Scheme, beta: D, h: f64) -> Self {
        match scheme {
            Scheme::NewmarkBeta => {
                let rest = -beta + 1.0;
                let inverse = beta.recip();
                Self {
                    h,
                    end: beta * beta * (h * h),
                    start: beta * rest * (h * h),
                    rate: inverse * (1.0 / h),
                    memory: rest * inverse,
                    stages: &AT_END,
                }
            }
            // Those that need no iteration have no such formulas, and never ask.
            Scheme::AverageVectorField | Scheme::Verlet | Scheme::Pefrl | Scheme::Rodas4 => Self {
                h,
                end: D::from(0.5 * h * h),
                start: D::from(0.0),
                rate: D::from(2.0 / h),
                memory: D::from(1.0),
                stages: &AVERAGE,
            },
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

    /// The velocity that damping acts on: at the end, or the mean.
    #[inline]
    pub fn dragged(&self, change: D, v0: D) -> D {
        if self.averages() { change * (1.0 / self.h) } else { self.rate(change, v0) }
    }

    /// Derivative of [`dragged`](Self::dragged) by the change, 1/s.
    #[inline]
    pub fn drag_rate(&self) -> D {
        if self.averages() { D::from(1.0 / self.h) } else { self.rate }
    }

    /// Residual of one degree of freedom, N s^2: the corrected Eq. (6a).
    #[inline]
    pub fn residual(&self, mass: D, change: D, v0: D, n1: D, n0: D) -> D {
        mass * (change - v0 * self.h) + self.end * n1 + self.start * n0
    }

    /// Factor `c` of the stiffnesses under Kelvin-Voigt damping of time `eta`, s.
    #[inline]
    pub fn viscous_factor(&self, eta: D, stage: Stage) -> D {
        match self.averages() {
            true => eta * (1.0 / (stage.place * self.h)) + 1.0,
            false => eta * self.rate + 1.0,
        }
    }

    /// Shift of a natural strain under Kelvin-Voigt damping.
    #[inline]
    pub fn viscous_shift(&self, eta: D, strain0: D, rate0: D, stage: Stage) -> D {
        match self.averages() {
            true => eta * strain0 * (1.0 / (stage.place * self.h)),
            false => eta * (strain0 * self.rate + self.memory * rate0),
        }
    }
}
