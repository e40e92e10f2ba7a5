//! A misfit's derivatives over a step, from its end to its start.
//!
//! [Forward sensitivities](crate::dynamics::sensitivity) push a change of the start through a step; this is the same
//! linear map, transposed: what the misfit makes of the end, in which the numbers below are its derivatives, becomes
//! what it makes of the start and of the numbers of the rod. The matrix of a step is symmetric, so that its factors
//! solve both.

use crate::dynamics::adjoint::numbers::{Numbers, by_each};
use crate::dynamics::adjoint::supports::MovingSupports;
use crate::dynamics::adjoint::viscous::ViscousBack;
use crate::dynamics::linearization::Linearization;
use crate::dynamics::simulation::Simulation;
use crate::error::Error;
use crate::numerics::tangent::{Factors, Tangent};
use crate::rod::{
    DragSlopes, FrameRate, Laws, NodalDrag, Strained, Transposed, still_frames, strained,
};
use crate::scene::{Damping, Maxwell};
use num_dual::Dual64;

/// The derivatives of a misfit by what is now, and by the numbers of the rod so far.
pub struct Backward<R: Transposed> {
    /// By places and velocities.
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    /// By accelerations, where the scheme goes on from them.
    pub acceleration: Vec<f64>,
    /// By the forces that the next step counts by its start.
    pub unbalanced: Vec<f64>,
    pub frames: Vec<FrameRate<1>>,
    pub viscous: Option<ViscousBack>,
    /// By the numbers of the rod.
    pub laws: Laws,
    pub mass: Vec<f64>,
    pub damping: Damping<f64>,
    pub drag: Option<DragSlopes>,
    /// By the scheme's number.
    pub parameter: f64,
    pub supports: MovingSupports<R>,
    /// What forces count for.
    force: Vec<f64>,
    right: Vec<f64>,
    room: Room,
}

/// Lists to work in.
#[derive(Default)]
struct Room {
    stiff: Vec<f64>,
    strain: Vec<f64>,
    along: Vec<f64>,
}

/// What does not change from step to step.
pub struct Constants<'a> {
    pub damping: Damping<f64>,
    pub drag: Option<&'a NodalDrag<f64>>,
    /// The scheme's number.
    pub parameter: f64,
}

impl<R: Transposed> Backward<R> {
    /// At the end of a simulation's run, where nothing counts yet. `apart`: whether kinds of strain have times of their
    /// own, or could; `moments`: whether there are dead moments, or could be.
    pub fn new(
        simulation: &Simulation<f64, R>,
        supports: MovingSupports<R>,
        (apart, moments): (bool, bool),
    ) -> Self {
        let (rod, state) = (simulation.rod(), simulation.state());
        let zero = vec![0.0; state.q.len()];
        let laws = rod.no_laws(moments);
        let frames = if R::HAS_FRAMES { laws.stretch.len() } else { 0 };
        let strains = state.internal.strain.len();
        let maxwell = simulation.damping().maxwell.map(|_| Maxwell { stiffness: 0.0, time: 0.0 });
        Self {
            q: zero.clone(),
            v: zero.clone(),
            acceleration: zero.clone(),
            unbalanced: zero.clone(),
            frames: still_frames(frames),
            viscous: (strains > 0).then(|| {
                ViscousBack::new(strains, still_frames(frames), simulation.damping(), apart)
            }),
            mass: zero.clone(),
            damping: Damping { maxwell, ..Damping::default() },
            drag: simulation.drag().map(NodalDrag::no_slopes),
            parameter: 0.0,
            supports,
            force: zero.clone(),
            right: zero,
            room: Room::default(),
            laws,
        }
    }

    /// Goes back over a step.
    ///
    /// # Errors
    /// [`Error::SingularTangent`] where the step has no derivatives.
    pub fn go(
        &mut self,
        constants: &Constants<'_>,
        step: &Linearization<'_, f64, R>,
    ) -> Result<(), Error> {
        let dual = step.coefficients(Dual64::new(constants.parameter, 1.0));
        let (coefficients, slopes) = (dual.map(|x| x.re), dual.map(|x| x.eps));
        let numbers = Numbers { dual, coefficients, slopes };
        R::rebase_back(step.end, &mut self.frames, &mut self.q);
        // What is led has no derivatives, and the forces on it move nothing.
        step.led.fill(&mut self.unbalanced, 0.0);
        self.next_forces(constants, &numbers, step);
        for by in [&mut self.q, &mut self.v, &mut self.acceleration] {
            step.led.fill(by, 0.0);
        }
        self.ends(&numbers, step)?;
        self.residual(constants, &numbers, step);
        self.forces(constants, &numbers, step);
        Ok(())
    }

