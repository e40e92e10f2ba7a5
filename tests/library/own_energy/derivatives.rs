//! Derivatives by the parameters of user-defined energies, and by those of the rod: sensitivities against dual numbers and
//! differences.

use crate::own_energy::energies::Everything;
use crate::own_energy::scenes::{
    helix, in_scheme, named, plane_and_space, schemes, straight, with_both,
};
use num_dual::{Dual64, HyperDual64};
use rodfit::energy::At;
use rodfit::problem::Model;
use rodfit::scene::*;
use rodfit::{AnyProblem, Parameter, Point, Trajectory};

/// Unknowns at the end of a run in numbers that `seed` makes of the parameters.
macro_rules! end_of_run {
    ($problem:expr, $seed:expr) => {
        match $problem.discretized() {
            AnyProblem::Planar(discretized) => end_of_run!(discretized, $seed, $problem),
            AnyProblem::Spatial(discretized) => end_of_run!(discretized, $seed, $problem),
        }
    };
    ($discretized:ident, $seed:expr, $problem:expr) => {{
        let mut simulation = $discretized.simulation_over($seed).unwrap();
        let time = $problem.time().unwrap();
        for k in 1..=time.steps() {
            simulation.step_to(time.at(k)).unwrap();
        }
        let last = $problem.nodes() - 1;
        $discretized.model.position(&simulation.state().q, last)
    }};
}

/// Largest absolute component.
fn largest(v: &[f64]) -> f64 {
    v.iter().fold(0.0, |most, x| most.max(x.abs()))
}

/// Largest absolute difference of two vectors.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    largest(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}

/// First derivatives by sensitivities against the whole run in dual numbers and against differences
/// of fresh problems.
fn check_first(name: &str, scene: &Scene, parameters: &[&str]) {
    let problem = scene.problem().unwrap();
    let parameters: Vec<Parameter> = parameters.iter().map(|name| named(name)).collect();
    let run = problem.simulate_with(&parameters).unwrap();
    let end = problem.time().unwrap().end;
    let (_, slopes) = run.at(Point::Tip, end).unwrap();
    for (parameter, slope) in parameters.iter().zip(&slopes) {
        let whole = end_of_run!(problem, |p, v| Dual64::new(v, f64::from(p == *parameter)));
        let whole = whole.map(|x| x.eps);
        let size = largest(&whole);
        let off = difference(slope, &whole) / size;
        let value = parameter.of(scene).unwrap();
        let h = 1e-3 * value;
        let tip = |x: f64| {
            let run = problem.with([(*parameter, x)]).unwrap().simulate().unwrap();
            run.tip(run.times().len() - 1)
        };
        let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(|k| tip(value + k * h));
        let by_difference: Vec<f64> =
            (0..3).map(|i| (8.0 * (a[i] - b[i]) - (c[i] - d[i])) / (12.0 * h)).collect();
        let of_difference = difference(slope, &by_difference) / size;
        println!("{name}, {parameter}: {size:.1e} {off:.1e} {of_difference:.1e}");
        // Sensitivities and dual numbers are both exact: rounding errors of the run.
        assert!(size > 0.0 && off < 1e-9, "{name}, {parameter}: {slope:?} {whole:?}");
        // Five-point differences: truncation and rounding errors.
        assert!(of_difference < 1e-6, "{name}, {parameter}: {slope:?} {by_difference:?}");
    }
}

const OF_BOTH: [&str; 6] = [
    "energy.magnet.moment",
    "energy.springs.k",
    "energy.springs.k3",
    "youngs_modulus",
    "rod.shape.length",
    "density",
];

#[test]
fn first_derivatives_by_all_schemes() {
    for scheme in schemes() {
        for (name, scene, by_hand, field) in [
            ("plane", straight(12), false, [0.0, 0.05, 0.0]),
            ("space", helix(14), true, [0.03, 0.05, 0.02]),
        ] {
            let scene = in_scheme(with_both(scene, by_hand, field), scheme);
            check_first(&format!("{name} {scheme:?}"), &scene, &OF_BOTH);
        }
    }
}

