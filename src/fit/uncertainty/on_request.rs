//! What an [`Analysis`](super::Analysis) asks for, added to the report of an optimum.

use crate::fit::Fit;
use crate::fit::report::FitReport;
use crate::fit::report::plot_data::Profile;
use crate::fit::search::Search;
use crate::fit::search::optimum::Optimum;
use crate::fit::uncertainty::analysis::Refinement;
use crate::fit::uncertainty::covariance::Local;
use crate::fit::uncertainty::noise::{Noise, scatter};
use crate::fit::uncertainty::verdict::{Doubts, Weight, percent};
use crate::fit::uncertainty::{bootstrap, discretization, profile};
use nalgebra::DMatrix;

/// Part of the residuals that mesh and step must leave to be blamed for them before the model.
const MESH_TO_BLAME: f64 = 0.5;

impl Fit {
    pub(crate) fn add_discretization(
        &self,
        search: &Search,
        optimum: &Optimum,
        (local, noise): (&Local, &Noise),
        report: &mut FitReport,
        doubts: &mut Doubts,
    ) {
        let how = self.analysis.discretization_error;
        if how == Refinement::None || !optimum.converged {
            return;
        }
        let mut weight = Weight::Numerics;
        match discretization::errors(search, optimum, (local, &noise.weights), how) {
            Ok((errors, left)) => {
                report.discretization_error = errors;
                if left > MESH_TO_BLAME && doubts.has_misfit() {
                    weight = Weight::Mesh;
                    doubts.add(
                        Weight::Mesh,
                        "a finer mesh or step changes the motion by as much as the model leaves of the \
                         data: refine segments or step before looking for what else is wrong",
                    );
                }
            }
            Err(error) => doubts.add(
                Weight::Numerics,
                format!("the discretisation error is unknown: a finer run failed ({error})"),
            ),
        }
        for (estimate, error) in report.parameters.iter().zip(&report.discretization_error) {
            if let (Some(value), Some(sd), Some(relative)) =
                (estimate.value, estimate.std_error, error.relative)
                && relative * value.abs() > 2.0 * noise.reach * sd
            {
                let name = estimate.name;
                let off = match name.is_positive() {
                    true => percent(relative),
                    false => format!("{:.1e} {}", relative * value.abs(), name.unit()),
                };
                let words = format!(
                    "{}: mesh and step may be {} off, more than the 95 % interval is wide; refine \
                     segments or step",
                    estimate.label(),
                    off.trim_end()
                );
                doubts.add(weight, words);
            }
        }
    }

    pub(crate) fn add_observed_information(
        &self,
        search: &Search,
        optimum: &Optimum,
        noise: &Noise,
        report: &mut FitReport,
        doubts: &mut Doubts,
    ) {
        if !self.analysis.observed_information {
            return;
        }
        let hessian = search.all_residuals().and_then(|r| r.hessian_at(&optimum.x));
        let hessian = match hessian {
            Ok(hessian) => hessian,
            Err(error) => {
                let words = format!("no observed information: its simulation failed ({error})");
                return doubts.add(Weight::Note, words);
            }
        };
        let n = self.unknowns.len();
        // Of what may be zero there is no logarithm to speak of.
        let known: Vec<usize> =
            (0..n).filter(|i| report.parameters[*i].upper95.is_none()).collect();
        let among = |m: &DMatrix<f64>| m.select_rows(&known).select_columns(&known);
        let hessian = among(&DMatrix::from_fn(n, n, |i, j| hessian[i][j]));
        let Some(factors) = hessian.cholesky() else {
            let words =
                "the Hessian of the misfit is not positive: this is not a minimum of its own";
            return doubts.add(Weight::Worthless, words);
        };
        let inverse = factors.inverse();
        // The gradient scatters with psi^2; under squares that is the variance times the Hessian.
        let robust = noise.weights.iter().any(|w| *w != 1.0);
        let covariance = match robust {
            false => noise.variance * inverse,
            true => {
                let scatter = among(&scatter(search, optimum));
                &inverse * scatter * &inverse
            }
        };
        for (place, i) in known.into_iter().enumerate() {
            let (sd, estimate) = (covariance[(place, place)].sqrt(), &mut report.parameters[i]);
            estimate.observed_std_error =
                estimate.value.map(|value| sd * self.unknowns[i].slope(value));
        }
    }

    pub(crate) fn add_profiles(
        &self,
        search: &Search,
        optimum: &Optimum,
        (local, noise): (&Local, &Noise),
        report: &mut FitReport,
        doubts: &mut Doubts,
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
                let words = format!(
                    "{unknown} = {:e} fits better: this is not the best minimum",
                    unknown.from_scale(x)
                );
                doubts.add(Weight::Worthless, words);
            }
        }
        profiles
    }

    pub(crate) fn add_bootstrap(
        &self,
        search: &Search,
        optimum: &Optimum,
        report: &mut FitReport,
        doubts: &mut Doubts,
    ) {
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
            let words = format!("{failed} of {count} bootstrap replicates did not converge");
            doubts.add(Weight::Note, words);
        }
    }
}
