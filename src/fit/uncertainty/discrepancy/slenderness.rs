//! Bias of the estimates by shear deformation and rotary inertia, which the model leaves out: whether the rod is
//! slender enough.
//!
//! Both make a real rod softer than the model (Timoshenko). The squared frequency of a mode is lower by the [thickness
//! effects](thickness_effects). A rod at rest deflects more by its [shear deflections](Problem::shear_deflections). A
//! motion (or any other measurement) changes as if Young's modulus were lower by the same factor as the squared
//! frequency of the first bending mode. Input: an optimum with its local analysis and estimates. By these changes of
//! the simulated values the parameters would move by `-(J'J)^-1 J' change`, with the weighted Jacobian `J`; their bias
//! is the opposite. No simulation of the motion is needed.
//!
//! [`check_slenderness`] adds one note on biases above [`WORTH_A_NOTE`] standard errors (combined standard
//! uncertainties where known). If the largest is above [`LOWERS_THE_GRADE`], it is a warning that lowers the grade. It
//! names up to [`NAMED`] estimates, the largest bias first. Where motions determine no Young's modulus and the response
//! of the parameters to it is unknown, a note has the relative softening alone. Softenings below
//! [`SMALLEST_SOFTENING`], those that the residuals exclude, and structures are not reported. Frequencies that are
//! simulated with both effects (`timoshenko = true`) have no bias; a warning states where their correction exceeds
//! [`LARGEST_FACTOR`].

use crate::code::Code;
use crate::error::Error;
use crate::fit::measurement::MeasuredData;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::frequencies::ModeFrequencies;
use crate::fit::measurement::shape::EquilibriumShape;
use crate::fit::misfit::camera::View;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::covariance::gauss_newton::LinearResponse;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::estimate::{Estimate, ParameterBias};
use crate::fit::uncertainty::noise::residual_noise::ResidualNoise;
use crate::fit::uncertainty::warning_list::{Severity, Warnings, percent};
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use crate::numerics::vector::{add, dot, scale, sub};
use crate::problem::Problem;
use crate::scene::shear::USUAL_RATIO;
use crate::scene::{Parameter, Scene};
use crate::vibration::{
    LARGEST_FACTOR, LinearizationPoint, ModeFilter, ModeKind, ModeName, thickness_effects,
};
use std::cmp::Reverse;
use std::f64::consts::PI;

/// Bias in standard errors above which it is reported: it then widens a 95 % interval by 1.5 %.
const WORTH_A_NOTE: f64 = 0.25;
/// Bias in standard errors above which it lowers the grade: the 95 % interval then covers the truth in 83 % of fits.
const LOWERS_THE_GRADE: f64 = 1.0;
/// Relative softening below which nothing is reported, however exact the data. An error of 0.1 % of the free
/// length, which is rarely known better, has the same effect: squared frequencies scale as its fourth power.
const SMALLEST_SOFTENING: f64 = 4e-3;
/// Largest mean square of the slope of mode n over the mean square of its displacement, in units of ((n + 1) pi/L)^2:
/// 1.25 of a free rod.
const LARGEST_SLOPE: f64 = 1.3;
/// Amplitude of the effect over that of the theory, below which the data exclude the effect. The theory is more
/// accurate than that: shear coefficient and Poisson's ratio change it by a fifth at most.
const EXCLUDED_AMPLITUDE: f64 = 0.5;
/// Standard errors by which the amplitude must be below that limit.
const CERTAIN: f64 = 3.0;
/// Largest number of parameters in a warning.
const NAMED: usize = 3;

/// Ratio `E/(kappa G)` of a rod: Young's modulus over shear coefficient times shear modulus.
struct ShearFlexibility {
    /// With the shear modulus of an isotropic material.
    isotropic: f64,
    /// With the shear modulus of the scene; none without one, or if an isotropic material can have it (Poisson's ratio
    /// from -1 to 0.5).
    stated: Option<f64>,
}

