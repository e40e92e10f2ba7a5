//! Minima of the full model, with objectives that can be computed for any weights.
//!
//! Two objectives are comparable only on the same mesh, with the same steps and the same weights. Each [`Minimum`]
//! therefore has its point on the unknowns' scales, whether the fit converged, the number of its mesh and steps
//! (`numerics`), and [`Squares`]. These are the sum of squared residuals of each measurement in its own unit squared,
//! the sum of squares of the priors, and the ratio of the robust losses to all squares at the sigmas of the fit (1 if
//! all residuals are zero). `Squares::misfit` returns half the sum of squares in units of any sigmas, priors included,
//! times this ratio.

/// Sums of squared residuals of one point, without the weights of the measurements.
#[derive(Clone, Debug)]
pub(crate) struct Squares {
    /// Sum of squares of each measurement, in its unit squared.
    measurements: Vec<f64>,
    /// Sum of squares of the residuals of the priors.
    priors: f64,
    /// Sum of the losses over the sum of the squares, with the weights of the fit.
    robust: f64,
}

impl Squares {
    /// The sums of squares of the `residuals` of one point, in units of `sigmas` and without robust loss and leverage
    /// weights. They are `counts` values of each measurement in order, then those of the priors. `cost` is half the sum
    /// of their losses; `2 cost/squares` is kept as the ratio of losses to squares (1 if all residuals are zero).
    pub fn new(residuals: &[f64], counts: &[usize], sigmas: &[f64], cost: f64) -> Self {
        let square = |r: &[f64]| r.iter().map(|r| r * r).sum::<f64>();
        let mut rest = residuals;
        let measurements = counts.iter().zip(sigmas).map(|(count, sigma)| {
            let (own, others) = rest.split_at(*count);
            rest = others;
            square(own) * sigma * sigma
        });
        let measurements = measurements.collect();
        // A robust loss does not scale with sigma as squares do: its ratio to them is kept as a factor.
        let whole = square(residuals);
        let robust = if whole > 0.0 { 2.0 * cost / whole } else { 1.0 };
        Self { measurements, priors: square(rest), robust }
    }

    /// The objective in units of other `sigmas`, one per measurement: half the sum of squares, priors included, times
    /// the kept ratio of robust losses to squares.
    pub fn misfit(&self, sigmas: &[f64]) -> f64 {
        let pairs = self.measurements.iter().zip(sigmas);
        let squares: f64 = pairs.map(|(square, sigma)| square / (sigma * sigma)).sum();
        0.5 * self.robust * (squares + self.priors)
    }
}

/// The end of a fit of the full model to the whole records.
#[derive(Clone, Debug)]
pub(crate) struct Minimum {
    /// The unknowns on their scales.
    pub x: Vec<f64>,
    pub squares: Squares,
    pub converged: bool,
    /// Number of its mesh and steps.
    pub numerics: usize,
}

#[cfg(test)]
impl Minimum {
    /// A converged minimum at `x` with this cost of one measurement with unit weight.
    pub fn with_cost(x: &[f64], cost: f64) -> Self {
        let squares = Squares::new(&[(2.0 * cost).sqrt()], &[1], &[1.0], cost);
        Self { x: x.to_vec(), squares, converged: true, numerics: 0 }
    }

    /// The minimum with its objective multiplied by a `factor` for any weights.
    pub fn scaled(mut self, factor: f64) -> Self {
        self.squares.robust *= factor;
        self
    }
}
