//! Conservation and dissipation of energy, order in the step, and damping, against theory.

use rodfit::dynamics::SimulationReport;
use rodfit::problem::Model;
use rodfit::scene::{
    Clamp, Friction, Initial, InitialState, Material, Motion, PointForce, Scene, Scheme, Section,
    Shape, StepTolerance, Support, Time,
};
use rodfit::{Error, Problem, Trajectory};

use crate::common::{
    at_tip, cantilever, cantilever_with, extremum, helix_with, planar, straight_rod,
};

/// Largest change of the total energy over the largest kinetic energy.
pub fn drift(scene: &Scene) -> f64 {
    let problem = scene.problem().unwrap();
    let time = problem.time().unwrap();
    let mut simulation = planar(&problem).simulation().unwrap();
    let start = simulation.energies().total();
    let (mut change, mut kinetic) = (0.0_f64, 0.0_f64);
    for k in 1..=time.steps() {
        simulation.step_to(time.at(k)).unwrap();
        let energies = simulation.energies();
        change = change.max((energies.total() - start).abs());
        kinetic = kinetic.max(energies.kinetic);
    }
    change / kinetic
}

#[test]
fn newmark_with_beta_one_half_conserves_energy() {
    for clamp in [Clamp::Nodes, Clamp::MidEdge] {
        let drift = drift(&cantilever_with(0.5, 1e-3, 5.0, clamp));
        println!("{clamp:?}: energy changes by {drift:.2e} of the largest kinetic energy in 5 s");
        // Second order without dissipation: the energy oscillates with the error of the step,
        // without a drift.
        assert!(drift < 1e-5, "{clamp:?}: {drift:e}");
    }
}

/// Where beta = 0.5 dies the average vector field keeps the energy.
#[test]
fn average_vector_field_conserves_energy() {
    let mut halved = false;
    for (clamp, step, end) in
        [(Clamp::MidEdge, 1e-2, 100.0), (Clamp::Nodes, 1e-2, 20.0), (Clamp::MidEdge, 5e-3, 20.0)]
    {
        let mut scene = cantilever_with(0.5, step, end, clamp);
        let newmark = scene.problem().unwrap().simulate();
        scene.time.as_mut().unwrap().scheme = Scheme::AverageVectorField;
        let problem = scene.problem().unwrap();
        let steps = problem.time().unwrap().steps();
        let mut report = rodfit::dynamics::SimulationReport::new(&problem);
        let mut run = rodfit::Trajectory::new(&problem, &[], &[]).unwrap();
        run.run(&problem, steps, |now| report.push(&problem, now)).unwrap();
        let (drift, taken) = (report.energy_drift(), run.work().steps);
        println!(
            "{clamp:?}, {step} s: {drift:.1e} of the largest kinetic energy in {end} s, {taken} steps for {steps}"
        );
        // The average vector field conserves energy up to the tolerance of Newton's method.
        assert!(drift < 1e-9, "{clamp:?}: {drift:e}");
        // Steps that Newton's method cannot solve, or whose rotations are too large for the
        // quadrature, are taken in halves; they are few.
        assert!(taken < steps + steps / 8, "{taken}");
        halved |= taken > steps;
        // Newmark-beta says what went wrong, and when.
        let error = newmark.map(|_| ()).expect_err("energy grows at these steps");
        assert!(matches!(error, rodfit::Error::EnergyGrowth { .. }), "{error}");
    }
    assert!(halved, "one of these runs has such a step");
}

/// `cargo test --release --test physics energy:: -- --ignored --nocapture`; a slice of it runs above
/// and in `direct`.
#[test]
#[ignore = "a minute"]
fn a_million_steps_without_drift() {
    for (scheme, step, most) in [
        (Scheme::AverageVectorField, 1e-3, 1e-10),
        (Scheme::Pefrl, 5e-5, 1e-11),
        (Scheme::Verlet, 3.3e-5, 1e-7),
    ] {
        let mut scene = cantilever();
        scene.time = Some(Time { scheme, ..Time::new(1e6 * step, step) });
        let problem = scene.problem().unwrap();
        let mut run = rodfit::Trajectory::new(&problem, &[], &[]).unwrap();
        let (mut start, mut kinetic) = (None, 0.0_f64);
        // The largest change in each fifth of the run.
        let (mut changes, mut k) = ([0.0_f64; 5], 0);
        run.run(&problem, 1_000_000, |now| {
            if k % 10 == 0 {
                let e = now.energies();
                kinetic = kinetic.max(e.kinetic);
                let change = e.total() - *start.get_or_insert(e.total());
                let part = &mut changes[(k / 200_000).min(4)];
                *part = part.max(change.abs());
            }
            k += 1;
        })
        .unwrap();
        let parts = changes.map(|change| change / kinetic);
        println!("{scheme:?}, {step} s: largest change of the energy in each fifth {parts:?}");
        assert!(parts.iter().all(|part| *part < most), "{scheme:?}: {parts:?}");
    }
}