/// An energy over three nodes, their tangents and directors, at the end of a rod in space; and a
/// place between nodes, which stays when the rod gets longer.
#[test]
fn first_derivatives_of_everything() {
    for (at, scheme) in [(At::End, Scheme::NewmarkBeta), (At::ArcLength(0.17), Scheme::Rodas4)] {
        let mut scene = in_scheme(helix(14), scheme);
        scene.loads.damping = Damping { mass: 0.3, ..Damping::default() };
        if scheme == Scheme::NewmarkBeta {
            scene.loads.damping.stiffness = 1e-3;
        }
        let scene = scene.with_energy("all", at, Everything { wrong: 0.0 }, [3e-4]);
        let names = ["energy.all.size", "youngs_modulus", "rod.shape.length", "rod.shape.pitch"];
        check_first(&format!("{at:?} {scheme:?}"), &scene, &names);
    }
}

/// Second derivatives in hyper-dual numbers against differences of the first.
#[test]
fn second_derivatives() {
    let names = ["energy.magnet.moment", "energy.springs.k", "youngs_modulus"].map(named);
    for (name, scene, field) in plane_and_space() {
        let problem = with_both(scene, true, field).problem().unwrap();
        let end = problem.time().unwrap().end;
        for one in names {
            for two in names {
                let along = |p: Parameter, q: Parameter| f64::from(u8::from(p == q));
                let seed = |p, v| HyperDual64::new(v, along(p, one), along(p, two), 0.0);
                let both = end_of_run!(problem, seed).map(|x| x.eps1eps2);
                let value = two.of(problem.scene()).unwrap();
                let h = 2e-3 * value;
                let slope = |k: f64| {
                    let run = problem.with([(two, value + k * h)]).unwrap();
                    run.simulate_with(&[one]).unwrap().at(Point::Tip, end).unwrap().1[0]
                };
                let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(slope);
                let by_difference: Vec<f64> =
                    (0..3).map(|i| (8.0 * (a[i] - b[i]) - (c[i] - d[i])) / (12.0 * h)).collect();
                let off = difference(&both, &by_difference) / largest(&both);
                println!("{name}, {one}, {two}: {:.1e} {off:.1e}", largest(&both));
                // Five-point differences of exact first derivatives.
                assert!(off < 1e-6, "{name}, {one}, {two}: {both:?} {by_difference:?}");
            }
        }
    }
}

/// Where a rod rests, and how it rings there, by the same parameters.
#[test]
fn derivatives_at_rest() {
    for (name, scene, field) in plane_and_space() {
        let mut scene = with_both(scene, false, field);
        scene.time = None;
        let problem = scene.problem().unwrap();
        let tip = problem.nodes() - 1;
        for parameter in ["energy.magnet.moment", "energy.springs.k", "rod.shape.length"].map(named)
        {
            let rest = Trajectory::at_rest(&problem, &[tip], &[parameter]).unwrap();
            let slope = rest.at(Point::Tip, 0.0).unwrap().1[0];
            let natural_frequencies = problem.natural_frequencies(&[1, 2], &[parameter]).unwrap();
            let value = parameter.of(&scene).unwrap();
            let h = 1e-3 * value;
            let there = |k: f64| {
                let other = problem.with([(parameter, value + k * h)]).unwrap();
                let natural_frequencies = other.natural_frequencies(&[1, 2], &[]).unwrap();
                let [x, y, z] = other.equilibrium().unwrap().tip;
                [
                    x,
                    y,
                    z,
                    natural_frequencies[0].frequency_rad_s,
                    natural_frequencies[1].frequency_rad_s,
                ]
            };
            let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(there);
            let difference_of = |i: usize| (8.0 * (a[i] - b[i]) - (c[i] - d[i])) / (12.0 * h);
            let by_difference: Vec<f64> = (0..3).map(difference_of).collect();
            let off = difference(&slope, &by_difference) / largest(&slope);
            println!("{name}, {parameter}: {off:.1e}");
            // Five-point differences of exact equilibria.
            assert!(off < 1e-6, "{name}, {parameter}: {slope:?} {by_difference:?}");
            for (found, i) in natural_frequencies.iter().zip([3, 4]) {
                let off = (found.derivatives[0] - difference_of(i)).abs();
                assert!(
                    off < 1e-6 * found.frequency_rad_s / value,
                    "{name}, {parameter}: {found:?}"
                );
            }
        }
    }
}
