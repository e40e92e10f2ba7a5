//! The error type of the library, and constructors of its variants.
//!
//! Variants are of two groups. Invalid input has a file, key or line, the found value and the allowed ones, and no
//! code; queries out of range belong to it. Failed or interrupted computations have a [`Code`] ([`Error::code`]), and
//! in general the time, the quantity and a remedy. The command returns exit code 2 for the first group
//! ([`Error::is_input`]) and 3 for the second. In messages, texts from files are shortened and their control characters
//! escaped. [`Error::invalid`] makes the error of a key or option, [`Error::io`] that of a file. Errors get their file
//! ([`Error::in_file`]) and table ([`Error::below`]) where they are passed on. An input that was given as text has the
//! path [`GIVEN_AS_TEXT`] in its folder, which no error names. `at_key` turns a query out of range into the error of a
//! key. [`ensure`] checks a condition on a value. [`none_on_failure`] replaces an error by `None`, except an
//! interruption.

use crate::code::Code;
use marker_files::printable::{
    clipped, io_reason, printable, printable_name, printable_path, shown, token,
};
use std::path::{Path, PathBuf};

/// Longest number that messages have without an exponent, in characters.
const LONGEST_NUMBER: usize = 24;

/// A number with more than [`LONGEST_NUMBER`] characters with an exponent, `1e300`; other texts unchanged.
fn with_exponent(text: String) -> String {
    match text.parse::<f64>() {
        Ok(number) if text.len() > LONGEST_NUMBER => format!("{number:e}"),
        _ => text,
    }
}

/// Name of the file of a scene, a structure or a fit that was given as text, in the folder of its paths.
pub(crate) const GIVEN_AS_TEXT: &str = "(text)";

/// `Some` value of a result, or `None` for any error but [`Error::Interrupted`]. An interruption by the user remains an
/// error.
pub(crate) fn none_on_failure<T>(result: Result<T, Error>) -> Result<Option<T>, Error> {
    match result {
        Ok(value) => Ok(Some(value)),
        // An interruption must end the whole computation, and not count as one failed attempt.
        Err(Error::Interrupted) => Err(Error::Interrupted),
        Err(_) => Ok(None),
    }
}

/// `Ok` if a condition `holds`, else [`Error::Invalid`] of the `key` with the value `found` and the `allowed` values,
/// without a file.
pub(crate) fn ensure(
    holds: bool,
    key: impl Into<String>,
    found: impl std::fmt::Display,
    allowed: impl Into<String>,
) -> Result<(), Error> {
    if holds { Ok(()) } else { Err(Error::invalid(key, found, allowed)) }
}

