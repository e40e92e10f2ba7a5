//! Reference frames of the angles of a rod, and the derivatives of these frames along parameters.
//!
//! In space the angle of an edge is measured from a reference frame, [`Frames`](crate::energy::frame::Frames): tangent
//! and director of each edge, reference twist of each joint (time-parallel transport, Bergou et al. 2010). A planar rod
//! has no angles; its frames are `()`, and every operation is empty. The derivative of a frame is that of its tangent
//! and a rotation about the tangent, rad ([`FrameRate`]). [`frame_rates`] returns these derivatives from frames over
//! dual numbers, [`set_dual_frames`] and [`set_real_frames`] convert frames to dual and to plain numbers;
//! [`zero_frame_rates`] are derivatives of constant frames. The trait [`RodGeometry`] has the strains at a state. It
//! returns the derivatives of the gradient, N, that follow from those of frames (`add_frame_rates`), and converts
//! derivatives of frames before a step to those after it (`move_frame_rates`). Both have a transpose (`add_to_frames`,
//! `move_frames_back`). `turn_frames` converts derivatives of a number by angles of edges to those by frames.

use crate::energy::frame::{EdgeFrame, one_plus_dot};
use crate::numerics::directions::Directions;
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::{Vector, add, combine, components, cross, dot, map_components};
use num_dual::Dual64;
use std::fmt::Debug;

/// The reference frames of the angles of a rod.
pub trait ReferenceFrames<D: Scalar>: Clone + Debug + Send + Sync {
    /// Frames made of the tangents and directors of all edges and the reference twists of all joints, rad. In the plane
    /// and by an assembly both lists are ignored.
    fn from_parts(edges: Vec<EdgeFrame<D>>, twists: Vec<D>) -> Self;

    /// The frames (tangent and reference director) of all edges; an empty list in the plane and of an assembly.
    fn edge_frames(&self) -> &[EdgeFrame<D>] {
        &[]
    }

    /// The reference twists of all joints, rad: the twist of the material directors of a joint whose edges have equal
    /// angles. An empty list in the plane.
    fn twists(&self) -> &[D] {
        &[]
    }

    /// The frames of all edges and the reference twists of all joints, mutable; empty lists in the plane.
    fn parts_mut(&mut self) -> (&mut [EdgeFrame<D>], &mut [D]) {
        (&mut [], &mut [])
    }

    /// Moves the frames to the edges at `q` by parallel transport, and updates the reference twists. Angles, strains
    /// and energies at `q` do not change. No operation in the plane.
    fn move_to(&mut self, _q: &[D]) {}

    /// Overwrites the angles in `q`, measured from these frames, by those measured from the frames `to`. Material
    /// directors and the twist of every joint stay; whole turns are chosen accordingly. No operation in the plane.
    fn convert_angles(&self, _q: &mut [D], _to: &Self) {}

    /// The first material director, a unit vector, of an edge at the unknowns `q`; `None` in the plane.
    fn director(&self, _q: &[D], _edge: usize) -> Option<[D; 3]> {
        None
    }

    /// Sets the angles in `q` so that no joint is twisted, for edges along the tangents of these frames. The angle of
    /// the first edge stays. No operation in the plane.
    fn untwist(&self, _q: &mut [D]) {}

    /// Sets the angle of an edge in `q` so that its first material director is `director`. Of the possible angles,
    /// whole turns apart, the one nearest to the present angle plus `turn`, rad, is taken. No operation in the plane.
    fn align(&self, _q: &mut [D], _edge: usize, _director: [D; 3], _turn: f64) {}
}

impl<D: Scalar> ReferenceFrames<D> for () {
    /// The empty frames `()` of a planar rod; both lists are ignored.
    fn from_parts(_: Vec<EdgeFrame<D>>, _: Vec<D>) {}
}

/// Overwrites edge frames and reference twists of `frames` with the real parts of those of `dual`, without
/// derivatives.
pub fn set_real_frames<D: Scalar>(
    dual: &impl ReferenceFrames<Dual64>,
    frames: &mut impl ReferenceFrames<D>,
) {
    let (edges, twists) = frames.parts_mut();
    for (to, from) in edges.iter_mut().zip(dual.edge_frames()) {
        *to = from.map(|x| D::from(x.re));
    }
    for (to, from) in twists.iter_mut().zip(dual.twists()) {
        *to = D::from(from.re);
    }
}

/// The derivatives of the reference frame of an edge along `G` parameters.
#[derive(Clone, Copy, Debug)]
pub struct FrameRate<const G: usize> {
    /// Those of its tangent.
    pub tangent: [Directions<G>; 3],
    /// The rotation of its directors about the tangent, rad.
    pub turn: Directions<G>,
}

/// A list of `count` zero derivatives, for the frames of `count` edges that do not change.
pub fn zero_frame_rates(count: usize) -> Vec<FrameRate<1>> {
    vec![FrameRate { tangent: [Directions::ZERO; 3], turn: Directions::ZERO }; count]
}

/// The derivatives of the frames of all edges that `duals` contain, one entry per edge and one lane per dual set of
/// frames. The rotation is the component of the director's derivative along the second director. The list is empty in
/// the plane.
pub fn frame_rates<F: ReferenceFrames<Dual64>, const G: usize>(
    duals: [&F; G],
) -> Vec<FrameRate<G>> {
    let frames = duals.map(F::edge_frames);
    let edges = frames.first().map_or(0, |edges| edges.len());
    let rate = |j: usize| FrameRate {
        tangent: [0, 1, 2].map(|c| Directions(frames.map(|edges| edges[j].tangent[c].eps))),
        turn: Directions(frames.map(|edges| {
            let EdgeFrame { tangent, director } = edges[j];
            // A unit director changes across itself: along the tangent, by the change of the tangent, and along the
            // second director.
            let second = cross(tangent.map(|x| x.re), director.map(|x| x.re));
            dot(director.map(|x| x.eps), second)
        })),
    };
    (0..edges).map(rate).collect()
}

