//! Place of recorded positions in a picture.
//!
//! Input: recorded positions in the axes of the world, m, as the camera records them. The axes of the file are those of
//! the picture: x to the right, y up, from the world's origin. Output: pixels from the upper left corner of the
//! picture, to the right and down. The inverse is [`ImagePlacement::recorded`]. A position without one of both axes has
//! no place. Placements follow from the pixels of the file ([`ImagePlacement::of_pixels`]), or are stated as scale and
//! origin.

use marker_files::{Axes, PixelAxes, Recording};

/// Scale and origin of recorded positions in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ImagePlacement {
    /// Place of the world's origin, px from the upper left corner to the right and down.
    pub origin: [f64; 2],
    /// Size of a pixel, m.
    pub pixel: f64,
    /// Axes of the file that are those of the world; `None` if they are equal.
    pub axes: Option<Axes>,
}

impl ImagePlacement {
    /// The placement in a picture of this `height`, px, and `width`, by the pixels in which the file of a `recording`
    /// was measured.
    pub fn of_pixels(pixels: PixelAxes, recording: &Recording, [width, height]: [u32; 2]) -> Self {
        let [x, y, _] = recording.origin.unwrap_or_default();
        let [width, height] = [width, height].map(f64::from);
        let down = |from_top: f64, from_bottom: f64| {
            if pixels.down { from_top + y } else { from_bottom - y }
        };
        let origin = match pixels.is_centered {
            true => [0.5 * width + x, down(0.5 * height, 0.5 * height)],
            false => [x, down(0.0, height)],
        };
        Self { origin, pixel: pixels.size, axes: recording.axes }
    }

    /// The place of a recorded position, m, in px from the upper left corner to the right and down. `None` if the
    /// position lacks a coordinate along an axis of the picture, or is not finite.
    pub fn place(&self, recorded: [Option<f64>; 3]) -> Option<[f64; 2]> {
        let file = self.axes.map_or(recorded, |axes| axes.to_file(recorded));
        let place =
            [self.origin[0] + file[0]? / self.pixel, self.origin[1] - file[1]? / self.pixel];
        place.iter().all(|x| x.is_finite()).then_some(place)
    }

    /// The recorded position, m, at a place in the picture, px; `None` for the coordinate along the axis of view.
    pub fn recorded(&self, [right, down]: [f64; 2]) -> [Option<f64>; 3] {
        let x = (right - self.origin[0]) * self.pixel;
        let y = (self.origin[1] - down) * self.pixel;
        let file = [Some(x), Some(y), None];
        self.axes.map_or(file, |axes| axes.to_world(file))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use marker_files::Vertical;

    /// A pixel of the file lies at the same pixel of the picture, with any direction of y, origin and axes.
    #[test]
    fn pixel_of_the_file_is_that_of_the_picture() {
        let size = [640, 480];
        for (y, is_centered, place) in [
            (Vertical::Down, false, [300.0, 100.0]),
            (Vertical::Up, false, [300.0, 380.0]),
            (Vertical::Down, true, [620.0, 340.0]),
            (Vertical::Up, true, [620.0, 140.0]),
        ] {
            for axes in [None, Some(["x", "none", "y"]), Some(["none", "-y", "x"])] {
                let axes = axes.map(|names| Axes::new(names).unwrap());
                let recording =
                    Recording { origin: Some([112.0, 305.0, 0.0]), axes, ..Recording::default() };
                let down = y == Vertical::Down;
                let pixels = PixelAxes { size: 4e-4, down, is_centered };
                let placement = ImagePlacement::of_pixels(pixels, &recording, size);
                // The conversion of the reader: less the origin, times the size, y up, in the axes of the world.
                let sign = if down { -1.0 } else { 1.0 };
                let file =
                    [Some((300.0 - 112.0) * 4e-4), Some(sign * (100.0 - 305.0) * 4e-4), None];
                let world = axes.map_or(file, |axes| axes.to_world(file));
                let found = placement.place(world).unwrap();
                for c in 0..2 {
                    assert!((found[c] - place[c]).abs() < 1e-10, "{y:?} {axes:?}: {found:?}");
                }
                let back = placement.recorded(found);
                for c in 0..3 {
                    assert!((back[c].unwrap_or(0.0) - world[c].unwrap_or(0.0)).abs() < 1e-15);
                }
            }
        }
    }
}
