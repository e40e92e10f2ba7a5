//! Prony series of Maxwell branches: relaxation, loss factor over frequency, creep, order in the step and dissipation,
//! against closed forms.

use nalgebra::{DMatrix, DVector};
use rodfit::scene::{
    Clamp, End, Initial, InitialState, Material, Maxwell, Motion, PowerLaw, Scene, Scheme,
    StepTolerance, Support, Time,
};
use rodfit::{Fit, Parameter, Trajectory, Unknown};
use std::f64::consts::{PI, TAU};

use crate::common::fits::{record, same_mesh};
use crate::common::{at_tip, cantilever, planar, straight_rod};
use crate::energy::energy_balance;

/// Three branches with relaxation times over two decades.
const SERIES: [Maxwell; 3] = [
    Maxwell { stiffness: 0.5, time: 0.02 },
    Maxwell { stiffness: 0.3, time: 0.2 },
    Maxwell { stiffness: 0.8, time: 2.0 },
];

const LENGTH: f64 = 0.1;
const RADIUS: f64 = 0.005;
/// Young's modulus, Pa: waves along the rod are a thousand times faster than its loads.
const MODULUS: f64 = 1e9;

/// A short rod along x between two walls, of which that at the end is moved along it.
fn stretched(motion: Motion, end: f64, steps: usize) -> Scene {
    let mut scene = straight_rod(4, [LENGTH, RADIUS], Material::new(1000.0, MODULUS));
    scene.supports.clamp = Clamp::Nodes;
    scene.supports.end = Support::Clamped;
    scene.supports.motion = vec![motion];
    scene.loads.damping.maxwell = SERIES.to_vec().into();
    let time = Time::new(end, end / steps as f64);
    let (scheme, tolerance) = (Scheme::NewmarkBeta, StepTolerance::Rounding);
    scene.time = Some(Time { scheme, beta: 0.55, tolerance, ..time });
    scene
}

/// Times, s, and the axial force at the end over that of the elastic rod under a displacement of 1 um along it.
fn axial_forces(scene: &Scene) -> Vec<[f64; 2]> {
    let problem = scene.problem().unwrap();
    let steps = problem.time().unwrap().steps();
    let mut run = Trajectory::new(&problem, &[], &[]).unwrap().keep_reactions();
    run.run(&problem, steps, |_| {}).unwrap();
    // The two middle edges are free to stretch.
    let stiffness = MODULUS * PI * RADIUS * RADIUS / (LENGTH / 2.0);
    let forces = run.reactions().into_iter().map(|r| r.end.force[0] / (stiffness * 1e-6));
    run.times().iter().copied().zip(forces).map(|(time, force)| [time, force]).collect()
}

/// After a fast ramp the stress decays as `1 + sum g e^(-t/tau)`, with the time from the middle of the ramp on.
#[test]
fn stress_relaxes_as_the_prony_series() {
    let ramp = 1e-3;
    let motion = Motion {
        end: End::End,
        displacement: [1e-6, 0.0, 0.0],
        ramp: Some(ramp),
        ..Motion::default()
    };
    let mut worst = 0.0_f64;
    for [time, force] in axial_forces(&stretched(motion, 0.5, 10_000)) {
        if time < 5e-3 {
            continue;
        }
        let decay =
            |branch: &Maxwell| branch.stiffness * (-(time - 0.5 * ramp) / branch.time).exp();
        let exact = 1.0 + SERIES.iter().map(decay).sum::<f64>();
        worst = worst.max((force / exact - 1.0).abs());
    }
    println!("relaxation off by {worst:.1e}");
    // The ramp's own duration: (ramp/tau)^2/50 of the fastest branch.
    assert!(worst < 2e-5, "{worst:e}");
}

