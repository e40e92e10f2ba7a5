//! `[time]`: duration, time step and integration scheme, with the validation of these keys.
//!
//! A file may leave out the end (that of the recording), the step, or step and scheme (chosen by the program). Beside a
//! step, or a number of the scheme, the default is Newmark-beta; `rho_inf` alone selects generalised-alpha. Numbers of
//! a scheme (`beta`, `rho_inf`, `tolerance`) are accepted only with the schemes that have them. `check` rejects an end
//! or step that is not positive and finite, a missing end without a recording, numbers out of range, and more than
//! `MOST_STEPS` steps.
//!
//! The steps of a [`Time`] have equal length, except that the last one may be shorter; its end is the duration. A step
//! that is not chosen yet counts as the duration.

use crate::error::Error;
use crate::scene::number::{Candidates, Quantity, SceneNumber};
use crate::scene::scheme::{Scheme, SchemeParameter};
use crate::scene::table::table;
use crate::scene::tolerance::StepTolerance;
use crate::scene::validate::positive;
use serde::{Deserialize, Serialize};

/// Largest number of time steps of a simulation; a scene with more is rejected.
const MOST_STEPS: f64 = 1e9;

/// `[time]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: SceneNumber + schemars::JsonSchema"))]
#[serde(try_from = "TimeForm<D>", into = "TimeForm<D>", bound = "D: SceneNumber")]
pub struct Time<D = f64> {
    /// Duration of the simulation, s; [`Time::TO_THE_END`] for that of the recording that drives the ends.
    pub end: f64,
    /// Time step, s; none if the program chooses it.
    pub step: Option<f64>,
    /// The time integrator.
    pub scheme: Scheme,
    /// Whether the program chooses the scheme, together with the step; `scheme` has no effect then.
    pub scheme_left_open: bool,
    /// Parameter of Newmark-beta, 0.5 to 1; 1 is implicit Euler.
    pub beta: D,
    /// Spectral radius of generalised-alpha at infinite frequency, 0 to 1: factor per step on the amplitude of
    /// vibrations that the step does not resolve.
    pub rho_inf: D,
    /// Newton error of a step of Newmark-beta and generalised-alpha, as a fraction of the rod length.
    pub tolerance: StepTolerance,
}

/// Relative difference below which a step and the duration are equal.
const ROUNDING: f64 = 1e-9;

/// Default of `rho_inf`, the spectral radius of generalised-alpha at infinite frequency.
const RHO_INF: f64 = 0.5;

/// `[time]`: duration, step and scheme.
#[derive(Clone, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: SceneNumber + schemars::JsonSchema"))]
#[serde(deny_unknown_fields, bound = "D: SceneNumber")]
struct TimeForm<D> {
    /// Duration of the simulation, s; default: that of the recording that drives the ends.
    #[serde(skip_serializing_if = "Option::is_none")]
    end: Option<f64>,
    /// Time step, s; default: chosen by the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    step: Option<f64>,
    /// Time integration scheme; default: chosen with the step; beside a step `newmark-beta`, with contacts
    /// `generalised-alpha`.
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
    tolerance: Option<StepTolerance>,
}

impl<D: From<f64>> TryFrom<TimeForm<D>> for Time<D> {
    type Error = &'static str;

