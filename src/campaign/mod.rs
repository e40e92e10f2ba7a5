//! Many fits on many machines: planned once, run in shards that may be killed at any moment, and collected. On one
//! platform the collected bytes are the same however the tasks were distributed.
//!
//! A campaign file (`form`, with patterns, tables, grids and random starts) names fit files with changes of their keys
//! (`changes`, `resolved`). A [`Plan`] is the list of its [`CampaignTask`]s. The id of a task is a hash of the
//! program's version, the fit with its changes, its scenes and the contents of its data. It does not depend on their
//! place, so that a task with a result is not computed again. [`run`](Plan::run) solves tasks (`outcome`) and appends
//! results to a [`Store`], a line of JSON each, by any number of processes, each for a [`Shard`] or for all tasks.
//! [`Collected`] merges the results of all of them, to a [`Status`], lines of JSON, a CSV table (`csv_table`), and
//! summaries for a comparison page. Results of one task that differ are an error.

mod changes;
mod collect;
mod csv_table;
mod fit_pattern;
mod form;
mod former_results;
mod hash;
mod outcome;
mod plan;
mod platform;
mod resolved;
mod row;
mod run;
mod shard;
mod starts;
mod status;
mod store;
mod summaries;
mod table;

pub use changes::Changes;
pub use collect::{Collected, Damage};
pub use outcome::Outcome;
pub use plan::{Admission, CampaignTask, Plan, Planned};
pub use platform::platform;
pub use run::{ChangedTask, RunOptions, RunSummary, useful_threads};
pub use shard::Shard;
pub use status::Status;
pub use store::{RecordContext, Store};

#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to CampaignTask")]
pub use plan::CampaignTask as Task;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to RunOptions")]
pub use run::RunOptions as Way;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to RunSummary")]
pub use run::RunSummary as Ran;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to RecordContext")]
pub use store::RecordContext as About;
