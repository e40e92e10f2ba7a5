//! Combinations of two parameters that the data determine where they do not determine each of them, such as
//! `youngs_modulus/density`.
//!
//! Along a direction `(a, b)` of two logarithms nothing changes that was observed. The product of powers `p1^b p2^-a` is
//! constant along it, and the data determine it where it is constant along all other such directions as well. Its logarithm
//! `v.x` has the variance `v'Cv`. It is an estimable function: any generalized inverse `C` of the normal matrix yields the same.

use crate::fit::unknown::Unknown;

/// Cosine of an angle up to which a combination is constant along a direction.
const CONSTANT: f64 = 1e-2;

/// Exponents of the unknowns in a product of powers, and the standard deviation of its logarithm.
#[derive(Clone, Debug)]
pub(crate) struct Combination {
    pub exponents: Vec<f64>,
    pub deviation: f64,
}

/// Exponents of the product of powers of two positive parameters that is constant along a direction; none for other directions.
/// They are rounded to the accuracy of singular vectors.
pub(crate) fn constant_exponents(unknowns: &[Unknown], direction: &[f64]) -> Option<Vec<f64>> {
    let involved: Vec<usize> = (0..unknowns.len()).filter(|j| direction[*j] != 0.0).collect();
    let [one, two] = involved[..] else { return None };
    if ![one, two].iter().all(|j| unknowns[*j].parameter.is_positive()) {
        return None;
    }
    let (a, b) = (direction[one], direction[two]);
    let unit = a.abs().min(b.abs()) * b.signum();
    let rounded = |power: f64| (power * 1e2).round() / 1e2;
    let mut exponents = vec![0.0; unknowns.len()];
    (exponents[one], exponents[two]) = (rounded(b / unit), rounded(-a / unit));
    Some(exponents)
}

/// The combinations that are constant along all `directions`, with the exponents of one of them each.
pub(crate) fn determined(unknowns: &[Unknown], directions: &[&Vec<f64>]) -> Vec<Vec<f64>> {
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let is_constant = |v: &Vec<f64>| {
        directions.iter().all(|direction| {
            let along: f64 = v.iter().zip(*direction).map(|(v, d)| v * d).sum();
            along.abs() <= CONSTANT * norm(v) * norm(direction)
        })
    };
    let all = directions.iter().filter_map(|direction| constant_exponents(unknowns, direction));
    all.filter(is_constant).collect()
}

impl Combination {
    /// Name, such as `youngs_modulus/density`.
    pub fn name(&self, unknowns: &[Unknown]) -> String {
        product(self.powers().map(|(j, power)| (unknowns[j].to_string(), power)).collect())
    }

    pub fn unit(&self, unknowns: &[Unknown]) -> String {
        let unit = |(j, power): (usize, f64)| {
            let unit = unknowns[j].parameter.unit();
            let is_compound = unit.contains(['/', ' ', '^']);
            let unit = if is_compound && power != 1.0 { format!("({unit})") } else { unit.into() };
            (unit, power)
        };
        let unit = product(self.powers().map(unit).filter(|(unit, _)| !unit.is_empty()).collect());
        if unit == "Pa/(kg/m^3)" { "m^2/s^2".into() } else { unit }
    }

    /// The unknowns with their exponents.
    pub fn powers(&self) -> impl Iterator<Item = (usize, f64)> {
        self.exponents.iter().copied().enumerate().filter(|(_, power)| *power != 0.0)
    }
}

/// `a^p b^q` with the negative powers below a line.
pub(crate) fn product(factors: Vec<(String, f64)>) -> String {
    let join = |is_above: bool| {
        let own = factors.iter().filter(|(_, power)| (*power > 0.0) == is_above);
        let own = own.map(|(name, power)| match power.abs() {
            1.0 => name.clone(),
            power => format!("{name}^{power}"),
        });
        own.collect::<Vec<_>>().join("*")
    };
    match [join(true), join(false)] {
        [above, below] if below.is_empty() => above,
        [above, below] if above.is_empty() => format!("1/{below}"),
        [above, below] => format!("{above}/{below}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Parameter;

    /// The modulus and the density in common, or the modulus and the radius to the fourth power over its square.
    #[test]
    fn exponents_follow_the_direction_and_other_directions_exclude_combinations() {
        let unknowns =
            [Parameter::YoungsModulus, Parameter::Density, Parameter::Radius].map(Unknown::new);
        let (density, radius) = (vec![0.3, 0.3, 0.0], vec![-0.8, 0.0, 0.4]);
        let combination = |exponents| Combination { exponents, deviation: 0.0 };
        let found = determined(&unknowns, &[&density]);
        assert_eq!(found, [vec![1.0, -1.0, 0.0]]);
        let found = combination(found[0].clone());
        assert_eq!(found.name(&unknowns), "youngs_modulus/density");
        assert_eq!(found.unit(&unknowns), "m^2/s^2");
        let found = combination(constant_exponents(&unknowns, &radius).unwrap());
        assert_eq!(found.name(&unknowns), "youngs_modulus*radius^2");
        assert_eq!(found.unit(&unknowns), "Pa*m^2");
        assert!(determined(&unknowns, &[&density, &radius]).is_empty());
        assert!(constant_exponents(&unknowns, &[1.0, 1.0, 1.0]).is_none());
    }
}
