//! The posterior density in coordinates in which it is nearly a standard normal distribution.
//!
//! An unknown between two bounds is the logistic function of an unbounded number `z` from the lower to the upper one,
//! one with a single bound is an exponential function of `z` from it, others are `z` (as in Stan). The log density
//! gains the logarithm of the derivatives. The coordinates `u` are `z = c + W u`: `c` is the optimum, and `W W'` the
//! inverse of the Gauss-Newton matrix of `z` there, to which the derivatives of bounded unknowns add their curvature.
//! [`StandardizedDensity`] evaluates the density and its gradient by `u` for the sampler, and returns the unknowns at a
//! point. It does not exist where the matrix is not positive definite.

use crate::error::Error;
use crate::fit::uncertainty::posterior::density::PosteriorDensity;
use crate::fit::uncertainty::posterior::sampler::{EvaluationError, LogDensity};
use nalgebra::{DMatrix, DVector};

/// Part of the range between two bounds that the origin keeps from either bound, where the logistic function is flat.
const MARGIN: f64 = 0.01;

/// An unknown as a function of an unbounded number.
#[derive(Clone, Copy, Debug)]
enum UnknownRange {
    /// The number itself.
    Unlimited,
    /// `end + sign exp(z)`: beyond a lower end (sign 1), or below an upper end (sign -1).
    OneSided { end: f64, sign: f64 },
    /// `low + (high - low)/(1 + exp(-z))`.
    Between { low: f64, high: f64 },
}

/// Value of an unknown with its derivatives by the unbounded number.
#[derive(Clone, Copy, Debug)]
struct RangePoint {
    /// The unknown on its scale.
    x: f64,
    /// Derivative `dx/dz`.
    slope: f64,
    /// Logarithm of the absolute derivative.
    log_slope: f64,
    /// Derivative of the logarithm by `z`.
    log_slope_by_z: f64,
    /// Minus the second derivative of the logarithm by `z`.
    curvature: f64,
}

impl UnknownRange {
    /// The range between bounds, infinite where there is none.
    fn new([low, high]: [f64; 2]) -> Self {
        match (low.is_finite(), high.is_finite()) {
            (true, true) => Self::Between { low, high },
            (true, false) => Self::OneSided { end: low, sign: 1.0 },
            (false, true) => Self::OneSided { end: high, sign: -1.0 },
            (false, false) => Self::Unlimited,
        }
    }

    /// The unbounded number of `x`, kept from the bounds: by [`MARGIN`] of the range, or of 1 from a single one.
    fn number(self, x: f64) -> f64 {
        match self {
            Self::Unlimited => x,
            Self::OneSided { end, sign } => (sign * (x - end)).max(MARGIN).ln(),
            Self::Between { low, high } => {
                let part = ((x - low) / (high - low)).clamp(MARGIN, 1.0 - MARGIN);
                (part / (1.0 - part)).ln()
            }
        }
    }

    /// The unknown and its derivatives at `z`.
    fn at(self, z: f64) -> RangePoint {
        match self {
            Self::Unlimited => {
                RangePoint { x: z, slope: 1.0, log_slope: 0.0, log_slope_by_z: 0.0, curvature: 0.0 }
            }
            Self::OneSided { end, sign } => RangePoint {
                x: end + sign * z.exp(),
                slope: sign * z.exp(),
                log_slope: z,
                log_slope_by_z: 1.0,
                curvature: 0.0,
            },
            Self::Between { low, high } => {
                let (part, rest) = ((1.0 + (-z).exp()).recip(), (1.0 + z.exp()).recip());
                let (width, product) = (high - low, part * rest);
                RangePoint {
                    x: if z < 0.0 { low + width * part } else { high - width * rest },
                    slope: width * product,
                    log_slope: (width * product).ln(),
                    log_slope_by_z: rest - part,
                    curvature: 2.0 * product,
                }
            }
        }
    }
}

/// The posterior density in the coordinates `u`.
pub(crate) struct StandardizedDensity<'a, S> {
    density: PosteriorDensity<'a>,
    ranges: Vec<UnknownRange>,
    /// Unbounded numbers of the optimum.
    origin: DVector<f64>,
    /// The matrix `W` of `z = c + W u`.
    scales: DMatrix<f64>,
    /// Whether the user stopped the fit.
    is_stopped: S,
}

