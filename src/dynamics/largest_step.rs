//! The largest stable step (s) of an explicit scheme: its stability limit over the highest angular frequency of the
//! rod at the start of the scene.
//!
//! The highest eigenvalue of `K x = omega^2 M x`, with the tangent `K` of the energy without loads that have no
//! potential, and the masses `M`, is found by geometric bisection. It is an upper bound within the relative
//! `TOLERANCE`. The bounds at first are the largest diagonal entry of `M^-1 K` and Gershgorin's. The number of negative
//! pivots of `K - lambda M` is that of eigenvalues below `lambda` (Sylvester). Input is the discretized scene. Output
//! of `largest_step`: the step, or `None` for schemes without a limit. `check_step` rejects a scene if its step, or its
//! whole time if shorter, is larger. Later states may have higher frequencies; they are not checked.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::tangent::{Factors, Tangent};
use crate::problem::Discretized;
use crate::problem::Model;
use crate::rod::{AssembledRod, FollowerLoads, Rod};
use crate::scene::Scheme;
use std::ops::Range;

/// Relative tolerance of the highest eigenvalue. A larger value rejects some stable steps; a smaller one costs
/// factorizations.
const TOLERANCE: f64 = 1e-4;

impl<M: Model> Discretized<'_, M> {
    /// The largest stable step of the scene's scheme at its initial state, s: the scheme's stability limit of `h omega`
    /// over an upper bound of the highest angular frequency. Loads without a potential are left out. `None` for schemes
    /// without a limit.
    ///
    /// # Errors
    /// Those of making the [start](Self::simulation).
    pub fn largest_step(&self) -> Result<Option<f64>, Error> {
        let Some(limit) = self.scene().scheme().traits().stability_limit else { return Ok(None) };
        let simulation = self.simulation()?;
        let state = simulation.state();
        let n = state.q.len();
        // Loads without a potential have no part in the highest frequency.
        let mut rod = simulation.rod().clone();
        rod.set_follower_loads(FollowerLoads::none());
        let (mut gradient, mut tangent) = (vec![0.0; n], rod.zero_tangent());
        rod.tangent(&state.q, &state.frames, Derivatives::Hand, &mut gradient, &mut tangent);
        // Limit of stability h omega < limit of the scheme, with the highest frequency omega.
        Ok(Some(limit / highest_squared(&tangent, rod.mass(), self.free()).sqrt()))
    }

    /// Rejects a scene whose step, or whole time if that is shorter, exceeds the largest stable step of its explicit
    /// scheme. Schemes without a limit and scenes without `[time]` pass.
    ///
    /// # Errors
    /// [`Error::Invalid`] for `time.step` with the largest step, and those of [`largest_step`](Self::largest_step).
    pub(crate) fn check_step(&self) -> Result<(), Error> {
        let (Some(largest), Some(time)) = (self.largest_step()?, &self.scene().time) else {
            return Ok(());
        };
        if time.step_size().min(time.end) <= largest {
            return Ok(());
        }
        let allowed = format!(
            "up to {largest:.3e} s with {} on this mesh; schemes without such a limit: {}",
            time.scheme.name(),
            Scheme::names(|traits| traits.stability_limit.is_none())
        );
        Err(Error::invalid("time.step", time.step_size(), allowed)
            .in_file(self.scene().path.as_deref()))
    }
}

/// An upper bound of the largest eigenvalue of `K x = lambda M x` of the unknowns in `range`, 1/s^2, which exceeds it
/// by at most the relative [`TOLERANCE`] (by more where a factorization fails). Geometric bisection between the largest
/// diagonal entry of `M^-1 K` and Gershgorin's bound: `K - lambda M` has as many negative pivots as there are
/// eigenvalues below `lambda`. If no diagonal entry is positive, the result is Gershgorin's bound.
fn highest_squared<T: Tangent<f64>>(tangent: &T, mass: &[f64], range: Range<usize>) -> f64 {
    let n = mass.len();
    let mut sums = vec![0.0; n];
    tangent.absolute_product(&vec![1.0; n], &mut sums);
    let largest = |x: &mut dyn Iterator<Item = f64>| x.fold(0.0, f64::max);
    // Gershgorin's circles; and no eigenvalue range ends below a diagonal entry.
    let mut high = largest(&mut range.clone().map(|i| sums[i] / mass[i])) * (1.0 + TOLERANCE);
    let mut low = largest(&mut range.clone().map(|i| tangent.get(i, i) / mass[i]));
    let mut factors = tangent.new_factors();
    while high > low * (1.0 + TOLERANCE) && low > 0.0 {
        let middle = (low * high).sqrt();
        // All pivots negative: no eigenvalue is above the middle. A failed factorization raises the
        // lower bound, so that the upper one stays an upper bound.
        let all_below = factors.factor_sum(mass, -middle, tangent, 1.0, range.clone()).is_ok()
            && factors.negative_pivots() == range.len();
        *if all_below { &mut high } else { &mut low } = middle;
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::banded::BandMatrix;

    /// A chain of masses between walls: omega^2 = 4 k/m sin^2(pi n/(2 (n + 1))).
    #[test]
    fn highest_frequency_of_a_chain() {
        let n = 12;
        let mut tangent = BandMatrix::<f64, 5>::zeros(n + 2);
        for i in 0..n + 1 {
            tangent.add_corner(i, 2, &[[3.0, -3.0], [-3.0, 3.0]]);
        }
        let found = highest_squared(&tangent, &vec![0.2; n + 2], 1..n + 1);
        let angle = std::f64::consts::PI * n as f64 / (2.0 * (n as f64 + 1.0));
        let exact = 60.0 * angle.sin().powi(2);
        assert!(found >= exact * (1.0 - 1e-12) && found < exact * (1.0 + 1e-3), "{found} {exact}");
    }
}
