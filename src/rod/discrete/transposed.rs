//! The derivatives of a rod's forces, and of its frames, transposed.

use crate::numerics::lanes::Lanes;
use crate::rod::discrete::DiscreteRod;
use crate::rod::discrete::rates::{JointRate, RateLayout, Rates};
use crate::rod::moments::EdgeMoments;
use crate::rod::sensitive::FrameRate;
use crate::rod::transposed::{Laws, Strained, Transposed};
use num_dual::Dual64;

/// Transposed products of a [`RateLayout`].
pub trait TransposedLayout<const N: usize, const S: usize>: RateLayout<N, S> {
    /// Adds the derivatives of a number by the law of a joint, see [`Laws::joint`], where the stresses have the
    /// derivatives `w`; `own` are the strains with a viscosity of their kind.
    fn add_to_joint(
        w: &[f64; S],
        strains: &[f64; S],
        own: &[f64; S],
        law: &mut ([f64; 6], [f64; 3]),
    );

    /// Adds the derivatives by the moments at `q`, where the forces have the derivatives `d`.
    fn add_to_moments(_q: &[f64], _d: &[f64], _laws: &mut Laws) {}

    /// The product with the derivatives by moments.
    fn along_moments(_: &Self::Moments<Dual64>, _laws: &Laws) -> f64 {
        0.0
    }

    /// Transposed part of the frames' turn with the angles of their edges.
    fn turn_frames(_: &Self::Geometry, _angles: &[f64], _frames: &mut [FrameRate<1>]) {}

    /// Transposed [`RateLayout::frame_rate`]: see
    /// [`Transposed::add_to_frames`](crate::rod::Transposed::add_to_frames).
    fn add_to_frames(
        _: &Self::Geometry,
        _gradient: &[f64],
        _by: (&[f64], &[f64]),
        _frames: &mut [FrameRate<1>],
    ) {
    }

    /// Transposed [`RateLayout::rebase_rates`].
    fn rebase_back(_: &Self::Geometry, _frames: &mut [FrameRate<1>], _q: &mut [f64]) {}
}

impl<L: TransposedLayout<N, S>, const N: usize, const S: usize> Transposed
    for DiscreteRod<f64, L, N, S>
{
    fn no_laws(&self, moments: bool) -> Laws {
        let edges = self.stretch.len();
        let any = L::Moments::<f64>::POSSIBLE && (moments || !self.moments.is_empty());
        Laws::new(edges, self.mass.len(), if any { edges } else { 0 })
    }

    fn measured_strains(geometry: &L::Geometry, out: &mut Vec<f64>) {
        out.clear();
        out.extend(L::measured_edges(geometry));
        out.extend(L::measured_joints(geometry).flatten());
    }

    fn by_length(&self, strains: &mut [f64]) {
        for (strain, law) in strains.iter_mut().zip(&self.stretch) {
            *strain *= law.rest_length;
        }
    }

    fn stiffened(&self, w: &[f64], coupled: bool, out: &mut Vec<f64>) {
        let (axial, joints) = w.split_at(self.stretch.len());
        out.clear();
        out.extend(self.stretch.iter().zip(axial).map(|(law, w)| law.stiffness * w));
        for (law, w) in self.joint.iter().zip(joints.as_chunks::<S>().0) {
            out.extend(L::stiffness_times(law, w, coupled));
        }
    }

    fn add_to_laws(&self, w: &[f64], Strained { strains, own, counted }: Strained, to: &mut Laws) {
        let edges = self.stretch.len();
        for (i, law) in self.stretch.iter().enumerate() {
            let s = strains[i] + own.get(i).copied().unwrap_or(0.0);
            to.stretch[i][0] += w[i] * s;
            to.stretch[i][1] += w[i];
            if counted {
                to.rest[i] += w[i] * law.stiffness * (s + 1.0);
            }
        }
        let [w, strains] = [w, strains].map(|list| list[edges..].as_chunks::<S>().0);
        let own = own.get(edges..).map_or(&[][..], |own| own.as_chunks::<S>().0);
        for (i, law) in to.joint.iter_mut().enumerate() {
            L::add_to_joint(&w[i], &strains[i], own.get(i).unwrap_or(&[0.0; S]), law);
        }
    }

    fn add_to_moments(&self, q: &[f64], d: &[f64], laws: &mut Laws) {
        L::add_to_moments(q, d, laws);
    }

    fn turn_frames(geometry: &L::Geometry, angles: &[f64], frames: &mut [FrameRate<1>]) {
        L::turn_frames(geometry, angles, frames);
    }

    fn add_to_frames(
        geometry: &L::Geometry,
        gradient: &[f64],
        by: (&[f64], &[f64]),
        frames: &mut [FrameRate<1>],
    ) {
        L::add_to_frames(geometry, gradient, by, frames);
    }

    fn rebase_back(geometry: &L::Geometry, frames: &mut [FrameRate<1>], q: &mut [f64]) {
        L::rebase_back(geometry, frames, q);
    }

    fn along(
        &self,
        dual: &DiscreteRod<Dual64, L, N, S>,
        rates: &Rates<L, N, S, 1>,
        laws: &Laws,
    ) -> f64 {
        let stretch = rates.stretch.iter().flatten().zip(laws.stretch.iter().flatten());
        let rest = rates.rest.iter().zip(&laws.rest);
        let load = rates.load.iter().enumerate();
        let load = load.flat_map(|(i, load)| load.iter().zip(&laws.load[L::STRIDE * i..]));
        let all = stretch.chain(rest).chain(load);
        all.map(|(Lanes([rate]), to)| rate * to).sum::<f64>()
            + L::along_moments(&dual.moments, laws)
            + Self::along_joints(rates, laws).iter().sum::<f64>()
    }

    fn along_joints(rates: &Rates<L, N, S, 1>, laws: &Laws) -> Vec<f64> {
        rates.joint.iter().zip(&laws.joint).map(|(rate, law)| rate.along(law).0[0]).collect()
    }
}
