//! Internal friction: springs in series with sliders (Prandtl), in parallel with the elastic law of a joint.
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
//! Input: the joint's stiffness `K` (N m), and the stretch `z` of its springs without slip. Output of [`SlipElements`]:
//! the stretch `z` with slip (`stretch_with_slip`), stiffness and stress of the springs (`response`, N m), and the
//! absolute distance of `|z|` from `R` (`distance_to_slipping`). `energy` is that of springs at a stretch with slip, J.
//! With one strain, `|z|` is the absolute value, and a slipping spring has no stiffness. [`SliderRates`] has the
//! derivatives of `R`, taken from dual sliders; its `slip_rate` returns those of the stretch with slip along
//! parameters.

use crate::energy::law::Symmetric;
use crate::numerics::directions::{Directions, dot as lanes_dot};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::components;
use num_dual::Dual64;
use std::sync::Arc;

/// The sliders of a rod.
#[derive(Clone, Debug)]
pub struct SlipElements<D> {
    /// Stiffness of the springs, as a fraction of the joints' own.
    pub stiffness: D,
    /// Sizes `R` of the stretch at which springs slip, one for each joint.
    pub limits: Vec<D>,
}

/// The sliders of a rod, and its springs during a step.
#[derive(Clone, Debug)]
pub struct ActiveSlipElements<D, K, const S: usize> {
    /// The sliders.
    pub sliders: Arc<SlipElements<D>>,
    /// The springs of all joints; empty for a rod without the stress of its springs.
    pub acting: Vec<Spring<D, K, S>>,
}

/// The spring of a joint during a step.
#[derive(Clone, Copy, Debug)]
pub struct Spring<D, K, const S: usize> {
    /// Elastic stiffness of the joint, N m.
    pub elastic: K,
    /// Stretch of the spring at zero strain, if it did not slip: `z0 - s0`.
    pub offset: [D; S],
}

impl<D, K, const S: usize> From<SlipElements<D>> for ActiveSlipElements<D, K, S> {
    /// The springs of a rod with these sliders; the list of acting springs is empty.
    fn from(sliders: SlipElements<D>) -> Self {
        Self { sliders: Arc::new(sliders), acting: Vec::new() }
    }
}

/// The springs of a joint at a stretch `z` without slip.
struct Stretched<D, const S: usize> {
    /// `K z`.
    pull: [D; S],
    /// The size `|z|`; zero without derivatives where there is no stretch.
    size: D,
    /// The factor `R/|z|` that returns the stretch to the limit `R`; none of springs that stick.
    factor: Option<D>,
}

impl<D: Scalar, const S: usize> Stretched<D, S> {
    /// The pull `K z`, the size `sqrt(z.K z/k)` and, if the size is above `limit`, the factor `limit/size`. `elastic`
    /// is the joint's own stiffness `K` with the mean bending stiffness `k`. A single strain has the size `|z|`.
    fn new<K: Symmetric<D, S>>(elastic: &K, z: &[D; S], limit: D) -> Self {
        let pull: [D; S] = elastic.times(z);
        let squared = product(z, &pull) / elastic.mean();
        // The root has no derivative at zero, where a spring sticks in any case.
        let size = match squared.value() > 0.0 {
            _ if S == 1 => z[0].abs(),
            true => squared.sqrt(),
            false => D::from(0.0),
        };
        let factor = (size.value() > limit.value()).then(|| limit / size);
        Self { pull, size, factor }
    }
}

/// The scalar product `a.b` over the `S` strains.
fn product<D: Scalar, const S: usize>(a: &[D; S], b: &[D; S]) -> D {
    let mut sum = a[0] * b[0];
    for c in 1..S {
        sum += a[c] * b[c];
    }
    sum
}

impl<D: Scalar> SlipElements<D> {
    /// The stretch of the springs of joint `i` after slip: `z` up to the limit `R`, else `z R/|z|`. `z` is the stretch
    /// without slip, `elastic` the joint's own stiffness.
    pub fn stretch_with_slip<K: Symmetric<D, S>, const S: usize>(
        &self,
        i: usize,
        elastic: &K,
        z: [D; S],
    ) -> [D; S] {
        let factor = Stretched::new(elastic, &z, self.limits[i]).factor;
        factor.map_or(z, |factor| components(|c| z[c] * factor))
    }

    /// The absolute difference between the size of the stretch `z` and the limit at which the springs of joint `i`
    /// begin or cease to slip, without derivatives.
    pub fn distance_to_slipping<K: Symmetric<D, S>, const S: usize>(
        &self,
        i: usize,
        elastic: &K,
        z: &[D; S],
    ) -> f64 {
        let limit = self.limits[i];
        (Stretched::new(elastic, z, limit).size.value() - limit.value()).abs()
    }

