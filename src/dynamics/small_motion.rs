//! Small motions of a rod about where it starts.
//!
//! Displacements `u` from there have the forces `g + K u`, with gradient and tangent at the start, and the same masses and damping.
//! In steps of one length the matrix of a [step](crate::dynamics::coefficients) is then always the same: one factorisation serves
//! them all, and a step takes one solve. Its solution says what `K` times the change is, too:
//! the forces need no other product.
//!
//! What mesh and step are off by, a large motion shares with the small one under the same sudden loads: both are off by where the
//! higher modes are on their way. [A resolution](crate::resolution) is found by that.

use crate::dynamics::coefficients::StepCoefficients;
use crate::dynamics::record::Record;
use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::banded::{BandMatrix, Ldlt};
use crate::problem::{AnyProblem, Discretized, Model, Problem};
use crate::rod::Rod;
use crate::scene::Scheme;

impl Problem {
    /// The nodes `tracked`, ascending, in the small motion from the scene's start, by generalised-alpha, in as many steps of one
    /// length as the scene has. Of damping there are mass and stiffness, of loads those that are constant.
    ///
    /// # Errors
    /// Those of a [simulation at the start](Discretized::simulation), and [`Error::SingularTangent`].
    pub(crate) fn small_motion(&self, tracked: &[usize]) -> Result<Record, Error> {
        match self.discretized() {
            AnyProblem::Planar(planar) => planar.small_motion(tracked),
            AnyProblem::Spatial(spatial) => spatial.small_motion(tracked),
        }
    }
}

