//! Pictures of a recording: frames of a video or a photograph, over which pages draw data and model.
//!
//! Input: the key `image` of an observation or a shape (`image_form`) with the name of a file or a pattern of numbered
//! files (`image_name`). Files are PNG or JPEG (`image_file`). Output: [`ImageSeries`] with the frames whose files are
//! there, and the place of recorded positions, m, in the picture, px (`image_placement`). The pictures have no effect
//! on a fit. Without the feature `page` they are not used.

mod image_file;
mod image_form;
mod image_name;
mod image_placement;

pub(crate) use image_file::{ImageFile, MOST_BYTES, read_image};
pub(crate) use image_form::{ImageForm, ImagedRow};
pub(crate) use image_placement::ImagePlacement;

use std::path::PathBuf;

/// Number of frames of a recording that a page shows, evenly spaced over those that are there.
pub(crate) const SHOWN_FRAMES: usize = 6;

/// The pictures of a recording that are there, at increasing times, and the place of positions in them.
#[derive(Clone, Debug)]
pub(crate) struct ImageSeries {
    /// The key `image`, a name or pattern. Tables with equal names and placements have the same pictures.
    pub name: String,
    /// Frames with a file; at least one.
    pub frames: Vec<ImageFrame>,
    /// Width and height of a picture, px.
    pub size: [u32; 2],
    /// Place of recorded positions in the picture.
    pub placement: ImagePlacement,
}

/// A position of a motion with pictures.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImagedPosition {
    /// Time on the clock of the recording, s.
    pub time: f64,
    /// Observed coordinates, m, in the axes of the world.
    pub position: [Option<f64>; 3],
}

/// One picture of a recording.
#[derive(Clone, Debug)]
pub(crate) struct ImageFrame {
    /// Time on the clock of the recording, s; `None` of a shape at rest.
    pub time: Option<f64>,
    /// Its file.
    pub file: PathBuf,
}

/// Indices of at most `count` of `n` entries, evenly spaced from the first to the last, ascending, each once.
pub(crate) fn evenly_spaced(n: usize, count: usize) -> Vec<usize> {
    let last = count.max(2) - 1;
    let index = |k: usize| (n.saturating_sub(1) * k + last / 2) / last;
    let mut all: Vec<usize> = (0..count.min(n)).map(index).collect();
    if n <= count {
        all = (0..n).collect();
    }
    all.dedup();
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evenly_spaced_indices_include_both_ends() {
        assert_eq!(evenly_spaced(101, 6), [0, 20, 40, 60, 80, 100]);
        assert_eq!(evenly_spaced(4, 6), [0, 1, 2, 3]);
        assert_eq!(evenly_spaced(7, 6), [0, 1, 2, 4, 5, 6]);
        assert!(evenly_spaced(0, 6).is_empty());
        assert_eq!(evenly_spaced(1, 6), [0]);
    }
}
