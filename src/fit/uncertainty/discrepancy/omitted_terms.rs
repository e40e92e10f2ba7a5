//! What may be missing in a scene: terms that stand at zero, and numbers that may be off.
//!
//! Each is a number of the scene where it stands now, or of the scene with a term of no size added, so that its
//! derivative is that of any number. `plausible` is how large it may well be without anybody knowing: what
//! laboratories have, not the largest that there can be.

use crate::fit::measurement::experiment::Experiment;
use crate::problem::Problem;
use crate::scene::along::Along;
use crate::scene::{Drag, Friction, Parameter, Point, PointMass, Scene, Section, Shape, Support};

/// A mass of no size, over the rod's: scenes have none of zero.
const NOTHING: f64 = 1e-9;
/// A clamp holds a rod as if it were longer by this part of its thickness: what elastic half spaces give.
const GRIP: f64 = 0.5;
/// Damping that air, clamp and material have without anybody knowing, over the critical.
const DAMPED: f64 = 2e-3;
/// Air: half its density times a drag coefficient of 1.2, kg/m^3.
const AIR: f64 = 0.72;
/// Angles by eye, rad; lengths and scales by eye, sections by calliper, markers, as parts.
const BY_EYE: f64 = 0.01;
const SCALE: f64 = 5e-3;
const SECTION: f64 = 0.01;
const MARKER: f64 = 0.01;
/// Densities from a data sheet, and bending stiffness of the quarter of the rod beside a grip, sleeve or glue, as parts.
const DATA_SHEET: f64 = 0.04;
const GRIPPED: f64 = 0.1;
/// Equal parts of the length, the first of which a grip may stiffen.
const GRIP_PARTS: usize = 4;
/// Internal friction: its springs over the rod's stiffness, and where they slip over the largest curvature that was seen.
const STRANDS: f64 = 0.01;
const SLIPS: f64 = 0.1;

/// What plausible sizes are taken from.
pub(crate) struct Sizes {
    /// Length, m, and mass, kg, of the rod.
    length: f64,
    mass: f64,
    /// Of its material, kg/m^3.
    density: f64,
    /// Of a circle or a tube, and height of a rectangle, m.
    radius: Option<f64>,
    height: Option<f64>,
    /// Of its section, m, and EI, N m^2.
    thickness: f64,
    bending: f64,
    /// Angular frequency of its first swing, rad/s, and time between two frames, s.
    swing: Option<f64>,
    frame: Option<f64>,
    /// Curvature of a cantilever whose tip moves as far as what was recorded, 1/m.
    bend: Option<f64>,
}

impl Sizes {
    /// Those of an experiment whose problem is this at the optimum.
    pub fn of(experiment: &Experiment, problem: &Problem) -> Self {
        let scene = problem.scene();
        let moments = scene.rod.section.moments();
        let [i1, i2] = moments.second_moments;
        let least = i1.min(i2);
        let rise =
            experiment.records().map(|o| o.rise_time()).filter(|t| *t > 0.0).reduce(f64::min);
        let frame = experiment.records().filter_map(|o| {
            let (first, last) = (o.samples.first()?.time, o.samples.last()?.time);
            (o.samples.len() > 1).then(|| (last - first) / (o.samples.len() - 1) as f64)
        });
        let far = experiment.records().map(|o| o.spread()).reduce(f64::max);
        Self {
            bend: far.filter(|far| *far > 0.0).map(|far| 3.0 * far / problem.length().powi(2)),
            length: problem.length(),
            density: scene.material.density,
            radius: match scene.rod.section {
                Section::Circle { radius } | Section::Tube { radius, .. } => Some(radius),
                _ => None,
            },
            height: match scene.rod.section {
                Section::Rectangle { height, .. } => Some(height),
                _ => None,
            },
            mass: scene.material.density * moments.area * problem.length(),
            // A circle of radius a has I/A = a^2/4.
            thickness: 4.0 * (least / moments.area).sqrt(),
            bending: scene.material.youngs_modulus * least,
            swing: rise.map(|rise| std::f64::consts::PI / rise),
            frame: frame.reduce(f64::min),
        }
    }
}

/// What may be missing or off.
pub(crate) struct Extension {
    /// The number, by its place.
    pub place: &'static str,
    /// What it is.
    pub words: &'static str,
    /// What would tell it from the parameters.
    pub test: &'static str,
    /// Adds the term to a scene that has none, if it can have one: of no size, or a small one.
    add: fn(&mut Scene, &Sizes),
    /// How large it may well be; none where that says nothing of the scene.
    pub plausible: fn(&Sizes) -> Option<f64>,
    /// Where it stands in a scene that says nothing of it; none where scenes always say it.
    usual: Option<f64>,
    /// Another number that changes with it, by its place, and the part of the size that each of the two changes by.
    pub beside: Option<Beside>,
}

