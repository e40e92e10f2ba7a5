//! Candidate designs of a planned experiment: other marker positions, durations and frame rates of its recordings.
//!
//! [`CandidateDesigns::new`] adds candidate recordings to the planned ones. For the first [`MOST_MOVED`] recordings
//! these have the marker on the center line at other arc lengths, of [`MARKER_POSITIONS`] along the rod. For every
//! recording with a usual (median) spacing of frames there are frames after the end (none where a support follows a
//! file), and frames between the planned ones. All are simulated together, with one Jacobian. The standard errors of
//! each candidate design follow from its rows of that Jacobian and those of the priors, by the covariance `(J'J)^-1`
//! with stated noise. [`standard_errors`] returns one per unknown in its unit, none if unidentified.
//!
//! `experiments` returns the planned experiments with the candidate recordings after the planned measurements of each.
//! `planned` selects the rows of the planned measurements and the priors, `end` is the number of rows of all
//! measurements. `planned_blocks` are the rows of each planned measurement, and `fill` overwrites the placeholders of
//! the plan by simulated values.
//!
//! [`CandidateDesigns::advice`] lists the candidate designs for the report of a plan: by arc length (m) for each
//! recording with candidate positions. Each experiment with a motion has a list by duration (s), and one by frame rate
//! (1/s) if its frames have a usual spacing. All are ascending. In each the best choice is marked. Of positions it is
//! that with the smallest geometric mean of the errors on the scales of the unknowns (relative for positive ones; an
//! unidentified one counts [`NOT_IDENTIFIED`]). Of durations and rates it is the smallest within [`NEARLY_BEST`] of the
//! least mean. Nothing is marked where no choice identifies any parameter.

use crate::error::Error;
use crate::fit::design::report::{Advice, Choice, DesignVariable};
use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::motion::{Observation, PointMotion, Sample};
use crate::fit::misfit::ar1::usual_spacing;
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::unknown::{ParameterPoint, Unknown};
use crate::numerics::total_order;
use crate::scene::{Contact, Point};
use std::ops::Range;
use std::path::Path;

/// Number of candidate positions of a marker, at equal parts of the length of the rod. Larger: finer choices and more
/// rows.
const MARKER_POSITIONS: usize = 10;
/// Smallest distance of a candidate position from the planned one, over the length of the rod.
const LEAST_MOVE: f64 = 1e-2;
/// Largest number of recordings with candidate positions: each has ten times the rows.
const MOST_MOVED: usize = 4;
/// Longest candidate duration, over that of the plan. Larger: a longer simulation.
const LONGER: f64 = 2.0;
/// Divisors of the planned duration and frame rate.
const DIVISORS: [usize; 3] = [8, 4, 2];
/// Factors on the planned frame rate.
const RATE_FACTORS: [usize; 2] = [2, 4];
/// Largest error of a recommended duration or rate, over the smallest error: the shortest such record is recommended.
const NEARLY_BEST: f64 = 1.05;
/// Standard deviation of an unknown that is not identified, on its scale, in the comparison of candidates: larger than
/// that of any identified one.
const NOT_IDENTIFIED: f64 = 1e3;
/// Factor on times that are compared with the end of a record, so that rounding errors drop no frame.
const ROUNDING: f64 = 1.0 + 1e-9;

/// Origin of the rows of a candidate recording.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CandidateKind {
    /// The planned measurement.
    Planned,
    /// The recording with its marker at another arc length, m, on the center line.
    MarkerPosition(f64),
    /// Frames after the planned end.
    Later,
    /// Frames between the planned ones: those that a rate with this factor has, and no smaller factor.
    Between(usize),
}

/// Rows of the Jacobian of a planned measurement, or of a candidate for it.
pub(crate) struct CandidateRows {
    /// Index of the experiment in the plan.
    pub experiment: usize,
    /// Index of the planned measurement in the experiment.
    index: usize,
    kind: CandidateKind,
    pub measurement: Measurement,
    /// Rows of the values in the common Jacobian.
    pub rows: Range<usize>,
}

impl CandidateRows {
    /// Whether these are rows of the planned measurement itself.
    fn is_planned(&self) -> bool {
        self.kind == CandidateKind::Planned
    }

    /// Whether both belong to the same planned measurement of one experiment, as its own rows or as a candidate for it.
    /// Candidates with another marker position replace the own rows in a design; those with later frames or frames
    /// between are added to them.
    fn is_of_same_measurement(&self, other: &Self) -> bool {
        (self.experiment, self.index) == (other.experiment, other.index)
    }
}