impl ShearFlexibility {
    /// The ratios for section and material in the middle of the rod. Poisson's ratio is the given one, else
    /// `E/(2 G) - 1` of a given shear modulus `G` if that is from -1 to 0.5, else [`USUAL_RATIO`]; shear coefficients
    /// depend on it. The ratio with a given `G` is there only if `E/(2 G) - 1` is beyond that range.
    fn new(scene: &Scene) -> Self {
        let (section, material) = scene.at(0.5);
        // Isotropic materials have G = E/(2 (1 + nu)).
        let ratio = |shear: f64| material.youngs_modulus / (2.0 * shear) - 1.0;
        let implied = material.shear_modulus.map(ratio);
        let possible = implied.filter(|nu| (-1.0..=0.5).contains(nu));
        let nu = material.poisson_ratio.or(possible).unwrap_or(USUAL_RATIO);
        let isotropic = section.shear_flexibility(nu);
        let stated = material.shear_modulus.filter(|_| possible.is_none());
        let relative = |shear: f64| material.youngs_modulus / (2.0 * (1.0 + nu) * shear);
        Self { isotropic, stated: stated.map(|shear| isotropic * relative(shear)) }
    }
}

/// Changes of the simulated values of one fit by shear deformation and rotary inertia.
struct Softening {
    /// Change of every residual (simulated less measured value), in units of sigma.
    change: Vec<f64>,
    /// Largest relative reduction of a squared frequency, or increase of a deflection.
    largest: f64,
    /// The same of motions whose Young's modulus is not identified: the Jacobian has no column for their change.
    without_row: f64,
    /// Largest factor by which a correction lowers the squared frequencies of `timoshenko = true`; 1 without a
    /// correction.
    corrected: f64,
}

/// Bias of an estimate by shear deformation and rotary inertia.
struct SlendernessBias<'a> {
    /// The biased estimate.
    estimate: &'a Estimate,
    /// Bias in the parameter's unit.
    bias: ParameterBias,
    /// Bias over the combined standard uncertainty, or else the standard error; negative if the estimate is too low.
    std_errors: f64,
}

