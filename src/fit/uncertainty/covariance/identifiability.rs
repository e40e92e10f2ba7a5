//! Directions of the unknowns that the data do not determine, with their descriptions.
//!
//! Input are directions from the covariance: changes of the unknowns on their scales (logarithms of positive
//! parameters), one component per unknown. Structural ones are right singular vectors of the scaled Jacobian with
//! singular values near zero. They do not change the observed values, and exact data would not determine them either.
//! Practical ones change the observed values by less than the noise. [`sparsest`] rewrites the structural directions
//! with few unknowns each, eliminates the unknowns chosen for them from the practical ones, and sets small components
//! to zero. [`describe_directions`] composes an [`UnidentifiableDirection`] with a text for each direction,
//! [`without_effect`] for one unknown without effect. [`summarize`] joins the first [`SUMMARIZED`] texts for the status
//! of the fit. The limit of practical identifiability ([`practical_limit`]) is a standard deviation of an unknown on
//! its scale.

use crate::code::Code;
use crate::fit::search::damping::may_vanish;
use crate::fit::uncertainty::covariance::combinations::{Combination, constant_exponents};
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;

/// Components of a direction up to this part of the largest are set to zero. Smaller: descriptions list unknowns by
/// rounding errors.
const SMALLEST_COMPONENT: f64 = 0.05;
/// Largest number of unknowns of a direction that its description lists completely.
const MOST_LISTED: usize = 6;
/// Number of unknowns that the description of a longer direction lists: those with the largest components.
const LISTED: usize = 4;
/// Number of directions that a summary describes; the others are counted.
const SUMMARIZED: usize = 3;
/// Largest standard deviation of the logarithm of an identifiable parameter: a factor of e.
pub(crate) const PRACTICAL_LOG: f64 = 1.0;
/// The same of parameters that are not positive, in their units: a quarter of the range of beta or Poisson's ratio.
const PRACTICAL_LINEAR: f64 = 0.25;
/// Standard deviation over the limit of an identifiable unknown, above which the misfit at that limit is computed: it
/// may be flatter than at the optimum. Smaller: more simulations.
pub(crate) const SUSPICIOUS: f64 = 0.1;

/// Kind of non-identifiability.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum NonIdentifiability {
    /// No record of these points determines the combination, however accurate.
    Structural,
    /// The noise of these data hides the combination.
    Practical,
}

impl NonIdentifiability {
    /// The code of the kind that reports print (`structural` or `practical`); `docs/codes.md` explains it.
    pub fn code(self) -> Code {
        match self {
            Self::Structural => Code::Structural,
            Self::Practical => Code::Practical,
        }
    }
}

/// A combination of parameters that the data do not determine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct UnidentifiableDirection {
    /// Kind of non-identifiability.
    pub kind: NonIdentifiability,
    /// Parameters of the combination.
    pub parameters: Vec<Parameter>,
    /// Description, as text.
    pub description: String,
}

/// Largest standard deviation with which an unknown is identifiable: [`PRACTICAL_LOG`] of the logarithm of a positive
/// parameter, else [`PRACTICAL_LINEAR`] in its unit.
pub(crate) fn practical_limit(unknown: &Unknown) -> f64 {
    if unknown.parameter.is_positive() { PRACTICAL_LOG } else { PRACTICAL_LINEAR }
}

/// Finding on one parameter without effect on the observed values. It is structural, with one exception. A damping or
/// other parameter that may be zero is practical, estimated as zero, while other unknowns have an effect. `is_only_one`
/// is true if no unknown of the fit has an effect.
pub(crate) fn without_effect(unknown: &Unknown, is_only_one: bool) -> UnidentifiableDirection {
    // At a damping of zero its logarithm has no effect, although larger values have one.
    let (kind, description) = match may_vanish(unknown) && !is_only_one {
        true => (
            NonIdentifiability::Practical,
            format!("{unknown} is estimated as zero: these data show no effect of it"),
        ),
        false => (NonIdentifiability::Structural, no_effect(unknown)),
    };
    UnidentifiableDirection { kind, parameters: vec![unknown.parameter], description }
}

/// The description, as text, of an unknown that has no effect on the observed quantities.
fn no_effect(unknown: &Unknown) -> String {
    format!("{unknown} has no effect on the observed quantities")
}

