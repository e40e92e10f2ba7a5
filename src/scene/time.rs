//! `[time]`: how long, in which steps, by which scheme.

use crate::error::Error;
use crate::scene::number::{Candidates, Numbers, Quantity, Written};
use crate::scene::scheme::{Scheme, SchemeParameter};
use crate::scene::tolerance::Tolerance;
use crate::scene::validate::positive;
use serde::{Deserialize, Serialize};

/// Most time steps of a simulation.
const MOST_STEPS: f64 = 1e9;

/// `[time]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(try_from = "TimeForm<D>", into = "TimeForm<D>", bound = "D: Written")]
pub struct Time<D = f64> {
    /// Duration of the simulation, s; [as long](Self::TO_THE_END) as the recording that leads its ends.
    pub end: f64,
    /// Time step, s; none where the program is to choose it.
    pub step: Option<f64>,
    /// The time integrator.
    pub scheme: Scheme,
    /// Whether the program is to choose the integrator, with the step.
    pub scheme_left_open: bool,
    /// Of Newmark-beta, in [0.5, 1]; 1 is implicit Euler.
    pub beta: D,
    /// Of generalised-alpha, in [0, 1]: by which factor a step takes vibrations down that are far too
    /// fast for it. At 1 none, at 0 they are gone after a step.
    pub rho_inf: D,
    /// Of Newmark-beta and generalised-alpha: which error of a step's solution is left.
    pub tolerance: Tolerance,
}

/// A step and an end that differ by less than this part are equal.
const ROUNDING: f64 = 1e-9;

/// The `rho_inf` of a scene that gives none.
const RHO_INF: f64 = 0.5;

/// `[time]`: duration, step and scheme.
#[derive(Clone, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: Written")]
struct TimeForm<D> {
    /// Duration of the simulation, s; default: that of the recording that drives the ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    end: Option<f64>,
    /// Time step, s; default: chosen by the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    step: Option<f64>,
    /// Time integration scheme; default: chosen with the step, or `newmark-beta` beside a step.
    #[serde(skip_serializing_if = "Option::is_none")]
    scheme: Option<Scheme>,
    /// Parameter of `newmark-beta`, 0.5 to 1: 0.5 conserves energy, 1 is implicit Euler.
    #[serde(skip_serializing_if = "Option::is_none")]
    beta: Option<D>,
    /// Spectral radius of `generalised-alpha` at infinite frequency, 0 to 1; default 0.5.
    #[serde(skip_serializing_if = "Option::is_none")]
    rho_inf: Option<D>,
    /// Newton error of a step as a fraction of the rod length, or `"rounding"`; default 3e-14.
    #[serde(skip_serializing_if = "Option::is_none")]
    tolerance: Option<Tolerance>,
}

impl<D: From<f64>> TryFrom<TimeForm<D>> for Time<D> {
    type Error = &'static str;

    fn try_from(form: TimeForm<D>) -> Result<Self, Self::Error> {
        let TimeForm { end, step, scheme, beta, rho_inf, tolerance } = form;
        if step == Some(f64::INFINITY) {
            return Err("time.step: found inf, allowed: a finite number above 0, or no such key");
        }
        if end == Some(Time::TO_THE_END) {
            return Err("time.end: found inf, allowed: a finite number above 0");
        }
        // A step was given for the default scheme, and so were its numbers.
        let numbers = beta.is_some() || rho_inf.is_some() || tolerance.is_some();
        let scheme_left_open = step.is_none() && scheme.is_none() && !numbers;
        let scheme = scheme.unwrap_or_default();
        let parameter = scheme.traits().parameter;
        if beta.is_some() && parameter != Some(SchemeParameter::Beta) {
            return Err("time.beta: found beside another scheme, allowed: with newmark-beta only");
        }
        if rho_inf.is_some() && parameter != Some(SchemeParameter::RhoInf) {
            return Err(
                "time.rho_inf: found beside another scheme, allowed: with generalised-alpha only",
            );
        }
        if tolerance.is_some() && parameter.is_none() {
            return Err("time.tolerance: found beside another scheme, allowed: with newmark-beta \
                        and generalised-alpha only");
        }
        Ok(Self {
            end: end.unwrap_or(Time::TO_THE_END),
            step,
            scheme,
            scheme_left_open,
            beta: beta.unwrap_or(D::from(0.5)),
            rho_inf: rho_inf.unwrap_or(D::from(RHO_INF)),
            tolerance: tolerance.unwrap_or_default(),
        })
    }
}