/// A plan with all its candidate recordings.
pub(crate) struct CandidateDesigns {
    /// Blocks of successive rows; in each experiment those of the planned measurements come first.
    blocks: Vec<CandidateRows>,
}

/// Inputs of the expected standard errors of candidate designs at one point.
struct DesignErrors<'a> {
    designs: &'a CandidateDesigns,
    /// The planned experiments.
    planned: &'a [Experiment],
    /// The values of the unknowns at which the plan is simulated.
    point: ParameterPoint<'a>,
    /// Rows of the Jacobian of all candidates, then those of the priors.
    rows: &'a [Vec<f64>],
}

impl CandidateDesigns {
    /// The planned measurements and the candidates for the recordings of `planned` experiments, with their rows in one
    /// Jacobian. In each experiment the planned measurements come first; then, recording by recording, marker
    /// positions, later frames and frames between. Only the first [`MOST_MOVED`] recordings get other marker positions.
    /// Error: a marker that is not on the rod.
    pub fn new(planned: &[Experiment]) -> Result<Self, Error> {
        let mut blocks: Vec<CandidateRows> = Vec::new();
        let mut moved = 0;
        for (e, experiment) in planned.iter().enumerate() {
            let mut add = |index: usize, kind: CandidateKind, measurement: Measurement| {
                let first = blocks.last().map_or(0, |block| block.rows.end);
                let rows = first..first + measurement.values();
                blocks.push(CandidateRows { experiment: e, index, kind, measurement, rows });
            };
            // The planned measurements come first: the rows of the plan are those that are not
            // candidates.
            for (index, measurement) in experiment.measurements.iter().enumerate() {
                add(index, CandidateKind::Planned, measurement.clone());
            }
            for (index, measurement) in experiment.measurements.iter().enumerate() {
                let Some(observation) = &measurement.observation() else { continue };
                // Positions are simulated for the first recordings only: each has ten.
                if moved < MOST_MOVED {
                    moved += 1;
                    for s in marker_positions(experiment, observation)? {
                        let mut moved = observation.clone().at(Point::ArcLength(s));
                        moved.marker = None;
                        add(index, CandidateKind::MarkerPosition(s), moved.into());
                    }
                }
                // Later and intermediate frames are rows of the same run, and cost almost
                // nothing.
                for (kind, frames) in additional_frames(experiment, observation) {
                    add(index, kind, frames.into());
                }
            }
        }
        Ok(Self { blocks })
    }

    /// The `planned` experiments with all candidate recordings after the planned measurements of each, in the order of
    /// the rows.
    pub fn experiments(&self, planned: &[Experiment]) -> Vec<Experiment> {
        let with_candidates = |(e, experiment): (usize, &Experiment)| {
            let own = self.blocks.iter().filter(|block| block.experiment == e);
            let measurements = own.map(|block| block.measurement.clone()).collect();
            Experiment { measurements, ..experiment.clone() }
        };
        planned.iter().enumerate().map(with_candidates).collect()
    }

    /// Adds the `residuals` of the planned rows, times sigma (1 without one), to the values of `planned`. They become
    /// those of the simulation.
    pub fn fill(&self, planned: &mut [Experiment], residuals: &[f64]) {
        for block in self.planned_blocks() {
            let own = &mut planned[block.experiment].measurements[block.index];
            own.add_residuals(&residuals[block.rows.clone()], own.sigma().unwrap_or(1.0));
        }
    }

    /// The blocks of rows of the planned measurements, in the order of experiments and measurements.
    pub fn planned_blocks(&self) -> impl Iterator<Item = &CandidateRows> {
        self.blocks.iter().filter(|block| block.is_planned())
    }

    /// Number of rows of all measurements, planned ones and candidates; those of the priors follow.
    pub fn end(&self) -> usize {
        self.blocks.last().map_or(0, |block| block.rows.end)
    }

    /// The elements of `rows`, one per row of the Jacobian, that belong to the planned measurements, then those of the
    /// priors.
    pub fn planned<T: Clone>(&self, rows: &[T]) -> Vec<T> {
        self.select(rows, |block, _, _| block.is_planned())
    }

