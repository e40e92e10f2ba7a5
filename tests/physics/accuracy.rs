//! Mesh, step and scheme that the program chooses: true errors against requested and estimated ones.

use rodfit::accuracy::{Calculation, RunAssessment, simulate_checked};
use rodfit::scene::{Resolution, Scheme, StepTolerance, Time};
use rodfit::vibration::LinearizationPoint;
use rodfit::{Error, Parameter, Point, Problem, Scene};

/// The problem of a scene with these lines at its beginning, in `[rod]` and in `[time]`.
fn problem(scene: &str, [first, segments, time]: [&str; 3]) -> Result<Problem, Error> {
    let text = scene.replace("[rod]", &format!("{first}\n[rod]\n{segments}"));
    Scene::from_toml(&text.replace("[time]", &format!("[time]\n{time}")), "data")?.problem()
}

/// A scene with chosen numerics and this requested accuracy.
fn open(scene: &str, accuracy: f64) -> Problem {
    problem(scene, [&format!("accuracy = {accuracy}"), "", ""]).unwrap()
}

/// Positions of a point over the length, at 100 times.
fn positions(problem: &Problem, point: Point) -> Vec<[f64; 3]> {
    let run = problem.simulate().unwrap();
    let (end, length) = (problem.time().unwrap().end, problem.length());
    let at = |k: usize| run.at(point, end * k as f64 / 100.0).unwrap().0.map(|x| x / length);
    (1..=100).map(at).collect()
}

/// Largest distance of corresponding points, m.
fn largest_distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let distance = |(a, b): (&[f64; 3], &[f64; 3])| {
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    a.iter().zip(b).map(distance).fold(0.0, f64::max)
}

/// The chosen scheme as TOML.
fn scheme(resolution: &Resolution) -> String {
    match resolution.scheme.unwrap() {
        Scheme::GeneralisedAlpha => "scheme = \"generalised-alpha\"\nrho_inf = 0.8".into(),
        scheme => format!("scheme = \"{}\"", scheme.name()),
    }
}

/// The largest distance of the chosen run from one with `finer` times as many edges and steps, over the length.
fn true_error(scene: &str, chosen: &Problem, finer: usize) -> f64 {
    let resolution = chosen.resolution().unwrap();
    let middle = chosen.scene().supports.end != rodfit::scene::Support::Free;
    let point = if middle { Point::ArcLength(0.5 * chosen.length()) } else { Point::Tip };
    let segments = format!("segments = {}", finer * resolution.segments);
    let step = resolution.step.unwrap() / finer as f64;
    let time = format!("step = {step}\n{}", scheme(resolution));
    let fine = problem(scene, ["", &segments, &time]).unwrap();
    largest_distance(&positions(chosen, point), &positions(&fine, point))
}

const STRAIGHT: &str = "[rod]\nshape = { kind = \"straight\", length = 0.5, direction = [1, 0, 0] }\n\
    section = { kind = \"circle\", radius = 0.005 }\n\
    [material]\ndensity = 1273.52\nyoungs_modulus = 1e8\npoisson_ratio = 0.5\n";
const ARC: &str = "[rod]\nshape = { kind = \"arc\", length = 0.3, angle = 1.5 }\n\
    section = { kind = \"rectangle\", width = 0.01, height = 0.002, up = [0, 1, 0] }\n\
    [material]\ndensity = 2700\nyoungs_modulus = 2e9\npoisson_ratio = 0.3\n";
const HELIX: &str = "[rod]\n\
    shape = { kind = \"helix\", length = 0.5, radius = 0.02, pitch = 0.05, axis = [0, 0, -1], handedness = \"left\" }\n\
    section = { kind = \"circle\", radius = 0.005 }\n\
    [material]\ndensity = 1273.52\nyoungs_modulus = 1e7\npoisson_ratio = 0.5\n";
/// A wire of nitinol, plucked.
const WIRE: &str = "[rod]\nshape = { kind = \"straight\", length = 0.35, direction = [1, 0, 0] }\n\
    section = { kind = \"circle\", radius = 0.0005 }\n\
    [material]\ndensity = 6450\nyoungs_modulus = 6.2e10\npoisson_ratio = 0.33\n\
    [initial]\nstate = \"equilibrium\"\npoint = [{ node = \"tip\", force = [0, -0.12, 0] }]\n\
    [loads]\ngravity = [0, -9.81, 0]\ndamping = { stiffness = 4e-4 }\n[time]\nend = 0.15\n";

