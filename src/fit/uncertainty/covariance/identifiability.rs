//! What the data cannot determine, in words.
//!
//! The singular vectors of the scaled Jacobian with small singular values are the combinations of
//! unknowns that change nothing one could observe: structurally, when they would change nothing in
//! data without noise either, or practically, when the noise hides what they change.

use crate::code::Code;
use crate::fit::search::damping::is_damping;
use crate::fit::uncertainty::covariance::combinations::{constant_exponents, product};
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use crate::scene::Parameter;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;

/// Unknowns with less than this share in a combination are not part of it.
const SHARE: f64 = 0.05;
/// Of more unknowns in a combination than the first, as many as the second are said, those with the largest shares.
const MANY: [usize; 2] = [6, 4];
/// More combinations than this are counted, not said, where all of them stand in a sentence.
const SAID: usize = 3;

/// A direction whose standard deviation is more than this part of what is still an identification
/// is also looked at as far as that: a long way off, the model may be flatter than it is here.
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
    /// Its name in JSON, by which it is explained.
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

/// A parameter that nothing observed depends on; damping, beside unknowns that have an effect, has
/// come out at zero.
pub(crate) fn without_effect(unknown: &Unknown, alone: bool) -> UnidentifiableDirection {
    let (kind, words) = match is_damping(unknown) && !alone {
        true => (
            NonIdentifiability::Practical,
            format!("{unknown} came out at zero: these data show none of it"),
        ),
        false => (NonIdentifiability::Structural, no_effect(unknown)),
    };
    UnidentifiableDirection { kind, parameters: vec![unknown.parameter], description: words }
}

fn no_effect(unknown: &Unknown) -> String {
    format!("{unknown} has no effect on what was observed")
}

/// The undetermined combinations along `directions` (changes of the unknowns on their scales), and
/// the unknowns in them.
pub(crate) fn findings(
    unknowns: &[Unknown],
    directions: Vec<Vec<f64>>,
    kind: NonIdentifiability,
    deviation: impl Fn(usize) -> f64,
) -> Vec<UnidentifiableDirection> {
    let name = |direction: Vec<f64>| {
        let involved: Vec<usize> = (0..unknowns.len()).filter(|j| direction[*j] != 0.0).collect();
        let combination: Vec<(&Unknown, f64)> =
            involved.iter().map(|j| (&unknowns[*j], direction[*j])).collect();
        let words = match kind {
            NonIdentifiability::Structural => structural(&combination),
            NonIdentifiability::Practical => practical(&combination, &involved, &deviation),
        };
        let parameters = combination.iter().map(|(u, _)| u.parameter).collect();
        UnidentifiableDirection { kind, parameters, description: words }
    };
    directions.into_iter().map(name).collect()
}

/// Structural directions that span the same space with as few unknowns each as elimination finds:
/// any combination of two is as undetermined as they are, and which ones the singular vectors show
/// is an accident. Practical ones are cleared of the structural ones. Shares below [`SHARE`] of the
/// largest become zero.
pub(crate) fn sparsest(
    mut structural: Vec<Vec<f64>>,
    mut practical: Vec<Vec<f64>>,
) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let mut pivots = Vec::new();
    for k in 0..structural.len() {
        let row = structural[k].clone();
        let free = (0..row.len()).filter(|j| !pivots.contains(j));
        let Some(pivot) = free.max_by(|a, b| row[*a].abs().total_cmp(&row[*b].abs())) else {
            break;
        };
        pivots.push(pivot);
        let others = structural.iter_mut().enumerate().filter(|(i, _)| *i != k);
        for other in others.map(|(_, other)| other).chain(&mut practical) {
            let factor = other[pivot] / row[pivot];
            other.iter_mut().zip(&row).for_each(|(d, r)| *d -= factor * r);
            other[pivot] = 0.0;
        }
    }
    for direction in structural.iter_mut().chain(&mut practical) {
        let most = direction.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
        direction.iter_mut().filter(|d| d.abs() <= SHARE * most).for_each(|d| *d = 0.0);
    }
    (structural, practical)
}

/// The product of powers that is constant along a combination of two positive parameters.
fn invariant(combination: &[(&Unknown, f64)]) -> Option<String> {
    let (unknowns, direction): (Vec<Unknown>, Vec<f64>) =
        combination.iter().map(|(unknown, a)| ((*unknown).clone(), *a)).unzip();
    let exponents = constant_exponents(&unknowns, &direction)?;
    Some(product(unknowns.iter().map(Unknown::to_string).zip(exponents).collect()))
}

fn structural(combination: &[(&Unknown, f64)]) -> String {
    match (combination, invariant(combination)) {
        ([(one, _)], _) => no_effect(one),
        ([(one, _), (two, _)], Some(invariant)) => format!(
            "{one} and {two} enter only as {invariant}; neither can be identified without the other"
        ),
        _ => format!(
            "the data do not change along the combination {} (logarithms of positive parameters)",
            sum(combination)
        ),
    }
}