    /// The elements of `rows`, one per row of the Jacobian, of all samples for which `keep` is true, then those of the
    /// priors. Arguments of `keep` are the block, the index of the sample in it, and its time, s. A sample has one row
    /// per measured coordinate, another value one row, with the time 0 at rest.
    fn select<T: Clone>(
        &self,
        rows: &[T],
        keep: impl Fn(&CandidateRows, usize, f64) -> bool,
    ) -> Vec<T> {
        let mut kept = Vec::new();
        for block in &self.blocks {
            let mut own = rows[block.rows.clone()].iter();
            match block.measurement.motion() {
                Some(motion) => {
                    for (k, sample) in motion.samples.iter().enumerate() {
                        let values = own.by_ref().take(sample.position.iter().flatten().count());
                        match keep(block, k, sample.time) {
                            true => kept.extend(values.cloned()),
                            false => values.for_each(drop),
                        }
                    }
                }
                None => {
                    // Readings have one row each; values at rest have no time, and are measured in any case.
                    let times = block.measurement.times().into_iter().enumerate();
                    for ((k, time), row) in times.zip(own) {
                        if keep(block, k, time.unwrap_or(0.0)) {
                            kept.push(row.clone());
                        }
                    }
                }
            }
        }
        // Priors constrain every design.
        kept.extend(rows[self.end()..].iter().cloned());
        kept
    }

    /// Expected standard errors at `point` of all candidate designs, with the best one of each list marked. There is a
    /// list by marker position for each recording that has candidates. For each experiment with a motion there is one
    /// by duration, and one by frame rate. `rows` are the Jacobian of all candidates in units of the noise, then those
    /// of the priors. Error: a covariance cannot be computed.
    pub fn advice(
        &self,
        planned: &[Experiment],
        point: ParameterPoint,
        rows: &[Vec<f64>],
    ) -> Result<Vec<Advice>, Error> {
        let errors = DesignErrors { designs: self, planned, point, rows };
        let mut advice = Vec::new();
        for block in self.planned_blocks() {
            advice.extend(errors.by_marker_position(block)?);
        }
        for e in 0..planned.len() {
            let is_motion =
                |b: &CandidateRows| b.experiment == e && b.measurement.motion().is_some();
            if self.planned_blocks().any(is_motion) {
                advice.push(errors.by_duration(e)?);
                advice.extend(errors.by_frame_rate(e)?);
            }
        }
        // The best choice is marked after all errors are known.
        advice.iter_mut().for_each(|advice| advice.mark_best(point));
        Ok(advice)
    }
}

