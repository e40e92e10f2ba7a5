//! The key `image` of `[[observation]]` and `[[shape]]`, and its conversion to the pictures that are there.
//!
//! Input: the deserialized key, a name or a table; the rows of the file with their frames, times and recorded positions
//! (m, in the axes of the world), and the pixels in which they were measured. An observation has a pattern of numbered
//! pictures, a shape one picture. Output: [`ImageSeries`]. Frames without a file are left out; of recordings with more
//! than [`MOST_CANDIDATES`] frames, evenly spaced ones are considered. The header of the pictures that pages show
//! evenly spaced is examined. Errors, with the key: a wrong pattern, no file, a file of another kind, pictures of
//! different sizes, positions that cannot be placed in the picture, and pictures that most positions are outside of.

use crate::error::{Error, ensure};
use crate::fit::image::image_name::ImageName;
use crate::fit::image::{
    ImageFrame, ImagePlacement, ImageSeries, SHOWN_FRAMES, evenly_spaced, read_image,
};
use marker_files::{PixelAxes, Recording};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Largest number of frames whose files are looked for.
const MOST_CANDIDATES: usize = 1_000_000;
/// Smallest part of the recorded positions that must be inside of the picture. Tracked points may leave it for a time.
const LEAST_INSIDE: f64 = 0.5;

/// Pictures of an observation or a shape.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "Image"))]
#[serde(
    untagged,
    expecting = "expected the name of a picture, such as \"frame_{:04}.png\", or { file = \"..\", first = 1, \
                 scale = 4e-4, origin = [112, 305] }"
)]
pub(crate) enum ImageForm {
    /// Name of a picture; of an observation with {}, {:N} or {:0N} for the number of the frame.
    Name(String),
    /// Name with the place of the positions in the picture.
    Table(ImageTable),
}

/// Pictures with their numbers and with the place of the positions in them.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "ImageTable"))]
#[serde(deny_unknown_fields)]
pub(crate) struct ImageTable {
    /// Name of a picture; of an observation with {}, {:N} or {:0N} for the number of the frame.
    file: String,
    /// Number of the picture of frame 0, or of the first row of a file without frame numbers; default 0.
    #[serde(default)]
    first: i64,
    /// Meters per pixel of the picture; default: that of positions in pixels.
    scale: Option<f64>,
    /// Position of the world's origin, pixels from the upper left corner to the right and down; default: that of
    /// positions in pixels.
    #[serde(default, deserialize_with = "crate::input::arrays::some_numbers")]
    origin: Option<[f64; 2]>,
}

/// A row of a file: number of its frame (NaN where the file leaves it blank), time, s, and recorded position, m, in the
/// axes of the world.
pub(crate) struct ImagedRow {
    pub frame: f64,
    pub time: f64,
    pub position: [Option<f64>; 3],
}

impl ImageForm {
    /// The entries of the key; a name alone has the defaults of the others.
    fn table(&self) -> ImageTable {
        match self {
            Self::Table(table) => table.clone(),
            Self::Name(file) => {
                ImageTable { file: file.clone(), first: 0, scale: None, origin: None }
            }
        }
    }

    /// The pictures of an observation with these `rows` of all its markers. `pixels` are those in which they were
    /// measured, by the file that `recording` describes. `key` is that of the table, names are relative to `folder`.
    /// `None` in a build without pages. The errors are those of the [module](self).
    pub fn of_motion(
        &self,
        folder: &Path,
        key: &str,
        rows: &[ImagedRow],
        pixels: Option<PixelAxes>,
        recording: &Recording,
    ) -> Result<Option<Arc<ImageSeries>>, Error> {
        let (key, table) = (format!("{key}.image"), self.table());
        let name = table.name(&key)?;
        if let ImageName::Single(name) = &name {
            let allowed =
                "a name with {} or {:04} for the number of the frame, such as \"frame_{:04}.png\"";
            return Err(Error::invalid(key, format!("{name:?} for a motion"), allowed));
        }
        let numbers: BTreeMap<i64, f64> = rows
            .iter()
            .filter(|row| row.frame.is_finite())
            .map(|row| ((row.frame.round() as i64).saturating_add(table.first), row.time))
            .collect();
        let all: Vec<(i64, f64)> = numbers.into_iter().collect();
        let candidate = |k: usize| {
            let (number, time) = all[k];
            let file = marker_files::file::at(folder, name.of_frame(number).as_ref());
            ImageFrame { time: Some(time), file }
        };
        let found = "no row with a number of its frame";
        ensure(!all.is_empty(), &key, found, "numbers in the column frame")?;
        let candidates = evenly_spaced(all.len(), MOST_CANDIDATES).into_iter().map(candidate);
        let positions: Vec<_> = rows.iter().map(|row| row.position).collect();
        table.series(&key, candidates.collect(), &positions, pixels, recording)
    }

    /// The picture of a shape at rest with these `positions`, as [`of_motion`](Self::of_motion).
    pub fn of_shape(
        &self,
        folder: &Path,
        key: &str,
        positions: &[[Option<f64>; 3]],
        pixels: Option<PixelAxes>,
        recording: &Recording,
    ) -> Result<Option<Arc<ImageSeries>>, Error> {
        let (key, table) = (format!("{key}.image"), self.table());
        let ImageName::Single(name) = table.name(&key)? else {
            let allowed = "the name of one picture, without {}";
            return Err(Error::invalid(key, format!("{:?} for a shape", table.file), allowed));
        };
        ensure(
            table.first == 0,
            format!("{key}.first"),
            table.first,
            "first of an observation only",
        )?;
        let file = marker_files::file::at(folder, name.as_ref());
        let frame = ImageFrame { time: None, file };
        table.series(&key, vec![frame], positions, pixels, recording)
    }
}

