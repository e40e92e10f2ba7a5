//! A measurement of one's own: whatever follows from where points of the rod are and how they move.

use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::motion::{Observation, Sample};
use crate::numerics::scalar::Scalar;
use crate::scene::Point;
use crate::scene::Scene;
use num_dual::{Dual64, HyperDual64};
use std::fmt::Debug;
use std::sync::Arc;

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

/// What a gauge showed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Time from the start of the motion, s; none of the rod at rest under the scene's loads.
    pub time: Option<f64>,
    /// What the gauge showed, in its unit.
    pub value: f64,
}

/// Readings of a [`Quantity`], in an order of rising times. The camera of the scene has no part in
/// them.
#[derive(Clone, Debug)]
pub struct Gauge {
    /// Name of the gauge, for messages and reports.
    pub name: String,
    /// Unit of the values; empty for pure numbers.
    pub unit: String,
    /// What the gauge showed.
    pub readings: Vec<Reading>,
    /// Standard deviation of each reading.
    pub sigma: f64,
    /// How residuals count.
    pub loss: Loss,
    /// Whether the readings are kept out of the fit and only predicted.
    pub held_out: bool,
    /// Where it looks; on other meshes the same places.
    pub(crate) points: Vec<Point>,
    quantity: Arc<dyn OverScalars>,
}

impl Gauge {
    /// Readings `(s, value)` of a motion, with the standard deviation of each.
    pub fn over_time(
        name: impl Into<String>,
        unit: impl Into<String>,
        quantity: impl Quantity,
        readings: &[(f64, f64)],
        sigma: f64,
    ) -> Self {
        let reading = |(time, value): &(f64, f64)| Reading { time: Some(*time), value: *value };
        let readings = readings.iter().map(reading).collect();
        Self::new((name.into(), unit.into()), quantity, readings, sigma)
    }

    /// Readings of the rod at rest, with the standard deviation of each.
    pub fn at_rest(
        name: impl Into<String>,
        unit: impl Into<String>,
        quantity: impl Quantity,
        values: &[f64],
        sigma: f64,
    ) -> Self {
        let readings = values.iter().map(|value| Reading { time: None, value: *value }).collect();
        Self::new((name.into(), unit.into()), quantity, readings, sigma)
    }

    fn new(
        (name, unit): (String, String),
        quantity: impl Quantity,
        readings: Vec<Reading>,
        sigma: f64,
    ) -> Self {
        Self {
            name,
            unit,
            readings,
            sigma,
            loss: Loss::Squares,
            held_out: false,
            points: quantity.points(),
            quantity: Arc::new(quantity),
        }
    }

    /// With another loss than squares.
    pub fn loss(self, loss: Loss) -> Self {
        Self { loss, ..self }
    }

    /// Kept out of the fit, to be predicted by it.
    pub fn held_out(self) -> Self {
        Self { held_out: true, ..self }
    }

    /// What it shows.
    pub(crate) fn shows(&self) -> Arc<dyn OverScalars> {
        self.quantity.clone()
    }

    /// Root mean square of the readings about their mean, or of a single one.
    pub(crate) fn size(&self) -> f64 {
        let values = || self.readings.iter().map(|r| r.value);
        let n = self.readings.len().max(1) as f64;
        let mean = if n > 1.0 { values().sum::<f64>() / n } else { 0.0 };
        let spread = (values().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
        // The same value again and again has no spread.
        if spread > 0.0 { spread } else { mean.abs() }
    }

    /// Its readings of a motion, as if they were a coordinate of a point.
    pub(crate) fn as_motion(&self) -> Option<Observation> {
        let sample =
            |r: &Reading| r.time.map(|time| Sample { time, position: [Some(r.value), None, None] });
        let samples: Vec<Sample> = self.readings.iter().filter_map(sample).collect();
        (!samples.is_empty()).then(|| Observation::new(samples))
    }
}

/// A quantity over every number type that fits are computed with.
pub(crate) trait OverScalars: Debug + Send + Sync {
    fn plain(&self, rod: &Sight<f64>) -> f64;
    fn dual(&self, rod: &Sight<Dual64>) -> Dual64;
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
pub(crate) trait Shown: Scalar {
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
