//! Reduction of natural frequencies by shear deformation and rotary inertia, which the rod model omits (Timoshenko).
//!
//! Input: names of modes of a problem, and the state about which they vibrate. The modes, without these effects,
//! are computed by the rod model. Let `phi` be its deflection, `Q` its shear force and `theta` the rotation of its
//! sections. Timoshenko's beam has these additional terms, of first order in `I/(A L^2)` by Rayleigh's quotient:
//!
//! ```text
//! omega^2 = omega_0^2 (1 - e),   e = (int Q^2/(kappa G A) ds + omega_0^2 int rho I theta^2 ds)
//!                                    / (omega_0^2 int rho A phi^2 ds)
//! ```
//!
//! The shear strain `Q/(kappa G A)` minimizes the quotient for any supports, since deflection and rotation may both
//! change. For a simply supported rod `e = (I/A) k^2 (1 + E/(kappa G))` with `k = n pi/L` (S. P. Timoshenko, Phil.
//! Mag. 41 (1921) 744). For a free one it is the first term of the correction in ASTM E1876.
//!
//! `Q` is the transverse part of the sum of inertia forces and reactions on one side of the section. The part of
//! the tension that rotates with the section is subtracted. This holds for curved, tapered and hanging rods. Errors
//! are those of the equilibrium, a mode without stiffness, and a number above that of the modes. Output for each
//! mode, in the order of the names ([`ThicknessEffect`]): the first term of `e` for `E/(kappa G) = 1`, and the
//! second one. [`ThicknessEffect::reduction`] returns `e`: the first times `E/(kappa G)`, plus the second.

use crate::error::Error;
use crate::numerics::tangent::Tangent;
use crate::numerics::vector::{add, dot, scale, sub};
use crate::problem::{AnyProblem, Model, Problem};
use crate::statics::{free_part, internal_forces};
use crate::vibration::frequencies::find_named_modes;
use crate::vibration::modes::{
    Eigenpair, LinearizationPoint, ModePlane, VibratingRod, linearization_state, spatial_state,
};
use crate::vibration::name::ModeName;

/// Relative reductions of a squared frequency by the effects of thickness, to first order.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ThicknessEffect {
    /// By shear deformation, for `E/(kappa G) = 1`.
    pub shear: f64,
    /// By rotary inertia.
    pub rotary: f64,
}

impl ThicknessEffect {
    /// Relative reduction of the squared frequency, dimensionless, for the ratio `E/(kappa G)`, `shear_flexibility`:
    /// `shear` times that ratio plus `rotary`.
    pub fn reduction(&self, shear_flexibility: f64) -> f64 {
        self.shear * shear_flexibility + self.rotary
    }
}

/// The relative reductions of the squared frequencies of named modes about a state by shear and rotary inertia, in the
/// order of the names. The state and the modes are computed here. Errors: those of the equilibrium, [`Error::Mode`] for
/// a mode without stiffness, [`Error::OutOfRange`] for a number above that of the modes.
pub(crate) fn thickness_effects(
    problem: &Problem,
    names: &[ModeName],
    about: LinearizationPoint,
) -> Result<Vec<ThicknessEffect>, Error> {
    let mut effects = vec![ThicknessEffect::default(); names.len()];
    let planes: Vec<Option<ModePlane>> = names.iter().map(|n| n.among.plane_of(problem)).collect();
    // Modes in and out of the plane have separate rods; effects are returned in the order of the names.
    let places_in = |plane: Option<ModePlane>| -> Vec<usize> {
        (0..names.len()).filter(|k| planes[*k] == plane).collect()
    };
    match problem.discretized() {
        // A planar rod vibrates in its plane and out of it; the second needs the spatial model of
        // the same state.
        AnyProblem::Planar(discretized) => {
            let q = linearization_state(&discretized, about)?.0;
            let inside = places_in(Some(ModePlane::In));
            if !inside.is_empty() {
                let rod = VibratingRod::new(&discretized, &q, &())?;
                rod.add_effects(names, &inside, &mut effects)?;
            }
            let outside = places_in(Some(ModePlane::Out));
            if !outside.is_empty() {
                let model = problem.spatial_model();
                let spatial = problem.discretized_as(&model);
                let (q, frames) = spatial_state(&discretized, &spatial, &q);
                let rod = VibratingRod::out_of_plane(&spatial, &q, &frames)?;
                rod.add_effects(names, &outside, &mut effects)?;
            }
        }
        AnyProblem::Spatial(discretized) => {
            let (q, frames) = linearization_state(&discretized, about)?;
            let rod = VibratingRod::new(&discretized, &q, &frames)?;
            rod.add_effects(names, &places_in(None), &mut effects)?;
        }
    }
    Ok(effects)
}

