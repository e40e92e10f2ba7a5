//! Refusals: what cannot be fitted is said before anything is computed, with the key or the file it
//! stands in.

use crate::error::Error;
use crate::fit::measurement::Measurement;
use crate::fit::measurement::dataset::Subject;
use crate::fit::measurement::experiment::{Experiment, all, fitted};
use crate::fit::measurement::motion::PointMotion;
use crate::fit::measurement::shape::EquilibriumShape;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::discrepancy::omitted_effects::OMITTED_EFFECTS;
use crate::fit::unknown::{Prior, Unknown};
use crate::scene::Support;
use crate::scene::validate::positive;
use crate::scene::{Parameter, Point};

/// Fewer values do not show their own noise beside other measurements.
const FEW: usize = 8;

/// Replicates of bootstrap and Monte Carlo beyond this are a slip of the pen.
const MOST_REPLICATES: usize = 1_000_000;

/// Searches that end farther from their minimum, in standard errors, have not found it.
const LARGEST_TOLERANCE: f64 = 0.1;

/// Points this many lengths from the wall of a held rod are not points of it.
const FARTHEST: f64 = 2.5;

/// Refuses a fit that cannot be solved, or not in the way it is asked for.
pub(crate) fn check(
    experiments: &[Experiment],
    unknowns: &[Unknown],
    analysis: &Analysis,
) -> Result<(), Error> {
    let fitted = fitted(experiments);
    if all(&fitted).next().is_none() {
        let allowed =
            "at least one measurement without held_out; `rodfit predict` compares without a fit";
        return Err(Error::invalid("observation", "none", allowed));
    }
    if unknowns.is_empty() {
        let allowed =
            "at least one; for a prediction without a fit set held_out = true in every measurement";
        return Err(Error::invalid("parameter", "none", allowed));
    }
    check_experiments(experiments)?;
    check_unknowns(experiments, unknowns)?;
    if analysis.bootstrap == 1 || analysis.bootstrap > MOST_REPLICATES {
        let allowed = format!("0, or 2 .. {MOST_REPLICATES}");
        return Err(Error::invalid("analysis.bootstrap", analysis.bootstrap, allowed));
    }
    if let Some(first) = analysis.bootstrap_first.filter(|first| *first > MOST_REPLICATES) {
        let allowed = format!("0 .. {MOST_REPLICATES}");
        return Err(Error::invalid("analysis.bootstrap_first", first, allowed));
    }
    if analysis.monte_carlo == 1 || analysis.monte_carlo > MOST_REPLICATES {
        let allowed = format!("0, or 2 .. {MOST_REPLICATES}");
        return Err(Error::invalid("analysis.monte_carlo", analysis.monte_carlo, allowed));
    }
    if !(0.0..=LARGEST_TOLERANCE).contains(&analysis.tolerance) {
        let allowed = format!("0 to {LARGEST_TOLERANCE} of a standard error");
        return Err(Error::invalid("analysis.tolerance", analysis.tolerance, allowed));
    }
    for (place, size) in &analysis.plausible {
        let key = format!("analysis.plausible.{place:?}");
        if !OMITTED_EFFECTS.iter().any(|e| e.path == place) {
            let places: Vec<&str> = OMITTED_EFFECTS.iter().map(|e| e.path).collect();
            return Err(Error::invalid(key, "no term that is looked for", places.join(", ")));
        }
        positive(&key, *size)?;
    }
    let several = all(&fitted).count() > 1;
    for experiment in experiments {
        check_measurements(experiment, unknowns, several)?;
        check_starts(experiment, unknowns)?;
    }
    let values: usize = all(&fitted).map(|(_, m)| m.values()).sum();
    let priors = unknowns.iter().filter(|u| u.prior.is_some()).count();
    // One more shows the noise, where that is not given.
    let known = all(&fitted).all(|(_, m)| m.sigma().is_some());
    let needed = unknowns.len() + usize::from(!known);
    if values + priors < needed {
        let allowed = match known {
            true => format!("at least {needed}, as many as parameters"),
            false => format!("at least {needed}, one more than parameters without a sigma"),
        };
        return Err(Error::invalid("observation", format!("{values} values"), allowed));
    }
    Ok(())
}

