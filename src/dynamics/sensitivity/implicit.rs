//! The derivatives of an implicit step's solution along several parameters side by side.

use crate::dynamics::coefficients::{END, StepCoefficients};
use crate::dynamics::linearization::Linearization;
use crate::dynamics::sensitivity::viscous::Viscous;
use crate::dynamics::simulation::Simulation;
use crate::error::Error;
use crate::numerics::lanes::{Lanes, all};
use crate::numerics::tangent::{Factors, Tangent};
use crate::numerics::vector::{Vector, components, map_components};
use crate::problem::boundary::BoundaryMotion;
use crate::rod::NodalDrag;
use crate::rod::{DualFrames, FrameRate, Rod, Sensitive};
use crate::scene::Damping;
use crate::scene::prescribed_motion::MotionTime;
use num_dual::Dual64;

/// The derivatives along `G` parameters.
#[derive(Clone)]
pub struct Implicit<R: Sensitive, const G: usize> {
    rods: [R::Dual; G],
    /// What the parameters change of the rod.
    rates: R::Rates<G>,
    /// Derivatives of the masses; none where there are none.
    mass: Option<Vec<[f64; G]>>,
    viscous: Option<Viscous<G>>,
    damping: [Damping<Dual64>; G],
    /// Drag, of the parameters along which there is any.
    drag: Vec<(usize, NodalDrag<Dual64>)>,
    room: DragRoom,
    /// The scheme's parameter.
    parameter: [Dual64; G],
    /// The supports that move.
    boundary_motion: Option<[BoundaryMotion<Dual64>; G]>,
    /// The unknowns that supports hold, with the derivatives of their places and velocities at the end of the
    /// step; without those that no parameter moves where the supports stay.
    held: Vec<(usize, [f64; G], [f64; G])>,
    q: Vec<[f64; G]>,
    v: Vec<[f64; G]>,
    /// Of a scheme that goes on from accelerations, where they are known.
    acceleration: Vec<[f64; G]>,
    unbalanced: Vec<[f64; G]>,
    frames: Vec<FrameRate<G>>,
    /// The frames with their derivatives, where dual numbers go through them.
    dual_frames: [DualFrames<R, f64>; G],
    /// The derivatives of the forces at fixed unknowns.
    direct: Vec<[f64; G]>,
    /// The right-hand side `-dR|q1`, and what solves it.
    right: Vec<[f64; G]>,
    solution: Vec<[f64; G]>,
}

/// Whether the stress depends on what the strains were, or its derivative does.
pub fn depends_on_history<R: Sensitive>(simulation: &Simulation<Dual64, R::Dual>) -> bool {
    // An average takes the viscous stress apart from the rest.
    !simulation.can_linearize_again() || simulation.damping().depends_on_history()
}

/// The lanes of `G` lists.
fn lanes<T: Copy, const G: usize>(lists: [&[T]; G], of: impl Fn(T) -> f64) -> Vec<[f64; G]> {
    let count = lists.first().map_or(0, |list| list.len());
    (0..count).map(|i| map_components(&lists, |list| of(list[i]))).collect()
}

