//! User-defined quantities: functions of the positions and velocities of points of the rod, with exact derivatives.
//!
//! A user implements [`Observable`] once over any scalar type. A fit evaluates it with `f64`, dual numbers (first
//! derivative) and hyper-dual numbers (second derivatives), through the object-safe form [`DynObservable`] and the
//! dispatch [`GaugeScalar`]. Input of a quantity: time, s, positions and velocities of its points, and the scene
//! ([`GaugeContext`]). Output: its value in its own unit.

use crate::numerics::scalar::Scalar;
use crate::scene::Point;
use crate::scene::Scene;
use num_dual::{Dual64, HyperDual64};
use std::fmt::Debug;

/// A quantity that a gauge measures, as a function of the motion of points of the rod.
///
/// It is defined once over any [`Scalar`]: a fit computes exact first and second derivatives with dual numbers.
///
/// ```
/// use rodfit::fit::{Gauge, Observable, GaugeContext};
/// use rodfit::{Fit, Parameter, Point, Scalar, Scene};
///
/// /// A strain gauge on the upper face of a round rod, 5 mm to each side of its place.
/// #[derive(Debug)]
/// struct Strain {
///     place: f64,
///     radius: f64,
/// }
/// impl Observable for Strain {
///     fn points(&self) -> Vec<Point> {
///         [-5e-3, 0.0, 5e-3].map(|off| Point::ArcLength(self.place + off)).into()
///     }
///     fn show<D: Scalar>(&self, rod: &GaugeContext<D>) -> D {
///         let [a, b, c] = [0, 1, 2].map(|i| rod.points[i].position);
///         let heading = |p: [D; 3], q: [D; 3]| (q[1] - p[1]).atan2(q[0] - p[0]);
///         (heading(a, b) - heading(b, c)) / 5e-3 * self.radius
///     }
/// }
/// # let mut scene = Scene::load("data/cantilever.toml")?;
/// # scene.rod.segments = Some(12);
/// # let problem = scene.problem()?;
/// let strain = Gauge::at_rest("strain", "", Strain { place: 0.1, radius: 5e-3 }, &[3.67e-3], 1e-5);
/// let fit = Fit::new(&problem).observe(strain).identify(Parameter::YoungsModulus);
/// # let x = [1e8_f64.ln()];
/// # let more = Gauge::at_rest("strain", "", Strain { place: 0.1, radius: 5e-3 }, &[0.0; 2], 1.0);
/// # let fit = Fit::new(&problem).observe(more).identify(Parameter::YoungsModulus);
/// # let strain = fit.residuals()?.residuals(&x)?[0];
/// # // From the tip in: M = w (L - s)^2/2, strain = M r/EI.
/// # let small = 1273.52 * 9.8 * 0.4 * 0.4 / 2.0 * 4.0 / 5e-3 / 1e8;
/// # assert!((strain / small - 1.0).abs() < 0.1, "{strain:e} {small:e}");
/// # Ok::<(), rodfit::Error>(())
/// ```
pub trait Observable: Debug + Send + Sync + 'static {
    /// The points of the rod that the quantity depends on; their states are passed to `show` in this order.
    fn points(&self) -> Vec<Point>;
    /// The value of the quantity, in its unit, for the state `rod` of its points, the time and the scene.
    fn show<D: Scalar>(&self, rod: &GaugeContext<D>) -> D;
}

/// State of the rod at one time, as far as a quantity depends on it, in world axes.
#[derive(Clone, Debug)]
pub struct GaugeContext<'a, D> {
    /// Time of the motion, s; zero at rest.
    pub time: f64,
    /// States of the [points](Observable::points), in their order.
    pub points: &'a [PointState<D>],
    /// The scene, with its numbers over `D`.
    pub scene: &'a Scene<D>,
}

/// Position and velocity of a point, in world axes.
#[derive(Clone, Copy, Debug)]
pub struct PointState<D> {
    /// Position, m.
    pub position: [D; 3],
    /// Velocity, m/s; zero at rest.
    pub velocity: [D; 3],
}

/// Object-safe form of an [`Observable`]: one function for each scalar type of a fit.
pub trait DynObservable: Debug + Send + Sync {
    /// The value of the quantity for the state `rod`, over `f64`, without derivatives.
    fn plain(&self, rod: &GaugeContext<f64>) -> f64;
    /// The value of the quantity for the state `rod` with one first derivative, by dual numbers.
    fn dual(&self, rod: &GaugeContext<Dual64>) -> Dual64;
    /// The value of the quantity for the state `rod` with two first derivatives and one second one, by hyper-dual
    /// numbers.
    fn hyper_dual(&self, rod: &GaugeContext<HyperDual64>) -> HyperDual64;
}

impl<Q: Observable> DynObservable for Q {
    /// The value of the quantity for the state `rod`, over `f64`, without derivatives.
    fn plain(&self, rod: &GaugeContext<f64>) -> f64 {
        self.show(rod)
    }
    /// The value of the quantity for the state `rod` with one first derivative, by dual numbers.
    fn dual(&self, rod: &GaugeContext<Dual64>) -> Dual64 {
        self.show(rod)
    }
    /// The value of the quantity for the state `rod` with two first derivatives and one second one, by hyper-dual
    /// numbers.
    fn hyper_dual(&self, rod: &GaugeContext<HyperDual64>) -> HyperDual64 {
        self.show(rod)
    }
}

/// A scalar type of a fit, with the function of [`DynObservable`] that belongs to it.
pub trait GaugeScalar: Scalar {
    /// The value of a `quantity` for the state `rod`, with the derivatives of this type, by the function of
    /// [`DynObservable`] for it.
    fn evaluate(quantity: &dyn DynObservable, rod: &GaugeContext<Self>) -> Self;
}

impl GaugeScalar for f64 {
    /// The value of a `quantity` for the state `rod`, without derivatives.
    fn evaluate(quantity: &dyn DynObservable, rod: &GaugeContext<Self>) -> Self {
        quantity.plain(rod)
    }
}

impl GaugeScalar for Dual64 {
    /// The value of a `quantity` for the state `rod` with one first derivative.
    fn evaluate(quantity: &dyn DynObservable, rod: &GaugeContext<Self>) -> Self {
        quantity.dual(rod)
    }
}

impl GaugeScalar for HyperDual64 {
    /// The value of a `quantity` for the state `rod` with two first derivatives and one second one.
    fn evaluate(quantity: &dyn DynObservable, rod: &GaugeContext<Self>) -> Self {
        quantity.hyper_dual(rod)
    }
}
