//! Largest strain of a rod from the positions of its nodes, and the warning above the range of the linear model.
//!
//! Two kinds of strain are compared. Along each edge it is the absolute relative change of length, with a linear
//! stretch law only. At each joint it is the strain on the surface by bending: half the thickness times the change of
//! curvature. In space the latter is a lower bound; shear strain by twist is not included. Natural strains by actuators
//! are free of stress and do not count, at the time of the state. [`StrainGauge`] holds the stress-free state of one
//! rod. From the positions of nodes (m) it returns the largest strain (dimensionless), its
//! kind, arc length (m) and time (s). [`StrainRecord`] holds the maximum over a motion; its `add` takes one state. Both
//! return `None` for scenes with recorded markers (`supports.path`), whose distances have tracking errors.
//! [`LargestStrain::warnings`] returns the warning of a strain above [`LARGEST_STRAIN`], and that of a curvature beyond
//! a table of the bending moment. `second_moments_of_bending`
//! returns the second moments of area (m^4) of the directions in which the model bends.

use crate::code::Code;
use crate::energy::bend_twist::JointLaw;
use crate::energy::law::NonlinearBending;
use crate::numerics::vector::{cross, dot, sub};
use crate::problem::model_with_setup::AnyModel;
use crate::problem::{AnyProblem, Problem, with_model};
use crate::rod::{Actuator, ActuatorEffect, Actuators, EdgeShift, JointShift};
use crate::scene::{BendingLaw, Section, StretchLaw};
use std::borrow::Cow;

/// Largest strain without a warning, beyond which materials are not linear: the tangent modulus of rubber (neo-Hookean)
/// is lower by a sixth, and metals and most plastics have yielded.
pub(crate) const LARGEST_STRAIN: f64 = 0.1;

/// Largest strain of a state, or of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LargestStrain {
    /// Absolute value of the strain, dimensionless.
    pub strain: f64,
    /// Whether it is due to bending.
    pub by_bending: bool,
    /// Arc length from the wall, m.
    pub place: f64,
    /// Time, s; none for an equilibrium.
    pub time: Option<f64>,
    /// The largest change of curvature, with a table of the bending moment.
    pub curvature: Option<LargestCurvature>,
}

/// Largest change of curvature of a rod whose bending moment is given by a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LargestCurvature {
    /// Absolute value of the change from the natural curvature, 1/m.
    pub change: f64,
    /// Arc length from the wall, m.
    pub place: f64,
    /// The last curvature of the table, 1/m.
    pub table_end: f64,
}

impl LargestStrain {
    /// Warnings, with their codes, of a strain above [`LARGEST_STRAIN`] and of a curvature beyond the table of the
    /// bending moment: value, kind, place, time and the modulus, Pa. Empty for smaller ones or NaN.
    pub fn warnings(&self, youngs_modulus: f64) -> Vec<(Code, String)> {
        let beyond = self.curvature.and_then(|curvature| curvature.warning());
        self.strain_warning(youngs_modulus).into_iter().chain(beyond).collect()
    }

    /// Replaces the largest strain by that of another state if it is larger, and the largest change of curvature in the
    /// same way.
    pub fn include(&mut self, now: Self) {
        let larger = |a: &LargestCurvature, b: &LargestCurvature| a.change.total_cmp(&b.change);
        let curvature = self.curvature.into_iter().chain(now.curvature).max_by(larger);
        if now.strain > self.strain {
            *self = now;
        }
        self.curvature = curvature;
    }

    /// The warning of a strain above [`LARGEST_STRAIN`].
    fn strain_warning(&self, youngs_modulus: f64) -> Option<(Code, String)> {
        let Self { strain, by_bending, place, time, .. } = *self;
        let kind = if by_bending { "by bending, on the surface" } else { "along the rod" };
        let moment = time.map_or(String::new(), |time| format!(", t = {time:.3e} s"));
        let message = format!(
            "strains reach {:.0} % ({kind}, {place:.3e} m from the wall{moment}). The model is linear and not \
             valid above 10 %. Check the units: youngs_modulus is {youngs_modulus:.3e} Pa",
            100.0 * strain
        );
        (!strain.is_nan() && strain > LARGEST_STRAIN).then_some((Code::LargeStrain, message))
    }
}