impl<R: Sensitive, const G: usize> Implicit<R, G> {
    /// At the start of simulations, one for each parameter; none of a scheme that solves no equations.
    pub fn new(simulations: [&Simulation<Dual64, R::Dual>; G]) -> Option<Self> {
        let [first, ..] = &simulations[..] else { return None };
        first.newton()?;
        let states = simulations.map(Simulation::state);
        let rate = |x: Dual64| x.eps;
        let rods = simulations.map(|simulation| simulation.rod().clone());
        let mut rates = R::Rates::default();
        R::set_rates(&rods, &mut rates);
        let mass = lanes(rods.each_ref().map(|rod| rod.mass()), rate);
        let q = lanes(states.map(|state| &state.q[..]), rate);
        let free = first.free();
        let held = (0..q.len()).filter(|i| !free.contains(i) && q[*i] != [0.0; G]);
        let held: Vec<_> = held.map(|i| (i, q[i], [0.0; G])).collect();
        // Supports that go as they were recorded to go have no derivatives.
        let motion = first.boundary_motion().filter(|motion| motion.has_numbers());
        Some(Self {
            boundary_motion: motion
                .and_then(|_| all(simulations.map(|s| s.boundary_motion().cloned()))),
            held,
            viscous: match simulations.iter().any(|simulation| depends_on_history::<R>(simulation))
            {
                true => Viscous::new::<R>(simulations),
                false => None,
            },
            rates,
            mass: mass.iter().any(|mass| *mass != [0.0; G]).then_some(mass),
            damping: simulations.map(Simulation::damping),
            drag: simulations
                .iter()
                .enumerate()
                .filter_map(|(g, simulation)| Some((g, simulation.drag()?.clone())))
                .filter(|(_, drag)| !drag.is_none())
                .collect(),
            room: DragRoom::default(),
            parameter: all(simulations.map(|simulation| Some(simulation.newton()?.parameter())))?,
            frames: R::frame_rates(states.map(|state| &state.frames)),
            dual_frames: states.map(|state| state.frames.clone()),
            v: lanes(states.map(|state| &state.v[..]), rate),
            acceleration: lanes(states.map(|state| &state.acceleration[..]), rate),
            unbalanced: lanes(states.map(|state| &state.unbalanced[..]), rate),
            direct: vec![[0.0; G]; q.len()],
            right: vec![[0.0; G]; q.len()],
            solution: vec![[0.0; G]; q.len()],
            q,
            rods,
        })
    }

    /// dq/dp and dv/dp of parameter `lane` and unknown `i`.
    pub fn rate(&self, lane: usize, i: usize) -> [f64; 2] {
        [self.q[i][lane], self.v[i][lane]]
    }

    /// The frames where the rod is now with their derivatives along parameter `lane`.
    pub fn frames(&self, lane: usize, now: &R::Frames) -> DualFrames<R, f64> {
        let mut dual = self.dual_frames[lane].clone();
        R::set_dual_frames(now, &self.frames, lane, &mut dual);
        dual
    }

    /// Advances over a step.
    pub fn advance(&mut self, step: &Linearization<'_, f64, R>) -> Result<(), Error> {
        let coefficients = step.coefficients(self.parameter[0].re);
        // Where the scheme's own numbers change, how.
        let changes = self.parameter.iter().any(|parameter| parameter.eps != 0.0);
        let dual = match changes {
            true => self.parameter.map(|parameter| step.coefficients(parameter)),
            false => [coefficients.map(Dual64::from); G],
        };
        let slopes = changes.then(|| dual.map(|dual| dual.map(|x| x.eps)));
        if self.boundary_motion.is_some() {
            for (lane, dual) in self.dual_frames.iter_mut().enumerate() {
                R::set_dual_frames(&step.before.frames, &self.frames, lane, dual);
            }
        }
        self.find_held(step);
        if let Some(viscous) = &mut self.viscous {
            viscous.at_end(&self.rates, (&dual, &self.damping), step);
        }
        self.rate_forces(&coefficients, step);
        self.rate_drag(&dual, step);
        self.rate_residual(&coefficients, slopes.as_ref(), step);
        self.solve(step)?;
        self.finish(&coefficients, slopes.as_ref(), step);
        if let Some(viscous) = &mut self.viscous {
            let changed = (&self.rates, &self.frames[..]);
            viscous.go_on(changed, (&dual, &self.damping), step, &self.q);
            self.rate_next_forces(&coefficients, step);
            self.add_drag(step);
        } else if coefficients.averages() {
            self.unbalanced.fill([0.0; G]);
        }
        R::rebase_rates(&mut self.frames, step.end, &self.q);
        Ok(())
    }

    /// What supports hold at the end of the step.
    fn find_held(&mut self, step: &Linearization<'_, f64, R>) {
        let Some(motions) = &self.boundary_motion else { return };
        let (now, free) = (step.after, &step.free);
        let held = (0..now.q.len()).filter(|i| !free.contains(i));
        let moment = MotionTime::Time(now.time);
        let ends: [_; G] = std::array::from_fn(|g| {
            let dual = |x: &[f64], rates: &[[f64; G]]| -> Vec<Dual64> {
                x.iter().zip(rates).map(|(x, rate)| Dual64::new(*x, rate[g])).collect()
            };
            let (mut q, mut v) = (dual(&now.q, &self.q), dual(&now.v, &self.v));
            motions[g].advance::<R::Dual>(moment, moment, &mut q, &self.dual_frames[g]);
            motions[g].velocities(now.time, &mut v);
            (q, v)
        });
        let of = |i: usize| (i, components(|g| ends[g].0[i].eps), components(|g| ends[g].1[i].eps));
        self.held.clear();
        self.held.extend(held.map(of));
    }

