//! Mesh, step and scheme of a motion.
//!
//! A sequence of runs halves the step or the edges, whichever leaves the larger error, and estimates both errors from the
//! [differences](crate::accuracy::difference) over the whole rod. It ends where the requested error is within reach of an
//! extrapolation; the chosen numerics are the cheapest that reach it. Neither part is refined far without the other: large
//! steps damp the modes that finer edges would add, and a coarse mesh does not have the modes that smaller steps would show.

use crate::accuracy::aim::{allowed_edges, is_struck};
use crate::accuracy::basis::{Basis, ChosenMotion, LAST_GROWTH};
use crate::accuracy::difference::{Differences, Positions, UNRELATED, largest_distance};
use crate::accuracy::refinement::{ErrorModel, Free, Refinement};
use crate::accuracy::rodas4;
use crate::accuracy::trial::{Numerics, Trial, Trials, largest_stable_step};
use crate::accuracy::tuning::{Tuning, is_limp};
use crate::error::Error;
use crate::scene::resolution::Bound;
use crate::scene::{Scene, Scheme};

/// Refinement of one part after which the difference of the other is taken again.
const STALE: f64 = 4.0;
/// Runs that may fail before the search ends.
const MOST_FAILURES: usize = 10;
/// The part that a run refined.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Mesh,
    Step,
}

/// A search for the numerics of a motion.
pub(super) struct MotionSearch<'a> {
    scene: &'a Scene,
    trials: Trials<'a>,
    tuning: &'static Tuning,
    mesh: Differences,
    step: Differences,
    /// Refinement of the other part since the last difference of mesh and of step.
    since_mesh: f64,
    since_step: f64,
    /// Edges that the scene gives, where it gives them, and steps.
    given_segments: Option<usize>,
    given_steps: Option<usize>,
}

impl<'a> MotionSearch<'a> {
    pub fn new(scene: &'a Scene, guess: Scene) -> Result<Self, Error> {
        let trials = Trials::new(scene, guess)?;
        let tuning = Tuning::of(scene, &trials.guess);
        let time = trials.guess.time()?;
        let given_segments = (!trials.open.segments).then(|| trials.guess.segments());
        let given_steps =
            (!trials.open.step).then(|| (time.end / time.step_size()).round().max(1.0) as usize);
        Ok(Self {
            scene,
            mesh: Differences::new(tuning.contraction),
            step: Differences::new(tuning.contraction),
            tuning,
            trials,
            since_mesh: 1.0,
            since_step: 1.0,
            given_segments,
            given_steps,
        })
    }

    /// Work of all trial runs, edges times Newton iterations.
    pub fn work(&self) -> f64 {
        self.trials.work.get()
    }

    /// Chooses what the scene leaves open, beginning with a step, s.
    pub fn choose(&mut self, first_step: f64) -> Result<ChosenMotion, Error> {
        let (end, scheme) = (self.trials.guess.time()?.end, self.trials.guess.time()?.scheme);
        let first_steps = (end / first_step - 1e-9).ceil().max(1.0) as usize;
        let mut now = Numerics {
            segments: self.coarsest_segments(),
            steps: self.given_steps.map_or(first_steps, |given| (given / 2).max(1)),
            scheme,
        };
        let mut last: Option<(Trial, Numerics)> = None;
        let mut refined = Part::Step;
        let mut failures = 0;
        loop {
            if now.segments as f64 * now.steps as f64 > self.trials.most_work {
                return self.conclude(last, now, Some(Bound::Work));
            }
            let Some(trial) = self.trials.run(now)? else {
                failures += 1;
                self.mesh.clear();
                self.step.clear();
                last = None;
                if failures > MOST_FAILURES {
                    return self.conclude(None, now, Some(Bound::Work));
                }
                now = self.after_failure(now, failures);
                continue;
            };
            if let Some((before, _)) = &last {
                self.compare(&before.positions, &trial.positions, refined);
            }
            last = Some((trial, now));
            let Some(next) = self.next_part(now) else { return self.conclude(last, now, None) };
            now = self.refine(now, next);
            refined = next;
        }
    }

    /// Edges of the first trial run: half of those that the scene gives, as far as markers at nodes allow it.
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

    /// Whether the mesh is that of a polyline's points.
    fn has_mesh_of_points(&self) -> bool {
        self.scene.rod.segments.is_none() && self.given_segments.is_some()
    }

    fn compare(&mut self, before: &Positions, after: &Positions, refined: Part) {
        let difference = largest_distance(before, after);
        match refined {
            Part::Mesh => {
                self.mesh.push(difference);
                (self.since_mesh, self.since_step) = (1.0, 2.0 * self.since_step);
            }
            Part::Step => {
                self.step.push(difference);
                (self.since_step, self.since_mesh) = (1.0, 2.0 * self.since_mesh);
            }
        }
    }

    /// Smaller steps after a run that failed, and after every second failure more edges.
    fn after_failure(&self, now: Numerics, failures: usize) -> Numerics {
        let steps = self.given_steps.unwrap_or(2 * now.steps);
        let more = allowed_edges(self.scene, (1.5 * now.segments as f64).ceil() as usize);
        let segments = if failures.is_multiple_of(2) { more } else { now.segments };
        Numerics { segments: self.given_segments.unwrap_or(segments), steps, ..now }
    }

