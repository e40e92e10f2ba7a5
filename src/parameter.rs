//! The parameters a trajectory can be differentiated by and identified from.

use crate::error::Error;
use crate::scene::along::MOST_PARTS;
use crate::scene::section::{Moments, circle, rectangle};
use crate::scene::{Along, Initial, Scene, Scheme, Section, Time};
use crate::simulation::Damping;
use serde::{Deserialize, Serialize};

/// A physical or numerical parameter of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "&'static str")]
pub enum Parameter {
    /// E, Pa. Holds the shear modulus or Poisson's ratio, whichever the scene gives.
    YoungsModulus,
    /// G, Pa.
    ShearModulus,
    /// Poisson's ratio.
    PoissonRatio,
    /// kg/m^3.
    Density,
    /// Of a circular section, m.
    Radius,
    /// Of a rectangular section, across `up`, m.
    Width,
    /// Of a rectangular section, along `up`, m.
    Height,
    /// Factor on the curvature of the rest shape.
    NaturalCurvature,
    /// The same of one of the parts the scene gives a list for, counted from 1 at the start.
    NaturalCurvatureOf(u8),
    /// Twist per length that the rod has when nothing acts on it, rad/m.
    NaturalTwist,
    /// The same of one of the parts the scene gives a list for, counted from 1 at the start.
    NaturalTwistOf(u8),
    /// Of the Newmark-beta scheme.
    Beta,
    /// Mass-proportional damping, 1/s.
    DampingMass,
    /// Kelvin-Voigt time, s.
    DampingStiffness,
    /// By how much the rod as a whole is turned about its first node in its plane, rad.
    ClampAngle,
    /// Velocity of the rod at t = 0 along x, m/s.
    InitialVelocityX,
    /// The same along y.
    InitialVelocityY,
    /// The same along z.
    InitialVelocityZ,
    /// Angular velocity of the rod at t = 0 about x, rad/s.
    InitialAngularVelocityX,
    /// The same about y.
    InitialAngularVelocityY,
    /// The same about z.
    InitialAngularVelocityZ,
    /// What the recording's clock shows when the motion starts, s.
    TimeOffset,
    /// Recorded over real lengths.
    PixelScale,
    /// Of the camera about the normal of the scene's plane, rad.
    InPlaneRotation,
    /// Where the clamp is recorded, less where it is in the scene, along x, m.
    ClampPositionX,
    /// The same along y.
    ClampPositionY,
    /// The same along z.
    ClampPositionZ,
}

/// Names of the parameters of parts.
macro_rules! of_parts {
    ($name:literal) => {
        of_parts!($name, 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16)
    };
    ($name:literal, $($part:literal)*) => {
        [$(concat!($name, ".", $part)),*]
    };
}
const CURVATURES: [&str; MOST_PARTS] = of_parts!("natural_curvature");
const TWISTS: [&str; MOST_PARTS] = of_parts!("natural_twist");

