//! What a misfit's derivatives by the start of a run and by the numbers of its rod make of parameters.

use crate::dynamics::adjoint::backward::Backward;
use crate::dynamics::adjoint::lists::{Asked, share_out};
use crate::dynamics::adjoint::viscous::add_by_strains;
use crate::dynamics::simulation::Simulation;
use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::tangent::Tangent;
use crate::problem::{Discretized, Model};
use crate::rod::{Laws, Rod, Strained, Transposed, still_frames, strained};
use crate::scene::{InitialState, Parameter};
use num_dual::Dual64;

/// A simulation of a model.
type Of<M> = Simulation<f64, <M as Model>::Rod<f64>>;

/// The derivatives by what was asked.
pub fn gradient<M: Model>(
    discretized: &Discretized<'_, M>,
    (backward, start): (&Backward<M::Rod<f64>>, &Of<M>),
    (mut asked, parameters): (Asked, &[Parameter]),
) -> Result<Vec<f64>, Error>
where
    M::Rod<f64>: Transposed,
{
    let mut gradient = vec![0.0; parameters.len()];
    if !asked.listed.is_empty() {
        match laws(discretized, backward, start) {
            Some(laws) => share_out(discretized, &laws, &asked.listed, &mut gradient),
            None => asked.one_by_one(parameters),
        }
    }
    for (k, parameter) in &asked.single {
        let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
        let dual = discretized.simulation_over::<Dual64>(seed)?;
        gradient[*k] = along(backward, start.rod(), &dual);
    }
    for (k, sum) in backward.supports.sums() {
        gradient[k] += sum;
    }
    Ok(gradient)
}

/// What the laws of joints count for, with what the start of the run makes of them: the forces there and, of one that
/// begins in equilibrium, the places. None where it follows them in other ways.
fn laws<M: Model>(
    discretized: &Discretized<'_, M>,
    backward: &Backward<M::Rod<f64>>,
    start: &Of<M>,
) -> Option<Laws>
where
    M::Rod<f64>: Transposed,
{
    let initial = &discretized.scene().initial;
    let (state, rod, free) = (start.state(), start.rod(), start.free());
    let rests = match initial.state {
        _ if initial.perturbation != 0.0 => return None,
        InitialState::Rest => false,
        InitialState::Equilibrium if initial.angular_velocity == [0.0; 3] => true,
        _ => return None,
    };
    let mut d = vec![0.0; state.q.len()];
    for i in free.clone() {
        d[i] = backward.unbalanced[i];
        if !state.acceleration.is_empty() {
            d[i] -= backward.acceleration[i] / rod.mass()[i];
        }
    }
    let mut geometry = Default::default();
    rod.measure(&state.q, &state.frames, &mut geometry);
    let (mut strain, mut along) = (Vec::new(), Vec::new());
    <M::Rod<f64> as Transposed>::measured_strains(&geometry, &mut strain);
    along.resize(strain.len(), 0.0);
    let still = still_frames(backward.frames.len());
    let mut laws = backward.laws.clone();
    let mut add = |d: &[f64]| {
        strained(rod, &geometry, &still, d, &mut along);
        let strained = Strained { strains: &strain, own: &[], counted: false };
        rod.add_to_laws(&along, strained, &mut laws);
    };
    add(&d);
    if rests {
        let n = d.len();
        let (mut gradient, mut tangent) = (vec![0.0; n], Tangent::zeros(n));
        let mut q = vec![0.0; n];
        rod.tangent(&state.q, &state.frames, Derivatives::Hand, &mut gradient, &mut tangent);
        tangent.product(&d, &mut q);
        // The frames are those of where the rod is, and go along.
        let mut frames = backward.frames.clone();
        <M::Rod<f64> as Transposed>::add_to_frames(&geometry, &gradient, (&d, &q), &mut frames);
        <M::Rod<f64> as Transposed>::rebase_back(&geometry, &mut frames, &mut q);
        q.iter_mut().zip(&backward.q).for_each(|(q, by)| *q += by);
        if let Some(drag) = start.drag() {
            let (mut slopes, mut v) = (drag.no_slopes(), vec![0.0; n]);
            drag.add_slopes_of([&state.q, &state.v, &d], &mut slopes, [&mut q, &mut v]);
        }
        if let Some(viscous) = &backward.viscous {
            let by_strain = &viscous.internal.strain;
            add_by_strains(rod, &geometry, (&state.q, &state.frames), by_strain, &mut q);
        }
        let held = discretized.setup.rod_with_release_forces(discretized.model, rod);
        discretized.displacement_under_forces(&held, &state.q, &state.frames, &mut q)?;
        q.iter_mut().for_each(|q| *q = -*q);
        add(&q);
    }
    Some(laws)
}

/// The derivative along what a simulation's numbers carry.
fn along<R: Transposed>(
    backward: &Backward<R>,
    rod: &R,
    dual: &Simulation<Dual64, R::Dual>,
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
