//! What a misfit's derivatives by the start of a run and by the numbers of its rod make of parameters.

use crate::dynamics::adjoint::backward::Backward;
use crate::dynamics::simulation::Simulation;
use crate::error::Error;
use crate::problem::{Discretized, Model};
use crate::rod::{Rod, Transposed};
use crate::scene::Parameter;
use num_dual::Dual64;

/// The derivatives by the parameters.
pub fn gradient<M: Model<W>, const W: usize>(
    discretized: &Discretized<'_, M, W>,
    backward: &Backward<M::Rod<f64>, W>,
    parameters: &[Parameter],
) -> Result<Vec<f64>, Error>
where
    M::Rod<f64>: Transposed<W>,
{
    let mut gradient = Vec::with_capacity(parameters.len());
    for parameter in parameters {
        let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
        let dual = discretized.simulation_over::<Dual64>(seed)?;
        gradient.push(along(backward, discretized.rod(), &dual));
    }
    for (k, sum) in backward.supports.sums() {
        gradient[k] += sum;
    }
    Ok(gradient)
}

/// The derivative along what a simulation's numbers carry.
fn along<R: Transposed<W>, const W: usize>(
    backward: &Backward<R, W>,
    rod: R,
    dual: &Simulation<Dual64, R::Dual, W>,
) -> f64 {
    let state = dual.state();
    let sum =
        |by: &[f64], x: &[Dual64]| -> f64 { by.iter().zip(x).map(|(by, x)| by * x.eps).sum() };
    let mut total = sum(&backward.q, &state.q)
        + sum(&backward.v, &state.v)
        + sum(&backward.acceleration, &state.acceleration)
        + sum(&backward.unbalanced, &state.unbalanced)
        + sum(&backward.mass, dual.rod().mass());
    for (by, frame) in backward.frames.iter().zip(R::frame_rates([&state.frames])) {
        total += by.turn.0[0] * frame.turn.0[0];
        total += by.tangent.iter().zip(frame.tangent).map(|(by, x)| by.0[0] * x.0[0]).sum::<f64>();
    }
    if let Some(viscous) = &backward.viscous {
        let (by, own) = (&viscous.internal, &state.internal);
        total += sum(&by.strain, &own.strain)
            + sum(&by.strain_rate, &own.strain_rate)
            + sum(&by.relaxing, &own.relaxing);
    }
    let mut rates = R::Rates::default();
    R::set_rates(std::array::from_ref(dual.rod()), &mut rates);
    total += rod.along(dual.rod(), &rates, &backward.laws);
    let (by, own) = (&backward.damping, dual.damping());
    total += by.mass * own.mass.eps
        + by.stiffness * own.stiffness.eps
        + by.bending * own.bending.eps
        + by.twisting * own.twisting.eps
        + by.stretching * own.stretching.eps;
    if let (Some(by), Some(own)) = (by.maxwell, own.maxwell) {
        total += by.stiffness * own.stiffness.eps + by.time * own.time.eps;
    }
    if let (Some(by), Some(own)) = (&backward.drag, dual.drag()) {
        total += sum(&by.normal, &own.normal)
            + sum(&by.tangential, &own.tangential)
            + sum(&by.fluid, &own.fluid)
            + sum(&by.lengths, &own.lengths);
    }
    total + dual.newton().map_or(0.0, |newton| backward.parameter * newton.parameter().eps)
}
