//! Random scenes of ten kinds whose mesh, step and scheme are left open.
//!
//! Length, slenderness, density, stiffness (by the sag under gravity), damping, loads and initial states are drawn from wide
//! ranges with the seed. The duration is a few periods of the lowest mode.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};

/// Kinds of scenes, by their number modulo the number of kinds.
pub const KINDS: [&str; 10] = [
    "released under gravity",
    "released from a shape",
    "plucked",
    "struck",
    "limp",
    "twisted",
    "moved end",
    "damped",
    "with masses",
    "curved",
];

/// The text of the scene with a seed, of the kind `seed` modulo 10, with SEGMENTS, STEP and ACCURACY in the places of its
/// numerics.
pub fn scene(seed: u64) -> String {
    let kind = KINDS[(seed % KINDS.len() as u64) as usize];
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut between = |a: f64, b: f64| a + (b - a) * random.random::<f64>();
    let gravity = 9.81;
    let length = 0.1 * 10f64.powf(between(0.0, 1.0));
    let radius = length * 10f64.powf(between(-2.5, -1.7));
    let density = between(900.0, 8000.0);
    // Deflection of the tip under the rod's weight over the length, were the deflection small.
    let sag = match kind {
        "limp" => 10f64.powf(between(0.3, 1.6)),
        "released from a shape" | "plucked" | "struck" | "twisted" => {
            10f64.powf(between(-2.5, -0.7))
        }
        _ => 10f64.powf(between(-2.0, 0.0)),
    };
    // The stiffness follows from the sag; 3.516 is the square of the first root of a clamped beam.
    let modulus = density * gravity * length.powi(3) / (2.0 * radius * radius * sag);
    let rate = 3.516 * (modulus * radius * radius / 4.0 / density).sqrt() / length.powi(2);
    // A limp rod swings like a pendulum, not like a beam.
    let rate = rate.max((gravity / length).sqrt());
    let periods = if kind == "limp" { between(0.5, 1.5) } else { between(1.0, 5.0) };
    let end = periods * TAU / rate;
    let weight = density * PI * radius * radius * length * gravity;
    let stiffness = modulus * PI / 4.0 * radius.powi(4);
    let straight = format!("{{ kind = \"straight\", length = {length}, direction = [1, 0, 0] }}");
    let arc = |angle: f64| format!("{{ kind = \"arc\", length = {length}, angle = {angle} }}");
    let shape = match kind {
        "curved" if between(0.0, 1.0) < 0.4 => format!(
            "{{ kind = \"helix\", length = {length}, radius = {}, pitch = {}, axis = [0, 0, -1], handedness = \"left\" }}",
            0.06 * length,
            0.12 * length
        ),
        "curved" => arc(between(0.3, 3.0)),
        _ => straight.clone(),
    };
    let section = match kind {
        "twisted" => format!(
            "{{ kind = \"rectangle\", width = {}, height = {}, up = [0, 1, 0] }}\nnatural_twist = {}",
            2.0 * radius,
            between(0.8, 2.0) * radius,
            between(-4.0, 4.0) / length
        ),
        _ => format!("{{ kind = \"circle\", radius = {radius} }}"),
    };
    // Half of the damped scenes have mass damping, the others stiffness damping; some other scenes weak mass damping.
    let damping = match kind {
        "damped" if between(0.0, 1.0) < 0.5 => format!("mass = {}", between(0.05, 0.5) * rate),
        "damped" => format!("stiffness = {}", between(0.005, 0.05) / rate),
        _ if between(0.0, 1.0) < 0.3 => format!("mass = {}", between(0.02, 0.2) * rate),
        _ => String::new(),
    };
    let pull = 0.5 * stiffness / (length * length);
    let initial = match kind {
        "released from a shape" => {
            format!("state = \"shape\"\nshape = {}", arc(between(0.4, 2.0)))
        }
        "plucked" => format!(
            "state = \"equilibrium\"\npoint = [{{ node = \"tip\", force = [0, {}, 0] }}]",
            between(0.3, 1.0) * pull
        ),
        "struck" if between(0.0, 1.0) < 0.5 => {
            format!("velocity = [0, {}, 0]", between(0.05, 0.5) * rate * length)
        }
        "struck" => format!("angular_velocity = [0, 0, {}]", between(0.1, 1.0) * rate),
        _ => String::new(),
    };
    let loads = match kind {
        "twisted" => format!(
            "point = [{{ node = \"tip\", force = [0, {}, {}] }}]",
            between(0.1, 0.5) * pull,
            between(0.1, 0.5) * pull
        ),
        _ => String::new(),
    };
    let masses = match kind {
        "with masses" => format!(
            "mass = [{{ node = \"tip\", mass = {} }}]",
            between(0.1, 2.0) * weight / gravity
        ),
        _ => String::new(),
    };
    let motion = match kind {
        "moved end" => format!(
            "[[supports.motion]]\nend = \"start\"\ndisplacement = [0, {}, 0]\nfrequency = {}\n",
            between(0.02, 0.1) * length,
            between(0.3, 2.0) * rate / TAU
        ),
        _ => String::new(),
    };
    let pulled =
        if ["released from a shape", "struck", "twisted"].contains(&kind) { 0.0 } else { -gravity };
    format!(
        "ACCURACY\n[rod]\nSEGMENTS\nshape = {shape}\nsection = {section}\n{masses}\n\
         [material]\ndensity = {density}\nyoungs_modulus = {modulus}\npoisson_ratio = 0.35\n{motion}\
         [loads]\ngravity = [0, {pulled}, 0]\ndamping = {{ {damping} }}\n{loads}\n[initial]\n{initial}\n\
         [time]\nend = {end}\nSTEP\n"
    )
}