    fn refine(&self, now: Numerics, part: Part) -> Numerics {
        match part {
            Part::Mesh => {
                let twice = allowed_edges(self.scene, 2 * now.segments);
                Numerics { segments: self.given_segments.unwrap_or(twice), ..now }
            }
            Part::Step => Numerics { steps: self.given_steps.unwrap_or(2 * now.steps), ..now },
        }
    }

    fn can_refine(&self, now: Numerics, part: Part) -> bool {
        match part {
            Part::Mesh => self.given_segments.is_none_or(|given| now.segments < given),
            Part::Step => self.given_steps.is_none_or(|given| now.steps < given),
        }
    }

    fn free(&self) -> Free {
        Free { mesh: self.given_segments.is_none(), step: self.given_steps.is_none() }
    }

    /// The part to be refined next; none where the chosen numerics are within reach.
    fn next_part(&self, now: Numerics) -> Option<Part> {
        let can = |part| self.can_refine(now, part);
        let (mesh, step) = (can(Part::Mesh), can(Part::Step));
        if self.step.count() == 0 && step {
            return Some(Part::Step);
        }
        if self.mesh.count() == 0 && mesh {
            return Some(Part::Mesh);
        }
        if !mesh && !step {
            return None;
        }
        if self.since_mesh > STALE && mesh {
            return Some(Part::Mesh);
        }
        if self.since_step > STALE && step {
            return Some(Part::Step);
        }
        let unrelated =
            [&self.mesh, &self.step].iter().any(|d| d.last().is_some_and(|d| d > UNRELATED));
        let observed = [(&self.mesh, mesh), (&self.step, step)];
        let observed = observed.iter().all(|(d, can)| !can || d.count() > 1);
        let most = if observed { self.tuning.growth_observed } else { self.tuning.growth_assumed };
        let errors = self.errors();
        let cheapest = errors.cheapest(self.target(), now.segments as f64, self.free());
        let within_reach = cheapest.is_some_and(|(_, growth)| growth <= most);
        if within_reach && !unrelated {
            // What is given is compared before the search ends.
            return match self.free() {
                Free { mesh: false, .. } if mesh => Some(Part::Mesh),
                Free { step: false, .. } if step => Some(Part::Step),
                _ => None,
            };
        }
        match (mesh, step) {
            (true, false) => Some(Part::Mesh),
            (false, true) => {
                // A given mesh that leaves too much is not made better by smaller steps.
                let hopeless = errors.mesh >= self.target() && errors.step < 0.1 * errors.mesh;
                (!hopeless).then_some(Part::Step)
            }
            _ if errors.mesh > errors.step => Some(Part::Mesh),
            _ => Some(Part::Step),
        }
    }

    fn target(&self) -> f64 {
        self.tuning.target * self.scene.asked()
    }

    fn errors(&self) -> ErrorModel {
        ErrorModel {
            mesh: self.mesh.error(),
            step: self.step.error(),
            mesh_order: self.mesh.order(),
            step_order: self.step.order(),
        }
    }

    /// The chosen numerics after the last trial run.
    fn conclude(
        &self,
        last: Option<(Trial, Numerics)>,
        tried: Numerics,
        bound: Option<Bound>,
    ) -> Result<ChosenMotion, Error> {
        let end = self.trials.guess.time()?.end;
        let Some((trial, numerics)) = last else {
            let step = end / tried.steps as f64;
            return Ok(ChosenMotion { numerics: tried, step, error: None, bound, basis: None });
        };
        let errors = self.errors();
        let is_known = self.mesh.count() + self.step.count() > 0;
        let by_rodas4 = self.by_rodas4(numerics, errors)?;
        let (chosen_errors, chosen_from) = by_rodas4.unwrap_or((errors, numerics));
        let basis = Basis {
            trial,
            numerics,
            errors,
            chosen_errors,
            chosen_from,
            target: self.target(),
            most_work: LAST_GROWTH * self.trials.most_work,
        };
        let finer = basis.refinement(self.free());
        let (numerics, step) = self.numerics(&basis, finer)?;
        let error = is_known.then(|| chosen_errors.after(finer));
        let given = self.given_segments.is_some() || self.given_steps.is_some();
        let too_large = error.is_none_or(|error| error > self.scene.asked());
        let bound = match (too_large, given) {
            (false, _) => None,
            (true, true) if bound.is_none() => Some(Bound::Given),
            (true, _) => Some(Bound::Work),
        };
        Ok(ChosenMotion { numerics, step, error, bound, basis: Some(basis) })
    }

    /// Edges, steps and step size, s, of a refinement.
    fn numerics(&self, basis: &Basis, finer: Refinement) -> Result<(Numerics, f64), Error> {
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
            if let Some(largest) = largest_stable_step(&scene.posed()?)? {
                step = step.min(largest);
            }
            step = step.min(self.scene.supports.largest_good_step());
        }
        Ok((numerics, step))
    }

    /// Errors with `rodas4` and the numerics they belong to, where it reaches the target with less work.
    ///
    /// Limp and struck rods are left out: its steps are large there, damp what finer edges would add, and hide mesh errors.
    fn by_rodas4(
        &self,
        numerics: Numerics,
        errors: ErrorModel,
    ) -> Result<Option<(ErrorModel, Numerics)>, Error> {
        if !self.trials.open.scheme
            || self.given_segments.is_some()
            || is_struck(self.scene)
            || is_limp(self.scene, &self.trials.guess)
            || !self.scene.is_taken_by(Scheme::Rodas4)
        {
            return Ok(None);
        }
        rodas4::cheaper(&self.trials, numerics, errors, self.target())
    }
}
