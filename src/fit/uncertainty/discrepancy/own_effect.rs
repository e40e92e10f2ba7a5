//! Effects that an experiment itself defines, beside those of the table of omitted effects.
//!
//! [`OwnEffect`] has the number, the plausible size and the distinguishing experiment of an effect. [`EffectTerm`] is
//! the term that it adds: of a [structure](crate::fit::uncertainty::discrepancy::structure_effects) or of a [load
//! cell](crate::fit::uncertainty::discrepancy::load_cell_effects). `effects` lists those of an experiment, `add_to` adds
//! one to its scene.

use crate::fit::measurement::experiment::Experiment;
use crate::problem::Problem;

/// An effect that an experiment defines, with the term that it adds to the experiment.
#[derive(PartialEq)]
pub(super) struct OwnEffect<T> {
    /// Path of its number.
    pub path: &'static str,
    /// Name, as text.
    pub name: String,
    /// Plausible size in the unit of the number.
    pub size: f64,
    /// Experiment that would distinguish the effect from the parameters.
    pub test: &'static str,
    /// The added term.
    pub term: T,
}

/// A term that an effect adds to an experiment.
pub(super) trait EffectTerm: Sized {
    /// All effects of an experiment, with their plausible sizes; empty where it can have none.
    fn effects(experiment: &Experiment) -> Vec<OwnEffect<Self>>;

    /// The effect with the path of its number in `problem`, to which other effects may have been added. Unchanged by
    /// default.
    fn beside_others_of(effect: OwnEffect<Self>, _problem: &Problem) -> OwnEffect<Self> {
        effect
    }

    /// Adds the term of an effect to an experiment, in place. False, without a change, if the scene cannot have it, or
    /// the model has no derivative by the number.
    fn add_to(effect: &OwnEffect<Self>, experiment: &mut Experiment) -> bool;
}
