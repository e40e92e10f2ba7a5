//! The derivatives of a planar rod's forces, transposed.

use crate::energy::{DeadMoment, Element};
use crate::numerics::lanes::Lanes;
use crate::rod::planar::geometry::Geometry;
use crate::rod::planar::rates::Rates;
use crate::rod::planar::{PlanarRod, unknowns};
use crate::rod::sensitive::FrameRate;
use crate::rod::transposed::{Laws, Strained, Transposed};
use num_dual::Dual64;

impl Transposed for PlanarRod<f64> {
    fn no_laws(&self, moments: bool) -> Laws {
        let edges = self.stretch.len();
        let moments = if moments || !self.moment.is_empty() { edges } else { 0 };
        Laws::new(edges, self.mass.len(), moments)
    }

    fn measured_strains(geometry: &Geometry, out: &mut Vec<f64>) {
        out.clear();
        out.extend(geometry.edges.iter().map(|edge| edge.strain));
        out.extend(geometry.joints.iter().map(|[curvature, _]| curvature));
    }

    fn by_length(&self, strains: &mut [f64]) {
        for (strain, law) in strains.iter_mut().zip(&self.stretch) {
            *strain *= law.rest_length;
        }
    }

    fn stiffened(&self, w: &[f64], _: bool, out: &mut Vec<f64>) {
        let stretch = self.stretch.iter().map(|law| law.stiffness);
        let laws = stretch.chain(self.bend.iter().map(|law| law.stiffness));
        out.clear();
        out.extend(laws.zip(w).map(|(stiffness, w)| stiffness * w));
    }

    fn add_to_laws(&self, w: &[f64], Strained { strains, own, counted }: Strained, to: &mut Laws) {
        let edges = self.stretch.len();
        let strain = |i: usize| strains[i] + own.get(i).copied().unwrap_or(0.0);
        for (i, law) in self.stretch.iter().enumerate() {
            let s = strain(i);
            to.stretch[i][0] += w[i] * s;
            to.stretch[i][1] += w[i];
            if counted {
                to.rest[i] += w[i] * law.stiffness * (s + 1.0);
            }
        }
        for (i, (stiffness, offset)) in to.joint.iter_mut().enumerate() {
            stiffness[0] += w[edges + i] * strain(edges + i);
            offset[0] += w[edges + i];
        }
    }

    fn add_to_moments(&self, q: &[f64], d: &[f64], laws: &mut Laws) {
        for (i, to) in laws.moment.iter_mut().enumerate() {
            let unit = DeadMoment { moment: 1.0, rest: [0.0; 2] };
            let forces = unit.gradient(unknowns::<f64, 4>(q, i));
            *to += forces.iter().zip(&d[2 * i..]).map(|(f, d)| f * d).sum::<f64>();
        }
    }

    fn turn_frames(_: &Geometry, _: &[f64], _: &mut [FrameRate<1>]) {}

    fn add_to_frames(_: &Geometry, _: &[f64], _: (&[f64], &[f64]), _: &mut [FrameRate<1>]) {}

    fn rebase_back(_: &Geometry, _: &mut [FrameRate<1>], _: &mut [f64]) {}

    fn along(&self, dual: &PlanarRod<Dual64>, rates: &Rates<1>, laws: &Laws) -> f64 {
        let pair = |[a, b]: [Lanes<1>; 2], to: [f64; 2]| a.0[0] * to[0] + b.0[0] * to[1];
        let stretch = rates.stretch.iter().zip(&laws.stretch).map(|(law, to)| pair(*law, *to));
        let rest = rates.rest.iter().zip(&laws.rest).map(|(rest, to)| rest.0[0] * to);
        let load = rates.load.iter().flatten().zip(&laws.load).map(|(load, to)| load.0[0] * to);
        let moments = dual.moment.iter().filter(|(i, _)| *i < laws.moment.len());
        let moment = moments.map(|(i, m)| m.moment.eps * laws.moment[*i]);
        stretch.chain(rest).chain(load).chain(moment).sum::<f64>()
            + Self::along_joints(rates, laws).iter().sum::<f64>()
    }

    fn along_joints(rates: &Rates<1>, laws: &Laws) -> Vec<f64> {
        let joints = rates.bend.iter().zip(&laws.joint);
        joints.map(|([slope, offset], (k, m))| slope.0[0] * k[0] + offset.0[0] * m[0]).collect()
    }
}
