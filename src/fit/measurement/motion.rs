//! Recorded motions: positions of a point of the rod, or of a marker beside it, over time.
//!
//! Input: a CSV table or a file of a tracking program, converted to s and m (`read`, `read_as`, `read_markers`), or a
//! plan of duration and frame rate (`planned`). `of_free_markers` takes the markers of the scene's own recording that
//! prescribe neither an end nor an inner node, or of a structure's recording those that have a point. Output:
//! [`Observation`], a data set whose differences in a fit are simulated less observed coordinate of the point, m, as
//! the camera of the scene records it. Coordinates that were not observed are `None` and have no difference. The point
//! is the tip unless `at` or `of_structure` sets another one; `offset` sets the position of a marker beside it.
//!
//! Times are on the recording's clock, s, and must increase. Files that cannot be read, points that are not on the rod,
//! and times after the end of the simulation are errors. Late times are allowed if the camera's clock has an offset,
//! given or unknown. [`PointMotion`] also has the spread, the largest speed and the rise time (about half the first
//! period), from which a search chooses how much of the record it fits first, and time steps.

use crate::error::{Error, ensure};
use crate::fit::measurement::dataset::{Abscissa, DataKind, Dataset, Header, ValidationContext};
use crate::fit::measurement::quantity::GaugeScalar;
use crate::fit::measurement::simulated::{Requirements, SimulatedOutput};
use crate::fit::structure::structure_places::check_place;
use crate::numerics::scalar::Scalar;
use crate::problem::Problem;
use crate::scene::marker::{MarkerStencil, is_beside};
use crate::scene::mesh::Mesh;
use crate::scene::track::Marker;
use crate::scene::validate::positive;
use crate::scene::{Point, StructurePoint, StructureScene, Track};
use crate::structure::StructureNodes;
use marker_files::{MarkerTrajectory, Recording, is_finite};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Largest number of planned samples; more are a mistake in the units.
const MOST_PLANNED: f64 = 1e6;
/// Smallest distance of the end of the first swing, over the largest distance in the record. A smaller one takes noise
/// as a swing.
const SWING: f64 = 0.3;
/// Distance, over that of the first swing so far, below which the swing has ended. A larger one ends at a smaller
/// return.
const RETURN: f64 = 0.8;
/// Distance that has risen, over that of the first swing: its end itself is flat, and its time uncertain.
const RISEN: f64 = 0.9;

/// An observed position of the point at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time on the recording's clock, s.
    pub time: f64,
    /// World coordinates x, y and z, m; `None` where not observed.
    pub position: [Option<f64>; 3],
}

impl Sample {
    /// Distance, m, from the point `from`, over the coordinates that both have.
    fn distance(&self, from: [Option<f64>; 3]) -> f64 {
        let parts = (0..3).filter_map(|c| Some((self.position[c]? - from[c]?).powi(2)));
        parts.sum::<f64>().sqrt()
    }
}

/// Treatment of frames in which a marker jumps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Glitches {
    /// Frames with glitches are compared as all others.
    #[default]
    Keep,
    /// Frames with glitches and two frames on each side are excluded.
    Mask,
}

/// Positions of a point of the rod, or of a marker fixed beside it, at increasing times.
#[derive(Clone, Debug)]
pub struct PointMotion {
    /// The observed point of the rod.
    pub point: Point,
    /// Position of the marker relative to that point of the centerline, m, in the axes of the rod there: along the
    /// tangent, the first director, and the second one, perpendicular to both. The first director is the section's
    /// `up`; of a circle or a tube it is the y axis, or the x axis where the rod begins along y. Its component along
    /// the rod is removed.
    pub offset: [f64; 3],
    /// Observed positions at increasing times.
    pub samples: Vec<Sample>,
    /// Name of the marker in the recording that prescribes the ends; `None` of other recordings.
    pub marker: Option<String>,
    /// The observed point of a structure, instead of `point`; `None` of one rod.
    pub place: Option<StructurePoint>,
}

/// The recorded motion of a point with its header.
pub type Observation = Dataset<PointMotion>;

