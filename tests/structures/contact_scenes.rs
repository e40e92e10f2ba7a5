//! Texts and structures with damping and friction of contacts.

use crate::scenes::{joint, spatial_rod, support, twisting_steel};
use rodfit::{Structure, StructureScene};

/// Gravitational acceleration, m/s^2.
pub const GRAVITY: f64 = 9.81;
/// Radius of all rods, m.
pub const RADIUS: f64 = 3e-3;
pub const DIMENSIONS: [&str; 2] = ["dimension = \"planar\"\n", "dimension = \"spatial\"\n"];

/// The structure of these texts, of rods with this Young's modulus, Pa, and the radius `RADIUS`.
pub fn structure(dimension: &str, modulus: f64, parts: &[String]) -> Structure {
    let text = dimension.to_string() + &twisting_steel() + &parts.concat();
    let text =
        text.replace("2e11", &format!("{modulus:e}")).replace("radius = 1e-3", "radius = 3e-3");
    Structure::new(StructureScene::from_toml(&text, ".").unwrap()).unwrap()
}

/// Text of gravity along -y.
pub fn gravity() -> String {
    format!("[loads]\ngravity = [0, {:?}, 0]\n", -GRAVITY)
}

/// Text of a plane through a point with this normal and these further keys.
pub fn plane([x, y]: [f64; 2], [nx, ny]: [f64; 2], keys: &str) -> String {
    format!(
        "[[contacts]]\nkind = \"plane\"\npoint = [{x:?}, {y:?}, 0]\nnormal = [{nx:?}, {ny:?}, 0]\n{keys}\n"
    )
}

/// Text of a duration and a step, s, with these further keys.
pub fn time(end: f64, step: f64, keys: &str) -> String {
    format!("[time]\nend = {end:?}\nstep = {step:e}\n{keys}\n")
}

/// Losses of the contacts below.
pub const LOSSES: &str = "friction = 0.4\ndamping = 8.0\nslip_velocity = 5e-3";

/// Text of a body.
pub fn body(dimension: &str) -> String {
    let inertia = if dimension == DIMENSIONS[0] { "3e-6" } else { "[2e-6, 4e-6, 3e-6]" };
    format!(
        "[[bodies]]\nname = \"bob\"\nmass = 0.02\ninertia = {inertia}\nposition = [0.34, 0.06, 0.0]\n"
    )
}

/// A frame of two welded rods and a body on a sprung arm that falls on a floor, with these keys of the floor and the
/// time.
pub fn falling(dimension: &str, modulus: f64, floor: &str, times: &str) -> Structure {
    structure(
        dimension,
        modulus,
        &[
            spatial_rod("a", 8, 0.15, [1.0, -0.1, 0.0]),
            spatial_rod("b", 8, 0.1, [1.0, 0.2, 0.0]),
            spatial_rod("c", 8, 0.1, [0.7, 0.7, 0.0]),
            body(dimension),
            joint("rigid", &["a.end", "b.start"], ""),
            joint("spring", &["b.end", "c.start"], "rotation = 0.5"),
            joint("rigid", &["bob", "c.end"], ""),
            gravity(),
            plane([0.0, -0.022], [0.1, 1.0], floor),
            times.into(),
        ],
    )
}

/// Text of a straight rod from `origin`.
pub fn placed(name: &str, segments: usize, length: f64, way: [f64; 3], origin: [f64; 3]) -> String {
    spatial_rod(name, segments, length, way) + &format!("origin = {origin:?}\n")
}

/// Text of contacts of all rods with this stiffness, N/m^3.
pub fn touching(stiffness: f64) -> String {
    format!("[[rod_contacts]]\nstiffness = {stiffness:e}\n")
}

/// Three rods near each other, one with a body: parallel in a plane, and skew in space. These are further keys of the
/// contacts.
pub fn bundle(dimension: &str, keys: &str) -> Structure {
    let aside = |z: f64| if dimension == DIMENSIONS[0] { 0.0 } else { z };
    structure(
        dimension,
        2e9,
        &[
            placed("a", 8, 0.15, [1.0, 0.0, aside(0.2)], [0.0; 3]),
            placed("b", 9, 0.17, [1.0, 0.01, aside(-0.8)], [-0.01, 0.007, aside(0.05)]),
            placed("c", 7, 0.12, [-1.0, -0.01, aside(0.1)], [0.14, -0.007, aside(0.01)]),
            "[[bodies]]\nname = \"bob\"\nmass = 0.02\ninertia = INERTIA\nposition = [0, -0.01, 0]\n"
                .replace("INERTIA", if dimension == DIMENSIONS[0] { "3e-6" } else { "[2e-6, 4e-6, 3e-6]" }),
            joint("rigid", &["bob", "c.end"], ""),
            support("a.start", "clamped"),
            support("b.end", "pinned"),
            touching(1e9) + keys,
        ],
    )
}

/// A rod that falls across a cantilever from this distance, m, with this step, s, and these further keys of contacts and
/// time.
pub fn collision(step: f64, gap: f64, losses: &str, keys: &str) -> Structure {
    let length = 0.2;
    structure(
        DIMENSIONS[1],
        2e9,
        &[
            placed("beam", 10, 0.3, [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]),
            placed(
                "falling",
                9,
                length,
                [1.0, 0.1, 0.1],
                [-0.5 * length - 0.01, 2.0 * RADIUS + gap, 0.2],
            ),
            support("beam.start", "clamped"),
            gravity(),
            touching(1e9) + losses + "\n",
            time(0.1, step, keys),
        ],
    )
}
