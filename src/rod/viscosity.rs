//! The viscous stress of a time step as a factor of every stiffness and a shift of every natural strain.
//!
//! A damped step is an elastic step with other laws: the stress of an element with the stiffness `K` is
//! `K (factor s - natural - shift)` at the strains `s`. Kinds of strain (stretching, bending, twisting) with additional
//! viscous times (s) add `K (own_factor s - time past)`, without the coupling of bending and twisting. Input:
//! coefficients of the step (by [`crate::dynamics::viscosity`]) or, at a known state, [`InternalVariables`] (`now`).
//! There the stresses of Maxwell branches and of internal friction are shifts too. Output: [`Viscosity`], and from it
//! the laws of all elements for the step (`set_laws`), or those of dashpots alone (`set_dashpots`). [`RodViscosity`] is
//! the part of one rod of several, whose viscous stress may have a factor.

use crate::energy::Law;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::components;
use crate::rod::InternalVariables;
use crate::scene::Damping;

/// The stress `K (factor s - natural - shift)` of strains `s` with the elastic stiffnesses `K`, and the parts of the
/// single kinds of strain.
#[derive(Clone, Debug)]
pub struct Viscosity<D> {
    /// Factor of every stiffness.
    pub factor: D,
    /// Shift of every natural strain.
    pub shift: Vec<D>,
    /// Part of the shifts that is elastic, not viscous; empty: none.
    pub elastic_shift: Vec<D>,
    /// Viscosities of the kinds of strain, if they differ.
    pub own: Option<OwnViscosity<D>>,
}

/// The additional stress `K (factor s - time past)` of stretching, bending and twisting. The coupling of bending and
/// twisting in a curved joint has no part in it, so that the stress dissipates energy in every motion.
#[derive(Clone, Debug)]
pub struct OwnViscosity<D> {
    /// The factor of each kind.
    pub factor: [D; 3],
    /// The time of each kind, s.
    pub time: [D; 3],
    /// Factor of a strain in its rate, 1/s.
    pub rate: D,
    /// The past rate of each strain, 1/s.
    pub past: Vec<D>,
}

impl<D: Scalar> Viscosity<D> {
    /// Factor 1 and zero shifts: no viscous stress, for `strains` strains. `apart`: whether stretching, bending and
    /// twisting may have additional times; their factors and times are then zero.
    pub fn none(strains: usize, apart: bool) -> Self {
        let zero = D::from(0.0);
        let past = vec![zero; strains];
        Self {
            factor: D::from(1.0),
            shift: past.clone(),
            elastic_shift: Vec::new(),
            own: apart.then_some(OwnViscosity {
                factor: [zero; 3],
                time: [zero; 3],
                rate: zero,
                past,
            }),
        }
    }

    /// Overwrites factor and shifts with the stress at a known state, of the variables `internal`. The factor is 1; a
    /// shift is minus the Kelvin-Voigt time times the strain rate, less the relative stiffness times the stretch of
    /// Maxwell and friction springs. Kinds with additional times get these times, the factor 0, and minus the strain
    /// rates as `past`.
    pub fn now(&mut self, damping: &Damping<D>, internal: &InternalVariables<D>) {
        let InternalVariables { strain_rate, slid, .. } = internal;
        self.factor = D::from(1.0);
        self.elastic_shift.clear();
        for (shift, rate) in self.shift.iter_mut().zip(strain_rate) {
            *shift = -(damping.stiffness * *rate);
        }
        for (branch, stretches) in damping.maxwell.as_slice().iter().zip(internal.branches()) {
            for (shift, stretched) in self.shift.iter_mut().zip(stretches) {
                *shift -= branch.stiffness * *stretched;
            }
        }
        if let Some(friction) = &damping.friction {
            // Springs act on the strains of bending and twisting, which come last.
            let first = self.shift.len() - slid.len();
            for (shift, stretched) in self.shift[first..].iter_mut().zip(slid) {
                *shift -= friction.stiffness * *stretched;
            }
        }
        if let Some(own) = &mut self.own {
            (own.factor, own.time) = ([D::from(0.0); 3], damping.additional_times());
            own.rate = D::from(0.0);
            own.past.iter_mut().zip(strain_rate).for_each(|(past, rate)| *past = -*rate);
        }
    }

