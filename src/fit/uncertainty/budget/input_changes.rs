//! Changes of inputs: numbers of the scenes that are not identified.
//!
//! An [`InputChange`] is the change of one number, or of the components of a vector. Each of its parts has the number,
//! its value and its change, both in its unit, in the experiments with this value. `of_known` is the change of a known
//! input by one standard uncertainty, `with_size` that of an omitted effect by a given size. [`unstated_inputs`]
//! returns changes by +1 % of other nonzero numbers of geometry, material, loads, camera scale and motion, then of
//! signals, actuators and contacts (`INPUT_PATHS`). Left out are directions, points of a structure (`PLACES`), slip
//! velocities of contacts, numbers that are identified or known,
//! and those without derivatives in the model. Numbers after the first [`MOST_NUMBERS`] are left out, but for
//! components of vectors that have begun; those of a vector are one change. Derivatives of the residuals by these
//! numbers yield the [input directions](crate::fit::uncertainty::budget::input_directions). `shifted` moves the values
//! at which these derivatives are taken. `relative_density_change` returns the relative change if only the density
//! changes, in all experiments and by the same fraction; else `None`.

use crate::fit::known::Known;
use crate::fit::measurement::experiment::Experiment;
use crate::fit::search::Search;
use crate::fit::unknown::Unknown;
use crate::scene::Parameter;

/// Largest number of numbers whose sensitivities are computed without a stated uncertainty: each costs a derivative.
const MOST_NUMBERS: usize = 16;
/// Relative change of an unstated input.
const PER_CENT: f64 = 0.01;
/// Paths of numbers that are inputs of an experiment, which meshes and steps are not.
const INPUT_PATHS: [&str; 18] = [
    "rod.shape.",
    "rod.section.",
    "rod.mass.",
    "material.",
    "loads.",
    "signals.",
    "actuation.",
    "contacts.",
    "rod_contacts.",
    "camera.pixel_scale",
    "supports.motion.",
    "initial.velocity.",
    "initial.angular_velocity.",
    "rod.taper.",
    "rods.",
    "materials.",
    "bodies.",
    "joints.",
];
/// Paths of inputs that come after all others, which would be left out beyond [`MOST_NUMBERS`] of these.
const LATER_PATHS: [&str; 4] = ["signals.", "actuation.", "contacts.", "rod_contacts."];
/// Paths of direction vectors, whose length has no effect.
const DIRECTION_PATHS: [&str; 3] = ["rod.shape.direction", "rod.shape.axis", "rod.section.up"];
/// Parts of the paths of numbers of contacts that are no inputs: lengths of direction vectors, and the speed that
/// regularizes friction.
const NO_INPUTS_OF_CONTACTS: [&str; 3] = [".normal.", ".axis.", ".slip_velocity"];
/// Parts of the paths of directions and points of a structure, which are no inputs: a change would separate the points
/// of a joint.
const PLACES: [&str; 6] =
    [".shape.direction", ".shape.axis", ".section.up", ".origin.", ".position.", ".connects."];
/// Path of the factors of a table of the bending moment.
const TABLE_PATH: &str = "material.bending_law.factor";
/// Relative difference up to which changes of the density are equal, up to rounding.
const EQUAL: f64 = 1e-9;

/// A change of one or several numbers of the scenes, such as the components of a vector.
pub(crate) struct InputChange {
    /// Name of the input.
    pub source: String,
    /// One part for each number and each value of it.
    pub parts: Vec<ValueChange>,
}

/// A change of a number in the experiments in which it has the same value.
#[derive(Clone)]
pub(crate) struct ValueChange {
    /// The number with its experiments, on its own scale.
    pub number: Unknown,
    /// Value at which derivatives are taken, in its unit.
    pub value: f64,
    /// Change, in its unit.
    pub change: f64,
}

impl InputChange {
    /// Change of a `number` in all its experiments by `change`, a function of its value, both in its unit. It has one
    /// part for each distinct value, with the names of the experiments that have it. No parts where no scene has the
    /// number.
    fn new(experiments: &[Experiment], number: &Unknown, change: impl Fn(f64) -> f64) -> Self {
        let mut parts: Vec<ValueChange> = Vec::new();
        for experiment in experiments.iter().filter(|e| number.is_of(e)) {
            let Some(value) = number.parameter.of(experiment.problem.scene()) else { continue };
            // Experiments with one value share a derivative: they are one part.
            let name = experiment.name.clone();
            match parts.iter_mut().find(|part| part.value == value) {
                Some(part) => part.number.experiments.push(name),
                None => {
                    let (experiments, number) = (vec![name], Unknown::new(number.parameter));
                    let number = Unknown { experiments, plain: true, ..number };
                    parts.push(ValueChange { number, value, change: change(value) });
                }
            }
        }
        Self { source: number.to_string(), parts }
    }

    /// Change, named `source`, of a `number` in all its experiments by the same `size` in its unit. It has one part for
    /// each distinct value.
    pub fn with_size(
        experiments: &[Experiment],
        source: &str,
        number: &Unknown,
        size: f64,
    ) -> Self {
        Self { source: source.into(), ..Self::new(experiments, number, |_| size) }
    }