fn of_part(names: [&'static str; MOST_PARTS], part: u8) -> &'static str {
    names.get(usize::from(part).wrapping_sub(1)).copied().unwrap_or("of no part")
}

impl Parameter {
    /// All parameters there are.
    pub fn all() -> impl Iterator<Item = Self> {
        let whole = [
            Self::YoungsModulus,
            Self::ShearModulus,
            Self::PoissonRatio,
            Self::Density,
            Self::Radius,
            Self::Width,
            Self::Height,
            Self::NaturalCurvature,
            Self::NaturalTwist,
            Self::Beta,
            Self::DampingMass,
            Self::DampingStiffness,
            Self::ClampAngle,
            Self::InitialVelocityX,
            Self::InitialVelocityY,
            Self::InitialVelocityZ,
            Self::InitialAngularVelocityX,
            Self::InitialAngularVelocityY,
            Self::InitialAngularVelocityZ,
            Self::TimeOffset,
            Self::PixelScale,
            Self::InPlaneRotation,
            Self::ClampPositionX,
            Self::ClampPositionY,
            Self::ClampPositionZ,
        ];
        let parts = 1..=MOST_PARTS as u8;
        let curvatures = parts.clone().map(Self::NaturalCurvatureOf);
        whole.into_iter().chain(curvatures).chain(parts.map(Self::NaturalTwistOf))
    }

    /// The name in files and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::YoungsModulus => "youngs_modulus",
            Self::ShearModulus => "shear_modulus",
            Self::PoissonRatio => "poisson_ratio",
            Self::Density => "density",
            Self::Radius => "radius",
            Self::Width => "width",
            Self::Height => "height",
            Self::NaturalCurvature => "natural_curvature",
            Self::NaturalCurvatureOf(part) => of_part(CURVATURES, part),
            Self::NaturalTwist => "natural_twist",
            Self::NaturalTwistOf(part) => of_part(TWISTS, part),
            Self::Beta => "beta",
            Self::DampingMass => "damping.mass",
            Self::DampingStiffness => "damping.stiffness",
            Self::ClampAngle => "clamp_angle",
            Self::InitialVelocityX => "initial.velocity.x",
            Self::InitialVelocityY => "initial.velocity.y",
            Self::InitialVelocityZ => "initial.velocity.z",
            Self::InitialAngularVelocityX => "initial.angular_velocity.x",
            Self::InitialAngularVelocityY => "initial.angular_velocity.y",
            Self::InitialAngularVelocityZ => "initial.angular_velocity.z",
            Self::TimeOffset => "time_offset",
            Self::PixelScale => "pixel_scale",
            Self::InPlaneRotation => "in_plane_rotation",
            Self::ClampPositionX => "clamp_position.x",
            Self::ClampPositionY => "clamp_position.y",
            Self::ClampPositionZ => "clamp_position.z",
        }
    }

    /// The unit, empty for pure numbers.
    pub fn unit(self) -> &'static str {
        match self {
            Self::YoungsModulus | Self::ShearModulus => "Pa",
            Self::Density => "kg/m^3",
            Self::Radius | Self::Width | Self::Height => "m",
            Self::NaturalTwist | Self::NaturalTwistOf(_) => "rad/m",
            Self::DampingMass => "1/s",
            Self::DampingStiffness | Self::TimeOffset => "s",
            Self::InPlaneRotation | Self::ClampAngle => "rad",
            Self::InitialVelocityX | Self::InitialVelocityY | Self::InitialVelocityZ => "m/s",
            Self::InitialAngularVelocityX
            | Self::InitialAngularVelocityY
            | Self::InitialAngularVelocityZ => "rad/s",
            Self::ClampPositionX | Self::ClampPositionY | Self::ClampPositionZ => "m",
            Self::PoissonRatio
            | Self::NaturalCurvature
            | Self::NaturalCurvatureOf(_)
            | Self::Beta
            | Self::PixelScale => "",
        }
    }

    /// Whether the parameter is positive and therefore identified in its logarithm.
    pub fn is_positive(self) -> bool {
        !matches!(
            self,
            Self::PoissonRatio
                | Self::NaturalCurvature
                | Self::NaturalCurvatureOf(_)
                | Self::NaturalTwist
                | Self::NaturalTwistOf(_)
                | Self::Beta
                | Self::ClampAngle
                | Self::InitialVelocityX
                | Self::InitialVelocityY
                | Self::InitialVelocityZ
                | Self::InitialAngularVelocityX
                | Self::InitialAngularVelocityY
                | Self::InitialAngularVelocityZ
                | Self::TimeOffset
                | Self::InPlaneRotation
                | Self::ClampPositionX
                | Self::ClampPositionY
                | Self::ClampPositionZ
        )
    }

    /// Whether it is a velocity at t = 0.
    pub fn is_initial_velocity(self) -> bool {
        matches!(
            self,
            Self::InitialVelocityX
                | Self::InitialVelocityY
                | Self::InitialVelocityZ
                | Self::InitialAngularVelocityX
                | Self::InitialAngularVelocityY
                | Self::InitialAngularVelocityZ
        )
    }

    /// Whether only the recording depends on it, and not the motion.
    pub fn is_of_the_camera(self) -> bool {
        matches!(
            self,
            Self::TimeOffset
                | Self::PixelScale
                | Self::InPlaneRotation
                | Self::ClampPositionX
                | Self::ClampPositionY
                | Self::ClampPositionZ
        )
    }

    /// Smallest and largest value the parameter may take at all.
    pub fn limits(self) -> [f64; 2] {
        match self {
            Self::Beta => [0.5, 1.0],
            Self::PoissonRatio => [-1.0 + 1e-9, 0.5],
            Self::NaturalCurvature | Self::NaturalCurvatureOf(_) => [-1e3, 1e3],
            Self::NaturalTwist | Self::NaturalTwistOf(_) => [-1e6, 1e6],
            Self::TimeOffset => [-1e6, 1e6],
            Self::InPlaneRotation | Self::ClampAngle => {
                [-std::f64::consts::PI, std::f64::consts::PI]
            }
            Self::ClampPositionX | Self::ClampPositionY | Self::ClampPositionZ => [-1e6, 1e6],
            Self::InitialVelocityX
            | Self::InitialVelocityY
            | Self::InitialVelocityZ
            | Self::InitialAngularVelocityX
            | Self::InitialAngularVelocityY
            | Self::InitialAngularVelocityZ => [-1e6, 1e6],
            _ => [f64::MIN_POSITIVE, f64::MAX],
        }
    }

    /// The parameter's value in a scene, if the scene has one.
    pub fn of(self, scene: &Scene) -> Option<f64> {
        match self {
            Self::YoungsModulus => Some(scene.material.youngs_modulus),
            Self::ShearModulus => scene.material.shear_modulus,
            Self::PoissonRatio => scene.material.poisson_ratio,
            Self::Density => Some(scene.material.density),
            Self::Radius => match scene.rod.section {
                Section::Circle { radius } => Some(radius),
                _ => None,
            },
            Self::Width => match scene.rod.section {
                Section::Rectangle { width, .. } => Some(width),
                _ => None,
            },
            Self::Height => match scene.rod.section {
                Section::Rectangle { height, .. } => Some(height),
                _ => None,
            },
            Self::NaturalCurvature => scene.rod.natural_curvature.whole(),
            Self::NaturalCurvatureOf(part) => scene.rod.natural_curvature.part(part),
            Self::NaturalTwist => scene.rod.natural_twist.whole(),
            Self::NaturalTwistOf(part) => scene.rod.natural_twist.part(part),
            Self::Beta => {
                let newmark = |time: &&Time| time.scheme == Scheme::NewmarkBeta;
                scene.time.as_ref().filter(newmark).map(|time| time.beta)
            }
            Self::DampingMass => Some(scene.loads.damping.mass),
            Self::DampingStiffness => Some(scene.loads.damping.stiffness),
            Self::ClampAngle => in_world_axes(scene).is_empty().then_some(scene.supports.angle),
            Self::InitialVelocityX => moving(scene).map(|initial| initial.velocity[0]),
            Self::InitialVelocityY => moving(scene).map(|initial| initial.velocity[1]),
            Self::InitialVelocityZ => moving(scene).map(|initial| initial.velocity[2]),
            Self::InitialAngularVelocityX => {
                moving(scene).map(|initial| initial.angular_velocity[0])
            }
            Self::InitialAngularVelocityY => {
                moving(scene).map(|initial| initial.angular_velocity[1])
            }
            Self::InitialAngularVelocityZ => {
                moving(scene).map(|initial| initial.angular_velocity[2])
            }
            Self::TimeOffset => Some(scene.camera.time_offset),
            Self::PixelScale => Some(scene.camera.pixel_scale),
            Self::InPlaneRotation => Some(scene.camera.in_plane_rotation),
            Self::ClampPositionX => Some(scene.camera.clamp_position[0]),
            Self::ClampPositionY => Some(scene.camera.clamp_position[1]),
            Self::ClampPositionZ => Some(scene.camera.clamp_position[2]),
        }
    }

    /// Puts a value into a scene.
    pub fn set(self, scene: &mut Scene, value: f64) -> Result<(), Error> {
        let slot = match self {
            Self::YoungsModulus => Some(&mut scene.material.youngs_modulus),
            Self::ShearModulus => scene.material.shear_modulus.as_mut(),
            Self::PoissonRatio => scene.material.poisson_ratio.as_mut(),
            Self::Density => Some(&mut scene.material.density),
            Self::Radius => match &mut scene.rod.section {
                Section::Circle { radius } => Some(radius),
                _ => None,
            },
            Self::Width => match &mut scene.rod.section {
                Section::Rectangle { width, .. } => Some(width),
                _ => None,
            },
            Self::Height => match &mut scene.rod.section {
                Section::Rectangle { height, .. } => Some(height),
                _ => None,
            },
            Self::NaturalCurvature => scene.rod.natural_curvature.whole_mut(),
            Self::NaturalCurvatureOf(part) => scene.rod.natural_curvature.part_mut(part),
            Self::NaturalTwist => scene.rod.natural_twist.whole_mut(),
            Self::NaturalTwistOf(part) => scene.rod.natural_twist.part_mut(part),
            Self::Beta => scene.time.as_mut().map(|time| &mut time.beta),
            Self::DampingMass => Some(&mut scene.loads.damping.mass),
            Self::DampingStiffness => Some(&mut scene.loads.damping.stiffness),
            Self::ClampAngle => Some(&mut scene.supports.angle),
            Self::InitialVelocityX => Some(&mut scene.initial.velocity[0]),
            Self::InitialVelocityY => Some(&mut scene.initial.velocity[1]),
            Self::InitialVelocityZ => Some(&mut scene.initial.velocity[2]),
            Self::InitialAngularVelocityX => Some(&mut scene.initial.angular_velocity[0]),
            Self::InitialAngularVelocityY => Some(&mut scene.initial.angular_velocity[1]),
            Self::InitialAngularVelocityZ => Some(&mut scene.initial.angular_velocity[2]),
            Self::TimeOffset => Some(&mut scene.camera.time_offset),
            Self::PixelScale => Some(&mut scene.camera.pixel_scale),
            Self::InPlaneRotation => Some(&mut scene.camera.in_plane_rotation),
            Self::ClampPositionX => Some(&mut scene.camera.clamp_position[0]),
            Self::ClampPositionY => Some(&mut scene.camera.clamp_position[1]),
            Self::ClampPositionZ => Some(&mut scene.camera.clamp_position[2]),
        };
        match slot {
            Some(slot) => *slot = value,
            None => return Err(self.absent(scene)),
        }
        Ok(())
    }

    /// The error for a parameter the scene does not have.
    pub fn absent(self, scene: &Scene) -> Error {
        let mut found = self.name().to_string();
        let allowed = match self {
            Self::Radius => "with a circular section".into(),
            Self::Width | Self::Height => "with a rectangular section".into(),
            Self::ShearModulus | Self::PoissonRatio => "with its key in [material]".into(),
            Self::NaturalCurvature | Self::NaturalTwist => {
                format!(
                    "with one number there, not a list, whose parts are {found}.1, {found}.2, .."
                )
            }
            Self::NaturalCurvatureOf(part) | Self::NaturalTwistOf(part) => {
                format!("with a list of {part} numbers or more there")
            }
            Self::Beta => "with [time] and the scheme newmark-beta".into(),
            Self::ClampAngle => {
                let other = in_world_axes(scene);
                let found_beside = if other.is_empty() { vec!["a scene in space"] } else { other };
                found += &format!(" beside {}", found_beside.join(", "));
                "in planar scenes where only the weight is given in the axes of the world".into()
            }
            parameter if parameter.is_initial_velocity() => "with a [time]".into(),
            _ => "a parameter the scene has".into(),
        };
        Error::invalid("parameter", found, allowed)
    }
}