/// Overwrites `dual` with the plain `frames` as real parts. Its derivatives are those in lane `lane` of `rates`;
/// those of the directors and of the reference twists follow from them.
pub fn set_dual_frames<const G: usize>(
    frames: &impl ReferenceFrames<f64>,
    rates: &[FrameRate<G>],
    lane: usize,
    dual: &mut impl ReferenceFrames<Dual64>,
) {
    let tangent_rate = |j: usize| map_components(&rates[j].tangent, |x| x.0[lane]);
    let turn = |j: usize| rates[j].turn.0[lane];
    let pair = |x: Vector<f64>, rate: Vector<f64>| components(|c| Dual64::new(x[c], rate[c]));
    let (edges, twists) = dual.parts_mut();
    for (j, (to, from)) in edges.iter_mut().zip(frames.edge_frames()).enumerate() {
        let EdgeFrame { tangent, director } = *from;
        // The director stays normal to the tangent: `d.t = 0` gives its change along the tangent.
        let along = -dot(director, tangent_rate(j));
        let rate = combine(turn(j), cross(tangent, director), along, tangent);
        *to = EdgeFrame { tangent: pair(tangent, tangent_rate(j)), director: pair(director, rate) };
    }
    // A transported director turns as over a step.
    for (i, (to, from)) in twists.iter_mut().zip(frames.twists()).enumerate() {
        let [e, f] = [i, i + 1].map(|j| frames.edge_frames()[j].tangent);
        let both = add(tangent_rate(i), tangent_rate(i + 1));
        let across = dot(cross(e, f), both) / one_plus_dot(e, f);
        *to = Dual64::new(*from, turn(i + 1) - turn(i) + across);
    }
}

/// The geometry of a rod at its unknowns in plain numbers: strains of edges and joints, and the products with
/// derivatives of its frames. In the plane the products with frames are empty.
pub trait RodGeometry: Clone + Debug + Default + Send + Sync {
    /// Sets the lists to `edges` edges and `edges - 1` joints.
    fn resize(&mut self, edges: usize);

    /// The axial strains of the edges, dimensionless, from the first edge on.
    fn edge_strains(&self) -> impl Iterator<Item = f64>;

    /// The strains of the joints, dimensionless, one joint after the other: one curvature in the plane, two
    /// curvatures and the twist (rad) in space.
    fn joint_strains(&self) -> impl Iterator<Item = f64>;

    /// Overwrites `out` with the strains of all edges, then of all joints: the order of
    /// [`Rod::strains`](crate::rod::Rod::strains).
    fn write_strains(&self, out: &mut Vec<f64>) {
        out.clear();
        out.extend(self.edge_strains());
        out.extend(self.joint_strains());
    }

    /// First half of [`add_frame_rates`](Self::add_frame_rates), without the tangent. Overwrites the entries of
    /// angles of edges in `angles`, rad, with the rotations of the directors by the derivatives of the frames. Adds
    /// the remaining derivatives of the gradient, at the given `gradient`, to `out`, N. No operation in the plane.
    fn add_frame_forces<const G: usize>(
        &self,
        _frames: &[FrameRate<G>],
        _gradient: &[f64],
        _angles: &mut [[f64; G]],
        _out: &mut [[f64; G]],
    ) {
    }

    /// Adds to `out` the derivatives of the gradient, N, along those of the `frames` at fixed unknowns, for `G`
    /// parameters. `gradient` and `tangent` are those at this geometry. Nothing happens without frames.
    fn add_frame_rates<const G: usize>(
        &self,
        frames: &[FrameRate<G>],
        gradient: &[f64],
        tangent: &impl Tangent<f64>,
        out: &mut [[f64; G]],
    ) {
        if frames.is_empty() {
            return;
        }
        let mut angles = vec![[0.0; G]; out.len()];
        self.add_frame_forces(frames, gradient, &mut angles, out);
        tangent.add_product(&angles, out);
    }

    /// Replaces the derivatives of the `frames` before a step by those after it, when the frames move to this
    /// geometry. `q` are the derivatives of the unknowns there. No operation in the plane.
    fn move_frame_rates<const G: usize>(&self, _frames: &mut [FrameRate<G>], _q: &[[f64; G]]) {}

    /// A change of a frame changes the angle of its material director. Adds to `frames` the derivatives of a number
    /// by the frames that follow, by the chain rule, from its derivatives by the `angles` of the edges (one entry per
    /// unknown). No operation in the plane.
    fn turn_frames(&self, _angles: &[f64], _frames: &mut [FrameRate<1>]) {}

    /// The transpose of [`add_frame_rates`](Self::add_frame_rates): adds to `frames` the derivatives of a number by
    /// the frames. `d` are its derivatives by the forces, `stiff` is the product of the tangent with `d`, `gradient`
    /// that at this geometry. No operation in the plane.
    fn add_to_frames(
        &self,
        _gradient: &[f64],
        _d: &[f64],
        _stiff: &[f64],
        _frames: &mut [FrameRate<1>],
    ) {
    }

    /// The transpose of [`move_frame_rates`](Self::move_frame_rates). Replaces the derivatives of a number by the
    /// frames after their move by those before it, and adds the part by the unknowns to `q`. No operation in the
    /// plane.
    fn move_frames_back(&self, _frames: &mut [FrameRate<1>], _q: &mut [f64]) {}
}
