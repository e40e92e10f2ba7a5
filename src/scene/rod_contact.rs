//! `[[rod_contacts]]`: contact of the rods of a structure with each other, and of each rod with itself.
//!
//! [`RodContactLaw`] names rods (by default all), the stiffness of the contact (force per length over the square of the
//! overlap, N/m^3) and the radius of the rods in it, m; both have defaults from the rods. Damping, friction and slip
//! velocity are those of [`contact`](crate::scene::contact) (`loss`, `None` without damping and friction). `applies_to`
//! returns whether a rod is among those that it names. `check_rod_contacts` rejects, with the key, invalid numbers,
//! unknown and repeated names, and rods without a radius.

use crate::error::{Error, ensure};
use crate::numerics::scalar::Scalar;
use crate::scene::contact::{ContactLoss, DAMPING, FRICTION, RADIUS, SLIP_VELOCITY, STIFFNESS};
use crate::scene::section::Section;
use crate::scene::table::{NumberTree, TABLE, table};

table! {
    /// `[[rod_contacts]]`: contact of rods with each other, and of each with itself.
    pub struct RodContactLaw {
        /// Names of the rods; default: all.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub rods: Vec<String>,
        /// Force per length over the square of the overlap, N/m^3; default: by the weights and bending stiffnesses of
        /// the rods.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub stiffness: Option<D> = STIFFNESS,
        /// Radius of the rods in contact, m; default: the outer radius of the section of each.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub contact_radius: Option<D> = RADIUS,
        /// Damping, s/m: the normal force is multiplied by one plus this number times the speed of approach;
        /// default: zero.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub damping: Option<D> = DAMPING,
        /// Friction coefficient of Coulomb's law; default: zero.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub friction: Option<D> = FRICTION,
        /// Speed from which on friction is that of Coulomb's law, m/s; default: 1 mm/s.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub slip_velocity: Option<D> = SLIP_VELOCITY,
    }
}

impl<D> RodContactLaw<D> {
    /// Whether the rod of this name may touch others.
    pub(crate) fn applies_to(&self, name: &str) -> bool {
        self.rods.is_empty() || self.rods.iter().any(|own| own == name)
    }
}

impl<D: Scalar> RodContactLaw<D> {
    /// Radius, m, of a rod of this section in the contact: that of the contact, or the outer one of the section. `None`
    /// for a section without a radius where the contact gives none.
    pub(crate) fn radius_of(&self, section: &Section<D>) -> Option<D> {
        self.contact_radius.or(section.outer_radius())
    }

    /// The numbers of the forces that depend on the velocity, with their defaults; `None` if the scene gives neither
    /// damping nor friction.
    pub(crate) fn loss(&self) -> Option<ContactLoss<D>> {
        ContactLoss::from_given([self.damping, self.friction, self.slip_velocity])
    }

    /// Whether the contact has a friction coefficient above zero.
    pub(crate) fn has_friction(&self) -> bool {
        self.friction.is_some_and(|friction| friction.value() > 0.0)
    }

    /// Whether the contact has damping or friction above zero.
    pub(crate) fn is_dissipative(&self) -> bool {
        self.has_friction() || self.damping.is_some_and(|damping| damping.value() > 0.0)
    }
}

/// Rejects the first contact with invalid numbers, unknown or repeated names, or a rod without a radius. The rods have
/// these `names` and `sections`, in the same order.
pub(super) fn check_rod_contacts(
    contacts: &[RodContactLaw],
    names: &[&str],
    sections: &[&Section],
) -> Result<(), Error> {
    for (i, contact) in contacts.iter().enumerate() {
        let key = format!("rod_contacts[{i}]");
        contact.check_numbers(&key, TABLE)?;
        for (k, name) in contact.rods.iter().enumerate() {
            let key = format!("{key}.rods[{k}]");
            let allowed = format!("the name of a rod: {}", names.join(", "));
            ensure(names.contains(&&**name), &key, format!("\"{name}\""), allowed)?;
            let is_new = !contact.rods[..k].contains(name);
            ensure(is_new, key, format!("\"{name}\" twice"), "each rod once")?;
        }
        let rods = names.iter().zip(sections);
        for (name, section) in rods.filter(|(name, _)| contact.applies_to(name)) {
            let allowed = format!("a radius, m, as the section of rods.{name} has none");
            let has_radius = contact.radius_of(section).is_some();
            ensure(has_radius, format!("{key}.contact_radius"), "no value", allowed)?;
        }
    }
    Ok(())
}