/// A dozen scenes, each of another kind.
fn dozen() -> Vec<String> {
    let with = |rod: &str, rest: &str| format!("{rod}{rest}\n");
    let down = "[loads]\ngravity = [0, -9.8, 0]\n";
    vec![
        with(STRAIGHT, &format!("{down}[time]\nend = 0.3")),
        with(STRAIGHT, &format!("{down}damping = {{ mass = 2.0 }}\n[time]\nend = 0.5")),
        with(STRAIGHT, &format!("{down}damping = {{ stiffness = 0.01 }}\n[time]\nend = 0.4")),
        with(STRAIGHT, &format!("{down}drag = {{ quadratic_normal = 2.0 }}\n[time]\nend = 0.4")),
        with(
            STRAIGHT,
            "[loads]\npoint = [{ node = \"tip\", force = [0, 0.02, 0.01] }]\n[time]\nend = 0.4",
        ),
        with(
            STRAIGHT,
            "[[supports.motion]]\nend = \"start\"\ndisplacement = [0, 0.02, 0]\nfrequency = 3.0\n[time]\nend = 0.5",
        ),
        with(STRAIGHT, "[initial]\nangular_velocity = [0, 0, 3]\n[time]\nend = 0.4"),
        with(ARC, &format!("{down}[time]\nend = 0.2")),
        with(
            ARC,
            "[supports]\nend = \"clamped\"\n[loads]\ngravity = [0, 200, 0]\ndamping = { stiffness = 1e-3 }\n\
             [time]\nend = 0.05",
        ),
        with(HELIX, "[loads]\ngravity = [0, 0, -9.8]\n[time]\nend = 0.2"),
        with(HELIX, "[loads]\ngravity = [0, -9.8, 0]\ndamping = { mass = 1.0 }\n[time]\nend = 0.2"),
        WIRE.into(),
    ]
}

/// Scenes without any numerics reach a requested error of 1e-2.
#[test]
fn true_errors_of_twelve_scenes_stay_below_the_request() {
    for (k, scene) in dozen().iter().enumerate() {
        let chosen = open(scene, 1e-2);
        let resolution = chosen.resolution().unwrap();
        let error = true_error(scene, &chosen, if k < 4 { 16 } else { 6 });
        println!(
            "{k}: {error:.1e}, {:.1e} estimated; {}",
            resolution.error.unwrap(),
            resolution.words()
        );
        // The requested error, in lengths of the rod.
        assert!(error <= 1e-2 && resolution.error.unwrap() <= 1e-2, "{k}: {error:e}");
    }
}

/// Where velocities jump at the clamp, many modes move, and errors of mesh and step fall with a lower order than elsewhere.
#[test]
fn true_errors_of_struck_rods_stay_below_the_request() {
    let down = "[loads]\ngravity = [0, -9.81, 0]\n";
    let scenes = [
        format!("[initial]\nvelocity = [0, 2, 0]\n{down}damping = {{ mass = 1.0 }}\n[time]\nend = 0.8\n"),
        "[initial]\nangular_velocity = [0, 0, 8]\n[loads]\ndamping = { stiffness = 1e-3 }\n[time]\nend = 0.6\n"
            .to_owned(),
    ];
    for (k, rest) in scenes.iter().enumerate() {
        let scene = format!("{STRAIGHT}{rest}");
        let chosen = open(&scene, 1e-2);
        let error = true_error(&scene, &chosen, 4);
        println!("{k}: {error:.1e}; {}", chosen.resolution().unwrap().words());
        // The requested error, in lengths of the rod.
        assert!(error <= 1e-2, "{k}: {error:e}");
    }
}

