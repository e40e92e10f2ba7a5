//! The library as somebody uses it who has not read its source: the energies one writes first, calls
//! that cannot be answered, what is read from a run, and a measurement of one's own.

use num_dual::Dual64;
use rodfit::check::{Terms, check_hessian};
use rodfit::fit::{
    Experiment, FitReport, Frequencies, Gauge, Quantity, RestShape, Sample, Sight, Sighting,
};
use rodfit::point::Stencil;
use rodfit::scene::{Clamp, End, Motion, Scene, Scheme, Shape, Support, Time};
use rodfit::{
    Energy, Error, Fit, Observation, Parameter, Point, Problem, Reaction, Scalar, Trajectory,
};

use crate::common::{cantilever, helix_with};

/// Declares energies as one writes them, and checks each: over plain, dual and second-order numbers
/// the same function, with derivatives as finite differences have them.
macro_rules! first_attempts {
    ($($test:ident: [$($q:literal),+], |$x:ident| $body:block)*) => {$(
        #[test]
        fn $test() {
            const N: usize = [$($q),+].len();
            #[derive(Clone)]
            struct Attempt;
            impl Energy<N> for Attempt {
                fn energy<D: Scalar>(&self, $x: &[D; N]) -> D $body
            }
            has_derivatives(&Attempt, [$($q),+]);
        }
    )*};
}

fn has_derivatives<const N: usize>(energy: &impl Energy<N>, q: [f64; N]) {
    let value = energy.energy(&q);
    assert!(value.is_finite() && value != 0.0);
    // Powers may be multiplied out in another order.
    assert!((energy.energy(&Terms::unknowns(&q)).value / value - 1.0).abs() < 1e-14);
    let mut slopes = [0.0; N];
    for i in 0..N {
        let along = |i: usize| move |j: usize| f64::from(u8::from(i == j));
        let dual: [Dual64; N] = std::array::from_fn(|j| Dual64::new(q[j], along(i)(j)));
        let by_dual = energy.energy(&dual);
        assert!((by_dual.re / value - 1.0).abs() < 1e-14);
        let h = 1e-5 * q[i].abs().max(1e-2);
        let at = |k: f64| energy.energy(&std::array::from_fn(|j| q[j] + k * h * along(i)(j)));
        let difference = (8.0 * (at(1.0) - at(-1.0)) - (at(2.0) - at(-2.0))) / (12.0 * h);
        assert!(
            (by_dual.eps - difference).abs() < 1e-7 * (difference.abs() + value.abs()),
            "q[{i}]: {} by dual numbers, {difference} by differences",
            by_dual.eps
        );
        slopes[i] = by_dual.eps;
    }
    assert!(slopes.iter().any(|slope| *slope != 0.0));
    // Second derivatives exist: a Hessian of zeros is found wrong, or is right.
    let report = check_hessian(energy, &q, &[[0.0; N]; N]);
    assert!(report.max_relative_error.hessian.is_finite());
}