    /// Of a viscous rod: the forces that the next step counts by its start, which are found anew, and what the material
    /// remembers.
    fn next_forces(
        &mut self,
        constants: &Constants<'_>,
        numbers: &Numbers,
        step: &Linearization<'_, f64, R>,
    ) {
        let Some(viscous) = &mut self.viscous else { return };
        let d = std::mem::take(&mut self.unbalanced);
        let damping = constants.damping.mass;
        for i in step.free.clone() {
            let (mass, v) = (step.rod.mass()[i], step.after.v[i]);
            self.v[i] += damping * mass * d[i];
            self.damping.mass += mass * v * d[i];
            self.mass[i] += damping * v * d[i];
        }
        if let (Some(drag), Some(slopes)) = (constants.drag, &mut self.drag) {
            let at = [&step.after.q[..], &step.after.v, &d];
            drag.add_slopes_of(at, slopes, [&mut self.q, &mut self.v]);
        }
        let (gradient, tangent) = step.next;
        let stiff = &mut self.room.stiff;
        stiff.resize(d.len(), 0.0);
        tangent.product(&d, stiff);
        self.q.iter_mut().zip(&*stiff).for_each(|(q, stiff)| *q += stiff);
        R::add_to_frames(step.end, gradient, (&d, stiff), &mut self.frames);
        let numbers = (numbers, &constants.damping);
        let mut to = (&mut self.laws, &mut self.damping, &mut self.parameter);
        viscous.forces_at_start(&d, numbers, step, &mut to);
        viscous.go_back(numbers, step, (&mut self.q, &mut self.frames), &mut to);
        add_loads(step, &d, &mut self.laws);
        self.unbalanced = d;
        self.unbalanced.fill(0.0);
    }

    /// Velocities, accelerations and forces at the end, and the solution of the step.
    fn ends(&mut self, numbers: &Numbers, step: &Linearization<'_, f64, R>) -> Result<(), Error> {
        let Numbers { coefficients, slopes, .. } = numbers;
        let free = step.free.clone();
        let (before, now, mass) = (step.before, step.after, step.rod.mass());
        let goes_on = coefficients.acceleration.is_some();
        let by_end = coefficients.end.recip();
        let velocity = by_each(|change, v0, a0| coefficients.velocity(change, v0, a0));
        let acceleration = by_each(|change, v0, a0| {
            let v1 = coefficients.velocity(change, v0, a0);
            coefficients.acceleration_at_end(change, [v0, v1], a0)
        });
        let has_acceleration = !now.acceleration.is_empty();
        self.right.fill(0.0);
        for i in free.clone() {
            let (v1, a1) = (self.v[i], if has_acceleration { self.acceleration[i] } else { 0.0 });
            let (change, v0) = (now.q[i] - before.q[i], before.v[i]);
            let a0 = if goes_on { before.acceleration[i] } else { 0.0 };
            self.parameter += v1 * slopes.velocity(change, v0, a0);
            if slopes.acceleration.is_some() {
                self.parameter += a1 * slopes.acceleration_at_end(change, [v0, now.v[i]], a0);
            }
            let by = |k: usize| v1 * velocity[k] + a1 * acceleration[k];
            let n1 = self.unbalanced[i];
            self.right[i] = self.q[i] + by(0) - mass[i] * n1 * by_end;
            self.force[i] = n1;
            self.q[i] = -by(0);
            self.v[i] = by(1);
            self.acceleration[i] = if goes_on { by(2) } else { 0.0 };
        }
        let b = step.factors.negative_pivots().gt(&0).then(|| self.right.clone());
        step.factors.solve(&mut self.right);
        if let Some(b) = b {
            step.check_solution(&self.right, &b)?;
        }
        for i in free {
            self.right[i] += self.force[i] * by_end;
        }
        Ok(())
    }

    /// The equations of the step, whose right-hand side counts for `right`.
    fn residual(
        &mut self,
        constants: &Constants<'_>,
        Numbers { coefficients, slopes, .. }: &Numbers,
        step: &Linearization<'_, f64, R>,
    ) {
        let (before, now, mass) = (step.before, step.after, step.rod.mass());
        let damping = constants.damping.mass;
        let inertia = coefficients.acceleration.as_ref().map_or(0.0, |a| a.inertia);
        let [by_change, by_v0, by_a0] =
            by_each(|change, v0, a0| coefficients.damped_velocity(change, v0, a0));
        self.force[..step.free.start].fill(0.0);
        self.force[step.free.end..].fill(0.0);
        for i in step.free.clone() {
            let (r, m) = (self.right[i], mass[i]);
            let d = self.force[i] - coefficients.end * r;
            self.force[i] = d;
            let damped = damping * m * d;
            self.q[i] += m * r - by_change * damped;
            self.v[i] += coefficients.h * m * r + by_v0 * damped;
            self.acceleration[i] += by_a0 * damped - inertia * m * r;
            self.unbalanced[i] = -coefficients.start * r;
            let (change, v0) = (now.q[i] - before.q[i], before.v[i]);
            let a0 = before.acceleration.get(i).copied().unwrap_or(0.0);
            let velocity = coefficients.damped_velocity(change, v0, a0);
            self.mass[i] +=
                damping * velocity * d - r * coefficients.residual(1.0, change, [v0, a0], 0.0, 0.0);
            self.damping.mass += m * velocity * d;
            let n1 = step.total[i] + damping * m * velocity;
            let n0 = before.unbalanced[i];
            self.parameter += damping * m * slopes.damped_velocity(change, v0, a0) * d
                - r * slopes.residual(m, 0.0, [0.0, a0], n1, n0);
        }
    }