/// The default accuracy is 1e-3 of the length.
#[test]
fn true_errors_stay_below_a_request_of_1e_3() {
    for k in [0, 2, 7, 11] {
        let scene = &dozen()[k];
        let chosen = open(scene, 1e-3);
        let error = true_error(scene, &chosen, 6);
        println!("{k}: {error:.1e}; {}", chosen.resolution().unwrap().words());
        // The requested error, in lengths of the rod.
        assert!(error <= 1e-3, "{k}: {error:e}");
        let default = problem(scene, ["", "", ""]).unwrap();
        assert_eq!(default.scene().time, chosen.scene().time);
    }
}

/// Choosing takes about as much work as the chosen run at most, on rods that bend little and much: the trial runs of a coarse
/// request are nearly as fine as its run. Where `rodas4` is chosen, its run is up to some times cheaper than the trial runs by
/// generalised-alpha, which are counted with it.
#[test]
fn choosing_takes_at_most_1_2_runs() {
    let gravity = "[loads]\ngravity = [0, -9.8, 0]\n[time]\nend = 1.0\n";
    for (accuracy, modulus) in [(1e-2, "1e8"), (1e-3, "1e8"), (1e-2, "1e7"), (1e-3, "1e7")] {
        let scene = format!("{STRAIGHT}{gravity}").replace("1e8", modulus);
        let chosen = open(&scene, accuracy);
        let off = true_error(&scene, &chosen, 6);
        assert!(off < accuracy, "{accuracy}: {off:e}");
        let work = chosen.simulate().unwrap().work();
        // A step of rodas4 takes as long as five iterations.
        let iterations = match work.newton_iterations {
            0 => 5 * work.steps,
            iterations => iterations,
        };
        let part = chosen.resolution().unwrap().work / (iterations * chosen.segments()) as f64;
        println!("{accuracy}, {modulus}: {part:.2} of a run");
        let most = if work.newton_iterations == 0 { 3.0 } else { 1.2 };
        assert!(part < most, "{accuracy}, {modulus}: {part}");
    }
}

/// Limp, twisted and released rods, compared with runs three times as fine in mesh and step: the error is within the request or
/// a warning is given.
#[test]
fn chosen_run_has_an_error_below_twice_its_estimate() {
    let limp =
        STRAIGHT.replace("1e8", "1e5") + "[loads]\ngravity = [0, -9.81, 0]\n[time]\nend = 0.6\n";
    let twisted = STRAIGHT.replace(
        "section = { kind = \"circle\", radius = 0.005 }",
        "section = { kind = \"rectangle\", width = 0.01, height = 0.006, up = [0, 1, 0] }\nnatural_twist = -4.0",
    ) + "[loads]\npoint = [{ node = \"tip\", force = [0, 0.05, 0.04] }]\n[time]\nend = 0.15\n";
    let released = STRAIGHT.replace("1e8", "1e6")
        + "[initial]\nstate = \"shape\"\nshape = { kind = \"arc\", length = 0.5, angle = 1.5 }\n[time]\nend = 0.6\n";
    for (name, scene) in [("limp", limp), ("twisted", twisted), ("released", released)] {
        let text = scene.replace("[rod]", "accuracy = 1e-2\n[rod]");
        let (chosen, run) = Scene::from_toml(&text, "data").unwrap().simulate().unwrap();
        let resolution = chosen.resolution().unwrap();
        let segments = format!("segments = {}", 3 * resolution.segments);
        let time = format!("step = {}\n{}", resolution.step.unwrap() / 3.0, scheme(resolution));
        let fine = problem(&scene, ["", &segments, &time]).unwrap().simulate().unwrap();
        let end = chosen.time().unwrap().end;
        let at = |run: &rodfit::Trajectory, s: f64, k: usize| {
            run.at(Point::ArcLength(s), end * k as f64 / 100.0).unwrap().0.map(|x| x / 0.5)
        };
        let places = |run| -> Vec<[f64; 3]> {
            let points = [0.125, 0.25, 0.375, 0.4999];
            points.iter().flat_map(|s| (1..=100).map(move |k| at(run, *s, k))).collect()
        };
        let off = largest_distance(&places(&run), &places(&fine));
        println!("{name}: {off:.1e}; {}", resolution.words());
        // The requested error, or a warning that it is not reached.
        assert!(off <= 1e-2 || resolution.bound.is_some(), "{name}: {off:e}");
        assert!(off <= 2.0 * resolution.error.unwrap(), "{name}: {off:e}");
    }
}