first_attempts! {
    // A tip magnet that a fixed one repels.
    magnetic_tip: [0.3, 0.1, 0.05], |q| {
        let r2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
        D::from(1e-3) / r2.sqrt().powi(3)
    }
    // A Winkler foundation with a cubic part.
    foundation: [0.02, -0.01, 0.03], |q| {
        q.iter().map(|y| *y * *y * 500.0 + y.powi(4) * 1e4 / 4.0).sum::<D>() / 2.0
    }
    morse_spring: [0.1, 0.35], |q| {
        let (depth, a, rest) = (2.0, 5.0, 0.2);
        let stretch = (q[1] - q[0]).abs() - rest;
        (D::from(1.0) - (stretch * -a).exp()).powi(2) * depth
    }
    fene_spring: [0.1, 0.35], |q| {
        let (k, longest) = (30.0, 0.5);
        let x = (q[1] - q[0]) / longest;
        (-x * x + 1.0).ln() * (-k * longest * longest / 2.0)
    }
    // The wall that a tip meets, smoothed.
    tanh_contact: [0.01], |q| {
        let gap = q[0] - 0.012;
        let touching = (-(gap / 1e-3).tanh() + 1.0) / 2.0;
        gap.powi(2) * 1e5 * touching
    }
    one_sided_contact: [-0.004, 0.02], |q| {
        let mut sum = D::from(0.0);
        for y in q {
            if *y < 0.0 {
                sum += y.abs().powf(2.5) * 1e6;
            }
        }
        sum
    }
    softplus: [0.3], |q| {
        let mut x = q[0];
        x *= 4.0;
        x -= 1.0;
        (x.exp() + 1.0).ln() / 4.0
    }
    // A floor below the smaller of two heights, a ceiling above the larger.
    floor_and_ceiling: [0.2, 0.5], |q| {
        let low = q[0].min(q[1]) - 0.25;
        let high = q[0].max(q[1]) - 0.4;
        low.powi(2) + high * high * 3.0
    }
    // Opening angle of three points, by the law of cosines.
    angle: [0.0, 0.0, 0.1, 0.01, 0.2, 0.05], |q| {
        let (ux, uy) = (q[2] - q[0], q[3] - q[1]);
        let (vx, vy) = (q[4] - q[2], q[5] - q[3]);
        let cosine = (ux * vx + uy * vy) / (ux.hypot(uy) * vx.hypot(vy));
        let angle = cosine.acos();
        angle * angle / 2.0
    }
    // Gravity of a pendulum with an angular spring.
    pendulum: [0.4], |q| {
        let mut energy = -q[0].cos() * 9.81 + 9.81;
        energy += (q[0] - 0.1).powi(2) * 0.5;
        energy /= 2.0;
        energy
    }
    // A dielectric elastomer's field: hyperbolic functions and angles.
    field: [0.2, 0.3], |q| {
        let (x, y) = (q[0], q[1]);
        x.sinh() * y.cosh() + x.atan2(y) + (x / y).atan() - (x * y).asin()
    }
    lennard_jones: [0.9, 1.1], |q| {
        let mut r = q[0];
        r /= q[1];
        let sixth = r.recip().powi(6);
        let energy = (sixth * sixth - sixth) * 4.0;
        if energy > 100.0 { D::from(100.0) } else { energy }
    }
}

/// The cantilever with few edges for a short time.
fn short() -> Scene {
    let mut scene = cantilever();
    scene.rod.segments = Some(12);
    scene.time = Some(Time::new(0.1, 2e-3));
    scene
}

/// What a refusal names, and what it says was found and is allowed.
fn refused<T>(result: Result<T, Error>) -> [String; 3] {
    match result {
        Err(Error::Invalid { key, found, allowed, .. }) => [key, found, allowed],
        Err(Error::OutOfRange { what, found, low, high }) => {
            [what.into(), found.to_string(), format!("{low} .. {high}")]
        }
        Err(other) => panic!("another error: {other}"),
        Ok(_) => panic!("accepted"),
    }
}

#[test]
fn vectors_of_another_length_are_refused() {
    let problem = short().problem().unwrap();
    let run = problem.simulate().unwrap();
    let fit = Fit::new(&problem)
        .observe(crate::common::record(&run, 10).sigma(1e-3))
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::Density);
    let residuals = fit.residuals().unwrap();
    for x in [&[][..], &[18.0], &[18.0, 7.0, 1.0]] {
        let found = format!("{} numbers", x.len());
        let expected = ["x".to_string(), found, "2, one per unknown".into()];
        assert_eq!(refused(residuals.residuals(x)), expected);
        assert_eq!(refused(residuals.jacobian_at(x)), expected);
        assert_eq!(refused(residuals.hessian_at(x)), expected);
        let x = x.to_vec();
        assert!(argmin::core::CostFunction::cost(&residuals, &x).is_err());
        assert!(argmin::core::Gradient::gradient(&residuals, &x).is_err());
    }
    for x in [[f64::NAN, 7.0], [1e5, 7.0], [f64::NEG_INFINITY, 7.0]] {
        assert!(residuals.residuals(&x).is_err());
        assert!(residuals.hessian_at(&x).is_err());
    }
    assert_eq!(residuals.residuals(&[1e8_f64.ln(), 1273.52_f64.ln()]).unwrap().len(), 20);
}

