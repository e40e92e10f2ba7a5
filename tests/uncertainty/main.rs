//! Reported errors are the errors made: intervals cover, and what is wrong does not look fine.

#[path = "../common/mod.rs"]
mod common;

mod across;
mod adequacy;
mod bounds;
mod budget;
mod chosen;
mod design;
mod determined_groups;
mod input_sensitivities;
mod intervals;
mod noise;
mod outliers;
mod outlying_experiments;
mod score;
mod sensitivity_growth;
mod validity;
mod warnings;
