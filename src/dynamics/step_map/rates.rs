//! The derivatives that the linear map of a step takes and returns.
//!
//! Forward: [`StateRates`] of the state and [`ParameterRates`] of the scene's numbers along `G` parameters,
//! extracted from `G` simulations over dual numbers, one SIMD lane each. `ParameterRates::new` returns `None` for
//! schemes without Newton's method; masses without derivatives, and lanes without drag, are left out. Transposed:
//! `StateRates` with one lane and [`ParameterSlopes`], the derivatives of a misfit by state and numbers. Their
//! `product` with the forward ones is the derivative of the misfit along one parameter, `dm/dp = dm/dx . dx/dp`,
//! without friction springs.
//!
//! `StateRates::zeros` and `ParameterSlopes::zeros` are zero derivatives of a misfit, to which a reverse sweep adds.
//! `ParameterRates::changed_rods` are the dual rods with the derivatives of their laws and loads.

use crate::dynamics::simulation::Simulation;
use crate::dynamics::step_map::numbers::StepNumbers;
use crate::dynamics::step_map::timed_loads::TimedLoadRates;
use crate::numerics::directions::{Directions, all};
use crate::numerics::vector::map_components;
use crate::problem::boundary::BoundaryMotion;
use crate::rod::{
    ChangedRods, DragSlopes, ForwardSensitivity, FrameRate, InternalVariables, LawDerivatives,
    NodalDrag, Rod, Transposed, frame_rates, zero_frame_rates,
};
use num_dual::Dual64;

/// A simulation whose numbers contain the derivative along one parameter.
pub type DualSimulation<R> = Simulation<Dual64, <R as Rod<f64>>::Dual>;

/// The derivatives of a state along `G` parameters, or with one lane those of a misfit by a state.
#[derive(Clone)]
pub struct StateRates<const G: usize> {
    /// Of the unknowns.
    pub q: Vec<[f64; G]>,
    /// Of the velocities.
    pub v: Vec<[f64; G]>,
    /// Of the accelerations; empty for schemes without.
    pub acceleration: Vec<[f64; G]>,
    /// Of the forces that the next step takes as those of its start.
    pub unbalanced: Vec<[f64; G]>,
    /// Of the reference frames.
    pub frames: Vec<FrameRate<G>>,
    /// Of the internal variables; empty where no stress depends on the past.
    pub internal: InternalVariables<Directions<G>>,
}

/// The derivatives in `G` lists of dual numbers, one SIMD lane per list; as long as the shortest list.
fn lanes<const G: usize>(lists: [&[Dual64]; G]) -> Vec<[f64; G]> {
    let count = lists.iter().map(|list| list.len()).min().unwrap_or(0);
    (0..count).map(|i| map_components(&lists, |list| list[i].eps)).collect()
}

/// The derivatives in `G` lists of internal variables, one SIMD lane per list.
fn internal_lanes<const G: usize>(lists: [&[Dual64]; G]) -> Vec<Directions<G>> {
    lanes(lists).into_iter().map(Directions).collect()
}

impl<const G: usize> StateRates<G> {
    /// The derivatives that the present states of `simulations` contain, one lane per simulation: unknowns, velocities,
    /// accelerations, forces, frames and internal variables. Lists are empty where those of a simulation are.
    pub fn new<R: ForwardSensitivity>(simulations: [&DualSimulation<R>; G]) -> Self {
        let states = simulations.map(|simulation| simulation.state());
        let internal = states.map(|state| &state.internal);
        Self {
            q: lanes(states.map(|state| &state.q[..])),
            v: lanes(states.map(|state| &state.v[..])),
            acceleration: lanes(states.map(|state| &state.acceleration[..])),
            unbalanced: lanes(states.map(|state| &state.unbalanced[..])),
            frames: frame_rates(states.map(|state| &state.frames)),
            internal: InternalVariables {
                strain: internal_lanes(internal.map(|internal| &internal.strain[..])),
                strain_rate: internal_lanes(internal.map(|internal| &internal.strain_rate[..])),
                slid: internal_lanes(internal.map(|internal| &internal.slid[..])),
                relaxing: internal_lanes(internal.map(|internal| &internal.relaxing[..])),
            },
        }
    }
}

