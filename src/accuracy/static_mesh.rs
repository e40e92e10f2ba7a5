//! The mesh of an equilibrium or of vibration modes: the number of edges is doubled until an extrapolation reaches
//! [`TARGET_PART`] of the requested error.
//!
//! Input: the scene, the calculation, and the first number of edges. Compared are positions over the length, or the
//! logarithms of frequencies and growth rates. The positions are those of the points that divide the rod into [`PARTS`]
//! parts, and of ends that are free or on a roller. Modes are about the rest shape if there is no equilibrium. The
//! error follows by Richardson extrapolation with the observed order (`difference`). The chosen mesh follows by
//! extrapolation: from half of the last mesh to [`MAX_EXTRAPOLATION`] times it, which is 1 to 2 by the number of
//! compared meshes. It has at least 2 edges per mode. A mesh without an equilibrium is skipped if a finer one is
//! allowed. Compared meshes have at most [`MAX_SEGMENTS`] edges ([`MAX_SEGMENTS_OF_MODES`], or the first number, for
//! modes). The search ends there at the latest, or where rounding errors dominate; then the requested error may not be
//! reached. Output: [`StaticMesh`] with the number of edges, the estimated error (over the length, or relative for
//! modes), and the reason in that case. Failed solutions are errors.

use crate::accuracy::calculation::{
    Calculation, MAX_SEGMENTS, MAX_SEGMENTS_OF_MODES, allowed_edges,
};
use crate::accuracy::difference::{OrderBounds, Positions, RefinementSequence, largest_distance};
use crate::accuracy::extrapolation::order_of_mesh;
use crate::accuracy::trial::comparison_points;
use crate::error::Error;
use crate::problem::Problem;
use crate::scene::resolution::Bound;
use crate::scene::{Point, Scene};
use crate::vibration::LinearizationPoint;

/// Allowed error of the mesh over the requested one: a reserve for the error of the estimate.
const TARGET_PART: f64 = 0.78;
/// Factor on the error after a single difference, over that of the theoretical order.
const SINGLE_DIFFERENCE_SAFETY: f64 = 1.5;
/// Lowest observed order of a converging sequence, for methods of second and of first order. Higher values compare more
/// meshes.
const LOWEST_ORDERS: [f64; 2] = [1.32, 0.486];
/// Largest refinement of the chosen mesh over the finest compared one: after three meshes, after two, and after two of
/// which a coarser one had no equilibrium.
const MAX_EXTRAPOLATION: [f64; 3] = [2.0, 1.3, 1.0];
/// Differences below this that do not decrease are rounding errors.
const MAX_ROUNDING: f64 = 1e-4;
/// Number of equal parts of the rod between the compared points of an equilibrium. With eight parts, as for motions, an
/// error beside a wall of a tensioned rod was 1.7 times the estimate. With more parts than edges, points are on the
/// straight edges within clamps, where the error of a curved rod is larger.
const PARTS: usize = 16;
/// Differences below this count as zero.
const NO_DIFFERENCE: f64 = 1e-12;

/// Bounds of the observed order, for a method of the theoretical order `order` (1 or 2), which is the highest. The
/// assumed order enlarges the error after a single difference by [`SINGLE_DIFFERENCE_SAFETY`].
fn order_bounds(order: f64) -> OrderBounds {
    let assumed = (1.0 + (order.exp2() - 1.0) / SINGLE_DIFFERENCE_SAFETY).log2();
    let lowest = if order > 1.0 { LOWEST_ORDERS[0] } else { LOWEST_ORDERS[1] };
    OrderBounds { highest: order, at_once: order, lowest, assumed }
}

/// A chosen mesh: number of edges, estimated error over the length or the frequency, and the reason where that is above
/// the requested one.
pub(super) struct StaticMesh {
    pub segments: usize,
    pub error: Option<f64>,
    pub bound: Option<Bound>,
}