/// Refuses measurements that cannot be compared with their scenes.
pub(crate) fn check_predicted(experiments: &[Experiment]) -> Result<(), Error> {
    check_experiments(experiments)?;
    // Without a fit measurements are not weighed against each other.
    let several = false;
    experiments.iter().try_for_each(|e| check_measurements(e, &[], several))
}

/// Refuses what is only planned.
pub(crate) fn recorded(experiments: &[Experiment]) -> Result<(), Error> {
    for experiment in experiments {
        if let Some(i) = experiment.measurements.iter().position(|m| m.planned()) {
            let key = format!("{}.file", key(experiment, i));
            let allowed = "a file; use `rodfit design` for a plan";
            return Err(Error::invalid(key, "none, as it is only planned", allowed));
        }
    }
    Ok(())
}

fn check_experiments(experiments: &[Experiment]) -> Result<(), Error> {
    for (i, experiment) in experiments.iter().enumerate() {
        let name = &experiment.name;
        if experiments[..i].iter().any(|e| e.name == *name) {
            let key = format!("experiment[{i}].name");
            return Err(Error::invalid(key, format!("{name:?}"), "each name once"));
        }
        if experiment.measurements.is_empty() {
            let found = format!("no measurement in {name}");
            let allowed = "at least one observation, shape or frequencies";
            return Err(Error::invalid(format!("experiment[{i}]"), found, allowed));
        }
    }
    Ok(())
}

fn check_unknowns(experiments: &[Experiment], unknowns: &[Unknown]) -> Result<(), Error> {
    for (i, unknown) in unknowns.iter().enumerate() {
        let key = format!("parameter[{i}]");
        unknown.check(experiments, &key)?;
        let shared = |e: &Experiment, u: &Unknown| u.is_of(e) && unknown.is_of(e);
        let twice = unknowns[..i]
            .iter()
            .any(|u| u.parameter == unknown.parameter && experiments.iter().any(|e| shared(e, u)));
        if twice {
            let allowed = "each name once in an experiment";
            return Err(Error::invalid(format!("{key}.name"), unknown.parameter, allowed));
        }
    }
    Ok(())
}

/// Those of one experiment, which may be one of `several` that are weighed against each other.
fn check_measurements(
    experiment: &Experiment,
    unknowns: &[Unknown],
    several: bool,
) -> Result<(), Error> {
    // With a clock of its own a recording may show later times than the motion lasts.
    let clock = |u: &Unknown| u.parameter == Parameter::TimeOffset && u.is_of(experiment);
    let other_clock =
        experiment.problem.scene().camera.time_offset != 0.0 || unknowns.iter().any(clock);
    let chosen = experiment.problem.scene().chosen();
    let of_scheme = |u: &&Unknown| {
        ["time.beta", "time.rho_inf"].contains(&u.parameter.path()) && u.is_of(experiment)
    };
    if let Some(unknown) = unknowns.iter().find(of_scheme).filter(|_| chosen.step) {
        let allowed = format!("a step, s, as {} depends on it", unknown.parameter);
        return Err(Error::invalid("time.step", "no such key", allowed));
    }
    for (i, measurement) in experiment.measurements.iter().enumerate() {
        let key = key(experiment, i);
        measurement.check(experiment, &key, other_clock)?;
        if chosen.segments && names_nodes(measurement) {
            let allowed = "\"tip\" or { arc_length = metres from the wall }, and a column s in the place of \
                           node: without rod.segments no node has an index";
            return Err(Error::invalid(key, "a node by its index", allowed));
        }
        if several && measurement.sigma().is_none() && measurement.values() < FEW {
            let found = format!("none, with {} values", measurement.values());
            let allowed = format!("a number; only {FEW} values or more show their noise");
            return Err(Error::invalid(format!("{key}.sigma"), found, allowed));
        }
    }
    Ok(())
}