/// A free flying, bending rod keeps its momentum: no support, no load.
#[test]
fn free_rod_conserves_momentum() {
    let mut scene = cantilever_with(0.5, 1e-3, 0.2, Clamp::MidEdge);
    scene.supports.start = rodfit::scene::Support::Free;
    scene.loads.gravity = [0.0; 3];
    let problem = scene.problem().unwrap();
    let mut simulation = planar(&problem).simulation().unwrap();
    let n = problem.nodes();
    let v: Vec<f64> = (0..n).flat_map(|i| [0.3, (3.0 * i as f64 / n as f64).sin()]).collect();
    simulation.set_velocity(&v);
    let momentum = |v: &[f64]| {
        let rod = planar(&problem).rod();
        [0, 1].map(|c| (0..n).map(|i| rod.mass[2 * i + c] * v[2 * i + c]).sum::<f64>())
    };
    let start = momentum(&simulation.state().v);
    for k in 1..=200 {
        simulation.step_to(k as f64 * 1e-3).unwrap();
    }
    let end = momentum(&simulation.state().v);
    for c in 0..2 {
        // Momentum is conserved up to rounding errors.
        assert!((end[c] - start[c]).abs() < 1e-12 * start[0].abs(), "{start:?} {end:?}");
    }
}

/// First mode of a clamped-free beam at s in [0, 1].
pub fn first_mode(s: f64) -> f64 {
    let b = 1.875104068711961_f64;
    let sigma = (b.cosh() + b.cos()) / (b.sinh() + b.sin());
    let x = b * s;
    (x.cosh() - x.cos()) - sigma * (x.sinh() - x.sin())
}

/// A rod set going in its first mode, without gravity: the tip's path after `end`, and its height
/// step by step.
fn swing(scene: &Scene, speed: f64, h: f64, end: f64) -> ([f64; 2], Vec<f64>) {
    let mut scene = scene.clone();
    scene.loads.gravity = [0.0; 3];
    scene.time.as_mut().unwrap().step = Some(h);
    scene.time.as_mut().unwrap().end = end;
    let problem: Problem = scene.problem().unwrap();
    let mut simulation = planar(&problem).simulation().unwrap();
    let rest = planar(&problem).rest();
    let v: Vec<f64> = (0..rest.len() / 2)
        .flat_map(|i| [0.0, speed * first_mode((rest[2 * i] / 0.5).max(0.0))])
        .collect();
    simulation.set_velocity(&v);
    let time = problem.time().unwrap();
    let mut heights = Vec::new();
    for k in 1..=time.steps() {
        simulation.step_to(time.at(k)).unwrap();
        heights.push(simulation.state().q[rest.len() - 1]);
    }
    (*simulation.state().q.last_chunk().unwrap(), heights)
}

/// Observed orders between steps h, h/2, h/4, against h/32. Six edges and steps that resolve
/// their fastest mode (axial, 7,000 rad/s), over all its 20 periods: to the scheme, the motion is
/// smooth.
fn orders(scene: &Scene, parameter: f64, scheme: Scheme) -> [f64; 2] {
    let mut scene = scene.clone();
    scene.rod.segments = Some(6);
    let (beta, rho_inf) = (parameter.max(0.5), parameter);
    scene.time = Some(Time { beta, rho_inf, scheme, ..Time::new(0.02, 1e-3) });
    let at = |h: f64| swing(&scene, 1.0, h, 0.02).0;
    let h = 2e-5;
    let exact = at(h / 32.0);
    let error = |h: f64| {
        let x = at(h);
        (x[0] - exact[0]).hypot(x[1] - exact[1])
    };
    let errors = [error(h), error(h / 2.0), error(h / 4.0)];
    [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()]
}

