//! Simulation of slender elastic rods, and identification of their parameters from recorded
//! motion.
//!
//! A rod of `N` nodes `x_0 .. x_(N-1)` has the energy (Discrete Elastic Rods; Bergou et al. 2008,
//! 2010; Huang & Jawed 2019, Eq. 1)
//!
//! ```text
//! E(q) = sum_j 1/2 EA eps_j^2 l_j                              stretch, every edge
//!      + sum_i 1/2 (EI/dl_i) |kappa_i - kappa_natural_i|^2     bend, every inner node
//!      + sum_i 1/2 (GJ/dl_i) (tau_i - tau_natural_i)^2         twist, in space
//!      - f.q
//! ```
//!
//! and moves by `M dv/dt = -dE/dq - damping`, which the corrected Newmark-beta scheme steps through
//! time with Newton's method on an exact banded tangent; [`dynamics::stepper`] has four more schemes and says
//! when to take which. Given where a point of the rod was seen, [`Fit`] finds the parameters that
//! explain it:
//!
//! ```text
//! minimise over p   1/2 sum_k |x(s, t_k; p) - x_seen_k|^2 / sigma^2
//! ```
//!
//! with exact derivatives of the trajectory ([`dynamics::sensitivity`]), a start of its own making, and an
//! error bar that says what the data can tell.
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | `q` | unknowns: `[x_0, y_0, x_1, ..]` in the plane of the scene; `[x_0 (3), theta_0, x_1 (3), ..]` in space | m, rad |
//! | `theta_j` | angle of edge `j`'s material directors from its transported reference ([`energy::frame`]) | rad |
//! | `l_j` | rest length of edge `j` | m |
//! | `dl_i` | Voronoi length of inner node `i`, half the adjacent rest lengths | m |
//! | `eps_j` | stretching strain `abs(e_j)/l_j - 1` | 1 |
//! | `kappa_i` | integrated curvature `2 tan(phi_i/2)` of the turning angle `phi_i`; in space its two components in the material frame | 1 |
//! | `tau_i` | twist: angle between neighbouring material directors, counted on past a turn | rad |
//! | `E`, `G` | Young's and shear modulus | Pa |
//! | `A`, `I`, `J` | area, second moment of area, torsion constant | m^2, m^4 |
//! | `M` | lumped masses, half of each adjacent edge; rotational inertias of edges | kg, kg m^2 |
//! | `beta` | of the scheme: 1 is implicit Euler, 1/2 keeps energy | 1 |
//!
//! # A simulation and a fit
//!
//! ```
//! use rodfit::{Fit, Observation, Parameter, Point, Scene};
//!
//! let problem = Scene::load("data/cantilever.toml")?.problem()?;
//! let fit = Fit::new(&problem)
//!     .observe(Observation::read("data/cantilever-tip.csv")?.at(Point::Tip))
//!     .identify(Parameter::YoungsModulus)
//!     .solve()?;
//! println!("{fit}");
//! let best = problem.with(fit.parameters())?;
//! let run = best.simulate_with(&[Parameter::YoungsModulus])?;
//! let (x, dx_dp) = run.at(Point::Tip, 0.3)?; // m, and m/Pa
//! # assert!((fit.parameters()[0].1 / 1e8 - 1.0).abs() < 2e-3 && x[1] < 0.0 && dx_dp[0][1] > 0.0);
//! # Ok::<(), rodfit::Error>(())
//! ```
//!
//! # How the data go
//!
//! A [`scene`] (a file, validated) becomes a [`problem`]: mesh, supports, loads and a
//! [model](problem::model), the smallest that holds the scene, which makes a [`rod`] of elements with an
//! [`energy`] each. It comes to rest ([`statics`]), rings there ([`vibration`]) and moves
//! ([`dynamics`]). [`fit`] compares all three with what was measured, `page` shows what came of it;
//! [`check`] proves derivatives and [`study`] weighs schemes, steps and meshes. [`numerics`] knows no
//! rods. Every stage is generic over the [`Scalar`], so that a simulation also runs in dual numbers.
//!
//! To change an energy, read [`energy::stretch`]; [`check`] tells whether its derivatives hold.
//! To add one that is not built in, a field or a foundation, see [`energy::own`].

// The command names the library as everybody does who uses it.
#[cfg(feature = "cli")]
extern crate self as rodfit;

#[cfg(feature = "cli")]
pub mod campaign;
pub mod check;
pub mod code;
#[cfg(feature = "cli")]
pub mod command;
pub mod dynamics;
pub mod energy;
mod error;
pub mod fit;
mod input;
pub mod numerics;
#[cfg(feature = "page")]
pub mod page;
pub mod problem;
pub mod resolution;
pub mod rod;
pub mod scene;
pub mod statics;
pub mod study;
pub mod vibration;

pub use code::Code;
pub use dynamics::{Reversible, Slopes, Snapshot, Trajectory};
pub use energy::{Analytic, Derivatives, Energy};
pub use error::Error;
pub use fit::{Fit, FitReport, Observation, Unknown};
pub use numerics::scalar::Scalar;
pub use problem::{AnyProblem, Discretized, PlanarProblem, Problem, SpatialProblem};
pub use scene::{Parameter, Point, Scene};
pub use statics::{Equilibrium, Reaction, Reactions};
pub use vibration::NaturalFrequency;

/// The README's code, compiled and run with the documentation's.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
