//! Bending laws of a material as ratios of their secant stiffness to that at small curvature.
//!
//! The bending moment at the difference `kappa` of the curvature from the natural one is `EI kappa phi(p)` with `p =
//! kappa^2`, 1/m^2, and `phi(0) = 1`. The energy per length beyond that of the linear law is `EI kappa^2 H(p)` with the
//! mean of the excess,
//!
//! ```text
//! H(p) = 1/(2 p) integral of phi - 1 from 0 to p
//! ```
//!
//! Two kinds: `phi = 1 + b p` (cubic moment), and a table of `phi` at up to [`MAX_BENDING_POINTS`] curvatures. Between
//! these the table is a cubic polynomial of `p`, with the slopes of Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5,
//! 1984): it is smooth and has no extrema of its own. Beyond the last curvature `phi` is constant.
//! Where `phi` has an extremum or two equal ratios follow each other, the slope is zero; its derivative by the ratios
//! then jumps, and is taken as zero.
//!
//! Input: a `BendingLaw` of the scene; squared curvatures. Output of [`SecantStiffness`]: `H` with its first and second
//! derivative by `p` (`excess`), and the derivatives of `H` and its first derivative by the numbers of the law
//! (`number_slopes`), in the order of `numbers`.

use crate::numerics::scalar::Scalar;
use crate::scene::material::{BendingLaw, MAX_BENDING_POINTS};

/// Largest number of numbers of a law: a ratio and a slope for each curvature of a table.
pub const MAX_NUMBERS: usize = 2 * MAX_BENDING_POINTS;

/// The ratio of the secant bending stiffness to that at small curvature, as a function of the squared curvature.
#[derive(Clone, Debug)]
pub enum SecantStiffness<D> {
    /// `1 + b p` with the coefficient `b`, m^2.
    Cubic(D),
    /// Ratios at curvatures.
    Table(SecantTable<D>),
}

/// A table of ratios, with a first point at no curvature and the ratio 1.
#[derive(Clone, Debug)]
pub struct SecantTable<D> {
    /// Squared curvatures, 1/m^2, ascending from 0.
    knots: Vec<f64>,
    /// Ratios there.
    values: Vec<D>,
    /// Derivatives of the ratio by the squared curvature there, m^2; zero at the last one.
    slopes: Vec<D>,
    /// Integrals of the ratio less 1 from 0 to each squared curvature, 1/m^2.
    integrals: Vec<D>,
}

impl<D: Scalar> SecantStiffness<D> {
    /// The ratio of a law. The curvatures of a table ascend from above zero, with one ratio each.
    pub fn new(law: &BendingLaw<D>) -> Self {
        match law {
            BendingLaw::Cubic { coefficient } => Self::Cubic(*coefficient),
            BendingLaw::Table { curvature, factor } => {
                Self::Table(SecantTable::new(curvature, factor))
            }
        }
    }

    /// `H` and its first two derivatives by `p` at the squared curvature `p`, 1/m^2.
    pub fn excess(&self, p: D) -> [D; 3] {
        match self {
            Self::Cubic(b) => [*b * p * 0.25, *b * 0.25, D::from(0.0)],
            Self::Table(table) => table.excess(p),
        }
    }

    /// The numbers of the law: the coefficient, or ratios and slopes of the table, each after the first point.
    pub fn numbers(&self) -> impl Iterator<Item = D> {
        let (coefficient, table) = match self {
            Self::Cubic(b) => (Some(*b), None),
            Self::Table(table) => (None, Some(table)),
        };
        let pairs = table.into_iter().flat_map(|table| {
            table.values[1..].iter().zip(&table.slopes).flat_map(|(value, slope)| [*value, *slope])
        });
        coefficient.into_iter().chain(pairs)
    }
}

impl SecantStiffness<f64> {
    /// Calls `add` for each number that acts on `H` at the squared curvature `p`: with its index in
    /// [`numbers`](Self::numbers), and the derivatives of `H` and of `dH/dp` by it.
    pub fn number_slopes(&self, p: f64, mut add: impl FnMut(usize, [f64; 2])) {
        match self {
            Self::Cubic(_) => add(0, [0.25 * p, 0.25]),
            Self::Table(table) => table.number_slopes(p, add),
        }
    }
}

