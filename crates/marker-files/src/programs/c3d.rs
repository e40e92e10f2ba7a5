//! Reader of C3D files: the points in space, frames by number with their rate, and points as markers.
//!
//! A C3D file has blocks of 512 bytes: a header, parameters in groups, and frames. A frame has four words for every
//! point, x, y, z and the residual, and then analog data, which are skipped. Words are floats of 32 bits if the scale
//! is negative, else integers of 16 bits times the scale. A point with a negative residual, or NaN, was not detected.
//! Names and unit are those of the group POINT. Point number K without a name is `point K`, from 1; without a unit it
//! is that of the calibration. Number of points, scale and rate are those of this group, else of the header. The range
//! of frames is that of the group TRIAL, else of the header; there 65535 as the last frame is replaced by a larger
//! POINT:FRAMES. Frames are numbered from the first one of this range, and frame 1 is at time zero. Errors: numbers
//! that are not little-endian (Intel), files that are cut off, counts that contradict each other, no point, a rate that
//! is not positive, an unknown unit, and infinite coordinates. In place of a line, errors of coordinates have the
//! number of the frame in the file, counted from 1, and others have 1.

use crate::error::Error;
use crate::format::Format;
use crate::marker_file::{Clock, FrameReading, LengthUnit, MarkerData, MarkerFile, length_unit};
use crate::programs::c3d_parameters::{Parameters, float, word};
use crate::signatures::{C3D_BLOCK as BLOCK, C3D_MARK as MARK};
use std::path::Path;

/// Largest count of points, and largest number of a block: the header has 16 bits for each.
const LARGEST: f64 = 65535.0;

/// The data of a file: counts, formats and place of the frames.
struct DataLayout {
    points: usize,
    /// Number of the first frame in the recording.
    first: f64,
    frames: usize,
    rate: f64,
    /// Factor of integers; `None` for floats.
    scale: Option<f64>,
    /// Place of the first frame, and size of a frame, bytes.
    start: usize,
    size: usize,
}

/// Reads the bytes of a C3D file into frames by number, with their rate, and points as markers; `path` is for messages.
/// An error for files with numbers of DEC or SGI, without points, with an unknown unit, an infinite coordinate, a
/// content that contradicts the header, or cut off.
pub(crate) fn read(path: &Path, bytes: &[u8]) -> Result<MarkerFile, Error> {
    let refused = |message: String| Error::data(path, 1, message);
    let header = || {
        let found = bytes.len();
        refused(format!(
            "found {found} bytes, allowed: a header of {BLOCK} bytes, parameters and points"
        ))
    };
    let [block @ 1..=u8::MAX, MARK, ..] = bytes else {
        let message = "found other first bytes than those of a C3D file, allowed: the number of the parameter block and \
                       0x50. If this is no C3D file, set format, as in format = \"csv\"";
        return Err(refused(message.into()));
    };
    let section = (usize::from(*block) - 1) * BLOCK;
    match bytes.get(section + 3) {
        Some(84) => {}
        Some(85) => {
            return Err(refused(
                "found numbers of DEC (VAX), allowed: numbers of Intel. Convert the file".into(),
            ));
        }
        Some(86) => {
            return Err(refused(
                "found numbers of SGI (MIPS), allowed: numbers of Intel. Convert the file".into(),
            ));
        }
        Some(other) => {
            return Err(refused(format!("found processor {other}, allowed: 84 (Intel)")));
        }
        None => return Err(header()),
    }
    let parameters = Parameters::read(bytes, section).map_err(refused)?;
    let layout = layout(bytes, &parameters).ok_or_else(header)?.map_err(refused)?;
    let unit = parameters.texts("POINT", "UNITS");
    let lengths = match unit.first().map_or("", |unit| &unit[..]) {
        "" => LengthUnit::Calibrated,
        stated => length_unit(stated).ok_or_else(|| {
            refused(format!("found POINT:UNITS `{stated}`, allowed: um, mm, cm or m"))
        })?,
    };
    let DataLayout { points, first, frames: count, rate, .. } = layout;
    // More than 255 names are in parameters LABELS2, LABELS3 and so on.
    let more =
        (2..=points / 255 + 1).flat_map(|k| parameters.texts("POINT", &format!("LABELS{k}")));
    let mut names = parameters.texts("POINT", "LABELS").into_iter().chain(more);
    let mut markers: Vec<MarkerData> = (0..points)
        .map(|k| MarkerData {
            name: names
                .next()
                .filter(|name| !name.is_empty())
                .unwrap_or_else(|| format!("point {}", k + 1)),
            axes: [true; 3],
            positions: Vec::with_capacity(count),
            likelihood: None,
        })
        .collect();
    let mut frames = Vec::with_capacity(count);
    for k in 0..count {
        for (p, marker) in markers.iter_mut().enumerate() {
            let position = position(bytes, &layout, k, p).ok_or_else(header)?;
            if position.iter().flatten().any(|x| x.is_infinite()) {
                let message = format!(
                    "found an infinite coordinate of `{}` in frame {}, allowed: numbers",
                    marker.name,
                    k + 1
                );
                return Err(Error::data(path, k as u64 + 1, message));
            }
            marker.positions.push(position);
        }
        frames.push(FrameReading { line: k as u64 + 1, clock: first + k as f64 });
    }
    let clock = Clock::Frames { first: first.min(1.0), rate: Some(rate) };
    Ok(MarkerFile { path: path.into(), format: Format::C3d, clock, lengths, frames, markers })
}

