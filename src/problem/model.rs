//! Models of a scene: the rest geometry and the elements of its rod, in the plane or in space.
//!
//! A [`Model`] builds rods over any number type and maps their nodes to the world. [`PlanarModel`](super::PlanarModel)
//! has two coordinates per node, without angles and frames; [`SpatialModel`](super::SpatialModel) has three
//! coordinates, angles and frames. Functions for both follow: nodes rotated by `supports.angle` (`tilted`), the first
//! material director (`first_director`), springs of internal friction (`springs`), and the direction of a roller
//! (`rolling`, none without one). `NodalLoad` and `NodalMass` are a load and a mass on a node, `Correction` has the
//! corrections that were decided for a problem. `shear_modulus` is that of a material, Pa, zero without a given one and
//! without Poisson's ratio.
//!
//! # The corrected discretization
//!
//! The published sums lose accuracy where a polygon represents a curve, and where they end at a
//! wall. Corrected constants of the elements compensate for this; the elements are unchanged.
//! [`Discretization`](crate::scene::Discretization) selects them. Proofs over many shapes and sizes:
//! `cargo test --release --test physics corrections:: -- --nocapture`.
//!
//! **A bent joint** is too stiff. Let one edge turn against the other about a joint with natural
//! turning angle `phi`, by a small `omega`: the discrete strains change by
//! `omega/cos^2(phi/2)` along the natural curvature, `omega/cos(phi/2)` across it, and
//! `d tau = omega/cos(phi/2)`. So the stiffness is `S K S/dl` with `S = (cos^2, cos, cos)(phi/2)`
//! on these three axes. And a chord is shorter than its arc: `dl`, axial stiffness, mass and
//! weight count arcs.
//!
//! **The axis of twist of a joint differs from that of the curve.** The joint twists about the direction of
//! `t_e + t_f`, that of `x(s + l) - x(s - l) = 2 l (t + l^2/6 t'' + ..)`. Across the rod `t''` is
//! `kappa' n + kappa tau_c b`, with the curve's torsion `tau_c`: on a helix the axis of the joint deviates
//! from that of the curve by `l^2 kappa tau_c/6` towards the binormal, and mixes bending with twisting.
//! So `K = Q diag(EI1, EI2, GJ) Q'`, where `Q` turns the joint's axes the shortest way onto the
//! tangent of the polynomial through the five nearest nodes; it couples twist and bending. A factor
//! on the natural curvature scales `kappa`, natural twist adds to `tau_c`.
//!
//! **Bending and twisting next to a wall.** A clamped rod is statically determinate: the
//! displacement of its tip along a unit load is `sum_i dl f(s_i)`, `f = m.M/K` with the moments `M`
//! of the loads and `m` of the unit load. With the wall in the middle of edge 0 the joints sit at
//! `l/2, 3l/2, ..`, and the sum is the midpoint rule for the integral of `f` from the wall on. At a
//! free end `f` and `f'` vanish; at the wall, by Euler and Maclaurin, the sum exceeds the integral
//! by `l^2/24 f'(0)`, negative for most loads: the rod is too stiff. Weights `25/24` and `23/24` of
//! the first two joints add `l/24 (f(l/2) - f(3l/2)) = -l^2/24 f'(0) + O(l^3)` and cancel it,
//! whatever the load. For an edge of length `a` in the wall and `b` next to it, with the
//! trapezoidal rule for unequal edges, the shift from one joint to the other is
//! `(a^2/8 - b^2/12)/b` instead of `l/24`.
//!
//! Curved rods have this correction, since their `f'(0)` is proportional to the curvature: the error of the helix is
//! six times smaller. Joints of straight rods keep their lengths, unless `corrected-statics` is requested: the
//! correction would improve the sag and degrade the frequencies. The table has their errors in units of `(l/L)^2`,
//! for small deflections of a straight cantilever. They are those of the sag of the tip under the rod's weight, and
//! of the squared frequencies of five modes:
//!
//! | | sag | mode 1 | 2 | 3 | 4 | 5 |
//! |---|---|---|---|---|---|---|
//! | no correction at the wall | -0.5 | -0.32 | -3.8 | -10 | -20 | -33 |
//! | with it | 0 | -0.77 | -5.3 | -13 | -23 | -37 |
//! | and tip masses of 5/12, 13/12 | -0.33 | 0.14 | -2.2 | -7.7 | -16 | -29 |
//!
//! The last row is an alternative that the program does not use. In it the last node and the one before have 5/12 and
//! 13/12 of the mass of an edge, instead of 1/2 and 1.
//!
//! The frequencies' own error, `-(l^2/6) int y'^2/int y^2`, is that of lumped masses everywhere along the rod. No
//! diagonal mass removes it, and the error at the wall compensates a part. The first swing of the paper's cantilever
//! at 50 segments is off by 1.9e-4 of its length without the correction, and by 9e-5 with it. With the tip masses,
//! which have wrong moments of the weight, it is off by 1.3e-4. Curvature beyond that at rest is measured as `2
//! tan(phi/2)`, stiffer than `phi` by `phi^2/3`. This error of the element is the rest of the error of the swing.
//!
//! **Masses next to a wall.** Where joints at walls are corrected, masses are too. The mass and weight of a quarter
//! of an edge move from node 1 to node 2. So the first moment of the half edge between wall and node 1 is right.
//!
//! **Stretching next to a wall.** A wall in the middle of edge 0 also holds the half of the edge that belongs to the
//! rod. So edge 1 gets the axial compliance of the rod between the wall and node 2, one and a half edges. Without
//! this correction the rod is short by half an edge, a first-order error. With it the stretch by a force at the tip
//! is exact, and that by the weight of second order.