/// A run that is further from the last trial run than the estimated errors allow, or that fails, is repeated in smaller steps;
/// the run of the scene itself is accepted. A rod of half the modulus stands for a run by wrong numerics.
#[test]
fn run_check_requires_finer_numerics_where_the_run_disagrees_or_fails() {
    let scene = dozen()[0].replace("[rod]", "accuracy = 1e-2\n[rod]");
    let assessed = |modulus: f64, outcome: Result<(), Error>| {
        let (problem, check) = Scene::from_toml(&scene, "data").unwrap().checked_problem().unwrap();
        let check = check.unwrap();
        let mut monitor = check.monitor(&problem).unwrap();
        let other = problem.with([(Parameter::YoungsModulus, modulus)]).unwrap();
        let steps = problem.time().unwrap().steps();
        let mut run = rodfit::Trajectory::unrecorded(&other).unwrap();
        run.run(&other, steps, |state| monitor.push(state)).unwrap();
        (steps, check.assess(&outcome, &monitor).unwrap())
    };
    match assessed(1e8, Ok(())).1 {
        RunAssessment::Accepted(error) => assert!(error.unwrap() <= 1e-2),
        RunAssessment::Repeat(_) => panic!("the run of the scene itself is repeated"),
    }
    for (modulus, outcome) in [(5e7, Ok(())), (1e8, Err(Error::SingularEquilibrium))] {
        match assessed(modulus, outcome) {
            (steps, RunAssessment::Repeat(next)) => {
                assert!(next.0.time().unwrap().steps() > steps);
                assert!(next.0.resolution().unwrap().work > 0.0);
            }
            (_, RunAssessment::Accepted(error)) => panic!("{modulus}: accepted with {error:?}"),
        }
    }
    let stopped = assessed(1e8, Err(Error::Interrupted)).1;
    assert!(matches!(stopped, RunAssessment::Accepted(None)));
}

/// The first run is that of a rod of half the modulus, as by wrong numerics: a second one follows, of the problem of the check.
#[test]
fn checked_simulation_is_repeated_until_its_check_accepts() {
    let scene = dozen()[0].replace("[rod]", "accuracy = 1e-2\n[rod]");
    let (problem, check) = Scene::from_toml(&scene, "data").unwrap().checked_problem().unwrap();
    let mut steps = Vec::new();
    let (problem, run) = simulate_checked(problem, check, |problem| {
        steps.push(problem.time()?.steps());
        let run = if steps.len() == 1 {
            problem.with([(Parameter::YoungsModulus, 5e7)])?
        } else {
            problem
        };
        let trajectory = rodfit::Trajectory::new(&run, &[run.nodes() - 1], &[])?;
        Ok((run, trajectory))
    })
    .unwrap();
    assert!(steps.len() == 2 && steps[1] > steps[0], "{steps:?}");
    assert_eq!(run.times().len() as u64, steps[1] as u64 + 1);
    // The requested error of the scene.
    assert!(problem.resolution().unwrap().error.unwrap() <= 1e-2);
}

/// A looser Newton tolerance needs fewer tangents and changes the motion by less than 1e-5; fits keep the default tolerance.
#[test]
fn newton_tolerance_follows_the_requested_accuracy() {
    for k in [0, 4, 9] {
        let scene = &dozen()[k];
        let chosen = open(scene, 1e-2);
        let Resolution { segments, step, .. } = *chosen.resolution().unwrap();
        let time =
            format!("step = {}\nscheme = \"generalised-alpha\"\nrho_inf = 0.8", step.unwrap());
        let exact = problem(scene, ["", &format!("segments = {segments}"), &time]).unwrap();
        let tangents = |p: &Problem| p.simulate().unwrap().work().tangents;
        let [few, many] = [&chosen, &exact].map(tangents);
        let off = largest_distance(&positions(&chosen, Point::Tip), &positions(&exact, Point::Tip));
        println!("{k}: {few} tangents instead of {many}, {off:.1e} off");
        // The Newton tolerance is a small part of the requested error.
        assert!(few < many && off < 1e-5, "{k}: {few} {many} {off:e}");
        let finer = chosen.scene().reopened().problem_for(Calculation::Guess).unwrap();
        assert_eq!(finer.scene().tolerance(), StepTolerance::default());
    }
}

