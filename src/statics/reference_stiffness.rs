//! Thresholds of squared frequencies (1/s^2) and stiffnesses (N/m, N m) below which a motion counts as one without
//! resistance.
//!
//! The scale is bending of the whole rod about its softer axis, `omega_b^2 = E I/(rho A L^4)` halfway along it; a
//! threshold is [`NEGLIGIBLE`] of it, plus rounding errors. For `n` nodes those of the tangent are `10 eps n^4
//! omega_b^2` in node coordinates, `10 eps n^2 omega_b^2` in [edge coordinates](crate::statics::edge_coordinates). For
//! positions they are multiplied by the ratio of the larger to the smaller second moment.
//!
//! `zero_squared_frequency` is one threshold for the rod; its rounding errors are `n^1.5 eps E/(rho L^2)` of a held
//! rod, with `10 n^2` instead of `n^1.5` of a free one. `negligible_stiffness` is one stiffness per unknown, and
//! `tangent_rounding` the estimate of the rounding errors as a multiple of `omega_b^2`.

use crate::problem::{Discretized, Model};
use crate::rod::Rod;
use crate::scene::Support;
use crate::statics::edge_coordinates::EdgeCoordinates;

/// Negligible fraction of the stiffness of bending of the whole rod: far below any physical resistance, and above most
/// rounding errors.
pub(super) const NEGLIGIBLE: f64 = 1e-9;

impl<M: Model> Discretized<'_, M> {
    /// Squared frequencies below this count as zero, 1/s^2: [`NEGLIGIBLE`] of `omega_b^2` plus rounding errors `c eps
    /// E/(rho L^2)` of the edges' stiffness. For `n` nodes `c` is `n^1.5` if a clamp, a hinge or a recording holds the
    /// rod. Else it is `10 n^2`: the rod moves along itself against the rounding errors of all edges and their
    /// elimination.
    pub(crate) fn zero_squared_frequency(&self) -> f64 {
        // A threshold is an order of magnitude: the section halfway along stands for a tapered rod.
        let (_, material) = self.scene().at(0.5);
        let speed_squared = material.youngs_modulus / material.density;
        let supports = &self.scene().supports;
        let held = [supports.start, supports.end]
            .iter()
            .any(|s| matches!(s, Support::Clamped | Support::Pinned | Support::Recorded))
            || supports.path.is_some();
        let nodes = self.nodes() as f64;
        let noise = f64::EPSILON * if held { nodes.powf(1.5) } else { 10.0 * nodes.powi(2) };
        self.bending_frequency_squared() * NEGLIGIBLE
            + noise * speed_squared / self.problem.length().powi(2)
    }

    /// Estimated rounding error of squared frequencies in node coordinates, as a multiple of `omega_b^2`:
    /// `10 eps n^4` for `n` nodes.
    pub(crate) fn tangent_rounding(&self) -> f64 {
        10.0 * f64::EPSILON * (self.nodes() as f64).powi(4)
    }

    /// Negligible stiffness of every unknown, N/m (N m for angles): [`NEGLIGIBLE`] of the stiffness of the whole rod in
    /// bending (the softer direction) or, for angles, in torsion. Rounding errors `10 eps n^4` of that stiffness are
    /// added (`n^2` with `edges`, for edge coordinates), for nodes times the ratio of both bending stiffnesses. In node
    /// coordinates nodes also get their mass times [`zero_squared_frequency`](Self::zero_squared_frequency).
    pub(crate) fn negligible_stiffness(&self, edges: Option<EdgeCoordinates>) -> Vec<f64> {
        let (section, _) = self.scene().at(0.5);
        let [i1, i2] = section.moments().second_moments;
        let power = if edges.is_some() { 2 } else { 4 };
        let noise = 10.0 * f64::EPSILON * (self.nodes() as f64).powi(power);
        let softest = self.bending_frequency_squared();
        // Rounding errors are those of the stiffer direction.
        let stiffer = i1.max(i2) / i1.min(i2);
        let of_nodes = softest * (NEGLIGIBLE + noise * stiffer)
            + if edges.is_some() { 0.0 } else { self.zero_squared_frequency() };
        self.stiffness(edges, of_nodes, softest * (NEGLIGIBLE + noise))
    }

    /// The fraction `part` of the bending stiffness of the whole rod, for every unknown in node coordinates, N/m (N m
    /// for angles): `part omega_b^2` times the mass, or the scale of inertia of an angle.
    pub(super) fn part_of_bending_stiffness(&self, part: f64) -> Vec<f64> {
        let squared = part * self.bending_frequency_squared();
        self.stiffness(None, squared, squared)
    }

    /// Stiffness of every unknown, N/m (N m for angles): its mass times `squared_of_nodes`, or for an angle its scale
    /// of inertia times `squared_of_angles`, both 1/s^2. `edges`: with the metric of edge coordinates.
    ///
    /// The inertia of an angle about its edge is too small for a scale. It counts as the mass of the edge on a lever
    /// of the rod's length, times the ratio of torsional to bending stiffness where that exceeds 1.
    fn stiffness(
        &self,
        edges: Option<EdgeCoordinates>,
        squared_of_nodes: f64,
        squared_of_angles: f64,
    ) -> Vec<f64> {
        let (section, material) = self.scene().at(0.5);
        let section = section.moments();
        let [i1, i2] = section.second_moments;
        let bending = material.youngs_modulus * i1.min(i2);
        let twist = (material.shear_modulus() * section.torsion_constant / bending).max(1.0);
        let (length, nodes) = (self.problem.length(), self.nodes() as f64);
        let inertia = material.density * section.area * length.powi(3) / nodes;
        let rod = self.rod();
        let mass = match edges {
            Some(edges) => edges.metric(&rod),
            None => rod.mass().to_vec(),
        };
        let stiffness = |(i, mass): (usize, f64)| match M::Rod::<f64>::is_angle(i) {
            true => squared_of_angles * twist * inertia,
            false => mass * squared_of_nodes,
        };
        mass.into_iter().enumerate().map(stiffness).collect()
    }
}
