//! Outputs of a run that data are compared with: what they require of it, and what it provides.

use crate::dynamics::record::Recorded;
use crate::fit::misfit::camera::View;
use crate::numerics::scalar::Scalar;
use crate::scene::mesh::Mesh;
use crate::scene::{Point, Scene};
use crate::vibration::ModeName;

/// Outputs of a run that measurements require.
#[derive(Debug, Default)]
pub struct Requirements {
    /// Points whose motion is recorded.
    pub moving: Vec<Point>,
    /// Those of them with a marker beside the centerline.
    pub beside: Vec<Point>,
    /// Points of the rod at rest.
    pub resting: Vec<Point>,
    /// Whether all nodes of the rod at rest are needed.
    pub whole_rest: bool,
    /// The modes whose frequencies are needed.
    pub modes: Vec<ModeName>,
    /// Time of the last sample on the clock of the camera, s.
    pub last_recorded: f64,
    /// Time of the last sample on the clock of the motion, s.
    pub last_read: f64,
}

impl Requirements {
    /// Whether the rod at rest is needed.
    pub fn is_at_rest(&self) -> bool {
        self.whole_rest || !self.resting.is_empty()
    }
}

/// Outputs of a run, over numbers that may carry derivatives.
#[derive(Clone, Copy)]
pub struct Simulated<'a, D> {
    pub(crate) moving: Option<Recorded<'a, D>>,
    pub(crate) resting: Option<Recorded<'a, D>>,
    /// Angular frequencies of the modes, rad/s; of those of one measurement where it is compared.
    pub(crate) frequencies: &'a [D],
    pub(crate) view: &'a View<D>,
    pub(crate) scene: &'a Scene<D>,
    pub(crate) mesh: &'a Mesh<D>,
}

impl<D: Scalar> Simulated<'_, D> {
    /// Calls `each` with the difference of every observed coordinate of a position.
    pub(crate) fn compare(
        &self,
        position: [D; 3],
        observed: &[Option<f64>; 3],
        each: &mut dyn FnMut(D),
    ) {
        let recorded = self.view.recorded(position);
        for (simulated, observed) in recorded.into_iter().zip(observed) {
            if let Some(observed) = observed {
                each(simulated - D::from(*observed));
            }
        }
    }
}