/// A number that changes along with that of an effect.
#[derive(Clone, Copy)]
pub(crate) struct Beside {
    pub place: &'static str,
    /// Change of the effect's own number for a size of one, and of the other.
    pub own: f64,
    pub other: f64,
}

/// A rod is measured where it is easy to measure: it tapers about its stated radius, not from it.
const ABOUT_THE_MIDDLE: Option<Beside> =
    Some(Beside { place: "rod.taper.radius.from", own: 0.5, other: -0.5 });

/// An effect whose number is in every scene.
const NOTHING_ADDED: Extension = Extension {
    place: "",
    words: "",
    test: "",
    add: |_, _| {},
    plausible: |_| None,
    usual: None,
    beside: None,
};
const ANOTHER_LENGTH: &str = "repeat at another free length";
const A_LONGER_RECORD: &str = "record until the motion has decayed";

const FRICTION: &str = "loads.damping.friction.stiffness";
const GRIP_STIFFNESS: &str = "rod.taper.youngs_modulus.0";

/// All that a fit looks for.
pub(crate) const EXTENSIONS: [Extension; 20] = [
    Extension {
        place: "supports.start_compliance.rotation",
        words: "compliant clamp",
        test: ANOTHER_LENGTH,
        plausible: |s| Some(GRIP * s.thickness / s.bending),
        usual: Some(0.0),
        ..NOTHING_ADDED
    },
    Extension {
        place: "supports.angle",
        words: "tilted clamp",
        test: "photograph the rod at rest, with and without its weight",
        plausible: |_| Some(BY_EYE),
        usual: Some(0.0),
        ..NOTHING_ADDED
    },
    Extension {
        place: "rod.mass.0.mass",
        words: "tip mass, such as a marker",
        test: "weigh the marker; add the static droop",
        add: |scene, sizes| {
            if scene.rod.mass.is_empty() {
                scene.rod.mass.push(PointMass::new(Point::Tip, NOTHING * sizes.mass));
            }
        },
        plausible: |s| Some(MARKER * s.mass),
        ..NOTHING_ADDED
    },
    Extension {
        place: "rod.shape.length",
        words: "different free length",
        test: "measure from clamp to tip",
        plausible: |s| Some(SCALE * s.length),
        ..NOTHING_ADDED
    },
    Extension {
        place: "rod.taper.radius.to",
        words: "taper",
        test: "calliper at both ends; higher modes",
        add: |scene, _| {
            let round = matches!(scene.rod.section, Section::Circle { .. } | Section::Tube { .. });
            if round && scene.rod.taper.is_none() {
                scene.rod.taper.radius = Some(Along::linear(1.0, 1.0));
            }
        },
        plausible: |_| Some(SECTION),
        usual: Some(1.0),
        beside: ABOUT_THE_MIDDLE,
    },
    Extension {
        place: GRIP_STIFFNESS,
        words: "stiffer first quarter of the rod",
        test: ANOTHER_LENGTH,
        add: |scene, _| {
            if scene.supports.start == Support::Clamped && scene.rod.taper.youngs_modulus.is_none()
            {
                scene.rod.taper.youngs_modulus = Some(Along::Piecewise(vec![1.0; GRIP_PARTS]));
            }
        },
        plausible: |_| Some(GRIPPED),
        usual: Some(1.0),
        ..NOTHING_ADDED
    },
    Extension {
        place: "material.density",
        words: "different density",
        test: "weigh a known length of the rod",
        plausible: |s| Some(DATA_SHEET * s.density),
        ..NOTHING_ADDED
    },
    Extension {
        place: "rod.section.radius",
        words: "different radius",
        test: "calliper at several places",
        plausible: |s| Some(SECTION * s.radius?),
        ..NOTHING_ADDED
    },
    Extension {
        place: "rod.section.height",
        words: "different height of the section",
        test: "calliper at several places",
        plausible: |s| Some(SECTION * s.height?),
        ..NOTHING_ADDED
    },
    Extension {
        place: "rod.shape.angle",
        words: "curved rest shape",
        test: "photograph the rod hanging, or turned over",
        add: |scene, _| {
            if let Shape::Straight { length, direction: [x, 0.0, 0.0] } = scene.rod.shape
                && x > 0.0
            {
                scene.rod.shape = Shape::Arc { length, angle: 0.0 };
            }
        },
        plausible: |_| Some(2.0 * BY_EYE),
        usual: Some(0.0),
        ..NOTHING_ADDED
    },
    Extension {
        place: "rod.natural_curvature",
        words: "different natural curvature",
        test: "photograph the rod lying flat",
        plausible: |_| Some(BY_EYE),
        usual: Some(1.0),
        ..NOTHING_ADDED
    },
    Extension {
        place: "loads.damping.mass",
        words: "mass damping",
        test: A_LONGER_RECORD,
        plausible: |s| Some(2.0 * DAMPED * s.swing?),
        usual: Some(0.0),
        ..NOTHING_ADDED
    },
    Extension {
        place: "loads.damping.stiffness",
        words: "Kelvin-Voigt damping",
        test: "strike the rod: higher modes are damped more",
        // Without any, the derivative is that of vibrations so fast that a trace of it ends them.
        add: |scene, sizes| {
            let some = sizes.swing.map(|swing| DAMPED / swing);
            scene.loads.damping.stiffness = some.unwrap_or_default();
        },
        plausible: |s| Some(2.0 * DAMPED / s.swing?),
        usual: Some(0.0),
        ..NOTHING_ADDED
    },
    Extension {
        place: "loads.drag.linear_normal",
        words: "viscous drag",
        test: "record another section, or in a vacuum",
        add: with_drag,
        plausible: |s| Some(2.0 * DAMPED * s.swing? * s.mass / s.length),
        usual: Some(0.0),
        ..NOTHING_ADDED
    },
    Extension {
        place: "loads.drag.quadratic_normal",
        words: "air drag",
        test: "record another amplitude",
        add: with_drag,
        plausible: |s| s.swing.map(|_| AIR * s.thickness),
        usual: Some(0.0),
        ..NOTHING_ADDED
    },
    Extension {
        place: FRICTION,
        words: "internal friction",
        test: "record another amplitude",
        add: |scene, sizes| {
            if let Some(bend) = sizes.bend
                && scene.loads.damping.friction.is_none()
            {
                let friction = Friction { stiffness: NOTHING, curvature: SLIPS * bend };
                scene.loads.damping.friction = Some(friction);
            }
        },
        plausible: |s| s.swing.and(s.bend).map(|_| STRANDS),
        ..NOTHING_ADDED
    },
    Extension {
        place: "camera.time_offset",
        words: "clock offset",
        test: "start the record before the release",
        plausible: |s| s.frame,
        usual: Some(0.0),
        ..NOTHING_ADDED
    },
    Extension {
        place: "camera.pixel_scale",
        words: "different scale of the camera",
        test: "place a scale in the plane of motion",
        plausible: |_| Some(SCALE),
        ..NOTHING_ADDED
    },
    Extension {
        place: "camera.in_plane_rotation",
        words: "tilted camera",
        test: "place a plumb line in the picture",
        plausible: |_| Some(BY_EYE),
        usual: Some(0.0),
        ..NOTHING_ADDED
    },
    Extension {
        place: "supports.end_compliance.rotation",
        words: "compliant clamp at the end",
        test: ANOTHER_LENGTH,
        plausible: |s| Some(GRIP * s.thickness / s.bending),
        usual: Some(0.0),
        ..NOTHING_ADDED
    },
];