    /// Change of a known input by its standard uncertainty, in its unit, in all its experiments; a part for each
    /// distinct value.
    pub fn of_known(experiments: &[Experiment], known: &Known) -> Self {
        Self::new(experiments, &known.as_unknown(), |_| known.sigma)
    }

    /// The same change about shifted values: each part's value plus this many `times` its change. The changes
    /// themselves stay.
    pub fn shifted(&self, times: f64) -> Self {
        // The change itself stays, so that derivatives refer to the same unit.
        let mut parts = self.parts.clone();
        parts.iter_mut().for_each(|part| part.value += times * part.change);
        Self { source: self.source.clone(), parts }
    }

    /// The relative change of the density, as a fraction, if this changes only the density, in all `experiments` and by
    /// the same fraction (within [`EQUAL`]); else none.
    pub fn relative_density_change(&self, experiments: &[Experiment]) -> Option<f64> {
        let relative = |part: &ValueChange| part.change / part.value;
        let first = relative(self.parts.first()?);
        let is_density = self.parts.iter().all(|part| {
            let is_equal = (relative(part) / first - 1.0).abs() < EQUAL;
            part.number.parameter == Parameter::Density && is_equal
        });
        let is_changed = |e: &Experiment| self.parts.iter().any(|part| part.number.is_of(e));
        (is_density && experiments.iter().all(is_changed)).then_some(first)
    }

    /// The unit of the number, or of the first component of a vector; empty without parts.
    pub fn unit(&self) -> &'static str {
        self.parts.first().map_or("", |part| part.number.parameter.unit())
    }

    /// The value of the number, in its unit, if all experiments with it have the same; `None` for a vector with several
    /// components, where experiments differ, and without parts.
    pub fn value(&self) -> Option<f64> {
        match &self.parts[..] {
            [alone] => Some(alone.value),
            _ => None,
        }
    }
}

/// A change by +1 % of every input of the scenes in [`INPUT_PATHS`], without direction vectors and points of a
/// structure. Left out are numbers that are identified or among `knowns`, zeros, and those that the model cannot
/// differentiate by. Numbers after the first [`MOST_NUMBERS`] are left out, but for components of vectors that have
/// begun. The components of a vector are parts of one change, named like the vector.
pub(crate) fn unstated_inputs(search: &Search, knowns: &[Known]) -> Vec<InputChange> {
    let is_stated = |p: Parameter, e: &Experiment| {
        search.unknowns.iter().any(|u| u.parameter == p && u.is_of(e))
            || knowns.iter().any(|k| k.parameter == p && k.as_unknown().is_of(e))
    };
    let is_below = |path: &str, paths: &[&str]| paths.iter().any(|own| path.starts_with(own));
    let contains = |path: &str, parts: &[&str]| parts.iter().any(|own| path.contains(own));
    let mut changes: Vec<InputChange> = Vec::new();
    let mut numbers: Vec<Parameter> = Vec::new();
    for experiment in search.experiments {
        let problem = &experiment.problem;
        // Every number of the scene, each once over all experiments.
        let mut all: Vec<Parameter> = Parameter::all(problem.scene()).into_iter().collect();
        all.sort_by_key(|parameter| is_below(parameter.path(), &LATER_PATHS));
        for parameter in all {
            let path = parameter.path();
            // A number of zero has no relative change.
            let is_left_out = is_below(path, &DIRECTION_PATHS)
                || path.starts_with("contacts.") && contains(path, &NO_INPUTS_OF_CONTACTS)
                || parameter.is_of_structure() && contains(path, &PLACES);
            let is_input = is_below(path, &INPUT_PATHS) && !is_left_out;
            // One per cent of a vector is one per cent of each component.
            let vector = [".x", ".y", ".z"].iter().find_map(|c| path.strip_suffix(c));
            // One per cent of a table is one per cent of each of its factors.
            let vector = vector.or_else(|| path.starts_with(TABLE_PATH).then_some(TABLE_PATH));
            let source = vector.unwrap_or(path);
            // The components of a vector that has begun are completed.
            let is_new = changes.iter().all(|change| change.source != source);
            if !is_input
                || is_new && numbers.len() >= MOST_NUMBERS
                || parameter.of(problem.scene()).is_none_or(|value| value == 0.0)
                || numbers.contains(&parameter)
                || is_stated(parameter, experiment)
                || problem.check_parameter(parameter).is_err()
            {
                continue;
            }
            numbers.push(parameter);
            // In experiments that state the number its value is not that of the scene.
            let mut number = Unknown::new(parameter);
            let (stating, free): (Vec<&Experiment>, Vec<&Experiment>) =
                search.experiments.iter().partition(|e| is_stated(parameter, e));
            if !stating.is_empty() {
                number.experiments = free.into_iter().map(|e| e.name.clone()).collect();
            }
            let mut change = InputChange::new(search.experiments, &number, |x| PER_CENT * x);
            if let Some(vector) = vector {
                change.source = vector.into();
            }
            match changes.iter_mut().find(|other| other.source == change.source) {
                Some(other) => other.parts.append(&mut change.parts),
                None => changes.push(change),
            }
        }
    }
    changes
}
