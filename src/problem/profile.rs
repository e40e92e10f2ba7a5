//! What a rod's section and material come to at its joints, edges and nodes.
//!
//! A joint stands for the rod from the middle of one of its edges to that of the other, and bends
//! and twists by the sum of what they do: its compliance is the mean of theirs. An edge stretches likewise,
//! and what a node weighs is the mean of the halves of its edges. Means count every part between
//! two jumps by its middle. That is of second order, wherever the jumps are; the value at the
//! joint would be of first order, as a jump then seems to be at the middle of an edge.

use crate::numerics::scalar::Scalar;
use crate::scene::{Material, Scene, Section};

/// Stiffnesses and inertia of a rod at a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constants<D> {
    /// EA, N.
    pub axial: D,
    /// EI1 and EI2, N m^2.
    pub bending: [D; 2],
    /// GJ, N m^2.
    pub torsion: D,
    /// A, m^2.
    pub area: D,
    /// rho A, kg/m.
    pub line_density: D,
    /// rho (I1 + I2), kg m.
    pub line_inertia: D,
}

impl<D: Scalar> Constants<D> {
    fn of(section: &Section<D>, material: &Material<D>) -> Self {
        let moments = section.moments();
        let [i1, i2] = moments.second_moments;
        Self {
            axial: material.youngs_modulus * moments.area,
            bending: [i1, i2].map(|i| material.youngs_modulus * i),
            torsion: material.shear_modulus() * moments.torsion_constant,
            area: moments.area,
            line_density: material.density * moments.area,
            line_inertia: material.density * (i1 + i2),
        }
    }

    /// With every stiffness, or compliance, and every inertia combined with another's.
    fn with(self, other: Self, f: impl Fn(D, D) -> D) -> Self {
        Self {
            axial: f(self.axial, other.axial),
            bending: [0, 1].map(|c| f(self.bending[c], other.bending[c])),
            torsion: f(self.torsion, other.torsion),
            area: f(self.area, other.area),
            line_density: f(self.line_density, other.line_density),
            line_inertia: f(self.line_inertia, other.line_inertia),
        }
    }

    /// Compliances in place of stiffnesses, or the other way round.
    fn inverted(self) -> Self {
        // Rods in the plane may have no torsion constant.
        let inverse = |x: D| if x.value() == 0.0 { x } else { x.recip() };
        Self {
            axial: inverse(self.axial),
            bending: self.bending.map(inverse),
            torsion: inverse(self.torsion),
            ..self
        }
    }
}

/// The constants all along a rod.
pub(crate) struct Profile<'a, D> {
    scene: &'a Scene<D>,
    /// Where the nodes are, as parts of the length.
    nodes: &'a [f64],
    /// Without factors along the rod.
    whole: Constants<D>,
    /// Where the constants jump, and the ends; empty of a rod that is the same all along.
    breaks: Vec<f64>,
}

impl<'a, D: Scalar> Profile<'a, D> {
    /// Of a scene whose rod has its `nodes` at these parts of its length.
    pub fn new(scene: &'a Scene<D>, nodes: &'a [f64]) -> Self {
        let taper = &scene.rod.taper;
        let breaks = if taper.is_none() { Vec::new() } else { taper.breaks() };
        Self { scene, nodes, whole: Constants::of(&scene.rod.section, &scene.material), breaks }
    }

    /// Of a joint, the first of which is at the second node.
    pub fn joint(&self, i: usize) -> Constants<D> {
        self.mean(self.middle(i), self.middle(i + 1))
    }

    /// Of an edge.
    pub fn edge(&self, j: usize) -> Constants<D> {
        self.mean(self.nodes[j], self.nodes[j + 1])
    }

    /// Of a node.
    pub fn node(&self, i: usize) -> Constants<D> {
        let last = self.nodes.len() - 1;
        let start = if i == 0 { self.nodes[0] } else { self.middle(i - 1) };
        let end = if i == last { self.nodes[last] } else { self.middle(i) };
        self.mean(start, end)
    }

    fn middle(&self, edge: usize) -> f64 {
        0.5 * (self.nodes[edge] + self.nodes[edge + 1])
    }

    /// From one place to another.
    fn mean(&self, start: f64, end: f64) -> Constants<D> {
        if self.breaks.is_empty() {
            return self.whole;
        }
        let first = self.breaks.partition_point(|place| *place <= start);
        let last = self.breaks.partition_point(|place| *place < end).max(first);
        let inside = self.breaks[first..last].iter().copied();
        let mut sum: Option<Constants<D>> = None;
        let mut from = start;
        for to in inside.chain([end]) {
            let (section, material) = self.scene.at(0.5 * (from + to));
            let here = Constants::of(&section, &material).inverted();
            let part = (to - from) / (end - start);
            let here = here.with(here, |x, _| x * part);
            sum = Some(sum.map_or(here, |sum| sum.with(here, |a, b| a + b)));
            from = to;
        }
        sum.map_or(self.whole, Constants::inverted)
    }
}
