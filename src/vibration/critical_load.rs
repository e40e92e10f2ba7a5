//! Critical loads: the value of a load at which the lowest mode about the equilibrium loses its stiffness, with
//! derivatives.
//!
//! Input: a load, its expected value, which gives the sign and the range of the search, and parameters. Let `F(P, p)`
//! be the squared lowest frequency of the rod under the load `P` with the parameters `p`, 1/s^2. It is positive where
//! the rod is stable, and nearly linear in `P` for a column. Newton's method in `P` approaches the root from the stable
//! side, from no load on; a load beyond the root is bisected with the last stable one. It ends at a distance of
//! [`DISTANCE`] of the load, where the equilibrium is not singular yet. Output ([`CriticalLoad`]): the extrapolated
//! root and its derivatives,
//!
//! ```text
//! P_c = P - F/F_P, dP_c/dp = (-F_p/F_P + F F_Pp/F_P^2)/(1 - F F_PP/F_P^2)
//! ```
//!
//! whose errors are of second order in the distance. Derivatives of `F` are exact (hyper-dual numbers). Errors are
//! [`Error::Invalid`] without such a load up to [`FARTHEST`] times the expected one, as for a rod that bends from the
//! first load on, and those of natural frequencies, as under loads without a potential.

use crate::error::Error;
use crate::problem::Problem;
use crate::scene::Parameter;
use num_dual::{Dual64, HyperDual64};

/// Distance of the last load below the critical one, relative to the load.
const DISTANCE: f64 = 1e-4;
/// Most evaluations of the lowest frequency. Newton's method takes four or five; each bisection after an overshoot one
/// more.
const MOST_TRIALS: usize = 40;
/// Largest critical load that is searched, over the expected one.
const FARTHEST: f64 = 100.0;

/// A critical load and its derivatives with respect to parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct CriticalLoad {
    /// The load, in its unit in the scene.
    pub value: f64,
    /// Derivative with respect to each of the parameters, per unit of the parameter, in their order.
    pub derivatives: Vec<f64>,
}

impl Problem {
    /// The smallest critical value of a `load` of the scene that has the sign of the `expected` one, with its
    /// derivatives by the `parameters`, in their order. Other loads and parameters stay. In a planar scene the rod
    /// buckles in its plane.
    ///
    /// ```
    /// use rodfit::scene::{Dimension, Material, Point, PointForce, Scene, Section, Shape};
    /// let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] }; // m
    /// let section = Section::Circle { radius: 0.002 };
    /// let mut scene = Scene::new(100, shape, section, Material::new(1200.0, 2e9));
    /// scene.loads.gravity = [0.0; 3];
    /// scene.loads.point.push(PointForce {
    ///     node: Point::Tip, force: [-1.0, 0.0, 0.0], moment: [0.0; 3], follower: false, signal: None,
    /// });
    /// let found = scene.problem()?.critical_load("loads.point.0.force.x".parse()?, -1.0, &[])?;
    /// let pi = std::f64::consts::PI;
    /// let euler = pi.powi(2) * 2e9 * pi * 0.002_f64.powi(4) / 4.0 / (4.0 * 0.5 * 0.5); // N
    /// assert!((found.value / -euler - 1.0).abs() < 1e-4);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Invalid`] without one up to 100 times the expected load; those of
    /// [`natural_frequencies`](Problem::natural_frequencies) without the load.
    pub fn critical_load(
        &self,
        load: Parameter,
        expected: f64,
        parameters: &[Parameter],
    ) -> Result<CriticalLoad, Error> {
        let none = || {
            let found = "a rod that stays stable under this load";
            let allowed =
                "a load under which a straight rod buckles, of the sign of the measured one";
            Error::invalid(load.path(), found, allowed)
        };
        let (mut stable, mut trial) = (0.0, 0.0);
        for _ in 0..MOST_TRIALS {
            // Beyond the critical load the lowest mode has no stiffness, or the rod has buckled and stiffens with the
            // load.
            let step = match self.distance_to_instability(load, trial) {
                Ok(step) if step * expected > 0.0 => Some(step),
                Err(error) if trial == 0.0 => return Err(error),
                Ok(_) if trial == 0.0 => return Err(none()),
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                _ => None,
            };
            let Some(step) = step else {
                trial = 0.5 * (stable + trial);
                continue;
            };
            let value = trial + step;
            if step.abs() <= DISTANCE * value.abs() {
                let under_load = self.with_fixed_layout([(load, trial)])?;
                let of = |p: &Parameter| under_load.derivative_of_critical_load(load, *p);
                let derivatives = parameters.iter().map(of).collect::<Result<_, _>>()?;
                return Ok(CriticalLoad { value, derivatives });
            }
            if value.abs() > FARTHEST * expected.abs() {
                return Err(none());
            }
            stable = trial;
            trial = value * (1.0 - 0.5 * DISTANCE);
        }
        Err(none())
    }

    /// The step from a `value` of the load to the root of the tangent of the squared lowest frequency `F` as a function
    /// of the load `P`: `-F/F_P`, in the unit of the load. Errors are those of the natural frequency.
    fn distance_to_instability(&self, load: Parameter, value: f64) -> Result<f64, Error> {
        let problem = self.with_fixed_layout([(load, value)])?;
        let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == load)));
        let frequency = problem.natural_frequencies_over(&[1_usize], seed)?[0];
        let squared = frequency * frequency;
        Ok(-squared.re / squared.eps)
    }

    /// The derivative of the critical load with respect to a parameter, from the problem under a load near the critical
    /// one, by the formula in the module header. It is zero with respect to the load itself. Errors are those of the
    /// natural frequency.
    fn derivative_of_critical_load(
        &self,
        load: Parameter,
        parameter: Parameter,
    ) -> Result<f64, Error> {
        if parameter == load {
            return Ok(0.0);
        }
        let along = |p: Parameter, own: Parameter| f64::from(u8::from(p == own));
        let squared = |other: Parameter| {
            let seed = |p, value| HyperDual64::new(value, along(p, load), along(p, other), 0.0);
            let frequency = self.natural_frequencies_over(&[1_usize], seed)?[0];
            Ok::<_, Error>(frequency * frequency)
        };
        // The root P of F = 0 is that of g = P - F/F_P. At a load near the root dP/dp = g_p/(1 - g_P), up to the square
        // of the distance, with g_P = F F_PP/F_P^2.
        let (by_parameter, by_load) = (squared(parameter)?, squared(load)?);
        let (value, slope) = (by_parameter.re, by_parameter.eps1);
        let by_parameter =
            -by_parameter.eps2 / slope + value * by_parameter.eps1eps2 / (slope * slope);
        Ok(by_parameter / (1.0 - value * by_load.eps1eps2 / (slope * slope)))
    }
}
