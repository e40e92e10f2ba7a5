//! Search for mesh, step and scheme of a motion by trial runs.
//!
//! `choose` makes the search. Input: the scene, whose given mesh or step is kept, the scene with the first mesh, and a
//! first step in s. The first run has half of the edges or steps that the scene gives. Each further run usually has a
//! finer mesh or smaller steps. The [differences](crate::accuracy::difference) between successive runs estimate the
//! errors of mesh and step. The part with the larger error is refined next. A failed run is followed by one with
//! smaller steps, and repeated failures by one with more edges; instead of these a given step or mesh is used.
//!
//! If scheme and mesh are open and generalised-alpha needs much smaller steps, `rodas4` is tried on a mesh coarser by
//! [`LARGE_RATIO`]. If its step error reaches the target with less work, the search goes on from that run.
//!
//! The target error is a fraction of the requested one, given by `tuning`. The search ends where an extrapolation from
//! the last run reaches it, or where given numerics make further runs impossible or useless. It also ends at a limit of
//! work, or after more than [`MAX_FAILURES`] failed runs. Before it ends at the limit of work, the part with the
//! smaller error is made coarser if the other one can then be refined further.
//!
//! Output: the numerics with the least work whose extrapolated error is the target, else the most accurate ones within
//! the allowed work. The step may then be reduced: to a stable one of an explicit scheme, or to resolve the motions of
//! supports and the signals well. The estimated error, over the length, is `None` unless every part that the scene
//! leaves open was estimated. The reason is added if the error is above the requested one or unknown. The basis for the
//! check of the run is added, unless no run succeeded; the numerics are then those of the last attempt. After a failed
//! run with smaller steps the search begins anew. If all further runs fail, the numerics are those of the last
//! successful run, not extrapolated, with its estimated error.
//!
//! Neither part is refined far without the other. Large steps damp the modes that finer edges would add, and a coarse
//! mesh lacks the modes that smaller steps would reveal.

use crate::accuracy::basis::{Basis, ChosenMotion};
use crate::accuracy::calculation::allowed_edges;
use crate::accuracy::difference::{Positions, RefinementSequence, UNRELATED, largest_distance};
use crate::accuracy::refinement::{ErrorModel, Free, MAX_EXTRAPOLATION, RefinementFactors};
use crate::accuracy::rodas4::{self, Alternative};
use crate::accuracy::trial::{Numerics, TrialRun, TrialRuns, largest_stable_step};
use crate::accuracy::tuning::Tuning;
use crate::error::Error;
use crate::scene::resolution::Bound;
use crate::scene::{Scene, Scheme};

/// Refinement of mesh or step after which the difference of the other one is computed again, because both interact.
const MAX_SHIFT: f64 = 8.0;
/// Refinement of mesh or step after which earlier differences of the other one are dropped: they determine no order.
const MAX_SHIFT_OF_ORDERS: f64 = 8.0;
/// Number of failed runs after which the search ends.
const MAX_FAILURES: usize = 10;
/// Usual refinement of mesh or step from one trial run to the next.
const SMALL_RATIO: usize = 2;
/// Refinement where the target is far; it saves runs.
const LARGE_RATIO: usize = 4;
/// Expected refinement over [`LARGE_RATIO`] from which on the large ratio is used.
const LARGE_RATIO_MARGIN: f64 = 1.5;
/// Expected refinement of the step of generalised-alpha from which on `rodas4` is tried.
const MIN_STEP_REFINEMENT: f64 = 4.0;
/// Refinement of the step after which `rodas4` is tried again.
const RETRY_REFINEMENT: usize = 3;
/// Factor on the largest work of the trial runs where the search is expected to reach the target.
const EXTENDED_SEARCH: f64 = 20.0;
/// The same where the errors of mesh or step are not estimated yet, because coarser runs failed.
const WITHOUT_ESTIMATE: f64 = 5.0;
/// Fraction of the target error that is allowed for the step.
const STEP_PART: f64 = 0.5;
/// Error of the step over that of a given mesh below which smaller steps are not tried, if the mesh alone exceeds the
/// target.
const HOPELESS_STEP_PART: f64 = 0.1;
/// Factor on the number of edges after every second failed run.
const MORE_EDGES: f64 = 1.5;

