//! The time integrators and their traits.
//!
//! A scheme is a variant here, a row of [`Traits`], and its steps in [`crate::dynamics::stepper`].
//! What a scene may ask of a scheme, how its energy is watched, which steps a study tries and what
//! messages say of it is read from the row.

use serde::{Deserialize, Serialize};

/// Time integration scheme.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// The paper's, corrected: [`crate::dynamics::coefficients`].
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

/// The number that belongs to a scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SchemeParameter {
    /// `time.beta` in [0.5, 1]: above 0.5 it dissipates, at first order.
    Beta,
    /// `time.rho_inf` in [0, 1]: by which factor a step takes vibrations down that are far too fast for
    /// it.
    RhoInf,
}

/// What a scheme is like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Traits {
    /// Which scheme.
    pub scheme: Scheme,
    /// The name in files and reports.
    pub name: &'static str,
    /// Which power of the step the error goes with, on smooth motion.
    pub order: u32,
    /// Whether it takes Kelvin-Voigt damping.
    pub takes_viscosity: bool,
    /// Whether it takes internal friction and relaxation.
    pub takes_friction: bool,
    /// Whether it takes drag.
    pub takes_drag: bool,
    /// Whether it takes moving supports.
    pub takes_boundary_motion: bool,
    /// Largest `h omega` at which a vibration stays bounded; none where every step is stable.
    pub stability_limit: Option<f64>,
    /// What becomes of the energy of a rod without damping.
    pub energy: EnergyKept,
    /// The number in `[time]` that belongs to it. Schemes with one have a `time.tolerance` too.
    pub parameter: Option<SchemeParameter>,
}

/// What a scheme makes of the energy of a rod without damping.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnergyKept {
    /// Kept to rounding, whatever the step.
    Exactly,
    /// Swings about its value, without a drift as long as the step is stable.
    OnAverage,
    /// Falls with what the step does not resolve, and may grow at large steps.
    Roughly,
}

/// One row a scheme, in the order of the variants. A study tries them in this order, so that
/// explicit schemes of low order come before those of high order.
const TRAITS: [Traits; 6] = [
    Traits {
        scheme: Scheme::NewmarkBeta,
        name: "newmark-beta",
        order: 2,
        takes_viscosity: true,
        takes_friction: true,
        takes_drag: true,
        takes_boundary_motion: true,
        stability_limit: None,
        energy: EnergyKept::Roughly,
        parameter: Some(SchemeParameter::Beta),
    },
    Traits {
        scheme: Scheme::AverageVectorField,
        name: "average-vector-field",
        order: 2,
        takes_viscosity: true,
        takes_friction: false,
        takes_drag: false,
        takes_boundary_motion: true,
        stability_limit: None,
        energy: EnergyKept::Exactly,
        parameter: None,
    },
    Traits {
        scheme: Scheme::Rodas4,
        name: "rodas4",
        order: 4,
        takes_viscosity: false,
        takes_friction: false,
        takes_drag: false,
        takes_boundary_motion: false,
        stability_limit: None,
        energy: EnergyKept::Roughly,
        parameter: None,
    },
    Traits {
        scheme: Scheme::Verlet,
        name: "verlet",
        order: 2,
        takes_viscosity: false,
        takes_friction: false,
        takes_drag: false,
        takes_boundary_motion: false,
        stability_limit: Some(2.0),
        energy: EnergyKept::OnAverage,
        parameter: None,
    },
    Traits {
        scheme: Scheme::Pefrl,
        name: "pefrl",
        order: 4,
        takes_viscosity: false,
        takes_friction: false,
        takes_drag: false,
        takes_boundary_motion: false,
        stability_limit: Some(2.989),
        energy: EnergyKept::OnAverage,
        parameter: None,
    },
    Traits {
        scheme: Scheme::GeneralisedAlpha,
        name: "generalised-alpha",
        order: 2,
        takes_viscosity: true,
        takes_friction: true,
        takes_drag: true,
        takes_boundary_motion: true,
        stability_limit: None,
        energy: EnergyKept::Roughly,
        parameter: Some(SchemeParameter::RhoInf),
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
    /// Whether `time.beta` belongs to it.
    pub fn takes_beta(self) -> bool {
        self.traits().parameter == Some(SchemeParameter::Beta)
    }

    /// All schemes, explicit ones of low order before those of high order.
    pub fn all() -> impl Iterator<Item = Self> {
        TRAITS.iter().map(|traits| traits.scheme)
    }

    /// What it is like.
    pub const fn traits(self) -> &'static Traits {
        &TRAITS[self as usize]
    }

    /// The name in files and reports.
    pub fn name(self) -> &'static str {
        self.traits().name
    }

    /// The names of the schemes that are `so`, for messages: `a, b and c`.
    pub(crate) fn names(so: impl Fn(&Traits) -> bool) -> String {
        let names: Vec<_> = TRAITS.iter().filter(|traits| so(traits)).map(|t| t.name).collect();
        match &names[..] {
            [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
            names => names.concat(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names are those that files are read with.
    #[test]
    fn names_in_files() {
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
