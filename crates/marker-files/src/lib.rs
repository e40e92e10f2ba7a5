//! Trajectories of markers from the files of motion-capture and video-tracking programs.
//!
//! A file is read in two steps. [`open`] recognizes the program by the first bytes, and [`parse`] returns the
//! [`MarkerFile`] in the units of the file: the clock of every frame and the positions of every marker. A [`Recording`]
//! states what the file does not: the marker, the frame rate, the scale of an image, the origin, the axes and the start
//! of the motion. [`load`] opens and parses a file by the keys of a recording. [`read`] also converts one marker and
//! returns a [`MarkerTrajectory`] in seconds and meters; [`read_several`] does so for markers by their names. Files and
//! lines that cannot be used are an [`Error`] with the path, and in general the line. [`read_bodies`] reads the
//! poses of rigid bodies of Motive, [`AccelerationColumns`] finds accelerations in a table. [`table`] reads tables of
//! numbers, [`file`](mod@file) whole files, and [`printable`] prepares texts of files for messages.
//!
//! ```
//! use marker_files::{Recording, Vertical, read};
//! // A camera with 240 frames per second and 0.4 mm per pixel; the motion starts at frame 37.
//! let recording = Recording {
//!     fps: Some(240.0),
//!     scale: Some(0.4e-3),
//!     origin: Some([112.0, 305.0, 0.0]),
//!     y: Some(Vertical::Down),
//!     time_zero: Some(37.0),
//!     ..Recording::default()
//! };
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("tip.csv");
//! std::fs::write(&path, "frame,x[px],y[px]\n36,1362,305\n38,1361,310\n39,1358,\n")?;
//! let tip = read(&path, &recording)?;
//! assert_eq!(tip.times, [1.0 / 240.0, 2.0 / 240.0]);
//! assert_eq!(tip.positions[0][1], Some(-5.0 * 0.4e-3));
//! assert_eq!(tip.dropped.before_time_zero, 1);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Files of other programs need no format to be named:
//!
//! ```
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("take.trc");
//! # let header = "PathFileType\t4\t(X/Y/Z)\ttake.trc\nDataRate\tUnits\n100\tmm\n";
//! # let table = "Frame#\tTime\ttip\t\t\n\t\tX1\tY1\tZ1\n1\t0.00\t1\t2\t3\n2\t0.01\t2\t2\t3\n";
//! # std::fs::write(&path, format!("{header}{table}"))?;
//! let (format, bytes) = marker_files::open(&path, None)?;
//! let file = marker_files::parse(&path, format, &bytes)?;
//! assert_eq!((format.program(), &file.markers[0].name[..]), ("Motion Analysis (TRC)", "tip"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod accelerations;
mod axes;
mod columns;
mod decimals;
mod detections;
mod error;
pub mod file;
mod format;
#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(not(feature = "hdf5"))]
#[path = "no_hdf5.rs"]
mod hdf5;
mod marker_file;
pub mod printable;
mod programs;
mod recording;
mod separator;
mod sigma;
mod signatures;
pub mod table;
mod trajectory;
mod units;
mod unknown_file;

pub use accelerations::AccelerationColumns;
pub use axes::Axes;
pub use columns::{ColumnKey, ColumnRule, ColumnRules, ColumnWithUnit};
pub use error::Error;
pub use format::Format;
pub use marker_file::{Clock, FrameReading, LengthUnit, MarkerData, MarkerFile, is_same_name};
pub use programs::{
    RecordedBodies, RecordedBody, RecordedBodyPose, load, open, parse, read_bodies,
};
pub use recording::{
    AxisColumns, ClockedColumns, Converted, NOT_FINITE, PixelAxes, Recording, Vertical, is_finite,
};
pub use sigma::{AxisColumnNames, SigmaColumns};
pub use trajectory::{Dropped, MarkerTrajectory, read, read_several};
pub use units::{ACCELERATIONS, ANGLES, CURVATURES, FORCES, MOMENTS, STANDARD_GRAVITY, STRAINS};
