//! The true rods: the reference, the errors of the model, and right models.
//!
//! Every fit assumes a straight, uniform rod of the stated length, radius and density with a rigid horizontal clamp.

use crate::rod::Cantilever;

/// Length that every scene states, m.
pub const LENGTH: f64 = 0.35;
/// Radius that every scene states, m.
pub const RADIUS: f64 = 2e-3;
/// Density that every scene states, kg/m^3.
pub const DENSITY: f64 = 1250.0;
/// Gravity, m/s^2.
pub const GRAVITY: f64 = 9.81;
/// True Young's modulus, Pa.
const MODULUS: f64 = 2.6e8;
/// True mass damping, 1/s.
const DAMPING: f64 = 0.6;
/// Duration of a recording, s.
pub const RECORD: f64 = 0.6;
/// Duration of a short recording, s.
const SHORT_RECORD: f64 = 0.3;
/// Stiffness of the compliant clamp over EI/L.
const CLAMP_SPRING: f64 = 25.0;
/// Quadratic drag, kg/m^2: three times that of air on this circle at a drag coefficient of 1.2, which is 2.9e-3.
const DRAG: f64 = 9e-3;
/// Turning angle of the curved rod from clamp to tip, rad.
const ARC: f64 = 0.05;
/// Angle of the tilted clamp, rad.
const TILT: f64 = std::f64::consts::PI / 180.0;

/// A true rod and the duration of its recording.
pub struct Kind {
    pub name: String,
    /// The number of the scene that is missing or off, by its place; none of a right model.
    pub cause: Option<&'static str>,
    /// Whether the error is the same motion at another E, whatever the noise.
    pub is_collinear: bool,
    pub rod: Cantilever,
    /// Of the recording, s.
    pub end: f64,
}

impl Kind {
    /// The reference with `change`, recorded for [`RECORD`].
    fn wrong(name: &str, cause: &'static str, change: fn(&mut Cantilever)) -> Self {
        let mut rod = reference();
        change(&mut rod);
        Self { name: name.into(), cause: Some(cause), is_collinear: false, rod, end: RECORD }
    }
}

/// The rod that the scene describes.
pub fn reference() -> Cantilever {
    Cantilever {
        length: LENGTH,
        radius: RADIUS,
        taper: 1.0,
        density: DENSITY,
        modulus: MODULUS,
        grip: 1.0,
        tip_mass: 0.0,
        compliance: 0.0,
        damping: DAMPING,
        drag: 0.0,
        arc: 0.0,
        tilt: 0.0,
        gravity: GRAVITY,
    }
}

/// A linear taper about the stated radius.
fn set_taper(rod: &mut Cantilever, part: f64) {
    rod.radius *= 1.0 + 0.5 * part;
    rod.taper = (1.0 - 0.5 * part) / (1.0 + 0.5 * part);
}

/// The rods with one error of the model, with the places of their causes. A rod tapered by a part has radii from `1 + part/2` of
/// the stated one at the clamp to `1 - part/2` at the tip.
pub fn wrong_models() -> Vec<Kind> {
    let wrong = Kind::wrong;
    let mass = "rod.mass.0.mass";
    let (taper, clamp) = ("rod.taper.radius.to", "supports.start_compliance.rotation");
    let short = wrong("tip mass 5 %, short record", mass, |r| r.tip_mass = 0.05 * r.mass());
    let density = wrong("10 % denser", "material.density", |r| r.density *= 1.1);
    vec![
        wrong("taper 10 %", taper, |r| set_taper(r, 0.1)),
        wrong("taper 40 %", taper, |r| set_taper(r, 0.4)),
        wrong("tip mass 1 %", mass, |r| r.tip_mass = 0.01 * r.mass()),
        wrong("tip mass 5 %", mass, |r| r.tip_mass = 0.05 * r.mass()),
        Kind { end: SHORT_RECORD, ..short },
        wrong("clamp of 25 EI/L", clamp, |r| {
            r.compliance = r.length / (CLAMP_SPRING * r.stiffness(0.0));
        }),
        wrong("1 % longer", "rod.shape.length", |r| r.length *= 1.01),
        wrong("3 % longer", "rod.shape.length", |r| r.length *= 1.03),
        Kind { is_collinear: true, ..density },
        wrong("grip 1.3 times stiffer", "rod.taper.youngs_modulus.0", |r| r.grip = 1.3),
        wrong("quadratic drag", "loads.drag.quadratic_normal", |r| r.drag = DRAG),
        wrong("curved rest shape", "rod.shape.angle", |r| r.arc = ARC),
        wrong("clamp tilted by 1 degree", "supports.angle", |r| r.tilt = TILT),
    ]
}

/// Soft to stiff and weakly to strongly damped rods that have no error of the model.
pub fn right_models() -> Vec<Kind> {
    let mut kinds = Vec::new();
    for modulus in [1.2e8, MODULUS, 8e8] {
        for damping in [0.2, DAMPING, 2.0] {
            kinds.push(Kind {
                name: format!("right: E {modulus:.1e} Pa, damping {damping} 1/s"),
                cause: None,
                is_collinear: false,
                rod: Cantilever { modulus, damping, ..reference() },
                end: RECORD,
            });
        }
    }
    kinds
}
