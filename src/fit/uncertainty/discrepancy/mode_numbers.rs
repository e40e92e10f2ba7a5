//! Test whether measured frequencies fit other mode numbers as well.
//!
//! Frequencies alone determine a stiffness only with the numbers of their modes: those of a simply supported rod are
//! proportional to `n^2`. So numbers with a common factor fit them too, with another modulus. The test applies to a fit
//! of one experiment with one rod (no structure), at least [`FEWEST`] frequencies and no other measurement. A single
//! frequency is tested where its mode number is assumed, not given: it fits any. Some
//! positive unknown must scale all frequencies by one factor (within [`ONE_SCALE`]) and change them clearly
//! ([`SMALLEST_POWER`]); the first such unknown must have a standard error. Other numberings ([`NUMBERINGS`]) are
//! compared without another fit: their frequencies at the optimum times the factor `c` that fits best,
//!
//! ```text
//! c = sum(f g/s^2)/sum(g^2/s^2),   chi^2 = sum((c g - f)^2/s^2)
//! ```
//!
//! of measured frequencies `f` with their noise `s` and computed ones `g`, rad/s. A numbering fits as well if its chi^2
//! exceeds that of the fit by at most [`EXCESS`]. The unknown `p` then has the value `p c^(1/power)`, with its
//! derivative `power = d ln f/d ln p`. That value must be within its bounds and [`EXCLUDED_BY_PRIOR`] standard
//! deviations of its prior. [`check_mode_numbers`] adds one note to the fit with all such numberings and these values;
//! without any it adds nothing.

use crate::code::Code;
use crate::fit::search::Search;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::problem::Problem;
use crate::vibration::{ModeName, NaturalFrequency};

/// Largest excess of the chi^2 of a numbering that fits as well: 95 % of right ones with one parameter are below.
const EXCESS: f64 = 4.0;
/// Fewest frequencies with given numbers with which numberings are compared: a single one fits any numbering.
const FEWEST: usize = 2;
/// Largest relative spread of the derivatives `d ln f/d ln p` of all frequencies by a parameter `p` that is their
/// common scale.
const ONE_SCALE: f64 = 1e-3;
/// Smallest absolute derivative `d ln f/d ln p` of such a parameter. Smaller: parameters that hardly change the
/// frequencies count.
const SMALLEST_POWER: f64 = 0.1;
/// Highest mode of another numbering; higher ones need a fine mesh.
const HIGHEST_MODE: usize = 60;
/// Distance from the mean of a prior, in its standard deviations, above which the prior excludes a value.
const EXCLUDED_BY_PRIOR: f64 = 3.0;

/// Another numbering of modes: `number factor/divisor + offset`.
#[derive(Clone, Copy)]
struct Numbering {
    factor: usize,
    divisor: usize,
    offset: isize,
}

/// Numberings by common mistakes: counting both planes, only modes of one symmetry, or from 0.
const NUMBERINGS: [Numbering; 6] = [
    Numbering { factor: 1, divisor: 2, offset: 0 },
    Numbering { factor: 1, divisor: 3, offset: 0 },
    Numbering { factor: 1, divisor: 1, offset: -1 },
    Numbering { factor: 1, divisor: 1, offset: 1 },
    Numbering { factor: 2, divisor: 1, offset: 0 },
    Numbering { factor: 3, divisor: 1, offset: 0 },
];

impl Numbering {
    /// The other number of mode `number`, `number factor/divisor + offset`; none if that is no whole number from 1 to
    /// [`HIGHEST_MODE`].
    fn renumber(self, number: usize) -> Option<usize> {
        let multiple = number * self.factor;
        let is_whole = multiple.is_multiple_of(self.divisor);
        let other = (multiple / self.divisor).checked_add_signed(self.offset)?;
        (is_whole && (1..=HIGHEST_MODE).contains(&other)).then_some(other)
    }
}

/// A parameter that scales all frequencies.
struct FrequencyScale {
    /// Index of the unknown.
    unknown: usize,
    /// Derivative d ln f/d ln p.
    power: f64,
}

/// A measured frequency, rad/s.
#[derive(Clone, Copy)]
struct MeasuredFrequency {
    /// Measured frequency, rad/s.
    value: f64,
    /// Its standard deviation, rad/s.
    sigma: f64,
}

/// Computed frequencies times the factor that fits measured ones best.
struct ScaledFit {
    /// Best factor on the computed frequencies.
    factor: f64,
    /// Sum of the squared differences over their standard deviations.
    chi_squared: f64,
}

/// Adds one note that lists all other numberings that fit the measured frequencies as well, with the value of the
/// parameter that each gives. Without any it adds nothing.
pub(crate) fn check_mode_numbers(fitted: Fitted, estimates: &[Estimate], warnings: &mut Warnings) {
    let Some(found) = other_numberings(fitted, estimates).filter(|found| !found.is_empty()) else {
        return;
    };
    let found = found.join("; ");
    let count: usize = fitted.measured().map(|own| own.residuals.len()).sum();
    let text = match count {
        1 => format!(
            "the mode number of the only frequency is assumed to be 1. Other numbers fit as well: {found}. Give modes = \
             [..] after a look at the nodes of the mode, or add a measurement such as the shape at rest"
        ),
        _ => format!(
            "other mode numbers fit the frequencies as well: {found}. Frequencies alone do not decide between them. \
             Find the nodes of a mode, or add a measurement such as the shape at rest"
        ),
    };
    warnings.add(Severity::Note, Code::ModeNumbers, text);
}

