//! Transposed derivatives of the forces of a [`DiscreteRod`], for the adjoint method: the implementation of
//! [`Transposed`].
//!
//! Input: derivatives `d` of a misfit by the forces on the unknowns, or `w = B d` by the stresses of the elements. `B`
//! are the derivatives of the strains by the unknowns. Output ([`LawDerivatives`]): derivatives of the misfit by the
//! stiffness and natural stress of each law, by rest lengths, dead loads and constant moments. Their product with the
//! forward rates of one parameter (`along`) is the derivative of the misfit along that parameter. User-defined energies
//! and contacts have no part.

use crate::energy::Law;
use crate::energy::law::{BendingSlopes, LawSlopes, NonlinearPart, Symmetric};
use crate::numerics::directions::Directions;
use crate::rod::discrete::DiscreteRod;
use crate::rod::discrete::rates::{RateLayout, Rates};
use crate::rod::moments;
use crate::rod::transposed::{LawDerivatives, StressInputs, Transposed};
use num_dual::Dual64;

/// Adds to `slopes`, one per law, the derivatives of the misfit by stiffness and natural stress from those `w` by the
/// stresses: products of `w` with the effective strains, and `w` itself. Strains `own` have no part in the coupling of
/// bending and twisting. Entries of `w` and of the strains for these laws begin at index `first`.
fn add_slopes<K: Symmetric<f64, S>, const S: usize>(
    w: &[f64],
    StressInputs { strains, own, .. }: StressInputs<'_>,
    first: usize,
    slopes: &mut [LawSlopes],
) {
    let [w, strains] = [w, strains].map(|list| list[first..].as_chunks::<S>().0);
    let own = own.get(first..).map_or(&[][..], |own| own.as_chunks::<S>().0);
    for (i, slopes) in slopes.iter_mut().enumerate() {
        slopes.add::<K, S>(&w[i], &strains[i], own.get(i).unwrap_or(&[0.0; S]));
    }
}

impl<L: RateLayout<N, S>, const N: usize, const S: usize> Transposed for DiscreteRod<f64, L, N, S> {
    /// Zero derivatives for this rod. Those by dead moments are kept only in the plane, if the rod has moments or
    /// `moments` is true.
    fn zero_law_derivatives(&self, moments: bool) -> LawDerivatives {
        let edges = self.stretch.len();
        let any = N == 2 && (moments || !self.moments.list.is_empty());
        let laws = LawDerivatives::new(edges, self.mass.len(), if any { edges } else { 0 });
        LawDerivatives { bending: vec![BendingSlopes::default(); self.bending.len()], ..laws }
    }

    /// Multiplies the strains of edges by their rest lengths, so that their products with forces are energies.
    fn scale_edges_by_rest_length(&self, strains: &mut [f64]) {
        for (strain, law) in strains.iter_mut().zip(&self.stretch) {
            *strain *= law.rest_length;
        }
    }

    /// Overwrites `out` with `K w`, the elastic stiffness of each element times its entries of `w`. `coupled`: with the
    /// coupling of bending and twisting in a joint.
    fn stiffened(&self, w: &[f64], coupled: bool, out: &mut Vec<f64>) {
        let (axial, joints) = w.split_at(self.stretch.len());
        out.clear();
        out.extend(self.stretch.iter().zip(axial).map(|(law, w)| law.stiffness * w));
        for (law, w) in self.joint.iter().zip(joints.as_chunks::<S>().0) {
            let stiffness = law.stiffness();
            let stiffness = if coupled { stiffness } else { stiffness.uncoupled() };
            let stressed: [f64; S] = stiffness.times(w);
            out.extend(stressed);
        }
    }

