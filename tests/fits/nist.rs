//! The optimizer of `fit` on NIST's reference problems for nonlinear regression (StRD).
//!
//! 27 data sets with parameters certified to eleven digits, each from a far and from a near
//! start. Derivatives by num-dual; one set of tolerances for all 54 runs.
//! `cargo test --release --test fits nist:: -- --nocapture` prints the table.

use argmin::core::{Error, Executor, Jacobian, Operator, State, TerminationReason};
use num_dual::{Dual64, DualNum};
use rodfit::fit::LevenbergMarquardt;
use std::f64::consts::PI;

/// One data set.
struct Problem {
    name: String,
    starts: [Vec<f64>; 2],
    certified: Vec<f64>,
    certified_rss: f64,
    /// Response, then predictors.
    rows: Vec<Vec<f64>>,
}

const NAMES: [&str; 27] = [
    "Misra1a", "Chwirut2", "Chwirut1", "Lanczos3", "Gauss1", "Gauss2", "DanWood", "Misra1b",
    "Kirby2", "Hahn1", "Nelson", "MGH17", "Lanczos1", "Lanczos2", "Gauss3", "Misra1c", "Misra1d",
    "Roszman1", "ENSO", "MGH09", "Thurber", "BoxBOD", "Rat42", "MGH10", "Eckerle4", "Rat43",
    "Bennett5",
];

/// Value of the data set's model at the predictors `x` with the parameters `b`.
fn model<D: DualNum<Primitive = f64> + Copy>(name: &str, b: &[D], x: &[f64]) -> D {
    let t = D::from(x[0]);
    let one = D::from(1.0);
    match name {
        "Misra1a" | "BoxBOD" => b[0] * (one - (-b[1] * t).exp()),
        "Misra1b" => b[0] * (one - (one + b[1] * t * 0.5).powi(-2)),
        "Misra1c" => b[0] * (one - (one + b[1] * t * 2.0).sqrt().recip()),
        "Misra1d" => b[0] * b[1] * t / (one + b[1] * t),
        "Chwirut1" | "Chwirut2" => (-b[0] * t).exp() / (b[1] + b[2] * t),
        "Lanczos1" | "Lanczos2" | "Lanczos3" => {
            b[0] * (-b[1] * t).exp() + b[2] * (-b[3] * t).exp() + b[4] * (-b[5] * t).exp()
        }
        "Gauss1" | "Gauss2" | "Gauss3" => {
            let bell = |b: &[D]| b[0] * (-((t - b[1]) / b[2]).powi(2)).exp();
            b[0] * (-b[1] * t).exp() + bell(&b[2..5]) + bell(&b[5..8])
        }
        "DanWood" => b[0] * (b[1] * x[0].ln()).exp(),
        "Kirby2" => (b[0] + (b[1] + b[2] * t) * t) / (one + (b[3] + b[4] * t) * t),
        "Hahn1" | "Thurber" => {
            (b[0] + (b[1] + (b[2] + b[3] * t) * t) * t) / (one + (b[4] + (b[5] + b[6] * t) * t) * t)
        }
        // Of the response's logarithm.
        "Nelson" => b[0] - b[1] * t * (-b[2] * x[1]).exp(),
        "MGH17" => b[0] + b[1] * (-t * b[3]).exp() + b[2] * (-t * b[4]).exp(),
        "Roszman1" => b[0] - b[1] * t - (b[2] / (t - b[3])).atan() / PI,
        "ENSO" => {
            let wave = |period: D, b: &[D]| {
                let angle = t * (2.0 * PI) / period;
                b[0] * angle.cos() + b[1] * angle.sin()
            };
            b[0] + wave(D::from(12.0), &b[1..3]) + wave(b[3], &b[4..6]) + wave(b[6], &b[7..9])
        }
        "MGH09" => b[0] * (t * t + t * b[1]) / (t * t + t * b[2] + b[3]),
        "Rat42" => b[0] / (one + (b[1] - b[2] * t).exp()),
        "Rat43" => b[0] * (-(one + (b[1] - b[2] * t).exp()).ln() / b[3]).exp(),
        "MGH10" => b[0] * (b[1] / (t + b[2])).exp(),
        "Eckerle4" => b[0] / b[1] * (((t - b[2]) / b[1]).powi(2) * -0.5).exp(),
        "Bennett5" => b[0] * (-(b[1] + t).ln() / b[2]).exp(),
        other => panic!("no model for {other}"),
    }
}

