//! Omitted effects of a fit with their plausible sizes, and the experiments with their terms added.
//!
//! [`ExtendedExperiments::new`] selects effects from the table of omitted effects, then those of structures, load
//! cells, gains of sensors, gravity and dial gauges. It leaves out effects whose number is identified or a known input
//! in any experiment, or that the scenes state, do not define or exclude beside such a parameter. The terms of all
//! others are added to copies of the experiments; each takes those that its scene can have. The plausible size is that
//! of the first experiment in which an effect of the table is defined, unless the options of the fit give one; other
//! effects always have the usual one. The results are these experiments, and each effect with the change of the scenes
//! by its plausible size, in the unit of its number. An effect that no scene can have is left out. Values of the
//! optimum that a scene does not allow are an error. Score tests differentiate the residuals by these changes.
//! [`add_effect`] adds a single effect of one rod, for fits with it as a further unknown.

use crate::error::Error;
use crate::fit::known::Known;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::budget::input_changes::InputChange;
use crate::fit::uncertainty::discrepancy::dial_gauge_effects::DialGauge;
use crate::fit::uncertainty::discrepancy::experiment_effect::{EffectTerm, ExperimentEffect};
use crate::fit::uncertainty::discrepancy::gravity_effects::GravityChange;
use crate::fit::uncertainty::discrepancy::load_cell_effects::LoadCell;
use crate::fit::uncertainty::discrepancy::omitted_effects::{OMITTED_EFFECTS, OmittedEffect};
use crate::fit::uncertainty::discrepancy::rod_sizes::RodSizes;
use crate::fit::uncertainty::discrepancy::sensor_gain_effects::SensorGain;
use crate::fit::uncertainty::discrepancy::structure_effects::StructureTerm;
use crate::fit::unknown::Unknown;
use crate::scene::Parameter;

/// An omitted effect that is tested in a fit.
pub(crate) struct TestedEffect {
    /// The effect, with the path of its number.
    pub effect: OmittedEffect,
    /// Name of the effect, as text, with numbers of the scenes where it has any.
    pub name: String,
    /// Plausible size in the unit of its number.
    pub plausible_size: f64,
    /// Change of the numbers of all scenes that have the effect by the plausible size.
    pub change: InputChange,
}

/// Experiments with all effects added that their scenes can have.
pub(crate) struct ExtendedExperiments {
    /// The experiments with the added terms, in their order.
    pub experiments: Vec<Experiment>,
    /// The effects that at least one of them has.
    pub effects: Vec<TestedEffect>,
}

impl ExtendedExperiments {
    /// Adds the effects to `experiments`, those of the fit or a coarse model of them, in the order of the table; each
    /// takes those that its scene can have. Effects whose number is identified or a known input in any experiment, or
    /// that such a parameter excludes, are left out. The first experiment in which an effect is defined determines its
    /// plausible size, unless the analysis gives one. Left out too are effects that are defined in no experiment, have
    /// a size that is not positive and finite, or that no scene can have. Error: an experiment does not allow the
    /// values of the optimum.
    pub fn new(
        fitted: Fitted,
        analysis: &Analysis,
        knowns: &[Known],
        mut experiments: Vec<Experiment>,
    ) -> Result<Self, Error> {
        let search = fitted.search;
        let sizes = |e: &Experiment| Ok::<_, Error>(RodSizes::new(e, &fitted.problem(e)?));
        let sizes: Vec<RodSizes> =
            search.experiments.iter().map(sizes).collect::<Result<_, _>>()?;
        let identified = search.unknowns.iter().map(|u| u.parameter);
        let stated: Vec<Parameter> = identified.chain(knowns.iter().map(|k| k.parameter)).collect();
        let mut effects = Vec::new();
        let is_possible =
            |e: &&OmittedEffect| !stated.contains(&e.parameter()) && !e.is_excluded_beside(&stated);
        for effect in OMITTED_EFFECTS.iter().filter(is_possible) {
            let requested = analysis.plausible.get(effect.path).copied();
            // The first experiment in which the effect is defined determines its size.
            let mut plausible = sizes.iter().filter_map(|sizes| (effect.plausible)(sizes));
            let size = plausible.next().map(|usual| requested.unwrap_or(usual));
            let Some(size) = size.filter(|size| size.is_finite() && *size > 0.0) else { continue };
            let mut own = Vec::new();
            for (experiment, sizes) in experiments.iter_mut().zip(&sizes) {
                // Every experiment takes the terms that its scene can have.
                if let Some(problem) = effect.added(&experiment.problem, sizes) {
                    experiment.problem = problem;
                    own.push(experiment.name.clone());
                }
            }
            if own.is_empty() {
                continue;
            }
            let number = Unknown { experiments: own, ..Unknown::new(effect.parameter()) };
            let change = |number: &Unknown, factor: f64| {
                InputChange::with_size(&experiments, effect.path, number, factor * size)
            };
            let change = match effect.coupling {
                None => change(&number, 1.0),
                Some(coupling) => {
                    // Both numbers change in one direction.
                    let parameter = Parameter::at(coupling.path);
                    let other = Unknown { parameter, ..number.clone() };
                    let mut both = change(&number, coupling.own);
                    both.parts.extend(change(&other, coupling.other).parts);
                    both
                }
            };
            let detailed = experiments.iter().find_map(|e| effect.name_in(e.problem.scene()));
            let name = detailed.unwrap_or_else(|| effect.name.into());
            effects.push(TestedEffect { effect: *effect, name, plausible_size: size, change });
        }
        effects.extend(effects_of_experiments::<StructureTerm>(&mut experiments, &stated));
        effects.extend(effects_of_experiments::<LoadCell>(&mut experiments, &stated));
        effects.extend(effects_of_experiments::<SensorGain>(&mut experiments, &stated));
        effects.extend(effects_of_experiments::<GravityChange>(&mut experiments, &stated));
        effects.extend(effects_of_experiments::<DialGauge>(&mut experiments, &stated));
        Ok(Self { experiments, effects })
    }
}