/// The numerical setting that is refined from one trial run to the next.
#[derive(Clone, Copy, PartialEq)]
enum RefinedPart {
    Mesh,
    Step,
}

/// The state of the search for mesh, step and scheme of a motion.
pub(super) struct MotionSearch<'a> {
    scene: &'a Scene,
    /// The trial runs.
    trials: TrialRuns<'a>,
    /// The constants for this kind of motion.
    tuning: &'static Tuning,
    /// Differences of runs by refinements of the mesh.
    mesh: RefinementSequence,
    /// Differences of runs by refinements of the step.
    step: RefinementSequence,
    /// Refinement of the step since the last difference of the mesh.
    since_mesh: f64,
    /// Refinement of the mesh since the last difference of the step.
    since_step: f64,
    /// Steps of the last trial run when `rodas4` was tried.
    steps_at_rodas4_trial: usize,
    /// Number of edges, if the scene gives it.
    given_segments: Option<usize>,
    /// Number of steps, if the scene gives the step.
    given_steps: Option<usize>,
    /// The last successful run before a failure with smaller steps; preferably one with estimated errors.
    earlier: Option<EarlierRun>,
}

/// A successful trial run with the differences that estimate its errors, which a later failure discarded.
struct EarlierRun {
    trial: TrialRun,
    /// Differences of runs by refinements of the mesh.
    mesh: RefinementSequence,
    /// Differences of runs by refinements of the step.
    step: RefinementSequence,
}

impl<'a> MotionSearch<'a> {
    /// The search for the numerics of the motion of a scene, before the first run; `guess` is the scene with the first
    /// mesh and step. Edges or step that the scene gives are kept. An error if `guess` cannot be built or has no
    /// `[time]`.
    pub fn new(scene: &'a Scene, guess: Scene) -> Result<Self, Error> {
        let trials = TrialRuns::new(scene, guess)?;
        let tuning = Tuning::of(scene, &trials.guess);
        let time = trials.guess.time()?;
        let given_segments = (!trials.open.segments).then(|| trials.guess.segments());
        let given_steps =
            (!trials.open.step).then(|| (time.end / time.step_size()).round().max(1.0) as usize);
        Ok(Self {
            scene,
            mesh: RefinementSequence::new(tuning.orders),
            step: RefinementSequence::new(tuning.orders),
            tuning,
            trials,
            since_mesh: 1.0,
            since_step: 1.0,
            steps_at_rodas4_trial: 0,
            given_segments,
            given_steps,
            earlier: None,
        })
    }

    /// Work of all trial runs, edges times Newton iterations.
    pub fn work(&self) -> f64 {
        self.trials.work.get()
    }

