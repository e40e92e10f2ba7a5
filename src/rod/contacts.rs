//! Contacts of a rod with obstacles: sums of energy (J), gradient (N) and tangent (N/m) over all edges.
//!
//! Input: the unknowns of the rod (m; angles have no part), and for each contact an obstacle in the axes of the model
//! with the parts of all edges that may touch it. Its stiffness is the force per length over the square of the overlap,
//! N/m^3. Energy and derivatives of one edge are those of [`edge_contact`](crate::energy::edge_contact). `add_gradient`
//! and `add_tangent` add them to those of the rod. Damping and friction (`have_losses`) depend on the velocities of a
//! step (`add_losses`): minus their forces (N) and the unsymmetric derivatives (N/m) are added to the equations of a
//! step only ([`contact_loss`](crate::energy::contact_loss)). `gradients` returns minus the forces of each contact
//! alone, losses included. `passed_obstacle` finds the first obstacle through which a step has led an edge
//! ([`swept_edge`](crate::energy::swept_edge)). Velocities and paths of edges are relative to a moved obstacle
//! (`moved_obstacles`). The list is empty in scenes without contacts.
//!
//! `RodContacts` are all contacts, `RodContact` is that with one obstacle, and `MovedObstacle` the motion of that.
//! `StepVelocities` are the velocities of all unknowns in a step, with their derivative by the unknown.

use crate::energy::contact_loss::LossyContact;
use crate::energy::edge_contact::{ContactDerivatives, EdgeContact};
use crate::energy::overlap::{ContactPart, EdgePart};
use crate::energy::swept_edge::passes_obstacle;
use crate::numerics::banded::BandMatrix;
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::tangent::{Tangent, UnsymmetricTangent};
use crate::numerics::vector::{Vector, add, components};
use crate::scene::contact::{ContactLoss, Obstacle};
use crate::scene::obstacle_motion::ObstaclePath;

/// Contact of all edges of a rod with one obstacle.
#[derive(Clone, Debug)]
pub struct RodContact<D> {
    /// The obstacle along the axes of the model, at its place at the end of the present step.
    pub(crate) obstacle: Obstacle<D>,
    /// Its prescribed motion; none of a fixed obstacle.
    pub(crate) moved: Option<MovedObstacle<D>>,
    /// Force per length over the square of the overlap, N/m^3.
    pub(crate) stiffness: D,
    /// The numbers of the forces that depend on the velocity; none without any.
    pub(crate) loss: Option<ContactLoss<D>>,
    /// The parts of all edges, in their order.
    pub(crate) parts: Vec<ContactPart<D>>,
}

/// Motion of an obstacle along the axes of the model.
#[derive(Clone, Debug)]
pub(crate) struct MovedObstacle<D> {
    /// Point of the obstacle at t = 0, m.
    pub start: Vector<D>,
    /// Its displacement in time.
    pub path: ObstaclePath<D>,
    /// Velocity at the end of the present step, m/s.
    pub velocity: Vector<D>,
    /// Displacement in the present step, m.
    pub movement: Vector<D>,
}

/// Velocities of all unknowns in a step of a simulation.
#[derive(Clone, Copy, Debug)]
pub struct StepVelocities<'a, D> {
    /// The velocities, m/s (rad/s for angles).
    pub velocity: &'a [D],
    /// Their derivative by the unknowns at the end of the step, 1/s.
    pub slope: D,
}

/// All contacts of a rod.
#[derive(Clone, Debug)]
pub struct RodContacts<D> {
    /// The contacts, in the order of the scene.
    pub(crate) list: Vec<RodContact<D>>,
}

impl<D> Default for RodContacts<D> {
    /// No contacts.
    fn default() -> Self {
        Self { list: Vec::new() }
    }
}

/// The positions of both nodes of an edge, whose unknowns begin at `first`; nodes have `A` coordinates and `S`
/// unknowns. The third coordinate in the plane is zero.
#[inline(always)]
fn edge_nodes<D: Scalar, const A: usize, const S: usize>(q: &[D], first: usize) -> [Vector<D>; 2] {
    let (mut nodes, q) = ([[D::from(0.0); 3]; 2], &q[first..first + S + A]);
    for c in 0..A {
        (nodes[0][c], nodes[1][c]) = (q[c], q[S + c]);
    }
    nodes
}

impl<D: Scalar> RodContact<D> {
    /// Adds the gradient at `q`, N, of a rod whose nodes have `A` coordinates and `S` unknowns, with `U = S + A` of an
    /// edge.
    fn sum_gradient<const A: usize, const S: usize, const U: usize>(
        &self,
        q: &[D],
        gradient: &mut [D],
    ) {
        let mut local = ContactDerivatives::<D, U>::zero();
        for (i, edge) in self.edges().enumerate() {
            let nodes = edge_nodes::<D, A, S>(q, S * i);
            if edge.edge.is_apart(nodes) {
                continue;
            }
            for k in 0..edge.edge.surfaces() {
                if edge.derive::<A, U>(k, nodes, false, &mut local) {
                    add_local::<D, U>(&local, S * i, gradient);
                }
            }
        }
    }