/// The position of a point in a frame, both counted from 0, in the unit of the file; all `None` where it was not
/// detected. `None` as a whole beyond the bytes.
fn position(
    bytes: &[u8],
    layout: &DataLayout,
    frame: usize,
    point: usize,
) -> Option<[Option<f64>; 3]> {
    let at = layout.start + frame * layout.size;
    let (values, residual) = match layout.scale {
        None => {
            let at = at + 16 * point;
            let value = |c: usize| float(bytes, at + 4 * c).map(f64::from);
            ([value(0)?, value(1)?, value(2)?], value(3)?)
        }
        Some(scale) => {
            let at = at + 8 * point;
            let value = |c: usize| word(bytes, at + 2 * c).map(|w| f64::from(w.cast_signed()));
            ([value(0)? * scale, value(1)? * scale, value(2)? * scale], value(3)?)
        }
    };
    let is_detected = residual >= 0.0 && values.iter().all(|x| !x.is_nan());
    Some(if is_detected { values.map(Some) } else { [None; 3] })
}

/// The layout of the frames by the header and the groups POINT and TRIAL of the parameters; `None` for a file without a
/// whole header. A number of the parameters replaces that of the header unless it is missing or 0. Errors, as messages:
/// numbers of points or of the first data block that differ in both, impossible numbers, and fewer bytes than frames.
fn layout(bytes: &[u8], parameters: &Parameters) -> Option<Result<DataLayout, String>> {
    let [points, analog, from, to] = [2, 4, 6, 8].map(|at| word(bytes, at));
    let (points, analog, from, to) = (points?, analog?, from?, to?);
    let [scale, block, rate] = [float(bytes, 12)?, f32::from(word(bytes, 16)?), float(bytes, 20)?];
    let number = |name: &str| parameters.number("POINT", name);
    // Header and parameters have the same numbers; one of both may be missing, as 0.
    let agreed = |name: &str, own: f64| match (number(name), own) {
        (Some(found), own) if found != own && found != 0.0 && own != 0.0 => {
            Err(format!("found POINT:{name} = {found} and {own} in the header, allowed: one value"))
        }
        (Some(found), _) if found != 0.0 => Ok(found),
        _ => Ok(own),
    };
    Some((|| {
        let points = agreed("USED", f64::from(points))?;
        let block = agreed("DATA_START", f64::from(block))?;
        let rate = number("RATE").filter(|rate| *rate != 0.0).unwrap_or(f64::from(rate));
        let scale = number("SCALE").filter(|scale| *scale != 0.0).unwrap_or(f64::from(scale));
        // Comparisons with a number that is not finite are false.
        if !(1.0..=LARGEST).contains(&points) {
            return Err("found no point, allowed: at least one point in space".into());
        }
        if !(rate.is_finite() && rate > 0.0) {
            return Err(format!(
                "found POINT:RATE = {rate}, allowed: a rate above 0 frames per second"
            ));
        }
        if !scale.is_finite() || scale == 0.0 {
            return Err(format!(
                "found POINT:SCALE = {scale}, allowed: a finite number other than 0"
            ));
        }
        if !(2.0..=LARGEST).contains(&block) {
            return Err(format!(
                "found POINT:DATA_START = {block}, allowed: a block behind the header"
            ));
        }
        // The header counts up to 65535 frames; longer recordings have their ends in the group TRIAL.
        let field = |name: &str| parameters.long("TRIAL", name);
        let ends = field("ACTUAL_START_FIELD").zip(field("ACTUAL_END_FIELD"));
        let [first, last] = ends.map_or([from, to].map(u64::from), |(from, to)| [from, to]);
        let mut count =
            (last + 1).checked_sub(first).filter(|count| *count > 0).ok_or_else(|| {
                format!("found the frames {first} to {last}, allowed: at least one frame")
            })?;
        if ends.is_none() && to == u16::MAX {
            count = number("FRAMES").map_or(count, |all| count.max(all as u64));
        }
        let is_float = scale < 0.0;
        let word = if is_float { 4 } else { 2 };
        let size = (4 * points as usize + usize::from(analog)) * word;
        let start = (block as usize - 1) * BLOCK;
        let available = bytes.len().saturating_sub(start) / size;
        if (available as u64) < count {
            return Err(format!(
                "found {available} frames of {count}, allowed: a file that is not cut off"
            ));
        }
        Ok(DataLayout {
            points: points as usize,
            first: first as f64,
            frames: count as usize,
            rate,
            scale: (!is_float).then_some(scale),
            start,
            size,
        })
    })())
}
