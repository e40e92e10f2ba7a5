//! Whether the rod is slender enough for a model without shear deformation and rotary inertia.
//!
//! Both make a real rod softer than the model. To first order in `I/(A L^2)` the squared frequency of a mode is lower by
//! what [`thickness_effects`] gives, and a rod at rest deflects more by its [shear deflections](Problem::shear_deflections). A motion is taken for one in
//! the first bending mode, which then shows a Young's modulus lower by the same part. These changes of the simulated
//! values go through the linear fit: by `-(J'J)^-1 J' change` the parameters would move, which is what the estimates
//! are off by. No simulation is needed.

use crate::code::Code;
use crate::error::Error;
use crate::fit::measurement::MeasuredData;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::frequencies::ModeFrequencies;
use crate::fit::measurement::shape::EquilibriumShape;
use crate::fit::misfit::camera::View;
use crate::fit::search::fitted::Fitted;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::{Severity, Warnings, percent};
use crate::fit::uncertainty::noise::residual_noise::Noise;
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use crate::numerics::vector::{add, dot, scale, sub};
use crate::problem::Problem;
use crate::scene::{Parameter, Scene};
use crate::vibration::{LinearizationPoint, ModeFilter, ModeKind, ModeName, thickness_effects};
use std::cmp::Reverse;
use std::f64::consts::PI;

/// Part of a standard error from which a bias is reported: it then widens a 95 % interval by 1.5 %.
const WORTH_A_NOTE: f64 = 0.25;
/// Standard errors from which a bias lowers the grade: the 95 % interval then covers the truth in 83 % of fits.
const LOWERS_THE_GRADE: f64 = 1.0;
/// Part of the rod's stiffness below which nothing is reported, however exact the data. An error of 0.1 % of the free
/// length, which hardly is known better, does as much: squared frequencies go with its fourth power.
const SMALLEST_SOFTENING: f64 = 4e-3;
/// Largest mean square of the slope of mode n over that of the mode, in units of ((n + 1) pi/L)^2: 1.25 of a free rod.
const LARGEST_SLOPE: f64 = 1.3;
/// An amplitude of an effect below this by so many standard errors is excluded by the data. The theory itself is off by
/// less: by the shear coefficient and Poisson's ratio, a fifth at most.
const HALF: f64 = 0.5;
const CERTAIN: f64 = 3.0;
/// Poisson's ratio of a rod whose scene gives none.
const USUAL_RATIO: f64 = 0.3;
/// So many parameters are named.
const NAMED: usize = 3;

/// Ratio E/(kappa G) of a rod.
struct ShearFlexibility {
    /// Of an isotropic material.
    isotropic: f64,
    /// With the shear modulus of the scene, where an isotropic material cannot have it.
    stated: Option<f64>,
}

impl ShearFlexibility {
    fn of(scene: &Scene) -> Self {
        let (section, material) = scene.at(0.5);
        let ratio = |shear: f64| material.youngs_modulus / (2.0 * shear) - 1.0;
        let implied = material.shear_modulus.map(ratio);
        let possible = implied.filter(|nu| (-1.0..=0.5).contains(nu));
        let nu = material.poisson_ratio.or(possible).unwrap_or(USUAL_RATIO);
        let flexibility = |modulus_ratio: f64| modulus_ratio / section.shear_coefficient(nu);
        let stated = material.shear_modulus.filter(|_| possible.is_none());
        Self {
            isotropic: flexibility(2.0 * (1.0 + nu)),
            stated: stated.map(|shear| flexibility(material.youngs_modulus / shear)),
        }
    }

    fn largest(&self) -> f64 {
        self.isotropic.max(self.stated.unwrap_or(0.0))
    }
}

/// Changes of the simulated values of one fit by what the model leaves out.
struct Softening {
    /// Change of every residual.
    change: Vec<f64>,
    /// Largest relative reduction of stiffness, as a squared frequency or a deflection shows it.
    largest: f64,
    /// The same of motions whose Young's modulus is not identified: no row of the Jacobian has their change.
    without_row: f64,
}