impl<D> From<Time<D>> for TimeForm<D> {
    fn from(time: Time<D>) -> Self {
        let Time { end, step, scheme, scheme_left_open, beta, rho_inf, tolerance } = time;
        if scheme_left_open {
            let end = (end != Time::TO_THE_END).then_some(end);
            return Self {
                end,
                step: None,
                scheme: None,
                beta: None,
                rho_inf: None,
                tolerance: None,
            };
        }
        let parameter = scheme.traits().parameter;
        let chosen = parameter.is_some() && tolerance != Tolerance::default();
        Self {
            end: (end != Time::TO_THE_END).then_some(end),
            step,
            scheme: Some(scheme),
            beta: (parameter == Some(SchemeParameter::Beta)).then_some(beta),
            rho_inf: (parameter == Some(SchemeParameter::RhoInf)).then_some(rho_inf),
            tolerance: chosen.then_some(tolerance),
        }
    }
}

impl Time {
    /// The end of a simulation that lasts as long as the recording that leads its ends, until that is
    /// read: a file without `end`.
    pub const TO_THE_END: f64 = f64::INFINITY;
}

impl<D: Copy> Time<D> {
    /// The number that belongs to the scheme: `rho_inf` of generalised-alpha, else `beta`.
    pub fn parameter(&self) -> D {
        match self.scheme.traits().parameter {
            Some(SchemeParameter::RhoInf) => self.rho_inf,
            Some(SchemeParameter::Beta) | None => self.beta,
        }
    }
}

impl Time {
    pub(super) fn over<D: From<f64>>(&self, n: &mut Numbers<'_, D>) -> Time<D> {
        let beta = Quantity::signed("").within(0.5, 1.0);
        let beta = beta.searched(Candidates::Values(&[0.55, 0.75, 0.95]));
        let rho_inf = Quantity::signed("").within(0.0, 1.0);
        let rho_inf = rho_inf.searched(Candidates::Values(&[0.1, 0.5, 0.9]));
        let parameter = self.scheme.traits().parameter;
        Time {
            end: self.end,
            step: self.step,
            scheme: self.scheme,
            scheme_left_open: self.scheme_left_open,
            beta: match parameter {
                Some(SchemeParameter::Beta) => n.number("beta", self.beta, beta),
                _ => D::from(self.beta),
            },
            rho_inf: match parameter {
                Some(SchemeParameter::RhoInf) => n.number("rho_inf", self.rho_inf, rho_inf),
                _ => D::from(self.rho_inf),
            },
            tolerance: self.tolerance,
        }
    }

    /// Duration and step in s, Newmark-beta at beta = 0.5.
    pub fn new(end: f64, step: f64) -> Self {
        Self {
            end,
            step: Some(step),
            scheme: Scheme::default(),
            scheme_left_open: false,
            beta: 0.5,
            rho_inf: RHO_INF,
            tolerance: Tolerance::default(),
        }
    }

    /// Duration in s; step and scheme are the program's to choose.
    pub fn lasting(end: f64) -> Self {
        Self { step: None, scheme_left_open: true, ..Self::new(end, end) }
    }

    /// Whether a given step is longer than the simulation.
    pub(crate) fn is_beyond_end(&self) -> bool {
        self.step.is_some_and(|step| step > self.end * (1.0 + ROUNDING))
    }

    /// Time step, s; the duration where it is left open.
    pub fn step_size(&self) -> f64 {
        self.step.unwrap_or(self.end)
    }

    /// Number of steps to the end; the last may be shorter.
    pub fn steps(&self) -> usize {
        ((self.end / self.step_size() - 1e-9).ceil() as usize).max(1)
    }

    /// Time after `k` steps, s.
    pub fn at(&self, k: usize) -> f64 {
        if k >= self.steps() { self.end } else { k as f64 * self.step_size() }
    }

    /// Refuses what makes no sense.
    pub(super) fn check(&self, led: bool) -> Result<(), Error> {
        match self.end == Self::TO_THE_END {
            true if led => {}
            true => return Err(Error::invalid("time.end", "inf, or none", "finite and above 0 s")),
            false => positive("time.end", self.end)?,
        }
        if let Some(step) = self.step {
            positive("time.step", step)?;
        }
        if !(0.5..=1.0).contains(&self.beta) {
            return Err(Error::invalid("time.beta", self.beta, "in [0.5, 1]"));
        }
        if !(0.0..=1.0).contains(&self.rho_inf) {
            return Err(Error::invalid("time.rho_inf", self.rho_inf, "in [0, 1]"));
        }
        self.tolerance.check()?;
        let (step, steps) = (self.step_size(), self.end / self.step_size());
        if self.end.is_finite() && steps > MOST_STEPS {
            let found = format!("{step:e}, which needs {steps:.3e} steps");
            return Err(Error::invalid("time.step", found, "at most 1e9 steps"));
        }
        Ok(())
    }
}
