//! Reference frames of the angles of a rod, and the derivatives of these frames along parameters.
//!
//! In space the angle of an edge is measured from a reference frame, [`Frames`](crate::energy::frame::Frames): tangent
//! and director of each edge, reference twist of each joint (time-parallel transport, Bergou et al. 2010). A planar rod
//! has no angles; its frames are `()`, and every operation is empty. The derivative of a frame is that of its tangent
//! and one turn about it ([`FrameRate`]).

use crate::energy::frame::{EdgeFrame, one_plus_dot};
use crate::numerics::lanes::Lanes;
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::{Vector, add, combine, components, cross, dot, map_components};
use num_dual::Dual64;
use std::fmt::Debug;

/// The reference frames of the angles of a rod.
pub trait ReferenceFrames<D: Scalar>: Clone + Debug + Send + Sync {
    /// Frames from those of all edges and the reference twists of all joints, rad.
    fn from_parts(edges: Vec<EdgeFrame<D>>, twists: Vec<D>) -> Self;

    /// The frames of all edges; none in the plane.
    fn edge_frames(&self) -> &[EdgeFrame<D>] {
        &[]
    }

    /// The reference twists of all joints, rad; none in the plane.
    fn twists(&self) -> &[D] {
        &[]
    }

    /// The frames of all edges and the twists of all joints, mutable.
    fn parts_mut(&mut self) -> (&mut [EdgeFrame<D>], &mut [D]) {
        (&mut [], &mut [])
    }

    /// Moves the frames to the edges at `q` by parallel transport; no energy there changes.
    fn move_to(&mut self, _q: &[D]) {}

    /// Converts the angles of `q`, measured from these frames, to angles from the frames `to`: same directors, same
    /// twist.
    fn convert_angles(&self, _q: &mut [D], _to: &Self) {}

    /// The first material director of an edge at `q`; `None` in the plane.
    fn director(&self, _q: &[D], _edge: usize) -> Option<[D; 3]> {
        None
    }

    /// Sets the angles in `q` so that no joint is twisted; the angle of the first edge stays.
    fn untwist(&self, _q: &mut [D]) {}

    /// Sets the angle of an edge in `q` so that its first material director is `director`. Of the possible angles,
    /// whole turns apart, the one nearest to the present angle plus `turn`, rad, is taken.
    fn align(&self, _q: &mut [D], _edge: usize, _director: [D; 3], _turn: f64) {}
}

impl<D: Scalar> ReferenceFrames<D> for () {
    /// The empty frames of a planar rod.
    fn from_parts(_: Vec<EdgeFrame<D>>, _: Vec<D>) {}
}

/// Overwrites `frames` with the real part of dual frames.
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
    pub tangent: [Lanes<G>; 3],
    /// The rotation of its directors about the tangent, rad.
    pub turn: Lanes<G>,
}

/// Zero derivatives of `count` frames.
pub fn still_frames(count: usize) -> Vec<FrameRate<1>> {
    vec![FrameRate { tangent: [Lanes::ZERO; 3], turn: Lanes::ZERO }; count]
}

/// The derivatives that dual frames contain, one lane per parameter.
pub fn frame_rates<F: ReferenceFrames<Dual64>, const G: usize>(
    duals: [&F; G],
) -> Vec<FrameRate<G>> {
    let frames = duals.map(F::edge_frames);
    let edges = frames.first().map_or(0, |edges| edges.len());
    let rate = |j: usize| FrameRate {
        tangent: [0, 1, 2].map(|c| Lanes(frames.map(|edges| edges[j].tangent[c].eps))),
        turn: Lanes(frames.map(|edges| {
            let EdgeFrame { tangent, director } = edges[j];
            let second = cross(tangent.map(|x| x.re), director.map(|x| x.re));
            dot(director.map(|x| x.eps), second)
        })),
    };
    (0..edges).map(rate).collect()
}

/// Overwrites `dual` with the plain `frames` and their derivatives in lane `lane` of `rates`.
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
    /// Sets the lists to so many edges, and one joint fewer.
    fn resize(&mut self, edges: usize);

    /// The strains of the edges, dimensionless.
    fn edge_strains(&self) -> impl Iterator<Item = f64>;

    /// The strains of the joints, dimensionless, one joint after the other.
    fn joint_strains(&self) -> impl Iterator<Item = f64>;

    /// Overwrites `out` with the strains of all edges, then of all joints.
    fn write_strains(&self, out: &mut Vec<f64>) {
        out.clear();
        out.extend(self.edge_strains());
        out.extend(self.joint_strains());
    }

    /// Writes the angles by which the directors turn with the derivatives of the frames, rad, to the unknowns that are
    /// angles of edges. Adds the derivatives of the gradient along those of the frames at fixed unknowns but for the
    /// products of these angles with the tangent. The gradient is that given.
    fn add_frame_forces<const G: usize>(
        &self,
        _frames: &[FrameRate<G>],
        _gradient: &[f64],
        _angles: &mut [[f64; G]],
        _out: &mut [[f64; G]],
    ) {
    }

    /// Adds to `out` the derivatives of the gradient, N, along those of the frames at fixed unknowns. `gradient` and
    /// `tangent` are those at this geometry.
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

    /// Replaces the derivatives of the frames before a step by those after it, when the frames move to this geometry.
    /// `q` are the derivatives of the unknowns there.
    fn move_frame_rates<const G: usize>(&self, _frames: &mut [FrameRate<G>], _q: &[[f64; G]]) {}

    /// Adds to `frames` the derivatives of a number by the frames that follow from those by the `angles` of the edges.
    fn turn_frames(&self, _angles: &[f64], _frames: &mut [FrameRate<1>]) {}

    /// The transpose of [`add_frame_rates`](Self::add_frame_rates): adds the derivatives of a number by the frames,
    /// where it has those `d` by the forces, and `stiff` is the product of `d` with the tangent.
    fn add_to_frames(
        &self,
        _gradient: &[f64],
        _d: &[f64],
        _stiff: &[f64],
        _frames: &mut [FrameRate<1>],
    ) {
    }

    /// The transpose of [`move_frame_rates`](Self::move_frame_rates): replaces the derivatives of a number by the frames
    /// after their move by those before it, and adds the part by the unknowns to `q`.
    fn move_frames_back(&self, _frames: &mut [FrameRate<1>], _q: &mut [f64]) {}
}
