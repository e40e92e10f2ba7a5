//! Energy that a time integration scheme adds to a motion, or removes from it, as a warning.
//!
//! Without damping, internal friction, drag of a fluid, moving supports and losses of contacts the total energy `T + V`
//! of a rod is constant. The work of loads in time, of loads without a potential, of actuators and of moved obstacles
//! is subtracted from it. A change is then an error of the scheme. Input: the scene, and the largest absolute change of
//! the energy in a run over the largest kinetic energy. Output: code and text of a warning if that fraction exceeds
//! [`MAX_CHANGE`] or is NaN, else `None`. The limit is [`MAX_DISSIPATION`] if beta or rho_inf requests dissipation, or
//! the program chose the step. `None` also for other scenes, and without `[time]`. [`is_conservative`] returns whether
//! the energy of a scene is constant as above, [`is_dissipative`] whether beta or rho_inf requests dissipation. Large
//! gains stop the run before ([`StepControl`](crate::dynamics::step_control::StepControl)).

use crate::code::Code;
use crate::scene::{Scene, SchemeParameter, Time};

/// Largest change of the energy without a warning, over the largest kinetic energy: the limit of step control for
/// gains.
const MAX_CHANGE: f64 = 0.1;
/// The same where `beta` or `rho_inf` requests numerical dissipation, or the program chose the step for the accuracy of
/// positions: high modes with little displacement may lose their energy.
const MAX_DISSIPATION: f64 = 1.0;
/// From this beta on Newmark's scheme is taken as dissipative.
const DISSIPATIVE_BETA: f64 = 0.505;
/// Up to this `rho_inf` generalised-alpha is taken as dissipative.
const DISSIPATIVE_RHO_INF: f64 = 0.98;

/// Whether the parameter of the scheme requests numerical dissipation: beta of at least `DISSIPATIVE_BETA`, or
/// rho_inf of at most `DISSIPATIVE_RHO_INF`. False for schemes without a parameter.
pub(super) fn is_dissipative(time: &Time) -> bool {
    match time.scheme.traits().parameter {
        Some(SchemeParameter::Beta) => time.beta >= DISSIPATIVE_BETA,
        Some(SchemeParameter::RhoInf) => time.rho_inf <= DISSIPATIVE_RHO_INF,
        None => false,
    }
}

/// Whether the total energy of a scene is constant: no damping, internal friction, drag of a fluid, moving support, or
/// contact with damping or friction. Every change is then an error of the scheme.
pub(super) fn is_conservative(scene: &Scene) -> bool {
    !(scene.supports.move_ends() || scene.loads.have_flow() || scene.is_dissipative())
}

/// Code and text of the warning of a run whose total energy changed by at most `change`, a fraction of the largest
/// kinetic energy. `None` up to the limit, without `[time]`, and for scenes that are not conservative; NaN is a
/// warning. The limit is `MAX_CHANGE`, or `MAX_DISSIPATION` for dissipative parameters and steps that the program
/// chose.
pub(crate) fn warning(scene: &Scene, change: f64) -> Option<(Code, String)> {
    let time = scene.time.as_ref().filter(|_| is_conservative(scene))?;
    // A chosen step is for the accuracy of positions, which lost high modes hardly change.
    let most = match is_dissipative(time) || scene.chosen().step {
        true => MAX_DISSIPATION,
        false => MAX_CHANGE,
    };
    let percent = 100.0 * change;
    let words = format!(
        "the scheme {} changed the total energy by {percent:.0} % of the largest kinetic energy, though the scene has no \
         damping. The motion has numerical damping. Use a smaller time.step{}, or add the physical damping of the rod",
        time.scheme.name(),
        scene.or_energy_conserving_scheme()
    );
    (change.is_nan() || change > most).then_some((Code::NumericalDamping, words))
}
