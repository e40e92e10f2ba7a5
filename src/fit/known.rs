//! Inputs with a standard uncertainty (type B inputs of the GUM): numbers of the scenes that are neither identified nor
//! exact.
//!
//! [`Known`] has the input, its standard uncertainty in its unit, the experiments that share the error (none named: all
//! that have the input), and correlations with the errors of other inputs. [`check`] rejects inputs that no scene has,
//! that are fitted or given twice in an experiment, and uncertainties that are not positive or above [`MOST_SIGMA`].
//! [`correlations`] returns the correlation matrix of all inputs for the uncertainty budget (0 for pairs without a
//! stated correlation). A correlation with no input or with several inputs of that name, beyond -1 to 1, or
//! contradictory (a negative eigenvalue of the matrix) is an error. [`correlation_root`] returns a square root `B` of
//! the matrix (`B B'`, by eigenvectors) for the Monte Carlo propagation. `as_unknown` makes an unknown of an input, for
//! derivatives of the residuals by it.

use crate::error::{Error, ensure};
use crate::fit::measurement::experiment::{Experiment, named};
use crate::fit::unknown::Unknown;
use crate::scene::Parameter;
use crate::scene::validate::positive;
use nalgebra::{DMatrix, SymmetricEigen};

/// Magnitude of a negative eigenvalue of a correlation matrix that is ascribed to rounding errors, per row of the
/// matrix. Larger magnitudes are rejected as contradictory correlations.
const ROUNDING: f64 = 1e-9;
/// Largest standard uncertainty, in any unit: squares of larger ones overflow.
const MOST_SIGMA: f64 = 1e100;

/// An input with a standard uncertainty. The fit does not change its value; its error contributes to those of the
/// estimates.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// The input, named as a parameter.
    pub parameter: Parameter,
    /// Standard uncertainty, in the unit of the input.
    pub sigma: f64,
    /// Names of the experiments that share the error; empty: all whose scene has the input.
    pub experiments: Vec<String>,
    /// Correlations with the errors of other inputs.
    pub correlations: Vec<Correlation>,
}

/// Correlation of the errors of two inputs, given at one of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Correlation {
    /// The other input.
    pub with: Parameter,
    /// An experiment of the other input, where several inputs have its name; `None`: any.
    pub experiment: Option<String>,
    /// Correlation coefficient, -1 to 1.
    pub value: f64,
}

impl Known {
    /// An input with a standard uncertainty in its unit, shared by all experiments that have it, without correlations.
    pub fn new(parameter: Parameter, sigma: f64) -> Self {
        Self { parameter, sigma, experiments: Vec::new(), correlations: Vec::new() }
    }

    /// Adds the name of an experiment to those that share one error of this input. Without any name, all experiments
    /// whose scene has the input share it. Experiments with independent errors need an input each.
    pub fn of_experiment(mut self, name: impl Into<String>) -> Self {
        self.experiments.push(name.into());
        self
    }

    /// Adds the correlation coefficient, -1 to 1, of this input's error with that of another input. The range is
    /// checked with the fit.
    pub fn correlated(mut self, with: Parameter, value: f64) -> Self {
        self.correlations.push(Correlation { with, experiment: None, value });
        self
    }

    /// The name of the input, followed by the names of its experiments in parentheses if any are given.
    pub fn label(&self) -> String {
        named(&self.parameter, &self.experiments)
    }

    /// An unknown of the same parameter and experiments, without start, bounds and prior, for derivatives of the
    /// residuals by the input.
    pub(crate) fn as_unknown(&self) -> Unknown {
        Unknown { experiments: self.experiments.clone(), ..Unknown::new(self.parameter) }
    }
}

