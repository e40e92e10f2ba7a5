//! Derivatives of a step by parameters through loads in time, forward and transposed.
//!
//! Loads in time are forces (N), and in a plane moments (N m) on edges, that follow signals. `F` and `m` are their
//! means over the step, `g(q)` is the gradient of a moment of size 1, and `end` and `start` are factors of the scheme.
//! The residual (kg m) has the terms `-(end + start) F + end m g(q1) + start m g(q0)`. An averaging scheme has
//! `-end F`, and `end m g` at its stages. The forces that a state stores contain no loads in time. Forward, the
//! derivatives of `F` and `m` along one parameter come from dual numbers: by sizes and places of loads, gain, delay and
//! numbers of signals, and the parameter of the scheme, on which factors and interval depend. [`TimedLoadRates`] adds
//! them to those of forces and right-hand sides. Transposed ([`TimedLoadSlopes`]), the same terms are multiplied with
//! the derivatives of a misfit by forces and right-hand sides, and summed over all steps for each parameter.
//!
//! `TimedLoadRates::add` adds to the derivatives of forces at the end at fixed unknowns and of right-hand sides.
//! `subtract_moments` removes those of the moments from the forces of the state at the end.
//! `TimedLoadSlopes::transpose_end` is the transpose of the latter; `transpose_right` and `transpose_direct` are those
//! of the two parts of `add`. All three add to the sums, and the first two to derivatives by unknowns.
//! `TimedLoadSlopes::add` adds a parameter; `sums` returns its derivative with its index.

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::linearization::Linearization;
use crate::dynamics::step_map::StateRates;
use crate::numerics::vector::components;
use crate::rod::{EdgeMoment, Rod, TimedLoads, UnknownForce};
use num_dual::Dual64;

/// The loads in time with the derivative along one parameter.
#[derive(Clone)]
pub struct TimedLoadRates {
    loads: TimedLoads<Dual64>,
    /// The derivative of the parameter of the scheme.
    scheme: f64,
}

/// The mean loads of a step, and the coefficients of its equations, with the derivative along one parameter.
struct MeanLoads {
    coefficients: StepCoefficients<Dual64>,
    forces: Vec<UnknownForce<Dual64>>,
    moments: Vec<EdgeMoment<Dual64>>,
}

/// The gradient, N, of the potential of a `moment` by the four coordinates of its edge at the unknowns `q`. It has the
/// derivative of the moment; the unknowns have none.
fn gradient_at(moment: &EdgeMoment<Dual64>, q: &[f64]) -> [Dual64; 4] {
    gradient_moving(moment, q, |_| 0.0)
}

/// The gradient, N, of the potential of a `moment` by the four coordinates of its edge at the unknowns `q`, of which
/// unknown `i` has the derivative `rate(i)`.
fn gradient_moving(
    moment: &EdgeMoment<Dual64>,
    q: &[f64],
    rate: impl Fn(usize) -> f64,
) -> [Dual64; 4] {
    let first = 2 * moment.edge;
    let own: [Dual64; 4] = components(|k| Dual64::new(q[first + k], rate(first + k)));
    EdgeMoment { edge: 0, moment: moment.moment }.forces(&own).map(|force| -force)
}

impl TimedLoadRates {
    /// The `loads`, whose numbers have the derivative along the parameter, and the derivative of the parameter of the
    /// `scheme` along it.
    pub fn new(loads: &TimedLoads<Dual64>, scheme: f64) -> Self {
        Self { loads: loads.clone(), scheme }
    }

    /// The mean forces, N, and moments, N m, over the interval of a step, and the coefficients of its equations, all
    /// with the derivatives along the parameter.
    fn means<R: Rod<f64>>(&self, step: &Linearization<'_, f64, R>) -> MeanLoads {
        let coefficients = step.coefficients(Dual64::new(step.parameter, self.scheme));
        let (mut forces, mut moments) = (Vec::new(), Vec::new());
        let interval = coefficients.load_interval(step.before.time);
        self.loads.set_mean(interval, &mut forces, &mut moments);
        MeanLoads { coefficients, forces, moments }
    }

