//! Actuators of a rod that follow signals: changes of natural strains, tensions of tendons, and factors of follower
//! loads.
//!
//! [`NaturalShifts`] are the changes of the natural strains of edges and joints at the value 1 of a signal.
//! [`Actuators`] is the list of all actuators with a signal, each with its [`ActuatorEffect`]: such changes in
//! proportion to the signal, tendons whose tension (N) it is, or a group of loads without a potential whose factor it
//! is. It returns the values of all signals at a time (`values_at`, s), or their means over an interval (`means`), and
//! stores those to which the rod is set. A simulation sets the rod to the values or means of each step before it
//! evaluates forces. The list is empty without such actuators.
//!
//! `Actuator` is an actuator with its signal; `EdgeShift` and `JointShift` are changes of natural strains of an edge
//! and a joint.

use crate::numerics::scalar::Scalar;
use crate::scene::SignalCurve;

/// Changes of natural strains for the value 1 of a factor.
#[derive(Clone, Debug)]
pub struct NaturalShifts<D> {
    /// Index and change of the natural strain of edges.
    pub edges: Vec<EdgeShift<D>>,
    /// Index and changes of the natural strains of joints.
    pub joints: Vec<JointShift<D>>,
}

/// Change of the natural strain of an edge.
#[derive(Clone, Copy, Debug)]
pub struct EdgeShift<D> {
    /// Index of the edge.
    pub edge: usize,
    /// Change of its natural strain.
    pub strain: D,
}

/// Changes of the natural strains of a joint.
#[derive(Clone, Copy, Debug)]
pub struct JointShift<D> {
    /// Index of the joint, one less than that of its node.
    pub joint: usize,
    /// Changes of the integrated curvatures towards both directors and of the twist, rad; in a plane that of its only
    /// curvature first.
    pub strains: [D; 3],
}

/// An actuator that follows a signal.
#[derive(Clone, Debug)]
pub struct Actuator<D> {
    /// The signal.
    pub signal: SignalCurve<D>,
    /// The quantity of the rod that it changes.
    pub effect: ActuatorEffect<D>,
}

/// Quantity of a rod that an actuator changes.
#[derive(Clone, Debug)]
pub enum ActuatorEffect<D> {
    /// Natural strains, in proportion to the signal.
    Strains(NaturalShifts<D>),
    /// The tensions of the energies with these indices, N, which are the values of the signal.
    Tensions(Vec<usize>),
    /// The factor of the group of loads without a potential with this index, which is the value of the signal.
    FollowerLoads(usize),
}

/// All actuators of a rod that follow signals, with the values to which the rod is set.
#[derive(Clone, Debug)]
pub struct Actuators<D> {
    /// The actuators.
    pub list: Vec<Actuator<D>>,
    /// The value of each signal to which the rod is set.
    pub values: Vec<D>,
}

impl<D: Scalar> Actuators<D> {
    /// Actuators of a rod that is set to the values of their signals at the time `t`, s.
    pub fn at(list: Vec<Actuator<D>>, t: f64) -> Self {
        let values = list.iter().map(|actuator| actuator.signal.value(D::from(t))).collect();
        Self { list, values }
    }

    /// Whether the rod has no actuators that follow signals.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The values of the signals at the time `t`, s.
    pub fn values_at(&self, t: f64) -> Vec<D> {
        self.list.iter().map(|actuator| actuator.signal.value(D::from(t))).collect()
    }

    /// The means of the signals from the time `from` to `to`, s.
    pub fn means(&self, from: f64, to: f64) -> Vec<D> {
        let mean = |actuator: &Actuator<D>| actuator.signal.mean(D::from(from), D::from(to));
        self.list.iter().map(mean).collect()
    }
}