#[test]
fn order_in_the_step_equals_that_of_the_scheme() {
    let plain = cantilever();
    let mut damped = cantilever();
    damped.loads.damping.mass = 20.0;
    damped.loads.damping.stiffness = 2e-6;
    for (name, scene) in [("undamped", &plain), ("damped", &damped)] {
        for (parameter, scheme, order) in [
            (0.5, Scheme::NewmarkBeta, 2.0),
            (0.75, Scheme::NewmarkBeta, 1.0),
            (1.0, Scheme::NewmarkBeta, 1.0),
            (0.5, Scheme::AverageVectorField, 2.0),
            (0.0, Scheme::GeneralisedAlpha, 2.0),
            (0.5, Scheme::GeneralisedAlpha, 2.0),
            (0.9, Scheme::GeneralisedAlpha, 2.0),
        ] {
            let found = orders(scene, parameter, scheme);
            println!("{name}, {scheme:?}, {parameter}: orders {found:.3?}");
            let right = found.iter().all(|p| (p - order).abs() < 0.15);
            assert!(right, "{name} {scheme:?} {parameter}: {found:?}");
        }
    }
}

/// Small vibrations decay as exp(-damping.mass t/2), and as exp(-damping.stiffness w^2 t/2) under
/// Kelvin-Voigt damping; their frequency is the beam's.
#[test]
fn damping_and_frequency_equal_those_of_a_beam() {
    let w =
        1.875104068711961_f64.powi(2) * (1e8 * 0.005_f64.powi(2) / (4.0 * 1273.52)).sqrt() / 0.25;
    let period = std::f64::consts::TAU / w;
    let decay = |mass: f64, stiffness: f64| {
        let mut scene = cantilever();
        scene.loads.damping.mass = mass;
        scene.loads.damping.stiffness = stiffness;
        let (_, y) = swing(&scene, 1e-3, 5e-4, 3.3 * period);
        // Maxima a quarter, and two more periods after the start.
        let times: Vec<f64> = (1..=y.len()).map(|k| k as f64 * 5e-4).collect();
        let peak = |n: f64| extremum(&times, &y, [(n - 0.25) * period, (n + 0.25) * period], 1.0);
        (peak(0.25) / peak(2.25)).ln() / (2.0 * period)
    };
    let none = decay(0.0, 0.0);
    // No damping: no decay.
    assert!(none.abs() < 1e-4, "{none}");
    let mass = decay(0.4, 0.0);
    // The rate of the amplitude is half of the mass damping, 0.4 1/s.
    assert!((mass / 0.2 - 1.0).abs() < 1e-3, "{mass}");
    let eta = 4e-3;
    let viscous = decay(0.0, eta);
    // Theory: `eta w^2/2`.
    assert!((viscous / (0.5 * eta * w * w) - 1.0).abs() < 5e-3, "{viscous} {}", 0.5 * eta * w * w);

    // The time between zero crossings is half a period, to the second order of the mesh.
    let (_, y) = swing(&cantilever(), 1e-3, 2.5e-4, 1.1 * period);
    let crossings: Vec<f64> = (1..y.len())
        .filter(|k| y[k - 1] * y[*k] < 0.0)
        .map(|k| (k as f64 + y[k - 1] / (y[k - 1] - y[k])) * 2.5e-4)
        .collect();
    let found = std::f64::consts::PI / (crossings[1] - crossings[0]);
    println!("first frequency over the beam's: {:.6}", found / w);
    // The beam's frequency, up to the errors of mesh and step.
    assert!((found / w - 1.0).abs() < 3e-4, "{found} {w}");
}

