//! Internal friction as elastic-plastic bending with kinematic hardening: curvatures of a loading cycle against the
//! bilinear law of moment and curvature, plastic set and area of the loop included.

use rodfit::Scene;

use crate::common::planar;

const LENGTH: f64 = 0.4;
/// EI of the hardening branch, N m^2: of a round section of radius 4 mm with E = 2e7 Pa.
const BENDING: f64 = 2e7 * std::f64::consts::PI * 4e-3 * 4e-3 * 4e-3 * 4e-3 / 4.0;
/// Springs that slip: the elastic stiffness is EI (1 + 3), up to the curvature 2/m.
const SPRINGS: f64 = 3.0;
const YIELD: f64 = 2.0;
/// Duration of a change of the moment, and of that with the rest after it, s.
const RAMP: f64 = 2.0;
const HELD: f64 = 22.0;
/// Moments over EI, 1/m, that follow each other on straight lines with rests: past the yield moment `EI (1 + 3) 2/m`. Elastic
/// unloading ends where the moment has changed by twice that: at 11 - 16 = -5.
const MOMENTS: [f64; 7] = [11.0, 0.0, -5.0, -11.0, 0.0, 5.0, 11.0];
/// The curvatures there by the bilinear law, 1/m; the second is the plastic set.
const CURVATURES: [f64; 7] = [5.0, 2.25, 1.0, -5.0, -2.25, -1.0, 5.0];

/// The integrated curvature `2 tan(phi/2)` of the joint in the middle of a rod with moments at its tip, after each of
/// them. Damping is such that the rod follows without overshoot.
fn bent(segments: usize, springs: f64, moments: &[f64]) -> Vec<f64> {
    let mut text = format!(
        "[rod]\nshape = {{ kind = \"straight\", length = {LENGTH}, direction = [1, 0, 0] }}\n\
         section = {{ kind = \"circle\", radius = 0.004 }}\nsegments = {segments}\n\
         [material]\nyoungs_modulus = 2e7\ndensity = 1200\n[supports]\nstart = \"clamped\"\n\
         [loads.damping]\nmass = 15\nstiffness = 0.2\n"
    );
    if springs > 0.0 {
        text += &format!("friction = {{ stiffness = {springs}, curvature = {YIELD} }}\n");
    }
    text += &format!(
        "[time]\nend = {}\nstep = 0.02\ntolerance = \"rounding\"\n",
        HELD * moments.len() as f64
    );
    let mut before = 0.0;
    for (i, moment) in moments.iter().enumerate() {
        let (start, change) = (HELD * i as f64, BENDING * (moment - before));
        text += &format!(
            "[[signals]]\nname = \"change{i}\"\nkind = \"ramp\"\nstart = {start}\nduration = {RAMP}\n\
             [[loads.point]]\nnode = \"tip\"\nmoment = [0, 0, {change}]\nsignal = \"change{i}\"\n"
        );
        before = *moment;
    }
    let problem = Scene::from_toml(&text, ".").unwrap().problem().unwrap();
    let mut simulation = planar(&problem).simulation().unwrap();
    let steps = problem.time().unwrap().steps() / moments.len();
    let mut found = Vec::new();
    for k in 1..=steps * moments.len() {
        simulation.step_to(problem.time().unwrap().at(k)).unwrap();
        if k % steps == 0 {
            let node = |i: usize| [simulation.state().q[2 * i], simulation.state().q[2 * i + 1]];
            let [a, b, c] = [0, 1, 2].map(|i| node(segments / 2 - 1 + i));
            let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]);
            let angle = (u[0] * v[1] - u[1] * v[0]).atan2(u[0] * v[0] + u[1] * v[1]);
            found.push(2.0 * (0.5 * angle).tan());
        }
    }
    found
}

/// The integrated curvatures of the bilinear law for a joint of this length, m, in the discrete model, whose moment is the
/// derivative of the energy by the angle: `(EI/l) (k + 3 z) (1 + k^2/4)` with the stretch `z` of the springs.
fn by_the_law(length: f64) -> Vec<f64> {
    let (mut k0, mut z0) = (0.0, 0.0);
    let law = |moment: &f64| {
        let z = |k: f64| (z0 + k - k0).clamp(-YIELD * length, YIELD * length);
        let (mut low, mut high) = (-1.0, 1.0);
        for _ in 0..60 {
            let k = 0.5 * (low + high);
            let found = (k + SPRINGS * z(k)) * (1.0 + 0.25 * k * k);
            if found < moment * length { low = k } else { high = k }
        }
        (z0, k0) = (z(low), low);
        low
    };
    MOMENTS.iter().map(law).collect()
}

#[test]
fn loading_cycle_is_that_of_the_bilinear_law() {
    let errors = [20, 40].map(|segments| {
        // The length of the joint, from the elastic rod under a small moment.
        let length = bent(segments, 0.0, &[1e-3])[0] / 1e-3;
        let found = bent(segments, SPRINGS, &MOMENTS);
        let expected = by_the_law(length);
        for ((found, expected), moment) in found.iter().zip(&expected).zip(MOMENTS) {
            let off = (found - expected).abs() / length;
            println!("moment {moment}: curvature {:.6}, off by {off:.1e}", found / length);
            assert!(off < 1e-6, "{moment}: {found} {expected}");
        }
        // The corners of the loop in the order of the cycle: angles per length, and moments.
        let corner = |k: usize| [2.0 * (0.5 * found[k]).atan() / length, MOMENTS[k]];
        let corners = [0, 2, 3, 5].map(corner);
        let next = corners.iter().cycle().skip(1);
        let pairs = corners.iter().zip(next);
        let area = 0.5 * pairs.map(|(a, b)| b[0] * a[1] - a[0] * b[1]).sum::<f64>();
        let exact = 4.0 * SPRINGS * YIELD * (5.0 - YIELD);
        println!("{segments} edges: area of the loop {area:.5} EI, {exact} by the law");
        let curvature = found.iter().zip(CURVATURES).map(|(k, exact)| (k / length - exact).abs());
        [curvature.fold(0.0, f64::max), (area / exact - 1.0).abs()]
    });
    println!("against the continuous law: curvatures and area off by {errors:?}");
    // Second order in the edge length.
    for k in 0..2 {
        assert!(errors[0][k] > 3.7 * errors[1][k] && errors[1][k] < 0.02, "{errors:?}");
    }
}