/// Returns one finding of this `kind` per direction, in their order, with the parameters of its nonzero components and
/// a text. `directions` are changes of the unknowns on their scales, with zeros for those not involved; `deviations`
/// are the standard deviations of all unknowns on their scales. One parameter is named alone, two positive ones with
/// the product of powers that stays constant, all others as a weighted sum. Practical findings add the standard
/// deviations, or that the misfit is flat where these are within the limits.
pub(crate) fn describe_directions(
    unknowns: &[Unknown],
    directions: Vec<Vec<f64>>,
    kind: NonIdentifiability,
    deviations: &[f64],
) -> Vec<UnidentifiableDirection> {
    let describe = |direction: Vec<f64>| {
        let involved: Vec<usize> = (0..unknowns.len()).filter(|j| direction[*j] != 0.0).collect();
        let own: Vec<&Unknown> = involved.iter().map(|j| &unknowns[*j]).collect();
        // A direction of two logarithms is described by the product that it leaves constant.
        let invariant = constant_exponents(unknowns, &direction)
            .map(|exponents| Combination { exponents, deviation: 0.0 }.name(unknowns));
        let sum = || weighted_sum(unknowns, &direction, &involved);
        // Structural directions are explained by their cause, practical ones by the size of the errors.
        let description = match (kind, &own[..], invariant) {
            (NonIdentifiability::Structural, [one], _) => no_effect(one),
            (NonIdentifiability::Structural, [one, two], Some(invariant)) => format!(
                "{one} and {two} enter only as {invariant}; neither can be identified without the other"
            ),
            (NonIdentifiability::Structural, ..) => format!(
                "the data do not change along the combination {} (logarithms of positive parameters)",
                sum()
            ),
            (NonIdentifiability::Practical, own, invariant) => {
                let listed = listed_unknowns(&direction, &involved);
                let reason = practical_reason(unknowns, deviations, &involved, &listed);
                match (own, invariant) {
                    ([one], _) => {
                        format!("{one} is practically not identifiable from these data: {reason}")
                    }
                    ([one, two], Some(invariant)) => format!(
                        "{one} and {two} are practically not identifiable from these data: all but their \
                         {invariant} is lost in the noise ({reason})"
                    ),
                    _ => format!(
                        "practically not identifiable from these data: the combination {} (logarithms of \
                         positive parameters) is lost in the noise ({reason})",
                        sum()
                    ),
                }
            }
        };
        let parameters = own.iter().map(|unknown| unknown.parameter).collect();
        UnidentifiableDirection { kind, parameters, description }
    };
    directions.into_iter().map(describe).collect()
}

/// Rewrites directions with few nonzero components each, by Gauss-Jordan elimination, as singular vectors of equal
/// singular values are arbitrary combinations. In turn, the largest component of each structural direction, at an
/// unknown that was not chosen before, is eliminated from all other structural and from all practical directions.
/// Components up to [`SMALLEST_COMPONENT`] of the largest become zero. Returns the structural and the practical
/// directions, in their order and not normalized; the structural ones span the same space but for components set to
/// zero.
pub(crate) fn sparsest(
    mut structural: Vec<Vec<f64>>,
    mut practical: Vec<Vec<f64>>,
) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let mut pivots = Vec::new();
    for k in 0..structural.len() {
        let row = structural[k].clone();
        // Every direction is solved for the unknown with its largest remaining component.
        let free = (0..row.len()).filter(|j| !pivots.contains(j));
        let Some(pivot) = free.max_by(|a, b| row[*a].abs().total_cmp(&row[*b].abs())) else {
            break;
        };
        pivots.push(pivot);
        let others = structural.iter_mut().enumerate().filter(|(i, _)| *i != k);
        for other in others.map(|(_, other)| other).chain(&mut practical) {
            // The unknown is eliminated from all other directions.
            let factor = other[pivot] / row[pivot];
            other.iter_mut().zip(&row).for_each(|(d, r)| *d -= factor * r);
            other[pivot] = 0.0;
        }
    }
    // Rounding errors of the singular vectors are no components.
    for direction in structural.iter_mut().chain(&mut practical) {
        let most = largest_component(direction);
        let small = direction.iter_mut().filter(|d| d.abs() <= SMALLEST_COMPONENT * most);
        small.for_each(|d| *d = 0.0);
    }
    (structural, practical)
}

/// Largest absolute component of a direction; 0 of an empty one.
fn largest_component(direction: &[f64]) -> f64 {
    direction.iter().fold(0.0, |most, d| most.max(d.abs()))
}

/// Reason of practical non-identifiability, as text: the standard deviations `s` of the `listed` unknowns, for positive
/// parameters as factors `exp(s)`. `listed` and `involved` are indices of unknowns. Where all `involved` unknowns are
/// within their practical limits, the reason is that the misfit is no larger far from the estimate.
fn practical_reason(
    unknowns: &[Unknown],
    deviations: &[f64],
    involved: &[usize],
    listed: &[usize],
) -> String {
    // The linear model determines these unknowns: the misfit itself was flat at the limit.
    if involved.iter().all(|j| deviations[*j] <= practical_limit(&unknowns[*j])) {
        return "the misfit is no larger far from the estimate".into();
    }
    // The exponential of the standard deviation of a logarithm is a factor.
    let size = |j: &usize| match deviations[*j] {
        sd if !unknowns[*j].parameter.is_positive() => format!("{sd:.2}"),
        sd if sd > 10.0 => "many orders of magnitude".into(),
        sd => format!("a factor of {:.1}", sd.exp()),
    };
    let sizes: Vec<String> = listed.iter().map(size).collect();
    format!("standard deviation {}", sizes.join(" and "))
}

