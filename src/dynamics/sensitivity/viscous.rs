//! Derivatives of viscous stress, of relaxation and of internal friction.

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::linearization::Linearization;
use crate::dynamics::simulation::Simulation;
use crate::dynamics::stepper::stretched;
use crate::dynamics::viscosity;
use crate::rod::{DualFrames, InternalVariables, Rod, Sensitive, Viscosity};
use crate::scene::Damping;
use num_dual::Dual64;

/// What `G` parameters change of a step's viscous stress.
#[derive(Clone)]
pub struct Viscous<R: Sensitive<W>, const W: usize, const G: usize> {
    /// The rods with that stress.
    rods: [R::Dual; G],
    rates: R::Rates<G>,
    /// What that stress alone is made from.
    dashpots: Option<[R::Dual; G]>,
    /// The rods with internal friction besides.
    sliding: Option<[R::Dual; G]>,
    /// How far its springs would be stretched if they did not slip.
    z: Vec<Dual64>,
    /// Derivatives of the internal variables.
    internal: [InternalVariables<f64>; G],
    /// The internal variables with the derivatives along one parameter.
    dual: InternalVariables<Dual64>,
    viscosity: Viscosity<Dual64>,
    strain: Vec<Dual64>,
    q: Vec<Dual64>,
    forces: Vec<Dual64>,
}

impl<R: Sensitive<W>, const W: usize, const G: usize> Viscous<R, W, G> {
    /// At the start of simulations; none of rods that are not viscous.
    pub fn new(simulations: [&Simulation<Dual64, R::Dual, W>; G]) -> Option<Self> {
        let [first, ..] = &simulations[..] else { return None };
        let (state, newton) = (first.state(), first.newton()?);
        let strains = state.internal.strain.len();
        let times = simulations.iter().flat_map(|simulation| simulation.damping().own_times());
        let apart = times.into_iter().any(|time| time != Dual64::from(0.0) || time.eps != 0.0);
        let dashpots = newton.dashpots().map(|_| {
            simulations.map(|simulation| {
                let dashpots = simulation.newton().and_then(|newton| newton.dashpots());
                dashpots.unwrap_or(simulation.rod()).clone()
            })
        });
        let rates = |x: &[Dual64]| x.iter().map(|x| x.eps).collect::<Vec<f64>>();
        (strains > 0).then(|| Self {
            rods: dashpots
                .clone()
                .unwrap_or(simulations.map(|simulation| simulation.rod().clone())),
            rates: R::Rates::default(),
            dashpots,
            sliding: (first.rod().slides() > 0)
                .then(|| simulations.map(|simulation| simulation.rod().clone())),
            z: Vec::new(),
            internal: simulations.map(|simulation| {
                let internal = &simulation.state().internal;
                InternalVariables {
                    strain: rates(&internal.strain),
                    strain_rate: rates(&internal.strain_rate),
                    slid: rates(&internal.slid),
                    relaxing: rates(&internal.relaxing),
                }
            }),
            dual: InternalVariables::default(),
            viscosity: Viscosity::none(strains, apart),
            strain: Vec::new(),
            q: Vec::new(),
            forces: vec![Dual64::from(0.0); state.q.len()],
        })
    }

    /// The rods with the stress of the step, and what the parameters change of them.
    pub fn rods(&self) -> (&[R::Dual; G], &R::Rates<G>) {
        (self.sliding.as_ref().unwrap_or(&self.rods), &self.rates)
    }

