//! Reactions of the supports in the states of a run, and their derivatives by parameters.
//!
//! Input: the discretized scene and the parameters of a run. `of` returns forces (N) and moments (N m) of the supports
//! in a state; `rates` their derivatives by parameter `k`. These follow from dual numbers made of the state, its
//! sensitivities, and the rod, damping, drag and supports over the parameter.

use crate::dynamics::record::Motion;
use crate::dynamics::sensitivity::Sensitivities;
use crate::problem::{Discretized, FramesOf, Model};
use crate::rod::{ForwardSensitivity, State};
use crate::scene::Parameter;
use crate::statics::{ReactionModel, Reactions};
use num_dual::Dual64;

/// Models of the reactions of a run, without derivatives and with those along each parameter.
pub(super) struct RecordedReactions<M: Model> {
    plain: ReactionModel<f64, M>,
    derived: Vec<ReactionModel<Dual64, M>>,
}

impl<M: Model> RecordedReactions<M> {
    /// The models of the reactions of a scene in motion: one in plain numbers, and one per parameter in dual numbers
    /// with the derivatives along it.
    pub fn new(discretized: &Discretized<'_, M>, parameters: &[Parameter]) -> Self {
        let derived = |parameter: &Parameter| {
            let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
            discretized.reactions_in_motion(discretized.setup_over(seed))
        };
        Self {
            plain: discretized.reactions_in_motion(discretized.setup_over(|_, value: f64| value)),
            derived: parameters.iter().map(derived).collect(),
        }
    }

    /// Forces, N, and moments, N m, of both supports on the rod in a state of the run, in world axes.
    pub fn of(
        &self,
        discretized: &Discretized<'_, M>,
        state: &State<f64, FramesOf<M>>,
    ) -> Reactions {
        discretized.reactions(&self.plain, state)
    }

    /// The derivatives by parameter `k` of force, N, and moment, N m, at the start, then at the end, in the given
    /// state, per unit of the parameter.
    pub fn rates(
        &self,
        discretized: &Discretized<'_, M>,
        sensitivities: &Sensitivities<M::Rod<f64>>,
        k: usize,
        state: &State<f64, FramesOf<M>>,
    ) -> [Motion; 2]
    where
        M::Rod<f64>: ForwardSensitivity,
    {
        let state = sensitivities.dual_state(k, state);
        discretized.reactions::<Dual64>(&self.derived[k], &state).map(|x| x.eps).parts()
    }
}
