//! Numbers of the scenes that are not identified, and not exactly known either.

use crate::error::Error;
use crate::fit::measurement::experiment::{Experiment, named};
use crate::fit::unknown::Unknown;
use crate::scene::Parameter;
use crate::scene::validate::positive;
use nalgebra::{DMatrix, SymmetricEigen};

/// How far below zero an eigenvalue of correlations may be by rounding.
const ROUNDING: f64 = 1e-9;

/// A number of the scenes that was measured with an error. The data do not change what is known of it: its
/// error goes into those of the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// The number, as parameters are named.
    pub parameter: Parameter,
    /// Its standard uncertainty, in its unit.
    pub sigma: f64,
    /// The experiments in which it is off by the same error; all that have it when empty.
    pub experiments: Vec<String>,
    /// With which others its error goes together.
    pub correlations: Vec<Correlation>,
}

/// How the error of a known number goes with that of another.
#[derive(Clone, Debug, PartialEq)]
pub struct Correlation {
    /// The other number.
    pub with: Parameter,
    /// An experiment of the other, where several known numbers have its name.
    pub experiment: Option<String>,
    /// The coefficient, -1 to 1.
    pub value: f64,
}

impl Known {
    /// A number with a standard uncertainty in its unit.
    pub fn new(parameter: Parameter, sigma: f64) -> Self {
        Self { parameter, sigma, experiments: Vec::new(), correlations: Vec::new() }
    }

    /// Of one more experiment only; without any all that have the number share its error.
    pub fn of_experiment(mut self, name: impl Into<String>) -> Self {
        self.experiments.push(name.into());
        self
    }

    /// With an error that goes with that of another known number, by a coefficient of -1 to 1.
    pub fn correlated(mut self, with: Parameter, value: f64) -> Self {
        self.correlations.push(Correlation { with, experiment: None, value });
        self
    }

    /// The name, with the experiments if it is of some only.
    pub fn label(&self) -> String {
        named(&self.parameter, &self.experiments)
    }

    /// The same number as one to be differentiated by.
    pub(crate) fn as_unknown(&self) -> Unknown {
        Unknown { experiments: self.experiments.clone(), ..Unknown::new(self.parameter) }
    }
}

/// Squares of more are no numbers any more.
const MOST_SIGMA: f64 = 1e100;

/// Refuses known numbers that no scene has, that are identified, or whose correlations cannot be.
pub(crate) fn check(
    experiments: &[Experiment],
    unknowns: &[Unknown],
    knowns: &[Known],
) -> Result<(), Error> {
    for (i, known) in knowns.iter().enumerate() {
        let (key, own) = (format!("known[{i}]"), known.as_unknown());
        own.check(experiments, &key)?;
        positive(&format!("{key}.sigma"), known.sigma)?;
        if known.sigma > MOST_SIGMA {
            let allowed = format!("up to {MOST_SIGMA:e}");
            return Err(Error::invalid(format!("{key}.sigma"), known.sigma, allowed));
        }
        let shared = |other: &Unknown| {
            let both = |e: &Experiment| other.is_of(e) && own.is_of(e);
            other.parameter == own.parameter && experiments.iter().any(both)
        };
        if let Some(unknown) = unknowns.iter().find(|u| shared(u)) {
            let (found, allowed) = match unknown.prior {
                Some(_) => ("which has a prior", "a prior or a [[known]], not both"),
                None => (
                    "which is identified",
                    "inputs that are not identified; give a parameter a prior instead",
                ),
            };
            let found = format!("{}, {found}", known.parameter);
            return Err(Error::invalid(format!("{key}.name"), found, allowed));
        }
        if knowns[..i].iter().any(|k| shared(&k.as_unknown())) {
            let allowed = "each name once in an experiment";
            return Err(Error::invalid(format!("{key}.name"), known.parameter, allowed));
        }
    }
    correlations(knowns).map(|_| ())
}

/// The correlations of all known numbers.
pub(crate) fn correlations(knowns: &[Known]) -> Result<DMatrix<f64>, Error> {
    let n = knowns.len();
    let mut matrix = DMatrix::identity(n, n);
    for (i, known) in knowns.iter().enumerate() {
        for (k, Correlation { with, experiment, value }) in known.correlations.iter().enumerate() {
            let key = |own: &str| format!("known[{i}].correlation[{k}].{own}");
            let is_it = |other: &Known| {
                let of = |name: &String| {
                    other.experiments.is_empty() || other.experiments.contains(name)
                };
                other.parameter == *with && experiment.as_ref().is_none_or(of)
            };
            let others: Vec<usize> = (0..n).filter(|j| *j != i && is_it(&knowns[*j])).collect();
            let [j] = others[..] else {
                let found = format!("{with}, of which there are {} others", others.len());
                let allowed =
                    "the name of one other [[known]], with its experiment where several have it";
                return Err(Error::invalid(key("with"), found, allowed));
            };
            if !(-1.0..=1.0).contains(value) {
                return Err(Error::invalid(key("value"), value, "-1 .. 1"));
            }
            if matrix[(i, j)] != 0.0 && matrix[(i, j)] != *value {
                let found = format!("{value}, and {} for the same pair", matrix[(i, j)]);
                return Err(Error::invalid(key("value"), found, "one value"));
            }
            (matrix[(i, j)], matrix[(j, i)]) = (*value, *value);
        }
    }
    if knowns.iter().all(|known| known.correlations.is_empty()) {
        return Ok(matrix);
    }
    let least = SymmetricEigen::new(matrix.clone()).eigenvalues.iter().copied().fold(0.0, f64::min);
    match least < -ROUNDING * n as f64 {
        true => {
            let found = "correlations that contradict each other";
            let allowed = "a matrix of correlations without negative eigenvalues";
            Err(Error::invalid("known", found, allowed))
        }
        false => Ok(matrix),
    }
}

/// A root of the correlations: independent normal numbers times it are correlated ones.
pub(crate) fn root(knowns: &[Known]) -> Result<DMatrix<f64>, Error> {
    let correlations = correlations(knowns)?;
    if knowns.is_empty() {
        return Ok(correlations);
    }
    let axes = SymmetricEigen::new(correlations);
    let sizes = axes.eigenvalues.map(|value| value.max(0.0).sqrt());
    Ok(axes.eigenvectors * DMatrix::from_diagonal(&sizes))
}