/// For small errors a scheme of fourth order is cheaper. Its error is below 0.39 of the request, and half that of
/// generalised-alpha with the same work.
#[test]
fn rodas4_is_chosen_where_it_is_cheaper() {
    let scene = &dozen()[0];
    let chosen = open(scene, 1e-4);
    let Resolution { segments, scheme, step, .. } = *chosen.resolution().unwrap();
    assert_eq!(scheme, Some(Scheme::Rodas4));
    let alpha = |steps: f64| {
        let time = format!("step = {}\nscheme = \"generalised-alpha\"\nrho_inf = 0.8", 0.3 / steps);
        problem(scene, ["", &format!("segments = {segments}"), &time]).unwrap()
    };
    let truth = positions(&alpha(8000.0), Point::Tip);
    let off = largest_distance(&positions(&chosen, Point::Tip), &truth);
    // The same work: a step of rodas4 takes as long as five Newton iterations, two of which are a step of generalised-alpha.
    let same_work = alpha(5.0 * 0.3 / step.unwrap() / 2.0);
    let other = largest_distance(&positions(&same_work, Point::Tip), &truth);
    println!("{off:.1e}, {other:.1e} by the other scheme at the same cost");
    assert!(off < 0.39e-4 && other > 2.0 * off, "{off:e} {other:e}");

    let damped = scene.replace("[time]", "damping = { stiffness = 1e-3 }\n[time]");
    // Rodas4 is not chosen with stiffness damping.
    assert_eq!(open(&damped, 1e-4).time().unwrap().scheme, Scheme::GeneralisedAlpha);
    let refused = chosen.simulate_with(&[Parameter::DampingStiffness]).unwrap_err().to_string();
    assert!(refused.contains("rodas4") && refused.contains("generalised-alpha"), "{refused}");
    let (_, rates) =
        chosen.simulate_with(&[Parameter::YoungsModulus]).unwrap().at(Point::Tip, 0.2).unwrap();
    assert!(rates[0].iter().any(|rate| *rate != 0.0));
}

/// With Kelvin-Voigt damping newmark-beta at 0.5 is off by a tenth of the length in steps of 0.8 ms of the longer
/// scene; generalised-alpha, which is chosen, has an error of second order below 2e-2.
#[test]
fn chosen_scheme_is_stable_with_stiff_damping() {
    let scene = WIRE.replace("0.15", "0.3");
    let at =
        |time: &str| positions(&problem(&scene, ["", "segments = 50", time]).unwrap(), Point::Tip);
    let alpha = "scheme = \"generalised-alpha\"\nrho_inf = 0.8";
    let truth = at(&format!("step = 5e-5\n{alpha}"));
    for step in ["8e-4", "3.2e-3"] {
        let error = largest_distance(&at(&format!("step = {step}\n{alpha}")), &truth);
        println!("{step}: {error:.1e}");
        // Second order in the step: 2e-2 at 3.2 ms is proportional to the squared step.
        assert!(error < 2e-2 * (step.parse::<f64>().unwrap() / 3.2e-3).powi(2), "{error:e}");
    }
    let chosen = open(&scene, 1e-3);
    assert_eq!(chosen.time().unwrap().scheme, Scheme::GeneralisedAlpha);
}