/// A stretched rod with a power law relaxes between the times of its spectrum as `Gamma(1 + n) t^-n - to^-n`.
#[test]
fn stress_relaxes_by_a_power_of_time() {
    let ramp = 1e-4;
    let motion = Motion {
        end: End::End,
        displacement: [1e-6, 0.0, 0.0],
        ramp: Some(ramp),
        ..Motion::default()
    };
    let mut scene = stretched(motion, 0.1, 10_000);
    let law = PowerLaw { stiffness: 2.0, exponent: 0.5, from: 1e-4, to: 10.0 };
    scene.loads.damping.maxwell = Vec::new().into();
    scene.loads.damping.power_law = Some(law);
    // Gamma(1.5), and the sum of ten branches in place of the spectrum, as in the documentation of the law.
    let gamma = 0.5 * PI.sqrt();
    let x = 0.25 * 10.0_f64.ln() * law.exponent;
    let factor = x.sinh() / x;
    let mut worst = 0.0_f64;
    for [time, force] in axial_forces(&scene) {
        let since = time - 0.5 * ramp;
        if since < 5e-3 {
            continue;
        }
        let [from, to] = [law.from, law.to].map(f64::sqrt).map(f64::recip);
        let relaxing = law.stiffness * (gamma / since.sqrt() - to) / (from - to) * factor;
        worst = worst.max((force - 1.0 - relaxing).abs());
    }
    println!("relaxation off by {worst:.1e}");
    // The error of the branches beside the spectrum.
    assert!(worst < 1e-3, "{worst:e}");
}

/// Exponent and stiffness are found from an exact recording, beside the modulus.
#[test]
fn power_law_is_identified_from_exact_data() {
    let mut scene = cantilever();
    scene.rod.segments = Some(8);
    scene.time = Some(Time { tolerance: StepTolerance::Rounding, ..Time::new(1.0, 2e-3) });
    let law = PowerLaw { stiffness: 0.8, exponent: 0.35, from: 2e-3, to: 2.0 };
    scene.loads.damping.power_law = Some(law);
    let data = record(&scene.problem().unwrap().simulate().unwrap(), 200).sigma(1e-4);
    let truth = scene.material.youngs_modulus;
    scene.loads.damping.power_law = Some(PowerLaw { stiffness: 0.6, exponent: 0.3, ..law });
    let fit = Fit::new(&scene.problem().unwrap()).observe(data);
    let fit = fit.identify(Unknown::new(Parameter::YoungsModulus).start(1.1 * truth));
    let fit = fit.identify(Unknown::new("loads.damping.power_law.stiffness".parse().unwrap()));
    let fit = fit.identify(Unknown::new("loads.damping.power_law.exponent".parse().unwrap()));
    let report = fit.analyse(same_mesh()).solve().unwrap();
    for (estimate, truth) in report.parameters.iter().zip([truth, 0.8, 0.35]) {
        let off = (estimate.value.unwrap() / truth - 1.0).abs();
        println!("{}: {off:.1e}", estimate.name);
        assert!(off < 1e-6, "{}: {off:e}", estimate.name);
    }
}

#[test]
fn invalid_power_laws_are_named() {
    for (law, key) in [
        ([0.5, 0.0, 1e-3, 1.0], "exponent"),
        ([0.5, 1.1, 1e-3, 1.0], "exponent"),
        ([-0.5, 0.3, 1e-3, 1.0], "stiffness"),
        ([0.5, 0.3, 0.0, 1.0], "from"),
        ([0.5, 0.3, 1e-3, 1e-3], "to"),
        ([0.5, 0.3, 1e-3, f64::INFINITY], "to"),
        ([0.5, 0.3, 1e-300, 1.0], "to"),
    ] {
        let mut scene = cantilever();
        let [stiffness, exponent, from, to] = law;
        scene.loads.damping.power_law = Some(PowerLaw { stiffness, exponent, from, to });
        let error = scene.validate().unwrap_err().to_string();
        assert!(error.contains(&format!("loads.damping.power_law.{key}")), "{error}");
    }
}

/// Storage and loss modulus over three decades of frequency.
#[test]
fn loss_factor_over_frequency_equals_the_closed_form() {
    for frequency in [0.05, 0.5, 5.0, 50.0] {
        let (w, periods) = (TAU * frequency, 2.0 + (8.0 * frequency).ceil());
        let (end, each) = (periods / frequency, 600);
        let motion = Motion {
            end: End::End,
            displacement: [1e-6, 0.0, 0.0],
            frequency: Some(frequency),
            ..Motion::default()
        };
        let forces = axial_forces(&stretched(motion, end, periods as usize * each));
        // Fourier coefficients over the last period, where the transients have decayed.
        let last = &forces[forces.len() - each..];
        let part = |wave: fn(f64) -> f64| {
            last.iter().map(|[t, force]| force * wave(w * t)).sum::<f64>() * 2.0 / each as f64
        };
        let [storage, loss] = [part(f64::sin), part(f64::cos)];
        let sum = |of: &dyn Fn(f64) -> f64| -> f64 {
            SERIES
                .iter()
                .map(|branch| {
                    let x = w * branch.time;
                    branch.stiffness * of(x) / (1.0 + x * x)
                })
                .sum()
        };
        let (exact_storage, exact_loss) = (1.0 + sum(&|x| x * x), sum(&|x| x));
        let [off_storage, off_loss] =
            [(storage - exact_storage) / exact_storage, (loss - exact_loss) / exact_storage];
        println!(
            "{frequency} Hz: loss factor {:.5}, exactly {:.5}; off by {off_storage:.1e}, {off_loss:.1e}",
            loss / storage,
            exact_loss / exact_storage
        );
        assert!(off_storage.abs() < 3e-4 && off_loss.abs() < 1e-4, "{frequency}");
    }
}

