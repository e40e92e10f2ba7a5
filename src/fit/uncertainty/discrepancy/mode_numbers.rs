//! Whether measured frequencies fit other mode numbers as well.
//!
//! Frequencies alone determine a stiffness only beside the numbers of their modes: those of a simply supported rod are
//! `n^2` times the first, so that any common factor of the numbers fits them, with another modulus. Where one scale of
//! all frequencies is fitted and nothing else was measured, other numberings are compared without another fit: their
//! frequencies at the optimum times the factor `c` that fits best,
//!
//! ```text
//! c = sum(f g/s^2)/sum(g^2/s^2),   chi^2 = sum((c g - f)^2/s^2)
//! ```
//!
//! of measured frequencies `f` with their noise `s` and computed ones `g`.

use crate::code::Code;
use crate::fit::search::Search;
use crate::fit::search::fitted::{Fitted, MeasuredResiduals};
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::grade::{Severity, Warnings};
use crate::problem::Problem;
use crate::vibration::ModeName;

/// A numbering whose chi^2 is larger by up to this much fits as well: 95 % of right ones do, of one parameter.
const AS_WELL: f64 = 4.0;
/// Fewer frequencies fit any numbering.
const FEWEST: usize = 2;
/// Largest relative spread of the derivatives d ln f/d ln p of all frequencies by a parameter that is their scale.
const ONE_SCALE: f64 = 1e-3;
/// Smallest such derivative.
const SMALLEST_POWER: f64 = 0.1;
/// Modes above this are not looked at.
const HIGHEST_MODE: usize = 60;

/// Another numbering of modes.
#[derive(Clone, Copy)]
enum Numbering {
    Times(usize),
    Over(usize),
    Up,
    Down,
}

impl Numbering {
    /// Those that are tried: mistakes in counting both planes, or only modes of one symmetry, or from 0.
    const ALL: [Self; 6] =
        [Self::Over(2), Self::Over(3), Self::Down, Self::Up, Self::Times(2), Self::Times(3)];

    fn of(self, number: usize) -> Option<usize> {
        let other = match self {
            Self::Times(factor) => number * factor,
            Self::Over(divisor) if number.is_multiple_of(divisor) => number / divisor,
            Self::Over(_) => return None,
            Self::Up => number + 1,
            Self::Down => number.checked_sub(1)?,
        };
        (1..=HIGHEST_MODE).contains(&other).then_some(other)
    }

    fn finer_mesh(self) -> usize {
        if let Self::Times(factor) = self { factor } else { 1 }
    }
}

/// Notes other numberings that fit as well, with the value they would give.
pub(crate) fn check_mode_numbers(fitted: Fitted, estimates: &[Estimate], warnings: &mut Warnings) {
    // Another experiment or another kind of measurement decides between numberings.
    let search = fitted.search;
    let [experiment] = search.experiments else { return };
    let (mut names, mut measured, mut chi_squared) = (Vec::new(), Vec::<[f64; 2]>::new(), 0.0);
    for MeasuredResiduals { measurement, sigma, residuals, .. } in fitted.measured() {
        let Some(frequencies) = measurement.frequencies() else { return };
        names.extend(frequencies.names());
        measured.extend(frequencies.values.iter().map(|f| [f.rad_s, sigma]));
        chi_squared += residuals.iter().map(|r| r * r).sum::<f64>();
    }
    if names.len() < FEWEST {
        return;
    }
    let Ok(problem) = fitted.problem(experiment) else { return };
    let Some((scale, power)) = scale_of(search, &problem, &names) else { return };
    let Some(value) = estimates[scale].value.filter(|_| estimates[scale].std_error.is_some())
    else {
        return;
    };
    let unknown = &search.unknowns[scale];
    let mut found = Vec::new();
    for numbering in Numbering::ALL {
        let renamed =
            |name: &ModeName| Some(ModeName { number: numbering.of(name.number)?, ..*name });
        let Some(others) = names.iter().map(renamed).collect::<Option<Vec<ModeName>>>() else {
            continue;
        };
        let Some((factor, other)) = refitted(&problem, &others, numbering.finer_mesh(), &measured)
        else {
            continue;
        };
        let other_value = value * factor.powf(1.0 / power);
        let [low, high] = unknown.scaled_bounds().map(|x| unknown.from_scale(x));
        let against_prior = unknown.prior_residual(unknown.to_scale(other_value));
        if other <= chi_squared + AS_WELL
            && (low..=high).contains(&other_value)
            && against_prior.is_none_or(|off| off.abs() <= 3.0)
        {
            let numbers: Vec<String> = others.iter().map(|name| name.number.to_string()).collect();
            let unit = unknown.parameter.unit();
            found.push(format!(
                "modes {} give {} = {other_value:.3e} {unit}",
                numbers.join(", "),
                estimates[scale].label()
            ));
        }
    }
    if !found.is_empty() {
        let words = format!(
            "other mode numbers fit the frequencies as well: {}. Frequencies alone do not decide between them. Find the \
             nodes of a mode, or add a measurement such as the shape at rest",
            found.join("; ")
        );
        warnings.add(Severity::Note, Code::ModeNumbers, words);
    }
}

/// The unknown that is a common scale of all frequencies, and d ln f/d ln p.
fn scale_of(search: &Search, problem: &Problem, names: &[ModeName]) -> Option<(usize, f64)> {
    let positive = |j: &usize| search.unknowns[*j].parameter.is_positive();
    (0..search.unknowns.len()).filter(positive).find_map(|j| {
        let parameter = search.unknowns[j].parameter;
        let value = parameter.of(problem.scene())?;
        let found = problem.natural_frequencies(names, &[parameter]).ok()?;
        let power =
            |f: &crate::vibration::NaturalFrequency| f.derivatives[0] * value / f.frequency_rad_s;
        let powers: Vec<f64> = found.iter().map(power).collect();
        let mean = powers.iter().sum::<f64>() / powers.len() as f64;
        let alike = powers.iter().all(|p| (p - mean).abs() <= ONE_SCALE * mean.abs());
        (alike && mean.abs() >= SMALLEST_POWER).then_some((j, mean))
    })
}

/// The factor by which the frequencies of modes fit those measured best, and the chi^2 that is left.
fn refitted(
    problem: &Problem,
    names: &[ModeName],
    finer: usize,
    measured: &[[f64; 2]],
) -> Option<(f64, f64)> {
    // Higher modes need as many more edges.
    let remeshed = match finer {
        1 => None,
        _ => Some(problem.like_it(problem.remeshed(finer * problem.segments())).ok()?),
    };
    let problem = remeshed.as_ref().unwrap_or(problem);
    let computed = problem.natural_frequencies(names, &[]).ok()?;
    let computed = || computed.iter().map(|f| f.frequency_rad_s).zip(measured);
    let both: f64 = computed().map(|(g, [f, sigma])| f * g / (sigma * sigma)).sum();
    let own: f64 = computed().map(|(g, [_, sigma])| (g / sigma).powi(2)).sum();
    let factor = both / own;
    let chi_squared = computed().map(|(g, [f, sigma])| ((factor * g - f) / sigma).powi(2)).sum();
    Some((factor, chi_squared))
}
