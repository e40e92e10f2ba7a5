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
//! To rods a joint with sliders is an elastic one at a time: with the tangent as its stiffness, and the
//! natural strains at which that stiffness has the whole stress where the joint is.

use crate::energy::bend_twist::JointLaw;
use crate::energy::planar_bend::PlanarBend;
use crate::energy::stiffness::Stiffness;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add, dot, scale, sub};

/// The sliders of a rod.
#[derive(Clone, Debug)]
pub struct Sliders<D> {
    /// Stiffness of the springs, as a part of the joints' own.
    pub stiffness: D,
    /// Strains at which they slip, one for every joint.
    pub limits: Vec<D>,
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

    /// A joint in space of these strains with its springs, which would be at `z`.
    pub fn joint(
        &self,
        i: usize,
        (law, elastic): (&JointLaw<D>, &Stiffness<D>),
        strains: Vector<D>,
        z: Vector<D>,
    ) -> JointLaw<D> {
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
        let stiffness = law.stiffness.plus(&own);
        let stress = add(law.stiffness.times(&sub(strains, law.natural)), stress);
        JointLaw { stiffness, natural: sub(strains, stiffness.inverse_times(&stress)) }
    }

    /// Energy of springs that are stretched by `z`, J.
    pub fn energy(&self, elastic: &Stiffness<D>, z: Vector<D>) -> D {
        dot(z, elastic.times(&z)) * self.stiffness * 0.5
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
