//! Warnings about valid scenes that are probably not intended: numbers in other units than SI, and a rod without
//! gravity or other load.
//!
//! `Problem::plausibility_notes` returns codes and texts for a [`Purpose`] (motion, equilibrium, modes), empty for a
//! plausible scene. First is one text of all implausible numbers, each with the likely unit (g/cm^3, MPa, mm). Density,
//! Young's modulus, thickness, length, their ratio, gravity, angles, attached masses and routes of tendons are compared
//! with the constants of this module. Above the densities of [`SOFTEST_OF_DENSITY`] a larger modulus is required.
//! Second: the scene file leaves out gravity and nothing else acts on its rod. Loads, flow, motions, recordings,
//! user-defined energies, actuators, initial shapes and stress at rest count as actions; for a motion also an initial
//! velocity. There is no such warning for modes, or for a straight rod within 10 degrees of the y or z axis. Third: a
//! given mesh that is too coarse for the natural curvature. Fourth: forces on held nodes only. Fifth: a rod that is too
//! thick for the model, unless units are implausible. Last, for equilibria and modes (`notes_at_rest`): friction of the
//! rod or of a contact, which they do not have, and signals that are zero at the time of the equilibrium.

use crate::code::Code;
use crate::numerics::vector::{dot, sub};
use crate::problem::{Problem, with_model};
use crate::scene::{Actuation, Contact, InitialState, PointForce, Scene, Section, Shape};

/// Smallest density of a solid, kg/m^3; only aerogels are lighter.
const LIGHTEST_SOLID: f64 = 10.0;
/// Largest density of a solid, kg/m^3 (osmium has 22590).
const HEAVIEST_SOLID: f64 = 23e3;
/// Young's modulus of the softest gels that hold the shape of a rod, Pa.
const SOFTEST_SOLID: f64 = 1e3;
/// Young's modulus above that of all solids, Pa; diamond has 1.2e12.
const STIFFEST_SOLID: f64 = 1.3e12;
/// Pairs of a density, kg/m^3, and the smallest Young's modulus of denser materials, Pa, the largest density first.
/// Silicone has 1e5 Pa at 1200 kg/m^3 and, filled with iron, at 2400; rubber with magnetic powder 1e6 Pa at 4000;
/// metals have more than 1e9 Pa, lead, the softest of them, 1.6e10.
const SOFTEST_OF_DENSITY: [[f64; 2]; 3] = [[7000.0, 1e9], [4000.0, 1e7], [2400.0, 5e4]];
/// Densities above this, kg/m^3, are those of metals, glass or composites, whose moduli are given in GPa.
const GIVEN_IN_GIGAPASCALS: f64 = 1500.0;
/// Radius or width beyond those of rods, m; larger ones are probably given in mm.
const THICKEST: f64 = 1.0;
/// Length beyond those of rods, m; larger ones are probably given in mm.
const LONGEST: f64 = 1e3;
/// Largest length over thickness: a hair of 1 m has 14 000, a length in mm beside a thickness in m a thousand times
/// that of a usual rod.
const MOST_SLENDER: f64 = 5e4;
/// Largest plausible gravity, m/s^2: fifty times that of the earth, which is 9810 in mm/s^2 and 981 in cm/s^2.
const STRONGEST_GRAVITY: f64 = 500.0;
/// Largest plausible angle of an arc, a clamp or a phase, rad: a full turn.
const LARGEST_ANGLE: f64 = std::f64::consts::TAU;
/// Largest plausible attached mass over the mass of the rod: a bob of 1 kg on a steel wire of 1 m has 160.
const HEAVIEST_MASS: f64 = 500.0;
/// Weight over bending stiffness, `w L^3/(E I)`, above which it is noticeable: the modulus from a motion of a hanging
/// rod is off by about an eighth of it.
const NOTICEABLE_WEIGHT: f64 = 0.1;
/// Cosine of the largest angle between a vertical rod and its axis: 10 degrees.
const VERTICAL: f64 = 0.985;

/// Computation for which a scene is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// A motion.
    Motion,
    /// The equilibrium.
    Rest,
    /// Frequencies of small vibrations, which need no load.
    Modes,
}