impl<'a, S: Fn() -> bool> StandardizedDensity<'a, S> {
    /// The `density` about the point `x` of the unknowns on their scales, within these `bounds`. None if the
    /// Gauss-Newton matrix there is not positive definite. Error: the simulation there fails.
    pub fn new(
        density: PosteriorDensity<'a>,
        x: &[f64],
        bounds: &[[f64; 2]],
        is_stopped: S,
    ) -> Result<Option<Self>, Error> {
        let ranges: Vec<UnknownRange> =
            bounds.iter().map(|bounds| UnknownRange::new(*bounds)).collect();
        let numbers = ranges.iter().zip(x).map(|(range, x)| range.number(*x));
        let origin = DVector::from_iterator(x.len(), numbers);
        let points: Vec<RangePoint> = ranges.iter().zip(&origin).map(|(r, z)| r.at(*z)).collect();
        let inner: Vec<f64> = points.iter().map(|point| point.x).collect();
        let mut matrix = density.information(&inner)?;
        for (i, point) in points.iter().enumerate() {
            matrix.row_mut(i).scale_mut(point.slope);
            matrix.column_mut(i).scale_mut(point.slope);
            matrix[(i, i)] += point.curvature;
        }
        let n = x.len();
        // With M = L L' the standard deviations of z are those of W = (L')^-1.
        let scales = matrix.cholesky().and_then(|factors| {
            factors.l().transpose().solve_upper_triangular(&DMatrix::identity(n, n))
        });
        let scales = scales.filter(|scales| scales.iter().all(|x| x.is_finite()));
        Ok(scales.map(|scales| Self { density, ranges, origin, scales, is_stopped }))
    }

    /// The unknowns on their scales at the point `u`, each with the derivatives of its range.
    fn points(&self, u: &[f64]) -> Vec<RangePoint> {
        let z = &self.origin + &self.scales * DVector::from_column_slice(u);
        self.ranges.iter().zip(&z).map(|(range, z)| range.at(*z)).collect()
    }

    /// The unknowns on their scales at the point `u`, and the logarithm of the density of `z` over that of the
    /// unknowns.
    pub fn unknowns(&self, u: &[f64]) -> (Vec<f64>, f64) {
        let points = self.points(u);
        (points.iter().map(|p| p.x).collect(), points.iter().map(|p| p.log_slope).sum())
    }
}

impl<S: Fn() -> bool> LogDensity for &StandardizedDensity<'_, S> {
    fn dimension(&self) -> usize {
        self.ranges.len()
    }

    fn evaluate(&self, u: &[f64], gradient: &mut [f64]) -> Result<f64, EvaluationError> {
        if (self.is_stopped)() {
            return Err(EvaluationError::Stopped);
        }
        let points = self.points(u);
        let x: Vec<f64> = points.iter().map(|point| point.x).collect();
        let mut by_x = vec![0.0; x.len()];
        let value = self.density.evaluate(&x, &mut by_x).map_err(|error| match error {
            Error::Interrupted => EvaluationError::Stopped,
            _ => EvaluationError::NotSimulated,
        })?;
        let by_z = points.iter().zip(by_x).map(|(p, by)| by * p.slope + p.log_slope_by_z);
        let by_z = DVector::from_iterator(x.len(), by_z);
        gradient.copy_from_slice(self.scales.tr_mul(&by_z).as_slice());
        Ok(value + points.iter().map(|point| point.log_slope).sum::<f64>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivatives of every kind of range equal central differences of fourth order, and `number` is the inverse.
    #[test]
    fn range_derivatives_equal_differences() {
        let infinite = f64::INFINITY;
        let bounds =
            [[-infinite, infinite], [-1.0, infinite], [-infinite, 2.0], [-1.0, 3.0], [4.0, 4.5]];
        let h = 1e-3;
        for range in bounds.map(UnknownRange::new) {
            for z in [-3.0, -0.7, 0.0, 0.4, 2.5] {
                let by_z = |f: &dyn Fn(RangePoint) -> f64| {
                    let at = |steps: f64| f(range.at(z + steps * h));
                    (8.0 * (at(1.0) - at(-1.0)) - at(2.0) + at(-2.0)) / (12.0 * h)
                };
                let point = range.at(z);
                let pairs = [
                    (point.slope, by_z(&|p| p.x)),
                    (point.log_slope, point.slope.abs().ln()),
                    (point.log_slope_by_z, by_z(&|p| p.log_slope)),
                    (point.curvature, -by_z(&|p| p.log_slope_by_z)),
                    (z, range.number(point.x)),
                ];
                for (found, expected) in pairs {
                    let error = (found - expected).abs();
                    assert!(error < 1e-9 * expected.abs().max(1.0), "{range:?} {z}: {pairs:?}");
                }
            }
        }
    }
}