/// Adds a warning or note if shear deformation and rotary inertia, which the model leaves out, bias the `estimates` by
/// more than [`WORTH_A_NOTE`] standard errors. Above [`LOWERS_THE_GRADE`] the severity is `Validity`, else `Note`. The
/// text lists up to [`NAMED`] of these, the largest bias first. If there are none because motions determine no Young's
/// modulus and the estimates have no input sensitivities, a note gives the softening alone. Nothing is added where the
/// softening is below [`SMALLEST_SOFTENING`], the residuals exclude it, or it cannot be computed. A further warning
/// (`Validity`) states where frequencies with `timoshenko = true` are corrected by more than [`LARGEST_FACTOR`].
pub(crate) fn check_slenderness(
    fitted: Fitted,
    local: &LocalAnalysis,
    estimates: &[Estimate],
    warnings: &mut Warnings,
) {
    let Fitted { search, optimum } = fitted;
    let response = |softening: &Softening| {
        let weights = &local.noise.weights;
        local.covariance.response(&softening.change, weights, &optimum.jacobian)
    };
    let softening = |ratio: fn(&ShearFlexibility) -> Option<f64>| softening(fitted, ratio).ok()?;
    // The isotropic ratio decides on the finding; a stated shear modulus only adds a second size to the text.
    let Some(isotropic) = softening(|flexibility| Some(flexibility.isotropic)) else { return };
    if isotropic.corrected > LARGEST_FACTOR {
        let lower = |factor: f64| percent(1.0 - factor.sqrt().recip());
        let text = format!(
            "the rod is too thick for timoshenko = true: shear deformation and rotary inertia lower a frequency by {}, and \
             up to {} the correction is accurate to 0.3 %. Leave out the highest modes, or measure a longer or thinner rod",
            lower(isotropic.corrected),
            lower(LARGEST_FACTOR)
        );
        warnings.add(Severity::Validity, Code::ThickRod, text);
    }
    let isotropic_response = response(&isotropic);
    if isotropic.largest < SMALLEST_SOFTENING
        || is_excluded(&isotropic_response, &optimum.residuals, &local.noise)
    {
        return;
    }
    // The response of the fit to the effects is the opposite of the bias without them.
    let biases = |softening: &Softening, response: &LinearResponse| {
        let all = estimates.iter().enumerate().map(|(j, estimate)| {
            let unknown = &search.unknowns[j];
            let by_motions = response_to_modulus(estimate, unknown, softening.without_row);
            SlendernessBias::new(estimate, unknown, response.unknowns[j]? + by_motions)
        });
        all.collect::<Vec<_>>()
    };
    let found = biases(&isotropic, &isotropic_response);
    // An inconsistent shear modulus of the scene yields another bias, which is reported beside.
    let stated = softening(|flexibility| flexibility.stated);
    let stated = stated.map(|softening| biases(&softening, &response(&softening)));
    let stated = |j: usize| stated.as_ref().and_then(|all| all[j].as_ref());
    let mut named: Vec<(&SlendernessBias, Option<&SlendernessBias>)> = found
        .iter()
        .enumerate()
        .filter_map(|(j, bias)| Some((bias.as_ref()?, stated(j))))
        .collect();
    named.retain(|(bias, _)| bias.std_errors.abs() > WORTH_A_NOTE);
    named.sort_by_cached_key(|(bias, _)| Reverse(total_order(bias.std_errors.abs())));
    let softer = percent(isotropic.largest);
    let Some((worst, _)) = named.first() else {
        // Without the response of a parameter to the modulus of a motion the bias is unknown.
        if estimates.iter().any(|e| e.std_error.is_some())
            && isotropic.without_row >= SMALLEST_SOFTENING
            && estimates.iter().all(|e| e.input_sensitivities.is_empty())
        {
            let text = format!(
                "the rod is thick: shear deformation and rotary inertia, which the model leaves out, make it softer by \
                 {softer}. Parameters that depend on the stiffness are biased accordingly. Measure a longer or thinner rod"
            );
            warnings.add(Severity::Note, Code::ThickRod, text);
        }
        return;
    };
    let is_large = worst.std_errors.abs() > LOWERS_THE_GRADE;
    let severity = if is_large { Severity::Validity } else { Severity::Note };
    let is_of_frequencies = |own: &MeasuredResiduals| own.measurement.frequencies().is_some();
    let remedy = match fitted.measured().all(|own| is_of_frequencies(&own)) {
        true => "Set timoshenko = true in [[frequencies]], or measure a longer or thinner rod",
        false => "Measure a longer or thinner rod, or correct the value",
    };
    let each = named.iter().take(NAMED).map(|(bias, stated)| bias.describe(*stated));
    let text = format!(
        "the rod is too thick for the model: {}. It leaves out shear deformation and rotary inertia, which make the rod \
         softer by up to {softer}. {remedy}",
        each.collect::<Vec<_>>().join(", ")
    );
    warnings.add(severity, Code::ThickRod, text);
}

/// Whether the residuals exclude [`EXCLUDED_AMPLITUDE`] times the effect: several modes or points determine its
/// amplitude. `response` is that of the fit to the change of the residuals by the effect.
///
/// The parameters follow a part of the change. The rest `u` (`response.residuals`), weighted, has the amplitude
/// `a = -u.r/|u|^2` in the weighted residuals `r`, with the standard error `s/|u|` for noise of the variance `s^2`. The
/// effect is excluded if `a` plus [`CERTAIN`] standard errors is below [`EXCLUDED_AMPLITUDE`].
fn is_excluded(response: &LinearResponse, residuals: &[f64], noise: &ResidualNoise) -> bool {
    let (mut square, mut product) = (0.0, 0.0);
    for ((rest, residual), weight) in response.residuals.iter().zip(residuals).zip(&noise.weights) {
        let rest = weight * rest;
        square += rest * rest;
        product += rest * weight * residual;
    }
    let square = square.max(f64::MIN_POSITIVE);
    -product / square + CERTAIN * (noise.variance / square).sqrt() < EXCLUDED_AMPLITUDE
}

