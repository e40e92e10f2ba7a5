//! Attachment of [user-defined energies](crate::energy::own) (Rust code) to a scene.
//!
//! `Scene::with_energy` adds an energy over one to three nodes with its name, its place and the values of its
//! parameters, which become numbers `energy.<name>.<parameter>` of the scene. `Scene::give_energy` supplies the code of
//! an energy that the scene file names, with place and values of the file. There an unknown name, a parameter that the
//! code does not have, or a missing value is an error. Code is stored behind the trait `Code`, because the module
//! `scene` must not import from `energy`. `energy()` returns it as [`AnyEnergy`] where a rod is built from the scene
//! (`problem::own`); `None` if its code has not been given.

use crate::energy::adapter::{Adapter, AnyEnergy};
use crate::energy::own::OwnEnergy;
use crate::error::Error;
use crate::scene::own::{At, Attached, Code};
use crate::scene::{Scene, number::Quantity};
use std::any::Any;
use std::sync::Arc;

/// An energy in the form that a scene stores: the scene module does not depend on energies.
struct SceneEnergy(Arc<dyn AnyEnergy>);

impl Code for SceneEnergy {
    /// Names and quantities (unit, allowed range) of the parameters of the energy.
    fn parameters(&self) -> &'static [(&'static str, Quantity)] {
        self.0.parameters()
    }
}

/// The energy as code that a scene stores, compiled for all scalars of the rod. An energy over no node, or over more
/// than three nodes, does not compile.
fn code<E, const N: usize, const P: usize>(energy: E) -> Arc<dyn Code>
where
    E: OwnEnergy<N, P>,
{
    const { assert!(N >= 1 && N <= 3, "an energy is over one to three nodes") };
    Arc::new(SceneEnergy(Arc::new(Adapter(energy))))
}

/// The user-defined energy of `attached`, an entry of the scene's energies; `None` if its code has not been given.
pub(crate) fn energy<D>(attached: &Attached<D>) -> Option<&Arc<dyn AnyEnergy>> {
    let code: &dyn Any = attached.code()?;
    code.downcast_ref::<SceneEnergy>().map(|kept| &kept.0)
}

impl Scene {
    /// The scene with a [user-defined energy](crate::energy::own) added at the places `at`, with the `values` of its
    /// parameters in their order. These become numbers of the scene, named `energy.<name>.<parameter>`. An existing
    /// energy of this name stays too.
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

    /// Supplies the code of the energy `name` of the scene file; its place and the values of its parameters are those
    /// of the file. Replaces code that was given before.
    ///
    /// # Errors
    ///
    /// The file has no energy of this name, has an unknown parameter of the energy, or no value of one of its
    /// parameters.
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
        // All parameters of the file must be those of the code, and each must have a value.
        let written = &self.energies[place];
        let known: Vec<&str> = E::PARAMETERS.iter().map(|(name, _)| *name).collect();
        if let Some((other, _)) = written.values().find(|(name, _)| !known.contains(name)) {
            let allowed = format!("the parameters of the energy: {}", known.join(", "));
            return Err(Error::invalid(key, format!("a parameter {other}"), allowed));
        }
        // The file may list the values in any order; the code has its own.
        let mut values = [0.0; P];
        for (value, name) in values.iter_mut().zip(&known) {
            let there = written.values().find(|(other, _)| other == name);
            *value = *there.ok_or_else(|| Error::invalid(&key, "no value", *name))?.1;
        }
        self.energies[place] = Attached::new(name, written.at(), code(energy), &values);
        Ok(())
    }
}
