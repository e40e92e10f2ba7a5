//! Where the rod is and how it moves.

use crate::numerics::scalar::Scalar;

/// The state of a rod at one time. Lengths: the rod's degrees of freedom, or its strains.
#[derive(Clone, Debug)]
pub struct State<D, F> {
    /// Time, s.
    pub time: f64,
    /// Unknowns, m (rad for angles).
    pub q: Vec<D>,
    /// What the angles are measured from; `()` where there are none.
    pub frames: F,
    /// Velocities, m/s (rad/s).
    pub v: Vec<D>,
    /// Elastic gradient less loads plus damping: minus the force that accelerates, N. Direct schemes
    /// leave the damping out; of an average it is half of the viscous force alone.
    pub unbalanced: Vec<D>,
    /// Strains; empty without Kelvin-Voigt damping.
    pub strain: Vec<D>,
    /// What whole turns of the rod add to the potential of its loads, J.
    pub wound: f64,
    /// Mean strain rates over the step that ended here, 1/s; empty without Kelvin-Voigt damping.
    pub strain_rate: Vec<D>,
}

impl<D: Scalar, F: Clone> State<D, F> {
    /// At rest at `q`, time zero.
    pub fn at_rest(q: Vec<D>, frames: F) -> Self {
        let zero = vec![D::from(0.0); q.len()];
        Self {
            time: 0.0,
            v: zero.clone(),
            unbalanced: zero,
            q,
            frames,
            wound: 0.0,
            strain: Vec::new(),
            strain_rate: Vec::new(),
        }
    }

    /// Copies `other` without allocating.
    pub fn restore(&mut self, other: &Self) {
        self.time = other.time;
        self.wound = other.wound;
        self.q.clone_from(&other.q);
        self.frames.clone_from(&other.frames);
        self.v.clone_from(&other.v);
        self.unbalanced.clone_from(&other.unbalanced);
        self.strain.clone_from(&other.strain);
        self.strain_rate.clone_from(&other.strain_rate);
    }
}