#[test]
fn a_trajectory_is_of_one_run_of_its_problem() {
    let problem = short().problem().unwrap();
    let steps = problem.time().unwrap().steps();
    let none = |_: &dyn rodfit::Snapshot| {};
    let mut run = Trajectory::new(&problem, &[12], &[]).unwrap();
    let before = refused(run.at(Point::Tip, 0.0));
    assert_eq!(before, ["trajectory", "no records", "one that has run"]);
    let other = problem.with([(Parameter::YoungsModulus, 2e8)]).unwrap();
    assert_eq!(refused(run.run(&other, steps, none))[0], "problem");
    assert_eq!(refused(run.run(&problem, steps + 1, none))[..2], ["steps", "51"]);
    run.run(&problem, steps, none).unwrap();
    assert_eq!(
        refused(run.run(&problem, steps, none))[..2],
        ["trajectory", "a record of 51 times"]
    );
    assert_eq!(run.times().len(), 51);
    // Between the samples of a node that was not tracked there is nothing to read.
    assert_eq!(refused(run.at(Point::Node(3), 0.0))[0], "a node that was not tracked");
    assert!(
        run.at(Point::ArcLength(f64::NAN), 0.0).is_err() && run.at(Point::Tip, f64::NAN).is_err()
    );
}

#[test]
fn nodes_may_be_tracked_in_any_order() {
    let problem = short().problem().unwrap();
    let outside = refused(Trajectory::new(&problem, &[3, 13], &[]).map(|_| ()));
    assert_eq!(outside, ["node", "13", "0 .. 12"]);
    let parameters = [Parameter::YoungsModulus];
    let of = |tracked: &[usize]| {
        let mut run = Trajectory::new(&problem, tracked, &parameters).unwrap();
        run.run(&problem, 50, |_| {}).unwrap();
        run
    };
    let (mixed, sorted) = (of(&[12, 5, 7, 5]), of(&[5, 7, 12]));
    for node in [5, 7, 12] {
        let read = |run: &Trajectory| run.at(Point::Node(node), 0.0731).unwrap();
        assert_eq!(read(&mixed), read(&sorted));
    }
    let rest = |tracked: &[usize]| Trajectory::at_rest(&problem, tracked, &[]).unwrap();
    assert_eq!(rest(&[12, 5]).node(5, 0), rest(&[5, 12]).node(5, 0));
    assert!(Trajectory::at_rest(&problem, &[13], &[]).is_err());
}

#[test]
fn odd_calls_are_refused() {
    let problem = short().problem().unwrap();
    let modes = refused(Frequencies::hz(&[1.0, 2.0], 0.1).of_modes(&[1]).map(|_| ()));
    assert_eq!(modes, ["modes", "1 modes", "2, one per frequency"]);
    assert_eq!(refused(Fit::of([]).identify(Parameter::Density).solve())[0], "observation");
    let nothing = Fit::new(&problem).identify(Parameter::YoungsModulus);
    assert_eq!(refused(nothing.solve())[0], "observation");
    assert_eq!(refused(nothing.residuals().map(|_| ()))[0], "observation");
    let nan =
        Observation::new(vec![Sample { time: f64::NAN, position: [Some(0.1), None, None] }; 5]);
    assert!(Fit::new(&problem).observe(nan).identify(Parameter::Density).solve().is_err());
    assert!(problem.with([(Parameter::YoungsModulus, f64::NAN)]).is_err());
    assert!(problem.with([(Parameter::Radius, -1.0)]).is_err());
    assert!(problem.stencil(Point::Node(usize::MAX)).is_err());
    assert_eq!(Stencil::<f64>::between(&[], 0.1).nodes, []);
    assert_eq!(Stencil::between(&[0.2], 0.1).nodes, [(0, 1.0)]);
    assert!(problem.modes(0, Default::default()).is_ok_and(|modes| modes.modes.is_empty()));
}

