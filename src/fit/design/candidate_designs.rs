//! Other ways to record what is planned, as other rows of the same Jacobian.

use crate::error::Error;
use crate::fit::design::report::{Advice, Choice, DesignVariable};
use crate::fit::measurement::Measurement;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::motion::{Observation, PointMotion, Sample};
use crate::fit::misfit::ar1::usual_spacing;
use crate::fit::uncertainty::covariance::gauss_newton::Covariance;
use crate::fit::unknown::Unknown;
use crate::numerics::total_order;
use crate::scene::Point;
use std::ops::Range;

/// Markers at so many equal parts of the rod's length.
const PLACES: usize = 10;
/// Recordings whose markers are moved at most.
const MOST_MOVED: usize = 4;
/// Lengths and rates, over those of the plan; smaller ones are one over whole numbers.
const LONGER: f64 = 2.0;
const PARTS: [usize; 3] = [8, 4, 2];
const FASTER: [usize; 2] = [2, 4];
/// Lengths and rates that come as near as this to the best are as good.
const AS_GOOD: f64 = 1.05;
/// What counts as the standard deviation of an unknown that is not identified, on its scale.
const UNKNOWN: f64 = 1e3;

/// What rows of the Jacobian are of.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// The plan.
    Own,
    /// A marker at another place, m.
    Place(f64),
    /// What is seen after the end.
    Later,
    /// Frames between those of the plan: those that so many times the rate has, and no smaller one.
    Between(usize),
}

/// Rows of one measurement, or of one of its choices.
pub(crate) struct Block {
    pub experiment: usize,
    /// The measurement among those of the experiment.
    of: usize,
    kind: Kind,
    pub measurement: Measurement,
    pub rows: Range<usize>,
}

/// A plan and its choices.
pub(crate) struct CandidateDesigns {
    blocks: Vec<Block>,
}

impl CandidateDesigns {
    /// Those of `planned`.
    pub fn of(planned: &[Experiment]) -> Result<Self, Error> {
        let mut blocks: Vec<Block> = Vec::new();
        let mut moved = 0;
        for (e, experiment) in planned.iter().enumerate() {
            let own = experiment.measurements.iter().map(|m| (Kind::Own, m.clone()));
            let own: Vec<_> = own.enumerate().map(|(of, (kind, m))| (of, kind, m)).collect();
            let mut all = own;
            for (of, measurement) in experiment.measurements.iter().enumerate() {
                let Some(observation) = &measurement.observation() else { continue };
                if moved < MOST_MOVED {
                    moved += 1;
                    let places = places(experiment, observation)?.into_iter();
                    all.extend(places.map(|(s, o)| (of, Kind::Place(s), o.into())));
                }
                let more = frames(experiment, observation).into_iter();
                all.extend(more.map(|(kind, o)| (of, kind, o.into())));
            }
            for (of, kind, measurement) in all {
                let first = blocks.last().map_or(0, |block: &Block| block.rows.end);
                let rows = first..first + measurement.values();
                blocks.push(Block { experiment: e, of, kind, measurement, rows });
            }
        }
        Ok(Self { blocks })
    }

    /// The experiments with all choices beside what is planned.
    pub fn experiments(&self, planned: &[Experiment]) -> Vec<Experiment> {
        let of = |(e, experiment): (usize, &Experiment)| {
            let own = self.blocks.iter().filter(|block| block.experiment == e);
            let measurements = own.map(|block| block.measurement.clone()).collect();
            Experiment { measurements, ..experiment.clone() }
        };
        planned.iter().enumerate().map(of).collect()
    }

    /// Makes the values of `planned` those of which nothing is left in `residuals`.
    pub fn fill(&self, planned: &mut [Experiment], residuals: &[f64]) {
        for block in self.blocks.iter().filter(|block| block.kind == Kind::Own) {
            let own = &mut planned[block.experiment].measurements[block.of];
            let sigmas = own.sigmas(own.sigma().unwrap_or(1.0));
            let left = residuals[block.rows.clone()].iter().zip(sigmas);
            own.data.values_mut().into_iter().zip(left).for_each(|(value, (r, s))| *value += r * s);
        }
    }

    /// The rows of the measurements of the plan.
    pub fn planned_blocks(&self) -> impl Iterator<Item = &Block> {
        self.blocks.iter().filter(|block| block.kind == Kind::Own)
    }

    /// The number of rows, without those of the priors that follow.
    pub fn end(&self) -> usize {
        self.blocks.last().map_or(0, |block| block.rows.end)
    }

    /// The rows of the plan, with those of the priors.
    pub fn planned<T: Clone>(&self, rows: &[T]) -> Vec<T> {
        self.rows(rows, |block, _, _| block.kind == Kind::Own)
    }

