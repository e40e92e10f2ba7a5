//! A misfit's derivatives over a step, through what the material remembers: strains, their rates, and how far springs of
//! a Maxwell branch are stretched.

use crate::dynamics::adjoint::numbers::Numbers;
use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::linearization::Linearization;
use crate::dynamics::viscosity::{Memory, relaxation};
use crate::energy::Derivatives;
use crate::numerics::lanes::Lanes;
use crate::rod::{FrameRate, InternalVariables, Laws, Strained, Transposed, strained};
use crate::scene::{Damping, Maxwell};
use num_dual::Dual64;

/// The derivatives of a misfit by what the material remembers.
pub struct ViscousBack {
    pub internal: InternalVariables<f64>,
    /// Whether kinds of strain have times of their own.
    apart: bool,
    still: Vec<FrameRate<1>>,
    /// What stresses are multiplied with, and what the strains they count for count for.
    along: Vec<f64>,
    by_strain: Vec<f64>,
    by_own: Vec<f64>,
    /// The strains that are counted.
    counted: Vec<f64>,
    own: Vec<f64>,
}

/// What the derivatives by numbers go to: of laws, of damping and of the scheme.
pub type To<'a> = (&'a mut Laws, &'a mut Damping<f64>, &'a mut f64);

/// The numbers of a step, and of damping.
type Given<'a> = (&'a Numbers, &'a Damping<f64>);

/// What a moment's stress counts, of a step's numbers and those of damping.
type MemoryOf = fn(&StepCoefficients<Dual64>, &Damping<Dual64>) -> Memory<Dual64>;

impl ViscousBack {
    pub fn new(
        strains: usize,
        still: Vec<FrameRate<1>>,
        damping: Damping<f64>,
        apart: bool,
    ) -> Self {
        let zero = vec![0.0; strains];
        let relaxing = if damping.maxwell.is_some() { zero.clone() } else { Vec::new() };
        let internal = InternalVariables {
            strain: zero.clone(),
            strain_rate: zero.clone(),
            slid: Vec::new(),
            relaxing,
        };
        let own = if apart { zero.clone() } else { Vec::new() };
        Self {
            internal,
            apart,
            still,
            along: zero.clone(),
            by_strain: zero.clone(),
            by_own: own.clone(),
            counted: zero,
            own,
        }
    }

    /// The forces at the end of a step, where they count for `d`.
    pub fn forces_at_end<R: Transposed>(
        &mut self,
        d: &[f64],
        given: Given<'_>,
        step: &Linearization<'_, f64, R>,
        to: &mut To<'_>,
    ) {
        self.forces(d, given, step, &step.before.internal, Memory::at_end, to);
    }

    /// The forces that the next step counts by its start, where they count for `d`.
    pub fn forces_at_start<R: Transposed>(
        &mut self,
        d: &[f64],
        given: Given<'_>,
        step: &Linearization<'_, f64, R>,
        to: &mut To<'_>,
    ) {
        self.forces(d, given, step, &step.after.internal, Memory::at_start, to);
    }

    fn forces<R: Transposed>(
        &mut self,
        d: &[f64],
        (numbers, damping): Given<'_>,
        step: &Linearization<'_, f64, R>,
        past: &InternalVariables<f64>,
        of: MemoryOf,
        to: &mut To<'_>,
    ) {
        let plain = numbers.dual.map(|x| Dual64::from(x.re));
        let memory = of(&plain, &duals(damping)).value();
        let now = &step.after.internal.strain;
        strained(step.rod, step.end, &self.still, d, &mut self.along);
        for (i, counted) in self.counted.iter_mut().enumerate() {
            *counted = memory.factor * now[i]
                - memory.strain * past.strain[i]
                - memory.rate * past.strain_rate[i];
            if let Some(z) = past.relaxing.get(i) {
                *counted -= memory.relaxing * z;
            }
        }
        for (i, own) in self.own.iter_mut().enumerate() {
            let kind = step.rod.kind(i);
            let before = memory.past[0] * past.strain[i] + memory.past[1] * past.strain_rate[i];
            *own = memory.own_factor[kind] * now[i] - memory.time[kind] * before;
        }
        let strained = Strained { strains: &self.counted, own: &self.own, counted: true };
        step.rod.add_to_laws(&self.along, strained, to.0);
        step.rod.stiffened(&self.along, true, &mut self.by_strain);
        if self.apart {
            step.rod.stiffened(&self.along, false, &mut self.by_own);
        }
        let sums = self.count(&memory, now, past, step, to.0);
        for (by, memory) in each_number(damping, numbers, of) {
            *by.of(to) += product(&sums, &memory);
        }
    }