impl StateRates<1> {
    /// Zero derivatives of a misfit by the state of a simulation; `frames` is the number of reference frames.
    /// Accelerations have entries for every scheme; stretches of friction springs have none.
    pub fn zeros<R: Rod<f64>>(simulation: &Simulation<f64, R>, frames: usize) -> Self {
        let state = simulation.state();
        let (unknowns, strains) = (vec![[0.0]; state.q.len()], state.internal.strain.len());
        let zeros = |count: usize| vec![Directions::ZERO; count];
        Self {
            q: unknowns.clone(),
            v: unknowns.clone(),
            acceleration: unknowns.clone(),
            unbalanced: unknowns,
            frames: zero_frame_rates(frames),
            internal: InternalVariables {
                strain: zeros(strains),
                strain_rate: zeros(strains),
                slid: Vec::new(),
                relaxing: zeros(state.internal.relaxing.len()),
            },
        }
    }

    /// The derivative of a misfit along one parameter through the state. It is the sum over all entries of the
    /// derivative of the misfit (`self`) times the derivative of the state by the parameter (`along`). Friction springs
    /// are left out.
    pub fn product(&self, along: &Self) -> f64 {
        let unknowns = |a: &[[f64; 1]], b: &[[f64; 1]]| dot(a.as_flattened(), b.as_flattened());
        let strains = |a: &[Directions<1>], b: &[Directions<1>]| -> f64 {
            a.iter().zip(b).map(|(a, b)| a.0[0] * b.0[0]).sum()
        };
        // Stretches of friction springs are left out: scenes with internal friction have no
        // adjoint.
        let frames = self
            .frames
            .iter()
            .zip(&along.frames)
            .map(|(a, b)| strains(&a.tangent, &b.tangent) + a.turn.0[0] * b.turn.0[0]);
        unknowns(&self.q, &along.q)
            + unknowns(&self.v, &along.v)
            + unknowns(&self.acceleration, &along.acceleration)
            + unknowns(&self.unbalanced, &along.unbalanced)
            + frames.sum::<f64>()
            + strains(&self.internal.strain, &along.internal.strain)
            + strains(&self.internal.strain_rate, &along.internal.strain_rate)
            + strains(&self.internal.relaxing, &along.internal.relaxing)
    }
}

/// The inner product `a.b`.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Drag with the derivative along the parameter of one SIMD lane.
#[derive(Clone)]
pub struct LaneDrag {
    /// The index of the lane.
    pub lane: usize,
    /// The drag at the nodes.
    pub drag: NodalDrag<Dual64>,
}

/// The derivatives of the numbers of a simulation along `G` parameters.
#[derive(Clone)]
pub struct ParameterRates<R: ForwardSensitivity, const G: usize> {
    /// The rods with one derivative each.
    pub rods: [R::Dual; G],
    /// Of laws and loads.
    pub laws: R::Rates<G>,
    /// Of the masses; none where none changes.
    pub mass: Option<Vec<[f64; G]>>,
    /// Of the numbers of damping and the scheme.
    pub numbers: StepNumbers<Directions<G>>,
    /// Of the stiffness of springs of internal friction.
    pub friction: Directions<G>,
    /// Whether kinds of strain have damping times of their own.
    pub has_own_times: bool,
    /// The drag of the lanes that have some.
    pub drag: Vec<LaneDrag>,
    /// The supports, where parameters may move them.
    pub boundary_motion: Option<[BoundaryMotion<Dual64>; G]>,
    /// The loads in time of all lanes; empty without any.
    pub timed_loads: Vec<TimedLoadRates>,
}

