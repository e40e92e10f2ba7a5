//! The exact Hessian of the misfit: observed information, next to the expected one of Gauss and
//! Newton.
//!
//! Half the sum of squares has the Hessian `J'J + sum_k r_k d2r_k`. The second term is what makes
//! the two differ: it vanishes with the residuals, and on average over noise. Every pair of
//! unknowns costs one simulation in hyper-dual numbers.

use super::view::View;
use super::{Residuals, Unknown};
use crate::error::Error;
use crate::parameter::Parameter;
use crate::second_order;
use num_dual::{DualNum, HyperDual64};

impl Unknown {
    /// The parameter at `x` on the scale of the fit, with the derivatives of `x`.
    fn lifted(&self, x: HyperDual64) -> HyperDual64 {
        if self.parameter.is_positive() { x.exp() } else { x }
    }
}

impl Residuals {
    /// Second derivatives of half the sum of squares at `x`, on the scales of the unknowns, exact
    /// to rounding.
    pub fn hessian_at(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        let n = self.unknowns().len();
        let mut hessian = vec![vec![0.0; n]; n];
        let (problem, plain) = self.run(x, &[])?;
        for i in 0..n {
            for j in 0..=i {
                let pair = [i, j].map(|k| self.unknowns()[k].parameter);
                let seed = |parameter: Parameter, value: f64| {
                    let place = self.unknowns().iter().position(|u| u.parameter == parameter);
                    let Some(k) = place else { return HyperDual64::from(value) };
                    let along = |direction: usize| f64::from(u8::from(k == direction));
                    self.unknowns()[k].lifted(HyperDual64::new(x[k], along(i), along(j), 0.0))
                };
                let run = second_order::repeat(&problem, &plain, pair, seed)?;
                let view = View::new(&problem, seed);
                let mut sum = 0.0;
                self.each_residual(&run, &view, [0, 1, 2].map(Some), |r: HyperDual64| {
                    sum += r.eps1 * r.eps2 + r.re * r.eps1eps2;
                })?;
                (hessian[i][j], hessian[j][i]) = (sum, sum);
            }
        }
        Ok(hessian)
    }
}

impl argmin::core::Hessian for Residuals {
    type Param = Vec<f64>;
    type Hessian = Vec<Vec<f64>>;
    fn hessian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, argmin::core::Error> {
        Ok(self.hessian_at(x)?)
    }
}
