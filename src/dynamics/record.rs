//! Recorded motion of a run: positions and velocities of tracked nodes at the start and after every step of the
//! scene, interpolated in between.
//!
//! [`Record`] stores, at each recorded time, position and velocity (m and m/s, world axes) of every tracked node. Then
//! follow the three director axes of each recorded edge with their rates (1/s). If requested, force (N) and moment (N
//! m) of the support at the start and of that at the end are last. Each of these is a `Motion`, two vectors; one list
//! has them record after record. One more list per parameter has their derivatives in the same order. Energies (J), the
//! ends of accepted steps (s) and counts of work are stored beside them. `push` appends a time, and `truncate` removes
//! all records after a given number of them.
//!
//! [`RecordView`] reads a record at any time from 0 to the last one: in its own numbers (`Record::read`), or in dual
//! numbers with the derivative by one parameter (`Record::along`). Between records, nodes and axes are cubic Hermite
//! interpolants of values and rates; energies and other lists are linear ([`RecordView::linear`]). `position` and
//! `places` return a point, a weighted sum of nodes, at one and at many times. `marker` returns a point with an offset
//! along the axes of edges, `motion` a point with its velocity. `node` and `axes` are values at one record, and
//! `reactions` those of both supports at all records, empty if they are not recorded. `weights` returns the recorded
//! motions and their factors in an interpolated position, for adjoint derivatives.
//!
//! Errors: [`Error::OutOfRange`] for a time before 0 or after the last record, and for a node, edge or step that is not
//! recorded; [`Error::Invalid`] for an empty record.

use crate::dynamics::step::Work;
use crate::dynamics::unstable_state::StabilityChecks;
use crate::error::Error;
use crate::numerics::hermite::HermiteWeights;
use crate::numerics::scalar::Scalar;
use crate::rod::Energies;
use crate::scene::Stencil;
use crate::scene::marker::MarkerStencil;
use crate::statics::{Reaction, Reactions};
use num_dual::Dual64;
use std::sync::Arc;
use std::time::Duration;

/// Relative excess of a time over the last record that is accepted: sums of steps and unit conversions have rounding
/// errors of some 1e-16.
const TIME_TOLERANCE: f64 = 1e-9;

/// Position and velocity of a node in world axes, m and m/s, or their derivatives.
pub(crate) type Motion<D = f64> = [[D; 3]; 2];

/// Positions and velocities of tracked nodes and director axes at every step of the scene.
#[derive(Clone, Debug)]
pub(crate) struct Record<D = f64> {
    /// The nodes that are recorded, ascending.
    tracked: Arc<[usize]>,
    /// The edges whose axes are recorded, ascending; three axes each follow the nodes.
    edges: Arc<[usize]>,
    /// Times of the records, s: the start and the end of every step of the scene.
    times: Vec<f64>,
    /// The motions of every tracked node and axis, record after record.
    motion: Vec<Motion<D>>,
    /// Their derivatives by every parameter, in a run in plain numbers with parameters.
    derivatives: Vec<Vec<Motion>>,
    /// Ends of all accepted steps, s: those of the scene, and halves where a step was rejected.
    pub taken: Vec<f64>,
    /// Energies at every time, if requested.
    pub energies: Option<Vec<Energies>>,
    /// Whether the reactions of the supports are recorded.
    pub has_reactions: bool,
    /// The work of the run.
    pub work: Work,
    /// Wall time of the stepping alone.
    pub stepping: Duration,
    /// Whether anything is recorded.
    pub keeps: bool,
    /// Checks for unstable states, if requested.
    pub stability: Option<StabilityChecks>,
}

impl<D: Scalar> Record<D> {
    /// An empty record of the nodes `tracked`, which must be ascending, with an empty list of derivatives for each of
    /// `parameters` parameters. Axes, energies, reactions and stability checks are not requested; motions are kept.
    pub fn new(tracked: impl Into<Arc<[usize]>>, parameters: usize) -> Self {
        Self {
            tracked: tracked.into(),
            edges: Arc::new([]),
            times: Vec::new(),
            motion: Vec::new(),
            derivatives: vec![Vec::new(); parameters],
            taken: Vec::new(),
            energies: None,
            has_reactions: false,
            work: Work::default(),
            stepping: Duration::ZERO,
            keeps: true,
            stability: None,
        }
    }

    /// The record with `edges`, which must be ascending, as the edges whose director axes are recorded.
    pub fn with_axes(self, edges: impl Into<Arc<[usize]>>) -> Self {
        Self { edges: edges.into(), ..self }
    }

