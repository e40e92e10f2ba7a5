//! Forces on nodes, and in the plane moments on edges, that are constants times signals: loads in time.
//!
//! [`TimedLoads`] has one entry per signal, with the forces (N) on unknowns and the moments (N m) on edges that it
//! multiplies. Output are lists, which are overwritten: forces at a time, s (`set_at`), or means of forces and moments
//! over an interval, which are exact integrals of the signals over its length (`set_mean`; as forces alone
//! `set_mean_at`). `set_with_rate` adds the rates (N/s) at another time, times a given time, to the forces. The forces
//! of a moment depend on the direction of its edge; `add_tangent` adds minus their derivatives (N/m). `work` and
//! [`work_of`] return the work (J) of mean or constant loads between two states. These loads have no part in the energy
//! or gradient of the rod; steppers add them to the equations of motion.
//!
//! `TimedLoad` are the loads of one signal; `UnknownForce` is a force on an unknown, `EdgeMoment` a moment on an edge.

use crate::energy::{DeadMoment, Element};
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use crate::scene::SignalCurve;

/// A force on one unknown.
#[derive(Clone, Copy, Debug)]
pub struct UnknownForce<D> {
    /// Index of the unknown.
    pub unknown: usize,
    /// Force, N.
    pub force: D,
}

/// A moment on an edge of a planar rod.
#[derive(Clone, Copy, Debug)]
pub struct EdgeMoment<D> {
    /// Index of the edge.
    pub edge: usize,
    /// Moment, N m, counter-clockwise.
    pub moment: D,
}

/// Loads that one signal multiplies.
#[derive(Clone, Debug)]
pub struct TimedLoad<D> {
    /// The signal.
    pub signal: SignalCurve<D>,
    /// The forces at the value 1 of the signal.
    pub forces: Vec<UnknownForce<D>>,
    /// The moments at the value 1 of the signal; none in space.
    pub moments: Vec<EdgeMoment<D>>,
}

/// All loads of a rod that depend on time.
#[derive(Clone, Debug)]
pub struct TimedLoads<D> {
    /// One entry per signal.
    pub loads: Vec<TimedLoad<D>>,
}

/// The four coordinates of the nodes of edge `i` of a planar rod, m.
#[inline(always)]
fn ends<D>(q: &[D], i: usize) -> &[D; 4] {
    q[2 * i..].first_chunk().expect("an edge's nodes are nodes of the rod")
}

impl<D: Scalar> EdgeMoment<D> {
    /// The moment times `factor` as an element with forces and their derivatives. Its energy is not used.
    fn element(&self, factor: D) -> DeadMoment<D> {
        DeadMoment { moment: self.moment * factor, rest: [D::from(0.0); 2] }
    }

    /// The forces of the moment on the four coordinates of its edge at the unknowns `q`, N: minus the gradient of its
    /// potential.
    pub fn forces(&self, q: &[D]) -> [D; 4] {
        self.element(D::from(-1.0)).gradient(ends(q, self.edge))
    }

    /// Adds the second derivatives of the potential of the moment at `q`, N/m, to `tangent`.
    pub fn add_tangent(&self, q: &[D], tangent: &mut impl Tangent<D>) {
        let local = self.element(D::from(1.0)).tangent(ends(q, self.edge));
        tangent.add_corner(2 * self.edge, 4, &local.hessian);
    }

    /// The work of the moment, J, while its edge turns from the unknowns `before` to `now`, by less than half a turn.
    fn work(&self, [before, now]: [&[D]; 2]) -> f64 {
        let edge = |q: &[D]| {
            let [x0, y0, x1, y1] = *ends(q, self.edge);
            [(x1 - x0).value(), (y1 - y0).value()]
        };
        let ([a, b], [x, y]) = (edge(before), edge(now));
        self.moment.value() * (a * y - b * x).atan2(a * x + b * y)
    }
}

impl<D: Scalar> TimedLoads<D> {
    /// No loads.
    pub fn none() -> Self {
        Self { loads: Vec::new() }
    }

    /// Whether there are no loads in time.
    pub fn is_empty(&self) -> bool {
        self.loads.is_empty()
    }

