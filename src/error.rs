//! What can go wrong, in words a user can act on.

use crate::code::Code;
use marker_files::printable::{
    clipped, io_reason, printable, printable_name, printable_path, shown, token,
};
use std::path::{Path, PathBuf};

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
        /// What the system said.
        source: std::io::Error,
    },
    /// A file is not valid TOML, or has unknown, missing or ill-typed keys.
    #[error("{}{}", prefix(file), shown(message))]
    Parse {
        /// The file, where there is one.
        file: Option<PathBuf>,
        /// Line, key and what was expected.
        message: String,
    },
    /// A value lies outside what is allowed.
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
        /// What stands there.
        found: String,
        /// What may stand there.
        allowed: String,
    },
    /// A line of a data file cannot be used.
    #[error("{}:{line}: {}", printable_path(path), shown(message))]
    Data {
        /// The file.
        path: PathBuf,
        /// The line, the header being line 1.
        line: u64,
        /// What was found and what is allowed.
        message: String,
    },
    /// A time step found no solution.
    #[error(
        "no solution at t = {time} s: after {iterations} Newton iterations the residual is {residual:e} N s^2, \
         above the rounding level of {tolerance:e}. Use a smaller time.step"
    )]
    Newton {
        /// End of the step that failed, s.
        time: f64,
        /// Newton iterations spent on it.
        iterations: usize,
        /// Largest residual, N s^2.
        residual: f64,
        /// Rounding level of that residual.
        tolerance: f64,
    },
    /// The scheme gains energy that the motion cannot have.
    #[error(
        "at t = {time} s the total energy has changed by {change:.2e} J{}, which is impossible for this rod. The \
         time step is unstable: {remedy}",
        of_kinetic(*fraction)
    )]
    EnergyGrowth {
        /// End of the step that was refused, s.
        time: f64,
        /// The change in the step or since the start (or the lowest energy so far, where it can only
        /// fall), whichever is larger, J.
        change: f64,
        /// The same over the largest kinetic energy.
        fraction: f64,
        /// What helps with this scheme.
        remedy: &'static str,
    },
    /// An energy of one's own became NaN or infinite.
    #[error(
        "at t = {time} s the value or gradient of energy.{name}, {arc_length} m along the rod, is not a finite \
         number. Check the energy function, or use a smaller time.step"
    )]
    NotFinite {
        /// End of the step that failed, s.
        time: f64,
        /// What the energy was called when it was attached.
        name: String,
        /// Where it is, m from the wall.
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
    /// A step came out beyond a fold.
    #[error(
        "at t = {time} s the rod would fold by 180 degrees at node {node}, which takes infinite energy. Use a \
         smaller time.step"
    )]
    Fold {
        /// End of the step that was refused, s.
        time: f64,
        /// The inner node.
        node: usize,
    },
    /// A step turned an edge of a rod with moving supports too far.
    #[error(
        "at t = {time} s edge {edge} would rotate by more than 45 degrees in one step. Use a smaller time.step"
    )]
    Leap {
        /// End of the step that was refused, s.
        time: f64,
        /// The edge, from 0.
        edge: usize,
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
         remains. A free rod has no equilibrium. Check the supports, or use a finer mesh"
    )]
    Equilibrium {
        /// Newton iterations.
        iterations: usize,
        /// Largest force out of balance, N.
        residual: f64,
    },
    /// A rod at rest that can move without a force, so that its place has no derivatives.
    #[error(
        "the rod at rest can move without a force, most at node {node}, so that its position has no derivative. \
         It is at a stability limit, or not supported. Check the supports and the loads"
    )]
    Indifferent {
        /// The node that moves most.
        node: usize,
    },
    /// Not all of the lowest modes were found.
    #[error(
        "the {asked} lowest of {unknowns} modes were not found reliably: too many frequencies are close together, \
         or the rounding errors of a very fine mesh are too large. Ask for fewer modes, or use a coarser mesh"
    )]
    Unconverged {
        /// How many were asked for.
        asked: usize,
        /// How many there are.
        unknowns: usize,
    },
    /// A mode whose frequency cannot be differentiated.
    #[error("mode {number}{among}, at {frequency_rad_s} rad/s: {reason}")]
    Mode {
        /// Counted from 1.
        number: usize,
        /// Among which modes, if not all.
        among: String,
        /// Its angular frequency; minus the growth rate of an unstable direction.
        frequency_rad_s: f64,
        /// Why not.
        reason: String,
    },
    /// A query outside the simulated time or the rod.
    #[error("{what} = {found} is outside {low} .. {high}")]
    OutOfRange {
        /// The quantity.
        what: &'static str,
        /// The value asked for.
        found: f64,
        /// Smallest value allowed.
        low: f64,
        /// Largest value allowed.
        high: f64,
    },
    /// The flag of [`Problem::stop_when`](crate::Problem::stop_when) was set.
    #[error("interrupted")]
    Interrupted,
    /// A fit that cannot start or cannot go on.
    #[error("{}", printable(&clipped(.0)))]
    Fit(String),
}

