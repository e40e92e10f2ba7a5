//! Internal friction: beside what is elastic in a joint, springs in series with sliders (Prandtl).
//!
//! A cable's strands, or the parts of a sheath, stick to each other until they slip. The springs take up the
//! change of the strains `s` of bending and twisting, `z = z0 + s - s0`, with the stress `g K z`, a
//! part `g` of the joint's own stiffness `K`; beyond the limit `|z| = R` they slip, `z R/|z|`. Sizes are
//! those of the energy, `|z|^2 = z.K z/k` with the mean bending stiffness `k`, so that the stress over
//! a step is the derivative of a convex potential and its tangent is symmetric,
//!
//! ```text
//! g K                                   where they stick
//! g (R/|z|) (K - (K z)(K z)'/(k |z|^2)) where they slip
//! ```
//!
//! which is the derivative of the step itself: Newton's method returns to the limit in every iteration.
//! `R` is a curvature, 1/m, times the joint's length.
//!
//! To energies a joint with sliders is an elastic one at a time: with the tangent as its stiffness, and the
//! natural strains at which that stiffness has the whole stress where the joint is.

use crate::energy::bend_twist::JointLaw;
use crate::energy::planar_bend::PlanarBend;
use crate::energy::stiffness::Stiffness;
use crate::numerics::lanes::{Lanes, dot as lanes_dot};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, components, dot, scale, sub};
use num_dual::Dual64;
use std::sync::Arc;

/// The sliders of a rod.
#[derive(Clone, Debug)]
pub struct Sliders<D> {
    /// Stiffness of the springs, as a part of the joints' own.
    pub stiffness: D,
    /// Strains at which they slip, one for every joint.
    pub limits: Vec<D>,
}

/// The sliders of a rod, and its springs while it makes a step.
#[derive(Clone, Debug)]
pub struct Springs<D, J> {
    /// What they slip on.
    pub sliders: Arc<Sliders<D>>,
    /// Of every joint its elastic stiffness, and where its spring would be at no strain if it did not slip; empty of a
    /// rod without the stress of its springs.
    pub acting: Vec<J>,
}

impl<D, J> From<Sliders<D>> for Springs<D, J> {
    fn from(sliders: Sliders<D>) -> Self {
        Self { sliders: Arc::new(sliders), acting: Vec::new() }
    }
}

/// Where springs are that would be at `z`, and the part of their stress that is left.
#[inline]
fn returned<D: Scalar>(size: D, limit: D) -> Option<D> {
    (size.value() > limit.value()).then(|| limit / size)
}

impl<D: Scalar> Sliders<D> {
    /// How far the spring of a joint in the plane is stretched that would be at `z`.
    pub fn slid(&self, i: usize, z: D) -> D {
        let size = if z.value() < 0.0 { -z } else { z };
        returned(size, self.limits[i]).map_or(z, |part| z * part)
    }

    /// A joint in the plane of the curvature `strain` with its spring, which would be at `z`.
    pub fn bend(
        &self,
        i: usize,
        (law, elastic): (&PlanarBend<D>, D),
        strain: D,
        z: D,
    ) -> PlanarBend<D> {
        let slid = self.slid(i, z);
        let slips = slid.value() != z.value();
        let own = elastic * self.stiffness;
        let stiffness = if slips { law.stiffness } else { law.stiffness + own };
        let stress = law.stiffness * (strain - law.natural_curvature) + own * slid;
        PlanarBend { stiffness, natural_curvature: strain - stress / stiffness }
    }

    /// How far the springs of a joint in space are stretched that would be at `z`.
    pub fn slid_in_space(&self, i: usize, elastic: &Stiffness<D>, z: Vector<D>) -> Vector<D> {
        let (size, _) = size(elastic, z);
        size.and_then(|size| returned(size, self.limits[i])).map_or(z, |part| scale(z, part))
    }

