//! States and measurements for which structures are not valid: springs in space near half a turn, frequencies in space,
//! implausible units and large strains.

use crate::scenes::{STEEL, joint, mixed_in_space, rubber_rod, structure, support};
use rodfit::fit::{Experiment, Frequencies};
use rodfit::structure::StructureReport;
use rodfit::{Fit, Parameter, Structure, StructureScene, Unknown};

/// Text of a rubber of this Young's modulus, Pa.
fn rubber(youngs_modulus: f64) -> String {
    format!(
        "[[materials]]\nname = \"rubber\"\ndensity = 1100\nyoungs_modulus = {youngs_modulus:e}\npoisson_ratio = 0.4\n"
    )
}

/// A rod stands on a weak spring and falls over: the spring turns by more than half a turn.
#[test]
fn spring_in_space_near_half_a_turn_is_an_error() {
    let upright = |name: &str, length: f64| {
        rubber_rod(name, "[0, 1, 0]").replace("length = 0.15", &format!("length = {length}"))
    };
    let text = |dimension: &str| {
        [
            format!("dimension = \"{dimension}\"\n"),
            upright("a", 0.1),
            upright("b", 0.2),
            rubber(1e8),
            joint("spring", &["a.end", "b.start"], "rotation = 1000.0"),
            support("a.start", "clamped"),
            "[loads]\ngravity = [0.02, -9.81, 0]\n".into(),
            "[time]\nend = 1.3\nstep = 2e-3\nscheme = \"generalised-alpha\"\nrho_inf = 0.9\n"
                .into(),
        ]
        .concat()
    };
    let run = |dimension: &str| {
        let structure =
            Structure::new(StructureScene::from_toml(&text(dimension), ".").unwrap()).unwrap();
        let mut motion = structure.simulation().unwrap();
        let time = structure.time().unwrap();
        let outcome = (1..=time.steps()).try_for_each(|k| motion.step_to(time.at(k)));
        outcome.map_err(|error| error.to_string())
    };
    let message = run("spatial").unwrap_err();
    println!("{message}");
    assert!(message.contains("joints[0]") && message.contains("half a turn"), "{message}");
    assert_eq!(run("planar"), Ok(()));
}

#[test]
fn frequencies_of_a_structure_in_space_are_rejected_before_the_search() {
    let scene = mixed_in_space(8, "").scene().clone();
    let experiment = Experiment::of_structure("", scene).unwrap();
    let experiment = experiment.observe(Frequencies::hz(&[10.0, 50.0, 90.0], 0.1));
    let modulus: Parameter = "materials.steel.youngs_modulus".parse().unwrap();
    let fit = Fit::of([experiment]).identify(Unknown::new(modulus).start(STEEL[0]));
    let error = fit.solve().unwrap_err();
    let message = error.to_string();
    assert!(error.is_input() && message.contains("frequencies[0]"), "{message}");
    assert!(message.contains("in a plane"), "{message}");
}

/// A cantilever of a rubber of this Young's modulus, Pa, with its weight.
fn cantilever(youngs_modulus: f64) -> Structure {
    let gravity = "[loads]\ngravity = [0, -9.81, 0]\n[time]\nend = 0.2\nstep = 1e-3\nscheme = \"generalised-alpha\"\n".to_string();
    structure(&[
        rubber_rod("a", "[1, 0, 0]"),
        rubber(youngs_modulus),
        support("a.start", "clamped"),
        gravity,
    ])
}

/// Whether one of the warnings is of rod a and has the code.
fn has(warnings: &[String], code: &str) -> bool {
    warnings.iter().any(|text| text.starts_with("rods.a: ") && text.ends_with(code))
}

#[test]
fn implausible_unit_of_a_rod_of_a_structure_is_warned_of() {
    for (modulus, is_warned) in [(10.0, true), (1e7, false)] {
        let structure = cantilever(modulus);
        let mut report = StructureReport::new(&structure);
        report.finish(&structure, &Ok(()));
        assert_eq!(has(&report.warnings, "[implausible-units]"), is_warned, "{modulus:e}");
    }
}

/// A body of 15 g whose mass is written in g.
#[test]
fn mass_of_a_body_in_grams_is_warned_of() {
    for (mass, is_warned) in [(15.0, true), (15e-3, false)] {
        let structure = structure(&[
            rubber_rod("a", "[1, 0, 0]"),
            rubber(1e7),
            format!(
                "[[bodies]]\nname = \"bob\"\nmass = {mass}\ninertia = 1e-6\nposition = [0.15, 0, 0]\n"
            ),
            joint("rigid", &["bob", "a.end"], ""),
            support("a.start", "clamped"),
            "[loads]\ngravity = [0, -9.81, 0]\n[time]\nend = 0.1\nstep = 1e-3\nscheme = \"generalised-alpha\"\n".into(),
        ]);
        let mut report = StructureReport::new(&structure);
        report.finish(&structure, &Ok(()));
        let is_named = |text: &String| text.starts_with("bodies.") && text.contains("(in g?)");
        assert_eq!(report.warnings.iter().any(is_named), is_warned, "{:?}", report.warnings);
    }
}

#[test]
fn large_strain_of_a_rod_of_a_structure_is_warned_of() {
    for (modulus, is_warned) in [(1e5, true), (1e8, false)] {
        let structure = cantilever(modulus);
        let found = structure.equilibrium().unwrap();
        let warnings = structure.equilibrium_warnings(&found);
        assert_eq!(has(&warnings, "[large-strain]"), is_warned, "{modulus:e}: {warnings:?}");
        let mut motion = structure.simulation().unwrap();
        let mut report = StructureReport::new(&structure);
        let time = structure.time().unwrap();
        for k in 1..=time.steps() {
            motion.step_to(time.at(k)).unwrap();
            report.push_energies(&motion);
        }
        report.finish(&structure, &Ok(()));
        assert_eq!(has(&report.warnings, "[large-strain]"), is_warned, "{:?}", report.warnings);
    }
}