    /// Stiffness and stresses, N m, of the springs of joint `i` at the stretch `z` without slip, by the formulas of the
    /// header. The stiffness of a slipping spring with one strain is zero.
    pub fn response<K: Symmetric<D, S>, const S: usize>(
        &self,
        i: usize,
        elastic: &K,
        z: &[D; S],
    ) -> (K, [D; S]) {
        let Stretched { pull, size, factor } = Stretched::new(elastic, z, self.limits[i]);
        let stiffness = K::from_entries(|k| elastic.entry(k) * self.stiffness);
        let Some(factor) = factor else {
            return (stiffness, components(|c| pull[c] * self.stiffness));
        };
        if S == 1 {
            // The direction of slip is the only one.
            let stress = stiffness.times(&components(|c| z[c] * factor));
            return (K::from_entries(|_| D::from(0.0)), stress);
        }
        // A slipping spring has no stiffness along its stretch: that direction is projected out.
        let radial = (elastic.mean() * size * size).recip();
        let stiffness = K::from_entries(|k| {
            let [r, c] = K::PLACES[k];
            (elastic.entry(k) - pull[r] * pull[c] * radial) * self.stiffness * factor
        });
        (stiffness, components(|c| pull[c] * self.stiffness * factor))
    }

    /// Energy `g z.K z/2` of springs at the stretch `z` with slip, J, with the joint's own stiffness `elastic` and the
    /// fraction `g`. The limit `R` is not applied to `z`.
    pub fn energy<K: Symmetric<D, S>, const S: usize>(&self, elastic: &K, z: &[D; S]) -> D {
        product(z, &elastic.times(z)) * self.stiffness * 0.5
    }
}

/// Derivatives of the limits of sliders along `G` parameters.
#[derive(Clone, Debug)]
pub struct SliderRates<const G: usize>(Vec<Directions<G>>);

impl<const G: usize> SliderRates<G> {
    /// The derivatives of the limits that dual sliders contain, one entry per joint and one lane for each parameter.
    pub fn from_duals(duals: [&SlipElements<Dual64>; G]) -> Self {
        let count = duals.iter().map(|sliders| sliders.limits.len()).min().unwrap_or(0);
        Self((0..count).map(|i| Directions(duals.map(|sliders| sliders.limits[i].eps))).collect())
    }