/// The integral from 0 to `u` of the polynomial `c[0] + c[1] u + c[2] u^2 + c[3] u^3`.
fn integral<D: Scalar>(c: [D; 4], u: D) -> D {
    (((c[3] * u * 0.25 + c[2] * (1.0 / 3.0)) * u + c[1] * 0.5) * u + c[0]) * u
}

impl<D: Scalar> SecantTable<D> {
    /// The table of ratios `factor` at the curvatures `curvature`, 1/m.
    fn new(curvature: &[f64], factor: &[D]) -> Self {
        let knots: Vec<f64> =
            std::iter::once(0.0).chain(curvature.iter().map(|kappa| kappa * kappa)).collect();
        let values: Vec<D> = std::iter::once(D::from(1.0)).chain(factor.iter().copied()).collect();
        let slopes = slopes(&knots, &values);
        let mut table = Self { integrals: vec![D::from(0.0)], knots, values, slopes };
        for k in 1..table.knots.len() {
            let width = D::from(table.knots[k] - table.knots[k - 1]);
            let part = integral(table.polynomial(k - 1), width);
            table.integrals.push(table.integrals[k - 1] + part);
        }
        table
    }

    /// The last point whose squared curvature is at most `p`.
    fn point_before(&self, p: f64) -> usize {
        self.knots.partition_point(|knot| *knot <= p).max(1) - 1
    }

    /// The ratio less 1 after the point `k` as a polynomial of the squared curvature from there on; constant after the
    /// last point.
    fn polynomial(&self, k: usize) -> [D; 4] {
        let excess = self.values[k] - 1.0;
        let Some(end) = self.knots.get(k + 1) else {
            return [excess, D::from(0.0), D::from(0.0), D::from(0.0)];
        };
        let width = end - self.knots[k];
        let mean = (self.values[k + 1] - self.values[k]) / width;
        let [a, b] = [self.slopes[k], self.slopes[k + 1]];
        [excess, a, (mean * 3.0 - a * 2.0 - b) / width, (a + b - mean * 2.0) / (width * width)]
    }

    /// `H` and its first two derivatives by `p`.
    fn excess(&self, p: D) -> [D; 3] {
        let k = self.point_before(p.value());
        let [c0, c1, c2, c3] = self.polynomial(k);
        if k == 0 {
            // Without the division by `p`, which may be zero: `c0` is zero here.
            let [c1, c2, c3] = [c1 * 0.25, c2 * (1.0 / 6.0), c3 * 0.125];
            return [
                ((c3 * p + c2) * p + c1) * p,
                (c3 * p * 3.0 + c2 * 2.0) * p + c1,
                c3 * p * 6.0 + c2 * 2.0,
            ];
        }
        let u = p - self.knots[k];
        let mean = (self.integrals[k] + integral([c0, c1, c2, c3], u)) / p * 0.5;
        let ratio = ((c3 * u + c2) * u + c1) * u + c0;
        let slope = (c3 * u * 3.0 + c2 * 2.0) * u + c1;
        // `p H` is half of the integral: its derivatives are half of the excess and of its slope.
        let first = (ratio * 0.5 - mean) / p;
        [mean, first, (slope * 0.5 - first * 2.0) / p]
    }
}