/// Chooses the mesh of an equilibrium or of modes. The number of edges is doubled from `first` on; `step`, s, is that
/// of the scene. After each solution the number for [`TARGET_PART`] of the requested error is extrapolated. The search
/// ends if that is at most [`MAX_EXTRAPOLATION`] times the last one. The chosen number is that one, but at least half
/// of the last one, 2, or 2 per mode. A mesh without an equilibrium is skipped if a finer one is allowed. The search
/// also ends at the largest mesh, which is then chosen. Where differences below [`MAX_ROUNDING`] do not decrease, half
/// of the last mesh is chosen. In both cases the error is the last estimate or difference, and the reason is
/// [`Bound::Work`] if it is above the requested one or unknown.
///
/// # Errors
///
/// Those of the solutions, and of building a problem.
pub(super) fn choose_static_mesh(
    scene: &Scene,
    calculation: Calculation,
    first: usize,
    step: f64,
) -> Result<StaticMesh, Error> {
    let (order, allowed) = (order_of_mesh(scene), TARGET_PART * scene.asked());
    let mut differences = RefinementSequence::new(order_bounds(order));
    let (mut segments, mut before, mut has_failed) = (first, None, false);
    let (most, least) = match calculation {
        Calculation::Modes(count) => (MAX_SEGMENTS_OF_MODES.max(first), 2 * count),
        _ => (MAX_SEGMENTS, 2),
    };
    // The search ends before its target, which is below the requested error, but perhaps within the latter.
    let bound =
        |error: Option<f64>| error.is_none_or(|error| error > scene.asked()).then_some(Bound::Work);
    loop {
        let now = match compared_quantities(&scene.resolved(segments, step).build()?, calculation) {
            // A coarse mesh may have no equilibrium where a finer one has.
            Err(Error::Equilibrium { .. }) if 2 * segments <= most => None,
            compared => Some(compared?),
        };
        // A skipped mesh interrupts the sequence: a difference across it would have another ratio.
        match before.as_ref().zip(now.as_ref()) {
            Some((before, now)) => differences.push(largest_distance(before, now), 2.0),
            None => differences.clear(),
        }
        has_failed |= now.is_none();
        before = now;
        let last = differences.last();
        // Meshes that agree to rounding errors have no observable order.
        let is_none = differences.count() > 1 && last.is_some_and(|last| last < NO_DIFFERENCE);
        let known = differences.count() > 0 && (differences.is_converging() || is_none);
        let error = known.then(|| if is_none { last.unwrap_or(0.0) } else { differences.error() });
        if let Some(error) = error {
            // The extrapolation is shorter where the order is assumed from a single difference.
            let far = match (differences.count(), has_failed) {
                (1, true) => MAX_EXTRAPOLATION[2],
                (1, false) => MAX_EXTRAPOLATION[1],
                _ => MAX_EXTRAPOLATION[0],
            };
            let power = if is_none { order } else { differences.order_or(order) };
            let finer = (error / allowed).powf(power.recip());
            if finer <= far {
                let chosen = (segments as f64 * finer.max(0.5)).ceil() as usize;
                let chosen = allowed_edges(scene, chosen.max(least));
                let error = error * (chosen as f64 / segments as f64).powf(-power);
                return Ok(StaticMesh { segments: chosen, error: Some(error), bound: None });
            }
        }
        if differences.count() > 2 && !differences.is_falling() && last < Some(MAX_ROUNDING) {
            // Finer meshes have larger rounding errors.
            return Ok(StaticMesh { segments: segments / 2, error: last, bound: bound(last) });
        }
        if 2 * segments > most {
            let error = error.or(last);
            return Ok(StaticMesh { segments, error, bound: bound(error) });
        }
        segments *= 2;
    }
}

/// Logarithm and sign of a frequency or, negative, of a growth rate, rad/s, as a vector with a third entry of zero;
/// zeros for zero. The distance of two meshes is the relative error of the mode. It is above one where the mode is
/// stable on one mesh only.
fn logarithm(frequency: f64) -> [f64; 3] {
    match frequency == 0.0 {
        true => [0.0; 3],
        false => [frequency.abs().ln(), frequency.signum(), 0.0],
    }
}

/// The quantities of a mesh that are compared. For an equilibrium the positions of the [`comparison_points`] of
/// [`PARTS`] parts, over the length. For modes the [logarithm] of each frequency, about the equilibrium, or about the
/// rest shape where there is none. Error: the equilibrium, or modes about both, cannot be computed.
fn compared_quantities(problem: &Problem, calculation: Calculation) -> Result<Positions, Error> {
    if let Calculation::Modes(count) = calculation {
        // A rod without an equilibrium has modes about its unstressed shape.
        let found = problem
            .modes(count, LinearizationPoint::Equilibrium)
            .or_else(|_| problem.modes(count, LinearizationPoint::Rest))?;
        return Ok(found.modes.iter().map(|mode| logarithm(mode.frequency_rad_s)).collect());
    }
    let rest = problem.equilibrium()?;
    let over = problem.length().recip();
    let place = |point: &Point| {
        let mut place = [0.0; 3];
        for (i, weight) in problem.stencil(*point)?.nodes {
            (0..3).for_each(|c| place[c] += over * weight * rest.nodes[i][c]);
        }
        Ok(place)
    };
    comparison_points(problem, PARTS).iter().map(place).collect()
}
