//! Notes on the fitted scenes: implausible units, no gravity, given meshes too coarse for the natural curvature, and
//! large strains.
//!
//! [`scene_notes`] examines the scenes of all experiments at the values of the optimum, and adds each note once to the
//! warnings of a fit. Notes do not lower the grade. Warnings do: of a fitted Young's modulus of no solid, of one beside
//! the density of no solid, and of strains above [`IMPOSSIBLE_STRAIN`]. Structures are not examined: one note lists
//! which effects are not assessed for them. A strain above `LARGEST_STRAIN`, the limit of a linear material, has a
//! note, for the first such experiment only. Strains of measured shapes at rest are those of the equilibrium. Strains
//! of a measured motion are the largest of a simulation.
//!
//! That simulation is omitted, and the strain of the initial shape counts, where [`OVERSHOOT`] times an estimated bound
//! is at most `LARGEST_STRAIN`. The bound is the larger of the strain of the initial shape and of one by beam theory.
//! Without an initial velocity the strain at equilibrium may replace the latter. There is no bound with motions of
//! supports, actuators, contacts, or signals of loads. Rods between recorded ends have no strains here.

use crate::code::Code;
use crate::fit::search::fitted::Fitted;
use crate::fit::uncertainty::warning_list::{Severity, Warnings};
use crate::problem::strain::{LARGEST_STRAIN, LargestStrain, StrainGauge};
use crate::problem::{AnyProblem, Problem, Purpose};
use crate::scene::Parameter;

/// Largest displacement of a released rod over that of its equilibrium: 2 of an undamped linear oscillation.
const OVERSHOOT: f64 = 2.0;

/// Strain above which the linear model describes no rod: results are wrong, mostly by the units or the setup.
const IMPOSSIBLE_STRAIN: f64 = 0.3;

/// Text of the note on a structure: effects that are assessed for one rod only.
const STRUCTURE_SCOPE: &str = "shear flexibility, large strains and motions out of the plane are not \
                               assessed for structures. One of them may bias the estimates. Fit one rod alone to compare";

/// Adds the notes on the scenes of all experiments at an optimum, each text once. They are the plausibility notes of
/// each problem, for a motion if one was measured, else for a shape at rest, else for modes. One more is on the largest
/// strain, at rest or in motion, of the first experiment where it is too large. A structure has one note on the scope
/// of the assessment instead. Experiments whose scene does not allow the values of the optimum are skipped.
pub(crate) fn scene_notes(fitted: Fitted, warnings: &mut Warnings) {
    let mut added: Vec<String> = Vec::new();
    let unknowns = fitted.search.unknowns;
    let fits_modulus = unknowns.iter().any(|own| own.parameter == Parameter::YoungsModulus);
    if fitted.search.experiments.iter().any(|e| e.problem.scene().structure.is_some()) {
        warnings.add(Severity::Note, Code::StructureScope, STRUCTURE_SCOPE);
    }
    for (k, experiment) in fitted.search.experiments.iter().enumerate() {
        let Ok(problem) = fitted.problem(experiment) else { continue };
        // Plausibility and strains are those of one rod.
        if problem.scene().structure.is_some() {
            continue;
        }
        let at_rest = experiment.measurements.iter().any(|m| {
            let required = m.requirements();
            required.is_at_rest() || !required.load_cases.is_empty()
        });
        let purpose = match (experiment.moves(), at_rest) {
            (true, _) => Purpose::Motion,
            (false, true) => Purpose::Rest,
            (false, false) => Purpose::Modes,
        };
        let mut notes = problem.plausibility_notes(purpose);
        // Thick rods have warnings with the bias of the estimates.
        notes.retain(|(code, _)| *code != Code::ThickRod);
        // Equilibria and modes beside a motion have their own warnings.
        let has_modes = experiment.measurements.iter().any(|m| !m.requirements().modes.is_empty());
        if purpose == Purpose::Motion && (at_rest || has_modes) {
            notes.extend(problem.notes_at_rest());
        }
        let modulus = problem.scene().material.youngs_modulus;
        let strains = [
            at_rest.then(|| strain_at_rest(&problem)).flatten(),
            experiment.moves().then(|| strain_in_motion(fitted, k, &problem)).flatten(),
        ];
        let largest = strains.into_iter().flatten().reduce(|mut largest, other| {
            largest.include(other);
            largest
        });
        let largest_strain = largest.map_or(0.0, |largest| largest.strain);
        notes.extend(largest.into_iter().flat_map(|largest| largest.warnings(modulus)));
        for (code, text) in notes {
            // The texts of strains differ between experiments; one note on them is enough.
            let same = if [Code::LargeStrain, Code::BeyondTable].contains(&code) {
                code.name().into()
            } else {
                text.clone()
            };
            if !added.contains(&same) {
                added.push(same);
                let is_wrong = match code {
                    Code::ImplausibleUnits => {
                        fits_modulus && problem.has_implausible_material(purpose)
                    }
                    Code::LargeStrain => largest_strain > IMPOSSIBLE_STRAIN,
                    _ => false,
                };
                let severity = if is_wrong { Severity::Validity } else { Severity::Note };
                warnings.add(severity, code, experiment.with_name(text));
            }
        }
    }
}