/// The place of one mass on a spring with Maxwell branches after the time `end`, over the amplitude: of the simulation,
/// and by the exponential of the matrix of `p' = v, v' = force - p - sum g z, z' = v - z/tau`. Times are in units of
/// the undamped vibration.
pub fn oscillator(
    series: &[Maxwell],
    scheme: Scheme,
    force: f64,
    end: f64,
    steps: u32,
) -> [f64; 2] {
    let mut scene = straight_rod(2, [0.1, 0.005], Material::new(1000.0, 1e7));
    scene.supports.clamp = Clamp::Nodes;
    let time = Time::new(1.0, 1.0);
    scene.time = Some(Time { scheme, rho_inf: 0.8, tolerance: StepTolerance::Rounding, ..time });
    let problem = scene.problem().unwrap();
    let rod = planar(&problem).rod();
    let stiffness = rod.stretch[1].stiffness / rod.stretch[1].rest_length;
    let w = (stiffness / rod.mass[4]).sqrt();
    let branch = |own: &Maxwell| Maxwell { time: own.time / w, ..*own };
    scene.loads.damping.maxwell = series.iter().map(branch).collect::<Vec<_>>().into();
    let amplitude = 1e-6;
    if force != 0.0 {
        scene.loads.point = at_tip([force * amplitude * stiffness, 0.0, 0.0]);
    }
    let problem = scene.problem().unwrap();
    let mut simulation = planar(&problem).simulation().unwrap();
    let rest = simulation.state().q[4];
    let speed = if force == 0.0 { 1.0 } else { 0.0 };
    simulation.set_velocity(&[0.0, 0.0, 0.0, 0.0, speed * amplitude * w, 0.0]);
    for k in 1..=steps {
        simulation.step_to(end / w * f64::from(k) / f64::from(steps)).unwrap();
    }
    // Unknowns: place, velocity, the stretch of every branch, and the constant 1.
    let n = series.len() + 3;
    let mut law = DMatrix::zeros(n, n);
    (law[(0, 1)], law[(1, 0)], law[(1, n - 1)]) = (1.0, -1.0, force);
    for (k, own) in series.iter().enumerate() {
        (law[(1, k + 2)], law[(k + 2, 1)]) = (-own.stiffness, 1.0);
        law[(k + 2, k + 2)] = -1.0 / own.time;
    }
    let mut start = DVector::zeros(n);
    (start[1], start[n - 1]) = (speed, 1.0);
    let exact = (law * end).exp() * start;
    [(simulation.state().q[4] - rest) / amplitude, exact[0]]
}

/// Vibration after a blow, and creep under a constant force, at second order in the step.
#[test]
fn vibration_and_creep_equal_the_closed_form_at_second_order() {
    let series = [
        Maxwell { stiffness: 0.4, time: 0.3 },
        Maxwell { stiffness: 0.8, time: 1.5 },
        Maxwell { stiffness: 0.6, time: 6.0 },
    ];
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        for force in [0.0, 0.7] {
            let errors = [400, 800, 1600].map(|steps| {
                let [found, exact] = oscillator(&series, scheme, force, 9.0, steps);
                found - exact
            });
            let orders = [errors[0] / errors[1], errors[1] / errors[2]].map(|r| r.abs().log2());
            println!("{scheme:?}, force {force}: errors {errors:?}, orders {orders:.2?}");
            assert!(errors[2].abs() < 1e-4 && orders.iter().all(|p| (p - 2.0).abs() < 0.15));
        }
    }
}