fn sum(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| a[c] + b[c])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
}

fn near(a: [f64; 3], b: [f64; 3], tolerance: f64) {
    assert!((0..3).all(|c| (a[c] - b[c]).abs() <= tolerance), "{a:?} {b:?}");
}

/// Masses of the nodes, kg.
fn masses(problem: &Problem) -> Vec<f64> {
    let nodes = 0..problem.nodes();
    match problem.posed() {
        rodfit::AnyProblem::Planar(p) => nodes.map(|i| p.rod().mass[2 * i]).collect(),
        rodfit::AnyProblem::Spatial(p) => nodes.map(|i| p.rod().mass[4 * i]).collect(),
    }
}

/// At rest the supports balance the weight of what is not inside of a wall, and its moment.
#[test]
fn reactions_at_rest_balance_the_weight() {
    let mut helix = helix_with(0.5, 1e-3, 0.1, Clamp::MidEdge);
    helix.material.poisson_ratio = Some(0.4);
    helix.loads.gravity = [1.0, 2.0, -9.0];
    let mut paper = short();
    paper.supports.clamp = Clamp::Nodes;
    let mut between = short();
    (between.supports.start, between.supports.end) = (Support::Pinned, Support::Clamped);
    let mut rolling = helix.clone();
    rolling.supports.end = Support::Roller;
    for (scene, inside) in
        [(short(), &[0][..]), (paper, &[]), (helix, &[0]), (between, &[12]), (rolling, &[0])]
    {
        let problem = scene.problem().unwrap();
        let rest = problem.equilibrium().unwrap();
        let (m, g) = (masses(&problem), scene.loads.gravity);
        let outside = (0..problem.nodes()).filter(|i| !inside.contains(i));
        let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
        for i in outside {
            let weight = g.map(|g| m[i] * g);
            force = sum(force, weight);
            moment = sum(moment, cross(rest.nodes[i], weight));
        }
        if let (Shape::Straight { length, .. }, true) = (&scene.rod.shape, inside.len() == 1) {
            let whole = 1273.52 * std::f64::consts::PI * 0.005_f64.powi(2) * length;
            assert!((force[1] / (g[1] * whole) - 1.0).abs() < 1e-12);
        }
        let last = problem.nodes() - 1;
        let middle = |a: usize, b: usize| sum(rest.nodes[a], rest.nodes[b]).map(|x| 0.5 * x);
        let point = |inner: usize, outer: usize| match inside.contains(&outer) {
            true => middle(inner, outer),
            false => rest.nodes[outer],
        };
        let ends =
            [(rest.reactions.start, point(1, 0)), (rest.reactions.end, point(last - 1, last))];
        for (Reaction { force: f, moment: m }, at) in ends {
            force = sum(force, f);
            moment = sum(moment, sum(m, cross(at, f)));
        }
        near(force, [0.0; 3], 1e-8);
        near(moment, [0.0; 3], 1e-8);
    }
}

/// A wall that turns one end of a straight rod about itself feels the torque of its twist.
#[test]
fn a_twisted_rod_turns_its_walls() {
    let mut scene = short();
    scene.loads.gravity = [0.0; 3];
    scene.material.shear_modulus = Some(4e7);
    scene.supports.end = Support::Clamped;
    scene.supports.motion = vec![Motion { twist: 0.3, end: End::End, ..Motion::default() }];
    let rest = scene.problem().unwrap().equilibrium().unwrap();
    let torsion_constant = std::f64::consts::PI * 0.005_f64.powi(4) / 2.0;
    let torque = 4e7 * torsion_constant * 0.3 / 0.5;
    near(rest.reactions.end.moment, [torque, 0.0, 0.0], 1e-9 * torque);
    near(rest.reactions.start.moment, [-torque, 0.0, 0.0], 1e-9 * torque);
    near(rest.reactions.start.force, [0.0; 3], 1e-9);
}