    /// Runs the search and returns mesh, step and scheme with the estimated error over the length. The first trial run
    /// has the first mesh and a step of about `first_step`, s; it has half of the edges or steps that the scene gives.
    /// After a failed run the number of steps is doubled, unless the scene gives the step. The search ends where an
    /// extrapolation suffices or given numerics prevent further runs (`next_part`). It also ends at the limit of work,
    /// and after more than [`MAX_FAILURES`] failed runs; then the reason is [`Bound::Work`]. A reason is returned only
    /// if the error is above the requested one or unknown. Error: an error of the input.
    pub fn choose(&mut self, first_step: f64) -> Result<ChosenMotion, Error> {
        let (end, scheme) = (self.trials.guess.time()?.end, self.trials.guess.time()?.scheme);
        let first_steps = (end / first_step - 1e-9).ceil().max(1.0) as usize;
        // The first run is coarse: half of a given mesh or step, so that there is a difference.
        let mut now = Numerics {
            segments: self.coarsest_segments(),
            steps: self.given_steps.map_or(first_steps, |given| (given / 2).max(1)),
            scheme,
        };
        let mut last: Option<TrialRun> = None;
        let mut refined = RefinedPart::Step;
        let mut failures = 0;
        loop {
            // Longer runs are allowed as long as the errors are not estimated at all.
            let factor = if self.is_estimated() { 1.0 } else { WITHOUT_ESTIMATE };
            let is_long = self.trials.expected_work(now) > factor * self.trials.most_work;
            // The limit of work ends the search, unless both errors fall and the target is near.
            if is_long && !last.as_ref().is_some_and(|last| self.is_promising(last.numerics)) {
                match self.coarser_basis(last.as_ref(), now, refined)? {
                    Some((basis, next)) => (last, now) = (Some(basis), next),
                    None => return self.conclude(last, now, Some(Bound::Work)),
                }
                continue;
            }
            // A run that fails is followed by one with smaller steps.
            let Some(trial) = self.trials.run(now)? else {
                failures += 1;
                if failures > MAX_FAILURES {
                    return self.conclude(last, now, Some(Bound::Work));
                }
                now = match &last {
                    // Finer edges need smaller steps, whose error is left to the difference of the mesh.
                    Some(_) if now.scheme == Scheme::Rodas4 && self.given_steps.is_none() => {
                        Numerics { steps: 2 * now.steps, ..now }
                    }
                    // The differences so far hold: the step is refined first, on the mesh of the last run.
                    Some(last) if refined == RefinedPart::Mesh && self.given_steps.is_none() => {
                        refined = RefinedPart::Step;
                        Numerics { steps: SMALL_RATIO * last.numerics.steps, ..last.numerics }
                    }
                    _ => {
                        // It is used if all further runs fail.
                        if let Some(trial) = last.take()
                            && (self.earlier.is_none() || self.is_estimated())
                        {
                            let (mesh, step) = (self.mesh.clone(), self.step.clone());
                            self.earlier = Some(EarlierRun { trial, mesh, step });
                        }
                        self.mesh.clear();
                        self.step.clear();
                        self.after_failure(now, failures)
                    }
                };
                continue;
            };
            // The change from the run before estimates the error of the mesh or of the step.
            // Richardson: the error of the finer run is the difference over r^p - 1.
            if let Some(before) = &last {
                let then = before.numerics;
                let ratio = match refined {
                    RefinedPart::Mesh => now.segments as f64 / then.segments as f64,
                    RefinedPart::Step => now.steps as f64 / then.steps as f64,
                };
                self.compare(&before.positions, &trial.positions, refined, ratio);
            }
            last = Some(trial);
            // Another scheme may reach the target with less work.
            if let Some(alternative) = self.cheaper_alternative(now)? {
                let coarse = alternative.trial.numerics;
                let mut coarser = now.segments as f64 / coarse.segments as f64;
                // Differences of meshes finer than that of the alternative are dropped.
                while coarser > 1.0 && self.mesh.count() > 0 {
                    coarser /= self.mesh.pop();
                }
                now = coarse;
                last = Some(alternative.trial);
                self.step = alternative.step;
                (self.since_mesh, self.since_step) = (1.0, 1.0);
            }
            // The larger of both errors is reduced, until an extrapolation reaches the target.
            let Some(next) = self.next_part(now) else { return self.conclude(last, now, None) };
            now = self.refine(now, next);
            refined = next;
        }
    }

    /// Whether trial runs above the usual limit of work are expected to reach the target error. Mesh and step have two
    /// or more differences each, which converge. The work predicted from the run with the numerics `at` is at most
    /// [`EXTENDED_SEARCH`] times that limit.
    fn is_promising(&self, at: Numerics) -> bool {
        let is_falling = |d: &RefinementSequence| d.count() > 1 && d.is_converging();
        let growth = self.errors().cheapest(self.target(), at.segments as f64, self.free());
        let work = growth.map(|(_, growth)| growth * self.trials.expected_work(at));
        is_falling(&self.mesh)
            && is_falling(&self.step)
            && work.is_some_and(|work| work <= EXTENDED_SEARCH * self.trials.most_work)
    }