/// Text about the first of these contacts that has friction, which equilibria and modes do not have; `None` without
/// one.
pub(crate) fn ignored_friction(contacts: &[Contact]) -> Option<String> {
    let rough = contacts.iter().position(Contact::has_friction)?;
    Some(format!(
        "the friction of contacts[{rough}] is ignored in equilibria and modes: the rod slides freely along the obstacle. \
         Simulate the motion with [time] for friction"
    ))
}

impl Problem {
    /// Whether numbers of the scene appear to be in other units than SI, or are those of no material.
    pub(crate) fn has_implausible_units(&self) -> bool {
        units(&self.scene, self.length()).is_some()
    }

    /// Whether Young's modulus is that of no solid, or of none with this density, or the density that of no solid. The
    /// latter counts for motions, modes and equilibria with gravity, on which it has an effect.
    pub(crate) fn has_implausible_material(&self, purpose: Purpose) -> bool {
        let (modulus, density) = (self.scene.material.youngs_modulus, self.scene.material.density);
        let has_mass = purpose != Purpose::Rest || self.scene.loads.gravity != [0.0; 3];
        !(softest_solid(density)..=STIFFEST_SOLID).contains(&modulus)
            || has_mass && !(LIGHTEST_SOLID..=HEAVIEST_SOLID).contains(&density)
    }

    /// Warnings, each with its code, first of implausible units (one for all numbers), then of missing gravity for the
    /// `purpose`. Then come a given mesh that is too coarse for the natural curvature, forces on held nodes, and a
    /// thick rod. Last, unless for a motion, are those of [`Self::notes_at_rest`]. Empty for a plausible scene.
    pub(crate) fn plausibility_notes(&self, purpose: Purpose) -> Vec<(Code, String)> {
        let units = units(&self.scene, self.length()).map(|words| (Code::ImplausibleUnits, words));
        let gravity = self.lacks_gravity(purpose).then(|| {
            let words = "the scene gives no gravity, and nothing else acts on the rod: it stays in its rest shape. \
                         Write [loads] gravity = [0, -9.81, 0], or [0, 0, 0] if none is meant";
            (Code::NoGravity, words.to_string())
        });
        let gravity = gravity.or_else(|| self.heavy_without_gravity(purpose));
        let at_rest = (purpose != Purpose::Motion).then(|| self.notes_at_rest());
        let mesh = self.natural_turn_note().into_iter().chain(self.held_load_note());
        let thickness = self.thickness_note().filter(|_| units.is_none());
        let first = units.into_iter().chain(gravity).chain(mesh).chain(thickness);
        first.chain(at_rest.into_iter().flatten()).collect()
    }

    /// Warning of forces of `loads.point` and `initial.point` on nodes that supports at the ends hold, which do not
    /// move the rod. Forces with a moment, and zero forces, are left out. `None` without any.
    fn held_load_note(&self) -> Option<(Code, String)> {
        let is_held = |load: &PointForce| {
            let nodes = self.stencil(load.node).map(|stencil| stencil.nodes).unwrap_or_default();
            let mut acting = nodes.iter().filter(|(_, weight)| *weight != 0.0);
            load.force != [0.0; 3]
                && load.moment == [0.0; 3]
                && !nodes.is_empty()
                && acting.all(|(node, _)| with_model!(self, |discretized| discretized.holds(*node)))
        };
        let lists = [("loads", &self.scene.loads.point), ("initial", &self.scene.initial.point)];
        let keys: Vec<String> = lists
            .into_iter()
            .flat_map(|(table, loads)| loads.iter().enumerate().map(move |own| (table, own)))
            .filter(|(_, (_, load))| is_held(load))
            .map(|(table, (k, _))| format!("{table}.point[{k}]"))
            .collect();
        let words = format!(
            "the force of {} acts on nodes that a support holds, and does not move the rod. Check the point of the load, \
             or take more segments, so that it is on free nodes",
            keys.join(", ")
        );
        (!keys.is_empty()).then_some((Code::LoadOnHeldNode, words))
    }

    /// Warnings of equilibria and modes, with codes: friction of the rod or of a contact, which they do not have, and
    /// loads whose signals are zero at the time of the equilibrium.
    pub(crate) fn notes_at_rest(&self) -> impl Iterator<Item = (Code, String)> {
        self.frictionless_note().into_iter().chain(self.zero_signals_note())
    }

