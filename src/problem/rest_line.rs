//! Rest shape of a rod in the axes of its model, and the parts of the rod that are alike in both models.
//!
//! [`RestLine`] holds nodes and lengths of chords (m), tributary lengths (m), and places of the nodes as fractions of
//! the length. `edge` is the vector of an edge, m. `stretch` returns the edges with their axial stiffness, N: `EA` of
//! the section profile times chord over arc, in series with the axial compliance of clamps. It also returns the parts
//! of a nonlinear stretch law. `inertia_and_weight` returns masses of all unknowns (kg), with the added mass of a
//! fluid, and in space the rotational inertia (kg m^2) about the rod for angles. The weights of the nodes (N) are
//! gravity times the mass of the rod less that of the displaced fluid. Point masses are not included. The planar and
//! the spatial model use it.

use crate::energy::law::NonlinearPart;
use crate::energy::{DeadLoad, Stretch};
use crate::numerics::scalar::Scalar;
use crate::problem::model::Correction;
use crate::problem::section_profile::SectionProfile;
use crate::problem::soft_clamp::SoftClamps;
use crate::problem::tributary::TributaryLengths;
use crate::rod::NonlinearParts;
use crate::scene::mesh::Mesh;
use crate::scene::{Material, Scene};

/// Nodes, edges and tributary lengths of a rod at rest, with `N` coordinates per node.
#[derive(Clone, Debug)]
pub(crate) struct RestLine<D, const N: usize> {
    /// Positions of the nodes, m.
    pub nodes: Vec<[D; N]>,
    /// Lengths of the edges (chords), m.
    pub length: Vec<D>,
    /// Lengths that joints, edges and nodes represent, m.
    pub tributary: TributaryLengths<D>,
    /// Positions of the nodes as fractions of the rod length.
    pub places: Vec<f64>,
}

/// Inertia and weights of a rod.
pub(crate) struct InertiaAndWeight<D, const N: usize> {
    /// Mass of every unknown, kg; rotational inertia of angles, kg m^2.
    pub mass: Vec<D>,
    /// Weight of every node, N.
    pub load: Vec<DeadLoad<D, N>>,
}

impl<D: Scalar, const N: usize> RestLine<D, N> {
    /// The line through `nodes`, m, in the axes of the model. Joints and nodes have the tributary lengths of half of
    /// each adjacent chord, or if `correction` has arcs those of the arcs of the `mesh` with corrections at walls.
    pub fn new(nodes: Vec<[D; N]>, mesh: &Mesh<D>, correction: &Correction) -> Self {
        let mut length = Vec::with_capacity(nodes.len() - 1);
        for pair in nodes.windows(2) {
            let mut square = D::from(0.0);
            for c in 0..N {
                let d = pair[1][c] - pair[0][c];
                square = if c == 0 { d * d } else { square + d * d };
            }
            length.push(square.sqrt());
        }
        let tributary = match correction.arcs(mesh) {
            Some(arcs) => TributaryLengths::corrected(arcs),
            None => TributaryLengths::plain(&length),
        };
        Self { nodes, length, tributary, places: mesh.places() }
    }

    /// Vector from node `j` to node `j + 1` at rest, m.
    pub fn edge(&self, j: usize) -> [D; N] {
        std::array::from_fn(|c| self.nodes[j + 1][c] - self.nodes[j][c])
    }

    /// The edges with their axial stiffness EA at no strain, N, in series with the axial compliance of clamps. Also the
    /// parts of a nonlinear stretch law, one per edge (empty for the linear law). A chord that is shorter than its arc
    /// is softer by their ratio.
    pub fn stretch(
        &self,
        material: &Material<D>,
        profile: &SectionProfile<D>,
        clamps: &SoftClamps<D>,
    ) -> (Vec<Stretch<D, N>>, NonlinearParts<D>) {
        let edges = self.length.iter().zip(&self.tributary.stretch).enumerate();
        let stretch = edges.map(|(j, (l, arc))| {
            // A force F lengthens the arc by `F arc/EA`; a chord of the length l does so with
            // the stiffness `EA l/arc`.
            let stiffness = clamps.stretching(j, profile.edge(j).axial * (*l / *arc), *l);
            Stretch { stiffness, rest_length: *l, natural_strain: D::from(0.0) }
        });
        let stretch: Vec<_> = stretch.collect();
        let (law, ratio) = (material.stretch_law, material.mooney_rivlin_ratio);
        let ratio = ratio.unwrap_or(D::from(0.0));
        // The strain of the material is that of the arc.
        let part = |(edge, arc): (&Stretch<D, N>, &D)| {
            let arc_ratio = *arc / edge.rest_length;
            NonlinearPart::new(law, edge.stiffness * arc_ratio, ratio, arc_ratio)
        };
        let edges = stretch.iter().zip(&self.tributary.stretch).filter_map(part).collect();
        (stretch, NonlinearParts { edges })
    }

    /// Mass of every unknown, kg, with the added mass of a fluid. In space an angle has the rotational inertia about
    /// the rod, kg m^2. Weights of the nodes, N, are the masses of the rod, without added mass and less that of
    /// displaced fluid, times `gravity`, m/s^2, in the axes of the model.
    pub fn inertia_and_weight(
        &self,
        scene: &Scene<D>,
        profile: &SectionProfile<D>,
        gravity: [D; N],
    ) -> InertiaAndWeight<D, N> {
        let (masses, weighing) = self.tributary.immersed(profile, scene.loads.drag.as_ref());
        let mut mass = Vec::with_capacity((N + 1) * self.nodes.len());
        for (i, node_mass) in masses.into_iter().enumerate() {
            mass.extend([node_mass; N]);
            // Angles of edges are unknowns in space only.
            if N == 3 {
                let inertia = |l: &D| profile.edge(i).line_inertia * *l;
                mass.extend(self.tributary.spin.get(i).map(inertia));
            }
        }
        let weight = |m: &D| DeadLoad { force: gravity.map(|g| *m * g) };
        InertiaAndWeight { mass, load: weighing.iter().map(weight).collect() }
    }
}
