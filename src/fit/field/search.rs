//! The search for the optimum of a fit along the rod: the Levenberg-Marquardt method with products with the Jacobian
//! instead of its rows.
//!
//! Unknowns are independent normal numbers `z`, which start from 0 (values of the scene, means of the priors). The cost
//! is half the sum of squares of residuals (in sigmas) and of `z`. A step `s` solves `(1 + damping + J'J) s =
//! -gradient` in the Krylov space of the gradient by Lanczos's method, with at most [`STEP_PRODUCTS`] products with
//! `J'J`, each of one forward derivative and one adjoint. The search converges when an accepted step predicts a
//! decrease of the cost below [`LEAST_GAIN`] and the damping is zero after it. It ends without convergence after
//! [`STEPS`] accepted steps, or if no step with a damping up to [`MAX_DAMPING`] is accepted. Eigenvectors of `J'J` at
//! the optimum, down to the eigenvalue [`LEAST_INFORMATION`], then yield the standard errors. Result: a
//! [`FieldReport`], without convergence too, with a warning. An unsupported fit, a failed run at the start, a failed
//! product with the Jacobian, values that the scene does not allow, and a stop are errors.

use crate::dynamics::{AdjointRun, TrajectorySlopes};
use crate::error::{Error, none_on_failure};
use crate::fit::field::plan::FieldFit;
use crate::fit::field::report::{FieldOptimum, FieldReport};
use crate::fit::field::space::FieldSpace;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::motion::Observation;
use crate::fit::misfit::camera::View;
use crate::fit::misfit::observation_row::ObservationRow;
use crate::fit::report::plot_data::Series;
use crate::fit::report::replay::measurement_series;
use crate::numerics::half_sum_of_squares;
use crate::numerics::lanczos::{Lanczos, RitzPair};
use crate::numerics::stopwatch::Stopwatch;
use crate::problem::Problem;

/// Largest number of steps of the search; after it the search has not converged.
const STEPS: usize = 40;
/// Largest number of products with `J'J` for a step. Larger: more accurate steps, each product at the cost of two runs
/// or less.
const STEP_PRODUCTS: usize = 40;
/// Largest number of products with `J'J` for the standard errors; where it is reached they are too large, with a
/// warning.
const ERROR_PRODUCTS: usize = 120;
/// Largest residual norm of the linear equations of a step, in standard errors: an upper bound of the error of the
/// step.
const STEP_ERROR: f64 = 0.1;
/// Smallest decrease of the misfit by a step: below it no combination moves by more than a twentieth of a standard
/// error.
const LEAST_GAIN: f64 = 1e-3;
/// Smallest fraction of the predicted decrease of the misfit that an accepted step achieves.
const LEAST_GAIN_RATIO: f64 = 1e-3;
/// Gain ratio above which the damping of the next step is lower.
const GOOD_GAIN_RATIO: f64 = 0.5;
/// Divisor of the damping after a good step. Larger: the damping vanishes sooner, and more steps are rejected.
const LESS_DAMPING: f64 = 5.0;
/// Factor on the damping after a rejected step.
const MORE_DAMPING: f64 = 4.0;
/// Smallest damping after a rejected step: as strong as the prior.
const FIRST_DAMPING: f64 = 1.0;
/// Damping below which it becomes zero: the prior, of strength one, dominates it.
const NEGLIGIBLE_DAMPING: f64 = 1e-2;
/// Largest damping: above it steps are too short to change the misfit.
const MAX_DAMPING: f64 = 1e12;
/// Smallest eigenvalue of `J'J` (information of the data over that of the prior) of the directions in the standard
/// errors. Left out directions make standard errors too large by a fraction of up to half of it.
const LEAST_INFORMATION: f64 = 0.05;
/// Number of products between two tests whether all directions for the standard errors are found.
const TEST_INTERVAL: usize = 4;