    /// Warning of loads and actuators whose signals are zero at `loads.at_time`; `None` without any. Signals with a
    /// gain of zero are left out.
    fn zero_signals_note(&self) -> Option<(Code, String)> {
        let scene = &self.scene;
        let time = scene.loads.at_time;
        let is_zero = |name: &str| {
            let signal = scene.signals.iter().find(|signal| signal.name == name);
            signal.is_some_and(|own| own.gain != 0.0 && own.curve().value(time) == 0.0)
        };
        let point = scene.loads.point.iter().map(|load| load.signal.as_deref());
        let line = scene.loads.line.iter().map(|load| load.signal.as_deref());
        let actuation = scene.actuation.iter().map(Actuation::signal);
        let keys = |table: &'static str, names: &mut dyn Iterator<Item = Option<&str>>| {
            let zero = names.enumerate().filter(|(_, name)| name.is_some_and(is_zero));
            zero.map(|(k, _)| format!("{table}[{k}]")).collect::<Vec<_>>()
        };
        let mut list = keys("loads.point", &mut { point });
        list.extend(keys("loads.line", &mut { line }));
        list.extend(keys("actuation", &mut { actuation }));
        let words = format!(
            "the signal of {} is zero at loads.at_time = {time} s, so that it has no effect in equilibria and modes. Set \
             loads.at_time to the time of interest, or remove `signal` for a constant load",
            list.join(", ")
        );
        (!list.is_empty()).then_some((Code::NoLoadAtTime, words))
    }

    /// Warning of an equilibrium or modes of a scene with friction, of a contact or in the rod, which they do not have;
    /// `None` without friction.
    fn frictionless_note(&self) -> Option<(Code, String)> {
        let contact = ignored_friction(&self.scene.contacts);
        let rod = self.scene.loads.damping.friction.map(|friction| {
            format!(
                "equilibria and modes are without loads.damping.friction, whose springs resist up to their slip: at small \
                 curvatures the rod is {:.3} times as stiff, with frequencies {:.3} times as high, and it rests where its \
                 motion ends. Simulate the motion with [time] for friction",
                1.0 + friction.stiffness,
                (1.0 + friction.stiffness).sqrt()
            )
        });
        let words: Vec<String> = rod.into_iter().chain(contact).collect();
        (!words.is_empty()).then(|| (Code::Frictionless, words.join(". ")))
    }

    /// Whether the file gives no gravity and nothing else moves the rod: no load, flow, support motion, recording,
    /// user-defined energy, actuator, or initial shape. Stress in the rest shape counts too, and for a motion an
    /// initial velocity, a recorded start or a moved obstacle. False for a vertical rod and for modes, which need no
    /// load.
    fn lacks_gravity(&self, purpose: Purpose) -> bool {
        let scene = &self.scene;
        let initial = &scene.initial;
        let starts = match purpose {
            Purpose::Motion => initial.state == InitialState::Recorded || initial.moves(),
            Purpose::Rest => false,
            Purpose::Modes => return false,
        };
        // Anything that moves the rod makes a missing gravity plausible.
        let acts = |load: &PointForce| load.force != [0.0; 3] || load.moment != [0.0; 3];
        let driven = starts
            || (purpose == Purpose::Motion && scene.has_moved_obstacles())
            || initial.shape.is_some()
            || initial.point.iter().any(acts)
            || scene.loads.point.iter().any(acts)
            || scene.loads.line.iter().any(|load| load.force != [0.0; 3])
            || scene.loads.have_flow()
            || !scene.supports.motion.is_empty()
            || scene.supports.path.is_some()
            || !scene.energies.is_empty()
            || !scene.actuation.is_empty()
            || !scene.rod.is_unstressed();
        scene.gravity_left_out && scene.loads.gravity == [0.0; 3] && !driven && !self.is_vertical()
    }

    /// Warning of a file that gives no gravity, for a rod that its weight would bend or stiffen noticeably: `w L^3/(E
    /// I)` above [`NOTICEABLE_WEIGHT`], with the weight `w` per length and the smaller `I`, halfway along the rod.
    /// `None` for modes, and where a recording or a fluid determines the motion.
    fn heavy_without_gravity(&self, purpose: Purpose) -> Option<(Code, String)> {
        let scene = &self.scene;
        let is_followed = scene.supports.path.is_some() || scene.loads.have_flow();
        if !scene.gravity_left_out
            || scene.loads.gravity != [0.0; 3]
            || purpose == Purpose::Modes
            || is_followed
        {
            return None;
        }
        let (section, material) = scene.at(0.5);
        let moments = section.moments();
        let [i1, i2] = moments.second_moments;
        let weight = 9.81 * material.density * moments.area;
        let relative = weight * self.length().powi(3) / (material.youngs_modulus * i1.min(i2));
        let words = format!(
            "the scene gives no gravity, so that the rod has no weight. That would be noticeable: w L^3/(E I) is \
             {relative:.2}, for the weight w per length. Write [loads] gravity = [0, -9.81, 0], or [0, 0, 0] if none is \
             meant"
        );
        (relative > NOTICEABLE_WEIGHT).then_some((Code::NoGravity, words))
    }

    /// Whether the rod at rest, rotated by `supports.angle`, is straight and within 10 degrees of the y or the z axis
    /// ([`VERTICAL`]), either of which points up in scenes. False for other shapes.
    fn is_vertical(&self) -> bool {
        if !matches!(self.scene.rod.shape, Shape::Straight { .. }) {
            return false;
        }
        let nodes = self.rest_positions();
        let edge = sub(nodes[1], nodes[0]);
        edge[1].abs().max(edge[2].abs()) > VERTICAL * dot(edge, edge).sqrt()
    }
}

