//! Sweeps over the edges of a rod, several of them in SIMD lanes.

use crate::numerics::scalar::{Nestable, Scalar, Sweep, Wide};
use crate::rod::Energies;
use crate::rod::layout::{At, Layout};

/// The edges of a rod in blocks of as many as there are SIMD lanes.
pub trait EdgeBlocks<'a, D: Nestable, V: Wide<D>, L: Layout<N, S>, const N: usize, const S: usize>:
    Sized
{
    /// Edges, the edges after them, and the joints between. The joint after the last edge carries nothing.
    type Block;

    /// Before the first block.
    fn new(at: At<'a, D, L, N, S>, level: V::Level) -> Self;

    /// The next block.
    fn next(&mut self) -> Option<Self::Block>;

    /// The number of its first edge.
    fn first(block: &Self::Block) -> usize;

    /// The strains of its edges and joints.
    fn strains(&self, block: &Self::Block) -> (V, [V; S]);

    /// Energies of stretching, bending and twisting, J, without those of springs.
    fn energies(&self, block: &Self::Block) -> [V; 3];

    /// Writes its geometry.
    fn measure(&self, block: &Self::Block, geometry: &mut L::Geometry);
}

/// Writes the geometry.
pub(super) struct Measured<'a, D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> {
    pub at: At<'a, D, L, N, S>,
    pub geometry: &'a mut L::Geometry,
}

impl<D: Nestable, L: Layout<N, S>, const N: usize, const S: usize> Sweep<D>
    for Measured<'_, D, L, N, S>
{
    type Output = ();

    #[inline(always)]
    fn sweep<V: Wide<D>>(self, level: V::Level) {
        L::resize(self.geometry, self.at.elements.stretch.len());
        let mut blocks = L::Blocks::<'_, D, V>::new(self.at, level);
        while let Some(block) = blocks.next() {
            blocks.measure(&block, self.geometry);
        }
    }
}

/// Adds up the elastic energies, without those of springs.
pub(super) struct Elastic<'a, D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> {
    pub at: At<'a, D, L, N, S>,
}

impl<D: Nestable, L: Layout<N, S>, const N: usize, const S: usize> Sweep<D>
    for Elastic<'_, D, L, N, S>
{
    type Output = Energies;

    #[inline(always)]
    fn sweep<V: Wide<D>>(self, level: V::Level) -> Energies {
        let (mut sums, edges) = (Energies::default(), self.at.elements.stretch.len());
        let mut blocks = L::Blocks::<'_, D, V>::new(self.at, level);
        while let Some(block) = blocks.next() {
            let energies = blocks.energies(&block);
            for lane in 0..V::LANES.min(edges - L::Blocks::<'_, D, V>::first(&block)) {
                let [stretch, bend, twist] = V::lane_of(&energies, lane);
                sums.stretch += stretch.value();
                sums.bend += bend.value();
                sums.twist += twist.value();
            }
        }
        sums
    }
}

/// Writes the strains of edges and of joints.
pub(super) struct Strains<'a, D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> {
    pub at: At<'a, D, L, N, S>,
    pub edges: &'a mut [D],
    pub joints: &'a mut [[D; S]],
}

impl<D: Nestable, L: Layout<N, S>, const N: usize, const S: usize> Sweep<D>
    for Strains<'_, D, L, N, S>
{
    type Output = ();

    #[inline(always)]
    fn sweep<V: Wide<D>>(self, level: V::Level) {
        let mut blocks = L::Blocks::<'_, D, V>::new(self.at, level);
        while let Some(block) = blocks.next() {
            let first = L::Blocks::<'_, D, V>::first(&block);
            let (edges, joints) = blocks.strains(&block);
            for (lane, to) in self.edges[first..].iter_mut().take(V::LANES).enumerate() {
                *to = edges.lane(lane);
            }
            for (lane, to) in self.joints[first..].iter_mut().take(V::LANES).enumerate() {
                *to = V::lane_of(&joints, lane);
            }
        }
    }
}