    /// The edges whose axes are recorded, ascending.
    pub fn edges(&self) -> Arc<[usize]> {
        self.edges.clone()
    }
    /// The nodes that are recorded, ascending.
    pub fn tracked(&self) -> Arc<[usize]> {
        self.tracked.clone()
    }
    /// Times of the records, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }
    /// The motions of tracked nodes, then of director axes, then the reactions if they are recorded, record after
    /// record.
    pub fn motions(&self) -> &[Motion<D>] {
        &self.motion
    }

    /// The motions of the tracked nodes, record after record.
    pub fn tracked_motions(&self) -> impl Iterator<Item = &Motion<D>> {
        let tracked = self.tracked.len();
        self.motion.chunks(self.width().max(1)).flat_map(move |own| own.iter().take(tracked))
    }

    /// Appends a record at `time`, s: the motions of the tracked nodes, then of the axes, then the reactions if they
    /// are recorded, [`width`](Self::width) in all.
    pub fn push(&mut self, time: f64, motions: impl Iterator<Item = Motion<D>>) {
        self.times.push(time);
        self.motion.extend(motions);
    }

    /// The list of the derivatives of all motions by parameter `k`, in the order of the motions, mutable. The caller
    /// appends those of each record.
    pub fn derivatives_mut(&mut self, k: usize) -> &mut Vec<Motion> {
        &mut self.derivatives[k]
    }

    /// Reserves memory for the derivatives of `times` records by every parameter. A failed allocation is ignored: the
    /// lists then grow as needed.
    pub fn make_room(&mut self, times: usize) {
        let motions = times.saturating_mul(self.width());
        for list in &mut self.derivatives {
            let _ = list.try_reserve_exact(motions);
        }
    }

    /// Removes all records after the first `times`, with their derivatives and energies, and the ends of
    /// accepted steps after the last remaining time. Work and stability checks stay.
    pub fn truncate(&mut self, times: usize) {
        let motions = times * self.width();
        self.times.truncate(times);
        self.motion.truncate(motions);
        self.derivatives.iter_mut().for_each(|list| list.truncate(motions));
        self.energies.iter_mut().for_each(|list| list.truncate(times));
        // Halves of a removed step are accepted steps too, and must not remain.
        let last = self.times.last().copied().unwrap_or(0.0);
        self.taken.retain(|end| *end <= last);
    }

    /// Position and velocity of a tracked node after `k` steps of the scene; `None` if the node is not tracked or the
    /// step is not recorded.
    pub fn motion_of(&self, node: usize, k: usize) -> Option<&Motion<D>> {
        let column = self.tracked.binary_search(&node).ok()?;
        self.motion.get(k * self.width() + column)
    }

    /// The index of the motion of a node after `k` steps in the list of motions. [`Error::OutOfRange`] for a node
    /// that is not tracked or a step that is not recorded.
    pub fn index_of(&self, node: usize, k: usize) -> Result<usize, Error> {
        let column = place_in(&self.tracked, node, "a node that was not tracked")?;
        let last = self.times.len().saturating_sub(1);
        if k > last {
            let (found, high) = (k as f64, last as f64);
            return Err(Error::OutOfRange { what: "step", found, low: 0.0, high });
        }
        Ok(k * self.width() + column)
    }

    /// The number of recorded motions per time: one for each tracked node, three for each recorded edge, and two with
    /// reactions.
    fn width(&self) -> usize {
        self.tracked.len() + 3 * self.edges.len() + 2 * usize::from(self.has_reactions)
    }

    /// The lists of the record, by value: times, s; motions, record after record; and their derivatives in the same
    /// order, one list per parameter.
    pub fn into_parts(self) -> (Vec<f64>, Vec<Motion<D>>, Vec<Vec<Motion>>) {
        (self.times, self.motion, self.derivatives)
    }

    /// A view of the record in its own numbers, which interpolates at any time from 0 to the last record.
    pub fn read(&self) -> RecordView<'_, D> {
        let motions = RecordedMotions::Own(&self.motion);
        RecordView {
            tracked: &self.tracked,
            edges: &self.edges,
            has_reactions: self.has_reactions,
            times: &self.times,
            motions,
        }
    }
}

/// A record that is interpolated at any time, in its own numbers or with a derivative.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordView<'a, D = f64> {
    tracked: &'a [usize],
    edges: &'a [usize],
    has_reactions: bool,
    times: &'a [f64],
    motions: RecordedMotions<'a, D>,
}

/// The motions of a record, with or without derivatives.
#[derive(Clone, Copy, Debug)]
enum RecordedMotions<'a, D> {
    /// In the record's own scalar.
    Own(&'a [Motion<D>]),
    /// Plain ones with their derivatives, if they have any, and the function that combines both.
    Along(&'a [Motion], Option<&'a [Motion]>, fn(&Motion, &Motion) -> Motion<D>),
}