/// Warns where the rod is too thick for the model, as the data resolve it.
pub(crate) fn check_slenderness(
    fitted: Fitted,
    LocalAnalysis { covariance, noise, .. }: &LocalAnalysis,
    estimates: &[Estimate],
    warnings: &mut Warnings,
) {
    let Fitted { search, optimum } = fitted;
    let softened =
        |pick: fn(&ShearFlexibility) -> Option<f64>| softening(fitted, pick).ok().flatten();
    let Some(usual) = softened(|flexibility| Some(flexibility.isotropic)) else { return };
    if usual.largest < SMALLEST_SOFTENING {
        return;
    }
    let moves_by = |softening: &Softening| {
        let twice_weighted: Vec<f64> =
            softening.change.iter().zip(&noise.weights).map(|(c, w)| w * w * c).collect();
        covariance.response(&optimum.jacobian, &twice_weighted)
    };
    if is_excluded(optimum, &usual.change, &moves_by(&usual), noise) {
        return;
    }
    let biases = |softening: &Softening| {
        let moves = moves_by(softening);
        let bias = |(j, estimate): (usize, &Estimate)| {
            let elsewhere = by_modulus(estimate, &search.unknowns[j], softening.without_row);
            let correction = moves[j]? + elsewhere;
            Bias::of(estimate, &search.unknowns[j], correction)
        };
        estimates.iter().enumerate().map(bias).collect::<Vec<_>>()
    };
    let (found, stated) = (biases(&usual), softened(|flexibility| flexibility.stated));
    let stated = stated.map(|softening| biases(&softening));
    let mut named: Vec<(&Bias, Option<&Bias>)> = found
        .iter()
        .enumerate()
        .filter_map(|(j, bias)| {
            let other = stated.as_ref().and_then(|all| all[j].as_ref());
            Some((bias.as_ref()?, other))
        })
        .filter(|(bias, _)| bias.std_errors.abs() > WORTH_A_NOTE)
        .collect();
    named.sort_by_cached_key(|x| Reverse(total_order(x.0.std_errors.abs())));
    let soft = percent(usual.largest);
    let Some((worst, _)) = named.first() else {
        // Not even the size is known where no parameter has an answer to it.
        if estimates.iter().any(|e| e.std_error.is_some())
            && usual.without_row >= SMALLEST_SOFTENING
            && estimates.iter().all(|e| e.input_sensitivities.is_empty())
        {
            let words = format!(
                "the rod is thick: shear deformation and rotary inertia, which the model leaves out, make it softer by \
                 {soft}. Parameters that depend on its stiffness are off accordingly. Measure a longer or thinner rod"
            );
            warnings.add(Severity::Note, Code::ThickRod, words);
        }
        return;
    };
    let weight = match worst.std_errors.abs() > LOWERS_THE_GRADE {
        true => Severity::Validity,
        false => Severity::Note,
    };
    let each: Vec<String> =
        named.iter().take(NAMED).map(|(bias, other)| bias.words(*other)).collect();
    let words = format!(
        "the rod is too thick for the model: {}. It leaves out shear deformation and rotary inertia, which make the rod \
         softer by up to {soft}. Measure a longer or thinner rod, or correct the value",
        each.join(", ")
    );
    warnings.add(weight, Code::ThickRod, words);
}

/// Whether the residuals exclude half of the change: measured values of several modes or points show it by themselves.
///
/// The parameters take up a part of a change; the rest `u`, weighted, must stand in the residuals `r` with the amplitude
/// `a = -u.r/|u|^2`, 1 where the rod is as the theory has it, with the standard error `s/|u|` for noise of variance `s^2`.
fn is_excluded(optimum: &Optimum, change: &[f64], moves: &[Option<f64>], noise: &Noise) -> bool {
    let (mut own, mut both) = (0.0, 0.0);
    let rows = optimum.jacobian.iter().zip(change).zip(&optimum.residuals).zip(&noise.weights);
    for (((row, change), residual), weight) in rows {
        let by_moves = row.iter().zip(moves).map(|(d, by)| d * by.unwrap_or(0.0)).sum::<f64>();
        let rest = weight * (change + by_moves);
        own += rest * rest;
        both += rest * weight * residual;
    }
    let std_error = (noise.variance / own.max(f64::MIN_POSITIVE)).sqrt();
    -both / own.max(f64::MIN_POSITIVE) + CERTAIN * std_error < HALF
}

