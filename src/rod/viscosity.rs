//! Viscous stress as a rod is told of it: for a step it is a matter of stiffnesses and natural strains. Where the
//! rod is known, the stress of relaxing springs and of those of internal friction is a shift too.

use crate::numerics::scalar::Scalar;
use crate::rod::InternalVariables;
use crate::scene::Damping;

/// The stress of strains `s`, `K (factor s - natural - shift)`, with the elastic stiffnesses `K`; and what
/// strains of one kind have beside the others.
#[derive(Clone, Debug)]
pub struct Viscosity<D> {
    /// Factor of every stiffness.
    pub factor: D,
    /// Shift of every natural strain.
    pub shift: Vec<D>,
    /// What is different from kind to kind, if anything.
    pub own: Option<OwnViscosity<D>>,
}

/// Of stretching, bending and twisting, `K (factor s - time past)` besides. What couples bending and twisting in a
/// bent joint has no time of its own: so the stress of any motion takes energy.
#[derive(Clone, Debug)]
pub struct OwnViscosity<D> {
    /// Of every kind.
    pub factor: [D; 3],
    /// Of every kind, s.
    pub time: [D; 3],
    /// Of every strain, 1/s.
    pub past: Vec<D>,
}

impl<D: Scalar> Viscosity<D> {
    /// Of no stress, for so many strains; `apart` if kinds of them may differ.
    pub fn none(strains: usize, apart: bool) -> Self {
        let zero = D::from(0.0);
        let past = vec![zero; strains];
        Self {
            factor: D::from(1.0),
            shift: past.clone(),
            own: apart.then_some(OwnViscosity { factor: [zero; 3], time: [zero; 3], past }),
        }
    }

    /// The stress of a rod in motion.
    pub fn now(&mut self, damping: &Damping<D>, internal: &InternalVariables<D>) {
        let InternalVariables { strain_rate, relaxing, slid, .. } = internal;
        self.factor = D::from(1.0);
        for (shift, rate) in self.shift.iter_mut().zip(strain_rate) {
            *shift = -(damping.stiffness * *rate);
        }
        if let Some(maxwell) = &damping.maxwell {
            for (shift, stretched) in self.shift.iter_mut().zip(relaxing) {
                *shift -= maxwell.stiffness * *stretched;
            }
        }
        if let Some(friction) = &damping.friction {
            // Springs take up strains of bending and twisting, the last ones.
            let first = self.shift.len() - slid.len();
            for (shift, stretched) in self.shift[first..].iter_mut().zip(slid) {
                *shift -= friction.stiffness * *stretched;
            }
        }
        if let Some(own) = &mut self.own {
            (own.factor, own.time) = ([D::from(0.0); 3], damping.own_times());
            own.past.iter_mut().zip(strain_rate).for_each(|(past, rate)| *past = -*rate);
        }
    }

    /// The factor for strains of one kind.
    pub fn factor(&self, kind: usize) -> D {
        self.own.as_ref().map_or(self.factor, |own| self.factor + own.factor[kind])
    }
}
