//! Time stepping: which schemes there are, and the formulas of those that iterate.
//!
//! | scheme | order | a step takes | keeps | for |
//! |---|---|---|---|---|
//! | Newmark-beta, 0.5 | 2 | 2 to 4 Newton iterations | energy to O(h^2), not for good | a per cent, Kelvin-Voigt damping |
//! | average vector field | 2 | the same, of four stages | energy exactly | long runs at large steps |
//! | [rodas4](crate::dynamics::stepper::rosenbrock) | 4 | 1 factorisation, 6 gradients | momentum | 1e-3 to 1e-5 of the length |
//! | [verlet](crate::dynamics::stepper::splitting) | 2 | 1 gradient | momenta, phase volume; it runs backwards | 1e-6 |
//! | [pefrl](crate::dynamics::stepper::splitting) | 4 | 4 gradients | likewise | 1e-8 |
//!
//! The last two are explicit: their steps must stay below [a limit of
//! stability](crate::Posed::largest_step), 36 us and 54 us on the paper's cantilever, that goes
//! with the square of an edge. `rodfit study` finds the cheapest scheme, step and mesh for a scene;
//! `cargo run --release --example work_precision` compares them on one mesh.
//!
//! # Tried and dropped
//!
//! On the same kernels and meshes (50 segments, 1 s, largest tip error over length, ms in one run)
//! these were nowhere ahead of the schemes above by more than the noise:
//!
//! | scheme | cantilever: error, ms | helix: error, ms |
//! |---|---|---|
//! | *Newmark-beta 0.5* | 3.2e-4, 8.8; 1.1e-4, 17 | 2.1e-4, 57; 9.2e-5, 92 |
//! | *rodas4* | 1.4e-3, 2.6; 7.0e-5, 5.1; 6.7e-6, 13 | 1.3e-4, 29; 1.2e-5, 58; 1.9e-6, 114 |
//! | *Verlet* | 1.3e-6, 17 | 5.5e-6, 56 |
//! | *PEFRL* | 5.4e-9, 39 | 2.4e-8, 140 |
//! | rodas4, step controlled by its error | 9.3e-5, 5.1; 1.1e-5, 11 | 1.5e-4, 24; 2.0e-5, 47 |
//! | Rosenbrock, L-stable, four stages (ROS4) | 2.0e-4, 8.1; 2.4e-5, 16 | 5.4e-4, 39; 7.2e-5, 78 |
//! | Rosenbrock, four stages (GRK4T) | grows at every step tried | likewise |
//! | Rosenbrock of order 3 (ROS3P) | 3.0e-4, 6.0; 3.1e-5, 12 | 8.9e-4, 32; 8.3e-5, 63 |
//! | Rosenbrock of order 2 (ROS2) | 4.6e-4, 4.9; 8.1e-5, 9.9 | 8.4e-4, 29; 9.4e-5, 58 |
//! | generalised-alpha, rho 0.9 | 3.2e-4, 9.2; 1.1e-4, 18 | 2.1e-4, 49; 9.4e-5, 98 |
//! | generalised-alpha, rho 0.4 | 4.7e-4, 9.2; 1.5e-4, 18 | 3.0e-4, 49; 1.2e-4, 99 |
//! | TR-BDF2 | 6.3e-4, 7.9; 1.7e-4, 16 | 3.1e-4, 57; 1.3e-4, 94 |
//! | Gauss, two stages, iterated with one real factorisation | 4.7e-5, 28; 9.2e-6, 57 | 4.2e-5, 116; 7.7e-6, 209 |
//! | velocity form of PEFRL (VEFRL) | 5.1e-8, 32 | 1.7e-7, 109 |
//! | Omelyan's five stages (4MN5FV) | 4.6e-9, 42 | 2.2e-8, 150 |
//! | Blanes and Moan's six stages | 2.2e-9, 50 | 1.9e-8, 184 |
//! | Verlet, bending at every second kick only | 3.5e-6 for 0.75 of the gradients | |
//!
//! Multirate kicks gain nothing on these meshes because bending is half as stiff as stretching
//! there, and resonate from the third step on; on finer ones bending is the stiffer of the two.
//! A factor of two between schemes of fourth order is one halving of the step, 16 in the error:
//! PEFRL, ROS4 at the same error and those of more stages lie on one line or behind it.
//!
//! The sudden release excites vibrations that no large step resolves: here every implicit scheme
//! falls short of its order, which it has on smooth motion
//! (`cargo test --release --test physics orders_in_the_step -- --nocapture`). In space an implicit
//! step measures the angles from the frames at its start, which adds an error of first order as
//! small as the edges' rotational inertia: below 1e-9 m on the helix at 1 ms.
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
//! rotations of reasonable steps (where it is not, the step is taken in halves). Damping acts on
//! the mean velocity `(q1 - q0)/h`; Kelvin-Voigt stress acts at both ends of the step as in
//! Newmark-beta at 1/2. On the way between them it has no business: nodes that go straight shorten
//! every edge that turns, by `alpha^2/8` in the middle of a turn by `alpha`, and the dissipation of
//! that stretching, `eta EA alpha^4/24` a step and length, is more than that of bending in a wire.

use crate::numerics::scalar::Scalar;
use crate::scene::Scheme;

/// The numbers of one step.
#[derive(Clone, Copy, Debug)]
pub struct Formulas<D> {
    /// Step, s.
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
                    stages: &[END],
                }
            }
            // Those that need no iteration have no such formulas, and never ask.
            Scheme::AverageVectorField | Scheme::Verlet | Scheme::Pefrl | Scheme::Rodas4 => Self {
                h,
                end: D::from(0.5 * h * h),
                start: D::from(0.5 * h * h),
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