impl ImageTable {
    /// The name or pattern; an error with the `key` for a wrong one.
    fn name(&self, key: &str) -> Result<ImageName, Error> {
        ImageName::new(&self.file)
            .map_err(|allowed| Error::invalid(key, format!("{:?}", self.file), allowed))
    }

    /// The pictures among `candidates` that are there, after the checks of the [module](self).
    fn series(
        &self,
        key: &str,
        candidates: Vec<ImageFrame>,
        positions: &[[Option<f64>; 3]],
        pixels: Option<PixelAxes>,
        recording: &Recording,
    ) -> Result<Option<Arc<ImageSeries>>, Error> {
        // Pictures are for pages only.
        if !cfg!(feature = "page") {
            return Ok(None);
        }
        let first = candidates.first().map(|frame| frame.file.display().to_string());
        let count = candidates.len();
        let is_there = |frame: &ImageFrame| marker_files::file::is_there(&frame.file);
        let frames: Vec<ImageFrame> = candidates.into_iter().filter(is_there).collect();
        if frames.is_empty() {
            let others = if count > 1 {
                format!(" or of {} further frames", count - 1)
            } else {
                String::new()
            };
            let found = format!("no file {}{others}", first.unwrap_or_default());
            let allowed = "pictures beside the fit file, of some of the frames at least; first is the number of the \
                           picture of frame 0";
            return Err(Error::invalid(key, found, allowed));
        }
        let mut size = None;
        for k in evenly_spaced(frames.len(), SHOWN_FRAMES) {
            let found = read_image(&frames[k].file, key)?.size;
            let [width, height] = *size.get_or_insert(found);
            let named = format!("{} x {} px: {}", found[0], found[1], frames[k].file.display());
            let allowed = format!("pictures of one size, {width} x {height} px like the first");
            ensure(found == [width, height], key, named, allowed)?;
        }
        let size = size.unwrap_or_default();
        let placement = self.placement(key, pixels, recording, size)?;
        let is_in_space = positions.iter().any(|x| x.iter().all(Option::is_some));
        let allowed = "two coordinates with a picture; axes = [\"x\", \"y\", \"none\"] of an observation selects them";
        ensure(!is_in_space, key, "positions with three coordinates", allowed)?;
        let places: Vec<_> = positions.iter().filter_map(|x| placement.place(*x)).collect();
        let found = "no position with x and y of the picture";
        let allowed = "positions with both coordinates of the picture, which axes select";
        ensure(!places.is_empty(), key, found, allowed)?;
        let is_inside =
            |place: &&[f64; 2]| (0..2).all(|c| (0.0..=f64::from(size[c])).contains(&place[c]));
        let inside = places.iter().filter(is_inside).count();
        if (inside as f64) < LEAST_INSIDE * places.len() as f64 {
            let range = |c: usize| {
                let of = |pick: fn(f64, f64) -> f64, from: f64| {
                    places.iter().fold(from, |x, p| pick(x, p[c]))
                };
                format!(
                    "{:.0} to {:.0}",
                    of(f64::min, f64::INFINITY),
                    of(f64::max, f64::NEG_INFINITY)
                )
            };
            let found = format!(
                "positions at {} px from the left and {} px from the top, {inside} of {} inside of the picture",
                range(0),
                range(1),
                places.len()
            );
            let allowed = format!(
                "the pictures that were tracked, in their size, {} x {} px here; else scale and origin in image",
                size[0], size[1]
            );
            return Err(Error::invalid(key, found, allowed));
        }
        Ok(Some(Arc::new(ImageSeries { name: self.file.clone(), frames, size, placement })))
    }

    /// The place of positions in a picture of this `size`, px: the stated one, or that of positions in pixels. Errors:
    /// one of scale and origin without the other, numbers that are not finite, a scale that is not positive, positions
    /// that are lengths, and `axes` without those of the picture.
    fn placement(
        &self,
        key: &str,
        pixels: Option<PixelAxes>,
        recording: &Recording,
        size: [u32; 2],
    ) -> Result<ImagePlacement, Error> {
        let axes = recording.axes;
        let placement = match (self.scale, self.origin, pixels) {
            (Some(pixel), Some(origin), _) => {
                let is_valid = pixel.is_finite() && pixel > 0.0;
                ensure(is_valid, format!("{key}.scale"), pixel, "meters per pixel, above 0")?;
                let is_finite = origin.iter().all(|x| x.is_finite());
                let allowed = "finite numbers of pixels";
                ensure(is_finite, format!("{key}.origin"), format!("{origin:?}"), allowed)?;
                ImagePlacement { origin, pixel, axes }
            }
            (None, None, Some(pixels)) => ImagePlacement::of_pixels(pixels, recording, size),
            (None, None, None) => {
                let allowed = "positions x and y in pixels with the key scale, or { file = \"..\", scale = meters per \
                               pixel, origin = [x, y] of the world's origin in the picture }";
                return Err(Error::invalid(key, "positions that are not in pixels", allowed));
            }
            (scale, _, _) => {
                let found =
                    if scale.is_some() { "scale without origin" } else { "origin without scale" };
                return Err(Error::invalid(
                    key,
                    found,
                    "scale and origin of the picture, or neither",
                ));
            }
        };
        let has_place = placement.place([Some(0.0); 3]).is_some();
        let allowed = "axes with x and y of the file, which are those of the picture";
        ensure(has_place, key, "axes without x or y", allowed)?;
        Ok(placement)
    }
}