/// Every error of the crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read or written.
    #[error("{}{}: {}", prefix(named_in), printable_path(path), io_reason(source))]
    Io {
        /// The scene or fit file that names it, where one does.
        named_in: Option<PathBuf>,
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A file is not valid TOML, or has unknown, missing or ill-typed keys.
    #[error("{}{}", prefix(file), shown(message))]
    Parse {
        /// The file, where there is one.
        file: Option<PathBuf>,
        /// Line, key and expected value.
        message: String,
    },
    /// A value outside the allowed ones.
    #[error(
        "{}{}: found {}, allowed: {}",
        prefix(file),
        token(key),
        printable_name(&clipped(found)),
        printable(&clipped(allowed))
    )]
    Invalid {
        /// The file, where there is one.
        file: Option<PathBuf>,
        /// The key, with its table: `rod.segments`.
        key: String,
        /// The value of the key.
        found: String,
        /// The allowed values.
        allowed: String,
    },
    /// A line of a data file cannot be used.
    #[error("{}:{line}: {}", printable_path(path), shown(message))]
    Data {
        /// The file.
        path: PathBuf,
        /// The line, the header being line 1.
        line: u64,
        /// The found and the allowed value.
        message: String,
    },
    /// A time step found no solution.
    #[error(
        "no solution at t = {time} s: after {iterations} Newton iterations the residual is {residual:.2e} N s^2, \
         above the rounding level of {tolerance:.2e}. Use a smaller time.step"
    )]
    Newton {
        /// End of the step that failed, s.
        time: f64,
        /// Newton iterations of the step.
        iterations: usize,
        /// Largest residual, N s^2.
        residual: f64,
        /// Rounding level of that residual.
        tolerance: f64,
    },
    /// The total energy changed by more than the limit of the scheme: a gain, or with a scheme that conserves energy
    /// exactly also a loss.
    #[error(
        "at t = {time} s the total energy has changed by {change:.2e} J{}, which is impossible for this rod. The \
         time step is unstable: {remedy}",
        kinetic_percentage(*fraction)
    )]
    EnergyGrowth {
        /// End of the rejected step, s.
        time: f64,
        /// The change in the step or since the start (or the lowest energy so far, where it can only
        /// fall), whichever is larger, J.
        change: f64,
        /// The change over the largest kinetic energy.
        fraction: f64,
        /// The remedy for this scheme.
        remedy: &'static str,
    },
    /// A user-defined energy became NaN or infinite.
    #[error(
        "at t = {time} s the value or gradient of energy.{name}, {arc_length} m along the rod, is not a finite \
         number. Check the energy function, or use a smaller time.step"
    )]
    NotFinite {
        /// End of the step that failed, s.
        time: f64,
        /// Name of the energy.
        name: String,
        /// Arc length of the element, m from the wall.
        arc_length: f64,
    },
    /// An explicit scheme has left its region of stability.
    #[error(
        "the explicit scheme is unstable at t = {time} s. Use a smaller time.step, or an implicit scheme"
    )]
    Unstable {
        /// End of the step that failed, s.
        time: f64,
    },
    /// A step folded the rod by 180 degrees.
    #[error(
        "at t = {time} s the rod would fold by 180 degrees at node {node}, which takes infinite energy. Use a \
         smaller time.step"
    )]
    Fold {
        /// End of the rejected step, s.
        time: f64,
        /// Index of the inner node.
        node: usize,
    },
    /// A step rotated an edge by more than 45 degrees, where moving supports or a flow do work on the rod.
    #[error(
        "at t = {time} s edge {edge} would rotate by more than 45 degrees in one step. Use a smaller time.step"
    )]
    Leap {
        /// End of the rejected step, s.
        time: f64,
        /// Index of the edge, from 0.
        edge: usize,
    },
    /// A step led a rod through an obstacle.
    #[error(
        "at t = {time} s the rod would pass through the obstacle contacts[{contact}] in one step. Use a smaller \
         time.step; if contact forces are too small to stop the rod, a larger contacts[{contact}].stiffness"
    )]
    PassedObstacle {
        /// End of the rejected step, s.
        time: f64,
        /// Index of the contact, from 0.
        contact: usize,
    },
    /// A step led a rod through another one.
    #[error(
        "at t = {time} s a rod would pass through another one, or itself, in one step (rod_contacts[{contact}]). Use a \
         smaller time.step; if contact forces are too small to stop the rods, a larger rod_contacts[{contact}].stiffness"
    )]
    PassedRod {
        /// End of the rejected step, s.
        time: f64,
        /// Index of the contact of rods, from 0.
        contact: usize,
    },
    /// The tangent of a step has no inverse.
    #[error(
        "the tangent matrix is singular at t = {time} s, degree of freedom {row}. Use a smaller time.step"
    )]
    SingularTangent {
        /// End of the step that failed, s.
        time: f64,
        /// Degree of freedom of the zero pivot.
        row: usize,
    },
    /// The tangent of an equilibrium has no inverse.
    #[error(
        "the tangent stiffness of the equilibrium is singular, as at a critical load: a motion has no stiffness. \
         Change the load or the mesh slightly"
    )]
    SingularEquilibrium,
    /// No equilibrium was found.
    #[error(
        "no equilibrium found: after {iterations} Newton iterations an unbalanced force of {residual:e} N \
         remains. Check the supports (a free rod has no equilibrium) and the loads, or use a finer mesh"
    )]
    Equilibrium {
        /// Newton iterations.
        iterations: usize,
        /// Largest force out of balance, N.
        residual: f64,
    },
    /// A rod at rest that can move without a force, so that its position has no derivatives.
    #[error(
        "the rod at rest can move without a force, most at node {node}, so that its position has no derivative. \
         It is at a stability limit, or not supported. Check the supports and the loads"
    )]
    Indifferent {
        /// Index of the node with the largest motion.
        node: usize,
    },
    /// Not all of the lowest modes were found.
    #[error(
        "the {asked} lowest of {unknowns} modes were not found reliably: too many frequencies are close together, \
         or the rounding errors of a very fine mesh are too large. Request fewer modes, or use a coarser mesh"
    )]
    Unconverged {
        /// Number of requested modes.
        asked: usize,
        /// Number of all modes.
        unknowns: usize,
    },
    /// A mode whose frequency cannot be differentiated.
    #[error("mode {number}{among}, at {frequency_rad_s} rad/s: {reason}")]
    Mode {
        /// Number of the mode, from 1.
        number: usize,
        /// The modes that are counted, if not all.
        among: String,
        /// Angular frequency, rad/s; minus the growth rate of an unstable mode.
        frequency_rad_s: f64,
        /// The reason.
        reason: String,
    },
    /// A query outside the simulated time or the rod.
    #[error("{what} = {found} is outside {low} .. {high}")]
    OutOfRange {
        /// The quantity.
        what: &'static str,
        /// The requested value.
        found: f64,
        /// Smallest value allowed.
        low: f64,
        /// Largest value allowed.
        high: f64,
    },
    /// The flag of [`Problem::stop_when`](crate::Problem::stop_when) was set.
    #[error("interrupted")]
    Interrupted,
    /// A fit that cannot start or continue.
    #[error("{}", printable(&clipped(.0)))]
    Fit(String),
}