impl Observation {
    /// Observed positions of the tip, without offset of a marker, with unknown noise and squared loss.
    ///
    /// ```
    /// use rodfit::fit::Sample;
    /// use rodfit::{Observation, Point};
    /// let sample = Sample { time: 0.1, position: [Some(0.5), Some(-0.02), None] }; // s, m
    /// let observation = Observation::new(vec![sample]).at(Point::Tip).sigma(1e-3); // m
    /// assert_eq!(observation.values(), 2);
    /// ```
    pub fn new(samples: Vec<Sample>) -> Self {
        Self { header: Header::in_meters(), data: PointMotion::new(samples) }
    }

    /// A planned recording of the tip at `rate` frames per second, in all three coordinates, from the start of the
    /// simulation on. Times are `k/rate` from 0 to the last one within the `duration`, s; positions are zeros as
    /// placeholders. [`Fit::design`](crate::Fit::design) computes its expected uncertainty.
    ///
    /// # Errors
    ///
    /// Numbers that are not above 0, less than one frame, or more than a million.
    pub fn planned(duration: f64, rate: f64) -> Result<Self, Error> {
        positive("duration", duration)?;
        positive("fps", rate)?;
        // A whole number of frames must not lose the last one by rounding.
        let frames = (duration * rate * (1.0 + 1e-12)).floor();
        let found = format!("{rate} frames per second for {duration} s, {frames} frames");
        let allowed = format!("1 to {MOST_PLANNED} frames");
        ensure((1.0..=MOST_PLANNED).contains(&frames), "fps", found, allowed)?;
        let sample = |k: usize| Sample { time: k as f64 / rate, position: [Some(0.0); 3] };
        let samples = (0..=frames as usize).map(sample).collect();
        let mut planned = Self::new(samples);
        planned.header.planned = true;
        Ok(planned)
    }

    /// The free markers of the recording that prescribes the ends in `problem`: those that prescribe neither an end nor
    /// an inner node. One observation each, at its node, with every `every`-th frame from the third one to the end of
    /// the simulation. The first two frames are left out, as a recorded start begins from them. So are frames without a
    /// position of the marker, and with `Glitches::Mask` also frames with glitches and their neighbors. Markers without
    /// positions are left out. For a structure they are the markers that are assigned to its points.
    ///
    /// # Errors
    ///
    /// A scene without a recording or without free markers with positions, `every` = 0, and a scene without time.
    pub fn of_free_markers(
        problem: &Problem,
        every: usize,
        glitches: Glitches,
    ) -> Result<Vec<Self>, Error> {
        if let Some(structure) = &problem.scene().structure {
            return Self::of_structure_markers(problem, structure, every, glitches);
        }
        let Some(path) = &problem.scene().supports.path else {
            let allowed = "only with a scene that has [supports.path]";
            return Err(Error::invalid("markers", "\"free\"", allowed));
        };
        ensure(every > 0, "every", 0, "1 or more frames")?;
        // Recorded markers of the scene are at nodes, at the times of its recording.
        let (track, end) = (path.track()?, problem.time()?.end * (1.0 + 1e-9));
        let nodes = path.nodes(problem.segments())?;
        let supports = &problem.scene().supports;
        // Held markers prescribe the motion: compared with it, they would have no residuals.
        let markers = path.free_markers([supports.start, supports.end]);
        let observation = |j: usize| {
            let marker = Self::of_marker(track, &track.markers()[j], end, every, glitches);
            marker.at(Point::Node(nodes[j]))
        };
        let free = markers.into_iter().map(observation);
        let free: Vec<Self> = free.filter(|o| o.values() > 0).collect();
        ensure(!free.is_empty(), "markers", "no free marker with positions", "one at least")?;
        Ok(free)
    }