    /// A trial run to refine mesh or step from where the refinement of `last` to `next` is too much work: that of
    /// `last` with the other part coarser by its last refinement, and `next` coarsened in the same way. The last
    /// difference of the other part is extrapolated to it. `None`, without a change, if the coarser part would have the
    /// larger error, has no difference, is given by the scene, or cannot be coarser, or if the coarser run fails.
    /// Error: invalid input.
    fn coarser_basis(
        &mut self,
        last: Option<&TrialRun>,
        next: Numerics,
        refined: RefinedPart,
    ) -> Result<Option<(TrialRun, Numerics)>, Error> {
        let (own, other, is_given) = match refined {
            RefinedPart::Mesh => (&self.mesh, &self.step, self.given_steps.is_some()),
            RefinedPart::Step => (&self.step, &self.mesh, self.given_segments.is_some()),
        };
        let coarser = other.clone().coarsened();
        let ratio = other.clone().pop();
        let is_smaller = coarser.error() < own.error();
        let Some(last) = last.filter(|_| other.count() > 0 && !is_given && is_smaller) else {
            return Ok(None);
        };
        let coarse = |number: usize| (number as f64 / ratio).round() as usize;
        let coarsened = |numerics: Numerics| match refined {
            RefinedPart::Mesh => Numerics { steps: coarse(numerics.steps).max(1), ..numerics },
            RefinedPart::Step => {
                let segments = allowed_edges(self.scene, coarse(numerics.segments).max(2));
                Numerics { segments, ..numerics }
            }
        };
        // The smallest numbers, and markers of a recorded path, limit how coarse the numerics can be.
        let numerics = coarsened(last.numerics);
        if numerics == last.numerics {
            return Ok(None);
        }
        let Some(basis) = self.trials.run(numerics)? else { return Ok(None) };
        let next = coarsened(next);
        match refined {
            RefinedPart::Mesh => (self.step, self.since_mesh) = (coarser, self.since_mesh / ratio),
            RefinedPart::Step => (self.mesh, self.since_step) = (coarser, self.since_step / ratio),
        }
        Ok(Some((basis, next)))
    }

    /// A trial run of `rodas4` whose step error reaches [`STEP_PART`] of the target error with less work than
    /// generalised-alpha, by [`rodas4::cheaper_alternative`]. Its mesh has the edges of `now` over [`LARGE_RATIO`], at
    /// least those of the first mesh. It is tried if scheme and mesh are left open, the scene supports `rodas4`, and
    /// there are two differences of the step and one of the mesh. Generalised-alpha must need a step refined by
    /// [`MIN_STEP_REFINEMENT`] or more, and have [`RETRY_REFINEMENT`] times the steps of the last attempt. Else `None`.
    /// An attempt stores the number of steps of `now`.
    fn cheaper_alternative(&mut self, now: Numerics) -> Result<Option<Alternative>, Error> {
        let can = self.trials.open.scheme
            && self.given_segments.is_none()
            && now.scheme != Scheme::Rodas4
            && self.scene.is_supported_by(Scheme::Rodas4);
        let is_time = now.steps >= RETRY_REFINEMENT * self.steps_at_rodas4_trial;
        if !can || !is_time || self.step.count() < 2 || self.mesh.count() == 0 {
            return Ok(None);
        }
        // Mesh and step share the target error.
        let target = STEP_PART * self.target();
        // Refinement of the step that its error requires, by the observed order.
        let need = (self.step.error() / target).powf(self.step.order().recip());
        if need < MIN_STEP_REFINEMENT {
            return Ok(None);
        }
        // The mesh is coarser by the large ratio: only the error of the step is compared.
        self.steps_at_rodas4_trial = now.steps;
        let coarse = allowed_edges(
            self.scene,
            (now.segments / LARGE_RATIO).max(self.trials.guess.segments()),
        );
        let segments = coarse.min(now.segments);
        rodas4::cheaper_alternative(
            &self.trials,
            segments,
            now.steps,
            need * now.steps as f64,
            target,
        )
    }