/// Every kind of support and both walls: the held unknowns stay, the rest moves, energy is kept.
#[test]
fn every_support_fixes_its_coordinates() {
    use rodfit::scene::Support::{Clamped, Free, Pinned, Roller};
    for start in [Free, Pinned, Clamped, Roller] {
        for end in [Free, Pinned, Clamped, Roller] {
            if [start, end] == [Roller, Roller] {
                continue;
            }
            for clamp in [Clamp::MidEdge, Clamp::Nodes] {
                let mut scene = cantilever_with(0.5, 5e-4, 0.1, clamp);
                scene.supports.start = start;
                scene.supports.end = end;
                let problem = scene.problem().unwrap();
                let held = |s| match s {
                    Free => 0,
                    Roller => 1,
                    Pinned => 2,
                    Clamped | Support::Recorded => 4,
                };
                let n = problem.dof();
                assert_eq!(planar(&problem).free(), held(start)..n - held(end));
                let cuts = [start, end].iter().filter(|s| **s == Clamped).count() as f64 * 0.5;
                let cuts = if clamp == Clamp::MidEdge { cuts } else { 0.0 };
                let rest = planar(&problem).rest();
                let edge = 0.5 / (50.0 - cuts);
                // A clamp in the middle of an edge takes half an edge.
                assert!(((rest[2] - rest[0]).hypot(rest[3] - rest[1]) - edge).abs() < 1e-14);
                // The energy is conserved up to the order of the scheme.
                assert!(drift(&scene) < 1e-3, "{start:?} {end:?} {clamp:?}");
                let mut simulation = planar(&problem).simulation().unwrap();
                for k in 1..=50 {
                    simulation.step_to(k as f64 * 5e-4).unwrap();
                }
                let q = &simulation.state().q;
                let still = (0..n).filter(|i| q[*i] == rest[*i]).count();
                assert!(still >= n - planar(&problem).free().len());
                // Held unknowns are not solved for: they stay exactly at rest.
                assert!(
                    (0..planar(&problem).free().start)
                        .chain(planar(&problem).free().end..n)
                        .all(|i| q[i] == rest[i])
                );
                let [_, y, _] = planar(&problem).model.position(q, n / 4);
                assert!(y < 0.0, "the middle falls");
            }
        }
    }
}

/// A whole run with its report, and how it ended.
pub fn run(scene: &Scene) -> (SimulationReport, Result<(), Error>) {
    let problem = scene.problem().unwrap();
    finish(&problem, Trajectory::new(&problem, &[], &[]).unwrap())
}

/// All steps of a run with its report, and how it ended.
pub fn finish(problem: &Problem, mut run: Trajectory) -> (SimulationReport, Result<(), Error>) {
    let mut report = SimulationReport::new(problem);
    let steps = problem.time().unwrap().steps();
    let outcome = run.run(problem, steps, |now| report.push(problem, now));
    report.finish(&run, &outcome);
    (report, outcome)
}

/// The total energy at the start of a run, its largest rise in a step, and its loss over the run, J.
pub fn energy_balance(scene: &Scene) -> [f64; 3] {
    let (report, outcome) = run(scene);
    outcome.unwrap();
    let total = totals(&report);
    let rise = total.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
    [total[0], rise, total[0] - total[total.len() - 1]]
}

/// Total energy at each recorded time, J.
fn totals(report: &SimulationReport) -> Vec<f64> {
    report.energy.iter().map(|e| e[1..].iter().sum()).collect()
}

/// Time stepping by the default scheme, Newmark-beta, with this `beta`.
fn newmark(beta: f64, end: f64, step: f64) -> Option<Time> {
    Some(Time { beta, ..Time::new(end, step) })
}

/// A nitinol wire, released from a force at its tip, with Kelvin-Voigt damping of up to 16 times the travel time of sound along
/// an edge. Energy never rises, and its loss converges with the step in all three schemes.
#[test]
fn kelvin_voigt_damping_of_a_stiff_wire_equals_theory() {
    let mut scene = straight_rod(50, [0.35, 5e-4], Material::new(6450.0, 6.2e10));
    scene.loads.gravity = [0.0, -9.81, 0.0];
    scene.initial = Initial { state: InitialState::Equilibrium, ..Initial::default() };
    scene.initial.point = at_tip([0.0, -0.12, 0.0]);
    let mut dissipated = |scheme, step, eta| {
        scene.loads.damping.stiffness = eta;
        // Generalised-alpha with little dissipation of its own.
        scene.time = Some(Time { scheme, rho_inf: 0.95, ..Time::new(0.6, step) });
        let (report, outcome) = run(&scene);
        outcome.unwrap_or_else(|error| panic!("{scheme:?}, {step} s, {eta} s: {error}"));
        let total = totals(&report);
        let kinetic = report.energy.iter().map(|e| e[1]).fold(0.0, f64::max);
        let rise = total.windows(2).map(|w| w[1] - w[0]).fold(0.0, f64::max);
        // Nothing but damping acts: a rise is an error of the scheme.
        assert!(rise < 1e-3 * kinetic, "{scheme:?}, {step} s, {eta} s: {:e}", rise / kinetic);
        total[0] - total[total.len() - 1]
    };
    for eta in [1e-5, 1e-4, 4e-4] {
        let exact = dissipated(Scheme::NewmarkBeta, 1e-4, eta);
        for scheme in [Scheme::NewmarkBeta, Scheme::AverageVectorField, Scheme::GeneralisedAlpha] {
            let errors = [1e-3, 5e-4].map(|step| dissipated(scheme, step, eta) / exact - 1.0);
            println!(
                "{eta} s, {scheme:?}: {errors:.4?} of the dissipation at steps of 1 and 0.5 ms"
            );
            // The dissipation converges with the step, by comparison with a fine run.
            assert!(errors[0].abs() < 0.1 && errors[1].abs() < 0.03, "{errors:?}");
        }
    }
}

