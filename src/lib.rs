//! Simulation of slender elastic rods, and identification of their parameters from recorded motion.
//!
//! A [`Scene`] describes a rod, its supports and its loads. It becomes a [`Problem`], which is simulated. A
//! [`StructureScene`] describes several rods with bodies and joints, and becomes a [`Structure`]. A [`Fit`] compares
//! simulations with measurements and estimates parameters with their uncertainty. Derivatives by unknowns and
//! parameters are hand-derived or from dual numbers, not differences. Numbers are in SI units.
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
//! # Data in memory
//!
//! Neither scene nor data need a file. [`Observation::new`] takes [samples](fit::Sample) of a point,
//! [`fit::RestShape`] a shape at rest, [`fit::Frequencies`] natural frequencies:
//!
//! ```
//! use rodfit::fit::Sample;
//! use rodfit::scene::{Material, Section, Shape, Time};
//! use rodfit::{Fit, Observation, Parameter, Point, Scene};
//!
//! let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] }; // m
//! let mut scene = Scene::new(20, shape, Section::Circle { radius: 0.005 }, Material::new(1200.0, 1e8));
//! scene.loads.gravity = [0.0, -9.81, 0.0]; // m/s^2
//! scene.time = Some(Time::new(0.5, 2e-3)); // s
//! let problem = scene.problem()?;
//! let run = problem.simulate()?; // synthetic data of the tip, every fifth step
//! let samples = run.times().iter().enumerate().step_by(5).map(|(k, &time)| {
//!     let [x, y, _] = run.tip(k);
//!     Sample { time, position: [Some(x), Some(y), None] } // s, m
//! });
//! let fit = Fit::new(&problem)
//!     .observe(Observation::new(samples.collect()).at(Point::Tip))
//!     .identify(Parameter::YoungsModulus)
//!     .solve()?;
//! assert!((fit.parameters()[0].1 / 1e8 - 1.0).abs() < 1e-6);
//! # Ok::<(), rodfit::Error>(())
//! ```
//!
//! # Modules
//!
//! | module | content |
//! |---|---|
//! | [`scene`] | rod, material, supports, loads, initial state; parameters by name |
//! | [`problem`] | a prepared scene: mesh, supports, [model](problem::model) |
//! | [`statics`], [`vibration`], [`dynamics`] | equilibria, modes, trajectories with [sensitivities](dynamics::sensitivity) and [schemes](dynamics::stepper) |
//! | [`structure`] | several rods with bodies and joints: equilibria, modes, trajectories |
//! | [`fit`] | measurements, search, uncertainty, report |
//! | [`energy`], [`rod`] | elements and their assembly; [user-defined energies](energy::own) |
//! | [`check`] | verification of derivatives, also of your own |
//! | [`export`] | files of a rod for other simulators |
//! | [`code`] | codes of grades, warnings and reasons for which a computation ended |
//! | [`accuracy`], [`study`] | choice of mesh and step; speed against error |
//! | [`summary`] | results as text for a terminal |
//! | [`numerics`] | dual numbers, band matrices, least squares; independent of rods |
//! | `page`, `campaign`, `command` | HTML pages, many fits, the command line (features `page` and `cli`) |
//!
//! Energies, simulations and equilibria are generic over the [`Scalar`], so that they also run in dual numbers.
//!
//! # Theory
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
//! The equation of motion is `M dv/dt = -dE/dq - damping`. Implicit schemes solve each step with Newton's method on an
//! exact banded tangent. A fit of a recorded motion minimizes, with the default loss,
//!
//! ```text
//! 1/2 sum_k |x(s, t_k; p) - x_observed_k|^2 / sigma^2
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | `q` | unknowns: `[x_0, y_0, x_1, ..]` in the plane of the scene; `[x_0 (3), theta_0, x_1 (3), ..]` in space | m, rad |
//! | `theta_j` | angle of edge `j`'s material directors from its transported reference ([`energy::frame`]) | rad |
//! | `l_j` | rest length of edge `j` | m |
//! | `dl_i` | Voronoi length of inner node `i`, half the adjacent rest lengths | m |
//! | `eps_j` | stretching strain `abs(e_j)/l_j - 1` | 1 |
//! | `kappa_i` | integrated curvature `2 tan(phi_i/2)` of the turning angle `phi_i`; in space its two components in the material frame | 1 |
//! | `tau_i` | twist: angle between neighboring material directors, counted beyond full turns | rad |
//! | `E`, `G` | Young's and shear modulus | Pa |
//! | `A`, `I`, `J` | area, second moment of area, torsion constant | m^2, m^4 |
//! | `M` | lumped masses, half of each adjacent edge; rotational inertias of edges | kg, kg m^2 |
//! | `beta` | parameter of Newmark-beta: 1 is implicit Euler, 1/2 is of second order without dissipation | 1 |
//!
//! To change an energy, read [`energy::stretch`] first; [`check`] verifies its derivatives.

// The command imports the library by its name, as users do.
#[cfg(feature = "cli")]
extern crate self as rodfit;

pub mod accuracy;
#[cfg(feature = "cli")]
pub mod campaign;
pub mod check;
pub mod code;
#[cfg(feature = "cli")]
pub mod command;
pub mod dynamics;
pub mod energy;
mod error;
pub mod export;
pub mod fit;
mod input;
pub mod numerics;
#[cfg(feature = "page")]
pub mod page;
pub mod problem;
pub mod rod;
pub mod scene;
pub mod statics;
pub mod structure;
pub mod study;
pub mod summary;
pub mod vibration;

pub use code::Code;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to AdjointRun")]
pub use dynamics::AdjointRun as Reversible;
/// The old name of [`TrajectorySlopes`].
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to TrajectorySlopes")]
pub use dynamics::TrajectorySlopes as Slopes;
pub use dynamics::{AdjointRun, Snapshot, Trajectory, TrajectorySlopes};
pub use energy::{Analytic, Derivatives, Energy};
pub use error::Error;
pub use fit::{Fit, FitReport, Observation, Unknown};
#[cfg(feature = "cli")]
pub use input::part_file::PartFile;
pub use marker_files::printable::{printable, printable_name};
pub use numerics::scalar::Scalar;
pub use problem::{AnyProblem, Discretized, PlanarProblem, Problem, SpatialProblem};
pub use scene::{Parameter, Point, Scene, StructureScene};
pub use statics::{Equilibrium, Reaction, Reactions};
pub use structure::Structure;
pub use vibration::NaturalFrequency;

/// The README's code, compiled and run with the documentation's.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