    /// Edges of the first trial run: half of those that the scene gives, rounded so that markers are at nodes. All of
    /// them if that is not fewer, or if the mesh is that of a polyline's points. Without given edges those of the first
    /// mesh.
    fn coarsest_segments(&self) -> usize {
        match self.given_segments {
            Some(given) if self.has_mesh_of_points() => given,
            Some(given) => {
                let half = allowed_edges(self.scene, (given / 2).max(2));
                if half < given { half } else { given }
            }
            None => self.trials.guess.segments(),
        }
    }

    /// Whether the mesh is that of the points of a polyline, which cannot be changed.
    fn has_mesh_of_points(&self) -> bool {
        self.scene.rod.segments.is_none() && self.given_segments.is_some()
    }

    /// Adds the largest distance between two trial runs, over the length, to the sequence of the part that was refined
    /// by the factor `ratio` between them. Earlier differences of that part are dropped if the other part was refined
    /// by more than [`MAX_SHIFT_OF_ORDERS`] in between. The refinement of the other part since the last difference of
    /// this one is 1 again. The refinement of this part since the last difference of the other is multiplied by
    /// `ratio`.
    fn compare(&mut self, before: &Positions, after: &Positions, refined: RefinedPart, ratio: f64) {
        let difference = largest_distance(before, after);
        match refined {
            RefinedPart::Mesh => {
                if self.since_mesh > MAX_SHIFT_OF_ORDERS {
                    self.mesh.clear();
                }
                self.mesh.push(difference, ratio);
                (self.since_mesh, self.since_step) = (1.0, ratio * self.since_step);
            }
            RefinedPart::Step => {
                if self.since_step > MAX_SHIFT_OF_ORDERS {
                    self.step.clear();
                }
                self.step.push(difference, ratio);
                (self.since_step, self.since_mesh) = (1.0, ratio * self.since_mesh);
            }
        }
    }

    /// The numerics after the failed run `now`, which was failure number `failures` (from 1): half the step, and after
    /// every second failure [`MORE_EDGES`] times the edges. A given mesh or step is used as given.
    fn after_failure(&self, now: Numerics, failures: usize) -> Numerics {
        let steps = self.given_steps.unwrap_or(2 * now.steps);
        // A mesh that is too coarse can make runs fail at any step.
        let more = allowed_edges(self.scene, (MORE_EDGES * now.segments as f64).ceil() as usize);
        let segments = if failures.is_multiple_of(2) { more } else { now.segments };
        Numerics { segments: self.given_segments.unwrap_or(segments), steps, ..now }
    }

    /// The numerics of the next trial run: those `now` with mesh or step refined by [`ratio`](Self::ratio). A number of
    /// edges or steps that the scene gives is used instead.
    fn refine(&self, now: Numerics, part: RefinedPart) -> Numerics {
        let ratio = self.ratio(now, part);
        match part {
            RefinedPart::Mesh => {
                let finer = allowed_edges(self.scene, ratio * now.segments);
                Numerics { segments: self.given_segments.unwrap_or(finer), ..now }
            }
            RefinedPart::Step => {
                Numerics { steps: self.given_steps.unwrap_or(ratio * now.steps), ..now }
            }
        }
    }