/// A polyline keeps its points, and given numbers stay; a node index without a given mesh is refused.
#[test]
fn given_mesh_step_and_scheme_are_kept() {
    let line = "[rod]\nshape = { kind = \"polyline\", points = [[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [0.3, 0, 0]] }\n\
        section = { kind = \"circle\", radius = 0.005 }\n\
        [material]\ndensity = 1273.52\nyoungs_modulus = 1e8\n[loads]\ngravity = [0, -9.8, 0]\n[time]\nend = 0.2\n";
    let polyline = problem(line, ["", "", ""]).unwrap();
    let chosen = polyline.resolution().unwrap().chosen;
    assert_eq!((polyline.segments(), chosen.segments, chosen.step), (3, false, true));
    assert!(polyline.warnings().is_empty());

    let scene = &dozen()[0];
    let given = problem(scene, ["", "segments = 7", "step = 0.01"]).unwrap();
    assert_eq!((given.resolution(), given.time().unwrap().scheme), (None, Scheme::NewmarkBeta));
    let checked = problem(scene, ["accuracy = 1e-4", "segments = 7", "step = 0.01"]).unwrap();
    assert_eq!((checked.segments(), checked.time().unwrap()), (7, given.time().unwrap()));
    let error = checked.resolution().unwrap().error.unwrap();
    // A mesh of 7 segments and steps of 10 ms are too coarse for the request of 1e-4.
    assert!(error > 1e-3 && checked.warnings()[0].contains("Leave out rod.segments"), "{error:e}");
    let own = problem(scene, ["", "", "scheme = \"average-vector-field\""]).unwrap();
    assert_eq!(own.time().unwrap().scheme, Scheme::AverageVectorField);
    let rest = problem(&scene.replace("[time]\nend = 0.3", ""), ["", "", ""]);
    // The default accuracy of 1e-3.
    assert!(rest.unwrap().resolution().unwrap().error.unwrap() < 1e-3);

    for (key, found, allowed) in [
        ("accuracy", "accuracy = 1.0", "1e-8 .. 0.1"),
        ("rod.segments", "loads.point = [{ node = 3, force = [0, 1, 0] }]", "arc_length"),
    ] {
        let refused =
            problem(&scene.replace("[loads]\ngravity = [0, -9.8, 0]", ""), [found, "", ""]);
        let words = refused.unwrap_err().to_string();
        assert!(words.contains(key) && words.contains(allowed), "{words}");
    }
}

/// A limp undamped rod over hundreds of periods: the work is bounded, and a warning states the error.
#[test]
fn search_for_a_motion_ends_at_its_limit_of_work() {
    // Limp, undamped, and for hundreds of swings.
    let limp =
        STRAIGHT.replace("1e8", "1e4") + "[loads]\ngravity = [0, -9.8, 0]\n[time]\nend = 40\n";
    let bounded = open(&limp, 1e-4);
    let warning = &bounded.warnings()[0];
    assert!(warning.contains("would take too long"), "{warning}");
    // The error is unknown, or above the request of 1e-4.
    assert!(bounded.resolution().unwrap().error.is_none_or(|error| error > 1e-4));
}

/// Walls at nodes cause mesh errors of first order; equilibria, modes and motions still reach the requested error.
/// A limp rod, released from a quarter of a circle, whose motion has too many modes for 1e-4. The errors that its own search
/// estimates for smaller requests are several times those of 1e-3.
#[test]
fn request_out_of_reach_has_no_larger_error_than_a_reachable_one() {
    let scene = "[rod]\nshape = { kind = \"straight\", length = 0.2, direction = [1, 0, 0] }\nsection = { kind = \"circle\", radius = 0.004 }\n\
                 [material]\ndensity = 1100\nyoungs_modulus = 1e6\n[initial]\nstate = \"shape\"\n\
                 shape = { kind = \"arc\", length = 0.2, angle = 1.5708 }\n[time]\nend = 2.0\n";
    let mut largest = f64::INFINITY;
    for accuracy in [1e-3, 1e-4, 1e-5] {
        let resolution = *open(scene, accuracy).resolution().unwrap();
        let error = resolution.error.unwrap();
        assert!(error <= largest, "{accuracy:e}: {}", resolution.words());
        assert_eq!(resolution.bound.is_some(), accuracy < 1e-3, "{}", resolution.words());
        largest = error;
    }
    assert!(largest < 1e-3, "{largest:e}");
}