/// Text `, 12.3 % of the largest kinetic energy` for a fraction of it, as in an error of growing energy. Empty for a
/// negative fraction, and for one of 1e4 or more or not finite, as without motion.
fn kinetic_percentage(fraction: f64) -> String {
    match 100.0 * fraction {
        percent @ 0.1..1e6 => format!(", {percent:.1} % of the largest kinetic energy"),
        percent @ 0.0..0.1 => format!(", {percent:.1e} % of the largest kinetic energy"),
        // Without motion the fraction has no meaning: it is negative, not finite or very large.
        _ => String::new(),
    }
}

/// The path of a file, printable, followed by a colon and a space; empty without a file.
fn prefix(file: &Option<PathBuf>) -> String {
    file.as_ref().map(|path| format!("{}: ", printable_path(path))).unwrap_or_default()
}

impl Error {
    /// [`Error::Io`] of the operating system for the file at a path, without the file that names it.
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { named_in: None, path: path.into(), source }
    }

    /// [`Error::Invalid`] of a key or an option, without a file: its value `found` and a description of the `allowed`
    /// ones.
    pub(crate) fn invalid(
        key: impl Into<String>,
        found: impl ToString,
        allowed: impl Into<String>,
    ) -> Self {
        Self::Invalid {
            file: None,
            key: key.into(),
            found: with_exponent(found.to_string()),
            allowed: allowed.into(),
        }
    }

    /// [`Error::OutOfRange`] as [`Error::Invalid`] of a key, with the range that a `place` such as `"of the rod"`
    /// allows. Others are unchanged.
    pub(crate) fn at_key(self, key: impl Into<String>, place: &str) -> Self {
        match self {
            Self::OutOfRange { what, found, low, high } => {
                let allowed = format!("{low} .. {high} {place}");
                Self::invalid(key, format!("{what} = {found}"), allowed)
            }
            error => error,
        }
    }

    /// The error with the file that it comes from. Unchanged if it has a file already, if `path` is `None` or that of
    /// an input that was [given as text](GIVEN_AS_TEXT), and for kinds without such a file: only `Parse`, `Invalid` and
    /// `Io` have one.
    pub(crate) fn in_file(mut self, path: Option<&Path>) -> Self {
        if let Self::Parse { file, .. }
        | Self::Invalid { file, .. }
        | Self::Io { named_in: file, .. } = &mut self
        {
            // The file nearest to the error is kept, such as a scene that a fit file names.
            let path = path.filter(|path| !path.ends_with(GIVEN_AS_TEXT));
            *file = file.take().or_else(|| path.map(Into::into));
        }
        self
    }

    /// The code of a failed computation, by its kind. None for invalid input, which the message explains.
    pub fn code(&self) -> Option<Code> {
        Some(match self {
            Self::Newton { .. } => Code::NoSolution,
            Self::EnergyGrowth { .. } => Code::EnergyGrowth,
            Self::NotFinite { .. } => Code::NotFinite,
            Self::Unstable { .. } => Code::UnstableStep,
            Self::Fold { .. } => Code::Fold,
            Self::Leap { .. } => Code::LargeRotation,
            Self::PassedObstacle { .. } | Self::PassedRod { .. } => Code::PassedObstacle,
            Self::SingularTangent { .. } | Self::SingularEquilibrium => Code::SingularTangent,
            Self::Equilibrium { .. } => Code::NoEquilibrium,
            Self::Indifferent { .. } => Code::NeutralEquilibrium,
            Self::Unconverged { .. } => Code::ModesNotFound,
            Self::Mode { .. } => Code::ModeWithoutDerivative,
            Self::Interrupted => Code::Interrupted,
            Self::Fit(_) => Code::FitFailed,
            // Invalid input has no code: its message has the file, the key and the allowed values.
            Self::Io { .. }
            | Self::Parse { .. }
            | Self::Invalid { .. }
            | Self::Data { .. }
            | Self::OutOfRange { .. } => return None,
        })
    }

    /// The error with its key below a table, `observation[0].duration` for `duration`. Only [`Error::Invalid`] has a
    /// key; others are unchanged.
    pub(crate) fn below(mut self, table: &str) -> Self {
        if let Self::Invalid { key, .. } = &mut self {
            *key = format!("{table}.{key}");
        }
        self
    }

    /// Whether the error is one of the input: it has no [`code`](Self::code), and the exit code is 2. All other errors
    /// are those of the computation.
    pub fn is_input(&self) -> bool {
        self.code().is_none()
    }
}