impl SecantTable<f64> {
    /// Calls `add` with the index of a number and the derivatives of `H` and `dH/dp` by it.
    fn number_slopes(&self, p: f64, mut add: impl FnMut(usize, [f64; 2])) {
        // At no curvature nothing depends on the numbers, times the strains that are factors of both.
        if p <= 0.0 {
            return;
        }
        // The ratio at no curvature and the slope at the last point are no numbers.
        let last = self.knots.len() - 1;
        let value = |k: usize| (k > 0).then(|| 2 * (k - 1));
        let slope = |k: usize| (k < last).then(|| 2 * k + 1);
        // From the derivatives of the integral and of the ratio.
        let mut add = |number: Option<usize>, integral: f64, ratio: f64| {
            if let Some(number) = number {
                let mean = 0.5 * integral / p;
                add(number, [mean, (0.5 * ratio - mean) / p]);
            }
        };
        let at = self.point_before(p);
        for k in 0..at {
            let width = self.knots[k + 1] - self.knots[k];
            for (k, sign) in [(k, 1.0), (k + 1, -1.0)] {
                add(value(k), 0.5 * width, 0.0);
                add(slope(k), sign * width * width / 12.0, 0.0);
            }
        }
        let u = p - self.knots[at];
        if at == last {
            return add(value(at), u, 1.0);
        }
        let width = self.knots[at + 1] - self.knots[at];
        let t = u / width;
        let (t2, t3, t4) = (t * t, t * t * t, t * t * t * t);
        let rise = 3.0 * t2 - 2.0 * t3;
        add(value(at), width * (t - t3 + 0.5 * t4), 1.0 - rise);
        add(value(at + 1), width * (t3 - 0.5 * t4), rise);
        let square = width * width;
        let [first, second] = [0.5 * t2 - 2.0 / 3.0 * t3 + 0.25 * t4, 0.25 * t4 - t3 / 3.0];
        add(slope(at), square * first, width * (t - 2.0 * t2 + t3));
        add(slope(at + 1), square * second, width * (t3 - t2));
    }
}

