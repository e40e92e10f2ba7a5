//! The gradient of the misfit by many unknowns at once, carried back over the motion.

use crate::dynamics::Reversible;
use crate::error::Error;
use crate::fit::measurement::MeasuredData;
use crate::fit::measurement::simulated::Simulated;
use crate::fit::misfit::camera::View;
use crate::fit::misfit::observation_row::{ObservationRow, affects_observation_operator};
use crate::fit::misfit::observed_experiment::{ObservedExperiment, in_halves, nodes};
use crate::fit::unknown::Unknown;
use num_dual::Dual64;

/// With more unknowns than this the gradient goes back over the run, for 2.4 to 2.7 times the time of a run: four derivatives
/// of every residual going along with it take 2.1 to 2.5 times, and every other 0.2 to 0.3 more.
const MANY: usize = 6;

impl ObservedExperiment {
    /// Whether its gradient goes back over its motion: many unknowns, a motion that can be gone back over, and
    /// nothing else that was measured than where points of the centre line were.
    pub fn goes_back(&self) -> bool {
        let centred =
            self.series.iter().all(|series| matches!(series.data, MeasuredData::PointMotion(_)));
        self.unknowns.len() > MANY
            && centred
            && self.required.beside.is_empty()
            && self.problem.check_reversible().is_ok()
    }

    /// Its plain residuals, the derivatives of its part of the misfit by all unknowns, and whether steps were taken in
    /// halves. `weights` has a factor on every residual. `count` receives the work.
    pub fn reverse_gradient(
        &self,
        (unknowns, x): (&[Unknown], &[f64]),
        weights: &[f64],
        count: impl Fn(f64),
    ) -> Result<(Vec<f64>, Vec<f64>, bool), Error> {
        let (problem, steps) = self.made((unknowns, x))?;
        count((steps * problem.segments()) as f64);
        let run = Reversible::run(&problem, &nodes(&self.required.moving, &problem)?, steps)?;
        let record = run.trajectory().record();
        let view = View::new(&problem, |_, value| value);
        let (mut residuals, mut slopes) = (Vec::new(), run.slopes());
        // What the misfit gains by every residual.
        let mut by_residual = Vec::new();
        let mut weights = weights.iter();
        for series in &self.series {
            let MeasuredData::PointMotion(motion) = &series.data else { continue };
            for seen in ObservationRow::of(
                &view,
                (motion.point, &motion.samples),
                series.weights.iter().copied(),
            ) {
                let residual = seen.residual(&problem, record)?;
                let weight = weights.next().copied().unwrap_or(1.0);
                let [value, slope] = series.loss.robust(weight * residual);
                let by = value * slope * weight;
                slopes.add(seen.point, seen.time, seen.axis.map(|a| a * by))?;
                residuals.push(residual);
                by_residual.push(by);
            }
        }
        let parameters = self.of_the_motion(unknowns);
        let by_motion = run.gradient(&parameters, &slopes)?;
        let mut gradient = vec![0.0; unknowns.len()];
        for i in &self.unknowns {
            let unknown = &unknowns[*i];
            let parameter = unknown.parameter;
            let place = parameters.iter().position(|p| *p == parameter);
            let mut sum = place.map_or(0.0, |place| by_motion[place]);
            if affects_observation_operator(parameter) {
                // What it makes of a motion that stays as it is.
                let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == parameter)));
                let scene = problem.scene().over_parameters(seed);
                let simulated = Simulated {
                    moving: Some(record.along(None)),
                    resting: None,
                    frequencies: &[],
                    view: &View::new(&problem, seed),
                    scene: &scene,
                    mesh: &scene.made_mesh(),
                };
                let mut by_residual = by_residual.iter();
                self.each_residual(&simulated, |r: Dual64, _| {
                    sum += by_residual.next().map_or(0.0, |by| by * r.eps);
                })?;
            }
            gradient[*i] = sum * unknown.slope(unknown.from_scale(x[*i]));
        }
        Ok((residuals, gradient, in_halves(run.trajectory())))
    }
}