/// Refuses starts of an experiment at which the rod is shorter than up to a point that was observed.
fn check_starts(experiment: &Experiment, unknowns: &[Unknown]) -> Result<(), Error> {
    let of_the_rod = |u: &Unknown| u.is_of(experiment) && u.parameter.path().starts_with("rod.");
    for (i, unknown) in unknowns.iter().enumerate().filter(|(_, u)| of_the_rod(u)) {
        let Some(start) = unknown.start else { continue };
        // What else is wrong with a rod of this start is said where it is simulated.
        let Ok(there) = experiment.problem.with_fixed_layout([(unknown.parameter, start)]) else {
            continue;
        };
        for (k, measurement) in experiment.measurements.iter().enumerate() {
            let Some(motion) = measurement.motion() else { continue };
            if let Err(error) = there.stencil(motion.point) {
                let found = format!(
                    "{start}, with which {}.point is not on the rod: {error}",
                    key(experiment, k)
                );
                let allowed = "a rod that has all observed points";
                return Err(Error::invalid(format!("parameter[{i}].start"), found, allowed));
            }
        }
    }
    Ok(())
}

/// Whether a point is named by the index of a node; markers of a recording have their nodes.
fn names_nodes(measurement: &Measurement) -> bool {
    let is_node = |point: Point| matches!(point, Point::Node(_));
    let of_motion = |m: &PointMotion| m.marker.is_none() && is_node(m.point);
    let of_shape = |s: &EquilibriumShape| s.sightings.iter().any(|s| is_node(s.point));
    measurement.motion().is_some_and(of_motion) || measurement.shape().is_some_and(of_shape)
}

/// Where measurement `i` of an experiment stands in the fit file.
pub(crate) fn key(experiment: &Experiment, i: usize) -> String {
    let table = experiment.measurements[i].table();
    let before = experiment.measurements[..i].iter().filter(|m| m.table() == table).count();
    experiment.key(&format!("{table}[{before}]"))
}

/// The same error, naming a parameter's place and the experiment whose scene refuses it.
fn of_parameter(error: Error, key: &str, experiment: &str) -> Error {
    let Error::Invalid { file, key: own, mut found, allowed } = error else { return error };
    if !experiment.is_empty() {
        found += &format!(" in experiment {experiment}");
    }
    let key = if own == "parameter" { format!("{key}.name") } else { own };
    Error::Invalid { file, key, found, allowed }
}

