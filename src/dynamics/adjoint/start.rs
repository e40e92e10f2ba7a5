//! The last stage of the adjoint: the gradient of a misfit by parameters, at the start of the run.
//!
//! Input: the requested parameters, and the sums of the reverse sweep ([`ByStart`]). These are derivatives of the
//! misfit by the initial state and by the numbers of the simulation (laws, masses, loads, damping, drag). Further ones
//! are by parameters through moving supports and loads that change with time. One simulation over dual numbers per
//! parameter has the derivatives of initial state and numbers by it. The gradient is the sum of their products with
//! those of the misfit, and of the parts through supports and loads. For a list of natural strains one product serves
//! all entries, through the laws (stiffness and natural stress) of the joints. This requires a start from the rest
//! shape, or from an equilibrium without angular velocity and with a regular tangent, and no perturbation. Otherwise
//! each entry is treated as a parameter. Output: one derivative per requested parameter, in their order.

use crate::dynamics::adjoint::lists::{
    RequestedParameters, UnlistedParameter, add_natural_strains,
};
use crate::dynamics::simulation::Simulation;
use crate::dynamics::step_map::{
    MovingSupports, ParameterRates, ParameterSlopes, StateRates, TimedLoadSlopes, add_by_strains,
};
use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::tangent::Tangent;
use crate::problem::{Discretized, Model};
use crate::rod::{
    LawDerivatives, Rod, RodGeometry, StressInputs, Transposed, strained, zero_frame_rates,
};
use crate::scene::InitialState;
use num_dual::Dual64;

/// The derivatives of a misfit by the start of a run, by the numbers of its simulation, and by parameters through
/// moving supports and loads that change with time.
pub struct ByStart<'a, M: Model>
where
    M::Rod<f64>: Transposed,
{
    /// The simulation in its initial state.
    pub start: &'a Simulation<f64, M::Rod<f64>>,
    /// By the initial state: unknowns, velocities, accelerations, forces, frames and internal variables.
    pub state: StateRates<1>,
    /// By laws, masses, loads, damping and drag.
    pub parameters: ParameterSlopes,
    /// By parameters that move supports.
    pub supports: MovingSupports<M::Rod<f64>>,
    /// By parameters through loads that change with time.
    pub timed_loads: TimedLoadSlopes,
}

/// The gradient of the misfit by the requested parameters, in their order. Derivatives by initial state and numbers of
/// the simulation are multiplied with the derivatives of these by each parameter, from one simulation in dual numbers
/// each. The parts by moving supports and by loads in time are added. Entries of lists of natural strains follow from
/// one product per list if [`laws`] has a result, else they are treated as other parameters. Errors are those of the
/// simulations at their start.
pub fn gradient<M: Model>(
    discretized: &Discretized<'_, M>,
    by_start: ByStart<'_, M>,
    mut requested: RequestedParameters,
) -> Result<Vec<f64>, Error>
where
    M::Rod<f64>: Transposed,
{
    let mut gradient = vec![0.0; requested.all.len()];
    // Lists of natural strains: one product for each list, if the initial state permits it.
    if !requested.listed.is_empty() {
        match laws(discretized, &by_start) {
            Some(laws) => add_natural_strains(discretized, &laws, &requested.listed, &mut gradient),
            None => requested.separate_lists(),
        }
    }
    // Every other parameter: a simulation in dual numbers has the derivatives of its initial
    // state and numbers.
    for UnlistedParameter { index, parameter } in &requested.single {
        let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
        let dual = discretized.simulation_over::<Dual64>(seed)?;
        gradient[*index] = by_start.state.product(&StateRates::new::<M::Rod<f64>>([&dual]));
        if let Some(rates) = ParameterRates::<M::Rod<f64>, 1>::new([&dual]) {
            gradient[*index] += by_start.parameters.product(by_start.start.rod(), &rates);
        }
    }
    // Parameters that move supports or change loads in time have summed their part during the sweep.
    for (k, sum) in by_start.supports.sums().chain(by_start.timed_loads.sums()) {
        gradient[k] += sum;
    }
    Ok(gradient)
}

/// The derivatives of the misfit by the laws (stiffness and natural stress) of joints: those of the reverse sweep, plus
/// those through the initial state. The latter are through the initial forces and accelerations and, for an initial
/// equilibrium, through its positions (one solve with the tangent). `None` with a perturbation, for an equilibrium with
/// an angular velocity, for initial states other than rest and equilibrium, and for a singular tangent.
fn laws<M: Model>(
    discretized: &Discretized<'_, M>,
    ByStart { start, state: by_state, parameters, .. }: &ByStart<'_, M>,
) -> Option<LawDerivatives>
where
    M::Rod<f64>: Transposed,
{
    let initial = &discretized.scene().initial;
    let (state, rod, free) = (start.state(), start.rod(), start.free());
    // An initial equilibrium depends on the laws too; a perturbation would in another way.
    let rests = match initial.state {
        _ if initial.perturbation != 0.0 => return None,
        InitialState::Rest => false,
        InitialState::Equilibrium if initial.angular_velocity == [0.0; 3] => true,
        _ => return None,
    };
    let mut d = vec![0.0; state.q.len()];
    // Initial forces n0, and accelerations a0 = -n0/m.
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
    let still = zero_frame_rates(by_state.frames.len());
    let mut laws = parameters.laws.clone();
    let mut add = |d: &[f64]| {
        strained(rod, &geometry, &still, d, &mut along);
        let strained = StressInputs { strains: &strain, own: &[], now: &strain, counted: false };
        rod.add_to_laws(&along, strained, &mut laws);
    };
    add(&d);
    // Equilibrium n(q, p) = 0: dq = -K^-1 dn, transposed as one more solve with K.
    if rests {
        let n = d.len();
        let (mut gradient, mut tangent) = (vec![0.0; n], rod.zero_tangent());
        let mut q = vec![0.0; n];
        rod.tangent(&state.q, &state.frames, Derivatives::Hand, &mut gradient, &mut tangent);
        tangent.product(&d, &mut q);
        // The frames are based at the equilibrium, and move with it.
        let mut frames = by_state.frames.clone();
        geometry.add_to_frames(&gradient, &d, &q, &mut frames);
        geometry.move_frames_back(&mut frames, &mut q);
        q.iter_mut().zip(by_state.q.as_flattened()).for_each(|(q, by)| *q += by);
        if let Some(drag) = start.drag() {
            let (mut slopes, mut v) = (drag.no_slopes(), vec![0.0; n]);
            drag.add_transposed_slopes([&state.q, &state.v, &d], &mut slopes, [&mut q, &mut v]);
        }
        let by_strain: Vec<f64> = by_state.internal.strain.iter().map(|by| by.0[0]).collect();
        if !by_strain.is_empty() {
            add_by_strains(rod, &geometry, &state.q, &state.frames, &by_strain, &mut q, &mut []);
        }
        let held = discretized.setup.rod_with_release_forces(discretized.model, rod);
        discretized.displacement_under_forces(&held, &state.q, &state.frames, &mut q)?;
        q.iter_mut().for_each(|q| *q = -*q);
        add(&q);
    }
    Some(laws)
}
