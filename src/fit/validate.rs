//! Validation of a fit before any simulation.
//!
//! Input: experiments, unknowns and options of the analysis. [`check`] is for fits. It rejects missing data or
//! unknowns, and fewer values, priors included, than unknowns (one more if a sigma is missing). Constant coordinates
//! are no values of a fit. It also rejects duplicate names, values of keys out of range, parameters or points that a
//! scene does not have, and starts that make the rod too short for an observed point. A measurement without sigma
//! beside others needs [`FEW`] values. [`check_predicted`] is for validation data without a fit, and [`check_recorded`]
//! rejects planned measurements. [`Measurement::check_units`] rejects positions in a wrong unit, whose median distance
//! from the wall exceeds [`FARTHEST`] rod lengths. Output: `Ok`, or the first [`Error::Invalid`] with the key in the
//! fit file or the file, the value found, and the allowed values.

use crate::error::{Error, ensure};
use crate::fit::measurement::Measurement;
use crate::fit::measurement::camera_needs::camera_needs;
use crate::fit::measurement::constant_axes::without_constant_axes;
use crate::fit::measurement::dataset::ValidationContext;
use crate::fit::measurement::experiment::{Experiment, all, fitted};
use crate::fit::measurement::motion::PointMotion;
use crate::fit::measurement::shape::EquilibriumShape;
use crate::fit::uncertainty::analysis::Analysis;
use crate::fit::uncertainty::discrepancy::omitted_effects::OMITTED_EFFECTS;
use crate::fit::uncertainty::posterior::settings::PosteriorSettings;
use crate::fit::unknown::{Prior, Unknown};
use crate::numerics::upper_median;
use crate::scene::validate::positive;
use crate::scene::{Dimension, Parameter, Point, Support};

/// Smallest number of values of a measurement without a sigma beside other measurements: fewer do not determine their
/// noise.
const FEW: usize = 8;

/// Largest number of replicates of bootstrap and Monte Carlo; more are a typing error.
const MOST_REPLICATES: usize = 1_000_000;

/// Largest tolerance of the distance from the minimum, in standard errors. The tolerance is an error of the estimates
/// beside their standard errors.
const LARGEST_TOLERANCE: f64 = 0.1;

/// Largest typical distance of observed points from the wall of a held rod, over its length. Points of an inextensible
/// rod are within one length of the wall; wrong units, as mm for m, change the distance by large factors.
const FARTHEST: f64 = 2.5;

/// Rejects a fit that cannot be solved: without fitted measurements or unknowns, or with fewer values of fitted
/// measurements (and priors) than unknowns. If any sigma of these is not given, one more value is needed for the noise.
/// Constant coordinates, which a fit leaves out, are not counted.
/// Between these checks of the existence of data and of their number, it checks names of experiments, unknowns,
/// `[analysis]`, and for each experiment its measurements (validation data too) and the starts. The first error is
/// returned.
pub(crate) fn check(
    experiments: &[Experiment],
    unknowns: &[Unknown],
    analysis: &Analysis,
) -> Result<(), Error> {
    // Validation data do not determine parameters.
    let fitted = fitted(experiments);
    let allowed = "at least one measurement without held_out. Use `rodfit predict` for a comparison without \
         a fit";
    ensure(all(&fitted).next().is_some(), "observation", "none", allowed)?;
    let allowed =
        "at least one. For a prediction without a fit set held_out = true in every measurement";
    ensure(!unknowns.is_empty(), "parameter", "none", allowed)?;
    check_experiments(experiments)?;
    check_unknowns(experiments, unknowns)?;
    check_analysis(analysis)?;
    // The weights of several measurements against each other depend on their sigmas.
    let several = all(&fitted).count() > 1;
    for experiment in experiments {
        check_measurements(experiment, unknowns, several)?;
        check_starts(experiment, unknowns)?;
    }
    let count =
        |experiments: &[Experiment]| -> usize { all(experiments).map(|(_, m)| m.values()).sum() };
    // A fit leaves constant coordinates out.
    let varying: Vec<Experiment> =
        fitted.iter().map(|e| without_constant_axes(e, unknowns)).collect();
    let (recorded, values) = (count(&fitted), count(&varying));
    let priors = unknowns.iter().filter(|u| u.prior.is_some()).count();
    // An unknown noise takes one more value.
    let known = all(&fitted).all(|(_, m)| m.sigma().is_some());
    let needed = unknowns.len() + usize::from(!known);
    let allowed = match known {
        true => format!("at least {needed}, as many as parameters"),
        false => format!("at least {needed}, one more than parameters without a sigma"),
    };
    let found = match values == recorded {
        true => format!("{values} values"),
        false => format!("{values} values that are not of a constant coordinate"),
    };
    ensure(values + priors >= needed, "observation", found, allowed)
}

