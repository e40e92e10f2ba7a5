//! `[time]`: how long, in which steps, by which scheme.

use crate::error::Error;
use crate::scene::number::{Candidates, Numbers, Quantity, Written};
use crate::scene::scheme::Scheme;
use crate::scene::tolerance::Tolerance;
use crate::scene::validate::positive;
use serde::{Deserialize, Serialize};

/// Most time steps of a simulation.
const MOST_STEPS: f64 = 1e9;

/// `[time]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "TimeForm<D>", into = "TimeForm<D>", bound = "D: Written")]
pub struct Time<D = f64> {
    /// Duration of the simulation, s.
    pub end: f64,
    /// Length of a step, s.
    pub step: f64,
    /// The time integrator.
    pub scheme: Scheme,
    /// Of Newmark-beta, in [0.5, 1]; 1 is implicit Euler.
    pub beta: D,
    /// Of Newmark-beta: which error of a step's solution is left.
    pub tolerance: Tolerance,
}

/// `[time]` as it is written: `beta` and `tolerance` stand beside the scheme they belong to only.
#[derive(Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields, bound = "D: Written")]
struct TimeForm<D> {
    end: f64,
    step: f64,
    #[serde(default)]
    scheme: Scheme,
    #[serde(skip_serializing_if = "Option::is_none")]
    beta: Option<D>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tolerance: Option<Tolerance>,
}

impl<D: From<f64>> TryFrom<TimeForm<D>> for Time<D> {
    type Error = &'static str;

    fn try_from(form: TimeForm<D>) -> Result<Self, Self::Error> {
        let TimeForm { end, step, scheme, beta, tolerance } = form;
        if beta.is_some() && !scheme.traits().takes_beta {
            return Err("time.beta: found beside another scheme, allowed: with newmark-beta only");
        }
        if tolerance.is_some() && !scheme.traits().takes_beta {
            return Err(
                "time.tolerance: found beside another scheme, allowed: with newmark-beta only",
            );
        }
        let (beta, tolerance) = (beta.unwrap_or(D::from(0.5)), tolerance.unwrap_or_default());
        Ok(Self { end, step, scheme, beta, tolerance })
    }
}

impl<D> From<Time<D>> for TimeForm<D> {
    fn from(Time { end, step, scheme, beta, tolerance }: Time<D>) -> Self {
        let traits = scheme.traits();
        let chosen = traits.takes_beta && tolerance != Tolerance::default();
        let tolerance = chosen.then_some(tolerance);
        Self { end, step, scheme, beta: traits.takes_beta.then_some(beta), tolerance }
    }
}

impl Time {
    pub(super) fn over<D: From<f64>>(&self, n: &mut Numbers<'_, D>) -> Time<D> {
        let beta = Quantity::signed("").within(0.5, 1.0);
        let beta = beta.searched(Candidates::Values(&[0.55, 0.75, 0.95]));
        Time {
            end: self.end,
            step: self.step,
            scheme: self.scheme,
            beta: match self.scheme.traits().takes_beta {
                true => n.number("beta", self.beta, beta),
                false => D::from(self.beta),
            },
            tolerance: self.tolerance,
        }
    }

    /// Duration and step in s, Newmark-beta at beta = 0.5.
    pub fn new(end: f64, step: f64) -> Self {
        Self { end, step, scheme: Scheme::default(), beta: 0.5, tolerance: Tolerance::default() }
    }

    /// Number of steps to the end; the last may be shorter.
    pub fn steps(&self) -> usize {
        ((self.end / self.step - 1e-9).ceil() as usize).max(1)
    }

    /// Time after `k` steps, s.
    pub fn at(&self, k: usize) -> f64 {
        if k >= self.steps() { self.end } else { k as f64 * self.step }
    }

    /// Refuses what makes no sense.
    pub(super) fn check(&self) -> Result<(), Error> {
        positive("time.end", self.end)?;
        positive("time.step", self.step)?;
        if !(0.5..=1.0).contains(&self.beta) {
            return Err(Error::invalid("time.beta", self.beta, "in [0.5, 1]"));
        }
        self.tolerance.check()?;
        if self.end / self.step > MOST_STEPS {
            let found = format!("{:e}, which needs {:.3e} steps", self.step, self.end / self.step);
            return Err(Error::invalid("time.step", found, "at most 1e9 steps"));
        }
        Ok(())
    }
}