    /// The derivatives of the forces at fixed free unknowns, of an average at a fixed end of the step: by
    /// the parameters, the frames, the supports, and of an average the start.
    fn rate_forces(
        &mut self,
        coefficients: &StepCoefficients<f64>,
        step: &Linearization<'_, f64, R>,
    ) {
        let Self { direct, frames, held, .. } = self;
        let elastic = (&self.rods, &self.rates);
        let stress = self.viscous.as_ref().map(Viscous::stress);
        let before = &step.before.frames;
        if !coefficients.averages() {
            let (place, at) = (step.end, (&step.after.q[..], before));
            match stress {
                Some(stress) => {
                    R::stressed_rate(Some(elastic), stress, place, at, step.derivatives, direct);
                }
                None => R::gradient_rate(elastic, place, at, step.derivatives, direct),
            }
            R::frame_rate(frames, place, step.gradient, step.tangent, direct);
            for (i, rate, _) in held {
                step.tangent.add_column(*i, *rate, direct);
            }
            return;
        }
        let mut sum = vec![[0.0; G]; direct.len()];
        for (k, forces) in step.stages.iter().enumerate() {
            let (place, at) = (&forces.geometry, (&forces.q[..], before));
            let stage = coefficients.stages.get(k).unwrap_or(&END);
            match stress.filter(|_| k >= coefficients.stages.len()) {
                Some(stress) => {
                    R::stressed_rate(None, stress, place, at, step.derivatives, direct);
                }
                None => R::gradient_rate(elastic, place, at, step.derivatives, direct),
            }
            R::frame_rate(frames, place, &forces.gradient, &forces.tangent, direct);
            for (j, start) in self.q.iter().enumerate() {
                forces.tangent.add_column(j, (Lanes(*start) * (1.0 - stage.place)).0, direct);
            }
            for (i, rate, _) in &*held {
                forces.tangent.add_column(*i, (Lanes(*rate) * stage.place).0, direct);
            }
            for (sum, direct) in sum.iter_mut().zip(&*direct) {
                (0..G).for_each(|g| sum[g] += stage.weight * direct[g]);
            }
        }
        *direct = sum;
    }

    /// The derivatives of the forces that the next step counts by its start, of a viscous rod.
    fn rate_next_forces(
        &mut self,
        coefficients: &StepCoefficients<f64>,
        step: &Linearization<'_, f64, R>,
    ) {
        let Some(viscous) = &self.viscous else { return };
        let Self { direct, frames, q, .. } = self;
        let (gradient, tangent) = step.next;
        let elastic = (!coefficients.averages()).then_some((&self.rods, &self.rates));
        let at = (&step.after.q[..], &step.before.frames);
        R::stressed_rate(elastic, viscous.stress(), step.end, at, step.derivatives, direct);
        R::frame_rate(frames, step.end, gradient, tangent, direct);
        tangent.add_product(q, direct);
        let free = step.free.clone();
        let direct = &self.direct[free.clone()];
        self.unbalanced[free.clone()].copy_from_slice(direct);
        if elastic.is_none() {
            return;
        }
        let damping = self.damping[0].mass.re;
        let changes: [f64; G] = components(|g| self.damping[g].mass.eps);
        for i in free {
            let (mass, v) = (step.rod.mass()[i], step.after.v[i]);
            let masses = self.mass.as_ref().map_or([0.0; G], |masses| masses[i]);
            for g in 0..G {
                self.unbalanced[i][g] +=
                    (changes[g] * mass + damping * masses[g]) * v + damping * mass * self.v[i][g];
            }
        }
    }

