//! The search for the most probable numbers, by products with the Jacobian.

use crate::dynamics::{Reversible, Slopes};
use crate::error::Error;
use crate::fit::field::plan::FieldFit;
use crate::fit::field::report::{FieldReport, Found};
use crate::fit::field::space::Space;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::motion::Observation;
use crate::fit::misfit::camera::View;
use crate::fit::misfit::observation_row::ObservationRow;
use crate::fit::report::plot_data::Series;
use crate::fit::report::replay::compared;
use crate::numerics::half_sum_of_squares;
use crate::numerics::lanczos::{Lanczos, RitzPair};
use crate::problem::Problem;
use std::time::Instant;

/// Steps of the search at most.
const STEPS: usize = 40;
/// Products for a step, and for the standard errors.
const PRODUCTS: [usize; 2] = [40, 120];
/// How much of a step may be missing, both in standard errors. What is left of its equations is no less than that.
const LEFT: f64 = 0.1;
/// The search ends where a step gains less of the misfit: no combination moves by more than a twentieth of a standard error.
const GAIN: f64 = 1e-3;
/// Directions in which the data say less than this part of what the prior does are left out of standard errors, which
/// are then too large by up to half of it.
const LITTLE: f64 = 0.05;

impl FieldFit {
    /// Finds the most probable numbers and their standard errors.
    ///
    /// # Errors
    /// A fit that is not one of these: [`Error::Invalid`] says which key. Those of [`Reversible::run`] at the start.
    pub fn solve(&self) -> Result<FieldReport, Error> {
        let since = Instant::now();
        self.check()?;
        let space = Space::new(&self.problem, &self.fields, &self.unknowns)?;
        let problem = self.problem.with_generic_layout_for(space.decisive())?;
        let mut search = Search { fit: self, space: &space, problem, runs: 0.0 };
        let z = vec![0.0; space.len()];
        let start = search.at(&z)?;
        let (optimum, converged) = search.descend((z, start))?;
        search.report((optimum, converged), since)
    }
}

/// What a rod with some numbers does, and how that differs from what was measured.
struct Trial {
    run: Reversible,
    /// Over sigma.
    residuals: Vec<f64>,
    cost: f64,
}

/// A search for the optimum.
struct Search<'a> {
    fit: &'a FieldFit,
    space: &'a Space,
    problem: Problem,
    /// Work so far, in runs.
    runs: f64,
}