/// What is read from a run hangs together: momentum changes by reactions, weight and drag, exactly
/// as the scheme sums them; kinetic energy is that of the velocities; energy of an undamped rod
/// stays.
#[test]
fn reactions_velocities_and_energies_of_a_run_hang_together() {
    let mut damped = short();
    damped.loads.damping.mass = 3.0;
    damped.loads.damping.stiffness = 2e-3;
    damped.time = Some(Time::new(0.1, 2e-4));
    let mut shaken = damped.clone();
    let shake = Motion {
        displacement: [0.0, 0.01, 0.0],
        rotation: [0.0, 0.0, 0.2],
        ramp: Some(0.05),
        end: End::Start,
        ..Motion::default()
    };
    shaken.supports.motion = vec![shake];
    let mut helix = helix_with(0.5, 1e-3, 0.05, Clamp::MidEdge);
    helix.material.poisson_ratio = Some(0.4);
    helix.rod.segments = Some(30);
    // Kelvin-Voigt forces are those of the mean strain rates over a step, the shaken wall's own
    // momentum is summed by the trapezoidal rule, and the helix's steps, stiff in stretch, are solved
    // to the rounding errors of that.
    for (scene, tolerance) in [(short(), 1e-9), (damped, 1e-3), (shaken, 1e-3), (helix, 1e-7)] {
        let (problem, drag) = (scene.problem().unwrap(), scene.loads.damping.mass);
        let (m, g) = (masses(&problem), scene.loads.gravity);
        let all: Vec<usize> = (0..problem.nodes()).collect();
        let mut run =
            Trajectory::new(&problem, &all, &[]).unwrap().keep_energies().keep_reactions();
        run.run(&problem, problem.time().unwrap().steps(), |_| {}).unwrap();
        let times = run.times();
        assert_eq!([run.energies().len(), run.reactions().len()], [times.len(); 2]);
        let momentum = |k: usize| {
            let of = |i: &usize| run.velocity(*i, k).map(|v| m[*i] * v);
            all[1..].iter().map(of).fold([0.0; 3], sum)
        };
        let whole: f64 = m[1..].iter().sum();
        let push = |k: usize| {
            let (r, p) = (run.reactions()[k].start.force, momentum(k));
            [0, 1, 2].map(|c| r[c] + whole * g[c] - drag * p[c])
        };
        let size = (1..times.len()).map(|k| momentum(k)[1].abs().max(momentum(k)[2].abs()));
        let size = size.fold(0.0, f64::max);
        for k in 1..times.len() {
            let (before, now, h) = (push(k - 1), push(k), times[k] - times[k - 1]);
            let impulse = [0, 1, 2].map(|c| 0.5 * h * (before[c] + now[c]));
            near(sum(momentum(k - 1), impulse), momentum(k), tolerance * size);
        }
        if problem.planar().is_some() && scene.supports.motion.is_empty() {
            let k = times.len() / 2;
            let square = |i: usize| run.velocity(i, k).map(|v| v * v).iter().sum::<f64>();
            let kinetic: f64 = all[2..].iter().map(|i| 0.5 * m[*i] * square(*i)).sum();
            assert!((run.energies()[k].kinetic / kinetic - 1.0).abs() < 1e-12);
        }
        if drag == 0.0 {
            let total = |k: usize| run.energies()[k].total();
            let most = run.energies().iter().map(|e| e.kinetic).fold(0.0, f64::max);
            assert!((0..times.len()).all(|k| (total(k) - total(0)).abs() < 0.02 * most));
        }
    }
    // Nothing is kept that was not asked for, and other schemes keep the same.
    let problem = short().problem().unwrap();
    let plain = problem.simulate().unwrap();
    assert!(plain.energies().is_empty() && plain.reactions().is_empty());
    let wall = |scheme: Scheme| {
        let mut scene = short();
        scene.time = Some(Time { scheme, ..Time::new(0.1, 2e-4) });
        let problem = scene.problem().unwrap();
        let mut run = Trajectory::new(&problem, &[], &[]).unwrap().keep_reactions();
        run.run(&problem, 500, |_| {}).unwrap();
        run.reactions()[500].start
    };
    let (one, other) = (wall(Scheme::NewmarkBeta), wall(Scheme::Rodas4));
    near(one.force, other.force, 2e-2 * one.force[1].abs());
    near(one.moment, other.moment, 2e-2 * one.moment[2].abs());
}

