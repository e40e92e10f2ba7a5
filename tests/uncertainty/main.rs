//! Reported errors are the errors made: intervals cover, and what is wrong does not look fine.

#[path = "../common/mod.rs"]
mod common;

mod doubts;
mod intervals;
mod outliers;