    /// How far a joint in the plane whose spring would be at `z` is from beginning or ceasing to slip.
    pub fn from_limit(&self, i: usize, z: D) -> f64 {
        (z.value().abs() - self.limits[i].value()).abs()
    }

    /// The same of a joint in space.
    pub fn from_limit_in_space(&self, i: usize, elastic: &Stiffness<D>, z: Vector<D>) -> f64 {
        let size = size(elastic, z).0.map_or(0.0, |size| size.value());
        (size - self.limits[i].value()).abs()
    }

    /// A joint in space of these strains with its springs, which would be at `z`.
    pub fn joint(
        &self,
        i: usize,
        both: (&JointLaw<D>, &Stiffness<D>),
        strains: Vector<D>,
        z: Vector<D>,
    ) -> JointLaw<D> {
        let (stiffness, stress) = self.response(i, both, strains, z);
        JointLaw { stiffness, natural: sub(strains, stiffness.inverse_times(&stress)) }
    }

    /// Its stiffness and stresses.
    pub fn response(
        &self,
        i: usize,
        (law, elastic): (&JointLaw<D>, &Stiffness<D>),
        strains: Vector<D>,
        z: Vector<D>,
    ) -> (Stiffness<D>, Vector<D>) {
        let (size, mean) = size(elastic, z);
        let pull = elastic.times(&z);
        let mut own = elastic.map(|k| k * self.stiffness);
        let mut stress = scale(pull, self.stiffness);
        if let Some(size) = size
            && let Some(part) = returned(size, self.limits[i])
        {
            let radial = (mean * size * size).recip();
            let flat = |a: usize, b: usize| pull[a] * pull[b] * radial;
            let [b11, b12, b22] = elastic.bend;
            let [c1, c2] = elastic.coupling;
            let left = Stiffness {
                bend: [b11 - flat(0, 0), b12 - flat(0, 1), b22 - flat(1, 1)],
                twist: elastic.twist - flat(2, 2),
                coupling: [c1 - flat(0, 2), c2 - flat(1, 2)],
            };
            own = left.map(|k| k * self.stiffness * part);
            stress = scale(stress, part);
        }
        let stress = add(law.stiffness.times(&sub(strains, law.natural)), stress);
        (law.stiffness.plus(&own), stress)
    }

    /// Energy of springs that are stretched by `z`, J.
    pub fn energy(&self, elastic: &Stiffness<D>, z: Vector<D>) -> D {
        dot(z, elastic.times(&z)) * self.stiffness * 0.5
    }
}

/// How the strains change with parameters at which the sliders of a rod slip.
#[derive(Clone, Debug)]
pub struct SliderRates<const G: usize>(Vec<Lanes<G>>);

impl<const G: usize> SliderRates<G> {
    /// Of dual sliders, one for each parameter.
    pub fn of(duals: [&Sliders<Dual64>; G]) -> Self {
        let count = duals.iter().map(|sliders| sliders.limits.len()).min().unwrap_or(0);
        Self((0..count).map(|i| Lanes(duals.map(|sliders| sliders.limits[i].eps))).collect())
    }

    /// The derivative of [`slid`](Sliders::slid), where that of `z` is `rate`.
    pub fn slid(&self, sliders: &Sliders<f64>, i: usize, z: f64, rate: Lanes<G>) -> Lanes<G> {
        match returned(z.abs(), sliders.limits[i]) {
            Some(_) => self.0[i] * z.signum(),
            None => rate,
        }
    }