    /// Every `every`-th frame of a marker of a track up to the time `end`, s, from the third frame on: the first two
    /// give the places and velocities at t = 0. Frames without a position of the marker, and with `Glitches::Mask` also
    /// those with glitches and their neighbors, are left out.
    fn of_marker(
        track: &Track,
        marker: &Marker,
        end: f64,
        every: usize,
        glitches: Glitches,
    ) -> Self {
        let frames = (2..track.times().len()).step_by(every);
        let kept = frames.filter(|k| {
            track.times()[*k] <= end
                && !(glitches == Glitches::Mask && track.is_spoiled(marker, *k))
        });
        // Frames without a position of the marker have no sample.
        let sample = |k: usize| {
            let position = marker.seen[k]?.map(Some);
            Some(Sample { time: track.times()[k], position })
        };
        let mut observation = Self::new(kept.filter_map(sample).collect());
        observation.marker = Some(marker.name.clone());
        observation
    }

    /// The markers of the recording of a `structure` that are assigned to its points, one observation each, with frames
    /// as in [`of_free_markers`](Self::of_free_markers). Markers without positions are left out. Errors: no recording,
    /// `every` = 0, and no marker with positions.
    fn of_structure_markers(
        problem: &Problem,
        structure: &StructureScene,
        every: usize,
        glitches: Glitches,
    ) -> Result<Vec<Self>, Error> {
        let Some(recording) = &structure.recording else {
            let allowed = "only with a structure that has [recording]";
            return Err(Error::invalid("markers", "\"free\"", allowed));
        };
        ensure(every > 0, "every", 0, "1 or more frames")?;
        let (track, end) = (recording.track()?, problem.time()?.end * (1.0 + 1e-9));
        let mut free = Vec::new();
        for (name, place) in &recording.markers {
            let j = recording.marker(&format!("recording.markers.{name}"), name)?;
            let marker = &track.markers()[j];
            let observation = Self::of_marker(track, marker, end, every, glitches);
            if observation.values() > 0 {
                free.push(observation.of_structure(place.clone()));
            }
        }
        ensure(!free.is_empty(), "markers", "no observed marker with positions", "one at least")?;
        Ok(free)
    }

    /// Reads a CSV file, or one of another program, as [`read_as`](Self::read_as) does, in SI units or those of the
    /// file, as an observation of the tip.
    ///
    /// ```
    /// use rodfit::{Observation, Point};
    /// let observation = Observation::read("data/cantilever-tip.csv")?.at(Point::Tip);
    /// assert!(observation.samples.len() > 50 && observation.samples[0].time >= 0.0); // s
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or a line of it that makes no sense, with its number.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read_as(path, &Recording::default())
    }

    /// Reads a CSV file with a column t (or time, or frame) and at least one of x, y, z, in any
    /// order, separated by commas, semicolons (then with decimal commas or points) or tabs. Units
    /// stand in brackets or parentheses, `t[ms],x[mm]`; without them s and m. Blank or NaN is
    /// missing; lines that start with `#` are comments. The format of files of [other programs](crate::fit::Format) is
    /// determined from their first bytes. `recording` has the marker, and the conversion to seconds and meters.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or a line of it that makes no sense, with its number.
    pub fn read_as(path: impl AsRef<Path>, recording: &Recording) -> Result<Self, Error> {
        let path = path.as_ref();
        Ok(Self::from_trajectory(path, recording, marker_files::read(path, recording)?))
    }

    /// The observation of the tip by the trajectory `read` of a marker in the file at `path`. It has the interpretation
    /// `recording`, the numbers of dropped rows, and standard deviations if the file has them.
    fn from_trajectory(path: &Path, recording: &Recording, read: MarkerTrajectory) -> Self {
        let pairs = read.times.into_iter().zip(read.positions);
        let samples = pairs.map(|(time, position)| Sample { time, position }).collect();
        let mut own = Self::new(samples).with_source(path, recording, read.dropped);
        (own.header.frames, own.header.pixels) = (read.frames, read.pixels);
        own.sigmas(&read.sigmas)
    }

    /// Reads several markers of a file, by their names, each at its point of the rod; one observation each, in the
    /// alphabetical order of the names.
    ///
    /// # Errors
    ///
    /// Those of [`read_as`](Self::read_as).
    pub fn read_markers(
        path: impl AsRef<Path>,
        recording: &Recording,
        markers: &BTreeMap<String, Point>,
    ) -> Result<Vec<Self>, Error> {
        let path = path.as_ref();
        let names = markers.keys().map(String::as_str);
        let read = marker_files::read_several(path, recording, names)?.into_iter();
        let observation = |(trajectory, (name, point)): (MarkerTrajectory, (&String, &Point))| {
            let own = Recording { marker: Some(name.clone()), ..recording.clone() };
            Self::from_trajectory(path, &own, trajectory).at(*point)
        };
        Ok(read.zip(markers).map(observation).collect())
    }

    /// The observation with another observed point of the rod than the tip.
    pub fn at(mut self, point: Point) -> Self {
        self.point = point;
        self
    }

    /// The observation of a point of a structure, `place`, instead of a point of one rod.
    ///
    /// ```
    /// use rodfit::scene::StructurePoint;
    /// let recorded = rodfit::Observation::new(Vec::new()).of_structure(StructurePoint::tip("arm"));
    /// assert_eq!(recorded.place, Some(StructurePoint::tip("arm")));
    /// ```
    pub fn of_structure(mut self, place: StructurePoint) -> Self {
        self.data.place = Some(place);
        self
    }

    /// The observation with a marker at this [offset](PointMotion::offset) from the centerline, m.
    pub fn offset(mut self, offset: [f64; 3]) -> Self {
        self.data.offset = offset;
        self
    }
}

