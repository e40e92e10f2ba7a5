//! Effects that a scene may omit: terms of size zero, and numbers that may have errors.
//!
//! [`OMITTED_EFFECTS`] is the table of the 25 effects that score tests of fits of one rod examine (those of structures
//! are in `structure_effects`). Each effect is a number of the scene, given by its path, by which the residuals are
//! differentiated like by any parameter; a taper changes two numbers together. Where a scene does not have the number,
//! a term with it is added: of the size zero, or of a small size ([`TRACE`]) where scenes do not allow zero.
//! Kelvin-Voigt damping is added with half of its plausible size instead (zero without an oscillation). The plausible
//! size, in the unit of the number and from the sizes of the rod, is an error that is common in laboratories, not the
//! largest possible one. It is none where the section or the data do not define it.
//!
//! [`OmittedEffect::added`] returns the problem with the term, or none where the scene states the effect or cannot have
//! it. [`OmittedEffect::is_excluded_beside`] returns whether other parameters of the fit exclude the effect,
//! [`OmittedEffect::is_one_sided`] whether the number cannot be smaller than in the scene. Constants are plausible
//! sizes relative to those of the rod.

use crate::fit::uncertainty::discrepancy::rod_sizes::RodSizes;
use crate::problem::Problem;
use crate::scene::along::Along;
use crate::scene::{
    BendingLaw, Drag, Friction, Maxwell, MaxwellBranches, Parameter, Point, PointMass, Scene,
    Section, Shape, Support,
};

/// Size of an added term where scenes do not allow zero: mass over the mass of the rod, or stiffness over the bending
/// stiffness of the rod.
const TRACE: f64 = 1e-9;
/// Extension of the rod that is equivalent to an elastic clamp, over its thickness, for elastic half-spaces.
pub(crate) const CLAMP_EXTENSION: f64 = 0.5;
/// Plausible damping ratio by air, clamp and material.
const DAMPING_RATIO: f64 = 2e-3;
/// Half the density of air times a drag coefficient of 1.2, kg/m^3.
const AIR_DRAG: f64 = 0.72;
/// Plausible error of an angle by eye, rad.
const ANGLE: f64 = 0.01;
/// Plausible relative error of a length or a scale by eye.
pub(crate) const LENGTH: f64 = 5e-3;
/// Plausible relative error of the frame rate of a camera: rates of telephones vary, and nominal ones are rounded.
const FRAME_RATE: f64 = 2e-3;
/// Plausible relative error of a dimension of the section by calipers.
pub(crate) const SECTION: f64 = 0.01;
/// Plausible mass of a marker over that of the rod.
pub(crate) const MARKER_MASS: f64 = 0.01;
/// Plausible relative error of a density from a data sheet.
pub(crate) const DENSITY: f64 = 0.04;
/// Plausible relative change of the stiffness of the part of the rod beside a grip, sleeve or glue.
const GRIP_STIFFENING: f64 = 0.1;
/// Number of equal parts of the length with separate stiffness factors; a grip may stiffen the first.
const GRIP_PARTS: usize = 4;
/// Plausible stiffness of the springs of internal friction over that of the rod.
const FRICTION_STIFFNESS: f64 = 0.01;
/// Yield curvature of internal friction over the largest observed curvature: below 1, so that the motion yields.
const YIELD_CURVATURE: f64 = 0.1;
/// Plausible stiffness of a second Maxwell branch over that of the rod.
const BRANCH_STIFFNESS: f64 = 0.02;
/// Relaxation time of a second Maxwell branch over that of the first: the next decade.
const RELAXATION_TIMES: f64 = 10.0;
/// Plausible part of the bending moment beyond the linear law at the largest observed curvature.
const NONLINEAR_MOMENT: f64 = 0.02;

