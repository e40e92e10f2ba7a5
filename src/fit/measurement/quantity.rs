//! A user-defined quantity: whatever follows from the positions and velocities of points of the rod.

use crate::numerics::scalar::Scalar;
use crate::scene::Point;
use crate::scene::Scene;
use num_dual::{Dual64, HyperDual64};
use std::fmt::Debug;

/// What a gauge shows, as a function of the rod's motion.
///
/// It is written once over any [`Scalar`], so that a fit has its exact first and second derivatives.
///
/// ```
/// use rodfit::fit::{Gauge, Quantity, Sight};
/// use rodfit::{Fit, Parameter, Point, Scalar, Scene};
///
/// /// A strain gauge on the upper face of a round rod, 5 mm to each side of its place.
/// #[derive(Debug)]
/// struct Strain {
///     place: f64,
///     radius: f64,
/// }
/// impl Quantity for Strain {
///     fn points(&self) -> Vec<Point> {
///         [-5e-3, 0.0, 5e-3].map(|off| Point::ArcLength(self.place + off)).into()
///     }
///     fn show<D: Scalar>(&self, rod: &Sight<D>) -> D {
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
pub trait Quantity: Debug + Send + Sync + 'static {
    /// The points of the rod that it looks at.
    fn points(&self) -> Vec<Point>;
    /// What the gauge shows, in its unit.
    fn show<D: Scalar>(&self, rod: &Sight<D>) -> D;
}

/// What a gauge sees of the rod at a moment, in world axes.
#[derive(Clone, Debug)]
pub struct Sight<'a, D> {
    /// Time of the motion, s; zero at rest.
    pub time: f64,
    /// The [points](Quantity::points) it looks at, in their order.
    pub points: &'a [Moving<D>],
    /// The scene, with its numbers over `D`.
    pub scene: &'a Scene<D>,
}

/// A point that moves, in world axes.
#[derive(Clone, Copy, Debug)]
pub struct Moving<D> {
    /// Where the point is, m.
    pub position: [D; 3],
    /// How fast it moves, m/s; zero at rest.
    pub velocity: [D; 3],
}

/// A quantity over every number type that fits are computed with.
pub trait OverScalars: Debug + Send + Sync {
    /// Its value.
    fn plain(&self, rod: &Sight<f64>) -> f64;
    /// The same with a derivative.
    fn dual(&self, rod: &Sight<Dual64>) -> Dual64;
    /// The same with second derivatives.
    fn hyper_dual(&self, rod: &Sight<HyperDual64>) -> HyperDual64;
}

impl<Q: Quantity> OverScalars for Q {
    fn plain(&self, rod: &Sight<f64>) -> f64 {
        self.show(rod)
    }
    fn dual(&self, rod: &Sight<Dual64>) -> Dual64 {
        self.show(rod)
    }
    fn hyper_dual(&self, rod: &Sight<HyperDual64>) -> HyperDual64 {
        self.show(rod)
    }
}

/// A number type that fits are computed with.
pub trait Shown: Scalar {
    /// What a quantity is in it.
    fn shown(quantity: &dyn OverScalars, rod: &Sight<Self>) -> Self;
}

impl Shown for f64 {
    fn shown(quantity: &dyn OverScalars, rod: &Sight<Self>) -> Self {
        quantity.plain(rod)
    }
}

impl Shown for Dual64 {
    fn shown(quantity: &dyn OverScalars, rod: &Sight<Self>) -> Self {
        quantity.dual(rod)
    }
}

impl Shown for HyperDual64 {
    fn shown(quantity: &dyn OverScalars, rod: &Sight<Self>) -> Self {
        quantity.hyper_dual(rod)
    }
}
