//! `[[observation]]` of a fit file: its keys, and their conversion to recorded or planned motions of points, or
//! readings of sensors.
//!
//! Input: the deserialized table, the folder of the fit file and the prepared scene. A file is read as one marker (at
//! the tip by default), or as several with their points. `markers = "free"` takes markers of the scene's own recording:
//! those that prescribe neither an end nor an inner node, of a structure those that have a point. `duration`, s, with
//! `fps`, Hz, plans an observation without data. With `quantity` the table is that of a sensor (`sensor_form`). Output:
//! one [`Measurement`] per point or sensor component, each with the table's standard deviation, loss and `held_out`, in
//! SI units. With `image` the measurements have the pictures of their frames. Keys that exclude each other and missing
//! keys are errors with the key; a file that cannot be read is an error with its path, and the line if it has one. The
//! type of `sigma`, a number (m) or columns of the file ([`Sigma`]), is shared with `[[shape]]`.

use crate::error::{Error, ensure};
use crate::fit::image::{ImageForm, ImagedPosition, ImagedRow};
use crate::fit::measurement::Measurement;
use crate::fit::measurement::loss::Loss;
use crate::fit::measurement::motion::{Glitches, Observation, Sample};
use crate::fit::measurement::sensor_table::SensorQuantity;
use crate::fit::sensor_form::{GivenKey, SensorFilter, SensorForm, TareForm, refuse_given};
use crate::problem::Problem;
use crate::scene::{End, Point, StructurePoint};
use marker_files::{Axes, ColumnRules, Format, Recording, SigmaColumns, Vertical};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// `[[observation]]`: recorded or planned motion of points of the rod.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(try_from = "ObservationKeys")]
pub(crate) struct ObservationForm(ObservationKeys);

impl TryFrom<ObservationKeys> for ObservationForm {
    type Error = &'static str;

    /// Checks the required keys: `file` unless the observation is planned (`duration`) or `markers` is `"free"`, and
    /// `fps` where it is planned. The error is `missing field` with the name of the key.
    fn try_from(form: ObservationKeys) -> Result<Self, Self::Error> {
        let is_free = matches!(form.markers, Some(MarkerSelection::Recorded(_)));
        match (&form.file, form.duration) {
            (None, None) if !is_free => Err("missing field `file`"),
            (_, Some(_)) if form.fps.is_none() => Err("missing field `fps`"),
            _ => Ok(Self(form)),
        }
    }
}

/// Several markers of one recording.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "Markers"))]
#[serde(
    untagged,
    expecting = "expected \"free\", or a table of markers of the file with their points"
)]
enum MarkerSelection {
    /// Markers of the recording that drives the ends.
    Recorded(RecordedMarkers),
    /// Markers of a file by name, with their points.
    Named(BTreeMap<String, ObservedPoint>),
}

/// Observed point of one rod or of a structure.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected \"tip\", the index of a node, or { arc_length = meters from the start of the rod }; in a structure \
                 { rod = \"..\", at = \"tip\" } or { body = \"..\" }"
)]
pub(crate) enum ObservedPoint {
    /// Point of the rod.
    OfRod(Point),
    /// Point of a structure.
    OfStructure(StructurePoint),
}

impl ObservedPoint {
    /// The `observation` with this point, of one rod or of a structure, as its observed point.
    fn of(self, observation: Observation) -> Observation {
        match self {
            Self::OfRod(point) => observation.at(point),
            Self::OfStructure(place) => observation.of_structure(place),
        }
    }
}

/// Selection of markers of the recording that drives the ends.
#[derive(Clone, Copy, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema), schemars(rename = "Led"))]
#[serde(rename_all = "lowercase")]
enum RecordedMarkers {
    /// All markers that no end holds.
    Free,
}

/// Standard deviation of the positions: one number, m, or columns of the file.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "expected a number, m, the name of a column of the file, or { x = \"..\", y = \"..\" } of the columns of \
                 its axes"
)]
pub(crate) enum Sigma {
    /// One number for all positions, m.
    Number(f64),
    /// Columns of the file.
    Columns(SigmaColumns),
}