/// Text of a direction as a sum of its unknowns with components over the largest, such as `+1.000 density -0.500
/// radius`. Of more than [`MOST_LISTED`] `involved` unknowns the [`LISTED`] with the largest components are written,
/// and the others counted.
fn weighted_sum(unknowns: &[Unknown], direction: &[f64], involved: &[usize]) -> String {
    let most = largest_component(direction);
    let listed = listed_unknowns(direction, involved);
    let term = |j: &usize| format!("{:+.3} {}", direction[*j] / most, unknowns[*j]);
    let mut terms: Vec<String> = listed.iter().map(term).collect();
    if listed.len() < involved.len() {
        terms.push(format!("and {} others", involved.len() - listed.len()));
    }
    terms.join(" ")
}

/// Indices of the unknowns that a description lists: all `involved` ones in their order. Of more than [`MOST_LISTED`]
/// the [`LISTED`] with the largest absolute components of the `direction`, the largest first.
fn listed_unknowns(direction: &[f64], involved: &[usize]) -> Vec<usize> {
    let mut listed = involved.to_vec();
    if listed.len() > MOST_LISTED {
        listed.sort_by_cached_key(|j| Reverse(total_order(direction[*j].abs())));
        listed.truncate(LISTED);
    }
    listed
}

/// Text on all directions that the data do not determine: the descriptions of the first [`SUMMARIZED`], separated by
/// semicolons, and the number of the others. Empty without directions.
pub(crate) fn summarize(findings: &[UnidentifiableDirection]) -> String {
    let described = findings.iter().take(SUMMARIZED).map(|f| f.description.clone());
    let mut parts: Vec<String> = described.collect();
    if findings.len() > SUMMARIZED {
        parts.push(format!("and {} more like these", findings.len() - SUMMARIZED));
    }
    parts.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions along which E/density and E*radius^2 are constant, combined as singular vectors may combine them.
    #[test]
    fn combined_directions_are_separated_by_elimination() {
        let unknowns = [
            Parameter::DampingMass,
            Parameter::YoungsModulus,
            Parameter::Density,
            Parameter::Radius,
        ]
        .map(Unknown::new);
        // Nothing changes along (E, density) = (1, 1) and along (E, radius) = (-2, 1).
        let (one, two) = ([0.0, 1.0, 1.0, 0.0], [0.0, -2.0, 0.0, 1.0]);
        let mix = |a: f64, b: f64| (0..4).map(|j| a * one[j] + b * two[j]).collect::<Vec<f64>>();
        let directions = vec![mix(0.6, 0.3), mix(-0.2, 0.5)];
        let (directions, practical) = sparsest(directions, vec![vec![0.0, 3.0, 0.0, 1.0]]);
        // Both structural directions are eliminated: one of the three components is left.
        assert_eq!(practical[0].iter().filter(|d| **d != 0.0).count(), 1, "{practical:?}");
        let found =
            describe_directions(&unknowns, directions, NonIdentifiability::Structural, &[0.0; 4]);
        assert_eq!(found.len(), 2);
        for finding in &found {
            assert_eq!(finding.parameters.len(), 2, "{finding:?}");
            assert!(!finding.parameters.contains(&Parameter::DampingMass));
        }
        let text: String = found.iter().map(|f| f.description.as_str()).collect();
        let known = ["youngs_modulus/density", "youngs_modulus*radius^2", "density/radius^2"];
        assert_eq!(known.iter().filter(|k| text.contains(**k)).count(), 2, "{text}");
    }

    /// Four of twenty unknowns and three of nine directions are listed, the others are counted.
    #[test]
    fn long_descriptions_list_the_largest_components() {
        let name = |j: usize| format!("rod.natural_bending.{j}.d1").parse::<Parameter>().unwrap();
        let unknowns: Vec<Unknown> = (0..20).map(|j| Unknown::new(name(j))).collect();
        let direction = |k: usize| (0..20).map(|j| if j == k { 1.0 } else { 0.5 }).collect();
        let directions: Vec<Vec<f64>> = (0..9).map(direction).collect();
        let deviations: Vec<f64> = (0..20).map(f64::from).collect();
        let kind = NonIdentifiability::Practical;
        let found = describe_directions(&unknowns, directions, kind, &deviations);
        assert_eq!(found[3].parameters.len(), 20);
        let text = &found[3].description;
        assert!(text.contains("+1.000 rod.natural_bending.3.d1 +0.500"), "{text}");
        assert!(
            text.contains("and 16 others") && text.contains("deviation 3.00 and 0.00"),
            "{text}"
        );
        let all = summarize(&found);
        assert!(all.ends_with("; and 6 more like these") && all.len() < 1200, "{all}");
        assert_eq!(summarize(&found[..1]), found[0].description);
    }
}