impl Search<'_> {
    /// All coordinates that were measured.
    fn seen(&self, problem: &Problem) -> Vec<ObservationRow> {
        let view = View::new(problem, |_, value| value);
        let all = self.fit.observations.iter().flat_map(|observation| {
            let measurement = Measurement::from(observation.clone());
            let sigmas = measurement.sigmas(measurement.sigma().unwrap_or(1.0));
            let weights = sigmas.into_iter().map(f64::recip);
            ObservationRow::of(&view, (observation.point, &observation.samples), weights)
        });
        all.collect()
    }

    /// What was measured and what the rod does, coordinate by coordinate.
    fn series(&self, trial: &Trial) -> Vec<Series> {
        let mut rest = &trial.residuals[..];
        let of = |observation: &Observation| {
            let measurement = Measurement::from(observation.clone());
            let (own, others) = rest.split_at(measurement.values());
            rest = others;
            let sigma = measurement.sigma().unwrap_or(1.0);
            compared(("", trial.run.problem()), &measurement, own, [sigma; 2])
        };
        self.fit.observations.iter().flat_map(of).collect()
    }

    /// What the rod does with the numbers at `z`.
    fn at(&mut self, z: &[f64]) -> Result<Trial, Error> {
        let problem = self.problem.with_fixed_layout(self.space.values(z))?;
        let seen = self.seen(&problem);
        let (time, mut tracked) = (problem.time()?, Vec::new());
        for observation in &self.fit.observations {
            tracked.extend(problem.nodes_around(observation.point)?);
        }
        let last = seen.iter().map(|seen| seen.time).fold(0.0, f64::max);
        let steps = ((last / time.step_size() - 1e-9).ceil().max(1.0) as usize).min(time.steps());
        self.runs += 1.0;
        let run = Reversible::run(&problem, &tracked, steps)?;
        let record = run.trajectory().record();
        let residuals = seen.iter().map(|seen| seen.residual(&problem, record));
        let residuals: Vec<f64> = residuals.collect::<Result<_, Error>>()?;
        let cost = half_sum_of_squares(&residuals) + half_sum_of_squares(z);
        Ok(Trial { run, residuals, cost })
    }

    /// `J v` at a trial.
    fn forth(&mut self, trial: &Trial, v: &[f64]) -> Result<Vec<f64>, Error> {
        self.runs += 1.0;
        let problem = trial.run.problem();
        let motions = trial.run.along(&self.space.direction(v))?;
        let record = trial.run.trajectory().record();
        let changes = self.seen(problem).into_iter().map(|seen| {
            let weights = record.read().weights(&problem.stencil(seen.point)?, seen.time)?;
            let change = |c: usize| -> f64 {
                let of = |(index, [place, velocity]): &(usize, [f64; 2])| {
                    let [x, v] = motions[*index];
                    place * x[c] + velocity * v[c]
                };
                weights.iter().map(of).sum()
            };
            Ok((0..3).map(|c| seen.axis[c] * change(c)).sum())
        });
        changes.collect()
    }

    /// `J' w` at a trial.
    fn back(&mut self, trial: &Trial, w: &[f64]) -> Result<Vec<f64>, Error> {
        self.runs += 1.0;
        let mut slopes: Slopes<'_> = trial.run.slopes();
        for (seen, w) in self.seen(trial.run.problem()).iter().zip(w) {
            slopes.add(seen.point, seen.time, seen.axis.map(|a| a * w))?;
        }
        let gradient = trial.run.gradient(self.space.parameters(), &slopes)?;
        Ok(self.space.gathered(&gradient))
    }

    /// Tells Lanczos's method what it asks for, up to so many products or until `done`.
    fn products(
        &mut self,
        trial: &Trial,
        lanczos: &mut Lanczos,
        most: usize,
        done: impl Fn(&Lanczos) -> bool,
    ) -> Result<(), Error> {
        while lanczos.count() < most && !done(lanczos) {
            let Some(next) = lanczos.next().map(<[f64]>::to_vec) else { break };
            let there = self.forth(trial, &next)?;
            lanczos.extend(self.back(trial, &there)?);
        }
        Ok(())
    }

    /// Goes down from a start; and whether it got to where no step gains anything.
    fn descend(
        &mut self,
        (mut z, mut trial): (Vec<f64>, Trial),
    ) -> Result<((Vec<f64>, Trial), bool), Error> {
        let mut damping = 0.0_f64;
        for _ in 0..STEPS {
            let mut down = self.back(&trial, &trial.residuals)?;
            down.iter_mut().zip(&z).for_each(|(down, z)| *down = -(*down + z));
            let length = (2.0 * half_sum_of_squares(&down)).sqrt();
            let mut lanczos = Lanczos::new(down.clone());
            let shift = 1.0 + damping;
            self.products(&trial, &mut lanczos, PRODUCTS[0], |known| {
                let (step, left) = known.solve(shift, length);
                let along: f64 = step.iter().zip(&down).map(|(s, d)| s * d).sum();
                known.count() > 0 && left < LEFT * along.max(2.0 * GAIN).sqrt()
            })?;
            loop {
                let (step, _) = lanczos.solve(1.0 + damping, length);
                // The model's decrease: what the step gains less what damping takes.
                let along: f64 = step.iter().zip(&down).map(|(s, d)| s * d).sum();
                let gain = 0.5 * along + damping * half_sum_of_squares(&step);
                let next: Vec<f64> = z.iter().zip(&step).map(|(z, s)| z + s).collect();
                let tried = match self.at(&next) {
                    Err(error) if error.is_input() => return Err(error),
                    Err(Error::Interrupted) => return Err(Error::Interrupted),
                    tried => tried.ok(),
                };
                let gained = tried.as_ref().map_or(f64::NEG_INFINITY, |t| trial.cost - t.cost);
                if let Some(tried) =
                    tried.filter(|_| gained > 1e-3 * gain || gained.abs() < GAIN && gain < GAIN)
                {
                    (z, trial) = (next, tried);
                    damping = if gained > 0.5 * gain { damping / 5.0 } else { damping };
                    damping = if damping < 1e-2 { 0.0 } else { damping };
                    if gain < GAIN && damping == 0.0 {
                        return Ok(((z, trial), true));
                    }
                    break;
                }
                damping = (4.0 * damping).max(1.0);
                if damping > 1e12 {
                    return Ok(((z, trial), false));
                }
            }
        }
        Ok(((z, trial), false))
    }

    /// What the optimum is worth.
    fn report(
        mut self,
        ((z, trial), converged): ((Vec<f64>, Trial), bool),
        since: Instant,
    ) -> Result<FieldReport, Error> {
        // A start that has a part of every direction.
        let start = (0..z.len()).map(|i| 1.0 + ((i * 7919 + 13) % 101) as f64 / 101.0).collect();
        let mut lanczos = Lanczos::new(start);
        self.products(&trial, &mut lanczos, PRODUCTS[1], |known| {
            known.count() >= 4 && known.count().is_multiple_of(4) && {
                let pairs = known.ritz_pairs();
                let open = |pair: &RitzPair| {
                    pair.value > LITTLE && pair.error > LITTLE * (1.0 + pair.value)
                };
                pairs.last().is_some_and(|pair| pair.value < LITTLE) && !pairs.iter().any(open)
            }
        })?;
        Ok(FieldReport::new(Found {
            fit: self.fit,
            space: self.space,
            z: &z,
            residuals: &trial.residuals,
            series: self.series(&trial),
            misfit: trial.cost,
            ritz: lanczos.ritz_pairs(),
            complete: lanczos.count() < PRODUCTS[1],
            converged,
            runs: self.runs,
            since,
        }))
    }
}