/// Rejects inputs that no scene has, that are given twice in an experiment or also identified there (with a prior or
/// without). Standard uncertainties must be positive and at most [`MOST_SIGMA`], and [`correlations`] must accept all
/// correlations. Errors name the table `known[i]`.
pub(crate) fn check(
    experiments: &[Experiment],
    unknowns: &[Unknown],
    knowns: &[Known],
) -> Result<(), Error> {
    for (i, known) in knowns.iter().enumerate() {
        let (key, own) = (format!("known[{i}]"), known.as_unknown());
        own.check(experiments, &key)?;
        // Sigmas of inputs are never estimated: zero would be an exact input, which needs no entry.
        positive(&format!("{key}.sigma"), known.sigma)?;
        let (sigma, allowed) = (known.sigma, format!("up to {MOST_SIGMA:e}"));
        ensure(sigma <= MOST_SIGMA, format!("{key}.sigma"), sigma, allowed)?;
        // A parameter is either identified or an input: both would count its error twice.
        if let Some(unknown) = unknowns.iter().find(|u| own.is_same_in_any(u, experiments)) {
            let (found, allowed) = match unknown.prior {
                Some(_) => ("which has a prior", "a prior or a [[known]], not both"),
                None => (
                    "which is a parameter of the fit",
                    "inputs that are not fitted. Give a fitted parameter a prior instead",
                ),
            };
            let found = format!("{}, {found}", known.parameter);
            return Err(Error::invalid(format!("{key}.name"), found, allowed));
        }
        // Two entries of one input in an experiment would have two independent errors.
        let is_new = !knowns[..i].iter().any(|k| own.is_same_in_any(&k.as_unknown(), experiments));
        let allowed = "each name once in an experiment";
        ensure(is_new, format!("{key}.name"), known.parameter, allowed)?;
    }
    correlations(knowns).map(|_| ())
}

/// The correlation matrix of all inputs, one row per input in their order; pairs without a given correlation have 0. An
/// error if a correlation names no or several inputs, is beyond -1 to 1, or is given twice with different values. So is
/// a matrix with an eigenvalue below minus [`ROUNDING`] per row.
pub(crate) fn correlations(knowns: &[Known]) -> Result<DMatrix<f64>, Error> {
    let n = knowns.len();
    // Each correlation is given at one of its inputs and applies to both.
    let mut matrix = DMatrix::identity(n, n);
    let mut is_given = DMatrix::from_element(n, n, false);
    for (i, known) in knowns.iter().enumerate() {
        for (k, Correlation { with, experiment, value }) in known.correlations.iter().enumerate() {
            let key = |own: &str| format!("known[{i}].correlation[{k}].{own}");
            // An input of one experiment may be correlated with that of the same name in another.
            let is_named = |other: &Known| {
                let has = |name: &String| {
                    other.experiments.is_empty() || other.experiments.contains(name)
                };
                other.parameter == *with && experiment.as_ref().is_none_or(has)
            };
            let others: Vec<usize> = (0..n).filter(|j| *j != i && is_named(&knowns[*j])).collect();
            let [j] = others[..] else {
                let found = format!("{with}, of which there are {} others", others.len());
                let allowed = "the name of one other [[known]], with its experiment if several have that \
                     name";
                return Err(Error::invalid(key("with"), found, allowed));
            };
            ensure((-1.0..=1.0).contains(value), key("value"), value, "-1 .. 1")?;
            if is_given[(i, j)] {
                let given = matrix[(i, j)];
                let found = format!("{value}, and {given} for the same pair");
                ensure(given == *value, key("value"), found, "one value")?;
            }
            (is_given[(i, j)], is_given[(j, i)]) = (true, true);
            (matrix[(i, j)], matrix[(j, i)]) = (*value, *value);
        }
    }
    if knowns.iter().all(|known| known.correlations.is_empty()) {
        return Ok(matrix);
    }
    // A matrix with a negative eigenvalue is no correlation matrix.
    let least = SymmetricEigen::new(matrix.clone()).eigenvalues.iter().copied().fold(0.0, f64::min);
    let found = "correlations that contradict each other";
    let allowed = "a correlation matrix without negative eigenvalues";
    ensure(least >= -ROUNDING * n as f64, "known", found, allowed)?;
    Ok(matrix)
}

/// A root `B` of the [correlation matrix](correlations) `B B'`, square and one row per input: the product of `B` with
/// independent standard normal numbers has these correlations. `B` is the eigenvectors times the roots of the
/// eigenvalues, negative ones as zero. Errors are those of [`correlations`].
pub(crate) fn correlation_root(knowns: &[Known]) -> Result<DMatrix<f64>, Error> {
    let correlations = correlations(knowns)?;
    if knowns.is_empty() {
        return Ok(correlations);
    }
    // The eigenvectors give a root also of a singular matrix, for which Cholesky's factorization fails.
    let axes = SymmetricEigen::new(correlations);
    let sizes = axes.eigenvalues.map(|value| value.max(0.0).sqrt());
    Ok(axes.eigenvectors * DMatrix::from_diagonal(&sizes))
}