    /// The derivatives of [`stretch_with_slip`](SlipElements::stretch_with_slip) of joint `i` at the stretch `z`
    /// without slip. `z` has the derivatives `rate`, which are returned for a spring that sticks. Else they are those
    /// of `z R/|z|`, by `z`, by the limit `R`, and by the elastic stiffness with the derivatives `stiffer`; with one
    /// strain those of `R` times the sign of `z`.
    pub fn slip_rate<K: Symmetric<f64, S>, R: Symmetric<Directions<G>, S>, const S: usize>(
        &self,
        sliders: &SlipElements<f64>,
        i: usize,
        elastic: &K,
        stiffer: &R,
        z: [f64; S],
        rate: [Directions<G>; S],
    ) -> [Directions<G>; S] {
        let Stretched { pull, size, factor } = Stretched::new(elastic, &z, sliders.limits[i]);
        let Some(factor) = factor else { return rate };
        if S == 1 {
            // A single strain slips at plus or minus its limit, whatever its stretch.
            return components(|c| self.0[i] * z[c].signum());
        }
        // z.K' z, from the entries on the diagonal and those above it.
        let (mut diagonal, mut above) = (Directions::ZERO, Directions::ZERO);
        for (k, [r, c]) in R::PLACES.iter().copied().enumerate() {
            let entry = stiffer.entry(k) * (z[r] * z[c]);
            if r == c { diagonal += entry } else { above += entry }
        }
        let twice =
            lanes_dot(&pull, &rate) * 2.0 + diagonal + above * 2.0 - stiffer.mean() * (size * size);
        // Product rule for `z R/|z|`, with the derivative of `|z|^2 = z.K z/k`.
        let size_rate = twice * (0.5 / (elastic.mean() * size));
        let factor_rate = self.0[i] * size.recip() - size_rate * (factor / size);
        components(|c| rate[c] * factor + factor_rate * z[c])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::law::Stiffness;
    use crate::numerics::vector::Vector;
    use std::f64::consts::TAU;

    fn stiffness() -> Stiffness<f64> {
        Stiffness { bend: [2.0, 0.1, 1.4], twist: 0.8, coupling: [0.05, -0.1] }
    }

    fn sliders() -> SlipElements<f64> {
        SlipElements { stiffness: 1.7, limits: vec![0.02] }
    }

    /// The stress is `g K z` at the stretch with slip, and the stiffness is its derivative, sticking and slipping.
    #[test]
    fn tangent_is_the_derivative_of_the_stress() {
        let elastic = stiffness();
        let dual = |x: f64| Dual64::from(x);
        for z in [[0.005, -0.004, 0.002], [0.05, 0.02, -0.04], [0.06, 0.015, -0.036]] {
            let (stiffness, stress) = sliders().response(0, &elastic, &z);
            for k in 0..3 {
                let along = |c: usize| if c == k { 1.0 } else { 0.0 };
                let z: Vector<Dual64> = components(|c| Dual64::new(z[c], along(c)));
                let sliders = SlipElements { stiffness: dual(1.7), limits: vec![dual(0.02)] };
                let slid = sliders.stretch_with_slip(0, &elastic.map(dual), z);
                let exact: Vector<Dual64> = elastic.map(dual).times(&slid);
                let slope: Vector<f64> = stiffness.times(&components(along));
                for c in 0..3 {
                    let exact = exact[c] * 1.7;
                    assert!((stress[c] - exact.re).abs() < 1e-15, "{stress:?} {exact:?}");
                    assert!((slope[c] - exact.eps).abs() < 1e-13, "{slope:?} {exact:?}");
                }
            }
        }
    }

    /// The stretch with slip has the derivatives of dual numbers along every number, sticking and slipping.
    #[test]
    fn slipping_has_derivatives_by_every_number() {
        let elastic = Stiffness {
            bend: [Dual64::new(2.0, 0.3), Dual64::new(0.1, -0.2), Dual64::new(1.4, 0.7)],
            twist: Dual64::new(0.8, -0.4),
            coupling: [Dual64::new(0.05, 0.6), Dual64::new(-0.1, 0.2)],
        };
        let limits = vec![Dual64::new(0.02, 0.9)];
        let sliders = SlipElements { stiffness: Dual64::new(1.7, 0.5), limits };
        let plain = SlipElements { stiffness: 1.7, limits: vec![0.02] };
        let rates = SliderRates::from_duals([&sliders, &sliders]);
        let stiffer = Stiffness::from_entries(|k| Directions([elastic.entry(k).eps; 2]));
        for z in [[0.004, -0.006, 0.003], [0.03, 0.02, -0.05]] {
            let rate = [0.2, -0.7, 0.4];
            let dual: Vector<Dual64> = components(|c| Dual64::new(z[c], rate[c]));
            let exact = sliders.stretch_with_slip(0, &elastic, dual).map(|z| z.eps);
            let real = elastic.map(|k| k.re);
            let found =
                rates.slip_rate(&plain, 0, &real, &stiffer, z, rate.map(|r| Directions([r; 2])));
            for c in 0..3 {
                assert!((found[c].0[1] - exact[c]).abs() < 1e-14, "{found:?} {exact:?}");
            }
            // A planar joint.
            let [x, dx] = [z[0], rate[0]];
            let [exact] = sliders.stretch_with_slip(0, &[elastic.bend[0]], [Dual64::new(x, dx)]);
            let stiffer = [Directions([0.3; 2])];
            let [found] = rates.slip_rate(&plain, 0, &[2.0], &stiffer, [x], [Directions([dx; 2])]);
            let close = |found: &f64| (found - exact.eps).abs() < 1e-14;
            assert!(found.0.iter().all(close), "{found:?} {exact}");
        }
    }

    /// A cycle of the strain between -a and a loses `4 g K R (a - R)`, to second order in its steps.
    #[test]
    fn cycle_loses_the_area_of_its_hysteresis_loop() {
        let (own, limit, most) = (1.7 * 2.0, 0.02, 0.05_f64);
        let exact = 4.0 * own * limit * (most - limit);
        let slid = |z: f64| sliders().stretch_with_slip(0, &[2.0], [z])[0];
        let lost = |steps: i32| {
            let strain = |k: i32| most * (f64::from(k) / f64::from(steps) * TAU).sin();
            let (mut z, mut work) = (0.0, 0.0);
            for k in 0..2 * steps {
                let change = strain(k + 1) - strain(k);
                let next = slid(z + change);
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
        assert_eq!(slid(0.019), 0.019);
    }

    /// A spatial joint with equal bending stiffnesses, strained about one axis, has the response of a planar joint.
    #[test]
    fn planar_joint_responds_as_a_spatial_one() {
        let flat = Stiffness { bend: [2.0, 0.0, 2.0], twist: 1.0, coupling: [0.0; 2] };
        for z in [0.01, 0.17, -0.03] {
            let (space, stress) = sliders().response(0, &flat, &[z, 0.0, 0.0]);
            let ([plane], [moment]) = sliders().response(0, &[2.0], &[z]);
            assert!((space.bend[0] - plane).abs() < 1e-14, "{space:?} {plane}");
            assert!((stress[0] - moment).abs() < 1e-15, "{stress:?} {moment}");
        }
    }
}
