//! `rodfit schema`
//!
//! The schemas are files, made from the types and their documentation by a test, which holds them to those: the program need
//! not know how they are made.

use crate::command::terminal;
use clap::ValueEnum;
use rodfit::Error;

#[derive(clap::Args)]
pub struct Options {
    /// Of what.
    of: Of,
}

#[derive(Clone, Copy, ValueEnum)]
enum Of {
    /// What a scene file may say (TOML).
    Scene,
    /// What a fit file may say (TOML).
    Fit,
    /// What a campaign file may say (TOML).
    Campaign,
    /// The JSON of `rodfit fit`.
    Result,
    /// The JSON of `rodfit simulate`.
    Simulation,
}

pub fn run(options: &Options) -> Result<u8, Error> {
    terminal::print(&options.of.text().trim_end()).map(|()| 0)
}

impl Of {
    /// Its schema.
    fn text(self) -> &'static str {
        match self {
            Self::Scene => include_str!("schema/scene.json"),
            Self::Fit => include_str!("schema/fit.json"),
            Self::Campaign => include_str!("schema/campaign.json"),
            Self::Result => include_str!("schema/result.json"),
            Self::Simulation => include_str!("schema/simulation.json"),
        }
    }
}

#[cfg(test)]
#[path = "schema/made.rs"]
mod made;
