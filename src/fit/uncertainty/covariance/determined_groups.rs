//! Groups of parameters that the data determine: combinations of unidentifiable parameters, and ratios to the
//! density.
//!
//! A motion under gravity, or between recorded ends, without a measured force has no scale of forces: with moduli and
//! density multiplied by one factor it stays the same. The data determine `EI/(rho A)` and `GJ/(rho A)`, and a modulus
//! is proportional to the density of the scene. The criterion uses the sensitivities to the inputs: the logarithmic
//! derivative by the density is 1 for the estimates of moduli, and 0 for all others, within [`DERIVATIVE_TOLERANCE`].
//!
//! [`determined_combinations`] returns the combinations with 95 % intervals, corrected for discretization; none without
//! convergence. [`determined_groups`] returns the ratios, m^4/s^2, with relative standard errors, for each modulus with
//! a standard error. There are none if any estimate violates the criterion, if the derivatives were not computed, and
//! for structures. A modulus whose experiments have different sections or densities has none. The report of the fit
//! lists both.

use crate::fit::measurement::experiment::{Experiment, named};
use crate::fit::search::Search;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::budget::input_sensitivities::InputSensitivities;
use crate::fit::uncertainty::covariance::combinations::Combination;
use crate::fit::uncertainty::covariance::local_analysis::LocalAnalysis;
use crate::fit::uncertainty::discretization::bias::{DiscretizationBias, remaining_error};
use crate::fit::uncertainty::estimate::Estimate;
use crate::problem::Problem;
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Tolerance of the logarithmic derivatives by the density, which are 1 or 0 where the data have no scale of forces.
/// Larger: data that determine the mass weakly count as data without a scale.
const DERIVATIVE_TOLERANCE: f64 = 1e-3;
/// Relative difference below which the factors of several experiments are equal, up to rounding.
const SAME_SECTION: f64 = 1e-9;

/// A combination of parameters that the data determine.
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
    /// Writes name, value, unit, standard error in per cent, and the 95 % interval if there is one.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, value, relative_std_error, unit, interval95 } = self;
        write!(f, "{name} = {value:.4e} {unit} +- {:.2} %", 100.0 * relative_std_error)?;
        match interval95 {
            Some([low, high]) => write!(f, ", 95 % [{low:.4e}, {high:.4e}]"),
            None => Ok(()),
        }
    }
}

/// One group per identifiable combination of the covariance, such as `youngs_modulus/density`, with value and 95 %
/// interval in its unit. The logarithm of the value is the sum of exponents times logarithms of the unknowns. It is
/// corrected by the `bias` of a mesh and step that the program chose. The interval is `log +- sqrt((k sd)^2 + e^2)`:
/// the largest coverage factor `k` of its unknowns, the standard deviation of the logarithm, and the remaining
/// discretization error `e`. Empty without convergence.
pub(crate) fn determined_combinations(
    Fitted { search, optimum }: Fitted,
    LocalAnalysis { covariance, correlations, .. }: &LocalAnalysis,
    bias: &DiscretizationBias,
) -> Vec<DeterminedGroup> {
    let group = |combination: &Combination| {
        let Combination { exponents, deviation } = combination;
        let corrections = bias.corrections_along(exponents);
        // The logarithm of the product is linear in the unknowns, which are logarithms.
        let log: f64 = exponents.iter().zip(&optimum.x).map(|(power, x)| power * x).sum();
        let log = log + corrections.iter().sum::<f64>();
        // The largest coverage factor of its unknowns is on the safe side.
        let factors = combination.powers().map(|(j, _)| correlations.coverage_factor(j));
        let half = (factors.fold(0.0, f64::max) * deviation).hypot(remaining_error(corrections));
        DeterminedGroup {
            name: combination.name(search.unknowns),
            value: log.exp(),
            relative_std_error: *deviation,
            unit: combination.unit(search.unknowns),
            interval95: Some([log - half, log + half].map(f64::exp)),
        }
    };
    covariance.combinations.iter().filter(|_| optimum.converged).map(group).collect()
}

/// Factor between a modulus and its group: second moment of the section over mass per length, in m^4/(kg/m).
#[derive(Clone, Copy)]
struct GroupFactor {
    /// Symbol of the stiffness, such as `EI`.
    symbol: &'static str,
    value: f64,
}

