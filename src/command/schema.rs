//! `rodfit schema`: prints the JSON schema of an input file (TOML) or of a result (JSON).
//!
//! Input is the kind: a scene, structure, fit or campaign file, or the result of `fit` (also with `[[field]]`),
//! `simulate`, `static`, `modes` (these three also of a structure), `study`, `predict` or `design`. The schemas are
//! files of the repository, compiled into the program. A test (`generate`) generates them from the types and their
//! documentation, and compares the files with them. Definitions that several schemas have are in one shared file,
//! with `true` in their places, and are put back when a schema is printed.

use crate::command::terminal;
use clap::ValueEnum;
use rodfit::Error;
use serde_json::Value;

/// Definitions that several schemas have; these have `true` in their place.
const SHARED: &str = include_str!("schema/shared.json");

/// Options of `rodfit schema`.
#[derive(clap::Args)]
pub struct SchemaOptions {
    /// Kind of the file or result.
    #[arg(value_name = "KIND")]
    of: SchemaKind,
}

/// A kind of file or result with a schema.
#[derive(Clone, Copy, ValueEnum)]
enum SchemaKind {
    /// Keys of a scene file (TOML).
    Scene,
    /// Keys of the scene file of a structure (TOML).
    Structure,
    /// Keys of a fit file (TOML).
    Fit,
    /// Keys of a campaign file (TOML).
    Campaign,
    /// JSON of `rodfit fit`.
    Result,
    /// JSON of `rodfit fit` with `[[field]]`.
    FieldResult,
    /// JSON of `rodfit simulate`.
    Simulation,
    /// JSON of `rodfit static`.
    Static,
    /// JSON of `rodfit modes`.
    Modes,
    /// JSON of `rodfit simulate` of a structure.
    StructureSimulation,
    /// JSON of `rodfit static` of a structure.
    StructureStatic,
    /// JSON of `rodfit modes` of a structure.
    StructureModes,
    /// JSON of `rodfit study`.
    Study,
    /// JSON of `rodfit predict`.
    Predict,
    /// JSON of `rodfit design`.
    Design,
}

/// Prints the schema of the given kind as JSON. Returns exit code 0. Error: standard output cannot be written.
pub fn run(options: &SchemaOptions) -> Result<u8, Error> {
    terminal::print(&options.of.text()).map(|()| 0)
}

impl SchemaKind {
    /// The schema as indented JSON text, with the shared definitions in the places of their placeholders `true`.
    fn text(self) -> String {
        let value =
            |text| serde_json::from_str::<Value>(text).expect("a schema of the repository is JSON");
        let (mut schema, mut shared) = (value(self.file()), value(SHARED));
        if let Some(Value::Object(own)) = schema.get_mut("definitions") {
            // Shared definitions are stored once; here they replace their placeholders.
            for (name, definition) in own.iter_mut().filter(|(_, own)| own.is_boolean()) {
                if let Some(known) = shared.get_mut(name) {
                    *definition = known.take();
                }
            }
        }
        format!("{schema:#}")
    }

    /// The stored text (JSON) of the schema, without the shared definitions.
    fn file(self) -> &'static str {
        match self {
            Self::Scene => include_str!("schema/scene.json"),
            Self::Structure => include_str!("schema/structure.json"),
            Self::StructureSimulation => include_str!("schema/structure-simulation.json"),
            Self::StructureStatic => include_str!("schema/structure-static.json"),
            Self::StructureModes => include_str!("schema/structure-modes.json"),
            Self::Fit => include_str!("schema/fit.json"),
            Self::Campaign => include_str!("schema/campaign.json"),
            Self::Result => include_str!("schema/result.json"),
            Self::FieldResult => include_str!("schema/field-result.json"),
            Self::Simulation => include_str!("schema/simulation.json"),
            Self::Static => include_str!("schema/static.json"),
            Self::Modes => include_str!("schema/modes.json"),
            Self::Study => include_str!("schema/study.json"),
            Self::Predict => include_str!("schema/predict.json"),
            Self::Design => include_str!("schema/design.json"),
        }
    }
}

#[cfg(test)]
#[path = "schema/generate.rs"]
mod generate;