impl Problem {
    /// Reads a file in NIST's own form.
    fn read(name: &str) -> Self {
        let path = format!("{}/data/nist/{name}.dat", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
        let numbers = |line: &str| -> Vec<f64> {
            line.split_whitespace().map_while(|word| word.parse().ok()).collect()
        };
        let parameters: Vec<Vec<f64>> = text
            .lines()
            .filter_map(|line| line.trim_start().strip_prefix('b')?.split_once('='))
            .map(|(_, values)| numbers(values))
            .filter(|values| values.len() == 4)
            .collect();
        let column = |k: usize| parameters.iter().map(|p| p[k]).collect::<Vec<f64>>();
        let after = |key: &str| {
            let line = text.lines().find_map(|line| line.strip_prefix(key));
            numbers(line.unwrap_or_else(|| panic!("{path}: no `{key}`")))[0]
        };
        let table = text.lines().skip_while(|line| !line.starts_with("Number of Observations"));
        let data = table.skip_while(|line| !line.starts_with("Data:")).skip(1);
        let mut rows: Vec<Vec<f64>> = data.map(numbers).filter(|row| row.len() >= 2).collect();
        if name == "Nelson" {
            rows.iter_mut().for_each(|row| row[0] = row[0].ln());
        }
        assert_eq!(rows.len(), after("Number of Observations:") as usize, "{path}");
        Self {
            name: name.into(),
            starts: [column(0), column(1)],
            certified: column(2),
            certified_rss: after("Residual Sum of Squares:"),
            rows,
        }
    }

    /// Residual sum of squares at the parameters `b`.
    fn rss(&self, b: &[f64]) -> f64 {
        self.rows.iter().map(|row| (model(&self.name, b, &row[1..]) - row[0]).powi(2)).sum()
    }
}

impl Operator for &Problem {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    fn apply(&self, b: &Vec<f64>) -> Result<Vec<f64>, Error> {
        Ok(self.rows.iter().map(|row| model(&self.name, b, &row[1..]) - row[0]).collect())
    }
}

impl Jacobian for &Problem {
    type Param = Vec<f64>;
    type Jacobian = Vec<Vec<f64>>;
    fn jacobian(&self, b: &Vec<f64>) -> Result<Vec<Vec<f64>>, Error> {
        let mut lifted: Vec<Dual64> = b.iter().map(|b| Dual64::from(*b)).collect();
        let mut rows = vec![vec![0.0; b.len()]; self.rows.len()];
        for j in 0..b.len() {
            lifted[j].eps = 1.0;
            for (row, data) in rows.iter_mut().zip(&self.rows) {
                row[j] = model(&self.name, &lifted, &data[1..]).eps;
            }
            lifted[j].eps = 0.0;
        }
        Ok(rows)
    }
}

/// Digits of the least accurate parameter: the logarithm of the relative error, at most the eleven
/// that are certified.
fn digits(found: &[f64], certified: &[f64]) -> f64 {
    let error = |(b, c): (&f64, &f64)| ((b - c) / c).abs();
    if found.len() != certified.len() || !found.iter().all(|b| b.is_finite()) {
        return 0.0;
    }
    let worst = found.iter().zip(certified).map(error).fold(0.0, f64::max);
    (-worst.log10()).clamp(0.0, 11.0)
}

/// Parameters, iterations, evaluations and how the run ended.
fn solve(problem: &Problem, start: &[f64]) -> (Vec<f64>, u64, u64, String) {
    let solver = LevenbergMarquardt::new(vec![[f64::MIN, f64::MAX]; start.len()])
        .step_tolerance(0.0)
        .noise_tolerance(0.0);
    let result = Executor::new(problem, solver)
        .configure(|state| state.param(start.to_vec()).max_iters(10000))
        .run();
    match result {
        Ok(result) => {
            let evaluations = result.problem().counts.get("jacobian_count").copied().unwrap_or(0);
            let state = result.state();
            let status = state.get_termination_reason().map_or("none", |r| r.text()).to_string();
            let b = state.get_param().or(state.get_best_param());
            (b.cloned().unwrap_or_default(), state.get_iter(), evaluations, status)
        }
        Err(error) => (Vec::new(), 0, 0, error.to_string()),
    }
}

/// The residuals of the certified parameters have the certified sum of squares (NIST StRD), up to the eleven digits of the
/// parameters.
#[test]
fn nist_certified_values_are_minima() {
    for name in NAMES {
        let problem = Problem::read(name);
        let b = &problem.certified;
        let rounding = |row: Vec<f64>| -> f64 {
            row.iter().zip(b).map(|(d, b)| (d * b * 0.5e-10).abs()).sum::<f64>().powi(2)
        };
        let allowed: f64 = (&problem).jacobian(b).unwrap().into_iter().map(rounding).sum();
        let (rss, certified) = (problem.rss(b), problem.certified_rss);
        // Certified values have eleven digits: half a unit of the last digit of each parameter, and of the sum.
        assert!((rss - certified).abs() <= allowed + 6e-11 * certified, "{name}: {rss:e}");
        // And they are a minimum: the gradient vanishes next to the terms it is made of.
        let (r, j) = ((&problem).apply(b).unwrap(), (&problem).jacobian(b).unwrap());
        for k in 0..b.len() {
            let terms = r.iter().zip(&j).map(|(r, row)| r * row[k]);
            let (sum, size) = terms.fold((0.0, 0.0), |(s, z), t| (s + t, z + f64::abs(t)));
            let by_rounding: f64 = j
                .iter()
                .map(|row| {
                    let moved = |(d, b): (&f64, &f64)| (d * b * 0.5e-10).abs();
                    row[k].abs() * row.iter().zip(b).map(moved).sum::<f64>()
                })
                .sum();
            // The gradient vanishes up to the same rounding of the parameters.
            assert!(f64::abs(sum) <= by_rounding + 1e-9 * size, "{name}: {sum:e} of {size:e}");
        }
    }
}

#[test]
fn nist_problems_are_solved_from_both_starts() {
    println!("problem   start  digits  iterations  evaluations  ended");
    let (mut sum, mut solved, mut unconverged) = (0.0, 0, Vec::new());
    for name in NAMES {
        let problem = Problem::read(name);
        for (k, start) in problem.starts.iter().enumerate() {
            let (b, iterations, evaluations, status) = solve(&problem, start);
            let digits = digits(&b, &problem.certified);
            println!(
                "{name:<9} {:>5} {digits:>7.1} {iterations:>11} {evaluations:>12}  {status}",
                k + 1
            );
            if status != TerminationReason::SolverConverged.text() {
                unconverged.push((name, k + 1, status));
            }
            sum += digits;
            solved += usize::from(digits >= 4.0);
        }
    }
    println!("{solved} of 54 to four digits or more; mean {:.2} of at most 11", sum / 54.0);
    assert_eq!(solved, 54);
    // At the minimum to rounding, none says that it is not one; but for Lanczos1, which is fitted to
    // the thirteenth digit of its data, where residuals are rounding errors.
    unconverged.retain(|(name, ..)| *name != "Lanczos1");
    assert!(unconverged.is_empty(), "{unconverged:?}");
    assert!(sum / 54.0 >= 10.0, "{:.3}", sum / 54.0);
}