impl FieldFit {
    /// Finds the values with the largest posterior probability and their standard errors, from the values of the scene
    /// (single parameters: means of their priors). The minimum is the one of the basin of this start. The report is
    /// returned also without convergence, with a warning.
    ///
    /// # Errors
    /// A fit that this method does not support, as an [`Error::Invalid`] with the key; those of [`AdjointRun::run`] at
    /// the start; values that the scene does not allow; a stop; and a failed product with the Jacobian.
    pub fn solve(&self) -> Result<FieldReport, Error> {
        let since = Stopwatch::start();
        self.check()?;
        let space = FieldSpace::new(&self.problem, &self.fields, &self.unknowns)?;
        let problem = self.problem.with_generic_layout_for(space.layout_parameters())?;
        let mut search = FieldSearch { fit: self, space: &space, problem, runs: 0.0 };
        let start = search.simulate(vec![0.0; space.parameters().len()])?;
        let (optimum, converged) = search.descend(start)?;
        search.report(&optimum, converged, since)
    }
}

/// A simulation with its differences from the measurements.
struct FieldTrial {
    /// Independent numbers of variance one.
    z: Vec<f64>,
    /// The simulation, with its states for derivatives.
    run: AdjointRun,
    /// Residuals, in sigmas.
    residuals: Vec<f64>,
    /// Half the sum of squares of residuals and of `z`.
    cost: f64,
}

/// State of the search.
struct FieldSearch<'a> {
    fit: &'a FieldFit,
    space: &'a FieldSpace,
    /// The problem with a layout for all values of the unknowns.
    problem: Problem,
    /// Number of runs and of products with the Jacobian so far.
    runs: f64,
}

