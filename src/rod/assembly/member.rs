//! A rod of an assembly with its carried and fixed nodes ([`Member`]), and the work space for its unknowns.
//!
//! `place` overwrites the unknowns of carried nodes by those that follow from the coordinates of bodies, and those of
//! fixed nodes by their positions with zero angles. `set_rates` does the same for velocities (zero for fixed nodes),
//! and `copy_frames` for the frames of carried edges. `unknowns_without_effect` lists the indices of the unknowns of
//! carried and then fixed nodes. `couplings` returns one block of zeros per carried end, for second derivatives: its
//! rows are the unknowns of the two nodes beside the end, its columns the body coordinates on which the end depends.
//! `carry` overwrites a list with the unknowns of all carried nodes and their derivatives by the coordinates of bodies.
//! The work space (`borrow`) is locked by one thread at a time and empty in a clone.
//!
//! `MotionOf` is the type of a carried node's unknowns, `MemberWorkspace` the work space, and `RodUnknowns` its
//! content.

use crate::numerics::scalar::RodScalar;
use crate::rod::assembly::attachment::{Attachment, CarriedNode, FixedNode};
use crate::rod::assembly::carrying::{CarriedMotion, CarryingBodies, MemberRod, VelocitySlopes};
use crate::rod::assembly::coupling::Coupling;
use crate::rod::assembly::frames::AssemblyFrames;
use crate::rod::assembly::layout::AssemblyLayout;
use crate::rod::{RodViscosity, Viscosity};
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The unknowns of a carried node of a layout.
pub(super) type MotionOf<D, L> = <<L as AssemblyLayout>::Bodies<D> as CarryingBodies<
    D,
    <L as AssemblyLayout>::Place<D>,
>>::Motion;

/// A rod of an assembly.
#[derive(Clone, Debug)]
pub struct Member<D: RodScalar, L: AssemblyLayout> {
    /// The rod.
    pub rod: L::Rod<D>,
    /// Range of its unknowns in those of the assembly.
    pub range: Range<usize>,
    /// Ends that bodies carry.
    pub attachments: Vec<Attachment<L::Place<D>>>,
    /// Nodes at walls.
    pub fixed: Vec<FixedNode<L::Place<D>>>,
    /// Factor on the viscous stresses and the stiffnesses of Maxwell branches of the rod.
    pub damping_factor: D,
}

impl<D: RodScalar, L: AssemblyLayout> Member<D, L> {
    /// Number of nodes of the rod, carried and fixed ones included.
    pub fn nodes(&self) -> usize {
        self.rod.edges() + 1
    }

