//! Second derivatives of a trajectory, by running it again in second-order dual numbers.
//!
//! A hyper-dual number carries the derivatives along two directions and the mixed one. The run
//! follows the steps of one in plain numbers, which decides where steps are halved.

use crate::dynamics::trajectory::{Motion, Trajectory};
use crate::error::Error;
use crate::problem::Model;
use crate::problem::{AnyProblem, Posed, Problem};
use crate::scene::Parameter;
use crate::statics::nodes_over;
use num_dual::HyperDual64;

/// The parts of a hyper-dual number after the real one.
const PARTS: [fn(&HyperDual64) -> f64; 4] = [|x| x.re, |x| x.eps1, |x| x.eps2, |x| x.eps1eps2];

/// Repeats the run of `plain` with the parameters that `seed` makes. The result's derivatives are
/// the first along both directions, and the mixed second; `pair` names the directions.
pub(crate) fn repeat(
    problem: &Problem,
    plain: &Trajectory,
    pair: [Parameter; 2],
    seed: impl Fn(Parameter, f64) -> HyperDual64,
) -> Result<Trajectory, Error> {
    match problem.posed() {
        AnyProblem::Planar(posed) => repeat_posed(&posed, plain, pair, seed),
        AnyProblem::Spatial(posed) => repeat_posed(&posed, plain, pair, seed),
    }
}

/// The rod of [`Trajectory::at_rest`] again, with the parameters that `seed` makes: derivatives as
/// those of [`repeat`].
pub(crate) fn rest(
    problem: &Problem,
    plain: &Trajectory,
    pair: [Parameter; 2],
    seed: impl Fn(Parameter, f64) -> HyperDual64,
) -> Result<Trajectory, Error> {
    match problem.posed() {
        AnyProblem::Planar(posed) => rest_posed(&posed, plain, pair, seed),
        AnyProblem::Spatial(posed) => rest_posed(&posed, plain, pair, seed),
    }
}

fn rest_posed<M: Model<W>, const W: usize>(
    posed: &Posed<'_, M, W>,
    plain: &Trajectory,
    [one, two]: [Parameter; 2],
    seed: impl Fn(Parameter, f64) -> HyperDual64,
) -> Result<Trajectory, Error> {
    let mut record = plain.emptied(&[one, two, two]);
    let tracked = plain.tracked();
    let nodes = nodes_over(posed, &posed.settled()?, tracked, seed)?;
    record.push(0.0, |k, node| {
        let place = tracked.binary_search(&node).expect("records go over the tracked nodes");
        [nodes[place].map(|x| PARTS[k](&x)), [0.0; 3]]
    });
    Ok(record)
}

fn repeat_posed<M: Model<W>, const W: usize>(
    posed: &Posed<'_, M, W>,
    plain: &Trajectory,
    [one, two]: [Parameter; 2],
    seed: impl Fn(Parameter, f64) -> HyperDual64,
) -> Result<Trajectory, Error> {
    let mut record = plain.emptied(&[one, two, two]);
    let mut simulation = posed.simulation_over(seed)?;
    let mut ends = plain.times().iter();
    let mut next = ends.next();
    let mut part = Vec::new();
    for time in std::iter::once(None).chain(plain.taken().iter().map(Some)) {
        if let Some(time) = time {
            simulation.step_to(*time)?;
        }
        let state = simulation.state();
        if next == Some(&state.time) {
            let parts = |x: &[HyperDual64]| PARTS.map(|part| x.iter().map(part).collect());
            part.clear();
            let (q, v): ([Vec<f64>; 4], [Vec<f64>; 4]) = (parts(&state.q), parts(&state.v));
            part.extend(q.into_iter().zip(v));
            record.push(state.time, |k, node| -> Motion {
                let (q, v) = &part[k];
                let position = if k == 0 { M::position::<f64> } else { M::rate::<f64> };
                [position(posed.model, q, node), posed.model.rate(v, node)]
            });
            next = ends.next();
        }
    }
    Ok(record)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Point;
    use crate::scene::{Handedness, Material, Scene, Section, Shape};

    fn helix() -> Scene {
        let shape = Shape::Helix {
            length: 0.3,
            radius: 0.02,
            pitch: 0.05,
            axis: [0.0, 0.0, -1.0],
            handedness: Handedness::Left,
        };
        let material = Material { poisson_ratio: Some(0.4), ..Material::new(1200.0, 1e7) };
        let mut scene = Scene::new(16, shape, Section::Circle { radius: 4e-3 }, material);
        scene.loads.gravity = [0.0, 0.0, -9.8];
        scene
    }

    /// Second derivatives of the place of rest against differences of the first.
    #[test]
    fn rods_at_rest() {
        let mut arc = helix();
        arc.rod.shape = Shape::Arc { length: 0.3, angle: 1.0 };
        arc.loads.gravity = [0.0, -9.8, 0.0];
        for scene in [helix(), arc] {
            let problem = scene.problem().unwrap();
            let tip = problem.nodes() - 1;
            let plain = Trajectory::at_rest(&problem, &[tip], &[]).unwrap();
            for pair in [
                [Parameter::YoungsModulus, Parameter::YoungsModulus],
                [Parameter::YoungsModulus, Parameter::Density],
                [Parameter::YoungsModulus, Parameter::NaturalCurvature],
                [Parameter::NaturalCurvature, Parameter::NaturalCurvature],
                [Parameter::ClampAngle, Parameter::YoungsModulus],
            ] {
                let [one, two] = pair;
                if one.of(&scene).is_none()
                    || problem.planar().is_none() && one == Parameter::ClampAngle
                {
                    continue;
                }
                let along = |p: Parameter, q: Parameter| f64::from(u8::from(p == q));
                let seed = |p, value| HyperDual64::new(value, along(p, one), along(p, two), 0.0);
                let run = rest(&problem, &plain, pair, seed).unwrap();
                let (_, [_, _, both]) = run
                    .at(Point::Tip, 0.0)
                    .map(|(x, d)| (x, <[_; 3]>::try_from(d).unwrap()))
                    .unwrap();
                let value = two.of(&scene).unwrap();
                let h = 2e-3 * value;
                let slope = |k: f64| {
                    let other = problem.with([(two, value + k * h)]).unwrap();
                    let run = Trajectory::at_rest(&other, &[tip], &[one]).unwrap();
                    run.at(Point::Tip, 0.0).unwrap().1[0]
                };
                let [a, b, c, d] = [1.0, -1.0, 2.0, -2.0].map(slope);
                let (mut off, mut size) = (0.0_f64, 0.0_f64);
                for i in 0..3 {
                    let difference = (8.0 * (a[i] - b[i]) - (c[i] - d[i])) / (12.0 * h);
                    off = off.max((both[i] - difference).abs());
                    size = size.max(difference.abs());
                }
                println!("{one}, {two}: {:.1e}", off / size);
                assert!(off < 1e-7 * size, "{one}, {two}: {both:?} {off:e} {size:e}");
            }
        }
    }
}
