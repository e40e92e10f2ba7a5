//! Identifiable combinations of two positive parameters that are not identifiable separately, such as
//! `youngs_modulus/density`.
//!
//! Input: the unknowns and the unidentifiable directions, which are changes of the unknowns on their scales. Along a
//! direction `(a, b)` of two logarithms no observed value changes, or none by more than the noise. The product of
//! powers `p1^b p2^-a` is constant along it. The data determine the product where it is constant along all other such
//! directions as well (cosine of at most [`ORTHOGONAL`]). Its logarithm `v.x` has the variance `v'Cv`. It is an
//! estimable function: any generalized inverse `C` of the normal matrix yields the same. [`constant_combinations`]
//! returns the exponents `v` of each product, one per unknown, for the covariance. They are scaled to 1 for the smaller
//! one in magnitude and rounded to two decimals. The covariance adds the standard deviation of the logarithm, and
//! [`Combination`] composes name and unit for the report. [`constant_exponents`] are those of one direction.

use crate::fit::unknown::Unknown;

/// Largest cosine of the angle between a direction and the exponents of a product that is constant along it. Exact
/// orthogonality is lost by rounded exponents; larger values accept products that vary.
const ORTHOGONAL: f64 = 1e-2;

/// A product of powers of the unknowns that the data determine, although not each factor.
#[derive(Clone, Debug)]
pub(crate) struct Combination {
    /// Exponent of every unknown; 0 for those that are no factor.
    pub exponents: Vec<f64>,
    /// Standard deviation of the logarithm of the product.
    pub deviation: f64,
}

/// Exponents, one per unknown, of the product of powers that is constant along `direction`, a change of the unknowns on
/// their scales. With components `a` and `b` they are `b` and `-a`, scaled, and 0 for all others. The smaller exponent
/// is 1 in absolute value, the first one positive; both are rounded to two decimals, the accuracy of singular vectors.
/// None unless exactly two components are not zero, both of positive parameters.
pub(crate) fn constant_exponents(unknowns: &[Unknown], direction: &[f64]) -> Option<Vec<f64>> {
    let involved: Vec<usize> = (0..unknowns.len()).filter(|j| direction[*j] != 0.0).collect();
    let [one, two] = involved[..] else { return None };
    if ![one, two].iter().all(|j| unknowns[*j].parameter.is_positive()) {
        return None;
    }
    // Along (a, b) the logarithm b x1 - a x2 of the product does not change.
    let (a, b) = (direction[one], direction[two]);
    // The smaller exponent becomes one in absolute value, and that of the first parameter is positive.
    let unit = a.abs().min(b.abs()) * b.signum();
    let rounded = |power: f64| (power * 1e2).round() / 1e2;
    let mut exponents = vec![0.0; unknowns.len()];
    (exponents[one], exponents[two]) = (rounded(b / unit), rounded(-a / unit));
    Some(exponents)
}

/// Exponents, one list per product and one number per unknown, of the products that are constant along all
/// `directions`. Each direction of two positive parameters proposes its product. It is kept if the cosine of its
/// exponents with every direction is at most [`ORTHOGONAL`]. Equal products of several directions are not merged.
pub(crate) fn constant_combinations(
    unknowns: &[Unknown],
    directions: &[&Vec<f64>],
) -> Vec<Vec<f64>> {
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let is_constant = |v: &Vec<f64>| {
        directions.iter().all(|direction| {
            // The logarithm of the product changes along a direction by their scalar product.
            let product: f64 = v.iter().zip(*direction).map(|(v, d)| v * d).sum();
            product.abs() <= ORTHOGONAL * norm(v) * norm(direction)
        })
    };
    let all = directions.iter().filter_map(|direction| constant_exponents(unknowns, direction));
    all.filter(is_constant).collect()
}

impl Combination {
    /// Name of the product, such as `youngs_modulus/density`, from the names of the unknowns with their exponents.
    pub fn name(&self, unknowns: &[Unknown]) -> String {
        product(&self.exponents, |j| unknowns[j].to_string())
    }

    /// Unit, such as `Pa*m^2`, from the SI units of the unknowns; composite units in a power are in parentheses. The
    /// unit of modulus over density is `m^2/s^2`.
    pub fn unit(&self, unknowns: &[Unknown]) -> String {
        // Composite units in a power are in brackets.
        let unit = product(&self.exponents, |j| {
            let unit = unknowns[j].parameter.unit();
            let is_compound = unit.contains(['/', ' ', '^']) && self.exponents[j] != 1.0;
            if is_compound { format!("({unit})") } else { unit.into() }
        });
        if unit == "Pa/(kg/m^3)" { "m^2/s^2".into() } else { unit }
    }

    /// Pairs of the index of an unknown and its exponent, ascending by index, without exponents of zero.
    pub fn powers(&self) -> impl Iterator<Item = (usize, f64)> {
        self.exponents.iter().copied().enumerate().filter(|(_, power)| *power != 0.0)
    }
}

/// Text `a^p*b/c^q` of a product with these `exponents`, where `symbol` returns the text of each factor. Negative
/// powers are in the denominator, after `1` without a numerator. Exponents of 1 are not written; empty symbols are left
/// out.
fn product(exponents: &[f64], symbol: impl Fn(usize) -> String) -> String {
    let join = |sign: f64| {
        let own = exponents.iter().enumerate().filter(|(_, power)| sign * **power > 0.0);
        let own = own.map(|(j, power)| (symbol(j), power)).filter(|(symbol, _)| !symbol.is_empty());
        let own = own.map(|(symbol, power)| match power.abs() {
            1.0 => symbol,
            power => format!("{symbol}^{power}"),
        });
        own.collect::<Vec<_>>().join("*")
    };
    match [join(1.0), join(-1.0)] {
        [above, below] if below.is_empty() => above,
        [above, below] if above.is_empty() => format!("1/{below}"),
        [above, below] => format!("{above}/{below}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Parameter;

    /// Along equal logarithms of modulus and density `E/rho` is constant, along (-2, 1) of modulus and radius `E r^2`;
    /// no product is along both.
    #[test]
    fn exponents_follow_the_direction_and_other_directions_exclude_combinations() {
        let unknowns =
            [Parameter::YoungsModulus, Parameter::Density, Parameter::Radius].map(Unknown::new);
        let (density, radius) = (vec![0.3, 0.3, 0.0], vec![-0.8, 0.0, 0.4]);
        let combination = |exponents| Combination { exponents, deviation: 0.0 };
        let found = constant_combinations(&unknowns, &[&density]);
        assert_eq!(found, [vec![1.0, -1.0, 0.0]]);
        let found = combination(found[0].clone());
        assert_eq!(found.name(&unknowns), "youngs_modulus/density");
        assert_eq!(found.unit(&unknowns), "m^2/s^2");
        let found = combination(constant_exponents(&unknowns, &radius).unwrap());
        assert_eq!(found.name(&unknowns), "youngs_modulus*radius^2");
        assert_eq!(found.unit(&unknowns), "Pa*m^2");
        assert!(constant_combinations(&unknowns, &[&density, &radius]).is_empty());
        assert!(constant_exponents(&unknowns, &[1.0, 1.0, 1.0]).is_none());
    }
}