    /// The stress of the one rod whose strains are those of the lists.
    pub(super) fn of_single_rod(&self) -> RodViscosity<'_, D> {
        RodViscosity { all: self, first: 0, scale: None }
    }
}

/// The viscous stress of one rod of several.
#[derive(Clone, Copy, Debug)]
pub struct RodViscosity<'a, D> {
    /// The stress of all rods.
    pub all: &'a Viscosity<D>,
    /// Index of the first strain of the rod in the lists.
    pub first: usize,
    /// Factor on the viscous stress of the rod; `None` is one.
    pub scale: Option<D>,
}

impl<D: Scalar> RodViscosity<'_, D> {
    /// The factor of every stiffness: elastic part 1, and the viscous part times `scale`.
    fn factor(&self) -> D {
        self.scale.map_or(self.all.factor, |scale| (self.all.factor - 1.0) * scale + 1.0)
    }

    /// A viscous number `x` times `scale`.
    #[inline(always)]
    fn scaled(&self, x: D) -> D {
        self.scale.map_or(x, |scale| x * scale)
    }

    /// Shifts of `S` natural strains from index `first` of the lists on: the viscous part times `scale`.
    fn scaled_shifts<const S: usize>(&self, first: usize, scale: D) -> [D; S] {
        components(|c| {
            let shift = self.all.shift[first + c];
            match self.all.elastic_shift.get(first + c) {
                Some(elastic) => (shift - *elastic) * scale + *elastic,
                None => shift * scale,
            }
        })
    }

    /// Overwrites the first `elastic.len()` of `laws` with the `elastic` ones under this stress: changed stiffnesses
    /// and natural strains, with the stress `K (factor s - natural - shift)` plus that of kinds with additional times.
    /// The strains of the first law are at index `skipped` of those of the rod.
    pub(super) fn set_laws<W: Law<D, S>, const S: usize>(
        &self,
        elastic: &[W],
        laws: &mut [W],
        skipped: usize,
    ) {
        let (from, to) = (elastic, &mut laws[..elastic.len()]);
        let (first, factor) = (self.first + skipped, self.factor());
        let shift = &self.all.shift[first..].as_chunks::<S>().0[..from.len()];
        let shift = |i: usize| match self.scale {
            Some(scale) => self.scaled_shifts(first + S * i, scale),
            None => shift[i],
        };
        let Some(own) = &self.all.own else {
            for i in 0..from.len() {
                // Only stiffness and natural strains differ: less to copy than the whole law.
                let law = from[i].viscous(factor, &shift(i));
                to[i].set(law.stiffness(), law.natural());
            }
            return;
        };
        let past = &own.past[first..].as_chunks::<S>().0[..from.len()];
        let (kinds, times) = (own.factor.map(|x| self.scaled(x)), own.time.map(|x| self.scaled(x)));
        for i in 0..from.len() {
            // Each strain of a joint has the time of its kind, bending or twisting.
            let past = components(|c| times[W::KINDS[c]] * past[i][c]);
            to[i] = from[i].viscous_by_kind(factor, &shift(i), &kinds, &past);
        }
    }

    /// Overwrites `laws` with `dashpots` whose stiffnesses are multiplied by the factor of each kind (common plus
    /// additional one), that of the coupling by the common one. Natural strains are the shifts; those of the first law
    /// are at index `skipped` of those of the rod.
    pub(super) fn set_dashpots<W: Law<D, S>, const S: usize>(
        &self,
        dashpots: &[W],
        laws: &mut [W],
        skipped: usize,
    ) {
        let own = self.all.own.as_ref().map_or([D::from(0.0); 3], |own| own.factor);
        let kinds = own.map(|own| self.scaled(self.all.factor + own));
        let coupling = self.scaled(self.all.factor);
        let shift = self.all.shift[self.first + skipped..].as_chunks::<S>().0;
        for (to, (from, shift)) in laws.iter_mut().zip(dashpots.iter().zip(shift)) {
            *to = from.dashpot(coupling, &kinds, *shift);
        }
    }
}