    /// Adds what the past of strains counts for, and returns what the numbers do that they are counted with.
    fn count<R: Transposed>(
        &mut self,
        memory: &Memory<f64>,
        now: &[f64],
        past: &InternalVariables<f64>,
        step: &Linearization<'_, f64, R>,
        laws: &mut Laws,
    ) -> Memory<f64> {
        let mut sums = memory_of_zeros();
        let to = &mut self.internal;
        for (i, by) in self.by_strain.iter().enumerate() {
            let (s0, r0) = (past.strain[i], past.strain_rate[i]);
            to.strain[i] -= memory.strain * by;
            to.strain_rate[i] -= memory.rate * by;
            sums.factor += now[i] * by;
            sums.strain -= s0 * by;
            sums.rate -= r0 * by;
            if let Some(z) = past.relaxing.get(i) {
                to.relaxing[i] -= memory.relaxing * by;
                sums.relaxing -= z * by;
            }
            let mut by_rest = memory.factor * by;
            if let Some(own) = self.by_own.get(i) {
                let kind = step.rod.kind(i);
                let by_past = -(memory.time[kind] * own);
                to.strain[i] += by_past * memory.past[0];
                to.strain_rate[i] += by_past * memory.past[1];
                sums.own_factor[kind] += now[i] * own;
                sums.time[kind] -= (memory.past[0] * s0 + memory.past[1] * r0) * own;
                sums.past[0] += by_past * s0;
                sums.past[1] += by_past * r0;
                by_rest += memory.own_factor[kind] * own;
            }
            if let Some(rest) = laws.rest.get_mut(i) {
                *rest -= (1.0 + now[i]) * by_rest;
            }
        }
        sums
    }

    /// Goes back over what the material remembers of a step.
    pub fn go_back<R: Transposed>(
        &mut self,
        (numbers, damping): Given<'_>,
        step: &Linearization<'_, f64, R>,
        (q, frames): (&mut [f64], &mut [FrameRate<1>]),
        (laws, by_damping, _): &mut To<'_>,
    ) {
        let h = numbers.coefficients.h;
        let (before, now) = (&step.before.internal, &step.after.internal);
        let to = &mut self.internal;
        let [left, taken] = damping.maxwell.map_or([0.0; 2], |maxwell| relaxation(&maxwell, h));
        let mut by_relaxation = [0.0; 2];
        // What a strain's change over the step counts for, which its start takes back.
        for i in 0..now.strain.len() {
            let mut by_change = to.strain_rate[i] / h;
            if let Some(z) = to.relaxing.get_mut(i) {
                by_change += taken * *z;
                by_relaxation[0] += before.relaxing[i] * *z;
                by_relaxation[1] += (now.strain[i] - before.strain[i]) * *z;
                *z *= left;
            }
            let by_end = to.strain[i] + by_change;
            to.strain[i] = -by_change;
            to.strain_rate[i] = 0.0;
            self.by_strain[i] = by_end;
            if let Some(rest) = laws.rest.get_mut(i) {
                *rest -= (1.0 + now.strain[i]) * by_end;
            }
        }
        if let (Some(maxwell), Some(by)) = (&damping.maxwell, by_damping.maxwell.as_mut()) {
            let time = Dual64::new(maxwell.time, 1.0);
            let slopes = relaxation(&Maxwell { stiffness: Dual64::from(0.0), time }, h);
            by.time += by_relaxation[0] * slopes[0].eps + by_relaxation[1] * slopes[1].eps;
        }
        let at = (&step.after.q[..], &step.before.frames);
        let out = add_by_strains(step.rod, step.end, at, &self.by_strain, q);
        R::turn_frames(step.end, &out, frames);
    }
}