/// Factors of the groups of `modulus` in an experiment, from the section and density of its scene: `GJ` (torsion
/// constant) of a shear modulus, else `EI`, or `EI1` and `EI2` of a rod that bends in two planes.
fn group_factors(problem: &Problem, modulus: Parameter) -> Vec<GroupFactor> {
    if problem.scene().structure.is_some() {
        return Vec::new();
    }
    let moments = problem.scene().rod.section.moments();
    let density = problem.scene().material.density;
    let factor =
        |symbol, moment: f64| GroupFactor { symbol, value: moment / moments.area / density };
    if modulus == Parameter::ShearModulus {
        return vec![factor("GJ", moments.torsion_constant)];
    }
    match problem.second_moments_of_bending()[..] {
        [alone] => vec![factor("EI", alone)],
        [i1, i2, ..] => vec![factor("EI1", i1), factor("EI2", i2)],
        [] => Vec::new(),
    }
}

/// Factors of the groups of `modulus` that all these experiments share, those of the first one. Empty where number,
/// symbol or value differ by more than [`SAME_SECTION`], or without experiments.
fn shared_factors<'a>(
    mut experiments: impl Iterator<Item = &'a Experiment>,
    modulus: Parameter,
) -> Vec<GroupFactor> {
    let Some(first) = experiments.next() else { return Vec::new() };
    let first = group_factors(&first.problem, modulus);
    // Experiments with other sections or densities have no common group.
    let is_same = |(a, b): (&GroupFactor, &GroupFactor)| {
        a.symbol == b.symbol && (a.value / b.value - 1.0).abs() < SAME_SECTION
    };
    let is_shared = experiments.all(|experiment| {
        let other = group_factors(&experiment.problem, modulus);
        other.len() == first.len() && other.iter().zip(&first).all(is_same)
    });
    if is_shared { first } else { Vec::new() }
}

/// Ratios of stiffness to mass per length, m^4/s^2, for each estimated Young's or shear modulus with a standard error:
/// `EI/(rho A)`, or two of a rod that bends in two planes, or `GJ/(rho A)`. The value is the modulus times `I/(rho A)`
/// (or `J/(rho A)`) of the scene; the relative standard error is that of the modulus. Empty unless the logarithmic
/// derivatives of all estimates by the density are 1 (moduli) or 0 (others) within [`DERIVATIVE_TOLERANCE`]; those
/// without a standard error or a derivative are not tested. Empty also where these derivatives were not computed. A
/// modulus whose experiments have different sections or densities, and one of a structure, has no ratio.
pub(crate) fn determined_groups(
    search: &Search,
    estimates: &[Estimate],
    sensitivities: &InputSensitivities,
) -> Vec<DeterminedGroup> {
    let Some(responses) = sensitivities.responses_to_density(search) else { return Vec::new() };
    let is_modulus = |p: Parameter| p == Parameter::YoungsModulus || p == Parameter::ShearModulus;
    let has_no_scale = |(estimate, response): (&Estimate, &Option<f64>)| {
        let expected = if is_modulus(estimate.name) { 1.0 } else { 0.0 };
        // A parameter that may be zero has no logarithmic derivative.
        estimate.std_error.is_none()
            || response.is_none_or(|response| (response - expected).abs() < DERIVATIVE_TOLERANCE)
    };
    // One estimate that depends on the density otherwise shows that the data have a scale of forces.
    if !estimates.iter().zip(&responses).all(has_no_scale) {
        return Vec::new();
    }
    // Every identified modulus has its groups.
    let mut groups = Vec::new();
    for ((estimate, response), unknown) in estimates.iter().zip(&responses).zip(search.unknowns) {
        if let (Some(value), Some(std_error), Some(_)) =
            (estimate.value, estimate.std_error, response)
            && is_modulus(estimate.name)
        {
            let own = search.experiments.iter().filter(|e| unknown.is_of(e));
            groups.extend(shared_factors(own, estimate.name).into_iter().map(|factor| {
                DeterminedGroup {
                    name: named(&format!("{}/(rho A)", factor.symbol), &estimate.experiments),
                    value: value * factor.value,
                    relative_std_error: std_error / value,
                    unit: "m^4/s^2".into(),
                    interval95: None,
                }
            }));
        }
    }
    groups
}
