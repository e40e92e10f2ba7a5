//! Motions of structures: momentum, energy, order and derivatives.

use crate::derivative_checks::{dual_run, shifted};
use crate::scenes::{joint, mixed, mixed_in_space, rod, structure};
use rodfit::Structure;
use rodfit::scene::structure::StructureJoint;
use rodfit::structure::StructureReport;

/// Two free rods of rubber with a spring that opens, `steps` steps in 0.01 s: 400 resolve all
/// axial vibrations, of up to 8000 rad/s.
fn opening(scheme: &str, steps: usize) -> Structure {
    let rubber =
        "[[materials]]\nname = \"rubber\"\ndensity = 1000\nyoungs_modulus = 1e7\n".to_string();
    let soft = |text: String| text.replace("steel", "rubber").replace("1e-3", "3e-3");
    structure(&[
        soft(rod("a", 8, 0.2, [1.0, 0.0])),
        soft(rod("b", 8, 0.15, [0.3, 1.0])),
        rubber,
        joint("spring", &["a.end", "b.start"], "rotation = 300.0\nrest = 0.8"),
        format!("[time]\nend = 0.01\nstep = {:e}\nscheme = \"{scheme}\"\n", 0.01 / steps as f64),
    ])
}

/// The state after `end` in `steps` steps, with the largest change of the energy, J, and the largest momenta.
fn run(structure: &Structure) -> (Vec<f64>, f64, [f64; 3], f64) {
    let time = structure.time().unwrap();
    let mut motion = structure.simulation().unwrap();
    let start = motion.energies().total();
    let (mut change, mut momenta, mut kinetic) = (0.0_f64, [0.0_f64; 3], 0.0_f64);
    for k in 1..=time.steps() {
        motion.step_to(time.at(k)).unwrap();
        let energies = motion.energies();
        change = change.max((energies.total() - start).abs());
        kinetic = kinetic.max(energies.kinetic);
        let now = motion.momentum();
        (0..3).for_each(|c| momenta[c] = momenta[c].max(now[c].abs()));
    }
    (motion.simulation().state().q.clone(), change, momenta, kinetic)
}

/// Nothing acts on a free structure from outside: its linear momentum is zero to rounding errors. The scheme keeps the
/// angular momentum to second order.
#[test]
fn momentum_of_a_free_structure_is_conserved() {
    let [coarse, fine] = [40, 80].map(|steps| run(&opening("newmark-beta", steps)).2);
    println!("{coarse:?} {fine:?}");
    // Against a scale of 1e-3 kg m/s: masses of grams at metres per second.
    assert!(coarse[..2].iter().all(|p| *p < 1e-14));
    let ratio = coarse[2] / fine[2];
    assert!((3.0..5.0).contains(&ratio), "{ratio}");
}

/// The average vector field conserves the energy of joints too.
#[test]
fn average_vector_field_conserves_the_energy_of_a_structure() {
    let (_, change, _, kinetic) = run(&opening("average-vector-field", 200));
    println!("{change:e} {kinetic:e}");
    assert!(change < 1e-8 * kinetic, "{change:e} of {kinetic:e}");
}

/// Differences of runs with half the step fall fourfold.
#[test]
fn motion_of_a_structure_converges_to_second_order_in_the_step() {
    let [a, b, c] = [400, 800, 1600].map(|steps| run(&opening("newmark-beta", steps)).0);
    let apart =
        |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    let ratio = apart(&a, &b) / apart(&b, &c);
    println!("{ratio} {:e}", apart(&b, &c));
    assert!((3.3..5.0).contains(&ratio), "{ratio}");
}

