//! `[[actuation]]`: actuators in the rod, which change its natural strains or pull tendons along it.
//!
//! An actuator of the kind `curvature` adds `gain` times its signal to a natural strain between two arc lengths: a
//! curvature towards a material director (1/m), the twist (rad/m) or the stretch (a strain). A `tendon` has a tension
//! (N) and a route: offsets (m) along both material directors at arc lengths, straight between. Its energy is the
//! tension times the length of the route. Without a signal the values are constants. Rejected, with the key, are places
//! outside the rod, routes of fewer than two points, and routes that do not ascend. Names of signals that the scene
//! does not have, and stretch beside a stretch law that is not linear, are rejected too. `check_actuation` makes these
//! checks, `check_on_rod` that of the places. `actuated_directions` returns the vectors that must lie in the plane of a
//! planar rod.

use crate::error::{Error, ensure};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, cross, scale, sub, unit};
use crate::scene::StretchLaw;
use crate::scene::number::{NumberVisitor, Quantity, SceneNumber};
use crate::scene::plane::KeyedVector;
use crate::scene::signal::{Signal, check_reference};
use crate::scene::table::{NumberTree, TABLE, table};
use serde::{Deserialize, Serialize};

/// Natural strain that an actuator changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum ActuatedStrain {
    /// Curvature towards the first material director, 1/m.
    D1,
    /// Curvature towards the second material director, 1/m.
    D2,
    /// Twist per length, rad/m.
    Twist,
    /// Strain along the rod.
    Stretch,
}

/// Tension of a tendon: a number, N, or the name of a signal with the values in N.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: SceneNumber + schemars::JsonSchema"))]
#[serde(
    untagged,
    bound = "D: SceneNumber",
    expecting = "expected a tension in N, or the name of a signal"
)]
pub enum Tension<D = f64> {
    /// Constant tension, N.
    Constant(D),
    /// Name of the signal whose value is the tension, N.
    Signal(String),
}

table! {
    /// A point of the route of a tendon.
    pub struct RoutePoint {
        /// Arc length from the start of the rod, m.
        pub at: D = Quantity::positive("m").vanishing(),
        /// Offset from the center line along both material directors, m.
        #[serde(deserialize_with = "crate::input::arrays::numbers")]
        pub offset: [D; 2] = Quantity::signed("m"),
    }
}

table! {
    /// `[[actuation]]`: an actuator in the rod.
    pub enum Actuation {
        /// Adds `gain` times the signal to a natural strain of a part of the rod.
        Curvature {
            /// The strain: curvature towards `d1` or `d2`, `twist`, or `stretch`.
            component: ActuatedStrain,
            /// Arc length at which the actuator begins, m; default: 0.
            #[serde(default)]
            from: D = Quantity::positive("m").vanishing(),
            /// Arc length at which it ends, m; default: the length of the rod.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            to: Option<D> = Quantity::positive("m"),
            /// Name of the signal; default: the constant 1.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            signal: Option<String>,
            /// Change of the strain per unit of the signal: 1/m of a curvature, rad/m of the twist, a strain of the
            /// stretch.
            gain: D = Quantity::signed(""),
        },
        /// Pulls a tendon along a route in the rod, attached at its last point.
        Tendon {
            /// Tension: a number, N, or the name of a signal in N.
            tension: Tension<D> = Quantity::positive("N").vanishing(),
            /// Points of the route, two or more by ascending arc length, with straight lines between.
            route: Vec<RoutePoint<D>> = TABLE,
        },
    }
}

/// The tension of a constant tendon is a number of the scene; that of a signal has the numbers of the signal.
impl NumberTree for Tension {
    type Kind = Quantity;
    type Over<D> = Tension<D>;

    /// The constant tension converted by the visitor under the path `key`, or the same name of a signal.
    fn map_numbers<D: From<f64>>(
        &self,
        key: &str,
        quantity: Quantity,
        visitor: &mut NumberVisitor<'_, D>,
    ) -> Tension<D> {
        match self {
            Self::Constant(tension) => Tension::Constant(visitor.number(key, *tension, quantity)),
            Self::Signal(name) => Tension::Signal(name.clone()),
        }
    }

    /// Rejects a constant tension that is not finite or below zero.
    fn check_numbers(&self, key: &str, quantity: Quantity) -> Result<(), Error> {
        match self {
            Self::Constant(tension) => quantity.check(key, *tension),
            Self::Signal(_) => Ok(()),
        }
    }
}

impl<D> Actuation<D> {
    /// Name of the signal that the actuator follows; none for a constant one.
    pub fn signal(&self) -> Option<&str> {
        match self {
            Self::Curvature { signal, .. } => signal.as_deref(),
            Self::Tendon { tension: Tension::Signal(name), .. } => Some(name),
            Self::Tendon { .. } => None,
        }
    }

    /// Whether the actuator is a tendon.
    pub fn is_tendon(&self) -> bool {
        matches!(self, Self::Tendon { .. })
    }
}