impl FieldSearch<'_> {
    /// One row per measured coordinate of all observations, in their order, for its residual: simulated less measured
    /// value over the standard deviation of the value. This is the sigma of the observation (1 without one) times the
    /// factor of the point or value. The simulated value is a linear function of the position of the point at the time
    /// of the sample, as the camera records it.
    fn observation_rows(&self, problem: &Problem) -> Vec<ObservationRow> {
        let view = View::new(problem, |_, value| value);
        let all = self.fit.observations.iter().flat_map(|observation| {
            let measurement = Measurement::from(observation.clone());
            let sigmas = measurement.sigmas(measurement.sigma().unwrap_or(1.0));
            let weights = sigmas.into_iter().map(f64::recip);
            ObservationRow::from_samples(&view, observation.point, &observation.samples, weights)
        });
        all.collect()
    }

    /// Measured and simulated values of all observations at a trial for plots, one series per observed coordinate;
    /// sigma is 1 for an observation without one.
    fn series(&self, trial: &FieldTrial) -> Vec<Series> {
        let mut rest = &trial.residuals[..];
        let own_series = |observation: &Observation| {
            let measurement = Measurement::from(observation.clone());
            let (own, others) = rest.split_at(measurement.values());
            rest = others;
            let sigma = measurement.sigma().unwrap_or(1.0);
            measurement_series(trial.run.problem(), &measurement, own, sigma, sigma)
        };
        self.fit.observations.iter().flat_map(own_series).collect()
    }

    /// Simulates the rod with the parameters at `z` from the start to the end of the step with the last sample, at
    /// least one step, and keeps its states for derivatives. The trial has the residuals of all measured coordinates,
    /// in sigmas, and the cost. The run counts as one. Error: values that the scene does not allow, or a simulation
    /// that fails.
    fn simulate(&mut self, z: Vec<f64>) -> Result<FieldTrial, Error> {
        // Same layout for all values, so that the residuals are smooth.
        let problem = self.problem.with_fixed_layout(self.space.values(&z))?;
        let rows = self.observation_rows(&problem);
        let (time, mut tracked) = (problem.time()?, Vec::new());
        for observation in &self.fit.observations {
            tracked.extend(problem.nodes_around(observation.point)?);
        }
        // The simulation ends with the last sample.
        let last = rows.iter().map(|row| row.time).fold(0.0, f64::max);
        let steps = ((last / time.step_size() - 1e-9).ceil().max(1.0) as usize).min(time.steps());
        self.runs += 1.0;
        let run = AdjointRun::run(&problem, &tracked, steps)?;
        let record = run.trajectory().record();
        let residuals = rows.iter().map(|row| row.residual(&problem, record));
        let residuals: Vec<f64> = residuals.collect::<Result<_, Error>>()?;
        let cost = half_sum_of_squares(&residuals) + half_sum_of_squares(&z);
        Ok(FieldTrial { z, run, residuals, cost })
    }

    /// The product `J v` at a trial: derivatives of the residuals along the direction `v` of the unknowns `z`, one
    /// number per measured coordinate, in sigmas. They are forward derivatives along the changes `C v` of the
    /// parameters. The product counts as a run. Error: the derivatives fail.
    fn multiply(&mut self, trial: &FieldTrial, v: &[f64]) -> Result<Vec<f64>, Error> {
        self.runs += 1.0;
        let problem = trial.run.problem();
        let motions = trial.run.along(&self.space.changes(v))?;
        let record = trial.run.trajectory().record();
        let changes = self.observation_rows(problem).into_iter().map(|row| {
            let weights = record.read().weights(&problem.stencil(row.point)?, row.time)?;
            // The position between steps is a Hermite polynomial of positions and velocities at their ends.
            let change = |c: usize| -> f64 {
                let part = |(index, [position, velocity]): &(usize, [f64; 2])| {
                    let [x, v] = motions[*index];
                    position * x[c] + velocity * v[c]
                };
                weights.iter().map(part).sum()
            };
            Ok((0..3).map(|c| row.axis[c] * change(c)).sum())
        });
        changes.collect()
    }

    /// The product `J' w` at a trial, one number per unknown of `z`, by the adjoint of the simulation: the gradient of
    /// `w . residuals`. `w` has a number per measured coordinate. The product counts as a run. Error: the adjoint
    /// fails.
    fn multiply_transposed(&mut self, trial: &FieldTrial, w: &[f64]) -> Result<Vec<f64>, Error> {
        self.runs += 1.0;
        let mut slopes: TrajectorySlopes<'_> = trial.run.slopes();
        for (row, w) in self.observation_rows(trial.run.problem()).iter().zip(w) {
            slopes.add(row.point, row.time, row.axis.map(|a| a * w))?;
        }
        let mut gradient = trial.run.gradient(self.space.parameters(), &slopes)?;
        self.space.multiply(&mut gradient);
        Ok(gradient)
    }

    /// Adds products with `J'J` at a trial to Lanczos's method, until `lanczos` has `most` products in total, `is_done`
    /// is true, or the Krylov space is complete. Error: a product fails.
    fn iterate_lanczos(
        &mut self,
        trial: &FieldTrial,
        lanczos: &mut Lanczos,
        most: usize,
        is_done: impl Fn(&Lanczos) -> bool,
    ) -> Result<(), Error> {
        while lanczos.count() < most && !is_done(lanczos) {
            let Some(next) = lanczos.next().map(<[f64]>::to_vec) else { break };
            let product = self.multiply(trial, &next)?;
            lanczos.extend(self.multiply_transposed(trial, &product)?);
        }
        Ok(())
    }

    /// Descends from a trial by Gauss-Newton steps, first without damping, at most [`STEPS`] accepted ones. A step is
    /// accepted if it lowers the cost by more than [`LEAST_GAIN_RATIO`] of the predicted decrease, or if both the
    /// predicted decrease and the magnitude of the change are below [`LEAST_GAIN`]. Otherwise, or if its simulation
    /// fails, the damping is multiplied by [`MORE_DAMPING`], to [`FIRST_DAMPING`] at least. After a gain above
    /// [`GOOD_GAIN_RATIO`] of the prediction it is divided by [`LESS_DAMPING`], and below [`NEGLIGIBLE_DAMPING`] it
    /// becomes zero. Returns the last accepted trial, and whether the search converged: an accepted step predicted less
    /// than [`LEAST_GAIN`], and the damping is zero after it. It ends without convergence after [`STEPS`], or above
    /// [`MAX_DAMPING`]. Error: a stop, a product with the Jacobian that fails, or values that the scene does not allow.
    fn descend(&mut self, mut trial: FieldTrial) -> Result<(FieldTrial, bool), Error> {
        let mut damping = 0.0_f64;
        for _ in 0..STEPS {
            // 1. The steepest descent, and the Krylov space that it generates.
            let mut down = self.multiply_transposed(&trial, &trial.residuals)?;
            down.iter_mut().zip(&trial.z).for_each(|(down, z)| *down = -(*down + z));
            let length = (2.0 * half_sum_of_squares(&down)).sqrt();
            let mut lanczos = Lanczos::new(down.clone());
            // The prior adds 1 to every eigenvalue of J'J. Damping raises this shift only, so that one Krylov space
            // serves the steps of all dampings.
            let shift = 1.0 + damping;
            self.iterate_lanczos(&trial, &mut lanczos, STEP_PRODUCTS, |known| {
                let (step, error) = known.solve(shift, length);
                // The root of `along` is about the length of the step in standard errors: the scale of the error.
                let along: f64 = step.iter().zip(&down).map(|(s, d)| s * d).sum();
                known.count() > 0 && error < STEP_ERROR * along.max(2.0 * LEAST_GAIN).sqrt()
            })?;
            // 2. Steps with increasing damping, until one lowers the misfit.
            loop {
                let (step, _) = lanczos.solve(1.0 + damping, length);
                // Decrease of the quadratic model without the damping.
                let along: f64 = step.iter().zip(&down).map(|(s, d)| s * d).sum();
                let predicted = 0.5 * along + damping * half_sum_of_squares(&step);
                let next = trial.z.iter().zip(&step).map(|(z, s)| z + s).collect();
                // A simulation that fails rejects the step, like one that raises the misfit. Invalid input is an
                // error of the fit.
                let tried = match self.simulate(next) {
                    Err(error) if error.is_input() => return Err(error),
                    tried => none_on_failure(tried)?,
                };
                let gain = tried.as_ref().map_or(f64::NEG_INFINITY, |t| trial.cost - t.cost);
                // At the minimum both changes are so small that their ratio has no meaning.
                let is_at_minimum = gain.abs() < LEAST_GAIN && predicted < LEAST_GAIN;
                let is_accepted = gain > LEAST_GAIN_RATIO * predicted || is_at_minimum;
                if let Some(tried) = tried.filter(|_| is_accepted) {
                    trial = tried;
                    let is_good = gain > GOOD_GAIN_RATIO * predicted;
                    damping = if is_good { damping / LESS_DAMPING } else { damping };
                    damping = if damping < NEGLIGIBLE_DAMPING { 0.0 } else { damping };
                    if predicted < LEAST_GAIN && damping == 0.0 {
                        return Ok((trial, true));
                    }
                    break;
                }
                damping = (MORE_DAMPING * damping).max(FIRST_DAMPING);
                if damping > MAX_DAMPING {
                    return Ok((trial, false));
                }
            }
        }
        Ok((trial, false))
    }

    /// The report of the trial at the optimum. Lanczos's method computes the eigenvectors of `J'J` for the standard
    /// errors. It ends when an eigenvalue below [`LEAST_INFORMATION`] appears and all larger ones are accurate, tested
    /// every [`TEST_INTERVAL`] products, or when all eigenvectors are found. With [`ERROR_PRODUCTS`] products it ends
    /// too, and the directions count as incomplete, which is a warning. Error: a product fails.
    fn report(
        mut self,
        trial: &FieldTrial,
        converged: bool,
        since: Stopwatch,
    ) -> Result<FieldReport, Error> {
        // A fixed start vector of irregular numbers between 1 and 2 has components along all eigenvectors.
        let n = trial.z.len();
        let start = (0..n).map(|i| 1.0 + ((i * 7919 + 13) % 101) as f64 / 101.0).collect();
        let mut lanczos = Lanczos::new(start);
        // All eigenvalues above the limit are found once a smaller one appears and the others are accurate.
        self.iterate_lanczos(trial, &mut lanczos, ERROR_PRODUCTS, |known| {
            known.count() > 0 && known.count().is_multiple_of(TEST_INTERVAL) && {
                let pairs = known.ritz_pairs();
                let is_inaccurate = |RitzPair { value, error, .. }: &RitzPair| {
                    *value > LEAST_INFORMATION && *error > LEAST_INFORMATION * (1.0 + value)
                };
                pairs.last().is_some_and(|least| least.value < LEAST_INFORMATION)
                    && !pairs.iter().any(is_inaccurate)
            }
        })?;
        Ok(FieldReport::new(FieldOptimum {
            fit: self.fit,
            space: self.space,
            z: &trial.z,
            residuals: &trial.residuals,
            series: self.series(trial),
            misfit: trial.cost,
            ritz: lanczos.ritz_pairs(),
            complete: lanczos.count() < ERROR_PRODUCTS,
            converged,
            runs: self.runs,
            since,
        }))
    }
}