impl<M: Model<W>, const W: usize> Discretized<'_, M, W> {
    fn small_motion(&self, tracked: &[usize]) -> Result<Record, Error> {
        let time = self.problem.time()?;
        let (steps, h) = (time.steps(), time.end / time.steps() as f64);
        let start = self.simulation()?;
        let (state, mass, free) = (start.state(), start.rod().mass(), self.free());
        let (n, damping) = (state.q.len(), start.damping());
        let (mut gradient, mut tangent) = (vec![0.0; n], BandMatrix::zeros(n));
        let derivatives = Derivatives::Hand;
        start.rod().tangent(&state.q, &state.frames, derivatives, &mut gradient, &mut tangent);

        let coefficients =
            StepCoefficients::new(Scheme::GeneralisedAlpha, time.parameter(), true, h);
        let inertial = 1.0 + coefficients.end * damping.mass * coefficients.damped_velocity_slope();
        let elastic = coefficients.end * coefficients.viscous_factor(damping.stiffness);
        let mut factors = Ldlt::with_order(n);
        factors
            .factor_sum(mass, inertial, &tangent, elastic, free.clone())
            .map_err(|singular| Error::SingularTangent { time: 0.0, row: singular.row })?;

        let (mut q, mut v, mut a) = (state.q.clone(), state.v.clone(), vec![0.0; n]);
        free.clone().for_each(|i| a[i] = -gradient[i] / mass[i] - damping.mass * v[i]);
        // The elastic forces with the loads, and those of the rates of strain in the step before.
        let (mut forces, mut viscous) = (gradient, vec![0.0; n]);
        let mut change = vec![0.0; n];
        let (mass, rate) = (&mass[free.clone()], damping.stiffness / h);
        let mut record = Record::new(tracked, 0);
        for k in 0..=steps {
            let motion = |i: &usize| [self.model.position(&q, *i), self.model.rate(&v, *i)];
            record
                .push(if k < steps { k as f64 * h } else { time.end }, tracked.iter().map(motion));
            if k == steps {
                break;
            }
            // Over slices of one length loops need not look at their ends.
            let count = free.len();
            let [q, v, a, forces, viscous] = [&mut q, &mut v, &mut a, &mut forces, &mut viscous]
                .map(|list| &mut list[free.clone()][..count]);
            for i in 0..count {
                let damped = |v: f64| damping.mass * mass[i] * v;
                let before = forces[i] + viscous[i] + damped(v[i]);
                let past = coefficients.viscous_past(0.0, viscous[i]);
                let after = forces[i] - past + damped(coefficients.velocity(0.0, v[i], a[i]));
                viscous[i] = -coefficients.residual(mass[i], 0.0, [v[i], a[i]], after, before);
            }
            // The right-hand sides are of use once more.
            let sides = viscous;
            change[free.clone()].copy_from_slice(sides);
            factors.solve(&mut change);
            let change = &change[free.clone()][..count];
            for i in 0..count {
                let stiff = (sides[i] - inertial * mass[i] * change[i]) / elastic;
                forces[i] += stiff;
                sides[i] = rate * stiff;
                let before = [v[i], a[i]];
                q[i] += change[i];
                v[i] = coefficients.velocity(change[i], before[0], before[1]);
                a[i] = coefficients.acceleration_at_end(change[i], [before[0], v[i]], before[1]);
            }
        }
        Ok(record)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::Trajectory;
    use crate::scene::{
        Handedness, InitialState, Material, Point, PointForce, Scene, Section, Shape, Time,
    };

    /// A simulation under loads that bend the rod by a few millionths of its length does the same, step for step.
    #[test]
    fn small_motions_are_those_of_a_simulation_under_small_loads() {
        let length = 0.5;
        let straight = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
        let arc = Shape::Arc { length, angle: 2.0 };
        let helix = Shape::Helix {
            length: 0.3,
            radius: 0.02,
            pitch: 0.05,
            axis: [0.0, 0.0, -1.0],
            handedness: Handedness::Left,
        };
        for (shape, spatial) in [(straight, false), (arc, false), (helix, true)] {
            for (mass, stiffness, plucked) in
                [(0.0, 0.0, false), (3.0, 0.0, false), (0.0, 2e-3, false), (1.0, 1e-3, true)]
            {
                let material = Material { poisson_ratio: Some(0.3), ..Material::new(1273.52, 1e8) };
                let section = Section::Circle { radius: 0.005 };
                let mut scene = Scene::new(12, shape.clone(), section, material);
                let small = 1e-6;
                scene.loads.gravity =
                    [0.0, -9.8 * small, 3.0 * small * f64::from(u8::from(spatial))];
                (scene.loads.damping.mass, scene.loads.damping.stiffness) = (mass, stiffness);
                if plucked {
                    let force = [0.0, 0.1 * small, 0.0];
                    let point = PointForce { node: Point::Tip, force, moment: [0.0; 3] };
                    (scene.initial.state, scene.initial.point) =
                        (InitialState::Equilibrium, vec![point]);
                }
                let mut time = Time::new(1.0, 5e-3);
                time.scheme = Scheme::GeneralisedAlpha;
                (time.rho_inf, time.tolerance) = (0.8, crate::scene::Tolerance::Predicted(1e-13));
                scene.time = Some(time);
                let problem = scene.problem().unwrap();
                assert_eq!(problem.planar().is_none(), spatial);
                let tip = problem.nodes() - 1;
                let mut run = Trajectory::new(&problem, &[tip], &[]).unwrap();
                run.run(&problem, 200, |_| {}).unwrap();
                let small = problem.small_motion(&[tip]).unwrap();
                assert_eq!(small.times().len(), 201);
                let place = |record: &Record, k: usize| record.motion_of(tip, k).unwrap()[0];
                let far = |a: [f64; 3], b: [f64; 3]| {
                    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
                };
                let start = place(&small, 0);
                let (mut largest, mut apart) = (0.0_f64, 0.0_f64);
                for k in 0..=200 {
                    largest = largest.max(far(place(&small, k), start));
                    apart = apart.max(far(place(&small, k), place(run.record(), k)));
                }
                let case = format!("{spatial} {mass} {stiffness} {plucked}");
                assert!(largest > 1e-9, "{case}: {largest:e}");
                assert!(apart < 1e-4 * largest, "{case}: {apart:e} of {largest:e}");
            }
        }
    }
}
