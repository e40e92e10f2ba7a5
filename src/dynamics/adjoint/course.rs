//! A run that can be gone back over: its states, kept where there is room, and found again from some where not.

use crate::dynamics::linearization::Linearization;
use crate::dynamics::simulation::Simulation;
use crate::error::Error;
use crate::numerics::tangent::Tangent;
use crate::rod::{Rod, State};

/// A run from its start, in stretches whose first simulations are known.
#[derive(Clone, Debug)]
pub struct Course<R: Rod<f64>> {
    /// The number of steps before a stretch, and the simulation then.
    starts: Vec<(usize, Simulation<f64, R>)>,
    /// The states of all of the run, if there is room.
    states: Vec<State<f64, R::Frames>>,
    /// The ends of all steps, s.
    times: Vec<f64>,
    room: Room,
    /// Steps from one start to the next.
    stretch: usize,
}

/// What is shown of a course: a state, and the step that led to it.
pub type See<'a, R> = dyn FnMut(
        &State<f64, <R as Rod<f64>>::Frames>,
        Option<&Linearization<'_, f64, R>>,
    ) -> Result<(), Error>
    + 'a;

/// How many there is room for.
#[derive(Clone, Copy, Debug)]
struct Room {
    states: usize,
    simulations: usize,
}

impl Room {
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

    /// How long stretches of so many steps are.
    fn stretch(&self, steps: usize) -> usize {
        match steps <= self.states {
            true => steps.max(1),
            false => steps.div_ceil(self.simulations).max(self.states),
        }
    }
}

impl<R: Rod<f64>> Course<R> {
    /// Of a run that is about to start, of about so many steps.
    pub fn new(simulation: &Simulation<f64, R>, steps: usize, bytes: usize) -> Self {
        let room = Room::of(simulation, bytes);
        let states = match steps <= room.states {
            true => vec![simulation.state().clone()],
            false => Vec::new(),
        };
        let stretch = room.stretch(steps);
        Self { starts: vec![(0, simulation.clone())], states, times: Vec::new(), room, stretch }
    }

    /// Takes a step to its run.
    pub fn push(&mut self, simulation: &Simulation<f64, R>) {
        self.times.push(simulation.state().time);
        let count = self.times.len();
        if (1..=self.room.states).contains(&self.states.len()) {
            return self.states.push(simulation.state().clone());
        }
        // Steps in halves may be more than there is room for.
        self.states = Vec::new();
        if count.is_multiple_of(self.stretch) {
            self.starts.push((count, simulation.clone()));
        }
    }

    /// The simulation at the start.
    pub fn start(&self) -> &Simulation<f64, R> {
        &self.starts[0].1
    }

    /// Shows the states with the steps that led to them, from the last to the first; that of the start has none.
    ///
    /// # Errors
    /// Those of `see`, and of a step.
    pub fn back(&self, see: &mut See<'_, R>) -> Result<(), Error> {
        let mut linear = self.start().clone();
        linear.keep_tangent();
        if !self.states.is_empty() {
            show(&self.states, &mut linear, see)?;
        } else {
            let ends = self.starts[1..].iter().map(|(k, _)| *k).chain([self.times.len()]);
            let stretches: Vec<_> = self.starts.iter().zip(ends).collect();
            for ((first, start), end) in stretches.into_iter().rev() {
                self.back_over(start.clone(), *first..end, &mut linear, see)?;
            }
        }
        see(self.start().state(), None)
    }

    /// Shows the states with the steps that led to them, from the first on.
    ///
    /// # Errors
    /// Those of `see`, and of a step.
    pub fn forth(&self, see: &mut See<'_, R>) -> Result<(), Error> {
        let mut linear = self.start().clone();
        linear.keep_tangent();
        see(self.start().state(), None)?;
        for pair in self.states.windows(2) {
            let [before, after] = pair else { continue };
            see(after, linear.linearized(before, after)?.as_ref())?;
        }
        if self.states.is_empty() {
            for time in &self.times {
                linear.step_to(*time)?;
                see(linear.state(), linear.linearization().as_ref())?;
            }
        }
        Ok(())
    }

    fn back_over(
        &self,
        mut simulation: Simulation<f64, R>,
        steps: std::ops::Range<usize>,
        linear: &mut Simulation<f64, R>,
        see: &mut See<'_, R>,
    ) -> Result<(), Error> {
        let stretch = self.room.stretch(steps.len());
        if steps.len() <= stretch {
            let mut states = vec![simulation.state().clone()];
            for time in &self.times[steps] {
                simulation.step_to(*time)?;
                states.push(simulation.state().clone());
            }
            return show(&states, linear, see);
        }
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
            self.back_over(start, first..end, linear, see)?;
            end = first;
        }
        Ok(())
    }
}

/// Shows steps from the last to the first.
fn show<R: Rod<f64>>(
    states: &[State<f64, R::Frames>],
    linear: &mut Simulation<f64, R>,
    see: &mut See<'_, R>,
) -> Result<(), Error> {
    for pair in states.windows(2).rev() {
        let [before, after] = pair else { continue };
        see(after, linear.linearized(before, after)?.as_ref())?;
    }
    Ok(())
}