/// An effect that a scene may omit.
#[derive(Clone, Copy)]
pub(crate) struct OmittedEffect {
    /// Path of its number in the scene.
    pub path: &'static str,
    /// Name, as text.
    pub name: &'static str,
    /// Experiment that would distinguish the effect from the parameters.
    pub test: &'static str,
    /// Adds the term to a scene without it, if the scene allows it; does nothing for numbers that every scene has.
    add: fn(&mut Scene, &RodSizes),
    /// Plausible size in the unit of the number; none where the effect is not defined.
    pub plausible: fn(&RodSizes) -> Option<f64>,
    /// Value of the number in a scene without the effect; none if the number has no such value, as a length or a mass.
    absent: Option<f64>,
    /// Another number that changes with it.
    pub coupling: Option<CoupledNumber>,
}

/// A number that changes along with that of an effect.
#[derive(Clone, Copy)]
pub(crate) struct CoupledNumber {
    /// Path of the other number.
    pub path: &'static str,
    /// Change of the effect's own number for a size of one.
    pub own: f64,
    /// Change of the other number for a size of one.
    pub other: f64,
}

/// A taper about the stated radius in the middle of the rod, where sections are measured.
const ABOUT_THE_MIDDLE: Option<CoupledNumber> =
    Some(CoupledNumber { path: "rod.taper.radius.from", own: 0.5, other: -0.5 });

/// Defaults of the table: an effect of a number that every scene has, without an added term.
const EVERY_SCENE: OmittedEffect = OmittedEffect {
    path: "",
    name: "",
    test: "",
    add: |_, _| {},
    plausible: |_| None,
    absent: None,
    coupling: None,
};
/// Experiment that distinguishes compliance and length of the clamp from the modulus.
const ANOTHER_LENGTH: &str = "repeat at another free length";
/// Experiment that determines damping.
const A_LONGER_RECORD: &str = "record until the motion has decayed";

/// Path of the size of internal friction.
const FRICTION: &str = "loads.damping.friction.stiffness";
/// Path of the stiffness factor of the first part of the rod.
const GRIP_STIFFNESS: &str = "rod.taper.youngs_modulus.0";
/// Path of the stiffness of a second Maxwell branch.
const SECOND_BRANCH: &str = "loads.damping.maxwell.1.stiffness";
/// Path of the time scale of the recording.
const TIME_SCALE: &str = "camera.time_scale";
/// Path of the first attached mass.
const TIP_MASS: &str = "rod.mass.0.mass";
/// Path of the coefficient of nonlinear bending.
const NONLINEAR_BENDING: &str = "material.bending_law.coefficient";
/// Paths of the rotational compliance of both clamps, in which a bending law must be linear.
const CLAMP_ROTATIONS: [&str; 2] =
    ["supports.start_compliance.rotation", "supports.end_compliance.rotation"];