    /// Overwrites `forces` and `moments` with their means from the time `from` to `to`, s; an unknown may have several
    /// entries.
    pub fn set_mean(
        &self,
        [from, to]: [D; 2],
        forces: &mut Vec<UnknownForce<D>>,
        moments: &mut Vec<EdgeMoment<D>>,
    ) {
        forces.clear();
        moments.clear();
        for load in &self.loads {
            let mean = load.signal.mean(from, to);
            load.add_forces(mean, forces);
            load.add_moments(mean, moments);
        }
    }

    /// Overwrites `forces` with the mean forces from the time `from` to `to`, s, those of moments at the unknowns `q`.
    pub fn set_mean_at(&self, [from, to]: [D; 2], q: &[D], forces: &mut Vec<UnknownForce<D>>) {
        forces.clear();
        for load in &self.loads {
            load.add_at(load.signal.mean(from, to), q, forces);
        }
    }

    /// Overwrites `forces` with those at the time `t`, s, and the unknowns `q`.
    pub fn set_at(&self, t: D, q: &[D], forces: &mut Vec<UnknownForce<D>>) {
        forces.clear();
        for load in &self.loads {
            load.add_at(load.signal.value(t), q, forces);
        }
    }

    /// Overwrites `forces` with those at the time `t`, s, plus the rates, N/s, at the time `start`, s, times `lead`, s.
    /// Moments act at the unknowns `q`, but in the rates at `q0`.
    pub fn set_with_rate(
        &self,
        t: f64,
        [start, lead]: [f64; 2],
        [q, q0]: [&[D]; 2],
        forces: &mut Vec<UnknownForce<D>>,
    ) {
        forces.clear();
        for load in &self.loads {
            load.add_at(load.signal.value(D::from(t)), q, forces);
            load.add_at(load.signal.rate(D::from(start)) * lead, q0, forces);
        }
    }

    /// Adds to `tangent` the second derivatives, N/m, of the potential of the moments at the time `t`, s, and the
    /// unknowns `q`.
    pub fn add_tangent(&self, t: f64, q: &[D], tangent: &mut impl Tangent<D>) {
        for load in self.loads.iter().filter(|load| !load.moments.is_empty()) {
            let value = load.signal.value(D::from(t));
            for EdgeMoment { edge, moment } in &load.moments {
                EdgeMoment { edge: *edge, moment: *moment * value }.add_tangent(q, tangent);
            }
        }
    }

    /// The work, J, of the mean loads from the time `from` to `to`, s, on the change of the unknowns from `before` to
    /// `now`.
    pub fn work(&self, [from, to]: [f64; 2], [before, now]: [&[D]; 2]) -> f64 {
        let mut work = 0.0;
        for load in &self.loads {
            let mean = load.signal.mean(D::from(from), D::from(to)).value();
            work += mean * work_of(&load.forces, &load.moments, [before, now]);
        }
        work
    }
}

/// The work, J, of constant `forces` and `moments` on the change of the unknowns from `before` to `now`.
pub fn work_of<D: Scalar>(
    forces: &[UnknownForce<D>],
    moments: &[EdgeMoment<D>],
    [before, now]: [&[D]; 2],
) -> f64 {
    let mut work = 0.0;
    for UnknownForce { unknown, force } in forces {
        work += force.value() * (now[*unknown].value() - before[*unknown].value());
    }
    for moment in moments {
        work += moment.work([before, now]);
    }
    work
}

impl<D: Scalar> TimedLoad<D> {
    /// Appends the forces times `factor` to `forces`.
    fn add_forces(&self, factor: D, forces: &mut Vec<UnknownForce<D>>) {
        for own in &self.forces {
            forces.push(UnknownForce { unknown: own.unknown, force: own.force * factor });
        }
    }

    /// Appends the moments times `factor` to `moments`.
    fn add_moments(&self, factor: D, moments: &mut Vec<EdgeMoment<D>>) {
        for own in &self.moments {
            moments.push(EdgeMoment { edge: own.edge, moment: own.moment * factor });
        }
    }

    /// Appends the forces, and those of the moments at the unknowns `q`, times `factor` to `forces`.
    fn add_at(&self, factor: D, q: &[D], forces: &mut Vec<UnknownForce<D>>) {
        self.add_forces(factor, forces);
        for moment in &self.moments {
            let local = moment.forces(q);
            for (k, force) in local.into_iter().enumerate() {
                forces.push(UnknownForce { unknown: 2 * moment.edge + k, force: force * factor });
            }
        }
    }
}