/// Adds what the unknowns count for where strains do, and returns it.
pub fn add_by_strains<R: Transposed>(
    rod: &R,
    geometry: &R::Geometry,
    at: (&[f64], &R::Frames),
    by_strain: &[f64],
    q: &mut [f64],
) -> Vec<f64> {
    // A strain is not weighed with an edge's length as an axial force is.
    let mut lengths = vec![1.0; by_strain.len()];
    rod.by_length(&mut lengths);
    let stress: Vec<Lanes<1>> =
        by_strain.iter().zip(lengths).map(|(by, length)| Lanes([by / length])).collect();
    let mut out = vec![[0.0]; q.len()];
    R::stressed_rate(None, &stress, geometry, at, Derivatives::Hand, &mut out);
    let out = out.into_flattened();
    q.iter_mut().zip(&out).for_each(|(q, out)| *q += out);
    out
}

/// A number of damping, or the scheme's.
#[derive(Clone, Copy)]
enum Number {
    Stiffness,
    /// Of stretching, bending and twisting alone.
    Own(usize),
    MaxwellStiffness,
    MaxwellTime,
    Scheme,
}

impl Number {
    /// The number in tables of its kind.
    fn in_damping<D>(self, damping: &mut Damping<D>) -> Option<&mut D> {
        match self {
            Self::Stiffness => Some(&mut damping.stiffness),
            Self::Own(0) => Some(&mut damping.stretching),
            Self::Own(1) => Some(&mut damping.bending),
            Self::Own(_) => Some(&mut damping.twisting),
            Self::MaxwellStiffness => {
                damping.maxwell.as_mut().map(|maxwell| &mut maxwell.stiffness)
            }
            Self::MaxwellTime => damping.maxwell.as_mut().map(|maxwell| &mut maxwell.time),
            Self::Scheme => None,
        }
    }

    fn of<'a>(self, (_, damping, scheme): &'a mut To<'_>) -> &'a mut f64 {
        self.in_damping(damping).unwrap_or(scheme)
    }
}

/// What a moment's stress counts, derived by each number.
fn each_number(
    damping: &Damping<f64>,
    numbers: &Numbers,
    of: MemoryOf,
) -> impl Iterator<Item = (Number, Memory<f64>)> {
    let all = [
        Number::Stiffness,
        Number::Own(0),
        Number::Own(1),
        Number::Own(2),
        Number::MaxwellStiffness,
        Number::MaxwellTime,
        Number::Scheme,
    ];
    let plain = numbers.dual.map(|x| Dual64::from(x.re));
    let (damping, dual) = (duals(damping), numbers.dual);
    all.into_iter().filter_map(move |number| {
        let mut damping = damping;
        let memory = match number {
            Number::Scheme => of(&dual, &damping),
            _ => {
                number.in_damping(&mut damping)?.eps = 1.0;
                of(&plain, &damping)
            }
        };
        Some((number, memory.map(|x| x.eps)))
    })
}

/// The numbers of damping, without derivatives.
fn duals(damping: &Damping<f64>) -> Damping<Dual64> {
    let Damping { mass, stiffness, bending, twisting, stretching, maxwell, .. } = *damping;
    let [mass, stiffness, bending, twisting, stretching] =
        [mass, stiffness, bending, twisting, stretching].map(Dual64::from);
    let maxwell =
        maxwell.map(|of| Maxwell { stiffness: of.stiffness.into(), time: of.time.into() });
    Damping { mass, stiffness, bending, twisting, stretching, maxwell, friction: None }
}

fn memory_of_zeros() -> Memory<f64> {
    Memory {
        factor: 0.0,
        strain: 0.0,
        rate: 0.0,
        relaxing: 0.0,
        past: [0.0; 2],
        own_factor: [0.0; 3],
        time: [0.0; 3],
    }
}

/// The sum of all products.
fn product(a: &Memory<f64>, b: &Memory<f64>) -> f64 {
    let list = |m: &Memory<f64>| {
        let ([p, q], [f0, f1, f2], [t0, t1, t2]) = (m.past, m.own_factor, m.time);
        [m.factor, m.strain, m.rate, m.relaxing, p, q, f0, f1, f2, t0, t1, t2]
    };
    list(a).iter().zip(list(b)).map(|(a, b)| a * b).sum()
}
