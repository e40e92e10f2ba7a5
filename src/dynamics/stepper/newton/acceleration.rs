//! The initial acceleration of a rod from its positions and velocities, filtered by the step size.
//!
//! Where positions come from a measurement, the forces there are mostly errors of positions. In a rod that hardly
//! stretches, one micrometer along an edge is a force many times its weight. An implicit step takes only the resolved
//! part of them. So does this system of a step of implicit Euler, with the forces `n` and their derivatives `K` and
//! `C`:
//!
//! ```text
//! (M + h C + h^2 K) a = -n
//! ```
//!
//! Input: a state, the step size `h` (s), and the change of all unknowns in two such steps, which gives the strain
//! rates. Output of [`acceleration_within`]: one acceleration (m/s^2, rad/s^2) per unknown, zero for held and
//! prescribed ones. A singular matrix is an error. `set_initial_acceleration` stores the forces that cause them,
//! without loads in time, for the first step, and for generalised-alpha the accelerations; averaging schemes have
//! neither.

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::step::{Step, StepperSettings, System, Work};
use crate::dynamics::stepper::newton::Newton;
use crate::dynamics::stepper::newton::timed_forces::add_timed_now;
use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::Factors;
use crate::rod::{Rod, State};
use crate::scene::{Scheme, StepTolerance};

/// The accelerations of a rod in `state` as a step of implicit Euler of size `h`, s, resolves them: the solution of `(M
/// + h C + h^2 K) a = -n`, m/s^2 (rad/s^2), with loads in time in `n`. There is one entry per unknown, zero for held
/// and prescribed ones. Strain rates are the differences of the strains over the `change` of all unknowns in two such
/// steps, divided by `2 h`. They do not follow from velocities, because the velocities of a rotating edge would stretch
/// it. The rates are stored in `state` if it has internal variables. [`Error::SingularTangent`] for a singular matrix.
pub(crate) fn acceleration_within<D: RodScalar, R: Rod<D>>(
    h: f64,
    system: &System<D, R>,
    state: &mut State<D, R::Frames>,
    change: &[D],
) -> Result<Vec<D>, Error> {
    let internal = &mut state.internal;
    if !internal.strain_rate.is_empty() {
        let next: Vec<D> = state.q.iter().zip(change).map(|(q, change)| *q + *change).collect();
        let mut strain = internal.strain.clone();
        system.rod.strains(&next, &state.frames, &mut strain);
        let ways = internal.strain_rate.iter_mut().zip(&strain).zip(&internal.strain);
        ways.for_each(|((rate, s1), s0)| *rate = (*s1 - *s0) * (0.5 / h));
    }
    // A solver of generalised-alpha without known accelerations: its first step is one of implicit Euler.
    let rates = state.internal.strain_rate.clone();
    let settings = StepperSettings {
        scheme: Scheme::GeneralisedAlpha,
        parameter: D::from(0.5),
        tolerance: StepTolerance::default(),
        length: 1.0,
    };
    let mut now = state.clone();
    let mut newton = Newton::<D, R>::new(settings, system, &mut now);
    now.internal.strain_rate = rates;
    // The forces of the state, with the given strain rates.
    newton.find_forces(system, &mut now);
    newton.coefficients = StepCoefficients::new(settings.scheme, settings.parameter, false, h);
    let step = Step { system, time: now.time + h, h };
    newton.set_viscous(&step, &now);
    if let (Some(drag), Some(drag_forces)) = (&system.drag, &mut newton.drag_forces) {
        drag_forces.begin(drag, &now, h);
    }
    let mut work = Work::default();
    // Matrix of a step of size h from this state: masses plus h^2 times stiffness and damping.
    newton.evaluate(&step, &now, &now, true, &mut work);
    newton.factor(&step, &mut work)?;
    let free = system.free.clone();
    // Accelerations by the forces, of free unknowns only.
    let mut a: Vec<D> = now.unbalanced.iter().map(|n| -*n).collect();
    add_timed_now(system, now.time, &now.q, &mut a);
    system.prescribed.fill(&mut a, D::from(0.0));
    newton.factors.solve(&mut a);
    a[..free.start].fill(D::from(0.0));
    a[free.end..].fill(D::from(0.0));
    Ok(a)
}

impl<D: RodScalar, R: Rod<D>> Newton<D, R> {
    /// Sets the forces at the start, N, to those that cause the accelerations `a`: `-m a` for the free unknowns, with
    /// loads in time added, which the forces of a state leave out. For generalised-alpha sets the accelerations to `a`.
    /// Averaging schemes have neither, and nothing changes.
    pub fn set_initial_acceleration(
        &self,
        a: Vec<D>,
        system: &System<D, R>,
        state: &mut State<D, R::Frames>,
    ) {
        if StepCoefficients::new(self.scheme, self.parameter, false, 1.0).averages() {
            return;
        }
        for i in system.free.clone() {
            state.unbalanced[i] = -(system.rod.mass()[i] * a[i]);
        }
        // The forces of a state do not include loads in time.
        add_timed_now(system, state.time, &state.q, &mut state.unbalanced);
        if self.scheme == Scheme::GeneralisedAlpha {
            state.acceleration = a;
        }
    }
}