impl PointMotion {
    /// The motion of the tip, without offset of a marker, with these samples.
    pub(crate) fn new(samples: Vec<Sample>) -> Self {
        Self { point: Point::Tip, offset: [0.0; 3], samples, marker: None, place: None }
    }

    /// The stencil (nodes with weights, and the offset in the axes of the rod) of the observed point on a mesh, or
    /// among the nodes of a structure. Error: a point that is not on it.
    pub(crate) fn stencil<D: Scalar>(
        &self,
        mesh: &Mesh<D>,
        structure: Option<&StructureNodes<'_, D>>,
    ) -> Result<MarkerStencil<D>, Error> {
        match (&self.place, structure) {
            (Some(place), Some(nodes)) => {
                // Validation has rejected offsets from a rod of a structure; those of bodies are in the place.
                let centre = nodes.stencil(place, "observation.point")?;
                Ok(MarkerStencil { centre, edges: Vec::new(), offset: [0.0; 3] })
            }
            _ => MarkerStencil::new(self.point.fixed(), self.offset, mesh),
        }
    }

    /// Smallest and largest observed values of each coordinate, m; none of a coordinate that was never observed.
    pub(crate) fn recorded_range(&self) -> [Option<[f64; 2]>; 3] {
        std::array::from_fn(|c| {
            let observed = self.samples.iter().filter_map(|s| s.position[c]);
            observed.map(|x| [x; 2]).reduce(|[low, high], [x, _]| [low.min(x), high.max(x)])
        })
    }

    /// Root mean square distance of all observed coordinates from their means, m; zero without samples.
    pub(crate) fn spread(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for c in 0..3 {
            let seen: Vec<f64> = self.samples.iter().filter_map(|s| s.position[c]).collect();
            // Each coordinate is taken about its own mean, so that the origin has no effect.
            let mean = seen.iter().sum::<f64>() / seen.len().max(1) as f64;
            sum += seen.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
            count += seen.len() as f64;
        }
        (sum / f64::max(count, 1.0)).sqrt()
    }

    /// The largest mean speed between two neighboring samples, m/s, by the coordinates that both have; zero with fewer
    /// than two samples.
    pub(crate) fn largest_speed(&self) -> f64 {
        let speed = |pair: &[Sample]| {
            let both = pair[0].position.iter().zip(pair[1].position);
            let square = both.filter_map(|(a, b)| Some((b? - (*a)?).powi(2))).sum::<f64>();
            let time = pair[1].time - pair[0].time;
            if time > 0.0 { square.sqrt() / time } else { 0.0 }
        };
        self.samples.windows(2).map(speed).fold(0.0, f64::max)
    }

    /// The first observed value of each coordinate, m; none of a coordinate that was not observed.
    fn first_coordinates(&self) -> [Option<f64>; 3] {
        [0, 1, 2].map(|c| self.samples.iter().find_map(|s| s.position[c]))
    }

