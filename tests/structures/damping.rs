//! Internal damping of single rods.

use crate::scenes::{joint, spatial_rod, twisting_steel};
use rodfit::{Scene, Structure, StructureScene, Trajectory};

/// Steps of the motions.
const STEPS: usize = 60;

/// Two times of viscous stress and a Maxwell branch, each times a factor.
fn damping(factor: f64, relaxes: bool) -> String {
    let branch = match relaxes {
        true => format!(", maxwell = [{{ stiffness = {:e}, time = 0.01 }}]", 0.4 * factor),
        false => String::new(),
    };
    format!(
        "damping = {{ stiffness = {:e}, bending = {:e}{branch} }}\n",
        1e-3 * factor,
        2e-3 * factor
    )
}

/// The text with thicker rods of rubber in place of steel.
fn soft(text: String) -> String {
    text.replace("2e11", "2e6")
        .replace("200000000000", "2e6")
        .replace("radius = 1e-3", "radius = 4e-3")
}

/// Text of `[time]`; only some schemes take a tolerance.
fn time(scheme: &str) -> String {
    let tolerance = match scheme {
        "average-vector-field" => "",
        _ => "tolerance = \"rounding\"\n",
    };
    format!("[time]\nend = 0.12\nstep = 2e-3\nscheme = \"{scheme}\"\n{tolerance}")
}

/// The motion of one cantilever alone under a force at its tip.
fn alone(dimension: &str, direction: &str, factor: f64, scheme: &str, relaxes: bool) -> Trajectory {
    let text = format!(
        "[rod]\n{dimension}segments = 10\nshape = {{ kind = \"straight\", length = 0.2, direction = {direction} }}\n\
         section = {{ kind = \"circle\", radius = 1e-3 }}\n\
         [material]\ndensity = 7800\nyoungs_modulus = 2e11\npoisson_ratio = 0.3\n\
         [supports]\nstart = \"clamped\"\n\
         [loads]\n{}[[loads.point]]\nnode = \"tip\"\nforce = [0.02, -0.05, 0]\n{}",
        damping(factor, relaxes),
        time(scheme)
    );
    let scene = Scene::from_toml(&soft(text), ".").unwrap();
    let problem = scene.problem().unwrap();
    let tip = [problem.nodes() - 1, problem.nodes() - 2];
    let mut run = Trajectory::new(&problem, &tip, &[]).unwrap().keep_energies();
    run.run(&problem, STEPS, |_| {}).unwrap();
    run
}

/// Two rods on a body of such a mass that it stays in place move as two cantilevers, each with its own damping. The sum
/// of their energies is that of the structure, with the energies of Maxwell springs.
#[test]
fn each_rod_has_its_own_damping() {
    let cases =
        [("newmark-beta", true), ("generalised-alpha", true), ("average-vector-field", false)];
    for (dimension, (scheme, relaxes)) in
        ["", "dimension = \"spatial\"\n"].into_iter().flat_map(|own| cases.map(|case| (own, case)))
    {
        if !dimension.is_empty() && scheme == "average-vector-field" {
            continue;
        }
        let inertia = if dimension.is_empty() { "1e9" } else { "[1e9, 1e9, 1e9]" };
        let rod = |name: &str, direction: [f64; 3], factor: f64| {
            spatial_rod(name, 10, 0.2, direction) + &format!("damping_factor = {factor}\n")
        };
        let force = |name: &str| {
            format!("[[loads.point]]\nrod = \"{name}\"\nnode = \"tip\"\nforce = [0.02, -0.05, 0]\n")
        };
        let text = [
            dimension.to_string(),
            twisting_steel(),
            rod("a", [1.0, 0.0, 0.0], 0.5),
            rod("b", [0.0, 1.0, 0.0], 2.0),
            format!(
                "[[bodies]]\nname = \"hub\"\nmass = 1e9\ninertia = {inertia}\nposition = [0, 0, 0]\n"
            ),
            joint("rigid", &["hub", "a.start", "b.start"], ""),
            format!("[loads]\n{}", damping(1.0, relaxes)),
            force("a"),
            force("b"),
            time(scheme),
        ];
        let scene = StructureScene::from_toml(&soft(text.concat()), ".").unwrap();
        let structure = Structure::new(scene).unwrap();
        let mut motion = structure.simulation().unwrap();
        let [a, b] = [("[1, 0, 0]", 0.5), ("[0, 1, 0]", 2.0)]
            .map(|(direction, factor)| alone(dimension, direction, factor, scheme, relaxes));
        let (mut off, mut energy, mut largest) = (0.0_f64, 0.0_f64, 0.0_f64);
        for k in 1..=STEPS {
            motion.step_to(a.times()[k]).unwrap();
            let shape = motion.shape();
            for (name, alone) in [("a", &a), ("b", &b)] {
                let (found, tip) = (shape.rods[name].tip, alone.tip(k));
                off = (0..3).map(|c| (found[c] - tip[c]).abs()).fold(off, f64::max);
            }
            let sum = a.energies()[k].total() + b.energies()[k].total();
            energy = energy.max((motion.energies().total() - sum).abs());
            largest = largest.max(motion.energies().kinetic);
        }
        println!("{scheme} {dimension:?}: off by {off:.1e} m, {energy:.1e} J of {largest:.1e} J");
        assert!(off < 1e-9 && energy < 1e-9 * largest, "{off:e} {energy:e} {largest:e}");
        // The factors have an effect that is far above these limits.
        let plain = alone(dimension, "[1, 0, 0]", 1.0, scheme, relaxes);
        let effect = (plain.tip(STEPS)[1] - a.tip(STEPS)[1]).abs();
        assert!(effect > 1e-5, "{effect:e}");
    }
}
