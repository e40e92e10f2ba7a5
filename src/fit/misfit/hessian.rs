//! The exact Hessian of the misfit by the unknowns: the observed information.
//!
//! Half the sum of squares of residuals `r_k` has the Hessian `J'J + sum_k r_k d2r_k`, with the Jacobian `J` and the
//! second derivatives `d2r_k` of each residual. The expected information of the Gauss-Newton method is the first term
//! alone. The second term vanishes with the residuals, and on average over noise. Every pair of unknowns costs one
//! simulation in hyper-dual numbers (Fike and Alonso 2011) per experiment that depends on both, about the recorded
//! simulation without derivatives at the same point. Robust losses, leverage weights (none of priors) and priors are
//! included. Output: a symmetric matrix on the unknowns' scales, in units of sigma, for standard errors with the exact
//! Hessian (`[analysis]`) and argmin's Newton solvers. A simulation that fails is an error; so are critical loads and
//! frequencies of structures, which have no second derivatives.

use crate::dynamics::Trajectory;
use crate::dynamics::record::Record;
use crate::error::Error;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::simulated::SimulatedOutput;
use crate::fit::misfit::camera::View;
use crate::fit::misfit::observed_experiment::{ExperimentRun, ObservedExperiment};
use crate::fit::misfit::residuals::Residuals;
use crate::scene::Parameter;
use crate::scene::number::Quantity;
use crate::structure::Structure;
use num_dual::HyperDual64;

impl Residuals {
    /// Second derivatives of half the sum of squares of the residuals at `x`, by the unknowns on their scales. Robust
    /// losses, leverage weights and priors are included. The matrix is symmetric and exact to rounding (hyper-dual
    /// numbers).
    ///
    /// # Errors
    ///
    /// Another count of numbers, a simulation that fails, and data without second derivatives: critical loads, and
    /// frequencies of structures.
    pub fn hessian_at(&self, x: &[f64]) -> Result<Vec<Vec<f64>>, Error> {
        self.check_length(x)?;
        let n = self.unknowns().len();
        let mut hessian = vec![vec![0.0; n]; n];
        let (runs, weights) = (self.runs(x, false)?, self.leverage_weights());
        for i in 0..n {
            // The matrix is symmetric: one run for each pair of unknowns.
            for j in 0..=i {
                let (mut sum, mut rest) = (0.0, &weights[..]);
                for (experiment, run) in self.experiments().iter().zip(&runs) {
                    let (own, others) = rest.split_at(experiment.counts().sum());
                    rest = others;
                    if experiment.depends_on(i) && experiment.depends_on(j) {
                        sum += self.second_derivative(x, experiment, run, own, [i, j])?;
                    }
                }
                // Each prior depends on one unknown only.
                let seeded = HyperDual64::new(x[i], 1.0, 1.0, 0.0);
                if let Some(r) = self.unknowns()[i].prior_residual(seeded).filter(|_| i == j) {
                    sum += r.eps1 * r.eps2 + r.re * r.eps1eps2;
                }
                (hessian[i][j], hessian[j][i]) = (sum, sum);
            }
        }
        Ok(hessian)
    }