/// The energy of a rod that is let go, with that of all springs, never rises; nor does that of the branches.
#[test]
fn series_dissipates_energy_at_every_step() {
    let mut scene = cantilever();
    scene.rod.segments = Some(16);
    scene.loads.gravity = [0.0; 3];
    scene.initial = Initial { state: InitialState::Equilibrium, ..Initial::default() };
    scene.initial.point = at_tip([0.0, -0.05, 0.0]);
    scene.loads.damping.maxwell = SERIES.to_vec().into();
    for scheme in [Scheme::NewmarkBeta, Scheme::GeneralisedAlpha] {
        scene.time = Some(Time { scheme, rho_inf: 0.9, ..Time::new(0.3, 2e-4) });
        let [start, rise, lost] = energy_balance(&scene);
        println!("{scheme:?}: {lost:.3e} J of {:.3e}, rise {rise:.1e}", start);
        // Energy may rise by the error of the scheme only.
        assert!(lost > 0.2 * start && rise < 1e-3 * lost, "{scheme:?}: {rise:e} of {lost:e}");
    }
}

/// A list with one branch has the motion of its table, two halves of a branch that of the whole one, and a branch
/// without stiffness none.
#[test]
fn lists_of_branches_equal_the_branch_that_they_add_up_to() {
    let branch = Maxwell { stiffness: 0.5, time: 0.05 };
    let half = Maxwell { stiffness: 0.25, ..branch };
    let nothing = Maxwell { stiffness: 0.0, time: 0.3 };
    let tip = |maxwell| {
        let mut scene = cantilever();
        scene.rod.segments = Some(12);
        scene.time = Some(Time { tolerance: StepTolerance::Rounding, ..Time::new(0.2, 1e-3) });
        scene.loads.damping.maxwell = maxwell;
        scene.problem().unwrap().simulate().unwrap().tip(200)
    };
    let whole = tip(branch.into());
    assert_eq!(whole, tip(vec![branch].into()));
    for series in [vec![half, half], vec![nothing, branch], vec![branch, nothing]] {
        let found = tip(series.clone().into());
        let off = (0..3).map(|c| (found[c] - whole[c]).abs()).sum::<f64>();
        assert!(off < 1e-11, "{series:?}: {off:e}");
    }
    assert!((tip(Vec::new().into())[1] - whole[1]).abs() > 1e-3);
}

/// Names of parameters, and messages of wrong entries.
#[test]
fn keys_of_branches_are_parameters_and_wrong_ones_are_named() {
    let read = |maxwell: &str| -> Result<Scene, String> {
        let text = format!(
            "[rod]\nsegments = 4\nshape = {{ kind = \"straight\", length = 0.5, direction = [1, 0, 0] }}\n\
             section = {{ kind = \"circle\", radius = 0.005 }}\n\
             [material]\ndensity = 1000\nyoungs_modulus = 1e8\n\
             [loads.damping]\nmaxwell = {maxwell}\n[time]\nend = 0.1\nstep = 1e-3\n"
        );
        let scene = Scene::from_toml(&text, ".").map_err(|error| error.to_string())?;
        scene.problem().map_err(|error| error.to_string())?;
        Ok(scene)
    };
    let names = |maxwell: &str| -> Vec<String> {
        let all = Parameter::all(&read(maxwell).unwrap()).into_iter();
        all.map(|p| p.path().to_string()).filter(|path| path.contains("maxwell")).collect()
    };
    let one = names("{ stiffness = 0.5, time = 0.1 }");
    assert_eq!(one, ["loads.damping.maxwell.stiffness", "loads.damping.maxwell.time"]);
    let two = names("[{ stiffness = 0.5, time = 0.1 }, { stiffness = 0.2, time = 1.0 }]");
    assert_eq!(two.len(), 4);
    assert_eq!(two[3], "loads.damping.maxwell.1.time");
    for (maxwell, expected) in [
        ("[{ stiffness = 0.5, time = 0.1 }, { stiffness = 0.2, time = 0 }]", "maxwell[1].time"),
        ("{ stiffness = -0.5, time = 0.1 }", "loads.damping.maxwell.stiffness"),
        ("{ stiffness = 0.5, tau = 0.1 }", "tau"),
        ("[{ stiffness = 0.5 }]", "time"),
        ("0.5", "list of such tables"),
    ] {
        let message = read(maxwell).unwrap_err();
        println!("{maxwell}: {message}");
        assert!(message.contains(expected), "{message}");
    }
    // Schemes without internal variables.
    let mut scene = read("[{ stiffness = 0.5, time = 0.1 }]").unwrap();
    scene.time = Some(Time { scheme: Scheme::Verlet, ..Time::new(0.1, 1e-5) });
    let refused = scene.problem().unwrap_err().to_string();
    assert!(refused.contains("loads.damping.maxwell"), "{refused}");
}
