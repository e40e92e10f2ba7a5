//! The layout of an assembly, in the plane or in space.

use crate::energy::frame::{EdgeFrame, Frames};
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::tangent::Tangent;
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
    type RodFrames<D: Nestable>: ReferenceFrames<D>;
    /// The second derivatives of the energy of a rod.
    type Band<D: Nestable>: Tangent<D>;
    /// A rod.
    type Rod<D: Nestable>: MemberRod<D>
        + Rod<D, Tangent = Self::Band<D>, Frames = Self::RodFrames<D>>;
    /// The bodies and springs.
    type Bodies<D: Nestable>: CarryingBodies<D, Self::Place<D>>;

    /// The place with `component(c)` for each of its components.
    fn place<D: Scalar>(component: impl Fn(usize) -> D) -> Self::Place<D>;

    /// Copies the frames of rod `k`.
    fn copy_frames<D: Nestable>(
        all: &AssemblyFrames<D>,
        k: usize,
        to: &mut Option<Self::RodFrames<D>>,
    );

    /// Stores the frames of rod `k`.
    fn store_frames<D: Nestable>(
        _own: Self::RodFrames<D>,
        _k: usize,
        _all: &mut AssemblyFrames<D>,
    ) {
    }

    /// Replaces the frame of edge `j` by its carried one, from which its angle is zero. No energy changes.
    fn hold_edge<D: Nestable>(
        _frames: &mut Self::RodFrames<D>,
        _j: usize,
        _carried: &EdgeFrame<D>,
    ) {
    }
}

impl AssemblyLayout for Plane {
    const STRIDE: usize = <Self as Layout<2, 1>>::STRIDE;
    type Place<D: Scalar> = [D; 2];
    type RodFrames<D: Nestable> = ();
    type Band<D: Nestable> = <Self as Layout<2, 1>>::Tangent<D>;
    type Rod<D: Nestable> = DiscreteRod<D, Self, 2, 1>;
    type Bodies<D: Nestable> = Bodies<D>;

    /// The place with `component(c)` for each of its components.
    fn place<D: Scalar>(component: impl Fn(usize) -> D) -> [D; 2] {
        [component(0), component(1)]
    }

    /// A planar rod has no frames.
    fn copy_frames<D: Nestable>(_: &AssemblyFrames<D>, _: usize, to: &mut Option<()>) {
        *to = Some(());
    }
}

impl AssemblyLayout for Space {
    const STRIDE: usize = <Self as Layout<3, 3>>::STRIDE;
    type Place<D: Scalar> = [D; 3];
    type RodFrames<D: Nestable> = Frames<D>;
    type Band<D: Nestable> = <Self as Layout<3, 3>>::Tangent<D>;
    type Rod<D: Nestable> = DiscreteRod<D, Self, 3, 3>;
    type Bodies<D: Nestable> = SpatialBodies<D>;

    /// The place with `component(c)` for each of its components.
    fn place<D: Scalar>(component: impl Fn(usize) -> D) -> [D; 3] {
        [component(0), component(1), component(2)]
    }

    /// Copies the frames of rod `k`.
    fn copy_frames<D: Nestable>(all: &AssemblyFrames<D>, k: usize, to: &mut Option<Frames<D>>) {
        match to {
            Some(to) => to.clone_from(&all.rods[k]),
            None => *to = Some(all.rods[k].clone()),
        }
    }

    /// Stores the frames of rod `k`.
    fn store_frames<D: Nestable>(own: Frames<D>, k: usize, all: &mut AssemblyFrames<D>) {
        all.rods[k] = own;
    }

    /// Replaces the frame of edge `j` by its carried one, from which its angle is zero. No energy changes.
    fn hold_edge<D: Nestable>(frames: &mut Frames<D>, j: usize, carried: &EdgeFrame<D>) {
        frames.replace(j, carried);
    }
}
