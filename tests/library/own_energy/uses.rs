//! Files, names and checks of user-defined energies, and errors of invalid ones.

use crate::own_energy::energies::{Bending, Everything, Floor, Foundation, Magnet};
use crate::own_energy::scenes::{helix, named, straight, with_both};
use rodfit::check::{Configuration, NodesAndEdges, Tolerance, check_own, check_problem};
use rodfit::dynamics::SimulationReport;
use rodfit::energy::At;
use rodfit::numerics::vector::{cross, unit};
use rodfit::scene::{Dimension, Scene, Shape};
use rodfit::{Error, Parameter};

/// The text of an error; panics for a success.
fn message<T>(result: Result<T, Error>) -> String {
    result.map(|_| ()).unwrap_err().to_string()
}

/// A straight rod with a magnet of 2 mA m^2 at its end in a field, T.
fn with_magnet(field: [f64; 3]) -> Scene {
    straight(8).with_energy("magnet", At::End, Magnet { field, by_hand: true }, [2e-3])
}

#[test]
fn parameters_of_user_defined_energies_have_names() {
    let scene = with_both(straight(8), true, [0.0, 0.05, 0.0]);
    let all: Vec<String> = Parameter::all(&scene).iter().map(Parameter::to_string).collect();
    for name in ["energy.magnet.moment", "energy.springs.k", "energy.springs.k3"] {
        assert!(all.contains(&name.to_string()), "{all:?}");
    }
    let moment = named("energy.magnet.moment");
    assert_eq!((moment.unit(), moment.is_positive()), ("A m^2", true));
    assert_eq!(named("energy.springs.k3").unit(), "N/m^4");
    // The moment with which the energy is attached.
    assert_eq!(moment.of(&scene), Some(2e-3));
    let other = scene.problem().unwrap().with([(moment, 3e-3)]).unwrap();
    assert_eq!(moment.of(other.scene()), Some(3e-3));
    let absent = message(other.check_parameter(named("energy.magnet.momentum")).map(|_| ()));
    assert!(
        absent.contains("attached by the program") && absent.contains("energy.magnet.moment"),
        "{absent}"
    );
    let refused = message(scene.problem().unwrap().with([(moment, -1.0)]));
    assert!(refused.contains("energy.magnet.moment"), "{refused}");
}

/// A scene file with a user-defined energy contains only its name and numbers; without its code it is rejected.
#[test]
fn file_with_energy_without_code_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let scene = with_both(straight(8), true, [0.0, 0.05, 0.0]);
    let text = scene.to_toml().unwrap();
    assert!(text.contains("[energy.magnet]") && text.contains("moment = 0.002"), "{text}");
    std::fs::write(&path, text.replace("moment = 0.002", "moment = 0.003")).unwrap();
    let error = message(Scene::load(&path));
    assert!(error.contains("scene.toml") && error.contains("energy.magnet"), "{error}");
    let loaded = Scene::load_with(&path, |scene| {
        scene.give_energy("magnet", Magnet { field: [0.0, 0.05, 0.0], by_hand: true })?;
        scene.give_energy("springs", Foundation { by_hand: true })
    })
    .unwrap();
    // The numbers of the file.
    assert_eq!(named("energy.magnet.moment").of(&loaded), Some(3e-3));
    assert_eq!(loaded.energies[1].at(), At::Interval(0.1, 0.22));
    let tip = |scene: &Scene| scene.problem().unwrap().equilibrium().unwrap().tip;
    let same = loaded.problem().unwrap().with([(named("energy.magnet.moment"), 2e-3)]).unwrap();
    assert_eq!(same.equilibrium().unwrap().tip, tip(&scene));
    let wrong = message(Scene::load_with(&path, |scene| {
        scene.give_energy("magnet", Foundation { by_hand: true })
    }));
    assert!(wrong.contains("moment") && wrong.contains("k, k3"), "{wrong}");
    let none = message(Scene::load_with(&path, |scene| {
        scene.give_energy("spring", Foundation { by_hand: true })
    }));
    assert!(none.contains("magnet, springs"), "{none}");
    // Reports name them too, and can be read back.
    let report = SimulationReport::new(&scene.problem().unwrap());
    let json = serde_json::to_string(&report).unwrap();
    let back: SimulationReport = serde_json::from_str(&json).unwrap();
    assert_eq!(back.scene.energies[0].name(), "magnet");
    assert!(message(back.scene.problem()).contains("load_with"));
}

#[test]
fn scene_with_invalid_energy_is_rejected() {
    let springs = || Foundation { by_hand: true };
    for (at, part) in [
        (At::ArcLength(0.31), "0.3 m"),
        (At::ArcLength(f64::NAN), "0.3 m"),
        (At::Interval(0.2, 0.1), "ascending"),
        (At::Interval(-0.1, 0.1), "0.3 m"),
    ] {
        let error =
            message(straight(8).with_energy("springs", at, springs(), [1.0, 0.0]).problem());
        assert!(error.contains("energy.springs.at") && error.contains(part), "{error}");
    }
    for (name, values, part) in [
        ("springs", [f64::NAN, 0.0], "energy.springs.k"),
        ("springs", [-1.0, 0.0], "energy.springs.k"),
        ("1", [1.0, 0.0], "a letter"),
        ("a.b", [1.0, 0.0], "a letter"),
    ] {
        let error = message(straight(8).with_energy(name, At::Whole, springs(), values).problem());
        assert!(error.contains(part), "{error}");
    }
    let twice = with_magnet([0.0; 3]).with_energy("magnet", At::Whole, springs(), [1.0, 0.0]);
    assert!(message(twice.problem()).contains("two energies of this name"));
    // A name means one kind of number.
    let floor = Floor { height: 0.0, bottom: -1.0 };
    let one = straight(8).with_energy("here", At::Whole, floor, [1.0]);
    one.problem().unwrap();
    let scene =
        straight(8).with_energy("nowhere", At::Whole, Floor { height: 1.0, bottom: 0.5 }, [1.0]);
    let error = message(scene.problem());
    assert!(error.contains("energy.nowhere") && error.contains("not a finite number"), "{error}");
}

