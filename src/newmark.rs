//! The paper's time stepping, Eq. (6), with its misprint corrected.
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

use crate::scalar::Scalar;

/// The numbers of one step.
#[derive(Clone, Copy, Debug)]
pub struct NewmarkBeta<D> {
    /// Step, s.
    pub h: f64,
    /// Factor h^2 beta^2 of the forces at the end, s^2.
    pub end: D,
    /// Factor h^2 beta (1 - beta) of the forces at the start, s^2.
    pub start: D,
    /// 1/(h beta), 1/s.
    pub rate: D,
    /// (1 - beta)/beta.
    pub memory: D,
}

impl<D: Scalar> NewmarkBeta<D> {
    /// The step of length `h`, s.
    #[inline]
    pub fn new(beta: D, h: f64) -> Self {
        let rest = -beta + 1.0;
        let inverse = beta.recip();
        Self {
            h,
            end: beta * beta * (h * h),
            start: beta * rest * (h * h),
            rate: inverse * (1.0 / h),
            memory: rest * inverse,
        }
    }

    /// Rate at the end of a quantity that changed by `change`: Eq. (6c).
    #[inline]
    pub fn rate(&self, change: D, rate0: D) -> D {
        change * self.rate - self.memory * rate0
    }

    /// Residual of one degree of freedom, N s^2: the corrected Eq. (6a).
    #[inline]
    pub fn residual(&self, mass: D, change: D, v0: D, n1: D, n0: D) -> D {
        mass * (change - v0 * self.h) + self.end * n1 + self.start * n0
    }

    /// Factor `c` of the stiffnesses under Kelvin-Voigt damping of time `eta`, s.
    #[inline]
    pub fn viscous_factor(&self, eta: D) -> D {
        eta * self.rate + 1.0
    }

    /// Shift of a natural strain under Kelvin-Voigt damping.
    #[inline]
    pub fn viscous_shift(&self, eta: D, strain0: D, rate0: D) -> D {
        eta * (strain0 * self.rate + self.memory * rate0)
    }
}
