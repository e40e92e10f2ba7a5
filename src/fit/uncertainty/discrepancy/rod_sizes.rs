//! Quantities of an experiment from which the plausible sizes of omitted effects follow.
//!
//! Input: an experiment, and its problem with the values of the optimum. [`RodSizes::new`] takes length, mass (without
//! attached ones), density and section of the rod from the scene, in SI units and without tapers. Stiffness `EI` and
//! thickness are those of the softer direction; the thickness is four radii of gyration, the diameter of a circle. The
//! recorded motions yield the first angular frequency, `pi` over the shortest time in which a record reaches its first
//! extreme, and the least mean time between frames. They also yield a curvature `3 d/L^2`: that at the clamp of a
//! cantilever of length `L` whose tip moves by `d`, the largest spread of a recorded point. Quantities that section or
//! data do not define are none.

use crate::fit::measurement::experiment::Experiment;
use crate::fit::measurement::motion::PointMotion;
use crate::fit::misfit::camera::is_in_picture;
use crate::problem::Problem;
use crate::scene::Section;
use std::f64::consts::PI;

/// Plausible relative change of a distance in the picture by lens distortion.
const DISTORTION: f64 = 0.01;

/// Sizes of a rod and its recordings that plausible sizes of omitted effects are computed from.
pub(crate) struct RodSizes {
    /// Length of the rod, m.
    pub length: f64,
    /// Mass of the rod without attached masses, kg.
    pub mass: f64,
    /// Density of its material, kg/m^3.
    pub density: f64,
    /// Radius of a circle or a tube, m.
    pub radius: Option<f64>,
    /// Height of a rectangle, m.
    pub height: Option<f64>,
    /// Thickness in the softer direction, m: four radii of gyration, `4 sqrt(I/A)`.
    pub thickness: f64,
    /// Least bending stiffness EI, N m^2.
    pub bending: f64,
    /// Angular frequency of the first oscillation, rad/s; none without a record over time that reaches an extreme.
    pub frequency: Option<f64>,
    /// Least mean time between two samples of a record, s; none without a record of several samples.
    pub frame: Option<f64>,
    /// Least mean time between two positions of a point, s; none without recorded motions.
    pub picture: Option<f64>,
    /// Delay of a rolling shutter that reads the length of the rod along y in one frame, s/m; none in space, without
    /// recorded points, or where a measurement has no y coordinate.
    pub row_delay: Option<f64>,
    /// Lens distortion that changes a distance of the length of the rod by [`DISTORTION`], 1/m^2; none in space, or
    /// where a measurement lacks a coordinate of the picture.
    pub distortion: Option<f64>,
    /// Curvature at the clamp of a cantilever whose tip moves as far as the recorded points, 1/m; none without moving
    /// points.
    pub curvature: Option<f64>,
}

impl RodSizes {
    /// Sizes of an experiment whose `problem` has the values of the optimum. Of several records the shortest rise time,
    /// the least mean time between frames and the largest spread of a point count. Frequency and frame time also use
    /// readings of sensors over time, and are none without records. Curvature uses points only, and is none without a
    /// motion of them; radius is none unless the section is a circle or a tube, height none unless it is a rectangle.
    pub fn new(experiment: &Experiment, problem: &Problem) -> Self {
        let scene = problem.scene();
        let moments = scene.rod.section.moments();
        let [i1, i2] = moments.second_moments;
        let least = i1.min(i2);
        let spacing = |o: &PointMotion| {
            let (first, last) = (o.samples.first()?.time, o.samples.last()?.time);
            (o.samples.len() > 1).then(|| (last - first) / (o.samples.len() - 1) as f64)
        };
        let frame = experiment.records().filter_map(|o| spacing(&o)).reduce(f64::min);
        let picture = experiment.motions().filter_map(spacing).reduce(f64::min);
        let has_coordinate = |c| experiment.measurements.iter().all(|own| own.has_coordinate(c));
        // Pictures are of one plane; recordings in space are from several cameras.
        let is_pictured = problem.model().0 == "planar";
        let has_picture = (0..3).all(|c| !is_in_picture(problem, c) || has_coordinate(c));
        let farthest = experiment.motions().map(PointMotion::spread).reduce(f64::max);
        let farthest = farthest.filter(|distance| *distance > 0.0);
        let length = problem.length();
        Self {
            length,
            mass: scene.material.density * moments.area * length,
            density: scene.material.density,
            radius: match scene.rod.section {
                Section::Circle { radius } | Section::Tube { radius, .. } => Some(radius),
                _ => None,
            },
            height: match scene.rod.section {
                Section::Rectangle { height, .. } => Some(height),
                _ => None,
            },
            // A circle of radius a has I/A = a^2/4.
            thickness: 4.0 * (least / moments.area).sqrt(),
            bending: scene.material.youngs_modulus * least,
            // The first extreme is half a period after the start.
            frequency: experiment.rise_time().map(|time| PI / time),
            frame,
            picture,
            row_delay: picture.filter(|_| is_pictured && has_coordinate(1)).map(|t| t / length),
            distortion: (is_pictured && has_picture).then_some(DISTORTION / (length * length)),
            // A tip load deflects the tip by k L^2/3 for the curvature k at the clamp.
            curvature: farthest.map(|distance| 3.0 * distance / length.powi(2)),
        }
    }
}
