//! Explicit schemes and Rodas4: gradients within a step, orders, energy, momenta, reversibility and limits of stability.

use rodfit::numerics::tangent::Tangent;
use rodfit::problem::Model;
use rodfit::rod::Rod;
use rodfit::scene::{Clamp, PointForce, Scene, Scheme, Section, Support, Time};
use rodfit::{AnyProblem, Derivatives, Discretized, Error, Problem, Trajectory};

use crate::common::{cantilever, helix_with, planar};

use Scheme::{Pefrl, Rodas4, Verlet};

/// The scene with this scheme, end and step, s.
fn with_scheme(mut scene: Scene, scheme: Scheme, end: f64, step: f64) -> Scene {
    scene.time = Some(Time { scheme, ..Time::new(end, step) });
    scene
}

/// A twisted helix of another section than a circle's.
fn twisted() -> Scene {
    let mut scene = helix_with(0.5, 1e-3, 0.1, Clamp::MidEdge);
    scene.rod.section = Section::Rectangle { width: 0.01, height: 0.004, up: [1.0, 0.3, 0.0] };
    scene.rod.natural_curvature = 0.7.into();
    scene
}

/// The gradient in one sweep with the frames moved along is the gradient after moving them; and
/// both are those of num-dual, and of the tangent's sweep.
#[test]
fn gradients_of_all_ways_agree() {
    let mut turned = cantilever();
    turned.loads.point = vec![PointForce { moment: [0.0, 0.0, 0.02], ..PointForce::default() }];
    for scene in [cantilever(), turned, twisted()] {
        match scene.problem().unwrap().discretized() {
            AnyProblem::Planar(discretized) => gradients_agree(&discretized),
            AnyProblem::Spatial(discretized) => gradients_agree(&discretized),
        }
    }
}

/// Requires that the gradient after 100 steps is the same by hand, by dual numbers, with fixed frames, and together with the
/// tangent.
fn gradients_agree<M: Model>(discretized: &Discretized<'_, M>) {
    let mut simulation = discretized.simulation().unwrap();
    for k in 1..=100 {
        simulation.step_to(f64::from(k) * 2e-4).unwrap();
    }
    let rod = discretized.rod();
    let (q, start) = (&simulation.state().q, &simulation.previous().frames);
    let zero = vec![0.0; q.len()];
    let moved = |derivatives| {
        let (mut gradient, mut frames) = (zero.clone(), start.clone());
        rod.moved_gradient(q, &mut frames, derivatives, &mut gradient);
        (gradient, frames)
    };
    let (hand, frames) = moved(Derivatives::Hand);
    let (dual, _) = moved(Derivatives::Dual);
    let (mut apart, mut swept) = (zero.clone(), zero.clone());
    rod.gradient(q, &frames, Derivatives::Hand, &mut apart);
    let mut tangent = rod.zero_tangent();
    rod.tangent(q, &frames, Derivatives::Hand, &mut swept, &mut tangent);
    let mut size = zero.clone();
    tangent.absolute_product(q, &mut size);
    let mut worst = 0.0_f64;
    for i in 0..q.len() {
        for other in [&dual, &apart, &swept] {
            worst = worst.max((hand[i] - other[i]).abs() / (size[i] + 1e-300));
        }
    }
    println!("gradients differ by {worst:.1e} of their terms");
    // All ways compute the same sums: rounding errors of their terms.
    assert!(worst < 1e-15, "{worst:e}");
}

/// The problem of a scene and its run.
fn simulate(scene: &Scene) -> (Problem, Trajectory) {
    let problem = scene.problem().unwrap();
    let run = problem.simulate().unwrap();
    (problem, run)
}

