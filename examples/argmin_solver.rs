//! The residuals of a fit in the solvers of the crate argmin: Brent's method and Nelder-Mead on the misfit, L-BFGS on its
//! gradient, and a trust region on its exact Hessian. Prints E of the cantilever and the number of iterations of each.
//!
//! These solvers converge to a minimum near their start; `Fit::solve` also searches for that start.
//! `cargo run --release --example argmin_solver`

use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::brent::BrentOpt;
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::neldermead::NelderMead;
use argmin::solver::quasinewton::LBFGS;
use argmin::solver::trustregion::{Steihaug, TrustRegion};
use rodfit::fit::Residuals;
use rodfit::{Fit, Observation, Parameter, Scene};

/// The cost of a single parameter as a number: `BrentOpt` requires a number, Nelder-Mead a vector.
struct Scalar(Residuals);

impl CostFunction for Scalar {
    type Param = f64;
    type Output = f64;
    fn cost(&self, x: &f64) -> Result<f64, Error> {
        self.0.cost(&vec![*x])
    }
}

fn main() -> Result<(), Error> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data");
    let problem = Scene::load(format!("{folder}/cantilever.toml"))?.problem()?;
    let fit = Fit::new(&problem)
        .observe(Observation::read(format!("{folder}/cantilever-tip.csv"))?)
        .identify(Parameter::YoungsModulus);

    // The solvers work on the logarithm of E.
    let brent = BrentOpt::new(5e7_f64.ln(), 2e8_f64.ln()).set_tolerance(1e-8, 1e-10);
    let result = Executor::new(Scalar(fit.residuals()?), brent)
        .configure(|state| state.max_iters(100))
        .run()?;
    let e = result.state().get_best_param().map_or(f64::NAN, |x| x.exp());
    println!("BrentOpt            E = {e:.6e} Pa, {} iterations", result.state().get_iter());

    let simplex = vec![vec![5e7_f64.ln()], vec![6e7_f64.ln()]];
    let nelder_mead = NelderMead::new(simplex).with_sd_tolerance(1e-12)?;
    let result = Executor::new(fit.residuals()?, nelder_mead)
        .configure(|state| state.max_iters(100))
        .run()?;
    let e = result.state().get_best_param().map_or(f64::NAN, |x| x[0].exp());
    println!("NelderMead          E = {e:.6e} Pa, {} iterations", result.state().get_iter());

    let line_search = MoreThuenteLineSearch::new();
    let lbfgs = LBFGS::new(line_search, 5).with_tolerance_grad(1e-8)?;
    let result = Executor::new(fit.residuals()?, lbfgs)
        .configure(|state| state.param(vec![7e7_f64.ln()]).max_iters(100))
        .run()?;
    let e = result.state().get_best_param().map_or(f64::NAN, |x| x[0].exp());
    println!("L-BFGS              E = {e:.6e} Pa, {} iterations", result.state().get_iter());

    // This solver never reports convergence; it stops after its iterations.
    let trust_region = TrustRegion::new(Steihaug::new().with_max_iters(10)).with_radius(0.1)?;
    let result = Executor::new(fit.residuals()?, trust_region)
        .configure(|state| state.param(vec![7e7_f64.ln()]).max_iters(12))
        .run()?;
    let e = result.state().get_best_param().map_or(f64::NAN, |x| x[0].exp());
    println!("TrustRegion         E = {e:.6e} Pa, {} iterations", result.state().get_iter());

    let report = fit.solve()?;
    let e = report.parameters[0].value.unwrap_or(f64::NAN);
    println!("Levenberg-Marquardt E = {e:.6e} Pa, {:.1} simulations", report.simulations);
    Ok(())
}