impl LargestCurvature {
    /// The warning of a curvature beyond the last one of the table.
    fn warning(&self) -> Option<(Code, String)> {
        let Self { change, place, table_end } = *self;
        let message = format!(
            "curvatures differ from the natural one by up to {change:.3e} 1/m ({place:.3e} m from the wall), beyond the \
             last one of material.bending_law, {table_end:.3e} 1/m. Its last factor is used there"
        );
        (change > table_end).then_some((Code::BeyondTable, message))
    }
}

/// Strains at which a rod is free of stress.
#[derive(Clone, Debug)]
struct StressFreeStrains {
    /// Relative changes of length of the edges.
    edges: Vec<f64>,
    /// Integrated curvatures of the joints, rad: the signed one and zero in the plane, those towards both directors in
    /// space.
    joints: Vec<[f64; 2]>,
}

/// Stress-free state of a rod, from which its strains are measured.
#[derive(Clone, Debug)]
pub(crate) struct StrainGauge {
    /// Lengths of the edges at zero strain, m.
    lengths: Vec<f64>,
    /// Natural strains with signals at `loads.at_time`.
    natural: StressFreeStrains,
    /// Actuators that change the natural strains with signals, and their values at `loads.at_time`.
    actuators: Actuators<f64>,
    /// Half of the thickness at every joint over the mean length of its two edges: strain on the surface over the
    /// change of the integrated curvature.
    slopes: Vec<f64>,
    /// Arc lengths of the nodes, m.
    places: Vec<f64>,
    /// Normal of the plane of a planar rod.
    normal: Option<[f64; 3]>,
    /// Whether the law of the stretch is linear: others hold for large stretches, which are not compared.
    is_linear: bool,
    /// The table of the bending moment, if the material has one.
    table: Option<TableRange>,
}

/// The curvatures that a table of the bending moment covers.
#[derive(Clone, Debug)]
struct TableRange {
    /// The last curvature, 1/m.
    end: f64,
    /// Lengths of the joints in the law, m.
    lengths: Vec<f64>,
}

impl Problem {
    /// Warnings, with their codes, of large strains and of curvatures beyond a table at rest, where `position` returns
    /// the nodes, m.
    pub(crate) fn strain_warnings(
        &self,
        position: impl Fn(usize) -> [f64; 3],
    ) -> Vec<(Code, String)> {
        let strain = StrainGauge::new(self).map(|gauge| gauge.largest(position, None));
        let modulus = self.scene().material.youngs_modulus;
        strain.into_iter().flat_map(|strain| strain.warnings(modulus)).collect()
    }
}

impl StrainGauge {
    /// Gauge with the stress-free lengths and integrated curvatures of the rod of a problem. For every joint it has
    /// half the thickness at its node over the mean length of its two edges. None if recorded markers prescribe nodes,
    /// as their distances have tracking errors.
    pub fn new(problem: &Problem) -> Option<Self> {
        if problem.scene().supports.path.is_some() {
            return None;
        }
        type Edges = (Vec<f64>, Vec<f64>, Actuators<f64>);
        let (lengths, edges, actuators): Edges = with_model!(problem, |discretized| {
            let stretch = discretized.rod().stretch;
            let lengths = stretch.iter().map(|edge| edge.rest_length).collect();
            let natural = stretch.iter().map(|edge| edge.natural_strain).collect();
            (lengths, natural, discretized.setup.actuators(discretized.model))
        });
        // Values of the signals at which the natural strains are taken.
        let changes_strains = |a: &Actuator<f64>| matches!(a.effect, ActuatorEffect::Strains(_));
        let list = actuators.list.into_iter().filter(changes_strains).collect();
        let actuators = Actuators::at(list, problem.scene().loads.at_time);
        let (joints, normal): (Vec<[f64; 2]>, _) = match problem.discretized() {
            AnyProblem::Planar(planar) => {
                let joints = planar.rod().joint;
                let natural = joints.iter().map(|bend| [bend.natural_curvature, 0.0]).collect();
                (natural, Some(problem.normal()))
            }
            AnyProblem::Spatial(spatial) => {
                let both = |j: &JointLaw<f64>| [j.natural[0], j.natural[1]];
                (spatial.rod().joint.iter().map(both).collect(), None)
            }
        };
        let natural = StressFreeStrains { edges, joints };
        let fractions = problem.mesh.places();
        // Strain on the surface is half the thickness times the change of curvature.
        let slope = |(i, pair): (usize, &[f64])| {
            let (section, _) = problem.scene().at(fractions[i + 1]);
            half_thickness(problem, &section, normal) / (0.5 * (pair[0] + pair[1]))
        };
        let slopes = lengths.windows(2).enumerate().map(slope).collect();
        let places = problem.arc_lengths().to_vec();
        let is_linear = problem.scene().material.stretch_law == StretchLaw::Linear;
        let end = match &problem.scene().material.bending_law {
            Some(BendingLaw::Table { curvature, .. }) => curvature.last().copied(),
            _ => None,
        };
        let table = end.map(|end| {
            let lengths = with_model!(problem, |discretized| {
                discretized.rod().bending.iter().map(NonlinearBending::length).collect()
            });
            TableRange { end, lengths }
        });
        Some(Self { natural, actuators, slopes, places, normal, is_linear, table, lengths })
    }

