//! Width and color of printed text, by the stream and the environment.
//!
//! Input is the [`Stream`] (standard output or error), its number of columns, and the variables `NO_COLOR`,
//! `CLICOLOR_FORCE` and `TERM`. Output is a [`TextStyle`]: the width for wrapping, columns, and whether the text is
//! colored. The width is that of the terminal, cut to the range from [`DEFAULT_WIDTH`] to `MAX_WIDTH`. Without a
//! terminal it is [`DEFAULT_WIDTH`], for standard error without limit, so that messages are not wrapped. Text is
//! colored on a terminal, unless `TERM` is `dumb`, or anywhere if `CLICOLOR_FORCE` is set and not 0; never if
//! `NO_COLOR` is set. Empty variables count as not set.

use console::Term;
use rodfit::summary::{DEFAULT_WIDTH, TextStyle};
use std::io::IsTerminal;

/// Columns of the longest line: longer ones are hard to read.
const MAX_WIDTH: usize = 120;

/// A stream for printed text.
#[derive(Clone, Copy)]
pub enum Stream {
    /// Standard output.
    Output,
    /// Standard error.
    Error,
}

impl Stream {
    /// Width and color of a text on this stream, by its terminal and the environment. On standard error that is no
    /// terminal the width has no limit: messages that other programs read have one line each.
    pub fn style(self) -> TextStyle {
        let (is_terminal, terminal) = match self {
            Self::Output => (std::io::stdout().is_terminal(), Term::stdout()),
            Self::Error => (std::io::stderr().is_terminal(), Term::stderr()),
        };
        let columns = terminal.size_checked().filter(|_| is_terminal).map(|(_, columns)| columns);
        let style = style(is_terminal, columns, |name| std::env::var(name).ok());
        match self {
            Self::Error if !is_terminal => TextStyle { width: usize::MAX, ..style },
            _ => style,
        }
    }
}

/// The style of a text on a stream with this number of `columns` (`None`: [`DEFAULT_WIDTH`]), cut to the range from
/// [`DEFAULT_WIDTH`] to [`MAX_WIDTH`]. Color: on a terminal unless `TERM` is `dumb`, or anywhere if `CLICOLOR_FORCE` is
/// set and not 0; never if `NO_COLOR` is set (<https://no-color.org>). Empty variables count as not set. `variable`
/// returns the value of an environment variable, `None` if it is not set.
fn style(
    is_terminal: bool,
    columns: Option<u16>,
    variable: impl Fn(&str) -> Option<String>,
) -> TextStyle {
    let is_set = |name: &str| variable(name).is_some_and(|value| !value.is_empty());
    let is_forced = variable("CLICOLOR_FORCE").is_some_and(|value| !["", "0"].contains(&&*value));
    let is_dumb = variable("TERM").is_some_and(|value| value == "dumb");
    TextStyle {
        width: columns.map_or(DEFAULT_WIDTH, usize::from).clamp(DEFAULT_WIDTH, MAX_WIDTH),
        is_colored: !is_set("NO_COLOR") && (is_forced || is_terminal && !is_dumb),
    }
}

#[cfg(test)]
mod tests {
    use crate::command::style::style;

    /// Whether output is colored, at a terminal or not, with these environment variables (name and value).
    fn is_colored(is_terminal: bool, set: &[[&str; 2]]) -> bool {
        let value =
            |name: &str| set.iter().find(|[own, _]| *own == name).map(|[_, v]| v.to_string());
        style(is_terminal, None, value).is_colored
    }

    #[test]
    fn terminals_are_colored_unless_no_color_is_set() {
        assert!(is_colored(true, &[]) && is_colored(true, &[["NO_COLOR", ""]]));
        assert!(!is_colored(false, &[]) && !is_colored(true, &[["NO_COLOR", "1"]]));
        assert!(!is_colored(true, &[["TERM", "dumb"]]));
        assert!(is_colored(false, &[["CLICOLOR_FORCE", "1"]]));
        assert!(!is_colored(false, &[["CLICOLOR_FORCE", "0"]]));
        assert!(!is_colored(false, &[["CLICOLOR_FORCE", "1"], ["NO_COLOR", "1"]]));
    }

    #[test]
    fn width_stays_between_80_and_120_columns() {
        let width = |columns| style(true, columns, |_| None).width;
        // 80 without a terminal, and the limits on both sides.
        assert_eq!([None, Some(40), Some(100), Some(300)].map(width), [80, 80, 100, 120]);
    }
}