    /// The part of this rod in the `viscosity` of all rods, where its strains begin at index `first`.
    pub(super) fn viscosity<'a>(
        &self,
        viscosity: &'a Viscosity<D>,
        first: usize,
    ) -> RodViscosity<'a, D> {
        RodViscosity { all: viscosity, first, scale: Some(self.damping_factor) }
    }

    /// All carried nodes, attachment after attachment.
    pub(super) fn carried(&self) -> impl Iterator<Item = &CarriedNode<L::Place<D>>> {
        self.attachments.iter().flat_map(|own| &own.nodes)
    }

    /// Indices of the unknowns of carried nodes, then of fixed ones, counted from the first unknown of the rod.
    pub fn unknowns_without_effect(&self) -> impl Iterator<Item = usize> {
        let carried = self.carried().map(|node| (node.node, node.width));
        let fixed = self.fixed.iter().map(|node| (node.node, node.width));
        carried.chain(fixed).flat_map(|(i, width)| L::STRIDE * i..L::STRIDE * i + width)
    }

    /// Overwrites `carried` with the unknowns of all carried nodes at the body coordinates `z`, in the order of
    /// [`carried`](Self::carried). Writes these, and positions of fixed nodes with zero angles, into the unknowns `q`
    /// of the rod.
    pub(super) fn place(
        &self,
        bodies: &L::Bodies<D>,
        z: &[D],
        frames: &AssemblyFrames<D>,
        q: &mut [D],
        carried: &mut Vec<MotionOf<D, L>>,
    ) {
        self.carry(bodies, z, frames, carried);
        for (node, motion) in self.carried().zip(&*carried) {
            q[L::STRIDE * node.node..][..node.width]
                .copy_from_slice(&motion.values()[..node.width]);
        }
        for FixedNode { node, width, position } in &self.fixed {
            let (to, position) = (&mut q[L::STRIDE * node..][..*width], position.as_ref());
            to[..position.len()].copy_from_slice(position);
            // A clamp at a wall also fixes the angle of its edge, measured from the fixed frame.
            to[position.len()..].fill(D::from(0.0));
        }
    }

    /// Overwrites `carried` with the unknowns of all carried nodes and their derivatives, at the body coordinates `z`.
    pub(super) fn carry(
        &self,
        bodies: &L::Bodies<D>,
        z: &[D],
        frames: &AssemblyFrames<D>,
        carried: &mut Vec<MotionOf<D, L>>,
    ) {
        carried.clear();
        self.attachments.iter().for_each(|own| bodies.carry(z, frames, own, carried));
    }

    /// Overwrites `to` with the frames of this rod, number `k`. The frame of each carried edge is replaced by that of
    /// its body or clamp at the coordinates `z`.
    pub(super) fn copy_frames(
        &self,
        k: usize,
        bodies: &L::Bodies<D>,
        z: &[D],
        frames: &AssemblyFrames<D>,
        to: &mut Option<L::RodFrames<D>>,
    ) {
        L::copy_frames(frames, k, to);
        let Some(to) = to else { return };
        for attachment in &self.attachments {
            let carried = bodies.edge_frame(z, frames, attachment);
            // The frame of a carried edge turns with its body, not by parallel transport: its angle stays zero.
            if let (Some(edge), Some(carried)) = (&attachment.edge, carried) {
                L::hold_edge(to, edge.edge, &carried);
            }
        }
    }

    /// Overwrites the entries of carried nodes in `rates`, those of this rod, with their derivatives times the rates
    /// `z_rates` of the body coordinates (increments of rotations). Entries of fixed nodes become zero.
    pub(super) fn set_rates(&self, carried: &[MotionOf<D, L>], z_rates: &[D], rates: &mut [D]) {
        for (node, carried) in self.carried().zip(carried) {
            for c in 0..node.width {
                let mut rate = D::from(0.0);
                for k in 0..carried.count() {
                    rate += carried.slope(k)[c] * z_rates[carried.coordinate(k)];
                }
                rates[L::STRIDE * node.node + c] = rate;
            }
        }
        for FixedNode { node, width, .. } in &self.fixed {
            rates[L::STRIDE * node..][..*width].fill(D::from(0.0));
        }
    }

    /// The couplings of its carried ends, one per attachment, with zero entries. Rows are the `2 STRIDE` unknowns after
    /// the last carried one of the first end, or before the first carried one of the last end. Columns are the
    /// coordinates of the attachment.
    pub(super) fn couplings(&self, bodies: &L::Bodies<D>) -> Vec<Coupling<D>> {
        // Elements reach two nodes beyond a carried one; no other unknowns of the rod are coupled to the body.
        let rows = 2 * L::STRIDE;
        let coupling = |attachment: &Attachment<L::Place<D>>| {
            let columns = bodies.coordinates(attachment);
            let nodes = &attachment.nodes;
            let start = match nodes.iter().find(|node| node.node == 0) {
                // The unknowns after those of the last carried node, or before those of the first.
                Some(_) => nodes
                    .iter()
                    .map(|node| L::STRIDE * node.node + node.width)
                    .max()
                    .unwrap_or_default(),
                None => {
                    let first = nodes.iter().map(|node| L::STRIDE * node.node).min();
                    first.unwrap_or_default().saturating_sub(rows)
                }
            };
            let entries = vec![D::from(0.0); rows * columns.len()];
            Coupling { rows: start..start + rows, columns, entries }
        };
        self.attachments.iter().map(coupling).collect()
    }
}

/// Unknowns of one rod, as work space; empty in a clone.
#[derive(Debug)]
pub(super) struct MemberWorkspace<D: RodScalar, L: AssemblyLayout>(Mutex<RodUnknowns<D, L>>);

/// Unknowns of one rod.
#[derive(Debug)]
pub(super) struct RodUnknowns<D: RodScalar, L: AssemblyLayout> {
    /// Unknowns, carried nodes included.
    pub q: Vec<D>,
    /// Its frames, with those of carried edges.
    pub frames: Option<L::RodFrames<D>>,
    /// Its carried nodes.
    pub carried: Vec<MotionOf<D, L>>,
    /// Unknowns, or changes of them, at another time.
    pub other: Vec<D>,
    /// Carried nodes at that time.
    pub other_carried: Vec<MotionOf<D, L>>,
    /// One or more numbers for each element, such as strains or axial forces.
    pub elements: Vec<D>,
    /// Slopes of the velocities of its carried nodes.
    pub slopes: Vec<VelocitySlopes<D>>,
}

impl<D: RodScalar, L: AssemblyLayout> Default for RodUnknowns<D, L> {
    /// Empty lists and no frames.
    fn default() -> Self {
        Self {
            q: Vec::new(),
            frames: None,
            carried: Vec::new(),
            other: Vec::new(),
            other_carried: Vec::new(),
            elements: Vec::new(),
            slopes: Vec::new(),
        }
    }
}

impl<D: RodScalar, L: AssemblyLayout> Default for MemberWorkspace<D, L> {
    /// An unlocked work space with empty lists.
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<D: RodScalar, L: AssemblyLayout> Clone for MemberWorkspace<D, L> {
    /// An empty work space: numbers are not copied.
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl<D: RodScalar, L: AssemblyLayout> MemberWorkspace<D, L> {
    /// Locks the work space for this thread; a lock that another thread left by a panic is taken too.
    pub fn borrow(&self) -> MutexGuard<'_, RodUnknowns<D, L>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