/// All omitted effects that a fit tests, in the order of the tests.
pub(crate) const OMITTED_EFFECTS: [OmittedEffect; 25] = [
    OmittedEffect {
        path: CLAMP_ROTATIONS[0],
        name: "compliant clamp",
        test: ANOTHER_LENGTH,
        plausible: |s| Some(CLAMP_EXTENSION * s.thickness / s.bending),
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "supports.angle",
        name: "tilted clamp",
        test: "photograph the rod at rest, with and without its weight",
        plausible: |_| Some(ANGLE),
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: TIP_MASS,
        name: "tip mass, such as a marker",
        test: "weigh the marker; add the static droop",
        add: |scene, sizes| {
            if scene.rod.mass.is_empty() {
                scene.rod.mass.push(PointMass::new(Point::Tip, TRACE * sizes.mass));
            }
        },
        plausible: |s| Some(MARKER_MASS * s.mass),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "rod.shape.length",
        name: "different free length",
        test: "measure from clamp to tip",
        plausible: |s| Some(LENGTH * s.length),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "rod.taper.radius.to",
        name: "taper",
        test: "measure both ends with calipers; record higher modes",
        add: |scene, _| {
            let round = matches!(scene.rod.section, Section::Circle { .. } | Section::Tube { .. });
            if round && scene.rod.taper.is_none() {
                scene.rod.taper.radius = Some(Along::linear(1.0, 1.0));
            }
        },
        plausible: |_| Some(SECTION),
        absent: Some(1.0),
        coupling: ABOUT_THE_MIDDLE,
    },
    OmittedEffect {
        path: GRIP_STIFFNESS,
        name: "different stiffness of the first quarter",
        test: ANOTHER_LENGTH,
        add: |scene, _| {
            if scene.supports.start == Support::Clamped && scene.rod.taper.youngs_modulus.is_none()
            {
                scene.rod.taper.youngs_modulus = Some(Along::Piecewise(vec![1.0; GRIP_PARTS]));
            }
        },
        plausible: |_| Some(GRIP_STIFFENING),
        absent: Some(1.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "material.density",
        name: "different density",
        test: "weigh a known length of the rod",
        plausible: |s| Some(DENSITY * s.density),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "rod.section.radius",
        name: "different radius",
        test: "measure several sections",
        plausible: |s| Some(SECTION * s.radius?),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "rod.section.height",
        name: "different height of the section",
        test: "measure several sections",
        plausible: |s| Some(SECTION * s.height?),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "rod.shape.angle",
        name: "curved rest shape",
        test: "photograph the rod hanging, or turned over",
        add: |scene, _| {
            // An arc of the angle zero is the same straight rod, as arcs start along +x.
            if let Shape::Straight { length, direction: [x, 0.0, 0.0] } = scene.rod.shape
                && x > 0.0
            {
                scene.rod.shape = Shape::Arc { length, angle: 0.0 };
            }
        },
        plausible: |_| Some(2.0 * ANGLE),
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "rod.natural_curvature",
        name: "different natural curvature",
        test: "photograph the rod lying flat",
        plausible: |_| Some(ANGLE),
        absent: Some(1.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "loads.damping.mass",
        name: "mass damping",
        test: A_LONGER_RECORD,
        plausible: |s| Some(2.0 * DAMPING_RATIO * s.frequency?),
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "loads.damping.stiffness",
        name: "Kelvin-Voigt damping",
        test: "strike the rod: higher modes are damped more",
        // At zero the derivative is that of undamped fast vibrations, which any damping removes.
        add: |scene, sizes| {
            let some = sizes.frequency.map(|frequency| DAMPING_RATIO / frequency);
            scene.loads.damping.stiffness = some.unwrap_or_default();
        },
        plausible: |s| Some(2.0 * DAMPING_RATIO / s.frequency?),
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "loads.drag.linear_normal",
        name: "viscous drag",
        test: "repeat with another section, or in a vacuum",
        add: with_drag,
        plausible: |s| Some(2.0 * DAMPING_RATIO * s.frequency? * s.mass / s.length),
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "loads.drag.quadratic_normal",
        name: "air drag",
        test: "repeat at another amplitude",
        add: with_drag,
        plausible: |s| s.frequency.map(|_| AIR_DRAG * s.thickness),
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: FRICTION,
        name: "internal friction",
        test: "repeat at another amplitude",
        add: |scene, sizes| {
            if let Some(curvature) = sizes.curvature
                && scene.loads.damping.friction.is_none()
            {
                let friction =
                    Friction { stiffness: TRACE, curvature: YIELD_CURVATURE * curvature };
                scene.loads.damping.friction = Some(friction);
            }
        },
        plausible: |s| s.frequency.and(s.curvature).map(|_| FRICTION_STIFFNESS),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: SECOND_BRANCH,
        name: "second relaxation time",
        test: "record faster and slower motions",
        // A single table has other parameter names than a list, so that only lists get another branch.
        add: |scene, _| {
            if let MaxwellBranches::Series(branches) = &mut scene.loads.damping.maxwell
                && let [first] = branches[..]
            {
                let time = RELAXATION_TIMES * first.time;
                branches.push(Maxwell { stiffness: 0.0, time });
            }
        },
        plausible: |_| Some(BRANCH_STIFFNESS),
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: NONLINEAR_BENDING,
        name: "nonlinear bending",
        test: "repeat at another amplitude",
        add: |scene, sizes| {
            if scene.material.bending_law.is_none() && sizes.curvature.is_some() {
                scene.material.bending_law = Some(BendingLaw::Cubic { coefficient: 0.0 });
            }
        },
        plausible: |s| s.frequency.and(s.curvature).map(|k| NONLINEAR_MOMENT / (k * k)),
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "camera.time_offset",
        name: "clock offset",
        test: "start the record before the release",
        plausible: |s| s.frame,
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: TIME_SCALE,
        name: "different frame rate",
        test: "record a clock, or a light that blinks at a known rate",
        plausible: |s| s.picture.map(|_| FRAME_RATE),
        absent: Some(1.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "camera.pixel_scale",
        name: "different scale of the recording",
        test: "place a scale in the plane of motion",
        plausible: |_| Some(LENGTH),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "camera.in_plane_rotation",
        name: "tilted camera",
        test: "place a plumb line in the picture",
        plausible: |_| Some(ANGLE),
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "camera.row_delay.y",
        name: "rolling shutter",
        test: "record with the camera turned by a right angle, or with a global shutter",
        plausible: |s| s.row_delay,
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: "camera.distortion",
        name: "lens distortion",
        test: "photograph a straight edge near the border of the picture",
        plausible: |s| s.distortion,
        absent: Some(0.0),
        ..EVERY_SCENE
    },
    OmittedEffect {
        path: CLAMP_ROTATIONS[1],
        name: "compliant clamp at the end",
        test: ANOTHER_LENGTH,
        plausible: |s| Some(CLAMP_EXTENSION * s.thickness / s.bending),
        absent: Some(0.0),
        ..EVERY_SCENE
    },
];

/// Whether `path` is that of an effect added to a structure, whose number cannot be negative: the rotational compliance
/// of a joint (`joints.NAME.rotation`), or the first mass on a rod (`rods.NAME.mass.0.mass`). False for all other
/// paths, also of other numbers that cannot be negative.
fn is_added_to_structure(path: &str) -> bool {
    let is_compliance = path.starts_with("joints.") && path.ends_with(".rotation");
    is_compliance || path.starts_with("rods.") && path.ends_with(".mass.0.mass")
}

/// Adds a table of drag coefficients, all zero, to a scene without one, if the recorded motion has a frequency
/// (`sizes.frequency`); else nothing.
fn with_drag(scene: &mut Scene, sizes: &RodSizes) {
    if scene.loads.drag.is_none() && sizes.frequency.is_some() {
        scene.loads.drag = Some(Drag::default());
    }
}

impl OmittedEffect {
    /// The effect of the number at `path`, which scenes have already. `test` describes the experiment that
    /// distinguishes it from the parameters. It has no name, no plausible size and no added term.
    pub fn of_number(path: &'static str, test: &'static str) -> Self {
        Self { path, test, ..EVERY_SCENE }
    }

    /// The number of the effect, as a parameter of a scene.
    pub fn parameter(&self) -> Parameter {
        Parameter::at(self.path)
    }

    /// Whether the number of the effect cannot be negative, so that negative sizes are excluded. Such numbers are
    /// parameters that may be zero (as dampings and compliances), added masses, friction, and added compliances and
    /// masses of a structure.
    pub fn is_one_sided(&self) -> bool {
        // Scenes do not allow zero for added masses and friction, so that they are no parameters that may vanish.
        let is_positive =
            [TIP_MASS, FRICTION].contains(&self.path) || is_added_to_structure(self.path);
        self.parameter().quantity().may_vanish || is_positive
    }

    /// Name of internal friction with its yield curvature in a `scene`, as text; none for other effects, or a scene
    /// without friction.
    pub fn name_in(&self, scene: &Scene) -> Option<String> {
        let friction = scene.loads.damping.friction.filter(|_| self.path == FRICTION)?;
        Some(format!("{} with the yield curvature {:.1e} 1/m", self.name, friction.curvature))
    }

    /// Whether a scene states the effect, or cannot have it. It states the effect if its number differs from `absent`.
    /// Any attached mass states the tip mass, any friction internal friction, and a taper of the modulus the stiffness
    /// at the grip. Another frame rate is excluded where a recording moves an end. Effects of `supports` require a
    /// clamped end (start or end of the rod).
    fn is_excluded_by(&self, scene: &Scene) -> bool {
        // A number at another value than that of an absent effect is stated.
        let own = self.absent.zip(self.parameter().of(scene));
        let has_clamp = [scene.supports.start, scene.supports.end].contains(&Support::Clamped);
        own.is_some_and(|(absent, own)| own != absent)
            || match self.path {
                TIP_MASS => !scene.rod.mass.is_empty(),
                FRICTION => scene.loads.damping.friction.is_some(),
                GRIP_STIFFNESS => scene.rod.taper.youngs_modulus.is_some(),
                // The recording that moves an end has the same clock.
                TIME_SCALE => {
                    let structure = scene.structure.as_ref();
                    scene.supports.path.is_some()
                        || structure.is_some_and(|own| own.recording.is_some())
                }
                path => path.starts_with("supports.") && !has_clamp,
            }
    }

    /// Whether a scene cannot have the effect together with one of the `stated` parameters (identified or known
    /// inputs). Rotational compliance of a clamp and nonlinear bending exclude each other.
    pub fn is_excluded_beside(&self, stated: &[Parameter]) -> bool {
        let is_stated = |path: &str| stated.iter().any(|parameter| parameter.path() == path);
        match self.path {
            NONLINEAR_BENDING => CLAMP_ROTATIONS.into_iter().any(is_stated),
            path if CLAMP_ROTATIONS.contains(&path) => is_stated(NONLINEAR_BENDING),
            _ => false,
        }
    }

    /// A copy of the problem with the term of the effect, if it needs one, of the size zero, or small where zero is not
    /// possible. None where the scene states the effect or cannot have it, where scene or scheme do not allow the term,
    /// or where the model has no derivative by its number. None also for lens distortion and rolling shutter without a
    /// plausible size.
    pub fn added(&self, problem: &Problem, sizes: &RodSizes) -> Option<Problem> {
        let mut scene = problem.scene().clone();
        // Lens and rows need coordinates that an experiment may not have: it then has no size of the effect.
        let needs_picture = ["camera.row_delay.y", "camera.distortion"].contains(&self.path);
        if self.is_excluded_by(&scene) || needs_picture && (self.plausible)(sizes).is_none() {
            return None;
        }
        (self.add)(&mut scene, sizes);
        // Schemes may not support the term, and scenes may refuse it.
        let added = problem
            .with_scene(scene)
            .ok()?
            .with_generic_layout_for_another(self.parameter())
            .ok()?;
        // The added number must have derivatives in this model.
        added.check_parameter(self.parameter()).ok()?;
        Some(added)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::Sample;
    use crate::fit::measurement::experiment::Experiment;
    use crate::fit::measurement::motion::Observation;

    /// Lens and rolling shutter are no effects of experiments whose samples lack a coordinate that they need.
    #[test]
    fn camera_effects_are_added_where_their_coordinates_were_observed() {
        let problem = Scene::load("data/cantilever.toml").unwrap().problem().unwrap();
        for (position, expected) in [
            ([Some(0.5), Some(-0.1), None], [true, true]),
            ([None, Some(-0.1), None], [true, false]),
            ([Some(0.5), None, None], [false, false]),
        ] {
            let sample = |time: f64| Sample { time, position };
            let data = Observation::new(vec![sample(0.0), sample(0.01)]);
            let sizes = RodSizes::new(&Experiment::new("", &problem).observe(data), &problem);
            let is_added = ["camera.row_delay.y", "camera.distortion"].map(|path| {
                let effect = OMITTED_EFFECTS.iter().find(|effect| effect.path == path).unwrap();
                effect.added(&problem, &sizes).is_some()
            });
            assert_eq!(is_added, expected, "{position:?}");
        }
    }
}
