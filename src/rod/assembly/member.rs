//! The rods of an assembly, with their carried and fixed nodes.

use crate::numerics::scalar::{Nestable, Scalar};
use crate::rod::PlanarRod;
use crate::rod::assembly::bodies::{Attachment, Bodies, CarriedNode, CarriedPosition};
use crate::rod::assembly::tangent::{Coupling, ROWS};
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A node at a wall.
#[derive(Clone, Copy, Debug)]
pub struct FixedNode<D> {
    /// Index of the node in its rod.
    pub node: usize,
    /// Position, m.
    pub position: [D; 2],
}

/// A rod of an assembly.
#[derive(Clone, Debug)]
pub struct Member<D: Scalar> {
    /// The rod.
    pub rod: PlanarRod<D>,
    /// Its unknowns in those of the assembly.
    pub range: Range<usize>,
    /// Ends that bodies carry.
    pub attachments: Vec<Attachment<D>>,
    /// Nodes at walls.
    pub fixed: Vec<FixedNode<D>>,
}

impl<D: Nestable> Member<D> {
    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.range.len() / 2
    }

    /// Number of strains: one of each edge, one of each joint.
    pub(super) fn strains(&self) -> usize {
        self.rod.stretch.len() + self.rod.joint.len()
    }

    /// Carried nodes with their attachments.
    pub(super) fn carried(&self) -> impl Iterator<Item = (&Attachment<D>, &CarriedNode<D>)> {
        let nodes = |own: &'_ Attachment<D>| own.nodes.len();
        self.attachments
            .iter()
            .flat_map(move |own| (0..nodes(own)).map(move |i| (own, &own.nodes[i])))
    }

    /// Unknowns of carried and fixed nodes, counted from the first of the rod.
    pub fn tied(&self) -> impl Iterator<Item = usize> {
        let carried = self.carried().map(|(_, node)| node.node);
        carried.chain(self.fixed.iter().map(|node| node.node)).flat_map(|i| 2 * i..2 * i + 2)
    }

    /// Writes the positions of all carried nodes, in the order of [`carried`](Self::carried), into `carried`, and those of
    /// carried and fixed nodes into the unknowns `q` of the rod.
    pub(super) fn place(
        &self,
        bodies: &Bodies<D>,
        z: &[D],
        q: &mut [D],
        carried: &mut Vec<CarriedPosition<D>>,
    ) {
        self.carry(bodies, z, carried);
        for ((_, node), carried) in self.carried().zip(&*carried) {
            q[2 * node.node..][..2].copy_from_slice(&carried.position);
        }
        for FixedNode { node, position } in &self.fixed {
            q[2 * node..][..2].copy_from_slice(position);
        }
    }

    /// Writes the positions of all carried nodes with their derivatives.
    pub(super) fn carry(&self, bodies: &Bodies<D>, z: &[D], carried: &mut Vec<CarriedPosition<D>>) {
        carried.clear();
        self.attachments.iter().for_each(|own| bodies.carry(z, own, carried));
    }

    /// Writes the rates of carried nodes along rates of the coordinates of bodies, and zeros for fixed nodes.
    pub(super) fn set_rates(&self, carried: &[CarriedPosition<D>], z_rates: &[D], rates: &mut [D]) {
        for ((_, node), carried) in self.carried().zip(carried) {
            for c in 0..2 {
                let mut rate = D::from(0.0);
                for k in 0..carried.count {
                    rate += carried.slopes[k][c] * z_rates[carried.coordinates[k]];
                }
                rates[2 * node.node + c] = rate;
            }
        }
        for FixedNode { node, .. } in &self.fixed {
            rates[2 * node..][..2].fill(D::from(0.0));
        }
    }

    /// The couplings of its carried ends, without entries.
    pub(super) fn couplings(&self, bodies: &Bodies<D>) -> Vec<Coupling<D>> {
        let coupling = |attachment: &Attachment<D>| {
            let columns = bodies.coordinates(attachment);
            let nodes = attachment.nodes.iter().map(|node| 2 * node.node);
            let [low, high] = [nodes.clone().min(), nodes.max()].map(Option::unwrap_or_default);
            // The two nodes beside the end, on its inner side.
            let start = if low == 0 { high + 2 } else { low - ROWS };
            let entries = vec![[D::from(0.0); ROWS]; columns.len()];
            Coupling { rows: start..start + ROWS, columns, entries }
        };
        self.attachments.iter().map(coupling).collect()
    }
}

/// Unknowns of one rod, as work space; empty in a clone.
#[derive(Debug)]
pub(super) struct MemberWorkspace<D>(Mutex<RodUnknowns<D>>);

/// Unknowns of one rod.
#[derive(Debug)]
pub(super) struct RodUnknowns<D> {
    /// Unknowns, carried nodes included.
    pub q: Vec<D>,
    /// Its carried nodes.
    pub carried: Vec<CarriedPosition<D>>,
    /// Unknowns, or changes of them, at another time.
    pub other: Vec<D>,
    /// Carried nodes at that time.
    pub other_carried: Vec<CarriedPosition<D>>,
    /// Numbers of the elements.
    pub elements: Vec<D>,
}

impl<D> Default for RodUnknowns<D> {
    fn default() -> Self {
        Self {
            q: Vec::new(),
            carried: Vec::new(),
            other: Vec::new(),
            other_carried: Vec::new(),
            elements: Vec::new(),
        }
    }
}

impl<D> Default for MemberWorkspace<D> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<D> Clone for MemberWorkspace<D> {
    /// A copy of the room.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<D> MemberWorkspace<D> {
    /// The work space, which no other thread uses meanwhile.
    pub fn borrow(&self) -> MutexGuard<'_, RodUnknowns<D>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