    /// Adds to lane `g` of `direct` the derivatives of the gradients of mean moments, N, at fixed unknowns at the end
    /// (of an averaging scheme at its stages). Adds to lane `g` of `right` the derivatives of the right-hand sides, kg
    /// m, by mean forces and by mean moments at the start of the step. `q0` are the derivatives of the unknowns at the
    /// start.
    pub fn add<R: Rod<f64>, const G: usize>(
        &self,
        step: &Linearization<'_, f64, R>,
        q0: &[[f64; G]],
        g: usize,
        [direct, right]: [&mut [[f64; G]]; 2],
    ) {
        let means = self.means(step);
        means.for_each_right(step, |i| q0[i][g], |i, rate| right[i][g] += rate);
        means.for_each_direct(step, |i, rate| direct[i][g] += rate);
    }

    /// Subtracts the derivatives of the mean moments from lane `g` of `forces`, those of the forces at the end: the
    /// forces of a state have no loads in time. The unknowns at the end have the derivatives `q1`. Nothing for
    /// averaging schemes.
    pub fn subtract_moments<R: Rod<f64>, const G: usize>(
        &self,
        step: &Linearization<'_, f64, R>,
        q1: &[[f64; G]],
        g: usize,
        forces: &mut [[f64; G]],
    ) {
        let means = self.means(step);
        if means.coefficients.averages() {
            return;
        }
        for moment in &means.moments {
            let gradient = gradient_moving(moment, &step.after.q, |i| q1[i][g]);
            for (k, by) in gradient.into_iter().enumerate() {
                forces[2 * moment.edge + k][g] -= by.eps;
            }
        }
    }
}

impl MeanLoads {
    /// Calls `each(unknown, rate)` with the derivatives of the right-hand sides, kg m, of free unknowns: through
    /// forces, and through moments at the start of the step. The unknowns there have the derivatives `q0`. Averaging
    /// schemes have no moments there.
    fn for_each_right<R: Rod<f64>>(
        &self,
        step: &Linearization<'_, f64, R>,
        q0: impl Fn(usize) -> f64,
        mut each: impl FnMut(usize, f64),
    ) {
        let factor = self.coefficients.load_factor();
        for UnknownForce { unknown, force } in &self.forces {
            if step.free.contains(unknown) {
                each(*unknown, (factor * *force).eps);
            }
        }
        if self.coefficients.averages() {
            return;
        }
        for moment in &self.moments {
            let gradient = gradient_moving(moment, &step.before.q, &q0);
            for (k, by) in gradient.into_iter().enumerate() {
                let unknown = 2 * moment.edge + k;
                if step.free.contains(&unknown) {
                    each(unknown, -(self.coefficients.start * by).eps);
                }
            }
        }
    }

    /// Calls `each(unknown, rate)` with the derivatives of the gradients of moments, N, at fixed unknowns: at the end
    /// of the step, or at the stages of an averaging scheme, times their weights.
    fn for_each_direct<R: Rod<f64>>(
        &self,
        step: &Linearization<'_, f64, R>,
        mut each: impl FnMut(usize, f64),
    ) {
        for moment in &self.moments {
            let mut add = |q: &[f64], weight: f64| {
                for (k, by) in gradient_at(moment, q).into_iter().enumerate() {
                    each(2 * moment.edge + k, weight * by.eps);
                }
            };
            match self.coefficients.averages() {
                true => {
                    let stages = step.stages.iter().zip(self.coefficients.stages);
                    stages.for_each(|(forces, stage)| add(&forces.q, stage.weight));
                }
                false => add(&step.after.q, 1.0),
            }
        }
    }
}

/// A parameter with the derivative of a misfit through loads in time so far.
struct TimedParameter {
    parameter: usize,
    rates: TimedLoadRates,
    sum: f64,
}