    /// The rows of the samples that `keep` chooses, which it is told by their place in the block, from 0 on, and their
    /// time, with those of the priors.
    fn rows<T: Clone>(&self, rows: &[T], keep: impl Fn(&Block, usize, f64) -> bool) -> Vec<T> {
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
                None if keep(block, 0, 0.0) => kept.extend(own.cloned()),
                None => {}
            }
        }
        kept.extend(rows[self.end()..].iter().cloned());
        kept
    }

    /// What all choices would tell.
    pub fn advice(
        &self,
        planned: &[Experiment],
        unknowns: (&[Unknown], &[f64]),
        rows: &[Vec<f64>],
    ) -> Result<Vec<Advice>, Error> {
        let mut advice = Vec::new();
        for block in self.blocks.iter().filter(|block| block.kind == Kind::Own) {
            let experiment = &planned[block.experiment];
            let mine = |b: &Block| (b.experiment, b.of) == (block.experiment, block.of);
            let places = self.blocks.iter().filter(|b| mine(b)).filter_map(|b| match b.kind {
                Kind::Place(s) => Some((s, b.kind)),
                _ => None,
            });
            let mut places: Vec<(f64, Kind)> = places.collect();
            let Some(motion) = block.measurement.motion() else { continue };
            if places.is_empty() {
                continue;
            }
            places.push((experiment.problem.arc_length(motion.point)?, Kind::Own));
            places.sort_by_cached_key(|x| total_order(x.0));
            let choice = |(s, kind): (f64, Kind)| {
                let keep =
                    |b: &Block, _, _| if mine(b) { b.kind == kind } else { b.kind == Kind::Own };
                let std_error = standard_errors(unknowns, &self.rows(rows, keep))?;
                Ok(Choice { value: s, std_error, planned: kind == Kind::Own, best: false })
            };
            let choices = places.into_iter().map(choice).collect::<Result<_, Error>>()?;
            let of = experiment.label(&block.measurement);
            advice.push(Advice {
                variable: DesignVariable::MarkerPosition,
                observation: of,
                choices,
            });
        }
        for (e, experiment) in planned.iter().enumerate() {
            advice.extend(self.lengths(e, experiment, unknowns, rows)?);
            advice.extend(self.rates(e, experiment, unknowns, rows)?);
        }
        advice.iter_mut().for_each(|advice| advice.mark(unknowns));
        Ok(advice)
    }

    /// All recordings of experiment `e` shorter or longer.
    fn lengths(
        &self,
        e: usize,
        experiment: &Experiment,
        unknowns: (&[Unknown], &[f64]),
        rows: &[Vec<f64>],
    ) -> Result<Option<Advice>, Error> {
        let whole = experiment.duration();
        let longer = self.blocks.iter().any(|b| b.experiment == e && b.kind == Kind::Later);
        let parts = PARTS.iter().map(|part| 1.0 / *part as f64);
        let factors = parts.chain([1.0]).chain(longer.then_some(LONGER));
        let choice = |factor: f64| {
            let end = factor * whole * (1.0 + 1e-9);
            let keep = |b: &Block, _, time: f64| match b.kind {
                Kind::Own => b.experiment != e || b.measurement.motion().is_none() || time <= end,
                Kind::Later => b.experiment == e && factor > 1.0,
                Kind::Place(_) | Kind::Between(_) => false,
            };
            let std_error = standard_errors(unknowns, &self.rows(rows, keep))?;
            Ok(Choice { value: factor * whole, std_error, planned: factor == 1.0, best: false })
        };
        self.filmed(e, experiment, DesignVariable::Duration, factors.map(choice))
    }

    /// All recordings of experiment `e` with fewer or more frames in a second.
    fn rates(
        &self,
        e: usize,
        experiment: &Experiment,
        unknowns: (&[Unknown], &[f64]),
        rows: &[Vec<f64>],
    ) -> Result<Option<Advice>, Error> {
        let spacings = experiment.measurements.iter().filter_map(|m| spacing(m.motion()?));
        let Some(spacing) = spacings.reduce(f64::min) else { return Ok(None) };
        let slower = PARTS.iter().map(|part| (*part, 1));
        let faster = FASTER.iter().map(|times| (1, *times));
        let choice = |(part, times): (usize, usize)| {
            let keep = |b: &Block, k: usize, _| match b.kind {
                Kind::Own => {
                    b.experiment != e || b.measurement.motion().is_none() || k.is_multiple_of(part)
                }
                Kind::Between(least) => b.experiment == e && least <= times,
                Kind::Place(_) | Kind::Later => false,
            };
            let std_error = standard_errors(unknowns, &self.rows(rows, keep))?;
            let value = times as f64 / (part as f64 * spacing);
            Ok(Choice { value, std_error, planned: part == times, best: false })
        };
        let all = slower.chain([(1, 1)]).chain(faster).map(choice);
        self.filmed(e, experiment, DesignVariable::FrameRate, all)
    }

    /// Advice on all recordings of an experiment, if it has any.
    fn filmed(
        &self,
        e: usize,
        experiment: &Experiment,
        variable: DesignVariable,
        choices: impl Iterator<Item = Result<Choice, Error>>,
    ) -> Result<Option<Advice>, Error> {
        let mut own = self.blocks.iter().filter(|b| b.experiment == e && b.kind == Kind::Own);
        if !own.any(|b| b.measurement.motion().is_some()) {
            return Ok(None);
        }
        let (of, choices) = (experiment.name.clone(), choices.collect::<Result<_, _>>()?);
        Ok(Some(Advice { variable, observation: of, choices }))
    }
}

