//! Mesh, step and scheme that a scene leaves to the program, and the accuracy of the choice.
//!
//! The mesh is open, to be chosen by the program, without `rod.segments` (except of a polyline), and the step without
//! `time.step`. The scheme is open if step, scheme and numbers of the scheme are all left out (`left_open`). `resolved`
//! sets the open settings and adds a [`Resolution`], `by` replaces a chosen scheme, and `reopened` makes chosen
//! settings open again. The module `accuracy` makes the choice.
//!
//! A [`Resolution`] has the settings of a run and which of them the program chose. It also has the requested error (by
//! default `ACCURACY`) and the estimated one, if there is an estimate, as fractions of the rod length, or of a
//! frequency for modes. `words` describes them as text; `warning` is the warning, with its code, if the requested
//! accuracy was not reached. `check_accuracy` rejects a requested error outside `ALLOWED`, and an open mesh beside node
//! indices.

use crate::code::Code;
use crate::error::Error;
use crate::scene::{Scene, Scheme, Shape, StepTolerance};
use serde::{Deserialize, Serialize};

/// Default accuracy: largest error of the motion as a fraction of the rod length.
const ACCURACY: f64 = 1e-3;
/// Allowed accuracies, fractions of the rod length.
const ALLOWED: std::ops::RangeInclusive<f64> = 1e-8..=0.1;
/// Spectral radius of generalised-alpha if the program chooses the scheme. Of the values compared
/// (`cargo run --release --example chosen_numerics -- schemes`) 0.8 is as accurate as newmark-beta at beta = 0.5 for
/// any damping. It takes steps at which that one fails or, with stiff damping, has errors of the order of the length; 0
/// does not allow large first steps.
const RHO_INF: f64 = 0.8;

/// Numerical settings that the program chose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Chosen {
    /// Whether the program chose `rod.segments`.
    pub segments: bool,
    /// Whether the program chose `time.step`.
    pub step: bool,
    /// Whether the program chose `time.scheme`.
    pub scheme: bool,
}

impl Chosen {
    /// Whether the program chose mesh or step; the scheme does not count.
    pub fn any(self) -> bool {
        self.segments || self.step
    }
}

/// Mesh, step and scheme of a run, and their estimated error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Resolution {
    /// Number of edges.
    pub segments: usize,
    /// Time step, s; null without a motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step: Option<f64>,
    /// Time integration scheme; null without a motion.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scheme: Option<Scheme>,
    /// Settings that the program chose.
    pub chosen: Chosen,
    /// Requested error of the motion as a fraction of the rod length.
    pub accuracy: f64,
    /// Estimated error of the motion as a fraction of the rod length; null if not estimated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Work of the trial runs, edges times Newton iterations.
    #[serde(default)]
    pub work: f64,
    /// Reason why the error may exceed the requested accuracy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bound: Option<Bound>,
}

/// Reason why the requested accuracy was not reached.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Bound {
    /// Finer runs would be too expensive.
    Work,
    /// Mesh or step of the scene is too coarse.
    Given,
}

impl Resolution {
    /// Text with the settings that the program chose (else that mesh and step are as given), then estimated and
    /// requested error, fractions of the length. Without an estimated error it ends after the settings; if there is a
    /// [`Bound`], it states that the error was not estimated.
    pub fn words(&self) -> String {
        self.words_over("the length")
    }

    /// [`words`](Self::words) with the error as a fraction of `whole`, such as `a frequency`, in place of the length.
    /// The number of edges, step, s, and scheme are listed only if the program chose them.
    pub(crate) fn words_over(&self, whole: &str) -> String {
        let Self { segments, step, scheme, chosen, .. } = self;
        // Only the settings that the program chose are listed.
        let mut parts = Vec::new();
        if chosen.segments {
            parts.push(format!("{segments} segments"));
        }
        if let (Some(step), true) = (step, chosen.step) {
            parts.push(format!("a step of {step:.3e} s"));
        }
        if let (Some(scheme), true) = (scheme, chosen.scheme) {
            parts.push(scheme.name().into());
        }
        let settings = match parts.is_empty() {
            true => "mesh and step as given".into(),
            false => format!("chosen automatically: {}", parts.join(", ")),
        };
        let asked = self.accuracy;
        match (self.error, self.bound) {
            (Some(error), _) => {
                format!("{settings}; estimated error {error:.1e} of {whole}, requested {asked:.0e}")
            }
            (None, Some(_)) => {
                format!("{settings}; error not estimated, requested {asked:.0e} of {whole}")
            }
            (None, None) => settings,
        }
    }

    /// Warning, with its code, that the requested accuracy was not reached: estimated error, reason ([`Bound`]) and
    /// remedy. None without a bound.
    pub fn warning(&self) -> Option<(Code, String)> {
        self.warning_over("the length")
    }

    /// [`warning`](Self::warning) with the error as a fraction of `whole`, such as `a frequency`, in place of the
    /// length. A limit of work advises a shorter or damped motion (with a step) or a larger accuracy. A given mesh or
    /// step that is too coarse has another code, and advises to leave it out.
    pub(crate) fn warning_over(&self, whole: &str) -> Option<(Code, String)> {
        let Self { accuracy, error, bound: Some(bound), .. } = self else { return None };
        // The consequence for the user depends on the reason: work or a given mesh.
        let error = match error {
            Some(error) => format!("is estimated at {error:.1e} of {whole}, above {accuracy:e}"),
            None => format!("could not be estimated, and may be above {accuracy:e} of {whole}"),
        };
        Some(match (bound, self.step) {
            (Bound::Work, Some(_)) => (
                Code::AccuracyOutOfReach,
                format!(
                    "accuracy: the error {error}. Finer runs {}would take too long, so that the request is not met. \
                     Shorten time.end, add damping, request a larger accuracy, or give rod.segments and time.step",
                    if self.error.is_none() { "failed or " } else { "" }
                ),
            ),
            (Bound::Work, None) => (
                Code::AccuracyOutOfReach,
                format!(
                    "accuracy: the error {error}. Finer meshes would take too long or have larger rounding \
                     errors, so that the request is not met. Request a larger accuracy, or give rod.segments"
                ),
            ),
            (Bound::Given, _) => (
                Code::AccuracyNotMet,
                format!(
                    "accuracy: the error {error}. The given mesh or step is too coarse for the request. Leave out \
                     rod.segments, time.step and time.scheme, and the program chooses them"
                ),
            ),
        })
    }
}

