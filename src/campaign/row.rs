//! A fit of a campaign, before it is shared out.

use crate::campaign::changes::Changes;
use crate::error::Error;
use std::path::PathBuf;

/// A fit and what is changed of it, before it is shared out.
#[derive(Clone)]
pub(crate) struct Row {
    /// Relative to the folder of the campaign.
    pub fit: PathBuf,
    pub name: String,
    pub changes: Changes,
    /// The table and the line it stands in.
    pub from: Option<(PathBuf, u64)>,
}

impl Row {
    /// A fit as it stands.
    pub fn of(fit: PathBuf) -> Self {
        Self { fit, name: String::new(), changes: Changes::new(), from: None }
    }

    /// Says where an error comes from.
    pub fn located(&self, error: Error) -> Error {
        match &self.from {
            Some((path, line)) => {
                let said: Vec<String> =
                    self.changes.iter().map(|(key, value)| format!("{key} = {value}")).collect();
                let message = format!("with {}: {error}", said.join(", "));
                Error::Data { path: path.clone(), line: *line, message }
            }
            None => error,
        }
    }
}