impl<R: ForwardSensitivity, const G: usize> ParameterRates<R, G> {
    /// The derivatives that the numbers of `simulations` contain, one lane each. Masses are absent if none has a
    /// derivative, and drag has the lanes with a fluid. Supports are present if an end is clamped or pinned and a
    /// support moves. `None` for explicit and Rosenbrock schemes.
    pub fn new(simulations: [&DualSimulation<R>; G]) -> Option<Self> {
        let parameter = |simulation: &DualSimulation<R>| Some(simulation.newton()?.parameter());
        let parameters: [Dual64; G] = all(simulations.map(parameter))?;
        // Derivatives of laws and loads, of masses, and of damping and scheme.
        let rods = simulations.map(|simulation| simulation.rod().clone());
        let mut laws = R::Rates::default();
        R::set_rates(&rods, &mut laws);
        let mass = lanes(rods.each_ref().map(|rod| rod.mass()));
        let damping = simulations.map(Simulation::damping);
        let friction = damping.map(|damping| damping.friction.map_or(0.0, |f| f.stiffness.eps));
        let times = damping.iter().flat_map(|damping| damping.additional_times());
        let drags = simulations.iter().map(|simulation| simulation.drag()).enumerate();
        // Supports with a recorded motion have no derivatives.
        let motion = simulations.map(|simulation| {
            simulation.boundary_motion().filter(|motion| motion.has_numbers()).cloned()
        });
        let timed = simulations.iter().zip(&parameters);
        let timed = timed.filter(|(simulation, _)| !simulation.timed_loads().is_empty());
        let timed = timed.map(|(simulation, parameter)| {
            TimedLoadRates::new(simulation.timed_loads(), parameter.eps)
        });
        Some(Self {
            laws,
            mass: mass.iter().any(|mass| *mass != [0.0; G]).then_some(mass),
            numbers: StepNumbers::new(damping, parameters),
            friction: Directions(friction),
            has_own_times: times.into_iter().any(|time| time.re != 0.0 || time.eps != 0.0),
            drag: drags
                .filter_map(|(lane, drag)| Some(LaneDrag { lane, drag: drag?.clone() }))
                .filter(|own| !own.drag.is_none())
                .collect(),
            // Present only if all simulations have such a motion.
            boundary_motion: all(motion),
            timed_loads: timed.collect(),
            rods,
        })
    }

    /// References to the dual rods and to the derivatives of their laws and loads, in the form that `gradient_rate` and
    /// `stressed_rate` of the rod take.
    #[inline(always)]
    pub fn changed_rods(&self) -> ChangedRods<'_, R, G> {
        ChangedRods { duals: &self.rods, rates: &self.laws }
    }
}

/// The derivatives of a misfit by the numbers of a simulation.
pub struct ParameterSlopes {
    /// By laws and loads.
    pub laws: LawDerivatives,
    /// By the masses.
    pub mass: Vec<f64>,
    /// By the numbers of damping and the scheme.
    pub numbers: StepNumbers<f64>,
    /// By the numbers of drag.
    pub drag: Option<DragSlopes>,
}

impl ParameterSlopes {
    /// Zero derivatives by all numbers of a simulation. `moments`: whether those by dead moments are needed.
    pub fn zeros<R: Transposed>(simulation: &Simulation<f64, R>, moments: bool) -> Self {
        Self {
            laws: simulation.rod().zero_law_derivatives(moments),
            mass: vec![0.0; simulation.rod().mass().len()],
            numbers: StepNumbers::zeros(simulation.damping().maxwell.as_slice().len()),
            drag: simulation.drag().map(NodalDrag::no_slopes),
        }
    }

    /// The derivative of a misfit along one parameter through the numbers of the simulation. It is the sum over all
    /// numbers of the derivative of the misfit (`self`) times the derivative of the number by the parameter (`along`).
    /// `rod` is that of the run.
    pub fn product<R: Transposed>(&self, rod: &R, along: &ParameterRates<R, 1>) -> f64 {
        let [dual] = &along.rods;
        let mut total =
            rod.along(dual, &along.laws, &self.laws) + self.numbers.product(&along.numbers);
        if let Some(mass) = &along.mass {
            total += dot(&self.mass, mass.as_flattened());
        }
        if let (Some(by), Some(LaneDrag { drag, .. })) = (&self.drag, along.drag.first()) {
            let sum = |by: &[f64], drag: &[Dual64]| -> f64 {
                by.iter().zip(drag).map(|(by, x)| by * x.eps).sum()
            };
            total += sum(&by.normal, &drag.normal)
                + sum(&by.tangential, &drag.tangential)
                + sum(&by.fluid, &drag.fluid)
                + sum(&by.lengths, &drag.lengths);
        }
        total
    }
}