impl From<marker_files::Error> for Error {
    /// The error of a data file: `Io`, or `Data` with file, line and message. Accelerations in place of positions are
    /// `Data` in line 1. Other errors of the reader become `Fit`.
    fn from(error: marker_files::Error) -> Self {
        match error {
            marker_files::Error::Io { path, source } => Self::io(&path, source),
            marker_files::Error::Data { path, line, message } => Self::Data { path, line, message },
            marker_files::Error::Accelerations { path, allowed } => {
                // The message names the keys of tables that take accelerations.
                let found = "accelerations instead of positions. Give those of a moved end in [[supports.motion]], \
                             and those of a point of the rod with quantity = \"acceleration\" in [[observation]]";
                Self::Data { path, line: 1, message: format!("found {found}, allowed: {allowed}") }
            }
            other => Self::Fit(other.to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_numbers_have_an_exponent() {
        for (found, expected) in [
            (-1e300, "-1e300"),
            (1.5e-300, "1.5e-300"),
            (f64::MAX, "1.7976931348623157e308"),
            (0.1 + 0.2, "0.30000000000000004"),
            (1e7, "10000000"),
        ] {
            let message = Error::invalid("key", found, "less").to_string();
            assert_eq!(message, format!("key: found {expected}, allowed: less"));
        }
        let text = Error::invalid("key", "a text of more than twenty-four characters", "less");
        assert!(text.to_string().contains("twenty-four"));
    }
}
