//! Tributary lengths: the length of the rod, m, that every joint, edge and node represents, and the nodal masses from
//! these.
//!
//! Input: lengths of edges (m), or of the arcs between nodes with the fractions of the outermost ones behind walls. In
//! `plain` joints and nodes have half of each adjacent edge; edges have their length, for stretch and for rotational
//! inertia. In `corrected` the joint and the inner node next to a wall have the part of the outermost edge outside of
//! the wall, instead of half of it. This part is added to the next edge, for stretch. The outermost node and edge
//! themselves, which the clamp holds, keep their lengths. On request it adds second-order corrections of joints and
//! masses next to a wall: see [`crate::problem::model`]. Bending and axial stiffness are divided by these lengths,
//! masses per length are multiplied with them. `immersed` returns two masses (kg) per node: for inertia with the added
//! mass of a fluid, for weight less the displaced fluid.

use crate::numerics::scalar::Scalar;
use crate::problem::section_profile::{SectionConstants, SectionProfile};
use crate::scene::Drag;

/// Arc lengths between the nodes, and the positions of walls.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arcs<'a, D = f64> {
    /// Length along every edge, m.
    pub lengths: &'a [D],
    /// Fractions of the first and of the last edge behind walls.
    pub behind: [f64; 2],
    /// Whether joints and masses next to a wall are corrected too.
    pub joints: bool,
}

/// Tributary lengths, m: a joint of length `l` bends as `EI/l`, an edge stretches as `EA/l`, a node weighs
/// `rho A l`.
#[derive(Clone, Debug)]
pub struct TributaryLengths<D> {
    /// Length of every joint, for bending and twisting.
    pub joint: Vec<D>,
    /// Length of every edge, for stretch.
    pub stretch: Vec<D>,
    /// Length of every node, for its mass.
    pub node: Vec<D>,
    /// Length of every edge, for its rotational inertia about the rod.
    pub spin: Vec<D>,
}

impl<D: Scalar> TributaryLengths<D> {
    /// Two lists with an entry for each node, kg. The first is the inertial mass, with the added mass of a `fluid`. The
    /// second is the mass for the weight, less that of the displaced fluid. Both are equal without a fluid.
    pub(crate) fn immersed(
        &self,
        profile: &SectionProfile<D>,
        fluid: Option<&Drag<D>>,
    ) -> (Vec<D>, Vec<D>) {
        let nodes = self.node.iter().enumerate().map(|(i, l)| (profile.node(i), *l));
        let of = |(rod, l): (SectionConstants<D>, D)| {
            let mass = rod.line_density * l;
            fluid.map_or((mass, mass), |fluid| {
                (mass + fluid.added_mass * l, mass - fluid.fluid_density * rod.area * l)
            })
        };
        nodes.map(of).unzip()
    }

    /// Uncorrected tributary lengths for edges of the lengths `edges`, m. Joints and nodes have half of each adjacent
    /// edge, stretch and spin the whole edge.
    pub fn plain(edges: &[D]) -> Self {
        let zero = D::from(0.0);
        let half = |j: Option<usize>| *j.and_then(|j| edges.get(j)).unwrap_or(&zero) * 0.5;
        Self {
            joint: edges.windows(2).map(|l| (l[0] + l[1]) * 0.5).collect(),
            stretch: edges.to_vec(),
            node: (0..=edges.len()).map(|i| half(i.checked_sub(1)) + half(Some(i))).collect(),
            spin: edges.to_vec(),
        }
    }

