//! The layout of an assembly, [`Plane`] or [`Space`]: its types, and the copies of frames between an assembly and its
//! rods.
//!
//! [`AssemblyLayout`] has the unknowns from one node to the next (2 or 4), a place of two or three components, m, and
//! the types of rods, their frames, their band matrices, and bodies. `copy_frames` copies the frames of rod `k` from
//! those of the assembly, `store_frames` writes them back. `hold_edge` replaces the frame of one edge by that which a
//! body carries, and adapts the reference twists of its joints. In a plane frames are empty, and these functions have
//! no effect.

use crate::energy::frame::{EdgeFrame, Frames};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::tangent::UnsymmetricTangent;
use crate::rod::assembly::bodies::Bodies;
use crate::rod::assembly::carrying::{CarryingBodies, MemberRod};
use crate::rod::assembly::frames::AssemblyFrames;
use crate::rod::assembly::spatial_bodies::SpatialBodies;
use crate::rod::layout::{Layout, Plane, Space};
use crate::rod::{DiscreteRod, ReferenceFrames, Rod};
use std::fmt::Debug;

/// The layout of an assembly: [`Plane`] or [`Space`].
pub trait AssemblyLayout: Copy + Debug + Send + Sync + 'static {
    /// Unknowns from one node to the next.
    const STRIDE: usize;
    /// A place, m.
    type Place<D: Scalar>: Copy + Debug + Send + Sync + AsRef<[D]>;
    /// The frames of a rod.
    type RodFrames<D: RodScalar>: ReferenceFrames<D>;
    /// The second derivatives of the energy of a rod.
    type Band<D: RodScalar>: UnsymmetricTangent<D>;
    /// A rod.
    type Rod<D: RodScalar>: MemberRod<D>
        + Rod<D, Tangent = Self::Band<D>, Frames = Self::RodFrames<D>>;
    /// The bodies and springs.
    type Bodies<D: RodScalar>: CarryingBodies<D, Self::Place<D>>;

    /// The place with `component(c)` at index `c`: two components in a plane, three in space.
    fn place<D: Scalar>(component: impl Fn(usize) -> D) -> Self::Place<D>;

    /// Overwrites `to` with a copy of the frames of rod `k`; in a plane with the empty frames.
    fn copy_frames<D: RodScalar>(
        all: &AssemblyFrames<D>,
        k: usize,
        to: &mut Option<Self::RodFrames<D>>,
    );

    /// Overwrites the frames of rod `k` in `all` with `own`. The default, of the plane, does nothing.
    fn store_frames<D: RodScalar>(
        _own: Self::RodFrames<D>,
        _k: usize,
        _all: &mut AssemblyFrames<D>,
    ) {
    }

    /// Replaces the frame of edge `j` by the `carried` one, and adapts the reference twists of its joints. Strains stay
    /// if the angle of the edge is reduced by the turn between both frames. The default, of the plane, does nothing.
    fn hold_edge<D: RodScalar>(
        _frames: &mut Self::RodFrames<D>,
        _j: usize,
        _carried: &EdgeFrame<D>,
    ) {
    }
}

impl AssemblyLayout for Plane {
    const STRIDE: usize = <Self as Layout<2, 1>>::STRIDE;
    type Place<D: Scalar> = [D; 2];
    type RodFrames<D: RodScalar> = ();
    type Band<D: RodScalar> = <Self as Layout<2, 1>>::Tangent<D>;
    type Rod<D: RodScalar> = DiscreteRod<D, Self, 2, 1>;
    type Bodies<D: RodScalar> = Bodies<D>;

    /// The place `[component(0), component(1)]`.
    fn place<D: Scalar>(component: impl Fn(usize) -> D) -> [D; 2] {
        [component(0), component(1)]
    }

    /// Sets `to` to the empty frames of a planar rod.
    fn copy_frames<D: RodScalar>(_: &AssemblyFrames<D>, _: usize, to: &mut Option<()>) {
        *to = Some(());
    }
}

impl AssemblyLayout for Space {
    const STRIDE: usize = <Self as Layout<3, 3>>::STRIDE;
    type Place<D: Scalar> = [D; 3];
    type RodFrames<D: RodScalar> = Frames<D>;
    type Band<D: RodScalar> = <Self as Layout<3, 3>>::Tangent<D>;
    type Rod<D: RodScalar> = DiscreteRod<D, Self, 3, 3>;
    type Bodies<D: RodScalar> = SpatialBodies<D>;

    /// The place `[component(0), component(1), component(2)]`.
    fn place<D: Scalar>(component: impl Fn(usize) -> D) -> [D; 3] {
        [component(0), component(1), component(2)]
    }

    /// Overwrites `to` with a copy of the frames of rod `k`; allocated lists are reused.
    fn copy_frames<D: RodScalar>(all: &AssemblyFrames<D>, k: usize, to: &mut Option<Frames<D>>) {
        match to {
            Some(to) => to.clone_from(&all.rods[k]),
            None => *to = Some(all.rods[k].clone()),
        }
    }

    /// Overwrites the frames of rod `k` in `all` with `own`.
    fn store_frames<D: RodScalar>(own: Frames<D>, k: usize, all: &mut AssemblyFrames<D>) {
        all.rods[k] = own;
    }

    /// Replaces the frame of edge `j` by the `carried` one, and adapts the reference twists of its joints. Strains stay
    /// if the angle of the edge is reduced by the turn between both frames.
    fn hold_edge<D: RodScalar>(frames: &mut Frames<D>, j: usize, carried: &EdgeFrame<D>) {
        frames.replace(j, carried);
    }
}