impl<'a> SlendernessBias<'a> {
    /// Bias of an estimate that shear deformation and rotary inertia would move by `change` on its scale (logarithm if
    /// positive): the opposite. It is relative to the combined standard uncertainty, or else to the standard error.
    /// None without a value or any standard error.
    fn new(estimate: &'a Estimate, unknown: &Unknown, change: f64) -> Option<Self> {
        let std_error = estimate.combined_std.or(estimate.std_error)?;
        let bias = ParameterBias::new(unknown, estimate.value?, -change);
        let std_errors = bias.change / std_error;
        Some(Self { estimate, bias, std_errors })
    }

    /// Text of the absolute bias: in per cent if the parameter is positive, else in its unit.
    fn size(&self) -> String {
        match self.bias.relative {
            Some(relative) => percent(relative.abs()),
            None => {
                let unit = self.estimate.name.unit();
                format!("{:.1e} {unit}", self.bias.change.abs()).trim_end().into()
            }
        }
    }

    /// Text of the bias with its direction (`too low`, `too high`) and its number of standard errors. The size with the
    /// `stated` shear modulus of the scene follows if there is one that no isotropic material has.
    fn describe(&self, stated: Option<&Self>) -> String {
        let Self { estimate, bias, std_errors } = self;
        let direction = if bias.change < 0.0 { "low" } else { "high" };
        let other = stated.map_or(String::new(), |other| {
            format!("; {} with the scene's shear modulus", other.size())
        });
        let (label, size, errors) = (estimate.label(), self.size(), std_errors.abs());
        format!("{label} is {size} too {direction} ({errors:.1} standard errors{other})")
    }
}

/// Change of an estimate on its scale (logarithm if positive) if motions had a Young's modulus that is lower by the
/// factor `1/(1 + fraction)`. It is `-100 ln(1 + fraction)` times the sensitivity of the estimate to +1 % of the
/// modulus; 0 without that sensitivity.
fn response_to_modulus(estimate: &Estimate, unknown: &Unknown, fraction: f64) -> f64 {
    let modulus = Parameter::YoungsModulus.path();
    let own = estimate.input_sensitivities.iter().find(|input| input.source == modulus);
    let slope = estimate.value.map_or(1.0, |value| unknown.slope(value));
    // The sensitivity is that to +1 %: a hundred times it is the derivative by the logarithm.
    own.map_or(0.0, |input| -100.0 * fraction.ln_1p() * input.change / slope)
}