/// Rejects values of `[analysis]` outside of their ranges: numbers of replicates (0, or 2 to [`MOST_REPLICATES`]), the
/// index of the first one (up to [`MOST_REPLICATES`]), the numbers of the posterior sampler, and the tolerance (0 to
/// [`LARGEST_TOLERANCE`] of a standard error). Names in `plausible` must be paths of [`OMITTED_EFFECTS`], and their
/// sizes positive.
fn check_analysis(analysis: &Analysis) -> Result<(), Error> {
    let Analysis { bootstrap, monte_carlo, .. } = analysis;
    for (key, replicates) in [("bootstrap", *bootstrap), ("monte_carlo", *monte_carlo)] {
        let is_valid = replicates != 1 && replicates <= MOST_REPLICATES;
        let allowed = format!("0, or 2 .. {MOST_REPLICATES}");
        ensure(is_valid, format!("analysis.{key}"), replicates, allowed)?;
    }
    analysis.posterior.map_or(Ok(()), PosteriorSettings::check)?;
    let first = analysis.bootstrap_first.unwrap_or(0);
    let allowed = format!("0 .. {MOST_REPLICATES}");
    ensure(first <= MOST_REPLICATES, "analysis.bootstrap_first", first, allowed)?;
    let (tolerance, allowed) =
        (analysis.tolerance, format!("0 to {LARGEST_TOLERANCE} of a standard error"));
    let is_valid = (0.0..=LARGEST_TOLERANCE).contains(&tolerance);
    ensure(is_valid, "analysis.tolerance", tolerance, allowed)?;
    let places: Vec<&str> = OMITTED_EFFECTS.iter().map(|e| e.path).collect();
    for (place, size) in &analysis.plausible {
        let key = format!("analysis.plausible.{place:?}");
        let is_known = places.contains(&&place[..]);
        ensure(is_known, &key, "no effect that is tested", places.join(", "))?;
        positive(&key, *size)?;
    }
    Ok(())
}

/// Rejects validation data that cannot be compared with their scenes, for a prediction without a fit: names of
/// experiments, and each measurement. Experiments without measurements are rejected too. A sigma is not required.
pub(crate) fn check_predicted(experiments: &[Experiment]) -> Result<(), Error> {
    check_experiments(experiments)?;
    // Without a fit the noise of a measurement is not needed for its weight.
    let several = false;
    experiments.iter().try_for_each(|e| check_measurements(e, &[], several))
}

/// Rejects planned measurements, which have no data; the error is that of the first one, with the key of its missing
/// `file`.
pub(crate) fn check_recorded(experiments: &[Experiment]) -> Result<(), Error> {
    for experiment in experiments {
        for (i, measurement) in experiment.measurements.iter().enumerate() {
            let key = format!("{}.file", measurement_key(experiment, i));
            let allowed = "a file. Use `rodfit design` for a plan";
            ensure(
                !measurement.planned(),
                key,
                "no file, as the measurement is only planned",
                allowed,
            )?;
        }
    }
    Ok(())
}

/// Rejects two experiments with the same name, and experiments without measurements, by their key `experiment[i]`.
fn check_experiments(experiments: &[Experiment]) -> Result<(), Error> {
    for (i, experiment) in experiments.iter().enumerate() {
        let name = &experiment.name;
        let (key, found) = (format!("experiment[{i}]"), format!("no measurement in {name}"));
        let is_new = experiments[..i].iter().all(|e| e.name != *name);
        ensure(is_new, format!("{key}.name"), format!("{name:?}"), "each name once")?;
        let allowed = "at least one observation, shape, frequencies, load_deflection or buckling";
        ensure(!experiment.measurements.is_empty(), key, found, allowed)?;
    }
    Ok(())
}

/// Rejects unknowns with wrong values ([`Unknown::check`]), and two unknowns of one parameter in one experiment.
fn check_unknowns(experiments: &[Experiment], unknowns: &[Unknown]) -> Result<(), Error> {
    for (i, unknown) in unknowns.iter().enumerate() {
        let key = format!("parameter[{i}]");
        unknown.check(experiments, &key)?;
        let is_new = !unknowns[..i].iter().any(|u| unknown.is_same_in_any(u, experiments));
        let allowed = "each name once in an experiment";
        ensure(is_new, format!("{key}.name"), unknown.parameter, allowed)?;
    }
    Ok(())
}