fn practical(
    combination: &[(&Unknown, f64)],
    involved: &[usize],
    deviation: &impl Fn(usize) -> f64,
) -> String {
    let size = |(k, j): (usize, &usize)| {
        let sd = deviation(*j);
        match combination[k].0.parameter.is_positive() {
            true if sd > 10.0 => "many orders of magnitude".to_string(),
            true => format!("a factor of {:.1}", sd.exp()),
            false => format!("{sd:.2}"),
        }
    };
    let said = said(combination);
    let sizes: Vec<String> = said.iter().map(|k| size((*k, &involved[*k]))).collect();
    let far = involved.iter().enumerate().any(|(k, j)| {
        deviation(*j) > if combination[k].0.parameter.is_positive() { 1.0 } else { 0.25 }
    });
    let why = match far {
        true => format!("standard deviation {}", sizes.join(" and ")),
        // Locally determined, but only here.
        false => "far from here the misfit is no larger".to_string(),
    };
    match (combination, invariant(combination)) {
        ([(one, _)], _) => {
            format!("{one} is practically not identifiable from these data: {why}")
        }
        ([(one, _), (two, _)], Some(invariant)) => format!(
            "{one} and {two} are practically not identifiable from these data: all but their \
             {invariant} is lost in the noise ({why})"
        ),
        _ => format!(
            "practically not identifiable from these data: the combination {} (logarithms of \
             positive parameters) is lost in the noise ({why})",
            sum(combination)
        ),
    }
}

fn sum(combination: &[(&Unknown, f64)]) -> String {
    let most = combination.iter().fold(0.0_f64, |m, (_, a)| m.max(a.abs()));
    let said = said(combination);
    let mut parts: Vec<String> = said
        .iter()
        .map(|k| format!("{:+.3} {}", combination[*k].1 / most, combination[*k].0))
        .collect();
    if said.len() < combination.len() {
        parts.push(format!("and {} others", combination.len() - said.len()));
    }
    parts.join(" ")
}

/// Which unknowns of a combination are said: all of a few, of many those with the largest shares.
fn said(combination: &[(&Unknown, f64)]) -> Vec<usize> {
    let mut all: Vec<usize> = (0..combination.len()).collect();
    if all.len() > MANY[0] {
        all.sort_by_cached_key(|x| Reverse(total_order(combination[*x].1.abs())));
        all.truncate(MANY[1]);
    }
    all
}

/// What the data do not determine, in one sentence.
pub(crate) fn in_one_sentence(findings: &[UnidentifiableDirection]) -> String {
    let mut words: Vec<String> =
        findings.iter().take(SAID).map(|f| f.description.clone()).collect();
    if findings.len() > SAID {
        words.push(format!("and {} more like these", findings.len() - SAID));
    }
    words.join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// E/density and E*radius^2 at once, mixed as singular vectors may mix them.
    #[test]
    fn mixed_combinations_are_taken_apart() {
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
        // What is known of E and the radius ends up in the other two.
        assert_eq!(practical[0].iter().filter(|d| **d != 0.0).count(), 1, "{practical:?}");
        let found = findings(&unknowns, directions, NonIdentifiability::Structural, |_| 0.0);
        assert_eq!(found.len(), 2);
        for finding in &found {
            assert_eq!(finding.parameters.len(), 2, "{finding:?}");
            assert!(!finding.parameters.contains(&Parameter::DampingMass));
        }
        let words: String = found.iter().map(|f| f.description.as_str()).collect();
        let known = ["youngs_modulus/density", "youngs_modulus*radius^2", "density/radius^2"];
        assert_eq!(known.iter().filter(|k| words.contains(**k)).count(), 2, "{words}");
    }

    /// A page of combinations of thirty curvatures says nothing to anybody.
    #[test]
    fn of_many_the_first_are_said() {
        let name = |j: usize| format!("rod.natural_bending.{j}.d1").parse::<Parameter>().unwrap();
        let unknowns: Vec<Unknown> = (0..20).map(|j| Unknown::new(name(j))).collect();
        let direction = |k: usize| (0..20).map(|j| if j == k { 1.0 } else { 0.5 }).collect();
        let directions: Vec<Vec<f64>> = (0..9).map(direction).collect();
        let found = findings(&unknowns, directions, NonIdentifiability::Practical, |j| j as f64);
        assert_eq!(found[3].parameters.len(), 20);
        let words = &found[3].description;
        assert!(words.contains("+1.000 rod.natural_bending.3.d1 +0.500"), "{words}");
        assert!(
            words.contains("and 16 others") && words.contains("deviation 3.00 and 0.00"),
            "{words}"
        );
        let all = in_one_sentence(&found);
        assert!(all.ends_with("; and 6 more like these") && all.len() < 1200, "{all}");
        assert_eq!(in_one_sentence(&found[..1]), found[0].description);
    }
}