/// Texts of all numberings of [`NUMBERINGS`] whose chi^2 exceeds that of the fit by at most [`EXCESS`], with the
/// parameter within its bounds and [`EXCLUDED_BY_PRIOR`] standard deviations of its prior. None with several
/// experiments, another kind of measurement or a structure, or with fewer than [`FEWEST`] frequencies whose numbers are
/// given. None also where no unknown is a common scale of the frequencies, the first such one has no standard error, or
/// frequencies cannot be computed.
fn other_numberings(fitted: Fitted, estimates: &[Estimate]) -> Option<Vec<String>> {
    let search = fitted.search;
    // Another experiment or another kind of measurement decides between numberings.
    let [experiment] = search.experiments else { return None };
    let (mut names, mut measured, mut chi_squared) = (Vec::new(), Vec::new(), 0.0);
    let mut are_assumed = true;
    for MeasuredResiduals { measurement, sigma, residuals, .. } in fitted.measured() {
        let frequencies = measurement.frequencies()?;
        names.extend(frequencies.names());
        are_assumed &= frequencies.are_modes_assumed;
        let values = frequencies.values.iter().map(|f| MeasuredFrequency { value: f.rad_s, sigma });
        measured.extend(values);
        chi_squared += residuals.iter().map(|r| r * r).sum::<f64>();
    }
    if names.len() < FEWEST && !are_assumed {
        return None;
    }
    let problem = fitted.problem(experiment).ok()?;
    if problem.scene().structure.is_some() {
        return None;
    }
    // Only a common scale of all frequencies can compensate for other numbers.
    let scale = frequency_scale(search, &problem, &names)?;
    let (estimate, unknown) = (&estimates[scale.unknown], &search.unknowns[scale.unknown]);
    let value = estimate.value.filter(|_| estimate.std_error.is_some())?;
    let describe = |numbering: Numbering| {
        let renumbered =
            |name: &ModeName| Some(ModeName { number: numbering.renumber(name.number)?, ..*name });
        let others: Vec<ModeName> = names.iter().map(renumbered).collect::<Option<_>>()?;
        let refitted = scaled_fit(&problem, &others, numbering.factor, &measured)?;
        // `f ~ p^power`: the factor of the frequencies is a power of that of the parameter.
        let other_value = value * refitted.factor.powf(1.0 / scale.power);
        let [low, high] = unknown.scaled_bounds().map(|x| unknown.from_scale(x));
        let from_prior = unknown.prior_residual(unknown.to_scale(other_value));
        let fits = refitted.chi_squared <= chi_squared + EXCESS
            && (low..=high).contains(&other_value)
            && from_prior.is_none_or(|sigmas| sigmas.abs() <= EXCLUDED_BY_PRIOR);
        let numbers: Vec<String> = others.iter().map(|name| name.number.to_string()).collect();
        let (label, unit) = (estimate.label(), unknown.parameter.unit());
        let numbers = numbers.join(", ");
        fits.then(|| format!("modes {numbers} give {label} = {other_value:.3e} {unit}"))
    };
    // Twice number 1 and one more are the same.
    let is_new = |own: &Numbering| names.len() > 1 || own.offset == 0;
    Some(NUMBERINGS.into_iter().filter(is_new).filter_map(describe).collect())
}

/// The first positive unknown `p` that is a common scale of the frequencies `f` of all named modes. Their derivatives
/// `d ln f/d ln p` differ from the mean by at most [`ONE_SCALE`] of it, and the mean is at least [`SMALLEST_POWER`] in
/// absolute value. Its power is the mean. None without one; unknowns whose derivatives fail are skipped.
fn frequency_scale(
    search: &Search,
    problem: &Problem,
    names: &[ModeName],
) -> Option<FrequencyScale> {
    let is_positive = |j: &usize| search.unknowns[*j].parameter.is_positive();
    (0..search.unknowns.len()).filter(is_positive).find_map(|unknown| {
        let parameter = search.unknowns[unknown].parameter;
        let value = parameter.of(problem.scene())?;
        let found = problem.natural_frequencies(names, &[parameter]).ok()?;
        let power = |f: &NaturalFrequency| f.derivatives[0] * value / f.frequency_rad_s;
        let powers: Vec<f64> = found.iter().map(power).collect();
        let power = powers.iter().sum::<f64>() / powers.len() as f64;
        // A common scale has f ~ p^power for all modes: equal logarithmic derivatives.
        let is_one = powers.iter().all(|p| (p - power).abs() <= ONE_SCALE * power.abs());
        (is_one && power.abs() >= SMALLEST_POWER).then_some(FrequencyScale { unknown, power })
    })
}

/// The factor of least squares on the computed frequencies of the named modes that fits the `measured` ones, in the
/// same order, and its chi^2. The mesh has `mesh_factor` times the segments of the problem, as higher modes need. None
/// where the frequencies cannot be computed.
fn scaled_fit(
    problem: &Problem,
    names: &[ModeName],
    mesh_factor: usize,
    measured: &[MeasuredFrequency],
) -> Option<ScaledFit> {
    // Higher modes require as many more edges.
    let remeshed = match mesh_factor {
        1 => None,
        _ => Some(problem.with_scene(problem.remeshed(mesh_factor * problem.segments())).ok()?),
    };
    let problem = remeshed.as_ref().unwrap_or(problem);
    let computed = problem.natural_frequencies(names, &[]).ok()?;
    let pairs = || computed.iter().map(|f| f.frequency_rad_s).zip(measured);
    let both: f64 = pairs().map(|(g, f)| f.value * g / (f.sigma * f.sigma)).sum();
    let own: f64 = pairs().map(|(g, f)| (g / f.sigma).powi(2)).sum();
    let factor = both / own;
    let chi_squared = pairs().map(|(g, f)| ((factor * g - f.value) / f.sigma).powi(2)).sum();
    Some(ScaledFit { factor, chi_squared })
}