    /// The natural strains at a time, s; without a time, those at `loads.at_time`.
    fn natural_at(&self, time: Option<f64>) -> Cow<'_, StressFreeStrains> {
        let Some(time) = time.filter(|_| !self.actuators.is_empty()) else {
            return Cow::Borrowed(&self.natural);
        };
        let mut natural = self.natural.clone();
        let values = self.actuators.values_at(time).into_iter().zip(&self.actuators.values);
        for (actuator, (now, before)) in self.actuators.list.iter().zip(values) {
            let ActuatorEffect::Strains(shifts) = &actuator.effect else { continue };
            let change = now - before;
            for EdgeShift { edge, strain } in &shifts.edges {
                natural.edges[*edge] += strain * change;
            }
            for JointShift { joint, strains } in &shifts.joints {
                natural.joints[*joint][0] += strains[0] * change;
                natural.joints[*joint][1] += strains[1] * change;
            }
        }
        Cow::Owned(natural)
    }

    /// Largest absolute strain of a rod with nodes at `position(i)`, m, with its kind and place. For a joint it is half
    /// the thickness times the change of curvature. For an edge it is the relative change of length less its natural
    /// strain, which is compared only with a linear law of the stretch. The place is the arc length of the joint, or of
    /// the first node of the edge. Actuators have the values of their signals at `time`, s, which is stored in the
    /// result; none for an equilibrium, with signals at `loads.at_time`.
    pub fn largest(
        &self,
        position: impl Fn(usize) -> [f64; 3],
        time: Option<f64>,
    ) -> LargestStrain {
        let natural = self.natural_at(time);
        let mut largest = LargestStrain { time, ..LargestStrain::default() };
        let mut compare = |strain: f64, by_bending: bool, i: usize| {
            if strain > largest.strain {
                largest =
                    LargestStrain { strain, by_bending, place: self.places[i], time, ..largest };
            }
        };
        let mut curvature = self.table.as_ref().map(|table| LargestCurvature {
            change: 0.0,
            place: 0.0,
            table_end: table.end,
        });
        // One pass over the edges: stretch of each, and bending of the joint before it.
        let mut before: Option<[f64; 3]> = None;
        let mut last = position(0);
        for (i, rest) in self.lengths.iter().enumerate() {
            let next = position(i + 1);
            let edge = sub(next, last);
            if self.is_linear {
                let strain = dot(edge, edge).sqrt() / rest - 1.0;
                compare((strain - natural.edges[i]).abs(), false, i);
            }
            if let Some(before) = before {
                let joint = i - 1;
                let change = self.curvature_change(before, edge, natural.joints[joint]);
                compare(self.slopes[joint] * change, true, i);
                if let (Some(largest), Some(table)) = (&mut curvature, &self.table) {
                    let change = change / table.lengths[joint];
                    if change > largest.change {
                        (largest.change, largest.place) = (change, self.places[i]);
                    }
                }
            }
            (before, last) = (Some(edge), next);
        }
        LargestStrain { curvature, ..largest }
    }

    /// Absolute change of the integrated curvature `2 tan(phi/2)` from `natural`, between the edge vectors `before` and
    /// `after`, m. In a plane both have a sign. In space it is the change of the absolute value, a lower bound.
    fn curvature_change(&self, before: [f64; 3], after: [f64; 3], natural: [f64; 2]) -> f64 {
        let across = cross(before, after);
        let lengths = (dot(before, before) * dot(after, after)).sqrt();
        // `2 tan(phi/2) = 2 sin/(1 + cos)`, with both times the product of the lengths; finite also
        // in a fold.
        let size = 2.0 / (lengths + dot(before, after)).max(f64::MIN_POSITIVE);
        let change = match self.normal {
            Some(normal) => size * dot(across, normal) - natural[0],
            None => size * dot(across, across).sqrt() - natural[0].hypot(natural[1]),
        };
        change.abs()
    }
}

