//! Closed forms of rods at rest and in motion, with which `rodfit bench --published` compares simulations.
//!
//! Lengths are fractions of the length of the rod, loads are dimensionless, and frequencies are relative to
//! `sqrt(EI/(rho A L^4))`. Elliptic integrals are those of Carlson (1995), "Numerical computation of real or complex
//! elliptic integrals", Numerical Algorithms 10, by duplication. Roots are found by bisection. Arguments are constants
//! of the cases; they are not checked.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

/// Number of bisections after which a root is known to rounding.
const BISECTIONS: usize = 60;
/// Relative spread of the arguments of Carlson's integrals below which the series in it is exact to rounding.
const SMALL_SPREAD: f64 = 1e-3;
/// Number of modes of the series of a released cantilever. The contribution of mode n is of order `1/n^5`.
const MODES: usize = 30;

/// Carlson's symmetric integral of the first kind, `R_F(x, y, z)`, and its degenerate one of the second kind, `R_D(x,
/// y, z)`, of arguments of which at most one of the first two is zero.
fn carlson([mut x, mut y, mut z]: [f64; 3]) -> [f64; 2] {
    let (mut sum, mut power) = (0.0, 1.0);
    loop {
        let mean = (x + y + z) / 3.0;
        let weighted_mean = (x + y + 3.0 * z) / 5.0;
        let spread = [x, y, z].iter().fold(0.0, |most: f64, a| most.max((1.0 - a / mean).abs()));
        if spread < SMALL_SPREAD {
            let [a, b] = [1.0 - x / mean, 1.0 - y / mean];
            let c = -a - b;
            let (e2, e3) = (a * b - c * c, a * b * c);
            let first = 1.0 - e2 / 10.0 + e3 / 14.0 + e2 * e2 / 24.0 - 3.0 * e2 * e3 / 44.0;
            let [a, b] = [1.0 - x / weighted_mean, 1.0 - y / weighted_mean];
            let c = -(a + b) / 3.0;
            let (ab, cc) = (a * b, c * c);
            let e2 = ab - 6.0 * cc;
            let e3 = (3.0 * ab - 8.0 * cc) * c;
            let e4 = 3.0 * (ab - cc) * cc;
            let e5 = ab * cc * c;
            let second = 1.0 - 3.0 * e2 / 14.0 + e3 / 6.0 + 9.0 * e2 * e2 / 88.0
                - 3.0 * e4 / 22.0
                - 9.0 * e2 * e3 / 52.0
                + 3.0 * e5 / 26.0;
            let tail = power * second / (weighted_mean * weighted_mean.sqrt());
            return [first / mean.sqrt(), 3.0 * sum + tail];
        }
        let [a, b, c] = [x, y, z].map(f64::sqrt);
        let shift = a * b + b * c + c * a;
        sum += power / (c * (z + shift));
        power /= 4.0;
        [x, y, z] = [x, y, z].map(|argument| (argument + shift) / 4.0);
    }
}

/// Legendre's elliptic integrals of the first and second kind, `F(phi, k)` and `E(phi, k)`, of an angle up to `pi/2`
/// with this sine, and a modulus below 1.
fn elliptic(sine: f64, modulus: f64) -> [f64; 2] {
    let product = (modulus * sine).powi(2);
    let [first, second] = carlson([1.0 - sine * sine, 1.0 - product, 1.0]);
    [sine * first, sine * first - product * sine / 3.0 * second]
}