impl<M: Model, T: Tangent<f64>> VibratingRod<'_, M, T> {
    /// Computes the modes `names` at the indices `places`, and overwrites the `effects` at these indices with the
    /// reductions of their squared frequencies.
    fn add_effects(
        &self,
        names: &[ModeName],
        places: &[usize],
        effects: &mut [ThicknessEffect],
    ) -> Result<(), Error> {
        let own: Vec<ModeName> = places.iter().map(|k| names[*k]).collect();
        for (place, pair) in places.iter().zip(find_named_modes(self, &own, false)?) {
            effects[*place] = self.thickness_effect(&pair);
        }
        Ok(())
    }

    /// The effect on one mode, for `E/(kappa G) = 1`: the integrals of squared shear force over axial stiffness, and of
    /// squared rotation of sections times their inertia and the squared frequency. Both are midpoint sums over edges,
    /// without the parts behind walls, over twice the kinetic energy of the mode. The shear force is transverse to the
    /// edge: internal force of inertia and reactions plus tension times rotation.
    fn thickness_effect(&self, pair: &Eigenpair) -> ThicknessEffect {
        let (discretized, scene) = (self.discretized, self.discretized.scene());
        let edges = discretized.nodes() - 1;
        let inertia = pair.vector.iter().zip(&self.pencil.mass).map(|(x, m)| pair.squared * m * x);
        let inertia: Vec<f64> = inertia.collect();
        let twice_kinetic: f64 = inertia.iter().zip(&pair.vector).map(|(f, x)| f * x).sum();
        // Inertia forces and reactions balance the elastic forces; the latter act on held unknowns.
        let mut on_nodes = vec![0.0; pair.vector.len()];
        self.pencil.tangent.product(&pair.vector, &mut on_nodes);
        for i in self.pencil.free.clone() {
            on_nodes[i] = inertia[i];
        }
        let (on_nodes, rates) = (self.in_model(&on_nodes), self.in_model(&pair.vector));
        let rate = |vector: &[f64], i: usize| discretized.model.rate(vector, i);
        let forces = internal_forces(discretized, |i| rate(&on_nodes, i));
        let directors = discretized.directors(discretized.setup);
        let still = vec![0.0; self.q.len()];
        let place = |i: usize| discretized.model.position(self.q, i);
        let rest = discretized.rest();
        let rest_place = |i: usize| discretized.model.position(&rest, i);
        let mut effect = ThicknessEffect::default();
        // Edge by edge: rotation of the section per amplitude, tension, transverse shear force, and
        // the two integrands.
        for j in 0..edges {
            let chord = sub(place(j + 1), place(j));
            let length = dot(chord, chord).sqrt();
            let [tangent, d1, d2] =
                discretized.axes(directors, self.q, &still, self.frames, j).map(|[axis, _]| axis);
            let transverse = |v: [f64; 3]| sub(v, scale(tangent, dot(v, tangent)));
            let rotation = scale(sub(rate(&rates, j + 1), rate(&rates, j)), 1.0 / length);
            let (section, material) = scene.at((j as f64 + 0.5) / edges as f64);
            let moments = section.moments();
            let [i1, i2] = moments.second_moments;
            let axial = material.youngs_modulus * moments.area;
            let rest_chord = sub(rest_place(j + 1), rest_place(j));
            let tension = axial * (length / dot(rest_chord, rest_chord).sqrt() - 1.0);
            let shear = transverse(add(forces[j], scale(rotation, tension)));
            let inertia = i1 * dot(rotation, d1).powi(2) + i2 * dot(rotation, d2).powi(2);
            let piece = length * free_part(discretized, j);
            effect.shear += dot(shear, shear) * piece / axial;
            effect.rotary += pair.squared * material.density * inertia * piece;
        }
        // The denominator, twice the kinetic energy of the mode without the effects.
        ThicknessEffect {
            shear: effect.shear / twice_kinetic,
            rotary: effect.rotary / twice_kinetic,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Dimension, Material, Point, PointForce, Scene, Section, Shape, Support};
    use crate::vibration::modes::ModeKind;
    use crate::vibration::name::ModeFilter;

    const LENGTH: f64 = 0.1;

    /// A bar of 100 x 20 x 10 mm.
    fn bar(start: Support, end: Support) -> Scene {
        let shape = Shape::Straight { length: LENGTH, direction: [1.0, 0.0, 0.0] };
        let section = Section::Rectangle { width: 0.02, height: 0.01, up: [0.0, 1.0, 0.0] };
        let material = Material { poisson_ratio: Some(0.29), ..Material::new(7850.0, 205e9) };
        let mut scene = Scene::new(160, shape, section, material);
        (scene.supports.start, scene.supports.end) = (start, end);
        scene
    }

    fn effect_on(scene: &Scene, number: usize, plane: Option<ModePlane>) -> ThicknessEffect {
        let among = ModeFilter { plane, kind: Some(ModeKind::Bending), direction: None };
        let problem = scene.problem().unwrap();
        thickness_effects(&problem, &[ModeName { number, among }], LinearizationPoint::Rest)
            .unwrap()[0]
    }

    fn assert_near(found: f64, expected: f64, tolerance: f64) {
        assert!((found / expected - 1.0).abs() < tolerance, "{found} {expected}");
    }

    /// Exact for any mode: (I/A) k^2 by shear at E = kappa G and as much by rotary inertia, k = n pi/L; out of the plane
    /// the width is the height.
    #[test]
    fn simply_supported_rod_has_the_terms_of_timoshenko() {
        let scene = bar(Support::Pinned, Support::Roller);
        for (number, plane, height) in
            [(1, ModePlane::In, 0.01_f64), (2, ModePlane::In, 0.01), (1, ModePlane::Out, 0.02)]
        {
            let k = number as f64 * std::f64::consts::PI / LENGTH;
            let expected = height * height / 12.0 * k * k;
            let effect = effect_on(&scene, number, Some(plane));
            assert_near(effect.shear, expected, 2e-3);
            assert_near(effect.rotary, expected, 2e-3);
        }
        // The spatial model has the same mode.
        let mut spatial = scene;
        spatial.rod.dimension = Dimension::Spatial;
        let effect = effect_on(&spatial, 1, None);
        let expected = 0.01_f64.powi(2) / 12.0 * (std::f64::consts::PI / LENGTH).powi(2);
        assert_near(effect.shear, expected, 2e-3);
        assert_near(effect.rotary, expected, 2e-3);
    }

    /// Mean squares of the slope over those of the mode, times L^2: 49.481 of the first mode of a free rod, whose shear
    /// force is the slope of a clamped one's, 12.303; 4.648 of a cantilever, 12.303 and 49.481 of one held at both ends.
    #[test]
    fn terms_for_other_supports_agree_with_integrals_of_beam_modes() {
        use Support::{Clamped, Free};
        let unit = 0.01_f64.powi(2) / 12.0 / LENGTH.powi(2);
        for (start, end, shear, rotary) in [
            (Free, Free, 12.303, 49.481),
            (Clamped, Free, 4.648, 4.648),
            (Free, Clamped, 4.648, 4.648),
            (Clamped, Clamped, 49.481, 12.303),
        ] {
            let effect = effect_on(&bar(start, end), 1, Some(ModePlane::In));
            assert_near(effect.shear, shear * unit, 0.02);
            assert_near(effect.rotary, rotary * unit, 0.02);
        }
    }

    /// Tension stiffens a rod without shear: the mode of a pinned rod under a force along it stays a sine, and so do the
    /// terms of shear and rotation over its larger squared frequency, 1 + T L^2/(pi^2 E I) times that without.
    #[test]
    fn tension_does_not_change_the_shear_term() {
        let mut scene = bar(Support::Pinned, Support::Roller);
        let bending = 205e9 * 0.02 * 0.01_f64.powi(3) / 12.0;
        let force = 0.3 * bending * (std::f64::consts::PI / LENGTH).powi(2);
        let along = [force, 0.0, 0.0];
        scene.loads.point = vec![PointForce {
            node: Point::Tip,
            force: along,
            moment: [0.0; 3],
            follower: false,
            signal: None,
        }];
        let among = ModeFilter {
            plane: Some(ModePlane::In),
            kind: Some(ModeKind::Bending),
            direction: None,
        };
        let names = [ModeName { number: 1, among }];
        let problem = scene.problem().unwrap();
        let effect =
            thickness_effects(&problem, &names, LinearizationPoint::Equilibrium).unwrap()[0];
        let k = std::f64::consts::PI / LENGTH;
        let unit = 0.01_f64.powi(2) / 12.0 * k * k;
        // The force makes it longer by 0.25 %.
        assert_near(effect.shear, unit / 1.3, 0.015);
        assert_near(effect.rotary, unit, 0.015);
    }

    /// ASTM E1876: T1 of a bar with thickness/length = 0.1 is 1.0707 at nu = 0.29, and the squared frequency is that of
    /// the slender bar over it. The first-order term alone is 1.0718.
    #[test]
    fn free_bar_correction_agrees_with_astm_e1876() {
        let scene = bar(Support::Free, Support::Free);
        let kappa = scene.rod.section.shear_coefficient(0.29);
        let effect = effect_on(&scene, 1, Some(ModePlane::In));
        let reduction = effect.reduction(2.0 * 1.29 / kappa);
        assert!((reduction - 0.0718).abs() < 1e-3, "{reduction}");
    }
}
