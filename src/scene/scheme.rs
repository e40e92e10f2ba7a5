//! The time integrators ([`Scheme`]) and their properties ([`Traits`]): name, order, supported terms, stability limit
//! (step times angular frequency), conservation of energy, parameter.
//!
//! The schemes are Newmark-beta (default), average vector field, Rodas4, Verlet, PEFRL and generalised-alpha. A scheme
//! is a variant of [`Scheme`], a row of [`Traits`], and a stepper in [`crate::dynamics::stepper`]. The row determines
//! the terms that a scene may contain, the energy check, the steps of a study and the text of messages.

use serde::{Deserialize, Serialize};

/// Time integration scheme.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Implicit, of Huang and Jawed (2019), Eq. (6), corrected: second order without dissipation at `beta = 0.5`,
    /// implicit Euler at 1.
    #[default]
    NewmarkBeta,
    /// Second order; conserves energy exactly at about 2.7 times the cost.
    AverageVectorField,
    /// Linearly implicit, fourth order; damps frequencies that the step does not resolve.
    Rodas4,
    /// Explicit, second order, symplectic; stable below a step limit.
    Verlet,
    /// Explicit, fourth order, symplectic; stable below a step limit.
    Pefrl,
    /// Second order; damps frequencies that the step does not resolve, as set by `time.rho_inf`.
    GeneralisedAlpha,
}

/// Parameter of a scheme in `[time]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SchemeParameter {
    /// `time.beta` in [0.5, 1]: above 0.5 it dissipates, at first order.
    Beta,
    /// `time.rho_inf` in [0, 1]: factor per step on the amplitude of vibrations that the step does not resolve.
    RhoInf,
}

/// Properties of a scheme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traits {
    /// The scheme.
    pub scheme: Scheme,
    /// The name in files and reports.
    pub name: &'static str,
    /// Order of accuracy: power of the step to which the error of smooth motion is proportional.
    pub order: u32,
    /// Whether it takes Kelvin-Voigt damping.
    pub takes_viscosity: bool,
    /// Whether it takes internal friction and relaxation.
    pub takes_friction: bool,
    /// Whether it takes drag.
    pub takes_drag: bool,
    /// Whether it takes contacts, whose forces begin and end within a step.
    pub takes_contacts: bool,
    /// Whether it takes moving supports.
    pub takes_boundary_motion: bool,
    /// Whether it takes signals that are not smooth: with jumps or kinks.
    pub takes_rough_signals: bool,
    /// Whether it takes actuators that follow signals, which it evaluates at the ends of a step or as means over it.
    pub takes_timed_actuation: bool,
    /// Largest `h omega` at which a vibration stays bounded, with step h and angular frequency omega; none for
    /// unconditionally stable schemes.
    pub stability_limit: Option<f64>,
    /// Conservation of the energy of a rod without damping.
    pub energy: EnergyConservation,
    /// Parameter in `[time]`. Schemes with a parameter have a `time.tolerance` too.
    pub parameter: Option<SchemeParameter>,
}

/// Conservation of the energy of a rod without damping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnergyConservation {
    /// Conserved to rounding, for every step.
    Exact,
    /// Oscillates about its value, without drift while the step is stable.
    OnAverage,
    /// Decreases by the motion that the step does not resolve, and may grow at large steps.
    Inexact,
}

/// Properties that most schemes share: implicit, second order, for all terms of the equation of motion.
const IMPLICIT: Traits = Traits {
    scheme: Scheme::NewmarkBeta,
    name: "newmark-beta",
    order: 2,
    takes_viscosity: true,
    takes_friction: true,
    takes_drag: true,
    takes_contacts: true,
    takes_boundary_motion: true,
    takes_rough_signals: true,
    takes_timed_actuation: true,
    stability_limit: None,
    energy: EnergyConservation::Inexact,
    parameter: None,
};

/// Properties of schemes for elastic rods without damping, drag, contacts and moving supports.
const ELASTIC: Traits = Traits {
    takes_viscosity: false,
    takes_friction: false,
    takes_drag: false,
    takes_contacts: false,
    takes_boundary_motion: false,
    energy: EnergyConservation::OnAverage,
    ..IMPLICIT
};

/// One row per scheme, in the order of the variants. A study tries the schemes in this order, so that
/// explicit schemes of low order come before those of high order.
const TRAITS: [Traits; 6] = [
    Traits { parameter: Some(SchemeParameter::Beta), ..IMPLICIT },
    Traits {
        scheme: Scheme::AverageVectorField,
        name: "average-vector-field",
        takes_friction: false,
        takes_drag: false,
        energy: EnergyConservation::Exact,
        ..IMPLICIT
    },
    Traits {
        scheme: Scheme::Rodas4,
        name: "rodas4",
        order: 4,
        takes_rough_signals: false,
        takes_timed_actuation: false,
        energy: EnergyConservation::Inexact,
        ..ELASTIC
    },
    Traits { scheme: Scheme::Verlet, name: "verlet", stability_limit: Some(2.0), ..ELASTIC },
    Traits {
        scheme: Scheme::Pefrl,
        name: "pefrl",
        order: 4,
        takes_rough_signals: false,
        takes_timed_actuation: false,
        stability_limit: Some(2.989),
        ..ELASTIC
    },
    Traits {
        scheme: Scheme::GeneralisedAlpha,
        name: "generalised-alpha",
        parameter: Some(SchemeParameter::RhoInf),
        ..IMPLICIT
    },
];

// Rows out of order do not compile.
const _: () = {
    let mut i = 0;
    while i < TRAITS.len() {
        assert!(TRAITS[i].scheme as usize == i);
        i += 1;
    }
};

impl Scheme {
    /// The scheme of a scene with contacts and a step that names none. Without enough numerical damping the energy of a
    /// rod that rests on an obstacle grows from step to step: with `rho_inf` 0.8 too, and not with the default 0.5.
    pub(super) const OF_CONTACTS: Self = Self::GeneralisedAlpha;

    /// Whether `time.beta` is its parameter: true for Newmark-beta only.
    pub fn takes_beta(self) -> bool {
        self.traits().parameter == Some(SchemeParameter::Beta)
    }

    /// All schemes in the order of the variants, explicit ones of low order before those of high order.
    pub fn all() -> impl Iterator<Item = Self> {
        TRAITS.iter().map(|traits| traits.scheme)
    }

    /// The properties of the scheme: its row of the table of all schemes.
    pub const fn traits(self) -> &'static Traits {
        // Rows are in the order of the variants, which the constant above asserts.
        &TRAITS[self as usize]
    }

    /// The name in files and reports, such as `newmark-beta`.
    pub fn name(self) -> &'static str {
        self.traits().name
    }

    /// Names of the schemes for which `has_property` returns true, for messages, in the order of the variants: `a, b
    /// and c`. An empty text if there is none.
    pub(crate) fn names(has_property: impl Fn(&Traits) -> bool) -> String {
        let names: Vec<_> =
            TRAITS.iter().filter(|traits| has_property(traits)).map(|t| t.name).collect();
        match &names[..] {
            [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
            names => names.concat(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scheme_names_equal_their_serialized_form() {
        for scheme in Scheme::all() {
            let written = serde_json::to_value(scheme).unwrap();
            assert_eq!(written, scheme.name());
        }
        assert_eq!(
            Scheme::names(|t| t.takes_viscosity),
            "newmark-beta, average-vector-field and generalised-alpha"
        );
    }
}
