//! Sweeps over all edges of a rod in SIMD lanes: gradient and tangent, tangent by edges, geometry, energies, strains.
//!
//! Each struct has the rod at its unknowns ([`At`]) and the lists to be written, and implements [`Sweep`]: plain
//! numbers run in vector registers (AVX2 if the processor has it), dual numbers one at a time. [`TangentSweep`]
//! overwrites gradient, N, less dead loads, and tangent, N/m, with nonlinear bending and friction springs. Nonlinear
//! parts of stretching laws, moments, user-defined energies, contacts and follower loads are left out. [`EdgeTangent`]
//! adds second derivatives by edge vectors, N/m, with the same parts. [`GeometrySweep`] and [`Strains`] overwrite
//! geometry and strains. [`Elastic`] returns sums of stretching, bending and twisting energy of the linear laws, J, in
//! plain numbers. The formulas are those of the [`Layout`].

use crate::numerics::scalar::{RodScalar, SimdScalar, Sweep};
use crate::rod::Energies;
use crate::rod::frames::RodGeometry;
use crate::rod::layout::{At, EdgeBlocks, Layout, NodeSink};

/// Overwrites gradient, N, and tangent, N/m, and the geometry if there is one, by the hand-derived formulas.
pub(super) struct TangentSweep<'a, D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> {
    pub at: At<'a, D, L, N, S>,
    pub gradient: &'a mut [D],
    pub tangent: &'a mut L::Tangent<D>,
    pub geometry: Option<&'a mut L::Geometry>,
}

impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> Sweep<D>
    for TangentSweep<'_, D, L, N, S>
{
    type Output = ();

    /// Overwrites gradient (N, less the dead loads), tangent (N/m) and, if one is given, the geometry, which is
    /// resized. `V` holds one edge per SIMD lane. Nonlinear parts of stretching laws, moments, user-defined energies,
    /// contacts and follower loads are left out.
    #[inline(always)]
    fn sweep<V: SimdScalar<D>>(self, level: V::Level) {
        let (elements, mut geometry) = (self.at.elements, self.geometry);
        if let Some(geometry) = &mut geometry {
            geometry.resize(elements.stretch.len());
        }
        // The sink stores derivatives by nodes, so that each edge and joint is computed once.
        let mut nodes = L::node_sink::<D, V>(level, elements.load, self.gradient, self.tangent);
        L::Blocks::<'_, D, V>::new(self.at, level).derive(&mut nodes, geometry);
        nodes.end();
    }
}

/// Adds the tangent by edge vectors, N/m, by the hand-derived formulas.
pub(super) struct EdgeTangent<'a, D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> {
    pub at: At<'a, D, L, N, S>,
    pub tangent: &'a mut L::Tangent<D>,
}

impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> Sweep<D>
    for EdgeTangent<'_, D, L, N, S>
{
    type Output = ();

    /// Adds the second derivatives by edge vectors and angles, N/m, to the tangent at the indices of edges, with one
    /// edge per SIMD lane.
    #[inline(always)]
    fn sweep<V: SimdScalar<D>>(self, level: V::Level) {
        let mut edges = L::edge_sink::<D, V>(self.tangent, self.at.elements.joint.len());
        L::Blocks::<'_, D, V>::new(self.at, level).derive(&mut edges, None);
    }
}

/// Overwrites the geometry with lengths, directions and strains of all edges and joints.
pub(super) struct GeometrySweep<'a, D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> {
    pub at: At<'a, D, L, N, S>,
    pub geometry: &'a mut L::Geometry,
}

impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> Sweep<D>
    for GeometrySweep<'_, D, L, N, S>
{
    type Output = ();

    /// Resizes and overwrites the geometry block by block: lengths, directions and strains of all edges and joints,
    /// with one edge per SIMD lane.
    #[inline(always)]
    fn sweep<V: SimdScalar<D>>(self, level: V::Level) {
        self.geometry.resize(self.at.elements.stretch.len());
        let mut blocks = L::Blocks::<'_, D, V>::new(self.at, level);
        while let Some(block) = blocks.next() {
            blocks.measure(&block, self.geometry);
        }
    }
}

/// Sums of the energies of stretching, bending and twisting of the linear laws, J, without nonlinear parts and friction
/// springs.
pub(super) struct Elastic<'a, D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> {
    pub at: At<'a, D, L, N, S>,
}

impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> Sweep<D>
    for Elastic<'_, D, L, N, S>
{
    type Output = Energies;

    /// Returns the sums of stretching, bending and twisting energy of the linear laws over all elements, J, without
    /// derivatives; other terms are zero. Lanes beyond the last edge are left out.
    #[inline(always)]
    fn sweep<V: SimdScalar<D>>(self, level: V::Level) -> Energies {
        let (mut sums, edges) = (Energies::default(), self.at.elements.stretch.len());
        let mut blocks = L::Blocks::<'_, D, V>::new(self.at, level);
        while let Some(block) = blocks.next() {
            let energies = blocks.energies(&block);
            // Lanes of the padding have no energy of the rod.
            for lane in 0..V::LANES.min(edges - L::Blocks::<'_, D, V>::first(&block)) {
                let [stretch, bend, twist] = V::extract_lane(&energies, lane);
                sums.stretch += stretch.value();
                sums.bend += bend.value();
                sums.twist += twist.value();
            }
        }
        sums
    }
}

/// Overwrites `edges` and `joints` with the strains of all edges and joints.
pub(super) struct Strains<'a, D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> {
    pub at: At<'a, D, L, N, S>,
    pub edges: &'a mut [D],
    pub joints: &'a mut [[D; S]],
}

impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> Sweep<D>
    for Strains<'_, D, L, N, S>
{
    type Output = ();

    /// Overwrites `edges` with the axial strains and `joints` with the strains of all joints, with one edge per SIMD
    /// lane.
    #[inline(always)]
    fn sweep<V: SimdScalar<D>>(self, level: V::Level) {
        let mut blocks = L::Blocks::<'_, D, V>::new(self.at, level);
        while let Some(block) = blocks.next() {
            let first = L::Blocks::<'_, D, V>::first(&block);
            let (edges, joints) = blocks.strains(&block);
            for (lane, to) in self.edges[first..].iter_mut().take(V::LANES).enumerate() {
                *to = edges.lane(lane);
            }
            for (lane, to) in self.joints[first..].iter_mut().take(V::LANES).enumerate() {
                *to = V::extract_lane(&joints, lane);
            }
        }
    }
}
