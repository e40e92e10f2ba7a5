//! Reductions of the frequencies of named modes by shear deformation and rotary inertia, for a check of fits.
//!
//! Input: names of modes of a problem, and the state about which they vibrate. Output of [`thickness_effects`]: the
//! relative reductions of their squared frequencies, by shear (for `E/(kappa G) = 1`) and by rotary inertia
//! ([`ThicknessEffect`]), in the order of the names. Errors are those of the equilibrium, a mode without stiffness, and
//! a number above that of the modes.

use crate::error::Error;
use crate::numerics::tangent::Tangent;
use crate::problem::{AnyProblem, Model, Problem};
use crate::vibration::frequencies::find_named_modes;
use crate::vibration::mode::{LinearizationPoint, ModePlane};
use crate::vibration::modes::{VibratingRod, linearization_state, spatial_state};
use crate::vibration::name::ModeName;
use crate::vibration::timoshenko::{ThicknessEffect, VibrationState};

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
    /// relative reductions of their squared frequencies. Errors are those of [`find_named_modes`].
    fn add_effects(
        &self,
        names: &[ModeName],
        places: &[usize],
        effects: &mut [ThicknessEffect],
    ) -> Result<(), Error> {
        let own: Vec<ModeName> = places.iter().map(|k| names[*k]).collect();
        let state = VibrationState {
            discretized: self.discretized,
            setup: self.discretized.setup,
            q: self.q,
            frames: self.frames,
            pencil: &self.pencil,
            plane: self.plane,
        };
        for (place, pair) in places.iter().zip(find_named_modes(self, &own, false)?) {
            effects[*place] = state.thickness_effect(pair.squared, &pair.vector);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Dimension, Material, Point, PointForce, Scene, Section, Shape, Support};
    use crate::vibration::mode::ModeKind;
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
        thickness_effects(&problem, &[ModeName::new(number, among)], LinearizationPoint::Rest)
            .unwrap()[0]
    }

    fn assert_near(found: f64, expected: f64, tolerance: f64) {
        assert!((found / expected - 1.0).abs() < tolerance, "{found} {expected}");
    }

    /// Exact for any mode: (I/A) k^2 by shear at E = kappa G and as much by rotary inertia, k = n pi/L; out of the
    /// plane the width is the height.
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
    /// force is the slope of a clamped one's, 12.303; 4.648 of a cantilever, 12.303 and 49.481 of one held at both
    /// ends.
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

    /// Tension stiffens a rod without shear: the mode of a pinned rod under a force along it stays a sine, and so do
    /// the terms of shear and rotation over its larger squared frequency, 1 + T L^2/(pi^2 E I) times that without.
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
        let names = [ModeName::new(1, among)];
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
    /// the slender bar over it.
    #[test]
    fn free_bar_factor_agrees_with_astm_e1876() {
        let scene = bar(Support::Free, Support::Free);
        let effect = effect_on(&scene, 1, Some(ModePlane::In));
        let factor = effect.factor(scene.rod.section.shear_flexibility(0.29));
        assert!((factor - 1.0707).abs() < 3e-4, "{factor}");
    }
}