impl Unknown {
    /// Checks names, start, bounds and prior; `key` names them in messages.
    pub(crate) fn check(&self, experiments: &[Experiment], key: &str) -> Result<(), Error> {
        let parameter = self.parameter;
        let names: Vec<&str> = experiments.iter().map(|e| e.name.as_str()).collect();
        if let Some(other) = self.experiments.iter().find(|name| !names.contains(&name.as_str())) {
            let allowed = match names[..] {
                [""] => "no name, as there is only one experiment".into(),
                _ => format!("one of {}", names.join(", ")),
            };
            return Err(Error::invalid(format!("{key}.experiment"), other, allowed));
        }
        let twice = |(i, name): &(usize, &String)| self.experiments[..*i].contains(name);
        if let Some((_, name)) = self.experiments.iter().enumerate().find(twice) {
            let found = format!("{name} twice");
            return Err(Error::invalid(format!("{key}.experiment"), found, "each name once"));
        }
        let mut takers = experiments.iter().filter(|e| self.is_of(e)).peekable();
        if takers.peek().is_none() {
            let scene = experiments.first().map(|e| e.problem.scene());
            let absent = scene.map_or_else(
                || Error::invalid("experiment", "none", "at least one"),
                |scene| parameter.absent(scene),
            );
            return Err(of_parameter(absent, key, ""));
        }
        takers.try_for_each(|e| {
            let checked = e.problem.check_parameter(parameter);
            checked.map_err(|error| of_parameter(error, key, &e.name))
        })?;
        let [least, most] = parameter.limits();
        let allowed = || match parameter.is_positive() {
            true => "finite and above 0".to_string(),
            false => format!("{least} .. {most}"),
        };
        let fits = |value: f64| value.is_finite() && value >= least && value <= most;
        let [mut low, mut high] = [least, most];
        if let Some(bounds) = self.bounds {
            [low, high] = bounds;
            if !(fits(low) && fits(high) && low < high) {
                let allowed = format!("two ascending numbers, each {}", allowed());
                return Err(Error::invalid(
                    format!("{key}.bounds"),
                    format!("{bounds:?}"),
                    allowed,
                ));
            }
        }
        if let Some(Prior { mean, sigma }) = self.prior {
            if !fits(mean) {
                return Err(Error::invalid(format!("{key}.prior.mean"), mean, allowed()));
            }
            positive(&format!("{key}.prior.sigma"), sigma)?;
        }
        match self.start {
            Some(start) if !fits(start) => {
                Err(Error::invalid(format!("{key}.start"), start, allowed()))
            }
            Some(start) if start < low || start > high => Err(Error::invalid(
                format!("{key}.start"),
                start,
                format!("within the bounds {low} .. {high}"),
            )),
            _ => Ok(()),
        }
    }
}

impl Measurement {
    /// Refuses positions that no point of a held rod can have: most likely in other units.
    pub(crate) fn check_units(&self, experiment: &Experiment) -> Result<(), Error> {
        let problem = &experiment.problem;
        let supports = &problem.scene().supports;
        if self.planned() {
            return Ok(());
        }
        if (supports.start, supports.end) == (Support::Free, Support::Free) {
            return Ok(());
        }
        let wall = problem.wall();
        let distance = |position: &[Option<f64>; 3]| {
            let parts = (0..3).filter_map(|c| Some((position[c]? - wall[c]).abs()));
            parts.fold(0.0, f64::max)
        };
        let mut distances: Vec<f64> = self.positions().iter().map(distance).collect();
        distances.sort_by(f64::total_cmp);
        // Single outliers are another matter.
        let Some(typical) = distances.get(distances.len() / 2) else { return Ok(()) };
        if *typical <= FARTHEST * problem.length() {
            return Ok(());
        }
        let found = format!("points typically {typical:.4} m from the wall of the rod");
        let allowed = format!(
            "points of a rod of {} m. Check the unit in the header, as in x[mm], the origin and the scale",
            problem.length()
        );
        Err(Error::invalid(experiment.label(self), found, allowed))
    }

    /// Refuses what cannot be compared with the experiment's problem; `key` names the measurement.
    fn check(&self, experiment: &Experiment, key: &str, other_clock: bool) -> Result<(), Error> {
        let (problem, label) = (&experiment.problem, experiment.label(self));
        if self.values() == 0 {
            return Err(Error::invalid(key, "no values", "at least one"));
        }
        if let Some(sigma) = self.sigma() {
            positive(&format!("{key}.sigma"), sigma)?;
        }
        let (factors, points) = (&self.header.sigma_factors, self.points());
        factors.iter().try_for_each(|f| positive(&format!("{key}.sigma_factors"), *f))?;
        if !factors.is_empty()
            && (![points, self.values()].contains(&factors.len()) || self.sigma().is_none())
        {
            let values = self.values();
            let found = format!("{} for {points} points with {values} values", factors.len());
            return Err(Error::invalid(
                format!("{key}.sigma_factors"),
                found,
                "one each, and a sigma",
            ));
        }
        self.data.check(&self.header, &Subject { problem, key, label: &label, other_clock })
    }
}