/// Observed orders between three halvings, against a much finer run of another scheme.
fn orders(scene: &Scene, scheme: Scheme, end: f64, h: f64) -> [f64; 2] {
    let steps = [h, h / 2.0, h / 4.0];
    let tip = |scheme, h| {
        let (_, run) = simulate(&with_scheme(scene.clone(), scheme, end, h));
        run.tip(run.times().len() - 1)
    };
    let exact = tip(Pefrl, 1e-5);
    let errors = steps.map(|h| {
        let x = tip(scheme, h);
        (0..3).map(|c| (x[c] - exact[c]).powi(2)).sum::<f64>().sqrt()
    });
    println!("{scheme:?}: errors {errors:?}");
    [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()]
}

/// A coarse, soft rod: the steps resolve every vibration it has.
fn smooth(mut scene: Scene, segments: usize) -> Scene {
    scene.rod.segments = Some(segments);
    scene.material.youngs_modulus = 1e6;
    scene.loads.damping.mass = 3.0;
    scene
}

#[test]
fn order_in_the_step_equals_that_of_the_scheme() {
    let (cantilever, helix) = (cantilever(), helix_with(0.5, 1e-3, 0.1, Clamp::MidEdge));
    for (name, scene) in [("plane", smooth(cantilever, 6)), ("space", smooth(helix, 12))] {
        for (scheme, end, h, order) in
            [(Verlet, 0.24, 1e-3, 2.0), (Pefrl, 0.24, 2e-3, 4.0), (Rodas4, 0.05, 2e-3, 4.0)]
        {
            let found = orders(&scene, scheme, end, h);
            println!("{name}, {scheme:?}: orders {found:.2?}");
            // In space rodas4 at its smallest step shows the first-order error of its frames, 1e-12 m.
            let shown = if (name, scheme) == ("space", Rodas4) { &found[..1] } else { &found[..] };
            assert!(shown.iter().all(|p| (p - order).abs() < 0.2), "{name} {scheme:?}: {found:?}");
        }
    }
}

/// Largest change of the total energy over the largest kinetic energy, and the change at the end.
fn drift(scene: &Scene) -> [f64; 2] {
    let problem = scene.problem().unwrap();
    let mut report = rodfit::dynamics::SimulationReport::new(&problem);
    let mut run = Trajectory::new(&problem, &[], &[]).unwrap();
    run.run(&problem, problem.time().unwrap().steps(), |now| report.push(&problem, now)).unwrap();
    let total = |e: &[f64; 6]| e[1..].iter().sum::<f64>();
    let kinetic = report.energy.iter().map(|e| e[1]).fold(0.0, f64::max);
    let change = total(report.energy.last().unwrap()) - total(&report.energy[0]);
    [report.energy_drift(), change / kinetic]
}

/// Errors of the energy oscillate without growth: after 5 s they are below twice those after 1 s.
#[test]
fn explicit_schemes_keep_the_energy() {
    let helix = helix_with(0.5, 1e-3, 1.0, Clamp::MidEdge);
    for (name, scene, steps) in
        [("cantilever", cantilever(), [3.4e-5, 5e-5]), ("helix", helix, [1.1e-4, 1.6e-4])]
    {
        for (scheme, step, most) in [(Verlet, steps[0], 2e-5), (Pefrl, steps[1], 2e-6)] {
            let [short, _] = drift(&with_scheme(scene.clone(), scheme, 1.0, step));
            let [long, end] = drift(&with_scheme(scene.clone(), scheme, 5.0, step));
            println!(
                "{name}, {scheme:?}, {step:e} s: energy off by {short:.1e}, {long:.1e} in 5 s, {end:.1e} at its end"
            );
            assert!(long < most && long < 2.0 * short, "{name} {scheme:?}: {short:e} {long:e}");
        }
    }
}

/// Rodas4 conserves energy within its local error at two steps.
#[test]
fn rodas4_nearly_keeps_the_energy() {
    for (step, most) in [(1e-3, 2e-5), (2.5e-3, 2e-3)] {
        let [largest, end] = drift(&with_scheme(cantilever(), Rodas4, 5.0, step));
        println!("Rodas4, {step:e} s: energy off by {largest:.1e}, {end:.1e} at the end");
        assert!(largest < most, "{largest:e} {end:e}");
    }
}