/// Derivatives of a motion by numbers of rods, bodies and joints, from a run over dual numbers, against central
/// differences of plain runs.
#[test]
fn dual_derivatives_of_a_motion_agree_with_differences() {
    let structure = mixed(8);
    let end = |structure: &Structure| {
        let mut motion = structure.simulation().unwrap();
        for k in 1..=20 {
            motion.step_to(2e-5 * f64::from(k)).unwrap();
        }
        // Positions of all nodes: coordinates of rotations have scales that depend on the numbers.
        let mut q = motion.simulation().state().q.clone();
        let frames = &motion.simulation().state().frames;
        motion.simulation().rod().place_carried(&mut q, frames);
        q.truncate(structure.at_rest().assembly.body_coordinates().start);
        q
    };
    for path in [
        "materials.steel.youngs_modulus",
        "rods.strut.section.radius",
        "rods.beam.shape.length",
        "bodies.bob.mass",
        "bodies.bob.inertia",
        "joints.1.rotation",
        "joints.1.rest",
    ] {
        let (value, q) = dual_run(&structure, path, (1..=20).map(|k| 2e-5 * f64::from(k)));
        let h = 1e-5 * value;
        let [plus, minus] = [h, -h].map(|h| end(&shifted(&structure, path, h)));
        let rates: Vec<f64> = q[..plus.len()].iter().map(|q| q.eps).collect();
        let size = rates.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        assert!(size > 0.0, "{path}");
        let plain = end(&structure);
        let apart = q.iter().zip(&plain).map(|(d, p)| (d.re - p).abs());
        let apart = apart.fold(0.0, f64::max);
        assert!(apart < 1e-10, "{path}: {apart:e}");
        for (i, rate) in rates.iter().enumerate() {
            let difference = (plus[i] - minus[i]) / (2.0 * h);
            assert!((rate - difference).abs() < 1e-4 * size, "{path} {i}: {rate} {difference}");
        }
    }
}

/// Uniform gravity does not turn a free structure with an offset body: its angular momentum about the center of mass stays
/// zero, and the body falls by `g t^2/2`.
#[test]
fn free_fall_of_a_structure_with_a_body_is_without_rotation() {
    let falling = structure(&[
        rod("arm", 10, 0.2, [1.0, 0.0]),
        "[[bodies]]\nname = \"bob\"\nmass = 0.1\ninertia = 1e-4\nposition = [0.3, 0, 0]\n".into(),
        joint("rigid", &["bob", "arm.end"], ""),
        "[loads]\ngravity = [0, -9.81, 0]\n[time]\nend = 0.1\nstep = 1e-3\n".into(),
    ]);
    let mut motion = falling.simulation().unwrap();
    for k in 1..=100 {
        motion.step_to(1e-3 * f64::from(k)).unwrap();
    }
    let bob = motion.shape().bodies["bob"];
    assert!((bob.position[1] + 9.81 * 0.01 / 2.0).abs() < 1e-11, "{:?}", bob.position);
    assert!(bob.angle.abs() < 1e-11, "{:e}", bob.angle);
    assert!((bob.position[0] - 0.3).abs() < 1e-12);
}

/// The energy that a viscous spring dissipates is no numerical damping, of which a report warns.
#[test]
fn report_of_a_structure_with_a_damped_joint_has_no_warning_of_its_loss() {
    let mut scene = opening("newmark-beta", 100).scene().clone();
    let StructureJoint::Spring { damping, .. } = &mut scene.joints[0] else { panic!("a spring") };
    *damping = 1.0;
    let structure = Structure::new(scene).unwrap();
    let (time, mut motion) = (structure.time().unwrap(), structure.simulation().unwrap());
    let mut report = StructureReport::new(&structure);
    report.push(&motion);
    let outcome: Result<(), rodfit::Error> = (1..=time.steps()).try_for_each(|k| {
        motion.step_to(time.at(k))?;
        report.push(&motion);
        Ok(())
    });
    report.finish(&structure, &outcome);
    let kinetic = report.energies.iter().map(|energies| energies.kinetic).fold(0.0, f64::max);
    let loss = report.energies[0].total() - report.energies.last().unwrap().total();
    println!("loss {loss:e} J, largest kinetic energy {kinetic:e} J");
    // The limit of the warning is a tenth of the largest kinetic energy.
    assert!(loss > 0.2 * kinetic && kinetic > 0.0, "{loss:e} of {kinetic:e}");
    assert_eq!((&report.status[..], &report.warnings[..]), ("completed", &[][..]));
}

/// The count of nodes is the number of their motions: bodies have nodes in a plane only.
#[test]
fn count_of_nodes_is_that_of_their_motions() {
    for structure in [mixed(8), mixed_in_space(8, "")] {
        let at_rest = structure.at_rest();
        let (q, v) = (&at_rest.q[..], vec![0.0; at_rest.q.len()]);
        let motions = structure.node_motions(&at_rest.assembly, [q, &v], &at_rest.frames);
        assert_eq!(structure.nodes().count(), motions.len());
    }
}