    /// The largest distance of a sample from the first observed value of each coordinate, m; 0 without samples.
    pub(crate) fn largest_distance(&self) -> f64 {
        let first = self.first_coordinates();
        self.samples.iter().map(|s| s.distance(first)).fold(0.0, f64::max)
    }

    /// Time, s, of the first sample at [`RISEN`] times the size of the first swing: about half a period of a free
    /// vibration. Distances are from the first observed value of each coordinate. The swing grows with the distance of
    /// the samples that have all coordinates of the record; its size is the largest one. It ends where the distance
    /// falls below [`RETURN`] of its size so far, if this is at least [`SWING`] of the largest distance in the record.
    /// In space the largest may come much later, when sideways motion has built up. Zero without samples.
    pub(crate) fn rise_time(&self) -> f64 {
        let first = self.first_coordinates();
        let distance = |s: &Sample| s.distance(first);
        // A sample that lacks coordinates has too small a distance.
        let whole = |s: &&Sample| (0..3).all(|c| first[c].is_some() == s.position[c].is_some());
        let farthest = self.largest_distance();
        let mut swing = 0.0_f64;
        for sample in self.samples.iter().filter(whole) {
            let d = distance(sample);
            if swing >= SWING * farthest && d < RETURN * swing {
                break;
            }
            swing = swing.max(d);
        }
        let risen = self.samples.iter().find(|s| distance(s) >= RISEN * swing);
        risen.map_or(0.0, |s| s.time)
    }
}