impl<D: Scalar> RecordView<'_, D> {
    /// The motion at `index` in the list of all motions: position, m, and velocity, m/s, of a node, axis and its rate,
    /// 1/s, or force, N, and moment, N m, of a support. A view with derivatives combines both into dual numbers.
    #[inline]
    fn at(&self, index: usize) -> Motion<D> {
        match self.motions {
            RecordedMotions::Own(all) => all[index],
            RecordedMotions::Along(all, rates, both) => {
                both(&all[index], rates.map_or(&[[0.0; 3]; 2], |rates| &rates[index]))
            }
        }
    }

    /// The number of recorded motions per time, as in [`Record::width`]: one per tracked node, three per edge, two with
    /// reactions.
    fn width(&self) -> usize {
        self.tracked.len() + 3 * self.edges.len() + 2 * usize::from(self.has_reactions)
    }

    /// Times of the records, s.
    pub fn times(&self) -> &[f64] {
        self.times
    }

    /// Forces, N, and moments, N m, of both supports on the rod at every recorded time, in world axes; empty if they
    /// are not recorded.
    pub fn reactions(self) -> impl Iterator<Item = Reactions<D>> {
        let (width, count) = (self.width(), self.times.len() * usize::from(self.has_reactions));
        (1..=count).map(move |k| {
            let [start, end] = [2, 1].map(|place| self.at(k * width - place));
            let [start, end] = [start, end].map(|[force, moment]| Reaction { force, moment });
            Reactions { start, end }
        })
    }

    /// The position of a point at a time, s, in world axes, m: the sum over the nodes of its `stencil`, each times its
    /// weight. Between steps a node is at the cubic Hermite interpolant of its positions and velocities at both ends of
    /// the step. A record of one time gives its position at any accepted time. [`Error::OutOfRange`] for times outside
    /// of the record and for nodes that are not tracked; [`Error::Invalid`] for an empty record.
    pub fn position(&self, stencil: &Stencil<D>, time: D) -> Result<[D; 3], Error> {
        let (k, hermite) = self.around(time)?;
        self.interpolate(&self.columns(stencil)?, k, &hermite)
    }

    /// The positions of a point at these `times`, m, in their order, as [`position`](Self::position) computes them,
    /// with the same errors. The step of each time is searched forward from that of the time before; an earlier time is
    /// found by bisection.
    pub fn places(
        &self,
        stencil: &Stencil<D>,
        times: impl Iterator<Item = D>,
    ) -> Result<Vec<[D; 3]>, Error> {
        let columns = self.columns(stencil)?;
        let mut step = 1;
        let place = |time: D| {
            self.check(time.value())?;
            step = self.step_from(step, time.value());
            self.interpolate(&columns, step, &self.hermite(step, time))
        };
        times.map(place).collect()
    }

    /// The position of a marker at a time, m: the point on the center line plus its offset along the director axes of
    /// its edges, summed with their weights. All are interpolated between steps. [`Error::OutOfRange`] for times
    /// outside of the record and nodes or edges that were not recorded; [`Error::Invalid`] for an empty record.
    pub fn marker(&self, marker: &MarkerStencil<D>, time: D) -> Result<[D; 3], Error> {
        let (k, hermite) = self.around(time)?;
        let mut columns = self.columns(&marker.centre)?;
        for (edge, weight) in &marker.edges {
            let first = self.tracked.len()
                + 3 * place_in(self.edges, *edge, "an edge that was not tracked")?;
            // Axes are interpolated like positions, so that the marker moves with continuous
            // velocity.
            columns.extend([0, 1, 2].map(|c| (first + c, *weight * marker.offset[c])));
        }
        self.interpolate(&columns, k, &hermite)
    }

    /// Position, m, and velocity, m/s, of a point at a time: the cubic Hermite interpolant and its derivative by time,
    /// which at the ends of a step is the recorded velocity. The velocity is zero if there is one record only. Errors
    /// are those of [`position`](Self::position).
    pub fn motion(&self, stencil: &Stencil<D>, time: f64) -> Result<Motion<D>, Error> {
        let position = self.position(stencil, D::from(time))?;
        let (k, _) = self.around(time)?;
        // A record of one time is a state at rest: it has no step to differentiate over.
        let rates = match self.times.get(k) {
            Some(end) => HermiteWeights::derivative(self.times[k - 1], *end, D::from(time)),
            None => return Ok([position, [D::from(0.0); 3]]),
        };
        let columns = self.columns(stencil)?;
        Ok([position, self.interpolate(&columns, k, &rates)?])
    }

    /// The value at a time, s, of a list `values` with a value at every recorded time, linear between these. The errors
    /// for the time are those of [`position`](Self::position).
    pub fn linear(&self, values: &[D], time: D) -> Result<D, Error> {
        self.check(time.value())?;
        let k = self.step_at(time.value());
        // A record of one time has its value at any accepted time.
        let (Some(end), Some(after)) = (self.times.get(k), values.get(k)) else {
            return Ok(values[k - 1]);
        };
        let part = (time - self.times[k - 1]) * (1.0 / (end - self.times[k - 1]));
        Ok(values[k - 1] + (*after - values[k - 1]) * part)
    }

    /// The recorded motions from which the position of a point at a time is interpolated: index in the list of motions,
    /// with the factors of position and of velocity (s). Both include the node's weight in the `stencil`. Two entries
    /// per node: first those of all nodes at the start of the step, then at its end. Errors are those of
    /// [`position`](Self::position).
    pub fn weights(&self, stencil: &Stencil, time: f64) -> Result<Vec<(usize, [f64; 2])>, Error> {
        let (k, hermite) = self.around(time)?;
        let width = self.width();
        // At rest there is one record: both ends of the interval are the same.
        let after = if k < self.times.len() { k } else { k - 1 };
        let ends = [(k - 1, [hermite.x0, hermite.v0]), (after, [hermite.x1, hermite.v1])];
        let columns = self.columns(stencil)?;
        let of_end = |(row, by): (usize, [f64; 2])| {
            columns
                .iter()
                .map(move |(column, weight)| (row * width + column, by.map(|x| x * weight)))
        };
        Ok(ends.into_iter().flat_map(of_end).collect())
    }

    /// The position of a node at record `k`, m, in world axes. [`Error::OutOfRange`] for a node that is not tracked.
    /// `k` must be a record.
    pub fn node(&self, node: usize, k: usize) -> Result<[D; 3], Error> {
        let column = place_in(self.tracked, node, "a node that was not tracked")?;
        Ok(self.at(k * self.width() + column)[0])
    }

    /// Tangent and both material directors of an edge at record `k`, unit vectors in world axes. [`Error::OutOfRange`]
    /// for an edge that is not recorded. `k` must be a record.
    pub fn axes(&self, edge: usize, k: usize) -> Result<[[D; 3]; 3], Error> {
        let place = place_in(self.edges, edge, "an edge that was not tracked")?;
        let first = k * self.width() + self.tracked.len() + 3 * place;
        Ok([0, 1, 2].map(|c| self.at(first + c)[0]))
    }

    /// The step that contains `time`, s: the index of the record at its end, and the Hermite weights at that time. An
    /// error outside of the record.
    fn around<E: Scalar>(&self, time: E) -> Result<(usize, HermiteWeights<E>), Error> {
        self.check(time.value())?;
        let k = self.step_at(time.value());
        Ok((k, self.hermite(k, time)))
    }

    /// Rejects times before 0, NaN, or after the last record by more than the relative [`TIME_TOLERANCE`], and any
    /// time of an empty record.
    fn check(&self, time: f64) -> Result<(), Error> {
        let Some(&last) = self.times.last() else {
            return Err(Error::invalid("trajectory", "no record", "a trajectory that has run"));
        };
        // Sums of steps and unit conversions have rounding errors of some 1e-16.
        match time >= 0.0 && time <= last * (1.0 + TIME_TOLERANCE) {
            true => Ok(()),
            false => Err(Error::OutOfRange { what: "time", found: time, low: 0.0, high: last }),
        }
    }

    /// The index of the record at the end of the step that contains `time`, s, by bisection. A time at the end of a
    /// step belongs to the next one, at the end of the last step to that; 1 if there is one record only.
    fn step_at(&self, time: f64) -> usize {
        // By bisection; a time at the end of the last step belongs to that step.
        let k = self.times.partition_point(|end| *end <= time);
        k.clamp(1, self.times.len().max(2) - 1)
    }

    /// The same as [`step_at`](Self::step_at), searched forward from step `k`, or by bisection for a time before that
    /// step.
    fn step_from(&self, mut k: usize, time: f64) -> usize {
        // Ascending times find the next step by going forward, without a bisection for each.
        if self.times[k - 1] > time {
            return self.step_at(time);
        }
        while k + 1 < self.times.len() && self.times[k] <= time {
            k += 1;
        }
        k
    }

    /// The weights of positions and velocities at both ends of the step that ends with record `k`, for the cubic
    /// Hermite interpolant at `time`, s. With one record only the position there has the weight 1, and the others 0.
    fn hermite<E: Scalar>(&self, k: usize, time: E) -> HermiteWeights<E> {
        match self.times.get(k) {
            Some(end) => HermiteWeights::new(self.times[k - 1], *end, time),
            None => HermiteWeights::new(0.0, 1.0, E::from(0.0)),
        }
    }

    /// The interpolated position, m, in the step that ends with record `k`, or the velocity, m/s, if `hermite` has the
    /// derivatives of the weights. It is the sum over `columns` (index within a record, and weight) of the Hermite
    /// interpolants with the weights `hermite`. Always `Ok`.
    fn interpolate(
        &self,
        columns: &[(usize, D)],
        k: usize,
        hermite: &HermiteWeights<D>,
    ) -> Result<[D; 3], Error> {
        let width = self.width();
        // A rod at rest has one record.
        let after = if k < self.times.len() { k } else { k - 1 };
        let mut sum = [D::from(0.0); 3];
        for (column, weight) in columns {
            let place = |k: usize| self.at(k * width + column);
            let ([x0, v0], [x1, v1]) = (place(k - 1), place(after));
            for (c, sum) in sum.iter_mut().enumerate() {
                let value = hermite.x0 * x0[c]
                    + hermite.x1 * x1[c]
                    + hermite.v0 * v0[c]
                    + hermite.v1 * v1[c];
                *sum += value * *weight;
            }
        }
        Ok(sum)
    }

    /// For each node of a stencil, its index among the motions of one record, and its weight. [`Error::OutOfRange`] for
    /// a node that is not tracked.
    fn columns<E: Scalar>(&self, stencil: &Stencil<E>) -> Result<Vec<(usize, E)>, Error> {
        let column = |(node, weight): &(usize, E)| {
            Ok((place_in(self.tracked, *node, "a node that was not tracked")?, *weight))
        };
        stencil.nodes.iter().map(column).collect()
    }
}

