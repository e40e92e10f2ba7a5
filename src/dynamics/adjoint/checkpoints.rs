//! Stored states of a run for its reverse sweep, within a given memory (bytes).
//!
//! Input: a simulation in its initial state, the expected number of steps and the memory; then the simulation after
//! each accepted step ([`Checkpoints::push`]). If the states of so many steps fit, all are stored. Otherwise whole
//! simulations are stored at checkpoints after equal numbers of steps. If bisected steps exceed the capacity for
//! states, these are discarded, and checkpoints follow. Of the memory 4/7 are for states and 3/7 for simulations, each
//! at least two, also in less memory. The states between two checkpoints are recomputed when the reverse sweep reaches
//! them, with further levels of checkpoints inside if needed (Griewank and Walther, *Evaluating Derivatives*, chapter
//! 12). [`Checkpoints::reverse`] and [`Checkpoints::forward`] call a function with the state after each accepted step
//! and the linearized step that led to it. The initial state comes without a step, last or first. `start` is the
//! simulation in that state. Errors are those of the function, and of recomputed and linearized steps.

use crate::dynamics::linearization::Linearization;
use crate::dynamics::simulation::Simulation;
use crate::error::Error;
use crate::numerics::tangent::Tangent;
use crate::rod::{Rod, State};

/// A run, with its simulations at checkpoints or all of its states.
#[derive(Clone, Debug)]
pub struct Checkpoints<R: Rod<f64>> {
    /// Checkpoints: the number of steps before, and the simulation there.
    starts: Vec<(usize, Simulation<f64, R>)>,
    /// All states of the run; empty where they need too much memory.
    states: Vec<State<f64, R::Frames>>,
    /// The ends of all steps, s.
    times: Vec<f64>,
    /// Capacity of the memory.
    room: Capacity,
    /// Steps from one checkpoint to the next.
    stretch: usize,
}

/// A function called with a state and the linearized step that led to it; `None` for the initial state.
pub type StepVisitor<'a, R> = dyn FnMut(
        &State<f64, <R as Rod<f64>>::Frames>,
        Option<&Linearization<'_, f64, R>>,
    ) -> Result<(), Error>
    + 'a;

/// Numbers of states and of simulations that fit into the memory.
#[derive(Clone, Copy, Debug)]
struct Capacity {
    states: usize,
    simulations: usize,
}

impl Capacity {
    /// The numbers of states and of simulations that fit into `bytes` bytes: 4/7 for states, 3/7 for simulations,
    /// each at least 2. The size of a simulation is estimated from its lists of unknowns and matrices.
    fn of<R: Rod<f64>>(simulation: &Simulation<f64, R>, bytes: usize) -> Self {
        let state = simulation.state();
        let (unknowns, internal) = (state.q.len(), &state.internal);
        let frames = if R::HAS_FRAMES { 2 * unknowns } else { 0 };
        let remembered = internal.strain.len() * 2 + internal.relaxing.len();
        let numbers = 3 * unknowns + state.acceleration.len() + frames + remembered;
        // Tangents with their factors, the elements, and lists of unknowns.
        let viscous = if internal.strain.is_empty() { 1 } else { 2 };
        let whole =
            2 * numbers + unknowns * (viscous * (2 * R::Tangent::NUMBERS_PER_ROW + 18) + 10);
        // More than half for states: the fewer stretches, the less is run again.
        let fit = |room: usize, numbers: usize| (room / (8 * numbers)).max(2);
        Self { states: fit(bytes / 7 * 4, numbers), simulations: fit(bytes / 7 * 3, whole) }
    }

    /// The number of steps between checkpoints of a run of `steps` steps: all of them (at least 1) if their states fit.
    /// Else `steps` over the number of simulations that fit, rounded up, or the number of states that fit if that is
    /// larger.
    fn stretch(&self, steps: usize) -> usize {
        match steps <= self.states {
            true => steps.max(1),
            false => steps.div_ceil(self.simulations).max(self.states),
        }
    }
}

impl<R: Rod<f64>> Checkpoints<R> {
    /// Storage for a run of about `steps` steps, with the simulation in its initial state as the first checkpoint. It
    /// takes about `bytes` bytes, and at least two states and two simulations. All states are stored if `steps` of them
    /// fit, else checkpoints after equal numbers of steps.
    pub fn new(simulation: &Simulation<f64, R>, steps: usize, bytes: usize) -> Self {
        let room = Capacity::of(simulation, bytes);
        // All states where they fit; otherwise they are recomputed from checkpoints.
        let states = match steps <= room.states {
            true => vec![simulation.state().clone()],
            false => Vec::new(),
        };
        let stretch = room.stretch(steps);
        Self { starts: vec![(0, simulation.clone())], states, times: Vec::new(), room, stretch }
    }