/// What an estimate is off by.
struct Bias {
    label: String,
    unit: &'static str,
    /// In the parameter's unit.
    off: f64,
    /// Over the true value, of positive parameters.
    relative: Option<f64>,
    std_errors: f64,
}

impl Bias {
    /// Of an estimate that would move by `correction` on its scale.
    fn of(estimate: &Estimate, unknown: &Unknown, correction: f64) -> Option<Self> {
        let value = estimate.value?;
        let std_error = estimate.combined_std.or(estimate.std_error)?;
        let positive = unknown.parameter.is_positive();
        let off = match positive {
            true => -value * correction.exp_m1(),
            false => -correction * unknown.slope(value),
        };
        Some(Self {
            label: estimate.label(),
            unit: estimate.name.unit(),
            off,
            relative: positive.then(|| (-correction).exp_m1()),
            std_errors: off / std_error,
        })
    }

    fn size(&self) -> String {
        match self.relative {
            Some(relative) => percent(relative.abs()),
            None => format!("{:.1e} {}", self.off.abs(), self.unit).trim_end().into(),
        }
    }

    /// In words, with what it is at the shear modulus of the scene, where that makes a difference.
    fn words(&self, stated: Option<&Self>) -> String {
        let direction = if self.off < 0.0 { "low" } else { "high" };
        let other = stated.map_or(String::new(), |other| {
            format!("; {} with the scene's shear modulus", other.size())
        });
        let errors = self.std_errors.abs();
        format!(
            "{} is {} too {direction} ({errors:.1} standard errors{other})",
            self.label,
            self.size()
        )
    }
}

/// By how much an estimate would move on its scale if motions showed a Young's modulus lower by a part.
fn by_modulus(estimate: &Estimate, unknown: &Unknown, part: f64) -> f64 {
    let modulus = Parameter::YoungsModulus.path();
    let by = estimate.input_sensitivities.iter().find(|per_cent| per_cent.source == modulus);
    let slope = estimate.value.map_or(1.0, |value| unknown.slope(value));
    by.map_or(0.0, |per_cent| -100.0 * part.ln_1p() * per_cent.change / slope)
}

/// What the model leaves out of all experiments, at the ratio E/(kappa G) that `pick` takes; none where no scene has it.
fn softening(
    fitted: Fitted,
    pick: fn(&ShearFlexibility) -> Option<f64>,
) -> Result<Option<Softening>, Error> {
    let Fitted { search, optimum } = fitted;
    let mut softening =
        Softening { change: vec![0.0; optimum.residuals.len()], largest: 0.0, without_row: 0.0 };
    let (mut first, mut any) = (0, false);
    let mut sigmas = search.sigmas.iter().zip(&optimum.counts);
    for experiment in search.experiments {
        let problem = fitted.problem(experiment)?;
        let flexibility = ShearFlexibility::of(problem.scene());
        let picked = pick(&flexibility);
        any |= picked.is_some();
        let thick = is_worth_a_look(experiment, &problem, flexibility.largest());
        let mut motion: Option<f64> = None;
        for measurement in &experiment.measurements {
            let Some((sigma, count)) = sigmas.next() else { break };
            let place = first..first + count;
            first += count;
            let Some(flexibility) = picked.or(Some(flexibility.isotropic)).filter(|_| thick) else {
                continue;
            };
            let inverse_sigmas = measurement.sigmas(*sigma).into_iter().map(f64::recip);
            match &measurement.data {
                MeasuredData::ModeFrequencies(frequencies) => {
                    let reductions = reductions(&problem, frequencies, flexibility)?;
                    let all = frequencies.values.iter().zip(&reductions).zip(inverse_sigmas);
                    for (k, ((value, reduction), inverse)) in place.zip(all) {
                        let lower = (1.0 + reduction).sqrt().recip() - 1.0;
                        softening.change[k] = value.rad_s * lower * inverse;
                        softening.largest = softening.largest.max(*reduction);
                    }
                }
                MeasuredData::EquilibriumShape(shape) => {
                    let (displaced, part) = displacements(&problem, shape, flexibility)?;
                    for (k, (change, inverse)) in place.zip(displaced.iter().zip(inverse_sigmas)) {
                        softening.change[k] = change * inverse;
                    }
                    softening.largest = softening.largest.max(part);
                }
                _ => {
                    let part = match motion {
                        Some(part) => part,
                        None => *motion.insert(first_mode(&problem, flexibility)?),
                    };
                    softening.largest = softening.largest.max(part);
                    let modulus = |u: &Unknown| {
                        u.parameter == Parameter::YoungsModulus && u.is_of(experiment)
                    };
                    match search.unknowns.iter().position(modulus) {
                        Some(j) => place.for_each(|k| {
                            let by_logarithm = optimum.jacobian.get(k).map_or(0.0, |row| row[j]);
                            softening.change[k] = -part.ln_1p() * by_logarithm;
                        }),
                        None => softening.without_row = softening.without_row.max(part),
                    }
                }
            }
        }
    }
    Ok(any.then_some(softening))
}