    /// The right-hand side of the step. Masses, damping and the scheme's numbers are looked at only
    /// where they change.
    fn rate_residual(
        &mut self,
        coefficients: &StepCoefficients<f64>,
        slopes: Option<&[StepCoefficients<f64>; G]>,
        step: &Linearization<'_, f64, R>,
    ) {
        let free = step.free.clone();
        let mass = &step.rod.mass()[free.clone()];
        let (q, v) = (&self.q[free.clone()], &self.v[free.clone()]);
        let n0 = &self.unbalanced[free.clone()];
        let (direct, right) = (&mut self.direct[free.clone()], &mut self.right[free.clone()]);
        let damping = self.damping[0].mass.re;
        let (lists, out) = ([q, v, n0], [&mut *direct, &mut *right]);
        // Asked once for all unknowns.
        match coefficients.acceleration {
            None => {
                let coefficients = coefficients.without_acceleration();
                residuals(&coefficients, (mass, damping), lists, |_| [0.0; G], out);
            }
            Some(_) => {
                let a0 = &self.acceleration[free.clone()][..mass.len()];
                residuals(coefficients, (mass, damping), lists, |i| a0[i], out);
            }
        }
        let began = Began::of(step);
        let masses = self.mass.as_ref().map(|mass| &mass[free.clone()]);
        if let Some(masses) = masses {
            for (i, rates) in masses.iter().enumerate() {
                let (change, start) = began.at(i);
                for g in 0..G {
                    right[i][g] -= coefficients.residual(rates[g], change, start, 0.0, 0.0);
                }
            }
        }
        let changes: [f64; G] = components(|g| self.damping[g].mass.eps);
        if changes != [0.0; G] || damping != 0.0 && masses.is_some() {
            for i in 0..mass.len() {
                let (change, [v0, a0]) = began.at(i);
                let velocity = coefficients.damped_velocity(change, v0, a0);
                for g in 0..G {
                    let mass_rate = masses.map_or(0.0, |masses| masses[i][g]);
                    let rate = (changes[g] * mass[i] + damping * mass_rate) * velocity;
                    direct[i][g] += rate;
                    right[i][g] -= coefficients.end * rate;
                }
            }
        }
        let (gradient, n0) = (&step.total[free.clone()], &step.before.unbalanced[free]);
        for (g, slope) in slopes.iter().flat_map(|slopes| slopes.iter().enumerate()) {
            for i in 0..mass.len() {
                let (change, [v0, a0]) = began.at(i);
                let damped = damping * mass[i];
                let n1 = gradient[i] + damped * coefficients.damped_velocity(change, v0, a0);
                // The velocity that an average is damped by knows nothing of the scheme's numbers.
                if !coefficients.averages() {
                    let rate = damped * slope.damped_velocity(change, v0, a0);
                    direct[i][g] += rate;
                    right[i][g] -= coefficients.end * rate;
                }
                right[i][g] -= slope.residual(mass[i], 0.0, [0.0, a0], n1, n0[i]);
            }
        }
    }

    /// The derivatives of the drag at fixed unknowns: by the parameters, and by all that it follows from.
    fn rate_drag(
        &mut self,
        coefficients: &[StepCoefficients<Dual64>; G],
        step: &Linearization<'_, f64, R>,
    ) {
        let (before, now) = (step.before, step.after);
        for (g, drag) in &self.drag {
            let (g, coefficients) = (*g, &coefficients[*g]);
            let DragRoom { there, v, .. } = &mut self.room;
            let at = |i: usize| {
                let carried = |x: &[f64], rates: &[[f64; G]]| Dual64::new(x[i], rates[i][g]);
                [carried(&before.q, &self.q), carried(&before.v, &self.v)]
            };
            there.clear();
            there.extend((0..now.q.len()).map(|i| {
                let [q0, v0] = at(i);
                q0 + v0 * coefficients.h
            }));
            v.clear();
            v.extend(now.v.iter().map(|v| Dual64::from(*v)));
            for (i, _, rate) in &self.held {
                v[*i].eps = rate[g];
            }
            for i in step.free.clone() {
                let a0 = match before.acceleration.get(i) {
                    Some(a0) => Dual64::new(*a0, self.acceleration[i][g]),
                    None => Dual64::from(0.0),
                };
                let [q0, v0] = at(i);
                v[i] = coefficients.damped_velocity(-q0 + now.q[i], v0, a0);
            }
            self.room.add_rates(drag, g, &mut self.direct);
        }
    }