#[test]
fn mesh_of_walls_at_nodes_reaches_the_request() {
    let rod =
        STRAIGHT.to_string() + "[supports]\nclamp = \"nodes\"\n[loads]\ngravity = [0, -9.8, 0]\n";
    let read = |first: &str, segments: &str| {
        let text = rod.replace("[rod]", &format!("{first}\n[rod]\n{segments}"));
        Scene::from_toml(&text, "data").unwrap()
    };
    let fine = read("", "segments = 4000");
    for accuracy in [1e-2, 1e-3] {
        let open = read(&format!("accuracy = {accuracy}"), "");
        let problem = open.problem().unwrap();
        let rest = problem.equilibrium().unwrap();
        let tip = fine.problem().unwrap().equilibrium().unwrap().tip;
        let off = (rest.tip[1] - tip[1]).abs() / 0.5;
        assert!(off < accuracy && problem.resolution().unwrap().bound.is_none(), "{off:e}");

        let problem = open.problem_for(Calculation::Modes(2)).unwrap();
        let modes = problem.modes(2, LinearizationPoint::Rest).unwrap();
        // sqrt(E I/(rho A)) (1.875/L)^2
        let exact = (1e8_f64 / 1273.52).sqrt() * 0.0025 * (1.875_104_068_711_96_f64 / 0.5).powi(2);
        let off = (modes.frequencies_rad_s[0] / exact - 1.0).abs();
        println!("{accuracy:e}: {off:.1e} with {} edges", problem.segments());
        assert!(off < accuracy, "{off:e}");
    }
    let moving = rod.replace("[loads]", "[time]\nend = 0.3\n[loads]");
    let moving = Scene::from_toml(&moving, "data").unwrap().problem().unwrap();
    let resolution = moving.resolution().unwrap();
    // The default accuracy of 1e-3 is reached, without a warning.
    assert!(resolution.bound.is_none() && resolution.error.unwrap() < 1e-3, "{resolution:?}");
}

/// Rounding errors dominate the frequencies of very fine meshes: the search ends at 1000 edges with a warning. A free rod
/// has modes about its unstressed shape, though no equilibrium under gravity.
#[test]
fn search_for_modes_ends_at_the_largest_mesh() {
    let scene = Scene::from_toml(&format!("accuracy = 1e-6\n{STRAIGHT}"), "data").unwrap();
    let problem = scene.problem_for(Calculation::Modes(10)).unwrap();
    let resolution = problem.resolution().unwrap();
    assert!(resolution.segments <= 1000 && resolution.bound.is_some(), "{resolution:?}");

    let falling =
        STRAIGHT.to_string() + "[supports]\nstart = \"free\"\n[loads]\ngravity = [0, -9.8, 0]\n";
    let falling = Scene::from_toml(&falling, "data").unwrap();
    let modes = falling
        .problem_for(Calculation::Modes(8))
        .unwrap()
        .modes(8, LinearizationPoint::Rest)
        .unwrap();
    let bends = modes.modes.iter().filter(|mode| mode.number == Some(1)).map(|m| m.frequency_rad_s);
    // sqrt(E I/(rho A)) (4.730/L)^2
    let exact = (1e8_f64 / 1273.52).sqrt() * 0.0025 * (4.730_040_744_862_704_f64 / 0.5).powi(2);
    let off = bends.map(|w| (w / exact - 1.0).abs()).fold(f64::INFINITY, f64::min);
    assert!(off < 1e-3, "{off:e} {modes}");
}

/// Reports and warnings contain no infinite error.
#[test]
fn unknown_error_is_not_reported() {
    let unknown = open(&dozen()[0], 1e-8);
    let resolution = unknown.resolution().unwrap();
    assert!(resolution.error.is_none_or(f64::is_finite), "{resolution:?}");
    assert!(!resolution.words().contains("inf") && !unknown.warnings()[0].contains("inf"));
}

/// A missing step is chosen by the program; infinity is refused.
#[test]
fn infinite_step_is_refused_and_a_missing_one_is_chosen() {
    let mut scene = crate::common::cantilever();
    for step in [f64::INFINITY, f64::NAN, 0.0] {
        scene.time = Some(Time::new(0.2, step));
        let error = scene.problem().err().unwrap().to_string();
        assert!(error.contains("time.step"), "{step}: {error}");
    }
    scene.time = Some(Time { step: None, ..Time::new(0.2, 1e-3) });
    let problem = scene.problem().unwrap();
    assert!(problem.resolution().unwrap().chosen.step);
    // The step is within the duration of 0.2 s.
    assert!(problem.time().unwrap().step.unwrap() < 0.2);
}

/// A rod of 1 m between two supports, in tension under a load across.
fn supported(supports: &str, load: &str) -> String {
    format!(
        "[rod]\nshape = {{ kind = \"straight\", length = 1.0, direction = [1, 0, 0] }}\n\
         section = {{ kind = \"circle\", radius = 0.002 }}\n\
         [material]\ndensity = 1200\nyoungs_modulus = 1e9\n[supports]\n{supports}\n[loads]\n{load}\n"
    )
}

