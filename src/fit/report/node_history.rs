//! Positions of all nodes of a run around given times.
//!
//! Input: intervals of time, s, and the states of a run at increasing times, of which those within a few steps of an
//! interval are stored. Output: the position of a node, m, at a time in an interval, by the polynomial through the two
//! stored states on each side. Its error is of the fourth order in the step. `None` for times that are not stored. At
//! most [`MOST_POSITIONS`] positions are stored.

use crate::scene::Time;

/// Number of steps beyond an interval that are stored: two on each side, with a margin for rounding.
const MARGIN: f64 = 2.5;
/// Largest number of stored positions, for the memory.
const MOST_POSITIONS: usize = 2_000_000;
/// Tolerance of times, s.
const TIME_TOLERANCE: f64 = 1e-9;

/// A state of a run.
struct StoredState {
    /// Time, s.
    time: f64,
    /// Positions of all nodes, m.
    nodes: Vec<[f64; 3]>,
}

/// States of a run around given times.
pub(crate) struct NodeHistory {
    intervals: Vec<[f64; 2]>,
    /// Time step, s.
    step: f64,
    states: Vec<StoredState>,
}

impl NodeHistory {
    /// An empty history for these intervals of time, s, of a run with the step of `time`.
    pub fn new(intervals: Vec<[f64; 2]>, time: Option<&Time>) -> Self {
        Self { intervals, step: time.map_or(0.0, Time::step_size), states: Vec::new() }
    }

    /// Stores the positions of the `nodes` at a time after those before, if it is near an interval.
    pub fn store(&mut self, time: f64, nodes: impl ExactSizeIterator<Item = [f64; 3]>) {
        let margin = MARGIN * self.step;
        let is_near = |[from, to]: &[f64; 2]| (from - margin..=to + margin).contains(&time);
        let has_room = (self.states.len() + 1) * nodes.len() <= MOST_POSITIONS;
        if has_room && self.intervals.iter().any(is_near) {
            self.states.push(StoredState { time, nodes: nodes.collect() });
        }
    }

    /// The position of a node, m, at a time, s; `None` if the states around it are not stored.
    pub fn position(&self, node: usize, time: f64) -> Option<[f64; 3]> {
        let next = self.states.partition_point(|state| state.time <= time);
        let near = |k: usize| {
            Some(k).filter(|k| {
                self.states
                    .get(*k)
                    .is_some_and(|state| (state.time - time).abs() <= MARGIN * self.step)
            })
        };
        let around = [next.checked_sub(2), next.checked_sub(1), Some(next), Some(next + 1)];
        let around: Vec<usize> = around.into_iter().flatten().filter_map(near).collect();
        let times = || around.iter().map(|k| self.states[*k].time);
        let is_between = times().any(|t| t <= time + TIME_TOLERANCE)
            && times().any(|t| t >= time - TIME_TOLERANCE);
        if !is_between {
            return None;
        }
        // Lagrange's polynomial through the states.
        let mut position = [0.0; 3];
        for k in &around {
            let StoredState { time: own, nodes } = &self.states[*k];
            let others = times().filter(|t| t != own);
            let weight: f64 = others.map(|t| (time - t) / (own - t)).product();
            let node = nodes.get(node)?;
            position.iter_mut().zip(node).for_each(|(x, node)| *x += weight * node);
        }
        Some(position)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cubic motion is exact, at the ends a motion with fewer states around it is of lower order; other times are
    /// not stored.
    #[test]
    fn cubic_motion_is_exact_within_the_intervals() {
        let mut history = NodeHistory {
            intervals: vec![[0.0, 0.0], [0.5, 0.52]],
            step: 0.01,
            states: Vec::new(),
        };
        let place = |t: f64| [t * t * t, 1.0 - t, 2.0];
        for k in 0..=100 {
            let t = 0.01 * f64::from(k);
            history.store(t, [[0.0; 3], place(t)].into_iter());
        }
        assert!(history.states.len() < 12, "{}", history.states.len());
        for t in [0.0, 0.5, 0.503, 0.5157, 0.52] {
            let found = history.position(1, t).unwrap();
            for c in 0..3 {
                assert!((found[c] - place(t)[c]).abs() < 1e-14, "{t}");
            }
        }
        assert_eq!(history.position(1, 0.3), None);
        assert_eq!(history.position(7, 0.5), None);
    }
}