/// A change of the energy in words, unless there is hardly any motion to compare it with.
fn of_kinetic(fraction: f64) -> String {
    match 100.0 * fraction {
        percent @ 0.1..1e6 => format!(", {percent:.1} % of the largest kinetic energy"),
        percent @ 0.0..0.1 => format!(", {percent:.1e} % of the largest kinetic energy"),
        _ => String::new(),
    }
}

fn prefix(file: &Option<PathBuf>) -> String {
    file.as_ref().map(|path| format!("{}: ", printable_path(path))).unwrap_or_default()
}

impl Error {
    pub(crate) fn io(path: &Path, source: std::io::Error) -> Self {
        Self::Io { named_in: None, path: path.into(), source }
    }

    pub(crate) fn invalid(
        key: impl Into<String>,
        found: impl ToString,
        allowed: impl Into<String>,
    ) -> Self {
        Self::Invalid {
            file: None,
            key: key.into(),
            found: found.to_string(),
            allowed: allowed.into(),
        }
    }

    /// Names the file an error comes from, where it does not say so itself.
    pub(crate) fn in_file(mut self, path: Option<&Path>) -> Self {
        if let Self::Parse { file, .. }
        | Self::Invalid { file, .. }
        | Self::Io { named_in: file, .. } = &mut self
        {
            *file = file.take().or_else(|| path.map(Into::into));
        }
        self
    }

    /// The short name of why a computation ended, by which it is explained; none where the input is at fault, of
    /// which the message says all there is.
    pub fn code(&self) -> Option<Code> {
        Some(match self {
            Self::Newton { .. } => Code::NoSolution,
            Self::EnergyGrowth { .. } => Code::EnergyGrowth,
            Self::NotFinite { .. } => Code::NotFinite,
            Self::Unstable { .. } => Code::UnstableStep,
            Self::Fold { .. } => Code::Fold,
            Self::Leap { .. } => Code::LargeRotation,
            Self::SingularTangent { .. } | Self::SingularEquilibrium => Code::SingularTangent,
            Self::Equilibrium { .. } => Code::NoEquilibrium,
            Self::Indifferent { .. } => Code::NeutralEquilibrium,
            Self::Unconverged { .. } => Code::ModesNotFound,
            Self::Mode { .. } => Code::ModeWithoutDerivative,
            Self::Interrupted => Code::Interrupted,
            Self::Fit(_) => Code::FitFailed,
            Self::Io { .. }
            | Self::Parse { .. }
            | Self::Invalid { .. }
            | Self::Data { .. }
            | Self::OutOfRange { .. } => return None,
        })
    }

    /// The same error of a key below another one: `duration` of `observation[0]`.
    pub(crate) fn below(mut self, table: &str) -> Self {
        if let Self::Invalid { key, .. } = &mut self {
            *key = format!("{table}.{key}");
        }
        self
    }

    /// Whether the input is at fault, and not the computation.
    pub fn is_input(&self) -> bool {
        self.code().is_none()
    }
}

impl From<marker_files::Error> for Error {
    fn from(error: marker_files::Error) -> Self {
        match error {
            marker_files::Error::Io { path, source } => Self::io(&path, source),
            marker_files::Error::Data { path, line, message } => Self::Data { path, line, message },
            marker_files::Error::Accelerations { path, allowed } => {
                let found = "accelerations instead of positions; those of a moved end, `ax, ay, az`, belong in \
                             [[supports.motion]]";
                Self::Data { path, line: 1, message: format!("found {found}, allowed: {allowed}") }
            }
            other => Self::Fit(other.to_string()),
        }
    }
}