/// An energy that becomes no number while the rod moves is named.
#[test]
fn energy_that_is_not_finite_ends_the_run() {
    for scheme in crate::own_energy::scenes::schemes() {
        let floor = Floor { height: -1.0, bottom: -0.003 };
        let scene = crate::own_energy::scenes::in_scheme(straight(8), scheme);
        let problem = scene.with_energy("floor", At::End, floor, [1.0]).problem().unwrap();
        let error = message(problem.simulate());
        assert!(error.contains("energy.floor, 0.3 m"), "{scheme:?}: {error}");
    }
}

#[test]
fn energy_out_of_the_plane_requires_spatial_model() {
    let plane = with_magnet([0.01, 0.05, 0.0]).problem().unwrap();
    assert_eq!(plane.model().0, "planar");
    let mut scene = with_magnet([0.0, 0.05, 0.01]);
    let space = scene.problem().unwrap();
    assert_eq!(space.model().0, "spatial");
    assert!(space.model().1.contains("energy.magnet leaves the plane"), "{}", space.model().1);
    let rest = space.equilibrium().unwrap();
    // The field has a component along z, which pulls the tip out of the plane by millimeters.
    assert!(rest.tip[2].abs() > 1e-3, "{rest}");
    scene.rod.dimension = Dimension::Planar;
    let error = message(scene.problem());
    assert!(error.contains("rod.dimension") && error.contains("energy.magnet"), "{error}");
}

#[test]
fn check_finds_wrong_derivative() {
    let both = with_both(straight(8), true, [0.0, 0.05, 0.0]);
    let bent = both.clone().with_energy(
        "bend",
        At::Whole,
        Bending { in_space: false },
        [2e-4, 3e-4, 1e-4],
    );
    let mut twisted = with_both(helix(8), true, [0.03, 0.05, 0.02])
        .with_energy("all", At::ArcLength(0.17), Everything { wrong: 0.0 }, [3e-4])
        .with_energy("bend", At::Whole, Bending { in_space: true }, [2e-4, 3e-4, 1e-4]);
    twisted.loads.gravity = [0.0; 3];
    for scene in [both, bent, twisted] {
        let report = check_problem(&scene.problem().unwrap(), Tolerance::default()).unwrap();
        assert!(report.passed(), "{report}");
    }
    let wrong =
        helix(8).with_energy("all", At::ArcLength(0.17), Everything { wrong: 1e-3 }, [3e-4]);
    let report = check_problem(&wrong.problem().unwrap(), Tolerance::default()).unwrap();
    let worst = report.worst.as_ref().unwrap();
    assert!(!report.derivatives_agree() && worst.element.starts_with("all at"), "{report}");
}

/// A round rod has directors of any orientation. A bending energy that differs between the two directors leaves the plane; the
/// check reports it although the energy is declared planar.
#[test]
fn check_finds_force_out_of_the_plane() {
    let mut scene = straight(8);
    scene.rod.shape = Shape::Straight { length: 0.3, direction: [0.48, 0.64, 0.6] };
    scene.loads.gravity = [8.0, -6.0, 0.0];
    for (second, stays) in [(2e-4, true), (3e-4, false)] {
        let bending = Bending { in_space: false };
        let scene = scene.clone().with_energy("bend", At::Whole, bending, [2e-4, second, 1e-4]);
        let problem = scene.problem().unwrap();
        assert_eq!(problem.model().0, "planar");
        let report = check_problem(&problem, Tolerance::default()).unwrap();
        let found = report.above.iter().any(|above| above.against == "the energy in space");
        assert_eq!(found, !stays, "{report}");
    }
}

/// An energy by itself, at any directors.
#[test]
fn energy_without_a_scene_is_checked() {
    let directors = |a: [f64; 3], b: [f64; 3]| {
        let tangent = unit(a);
        let first = unit(cross(tangent, b));
        [tangent, first, cross(tangent, first)]
    };
    let edges = |s: f64| {
        [directors([1.0, s, 0.2], [0.0, 1.0, s]), directors([0.8, -s, 0.5], [s, 0.3, 1.0])]
    };
    let nodes = |s: f64| [[0.0; 3], [0.1, 0.02 * s, 0.0], [0.2, 0.01, 0.03 * s]];
    let state = |s: f64| Configuration {
        arc_length: 0.1,
        length: 0.1,
        rest: NodesAndEdges { nodes: nodes(0.0), edges: edges(0.0) },
        now: NodesAndEdges { nodes: nodes(s), edges: edges(s) },
    };
    let states = [0.3, -1.0, 2.0].map(state);
    let tolerance = Tolerance::default();
    let report = check_own(&Everything { wrong: 0.0 }, [0.3], &states, tolerance);
    assert!(report.passed() && report.states == 3, "{report}");
    let report = check_own(&Everything { wrong: 1e-9 }, [0.3], &states, tolerance);
    let worst = report.worst.as_ref().unwrap();
    assert!(!report.derivatives_agree() && worst.dof.contains("Node(0)"), "{report}");
    // In dual numbers alone finite differences are left to judge.
    let report = check_own(&Bending { in_space: true }, [1.0, 2.0, 3.0], &states, tolerance);
    assert!(report.passed(), "{report}");
}