    /// Stores the state after an accepted step, or the simulation after every `stretch` steps. If bisected steps exceed
    /// the capacity for states, all stored states are discarded, and checkpoints are stored from there on. The time of
    /// the step is stored in any case.
    pub fn push(&mut self, simulation: &Simulation<f64, R>) {
        // The times are stored in any case: recomputed steps end at the same times.
        self.times.push(simulation.state().time);
        let count = self.times.len();
        if (1..=self.room.states).contains(&self.states.len()) {
            return self.states.push(simulation.state().clone());
        }
        // Bisected steps may exceed the capacity.
        self.states = Vec::new();
        if count.is_multiple_of(self.stretch) {
            self.starts.push((count, simulation.clone()));
        }
    }

    /// The simulation in its initial state, at t = 0.
    pub fn start(&self) -> &Simulation<f64, R> {
        &self.starts[0].1
    }

    /// Calls `visit` with all states and the linearized steps that led to them, from the last to the first. The
    /// initial state comes last, without a step. States that are not stored are recomputed from checkpoints.
    ///
    /// # Errors
    /// Those of `visit`, and of a step.
    pub fn reverse(&self, visit: &mut StepVisitor<'_, R>) -> Result<(), Error> {
        // One simulation linearizes all steps, from the states before and after each.
        let mut linear = self.start().clone();
        linear.keep_all_tangents();
        if !self.states.is_empty() {
            visit_backwards(&self.states, &mut linear, visit)?;
        } else {
            let ends = self.starts[1..].iter().map(|(k, _)| *k).chain([self.times.len()]);
            let stretches: Vec<_> = self.starts.iter().zip(ends).collect();
            // Stretches between checkpoints, the last one first.
            for ((first, start), end) in stretches.into_iter().rev() {
                self.reverse_over(start.clone(), *first..end, &mut linear, visit)?;
            }
        }
        visit(self.start().state(), None)
    }

    /// Calls `visit` with all states and the linearized steps that led to them, from the first to the last. The
    /// initial state comes first, without a step. Without stored states the run is repeated once.
    ///
    /// # Errors
    /// Those of `visit`, and of a step.
    pub fn forward(&self, visit: &mut StepVisitor<'_, R>) -> Result<(), Error> {
        let mut linear = self.start().clone();
        linear.keep_all_tangents();
        visit(self.start().state(), None)?;
        for pair in self.states.windows(2) {
            let [before, after] = pair else { continue };
            visit(after, linear.linearized(before, after)?.as_ref())?;
        }
        // Without stored states the run is repeated once, forward.
        if self.states.is_empty() {
            for time in &self.times {
                linear.step_to(*time)?;
                visit(linear.state(), linear.linearization().as_ref())?;
            }
        }
        Ok(())
    }

    /// Visits the ends of a range of steps backwards. Their states are recomputed from the `simulation` at the start of
    /// the range. If they do not fit into the memory, further checkpoints inside the range are stored, and the parts
    /// are visited recursively. `linear` linearizes the steps. Errors are those of `visit`, and of repeated and
    /// linearized steps.
    fn reverse_over(
        &self,
        mut simulation: Simulation<f64, R>,
        steps: std::ops::Range<usize>,
        linear: &mut Simulation<f64, R>,
        visit: &mut StepVisitor<'_, R>,
    ) -> Result<(), Error> {
        let stretch = self.room.stretch(steps.len());
        // Short enough: all states of the range are recomputed and visited backwards.
        if steps.len() <= stretch {
            let mut states = vec![simulation.state().clone()];
            for time in &self.times[steps] {
                simulation.step_to(*time)?;
                states.push(simulation.state().clone());
            }
            return visit_backwards(&states, linear, visit);
        }
        // Too long: a second level of checkpoints inside the range.
        let mut starts = Vec::new();
        for k in steps.clone() {
            if (k - steps.start).is_multiple_of(stretch) {
                starts.push((k, simulation.clone()));
            }
            simulation.step_to(self.times[k])?;
        }
        drop(simulation);
        let mut end = steps.end;
        while let Some((first, start)) = starts.pop() {
            self.reverse_over(start, first..end, linear, visit)?;
            end = first;
        }
        Ok(())
    }
}

/// Calls `visit` with each of `states` and the step from the one before, from the last to the second state. `linear`
/// linearizes the steps. Errors are those of `visit` and of linearized steps.
fn visit_backwards<R: Rod<f64>>(
    states: &[State<f64, R::Frames>],
    linear: &mut Simulation<f64, R>,
    visit: &mut StepVisitor<'_, R>,
) -> Result<(), Error> {
    for pair in states.windows(2).rev() {
        let [before, after] = pair else { continue };
        visit(after, linear.linearized(before, after)?.as_ref())?;
    }
    Ok(())
}