/// Changes of the simulated values of all experiments by shear deformation and rotary inertia, one per residual in
/// units of sigma, and the largest relative softening. Frequencies that are simulated with these effects have no
/// change; the largest factor of their correction is in `corrected`. A motion, or any other measurement, changes by
/// `-ln(1 + reduction)` times the derivative by the logarithm of Young's modulus. Without that unknown only its
/// softening is returned (`without_row`). Structures, and experiments that are thin by [`may_be_thick`], keep zeros.
/// `ratio` selects the ratio `E/(kappa G)` of a scene; where it returns none, the isotropic one is used. `Ok(None)` if
/// it returns none for all scenes. Error: modes or equilibrium cannot be computed.
fn softening(
    fitted: Fitted,
    ratio: fn(&ShearFlexibility) -> Option<f64>,
) -> Result<Option<Softening>, Error> {
    let Fitted { search, optimum } = fitted;
    let mut softening = Softening {
        change: vec![0.0; optimum.residuals.len()],
        largest: 0.0,
        without_row: 0.0,
        corrected: 1.0,
    };
    let mut is_defined = false;
    for experiment in search.experiments {
        let problem = fitted.problem(experiment)?;
        // Shear flexibility is that of one rod.
        if problem.scene().structure.is_some() {
            continue;
        }
        let flexibility = ShearFlexibility::new(problem.scene());
        is_defined |= ratio(&flexibility).is_some();
        let largest = flexibility.isotropic.max(flexibility.stated.unwrap_or(0.0));
        if !may_be_thick(experiment, &problem, largest) {
            continue;
        }
        let of_scene = flexibility.stated.unwrap_or(flexibility.isotropic);
        // A scene without a value of its own has that of an isotropic material.
        let flexibility = ratio(&flexibility).unwrap_or(flexibility.isotropic);
        // All motions of an experiment share one first mode, which is computed once.
        let mut of_motion: Option<f64> = None;
        let own = fitted.measured().filter(|own| std::ptr::eq(own.experiment, experiment));
        for MeasuredResiduals { measurement, sigma, rows, .. } in own {
            let sigmas = measurement.sigmas(sigma).into_iter();
            let reduction = match &measurement.data {
                // The simulated frequencies include the effects: only their size is of interest.
                MeasuredData::ModeFrequencies(frequencies) if frequencies.timoshenko => {
                    let reductions = reductions(&problem, frequencies, of_scene)?;
                    let factor = reductions.into_iter().fold(0.0, f64::max) + 1.0;
                    softening.corrected = softening.corrected.max(factor);
                    0.0
                }
                MeasuredData::ModeFrequencies(frequencies) => {
                    let reductions = reductions(&problem, frequencies, flexibility)?;
                    let values = frequencies.values.iter().zip(&reductions).zip(sigmas);
                    for (row, ((value, reduction), sigma)) in rows.zip(values) {
                        // `w^2` is lower by the factor 1/(1 + reduction).
                        let relative = (1.0 + reduction).sqrt().recip() - 1.0;
                        softening.change[row] = value.rad_s * relative / sigma;
                    }
                    reductions.into_iter().fold(0.0, f64::max)
                }
                MeasuredData::EquilibriumShape(shape) => {
                    let shear = shear_displacements(&problem, shape, flexibility)?;
                    for (row, (change, sigma)) in rows.zip(shear.changes.iter().zip(sigmas)) {
                        softening.change[row] = change / sigma;
                    }
                    shear.relative
                }
                _ => {
                    let reduction = match of_motion {
                        Some(reduction) => reduction,
                        None => *of_motion.insert(first_mode_reduction(&problem, flexibility)?),
                    };
                    // A softer rod moves as one with a lower modulus: the change is along its column of the Jacobian.
                    let is_modulus = |u: &Unknown| {
                        u.parameter == Parameter::YoungsModulus && u.is_of(experiment)
                    };
                    match search.unknowns.iter().position(is_modulus) {
                        Some(j) => rows.for_each(|row| {
                            let by_logarithm = optimum.jacobian.get(row).map_or(0.0, |d| d[j]);
                            softening.change[row] = -reduction.ln_1p() * by_logarithm;
                        }),
                        None => softening.without_row = softening.without_row.max(reduction),
                    }
                    reduction
                }
            };
            softening.largest = softening.largest.max(reduction);
        }
    }
    Ok(is_defined.then_some(softening))
}

/// Whether an upper bound of the relative softening of an experiment exceeds [`SMALLEST_SOFTENING`]: [`LARGEST_SLOPE`]
/// times `((n + 1) pi i/L)^2 (1 + flexibility)`. Here `flexibility` is `E/(kappa G)`, `n` the highest measured mode (at
/// least 1), `i` the largest radius of gyration of the ends and the middle, and `L` the length.
fn may_be_thick(experiment: &Experiment, problem: &Problem, flexibility: f64) -> bool {
    let scene = problem.scene();
    // The thickest place and the shortest wave bound the effect of all modes.
    let radius = [0.0, 0.5, 1.0].map(|place| scene.at(place).0.radius_of_gyration());
    let radius = radius.into_iter().fold(0.0, f64::max);
    let number = experiment.highest_mode().max(1) as f64;
    let wave = (number + 1.0) * PI / problem.length();
    LARGEST_SLOPE * (wave * radius).powi(2) * (1.0 + flexibility) > SMALLEST_SOFTENING
}