/// Positions of 41 equidistant points of the rod in equilibrium, over the length.
fn positions_at_rest(problem: &Problem) -> Vec<[f64; 3]> {
    let (rest, over) = (problem.equilibrium().unwrap(), problem.length().recip());
    let position = |k: i32| {
        let point = Point::ArcLength(f64::from(k) / 40.0 * problem.length());
        let mut sum = [0.0; 3];
        for (node, weight) in problem.stencil(point).unwrap().nodes {
            (0..3).for_each(|c| sum[c] += over * weight * rest.nodes[node][c]);
        }
        sum
    };
    (0..=40).map(position).collect()
}

/// Two opposite forces bend a clamped rod, whose middle stays at its place by symmetry. The end of a rod on a roller has a
/// larger error than its middle.
#[test]
fn error_of_an_equilibrium_is_estimated_along_the_whole_rod() {
    let opposite = "point = [{ node = { arc_length = 0.25 }, force = [0, 40, 0] }, \
                    { node = { arc_length = 0.75 }, force = [0, -40, 0] }]";
    let scenes = [
        ("opposite forces", supported("start = \"clamped\"\nend = \"clamped\"", opposite)),
        (
            "roller",
            supported("start = \"pinned\"\nend = \"roller\"", "line = [{ force = [0, 8, 0] }]"),
        ),
    ];
    for (name, scene) in scenes {
        let chosen = open(&scene, 1e-3);
        let resolution = chosen.resolution().unwrap();
        let fine = problem(&scene, ["", "segments = 800", ""]).unwrap();
        let error = largest_distance(&positions_at_rest(&chosen), &positions_at_rest(&fine));
        println!("{name}: {error:.1e}; {}", resolution.words());
        let allowed = 1.5 * resolution.error.unwrap();
        assert!(error <= allowed || resolution.bound.is_some(), "{name}: {error:e} {allowed:e}");
    }
}

/// A force acts for 0.4 s on a critically damped cantilever, which is at rest again after one of 120 s: a hundred equidistant
/// times do not meet the motion.
#[test]
fn error_of_a_short_motion_in_a_long_time_is_estimated() {
    let scene = |first: &str, segments: &str, time: &str| {
        let text = format!(
            "{first}\n[rod]\nshape = {{ kind = \"straight\", length = 1.0, direction = [1, 0, 0] }}\n\
             section = {{ kind = \"circle\", radius = 0.005 }}\n{segments}\n\
             [material]\ndensity = 1200\nyoungs_modulus = 2e9\n\
             [[signals]]\nname = \"p\"\nkind = \"pulse\"\nduration = 0.4\nrise = 0.1\n\
             [loads]\ndamping = {{ mass = 22.7 }}\n\
             point = [{{ node = \"tip\", force = [0, 2.945, 0], signal = \"p\" }}]\n[time]\n{time}\n"
        );
        Scene::from_toml(&text, "data").unwrap().simulate().unwrap()
    };
    let (chosen, run) = scene("accuracy = 1e-2", "", "end = 120");
    // Halving mesh and step of this run changes it by less than 1e-4 of the length.
    let fine_time = "end = 1.0\nstep = 1e-3\nscheme = \"generalised-alpha\"\nrho_inf = 0.8";
    let (_, fine) = scene("", "segments = 64", fine_time);
    let positions = |run: &rodfit::Trajectory| -> Vec<[f64; 3]> {
        let points = [0.25, 0.5, 0.75, 1.0].map(Point::ArcLength);
        let at = |point: Point, k: i32| run.at(point, 0.01 * f64::from(k)).unwrap().0;
        points.iter().flat_map(|point| (1..=100).map(move |k| at(*point, k))).collect()
    };
    let error = largest_distance(&positions(&run), &positions(&fine));
    let resolution = chosen.resolution().unwrap();
    println!("{error:.1e}; {}", resolution.words());
    let allowed = 1.5 * resolution.error.unwrap();
    assert!(error <= allowed || resolution.bound.is_some(), "{error:e} {allowed:e}");
}