/// Whether a mass that is attached to rods is probably in another unit; `rods` is the mass of these, in the same unit.
pub(crate) fn is_implausible_mass(mass: f64, rods: f64) -> bool {
    mass > HEAVIEST_MASS * rods
}

/// Young's modulus of the softest solids of a density, Pa.
fn softest_solid(density: f64) -> f64 {
    let least = SOFTEST_OF_DENSITY.iter().find(|[above, _]| density > *above);
    least.map_or(SOFTEST_SOLID, |[_, modulus]| *modulus)
}

/// Message about all numbers that appear to be in other units than SI, each with its value and the likely unit.
/// Compared with the constants of this module are density, Young's modulus, thickness, length, gravity, angles,
/// attached masses (with the mass of the rod) and offsets of tendons (with the length). The modulus is also compared
/// with the least of its density, the thickness with the length, and the length with the thickness. The section is that
/// without taper. None if all are plausible. `length` is that of the rod, m.
fn units(scene: &Scene, length: f64) -> Option<String> {
    let mut found = Vec::new();
    let mut add = |key: &str, value: f64, unit: &str, guess: &str| {
        // Four digits: fitted values have more than they mean.
        let rounded = format!("{value:.3e}").parse().unwrap_or(value);
        found.push(format!("{key} of {rounded} {unit} (in {guess}?)"));
    };
    let (density, modulus) = (scene.material.density, scene.material.youngs_modulus);
    // Each size is compared with a range that no rod exceeds; the guess is the unit that is most
    // often confused.
    if density < LIGHTEST_SOLID {
        add("material.density", density, "kg/m^3", "g/cm^3");
    } else if density > HEAVIEST_SOLID {
        add("material.density", density, "kg/m^3", "g/m^3");
    }
    if modulus < SOFTEST_SOLID {
        // Moduli of dense materials are given in GPa in data sheets, those of light ones in MPa.
        let gigapascals = density > GIVEN_IN_GIGAPASCALS;
        add("material.youngs_modulus", modulus, "Pa", if gigapascals { "GPa" } else { "MPa" });
    } else if modulus < softest_solid(density) {
        add("material.youngs_modulus", modulus, "Pa, softer than solids of this density", "MPa");
    } else if modulus > STIFFEST_SOLID {
        add("material.youngs_modulus", modulus, "Pa, stiffer than diamond", "another unit");
    }
    let sizes = match &scene.rod.section {
        Section::Circle { radius } | Section::Tube { radius, .. } => [2.0 * radius; 2],
        Section::Rectangle { width, height, .. } => [*width, *height],
        Section::Custom { area, .. } => [area.sqrt(); 2],
    };
    let (thickest, thinnest) = (sizes[0].max(sizes[1]), sizes[0].min(sizes[1]));
    if thickest > THICKEST || thinnest > length {
        add("rod.section", thickest, "m", "mm");
    }
    if length > LONGEST || length > MOST_SLENDER * thinnest {
        add("rod.shape", length, "m", "mm");
    }
    let gravity = scene.loads.gravity.iter().map(|g| g * g).sum::<f64>().sqrt();
    if gravity > STRONGEST_GRAVITY {
        add("loads.gravity", gravity, "m/s^2", "mm/s^2");
    }
    // Angles beyond a full turn are those of coils; a phase beyond it has no meaning of its own.
    let angles = [
        (
            "rod.shape.angle",
            match scene.rod.shape {
                Shape::Arc { angle, .. } => angle,
                _ => 0.0,
            },
        ),
        ("supports.angle", scene.supports.angle),
    ];
    let phases = scene.signals.iter().map(|signal| ("signals.phase", signal.phase.unwrap_or(0.0)));
    for (key, angle) in angles.into_iter().chain(phases) {
        if angle.abs() > LARGEST_ANGLE {
            add(key, angle, "rad", "degrees");
        }
    }
    let rod_mass = density * scene.rod.section.moments().area * length;
    if let Some(point) = scene.rod.mass.iter().find(|own| is_implausible_mass(own.mass, rod_mass)) {
        add("rod.mass", point.mass, "kg", "g");
    }
    let routes = scene.actuation.iter().filter_map(|actuator| match actuator {
        Actuation::Tendon { route, .. } => Some(route),
        Actuation::Curvature { .. } => None,
    });
    let offsets = routes.flatten().map(|point| point.offset[0].hypot(point.offset[1]));
    let farthest = offsets.fold(0.0, f64::max);
    if farthest > length {
        add("actuation.route.offset", farthest, "m", "mm");
    }
    (!found.is_empty()).then(|| {
        format!(
            "the model has {}: probably not in SI units. Results are then wrong by powers of ten. Give m, kg/m^3, Pa, \
             rad and m/s^2: 1 g/cm^3 is 1000 kg/m^3, 1 MPa is 1e6 Pa, 1 GPa is 1e9 Pa",
            found.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Point, PointMass, RoutePoint, Support, Tension};
    use std::f64::consts::FRAC_PI_2;

    /// Scene of a straight rod of 0.3 m with these numbers, SI.
    fn scene_of(density: f64, modulus: f64, radius: f64) -> Scene {
        let shape = Shape::Straight { length: 0.3, direction: [1.0, 0.0, 0.0] };
        Scene::new(8, shape, Section::Circle { radius }, Material::new(density, modulus))
    }

    /// A rod along x stands if its clamp is rotated by a right angle, and one along y lies.
    #[test]
    fn rotated_clamp_counts_for_the_vertical_rod() {
        let lacks_gravity = |direction: [f64; 3], angle: f64| {
            let mut scene = scene_of(1100.0, 1e6, 2e-3);
            scene.rod.shape = Shape::Straight { length: 0.3, direction };
            scene.supports.angle = angle;
            scene.gravity_left_out = true;
            scene.problem().unwrap().lacks_gravity(Purpose::Rest)
        };
        let (x, y) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        assert!(lacks_gravity(x, 0.0) && !lacks_gravity(y, 0.0));
        assert!(!lacks_gravity(x, FRAC_PI_2) && lacks_gravity(y, FRAC_PI_2));
    }

    /// A clamp holds the nodes 0 and 1 of a rod of eight edges, whose outermost one begins half an edge behind the
    /// wall; a pinned end holds node 0 only.
    #[test]
    fn force_on_held_nodes_is_reported() {
        let codes = |support: Support, point: Point| {
            let mut scene = scene_of(1100.0, 1e6, 2e-3);
            scene.supports.start = support;
            scene.supports.end = Support::Clamped;
            let force = [0.0, -1.0, 0.0];
            scene.loads.point = vec![PointForce { node: point, force, ..PointForce::default() }];
            let notes = scene.problem().unwrap().plausibility_notes(Purpose::Motion);
            notes.into_iter().map(|(code, _)| code).collect::<Vec<_>>()
        };
        let held = [Code::LoadOnHeldNode];
        assert_eq!(codes(Support::Clamped, Point::Node(1)), held);
        assert_eq!(codes(Support::Clamped, Point::ArcLength(0.01)), held);
        assert_eq!(codes(Support::Clamped, Point::Tip), held);
        assert_eq!(codes(Support::Pinned, Point::Node(0)), held);
        assert!(codes(Support::Pinned, Point::Node(1)).is_empty());
        assert!(codes(Support::Clamped, Point::Node(2)).is_empty());
        assert!(codes(Support::Clamped, Point::ArcLength(0.1)).is_empty());
    }

    #[test]
    fn real_material_is_not_reported() {
        // Densities in kg/m^3 and moduli in Pa of data sheets.
        let materials = [
            ("silicone", 1100.0, 1e5),
            ("soft silicone", 1070.0, 3e4),
            ("silicone filled with iron", 2300.0, 1e5),
            ("rubber with magnetic powder", 3500.0, 1e6),
            ("gelatine", 1050.0, 2e3),
            ("foam", 20.0, 1e4),
            ("balsa", 120.0, 3e9),
            ("steel", 7850.0, 205e9),
            ("lead", 11340.0, 16e9),
            ("tungsten", 19300.0, 411e9),
        ];
        for (name, density, modulus) in materials {
            assert_eq!(units(&scene_of(density, modulus, 2e-3), 0.3), None, "{name}");
        }
    }

    /// Two stiff solids: diamond, and none.
    #[test]
    fn modulus_above_that_of_diamond_is_reported() {
        assert_eq!(units(&scene_of(3500.0, 1.2e12, 2e-3), 0.3), None);
        let words = units(&scene_of(7850.0, 7.895_731e12, 2e-3), 0.3).unwrap();
        assert!(words.contains("modulus of 7896000000000 Pa, stiffer than diamond"), "{words}");
    }

    #[test]
    fn number_in_another_unit_is_reported() {
        // Nylon, steel and aluminium in g/cm^3, mm, GPa or MPa.
        let cases = [
            (
                scene_of(1.1, 1.5, 10.0),
                300.0,
                vec!["density of 1.1", "modulus of 1.5", "section of 20"],
            ),
            (scene_of(7.85e-9, 205e3, 2.0), 300.0, vec!["density of", "section of 4 m"]),
            (scene_of(7850.0, 200.0, 2e-3), 0.2, vec!["200 Pa (in GPa?)"]),
            (
                scene_of(7850.0, 205e3, 2e-3),
                0.2,
                vec!["205000 Pa, softer than solids of this density (in MPa?)"],
            ),
            (scene_of(2700.0, 70.0, 2e-3), 0.2, vec!["70 Pa (in GPa?)"]),
            (scene_of(1140.0, 1.5e-3, 2e-3), 0.2, vec!["(in MPa?)"]),
            (scene_of(1140.0, 1e6, 0.4), 0.3, vec!["section of 0.8 m (in mm?)"]),
            (scene_of(1140.0, 1e6, 2e-3), 300.0, vec!["shape of 300 m (in mm?)"]),
            (scene_of(1140.0, 1e6, 2e-3), 1500.0, vec!["shape of 1500 m (in mm?)"]),
        ];
        for (scene, length, all) in cases {
            let words = units(&scene, length).unwrap_or_default();
            assert!(all.iter().all(|part| words.contains(part)), "{words}: {all:?}");
        }
        let mut falling = scene_of(1140.0, 1e6, 2e-3);
        falling.loads.gravity = [0.0, -9810.0, 0.0];
        assert!(units(&falling, 0.2).unwrap().contains("gravity of 9810 m/s^2"));
    }

    #[test]
    fn angles_masses_and_tendons_in_other_units_are_noted() {
        let note = |change: &dyn Fn(&mut Scene)| {
            let mut scene = scene_of(1200.0, 1e7, 2e-3);
            change(&mut scene);
            units(&scene, 0.3).unwrap_or_default()
        };
        assert_eq!(note(&|_| {}), "");
        let angle = note(&|scene| scene.supports.angle = 30.0);
        assert!(angle.contains("supports.angle of 30 rad (in degrees?)"), "{angle}");
        let arc = note(&|scene| scene.rod.shape = Shape::Arc { length: 0.3, angle: 45.0 });
        assert!(arc.contains("rod.shape.angle of 45 rad (in degrees?)"), "{arc}");
        // The rod has 4.5 g.
        let mass = note(&|scene| scene.rod.mass.push(PointMass::new(Point::Tip, 10.0)));
        assert!(mass.contains("rod.mass of 10 kg (in g?)"), "{mass}");
        let tendon = note(&|scene| {
            let route = vec![RoutePoint { at: 0.1, offset: [3.0, 0.0] }];
            scene.actuation.push(Actuation::Tendon { tension: Tension::Constant(1.0), route });
        });
        assert!(tendon.contains("actuation.route.offset of 3 m (in mm?)"), "{tendon}");
    }
}