/// Largest strain of a motion so far, for the warning at its end.
#[derive(Clone, Debug, Default)]
pub(crate) struct StrainRecord(Option<(StrainGauge, LargestStrain)>);

/// All records are equal, so that they do not distinguish results.
impl PartialEq for StrainRecord {
    /// True for any two records.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl StrainRecord {
    /// Record of a motion of the rod of a problem before its first state, with strain 0. It has no gauge, and records
    /// nothing, if recorded markers prescribe nodes.
    pub fn new(problem: &Problem) -> Self {
        Self(StrainGauge::new(problem).map(|gauge| (gauge, LargestStrain::default())))
    }

    /// Replaces the recorded strain by the largest one of a state with nodes at `position(i)`, m, at a time, s, if that
    /// is larger.
    pub fn add(&mut self, position: impl Fn(usize) -> [f64; 3], time: f64) {
        let Some((gauge, largest)) = &mut self.0 else { return };
        largest.include(gauge.largest(position, Some(time)));
    }

    /// Largest strain of all states so far, 0 before the first; none if recorded markers prescribe nodes.
    pub fn largest(&self) -> Option<LargestStrain> {
        self.0.as_ref().map(|(_, largest)| *largest)
    }
}

/// Half of the thickness in the direction of bending, m: the outer radius, or half of height or width. In a plane that
/// one lies in the plane with the given `normal`; in space it is the smaller one. A custom section has that of the
/// rectangle with the same area and smaller second moment, at most the length of the rod.
fn half_thickness(problem: &Problem, section: &Section, normal: Option<[f64; 3]>) -> f64 {
    match section {
        Section::Circle { radius } | Section::Tube { radius, .. } => *radius,
        Section::Rectangle { width, height, up } => {
            let within = normal.map(|normal| dot(normal, *up).abs() < 0.5 * dot(*up, *up).sqrt());
            0.5 * match within {
                Some(true) => *height,
                Some(false) => *width,
                None => width.min(*height),
            }
        }
        Section::Custom { .. } => {
            // That of the rectangle with the same area and the smaller second moment.
            let moments = section.moments();
            let [i1, i2] = moments.second_moments;
            (3.0 * i1.min(i2) / moments.area).sqrt().min(problem.length())
        }
    }
}

