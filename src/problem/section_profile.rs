//! Stiffnesses and inertia of joints, edges and nodes of a rod with a tapered section or material.
//!
//! Input: a scene over any number type, and the places of its nodes as fractions of the length. Output per joint,
//! edge or node: [`SectionConstants`], which are EA (N), EI1, EI2 and GJ (N m^2), area (m^2), mass (kg/m) and
//! inertia (kg m) per length. GJ is 0 without shear modulus and Poisson's ratio. A joint represents the rod between
//! the middles of its two edges. Its angles are the sums of those of its parts, so that stiffnesses are harmonic
//! means; likewise for an edge. Area, mass and inertia are arithmetic means, for a node over the halves of its
//! edges. Each part between two jumps is evaluated at its middle: of second order for jumps at any place. Without
//! taper all are the constants of the section.

use crate::numerics::scalar::Scalar;
use crate::scene::{Material, Scene, Section};

/// Stiffnesses and inertia of a cross-section.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SectionConstants<D> {
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

impl<D: Scalar> SectionConstants<D> {
    /// Constants of a section and a material: EA, EI1 and EI2, GJ, A, rho A and rho (I1 + I2). GJ is 0 without shear
    /// modulus and Poisson's ratio.
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

    /// The constants `f(own, other)`, field by field: `f` gets the same constant of both.
    fn combine(self, other: Self, f: impl Fn(D, D) -> D) -> Self {
        Self {
            axial: f(self.axial, other.axial),
            bending: [0, 1].map(|c| f(self.bending[c], other.bending[c])),
            torsion: f(self.torsion, other.torsion),
            area: f(self.area, other.area),
            line_density: f(self.line_density, other.line_density),
            line_inertia: f(self.line_inertia, other.line_inertia),
        }
    }

    /// Reciprocals of EA, EI1, EI2 and GJ, so that stiffnesses become compliances or the reverse; zero stays zero. Area
    /// and inertias are unchanged.
    fn inverted(self) -> Self {
        // The torsional stiffness of planar rods may be 0.
        let inverse = |x: D| if x.value() == 0.0 { x } else { x.recip() };
        Self {
            axial: inverse(self.axial),
            bending: self.bending.map(inverse),
            torsion: inverse(self.torsion),
            ..self
        }
    }
}

/// Constants along a rod.
pub(crate) struct SectionProfile<'a, D> {
    scene: &'a Scene<D>,
    /// Positions of the nodes as fractions of the rod length.
    nodes: &'a [f64],
    /// Constants without taper.
    whole: SectionConstants<D>,
    /// Places of jumps, and both ends; empty for a rod without taper.
    breaks: Vec<f64>,
}

impl<'a, D: Scalar> SectionProfile<'a, D> {
    /// Profile of a scene with nodes at these fractions of the rod length. It has the constants without taper, and the
    /// places of jumps of the taper.
    pub fn new(scene: &'a Scene<D>, nodes: &'a [f64]) -> Self {
        let taper = &scene.rod.taper;
        let breaks = if taper.is_none() { Vec::new() } else { taper.breaks() };
        Self {
            scene,
            nodes,
            whole: SectionConstants::of(&scene.rod.section, &scene.material),
            breaks,
        }
    }

    /// Constants of joint `i`, which is at node `i + 1`, between the middles of its two edges: harmonic means of
    /// stiffnesses, arithmetic ones of area, mass and inertia per length.
    pub fn joint(&self, i: usize) -> SectionConstants<D> {
        self.mean(self.middle(i), self.middle(i + 1))
    }

    /// Constants of edge `j` between its two nodes: harmonic means of stiffnesses, arithmetic ones of area, mass and
    /// inertia per length.
    pub fn edge(&self, j: usize) -> SectionConstants<D> {
        self.mean(self.nodes[j], self.nodes[j + 1])
    }

    /// Constants of node `i` between the middles of its two edges, of an end node over half an edge: harmonic means of
    /// stiffnesses, arithmetic ones of area, mass and inertia per length.
    pub fn node(&self, i: usize) -> SectionConstants<D> {
        let last = self.nodes.len() - 1;
        let start = if i == 0 { self.nodes[0] } else { self.middle(i - 1) };
        let end = if i == last { self.nodes[last] } else { self.middle(i) };
        self.mean(start, end)
    }

    /// Middle of edge number `edge`, as a fraction of the rod length.
    fn middle(&self, edge: usize) -> f64 {
        0.5 * (self.nodes[edge] + self.nodes[edge + 1])
    }

    /// Mean constants between two places, fractions of the rod length: harmonic means of stiffnesses, arithmetic ones
    /// of area and inertias. Each part between two jumps is evaluated at its middle. Without taper they are those of
    /// the rod.
    fn mean(&self, start: f64, end: f64) -> SectionConstants<D> {
        if self.breaks.is_empty() {
            return self.whole;
        }
        // Between jumps the section is smooth, so that the middle of each part is of second order.
        let first = self.breaks.partition_point(|place| *place <= start);
        let last = self.breaks.partition_point(|place| *place < end).max(first);
        let inside = self.breaks[first..last].iter().copied();
        let mut sum: Option<SectionConstants<D>> = None;
        let mut from = start;
        // The sum of compliances and inertia, each times its share of the length.
        for to in inside.chain([end]) {
            let (section, material) = self.scene.at(0.5 * (from + to));
            let here = SectionConstants::of(&section, &material).inverted();
            let part = (to - from) / (end - start);
            let here = here.combine(here, |x, _| x * part);
            sum = Some(sum.map_or(here, |sum| sum.combine(here, |a, b| a + b)));
            from = to;
        }
        sum.map_or(self.whole, SectionConstants::inverted)
    }
}
