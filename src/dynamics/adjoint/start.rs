//! The gradient of a misfit by parameters, from its derivatives by the initial state and by the numbers of the simulation.

use crate::dynamics::adjoint::lists::{RequestedParameters, add_natural_strains};
use crate::dynamics::simulation::Simulation;
use crate::dynamics::step_map::{
    MovingSupports, ParameterRates, ParameterSlopes, StateRates, add_by_strains,
};
use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::tangent::Tangent;
use crate::problem::{Discretized, Model};
use crate::rod::{
    Laws, Rod, RodGeometry, Strained, Transposed, frame_rates, still_frames, strained,
};
use crate::scene::{InitialState, Parameter};
use num_dual::Dual64;

/// The derivatives of a misfit by the start of a run, by the numbers of its simulation and by the motion of supports.
pub struct ByStart<'a, M: Model>
where
    M::Rod<f64>: Transposed,
{
    pub start: &'a Simulation<f64, M::Rod<f64>>,
    pub state: StateRates<1>,
    pub parameters: ParameterSlopes,
    pub supports: MovingSupports<M::Rod<f64>>,
}

/// The gradient by the requested parameters.
pub fn gradient<M: Model>(
    discretized: &Discretized<'_, M>,
    by_start: ByStart<'_, M>,
    (mut requested, parameters): (RequestedParameters, &[Parameter]),
) -> Result<Vec<f64>, Error>
where
    M::Rod<f64>: Transposed,
{
    let mut gradient = vec![0.0; parameters.len()];
    if !requested.listed.is_empty() {
        match laws(discretized, &by_start) {
            Some(laws) => add_natural_strains(discretized, &laws, &requested.listed, &mut gradient),
            None => requested.separate_lists(parameters),
        }
    }
    for (k, parameter) in &requested.single {
        let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
        let dual = discretized.simulation_over::<Dual64>(seed)?;
        gradient[*k] = by_start.state.product(&StateRates::new::<M::Rod<f64>>([&dual]));
        if let Some(rates) = ParameterRates::<M::Rod<f64>, 1>::new([&dual]) {
            gradient[*k] += by_start.parameters.product(by_start.start.rod(), &rates);
        }
    }
    for (k, sum) in by_start.supports.sums() {
        gradient[k] += sum;
    }
    Ok(gradient)
}

/// The derivatives by the laws of joints, with those through the initial state: through the initial forces and, for an
/// initial equilibrium, through its places. None for initial states that depend on the laws in other ways.
fn laws<M: Model>(
    discretized: &Discretized<'_, M>,
    ByStart { start, state: by_state, parameters, .. }: &ByStart<'_, M>,
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
        d[i] = by_state.unbalanced[i][0];
        if !state.acceleration.is_empty() {
            d[i] -= by_state.acceleration[i][0] / rod.mass()[i];
        }
    }
    let mut geometry = Default::default();
    rod.measure(&state.q, &state.frames, &mut geometry);
    let (mut strain, mut along) = (Vec::new(), Vec::new());
    geometry.write_strains(&mut strain);
    along.resize(strain.len(), 0.0);
    let still = still_frames(by_state.frames.len());
    let mut laws = parameters.laws.clone();
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
        geometry.add_to_frames(&gradient, (&d, &q), &mut frames);
        geometry.move_frames_back(&mut frames, &mut q);
        q.iter_mut().zip(&backward.q).for_each(|(q, by)| *q += by);
        if let Some(drag) = start.drag() {
            let (mut slopes, mut v) = (drag.no_slopes(), vec![0.0; n]);
            drag.add_slopes_of([&state.q, &state.v, &d], &mut slopes, [&mut q, &mut v]);
        }
        let by_strain: Vec<f64> = by_state.internal.strain.iter().map(|by| by.0[0]).collect();
        if !by_strain.is_empty() {
            let at = (&state.q[..], &state.frames);
            add_by_strains(rod, &geometry, at, &by_strain, (&mut q, &mut []));
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
    for (by, frame) in backward.frames.iter().zip(frame_rates([&state.frames])) {
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