    /// The derivative of [`slid_in_space`](Sliders::slid_in_space), where `z` has the derivatives `rate` and the
    /// elastic stiffness, whose upper triangle row by row they are, `stiffer`:
    /// `|z|^2 = z.K z/k` and the spring is at `z R/|z|`.
    pub fn slid_in_space(
        &self,
        sliders: &Sliders<f64>,
        i: usize,
        (elastic, stiffer): (&Stiffness<f64>, &[Lanes<G>; 6]),
        (z, rate): (Vector<f64>, [Lanes<G>; 3]),
    ) -> [Lanes<G>; 3] {
        let limit = sliders.limits[i];
        let (size, mean) = size(elastic, z);
        let slips = size.and_then(|size| Some((size, returned(size, limit)?)));
        let Some((size, part)) = slips else { return rate };
        let pull = elastic.times(&z);
        let [k11, k12, k13, k22, k23, k33] = *stiffer;
        let [x, y, t] = z;
        let diagonal = k11 * (x * x) + k22 * (y * y) + k33 * (t * t);
        let off = k12 * (x * y) + k13 * (x * t) + k23 * (y * t);
        let mean_rate = (k11 + k22) * 0.5;
        let twice =
            lanes_dot(&pull, &rate) * 2.0 + diagonal + off * 2.0 - mean_rate * (size * size);
        let size_rate = twice * (0.5 / (mean * size));
        let part_rate = self.0[i] * size.recip() - size_rate * (part / size);
        components(|c| rate[c] * part + part_rate * z[c])
    }
}

