//! A row of a campaign: a fit file with its changed keys, before random starts and bootstrap multiply it to tasks.
//!
//! [`CampaignRow`] has the path of the fit file, relative to the campaign's folder, its name (empty if none), and its
//! changes by table and grid. It also has its line in the campaign's CSV table, counted from 1 with the header; None
//! for fits found by patterns. `form` and `table` create rows, and `plan` makes tasks of them. [`CampaignRow::locate`]
//! converts an error of the fit to an error at its line of the table, with the changes in the message. It returns
//! errors of other rows unchanged.

use crate::campaign::changes::Changes;
use crate::error::Error;
use std::path::PathBuf;

/// A fit file with its changed keys, its name, and its line in the campaign's table.
#[derive(Clone, Default)]
pub(crate) struct CampaignRow {
    /// Path of the fit file, relative to the folder of the campaign.
    pub fit: PathBuf,
    pub name: String,
    pub changes: Changes,
    /// Where a table has the fit; `None` for fits that patterns match.
    pub source: Option<TableLine>,
}

/// A line of a campaign's CSV table, for messages.
#[derive(Clone)]
pub(crate) struct TableLine {
    pub file: PathBuf,
    /// Counted from 1, with the header.
    pub line: u64,
}

impl CampaignRow {
    /// An error of this fit as an error at its line of the table, with the changes in its message; unchanged for a fit
    /// that is not from a table.
    pub fn locate(&self, error: Error) -> Error {
        let Some(TableLine { file, line }) = &self.source else { return error };
        let changes: Vec<String> =
            self.changes.iter().map(|(key, value)| format!("{key} = {value}")).collect();
        let message = format!("with {}: {error}", changes.join(", "));
        Error::Data { path: file.clone(), line: *line, message }
    }
}