fn with_drag(scene: &mut Scene, sizes: &Sizes) {
    if scene.loads.drag.is_none() && sizes.swing.is_some() {
        scene.loads.drag = Some(Drag::default());
    }
}

impl Extension {
    /// The number.
    pub fn parameter(&self) -> Parameter {
        Parameter::at(self.place)
    }

    /// Whether it cannot be below what it is.
    pub fn is_one_sided(&self) -> bool {
        self.parameter().quantity().may_vanish
            || ["rod.mass.0.mass", FRICTION].contains(&self.place)
    }

    /// What it is, where that takes a number of a scene that has it.
    pub fn words_in(&self, scene: &Scene) -> Option<String> {
        let friction = scene.loads.damping.friction.filter(|_| self.place == FRICTION)?;
        Some(format!("{} that yields at {:.1e} 1/m", self.words, friction.curvature))
    }

    /// The problem with the term, if it can have it and says nothing of it.
    pub fn added(&self, problem: &Problem, sizes: &Sizes) -> Option<Problem> {
        let mut scene = problem.scene().clone();
        let held = |support| support == Support::Clamped;
        if self.place.starts_with("supports.")
            && !held(scene.supports.start)
            && !held(scene.supports.end)
        {
            return None;
        }
        if self.place == "rod.mass.0.mass" && !scene.rod.mass.is_empty()
            || self.place == FRICTION && scene.loads.damping.friction.is_some()
        {
            return None;
        }
        let there = self.parameter().of(&scene);
        if self.place == GRIP_STIFFNESS && scene.rod.taper.youngs_modulus.is_some() {
            return None;
        }
        if self.usual.is_some_and(|usual| there.is_some_and(|there| there != usual)) {
            return None;
        }
        (self.add)(&mut scene, sizes);
        // Schemes that do not take it, and all else that a scene refuses.
        let added = problem.like_it(scene).ok()?.laid_out_for_another(self.parameter()).ok()?;
        added.check_parameter(self.parameter()).ok()?;
        Some(added)
    }
}