/// Heading of the tip in the xy plane, rad.
#[derive(Debug)]
struct TipAngle;

impl Quantity for TipAngle {
    fn points(&self) -> Vec<Point> {
        vec![Point::ArcLength(0.47), Point::Tip]
    }
    fn show<D: Scalar>(&self, rod: &Sight<D>) -> D {
        let [a, b] = [0, 1].map(|i| rod.points[i].position);
        (b[1] - a[1]).atan2(b[0] - a[0])
    }
}

/// Bending moment near the wall, N m, and a little of how fast the place moves.
#[derive(Debug)]
struct ClampMoment;

impl Quantity for ClampMoment {
    fn points(&self) -> Vec<Point> {
        [0.02, 0.06, 0.1].map(Point::ArcLength).into()
    }
    fn show<D: Scalar>(&self, rod: &Sight<D>) -> D {
        let [a, b, c] = [0, 1, 2].map(|i| rod.points[i].position);
        let heading = |p: [D; 3], q: [D; 3]| (q[1] - p[1]).atan2(q[0] - p[0]);
        let curvature = (heading(b, c) - heading(a, b)) / 0.04;
        let stiffness =
            rod.scene.material.youngs_modulus * rod.scene.rod.section.moments().second_moments[0];
        stiffness * curvature + rod.points[2].velocity[1] * (1e-3 * (1.0 + rod.time))
    }
}

/// A quantity of a simulated motion, as a gauge would show it.
fn shown(problem: &Problem, quantity: &impl Quantity, time: f64) -> f64 {
    let run = problem.simulate().unwrap();
    let step = 1e-7;
    let moving = |point: &Point| {
        let at = |t: f64| run.at(*point, t).unwrap().0;
        let (position, after, before) = (at(time), at(time + step), at(time - step));
        let velocity = [0, 1, 2].map(|c| (after[c] - before[c]) / (2.0 * step));
        rodfit::fit::Moving { position, velocity }
    };
    let points: Vec<_> = quantity.points().iter().map(moving).collect();
    quantity.show(&Sight { time, points: &points, scene: problem.scene() })
}

const TIMES: [f64; 5] = [0.013, 0.031, 0.052, 0.074, 0.095];

/// The tip's angle and the clamp's moment over time, and the angle at rest.
fn gauges(problem: &Problem) -> [Gauge; 3] {
    let angle = TIMES.map(|t| (t, shown(problem, &TipAngle, t)));
    let moment = TIMES.map(|t| (t, shown(problem, &ClampMoment, t)));
    let rest = problem.equilibrium().unwrap().nodes;
    let between =
        Stencil::between(&(0..13).map(|i| (f64::from(i) - 0.5) / 23.0).collect::<Vec<_>>(), 0.47);
    let a = between.nodes.iter().fold([0.0; 3], |s, (i, w)| sum(s, rest[*i].map(|x| w * x)));
    let angle_at_rest = (rest[12][1] - a[1]).atan2(rest[12][0] - a[0]);
    [
        Gauge::over_time("angle of the tip", "rad", TipAngle, &angle, 1e-3),
        Gauge::over_time("moment of the clamp", "N m", ClampMoment, &moment, 1e-5),
        Gauge::at_rest("angle at rest", "rad", TipAngle, &[angle_at_rest], 1e-3),
    ]
}

