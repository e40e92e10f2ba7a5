//! Hand-derived derivatives against num-dual and finite differences, far beyond what scenes reach.

use num_dual::{Dual2SVec, Dual2SVec64, Dual64, DualSVec64, HyperDual64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::Scalar;
use rodfit::check::{CancellationBound, Tolerance, check, check_problem};
use rodfit::energy::{AsEnergy, DeadLoad, Derivatives, Element, PlanarBend, Stretch};
use rodfit::scene::{Clamp, Section, Shape};

use crate::common::differences::assembled;
use crate::common::{cantilever, cantilever_with, planar};

/// A bend of turning angle `turn` (rad) with edges of the given lengths, anywhere.
fn bent(random: &mut ChaCha8Rng, turn: f64, [e, f]: [f64; 2]) -> [f64; 6] {
    let angle: f64 = random.random_range(-3.1..3.1);
    let scale = e.max(f);
    let [x, y] = [0, 1].map(|_| random.random_range(-1.0..1.0) * scale);
    let (x1, y1) = (x + e * angle.cos(), y + e * angle.sin());
    [x, y, x1, y1, x1 + f * (angle + turn).cos(), y1 + f * (angle + turn).sin()]
}

fn random_bend(random: &mut ChaCha8Rng) -> PlanarBend<f64> {
    PlanarBend {
        stiffness: 10f64.powf(random.random_range(-6.0..6.0)),
        natural_curvature: random.random_range(-2.0..2.0),
    }
}

/// 12,000 states: turns to 170 degrees at 1e-12, to 179.9 at the tolerance of the conditioning,
/// finite differences to 150 degrees.
#[test]
fn bend_agrees_on_random_states() {
    let mut random = ChaCha8Rng::seed_from_u64(20);
    let mut worst = [0.0_f64; 3];
    for k in 0..12_000 {
        let limit = if k < 9_000 { 170.0 } else { 179.9 };
        let low = if k < 9_000 { 0.0 } else { 165.0 };
        let degrees: f64 = random.random_range(low..limit);
        let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
        let length = 10f64.powf(random.random_range(-6.0..1.0));
        let ratio = 10f64.powf(random.random_range(-0.5..0.5));
        let q = bent(&mut random, sign * degrees.to_radians(), [length, length * ratio]);
        let allowed = 1e-12 * f64::max(1.0, 10.0 / (180.0 - degrees));
        let tolerance = Tolerance {
            gradient: allowed,
            hessian: allowed,
            finite_difference: if degrees <= 150.0 { 1e-7 } else { f64::INFINITY },
        };
        let report = check(&AsEnergy(random_bend(&mut random)), &[q], tolerance);
        assert!(report.passed(), "state {k}, {degrees} degrees, {q:?}\n{report}");
        let errors = report.max_relative_error;
        if degrees <= 170.0 {
            worst[0] = worst[0].max(errors.gradient.max(errors.hessian));
        } else {
            worst[1] = worst[1].max(errors.gradient.max(errors.hessian) * 1e-12 / allowed);
        }
        if degrees <= 150.0 {
            worst[2] = worst[2].max(errors.finite_difference);
        }
    }
    println!(
        "worst: to 170 degrees {:.1e}, nonlinear (scaled) {:.1e}, differences {:.1e}",
        worst[0], worst[1], worst[2]
    );
}

#[test]
fn stretch_and_load_agree_on_random_states() {
    let mut random = ChaCha8Rng::seed_from_u64(21);
    for k in 0..3_000 {
        // Lengths and stiffnesses over many decades: errors must be relative to the terms.
        let rest_length = 10f64.powf(random.random_range(-6.0..1.0));
        let length = rest_length * random.random_range(0.3..3.0);
        let angle: f64 = random.random_range(-3.1..3.1);
        let q = [0.0, 0.0, length * angle.cos(), length * angle.sin()];
        let element = Stretch {
            stiffness: 10f64.powf(random.random_range(-6.0..9.0)),
            rest_length,
            natural_strain: random.random_range(-0.1..0.1),
        };
        let report = check(&AsEnergy(element), &[q], Tolerance::default());
        assert!(report.passed(), "state {k}: {q:?}\n{report}");
    }
    let load = DeadLoad::<f64, 2> { force: [0.3, -2.0] };
    let report = check(&AsEnergy(load), &[[0.5, 0.1]], Tolerance::default());
    assert!(report.passed(), "{report}");
}

/// A wrong formula must be seen, and named: the test of the tests.
#[test]
fn check_of_a_wrong_hessian_names_the_element() {
    struct Wrong(PlanarBend<f64>);
    impl rodfit::Energy<6> for Wrong {
        fn energy<D: Scalar>(&self, q: &[D; 6]) -> D {
            AsEnergy(self.0).energy(q)
        }
    }
    impl rodfit::Analytic<6> for Wrong {
        fn gradient(&self, q: &[f64; 6]) -> [f64; 6] {
            Element::gradient(&self.0, q)
        }
        fn hessian(&self, q: &[f64; 6]) -> [[f64; 6]; 6] {
            let mut hessian = self.0.tangent(q).hessian;
            hessian[2][4] *= 1.0 + 1e-9;
            hessian
        }
    }
    let mut random = ChaCha8Rng::seed_from_u64(22);
    let q = bent(&mut random, 0.8, [0.1, 0.12]);
    let report = check(&Wrong(random_bend(&mut random)), &[q], Tolerance::default());
    assert!(!report.passed());
    let worst = report.worst.expect("an error was made");
    assert_eq!((worst.quantity.as_str(), worst.dof.as_str()), ("hessian", "q[2] q[4]"));
    assert!((1e-11..1e-8).contains(&worst.relative_error), "{worst:?}");
}

fn second_order<D: Scalar>(q: &[f64; 6], wrap: impl Fn(usize, f64) -> D) -> D {
    let element = PlanarBend { stiffness: D::from(2.0), natural_curvature: D::from(0.0) };
    element.energy(&std::array::from_fn(|i| wrap(i, q[i])))
}

/// Straight, and so little off it that squares and products underflow: finite in every scalar.
#[test]
fn nearly_straight_rods_stay_finite_in_every_scalar() {
    for length in [1e-6, 0.01, 10.0] {
        for off in [0.0, 1e-300, 1e-160, 1e-12, -1e-300, -1e-12] {
            let q = [0.0, 0.0, length, 0.0, 2.0 * length, off];
            let bend = PlanarBend { stiffness: 2.0, natural_curvature: 0.0 };
            let report = check(&AsEnergy(bend), &[q], Tolerance::default());
            let errors = report.max_relative_error;
            assert!(errors.gradient <= 1e-12 && errors.hessian <= 1e-12, "{off}: {report}");

            let local = bend.tangent(&q);
            assert!(
                local.gradient.iter().chain(local.hessian.iter().flatten()).all(|x| x.is_finite())
            );
            assert!(second_order(&q, |_, x| x).is_finite());
            let dual = second_order(&q, |i, x| Dual64::new(x, i as f64));
            assert!(dual.eps.is_finite());
            let vector = second_order(&q, |i, x| DualSVec64::<6>::from_re(x).derivative(i));
            assert!(
                vector
                    .eps
                    .unwrap_generic(nalgebra::Const::<6>, nalgebra::U1)
                    .iter()
                    .all(|x| x.is_finite())
            );
            let second = second_order(&q, |i, x| Dual2SVec64::<6>::from_re(x).derivative(i));
            let n = nalgebra::Const::<6>;
            assert!(second.v2.unwrap_generic(n, n).iter().all(|x| x.is_finite()));
            let hyper = second_order(&q, |i, x| HyperDual64::new(x, 1.0, i as f64, 0.0));
            assert!(hyper.eps1eps2.is_finite());
            let nested = second_order(&q, |i, x| {
                Dual2SVec::<Dual64, 6>::from_re(Dual64::new(x, 1.0 + i as f64)).derivative(i)
            });
            assert!(
                nested
                    .v2
                    .unwrap_generic(n, n)
                    .iter()
                    .all(|x| x.re.is_finite() && x.eps.is_finite())
            );
            let terms = second_order(&q, |i, _| CancellationBound::<6>::unknowns(&q)[i]);
            assert!(terms.second.iter().flatten().all(|x| x.is_finite()));
        }
    }
}

#[test]
fn assembly_adds_every_element_once() {
    let problem = cantilever().problem().unwrap();
    let mut simulation = planar(&problem).simulation().unwrap();
    for k in 1..=100 {
        simulation.step_to(k as f64 * 1e-3).unwrap();
    }
    let (rod, q) = (planar(&problem).rod(), simulation.state().q.clone());
    assembled(&rod, &q, &(), 1e-8);
}

#[test]
fn check_of_a_scene_passes() {
    let report = check_problem(&cantilever().problem().unwrap(), Tolerance::default()).unwrap();
    // Every element at every state counts as one.
    assert!(report.passed() && report.states > 1000, "{report}");
}

/// Two records of the same motion, by either route of derivatives.
#[test]
fn motion_by_hand_and_dual_derivatives_is_the_same() {
    let scene = cantilever_with(0.7, 2e-3, 0.3, Clamp::MidEdge);
    let run = |route| scene.problem().unwrap().with_derivatives(route).simulate().unwrap();
    let (hand, dual) = (run(Derivatives::Hand), run(Derivatives::Dual));
    approx::assert_abs_diff_eq!(hand, dual);
    approx::assert_abs_diff_ne!(
        hand,
        scene
            .problem()
            .unwrap()
            .with([(rodfit::Parameter::Beta, 0.71)])
            .unwrap()
            .simulate()
            .unwrap()
    );
}

/// A spring far from the origin: distances of a centimetre at coordinates of kilometres.
struct Far {
    rest_length: f64,
    wrong: f64,
}

impl Far {
    fn spring(&self) -> Stretch<f64, 2> {
        Stretch { stiffness: 3.0, rest_length: self.rest_length, natural_strain: 0.0 }
    }
}

impl rodfit::Energy<4> for Far {
    fn energy<D: Scalar>(&self, q: &[D; 4]) -> D {
        AsEnergy(self.spring()).energy(q)
    }
}

impl rodfit::Analytic<4> for Far {
    fn gradient(&self, q: &[f64; 4]) -> [f64; 4] {
        Element::gradient(&self.spring(), q)
    }
    fn hessian(&self, q: &[f64; 4]) -> [[f64; 4]; 4] {
        self.spring().tangent(q).hessian.map(|row| row.map(|x| x * (1.0 + self.wrong)))
    }
}

/// Coordinates large against distances: differences take steps in the energy's own scale, and
/// agree; they were off by the energy itself.
#[test]
fn differences_of_an_energy_use_steps_of_its_scale() {
    for offset in [0.0, 1.0, 1e2, 1e4, 1e6] {
        for rest_length in [1e-2, 1.0] {
            let spring = Far { rest_length, wrong: 0.0 };
            let [dx, dy] = [0.9 * rest_length, 0.6 * rest_length];
            let q = [offset, -offset, offset + dx, dy - offset];
            let report = check(&spring, &[q], Tolerance::default());
            assert!(report.derivatives_agree(), "{offset}: {report}");
            assert!(report.passed(), "{offset} {rest_length}: {report}");
            assert_eq!(report.above_count, 0);
        }
    }
}

/// The derivation's verdict is apart from the third opinion's, and every entry above a limit is
/// listed, the first twenty of them.
#[test]
fn check_report_separates_verdicts_and_lists_entries() {
    // Differences cannot reach what is asked of them: that says nothing of the derivation.
    let strict = Tolerance { finite_difference: 1e-16, ..Tolerance::default() };
    let right = Far { rest_length: 0.5, wrong: 0.0 };
    let q = [0.1, 0.2, 0.5, -0.2];
    let report = check(&right, &[q], strict);
    assert!(report.derivatives_agree() && !report.passed());
    let words = report.to_string();
    let row =
        |start: &str| words.lines().find(|line| line.trim_start().starts_with(start)).unwrap();
    assert!(row("gradient").ends_with(" agree") && row("Hessian").ends_with(" agree"), "{words}");
    assert!(words.starts_with("finite differences disagree with the hand-derived"), "{words}");
    assert!(report.above_count > 0, "{words}");
    assert!(report.above.iter().all(|above| above.against == "finite difference"));
    // Sixteen entries are wrong, by either measure.
    let wrong = Far { rest_length: 0.5, wrong: 1e-3 };
    let one = check(&wrong, &[q], Tolerance::default());
    assert!(!one.derivatives_agree() && !one.passed());
    assert_eq!((one.above_count, one.above.len()), (32, 20));
    let dual = one.above.iter().filter(|above| above.against == "dual");
    let named: Vec<&str> = dual.map(|above| above.dof.as_str()).collect();
    assert_eq!((named.len(), named[0], named[15]), (16, "q[0] q[0]", "q[3] q[3]"));
    assert!(one.above.iter().all(|above| above.quantity == "hessian"));
    let words = one.to_string();
    assert!(
        words.contains("derivatives disagree") && words.contains("the first 20 of 32"),
        "{words}"
    );
    // Errors that only duals can see.
    let slight = check(&Far { rest_length: 0.5, wrong: 1e-9 }, &[q], Tolerance::default());
    assert!(!slight.derivatives_agree());
    assert_eq!((slight.above_count, slight.above.len()), (16, 16));
    let json = serde_json::to_value(&slight).unwrap();
    assert_eq!(json["verdicts"]["hand_dual"], "disagree");
    assert_eq!(json["verdicts"]["finite_difference"], "agree");
    assert_eq!(json["above"][3]["dof"], "q[0] q[3]");
    assert!(json["max_relative_error"]["hessian"].as_f64().unwrap() > 1e-10);
    // And of a Hessian from elsewhere.
    let mut hessian = rodfit::Analytic::hessian(&right, &q);
    assert!(rodfit::check::check_hessian(&right, &q, &hessian).passed());
    hessian[1][2] += 1.0;
    let report = rodfit::check::check_hessian(&right, &q, &hessian);
    assert_eq!(report.above_count, 2, "{report}");
    assert!(report.above.iter().all(|above| above.dof == "q[1] q[2]"), "{report}");
}

/// A plane that lies askew to the axes is no plane that a number leaves, but for rounding errors.
#[test]
fn length_parameter_stays_in_an_oblique_plane() {
    for k in 0..40 {
        let angle = 0.37 + k as f64;
        let turn = nalgebra::Rotation3::from_euler_angles(angle, 1.3 * angle, 0.7 * angle);
        let axis = |i: usize| {
            let column: [f64; 3] = turn.matrix().column(i).into_owned().into();
            column
        };
        let mut scene = crate::common::coarse(6, 2e-3, 0.01);
        scene.rod.shape = Shape::Straight { length: 0.5, direction: axis(0) };
        scene.rod.section = Section::Rectangle { width: 0.01, height: 0.004, up: axis(2) };
        scene.loads.gravity = [0, 1, 2].map(|i| 9.8 * (axis(0)[i] + axis(1)[i]));
        let problem = scene.problem().unwrap();
        assert_eq!(problem.model().0, "planar", "{k}");
        for name in ["rod.shape.length", "youngs_modulus", "rod.section.width"] {
            let run = problem.simulate_with(&[name.parse().unwrap()]);
            assert!(run.is_ok(), "{k}, {name}: {:?}", run.err());
        }
        let out = problem.simulate_with(&["rod.shape.direction.x".parse().unwrap()]);
        assert!(out.is_err(), "{k}: out of the plane");
    }
}