impl Problem {
    /// Second moments of area, m^4, without taper, of the directions in which the rod bends. These are the one in the
    /// plane of a planar model, or both of a spatial model; one if both are equal.
    pub(crate) fn second_moments_of_bending(&self) -> Vec<f64> {
        let moments = self.scene.rod.section.moments().second_moments;
        match &self.model {
            AnyModel::Planar(modelled) => vec![moments[modelled.model.second_moment()]],
            AnyModel::Spatial(_) if moments[0] == moments[1] => vec![moments[0]],
            AnyModel::Spatial(_) => moments.to_vec(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Along, Dimension, Material, Scene, Shape, Support};

    /// A rod of 5 mm radius on a circle of 50 mm: 10 % by bending; and drawn out by a fifth.
    #[test]
    fn strain_equals_that_of_the_prescribed_geometry() {
        for dimension in [Dimension::Planar, Dimension::Spatial] {
            let shape = Shape::Straight { length: 0.1, direction: [1.0, 0.0, 0.0] };
            let material = Material { poisson_ratio: Some(0.3), ..Material::new(1e3, 1e6) };
            let mut scene = Scene::new(100, shape, Section::Circle { radius: 0.005 }, material);
            scene.rod.dimension = dimension;
            let problem = scene.problem().unwrap();
            let gauge = StrainGauge::new(&problem).unwrap();
            let places = problem.arc_lengths().to_vec();
            let on_circle = |i: usize| {
                let angle = places[i] / 0.05;
                [0.05 * angle.sin(), 0.05 * (1.0 - angle.cos()), 0.0]
            };
            let bent = gauge.largest(on_circle, None);
            assert!(bent.by_bending && (bent.strain - 0.1).abs() < 1e-4, "{bent:?}");
            let drawn = gauge.largest(|i| [1.2 * places[i], 0.0, 0.0], Some(0.5));
            assert!(!drawn.by_bending && (drawn.strain - 0.2).abs() < 1e-9, "{drawn:?}");
            assert!(drawn.warnings(1e6)[0].1.contains("20 % (along the rod"));
            assert!(gauge.largest(|i| [places[i], 0.0, 0.0], None).strain < 1e-9);
        }
    }

    /// The problem of a free rod of 0.1 m with 10 mm radius and these further tables.
    fn free_rod(tables: &str) -> Problem {
        let text = format!(
            "[rod]\nsegments = 40\nshape = {{ kind = \"straight\", length = 0.1, direction = [1, 0, 0] }}\n\
             section = {{ kind = \"circle\", radius = 0.01 }}\n\
             [material]\ndensity = 1000\nyoungs_modulus = 1e6\n[supports]\nstart = \"free\"\n{tables}"
        );
        Scene::from_toml(&text, ".").unwrap().problem().unwrap()
    }

    /// A curvature of 20/m by a signal at t = 2 s bends the rod without strain; at t = 0 it would be 20 %. A stretch of
    /// 15 % by a constant actuator has none either.
    #[test]
    fn natural_strains_of_actuators_are_no_strains() {
        let problem = free_rod(
            "[[signals]]\nname = \"s\"\nkind = \"ramp\"\nduration = 2.0\n\
             [[actuation]]\nkind = \"curvature\"\ncomponent = \"d1\"\ngain = 20\nsignal = \"s\"\n",
        );
        let gauge = StrainGauge::new(&problem).unwrap();
        let places = problem.arc_lengths().to_vec();
        let on_circle = |i: usize| {
            let angle = 20.0 * places[i];
            [angle.sin() / 20.0, (1.0 - angle.cos()) / 20.0, 0.0]
        };
        let strain = |time: f64| gauge.largest(on_circle, Some(time)).strain;
        assert!(strain(2.0) < 1e-3, "{:e}", strain(2.0));
        assert!((strain(0.0) - 0.2).abs() < 1e-3, "{:e}", strain(0.0));
        let problem =
            free_rod("[[actuation]]\nkind = \"curvature\"\ncomponent = \"stretch\"\ngain = 0.15\n");
        let gauge = StrainGauge::new(&problem).unwrap();
        let found = gauge.largest(|i| [1.15 * places[i], 0.0, 0.0], None);
        assert!(found.strain < 1e-9, "{found:?}");
    }

    /// Half of a tapered polyline is its first edge, at whose end the radius is 6 mm.
    #[test]
    fn thickness_of_a_joint_is_that_at_its_node() {
        let node =
            |k: i32| [if k == 0 { 0.0 } else { 0.05 + 0.05 * f64::from(k - 1) / 19.0 }, 0.0, 0.0];
        let material = Material::new(1e3, 1e6);
        let shape = Shape::points((0..=20).map(node));
        let mut scene = Scene::new(20, shape, Section::Circle { radius: 0.01 }, material);
        scene.rod.taper.radius = Some(Along::linear(1.0, 0.2));
        scene.supports.start = Support::Free;
        let gauge = StrainGauge::new(&scene.problem().unwrap()).unwrap();
        let radius = gauge.slopes[0] * 0.5 * (gauge.lengths[0] + gauge.lengths[1]);
        assert!((radius - 0.006).abs() < 1e-6, "{radius:e}");
    }
}
