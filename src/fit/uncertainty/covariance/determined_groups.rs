//! Groups of numbers that the data determine: combinations of parameters that are not identifiable, and ratios to the density.
//!
//! A motion under gravity, or between recorded ends, without a measured force has no scale of forces: with moduli and density
//! multiplied by one factor it stays the same. The data determine `EI/(rho A)` and `GJ/(rho A)`, and a modulus follows with the
//! density that the scene gives. It is so where the estimate of a modulus changes by 1 % with 1 % of the density, and
//! no other estimate changes with it.

use crate::fit::measurement::experiment::{Experiment, named};
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::budget::input_sensitivities::InputSensitivities;
use crate::fit::uncertainty::covariance::combinations::Combination;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::estimate::Estimate;
use crate::fit::uncertainty::shifts::{OPEN, Shifts};
use crate::problem::Problem;
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};
use std::fmt;

/// How far the logarithmic derivatives by the density may be from 1 and 0.
const EXACT: f64 = 1e-3;
/// Sections of several experiments are one where they differ by less than this part.
const SAME_SECTION: f64 = 1e-9;

/// A combination of numbers that the data determine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct DeterminedGroup {
    /// Name of the group: a combination of parameters that are not identifiable, such as
    /// `youngs_modulus/density`, or a ratio to the given density, `EI/(rho A)` or `GJ/(rho A)`; `EI1`
    /// bends in the plane of `up` and `EI2` across it.
    pub name: String,
    /// Value at the estimate of the modulus, without the factors of a taper, in `unit`.
    pub value: f64,
    /// Standard error as a fraction of the value, without the uncertainty of the given density.
    pub relative_std_error: f64,
    /// Unit of the value.
    pub unit: String,
    /// 95 % interval of a combination of parameters, in `unit`; null for ratios to the density.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval95: Option<[f64; 2]>,
}

impl fmt::Display for DeterminedGroup {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, value, relative_std_error, unit, interval95 } = self;
        write!(f, "{name} = {value:.4e} {unit} +- {:.2} %", 100.0 * relative_std_error)?;
        match interval95 {
            Some([low, high]) => write!(f, ", 95 % [{low:.4e}, {high:.4e}]"),
            None => Ok(()),
        }
    }
}

/// The values of the combinations that the data determine. They are corrected for a discretization that the program chose, and
/// intervals hold the error of the correction.
pub(crate) fn determined_combinations(
    Fitted { search, optimum }: Fitted,
    LocalAnalysis { covariance, correlations, .. }: &LocalAnalysis,
    shifts: &Shifts,
) -> Vec<DeterminedGroup> {
    if !optimum.converged {
        return Vec::new();
    }
    let value = |combination: &Combination| {
        let Combination { exponents, deviation } = combination;
        let chosen = shifts.along(exponents).into_iter().filter(|(_, is_chosen)| *is_chosen);
        let correction: f64 = chosen.clone().map(|(shift, _)| shift).sum();
        let open: f64 = chosen.map(|(shift, _)| OPEN * shift.abs()).sum();
        let log: f64 = exponents.iter().zip(&optimum.x).map(|(power, x)| power * x).sum();
        let log = log + correction;
        let involved = combination.powers().map(|(j, _)| correlations.reach[j]);
        let half = (involved.fold(0.0, f64::max) * deviation).hypot(open);
        DeterminedGroup {
            name: combination.name(search.unknowns),
            value: log.exp(),
            relative_std_error: *deviation,
            unit: combination.unit(search.unknowns),
            interval95: Some([log - half, log + half].map(f64::exp)),
        }
    };
    covariance.combinations.iter().map(value).collect()
}

/// A factor between a modulus over the density and a group, m^2.
struct SectionRatio {
    symbol: &'static str,
    value: f64,
}

/// Ratios of a section's second moments to its area.
fn section_ratios(problem: &Problem, modulus: Parameter) -> Vec<SectionRatio> {
    let moments = problem.scene().rod.section.moments();
    let ratio = |symbol, moment: f64| SectionRatio { symbol, value: moment / moments.area };
    if modulus == Parameter::ShearModulus {
        return vec![ratio("GJ", moments.torsion_constant)];
    }
    match problem.second_moments_of_bending()[..] {
        [alone] => vec![ratio("EI", alone)],
        [i1, i2, ..] => vec![ratio("EI1", i1), ratio("EI2", i2)],
        [] => Vec::new(),
    }
}

/// The ratio over the density that all experiments of an estimate share; none where they differ.
fn shared_factors(experiments: &[&Experiment], modulus: Parameter) -> Option<Vec<SectionRatio>> {
    let of = |experiment: &&Experiment| {
        let density = experiment.problem.scene().material.density;
        let mut ratios = section_ratios(&experiment.problem, modulus);
        ratios.iter_mut().for_each(|ratio| ratio.value /= density);
        ratios
    };
    let mut all = experiments.iter().map(of);
    let first = all.next()?;
    let is_same = |other: Vec<SectionRatio>| {
        other.len() == first.len()
            && other.iter().zip(&first).all(|(a, b)| {
                a.symbol == b.symbol && (a.value / b.value - 1.0).abs() < SAME_SECTION
            })
    };
    all.all(is_same).then_some(first)
}

/// The groups that the data determine; none where they determine the mass, or where the sensitivities to the density are
/// unknown.
pub(crate) fn determined_groups(
    search: &Search,
    estimates: &[Estimate],
    sensitivities: &InputSensitivities,
) -> Vec<DeterminedGroup> {
    let Some(responses) = sensitivities.responses_to_density(search) else { return Vec::new() };
    let is_modulus = |p: Parameter| p == Parameter::YoungsModulus || p == Parameter::ShearModulus;
    let follows = |estimate: &Estimate, response: &Option<f64>| {
        let expected = if is_modulus(estimate.name) { 1.0 } else { 0.0 };
        // A parameter that may be zero has no logarithmic derivative.
        estimate.std_error.is_none()
            || response.is_none_or(|response| (response - expected).abs() < EXACT)
    };
    if !estimates.iter().zip(&responses).all(|(e, response)| follows(e, response)) {
        return Vec::new();
    }
    let mut groups = Vec::new();
    for ((estimate, response), unknown) in estimates.iter().zip(&responses).zip(search.unknowns) {
        let (Some(value), Some(std_error), Some(_)) =
            (estimate.value, estimate.std_error, response)
        else {
            continue;
        };
        let own: Vec<&Experiment> =
            search.experiments.iter().filter(|e| unknown.is_of(e)).collect();
        if !is_modulus(estimate.name) {
            continue;
        }
        for SectionRatio { symbol, value: factor } in
            shared_factors(&own, estimate.name).unwrap_or_default()
        {
            groups.push(DeterminedGroup {
                name: named(&format!("{symbol}/(rho A)"), &estimate.experiments),
                value: value * factor,
                relative_std_error: std_error / value,
                unit: "m^4/s^2".into(),
                interval95: None,
            });
        }
    }
    groups
}