    /// The forces at the end of the step, at a fixed end: by what the rod is made of, by frames and by supports.
    fn forces(
        &mut self,
        constants: &Constants<'_>,
        numbers: &Numbers,
        step: &Linearization<'_, f64, R>,
    ) {
        let d = std::mem::take(&mut self.force);
        match &mut self.viscous {
            Some(viscous) => {
                let numbers = (numbers, &constants.damping);
                let mut to = (&mut self.laws, &mut self.damping, &mut self.parameter);
                viscous.forces_at_end(&d, numbers, step, &mut to);
            }
            None => {
                let Room { strain, along, .. } = &mut self.room;
                R::measured_strains(step.end, strain);
                along.resize(strain.len(), 0.0);
                let still = still_frames(self.frames.len());
                strained(step.rod, step.end, &still, &d, along);
                let strained = Strained { strains: strain, own: &[], counted: false };
                step.rod.add_to_laws(along, strained, &mut self.laws);
            }
        }
        add_loads(step, &d, &mut self.laws);
        if R::HAS_FRAMES {
            let stiff = &mut self.room.stiff;
            stiff.resize(d.len(), 0.0);
            step.tangent.product(&d, stiff);
            R::add_to_frames(step.end, step.gradient, (&d, stiff), &mut self.frames);
            let held = (0..d.len()).filter(|i| !step.free.contains(i));
            held.for_each(|i| self.q[i] += stiff[i]);
        } else {
            add_held(step, &d, &mut self.q);
        }
        let by_there = self.drag(&d, constants, numbers, step);
        self.supports.lead_back(step, (&mut self.q, &mut self.v), &mut self.frames);
        for (i, by_there) in by_there.into_iter().enumerate() {
            self.q[i] += by_there;
            self.v[i] += numbers.coefficients.h * by_there;
        }
        self.force = d;
    }

    /// The drag at the end of the step; returns what the places count for in it that the rod would be at.
    fn drag(
        &mut self,
        d: &[f64],
        constants: &Constants<'_>,
        Numbers { coefficients, slopes, .. }: &Numbers,
        step: &Linearization<'_, f64, R>,
    ) -> Vec<f64> {
        let (Some(drag), Some(by_drag)) = (constants.drag, &mut self.drag) else {
            return Vec::new();
        };
        let (before, now, h) = (step.before, step.after, coefficients.h);
        let there: Vec<f64> = before.q.iter().zip(&before.v).map(|(q, v)| q + v * h).collect();
        let a0 = |i: usize| before.acceleration.get(i).copied().unwrap_or(0.0);
        let mut v = now.v.clone();
        for i in step.free.clone() {
            v[i] = coefficients.damped_velocity(now.q[i] - before.q[i], before.v[i], a0(i));
        }
        let (mut by_there, mut by_v) = (vec![0.0; v.len()], vec![0.0; v.len()]);
        drag.add_slopes_of([&there, &v, d], by_drag, [&mut by_there, &mut by_v]);
        let [by_change, by_v0, by_a0] =
            by_each(|change, v0, a0| coefficients.damped_velocity(change, v0, a0));
        for (i, by_v) in by_v.into_iter().enumerate() {
            if !step.free.contains(&i) {
                self.v[i] += by_v;
                continue;
            }
            self.q[i] -= by_v * by_change;
            self.v[i] += by_v * by_v0;
            self.acceleration[i] += by_v * by_a0;
            let change = now.q[i] - before.q[i];
            self.parameter += by_v * slopes.damped_velocity(change, before.v[i], a0(i));
        }
        by_there
    }
}

/// What loads and dead moments count for.
fn add_loads<R: Transposed>(step: &Linearization<'_, f64, R>, d: &[f64], laws: &mut Laws) {
    laws.load.iter_mut().zip(d).for_each(|(load, d)| *load -= d);
    step.rod.add_to_moments(&step.after.q, d, laws);
}

/// What held places count for, by the tangent's rows of them alone.
fn add_held<R: Transposed>(step: &Linearization<'_, f64, R>, d: &[f64], q: &mut [f64]) {
    for i in (0..d.len()).filter(|i| !step.free.contains(i)) {
        let near = R::Tangent::coupled(i, d.len());
        q[i] += near.map(|j| step.tangent.get(i, j) * d[j]).sum::<f64>();
    }
}
