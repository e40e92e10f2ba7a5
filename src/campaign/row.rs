//! A fit of a campaign with its changes, before its starts and bootstrap become tasks.

use crate::campaign::changes::Changes;
use crate::error::Error;
use std::path::PathBuf;

/// A fit with its changes.
#[derive(Clone, Default)]
pub(crate) struct CampaignRow {
    /// Path of the fit file, relative to the folder of the campaign.
    pub fit: PathBuf,
    pub name: String,
    pub changes: Changes,
    /// Where a table has the fit; none of fits that patterns match.
    pub source: Option<TableLine>,
}

/// A line of a table.
#[derive(Clone)]
pub(crate) struct TableLine {
    pub file: PathBuf,
    /// Counted from 1, with the header.
    pub line: u64,
}

impl CampaignRow {
    /// An error of this fit, with the line of the table and the changes in it.
    pub fn locate(&self, error: Error) -> Error {
        let Some(TableLine { file, line }) = &self.source else { return error };
        let changes: Vec<String> =
            self.changes.iter().map(|(key, value)| format!("{key} = {value}")).collect();
        let message = format!("with {}: {error}", changes.join(", "));
        Error::Data { path: file.clone(), line: *line, message }
    }
}