impl DesignErrors<'_> {
    /// The design with this `value` of its variable (m, s or 1/s) and the rows for which `keep` is true, with its
    /// standard errors. `planned` is whether it is the design of the plan; it is not yet marked as best. Error: the
    /// covariance cannot be computed.
    fn choice(
        &self,
        value: f64,
        planned: bool,
        keep: impl Fn(&CandidateRows, usize, f64) -> bool,
    ) -> Result<Choice, Error> {
        // A design is a selection of rows of the common Jacobian: it needs no simulation of its own.
        let std_error = standard_errors(self.point, &self.designs.select(self.rows, keep))?;
        Ok(Choice { value, std_error, planned, best: false })
    }

    /// The recording of a planned `block` with its marker at all candidate positions and the planned one, ascending by
    /// arc length, m; all other recordings stay as planned. None without candidates. Error: a planned point outside the
    /// rod, or a covariance that cannot be computed.
    fn by_marker_position(&self, block: &CandidateRows) -> Result<Option<Advice>, Error> {
        let experiment = &self.planned[block.experiment];
        let own = self.designs.blocks.iter().filter(|b| b.is_of_same_measurement(block));
        let position = |b: &CandidateRows| match b.kind {
            CandidateKind::MarkerPosition(s) => Some(s),
            _ => None,
        };
        let mut positions: Vec<f64> = own.filter_map(position).collect();
        let Some(motion) = block.measurement.motion().filter(|_| !positions.is_empty()) else {
            return Ok(None);
        };
        let planned = experiment.problem.arc_length(motion.point)?;
        positions.push(planned);
        // The planned position is listed among the candidates in the order along the rod.
        positions.sort_by_cached_key(|s| total_order(*s));
        // Only this recording moves its marker; all others stay as planned.
        let choice = |s: f64| {
            let kind = match s == planned {
                true => CandidateKind::Planned,
                false => CandidateKind::MarkerPosition(s),
            };
            self.choice(s, s == planned, |b, _, _| match b.is_of_same_measurement(block) {
                true => b.kind == kind,
                false => b.is_planned(),
            })
        };
        let choices = positions.into_iter().map(choice).collect::<Result<_, Error>>()?;
        let observation = experiment.label(&block.measurement);
        Ok(Some(Advice { variable: DesignVariable::MarkerPosition, observation, choices }))
    }

    /// Experiment `e` with the planned duration divided by [`DIVISORS`], the planned one, and [`LONGER`] times it if
    /// there are later frames, s, ascending. All of its recordings and readings end together; values at rest, and
    /// other experiments, stay as planned. Error: the covariance cannot be computed.
    fn by_duration(&self, e: usize) -> Result<Advice, Error> {
        let experiment = &self.planned[e];
        let whole = experiment.duration();
        let is_later = |b: &CandidateRows| b.experiment == e && b.kind == CandidateKind::Later;
        let has_later = self.designs.blocks.iter().any(is_later);
        let shorter = DIVISORS.iter().map(|divisor| 1.0 / *divisor as f64);
        let factors = shorter.chain([1.0]).chain(has_later.then_some(LONGER));
        let choice = |factor: f64| {
            // Shorter records keep the planned frames up to their end; only the longer one has the later frames.
            let end = factor * whole * ROUNDING;
            self.choice(factor * whole, factor == 1.0, |b, _, time| match b.kind {
                CandidateKind::Planned => b.experiment != e || time <= end,
                CandidateKind::Later => b.experiment == e && factor > 1.0,
                CandidateKind::MarkerPosition(_) | CandidateKind::Between(_) => false,
            })
        };
        let choices = factors.map(choice).collect::<Result<_, _>>()?;
        let observation = experiment.name.clone();
        Ok(Advice { variable: DesignVariable::Duration, observation, choices })
    }

    /// Experiment `e` with the planned frame rate divided by [`DIVISORS`], the planned one, and that times
    /// [`RATE_FACTORS`], 1/s, ascending. The planned rate is that of the recording with the closest frames. None
    /// without a usual spacing of frames. Error: the covariance cannot be computed.
    fn by_frame_rate(&self, e: usize) -> Result<Option<Advice>, Error> {
        let experiment = &self.planned[e];
        let spacings = experiment.measurements.iter().filter_map(|m| frame_spacing(m.motion()?));
        // Divisors and factors act on the frames of every recording; the listed rate is that of the fastest.
        let Some(spacing) = spacings.reduce(f64::min) else { return Ok(None) };
        let choice = |divisor: usize, factor: usize| {
            let value = factor as f64 / (divisor as f64 * spacing);
            self.choice(value, divisor == factor, |b, k, _| match b.kind {
                CandidateKind::Planned => {
                    let is_kept = k.is_multiple_of(divisor);
                    b.experiment != e || b.measurement.motion().is_none() || is_kept
                }
                CandidateKind::Between(least) => b.experiment == e && least <= factor,
                CandidateKind::MarkerPosition(_) | CandidateKind::Later => false,
            })
        };
        // Every divisor-th frame of the plan, or the frames between the planned ones.
        let slower = DIVISORS.iter().map(|divisor| choice(*divisor, 1));
        let faster = RATE_FACTORS.iter().map(|factor| choice(1, *factor));
        let choices = slower.chain([choice(1, 1)]).chain(faster).collect::<Result<_, _>>()?;
        let observation = experiment.name.clone();
        Ok(Some(Advice { variable: DesignVariable::FrameRate, observation, choices }))
    }
}

impl Advice {
    /// Marks the best choice: that with the smallest geometric mean of the standard errors of all unknowns at the
    /// point. The errors are on their scales: relative ones of positive parameters, absolute ones of others. An
    /// unidentified one counts [`NOT_IDENTIFIED`]. Of durations and rates it is the smallest one (the first of the
    /// list) whose mean is within a factor of [`NEARLY_BEST`] of the smallest mean. No choice is marked where none
    /// identifies any parameter.
    fn mark_best(&mut self, ParameterPoint { unknowns, x }: ParameterPoint) {
        let log_error = |choice: &Choice| -> f64 {
            // Errors of parameters in different units are compared by their product, like the determinant of the
            // covariance without its correlations (compare D-optimality).
            let of_unknown = |((unknown, x), error): ((&Unknown, &f64), &Option<f64>)| {
                let slope = unknown.slope(unknown.from_scale(*x)).abs();
                error.map_or(NOT_IDENTIFIED, |e| e / slope).ln()
            };
            let all = unknowns.iter().zip(x).zip(&choice.std_error);
            all.map(of_unknown).sum::<f64>() / unknowns.len() as f64
        };
        let log_errors: Vec<f64> = self.choices.iter().map(log_error).collect();
        let least = log_errors.iter().copied().fold(f64::INFINITY, f64::min);
        let good = match self.variable {
            DesignVariable::MarkerPosition => least,
            DesignVariable::Duration | DesignVariable::FrameRate => least + NEARLY_BEST.ln(),
        };
        let any = self.choices.iter().any(|choice| choice.std_error.iter().any(Option::is_some));
        if let Some(best) = log_errors.iter().position(|error| *error <= good).filter(|_| any) {
            self.choices[best].best = true;
        }
    }
}