    /// The factor by which mesh or step of the numerics `now` is refined next: [`LARGE_RATIO`] or [`SMALL_RATIO`]. The
    /// large one needs two or more differences of this part, the last one below [`UNRELATED`], and no refinement of
    /// this part since the last difference of the other. The target must also need a refinement above
    /// [`LARGE_RATIO_MARGIN`] times the large ratio, or be out of reach of all.
    fn ratio(&self, now: Numerics, part: RefinedPart) -> usize {
        let (own, other_is_fresh) = match part {
            RefinedPart::Mesh => (&self.mesh, self.since_step <= 1.0),
            RefinedPart::Step => (&self.step, self.since_mesh <= 1.0),
        };
        let cheapest = self.errors().cheapest(self.target(), now.segments as f64, self.free());
        let need = cheapest.map_or(f64::INFINITY, |(finer, _)| match part {
            RefinedPart::Mesh => finer.mesh,
            RefinedPart::Step => finer.step,
        });
        // A large ratio skips runs where the target is far and the order is known.
        let is_far =
            own.count() > 1 && other_is_fresh && need > LARGE_RATIO_MARGIN * LARGE_RATIO as f64;
        if is_far && own.last().is_some_and(|last| last < UNRELATED) {
            LARGE_RATIO
        } else {
            SMALL_RATIO
        }
    }

    /// Whether this part, mesh or step, of the numerics `now` may be refined: it is not given by the scene, or still
    /// coarser than the given one.
    fn can_refine(&self, now: Numerics, part: RefinedPart) -> bool {
        match part {
            RefinedPart::Mesh => self.given_segments.is_none_or(|given| now.segments < given),
            RefinedPart::Step => self.given_steps.is_none_or(|given| now.steps < given),
        }
    }

    /// Flags for mesh and step: whether the scene leaves them open.
    fn free(&self) -> Free {
        Free { mesh: self.given_segments.is_none(), step: self.given_steps.is_none() }
    }

    /// Flags for mesh and step: whether the scene leaves them open and at least one difference of runs estimates their
    /// error.
    fn estimated(&self) -> Free {
        let Free { mesh, step } = self.free();
        Free { mesh: mesh && self.mesh.count() > 0, step: step && self.step.count() > 0 }
    }

    /// Whether at least one difference of runs exists, and one for each part, mesh or step, that the scene leaves open.
    fn is_estimated(&self) -> bool {
        self.mesh.count() + self.step.count() > 0 && self.estimated() == self.free()
    }

    /// The part, mesh or step, to be refined after the run `now`; `None` ends the search. Parts without a difference
    /// come first, the step before the mesh; then one whose difference is outdated by refinements of the other above
    /// [`MAX_SHIFT`]. The target is within reach if an extrapolation by factors up to [`MAX_EXTRAPOLATION`], within the
    /// growth of work of the tuning, suffices and no last difference exceeds [`UNRELATED`]. Then it is a part whose
    /// difference that extrapolation would outdate, or a given part that is still coarser than given, or else `None`.
    /// Out of reach it is the part with the larger error. `None` also if neither part may be refined, or where smaller
    /// steps are useless beside the error of a given mesh ([`HOPELESS_STEP_PART`]).
    fn next_part(&self, now: Numerics) -> Option<RefinedPart> {
        let can = |part| self.can_refine(now, part);
        let (mesh, step) = (can(RefinedPart::Mesh), can(RefinedPart::Step));
        // At least one difference of each part first.
        if self.step.count() == 0 && step {
            return Some(RefinedPart::Step);
        }
        if self.mesh.count() == 0 && mesh {
            return Some(RefinedPart::Mesh);
        }
        if !mesh && !step {
            return None;
        }
        // Differences age: those of the mesh change with the step, and those of the step with the
        // mesh.
        if self.since_mesh > MAX_SHIFT && mesh {
            return Some(RefinedPart::Mesh);
        }
        if self.since_step > MAX_SHIFT && step {
            return Some(RefinedPart::Step);
        }
        // Runs that differ by much of the length have no order of convergence.
        let unrelated =
            [&self.mesh, &self.step].iter().any(|d| d.last().is_some_and(|d| d > UNRELATED));
        let observed = [(&self.mesh, mesh), (&self.step, step)];
        let observed = observed.iter().all(|(d, can)| !can || d.count() > 1);
        // An extrapolation may be longer where the order was observed and not assumed.
        let most = if observed { self.tuning.growth_observed } else { self.tuning.growth_assumed };
        let errors = self.errors();
        let cheapest = errors.cheapest(self.target(), now.segments as f64, self.free());
        let within_reach = cheapest.is_some_and(|(finer, growth)| {
            growth <= most && finer.mesh.max(finer.step) <= MAX_EXTRAPOLATION
        });
        if let Some((finer, _)) = cheapest.filter(|_| within_reach && !unrelated) {
            // The difference of the step is computed again before the mesh is refined far, and the other way round.
            if step && self.since_step * finer.mesh > MAX_SHIFT {
                return Some(RefinedPart::Step);
            }
            if mesh && self.since_mesh * finer.step > MAX_SHIFT {
                return Some(RefinedPart::Mesh);
            }
            // A given mesh or step is compared with a coarser one before the search ends.
            return match self.free() {
                Free { mesh: false, .. } if mesh => Some(RefinedPart::Mesh),
                Free { step: false, .. } if step => Some(RefinedPart::Step),
                _ => None,
            };
        }
        match (mesh, step) {
            (true, false) => Some(RefinedPart::Mesh),
            (false, true) => {
                // Smaller steps do not reduce the error of a given mesh.
                let is_hopeless =
                    errors.mesh >= self.target() && errors.step < HOPELESS_STEP_PART * errors.mesh;
                (!is_hopeless).then_some(RefinedPart::Step)
            }
            _ if errors.mesh > errors.step => Some(RefinedPart::Mesh),
            _ => Some(RefinedPart::Step),
        }
    }

