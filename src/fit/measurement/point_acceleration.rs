//! Acceleration less gravity of a point of the rod along an axis that is fixed to the rod, as an accelerometer measures
//! it.
//!
//! Input: the point, the direction of the axis along tangent, first and second director of the rod, and the recorded
//! motion of nodes and directors around the point. Output of [`accelerations`]: the component at every recorded time,
//! m/s^2. The acceleration is the derivative of the recorded velocities by a parabola through three times, of second
//! order; gravity is subtracted. A single recorded time has the acceleration zero. Errors are a point outside the rod,
//! and nodes or edges that are not recorded.

use crate::dynamics::record::RecordView;
use crate::error::Error;
use crate::fit::measurement::simulated::SimulatedOutput;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{dot, sub};
use crate::scene::marker::MarkerStencil;
use crate::scene::{Point, Stencil};

/// The component along `direction` of acceleration less gravity, m/s^2, of a `point`, one number per time of a record.
/// `direction` is a unit vector along tangent, first and second director, and turns with the rod. Error: a point
/// outside the rod or not recorded.
pub(super) fn accelerations<D: Scalar>(
    point: Point,
    direction: [f64; 3],
    record: &RecordView<'_, D>,
    simulated: &SimulatedOutput<D>,
) -> Result<Vec<D>, Error> {
    let marker = MarkerStencil::new(point.fixed(), direction, simulated.mesh)?;
    let axis = MarkerStencil { centre: Stencil { nodes: Vec::new() }, ..marker.clone() };
    let times = record.times();
    let velocity = |time: &f64| Ok(record.motion(&marker.centre, *time)?[1]);
    let velocities = times.iter().map(velocity).collect::<Result<Vec<_>, Error>>()?;
    let rates = parabola_slopes(times, &velocities);
    let component = |(time, rate): (&f64, [D; 3])| {
        let along = record.marker(&axis, D::from(*time))?;
        Ok(dot(sub(rate, simulated.scene.loads.gravity), along))
    };
    times.iter().zip(rates).map(component).collect()
}

/// The slope at each of these times of the parabola through the values there and at both neighbours; at an end the
/// parabola is that of its neighbour. Zero for a single value.
fn parabola_slopes<D: Scalar>(times: &[f64], values: &[[D; 3]]) -> Vec<[D; 3]> {
    let last = times.len().saturating_sub(1);
    let secant = |k: usize| {
        let over = 1.0 / (times[k + 1] - times[k]);
        sub(values[k + 1], values[k]).map(|x| x * over)
    };
    let slope = |k: usize| match last {
        0 => [D::from(0.0); 3],
        1 => secant(0),
        _ => {
            let middle = k.clamp(1, last - 1);
            let [before, after] = [secant(middle - 1), secant(middle)];
            let steps = [times[middle] - times[middle - 1], times[middle + 1] - times[middle]];
            // The slope of the parabola is linear, and equal to the secants in the middle of both steps.
            let from_first = times[k] - 0.5 * (times[middle - 1] + times[middle]);
            let part = from_first / (0.5 * (steps[0] + steps[1]));
            std::array::from_fn(|c| before[c] + (after[c] - before[c]) * part)
        }
    };
    (0..times.len()).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The derivative of a parabola is exact at unequal times, also at both ends.
    #[test]
    fn slopes_of_a_parabola_are_exact() {
        let times = [0.0, 0.1, 0.25, 0.3, 0.7];
        let values = times.map(|t: f64| [1.0 - 3.0 * t + 5.0 * t * t, t, 0.0]);
        for (t, slope) in times.iter().zip(parabola_slopes(&times, &values)) {
            let exact = [-3.0 + 10.0 * t, 1.0, 0.0];
            assert!((0..3).all(|c| (slope[c] - exact[c]).abs() < 1e-12), "{t}: {slope:?}");
        }
        assert_eq!(parabola_slopes(&[0.0], &[[1.0; 3]]), [[0.0; 3]]);
    }
}