use crate::energy::adapter::Chart;
use crate::energy::law::{ActiveSlipElements, SlipElements};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::vector::{Vector, add, dot, rotate, scale, sub, unit};
use crate::problem::tributary::{Arcs, TributaryLengths};
use crate::rod::{AssembledRod, EdgeMoment, Rod};
use crate::scene::mesh::Mesh;
use crate::scene::{End, Material, Scene, Support};
use nalgebra::Vector3;
use num_dual::Dual64;

/// A force and a moment on a node, in world axes.
#[derive(Clone, Copy, Debug)]
pub struct NodalLoad<D = f64> {
    /// The node it acts on.
    pub node: usize,
    /// Force, N.
    pub force: [D; 3],
    /// Moment, N m.
    pub moment: [D; 3],
}

/// Point mass on a node.
#[derive(Clone, Copy, Debug)]
pub struct NodalMass<D = f64> {
    /// The node it is on.
    pub node: usize,
    /// Mass, kg.
    pub mass: D,
}

/// Corrections of the elements, decided once for a problem.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Correction {
    /// Whether arc lengths replace chords, and bent joints are softer accordingly; not in the paper's discretization.
    pub arcs: bool,
    /// Fractions of the first and of the last edge behind walls.
    pub behind: [f64; 2],
    /// Whether joints and masses next to a wall are corrected too.
    pub joints: bool,
}

impl Correction {
    /// Lengths along the curve of all edges of a mesh, with the fractions behind walls and whether joints at walls are
    /// corrected. None if tributary lengths are those of chords.
    pub(crate) fn arcs<'a, D: Scalar>(&self, mesh: &'a Mesh<D>) -> Option<Arcs<'a, D>> {
        let Self { behind, joints, .. } = *self;
        self.arcs.then_some(Arcs { lengths: &mesh.arcs, behind, joints })
    }
}

/// Planar or spatial model of a scene: the axes that were chosen once, and rods, rest shapes and positions over any
/// number type of the scene.
pub trait Model: Sync {
    /// Number of unknowns from one node to the next.
    const STRIDE: usize;
    /// The rod over the scalar `D`.
    type Rod<D: RodScalar>: AssembledRod<D, Dual = Self::Rod<Dual64>>;
    /// The rest shape in the axes of the model.
    type Rest<D: RodScalar>: Clone + std::fmt::Debug + Send + Sync;