    /// The error for which numerics are chosen, over the length: the requested accuracy times the `target` of the
    /// tuning constants.
    fn target(&self) -> f64 {
        self.tuning.target * self.scene.asked()
    }

    /// Errors of mesh and step of the last runs, over the length (zero without a difference), and their orders of
    /// convergence less the `doubt` of the tuning constants.
    fn errors(&self) -> ErrorModel {
        ErrorModel {
            mesh: self.mesh.error(),
            step: self.step.error(),
            mesh_order: self.mesh.order() - self.tuning.doubt,
            step_order: self.step.order() - self.tuning.doubt,
        }
    }

    /// The chosen numerics after the trial run `last`: those with the least work whose extrapolated error is the
    /// target, or the most accurate within the allowed work. The error is `None` if not all open parts were estimated.
    /// Without `last` they are those of the last run that a later failure discarded, with its error. Without any
    /// successful run they are `tried`, the numerics of the last attempt, without error and basis. `bound` is the
    /// reason of an early end; the result has one only if the error is above the requested one or unknown.
    fn conclude(
        &mut self,
        last: Option<TrialRun>,
        tried: Numerics,
        bound: Option<Bound>,
    ) -> Result<ChosenMotion, Error> {
        let end = self.trials.guess.time()?.end;
        let earlier = if last.is_none() { self.earlier.take() } else { None };
        // Runs with smaller steps failed: the earlier run is not extrapolated.
        let is_final = earlier.is_some();
        let last = last.or_else(|| {
            let EarlierRun { trial, mesh, step } = earlier?;
            (self.mesh, self.step) = (mesh, step);
            Some(trial)
        });
        // No run succeeded: the last numerics are returned with no error estimate.
        let Some(trial) = last else {
            let step = end / tried.steps as f64;
            return Ok(ChosenMotion { numerics: tried, step, error: None, bound, basis: None });
        };
        let errors = self.errors();
        let is_known = self.is_estimated();
        let free = if is_final { Free { mesh: false, step: false } } else { self.estimated() };
        let ran = trial.numerics;
        let mut basis = Basis {
            trial_work: self.trials.expected_work(trial.numerics),
            trial,
            errors,
            has_many_modes: self.tuning.has_many_modes,
            is_known,
            free,
            target: self.target(),
            requested: self.scene.asked(),
            most_work: EXTENDED_SEARCH * self.trials.most_work,
        };
        // Cheapest refinement of the last trial run that reaches the target by extrapolation.
        let finer = basis.refinement();
        let (numerics, step) = self.numerics(&basis, finer)?;
        // Given numbers that replace those of an earlier run have no estimate.
        let is_known = is_known && (!is_final || numerics == ran);
        basis.is_known = is_known;
        let error = is_known.then(|| errors.after(finer));
        let given = self.given_segments.is_some() || self.given_steps.is_some();
        let too_large = error.is_none_or(|error| error > self.scene.asked());
        // The reason where the requested error is not reached: given numerics, or the limit of
        // work.
        let bound = match (too_large, given) {
            (false, _) => None,
            (true, true) if bound.is_none() => Some(Bound::Given),
            (true, _) => Some(Bound::Work),
        };
        Ok(ChosenMotion { numerics, step, error, bound, basis: Some(basis) })
    }