impl<D> Scene<D> {
    /// Settings that the scene leaves to the program. The mesh is open without `rod.segments`, except for a polyline,
    /// whose points give it. The step is open if there is a `[time]` without a step. The scheme is open with the step,
    /// if `[time]` has neither a scheme nor numbers of one.
    pub(crate) fn left_open(&self) -> Chosen {
        let given = matches!(self.rod.shape, Shape::Polyline { .. });
        let step = self.time.as_ref().is_some_and(|time| time.step.is_none());
        Chosen {
            segments: self.rod.segments.is_none() && !given,
            step,
            scheme: step && self.time.as_ref().is_some_and(|time| time.scheme_left_open),
        }
    }

    /// Settings that the program chose when the scene was resolved; none of them for a scene without a resolution.
    pub(crate) fn chosen(&self) -> Chosen {
        self.resolution.map(|resolution| resolution.chosen).unwrap_or_default()
    }
}

impl Scene {
    /// Requested accuracy: largest error of the motion, a fraction of the rod length; the default is [`ACCURACY`].
    pub(crate) fn asked(&self) -> f64 {
        self.accuracy.unwrap_or(ACCURACY)
    }

    /// The scene with `segments` edges and the time step `step`, s, each applied only if the setting is open or was
    /// chosen by the program before. A scheme that is open, or was chosen before, becomes generalised-alpha with
    /// [`RHO_INF`] and the default tolerance. A mesh that was chosen before is changed by `remeshed`, so that node
    /// indices keep their arc length. The result has a resolution without an estimated error.
    pub(crate) fn resolved(&self, segments: usize, step: f64) -> Scene {
        let (open, before) = (self.left_open(), self.chosen());
        // A setting that the program chose before may be chosen anew.
        let chosen = Chosen {
            segments: open.segments || before.segments,
            step: open.step || before.step,
            scheme: open.scheme || before.scheme,
        };
        let mut scene = self.clone();
        if open.segments {
            scene.rod.segments = Some(segments);
        } else if before.segments {
            // Points that are named by a node index keep their arc length.
            scene.remeshed = Some(segments);
        }
        if let Some(time) = scene.time.as_mut().filter(|_| chosen.step) {
            time.step = Some(step);
            if chosen.scheme {
                // Simulations allow a larger Newton error than derivatives.
                (time.scheme, time.rho_inf) = (Scheme::GeneralisedAlpha, RHO_INF);
                (time.tolerance, time.scheme_left_open) = (StepTolerance::default(), false);
            }
        }
        let time = scene.time.as_ref();
        scene.resolution = Some(Resolution {
            segments: if chosen.segments {
                segments
            } else {
                scene.rod.segments.unwrap_or(segments)
            },
            step: time.and_then(|time| time.step),
            scheme: time.map(|time| time.scheme),
            chosen,
            accuracy: self.asked(),
            error: None,
            work: 0.0,
            bound: None,
        });
        scene
    }

    /// The scene with `scheme`, also in its resolution, if the program chose the scheme; otherwise unchanged.
    pub(crate) fn by(mut self, scheme: Scheme) -> Scene {
        if self.chosen().scheme {
            self.time.iter_mut().for_each(|time| time.scheme = scheme);
            self.resolution.iter_mut().for_each(|resolution| resolution.scheme = Some(scheme));
        }
        self
    }

    /// The scene in which mesh, step and scheme that the program chose are left open again, without a resolution. Given
    /// settings stay. With an open scheme the tolerance becomes the default; its name and parameter stay, without
    /// effect, until a new choice.
    pub fn reopened(&self) -> Scene {
        let chosen = self.chosen();
        let mut scene = Scene { resolution: None, ..self.clone() };
        if chosen.segments {
            (scene.rod.segments, scene.remeshed) = (None, None);
        }
        if let Some(time) = scene.time.as_mut().filter(|_| chosen.step) {
            time.step = None;
            time.scheme_left_open = chosen.scheme;
            if chosen.scheme {
                time.tolerance = StepTolerance::default();
            }
        }
        scene
    }

    /// Rejects a given accuracy outside 1e-8 to 0.1 ([`ALLOWED`]). Rejects an open mesh beside loads or masses on node
    /// indices, which would depend on the choice.
    pub(super) fn check_accuracy(&self) -> Result<(), Error> {
        if let Some(accuracy) = self.accuracy.filter(|a| !ALLOWED.contains(a)) {
            let allowed = "1e-8 .. 0.1, the largest error over the rod's length";
            return Err(Error::invalid("accuracy", accuracy, allowed));
        }
        if self.left_open().segments && self.mesh_is_given() {
            let allowed = "2 .. 1e7 in a scene with loads or masses on node indices. Without \
                           segments give { arc_length = distance from the wall in m } or \"tip\" instead of an index";
            return Err(Error::invalid("rod.segments", "no such key", allowed));
        }
        Ok(())
    }
}
