//! Names of modes: a number, and a filter of the modes among which it counts. Measured frequencies name their modes
//! by these.
//!
//! A filter has a plane (in or out of the plane of a planar scene), a kind and a direction. Modes pass a direction with
//! more than half of their kinetic energy along it. Without a plane, torsion and directions within 45 degrees of the
//! normal are out of the plane of a planar scene, all others in it; modes in space have no plane. Modes are counted
//! from 1 on in ascending order of frequency; free rigid motions are not counted. A name also states whether its
//! frequency is that of a slender rod, or of Timoshenko's beam.
//!
//! Rejected (`check`) are a zero or infinite direction, a plane in space, torsion in the plane, axial modes out of it,
//! and modes out of it without torsional stiffness or with moments. Timoshenko's beam excludes torsion and axial modes,
//! and requires Poisson's ratio or a shear modulus.

use crate::error::Error;
use crate::numerics::vector::dot;
use crate::problem::Problem;
use crate::vibration::mode::{ModeKind, ModePlane};
use crate::vibration::modes::Eigenpair;

/// The modes among which a number counts. The default is, in a planar scene, the modes in its plane, and in a spatial
/// scene all modes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModeFilter {
    /// Only modes in the plane of a planar scene, or only those out of it.
    pub plane: Option<ModePlane>,
    /// Only modes of this kind.
    pub kind: Option<ModeKind>,
    /// Only modes with more than half of their kinetic energy along this direction.
    pub direction: Option<[f64; 3]>,
}

/// A mode by its number in ascending order of frequencies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeName {
    /// The number, from 1 on; free motions are not counted.
    pub number: usize,
    /// The modes that are counted.
    pub among: ModeFilter,
    /// Whether the frequency of a bending mode includes shear deformation and rotary inertia.
    pub timoshenko: bool,
}

impl ModeName {
    /// The mode with this number, from 1 on, among those of a filter: of a slender rod, without shear deformation and
    /// rotary inertia.
    pub fn new(number: usize, among: ModeFilter) -> Self {
        Self { number, among, timoshenko: false }
    }

    /// Rejects modes that the problem cannot have; `key` names the table in messages. See [`ModeFilter::check`]. With
    /// `timoshenko` these are also filters for torsion or axial modes, and scenes without Poisson's ratio or shear
    /// modulus.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the key, the value and the allowed values.
    pub(crate) fn check(&self, problem: &Problem, key: &str) -> Result<(), Error> {
        self.among.check(problem, key)?;
        if !self.timoshenko {
            return Ok(());
        }
        let key = format!("{key}.timoshenko");
        if let Some(kind @ (ModeKind::Torsion | ModeKind::Axial)) = self.among.kind {
            let found = format!("true, with kind = \"{}\"", kind.name());
            return Err(Error::invalid(key, found, "bending modes"));
        }
        let material = &problem.scene().material;
        if material.poisson_ratio.is_none() && material.shear_modulus.is_none() {
            let found = "true, in a scene without Poisson's ratio";
            let allowed = "poisson_ratio or shear_modulus in [material], on which shear depends";
            return Err(Error::invalid(key, found, allowed));
        }
        Ok(())
    }
}

impl From<usize> for ModeName {
    /// The mode with this number, from 1 on, among those of the default filter: in a planar scene the modes in its
    /// plane, in a spatial one all.
    fn from(number: usize) -> Self {
        Self::new(number, ModeFilter::default())
    }
}

impl From<&ModeName> for ModeName {
    /// A copy of the name.
    fn from(name: &ModeName) -> Self {
        *name
    }
}

impl From<&usize> for ModeName {
    /// The mode with this number, from 1 on, among those of the default filter: in a planar scene the modes in its
    /// plane, in a spatial one all.
    fn from(number: &usize) -> Self {
        Self::from(*number)
    }
}

