//! Drag in the equations of a step: forces (N) added to the elastic gradient, and their derivatives (N/m) added to
//! the tangent.
//!
//! Input: drag coefficients of the nodes, the state before the step, the iterate, and the elastic gradient and tangent.
//! Drag acts at the velocities of the step that mass damping acts on: those at its end, or the mean velocity of an
//! averaging scheme. The rod's tangents are those at the places `q0 + h v0`, constant over the iteration. Output:
//! `total`, the gradient less the drag forces, and `matrix`, its derivative by the unknowns at the end. `begin`
//! computes the tangents of the rod, `find` overwrites `total` and `set_matrix` overwrites `matrix`. For the start of a
//! step `add_now` adds minus the drag at given places and velocities to a list of forces.

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::step::Step;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::Vector;
use crate::rod::{NodalDrag, State};

/// The drag of a step.
#[derive(Clone, Debug)]
pub(super) struct DragForces<D, T> {
    /// Unit tangents of the rod at all nodes.
    tangents: Vec<Vector<D>>,
    /// Expected places at the end of the step, m; then velocities, m/s.
    room: Vec<D>,
    /// The elastic gradient with the drag, N (N m for angles).
    pub total: Vec<D>,
    /// The tangent with that of the drag, N/m.
    pub matrix: T,
}

impl<D: RodScalar, T: Tangent<D>> DragForces<D, T> {
    /// Work arrays without drag, for a rod with `n` unknowns. `matrix` is any matrix with the pattern of its tangent.
    pub fn new(n: usize, matrix: T) -> Self {
        let zero = vec![D::from(0.0); n];
        Self { tangents: Vec::new(), room: zero.clone(), total: zero, matrix }
    }

    /// Begins a step of size `h`, s: computes the unit tangents of the rod at the predicted places `q0 + h v0` of the
    /// state `before`.
    pub fn begin<F>(&mut self, drag: &NodalDrag<D>, before: &State<D, F>, h: f64) {
        // Tangents at predicted places are constant over the iteration; their error is of second
        // order in the step.
        for (x, (q, v)) in self.room.iter_mut().zip(before.q.iter().zip(&before.v)) {
            *x = *q + *v * h;
        }
        drag.tangents(&self.room, &mut self.tangents);
    }

    /// Overwrites `total` with the forces of the iterate `now`, N: the `gradient` of the solver less the drag forces at
    /// the [damped velocities](StepCoefficients::damped_velocity). These follow from the change since `before`.
    /// Unknowns that are not free keep their velocities in `now`.
    pub fn find<R, F>(
        &mut self,
        step: &Step<'_, D, R>,
        drag: &NodalDrag<D>,
        coefficients: &StepCoefficients<D>,
        [before, now]: [&State<D, F>; 2],
        gradient: &[D],
    ) {
        // Held unknowns have prescribed velocities; those of free ones follow from the iterate.
        self.room.copy_from_slice(&now.v);
        for i in step.system.free.clone() {
            let a0 = before.acceleration.get(i).copied().unwrap_or(D::from(0.0));
            self.room[i] = coefficients.damped_velocity(now.q[i] - before.q[i], before.v[i], a0);
        }
        self.total.copy_from_slice(gradient);
        drag.add_forces(&self.tangents, &self.room, &mut self.total);
    }

    /// Overwrites `matrix` with the elastic `tangent` plus that of the drag at the velocities of the last
    /// [`find`](Self::find), N/m. `slope` is the derivative of the velocity by the unknown, 1/s.
    pub fn set_matrix(&mut self, drag: &NodalDrag<D>, slope: D, tangent: &T) {
        self.matrix.clone_from(tangent);
        drag.add_slopes(&self.tangents, &self.room, slope, &mut self.matrix);
    }

    /// Adds minus the drag on a rod with the unknowns `q` and velocities `v`, N, to `forces`. Overwrites the stored
    /// tangents with those at `q`.
    pub fn add_now(&mut self, drag: &NodalDrag<D>, [q, v]: [&[D]; 2], forces: &mut [D]) {
        drag.tangents(q, &mut self.tangents);
        drag.add_forces(&self.tangents, v, forces);
    }
}
