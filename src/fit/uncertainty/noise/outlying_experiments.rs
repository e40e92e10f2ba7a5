//! Experiments that the model explains much worse than most.
//!
//! One bad recording of many does not speak against the set-up that all of them share: scale, clock, origin, followed point. So
//! the unexplained part of the motion is compared with its median over the experiments.

use crate::numerics::total_order;
/// Fewest experiments of which one can stand out.
const FEWEST: usize = 3;

/// The part of an experiment that the model leaves unexplained.
#[derive(Clone, Debug)]
pub(crate) struct UnexplainedPart {
    pub experiment: String,
    /// Sum of the squared residuals over that of the squared motions, by the values of each measurement.
    square: f64,
    values: f64,
    /// Whether any of its measurements is not explained.
    pub is_unexplained: bool,
}

/// The unexplained parts of all experiments.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnexplainedParts(Vec<UnexplainedPart>);

impl UnexplainedParts {
    /// Adds a measurement with so many values, of whose motion the part `relative` is unexplained.
    pub fn add(&mut self, experiment: &str, relative: f64, values: usize, is_unexplained: bool) {
        let values = values as f64;
        let square = values * relative * relative;
        match self.0.last_mut().filter(|last| last.experiment == experiment) {
            Some(last) => {
                last.square += square;
                last.values += values;
                last.is_unexplained |= is_unexplained;
            }
            None => {
                let experiment = experiment.into();
                self.0.push(UnexplainedPart { experiment, square, values, is_unexplained });
            }
        }
    }

    /// Number of experiments.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Median of the unexplained parts.
    pub fn median(&self) -> f64 {
        let mut parts: Vec<f64> = self.0.iter().map(UnexplainedPart::relative).collect();
        parts.sort_by_cached_key(|x| total_order(*x));
        match parts.len() {
            0 => 0.0,
            n => 0.5 * (parts[(n - 1) / 2] + parts[n / 2]),
        }
    }

    /// The part of an experiment, if it stands out: where most experiments are explained, and this one is not, and leaves
    /// more than the median.
    pub fn outlying(&self, experiment: &str) -> Option<f64> {
        let unexplained = self.0.iter().filter(|part| part.is_unexplained).count();
        let own = self.0.iter().find(|part| part.experiment == experiment)?;
        let most_are_explained = self.count() >= FEWEST && 2 * unexplained < self.count();
        let stands_out = own.is_unexplained && own.relative() > self.median();
        (most_are_explained && stands_out).then(|| own.relative())
    }
}

impl UnexplainedPart {
    fn relative(&self) -> f64 {
        (self.square / self.values.max(1.0)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(relative: &[f64]) -> UnexplainedParts {
        let mut parts = UnexplainedParts::default();
        for (k, relative) in relative.iter().enumerate() {
            parts.add(&k.to_string(), *relative, 10, *relative > 0.1);
        }
        parts
    }

    #[test]
    fn one_bad_experiment_of_many_stands_out() {
        let found = parts(&[0.05, 0.06, 0.5, 0.08]);
        assert_eq!(found.outlying("2"), Some(0.5));
        assert_eq!(found.outlying("1"), None);
        assert!((found.median() - 0.07).abs() < 1e-12);
    }

    #[test]
    fn no_experiment_stands_out_where_half_are_bad_or_two_are_there() {
        assert_eq!(parts(&[0.05, 0.5, 0.6, 0.08]).outlying("2"), None);
        assert_eq!(parts(&[0.01, 0.5]).outlying("1"), None);
        assert_eq!(parts(&[0.05, 0.06, 0.09]).outlying("2"), None);
    }

    #[test]
    fn measurements_of_one_experiment_are_averaged_by_their_values() {
        let mut parts = parts(&[0.05, 0.06]);
        parts.add("2", 0.0, 30, false);
        parts.add("2", 0.4, 10, true);
        assert_eq!(parts.outlying("2"), Some(0.2));
    }
}