impl Sigma {
    /// The standard deviation as a number, m, or as columns of the file; the other one is `None`.
    pub fn parts(self) -> (Option<f64>, Option<SigmaColumns>) {
        match self {
            Self::Number(sigma) => (Some(sigma), None),
            Self::Columns(columns) => (None, Some(columns)),
        }
    }
}

/// Keys of `[[observation]]`.
#[derive(Clone, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct ObservationKeys {
    /// Table, or file of a tracking program.
    file: Option<PathBuf>,
    /// Several markers with their points, or `"free"`.
    markers: Option<MarkerSelection>,
    /// Use every n-th frame; default 1.
    every: Option<usize>,
    /// Treatment of frames in which a marker jumps.
    glitches: Option<Glitches>,
    /// Observed point; default: the tip of the rod. In a structure `{ rod = "..", at = "tip" }` or `{ body = ".." }`.
    #[serde(alias = "node")]
    point: Option<ObservedPoint>,
    /// Position of the marker, or of the sensor of a strain, relative to the point of the centerline, m, in axes that
    /// move with the rod: tangent, first and second director. Two numbers are along both directors. Default: none of a
    /// marker; required of a strain.
    #[serde(default, deserialize_with = "crate::input::arrays::some_three_or_last_two")]
    #[cfg_attr(test, schemars(with = "Vec<f64>", length(min = 2, max = 3)))]
    offset: Option<[f64; 3]>,
    /// Standard deviation of a coordinate, m, or columns of the file; default: estimated from the
    /// residuals.
    sigma: Option<Sigma>,
    /// Loss function of the residuals.
    #[serde(default)]
    loss: Loss,
    /// Whether the observation is validation data: predicted, not fitted.
    #[serde(default)]
    held_out: bool,
    /// Program that wrote the file; default: determined from the first bytes.
    format: Option<Format>,
    /// Columns of a table by name or number, where the header has other names or is missing.
    columns: Option<ColumnRules>,
    /// Name of the marker in the file, where there are several.
    marker: Option<String>,
    /// Confidence below which positions are treated as missing.
    likelihood: Option<f64>,
    /// Axes of the file that are the world's x, y and z.
    axes: Option<Axes>,
    /// Frames per second, Hz, of a file with frame numbers or of a planned observation.
    fps: Option<f64>,
    /// Meters per pixel, or per length unit where the file states none.
    scale: Option<f64>,
    /// Position of the world's origin in the file's own coordinates and unit.
    #[serde(default, deserialize_with = "crate::input::arrays::some_numbers")]
    origin: Option<[f64; 3]>,
    /// Direction of the file's y axis.
    y: Option<Vertical>,
    /// Time on the file's own clock, in its unit, at which the motion starts.
    time_zero: Option<f64>,
    /// Duration of a planned observation, s, instead of a file.
    duration: Option<f64>,
    /// Quantity of a sensor instead of a position: force or moment of a support on the rod, or acceleration, angle,
    /// curvature, strain or pose (orientation) of a point.
    quantity: Option<SensorQuantity>,
    /// End of the rod with the support of the sensor.
    of: Option<End>,
    /// Rigid body of an export of OptiTrack Motive whose rotation a pose has; default: the only one.
    body: Option<String>,
    /// Rotation vector of the frame of the sensor, rad, beyond `axes`.
    #[serde(default, deserialize_with = "crate::input::arrays::some_numbers")]
    rotation: Option<[f64; 3]>,
    /// Offset of the readings: `"free"`, or three numbers in the axes of the file, two of a curvature, one of an angle
    /// or strain, in the unit of the quantity; default 0. With `"free"` the mounting rotation of a pose is unknown.
    tare: Option<TareForm>,
    /// Filter of the sensor, which is applied to the model too.
    filter: Option<SensorFilter>,
    /// Name of the sensor in `[[sensors]]` of the scene, with rotation, delay and filter that can be identified.
    sensor: Option<String>,
    /// Pictures of the frames, over which the page of the fit draws data and model: `"frame_{:04}.png"`, or a table.
    image: Option<ImageForm>,
    /// First and last time of the readings of a sensor that are used, s after the start of the motion; default: all.
    #[serde(default, deserialize_with = "crate::input::arrays::some_numbers")]
    window: Option<[f64; 2]>,
}