/// Rejects measurements of one experiment that cannot be compared with its scene, and loads of load-deflection curves
/// and buckling tests that are unknowns of the fit. Rejects unknown parameters of the time scheme (`time.beta`,
/// `time.rho_inf`) without a fixed step, frequencies of structures in space, and nodes named by index on a mesh that
/// the program chooses. If the fit has `several` measurements, one with fewer than [`FEW`] values needs a sigma, as its
/// noise cannot be estimated.
fn check_measurements(
    experiment: &Experiment,
    unknowns: &[Unknown],
    several: bool,
) -> Result<(), Error> {
    // The times of a recording with its own clock may be later than the end of the motion.
    check_camera(experiment, unknowns)?;
    let camera = experiment.problem.scene().camera;
    let is_offset = |u: &Unknown| {
        let path = u.parameter.path();
        let moves_times = ["camera.time_offset", "camera.time_scale"].contains(&path)
            || path.starts_with("camera.row_delay.");
        moves_times && u.is_of(experiment)
    };
    let other_clock = [camera.time_offset, camera.time_scale] != [0.0, 1.0]
        || camera.row_delay != [0.0; 3]
        || unknowns.iter().any(is_offset);
    // Parameters of the time scheme act through the step: they need a step that stays.
    let chosen = experiment.problem.scene().chosen();
    let is_of_scheme = |u: &&Unknown| {
        ["time.beta", "time.rho_inf"].contains(&u.parameter.path()) && u.is_of(experiment)
    };
    if let Some(unknown) = unknowns.iter().find(is_of_scheme).filter(|_| chosen.step) {
        let allowed = format!("a step, s, as {} depends on it", unknown.parameter);
        return Err(Error::invalid("time.step", "no such key", allowed));
    }
    let scene = experiment.problem.scene();
    let is_in_space = scene.structure.is_some() && scene.rod.dimension == Dimension::Spatial;
    let own = unknowns.iter().filter(|u| u.is_of(experiment));
    let parameters: Vec<Parameter> = own.map(|u| u.parameter).collect();
    for (i, measurement) in experiment.measurements.iter().enumerate() {
        let key = measurement_key(experiment, i);
        let has_modes_in_space = is_in_space && measurement.frequencies().is_some();
        let allowed = "a structure in a plane: frequencies of one in space have no derivatives";
        ensure(!has_modes_in_space, &key, "frequencies of a structure in space", allowed)?;
        let other_clock = match measurement.data.sensor_reference() {
            Some(sensor) => sensor.is_delayed(scene, &parameters),
            None => other_clock && measurement.motion().is_some(),
        };
        measurement.check(experiment, &key, other_clock, &parameters)?;
        // The values of the load are those of the measurement.
        let is_load = |u: &Unknown| {
            let curve = measurement.load_curve().map(|curve| curve.load);
            let load = curve.or(measurement.buckling().map(|own| own.load));
            load == Some(u.parameter) && u.is_of(experiment)
        };
        let is_unknown = unknowns.iter().any(is_load);
        let allowed = "a load that is no parameter of the fit";
        ensure(!is_unknown, format!("{key}.load"), "a [[parameter]]", allowed)?;
        let allowed = "\"tip\" or { arc_length = distance from the wall in m }, and a column s \
                       instead of node, as nodes have no index without rod.segments";
        // The index of a node has a meaning only on a given mesh.
        let has_index = chosen.segments && names_nodes(measurement);
        ensure(!has_index, &key, "a node by its index", allowed)?;
        let values = measurement.values();
        // The sigma of a few values cannot be estimated, and the weight beside other measurements depends on it.
        let has_no_weight = several && measurement.sigma().is_none() && values < FEW;
        let found = format!("no sigma and {values} values");
        let allowed = format!(
            "a number, as the noise cannot be estimated from fewer than {FEW} \
                               values"
        );
        ensure(!has_no_weight, format!("{key}.sigma"), found, allowed)?;
    }
    Ok(())
}

/// Rejects a delay of rows, and a lens distortion, that the scene has or a fit identifies, for measurements in which a
/// coordinate that they need was not observed in every position.
fn check_camera(experiment: &Experiment, unknowns: &[Unknown]) -> Result<(), Error> {
    let all_needs = camera_needs(experiment, unknowns);
    for (c, (axis, needs)) in ["x", "y", "z"].into_iter().zip(all_needs).enumerate() {
        for (i, measurement) in experiment.measurements.iter().enumerate() {
            let needs_row = needs.row_delay && measurement.motion().is_some();
            let found = format!("{} with positions without {axis}", measurement_key(experiment, i));
            let key = match needs_row {
                true => format!("camera.row_delay.{axis}"),
                false => "camera.distortion".into(),
            };
            let is_met = measurement.has_coordinate(c) || !needs_row && !needs.distortion;
            let allowed = format!("measurements with {axis} in every position");
            ensure(is_met, key, found, allowed)?;
        }
    }
    Ok(())
}