    /// The same at the end of a step, where the forces are found anew.
    fn add_drag(&mut self, step: &Linearization<'_, f64, R>) {
        for (g, drag) in &self.drag {
            let now = step.after;
            let DragRoom { there, v, .. } = &mut self.room;
            carry((&now.q, &self.q), *g, there);
            carry((&now.v, &self.v), *g, v);
            self.room.add_rates(drag, *g, &mut self.unbalanced);
        }
    }

    fn solve(&mut self, step: &Linearization<'_, f64, R>) -> Result<(), Error> {
        step.led.fill(&mut self.right, [0.0; G]);
        self.solution.copy_from_slice(&self.right);
        step.factors.solve_many(&mut self.solution);
        if step.factors.negative_pivots() == 0 {
            return Ok(());
        }
        (0..G).try_for_each(|g| {
            let [x, b] = [&self.solution, &self.right]
                .map(|list| list.iter().map(|lanes| lanes[g]).collect::<Vec<f64>>());
            step.check_solution(&x, &b)
        })
    }

    /// Takes the solution `dq1` and derives velocities and forces from it.
    fn finish(
        &mut self,
        coefficients: &StepCoefficients<f64>,
        slopes: Option<&[StepCoefficients<f64>; G]>,
        step: &Linearization<'_, f64, R>,
    ) {
        let free = step.free.clone();
        let by_end = coefficients.end.recip();
        let mass = &step.rod.mass()[free.clone()];
        let (q, v) = (&mut self.q[free.clone()], &mut self.v[free.clone()]);
        let n = &mut self.unbalanced[free.clone()];
        let (direct, right) = (&self.direct[free.clone()], &self.right[free.clone()]);
        let solution = &self.solution[free.clone()];
        self.acceleration.resize(step.after.acceleration.len(), [0.0; G]);
        let a = self.acceleration.get_mut(free.clone()).unwrap_or_default();
        // dn1 = dn1|q1 + (J - M) dq1 / (h beta)^2, and J dq1 is the right-hand side.
        for i in 0..mass.len() {
            for g in 0..G {
                n[i][g] = direct[i][g] + (right[i][g] - mass[i] * solution[i][g]) * by_end;
            }
        }
        match (coefficients.acceleration, a.is_empty()) {
            (None, true) => {
                let coefficients = coefficients.without_acceleration();
                velocities(&coefficients, solution, [q, v]);
            }
            _ => accelerations(coefficients, solution, [q, v, a]),
        }
        if let Some(slopes) = slopes {
            let began = Began::of(step);
            for (i, k) in free.enumerate() {
                let (change, [v0, a0]) = began.at(i);
                for (g, slope) in slopes.iter().enumerate() {
                    v[i][g] += slope.velocity(change, v0, a0);
                    if slope.acceleration.is_some() {
                        let both = [v0, step.after.v[k]];
                        a[i][g] += slope.acceleration_at_end(change, both, a0);
                    }
                }
            }
        }
        for (i, q, v) in &self.held {
            (self.q[*i], self.v[*i]) = (*q, *v);
        }
        // What is led goes as fast as it was seen to go, whatever the scheme's numbers are.
        step.led.fill(&mut self.v, [0.0; G]);
        if !self.acceleration.is_empty() {
            step.led.fill(&mut self.acceleration, [0.0; G]);
        }
    }
}

/// Adds the derivatives of mass damping at a fixed end to those of the forces there, `direct`, and writes minus those of
/// the residual, of unknowns with the derivatives `[q, v, n0]` at the start.
#[inline(always)]
fn residuals<const G: usize>(
    coefficients: &StepCoefficients<f64>,
    (mass, damping): (&[f64], f64),
    [q, v, n0]: [&[[f64; G]]; 3],
    a0: impl Fn(usize) -> [f64; G],
    [direct, right]: [&mut [[f64; G]]; 2],
) {
    let count = mass.len();
    let (q, v, n0) = (&q[..count], &v[..count], &n0[..count]);
    let (direct, right) = (&mut direct[..count], &mut right[..count]);
    if damping != 0.0 {
        for i in 0..count {
            let a0 = a0(i);
            for g in 0..G {
                let velocity = coefficients.damped_velocity(-q[i][g], v[i][g], a0[g]);
                direct[i][g] += damping * mass[i] * velocity;
            }
        }
    }
    for i in 0..count {
        let a0 = a0(i);
        for g in 0..G {
            let (change, n1, start) = (-q[i][g], direct[i][g], [v[i][g], a0[g]]);
            right[i][g] = -coefficients.residual(mass[i], change, start, n1, n0[i][g]);
        }
    }
}