impl Advice {
    /// Marks the best choice.
    fn mark(&mut self, (unknowns, x): (&[Unknown], &[f64])) {
        let size = |choice: &Choice| -> f64 {
            let of = |((unknown, x), error): ((&Unknown, &f64), &Option<f64>)| {
                error.map_or(UNKNOWN, |e| e / unknown.slope(unknown.from_scale(*x)).abs()).ln()
            };
            let all = unknowns.iter().zip(x).zip(&choice.std_error);
            all.map(of).sum::<f64>() / unknowns.len() as f64
        };
        let sizes: Vec<f64> = self.choices.iter().map(size).collect();
        let least = sizes.iter().copied().fold(f64::INFINITY, f64::min);
        let good = match self.variable {
            DesignVariable::MarkerPosition => least,
            DesignVariable::Duration | DesignVariable::FrameRate => least + AS_GOOD.ln(),
        };
        let any = self.choices.iter().any(|choice| choice.std_error.iter().any(Option::is_some));
        if let Some(best) = sizes.iter().position(|size| *size <= good).filter(|_| any) {
            self.choices[best].best = true;
        }
    }
}

/// Standard errors of the unknowns by these rows.
pub(crate) fn standard_errors(
    (unknowns, x): (&[Unknown], &[f64]),
    rows: &[Vec<f64>],
) -> Result<Vec<Option<f64>>, Error> {
    let found = Covariance::new(unknowns, &[], rows, 1.0, 0.0, None, |_| f64::INFINITY)?;
    let error = |((unknown, x), sd): ((&Unknown, &f64), &Option<f64>)| {
        sd.map(|sd| sd * unknown.slope(unknown.from_scale(*x)))
    };
    Ok(unknowns.iter().zip(x).zip(&found.deviation).map(error).collect())
}

/// The recording with its marker elsewhere, where it is not already.
fn places(
    experiment: &Experiment,
    observation: &Observation,
) -> Result<Vec<(f64, Observation)>, Error> {
    let length = experiment.problem.length();
    let own = experiment.problem.arc_length(observation.point)?;
    let place = move |k: usize| length * k as f64 / PLACES as f64;
    let others = (1..=PLACES).map(place).filter(move |s| (s - own).abs() > 1e-2 * length);
    let moved = |s: f64| {
        let mut moved = observation.clone().at(Point::ArcLength(s));
        moved.marker = None;
        (s, moved)
    };
    Ok(others.map(moved).collect())
}

/// The usual time between two frames, s; that to the first of a single one.
fn spacing(motion: &PointMotion) -> Option<f64> {
    let times: Vec<f64> = motion.samples.iter().map(|s| s.time).collect();
    usual_spacing(&times).or_else(|| times.first().copied().filter(|t| *t > 0.0))
}

/// Frames after the end of a recording and between its own.
fn frames(experiment: &Experiment, observation: &Observation) -> Vec<(Kind, Observation)> {
    let Some(spacing) = spacing(observation) else { return Vec::new() };
    let seen = (0..3).map(|c| observation.samples.iter().any(|s| s.position[c].is_some()));
    let seen: Vec<bool> = seen.collect();
    let position: [Option<f64>; 3] = std::array::from_fn(|c| seen[c].then_some(0.0));
    let at = |times: Vec<f64>| {
        let mut other = observation.clone();
        other.samples = times.into_iter().map(|time| Sample { time, position }).collect();
        other.header.sigma_factors.clear();
        other
    };
    let mut all = Vec::new();
    let last = observation.samples.last().map_or(0.0, |s| s.time);
    let supports = &experiment.problem.scene().supports;
    let led =
        supports.path.is_some() || supports.motion.iter().any(|m| !m.file.as_os_str().is_empty());
    if !led {
        let frames = ((LONGER - 1.0) * experiment.duration() / spacing * (1.0 + 1e-9)).floor();
        let after = (1..=frames as usize).map(|k| last + k as f64 * spacing);
        all.push((Kind::Later, at(after.collect())));
    }
    for times in FASTER {
        let mut between = Vec::new();
        let mut before = observation.samples.first().map_or(0.0, |s| s.time) - spacing;
        for sample in &observation.samples {
            // Even parts are those of smaller rates.
            let parts = (1..times).step_by(2).map(|k| k as f64 / times as f64);
            between.extend(parts.map(|part| before + part * (sample.time - before)));
            before = sample.time;
        }
        between.retain(|time| *time >= 0.0);
        all.push((Kind::Between(times), at(between)));
    }
    all.retain(|(_, o)| !o.samples.is_empty());
    all
}