#[test]
fn a_measurement_of_ones_own_has_exact_derivatives() {
    let problem = short().problem().unwrap();
    let [angle, moment, rest] = gauges(&problem);
    let fit = Fit::new(&problem)
        .observe(angle)
        .observe(moment)
        .observe(rest)
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::Density);
    let residuals = fit.residuals().unwrap();
    let truth = [1e8_f64.ln(), 1273.52_f64.ln()];
    // The finite difference behind the velocity is what is left.
    assert!(residuals.residuals(&truth).unwrap().iter().all(|r| r.abs() < 1e-3));
    let x = [truth[0] + 0.1, truth[1] - 0.05];
    let jacobian = residuals.jacobian_at(&x).unwrap();
    let hessian = residuals.hessian_at(&x).unwrap();
    let gradient = |x: &[f64]| {
        let (rows, r) = (residuals.jacobian_at(x).unwrap(), residuals.residuals(x).unwrap());
        [0, 1].map(|j| rows.iter().zip(&r).map(|(row, r)| row[j] * r).sum::<f64>())
    };
    let h = 1e-3;
    for j in 0..2 {
        let at = |k: f64| {
            let mut x = x;
            x[j] += k * h;
            x
        };
        let difference = |values: [f64; 4]| {
            let [a, b, c, d] = values;
            (8.0 * (a - b) - (c - d)) / (12.0 * h)
        };
        let points = [1.0, -1.0, 2.0, -2.0].map(at);
        let all = points.map(|x| residuals.residuals(&x).unwrap());
        for (i, row) in jacobian.iter().enumerate() {
            let by_difference = difference([0, 1, 2, 3].map(|p| all[p][i]));
            assert!((row[j] - by_difference).abs() < 1e-6 * (1.0 + row[j].abs()), "row {i}, {j}");
        }
        let gradients = points.map(|x| gradient(&x));
        for i in 0..2 {
            let by_difference = difference([0, 1, 2, 3].map(|p| gradients[p][i]));
            let size = hessian[i][i].abs().max(hessian[j][j].abs());
            assert!((hessian[i][j] - by_difference).abs() < 1e-7 * size, "{i} {j}");
        }
    }
}

#[test]
fn a_measurement_of_ones_own_joins_a_fit() {
    let problem = short().problem().unwrap();
    let [angle, moment, rest] = gauges(&problem);
    let report = Fit::new(&problem)
        .observe(angle)
        .observe(moment)
        .observe(rest.held_out())
        .identify(Parameter::YoungsModulus)
        .keep_evidence()
        .solve()
        .unwrap();
    let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
    assert!((estimate.value.unwrap() / 1e8 - 1.0).abs() < 1e-5, "{report}");
    assert_eq!(report.units, ["rad", "N m"]);
    let prediction = &report.predictions[0];
    assert_eq!(
        (prediction.observation.as_str(), prediction.unit.as_str()),
        ("angle at rest", "rad")
    );
    assert!(prediction.rms < 1e-6);
    let series = &report.evidence.as_ref().unwrap().series;
    assert_eq!(
        series.iter().map(|s| s.label.as_str()).collect::<Vec<_>>(),
        ["angle of the tip", "moment of the clamp"]
    );
    let page = rodfit::report::fit_page(&report, "gauges");
    assert!(page.contains("moment of the clamp") && !page.contains("NaN"));

    let refuse = |gauge: Gauge| {
        refused(Fit::new(&problem).observe(gauge).identify(Parameter::Density).solve())
    };
    let late = refuse(Gauge::over_time("late", "rad", TipAngle, &[(0.05, 0.0), (0.2, 0.0)], 1.0));
    assert_eq!(late[..2], ["late", "other times"]);
    #[derive(Debug)]
    struct Beyond;
    impl Quantity for Beyond {
        fn points(&self) -> Vec<Point> {
            vec![Point::ArcLength(0.6)]
        }
        fn show<D: Scalar>(&self, rod: &Sight<D>) -> D {
            rod.points[0].position[0]
        }
    }
    assert_eq!(refuse(Gauge::at_rest("beyond", "m", Beyond, &[0.0; 3], 1.0))[0], "beyond: points");
    let nan = refuse(Gauge::at_rest("bad", "rad", TipAngle, &[0.0, f64::NAN], 1.0));
    assert_eq!(nan[..2], ["bad", "other readings"]);
    assert_eq!(
        refuse(Gauge::at_rest("exact", "rad", TipAngle, &[0.0; 2], 0.0))[0],
        "gauge[0].sigma"
    );
}

