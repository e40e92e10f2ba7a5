//! Experiments whose residuals are an outlier among those of all experiments.
//!
//! One bad recording of many is no evidence against the setup that all of them share: scale, clock, origin, tracked
//! point. The unexplained part of a motion is the root mean square residual over the size of the motion.
//! [`UnexplainedParts::add`] collects it for every measurement, experiment by experiment, with its number of values and
//! whether its residuals are no noise. The part of an experiment is the root mean square of those of its measurements,
//! weighted by their numbers of values. An experiment is an outlier if any of its measurements is unexplained and its
//! part is above the median of all experiments. At least [`FEWEST`] experiments, fewer than half of them unexplained,
//! are required. [`UnexplainedParts::outlying`] returns the part of an outlier, and none for others. The warnings of
//! unexplained motion use it.

use crate::numerics::median;

/// Fewest experiments of which one can be an outlier: the median of two is no reference.
const FEWEST: usize = 3;

/// The unexplained part of the motion of an experiment.
#[derive(Clone, Debug)]
struct UnexplainedPart {
    /// Name of the experiment.
    experiment: String,
    /// Sum over the measurements of the squared unexplained part times the number of values.
    square: f64,
    /// Number of values.
    values: f64,
    /// Whether the residuals of any of its measurements are no noise.
    is_unexplained: bool,
}

/// The unexplained parts of all experiments.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnexplainedParts(Vec<UnexplainedPart>);

impl UnexplainedParts {
    /// Adds a measurement of `experiment` with this number of values. `relative` is the unexplained part of its motion,
    /// `is_unexplained` whether its residuals are no noise. Measurements of one experiment must follow each other.
    pub fn add(&mut self, experiment: &str, relative: f64, values: usize, is_unexplained: bool) {
        let values = values as f64;
        // Squares weighted by the number of values: the part of an experiment is a root mean square over them.
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

    /// Number of experiments with at least one added measurement.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Median of the unexplained parts of all experiments; 0 without any.
    pub fn median(&self) -> f64 {
        median(self.0.iter().map(UnexplainedPart::relative))
    }

    /// The unexplained part of an outlying experiment; none for others. At least [`FEWEST`] experiments, fewer than
    /// half of them unexplained, are required to compare with. The residuals of the experiment must be no noise, and
    /// its part must be above the median.
    pub fn outlying(&self, experiment: &str) -> Option<f64> {
        let unexplained = self.0.iter().filter(|part| part.is_unexplained).count();
        let own = self.0.iter().find(|part| part.experiment == experiment)?;
        // In the majority bad experiments are a fault of the common setup.
        let most_are_explained = self.count() >= FEWEST && 2 * unexplained < self.count();
        let stands_out = own.is_unexplained && own.relative() > self.median();
        (most_are_explained && stands_out).then(|| own.relative())
    }
}

impl UnexplainedPart {
    /// The unexplained part of the experiment: the root mean square, over all values of its measurements, of the
    /// residual over the size of the motion of its measurement.
    fn relative(&self) -> f64 {
        (self.square / self.values.max(1.0)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One measurement of ten values per experiment; parts above 0.1 are unexplained.
    fn parts(relative: &[f64]) -> UnexplainedParts {
        let mut parts = UnexplainedParts::default();
        for (k, relative) in relative.iter().enumerate() {
            parts.add(&k.to_string(), *relative, 10, *relative > 0.1);
        }
        parts
    }

    /// The median of 0.05, 0.06, 0.08 and 0.5 is 0.07.
    #[test]
    fn one_bad_experiment_of_four_stands_out() {
        let found = parts(&[0.05, 0.06, 0.5, 0.08]);
        assert_eq!(found.outlying("2"), Some(0.5));
        assert_eq!(found.outlying("1"), None);
        assert!((found.median() - 0.07).abs() < 1e-12);
    }

    #[test]
    fn no_experiment_stands_out_where_half_are_bad_or_two_are_there() {
        // Half of four are bad; two alone; and three that differ by a factor below two.
        assert_eq!(parts(&[0.05, 0.5, 0.6, 0.08]).outlying("2"), None);
        assert_eq!(parts(&[0.01, 0.5]).outlying("1"), None);
        assert_eq!(parts(&[0.05, 0.06, 0.09]).outlying("2"), None);
    }

    /// 10 of 40 values with 0.4 and the others with none: the root of 0.4^2/4.
    #[test]
    fn measurements_of_one_experiment_are_averaged_by_their_values() {
        let mut parts = parts(&[0.05, 0.06]);
        parts.add("2", 0.0, 30, false);
        parts.add("2", 0.4, 10, true);
        assert_eq!(parts.outlying("2"), Some(0.2));
    }
}
