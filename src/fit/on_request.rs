//! What an [`Analysis`](super::Analysis) asks for, added to the report of an optimum.

use super::noise::{Noise, scatter};
use super::optimum::Optimum;
use super::search::Search;
use super::uncertainty::Local;
use super::{Fit, FitReport, Profile, Refinement, bootstrap, discretization, profile};
use nalgebra::DMatrix;

impl Fit {
    pub(super) fn add_discretization(
        &self,
        search: &Search,
        optimum: &Optimum,
        local: &Local,
        noise: &Noise,
        report: &mut FitReport,
    ) {
        let how = self.analysis.discretization_error;
        if how == Refinement::None || !optimum.converged {
            return;
        }
        match discretization::errors(search, optimum, (local, &noise.weights), how) {
            Ok(errors) => report.discretization_error = errors,
            Err(error) => report
                .warnings
                .push(format!("the discretisation error is unknown: a finer run failed ({error})")),
        }
        for (estimate, error) in report.parameters.iter().zip(&report.discretization_error) {
            if let (Some(value), Some(sd), Some(relative)) =
                (estimate.value, estimate.std_error, error.relative)
                && relative * value.abs() > 2.0 * noise.reach * sd
            {
                report.warnings.push(format!(
                    "{}: mesh and step may be {:.2} % off, more than the 95 % interval is wide; refine segments or step",
                    estimate.label(),
                    100.0 * relative
                ));
            }
        }
    }

    pub(super) fn add_observed_information(
        &self,
        search: &Search,
        optimum: &Optimum,
        noise: &Noise,
        report: &mut FitReport,
    ) {
        if !self.analysis.observed_information {
            return;
        }
        let hessian = search.all_residuals().and_then(|r| r.hessian_at(&optimum.x));
        let hessian = match hessian {
            Ok(hessian) => hessian,
            Err(error) => {
                let words = format!("no observed information: its simulation failed ({error})");
                return report.warnings.push(words);
            }
        };
        let n = self.unknowns.len();
        let Some(factors) = DMatrix::from_fn(n, n, |i, j| hessian[i][j]).cholesky() else {
            let words =
                "the Hessian of the misfit is not positive: this is not a minimum of its own";
            return report.warnings.push(words.into());
        };
        let inverse = factors.inverse();
        // The gradient scatters with psi^2; under squares that is the variance times the Hessian.
        let robust = noise.weights.iter().any(|w| *w != 1.0);
        let covariance = match robust {
            false => noise.variance * inverse,
            true => {
                let scatter = scatter(search, optimum);
                &inverse * scatter * &inverse
            }
        };
        for (i, estimate) in report.parameters.iter_mut().enumerate() {
            let sd = covariance[(i, i)].sqrt();
            estimate.observed_std_error =
                estimate.value.map(|value| sd * self.unknowns[i].slope(value));
        }
    }

    pub(super) fn add_profiles(
        &self,
        search: &Search,
        optimum: &Optimum,
        (local, noise): (&Local, &Noise),
        report: &mut FitReport,
    ) -> Vec<Profile> {
        let mut profiles = Vec::new();
        if !self.analysis.profile {
            return profiles;
        }
        for (i, unknown) in self.unknowns.iter().enumerate() {
            let Some(sd) = local.deviation[i].filter(|sd| *sd > 0.0) else { continue };
            let found = profile::interval(search, optimum, i, (sd, noise.rise.sqrt(), noise.reach));
            if search.is_stopped() {
                // Half a profile says nothing about its ends.
                break;
            }
            report.parameters[i].profile95 = Some(found.values(unknown));
            profiles.push(found.profile(unknown, noise.reach));
            if let Some(x) = found.better {
                report.warnings.push(format!(
                    "{unknown} = {:e} fits better: this is not the best minimum",
                    unknown.from_scale(x)
                ));
            }
        }
        profiles
    }

    pub(super) fn add_bootstrap(&self, search: &Search, optimum: &Optimum, report: &mut FitReport) {
        let count = self.analysis.bootstrap;
        if count == 0 {
            return;
        }
        let plan = (count, self.analysis.seed);
        let (spreads, failed) = bootstrap::spread(search, optimum, &report.sigma, plan);
        if search.is_stopped() {
            // Those that were done in time are no fair sample.
            return;
        }
        for (estimate, spread) in report.parameters.iter_mut().zip(spreads) {
            estimate.bootstrap = spread;
        }
        if failed > 0 {
            report
                .warnings
                .push(format!("{failed} of {count} bootstrap replicates did not converge"));
        }
    }
}