    /// Takes the stress at the end of a step.
    pub fn set(
        &mut self,
        rods: &[R::Dual; G],
        coefficients: &[StepCoefficients<Dual64>; G],
        damping: [Damping<Dual64>; G],
        step: &Linearization<'_, f64, R, W>,
    ) {
        let before = &step.before.internal;
        for g in 0..G {
            carry(before, &self.internal[g], &mut self.dual);
            viscosity::at_end(&coefficients[g], &damping[g], &self.dual, &mut self.viscosity);
            let viscous = &mut self.rods[g];
            match &self.dashpots {
                Some(dashpots) => viscous.set_dashpots(&dashpots[g], &self.viscosity),
                None => viscous.set_viscous(&rods[g], &self.viscosity),
            }
            if let Some(sliding) = &mut self.sliding {
                let now = &step.after.internal.strain;
                self.strain.clear();
                self.strain.extend(now.iter().map(|s| Dual64::from(*s)));
                stretched(rods[g].slides(), &self.dual, &self.strain, &mut self.z);
                sliding[g].set_sliders(&self.rods[g], &rods[g], &self.strain, &self.z);
            }
        }
        R::set_rates(self.sliding.as_ref().unwrap_or(&self.rods), &mut self.rates);
    }

    /// Goes on to the end of a step, where the unknowns and velocities have the derivatives `q` and
    /// `v`, and writes those of the forces there that the next step counts by its start.
    pub fn finish(
        &mut self,
        (rods, frames): (&[R::Dual; G], &[DualFrames<R, f64, W>; G]),
        (coefficients, damping): (&[StepCoefficients<Dual64>; G], [Damping<Dual64>; G]),
        step: &Linearization<'_, f64, R, W>,
        [q, v]: [&[[f64; G]]; 2],
        unbalanced: &mut [[f64; G]],
    ) {
        let now = step.after;
        for g in 0..G {
            let (coefficients, own) = (&coefficients[g], &mut self.internal[g]);
            self.q.clear();
            self.q.extend(now.q.iter().zip(q).map(|(q, rate)| Dual64::new(*q, rate[g])));
            rods[g].strains(&self.q, &frames[g], &mut self.strain);
            carry(&step.before.internal, own, &mut self.dual);
            stretched(rods[g].slides(), &self.dual, &self.strain, &mut self.z);
            rods[g].slip(&mut self.z);
            own.slid.iter_mut().zip(&self.z).for_each(|(slid, z)| *slid = z.eps);
            let relaxing = &mut self.forces;
            viscosity::relax(&damping[g], coefficients.h, &self.dual, &self.strain, relaxing);
            own.relaxing.iter_mut().zip(&*relaxing).for_each(|(own, z)| *own = z.eps);
            for (i, strain) in self.strain.iter().enumerate() {
                own.strain_rate[i] = (strain.eps - own.strain[i]) / coefficients.h;
                own.strain[i] = strain.eps;
            }
            carry(&now.internal, own, &mut self.dual);
            viscosity::at_start(coefficients, &damping[g], &self.dual, &mut self.viscosity);
            let base = &self.dashpots.as_ref().unwrap_or(rods)[g];
            self.rods[g].set_viscous(base, &self.viscosity);
            let mut rod = &self.rods[g];
            if let Some(sliding) = &mut self.sliding {
                sliding[g].set_sliders(rod, &rods[g], &self.strain, &self.z);
                rod = &sliding[g];
            }
            self.forces.resize(self.q.len(), Dual64::from(0.0));
            rod.gradient(&self.q, &frames[g], step.derivatives, &mut self.forces);
            let zero = Dual64::from(0.0);
            let mass_damping = if coefficients.averages() { zero } else { damping[g].mass };
            for i in step.free.clone() {
                let velocity = Dual64::new(now.v[i], v[i][g]);
                let mass = rods[g].mass()[i];
                unbalanced[i][g] = (self.forces[i] + mass_damping * mass * velocity).eps;
            }
        }
    }
}

/// Writes internal variables with their derivatives.
fn carry(
    plain: &InternalVariables<f64>,
    rates: &InternalVariables<f64>,
    dual: &mut InternalVariables<Dual64>,
) {
    let lists = [
        (&plain.strain, &rates.strain, &mut dual.strain),
        (&plain.strain_rate, &rates.strain_rate, &mut dual.strain_rate),
        (&plain.slid, &rates.slid, &mut dual.slid),
        (&plain.relaxing, &rates.relaxing, &mut dual.relaxing),
    ];
    for (plain, rates, dual) in lists {
        dual.clear();
        dual.extend(plain.iter().zip(rates).map(|(x, rate)| Dual64::new(*x, *rate)));
    }
}