impl ObservationForm {
    /// The measurements of the table, whose `key` in the fit file is named in errors. With `quantity`: the components
    /// of a sensor. With `duration`: one planned point. With `markers = "free"`: markers of the recording of the scene
    /// in `problem` ([`Observation::of_free_markers`]). Else those of a file, whose path is relative to `folder`: one
    /// point, by default the tip, or one measurement per named marker. Sigma, loss and `held_out` of the table apply to
    /// each of them. An error for keys that exclude each other, and files that cannot be read.
    pub fn read(
        self,
        folder: &Path,
        problem: &Problem,
        key: &str,
    ) -> Result<Vec<Measurement>, Error> {
        let Self(form) = self;
        let ObservationKeys { file, markers, format, columns, marker, likelihood, axes, .. } = form;
        let ObservationKeys { fps, scale, origin, y, time_zero, point, .. } = form;
        let ObservationKeys { offset, sigma, loss, held_out, .. } = form;
        let (sigma, sigma_columns) = sigma.map_or((None, None), Sigma::parts);
        let measurement = |o: Observation| {
            o.offset(offset.unwrap_or_default()).with_properties(sigma, loss, held_out).into()
        };
        let recording = Recording {
            format,
            columns,
            marker,
            likelihood,
            axes,
            fps,
            scale,
            origin,
            y,
            time_zero,
            sigma: sigma_columns,
        };
        if let Some(quantity) = form.quantity {
            let positions = [
                GivenKey("duration", form.duration.is_some()),
                GivenKey("markers", markers.is_some()),
                GivenKey("every", form.every.is_some()),
                GivenKey("glitches", form.glitches.is_some()),
                GivenKey("image", form.image.is_some()),
            ];
            let allowed = "this key with positions only";
            refuse_given(key, &positions, "a key of a position with quantity", allowed)?;
            let point = match point {
                Some(ObservedPoint::OfRod(point)) => Some(point),
                Some(ObservedPoint::OfStructure(_)) => {
                    let (found, allowed) =
                        ("a point of a structure with quantity", "a point of one rod");
                    return Err(Error::invalid(format!("{key}.point"), found, allowed));
                }
                None => None,
            };
            let rotation = form.rotation.unwrap_or_default();
            let (of, tare, filter, window) = (form.of, form.tare, form.filter, form.window);
            let sensor = form.sensor;
            let body = form.body;
            let form = SensorForm {
                quantity,
                of,
                point,
                file,
                rotation,
                offset,
                body,
                tare,
                filter,
                sensor,
                window,
                recording,
                sigma,
                loss,
                held_out,
            };
            return form.read(folder, problem, key);
        }
        let sensors = [
            GivenKey("of", form.of.is_some()),
            GivenKey("body", form.body.is_some()),
            GivenKey("rotation", form.rotation.is_some()),
            GivenKey("tare", form.tare.is_some()),
            GivenKey("filter", form.filter.is_some()),
            GivenKey("sensor", form.sensor.is_some()),
            GivenKey("window", form.window.is_some()),
        ];
        let allowed = "together with quantity only";
        refuse_given(key, &sensors, "a key of a sensor", allowed)?;
        // A planned observation has times and coordinates, and no keys of files.
        if let Some(duration) = form.duration {
            let recorded = Recording { axes: None, fps: None, ..recording.clone() };
            let alone = form.every.is_none() && form.glitches.is_none() && markers.is_none();
            let no_image = [GivenKey("image", form.image.is_some())];
            refuse_given(
                key,
                &no_image,
                "pictures of a planned observation",
                "none without a file",
            )?;
            let allowed = "only point, offset, fps, axes, sigma and held_out together with the \
                           duration of a planned observation";
            let is_plan = file.is_none() && alone && recorded == Recording::default();
            ensure(is_plan, format!("{key}.duration"), duration, allowed)?;
            let planned = Observation::planned(duration, fps.unwrap_or_default());
            let planned = planned.map_err(|error| error.below(key))?;
            let mut planned = match point {
                Some(point) => point.of(planned),
                None => planned,
            };
            // A camera may record two coordinates only: `axes` of a plan selects them.
            if let Some(axes) = axes {
                planned.samples.iter_mut().for_each(|s| s.position = axes.to_world(s.position));
            }
            return Ok(vec![measurement(planned)]);
        }
        // Markers of a file need the file; free markers are those of the scene's recording.
        let Some(MarkerSelection::Recorded(RecordedMarkers::Free)) = markers else {
            let free = [
                GivenKey("every", form.every.is_some()),
                GivenKey("glitches", form.glitches.is_some()),
            ];
            let allowed = "with markers = \"free\" only";
            refuse_given(key, &free, "an observation without markers", allowed)?;
            // A file with named markers has one measurement per marker, another file only one.
            let file = marker_files::file::at(folder, &file.unwrap_or_default());
            let pictured = |reads: &mut [Observation]| match &form.image {
                Some(image) => add_images(reads, image, folder, key, &recording),
                None => Ok(()),
            };
            let Some(MarkerSelection::Named(markers)) = markers else {
                let mut reads = [Observation::read_as(file, &recording)?];
                pictured(&mut reads)?;
                let [read] = reads;
                return Ok(vec![measurement(match point {
                    Some(point) => point.of(read),
                    None => read,
                })]);
            };
            let are_alone = recording.marker.is_none() && point.is_none() && !markers.is_empty();
            let found = format!("{} markers together with marker or point", markers.len());
            let allowed = "at least one marker with its point, and neither marker nor point in \
                           the observation";
            ensure(are_alone, format!("{key}.markers"), found, allowed)?;
            // The reader takes points of one rod; those of the table, also of structures, replace the tips.
            let tips = markers.keys().map(|name| (name.clone(), Point::Tip)).collect();
            let mut reads = Observation::read_markers(file, &recording, &tips)?;
            pictured(&mut reads)?;
            let pairs = reads.into_iter().zip(markers.into_values());
            let placed = pairs.map(|(read, point)| point.of(read));
            return Ok(placed.map(measurement).collect());
        };
        // Free markers have their points and files by the scene: keys of files contradict them.
        let no_image = [GivenKey("image", form.image.is_some())];
        refuse_given(
            key,
            &no_image,
            "pictures with markers = \"free\"",
            "with a file in pixels only",
        )?;
        let are_alone = file.is_none() && point.is_none() && recording == Recording::default();
        let allowed = "no file, point or keys of files together with markers = \"free\", which \
                       are markers of supports.path";
        ensure(are_alone, format!("{key}.markers"), "\"free\"", allowed)?;
        let every = form.every.unwrap_or(1);
        let glitches = form.glitches.unwrap_or_default();
        let free = Observation::of_free_markers(problem, every, glitches);
        let free = free.map_err(|error| error.below(key))?;
        Ok(free.into_iter().map(measurement).collect())
    }
}

/// Adds the pictures of the key `image` to the observations of one file, which share them. `key` is that of the table,
/// names are relative to `folder`. Positions along all three axes are an error, as a picture shows two; the other
/// errors are those of [`ImageForm`].
fn add_images(
    reads: &mut [Observation],
    image: &ImageForm,
    folder: &Path,
    key: &str,
    recording: &Recording,
) -> Result<(), Error> {
    let samples = reads.iter().flat_map(|read| read.samples.iter().zip(&read.header.frames));
    let row = |(sample, frame): (&Sample, &f64)| ImagedRow {
        frame: *frame,
        time: sample.time,
        position: sample.position,
    };
    let rows: Vec<ImagedRow> = samples.map(row).collect();
    let pixels = reads.first().and_then(|read| read.header.pixels);
    let images = image.of_motion(folder, key, &rows, pixels, recording)?;
    for read in reads {
        read.header.images = images.clone();
        let position =
            |sample: &Sample| ImagedPosition { time: sample.time, position: sample.position };
        read.header.imaged = read.samples.iter().map(position).collect();
    }
    Ok(())
}