/// A free rod that flies, turns and bends, in its plane: linear and angular momentum.
#[test]
fn a_free_rod_keeps_its_momenta() {
    for (scheme, step, turns_too) in
        [(Verlet, 3e-5, true), (Pefrl, 5e-5, true), (Rodas4, 1e-3, false)]
    {
        let mut scene = with_scheme(cantilever(), scheme, 0.2, step);
        scene.supports.start = Support::Free;
        scene.loads.gravity = [0.0; 3];
        let problem = scene.problem().unwrap();
        let mut simulation = planar(&problem).simulation().unwrap();
        let n = problem.nodes();
        let v: Vec<f64> = (0..n).flat_map(|i| [0.3, (5.0 * i as f64 / n as f64).sin()]).collect();
        simulation.set_velocity(&v);
        let rod = planar(&problem).rod();
        let momenta = |q: &[f64], v: &[f64]| {
            let sum = |term: &dyn Fn(usize) -> f64| (0..n).map(term).sum::<f64>();
            let at =
                |i: usize| (rod.mass[2 * i], [q[2 * i], q[2 * i + 1]], [v[2 * i], v[2 * i + 1]]);
            [
                sum(&|i| at(i).0 * at(i).2[0]),
                sum(&|i| at(i).0 * at(i).2[1]),
                sum(&|i| at(i).0 * (at(i).1[0] * at(i).2[1] - at(i).1[1] * at(i).2[0])),
            ]
        };
        let start = momenta(&simulation.state().q, &simulation.state().v);
        let time = problem.time().unwrap();
        for k in 1..=time.steps() {
            simulation.step_to(time.at(k)).unwrap();
        }
        let end = momenta(&simulation.state().q, &simulation.state().v);
        let change: Vec<f64> = (0..3).map(|c| (end[c] / start[c] - 1.0).abs()).collect();
        println!("{scheme:?}: momenta change by {change:?}");
        // Symplectic schemes conserve linear momentum up to rounding errors.
        assert!(change[0] < 1e-12 && change[1] < 1e-12, "{scheme:?}: {change:?}");
        assert!(!turns_too || change[2] < 1e-12, "{scheme:?}: {change:?}");
    }
}

/// The symmetric schemes find back when all velocities are turned round.
#[test]
fn explicit_schemes_run_backwards() {
    let mut helix = twisted();
    helix.loads.gravity = [0.0, -9.8, -3.0];
    for scene in [cantilever(), helix] {
        for (scheme, step) in [(Verlet, 2e-5), (Pefrl, 3e-5)] {
            let problem = with_scheme(scene.clone(), scheme, 0.1, step).problem().unwrap();
            match problem.discretized() {
                AnyProblem::Planar(discretized) => runs_backwards(&discretized, step),
                AnyProblem::Spatial(discretized) => runs_backwards(&discretized, step),
            }
        }
    }
}

