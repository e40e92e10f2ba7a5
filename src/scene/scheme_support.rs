//! Terms of a scene that an integration scheme does not support.
//!
//! `unsupported_by` compares a scene with the [`Traits`] of a scheme. Output is a list of terms, each with its key, its
//! found value, and text with the schemes that support it; it is empty if the scheme supports the scene. Order: the
//! first Kelvin-Voigt time above zero, internal friction, Maxwell branches, drag, contacts (one term), friction or
//! damping of each contact, the first moved obstacle, and moving supports. Then follow the first signal with kinks or
//! jumps that is used, the first actuator with a signal, and the first follower load with a signal.
//! `or_energy_conserving_scheme` is the advice to take `average-vector-field` for a scene that it supports.

use crate::scene::Scene;
use crate::scene::scheme::{Scheme, Traits};

impl Scene {
    /// Whether a scheme supports all terms of the scene: damping, friction, drag, contacts, moving supports, signals,
    /// and actuators and follower loads with a signal.
    pub(crate) fn is_supported_by(&self, scheme: Scheme) -> bool {
        self.unsupported_by(scheme).is_empty()
    }

    /// The advice to take the scheme that conserves the energy, as the end of a sentence that gives another advice.
    /// Empty where that scheme does not support the scene, or is its own.
    pub(crate) fn or_energy_conserving_scheme(&self) -> &'static str {
        let own = self.time.as_ref().map(|time| time.scheme);
        match own != Some(Scheme::AverageVectorField)
            && self.is_supported_by(Scheme::AverageVectorField)
        {
            true => " or scheme = \"average-vector-field\"",
            false => "",
        }
    }

    /// Terms of the scene that a scheme does not support, each with key, found value and the schemes that support it;
    /// empty if it supports all. Order: the first Kelvin-Voigt time above zero, internal friction, Maxwell branches,
    /// drag, contacts (one term), friction or damping of each contact, the first moved obstacle, and moving supports.
    /// Then follow the first used signal that is not smooth, the first actuator with a signal, and the first follower
    /// load with a signal.
    pub(super) fn unsupported_by(&self, scheme: Scheme) -> Vec<UnsupportedTerm> {
        let (damping, traits) = (&self.loads.damping, scheme.traits());
        let mut unsupported = Vec::new();
        let mut add = |key: &str, found: String, supports: fn(&Traits) -> bool| {
            let allowed = format!("with the schemes {}", Scheme::names(supports));
            unsupported.push(UnsupportedTerm { key: key.into(), found, allowed });
        };
        let beside = |term: &str| format!("{term} with the scheme {}", traits.name);
        // Friction and Maxwell branches both need internal variables.
        if !traits.takes_friction {
            if damping.friction.is_some() {
                add("loads.damping.friction", beside("friction"), |traits| traits.takes_friction);
            }
            if !damping.maxwell.is_empty() {
                add("loads.damping.maxwell", beside("maxwell"), |traits| traits.takes_friction);
            }
            if damping.power_law.is_some() {
                let key = "loads.damping.power_law";
                add(key, beside("power_law"), |traits| traits.takes_friction);
            }
        }
        if !traits.takes_drag && self.loads.drag.is_some() {
            add("loads.drag", beside("drag"), |traits| traits.takes_drag);
        }
        if !traits.takes_contacts && !self.contacts.is_empty() {
            add("contacts", beside("contacts"), |traits| traits.takes_contacts);
        }
        let losses = self.contacts.iter().map(|contact| contact.loss().is_some());
        for (i, _) in losses.enumerate().filter(|(_, has_loss)| *has_loss && !traits.takes_drag) {
            let name = if self.contacts[i].has_friction() { "friction" } else { "damping" };
            let key = format!("contacts[{i}].{name}");
            add(&key, beside(name), |traits| traits.takes_drag && traits.takes_contacts);
        }
        let moved = self.contacts.iter().position(|contact| !contact.motions().is_empty());
        if let (false, Some(i)) = (traits.takes_drag, moved) {
            let takers = |traits: &Traits| traits.takes_drag && traits.takes_contacts;
            add(&format!("contacts[{i}].motion"), beside("a moved obstacle"), takers);
        }
        if !traits.takes_boundary_motion && self.supports.move_ends() {
            let is_recorded = self.supports.path.is_some();
            let key = if is_recorded { "supports.path" } else { "supports.motion" };
            add(key, beside("a motion"), |traits| traits.takes_boundary_motion);
        }
        if let (false, Some(signal)) =
            (traits.takes_rough_signals, self.used_signals().find(|signal| !signal.is_smooth()))
        {
            let key = format!("signals.{}", signal.name);
            let found = beside("a signal with kinks or jumps");
            let takers = Scheme::names(|traits| traits.takes_rough_signals);
            let allowed = format!(
                "a sine or a file with interpolation = \"cubic\"; the schemes {takers} take it"
            );
            unsupported.push(UnsupportedTerm { key, found, allowed });
        }
        let timed = self.actuation.iter().position(|actuator| actuator.signal().is_some());
        if let (false, Some(i)) = (traits.takes_timed_actuation, timed) {
            let name = if self.actuation[i].is_tendon() { "tension" } else { "signal" };
            let key = format!("actuation[{i}].{name}");
            let found = beside("a signal");
            let takers = Scheme::names(|traits| traits.takes_timed_actuation);
            let allowed = format!("a constant; the schemes {takers} take signals");
            unsupported.push(UnsupportedTerm { key, found, allowed });
        }
        let points = self.loads.point.iter().enumerate().map(|(k, load)| {
            (format!("loads.point[{k}].signal"), load.follower && load.signal.is_some())
        });
        let lines = self.loads.line.iter().enumerate().map(|(k, load)| {
            (format!("loads.line[{k}].signal"), load.follower && load.signal.is_some())
        });
        let timed = points.chain(lines).find(|(_, timed)| *timed);
        if let (false, Some((key, _))) = (traits.takes_timed_actuation, timed) {
            let found = beside("a signal of a follower load");
            let takers = Scheme::names(|traits| traits.takes_timed_actuation);
            let allowed = format!("a constant; the schemes {takers} take signals");
            unsupported.push(UnsupportedTerm { key, found, allowed });
        }
        // Viscosity becomes the first term, which validation reports.
        let time = damping.times().into_iter().find(|(_, time)| *time > 0.0);
        if let Some((key, time)) = time.filter(|_| !traits.takes_viscosity) {
            let takers = Scheme::names(|traits| traits.takes_viscosity);
            let allowed = format!("0 with {}; the schemes {takers} take it", traits.name);
            let key = format!("loads.damping.{key}");
            unsupported.insert(0, UnsupportedTerm { key, found: time.to_string(), allowed });
        }
        unsupported
    }
}

/// Term of the equation of motion that a scheme does not support.
pub(super) struct UnsupportedTerm {
    /// Key of the term in the scene.
    pub key: String,
    /// Value of the key.
    pub found: String,
    /// Schemes that support it.
    pub allowed: String,
}