/// Rejects start values of the unknowns of one experiment at which an observed point of a motion is not on the rod.
/// Only parameters `rod.*` are checked, each by itself. Starts that the scene does not allow are accepted; the
/// simulation reports them.
fn check_starts(experiment: &Experiment, unknowns: &[Unknown]) -> Result<(), Error> {
    let is_of_rod = |u: &Unknown| u.is_of(experiment) && u.parameter.path().starts_with("rod.");
    for (i, unknown) in unknowns.iter().enumerate().filter(|(_, u)| is_of_rod(u)) {
        let Some(start) = unknown.start else { continue };
        // Other errors of a rod with this start are reported by its simulation.
        let Ok(problem) = experiment.problem.with_fixed_layout([(unknown.parameter, start)]) else {
            continue;
        };
        for (k, measurement) in experiment.measurements.iter().enumerate() {
            let Some(motion) = measurement.motion() else { continue };
            if let Err(error) = problem.stencil(motion.point) {
                let key = measurement_key(experiment, k);
                let found = format!("{start}, for which {key}.point is not on the rod: {error}");
                let allowed = "values for which all observed points are on the rod";
                return Err(Error::invalid(format!("parameter[{i}].start"), found, allowed));
            }
        }
    }
    Ok(())
}

/// Whether a motion, a shape or a load-deflection curve names a point by the index of a node. Motions of markers of the
/// recording that prescribes the ends do not count.
fn names_nodes(measurement: &Measurement) -> bool {
    let is_node = |point: Point| matches!(point, Point::Node(_));
    let of_motion = |m: &PointMotion| m.marker.is_none() && is_node(m.point);
    let of_shape = |s: &EquilibriumShape| s.sightings.iter().any(|s| is_node(s.point));
    measurement.motion().is_some_and(of_motion)
        || measurement.shape().is_some_and(of_shape)
        || measurement.load_curve().is_some_and(|curve| is_node(curve.point))
}

/// The key of measurement `i` of an experiment in the fit file: name of the experiment, table, and index in the table,
/// as `bent.observation[0]`; without the name if it is empty.
pub(crate) fn measurement_key(experiment: &Experiment, i: usize) -> String {
    let table = experiment.measurements[i].table();
    let before = experiment.measurements[..i].iter().filter(|m| m.table() == table).count();
    experiment.key(&format!("{table}[{before}]"))
}

/// The `error` of a scene about a parameter, with the name of the experiment (if any) added to the value found. The key
/// `parameter` becomes `{key}.name`, with the `key` of the table in the fit file; other keys stay. Other kinds of
/// errors are unchanged.
fn with_parameter_key(error: Error, key: &str, experiment: &str) -> Error {
    let Error::Invalid { file, key: own, mut found, allowed } = error else { return error };
    if !experiment.is_empty() {
        found += &format!(" in experiment {experiment}");
    }
    let key = if own == "parameter" { format!("{key}.name") } else { own };
    Error::Invalid { file, key, found, allowed }
}

impl Unknown {
    /// Whether both unknowns are of the same parameter, and at least one experiment belongs to both.
    pub(crate) fn is_same_in_any(&self, other: &Self, experiments: &[Experiment]) -> bool {
        let has_both = |e: &Experiment| self.is_of(e) && other.is_of(e);
        self.parameter == other.parameter && experiments.iter().any(has_both)
    }

