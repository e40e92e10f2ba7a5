//! Texts of structures.

use rodfit::{Structure, StructureScene};

/// Young's modulus, Pa, density, kg/m^3, and radius, m, of all rods here.
pub const STEEL: [f64; 3] = [2e11, 7800.0, 1e-3];

/// Bending stiffness, N m^2.
pub fn bending() -> f64 {
    STEEL[0] * std::f64::consts::PI * STEEL[2].powi(4) / 4.0
}

/// Mass per length, kg/m.
pub fn line_density() -> f64 {
    STEEL[1] * std::f64::consts::PI * STEEL[2].powi(2)
}

/// Text of a straight rod.
pub fn rod(name: &str, segments: usize, length: f64, [x, y]: [f64; 2]) -> String {
    format!(
        "[[rods]]\nname = \"{name}\"\nsegments = {segments}\n\
         shape = {{ kind = \"straight\", length = {length}, direction = [{x:?}, {y:?}, 0.0] }}\n\
         section = {{ kind = \"circle\", radius = {:e} }}\nmaterial = \"steel\"\n",
        STEEL[2]
    )
}

/// Text of a rod of rubber of 0.15 m in this direction, a list.
pub fn rubber_rod(name: &str, direction: &str) -> String {
    format!(
        "[[rods]]\nname = \"{name}\"\nsegments = 8\nmaterial = \"rubber\"\n\
         shape = {{ kind = \"straight\", length = 0.15, direction = {direction} }}\n\
         section = {{ kind = \"circle\", radius = 5e-3 }}\n"
    )
}

/// Text of the material.
pub fn steel() -> String {
    let [modulus, density, _] = STEEL;
    format!("[[materials]]\nname = \"steel\"\ndensity = {density}\nyoungs_modulus = {modulus:e}\n")
}

/// Text of a joint of ends `a.end`.
pub fn joint(kind: &str, ends: &[&str], more: &str) -> String {
    let connects = ends.iter().map(|end| match end.split_once('.') {
        Some((rod, at)) => format!("{{ rod = \"{rod}\", at = \"{at}\" }}"),
        None => format!("{{ body = \"{end}\" }}"),
    });
    let connects: Vec<String> = connects.collect();
    format!("[[joints]]\nkind = \"{kind}\"\nconnects = [{}]\n{more}\n", connects.join(", "))
}

/// Text of a support.
pub fn support(end: &str, kind: &str) -> String {
    let (rod, at) = end.split_once('.').unwrap();
    format!("[[supports]]\nof = {{ rod = \"{rod}\", at = \"{at}\" }}\nkind = \"{kind}\"\n")
}

/// The structure of these texts.
pub fn structure(parts: &[String]) -> Structure {
    let scene = StructureScene::from_toml(&(steel() + &parts.concat()), ".").unwrap();
    Structure::new(scene).unwrap()
}

/// A frame with every kind of joint and a body: two legs, a beam of two pieces with a spring between, a hinged strut, and a
/// body at the end of a free arm.
pub fn mixed(segments: usize) -> Structure {
    structure(&[
        rod("left", segments, 0.2, [0.1, 1.0]),
        rod("beam", segments, 0.15, [1.0, 0.1]),
        rod("rest", segments, 0.12, [1.0, -0.2]),
        rod("strut", segments, 0.1, [0.3, -1.0]),
        rod("arm", segments, 0.1, [1.0, 0.6]),
        "[[bodies]]\nname = \"bob\"\nmass = 0.02\ninertia = 3e-6\nposition = [0.42, 0.28, 0]\n".into(),
        joint("rigid", &["left.end", "beam.start"], ""),
        joint("spring", &["beam.end", "rest.start"], "rotation = 2.0\nrest = 0.1"),
        joint("ball", &["rest.end", "strut.start", "arm.start"], ""),
        joint("rigid", &["bob", "arm.end"], ""),
        support("left.start", "clamped"),
        support("strut.end", "pinned"),
        "[loads]\ngravity = [0, -9.81, 0]\n[[loads.point]]\nrod = \"beam\"\nnode = 5\nforce = [0.1, -0.3, 0]\n"
            .into(),
        "[time]\nend = 0.02\nstep = 1e-3\n".into(),
    ])
}

/// Shear modulus of steel with Poisson's ratio 0.3, Pa.
pub fn shear_modulus() -> f64 {
    STEEL[0] / 2.6
}

/// Torsional stiffness, N m^2.
pub fn torsion() -> f64 {
    shear_modulus() * std::f64::consts::PI * STEEL[2].powi(4) / 2.0
}

/// Text of a straight rod in space.
pub fn spatial_rod(name: &str, segments: usize, length: f64, [x, y, z]: [f64; 3]) -> String {
    rod(name, segments, length, [1.0, 0.0])
        .replace("direction = [1.0, 0.0, 0.0]", &format!("direction = [{x:?}, {y:?}, {z:?}]"))
}

/// Text of steel with Poisson's ratio 0.3.
pub fn twisting_steel() -> String {
    steel() + "poisson_ratio = 0.3\n"
}

/// The structure of these texts in space.
pub fn spatial(parts: &[String]) -> Structure {
    let text = "dimension = \"spatial\"\n".to_string() + &twisting_steel() + &parts.concat();
    Structure::new(StructureScene::from_toml(&text, ".").unwrap()).unwrap()
}

/// A frame in space with every kind of joint and a body: a clamped leg with a beam of two sprung pieces, a ball with a clamped
/// strut, a body on a hanger, and an arm that is hinged to the body.
pub fn mixed_in_space(segments: usize, time: &str) -> Structure {
    spatial(&[
        spatial_rod("leg", segments, 0.2, [0.1, 1.0, 0.3]),
        spatial_rod("beam", segments, 0.15, [1.0, 0.1, -0.2]),
        spatial_rod("rest", segments, 0.12, [1.0, -0.2, 0.4]),
        spatial_rod("strut", segments, 0.1, [0.3, -1.0, 0.2]),
        spatial_rod("hanger", segments, 0.1, [0.2, 0.6, 1.0]),
        spatial_rod("arm", segments, 0.1, [0.1, -1.0, 0.4]),
        "[[bodies]]\nname = \"bob\"\nmass = 0.02\ninertia = [3e-6, 4e-6, 2e-6]\n\
         orientation = [0.3, -0.2, 0.5]\nposition = [0.04, 0.25, 0.15]\n"
            .into(),
        joint("rigid", &["leg.end", "beam.start", "hanger.start"], ""),
        joint("spring", &["beam.end", "rest.start"], "rotation = [2.0, 1.0, 3.0]"),
        joint("ball", &["rest.end", "strut.start"], ""),
        joint("hinge", &["bob", "arm.start"], "axis = [1.0, 0.3, -0.2]")
            .replace("{ body = \"bob\" }", "{ body = \"bob\", offset = [0.0, -0.02, 0.01] }"),
        joint("rigid", &["bob", "hanger.end"], ""),
        support("leg.start", "clamped"),
        support("strut.end", "clamped"),
        "[loads]\ngravity = [0.5, -9.81, 1.0]\n[[loads.point]]\nrod = \"beam\"\nnode = 5\n\
         force = [0.1, -0.3, 0.2]\n"
            .into(),
        time.into(),
    ])
}