/// What a scene gives in the axes of the world beside its weight, and would have to be turned with
/// the rod.
fn in_world_axes(scene: &Scene) -> Vec<&'static str> {
    let given = [
        ("loads.point", !scene.loads.point.is_empty()),
        ("initial.point", !scene.initial.point.is_empty()),
        ("initial.shape", scene.initial.shape.is_some()),
        ("supports.motion", !scene.supports.motion.is_empty()),
        ("supports.roller", scene.supports.roller.is_some()),
    ];
    given.into_iter().filter_map(|(key, given)| given.then_some(key)).collect()
}

/// The start of a scene that is to move.
fn moving(scene: &Scene) -> Option<&Initial> {
    scene.time.as_ref().map(|_| &scene.initial)
}

impl From<Parameter> for &'static str {
    fn from(parameter: Parameter) -> Self {
        parameter.name()
    }
}

impl TryFrom<String> for Parameter {
    type Error = String;

    fn try_from(name: String) -> Result<Self, String> {
        Self::all().find(|parameter| parameter.name() == name).ok_or_else(|| {
            let of_parts = |p: &Self| matches!(p, Self::NaturalCurvatureOf(_) | Self::NaturalTwistOf(_));
            let names: Vec<&str> = Self::all().filter(|p| !of_parts(p)).map(Self::name).collect();
            let names = names.join(", ");
            format!(
                "unknown parameter {name:?}, allowed: {names}, and natural_curvature.1, natural_twist.1, .. \
                 of the parts of a list"
            )
        })
    }
}