/// Standard errors of the unknowns at a point, one each in their units, by these rows of the Jacobian in units of the
/// noise; none of unidentified ones. Error: the singular value decomposition fails.
pub(crate) fn standard_errors(
    ParameterPoint { unknowns, x }: ParameterPoint,
    rows: &[Vec<f64>],
) -> Result<Vec<Option<f64>>, Error> {
    // The variance is 1, because rows are in units of the stated noise. A plan has no misfit whose rise could be
    // evaluated: the Jacobian alone decides what is identifiable.
    let found = Covariance::new(unknowns, &[], rows, 1.0, 0.0, None, |_| f64::INFINITY)?;
    let error = |((unknown, x), sd): ((&Unknown, &f64), &Option<f64>)| {
        sd.map(|sd| sd * unknown.slope(unknown.from_scale(*x)))
    };
    Ok(unknowns.iter().zip(x).zip(&found.deviation).map(error).collect())
}

/// Candidate arc lengths of the marker of a recording, m, ascending: the far ends of [`MARKER_POSITIONS`] equal parts
/// of the rod, the tip included. Those within [`LEAST_MOVE`] of the length from the planned one are left out. Error: a
/// marker that is not on the rod.
fn marker_positions(experiment: &Experiment, observation: &Observation) -> Result<Vec<f64>, Error> {
    let length = experiment.problem.length();
    let planned = experiment.problem.arc_length(observation.point)?;
    let all = (1..=MARKER_POSITIONS).map(|k| length * k as f64 / MARKER_POSITIONS as f64);
    Ok(all.filter(|s| (s - planned).abs() > LEAST_MOVE * length).collect())
}

/// The usual (median) time between two frames of a motion, s. For a single frame, or a median of zero, it is the time
/// of the first frame; `None` if that is not positive, or without frames.
fn frame_spacing(motion: &PointMotion) -> Option<f64> {
    let times: Vec<f64> = motion.samples.iter().map(|s| s.time).collect();
    usual_spacing(&times).or_else(|| times.first().copied().filter(|t| *t > 0.0))
}

/// Candidate recordings of an observation, with values of zero in the coordinates that any frame has, and without
/// stated factors of sigma. One has frames after the last one at the usual spacing, for [`LONGER`] - 1 times the
/// duration of the experiment. It is left out where a support follows a file. For each of [`RATE_FACTORS`] one has the
/// frames between the planned ones (and before the first, from t = 0 on) that no smaller factor has. Recordings without
/// frames are left out; without a usual spacing there are none.
fn additional_frames(
    experiment: &Experiment,
    observation: &Observation,
) -> Vec<(CandidateKind, Observation)> {
    let Some(spacing) = frame_spacing(observation) else { return Vec::new() };
    let is_observed = |c: usize| observation.samples.iter().any(|s| s.position[c].is_some());
    let position = std::array::from_fn(|c| is_observed(c).then_some(0.0));
    let at = |times: Vec<f64>| {
        let mut other = observation.clone();
        other.samples = times.into_iter().map(|time| Sample { time, position }).collect();
        // Factors of sigma belong to the planned frames; other frames have the common sigma.
        other.header.sigma_factors.clear();
        other
    };
    // Later frames continue the planned spacing; frames between are those of multiples of the planned rate.
    let mut all = Vec::new();
    let last = observation.samples.last().map_or(0.0, |s| s.time);
    let scene = experiment.problem.scene();
    let is_recorded = |file: &Path| !file.as_os_str().is_empty();
    let is_prescribed = scene.supports.path.is_some()
        || scene.supports.motion.iter().any(|m| is_recorded(&m.file))
        || scene.contacts.iter().flat_map(Contact::motions).any(|m| is_recorded(&m.file));
    // Supports and obstacles that follow a file have no motion after its end.
    if !is_prescribed {
        let frames = ((LONGER - 1.0) * experiment.duration() / spacing * ROUNDING).floor();
        let after = (1..=frames as usize).map(|k| last + k as f64 * spacing);
        all.push((CandidateKind::Later, at(after.collect())));
    }
    for factor in RATE_FACTORS {
        let mut between = Vec::new();
        let mut before = observation.samples.first().map_or(0.0, |s| s.time) - spacing;
        for sample in &observation.samples {
            // Frames at even parts belong to smaller factors.
            let parts = (1..factor).step_by(2).map(|k| k as f64 / factor as f64);
            between.extend(parts.map(|part| before + part * (sample.time - before)));
            before = sample.time;
        }
        between.retain(|time| *time >= 0.0);
        all.push((CandidateKind::Between(factor), at(between)));
    }
    all.retain(|(_, o)| !o.samples.is_empty());
    all
}
