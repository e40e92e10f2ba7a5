//! Drag while Newton's method iterates.
//!
//! Drag counts with the velocities at the end of the step. The tangents are those of the rod as it would be if
//! its velocities stayed what they are at the start of the step: of second order in the step, and the same in every iteration.

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::step::Step;
use crate::numerics::scalar::Nestable;
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::Vector;
use crate::rod::{NodalDrag, State};

/// The drag of a step.
#[derive(Clone, Debug)]
pub(super) struct Dragging<D, T> {
    tangents: Vec<Vector<D>>,
    /// Places at the end of the step as they were expected at its start, m; then velocities, m/s.
    room: Vec<D>,
    /// The elastic gradient with the drag, N (N m for angles).
    pub total: Vec<D>,
    /// The tangent with that of the drag, N/m.
    pub matrix: T,
}

impl<D: Nestable, T: Tangent<D>> Dragging<D, T> {
    /// Of a rod with `n` unknowns.
    pub fn new(n: usize) -> Self {
        let zero = vec![D::from(0.0); n];
        let matrix = T::zeros(n);
        Self { tangents: Vec::new(), room: zero.clone(), total: zero, matrix }
    }

    /// Begins a step.
    pub fn begin<F>(&mut self, drag: &NodalDrag<D>, before: &State<D, F>, h: f64) {
        for (x, (q, v)) in self.room.iter_mut().zip(before.q.iter().zip(&before.v)) {
            *x = *q + *v * h;
        }
        drag.tangents(&self.room, &mut self.tangents);
    }

    /// Finds the forces of an iteration, whose elastic gradient this is.
    pub fn find<R, F>(
        &mut self,
        (step, drag): (&Step<'_, D, R>, &NodalDrag<D>),
        coefficients: &StepCoefficients<D>,
        [before, now]: [&State<D, F>; 2],
        gradient: &[D],
    ) {
        self.room.copy_from_slice(&now.v);
        for i in step.system.free.clone() {
            let a0 = before.acceleration.get(i).copied().unwrap_or(D::from(0.0));
            self.room[i] = coefficients.damped_velocity(now.q[i] - before.q[i], before.v[i], a0);
        }
        self.total.copy_from_slice(gradient);
        drag.add_forces(&self.tangents, &self.room, &mut self.total);
    }

    /// Makes the matrix of the elastic tangent, where the forces were found.
    pub fn set_matrix(&mut self, drag: &NodalDrag<D>, slope: D, tangent: &T) {
        self.matrix.clone_from(tangent);
        drag.add_slopes(&self.tangents, &self.room, slope, &mut self.matrix);
    }

    /// Adds the drag on a rod in a state to its forces.
    pub fn add_now(&mut self, drag: &NodalDrag<D>, [q, v]: [&[D]; 2], forces: &mut [D]) {
        drag.tangents(q, &mut self.tangents);
        drag.add_forces(&self.tangents, v, forces);
    }
}