impl std::fmt::Display for Parameter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// A number per part of the rod: see [`Along`].
#[derive(Clone, Copy, Debug)]
pub struct PerPart<D> {
    values: [D; MOST_PARTS],
    count: usize,
}

impl<D: crate::Scalar> PerPart<D> {
    fn new(
        along: &Along,
        whole: Parameter,
        part: impl Fn(u8) -> Parameter,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Self {
        let mut values = [D::from(0.0); MOST_PARTS];
        let given = along.values();
        for ((value, given), number) in values.iter_mut().zip(given).zip(1..) {
            *value = seed(if along.whole().is_some() { whole } else { part(number) }, *given);
        }
        Self { values, count: given.len().min(MOST_PARTS) }
    }

    /// The number at a place, given as a part of the rod's length. Where two parts meet, the second's.
    pub fn at(&self, place: f64) -> D {
        // Rounding errors of arc lengths do not count.
        let part = (place * self.count as f64 + 1e-9).max(0.0) as usize;
        self.values[part.min(self.count.saturating_sub(1))]
    }
}

/// The numbers of a scene that a simulation depends on differentiably.
#[derive(Clone, Copy, Debug)]
pub struct Properties<D> {
    /// E, Pa.
    pub youngs_modulus: D,
    /// G, Pa; zero when the scene gives neither it nor Poisson's ratio, as planar ones need not.
    pub shear_modulus: D,
    /// kg/m^3.
    pub density: D,
    /// m^2.
    pub area: D,
    /// Second moments of area in the plane of `up` and across it, m^4.
    pub second_moments: [D; 2],
    /// J, m^4.
    pub torsion_constant: D,
    /// Factor on the curvature of the rest shape.
    pub natural_curvature: PerPart<D>,
    /// Natural twist per length, rad/m.
    pub natural_twist: PerPart<D>,
    /// How much further than the scene says the rod is turned: zero, with derivatives, rad.
    pub clamp_angle: D,
    /// Velocity at t = 0 in world axes, m/s.
    pub velocity: [D; 3],
    /// Angular velocity at t = 0 in world axes, rad/s.
    pub angular_velocity: [D; 3],
    /// Both dampings.
    pub damping: Damping<D>,
    /// Of the scheme.
    pub beta: D,
}

impl<D: crate::Scalar> Properties<D> {
    /// Reads the numbers, each as `seed` makes it of its parameter and value: `|_, v| v` for plain
    /// numbers, or a dual number with a derivative where the parameter is the one asked for.
    pub fn of(scene: &Scene, seed: impl Fn(Parameter, f64) -> D) -> Self {
        let Moments { area, second_moments, torsion_constant } = match scene.rod.section {
            Section::Circle { radius } => circle(seed(Parameter::Radius, radius)),
            Section::Rectangle { width, height, .. } => {
                rectangle(seed(Parameter::Width, width), seed(Parameter::Height, height))
            }
            Section::Custom { area, i1, i2, j, .. } => Moments {
                area: D::from(area),
                second_moments: [i1, i2].map(D::from),
                torsion_constant: D::from(j),
            },
        };
        let youngs_modulus = seed(Parameter::YoungsModulus, scene.material.youngs_modulus);
        let shear_modulus = match (scene.material.shear_modulus, scene.material.poisson_ratio) {
            (Some(modulus), _) => seed(Parameter::ShearModulus, modulus),
            (None, Some(ratio)) => {
                youngs_modulus / ((seed(Parameter::PoissonRatio, ratio) + 1.0) * 2.0)
            }
            (None, None) => D::from(0.0),
        };
        Self {
            youngs_modulus,
            shear_modulus,
            density: seed(Parameter::Density, scene.material.density),
            area,
            second_moments,
            torsion_constant,
            natural_curvature: {
                use Parameter::{NaturalCurvature, NaturalCurvatureOf};
                PerPart::new(
                    &scene.rod.natural_curvature,
                    NaturalCurvature,
                    NaturalCurvatureOf,
                    &seed,
                )
            },
            natural_twist: {
                use Parameter::{NaturalTwist, NaturalTwistOf};
                PerPart::new(&scene.rod.natural_twist, NaturalTwist, NaturalTwistOf, &seed)
            },
            clamp_angle: {
                let angle = scene.supports.angle;
                seed(Parameter::ClampAngle, angle) - D::from(angle)
            },
            velocity: {
                let [x, y, z] = scene.initial.velocity;
                [
                    seed(Parameter::InitialVelocityX, x),
                    seed(Parameter::InitialVelocityY, y),
                    seed(Parameter::InitialVelocityZ, z),
                ]
            },
            angular_velocity: {
                let [x, y, z] = scene.initial.angular_velocity;
                [
                    seed(Parameter::InitialAngularVelocityX, x),
                    seed(Parameter::InitialAngularVelocityY, y),
                    seed(Parameter::InitialAngularVelocityZ, z),
                ]
            },
            damping: Damping {
                mass: seed(Parameter::DampingMass, scene.loads.damping.mass),
                stiffness: seed(Parameter::DampingStiffness, scene.loads.damping.stiffness),
            },
            beta: seed(Parameter::Beta, scene.time.as_ref().map_or(0.5, |time| time.beta)),
        }
    }
}