/// The index of `wanted`, a node or edge, in the ascending list `recorded`. [`Error::OutOfRange`] with the first and
/// last entry of the list if it is not there; `what` names it in the message.
fn place_in(recorded: &[usize], wanted: usize, what: &'static str) -> Result<usize, Error> {
    recorded.binary_search(&wanted).map_err(|_| Error::OutOfRange {
        what,
        found: wanted as f64,
        low: recorded.first().map_or(0.0, |i| *i as f64),
        high: recorded.last().map_or(0.0, |i| *i as f64),
    })
}

impl Record {
    /// A view of the record in dual numbers, with the derivatives by parameter `k`; `None` gives zero derivatives.
    pub fn along(&self, k: Option<usize>) -> RecordView<'_, Dual64> {
        let rates = k.map(|k| &self.derivatives[k][..]);
        let motions = RecordedMotions::Along(&self.motion, rates, motion_with_rates);
        RecordView {
            tracked: &self.tracked,
            edges: &self.edges,
            has_reactions: self.has_reactions,
            times: &self.times,
            motions,
        }
    }
}

/// The position and velocity of `motion` as dual numbers with the derivatives `rates`.
#[inline]
fn motion_with_rates(motion: &Motion, rates: &Motion) -> Motion<Dual64> {
    let mut both = [[Dual64::from(0.0); 3]; 2];
    for part in 0..2 {
        for c in 0..3 {
            both[part][c] = Dual64::new(motion[part][c], rates[part][c]);
        }
    }
    both
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_positions_in_any_order() {
        let mut record = Record::<f64>::new(vec![3], 0);
        for k in 0..9_u32 {
            let t = f64::from(k * k);
            record.push(t, std::iter::once([[t.sin(), t, -t], [t.cos(), 1.0, -1.0]]));
        }
        let (read, stencil) = (record.read(), Stencil { nodes: vec![(3, 1.0)] });
        // Steps of unequal length end at k^2, the last one at 64.
        let ascending = (0..=640).map(|k| 0.1 * f64::from(k));
        let times: Vec<f64> = ascending.chain([63.0, 0.5, 64.0, 0.0, 1.0]).collect();
        let places = read.places(&stencil, times.iter().copied()).unwrap();
        for (time, place) in times.iter().zip(places) {
            assert_eq!(read.position(&stencil, *time).unwrap(), place, "{time}");
        }
        assert!(read.places(&stencil, [1.0, 65.0].into_iter()).is_err());
        assert!(read.places(&stencil, std::iter::once(f64::NAN)).is_err());
        assert!(Record::<f64>::new(vec![3], 0).read().places(&stencil, [0.0].into_iter()).is_err());
    }
}
