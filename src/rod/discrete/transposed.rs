//! The derivatives of a rod's forces, transposed.

use crate::energy::Law;
use crate::energy::law::{LawSlopes, Symmetric};
use crate::numerics::lanes::Lanes;
use crate::rod::discrete::DiscreteRod;
use crate::rod::discrete::rates::{RateLayout, Rates};
use crate::rod::moments;
use crate::rod::transposed::{Laws, Strained, Transposed};
use num_dual::Dual64;

/// Adds the derivatives by the laws whose strains are those from `first` on.
fn add_slopes<K: Symmetric<f64, S>, const S: usize>(
    w: &[f64],
    Strained { strains, own, .. }: Strained<'_>,
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
    /// Zero derivatives. `moments`: whether those by dead moments are needed.
    fn no_laws(&self, moments: bool) -> Laws {
        let edges = self.stretch.len();
        let any = N == 2 && (moments || !self.moments.list.is_empty());
        Laws::new(edges, self.mass.len(), if any { edges } else { 0 })
    }

    /// Multiplies the strains of edges by their rest lengths, so that their products with forces are energies.
    fn by_length(&self, strains: &mut [f64]) {
        for (strain, law) in strains.iter_mut().zip(&self.stretch) {
            *strain *= law.rest_length;
        }
    }

    /// Writes `K w`, with the `coupled` part of bending and twisting or without.
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

    /// Adds the derivatives by the laws at these strains, where those by the stresses are `w`.
    fn add_to_laws(&self, w: &[f64], strained: Strained, to: &mut Laws) {
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
    }

    /// Adds the derivatives by the dead moments at `q`, where those by the forces are `d`.
    fn add_to_moments(&self, q: &[f64], d: &[f64], laws: &mut Laws) {
        moments::add_slopes(q, d, &mut laws.moment);
    }

    /// The derivative along one parameter, of which `dual` and `rates` contain the changes of the rod.
    fn along(
        &self,
        dual: &DiscreteRod<Dual64, L, N, S>,
        rates: &Rates<L, N, S, 1>,
        laws: &Laws,
    ) -> f64 {
        let stretch = rates.stretch.iter().zip(&laws.stretch);
        let stretch = stretch.flat_map(|(rate, by)| {
            [rate.stiffness[0] * by.stiffness[0], rate.offset[0] * by.offset[0]].map(|x| x.0[0])
        });
        let rest = rates.rest.iter().zip(&laws.rest);
        let load = rates.load.iter().enumerate();
        let load = load.flat_map(|(i, load)| load.iter().zip(&laws.load[L::STRIDE * i..]));
        let all = stretch.chain(rest.chain(load).map(|(Lanes([rate]), to)| rate * to));
        all.sum::<f64>()
            + dual.moments.along(&laws.moment)
            + Self::along_joints(rates, laws).iter().sum::<f64>()
    }

    /// The parts of it by the law of each joint.
    fn along_joints(rates: &Rates<L, N, S, 1>, laws: &Laws) -> Vec<f64> {
        rates.joint.iter().zip(&laws.joint).map(|(rate, law)| rate.along(law).0[0]).collect()
    }
}
