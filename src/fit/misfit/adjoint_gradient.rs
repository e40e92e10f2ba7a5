//! Gradient of half the sum of the losses of one experiment by all its unknowns, by the adjoint of its motion.
//!
//! The motion is run once forward. The derivative of the misfit by every recorded position is the source term of the
//! adjoint (reverse) equations. They yield the derivatives by all parameters of the motion. Parameters of camera,
//! supports and arc lengths also act on the observations at a fixed motion; this part is added by dual numbers. A
//! gradient then costs about 2.5 runs for any number of unknowns (Cao, Li, Petzold and Serban 2003), while the cost of
//! forward sensitivities grows with every unknown. So it is used above [`MOST_FORWARD_UNKNOWNS`] unknowns, only if all
//! experiments allow it: with recorded motions of the centerline of one rod as the only measurements, and where reverse
//! equations exist. `has_adjoint_gradient` returns whether this experiment does. Output of `adjoint_gradient`:
//! [`ExperimentGradient`] for argmin's gradient solvers: plain residuals in units of sigma, whether time steps were
//! halved, and the gradient on the scales of all unknowns of the fit (zero for those of other experiments). The search
//! itself uses Jacobians.

use crate::dynamics::AdjointRun;
use crate::error::Error;
use crate::fit::measurement::MeasuredData;
use crate::fit::measurement::simulated::SimulatedOutput;
use crate::fit::misfit::camera::View;
use crate::fit::misfit::observation_row::{ObservationRow, affects_observation_operator};
use crate::fit::misfit::observed_experiment::{ObservedExperiment, has_halved_steps, nodes};
use crate::fit::unknown::ParameterPoint;
use num_dual::Dual64;

/// Number of unknowns above which the adjoint is used. It takes 2.4 to 2.7 times a run. Four forward derivatives of
/// every residual take 2.1 to 2.5 times a run, and each further one 0.2 to 0.3 more.
const MOST_FORWARD_UNKNOWNS: usize = 6;

/// Residuals of an experiment, and the gradient of its part of the misfit, at one point.
pub(super) struct ExperimentGradient {
    /// Plain residuals, in units of sigma.
    pub residuals: Vec<f64>,
    /// Derivatives by all unknowns of the fit, on their scales.
    pub gradient: Vec<f64>,
    /// Whether any time step was halved.
    pub halved: bool,
}

impl ObservedExperiment {
    /// Whether the adjoint computes the gradient of this experiment at less cost than forward sensitivities. This
    /// experiment must depend on more than [`MOST_FORWARD_UNKNOWNS`] unknowns, have only recorded motions of points of
    /// the centerline of one rod as measurements, and a motion for which reverse equations exist (`check_reversible`).
    pub fn has_adjoint_gradient(&self) -> bool {
        let are_motions =
            self.series.iter().all(|series| matches!(series.data, MeasuredData::PointMotion(_)));
        self.unknowns.len() > MOST_FORWARD_UNKNOWNS
            && are_motions
            && self.problem.scene().structure.is_none()
            && self.required.beside.is_empty()
            && self.problem.check_reversible().is_ok()
    }

    /// The residuals `(simulated - measured)/sigma` of this experiment, without loss and leverage weight, and the
    /// gradient of half the sum of its losses at `point`. The gradient is by all unknowns of the fit on their scales
    /// (zero for those of other experiments). `weights` has the leverage weight of every residual, a factor before the
    /// loss. `count` receives the work, steps times segments, before the run. An error if the motion cannot be
    /// simulated.
    pub(super) fn adjoint_gradient(
        &self,
        point: ParameterPoint,
        weights: &[f64],
        count: impl Fn(f64),
    ) -> Result<ExperimentGradient, Error> {
        let (problem, steps) = self.problem_and_steps(point)?;
        count((steps * problem.segments()) as f64);
        let run = AdjointRun::run(&problem, &nodes(&self.required.moving, &problem)?, steps)?;
        let record = run.trajectory().record();
        let view = View::new(&problem, |_, value| value);
        let (mut residuals, mut slopes) = (Vec::new(), run.slopes());
        // The derivative of the misfit by every residual is the source term of the adjoint equations.
        let mut by_residual = Vec::new();
        let mut weights = weights.iter();
        for series in &self.series {
            let MeasuredData::PointMotion(motion) = &series.data else { continue };
            let of_series = series.weights.iter().copied();
            for row in ObservationRow::from_samples(&view, motion.point, &motion.samples, of_series)
            {
                // Residuals are positions times a row: the derivative by the position is that row, in units of sigma.
                let residual = row.residual(&problem, record)?;
                let weight = weights.next().copied().unwrap_or(1.0);
                let [value, slope] = series.loss.robust(weight * residual);
                let by = value * slope * weight;
                slopes.add(row.point, row.time, row.axis.map(|a| a * by))?;
                residuals.push(residual);
                by_residual.push(by);
            }
        }
        let parameters = self.motion_parameters(point.unknowns);
        let by_motion = run.gradient(&parameters, &slopes)?;
        // The gradient by an unknown: the part through the motion, and the explicit part through the observation.
        let mut gradient = vec![0.0; point.unknowns.len()];
        for i in &self.unknowns {
            let unknown = &point.unknowns[*i];
            let parameter = unknown.parameter;
            let index = parameters.iter().position(|p| *p == parameter);
            let mut sum = index.map_or(0.0, |index| by_motion[index]);
            if affects_observation_operator(parameter) {
                // The explicit dependence of the observations on the parameter, at a fixed motion.
                let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == parameter)));
                let scene = problem.scene().over_parameters(seed);
                let simulated = SimulatedOutput {
                    moving: Some(record.along(None)),
                    resting: None,
                    frequencies: &[],
                    load_cases: &[],
                    critical_loads: &[],
                    view: &View::new(&problem, seed),
                    scene: &scene,
                    mesh: &scene.made_mesh(),
                    reference_strains: None,
                    structure: None,
                };
                let mut by_residual = by_residual.iter();
                self.for_each_residual(&simulated, |r: Dual64, _| {
                    sum += by_residual.next().map_or(0.0, |by| by * r.eps);
                })?;
            }
            // From the parameter in its unit to its scale of the fit.
            gradient[*i] = sum * unknown.slope(unknown.from_scale(point.x[*i]));
        }
        Ok(ExperimentGradient { residuals, gradient, halved: has_halved_steps(run.trajectory()) })
    }
}
