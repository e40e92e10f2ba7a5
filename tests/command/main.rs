//! Tests of the command: outputs, exit codes and messages for valid and invalid input, and the HTML pages.

#[path = "../common/mod.rs"]
mod common;

mod campaign;
mod campaign_file;
mod campaign_guards;
mod contacts;
mod design;
#[cfg(unix)]
mod documents;
mod experiments;
mod explain;
mod export;
mod file_names;
mod first_use;
mod fit;
mod folder;
mod former_results;
mod hostile;
mod hostile_fits;
mod hostile_scenes;
mod inspect;
mod interrupt;
#[cfg(unix)]
mod layout;
mod motion;
mod output_places;
mod outputs;
mod page_structure;
mod plausibility;
mod predictions;
mod recorded_poses;
mod recorded_walls;
mod recordings;
mod refusals;
mod refused_options;
mod report;
mod results;
mod schema;
mod slurm;
mod study;
mod untrusted_files;