    /// Tributary lengths along arcs. The joint and the inner node next to a wall have the part of the outermost edge
    /// outside of the wall, instead of half of it. This part is added to the next edge, for stretch. The outermost node
    /// and edge, which the clamp holds, keep their lengths. If `arcs.joints` is set, second-order terms follow (see
    /// [`crate::problem::model`]), with the part `r` of the outermost edge outside of its wall and the next edge `b`.
    /// The length `r/2` is moved from the node next to a wall to the one after it. With more than two edges, the first
    /// joint gets `(r^2/2 - b^2/12)/b` of the second, at most half of it.
    pub(crate) fn corrected(arcs: Arcs<D>) -> Self {
        let mut line = Self::plain(arcs.lengths);
        for (end, behind) in arcs.behind.into_iter().enumerate() {
            // Index counted from the wall.
            let at = |k: usize, count: usize| if end == 0 { k } else { count - 1 - k };
            let edges = arcs.lengths.len();
            if behind == 0.0 {
                continue;
            }
            let [outermost, next] = [0, 1].map(|k| arcs.lengths[at(k, edges)]);
            // Length between wall and first joint: half of the edge if the wall is at its middle.
            let rod = outermost * (1.0 - behind);
            // The part of the edge that is behind the wall does not bend, weigh or stretch.
            let hidden = outermost * 0.5 - rod;
            line.joint[at(0, edges - 1)] -= hidden;
            line.node[at(1, edges + 1)] -= hidden;
            // The part of the outermost edge outside of the wall stretches with the next edge.
            line.stretch[at(1, edges)] += rod;
            if !arcs.joints {
                continue;
            }
            // Second order: mass between wall and first node is moved so that its first moment is
            // right.
            line.node[at(1, edges + 1)] -= rod * 0.5;
            line.node[at(2, edges + 1)] += rod * 0.5;
            if edges > 2 {
                let [first, second] = [0, 1].map(|k| at(k, edges - 1));
                // Second order of bending next to a clamp: see the module of the model.
                let shift = (rod * rod * 0.5 - next * next * (1.0 / 12.0)) / next;
                // A mesh with a neighbor of twice the length or more is not smooth.
                let most = line.joint[second] * 0.5;
                let shift = if shift.value() > most.value() { most } else { shift };
                line.joint[first] += shift;
                line.joint[second] -= shift;
            }
        }
        line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrected_lengths_of_a_rod_with_walls_have_the_sum_of_plain_ones() {
        for lengths in [&[1.0; 2][..], &[1.0; 3], &[0.9, 1.0, 1.2, 1.1, 1.0], &[5.0, 1.0, 1.0]] {
            for behind in [[0.5, 0.0], [0.0, 0.5], [0.5, 0.5]] {
                let (plain, line) = (
                    TributaryLengths::plain(lengths),
                    TributaryLengths::corrected(Arcs { lengths, behind, joints: true }),
                );
                let sum = |v: &[f64]| v.iter().sum::<f64>();
                assert!((sum(&line.joint) - sum(&plain.joint)).abs() < 1e-15 * sum(lengths));
                assert!((sum(&line.node) - sum(&plain.node)).abs() < 1e-15 * sum(lengths));
                assert!(line.joint.iter().chain(&line.node).all(|l| *l > 0.0), "{line:?}");
            }
        }
        let line = TributaryLengths::corrected(Arcs {
            lengths: &[24.0; 5],
            behind: [0.5, 0.0],
            joints: true,
        });
        // Equal edges of 24: the second-order shift of a joint is (1/8 - 1/12) 24 = 1, that of a
        // node 6.
        assert_eq!(line.joint, [25.0, 23.0, 24.0, 24.0]);
        assert_eq!(line.stretch, [24.0, 36.0, 24.0, 24.0, 24.0]);
        assert_eq!(line.node, [12.0, 18.0, 30.0, 24.0, 24.0, 12.0]);
    }

    /// The joints' sum of a linear function is its integral from the wall on, on unequal edges too,
    /// but for the start's part of the rule's own error, which smooth functions do not have.
    #[test]
    fn joint_lengths_integrate_linear_function_from_the_wall() {
        let lengths = [1.1, 1.0, 0.9, 0.8, 0.7];
        let line = TributaryLengths::corrected(Arcs {
            lengths: &lengths,
            behind: [0.5, 0.0],
            joints: true,
        });
        let mut at = -0.55;
        let mut sum = [0.0_f64; 2];
        for (joint, edge) in line.joint.iter().zip(&lengths) {
            at += edge;
            sum = [sum[0] + joint, sum[1] + joint * at];
        }
        // To the middle of the last edge: the last joint's half of it is off its middle.
        let end = at + 0.5 * lengths[4];
        assert!((sum[0] - end).abs() < 1e-15);
        // Trapezoids have l^2/12 (f'(end) - f'(start)) too much.
        let euler = lengths[1].powi(2) / 12.0;
        assert!((sum[1] + 0.5 * (end - at).powi(2) - 0.5 * end * end - euler).abs() < 1e-15);
    }
}
