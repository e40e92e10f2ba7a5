//! Constant moments (N m) on the edges of a planar rod: potential (J), gradient (N), tangent (N/m), and derivatives by
//! the moments.
//!
//! A moment `M` has the potential `-M angle`. The angle is that of its edge from the first edge's direction at rest. It
//! is the angle of the first edge, in (-pi, pi], plus the turning angles of the joints between. So whole turns along
//! the rod are counted; those of the first edge over time are added by the caller. In space a constant moment has no
//! potential (Ziegler 1968), so that spatial rods have none.
//!
//! - `add_gradient` and `add_tangent` add first and second derivatives of the potential by the coordinates of the
//!   nodes. `add_edge_tangent` adds the second derivatives by the vectors of the edges; edge `i` has the rows of node
//!   `i + 1`.
//! - [`Moments::potential`] returns the potential, and [`Moments::jump`] minus its jump in a step in which the angle of
//!   the first edge passes half a turn.
//! - [`add_slopes`] adds, for each edge, the derivative of the number `d . gradient` by a moment there, with given
//!   weights `d` of the unknowns. [`Moments::along`] sums such derivatives, each times that of the moment by a
//!   parameter.

use crate::energy::{DeadMoment, Element};
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use num_dual::Dual64;
use std::f64::consts::TAU;

/// The moments on the edges of a planar rod; none in space.
#[derive(Clone, Debug)]
pub struct Moments<D> {
    /// The moments, each with the index of the edge on which it acts.
    pub list: Vec<(usize, DeadMoment<D>)>,
    /// The vector of the first edge at rest, from which the angles of the potential are measured.
    pub heading: [D; 2],
}

/// The four coordinates `[x0, y0, x1, y1]` of the end nodes of edge `i` of a planar rod, m.
#[inline(always)]
fn ends<D>(q: &[D], i: usize) -> &[D; 4] {
    q[2 * i..].first_chunk().expect("an edge's nodes are nodes of the rod")
}

impl<D: Scalar> Moments<D> {
    /// An empty list of moments.
    pub fn none() -> Self {
        Self { list: Vec::new(), heading: [D::from(0.0); 2] }
    }

    /// The angle of the first edge from its direction at rest (`heading`), in (-pi, pi], rad.
    fn first_angle(&self, q: &[D]) -> f64 {
        // The potential of the moment -1 is the angle itself.
        let first = DeadMoment { moment: D::from(-1.0), rest: self.heading };
        first.energy(ends(q, 0)).value()
    }

    /// Adds to `gradient` that of the potential of all moments at `q`, N, at the four coordinates of each moment's
    /// edge.
    pub(super) fn add_gradient(&self, q: &[D], gradient: &mut [D]) {
        for (i, moment) in &self.list {
            let local = moment.gradient(ends(q, *i));
            gradient[2 * i..].iter_mut().zip(local).for_each(|(to, from)| *to += from);
        }
    }

    /// Adds to `gradient`, N, and `tangent`, N/m, the first and second derivatives of the potential of all moments at
    /// `q`.
    pub(super) fn add_tangent(&self, q: &[D], gradient: &mut [D], tangent: &mut impl Tangent<D>) {
        for (i, moment) in &self.list {
            let local = moment.tangent(ends(q, *i));
            gradient[2 * i..].iter_mut().zip(local.gradient).for_each(|(to, from)| *to += from);
            tangent.add_corner(2 * i, 4, &local.hessian);
        }
    }

    /// Adds to `tangent` the second derivatives of the potential by edge vectors, N/m: those by the second node of an
    /// edge. Edge `i` has the rows and columns of node `i + 1`.
    pub(super) fn add_edge_tangent(&self, q: &[D], tangent: &mut impl Tangent<D>) {
        for (i, moment) in &self.list {
            let h = moment.tangent(ends(q, *i)).hessian;
            tangent.add_corner(2 * i + 2, 2, &[[h[2][2], h[2][3]], [h[3][2], h[3][3]]]);
        }
    }

    /// The potential of all moments, J; zero without any. `turning(i)` returns the turning angle of joint `i`, rad.
    /// The angle of an edge is that of the first edge plus the turning angles of the joints before it.
    pub(super) fn potential(&self, q: &[D], turning: impl Fn(usize) -> f64) -> f64 {
        let Some(last) = self.list.iter().map(|(i, _)| *i).max() else { return 0.0 };
        let mut angle = self.first_angle(q);
        let mut potential = 0.0;
        for j in 0..=last {
            // Turning angles are summed, so that whole turns along the rod count.
            if j > 0 {
                angle += turning(j - 1);
            }
            let here = self.list.iter().filter(|(i, _)| *i == j);
            potential -= here.map(|(_, m)| m.moment.value() * angle).sum::<f64>();
        }
        potential
    }

    /// The correction of [`potential`](Self::potential), J, for a step from `before` to `now` in which the angle of the
    /// first edge passes half a turn: `-2 pi n` times the sum of all moments. Here `n` is the number of turns by which
    /// that angle drops, so that the potential itself jumps by `2 pi n` times the sum. Zero in other steps and without
    /// moments.
    pub(super) fn jump(&self, before: &[D], now: &[D]) -> f64 {
        if self.list.is_empty() {
            return 0.0;
        }
        // The angle is in (-pi, pi]: a difference near a whole turn is a passage through half a turn.
        let turns = ((self.first_angle(before) - self.first_angle(now)) / TAU).round();
        let moments: f64 = self.list.iter().map(|(_, m)| m.moment.value()).sum();
        -TAU * turns * moments
    }
}

impl Moments<Dual64> {
    /// The derivative of a number along the parameter of these dual moments. It is the sum of the derivative of each
    /// moment times the entry of `slopes` for its edge: the number's derivative by a moment there. Edges beyond
    /// `slopes` count zero.
    pub(super) fn along(&self, slopes: &[f64]) -> f64 {
        let moments = self.list.iter().filter(|(i, _)| *i < slopes.len());
        moments.map(|(i, m)| m.moment.eps * slopes[*i]).sum()
    }
}

/// Adds to `slopes`, one per edge, the derivatives of the number `d . gradient` by a moment on that edge, at the
/// unknowns `q`. `d` are weights of all unknowns, `gradient` is that of the potential of the moments.
pub(super) fn add_slopes(q: &[f64], d: &[f64], slopes: &mut [f64]) {
    for (i, to) in slopes.iter_mut().enumerate() {
        // Forces are proportional to the moment, and do not depend on its direction at rest.
        let unit = DeadMoment { moment: 1.0, rest: [0.0; 2] };
        let forces = unit.gradient(ends(q, i));
        *to += forces.iter().zip(&d[2 * i..]).map(|(f, d)| f * d).sum::<f64>();
    }
}
