//! Motions of the director axes of recorded edges, for markers beside the center line, and their derivatives by
//! parameters.
//!
//! A marker with an offset moves with the directors of its edge. Input: the edges of a record, a state, and the
//! derivatives of the state by parameters. Output of `motions`, for every recorded edge in ascending order: tangent and
//! both material directors (unit vectors in world axes), each with its rate of change (1/s). `rates` returns their
//! derivatives by parameter `k`, in the same order, per unit of the parameter. They follow from dual numbers made of
//! the state, its derivatives, and the rotation from the frames of the simulation to the directors. `new` returns
//! `None` for a record without edges.

use crate::dynamics::record::{Motion, Record};
use crate::dynamics::sensitivity::Sensitivities;
use crate::problem::{DirectorRotation, Discretized, FramesOf, Model};
use crate::rod::{ForwardSensitivity, State};
use crate::scene::Parameter;
use num_dual::Dual64;
use std::sync::Arc;

/// The rotations from the frames of a simulation to its material directors, without derivatives and along each
/// parameter, for the axes of recorded edges.
pub(super) struct DirectorAxes {
    /// The recorded edges, ascending.
    edges: Arc<[usize]>,
    /// The rotation from the frames of a simulation to the directors.
    directors: DirectorRotation<f64>,
    /// The same with the derivatives along each parameter.
    derived: Vec<DirectorRotation<Dual64>>,
}

impl DirectorAxes {
    /// The axes of the edges of `record`, with the rotations for their derivatives by `parameters`; `None` if the
    /// record has no edges.
    pub fn new<M: Model>(
        discretized: &Discretized<'_, M>,
        parameters: &[Parameter],
        record: &Record,
    ) -> Option<Self> {
        let derived = |parameter: &Parameter| {
            let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
            discretized.directors(&discretized.setup_over(seed))
        };
        (!record.edges().is_empty()).then(|| Self {
            edges: record.edges(),
            directors: discretized.directors(discretized.setup),
            derived: parameters.iter().map(derived).collect(),
        })
    }

    /// Three unit axes (tangent, two material directors) of every recorded edge in a state, edge after edge, each
    /// with its rate of change, 1/s. In world axes.
    pub fn motions<M: Model>(
        &self,
        discretized: &Discretized<'_, M>,
        State { q, v, frames, .. }: &State<f64, FramesOf<M>>,
    ) -> impl Iterator<Item = Motion> {
        self.edges
            .iter()
            .flat_map(move |edge| discretized.axes(self.directors, q, v, frames, *edge))
    }

    /// The derivatives of axes and rates by parameter `k` in the given state, in the order of
    /// [`motions`](Self::motions), in world axes. They are the derivatives of dual numbers made of the state, its
    /// sensitivities, and the directors' rotation by the parameter.
    pub fn rates<M: Model>(
        &self,
        discretized: &Discretized<'_, M>,
        sensitivities: &Sensitivities<M::Rod<f64>>,
        k: usize,
        state: &State<f64, FramesOf<M>>,
    ) -> Vec<Motion>
    where
        M::Rod<f64>: ForwardSensitivity,
    {
        let State { q, v, frames, .. } = sensitivities.dual_state(k, state);
        // Dual numbers through the same function: axes depend on places, frames and angles at once.
        let axes = |edge: &usize| {
            let axes = discretized.axes::<Dual64>(self.derived[k], &q, &v, &frames, *edge);
            axes.map(|axis| axis.map(|x| x.map(|c| c.eps)))
        };
        self.edges.iter().flat_map(axes).collect()
    }
}