/// Derivatives of a misfit by parameters through loads in time, for the adjoint method.
#[derive(Default)]
pub struct TimedLoadSlopes(Vec<TimedParameter>);

impl TimedLoadSlopes {
    /// Adds the parameter with this index in the gradient, and the loads in time with their derivatives along it. Its
    /// sum begins at zero.
    pub fn add(&mut self, parameter: usize, rates: TimedLoadRates) {
        self.0.push(TimedParameter { parameter, rates, sum: 0.0 });
    }

    /// Indices of the parameters, each with the derivative of the misfit through loads in time.
    pub fn sums(&self) -> impl Iterator<Item = (usize, f64)> {
        self.0.iter().map(|own| (own.parameter, own.sum))
    }

    /// The transpose of [`TimedLoadRates::subtract_moments`], from the derivatives of the misfit by the forces at the
    /// end, `state.unbalanced`: adds to the sums of the parameters and to the derivatives by the unknowns at the end,
    /// `state.q`.
    pub fn transpose_end<R: Rod<f64>>(
        &mut self,
        step: &Linearization<'_, f64, R>,
        state: &mut StateRates<1>,
    ) {
        let by_force = |i: usize| match step.free.contains(&i) {
            true => state.unbalanced[i][0],
            false => 0.0,
        };
        for TimedParameter { rates, sum, .. } in &mut self.0 {
            for moment in &rates.means(step).moments {
                for (k, by) in gradient_at(moment, &step.after.q).into_iter().enumerate() {
                    *sum -= by_force(2 * moment.edge + k) * by.eps;
                }
            }
        }
        let mut moved = Vec::new();
        for moment in step.timed_moments {
            let d = components(|k| by_force(2 * moment.edge + k));
            moved.push((2 * moment.edge, tangent_product(moment, &step.after.q, d)));
        }
        for (first, by) in moved {
            (0..4).for_each(|k| state.q[first + k][0] -= by[k]);
        }
    }

    /// The transpose of the part of [`TimedLoadRates::add`] by right-hand sides, from the derivatives `right` of the
    /// misfit by them: adds to the sums of the parameters, and the derivatives by the unknowns at the start to `q0`.
    pub fn transpose_right<R: Rod<f64>>(
        &mut self,
        step: &Linearization<'_, f64, R>,
        right: &[[f64; 1]],
        q0: &mut [[f64; 1]],
    ) {
        for TimedParameter { rates, sum, .. } in &mut self.0 {
            let means = rates.means(step);
            means.for_each_right(step, |_| 0.0, |unknown, rate| *sum += right[unknown][0] * rate);
        }
        let start = step.coefficients(step.parameter).start;
        for moment in step.timed_moments {
            let first = 2 * moment.edge;
            let d = components(|k| match step.free.contains(&(first + k)) {
                true => right[first + k][0],
                false => 0.0,
            });
            let by = tangent_product(moment, &step.before.q, d);
            (0..4).for_each(|k| q0[first + k][0] -= start * by[k]);
        }
    }

    /// The transpose of the part of [`TimedLoadRates::add`] by forces at fixed unknowns, from the derivatives `direct`
    /// of the misfit by them: adds to the sums of the parameters.
    pub fn transpose_direct<R: Rod<f64>>(
        &mut self,
        step: &Linearization<'_, f64, R>,
        direct: &[f64],
    ) {
        for TimedParameter { rates, sum, .. } in &mut self.0 {
            rates.means(step).for_each_direct(step, |i, rate| *sum += direct[i] * rate);
        }
    }
}

/// The product of the second derivatives of the potential of a moment at the unknowns `q`, N/m, with the vector `d` of
/// the four coordinates of its edge.
fn tangent_product(moment: &EdgeMoment<f64>, q: &[f64], d: [f64; 4]) -> [f64; 4] {
    let dual = EdgeMoment { edge: moment.edge, moment: Dual64::from(moment.moment) };
    gradient_moving(&dual, q, |i| d[i - 2 * moment.edge]).map(|by| by.eps)
}