    /// Edges, steps and scheme of the last trial run refined by `finer`, and the step, s. A given mesh or step is kept.
    /// Other steps are reduced to a stable one of an explicit scheme, and to one that resolves the motions of supports
    /// and the signals well. Errors are those of building the problem with these numerics.
    fn numerics(&self, basis: &Basis, finer: RefinementFactors) -> Result<(Numerics, f64), Error> {
        let numerics = basis.refined(finer, self.scene);
        let numerics = Numerics {
            segments: self.given_segments.unwrap_or(numerics.segments),
            steps: self.given_steps.unwrap_or(numerics.steps),
            ..numerics
        };
        let time = self.trials.guess.time()?;
        let mut step = if self.given_steps.is_some() {
            time.step_size()
        } else {
            time.end / numerics.steps as f64
        };
        if self.given_steps.is_none() {
            let scene = self.scene.resolved(numerics.segments, step).by(numerics.scheme);
            // Explicit schemes have a largest step, recorded supports an interval of their
            // samples.
            if let Some(largest) = largest_stable_step(&scene.build()?)? {
                step = step.min(largest);
            }
            step = step.min(self.scene.largest_good_step());
        }
        Ok((numerics, step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::InitialNumerics;
    use crate::accuracy::calculation::Calculation;

    const SCENE: &str = "accuracy = 1e-6\n[rod]\nshape = { kind = \"straight\", length = 0.5, direction = [1, 0, 0] }\nsection = { kind = \"circle\", radius = 0.005 }\n\
        [material]\nyoungs_modulus = 1e8\ndensity = 1200.0\n[supports]\nstart = \"clamped\"\n[loads]\ngravity = [0, -9.81, 0]\n\
        [time]\nend = 0.3\nscheme = \"generalised-alpha\"\n";

    /// All runs with at least `factor` times the first number of steps fail: the numerics are those of the last
    /// successful run. Its error is known if runs with two numbers of steps succeeded.
    #[test]
    fn successful_run_is_chosen_where_runs_with_smaller_steps_fail() {
        let scene = Scene::from_toml(SCENE, ".").unwrap();
        let first = InitialNumerics::of(&scene, Calculation::Motion).unwrap();
        let first_steps = (0.3 / first.step - 1e-9).ceil() as usize;
        for (factor, is_known) in [(2, false), (4, true)] {
            let mut search = MotionSearch::new(&first.scene, first.guess.clone()).unwrap();
            search.trials.fails_from = Some(factor * first_steps);
            let chosen = search.choose(first.step).unwrap();
            let run = chosen.basis.expect("a successful run").trial.numerics;
            assert!(chosen.numerics == run && run.steps == factor / 2 * first_steps, "{run:?}");
            assert_eq!(chosen.error.is_some(), is_known, "{:?}", chosen.error);
            assert!(chosen.error.is_none_or(|error| error > 1e-6 && error < 1.0));
            assert!(chosen.bound.is_some());
        }
    }
}