impl DataKind for PointMotion {
    /// Name of the table of this kind of data in a fit file: `observation`.
    fn table(&self) -> &'static str {
        "observation"
    }

    /// The file, with the name of the marker if one is selected. Without a file: `marker` and its name, or
    /// `observation of` and the point, after `planned` if it is.
    fn label(&self, header: &Header) -> String {
        let named = header.recording.as_ref().and_then(|r| r.marker.as_ref());
        match (&header.source, &self.marker) {
            (Some(path), _) => match named {
                Some(marker) => format!("{}, {marker}", path.display()),
                None => path.display().to_string(),
            },
            (None, Some(marker)) => format!("marker {marker}"),
            (None, None) => {
                let planned = if header.planned { "planned " } else { "" };
                let point = match (&self.place, self.point) {
                    (Some(place), _) => place.to_string(),
                    (None, Point::Tip) => "the tip".to_string(),
                    (None, Point::Node(index)) => format!("node {index}"),
                    (None, Point::ArcLength(s)) => format!("arc length {s} m"),
                };
                format!("{planned}observation of {point}")
            }
        }
    }

    /// The abscissa of plots: time.
    fn abscissa(&self) -> Abscissa {
        Abscissa::Time
    }

    /// Time of every sample on the clock of the recording, s, in their order.
    fn abscissas(&self, _problem: &Problem) -> Vec<f64> {
        self.samples.iter().map(|s| s.time).collect()
    }

    /// The observed position of every sample, m, with `None` for coordinates that were not observed.
    fn positions(&self) -> Vec<[Option<f64>; 3]> {
        self.samples.iter().map(|s| s.position).collect()
    }

    /// Mutable references to the observed position of every sample, m, in their order.
    fn positions_mut(&mut self) -> Vec<&mut [Option<f64>; 3]> {
        self.samples.iter_mut().map(|s| &mut s.position).collect()
    }

    /// The time of every value on the clock of the recording, s: that of a sample once for each of its observed
    /// coordinates.
    fn times(&self) -> Vec<Option<f64>> {
        let values = |s: &Sample| s.position.iter().flatten().count();
        self.samples.iter().flat_map(|s| std::iter::repeat_n(Some(s.time), values(s))).collect()
    }

    /// Root mean square distance of all observed coordinates from their means, m: the spread of the motion; zero
    /// without samples.
    fn size(&self, _problem: &Problem) -> f64 {
        self.spread()
    }

    /// Rejects a point that is not on the rod, an offset longer than the rod, and positions that are not finite.
    /// Rejects times that are negative, not finite or do not strictly increase. Times after the end of the simulation
    /// are rejected unless the clock has an offset, given or unknown (`other_clock`). Errors have the key of the table
    /// or the label. An error without a time of the scene.
    fn check(&self, header: &Header, context: &ValidationContext) -> Result<(), Error> {
        let ValidationContext { problem, key, label, other_clock, .. } = context;
        match check_place(problem, self.place.as_ref(), self.offset, key)? {
            true => {}
            false => drop(
                problem
                    .stencil(self.point)
                    .map_err(|error| error.at_key(format!("{key}.point"), "of the rod"))?,
            ),
        }
        // A marker farther from the rod than its length is most likely in another unit.
        let size = self.offset.iter().map(|x| x * x).sum::<f64>().sqrt();
        let (length, found) = (problem.length(), format!("{:?}", self.offset));
        let allowed = format!("up to the rod's length, {length} m");
        ensure(size <= length, format!("{key}.offset"), found, allowed)?;
        let end = problem.time()?.end;
        // Samples after the simulated time have no simulated position, unless the offset of the clock is unknown.
        let late = self.samples.iter().find(|s| s.time > end * (1.0 + 1e-9));
        if let Some(late) = late.filter(|_| !other_clock) {
            let found = format!("t = {} s", late.time);
            let allowed = format!("up to the scene's time.end = {end} s");
            return Err(match header.planned {
                true => Error::invalid(format!("{key}.duration"), found, allowed),
                false => {
                    let missing = "check the unit in the header, as in t[ms], time_zero (time in \
                                   the file at which the motion starts), and time.end";
                    Error::invalid(*label, found, format!("{allowed}; {missing}"))
                }
            });
        }
        let invalid_sample = |s: &Sample| match s.time.is_finite() && s.time >= 0.0 {
            false => Some(format!("t = {} s", s.time)),
            true if is_finite(s.time, &s.position) => None,
            true => Some(format!("an infinite position at t = {} s", s.time)),
        };
        let invalid_order = || {
            let pair = self.samples.windows(2).find(|w| w[0].time >= w[1].time)?;
            Some(format!("{} s after {} s", pair[1].time, pair[0].time))
        };
        match self.samples.iter().find_map(invalid_sample).or_else(invalid_order) {
            Some(found) => {
                let allowed = "finite positions at increasing times from 0 on";
                Err(Error::invalid(*label, found, allowed))
            }
            None => Ok(()),
        }
    }

    /// Removes samples after the `horizon`, s, in place.
    fn prepare(&mut self, _problem: &Problem, horizon: f64) {
        self.samples.retain(|s| s.time <= horizon);
    }

    /// Adds to the required `outputs` the motion of the point, whether a marker is beside it (offset not zero), the
    /// time of the last sample, and the range of the recorded coordinates.
    fn require(&self, outputs: &mut Requirements) {
        match &self.place {
            Some(place) => outputs.moving_places.push(place.clone()),
            None => outputs.moving.push(self.point),
        }
        if is_beside(self.offset) {
            outputs.beside.push(self.point);
        }
        let last = self.samples.last().map_or(0.0, |s| s.time);
        outputs.last_recorded = outputs.last_recorded.max(last);
        for (all, own) in outputs.recorded_range.iter_mut().zip(self.recorded_range()) {
            *all = match (*all, own) {
                (Some([low, high]), Some(own)) => Some([low.min(own[0]), high.max(own[1])]),
                (all, own) => all.or(own),
            };
        }
    }

    /// Calls `each` with simulated less observed coordinate, m, sample by sample, observed coordinates only. The
    /// simulated position is that of the marker at the sample's time on the clock of the motion, as the camera records
    /// it. Nothing without a simulated motion. An error for a point that is not on the rod and times after the end of
    /// the motion.
    fn differences<D: GaugeScalar>(
        &self,
        simulated: &SimulatedOutput<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error> {
        let Some(moving) = simulated.moving else { return Ok(()) };
        let marker = self.stencil(simulated.mesh, simulated.structure)?;
        for sample in &self.samples {
            let time = simulated.view.sample_time(sample.time, &sample.position);
            let position = moving.marker(&marker, time)?;
            simulated.compare(position, &sample.position, each);
        }
        Ok(())
    }
}
