//! Attachment of [user-defined energies](crate::energy::own) to a scene.

use crate::energy::adapter::{Adapter, AnyEnergy};
use crate::energy::own::OwnEnergy;
use crate::error::Error;
use crate::scene::own::{At, Attached, Code};
use crate::scene::{Scene, number::Quantity};
use std::any::Any;
use std::sync::Arc;

/// An energy in the form that a scene stores: the scene module does not depend on energies.
struct Kept(Arc<dyn AnyEnergy>);

impl Code for Kept {
    /// Names and quantities of its parameters.
    fn parameters(&self) -> &'static [(&'static str, Quantity)] {
        self.0.parameters()
    }
}

/// A user-defined energy behind a pointer, over all scalars that the rod needs.
fn code<E, const N: usize, const P: usize>(energy: E) -> Arc<dyn Code>
where
    E: OwnEnergy<N, P>,
{
    const { assert!(N >= 1 && N <= 3, "an energy is over one to three nodes") };
    Arc::new(Kept(Arc::new(Adapter(energy))))
}

/// The energy that is attached, if it has been given.
pub(crate) fn energy<D>(attached: &Attached<D>) -> Option<&Arc<dyn AnyEnergy>> {
    let code: &dyn Any = attached.code()?;
    code.downcast_ref::<Kept>().map(|kept| &kept.0)
}

impl Scene {
    /// The scene with an [energy of one's own](crate::energy::own) and the values of its parameters,
    /// in their order. Its numbers are those of the scene from now on, named
    /// `energy.<name>.<parameter>`.
    pub fn with_energy<E, const N: usize, const P: usize>(
        mut self,
        name: &str,
        at: At,
        energy: E,
        values: [f64; P],
    ) -> Self
    where
        E: OwnEnergy<N, P>,
    {
        self.energies.push(Attached::new(name, at, code(energy), &values));
        self
    }

    /// Gives an energy that the scene's file names its code; its place and its numbers are the
    /// file's. Parameters that the file does not name, and energies, are errors.
    pub fn give_energy<E, const N: usize, const P: usize>(
        &mut self,
        name: &str,
        energy: E,
    ) -> Result<(), Error>
    where
        E: OwnEnergy<N, P>,
    {
        let key = format!("energy.{name}");
        let names: Vec<&str> = self.energies.iter().map(Attached::name).collect();
        let Some(place) = names.iter().position(|other| *other == name) else {
            let allowed = format!("the energies of the file: {}", names.join(", "));
            return Err(Error::invalid(key, "no such energy", allowed));
        };
        let written = &self.energies[place];
        let known: Vec<&str> = E::PARAMETERS.iter().map(|(name, _)| *name).collect();
        if let Some((other, _)) = written.values().find(|(name, _)| !known.contains(name)) {
            let allowed = format!("the parameters of the energy: {}", known.join(", "));
            return Err(Error::invalid(key, format!("a parameter {other}"), allowed));
        }
        let mut values = [0.0; P];
        for (value, name) in values.iter_mut().zip(&known) {
            let there = written.values().find(|(other, _)| other == name);
            *value = *there.ok_or_else(|| Error::invalid(&key, "no value", *name))?.1;
        }
        self.energies[place] = Attached::new(name, written.at(), code(energy), &values);
        Ok(())
    }
}
