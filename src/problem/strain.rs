//! Largest strain of a rod from the positions of its nodes, and the warning above the range of the linear model.
//!
//! Two kinds of strain are compared. Along each edge it is the absolute relative change of length, with a linear
//! stretch law only. At each joint it is the strain on the surface by bending: half the thickness times the change of
//! curvature. In space the latter is a lower bound; shear strain by twist is not included. [`StrainGauge`] holds the
//! stress-free state of one rod. From the positions of nodes (m) it returns the largest strain (dimensionless), its
//! kind, arc length (m) and time (s). [`StrainRecord`] holds the maximum over a motion; its `add` takes one state. Both
//! return `None` for scenes with recorded markers (`supports.path`), whose distances have tracking errors.
//! [`LargestStrain::warning`] returns the warning of a strain above [`LARGEST_STRAIN`]. `second_moments_of_bending`
//! returns the second moments of area (m^4) of the directions in which the model bends.

use crate::code::Code;
use crate::energy::bend_twist::JointLaw;
use crate::numerics::vector::{cross, dot, sub};
use crate::problem::model_with_setup::AnyModel;
use crate::problem::{AnyProblem, Problem, with_model};
use crate::scene::{Section, StretchLaw};

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
}

impl LargestStrain {
    /// Warning, with its code, of a strain above [`LARGEST_STRAIN`]: value in per cent, kind, place, time and the
    /// modulus, Pa. None for a smaller strain or NaN.
    pub fn warning(&self, youngs_modulus: f64) -> Option<(Code, String)> {
        let Self { strain, by_bending, place, time } = *self;
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

/// Stress-free state of a rod, from which its strains are measured.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StrainGauge {
    /// Stress-free lengths of the edges, m.
    lengths: Vec<f64>,
    /// Stress-free integrated curvatures of the joints, rad; signed in the plane.
    natural: Vec<f64>,
    /// Half of the thickness at every joint over the mean length of its two edges: strain on the surface over the
    /// change of the integrated curvature.
    slopes: Vec<f64>,
    /// Arc lengths of the nodes, m.
    places: Vec<f64>,
    /// Normal of the plane of a planar rod.
    normal: Option<[f64; 3]>,
    /// Whether the law of the stretch is linear: others hold for large stretches, which are not compared.
    is_linear: bool,
}

impl StrainGauge {
    /// Gauge with the stress-free lengths and integrated curvatures of the rod of a problem, with signals at
    /// `loads.at_time`. For every joint it has half the thickness over the mean length of its two edges; the section is
    /// taken at the index of the node over the number of edges. In space curvatures are absolute values. None if
    /// recorded markers prescribe nodes, as their distances have tracking errors.
    pub fn new(problem: &Problem) -> Option<Self> {
        if problem.scene().supports.path.is_some() {
            return None;
        }
        let lengths: Vec<f64> = with_model!(problem, |discretized| {
            discretized.rod().stretch.iter().map(|edge| edge.rest_length).collect()
        });
        let (natural, normal): (Vec<f64>, _) = match problem.discretized() {
            AnyProblem::Planar(planar) => {
                let joints = planar.rod().joint;
                let natural = joints.iter().map(|bend| bend.natural_curvature).collect();
                (natural, Some(problem.normal()))
            }
            AnyProblem::Spatial(spatial) => {
                let size = |j: &JointLaw<f64>| j.natural[0].hypot(j.natural[1]);
                (spatial.rod().joint.iter().map(size).collect(), None)
            }
        };
        let nodes = lengths.len() as f64;
        // Strain on the surface is half the thickness times the change of curvature.
        let slope = |(i, pair): (usize, &[f64])| {
            let (section, _) = problem.scene().at((i as f64 + 1.0) / nodes);
            half_thickness(problem, &section, normal) / (0.5 * (pair[0] + pair[1]))
        };
        let slopes = lengths.windows(2).enumerate().map(slope).collect();
        let places = problem.arc_lengths().to_vec();
        let is_linear = problem.scene().material.stretch_law == StretchLaw::Linear;
        Some(Self { natural, slopes, places, normal, is_linear, lengths })
    }

    /// Largest absolute strain of a rod with nodes at `position(i)`, m, with its kind and place. For a joint it is half
    /// the thickness times the change of curvature. For an edge it is the relative change of length, which is compared
    /// only with a linear law of the stretch. The place is the arc length of the joint, or of the first node of the
    /// edge. `time`, s, is stored in the result; none for an equilibrium.
    pub fn largest(
        &self,
        position: impl Fn(usize) -> [f64; 3],
        time: Option<f64>,
    ) -> LargestStrain {
        let mut largest = LargestStrain { time, ..LargestStrain::default() };
        let mut compare = |strain: f64, by_bending: bool, i: usize| {
            if strain > largest.strain {
                largest = LargestStrain { strain, by_bending, place: self.places[i], time };
            }
        };
        // One pass over the edges: stretch of each, and bending of the joint before it.
        let mut before: Option<[f64; 3]> = None;
        let mut last = position(0);
        for (i, rest) in self.lengths.iter().enumerate() {
            let next = position(i + 1);
            let edge = sub(next, last);
            if self.is_linear {
                compare((dot(edge, edge).sqrt() / rest - 1.0).abs(), false, i);
            }
            if let Some(before) = before {
                let joint = i - 1;
                let change = self.curvature_change(before, edge, self.natural[joint]);
                compare(self.slopes[joint] * change, true, i);
            }
            (before, last) = (Some(edge), next);
        }
        largest
    }

    /// Absolute change of the integrated curvature `2 tan(phi/2)` from `natural`, between the edge vectors `before` and
    /// `after`, m. In a plane both have a sign. In space it is the change of the absolute value, a lower bound.
    fn curvature_change(&self, before: [f64; 3], after: [f64; 3], natural: f64) -> f64 {
        let across = cross(before, after);
        let lengths = (dot(before, before) * dot(after, after)).sqrt();
        // `2 tan(phi/2) = 2 sin/(1 + cos)`, with both times the product of the lengths; finite also
        // in a fold.
        let size = 2.0 / (lengths + dot(before, after)).max(f64::MIN_POSITIVE);
        let curvature = match self.normal {
            Some(normal) => size * dot(across, normal),
            None => size * dot(across, across).sqrt(),
        };
        (curvature - natural).abs()
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
        let now = gauge.largest(position, Some(time));
        if now.strain > largest.strain {
            *largest = now;
        }
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
    use crate::scene::{Dimension, Material, Scene, Shape};

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
            assert!(drawn.warning(1e6).unwrap().1.contains("20 % (along the rod"));
            assert!(gauge.largest(|i| [places[i], 0.0, 0.0], None).strain < 1e-9);
        }
    }
}