    /// The rest shape of a scene on its mesh, in the axes of the model: nodes, tributary lengths of nodes, edges and
    /// joints, and the curvature of the rest shape integrated over each joint, rad. In space it also has frames and, if
    /// joints are corrected, their slants: the components of the unit tangent of the curve along both bending axes of
    /// the joint.
    fn at_rest<D: RodScalar>(&self, scene: &Scene<D>, mesh: &Mesh<D>) -> Self::Rest<D>;

    /// The rod of a scene at this rest shape: elements, masses, weights and internal friction. Point masses, point and
    /// line loads and user-defined energies are added by the setup.
    fn rod<D: RodScalar>(&self, scene: &Scene<D>, rest: &Self::Rest<D>) -> Self::Rod<D>;

    /// Adds the moments of `loads`, N m, to a rod in a plane, half on each edge of the node. A constant moment has a
    /// potential there. Forces are ignored. In space nothing is added.
    fn add_moments<D: RodScalar>(
        &self,
        _rod: &mut Self::Rod<D>,
        _rest: &Self::Rest<D>,
        _loads: &[NodalLoad<D>],
    ) {
    }

    /// The moments of `loads`, N m, along the normal on the edges of a rod in a plane with so many `edges`, half on
    /// each edge of the node. Forces are ignored. Empty in space.
    fn edge_moments<D: RodScalar>(
        &self,
        _edges: usize,
        _loads: &[NodalLoad<D>],
    ) -> Vec<EdgeMoment<D>> {
        Vec::new()
    }

    /// Tributary lengths of nodes, edges and joints, m, along the curve and without the parts behind walls if the
    /// discretization is corrected.
    fn tributary<D: RodScalar>(rest: &Self::Rest<D>) -> &TributaryLengths<D>;

    /// The map from unknowns to positions of nodes and directors of edges in the world, for user-defined energies.
    fn chart<D: RodScalar>(&self, scene: &Scene<D>, rest: &Self::Rest<D>) -> Chart<D>;

    /// Number of unknowns, those that supports hold included.
    fn dof(&self) -> usize;

    /// The unknowns at rest in the axes of the model: the coordinates of each node in turn, m. In space an angle of
    /// zero, rad, for each edge follows those of its first node.
    fn unknowns<D: RodScalar>(&self, rest: &Self::Rest<D>) -> Vec<D>;

    /// The reference frames of the edges at rest; the empty type in a plane.
    fn frames<D: RodScalar>(&self, rest: &Self::Rest<D>) -> <Self::Rod<D> as Rod<D>>::Frames;

    /// The reference frames converted to the number type `D`, without derivatives; the empty type in a plane.
    fn frames_over<D: RodScalar>(
        frames: &<Self::Rod<f64> as Rod<f64>>::Frames,
    ) -> <Self::Rod<D> as Rod<D>>::Frames;

    /// Number of unknowns that a support of this kind holds, counted from the end of the rod inwards. It is 0 for a
    /// free end; a clamped one holds two nodes, and in space the angle of their edge. A recorded end counts as a
    /// clamped one.
    fn held_unknowns(&self, support: Support) -> usize;

    /// Components of a vector of the world in the axes of the model; the third is normal to a plane.
    fn components<D: Scalar>(&self, vector: [D; 3]) -> [D; 3];

    /// The position of node `i` in the world, m, from all unknowns `q`.
    fn position<D: Scalar>(&self, q: &[D], i: usize) -> [D; 3];

    /// The velocity of node `i` in the world, m/s, from the rates `v` of all unknowns.
    fn rate<D: Scalar>(&self, v: &[D], i: usize) -> [D; 3];
}

