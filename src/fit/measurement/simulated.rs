//! Outputs of a simulation with which data are compared.
//!
//! [`Requirements`] lists the outputs that the measurements of an experiment require, so that a simulation computes no
//! others. These are points, tangents and strains in motion and at rest (of a rod or a structure), reactions of
//! supports, modes, load cases and critical loads. The last times, s, on the clocks of the camera and of the motion
//! belong to them. `has_motion` returns whether the motion, `is_at_rest` whether the equilibrium under the loads of the
//! scene, and `has_strains` whether curvatures or strains are required.
//!
//! [`SimulatedOutput`] has the computed outputs over a scalar type with derivatives: motion and equilibrium (`None` if
//! not required), angular frequencies of the required modes, rad/s, equilibria of the load cases, and critical loads, N
//! or N m. It also has camera, scene, mesh and the strains without load. Each kind of data subtracts its values from
//! these; [`SimulatedOutput::compare`] does so for the observed coordinates of a position, m.

use crate::dynamics::record::RecordView;
use crate::fit::misfit::camera::View;
use crate::numerics::scalar::Scalar;
use crate::problem::ReferenceStrains;
use crate::scene::mesh::Mesh;
use crate::scene::{Parameter, Point, Scene, StructurePoint};
use crate::structure::StructureNodes;
use crate::vibration::ModeName;

/// An equilibrium of the rod under another value of one of its loads.
#[derive(Clone, Copy, Debug)]
pub struct LoadCase {
    /// The number of the scene that takes the value.
    pub load: Parameter,
    /// The value, in the unit of the number.
    pub value: f64,
    /// The point whose position is measured.
    pub point: Point,
}

/// A load at whose critical value the rod buckles.
#[derive(Clone, Copy, Debug)]
pub struct BucklingCase {
    /// The number of the scene that takes the value.
    pub load: Parameter,
    /// The measured critical value, whose sign the simulated one has.
    pub expected: f64,
}

/// Time of a reading on the clock of a sensor of the scene.
#[derive(Clone, Debug)]
pub struct DelayedReading {
    /// Name of the sensor.
    pub sensor: String,
    /// Time, s.
    pub time: f64,
}

/// Outputs of a simulation that measurements require, collected over all measurements of an experiment.
#[derive(Debug, Default)]
pub struct Requirements {
    /// Points with a measured motion or acceleration.
    pub moving: Vec<Point>,
    /// Points with a marker beside the centerline or a measured acceleration: the axes of the rod there are required.
    pub beside: Vec<Point>,
    /// Points with a measured position at rest.
    pub resting: Vec<Point>,
    /// Points with a marker beside the centerline at rest: the axes of the rod there are required.
    pub beside_at_rest: Vec<Point>,
    /// Points with a measured angle of the tangent in a motion.
    pub moving_tangents: Vec<Point>,
    /// Points with a measured angle of the tangent at rest.
    pub resting_tangents: Vec<Point>,
    /// Points with a measured curvature or strain in a motion.
    pub moving_strains: Vec<Point>,
    /// Points with a measured curvature or strain at rest.
    pub resting_strains: Vec<Point>,
    /// Points of a structure with a measured motion.
    pub moving_places: Vec<StructurePoint>,
    /// Points of a structure with a measured position at rest.
    pub resting_places: Vec<StructurePoint>,
    /// Whether the reactions of the supports in a motion are required.
    pub moving_reactions: bool,
    /// Whether the reactions of the supports at rest are required.
    pub resting_reactions: bool,
    /// Whether all nodes of the rod at rest are required.
    pub whole_rest: bool,
    /// Modes with a measured frequency.
    pub modes: Vec<ModeName>,
    /// Equilibria under values of a load, those of each measurement in the order in which they follow each other.
    pub load_cases: Vec<LoadCase>,
    /// Loads with a measured critical value.
    pub buckling_cases: Vec<BucklingCase>,
    /// Time of the last sample of a recorded motion on the clock of the camera, s.
    pub last_recorded: f64,
    /// Smallest and largest recorded coordinates of the motions, m; none along a coordinate that was never observed.
    pub recorded_range: [Option<[f64; 2]>; 3],
    /// Time of the last reading of a gauge or sensor on the clock of the motion, s.
    pub last_read: f64,
    /// The last readings on clocks of sensors of the scene.
    pub last_delayed: Vec<DelayedReading>,
}

impl Requirements {
    /// Whether the equilibrium under the loads of the scene is required: any point, tangent or strain, all nodes, or
    /// the reactions at rest. Modes, load cases and critical loads do not count.
    pub fn is_at_rest(&self) -> bool {
        let has_points = !self.resting.is_empty() || !self.resting_places.is_empty();
        let has_tangents = !self.resting_tangents.is_empty();
        let has_lines = has_tangents || !self.resting_strains.is_empty();
        self.whole_rest || has_points || has_lines || self.resting_reactions
    }

    /// Whether a motion is required: any point, tangent, strain or reaction in motion.
    pub fn has_motion(&self) -> bool {
        let has_points = !self.moving.is_empty() || !self.moving_places.is_empty();
        let has_lines = !self.moving_tangents.is_empty() || !self.moving_strains.is_empty();
        has_points || has_lines || self.moving_reactions
    }

    /// Whether a curvature or strain is required, in motion or at rest.
    pub fn has_strains(&self) -> bool {
        !self.moving_strains.is_empty() || !self.resting_strains.is_empty()
    }
}

/// Outputs of a simulation, over a scalar type that may carry derivatives.
#[derive(Clone, Copy)]
pub struct SimulatedOutput<'a, D> {
    /// The motion, if it is required.
    pub(crate) moving: Option<RecordView<'a, D>>,
    /// The equilibrium, if it is required.
    pub(crate) resting: Option<RecordView<'a, D>>,
    /// Angular frequencies of the required modes, rad/s; in the comparison of one measurement those of its modes.
    pub(crate) frequencies: &'a [D],
    /// The equilibria of the required load cases; in the comparison of one measurement those of its cases.
    pub(crate) load_cases: &'a [RecordView<'a, D>],
    /// The critical loads of the required cases; in the comparison of one measurement its own.
    pub(crate) critical_loads: &'a [D],
    /// The camera.
    pub(crate) view: &'a View<D>,
    pub(crate) scene: &'a Scene<D>,
    pub(crate) mesh: &'a Mesh<D>,
    /// Edges and joints of the rod without load; none if no strain is required.
    pub(crate) reference_strains: Option<&'a ReferenceStrains<D>>,
    /// Meshes and bodies of a structure; none of one rod.
    pub(crate) structure: Option<&'a StructureNodes<'a, D>>,
}

impl<D: Scalar> SimulatedOutput<'_, D> {
    /// Calls `each` with simulated less observed value, m, in the order x, y, z, of every observed coordinate. The
    /// simulated value is that of the world `position`, m, as the camera records it, lens distortion included.
    pub(crate) fn compare(
        &self,
        position: [D; 3],
        observed: &[Option<f64>; 3],
        each: &mut dyn FnMut(D),
    ) {
        let recorded = self.view.recorded(position);
        let undistorted = self.view.undistorted(observed);
        let difference =
            [0, 1, 2].map(|c| undistorted[c].map_or(D::from(0.0), |x| recorded[c] - x));
        let difference = self.view.distorted_difference(difference, observed);
        for c in (0..3).filter(|c| observed[*c].is_some()) {
            each(difference[c]);
        }
    }
}