/// Takes the unknowns' derivatives at the end, and writes those of the velocities.
#[inline(always)]
fn velocities<const G: usize>(
    coefficients: &StepCoefficients<f64>,
    end: &[[f64; G]],
    [q, v]: [&mut [[f64; G]]; 2],
) {
    let (q, v) = (&mut q[..end.len()], &mut v[..end.len()]);
    for i in 0..end.len() {
        for g in 0..G {
            v[i][g] = coefficients.velocity(end[i][g] - q[i][g], v[i][g], 0.0);
            q[i][g] = end[i][g];
        }
    }
}

/// The same with the accelerations, of a scheme that goes on from them, at the first step too, where they are not known.
#[inline(always)]
fn accelerations<const G: usize>(
    coefficients: &StepCoefficients<f64>,
    end: &[[f64; G]],
    [q, v, a]: [&mut [[f64; G]]; 3],
) {
    let (q, v, a) = (&mut q[..end.len()], &mut v[..end.len()], &mut a[..end.len()]);
    for i in 0..end.len() {
        for g in 0..G {
            let (change, v0, a0) = (end[i][g] - q[i][g], v[i][g], a[i][g]);
            v[i][g] = coefficients.velocity(change, v0, a0);
            q[i][g] = end[i][g];
            a[i][g] = coefficients.acceleration_at_end(change, [v0, v[i][g]], a0);
        }
    }
}

/// How the free unknowns began a step, and how much they have changed in it.
struct Began<'a> {
    q1: &'a [f64],
    q0: &'a [f64],
    v0: &'a [f64],
    /// Of a scheme that goes on from them, where they are known.
    a0: Option<&'a [f64]>,
}

impl<'a> Began<'a> {
    fn of<R: Rod<f64>>(step: &Linearization<'a, f64, R>) -> Self {
        let (before, now, free) = (step.before, step.after, step.free.clone());
        Self {
            q1: &now.q[free.clone()],
            q0: &before.q[free.clone()],
            v0: &before.v[free.clone()],
            a0: before.acceleration.get(free),
        }
    }

    /// The change of unknown `i`, and its velocity and acceleration at the start.
    #[inline(always)]
    fn at(&self, i: usize) -> (f64, [f64; 2]) {
        (self.q1[i] - self.q0[i], [self.v0[i], self.a0.map_or(0.0, |a0| a0[i])])
    }
}

/// Writes numbers with their derivatives along one parameter.
fn carry<const G: usize>((x, rates): (&[f64], &[[f64; G]]), g: usize, to: &mut Vec<Dual64>) {
    to.clear();
    to.extend(x.iter().zip(rates).map(|(x, rate)| Dual64::new(*x, rate[g])));
}

/// Where the derivatives of drag are found: places and velocities, and what follows from them.
#[derive(Clone, Default)]
struct DragRoom {
    there: Vec<Dual64>,
    v: Vec<Dual64>,
    tangents: Vec<Vector<Dual64>>,
    forces: Vec<Dual64>,
}

impl DragRoom {
    /// Adds the derivatives of the drag there along one parameter.
    fn add_rates<const G: usize>(
        &mut self,
        drag: &NodalDrag<Dual64>,
        g: usize,
        out: &mut [[f64; G]],
    ) {
        drag.tangents(&self.there, &mut self.tangents);
        self.forces.clear();
        self.forces.resize(self.v.len(), Dual64::from(0.0));
        drag.add_forces(&self.tangents, &self.v, &mut self.forces);
        out.iter_mut().zip(&self.forces).for_each(|(out, force)| out[g] += force.eps);
    }
}