/// The root of a function that increases through it between `low` and `high`.
fn root(mut low: f64, mut high: f64, function: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if function(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Deflection of the tip of an inextensible cantilever across its rest shape, under a force across it at the tip, over
/// the length: `1 - 2 (E(k) - E(theta, k))/a`, where `a^2 = P L^2/EI` is the `load` and `sin theta = 1/(k sqrt 2)`. The
/// modulus k is the root of `K(k) - F(theta, k) = a`. Source: Bisshopp and Drucker (1945).
pub fn elastica_deflection(load: f64) -> f64 {
    let sine = |modulus: f64| FRAC_1_SQRT_2 / modulus;
    let scale = load.sqrt();
    let between = |k: f64| {
        let ([complete_first, complete_second], [first, second]) =
            (elliptic(1.0, k), elliptic(sine(k).min(1.0), k));
        [complete_first - first, complete_second - second]
    };
    let modulus = root(FRAC_1_SQRT_2, 1.0 - f64::EPSILON, |k| between(k)[0] - scale);
    1.0 - 2.0 * between(modulus)[1] / scale
}

/// Root `k_n L` of the frequency equation `cos x + 1/cosh x = 0` of a cantilever, for the mode `n`, from 1 on. Its
/// angular frequency is the square, in units of `sqrt(EI/(rho A L^4))`.
pub fn cantilever_root(mode: usize) -> f64 {
    let sign = if mode % 2 == 1 { -1.0 } else { 1.0 };
    // One root between neighboring multiples of pi.
    let high = mode as f64 * PI;
    root(high - PI, high, |x| sign * (x.cos() + 1.0 / x.cosh()))
}

/// Deflection of the tip of a cantilever that is released at rest under a uniform load at time 0, over its static
/// deflection `q L^4/(8 EI)`, as a function of time in units of `sqrt(rho A L^4/EI)`: the series of the modes, `sum_n
/// 32 (-1)^(n+1) s_n/x_n^5 (1 - cos(x_n^2 t))` with `s_n = (cosh x_n + cos x_n)/(sinh x_n + sin x_n)`.
pub fn released_cantilever() -> impl Fn(f64) -> f64 {
    let term = |mode: usize| {
        let root = cantilever_root(mode);
        let ratio = (root.cosh() + root.cos()) / (root.sinh() + root.sin());
        let sign = if mode % 2 == 1 { 1.0 } else { -1.0 };
        [32.0 * sign * ratio / root.powi(5), root * root]
    };
    let terms: Vec<[f64; 2]> = (1..=MODES).map(term).collect();
    move |time| {
        let deflection = |[size, frequency]: &[f64; 2]| size * (1.0 - (frequency * time).cos());
        terms.iter().map(deflection).sum()
    }
}

/// Period of a uniform rigid rod that swings about a hinge through its end with this `amplitude`, rad, in units of
/// `sqrt(L/g)`: `4 sqrt(2/3) K(sin(amplitude/2))`.
pub fn pendulum_period(amplitude: f64) -> f64 {
    4.0 * (2.0_f64 / 3.0).sqrt() * elliptic(1.0, (0.5 * amplitude).sin())[0]
}

/// Sag of a catenary between two points at the same height, over its length, for the `span` between them over the
/// length: `(cosh x - 1)/(2 sinh x)`, where `sinh(x)/x = 1/span`.
pub fn catenary_sag(span: f64) -> f64 {
    let x = root(1e-9, 20.0, |x| x.sinh() / x - 1.0 / span);
    0.5 * (x.cosh() - 1.0) / x.sinh()
}

/// Angular frequency of torsion of a bar that is held at one end, in units of `sqrt(G/(rho L^2))` for a round section:
/// `(n - 1/2) pi` of the mode n.
pub fn torsion_frequency(mode: usize) -> f64 {
    (2 * mode - 1) as f64 * FRAC_PI_2
}

#[cfg(test)]
mod tests {
    use crate::command::bench::closed_forms::{
        cantilever_root, catenary_sag, elastica_deflection, elliptic, pendulum_period,
        released_cantilever,
    };
    use std::f64::consts::PI;

    /// Values of Abramowitz and Stegun, tables 17.1, 17.5 and 17.6.
    #[test]
    fn elliptic_integrals_agree_with_tables() {
        let degree = PI / 180.0;
        for (angle, modulus, first, second) in [
            (90.0_f64, 0.5_f64.sqrt(), 1.854_074_677_301_372, 1.350_643_881_047_675),
            (90.0, (75.0 * degree).sin(), 2.768_063_145_368_768, 1.076_405_113_076_403),
            (30.0, (30.0 * degree).sin(), 0.529_428_63, 0.517_881_93),
            (90.0, 0.0, 0.5 * PI, 0.5 * PI),
        ] {
            let found = elliptic((angle * degree).sin(), modulus);
            println!("{angle} {modulus}: {found:?}");
            // The tables of incomplete integrals have eight digits.
            assert!((found[0] - first).abs() < 6e-9, "{found:?}");
            assert!((found[1] - second).abs() < 6e-9, "{found:?}");
        }
    }

    #[test]
    fn closed_forms_agree_with_published_values() {
        // Exact integrals of the elastica, as in the tests of equilibria.
        for (load, exact) in [(1.0, 0.3017207738), (5.0, 0.7137915236), (50.0, 0.9171554473)] {
            assert!((elastica_deflection(load) - exact).abs() < 1e-10, "{load}");
        }
        for (mode, exact) in [(1, 1.87510407), (2, 4.69409113), (3, 7.85475744)] {
            assert!((cantilever_root(mode) - exact).abs() < 1e-8, "{mode}");
        }
        // Small swings have the period of the linear equation; 1.18034 times that at 90 degrees.
        let small = 2.0 * PI * (2.0_f64 / 3.0).sqrt();
        assert!((pendulum_period(1e-4) / small - 1.0).abs() < 1e-9);
        assert!((pendulum_period(0.5 * PI) / small - 1.180_340_599).abs() < 1e-9);
        // A shallow catenary is a parabola: sag^2 = 3/8 span (length - span) to first order.
        let sag = catenary_sag(0.999);
        assert!((sag * sag / (0.375 * 0.999 * 0.001) - 1.0).abs() < 2e-3, "{sag}");
    }

    /// The mean of the released motion is the static deflection; the start is at rest.
    #[test]
    fn released_cantilever_oscillates_about_its_static_deflection() {
        let deflection = released_cantilever();
        assert!(deflection(0.0).abs() < 1e-15);
        // The tip starts with the acceleration of the load, q/(rho A): 4 t^2 of the static deflection, until waves from
        // the wall arrive.
        let early = deflection(0.005) / (4.0 * 0.005_f64.powi(2));
        assert!((early - 1.0).abs() < 1e-3, "{early}");
        let mean = (0..100_000).map(|k| deflection(f64::from(k) * 0.017)).sum::<f64>() / 1e5;
        assert!((mean - 1.0).abs() < 1e-3, "{mean}");
    }
}
