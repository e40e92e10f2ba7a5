//! The strains of a rod in a state, from the places of its nodes: of edges along the rod, and on its surface by bending,
//! half its thickness times the change of curvature. The twist of sections is not among them.

use crate::code::Code;
use crate::energy::bend_twist::JointLaw;
use crate::numerics::vector::{cross, dot, sub};
use crate::problem::modelled::AnyModel;
use crate::problem::{AnyProblem, Problem};
use crate::scene::Section;

/// Strains above this are beyond a linear material: rubber's tangent modulus has by then fallen by a sixth
/// (neo-Hookean), and metals and most plastics have yielded long before.
pub(crate) const LARGEST_STRAIN: f64 = 0.1;

/// The largest strain of a state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LargestStrain {
    /// Its size.
    pub strain: f64,
    /// Whether bending makes it.
    pub by_bending: bool,
    /// Where, by arc length from the wall, m.
    pub place: f64,
    /// When, s; none at rest.
    pub time: Option<f64>,
}

impl LargestStrain {
    /// The warning, where it is beyond what the model is for.
    pub fn warning(&self, youngs_modulus: f64) -> Option<(Code, String)> {
        let Self { strain, by_bending, place, time } = *self;
        let kind = if by_bending { "by bending, on the surface" } else { "along the rod" };
        let moment = time.map_or(String::new(), |time| format!(", t = {time:.3e} s"));
        let words = format!(
            "strains reach {:.0} % ({kind}, {place:.3e} m from the wall{moment}). The model is linear and not \
             valid above 10 %. Check the units: youngs_modulus is {youngs_modulus:.3e} Pa",
            100.0 * strain
        );
        (!strain.is_nan() && strain > LARGEST_STRAIN).then_some((Code::LargeStrain, words))
    }
}

/// What strains of a problem's rod count from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StrainGauge {
    /// Lengths of the edges without stress, m.
    lengths: Vec<f64>,
    /// Integrated curvatures of the joints without stress, in the plane with their signs.
    natural: Vec<f64>,
    /// Half of the thickness at every joint over the length it stands for.
    slopes: Vec<f64>,
    /// Arc lengths of the nodes, m.
    places: Vec<f64>,
    /// Of a planar rod.
    normal: Option<[f64; 3]>,
}

impl StrainGauge {
    /// Of a problem's rod; none where recorded markers prescribe nodes, whose distances have the errors of tracking.
    pub fn new(problem: &Problem) -> Option<Self> {
        if problem.scene().supports.path.is_some() {
            return None;
        }
        let (lengths, natural, normal): (Vec<f64>, Vec<f64>, _) = match problem.discretized() {
            AnyProblem::Planar(discretized) => {
                let rod = discretized.rod();
                let lengths = rod.stretch.iter().map(|s| s.rest_length).collect();
                let natural = rod.joint.iter().map(|b| b.natural_curvature).collect();
                (lengths, natural, Some(problem.normal()))
            }
            AnyProblem::Spatial(discretized) => {
                let rod = discretized.rod();
                let lengths = rod.stretch.iter().map(|s| s.rest_length).collect();
                let size = |j: &JointLaw<f64>| j.natural[0].hypot(j.natural[1]);
                (lengths, rod.joint.iter().map(size).collect(), None)
            }
        };
        let nodes = lengths.len() as f64;
        let slope = |(i, pair): (usize, &[f64])| {
            let (section, _) = problem.scene().at((i as f64 + 1.0) / nodes);
            half_thickness(problem, &section, normal) / (0.5 * (pair[0] + pair[1]))
        };
        let slopes = lengths.windows(2).enumerate().map(slope).collect();
        let places = problem.arc_lengths().to_vec();
        Some(Self { natural, slopes, places, normal, lengths })
    }

    /// The largest strain of a rod whose nodes are there.
    pub fn largest(
        &self,
        position: impl Fn(usize) -> [f64; 3],
        time: Option<f64>,
    ) -> LargestStrain {
        let mut largest = LargestStrain { strain: 0.0, by_bending: false, place: 0.0, time };
        let mut before: Option<[f64; 3]> = None;
        let mut last = position(0);
        for (i, rest) in self.lengths.iter().enumerate() {
            let next = position(i + 1);
            let edge = sub(next, last);
            let stretch = (dot(edge, edge).sqrt() / rest - 1.0).abs();
            if stretch > largest.strain {
                largest = LargestStrain {
                    strain: stretch,
                    by_bending: false,
                    place: self.places[i],
                    time,
                };
            }
            if let Some(before) = before {
                let bent = self.slopes[i - 1] * self.bent(before, edge, self.natural[i - 1]);
                if bent > largest.strain {
                    largest = LargestStrain {
                        strain: bent,
                        by_bending: true,
                        place: self.places[i],
                        time,
                    };
                }
            }
            (before, last) = (Some(edge), next);
        }
        largest
    }

    /// Change of the integrated curvature between two edges; in space of its size, which is the least it may be.
    fn bent(&self, before: [f64; 3], after: [f64; 3], natural: f64) -> f64 {
        let across = cross(before, after);
        let lengths = (dot(before, before) * dot(after, after)).sqrt();
        let size = 2.0 / (lengths + dot(before, after)).max(f64::MIN_POSITIVE);
        let curvature = match self.normal {
            Some(normal) => size * dot(across, normal),
            None => size * dot(across, across).sqrt(),
        };
        (curvature - natural).abs()
    }
}

/// The largest strain of a motion so far. It is no part of a result: the warning at the end is.
#[derive(Clone, Debug, Default)]
pub(crate) struct StrainRecord(Option<(StrainGauge, LargestStrain)>);

/// Records do not distinguish results.
impl PartialEq for StrainRecord {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl StrainRecord {
    /// Of a motion of a problem's rod that has not begun.
    pub fn new(problem: &Problem) -> Self {
        Self(StrainGauge::new(problem).map(|gauge| (gauge, LargestStrain::default())))
    }

    /// Takes a state.
    pub fn add(&mut self, position: impl Fn(usize) -> [f64; 3], time: f64) {
        let Some((gauge, largest)) = &mut self.0 else { return };
        let now = gauge.largest(position, Some(time));
        if now.strain > largest.strain {
            *largest = now;
        }
    }

    /// The largest strain, if strains are known.
    pub fn largest(&self) -> Option<LargestStrain> {
        self.0.as_ref().map(|(_, largest)| *largest)
    }
}

/// Half of the thickness in the direction of bending, m: in space of the thinner one, about which strips bend.
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
            // A rectangle of the same area and the smaller second moment.
            let moments = section.moments();
            let [i1, i2] = moments.second_moments;
            (3.0 * i1.min(i2) / moments.area).sqrt().min(problem.length())
        }
    }
}

impl Problem {
    /// Second moments of area of the section in the directions in which the rod bends, m^4: one in a plane, and
    /// one where all directions have the same.
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
    fn strains_are_those_of_geometry() {
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
