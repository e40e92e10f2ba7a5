//! Obstacles with a prescribed translation: their places in a step, and the work that they do on the rod, J.
//!
//! Contact forces depend on the place and velocity of an obstacle at the end of a step. `move_obstacles` sets both for
//! a step between two times, s, with the movement in it, m, which the search for passed obstacles needs.
//! `copy_obstacles` takes the places from another rod. An obstacle does the work `F . movement`, with the force `F` on
//! the rod, damping and friction included. `obstacle_work` is that of all moved obstacles, with the forces in one
//! state; the mean of both ends of a step is of second order. Without moved obstacles nothing changes, and the work is
//! zero.

use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{add, sub};
use crate::rod::contacts::{MovedObstacle, RodContact, RodContacts};

impl<D: Scalar> RodContacts<D> {
    /// Whether an obstacle has a prescribed motion.
    pub fn have_moved_obstacles(&self) -> bool {
        self.list.iter().any(|contact| contact.moved.is_some())
    }

    /// Overwrites the places of all obstacles with those of the contacts `other` of the same rod.
    pub(super) fn copy_obstacles(&mut self, other: &Self) {
        for (own, other) in self.list.iter_mut().zip(&other.list) {
            if other.moved.is_some() {
                own.obstacle = other.obstacle;
            }
        }
    }
}

impl<D: RodScalar> RodContact<D> {
    /// Moves the obstacle to its place at the end of the step between two times, s, and sets its velocity there and its
    /// movement in the step. Fixed obstacles stay.
    fn move_obstacle(&mut self, [from, to]: [f64; 2]) {
        let Some(MovedObstacle { start, path, velocity, movement }) = &mut self.moved else {
            return;
        };
        let now = path.displacement(to);
        self.obstacle.point = add(*start, now);
        *velocity = path.velocity(to);
        *movement = sub(now, path.displacement(from));
    }
}

impl<D: RodScalar> RodContacts<D> {
    /// Moves all obstacles to their places at the end of the step between two times, s.
    pub fn move_obstacles(&mut self, interval: [f64; 2]) {
        self.list.iter_mut().for_each(|contact| contact.move_obstacle(interval));
    }

    /// The work, J, of the obstacles in their movement between two times, s, with the forces at the unknowns `q` and
    /// velocities `v` of a rod in `N` dimensions, and at the present places of the obstacles.
    pub(super) fn obstacle_work<const N: usize>(
        &self,
        [from, to]: [f64; 2],
        q: &[D],
        v: &[D],
    ) -> f64 {
        // A node has as many coordinates as there are dimensions, and in space the angle of its edge.
        let stride = if N == 2 { 2 } else { 4 };
        let mut work = 0.0;
        let mut gradient = vec![D::from(0.0); q.len()];
        for contact in &self.list {
            let Some(MovedObstacle { path, .. }) = &contact.moved else { continue };
            let movement = sub(path.displacement(to), path.displacement(from));
            gradient.fill(D::from(0.0));
            contact.add_forces::<N>(q, v, &mut gradient);
            for node in gradient.chunks(stride) {
                // The gradient is minus the force.
                (0..N).for_each(|c| work -= node[c].value() * movement[c].value());
            }
        }
        work
    }
}