/// A swinging cable with internal friction: the dissipated energy converges with the step to second order, and friction never
/// adds energy.
#[test]
fn friction_dissipates_energy() {
    for (name, mut scene) in
        [("plane", cantilever()), ("space", helix_with(0.5, 1e-3, 0.3, Clamp::MidEdge))]
    {
        scene.rod.segments = Some(16);
        let friction = Friction { stiffness: 0.8, curvature: 0.5 };
        let mut lost = |scheme, step| {
            scene.loads.damping.friction = Some(friction);
            let time = Time {
                scheme,
                rho_inf: 0.9,
                tolerance: StepTolerance::Rounding,
                ..Time::new(0.3, step)
            };
            scene.time = Some(time);
            let [_, rise, lost] = energy_balance(&scene);
            // Friction never gives energy: a rise is an error of the scheme.
            assert!(rise < 2e-3 * lost, "{name} {scheme:?} {step}: {rise:e} of {lost:e}");
            lost
        };
        let exact = lost(Scheme::NewmarkBeta, 6.25e-5);
        for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
            let errors = [1e-3, 5e-4, 2.5e-4].map(|step| lost(scheme, step) / exact - 1.0);
            println!("{name}, {scheme:?}: {errors:?} of {exact:.3e} J");
            // Second order in the step: about a quarter per halving.
            assert!(exact > 0.0 && errors[2].abs() < 2e-3 && errors[0].abs() < 2e-2);
        }
    }
}

/// An arc that snaps into another shape, at steps with several solutions: for beta above 1/2 the total energy gains at most 11 %
/// of the largest kinetic energy.
#[test]
fn energy_does_not_increase_without_a_source() {
    let arc = |length, angle| Shape::Arc { length, angle };
    let mut sprung = Scene::new(
        10,
        arc(2.0, 4.4),
        Section::Circle { radius: 0.0057 },
        Material::new(312.0, 1e9),
    );
    (sprung.supports.start, sprung.supports.end) = (Support::Roller, Support::Pinned);
    sprung.supports.clamp = Clamp::Nodes;
    sprung.supports.roller = Some([-0.95, 0.85, 0.0]);
    sprung.loads.gravity = [0.0, -1.0, 0.0];
    let shape = Some(arc(2.0, 0.64));
    sprung.initial = Initial { state: InitialState::Shape, shape, ..Initial::default() };
    for beta in [0.51, 0.55, 0.6, 0.75, 1.0] {
        sprung.time = newmark(beta, 4.2, 0.06);
        let (report, outcome) = run(&sprung);
        let total = totals(&report);
        let kinetic = report.energy.iter().map(|e| e[1]).fold(0.0, f64::max);
        let (mut lowest, mut gain) = (total[0], 0.0_f64);
        for now in &total {
            gain = gain.max(now - lowest);
            lowest = lowest.min(*now);
        }
        println!(
            "beta {beta}: gained {:.1e} of the largest kinetic energy, {outcome:?}",
            gain / kinetic.max(f64::MIN_POSITIVE)
        );
        // Large steps with several solutions: gains up to 11 % of the largest kinetic energy are accepted.
        assert!(gain <= 0.11 * kinetic, "beta {beta}: {:e}", gain / kinetic);
        let stated =
            matches!(outcome, Ok(()) | Err(Error::EnergyGrowth { .. } | Error::Newton { .. }));
        assert!(stated, "{outcome:?}");
    }
}