    /// Rejects names of experiments that do not exist or are repeated, parameters that no scene has, and values of
    /// start, bounds and prior out of range. All must be within the limits of the parameter, bounds ascending, the
    /// start within the bounds, sigma of the prior positive. `key` is that of the unknown's table in the fit file.
    pub(crate) fn check(&self, experiments: &[Experiment], key: &str) -> Result<(), Error> {
        let parameter = self.parameter;
        // Names of experiments, then the parameter in their scenes, then its values.
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
        let mut own = experiments.iter().filter(|e| self.is_of(e)).peekable();
        if own.peek().is_none() {
            let scene = experiments.first().map(|e| e.problem.scene());
            let absent = scene.map_or_else(
                || Error::invalid("experiment", "none", "at least one"),
                |scene| parameter.absent(scene),
            );
            return Err(with_parameter_key(absent, key, ""));
        }
        own.try_for_each(|e| {
            let checked = e.problem.check_parameter(parameter);
            checked.map_err(|error| with_parameter_key(error, key, &e.name))
        })?;
        let [least, most] = parameter.limits();
        let allowed = || match parameter.is_positive() {
            true => "finite and above 0".to_string(),
            false => format!("{least} .. {most}"),
        };
        let is_valid = |value: f64| value.is_finite() && value >= least && value <= most;
        // Bounds, prior and start are checked against the limits of the parameter, the start also against the bounds.
        let [low, high] = self.bounds.unwrap_or([least, most]);
        let are_bounds = self.bounds.is_none() || is_valid(low) && is_valid(high) && low < high;
        let ascending = format!("two ascending numbers, each {}", allowed());
        ensure(are_bounds, format!("{key}.bounds"), format!("{:?}", [low, high]), ascending)?;
        if let Some(Prior { mean, sigma }) = self.prior {
            ensure(is_valid(mean), format!("{key}.prior.mean"), mean, allowed())?;
            positive(&format!("{key}.prior.sigma"), sigma)?;
        }
        let Some(start) = self.start else { return Ok(()) };
        let allowed = match is_valid(start) {
            false => allowed(),
            true if start < low || start > high => format!("within the bounds {low} .. {high}"),
            true => return Ok(()),
        };
        Err(Error::invalid(format!("{key}.start"), start, allowed))
    }
}

impl Measurement {
    /// Rejects a measurement whose positions are in another unit than meters. The distance of a point from the wall is
    /// its largest coordinate difference; the median over the points must be at most [`FARTHEST`] lengths of the rod.
    /// Planned data, free rods and data without positions are accepted.
    pub(crate) fn check_units(&self, experiment: &Experiment) -> Result<(), Error> {
        let problem = &experiment.problem;
        let supports = &problem.scene().supports;
        // A free rod may be anywhere: its distance from the wall is no sign of the unit.
        let is_free = (supports.start, supports.end) == (Support::Free, Support::Free);
        if self.planned() || is_free {
            return Ok(());
        }
        let wall = match &problem.scene().structure {
            Some(structure) => structure.rods[0].origin.unwrap_or_default(),
            None => problem.wall(),
        };
        let distance = |position: &[Option<f64>; 3]| {
            let parts = (0..3).filter_map(|c| Some((position[c]? - wall[c]).abs()));
            parts.fold(0.0, f64::max)
        };
        // The median is that of the units; outliers are no wrong units.
        let typical = upper_median(self.positions().iter().map(distance));
        let Some(typical) = typical.filter(|x| *x > FARTHEST * problem.length()) else {
            return Ok(());
        };
        let found = format!(
            "points at a typical distance of {typical:.4} m from the wall of the \
                             rod"
        );
        let allowed = format!(
            "points of a rod of {} m. Check the unit in the header, as in x[mm], the origin and the scale",
            problem.length()
        );
        Err(Error::invalid(experiment.label(self), found, allowed))
    }

    /// Rejects a measurement without values, and a sigma or factors of it that are not positive. Factors require a
    /// sigma, and must be one per point or one per value. Also rejects values that the kind of data does not allow for
    /// the problem of the experiment. `key` is that of the table in the fit file. With `other_clock` (an offset of the
    /// clock or delays of rows) the times may end after the simulated motion.
    fn check(
        &self,
        experiment: &Experiment,
        key: &str,
        other_clock: bool,
        parameters: &[Parameter],
    ) -> Result<(), Error> {
        let (problem, label) = (&experiment.problem, experiment.label(self));
        ensure(self.values() > 0, key, "no values", "at least one")?;
        if let Some(sigma) = self.sigma() {
            positive(&format!("{key}.sigma"), sigma)?;
        }
        let (factors, points) = (&self.header.sigma_factors, self.points());
        factors.iter().try_for_each(|f| positive(&format!("{key}.sigma_factors"), *f))?;
        let (count, values) = (factors.len(), self.values());
        // Factors of the standard deviation are per point or per value, and need a sigma to multiply.
        let are_factors = count == 0 || [points, values].contains(&count) && self.sigma().is_some();
        let found = format!("{count} for {points} points with {values} values");
        ensure(
            are_factors,
            format!("{key}.sigma_factors"),
            found,
            "one factor for each value, \
                                     and a sigma",
        )?;
        let context = ValidationContext { problem, key, label: &label, other_clock, parameters };
        self.data.check(&self.header, &context)
    }
}