impl Actuation {
    /// Rejects the name of a signal that the scene does not have, routes of fewer than two points or that do not
    /// ascend, and an actuator that does not end after it begins. Stretch beside a law of the stretch that is not
    /// linear is rejected too, and so is a constant stretch of -1 or less. `key` is that of the actuator.
    fn check(&self, key: &str, signals: &[Signal], law: StretchLaw) -> Result<(), Error> {
        match self {
            Self::Curvature { component, from, to, signal, gain } => {
                check_reference(signals, signal.as_deref(), key)?;
                let is_constant_stretch = *component == ActuatedStrain::Stretch && signal.is_none();
                let has_length = !is_constant_stretch || *gain > -1.0;
                let allowed = "above -1 of a constant stretch, at which the rod has no length";
                ensure(has_length, format!("{key}.gain"), gain, allowed)?;
                if *component == ActuatedStrain::Stretch && law != StretchLaw::Linear {
                    let allowed = "d1, d2 or twist with a material.stretch_law that is not linear";
                    return Err(Error::invalid(format!("{key}.component"), "stretch", allowed));
                }
                match to {
                    Some(to) if to <= from => {
                        let allowed = format!("an arc length above from, {from} m");
                        Err(Error::invalid(format!("{key}.to"), to, allowed))
                    }
                    _ => Ok(()),
                }
            }
            Self::Tendon { tension, route } => {
                if let Tension::Signal(name) = tension {
                    // The message of a load has the key `signal`, that of a tendon is its tension.
                    let known = signals.iter().map(|signal| &*signal.name);
                    let Some(signal) = signals.iter().find(|signal| signal.name == *name) else {
                        let names = known.collect::<Vec<_>>().join(", ");
                        let allowed = format!("a tension in N, or one of the signals: {names}");
                        let found = format!("{name:?}");
                        return Err(Error::invalid(format!("{key}.tension"), found, allowed));
                    };
                    // A tendon pulls only.
                    if signal.has_negative_values() {
                        let found = format!("the signal {name:?} with values below 0");
                        let allowed = "a signal of 0 N or above: a ramp, a pulse, steps or samples";
                        return Err(Error::invalid(format!("{key}.tension"), found, allowed));
                    }
                }
                let ascends = route.windows(2).all(|pair| pair[0].at < pair[1].at);
                if route.len() < 2 || !ascends {
                    let places: Vec<f64> = route.iter().map(|point| point.at).collect();
                    let allowed = "two points or more with ascending arc lengths at, m";
                    return Err(Error::invalid(
                        format!("{key}.route"),
                        format!("{places:?}"),
                        allowed,
                    ));
                }
                Ok(())
            }
        }
    }

    /// Rejects an actuator that begins at or beyond the end of a rod of a `length`, m, or ends beyond it; `key` is that
    /// of the actuator.
    pub(crate) fn check_on_rod(&self, key: &str, length: f64) -> Result<(), Error> {
        let (names, [first, last]) = match self {
            Self::Curvature { from, to, .. } => (["from", "to"], [*from, to.unwrap_or(*from)]),
            Self::Tendon { route, .. } => (["route"; 2], [route[0].at, route[route.len() - 1].at]),
        };
        let allowed = format!("a beginning from 0 to below {length} m, the length of the rod");
        ensure(first < length, format!("{key}.{}", names[0]), first, allowed)?;
        let allowed = format!("an end up to {length} m, the length of the rod");
        let is_on_rod = last <= length * (1.0 + PLACE_ROUNDING);
        ensure(is_on_rod, format!("{key}.{}", names[1]), last, allowed)
    }
}

/// Fraction of the length by which the end of a route may exceed it, for rounding errors.
const PLACE_ROUNDING: f64 = 1e-9;

/// Rejects the first actuator with invalid numbers, an unknown name of a signal, a route that does not ascend, or an
/// end that is not after its beginning. Stretch is rejected too if `law`, that of the stretch, is not linear.
pub(super) fn check_actuation(
    actuation: &[Actuation],
    signals: &[Signal],
    law: StretchLaw,
) -> Result<(), Error> {
    for (i, actuator) in actuation.iter().enumerate() {
        let key = format!("actuation[{i}]");
        actuator.check_numbers(&key, TABLE)?;
        actuator.check(&key, signals, law)?;
    }
    Ok(())
}

/// Vectors that the plane of a planar rod must contain, with their keys: directions of actuated curvature times the
/// gain, and offsets of routes. Actuated twist and stretch have none. `director` is the first material director of the
/// first edge of `nodes`.
pub(crate) fn actuated_directions<D: Scalar>(
    actuation: &[Actuation<D>],
    nodes: &[Vector<D>],
    director: Vector<D>,
) -> Vec<KeyedVector<D>> {
    let tangent = unit(sub(nodes[1], nodes[0]));
    let second = cross(tangent, director);
    let mut directions = Vec::new();
    for (i, actuator) in actuation.iter().enumerate() {
        match actuator {
            Actuation::Curvature { component, gain, .. } => {
                let axis = match component {
                    ActuatedStrain::D1 => director,
                    ActuatedStrain::D2 => second,
                    ActuatedStrain::Twist | ActuatedStrain::Stretch => continue,
                };
                let key = format!("actuation[{i}].component");
                directions.push(KeyedVector { key, vector: scale(axis, *gain) });
            }
            Actuation::Tendon { route, .. } => {
                for (k, RoutePoint { offset: [first, across], .. }) in route.iter().enumerate() {
                    let vector = add(scale(director, *first), scale(second, *across));
                    let key = format!("actuation[{i}].route[{k}].offset");
                    directions.push(KeyedVector { key, vector });
                }
            }
        }
    }
    directions
}