/// Whether no rod has the values of an optimum: the strain at equilibrium of any experiment is above
/// [`IMPOSSIBLE_STRAIN`], or numbers of its scene are implausible.
pub(crate) fn is_impossible(fitted: Fitted) -> bool {
    fitted.search.experiments.iter().filter_map(|own| fitted.problem(own).ok()).any(|problem| {
        let strain = strain_at_rest(&problem).map_or(0.0, |largest| largest.strain);
        strain > IMPOSSIBLE_STRAIN || problem.has_implausible_units()
    })
}

/// The largest strain at equilibrium; none where that cannot be computed, or where recorded markers prescribe nodes.
fn strain_at_rest(problem: &Problem) -> Option<LargestStrain> {
    let found = problem.equilibrium().ok()?;
    Some(StrainGauge::new(problem)?.largest(|i| found.nodes[i], None))
}

/// The largest strain of the motion of experiment number `experiment`, whose `problem` has the values of the optimum.
/// It is that of the initial shape, without a run, if [`OVERSHOOT`] times a bound is at most [`LARGEST_STRAIN`]. The
/// bound is the larger one of that strain and of [`strain_bound`], or without an initial velocity of the strain at
/// equilibrium. Motions of supports, actuators, contacts and signals have no bound. None between recorded ends, or
/// where the run fails.
fn strain_in_motion(
    Fitted { search, optimum }: Fitted,
    experiment: usize,
    problem: &Problem,
) -> Option<LargestStrain> {
    let gauge = StrainGauge::new(problem)?;
    let start = start_strain(problem, &gauge);
    // The bounds are those of constant loads: nothing else may strain the rod.
    let scene = problem.scene();
    let has_bound = scene.supports.motion.is_empty()
        && scene.actuation.is_empty()
        && scene.contacts.is_empty()
        && scene.signals.is_empty()
        // The end of a table is compared with curvatures, which the bound does not cover.
        && start.curvature.is_none();
    let is_allowed = |strain: f64| has_bound && OVERSHOOT * strain <= LARGEST_STRAIN;
    if is_allowed(start.strain.max(strain_bound(problem))) {
        return Some(start);
    }
    let at_rest = || strain_at_rest(problem).map_or(f64::INFINITY, |largest| largest.strain);
    if has_bound && !scene.initial.moves() && is_allowed(start.strain.max(at_rest())) {
        return Some(start);
    }
    // No bound holds: the strain is computed after every step of a run.
    let mut largest = start;
    let mut after = |_: &Problem, simulation: &dyn crate::dynamics::Snapshot| {
        largest.include(gauge.largest(|i| simulation.position(i), Some(simulation.time())));
    };
    search.all_residuals().ok()?.run(experiment, &optimum.x, false, &mut after).ok()?;
    Some(largest)
}

/// The largest strain of the initial shape, at the time 0.
fn start_strain(problem: &Problem, gauge: &StrainGauge) -> LargestStrain {
    let nodes = match problem.discretized() {
        AnyProblem::Planar(discretized) => discretized.start_positions(),
        AnyProblem::Spatial(discretized) => discretized.start_positions(),
    };
    gauge.largest(|i| nodes[i], Some(0.0))
}

/// Estimated upper bound of the strains (a pure number) by loads at equilibrium and by the initial velocity, from beam
/// theory: the largest of `2 i k + F/(E A) + 2 v sqrt(rho/E)` at both ends and the middle of the rod. `i` is the
/// smaller radius of gyration, `A` the area, `I = A i^2`, and `F` the sum of the magnitudes of the weights of rod and
/// attached masses and of all point and line loads. `v` is the initial speed plus the initial angular velocity times
/// the length `L`. The curvature is `k = min(F L/(E I), 2 sqrt(F/(E I))) + M/(E I)`, with the sum `M` of all moments.
fn strain_bound(problem: &Problem) -> f64 {
    let scene = problem.scene();
    let size = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let length = problem.length();
    let points = scene.loads.point.iter().chain(&scene.initial.point);
    let [force, moment] = points.fold([0.0; 2], |[force, moment], point| {
        [force + size(&point.force), moment + size(&point.moment)]
    });
    let force = force + scene.loads.line.iter().map(|line| line.size(length)).sum::<f64>();
    let gravity = size(&scene.loads.gravity);
    let attached = scene.rod.mass.iter().map(|mass| mass.mass * gravity).sum::<f64>();
    let speed = size(&scene.initial.velocity) + size(&scene.initial.angular_velocity) * length;
    let strain = |place: f64| {
        let (section, material) = scene.at(place);
        let (modulus, density) = (material.youngs_modulus, material.density);
        let moments = section.moments();
        let [i1, i2] = moments.second_moments;
        let (area, radius) = (moments.area, (i1.min(i2) / moments.area).sqrt());
        let all = density * area * length * gravity + attached + force;
        let bending = modulus * area * radius * radius;
        // Half of the weight's lever; an elastica under a force F bends by no more than 2 sqrt(F/(E I)).
        let curvature =
            (all * length / bending).min(2.0 * (all / bending).sqrt()) + moment / bending;
        // The surface is up to twice the radius of gyration away. A jump of the velocity v makes a curvature of
        // v sqrt(rho A/(E I)), and a strain along the rod of v sqrt(rho/E).
        let wave = (density / modulus).sqrt();
        2.0 * radius * curvature + all / (modulus * area) + 2.0 * speed * wave
    };
    // A tapered rod is softest at an end or in the middle.
    [0.0, 0.5, 1.0].map(strain).into_iter().fold(0.0, f64::max)
}