impl ModeFilter {
    /// The plane of these modes in a planar problem. It is the stated one; else out of the plane for torsion, or for a
    /// direction within 45 degrees of the normal; else in it. `None` in a spatial problem.
    pub(crate) fn plane_of(&self, problem: &Problem) -> Option<ModePlane> {
        problem.planar()?;
        let across = self.direction.is_some_and(|d| {
            let along = dot(problem.normal(), d);
            along * along > 0.5 * dot(d, d)
        });
        let out = across || self.kind == Some(ModeKind::Torsion);
        Some(self.plane.unwrap_or(if out { ModePlane::Out } else { ModePlane::In }))
    }

    /// Whether a mode passes the filter of kind and direction; free rigid motions never do. `mass` returns the mass
    /// of a node, kg, for the kinetic energy, of which more than half must be along the direction. The plane is not
    /// tested: modes in and out of it are computed separately.
    pub(crate) fn includes(&self, pair: &Eigenpair, mass: impl Fn(usize) -> f64) -> bool {
        let along = |d: [f64; 3]| {
            let energy = |x: &[f64; 3]| [dot(*x, d).powi(2) / dot(d, d), dot(*x, *x)];
            let sums = pair.shape.iter().enumerate().fold([0.0; 2], |sums, (i, x)| {
                let [along, all] = energy(x);
                [sums[0] + mass(i) * along, sums[1] + mass(i) * all]
            });
            sums[0] > 0.5 * sums[1]
        };
        !pair.is_free()
            && self.kind.is_none_or(|kind| kind == pair.kind)
            && self.direction.is_none_or(along)
    }

    /// Rejects filters that no mode of the problem passes; `key` names the table in messages. These are a zero or
    /// infinite direction, a plane in a spatial scene, torsion in the plane, and axial modes out of it. Modes out of
    /// the plane are also rejected without a shear modulus or Poisson's ratio, and with moments.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the key, the value and the allowed values.
    pub(crate) fn check(&self, problem: &Problem, key: &str) -> Result<(), Error> {
        if let Some(d) = self.direction
            && !(d.iter().all(|d| d.is_finite()) && dot(d, d).is_normal())
        {
            let allowed = "three numbers, not all zero";
            return Err(Error::invalid(format!("{key}.direction"), format!("{d:?}"), allowed));
        }
        if self.plane.is_some() && problem.planar().is_none() {
            let allowed = "kind or direction, as the modes of a spatial scene have no plane";
            return Err(Error::invalid(format!("{key}.plane"), "a plane", allowed));
        }
        // Torsion in the plane and stretching out of it do not occur in a planar rod.
        let plane = self.plane_of(problem);
        let impossible = match (plane, self.kind) {
            (Some(ModePlane::In), Some(ModeKind::Torsion)) => Some("bending or axial in the plane"),
            (Some(ModePlane::Out), Some(ModeKind::Axial)) => {
                Some("bending or torsion out of the plane")
            }
            _ => None,
        };
        if let (Some(allowed), Some(kind)) = (impossible, self.kind) {
            return Err(Error::invalid(format!("{key}.kind"), kind.name(), allowed));
        }
        // Motions out of the plane need a torsional stiffness.
        if plane == Some(ModePlane::Out) && !problem.can_twist() {
            let found = "modes out of the plane of a scene without poisson_ratio or shear_modulus, \
                         or with moments";
            let allowed = "modes in the plane. Give poisson_ratio or shear_modulus in [material] \
                           for other modes";
            return Err(Error::invalid(key, found, allowed));
        }
        Ok(())
    }

    /// The filter as text to be appended to a number, such as ` of torsion out of the plane`: kind, plane and
    /// direction, with a leading space; empty without conditions.
    pub(crate) fn words(&self) -> String {
        let plane = match self.plane {
            Some(ModePlane::In) => " in the plane",
            Some(ModePlane::Out) => " out of the plane",
            None => "",
        };
        let kind = self.kind.map(|kind| format!(" of {}", kind.name())).unwrap_or_default();
        let along = self.direction.map(|d| format!(" along {d:?}")).unwrap_or_default();
        format!("{kind}{plane}{along}")
    }
}