/// Relative reduction of the squared frequency `w^2` of each measured mode about the equilibrium, in their order, by
/// shear deformation with this `flexibility` (`E/(kappa G)`) and by rotary inertia. A reduction `r` lowers `w^2` to
/// `w^2/(1 + r)`; 0 without an effect. Error: the modes cannot be computed.
fn reductions(
    problem: &Problem,
    frequencies: &ModeFrequencies,
    flexibility: f64,
) -> Result<Vec<f64>, Error> {
    let names: Vec<ModeName> = frequencies.names().collect();
    let effects = thickness_effects(problem, &names, LinearizationPoint::Equilibrium)?;
    Ok(effects.iter().map(|effect| effect.factor(flexibility) - 1.0).collect())
}

/// Relative reduction of the squared frequency of the first bending mode by rotary inertia and by shear deformation
/// with this `flexibility` (`E/(kappa G)`). As in `reductions`, `w^2` becomes `w^2/(1 + r)`. The mode is that about the
/// rest shape, whose squared frequency is proportional to Young's modulus. Error: the mode cannot be computed.
fn first_mode_reduction(problem: &Problem, flexibility: f64) -> Result<f64, Error> {
    let among = ModeFilter { kind: Some(ModeKind::Bending), ..ModeFilter::default() };
    let first = [ModeName::new(1, among)];
    Ok(thickness_effects(problem, &first, LinearizationPoint::Rest)?[0].factor(flexibility) - 1.0)
}

/// Displacements by shear deformation of the measured points of a rod at rest.
struct ShearDisplacements {
    /// Changes of the measured coordinates, in the order of the points, m.
    changes: Vec<f64>,
    /// Largest displacement of a point by shear over the largest measured deflection of a point from the rest shape.
    relative: f64,
}

/// Displacements of the measured points of a `shape` by shear with this `flexibility` (`E/(kappa G)`), in the
/// coordinates that the camera records: one number per measured coordinate, m. Also returns the largest displacement
/// over the largest measured deflection from the rest shape. Error: the equilibrium cannot be computed.
fn shear_displacements(
    problem: &Problem,
    shape: &EquilibriumShape,
    flexibility: f64,
) -> Result<ShearDisplacements, Error> {
    let (deflections, view) = (problem.shear_deflections()?, View::new(problem, |_, value| value));
    let origin = view.recorded([0.0; 3]);
    let (mut changes, mut displaced, mut deflected) = (Vec::new(), 0.0_f64, 0.0_f64);
    for sighting in shape.with_approximate_points(problem) {
        let stencil = problem.stencil(sighting.point)?;
        let sum = stencil.nodes.iter().fold([0.0; 3], |sum, (i, weight)| {
            add(sum, scale(deflections[*i], weight * flexibility))
        });
        // Differences of positions have no origin.
        let recorded = sub(view.recorded(sum), origin);
        let observed = || sighting.position.iter();
        changes.extend(observed().zip(recorded).filter_map(|(x, change)| x.map(|_| change)));
        displaced = displaced.max(dot(sum, sum).sqrt());
        let rest = view.recorded(problem.rest_position(&stencil));
        let deflection = observed().zip(rest).filter_map(|(x, rest)| Some((*x)? - rest));
        deflected = deflected.max(deflection.map(|d| d * d).sum::<f64>().sqrt());
    }
    Ok(ShearDisplacements { changes, relative: displaced / deflected.max(f64::MIN_POSITIVE) })
}