impl<D: Scalar> Material<D> {
    /// Shear modulus G, Pa: the given one, or `E/(2 (1 + nu))` with Poisson's ratio nu. Zero without both, which only
    /// planar scenes may leave out.
    pub(crate) fn shear_modulus(&self) -> D {
        match (self.shear_modulus, self.poisson_ratio) {
            (Some(modulus), _) => modulus,
            (None, Some(ratio)) => self.youngs_modulus / ((ratio + 1.0) * 2.0),
            (None, None) => D::from(0.0),
        }
    }

    /// Whether the [shear modulus](Self::shear_modulus) is given, by itself or by Poisson's ratio.
    pub(crate) fn has_shear_modulus(&self) -> bool {
        self.shear_modulus.is_some() || self.poisson_ratio.is_some()
    }
}

/// The nodes, m, rotated by `supports.angle`, rad, about an axis through the first one along the unit vector `normal`.
/// Unchanged at an angle of zero without derivatives.
pub(crate) fn tilted<D: Scalar>(
    scene: &Scene<D>,
    nodes: &[Vector<D>],
    normal: &Vector3<f64>,
) -> Vec<Vector<D>> {
    let angle = scene.supports.angle;
    // At an angle of zero its derivative is not zero.
    if angle.value() == 0.0 && D::ORDER == 0 {
        return nodes.to_vec();
    }
    let rotation = [0, 1, 2].map(|c| angle * normal[c]);
    nodes.iter().map(|x| add(nodes[0], rotate(rotation, sub(*x, nodes[0])))).collect()
}

/// First material director of the first edge of `nodes`, a unit vector of the world: along the component of the
/// section's `up` across the edge. Circles and tubes, without `up`, take that of the y axis, or of the x axis if the
/// edge is within 8 degrees of y.
pub(crate) fn first_director<D: Scalar>(scene: &Scene<D>, nodes: &[Vector<D>]) -> Vector<D> {
    scene.rod.section.up_across(nodes).unwrap_or_else(|| {
        let tangent = unit(sub(nodes[1], nodes[0]));
        // Near the y axis its component across the edge is too small to be a direction.
        let axis = if tangent[1].value().abs() < 0.99 { [0.0, 1.0, 0.0] } else { [1.0, 0.0, 0.0] };
        let axis = axis.map(D::from);
        unit(sub(axis, scale(tangent, dot(tangent, axis))))
    })
}

/// Springs of internal friction of all joints, with the stiffness of `loads.damping.friction` as a fraction of that of
/// the joint. The spring of joint `i` slips at the integrated curvature, rad, of `friction.curvature` times the
/// tributary length of the joint and `times(i)`. None for a scene without friction.
pub(crate) fn springs<D: Scalar, K, const S: usize>(
    scene: &Scene<D>,
    tributary: &TributaryLengths<D>,
    times: impl Fn(usize) -> D,
) -> Option<ActiveSlipElements<D, K, S>> {
    let friction = scene.loads.damping.friction?;
    // The scene gives a curvature, 1/m; springs stretch by integrated curvatures.
    let limit = |(i, length): (usize, &D)| friction.curvature * *length * times(i);
    let limits = tributary.joint.iter().enumerate().map(limit).collect();
    Some(ActiveSlipElements::from(SlipElements { stiffness: friction.stiffness, limits }))
}

/// The end on a roller and its direction in the world: `supports.roller`, or along the outermost edge at that end of
/// these nodes, m. It is not normalized. None without a roller.
pub(crate) fn rolling(scene: &Scene, nodes: &[Vector<f64>]) -> Option<(End, Vector3<f64>)> {
    let end = scene.supports.rolling()?;
    let edge = match end {
        End::Start => &nodes[..2],
        End::End => &nodes[nodes.len() - 2..],
    };
    // Without a stated direction the roller moves along its outermost edge at rest.
    let along = Vector3::from(edge[1]) - Vector3::from(edge[0]);
    Some((end, scene.supports.roller.map_or(along, Vector3::from)))
}
