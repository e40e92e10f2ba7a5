//! The formats of motion-capture and tracking programs, and their recognition by the first bytes of a file.
//!
//! [`Format::detect`] takes the bytes of a file and returns its format. C3D is recognized by the signature of its
//! bytes, HDF5 files by theirs and their data sets. Of other files the first 4096 bytes are examined as text. Most
//! programs are recognized by the text of the first cell, or by names of columns in the first line, and Tracker by `t`
//! at the start of the second line. Blank lines are skipped. OpenSim is recognized by a line `endheader` anywhere in
//! this text. A file that no program matches is a plain table (CSV); there is no error. [`Format::key`] is the name of
//! a format in configuration files, [`Format::program`] the name of its program for messages.

use crate::hdf5;
use crate::signatures::{is_c3d, is_end_of_header, is_hdf5};
use serde::{Deserialize, Serialize};

/// Number of bytes at the beginning of a file that are examined.
const FIRST: usize = 4096;

/// Defines the formats with their keys in configuration files and their programs.
macro_rules! formats {
    ($($(#[$documentation:meta])* $Format:ident $key:literal $program:literal;)*) => {
        /// Tracking programs whose files are read.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(rename_all = "lowercase")]
        #[non_exhaustive]
        pub enum Format {
            $($(#[$documentation])* $Format,)*
        }

        impl Format {
            /// All formats.
            pub const ALL: &[Self] = &[$(Self::$Format),*];

            /// The name of the program, for messages; `a table` for a plain table.
            pub fn program(self) -> &'static str {
                match self {
                    $(Self::$Format => $program,)*
                }
            }

            /// Name of the format in configuration files, in lower case.
            pub fn key(self) -> &'static str {
                match self {
                    $(Self::$Format => $key,)*
                }
            }
        }
    };
}

formats! {
    /// A table with a clock and columns x, y, z, or xA, yA, zA of markers A.
    Csv "csv" "a table";
    /// OptiTrack Motive's CSV export.
    Motive "motive" "OptiTrack Motive";
    /// Vicon Nexus's CSV (ASCII) export.
    Vicon "vicon" "Vicon Nexus";
    /// Tracker's data export, of one track or several.
    Tracker "tracker" "Tracker";
    /// DeepLabCut's CSV or HDF5, of one animal or several; Lightning Pose and SLEAP write its CSV too.
    DeepLabCut "deeplabcut" "DeepLabCut";
    /// DLTdv's points, in pixels or in space.
    Dltdv "dltdv" "DLTdv";
    /// Qualisys Track Manager's TSV export.
    Qualisys "qualisys" "Qualisys";
    /// Kinovea's export to a spreadsheet, or to text.
    Kinovea "kinovea" "Kinovea";
    /// SLEAP's analysis in CSV or HDF5.
    Sleap "sleap" "SLEAP";
    /// TrackMate's spots.
    TrackMate "trackmate" "TrackMate";
    /// TRC, as Motion Analysis, OpenSim and Pose2Sim write it.
    Trc "trc" "Motion Analysis (TRC)";
    /// OpenSim's storage files, STO and MOT.
    Sto "sto" "OpenSim (STO, MOT)";
    /// The points of C3D files.
    C3d "c3d" "C3D";
}

impl Format {
    /// The format of a file by its first bytes. C3D is recognized by its signature. HDF5 files of DeepLabCut and SLEAP
    /// are recognized by their data sets, with the feature `hdf5`; all bytes are needed for it. Other programs are
    /// recognized by the text of the first cell, names of columns in the first line, or a line `endheader` among the
    /// first 4096 bytes. Tracker has `t` at the start of the second line. The result is a plain table ([`Format::Csv`])
    /// if no program is recognized. A byte-order mark and blank lines are skipped; case is ignored in first cells.
    pub fn detect(bytes: &[u8]) -> Self {
        if is_c3d(bytes) {
            return Self::C3d;
        }
        if is_hdf5(bytes) {
            return match bytes {
                _ if hdf5::is_sleap(bytes) => Self::Sleap,
                _ if hdf5::is_deeplabcut(bytes) => Self::DeepLabCut,
                _ => Self::Csv,
            };
        }
        let text = String::from_utf8_lossy(&bytes[..bytes.len().min(FIRST)]);
        let text = text.trim_start_matches('\u{feff}');
        let mut lines = text.lines().filter(|line| !line.trim_matches([',', ' ', '\t']).is_empty());
        let (first, second) = (lines.next().unwrap_or(""), lines.next().unwrap_or(""));
        let cell = |line: &str| {
            let cell = line.split([',', ';', '\t']).next().unwrap_or("");
            cell.trim().trim_matches('"').to_lowercase()
        };
        let (begins, below) = (cell(first), cell(second));
        // Spreadsheet programs pad lines with empty columns.
        let alone = !first.trim_end_matches([',', ';', '\t', ' ']).contains([',', ';', '\t']);
        match &begins[..] {
            // Each program writes a fixed text in the first cell; Tracker has `t` at the start of the second line.
            "format version" => Self::Motive,
            "scorer" => Self::DeepLabCut,
            "pathfiletype" => Self::Trc,
            "no_of_frames" => Self::Qualisys,
            "trajectories" | "devices" | "model outputs" | "joints" | "segments" | "events" => {
                Self::Vicon
            }
            "#kinovea trajectory data export" => Self::Kinovea,
            "track" if first.contains("frame_idx") => Self::Sleap,
            _ if text.lines().any(is_end_of_header) => Self::Sto,
            _ if first.contains("TRACK_ID") && first.contains("POSITION_X") => Self::TrackMate,
            _ if begins.starts_with("time") && first.contains("/X") => Self::Kinovea,
            "" | "#multi:" | "multi:" if below == "t" => Self::Tracker,
            // The export of a single track of Tracker has only the name of the track in its first line.
            _ if alone
                && (below == "t" || below.starts_with("t ") && !below.contains(['(', '[']))
                && !begins.starts_with('#')
                && !begins.starts_with("sep=") =>
            {
                Self::Tracker
            }
            _ if is_point(&begins) => Self::Dltdv,
            _ => Self::Csv,
        }
    }
}

/// Whether the name of a column, in lower case, is that of a DLTdv point, as `pt1_x` or `pt12_cam2_y`: `pt`, digits,
/// `_`, and an axis behind the last `_`.
fn is_point(cell: &str) -> bool {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let Some((point, rest)) = cell.strip_prefix("pt").and_then(|rest| rest.split_once('_')) else {
        return false;
    };
    digits(point) && rest.rsplit('_').next().is_some_and(|axis| ["x", "y", "z"].contains(&axis))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_show_in_the_first_bytes() {
        for (text, format) in [
            ("Format Version,1.23,Take Name,rod\n\n,Type,Marker\n", Format::Motive),
            ("\u{feff}\r\n\r\nTrajectories\r\n100\r\n", Format::Vicon),
            ("mass_A\nt\tx\ty\n0\t1\t2\n", Format::Tracker),
            (",mass_A,,mass_B\nt,x,y,x,y\n", Format::Tracker),
            ("#multi:\tmass_A\t\nt\tx\ty\n", Format::Tracker),
            ("mass_A,,\nt,x,y\n0,1,2\n", Format::Tracker),
            ("mass_A\nt x y\n0 1 2\n", Format::Tracker),
            ("t x y\n0 1 2\n", Format::Csv),
            ("sep=,\nt,x,y\n0,1,2\n", Format::Csv),
            ("Positions\nversion=1\n\nendheader\ntime\ta_X\ta_Y\n", Format::Sto),
            ("PathFileType\t4\t(X/Y/Z)\ttip.trc\n", Format::Trc),
            ("scorer,DLC,DLC\nbodyparts,tip,tip\n", Format::DeepLabCut),
            ("pt1_cam1_X,pt1_cam1_Y\n1,2\n", Format::Dltdv),
            ("pt1_X,pt1_Y,pt1_Z\n", Format::Dltdv),
            ("NO_OF_FRAMES\t3\nNO_OF_CAMERAS\t2\n", Format::Qualisys),
            ("\"Time\",\"Trajectory 1/0/X\",\"Trajectory 1/0/Y\"\n", Format::Kinovea),
            ("#Kinovea Trajectory data export\n#T X Y\n0 1 2\n", Format::Kinovea),
            ("track,frame_idx,instance.score,tip.x,tip.y,tip.score\n", Format::Sleap),
            ("LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y\n", Format::TrackMate),
            ("\"Time (ms)\";\"X (mm)\";\"Y (mm)\"\n", Format::Csv),
            ("\u{2}P\u{f}\0\u{1}\0", Format::C3d),
            ("\nP,x\n0,1\n", Format::Csv),
            ("t,x,y\n0,1,2\n", Format::Csv),
            ("# tip\nt,x\n0,1\n", Format::Csv),
            ("", Format::Csv),
            ("t\n0\n", Format::Csv),
            ("point_x,y\n", Format::Csv),
        ] {
            assert_eq!(Format::detect(text.as_bytes()), format, "{text:?}");
        }
    }
}