    /// The contact of each edge of the rod with the obstacle, in the order of the edges.
    #[inline]
    fn edges(&self) -> impl Iterator<Item = EdgeContact<'_, D>> {
        let Self { obstacle, stiffness, parts, .. } = self;
        parts
            .iter()
            .map(|part| EdgeContact { edge: EdgePart { obstacle, part }, stiffness: *stiffness })
    }
}

impl<D: Scalar> RodContacts<D> {
    /// Whether there are no contacts.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The energy of all contacts at the unknowns `q` of a rod in `N` dimensions, J, without derivatives.
    pub(super) fn energy<const N: usize>(&self, q: &[D]) -> f64 {
        match N {
            2 => self.sum_energy::<2, 2>(q),
            _ => self.sum_energy::<3, 4>(q),
        }
    }

    /// The index of the first contact through whose obstacle some edge of a rod in `N` dimensions passes in a step from
    /// the unknowns `before` to `now`, on straight lines relative to the obstacle, which moves by its movement in the
    /// step; `None` without one. Derivatives have no influence.
    pub(super) fn passed_obstacle<const N: usize>(&self, before: &[D], now: &[D]) -> Option<usize> {
        match N {
            2 => self.find_passed::<2, 2>(before, now),
            _ => self.find_passed::<3, 4>(before, now),
        }
    }

    /// [`passed_obstacle`](Self::passed_obstacle) of a rod whose nodes have `A` coordinates and `S` unknowns.
    fn find_passed<const A: usize, const S: usize>(
        &self,
        before: &[D],
        now: &[D],
    ) -> Option<usize> {
        self.list.iter().position(|contact| {
            let obstacle = contact.obstacle.map(|x| x.value());
            let moved = contact.moved.as_ref().map(|moved| moved.movement.map(|x| x.value()));
            contact.parts.iter().enumerate().any(|(i, part)| {
                let part = part.map(|x| x.value());
                let [mut before, now] = [before, now]
                    .map(|q| edge_nodes::<D, A, S>(q, S * i).map(|node| node.map(|x| x.value())));
                // Places before the step relative to the obstacle after it.
                if let Some(movement) = moved {
                    before = before.map(|node| add(node, movement));
                }
                passes_obstacle(EdgePart { obstacle: &obstacle, part: &part }, before, now)
            })
        })
    }

    /// Adds the gradient of the energy of all contacts at the unknowns `q` of a rod in `N` dimensions, N.
    pub(super) fn add_gradient<const N: usize>(&self, q: &[D], gradient: &mut [D]) {
        for contact in &self.list {
            match N {
                2 => contact.sum_gradient::<2, 2, 4>(q, gradient),
                _ => contact.sum_gradient::<3, 4, 7>(q, gradient),
            }
        }
    }

    /// Adds gradient, N, and second derivatives, N/m, of the energy of all contacts at the unknowns `q` of a rod in `N`
    /// dimensions.
    pub(super) fn add_tangent<const N: usize>(
        &self,
        q: &[D],
        gradient: &mut [D],
        tangent: &mut impl Tangent<D>,
    ) {
        match N {
            2 => self.sum_tangent::<2, 2, 4>(q, gradient, tangent),
            _ => self.sum_tangent::<3, 4, 7>(q, gradient, tangent),
        }
    }

    /// The energy at the unknowns `q`, J, of a rod whose nodes have `A` coordinates and `S` unknowns.
    fn sum_energy<const A: usize, const S: usize>(&self, q: &[D]) -> f64 {
        let mut sum = 0.0;
        for contact in &self.list {
            for (i, edge) in contact.edges().enumerate() {
                sum += edge.energy(edge_nodes::<D, A, S>(q, S * i)).value();
            }
        }
        sum
    }

    /// Adds gradient, N, and second derivatives, N/m, at `q`, of a rod whose nodes have `A` coordinates and `S`
    /// unknowns, with `U = S + A` of an edge.
    fn sum_tangent<const A: usize, const S: usize, const U: usize>(
        &self,
        q: &[D],
        gradient: &mut [D],
        tangent: &mut impl Tangent<D>,
    ) {
        let mut local = ContactDerivatives::<D, U>::zero();
        for contact in &self.list {
            for (i, edge) in contact.edges().enumerate() {
                let nodes = edge_nodes::<D, A, S>(q, S * i);
                if edge.edge.is_apart(nodes) {
                    continue;
                }
                for k in 0..edge.edge.surfaces() {
                    if edge.derive::<A, U>(k, nodes, true, &mut local) {
                        add_local::<D, U>(&local, S * i, gradient);
                        tangent.add_corner(S * i, U, &local.hessian);
                    }
                }
            }
        }
    }
}