/// Adds the term of the effect whose number is at `path` to an experiment of one rod, unless it has it already. Returns
/// the plausible size in the unit of the number; `None` where the experiment cannot have the effect, and for all other
/// numbers.
pub(crate) fn add_effect(path: &str, experiment: &mut Experiment, sizes: &RodSizes) -> Option<f64> {
    if let Some(effect) = OMITTED_EFFECTS.iter().find(|effect| effect.path == path) {
        experiment.problem = effect.added(&experiment.problem, sizes)?;
        return Some((effect.plausible)(sizes).unwrap_or(0.0));
    }
    add_effect_of_experiment::<LoadCell>(path, experiment)
        .or_else(|| add_effect_of_experiment::<SensorGain>(path, experiment))
        .or_else(|| add_effect_of_experiment::<GravityChange>(path, experiment))
        .or_else(|| add_effect_of_experiment::<DialGauge>(path, experiment))
}

/// Adds the effect with the term `T` whose number is at `path` to an experiment; its plausible size, or `None` where
/// the experiment has no such effect.
fn add_effect_of_experiment<T: EffectTerm>(path: &str, experiment: &mut Experiment) -> Option<f64> {
    let effect = T::effects(experiment).into_iter().find(|effect| effect.path == path)?;
    T::add_to(&effect, experiment).then_some(effect.size)
}

/// Adds the effects with terms `T` to the `experiments`, in place, each to those that can have it. Returns these
/// effects with their changes by the plausible size of the first experiment that has them; effects of several
/// experiments with one path and one name are one. Effects of `stated` parameters (identified or known inputs) are left
/// out.
fn effects_of_experiments<T: EffectTerm>(
    experiments: &mut [Experiment],
    stated: &[Parameter],
) -> Vec<TestedEffect> {
    let mut found: Vec<(ExperimentEffect<T>, Vec<String>)> = Vec::new();
    for experiment in experiments.iter_mut() {
        for effect in T::effects(experiment) {
            let effect = T::beside_others_of(effect, &experiment.problem);
            // Effects are added to one scene, one after the other: a single run has the derivatives by all of them.
            if stated.contains(&Parameter::at(effect.path)) || !T::add_to(&effect, experiment) {
                continue;
            }
            let name = experiment.name.clone();
            // The path of an added joint is its index, which is another joint in another structure.
            let is_same =
                |own: &ExperimentEffect<T>| own.path == effect.path && own.name == effect.name;
            match found.iter_mut().find(|(own, _)| is_same(own)) {
                Some((_, experiments)) => experiments.push(name),
                None => found.push((effect, vec![name])),
            }
        }
    }
    let tested = |(effect, own): (ExperimentEffect<T>, Vec<String>)| {
        let ExperimentEffect { path, name, size, test, .. } = effect;
        let number = Unknown { experiments: own, ..Unknown::new(Parameter::at(path)) };
        let change = InputChange::with_size(experiments, path, &number, size);
        let effect = OmittedEffect::of_number(path, test);
        TestedEffect { effect, name, plausible_size: size, change }
    };
    found.into_iter().map(tested).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::StructureScene;

    /// Two welded rods, of which a support clamps one end.
    fn welded(name: &str, rod: &str, end: &str) -> Experiment {
        let text_of_rod = |name: &str, direction: &str| {
            format!(
                "[[rods]]\nname = \"{name}\"\nsegments = 8\nmaterial = \"rubber\"\n\
                 shape = {{ kind = \"straight\", length = 0.15, direction = {direction} }}\n\
                 section = {{ kind = \"circle\", radius = 5e-3 }}\n"
            )
        };
        let text = [
            text_of_rod("mast", "[0, 1, 0]"),
            text_of_rod("arm", "[1, 0, 0]"),
            "[[materials]]\nname = \"rubber\"\ndensity = 1100\nyoungs_modulus = 1e6\n".into(),
            "[[joints]]\nkind = \"rigid\"\n".into(),
            "connects = [{ rod = \"mast\", at = \"end\" }, { rod = \"arm\", at = \"start\" }]\n"
                .into(),
            format!(
                "[[supports]]\nof = {{ rod = \"{rod}\", at = \"{end}\" }}\nkind = \"clamped\"\n"
            ),
            "[time]\nend = 0.1\nstep = 5e-3\n".into(),
        ];
        let scene = StructureScene::from_toml(&text.concat(), ".").unwrap();
        Experiment::of_structure(name, scene).unwrap()
    }

    /// The springs of both supports are the second joint of their structures, but not one effect. The joint of the rods
    /// is the same effect in both.
    #[test]
    fn supports_of_different_rods_are_different_effects() {
        let mut experiments = [welded("one", "mast", "start"), welded("other", "arm", "end")];
        let found = effects_of_experiments::<StructureTerm>(&mut experiments, &[]);
        let names = |path: &str| -> Vec<&str> {
            let own = found.iter().filter(|tested| tested.effect.path == path);
            own.map(|tested| &tested.name[..]).collect()
        };
        let supports = ["compliant support of mast, start", "compliant support of arm, end"];
        assert_eq!(names("joints.1.rotation"), supports);
        assert_eq!(names("joints.0.rotation"), ["compliant joint of mast, arm"]);
    }
}