/// Requires that 1000 steps forward and as many with reversed velocity lead back to the start.
fn runs_backwards<M: Model>(discretized: &Discretized<'_, M>, step: f64) {
    let mut simulation = discretized.simulation().unwrap();
    let start = simulation.state().q.clone();
    for k in 1..=1000 {
        simulation.step_to(f64::from(k) * step).unwrap();
    }
    let farthest = |q: &[f64]| {
        let apart = |i| {
            let (a, b) = (discretized.model.position(q, i), discretized.model.position(&start, i));
            (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
        };
        (0..discretized.nodes()).map(apart).fold(0.0, f64::max)
    };
    let away = farthest(&simulation.state().q);
    let back: Vec<f64> = simulation.state().v.iter().map(|v| -v).collect();
    simulation.set_velocity(&back);
    for k in 1001..=2000 {
        simulation.step_to(f64::from(k) * step).unwrap();
    }
    let left = farthest(&simulation.state().q);
    println!("{away:.1e} m away, and back to {left:.1e} m");
    // Symmetric schemes are reversible: rounding errors, grown along the way.
    assert!(away > 1e-4 && left < 1e-9 * away, "{away:e} {left:e}");
}

/// Steps of 100 ms end in all schemes with a complete run or a named error: Verlet and PEFRL reject the step. All recorded
/// positions are within the reach of the rod.
#[test]
fn steps_of_100_ms() {
    for (name, scene) in
        [("cantilever", cantilever()), ("helix", helix_with(0.5, 0.1, 1.0, Clamp::MidEdge))]
    {
        for scheme in [
            Scheme::NewmarkBeta,
            Scheme::AverageVectorField,
            Scheme::Verlet,
            Scheme::Pefrl,
            Scheme::Rodas4,
        ] {
            let problem = with_scheme(scene.clone(), scheme, 1.0, 0.1).problem().unwrap();
            let mut run = Trajectory::new(&problem, &[problem.nodes() - 1], &[]).unwrap();
            let outcome = run.run(&problem, 10, |_| {});
            let recorded = run.times().len();
            println!(
                "{name}, {scheme:?}: {recorded} of 11 states, {} steps, {outcome:?}",
                run.work().steps
            );
            for k in 0..recorded {
                // The rod is 0.5 m long: no recorded state is beyond its reach.
                assert!(run.tip(k).iter().all(|x| x.is_finite() && x.abs() < 0.6), "{scheme:?}");
            }
            match (scheme, outcome) {
                (Verlet | Pefrl, Err(Error::Invalid { key, .. })) => assert_eq!(key, "time.step"),
                (Verlet | Pefrl, outcome) => panic!("{scheme:?}: {outcome:?}"),
                (_, Ok(())) => assert_eq!(recorded, 11),
                (_, Err(Error::Newton { .. } | Error::EnergyGrowth { .. })) => {}
                (_, Err(other)) => panic!("{scheme:?}: {other}"),
            }
        }
    }
}

/// A thick rod of five edges, which stiffens as it folds, at steps up to the largest stable one of its start. Step control
/// stops the growth of the energy, and the recorded states stay sound.
#[test]
fn a_rod_that_stiffens_beyond_its_step() {
    let mut scene = with_scheme(cantilever(), Verlet, 2.0, 1e-3);
    scene.rod.segments = Some(5);
    scene.rod.section = Section::Circle { radius: 0.1 };
    scene.material.youngs_modulus = 2e4;
    scene.loads.gravity = [0.0, -20.0, 0.0];
    let largest = planar(&scene.problem().unwrap()).largest_step().unwrap().unwrap();
    let mut troubled = false;
    for part in [0.4, 0.999] {
        scene.time.as_mut().unwrap().step = Some(part * largest);
        let problem = scene.problem().unwrap();
        let mut report = rodfit::dynamics::SimulationReport::new(&problem);
        let mut run = Trajectory::new(&problem, &[problem.nodes() - 1], &[]).unwrap();
        let steps = problem.time().unwrap().steps();
        let outcome = run.run(&problem, steps, |now| report.push(&problem, now));
        println!(
            "{part}: {} of {steps} steps, {} taken, energy off by {:.1e}, {outcome:?}",
            run.times().len() - 1,
            run.work().steps,
            report.energy_drift()
        );
        assert!(report.energy.iter().flatten().all(|x| x.is_finite()));
        // Step control looks at every 32nd step, and stops a run that is off by a tenth.
        assert!(report.energy_drift() < 0.5, "{part}: {}", report.energy_drift());
        troubled |= outcome.is_err() || run.work().steps > steps;
        assert!(troubled == (part > 0.9), "{part}");
    }
    scene.time.as_mut().unwrap().step = Some(1.001 * largest);
    let error = scene.problem().unwrap().simulate().map(|_| ()).expect_err("above the largest");
    assert!(error.to_string().starts_with("time.step: found"), "{error}");
}