/// Whether an upper bound of what the model leaves out of an experiment can matter.
fn is_worth_a_look(experiment: &Experiment, problem: &Problem, flexibility: f64) -> bool {
    let scene = problem.scene();
    let radius = [0.0, 0.5, 1.0].map(|place| scene.at(place).0.radius_of_gyration());
    let radius = radius.into_iter().fold(0.0, f64::max);
    let number = experiment.highest_mode().max(1) as f64;
    let wave = (number + 1.0) * PI / problem.length();
    LARGEST_SLOPE * (wave * radius).powi(2) * (1.0 + flexibility) > SMALLEST_SOFTENING
}

/// By what part the squared frequencies are lower.
fn reductions(
    problem: &Problem,
    frequencies: &ModeFrequencies,
    flexibility: f64,
) -> Result<Vec<f64>, Error> {
    let names: Vec<ModeName> = frequencies.names().collect();
    let effects = thickness_effects(problem, &names, LinearizationPoint::Equilibrium)?;
    Ok(effects.iter().map(|effect| effect.reduction(flexibility)).collect())
}

/// By what part the squared frequency of the first bending mode about the rest shape is lower: without loads it is in
/// proportion to Young's modulus.
fn first_mode(problem: &Problem, flexibility: f64) -> Result<f64, Error> {
    let among = ModeFilter { kind: Some(ModeKind::Bending), ..ModeFilter::default() };
    let first = [ModeName { number: 1, among }];
    Ok(thickness_effects(problem, &first, LinearizationPoint::Rest)?[0].reduction(flexibility))
}

/// Changes of the coordinates that were seen of a rod at rest, m, and the largest displacement over the largest
/// deflection.
fn displacements(
    problem: &Problem,
    shape: &EquilibriumShape,
    flexibility: f64,
) -> Result<(Vec<f64>, f64), Error> {
    let (by_shear, view) = (problem.shear_deflections()?, View::new(problem, |_, value| value));
    let origin = view.recorded([0.0; 3]);
    let size = |v: [f64; 3]| dot(v, v).sqrt();
    let (mut changes, mut displaced, mut deflected) = (Vec::new(), 0.0_f64, 0.0_f64);
    for sighting in shape.placed(problem) {
        let stencil = problem.stencil(sighting.point)?;
        let sum = stencil
            .nodes
            .iter()
            .fold([0.0; 3], |sum, (i, weight)| add(sum, scale(by_shear[*i], weight * flexibility)));
        let recorded = sub(view.recorded(sum), origin);
        let seen = sighting.position.iter().zip(recorded);
        changes.extend(seen.filter_map(|(seen, change)| seen.map(|_| change)));
        displaced = displaced.max(size(sum));
        let rest = view.recorded(problem.rest_position(&stencil));
        let away =
            sighting.position.iter().zip(rest).filter_map(|(seen, rest)| Some((*seen)? - rest));
        deflected = deflected.max(away.map(|d| d * d).sum::<f64>().sqrt());
    }
    Ok((changes, displaced / deflected.max(f64::MIN_POSITIVE)))
}