/// The derivatives of the ratio at the points: weighted harmonic means of the slopes on both sides where they have the
/// same sign, zero where they have not, and zero at the last point. At the first point that of the parabola through the
/// first three points, limited to the range in which the polynomial has no extremum.
fn slopes<D: Scalar>(knots: &[f64], values: &[D]) -> Vec<D> {
    let zero = D::from(0.0);
    let widths: Vec<f64> = knots.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let means: Vec<D> =
        values.windows(2).zip(&widths).map(|(pair, width)| (pair[1] - pair[0]) / *width).collect();
    let is_same_sign = |a: D, b: D| a.value() * b.value() > 0.0;
    let first = match means[..] {
        // The parabola whose vertex is at the last point.
        [mean] => mean * 2.0,
        [a, b, ..] => {
            let [h, k] = [widths[0], widths[1]];
            let slope = (a * (2.0 * h + k) - b * h) / (h + k);
            if !is_same_sign(slope, a) {
                zero
            } else if slope.value().abs() > 3.0 * a.value().abs() {
                a * 3.0
            } else {
                slope
            }
        }
        [] => zero,
    };
    let inner = means.windows(2).zip(widths.windows(2)).map(|(means, widths)| {
        let [a, b] = [means[0], means[1]];
        if !is_same_sign(a, b) {
            return zero;
        }
        let [before, after] = [2.0 * widths[1] + widths[0], widths[1] + 2.0 * widths[0]];
        (a.recip() * before + b.recip() * after).recip() * (before + after)
    });
    let slopes = std::iter::once(first).chain(inner);
    slopes.chain(std::iter::once(zero)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::{Dual64, second_derivative};

    const CURVATURE: [f64; 4] = [2.0, 3.0, 5.0, 8.0];
    const FACTOR: [f64; 4] = [0.8, 0.5, 0.45, 0.6];
    /// Squared curvatures in every interval, at a point, and beyond the last one.
    const SQUARES: [f64; 7] = [0.01, 2.5, 9.0, 13.0, 40.0, 63.9, 90.0];

    fn table<D: Scalar>() -> SecantTable<D> {
        SecantTable::new(&CURVATURE, &FACTOR.map(D::from))
    }

    /// The ratio `phi = 1 + 2 d(p H)/dp` has the values of the table, is constant beyond the last one, and between two
    /// points within their values.
    #[test]
    fn ratio_is_that_of_the_table() {
        let law = SecantStiffness::Table(table());
        let ratio = |kappa: f64| {
            let [mean, first, _] = law.excess(kappa * kappa);
            1.0 + 2.0 * (mean + kappa * kappa * first)
        };
        for (kappa, factor) in CURVATURE.into_iter().zip(FACTOR) {
            assert!((ratio(kappa) - factor).abs() < 1e-14, "{kappa} {}", ratio(kappa));
        }
        assert!((ratio(20.0) - 0.6).abs() < 1e-14 && (ratio(0.0) - 1.0).abs() < 1e-15);
        let ends = |k: usize| if k == 0 { [0.0, 1.0] } else { [CURVATURE[k - 1], FACTOR[k - 1]] };
        for k in 0..4 {
            let ([from, a], [to, b]) = (ends(k), ends(k + 1));
            for i in 1..50 {
                let found = ratio(from + (to - from) * f64::from(i) / 50.0);
                assert!(found > a.min(b) - 1e-14 && found < a.max(b) + 1e-14, "{k} {i} {found}");
            }
        }
    }

    /// `H`, its derivatives by num-dual, and the integral of the ratio by Simpson's rule.
    #[test]
    fn excess_is_the_mean_and_has_its_derivatives() {
        for p in SQUARES {
            let [mean, first, second] = table::<f64>().excess(p);
            let number = |p| SecantStiffness::Table(table()).excess(p)[0];
            let (value, by, twice) = second_derivative(number, p);
            assert!((mean - value).abs() < 1e-15, "{p}");
            assert!((first - by).abs() < 1e-13 && (second - twice).abs() < 1e-12, "{p}");
            let ratio = |x: f64| {
                let [mean, first, _] = table::<f64>().excess(x);
                2.0 * (mean + x * first)
            };
            let (count, mut sum) = (20_000, 0.0);
            let h = p / f64::from(count);
            for i in 0..count {
                let x = h * f64::from(i);
                sum += h / 6.0 * (ratio(x) + 4.0 * ratio(x + 0.5 * h) + ratio(x + h));
            }
            assert!((0.5 * sum / p - mean).abs() < 1e-9, "{p} {sum} {mean}");
        }
    }

    /// A table of a ratio that is linear in the squared curvature is that of the cubic law, up to the last interval.
    #[test]
    fn table_of_a_cubic_law_is_that_law() {
        let cubic = SecantStiffness::Cubic(0.02);
        let factor = CURVATURE.map(|kappa| 1.0 + 0.02 * kappa * kappa);
        let table = SecantTable::new(&CURVATURE, &factor);
        for p in [0.0, 1.0, 4.0, 20.0, 24.9] {
            for (a, b) in cubic.excess(p).iter().zip(table.excess(p)) {
                assert!((a - b).abs() < 1e-15, "{p}");
            }
        }
    }

    /// Derivatives by every number, against those of dual tables with that number.
    #[test]
    fn slopes_by_numbers_are_those_of_dual_tables() {
        for p in SQUARES {
            let laws = [SecantStiffness::Cubic(0.3), SecantStiffness::Table(table())];
            let duals = [SecantStiffness::Cubic(0.3.into()), SecantStiffness::Table(table())];
            for (law, dual) in laws.iter().zip(duals) {
                let mut found = [[0.0; 2]; MAX_NUMBERS];
                law.number_slopes(p, |k, by| {
                    found[k] = [found[k][0] + by[0], found[k][1] + by[1]];
                });
                for k in 0..law.numbers().count() {
                    let dual = with_unit(&dual, k);
                    let [mean, first, _] = dual.excess(Dual64::from(p));
                    for (a, b) in found[k].iter().zip([mean.eps, first.eps]) {
                        assert!((a - b).abs() < 1e-13, "{p} {k} {a} {b}");
                    }
                }
            }
        }
    }

    /// The law with a unit derivative of the number `k`; integrals are computed anew.
    fn with_unit(law: &SecantStiffness<Dual64>, k: usize) -> SecantStiffness<Dual64> {
        match law {
            SecantStiffness::Cubic(b) => SecantStiffness::Cubic(b.derivative()),
            SecantStiffness::Table(table) => {
                let mut table = table.clone();
                match k % 2 {
                    0 => table.values[k / 2 + 1].eps = 1.0,
                    _ => table.slopes[k / 2].eps = 1.0,
                }
                for k in 1..table.knots.len() {
                    let width = Dual64::from(table.knots[k] - table.knots[k - 1]);
                    let part = integral(table.polynomial(k - 1), width);
                    table.integrals[k] = table.integrals[k - 1] + part;
                }
                SecantStiffness::Table(table)
            }
        }
    }
}
