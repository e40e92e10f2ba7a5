//! The linear law of a joint: one strain of bending in the plane, two of bending and one of twisting in space.

use crate::energy::bend_twist::JointLaw;
use crate::energy::{PlanarBend, Sliders, Stiffness};
use crate::numerics::scalar::Scalar;
use crate::rod::{OwnViscosity, Viscosity};
use std::fmt::Debug;

/// A joint whose stresses are linear in its `S` strains: `K (s - natural)`, N m.
pub trait LinearJoint<D: Scalar, const S: usize>: Copy + Debug + Send + Sync {
    /// `K`, N m.
    type Stiffness: Copy + Debug + Send + Sync;

    /// `K`, N m.
    fn stiffness(&self) -> Self::Stiffness;

    /// Replaces the natural strains.
    fn set_natural(&mut self, natural: [D; S]);

    /// Energies of bending and of twisting by `strains`, natural ones taken as zero, J. The energy of a coupling
    /// between them counts half for each.
    fn strain_energies(&self, strains: &[D; S]) -> [D; 2];

    /// The joint with the stress `K (factor s - natural - shift)`, and with the viscosity of each kind of strain, where
    /// `past` are the rates of the joint's own strains.
    fn viscous(&self, factor: D, shift: &[D; S], own: Option<(&OwnViscosity<D>, &[D; S])>) -> Self;

    /// The joint with every stiffness times the factor of its kind, and these natural strains.
    fn dashpot(&self, viscosity: &Viscosity<D>, natural: [D; S]) -> Self;

    /// The stretch of the springs of internal friction of joint `i`, which would be `z` without slip.
    fn slid(&self, sliders: &Sliders<D>, i: usize, z: [D; S]) -> [D; S];

    /// The distance of that stretch from the limit at which the springs begin to slip.
    fn distance_to_slipping(&self, sliders: &Sliders<D>, i: usize, z: [D; S]) -> f64;

    /// Energy of the springs at the stretch `z`, J.
    fn spring_energy(&self, sliders: &Sliders<D>, z: [D; S]) -> D;
}

impl<D: Scalar> LinearJoint<D, 1> for PlanarBend<D> {
    type Stiffness = D;

    fn stiffness(&self) -> D {
        self.stiffness
    }

    fn set_natural(&mut self, [natural]: [D; 1]) {
        self.natural_curvature = natural;
    }

    fn strain_energies(&self, [k]: &[D; 1]) -> [D; 2] {
        [self.stiffness * *k * *k * 0.5, D::from(0.0)]
    }

    #[inline(always)]
    fn viscous(&self, factor: D, shift: &[D; 1], own: Option<(&OwnViscosity<D>, &[D; 1])>) -> Self {
        match own {
            None => PlanarBend::viscous(self, factor, shift[0]),
            Some((own, past)) => {
                let shift = shift[0] + own.time[1] * past[0];
                PlanarBend::viscous(self, factor + own.factor[1], shift)
            }
        }
    }

    fn dashpot(&self, viscosity: &Viscosity<D>, [natural]: [D; 1]) -> Self {
        Self { stiffness: self.stiffness * viscosity.factor(1), natural_curvature: natural }
    }

    fn slid(&self, sliders: &Sliders<D>, i: usize, [z]: [D; 1]) -> [D; 1] {
        [sliders.slid(i, z)]
    }

    fn distance_to_slipping(&self, sliders: &Sliders<D>, i: usize, [z]: [D; 1]) -> f64 {
        sliders.from_limit(i, z)
    }

    fn spring_energy(&self, sliders: &Sliders<D>, [z]: [D; 1]) -> D {
        z * z * self.stiffness * sliders.stiffness * 0.5
    }
}

impl<D: Scalar> LinearJoint<D, 3> for JointLaw<D> {
    type Stiffness = Stiffness<D>;

    fn stiffness(&self) -> Stiffness<D> {
        self.stiffness
    }

    fn set_natural(&mut self, natural: [D; 3]) {
        self.natural = natural;
    }

    fn strain_energies(&self, s: &[D; 3]) -> [D; 2] {
        let stress = self.stiffness.times(s);
        [(stress[0] * s[0] + stress[1] * s[1]) * 0.5, stress[2] * s[2] * 0.5]
    }

    #[inline(always)]
    fn viscous(&self, factor: D, shift: &[D; 3], own: Option<(&OwnViscosity<D>, &[D; 3])>) -> Self {
        match own {
            None => JointLaw::viscous(self, factor, shift),
            Some((own, past)) => {
                let ([_, bend, twist], [_, bending, twisting]) = (own.factor, own.time);
                let past = [bending * past[0], bending * past[1], twisting * past[2]];
                self.viscous_apart(factor, shift, ([bend, twist], &past))
            }
        }
    }

    fn dashpot(&self, viscosity: &Viscosity<D>, natural: [D; 3]) -> Self {
        let [bend, twist] = [1, 2].map(|kind| viscosity.factor(kind));
        Self { stiffness: self.stiffness.by_kind(viscosity.factor, [bend, twist]), natural }
    }

    fn slid(&self, sliders: &Sliders<D>, i: usize, z: [D; 3]) -> [D; 3] {
        sliders.slid_in_space(i, &self.stiffness, z)
    }

    fn distance_to_slipping(&self, sliders: &Sliders<D>, i: usize, z: [D; 3]) -> f64 {
        sliders.from_limit_in_space(i, &self.stiffness, z)
    }

    fn spring_energy(&self, sliders: &Sliders<D>, z: [D; 3]) -> D {
        sliders.energy(&self.stiffness, z)
    }
}