    /// The second derivative, by the unknowns `i` and `j` on their scales, of half the sum of the losses of an
    /// experiment at `x`, by hyper-dual numbers about its `run` without derivatives there. `weights` are the leverage
    /// weights of its residuals. Error: a simulation that fails, critical loads, or frequencies of structures.
    fn second_derivative(
        &self,
        x: &[f64],
        experiment: &ObservedExperiment,
        run: &ExperimentRun,
        weights: &[f64],
        [i, j]: [usize; 2],
    ) -> Result<f64, Error> {
        let seed = |parameter: Parameter, value: f64| {
            let is_own =
                |u: &usize| experiment.depends_on(*u) && self.unknowns()[*u].parameter == parameter;
            // A parameter that is no unknown of this experiment is a constant.
            let Some(u) = (0..x.len()).find(is_own) else { return HyperDual64::from(value) };
            let along = |direction: usize| f64::from(u8::from(u == direction));
            self.unknowns()[u].value(HyperDual64::new(x[u], along(i), along(j), 0.0))
        };
        // The plain run determines the steps, halved ones included: the run over hyper-dual numbers repeats them.
        let ExperimentRun { problem, moving, resting, load_cases, structure } = run;
        if let Some(structure) = structure {
            return self.second_derivative_of_structure(experiment, run, structure, weights, seed);
        }
        if experiment.has_critical_loads() {
            return Err(Error::Fit("critical loads have no second derivatives".into()));
        }
        let over = |plain: &Option<Trajectory>| plain.as_ref().map(|t| t.over(seed)).transpose();
        let (moving, resting) = (over(moving)?, over(resting)?);
        let load_cases: Vec<Trajectory<HyperDual64>> =
            load_cases.iter().map(|own| own.over(seed)).collect::<Result<_, Error>>()?;
        // Frequencies have no recorded base: they are solved anew over hyper-dual numbers.
        let frequencies = match experiment.modes() {
            [] => Vec::new(),
            modes => problem.natural_frequencies_over(modes, seed)?,
        };
        let scene = problem.scene().over_parameters(seed);
        let reference_strains = experiment.reference_strains(problem, seed);
        let simulated = SimulatedOutput {
            moving: moving.as_ref().map(|motion| motion.record().read()),
            resting: resting.as_ref().map(|rest| rest.record().read()),
            frequencies: &frequencies,
            load_cases: &load_cases.iter().map(|own| own.record().read()).collect::<Vec<_>>(),
            critical_loads: &[],
            view: &View::new(problem, seed),
            scene: &scene,
            mesh: &scene.made_mesh(),
            reference_strains: reference_strains.as_ref(),
            structure: None,
        };
        second_derivative_of_loss(experiment, &simulated, weights)
    }
}

impl Residuals {
    /// The second derivative of half the sum of the losses of an experiment with a `structure`, from runs over
    /// hyper-dual numbers whose parts `seed` returns. `weights` are the leverage weights of its residuals. Frequencies
    /// are an error.
    fn second_derivative_of_structure(
        &self,
        experiment: &ObservedExperiment,
        run: &ExperimentRun,
        structure: &Structure,
        weights: &[f64],
        seed: impl Fn(Parameter, f64) -> HyperDual64,
    ) -> Result<f64, Error> {
        if !experiment.modes().is_empty() {
            return Err(Error::Fit("frequencies of structures have no second derivatives".into()));
        }
        let of_path = |path: &str, value: f64, _: Quantity| seed(Parameter::at(path), value);
        let [moving, resting] = run.structure_over(structure, of_path)?;
        let nodes = structure.nodes_over(of_path)?;
        let scene = run.problem.scene().over_parameters(&seed);
        let simulated = SimulatedOutput {
            moving: moving.as_ref().map(Record::read),
            resting: resting.as_ref().map(Record::read),
            frequencies: &[],
            load_cases: &[],
            critical_loads: &[],
            view: &View::new(&run.problem, &seed),
            scene: &scene,
            mesh: &scene.made_mesh(),
            reference_strains: None,
            structure: Some(&nodes),
        };
        second_derivative_of_loss(experiment, &simulated, weights)
    }
}

impl argmin::core::Hessian for Residuals {
    type Param = Vec<f64>;
    type Hessian = Vec<Vec<f64>>;
    /// The Hessian of half the sum of squares at `x`, a symmetric matrix by the unknowns on their scales, exact by
    /// hyper-dual numbers, for argmin's solvers. Error: a simulation fails.
    fn hessian(&self, x: &Vec<f64>) -> Result<Vec<Vec<f64>>, argmin::core::Error> {
        Ok(self.hessian_at(x)?)
    }
}

/// The mixed second derivative of half the sum of the losses of an experiment, from its `simulated` output over
/// hyper-dual numbers. For each residual times its leverage weight it adds `rho''/2` times the product of its slopes,
/// plus `rho'/2` times its second derivative. Errors are those of the residuals.
fn second_derivative_of_loss(
    experiment: &ObservedExperiment,
    simulated: &SimulatedOutput<HyperDual64>,
    weights: &[f64],
) -> Result<f64, Error> {
    let (mut sum, mut weights) = (0.0, weights.iter());
    experiment.for_each_residual(simulated, |r: HyperDual64, loss: Loss| {
        let r = r * weights.next().copied().unwrap_or(1.0);
        // d2(rho/2) = psi' dr_i dr_j + psi d2r_ij.
        let [psi, slope] = loss.influence(r.re);
        sum += slope * r.eps1 * r.eps2 + psi * r.eps1eps2;
    })?;
    Ok(sum)
}