impl<D: RodScalar> RodContacts<D> {
    /// Whether a contact has forces that depend on the velocity.
    pub fn have_losses(&self) -> bool {
        self.list.iter().any(|contact| contact.loss.is_some())
    }

    /// Minus the forces of each contact on all unknowns, N, damping and friction included, at the unknowns `q` and
    /// velocities `v` (m/s) of a rod in `N` dimensions: one list per contact, in the order of the scene.
    pub(super) fn gradients<const N: usize>(&self, q: &[D], v: &[D]) -> Vec<Vec<D>> {
        let gradient = |contact: &RodContact<D>| {
            let mut gradient = vec![D::from(0.0); q.len()];
            contact.add_forces::<N>(q, v, &mut gradient);
            gradient
        };
        self.list.iter().map(gradient).collect()
    }

    /// Adds minus the forces that depend on the velocity, N, to `gradient`, and their derivatives by the unknowns at
    /// the end of a step, N/m, to `tangent` if it is given. The rod has the unknowns `q` in `N` dimensions.
    pub(super) fn add_losses<const N: usize>(
        &self,
        q: &[D],
        velocities: StepVelocities<'_, D>,
        gradient: &mut [D],
        mut tangent: Option<&mut impl UnsymmetricTangent<D>>,
    ) {
        for contact in &self.list {
            let tangent = tangent.as_deref_mut();
            match N {
                2 => contact.sum_losses::<2, 2, 4>(q, velocities, gradient, tangent),
                _ => contact.sum_losses::<3, 4, 7>(q, velocities, gradient, tangent),
            }
        }
    }
}

impl<D: RodScalar> RodContact<D> {
    /// Adds minus all forces of the contact, N, damping and friction included, at the unknowns `q` and velocities `v`
    /// of a rod in `N` dimensions.
    pub(super) fn add_forces<const N: usize>(&self, q: &[D], v: &[D], gradient: &mut [D]) {
        let velocities = StepVelocities { velocity: v, slope: D::from(0.0) };
        // Without a tangent any matrix type serves.
        let no_tangent = None::<&mut BandMatrix<D, 1>>;
        match N {
            2 => {
                self.sum_gradient::<2, 2, 4>(q, gradient);
                self.sum_losses::<2, 2, 4>(q, velocities, gradient, no_tangent);
            }
            _ => {
                self.sum_gradient::<3, 4, 7>(q, gradient);
                self.sum_losses::<3, 4, 7>(q, velocities, gradient, no_tangent);
            }
        }
    }

    /// Adds minus the forces that depend on the velocity, and their derivatives, as
    /// [`add_losses`](RodContacts::add_losses), of a rod whose nodes have `A` coordinates and `S` unknowns, with `U = S
    /// + A` of an edge. Nothing without damping and friction.
    fn sum_losses<const A: usize, const S: usize, const U: usize>(
        &self,
        q: &[D],
        StepVelocities { velocity, slope }: StepVelocities<'_, D>,
        gradient: &mut [D],
        mut tangent: Option<&mut impl UnsymmetricTangent<D>>,
    ) {
        let Some(loss) = self.loss else { return };
        for (i, edge) in self.edges().enumerate() {
            let lossy = LossyContact { contact: edge, loss };
            let of_edge = |x: &[D]| components(|k| x[S * i + k]);
            let (q, mut v): ([D; U], [D; U]) = (of_edge(q), of_edge(velocity));
            if !lossy.touches::<A, U>(&q) {
                continue;
            }
            // The forces depend on velocities relative to the obstacle.
            if let Some(moved) = &self.moved {
                for c in 0..A {
                    v[c] -= moved.velocity[c];
                    v[S + c] -= moved.velocity[c];
                }
            }
            let forces = lossy.forces::<A, U>(&q, &v);
            gradient[S * i..].iter_mut().zip(forces).for_each(|(to, force)| *to += force);
            if let Some(tangent) = &mut tangent {
                tangent.add_unsymmetric(S * i, U, &lossy.tangent::<A, U>(&q, &v, slope));
            }
        }
    }
}

/// Adds the gradient of an edge, whose unknowns begin at `first`, to that of the rod.
#[inline(always)]
fn add_local<D: Scalar, const U: usize>(
    local: &ContactDerivatives<D, U>,
    first: usize,
    gradient: &mut [D],
) {
    let gradient = &mut gradient[first..first + U];
    for i in 0..U {
        gradient[i] += local.gradient[i];
    }
}
