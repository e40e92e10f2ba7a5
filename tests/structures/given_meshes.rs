//! Estimated errors of the meshes of structures, against fine meshes, and the warning of coarse ones.

use rodfit::{Structure, StructureScene};

/// Segments of each rod, and of the fine mesh.
const MESHES: [usize; 5] = [6, 7, 8, 12, 20];
const FINE: usize = 100;
const COUNT: usize = 6;
const LIMIT: f64 = 0.02;

/// An L of two welded rods in a wall, under its weight.
fn corner(segments: usize) -> Structure {
    let rod = |name: &str, direction: &str| {
        format!(
            "[[rods]]\nname = \"{name}\"\nsegments = {segments}\nmaterial = \"rubber\"\n\
             shape = {{ kind = \"straight\", length = 0.25, direction = {direction} }}\n\
             section = {{ kind = \"circle\", radius = 0.005 }}\n"
        )
    };
    let text = format!(
        "{}{}{}",
        rod("a", "[1, 0, 0]"),
        rod("b", "[0, 1, 0]"),
        r#"
            [[materials]]
            name = "rubber"
            density = 1300
            youngs_modulus = 1e9
            [[joints]]
            kind = "rigid"
            connects = [{ rod = "a", at = "end" }, { rod = "b", at = "start" }]
            [[supports]]
            of = { rod = "a", at = "start" }
            kind = "clamped"
            [loads]
            gravity = [0, -9.8, 0]
        "#
    );
    Structure::new(StructureScene::from_toml(&text, ".").unwrap()).unwrap()
}

/// The factor on the numbers of segments that a warning recommends.
fn factor(warning: &str) -> f64 {
    let (_, words) = warning.split_once("Use ").unwrap();
    words.split(' ').next().unwrap().parse().unwrap()
}

/// Whether an estimate is within a factor of 3 of the true error, or both are below a small number.
fn is_near(estimate: f64, truth: f64) -> bool {
    let ratio = (estimate / truth).abs();
    ratio > 1.0 / 3.0 && ratio < 3.0 || estimate.abs().max(truth.abs()) < 2e-4
}

#[test]
fn frequency_errors_of_structures_are_estimated() {
    let modes = |segments: usize| {
        let structure = corner(segments);
        let mut found = structure.modes(COUNT, false).unwrap();
        structure.add_mesh_errors(COUNT, false, &mut found);
        found
    };
    let exact = modes(FINE).modes;
    for segments in MESHES {
        let found = modes(segments);
        for (own, exact) in found.modes.iter().zip(&exact) {
            let (error, truth) =
                (own.mesh_error.unwrap(), own.frequency_rad_s / exact.frequency_rad_s - 1.0);
            assert!(is_near(error, truth), "{segments}: {error:e}, {truth:e}");
        }
        let is_large = found.modes.iter().any(|mode| mode.mesh_error.unwrap().abs() > LIMIT);
        assert_eq!(found.warnings.iter().any(|text| text.contains("[coarse-mesh]")), is_large);
        if is_large {
            println!("{segments}: {}", found.warnings[0]);
            let finer = (factor(&found.warnings[0]) * segments as f64).ceil() as usize;
            assert!(modes(finer).warnings.is_empty(), "{finer}");
        }
    }
}

#[test]
fn displacement_errors_of_structures_are_estimated() {
    let rest = |segments: usize| {
        let structure = corner(segments);
        let mut found = structure.equilibrium().unwrap();
        structure.add_mesh_error(&mut found);
        found
    };
    // The end of the second rod moves most; without loads it is at (0.25, 0.25) on every mesh.
    let tip = rest(FINE).shape.rods["b"].tip;
    for segments in MESHES {
        let found = rest(segments);
        let own = found.shape.rods["b"].tip;
        let truth = (own[0] - tip[0]).hypot(own[1] - tip[1]);
        let extent = (own[0] - 0.25).hypot(own[1] - 0.25);
        let error = found.mesh_error.unwrap();
        let relative = error.relative.unwrap();
        assert!(is_near(relative, truth / extent), "{segments}: {relative:e}, {truth:e}");
        let warned = found.warnings.iter().any(|text| text.contains("[coarse-mesh]"));
        assert_eq!(warned, relative > LIMIT, "{segments}: {error:?}");
        if warned {
            println!("{segments}: {}", found.warnings[0]);
            let finer = (factor(&found.warnings[0]) * segments as f64).ceil() as usize;
            assert!(rest(finer).warnings.is_empty(), "{finer}");
        }
    }
}