/// The same but for the last digit, which JSON may cost.
fn same(a: &serde_json::Value, b: &serde_json::Value) -> bool {
    use serde_json::Value::{Array, Number, Object};
    match (a, b) {
        (Number(a), Number(b)) => {
            let [a, b] = [a, b].map(|x| x.as_f64().unwrap());
            (a - b).abs() <= 1e-15 * a.abs()
        }
        (Array(a), Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b)),
        (Object(a), Object(b)) => {
            a.len() == b.len() && a.iter().all(|(key, a)| b.get(key).is_some_and(|b| same(a, b)))
        }
        (a, b) => a == b,
    }
}

/// What is written is read again as what it was.
fn round_trip<T: serde::Serialize + serde::de::DeserializeOwned>(report: &T) -> T {
    let json = serde_json::to_string(report).unwrap();
    let back: T = serde_json::from_str(&json).unwrap();
    let [a, b] = [report, &back].map(|r| serde_json::to_value(r).unwrap());
    assert!(same(&a, &b), "{json}");
    back
}

#[test]
fn reports_are_read_back() {
    let mut scene = short();
    scene.material.poisson_ratio = Some(0.4);
    let problem = scene.problem().unwrap();
    let rest = problem.equilibrium().unwrap();
    assert_eq!(round_trip(&rest).model, "planar");
    let modes = problem.modes(4, Default::default()).unwrap();
    assert_eq!(round_trip(&modes).modes.len(), 4);
    let check = rodfit::check::check_problem(&problem, Default::default()).unwrap();
    assert!(round_trip(&check).passed());

    let mut report = rodfit::output::SimulationReport::new(&problem);
    let mut run = Trajectory::new(&problem, &[12], &[]).unwrap();
    let outcome = run.run(&problem, 50, |state| report.push(&problem, state));
    report.finish(&run, &outcome);
    assert_eq!(round_trip(&report).tip.len(), 51);

    let off = |k: usize| 1e-3 * (k as f64 * 2.4).sin();
    let mut motion = crate::common::record(&run, 20);
    motion.samples.iter_mut().enumerate().for_each(|(k, s)| {
        s.position = s.position.map(|x| x.map(|x| x + off(k)));
    });
    let sighting = |i: usize| Sighting {
        point: Point::Node(i),
        position: rest.nodes[i].map(|x| Some(x + off(i))),
    };
    let droop = RestShape::new([4, 8, 12].map(sighting).into()).sigma(1e-3).held_out();
    let report = Fit::of([Experiment::new("one", &problem).observe(motion).observe(droop)])
        .identify(Parameter::YoungsModulus)
        .analyse(rodfit::fit::Analysis { profile: true, ..Default::default() })
        .keep_evidence()
        .solve()
        .unwrap();
    let back: FitReport = round_trip(&report);
    assert_eq!(back.to_string(), report.to_string());
    assert!(back.evidence.is_some_and(|e| e.profiles.len() == 1) && back.predictions.len() == 1);

    scene.time = Some(Time::new(0.02, 4e-3));
    let tip =
        rodfit::scene::PointForce { node: rodfit::scene::Node::Index(9), ..Default::default() };
    scene.loads.point = vec![tip];
    let study = rodfit::study::Study::new(&scene, |_, _| {}).unwrap();
    assert_eq!(round_trip(&study).rows.len(), study.rows.len());
}

/// What the documents show of files can be read: their scenes are scenes.
#[test]
fn the_documents_files_can_be_read() {
    let blocks = |text: &str| -> Vec<String> {
        let parts = text.split("```toml\n").skip(1);
        parts.map(|part| part.split("```").next().unwrap().to_string()).collect()
    };
    let readme = blocks(include_str!("../../README.md"));
    let files = blocks(include_str!("../../docs/files.md"));
    for block in readme.iter().chain(&files) {
        block.parse::<toml::Table>().unwrap_or_else(|error| panic!("{error} in\n{block}"));
    }
    for scene in [&readme[0], &files[0]] {
        toml::from_str::<rodfit::Scene>(scene)
            .unwrap_or_else(|error| panic!("{error} in\n{scene}"));
    }
}