    /// The times of a form in a file, with defaults: Newmark-beta (generalised-alpha with `rho_inf` alone), beta 0.5,
    /// `rho_inf` 0.5, tolerance 3e-14. The scheme is left open if neither step nor scheme nor a number of one is given.
    /// A missing end is infinite. An error for an infinite step or end, and for numbers of another scheme.
    fn try_from(form: TimeForm<D>) -> Result<Self, Self::Error> {
        let TimeForm { end, step, scheme, beta, rho_inf, tolerance } = form;
        // Infinity is the internal mark of a missing number, and must not be in a file.
        if step == Some(f64::INFINITY) {
            return Err("time.step: found inf, allowed: a finite number above 0, or no such key");
        }
        if end == Some(Time::TO_THE_END) {
            return Err("time.end: found inf, allowed: a finite number above 0");
        }
        // A step was given for the default scheme, and so were its numbers.
        let numbers = beta.is_some() || rho_inf.is_some() || tolerance.is_some();
        let scheme_left_open = step.is_none() && scheme.is_none() && !numbers;
        // A number that one scheme alone has names that scheme.
        let of_number = (rho_inf.is_some() && beta.is_none()).then_some(Scheme::GeneralisedAlpha);
        let scheme = scheme.or(of_number).unwrap_or_default();
        let parameter = scheme.traits().parameter;
        // A number of another scheme would have no effect.
        if beta.is_some() && parameter != Some(SchemeParameter::Beta) {
            return Err("time.beta: found with another scheme, allowed: with newmark-beta only");
        }
        if rho_inf.is_some() && parameter != Some(SchemeParameter::RhoInf) {
            return Err(
                "time.rho_inf: found with another scheme, allowed: with generalised-alpha only",
            );
        }
        if tolerance.is_some() && parameter.is_none() {
            return Err("time.tolerance: found with another scheme, allowed: with newmark-beta \
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
    /// The form in a file. An end that is missing (infinite) is left out. With an open scheme, step, scheme and its
    /// numbers are left out too. Numbers of other schemes, and the default tolerance, are always left out.
    fn from(time: Time<D>) -> Self {
        let Time { end, step, scheme, scheme_left_open, beta, rho_inf, tolerance } = time;
        let parameter = scheme.traits().parameter;
        let is_tolerance_given = parameter.is_some() && tolerance != StepTolerance::default();
        // Numbers of the scheme are written with a scheme that was given.
        let given = !scheme_left_open;
        Self {
            end: (end != Time::TO_THE_END).then_some(end),
            step: step.filter(|_| given),
            scheme: given.then_some(scheme),
            beta: (given && parameter == Some(SchemeParameter::Beta)).then_some(beta),
            rho_inf: (given && parameter == Some(SchemeParameter::RhoInf)).then_some(rho_inf),
            tolerance: (given && is_tolerance_given).then_some(tolerance),
        }
    }
}

impl Time {
    /// Duration of a file without `end`, until the recording that drives the ends is read.
    pub const TO_THE_END: f64 = f64::INFINITY;
}

impl<D: Copy> Time<D> {
    /// Parameter of the scheme: `rho_inf` of generalised-alpha, and `beta` of all others, of which only Newmark-beta
    /// uses it.
    pub fn parameter(&self) -> D {
        match self.scheme.traits().parameter {
            Some(SchemeParameter::RhoInf) => self.rho_inf,
            Some(SchemeParameter::Beta) | None => self.beta,
        }
    }
}

/// Quantity of the damping parameter of Newmark-beta, 0.5 to 1.
const BETA: Quantity =
    Quantity::signed("").within(0.5, 1.0).searched(Candidates::Values(&[0.55, 0.75, 0.95]));
/// Quantity of the spectral radius of generalised-alpha at infinite frequency, 0 to 1.
const RADIUS: Quantity =
    Quantity::signed("").within(0.0, 1.0).searched(Candidates::Values(&[0.1, 0.5, 0.9]));

table!(@numbers Time {
    end,
    step,
    scheme,
    scheme_left_open,
    beta = BETA,
    rho_inf = RADIUS,
    tolerance,
});

impl Time {
    /// Duration and step, s, with Newmark-beta at beta = 0.5.
    ///
    /// ```
    /// let time = rodfit::scene::Time::new(1.0, 1e-3); // s
    /// assert_eq!((time.steps(), time.at(500)), (1000, 0.5));
    /// ```
    pub fn new(end: f64, step: f64) -> Self {
        Self {
            end,
            step: Some(step),
            scheme: Scheme::default(),
            scheme_left_open: false,
            beta: 0.5,
            rho_inf: RHO_INF,
            tolerance: StepTolerance::default(),
        }
    }

    /// Times with the duration `end`, s, and a step and a scheme that the program chooses.
    pub fn lasting(end: f64) -> Self {
        Self { step: None, scheme_left_open: true, ..Self::new(end, end) }
    }

    /// Whether a given step is longer than the duration, beyond rounding. False if the program chooses the step.
    pub(crate) fn is_beyond_end(&self) -> bool {
        self.step.is_some_and(|step| step > self.end * (1.0 + ROUNDING))
    }

    /// Time step, s; the duration if the step is not chosen yet.
    pub fn step_size(&self) -> f64 {
        self.step.unwrap_or(self.end)
    }

    /// Number of steps to the end, rounded up except for rounding errors, at least one; the last step may be shorter.
    pub fn steps(&self) -> usize {
        // A duration of whole steps must not get one more by rounding.
        ((self.end / self.step_size() - ROUNDING).ceil() as usize).max(1)
    }

    /// Time after `k` steps, s: `k` times the step, and the end after all steps or more.
    pub fn at(&self, k: usize) -> f64 {
        if k >= self.steps() { self.end } else { k as f64 * self.step_size() }
    }

    /// Rejects an end or step that is not positive and finite, beta outside 0.5 to 1, `rho_inf` outside 0 to 1, and an
    /// invalid tolerance. Also rejected are more than [`MOST_STEPS`] steps, and a missing end unless recorded ends give
    /// it (`has_recording`).
    pub(super) fn check(&self, has_recording: bool) -> Result<(), Error> {
        match self.end == Self::TO_THE_END {
            true if has_recording => {}
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