    /// Adds to `to` the derivatives of the misfit by stiffness and natural stress of all laws, from those `w` by the
    /// stresses, at the effective strains `strained`. If `strained.counted`, those by relative changes of rest lengths,
    /// `w K (1 + s)`, are added. Nonlinear laws of edges and joints add those by their moduli, natural strains and rest
    /// lengths, at the present strains.
    fn add_to_laws(&self, w: &[f64], strained: StressInputs, to: &mut LawDerivatives) {
        let edges = self.stretch.len();
        add_slopes::<[f64; 1], 1>(w, strained, 0, &mut to.stretch);
        add_slopes::<L::Stiffness<f64>, S>(w, strained, edges, &mut to.joint);
        // With a history the stresses depend on the rest lengths through the effective strains
        // too.
        if strained.counted {
            for (i, law) in self.stretch.iter().enumerate() {
                let strain = strained.strains[i] + strained.own.get(i).copied().unwrap_or(0.0);
                to.rest[i] += w[i] * law.stiffness * (strain + 1.0);
            }
        }
        if !self.bending.is_empty() {
            let [w, now] = [w, strained.now].map(|list| list[edges..].as_chunks::<S>().0);
            for (i, (bending, to)) in self.bending.iter().zip(&mut to.bending).enumerate() {
                bending.add_slopes(&w[i], &now[i], to);
            }
        }
        for (i, (nonlinear, strain)) in self.nonlinear.edges.iter().zip(strained.now).enumerate() {
            let strain = *strain;
            // At fixed unknowns the strain depends on the rest length.
            let [first, second, by_arc_ratio] = nonlinear.force_slopes(strain);
            to.stretch[i].modulus += w[i] * first;
            to.stretch[i].second_modulus += w[i] * second;
            to.stretch[i].arc_ratio += w[i] * by_arc_ratio;
            to.rest[i] -= w[i] * nonlinear.response(strain)[0] * (1.0 + strain);
        }
    }

    /// Adds to `laws.moment`, one entry per edge, the derivatives of the misfit by a dead moment on that edge at `q`,
    /// from those `d` by the forces. An empty list stays empty.
    fn add_to_moments(&self, q: &[f64], d: &[f64], laws: &mut LawDerivatives) {
        moments::add_slopes(q, d, &mut laws.moment);
    }

    /// The derivative of the misfit along one parameter: the sum of `laws` times the rates along it. Rates of
    /// stiffnesses, natural stresses, moduli, rest lengths and loads are in `rates`, those of moments in `dual`.
    fn along(
        &self,
        dual: &DiscreteRod<Dual64, L, N, S>,
        rates: &Rates<L, N, S, 1>,
        laws: &LawDerivatives,
    ) -> f64 {
        let stretch = rates.stretch.iter().zip(&laws.stretch);
        let stretch = stretch.flat_map(|(rate, by)| {
            [rate.stiffness[0] * by.stiffness[0], rate.offset[0] * by.offset[0]].map(|x| x.0[0])
        });
        let rest = rates.rest.iter().zip(&laws.rest);
        let load = rates.load.iter().enumerate();
        let load = load.flat_map(|(i, load)| load.iter().zip(&laws.load[L::STRIDE * i..]));
        let nonlinear = rates.nonlinear.iter().zip(&laws.stretch);
        let along = |([rate], by): (&[NonlinearPart<Dual64>; 1], &LawSlopes)| {
            rate.modulus.eps * by.modulus
                + rate.second_modulus.eps * by.second_modulus
                + rate.arc_ratio.eps * by.arc_ratio
        };
        let nonlinear: f64 = nonlinear.map(along).sum();
        let all = stretch.chain(rest.chain(load).map(|(Directions([rate]), to)| rate * to));
        all.sum::<f64>()
            + nonlinear
            + dual.moments.along(&laws.moment)
            + Self::along_joints(rates, laws).iter().sum::<f64>()
    }

    /// The part of [`along`](Transposed::along) by stiffness and natural stress of each joint, one number per joint.
    fn along_joints(rates: &Rates<L, N, S, 1>, laws: &LawDerivatives) -> Vec<f64> {
        let mut along: Vec<f64> =
            rates.joint.iter().zip(&laws.joint).map(|(rate, law)| rate.along(law).0[0]).collect();
        for (sum, ([rate], by)) in along.iter_mut().zip(rates.bending.iter().zip(&laws.bending)) {
            *sum += rate.along(by);
        }
        along
    }
}