/// The size of a stretch, none of one that is zero, and the mean bending stiffness.
#[inline]
fn size<D: Scalar>(elastic: &Stiffness<D>, z: Vector<D>) -> (Option<D>, D) {
    let [b11, _, b22] = elastic.bend;
    let mean = (b11 + b22) * 0.5;
    let squared = dot(z, elastic.times(&z)) / mean;
    ((squared.value() > 0.0).then(|| squared.sqrt()), mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;
    use std::f64::consts::TAU;

    fn stiffness() -> Stiffness<f64> {
        Stiffness { bend: [2.0, 0.1, 1.4], twist: 0.8, coupling: [0.05, -0.1] }
    }

    fn sliders() -> Sliders<f64> {
        Sliders { stiffness: 1.7, limits: vec![0.02] }
    }

    /// The law has the stress where the joint is, and its stiffness is the derivative of the stress,
    /// sticking and slipping.
    #[test]
    fn the_tangent_is_the_derivative_of_the_stress() {
        let law = JointLaw { stiffness: stiffness(), natural: [0.01, -0.02, 0.03] };
        let elastic = stiffness();
        let dual = |x: f64| Dual64::from(x);
        for z0 in [[0.0; 3], [0.01, -0.005, 0.004]] {
            for strains in [[0.005, -0.004, 0.002], [0.05, 0.02, -0.04]] {
                let at = |s: Vector<f64>| add(s, z0);
                let found = sliders().joint(0, (&law, &elastic), strains, at(strains));
                for k in 0..3 {
                    let along = |c: usize| if c == k { 1.0 } else { 0.0 };
                    let s: Vector<Dual64> =
                        std::array::from_fn(|c| Dual64::new(strains[c], along(c)));
                    let sliders = Sliders { stiffness: dual(1.7), limits: vec![dual(0.02)] };
                    let z = std::array::from_fn(|c| s[c] + z0[c]);
                    let slid = sliders.slid_in_space(0, &elastic.map(dual), z);
                    let stress = add(
                        elastic.map(dual).times(&sub(s, law.natural.map(dual))),
                        scale(elastic.map(dual).times(&slid), dual(1.7)),
                    );
                    let own = found.stiffness.times(&sub(strains, found.natural));
                    let slope = found.stiffness.times(&std::array::from_fn(along));
                    for c in 0..3 {
                        assert!((own[c] - stress[c].re).abs() < 1e-15, "{own:?} {stress:?}");
                        assert!((slope[c] - stress[c].eps).abs() < 1e-13, "{slope:?} {stress:?}");
                    }
                }
            }
        }
    }

    /// How far springs are stretched changes with every number as in dual numbers, sticking and slipping.
    #[test]
    fn slipping_has_derivatives_by_every_number() {
        let elastic = Stiffness {
            bend: [Dual64::new(2.0, 0.3), Dual64::new(0.1, -0.2), Dual64::new(1.4, 0.7)],
            twist: Dual64::new(0.8, -0.4),
            coupling: [Dual64::new(0.05, 0.6), Dual64::new(-0.1, 0.2)],
        };
        let limits = vec![Dual64::new(0.02, 0.9)];
        let sliders = Sliders { stiffness: Dual64::new(1.7, 0.5), limits };
        let plain = Sliders { stiffness: 1.7, limits: vec![0.02] };
        let rates = SliderRates::of([&sliders, &sliders]);
        let Stiffness { bend: [b11, b12, b22], twist, coupling: [c1, c2] } = elastic.map(|k| k.eps);
        let stiffer = [b11, b12, c1, b22, c2, twist].map(|k| Lanes([k; 2]));
        for z in [[0.004, -0.006, 0.003], [0.03, 0.02, -0.05]] {
            let rate = [0.2, -0.7, 0.4];
            let dual: Vector<Dual64> = std::array::from_fn(|c| Dual64::new(z[c], rate[c]));
            let exact = sliders.slid_in_space(0, &elastic, dual).map(|z| z.eps);
            let both = (&elastic.map(|k| k.re), &stiffer);
            let found = rates.slid_in_space(&plain, 0, both, (z, rate.map(|r| Lanes([r; 2]))));
            for c in 0..3 {
                assert!((found[c].0[1] - exact[c]).abs() < 1e-14, "{found:?} {exact:?}");
            }
            let [x, dx] = [z[0], rate[0]];
            let exact = sliders.slid(0, Dual64::new(x, dx)).eps;
            let found = rates.slid(&plain, 0, x, Lanes([dx; 2]));
            assert!(found.0.iter().all(|found| (found - exact).abs() < 1e-14), "{found:?} {exact}");
        }
    }

    /// A cycle of the strain between -a and a loses `4 g K R (a - R)`, to second order in its steps.
    #[test]
    fn a_cycle_loses_its_area() {
        let (own, limit, most) = (1.7 * 2.0, 0.02, 0.05_f64);
        let exact = 4.0 * own * limit * (most - limit);
        let lost = |steps: i32| {
            let strain = |k: i32| most * (f64::from(k) / f64::from(steps) * TAU).sin();
            let (mut z, mut work) = (0.0, 0.0);
            for k in 0..2 * steps {
                let change = strain(k + 1) - strain(k);
                let next = sliders().slid(0, z + change);
                // The first cycle runs in.
                if k >= steps {
                    work += own * 0.5 * (z + next) * change;
                }
                z = next;
            }
            work
        };
        let errors = [50, 100, 200, 400].map(|steps| lost(steps) / exact - 1.0);
        println!("{errors:?} of {exact:.3e}");
        assert!(errors[0].abs() < 2e-2 && errors[3].abs() < errors[0].abs() / 30.0);
        // Within the limit nothing is lost.
        assert_eq!(sliders().slid(0, 0.019), 0.019);
    }

    /// In the plane it is the same with one strain.
    #[test]
    fn a_joint_in_the_plane_is_one_in_space() {
        let flat = Stiffness { bend: [2.0, 0.0, 2.0], twist: 1.0, coupling: [0.0; 2] };
        let law = JointLaw { stiffness: flat, natural: [0.01, 0.0, 0.0] };
        let bend = PlanarBend { stiffness: 2.0, natural_curvature: 0.01 };
        for (strain, z) in [(0.015, 0.01), (0.2, 0.17), (-0.2, -0.03)] {
            let space = sliders().joint(0, (&law, &flat), [strain, 0.0, 0.0], [z, 0.0, 0.0]);
            let plane = sliders().bend(0, (&bend, 2.0), strain, z);
            assert!((space.stiffness.bend[0] - plane.stiffness).abs() < 1e-14);
            assert!((space.natural[0] - plane.natural_curvature).abs() < 1e-14);
        }
    }
}