/// A dead moment spins a rod about its hinge, beyond half turns and whole ones: its work is `M phi`,
/// and `phi = M t^2/(2 I)`.
#[test]
fn dead_moment_accelerates_a_hinged_rod() {
    let mut scene = straight_rod(12, [0.5, 0.01], Material::new(1273.52, 1e9));
    scene.supports.start = Support::Pinned;
    let moment = 0.5;
    scene.loads.point = vec![PointForce { moment: [0.0, 0.0, moment], ..PointForce::default() }];
    for (scheme, beta, step) in [
        (Scheme::NewmarkBeta, 0.5, 5e-4),
        (Scheme::NewmarkBeta, 0.6, 5e-4),
        (Scheme::AverageVectorField, 0.5, 5e-4),
        (Scheme::Rodas4, 0.5, 5e-4),
        (Scheme::Verlet, 0.5, 1e-5),
    ] {
        for sign in [1.0, -1.0] {
            scene.loads.point[0].moment[2] = sign * moment;
            scene.time = Some(Time { scheme, beta, ..Time::new(1.0, step) });
            let (report, outcome) = run(&scene);
            outcome.unwrap_or_else(|error| panic!("{scheme:?}: {error}"));
            let work = -report.energy.last().unwrap()[5];
            let inertia = 1273.52 * std::f64::consts::PI * 1e-4 * 0.5_f64.powi(3) / 3.0;
            let exact = moment * moment / (2.0 * inertia);
            println!(
                "{scheme:?}: {:.3} turns, off by {:.1e}",
                work / moment / std::f64::consts::TAU,
                work / exact - 1.0
            );
            assert!(work > 2.0 * std::f64::consts::TAU * moment);
            // Work `M phi` with `phi = M t^2/(2 I)`, up to the elasticity of the rod.
            assert!((work / exact - 1.0).abs() < 0.02, "{scheme:?}: {work} {exact}");
            if beta == 0.5 {
                // With beta 1/2 the energy changes by the work of the moment only.
                assert!(report.energy_drift() < 1e-3, "{scheme:?}: {}", report.energy_drift());
            }
        }
    }
}

/// A rod at rest without loads has no energy to compare rounding errors with: it stays, and no run
/// is refused for them.
#[test]
fn rod_in_equilibrium_stays_in_equilibrium() {
    let mut helix = helix_with(0.5, 3e-4, 0.06, Clamp::MidEdge);
    helix.supports.end = Support::Clamped;
    let mut plane = cantilever_with(0.5, 3e-4, 0.06, Clamp::MidEdge);
    plane.rod.shape = Shape::Arc { length: 0.5, angle: 2.0 };
    for mut scene in [helix, plane] {
        scene.loads.gravity = [0.0; 3];
        for state in [InitialState::Rest, InitialState::Equilibrium] {
            scene.initial.state = state;
            for (scheme, beta) in [
                (Scheme::NewmarkBeta, 0.5),
                (Scheme::NewmarkBeta, 0.8),
                (Scheme::AverageVectorField, 0.5),
                (Scheme::Rodas4, 0.5),
            ] {
                scene.time = Some(Time { scheme, beta, ..scene.time.unwrap() });
                let (report, outcome) = run(&scene);
                outcome.unwrap_or_else(|error| panic!("{scheme:?}: {error}"));
                assert_eq!(report.energy_drift(), 0.0);
                assert_eq!(report.energy_in_words(), "the rod does not move");
            }
        }
    }
}

/// Text of a summary about the energy: conserved within a part of the kinetic energy, dissipated by the scheme or by damping, or
/// changed by a moving support.
#[test]
fn energy_is_displayed_in_joules() {
    let mut scene = cantilever_with(0.5, 1e-3, 0.2, Clamp::MidEdge);
    let words = |scene: &Scene| run(scene).0.energy_in_words();
    let kept = words(&scene);
    assert!(
        kept.starts_with("energy conserved within ")
            && kept.ends_with("of the largest kinetic energy")
    );
    scene.time = newmark(0.75, 0.2, 1e-3);
    assert!(
        words(&scene).starts_with("numerical damping (beta = 0.75) dissipated "),
        "{}",
        words(&scene)
    );
    scene.loads.damping.mass = 1.0;
    assert!(words(&scene).starts_with("damping dissipated "), "{}", words(&scene));
    scene.supports.motion = vec![Motion {
        end: rodfit::scene::End::Start,
        displacement: [0.0, 0.1, 0.0],
        ramp: Some(0.1),
        ..Motion::default()
    }];
    assert!(words(&scene).starts_with("energy changed from "), "{}", words(&scene));
}
