//! `rodfit schema`
//!
//! The schemas are files, made from the types and their documentation by a test, which holds them to those: the program need
//! not know how they are made. What several of them define stands in a file of its own.

use crate::command::terminal;
use clap::ValueEnum;
use rodfit::Error;
use serde_json::Value;

/// Definitions that several schemas have: there they are `true`.
const SHARED: &str = include_str!("schema/shared.json");

#[derive(clap::Args)]
pub struct Options {
    /// Kind of the file or result.
    of: Of,
}

#[derive(Clone, Copy, ValueEnum)]
enum Of {
    /// Keys of a scene file (TOML).
    Scene,
    /// Keys of a fit file (TOML).
    Fit,
    /// Keys of a campaign file (TOML).
    Campaign,
    /// JSON of `rodfit fit`.
    Result,
    /// JSON of `rodfit simulate`.
    Simulation,
}

pub fn run(options: &Options) -> Result<u8, Error> {
    terminal::print(&options.of.text()).map(|()| 0)
}

impl Of {
    /// Its schema.
    fn text(self) -> String {
        let value = |text| serde_json::from_str::<Value>(text).expect("one of the names above");
        let (mut schema, mut shared) = (value(self.file()), value(SHARED));
        if let Some(Value::Object(own)) = schema.get_mut("definitions") {
            for (name, definition) in own.iter_mut().filter(|(_, own)| own.is_boolean()) {
                if let Some(known) = shared.get_mut(name) {
                    *definition = known.take();
                }
            }
        }
        format!("{schema:#}")
    }

    /// Its file.
    fn file(self) -> &'static str {
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
