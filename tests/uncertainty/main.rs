//! Tests of the reported uncertainty: coverage of intervals, budgets against closed forms, and grades of wrong models.

#[path = "../common/mod.rs"]
mod common;

mod adequacy;
mod bounds;
mod budget;
mod chosen_numerics;
mod cluster_jackknife;
mod design;
mod determined_groups;
mod dragged_strip;
mod input_sensitivities;
mod intervals;
mod noise;
mod noise_comparison;
mod outliers;
mod outlying_experiments;
#[cfg(feature = "posterior")]
mod posterior;
mod score;
mod sensitivity_growth;
mod validity;
mod warnings;
