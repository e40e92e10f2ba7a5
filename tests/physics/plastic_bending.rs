//! Internal friction as elastic-plastic bending with kinematic hardening: curvatures of a loading cycle against the
//! bilinear law of moment and curvature, plastic set and area of the loop included.

use rodfit::Scene;

use crate::common::rest;

const LENGTH: f64 = 0.4;
/// EI of the hardening branch, N m^2: of a round section of radius 4 mm with E = 2e7 Pa.
const BENDING: f64 = 2e7 * std::f64::consts::PI * 4e-3 * 4e-3 * 4e-3 * 4e-3 / 4.0;
/// Springs that slip: the elastic stiffness is EI (1 + 3), up to the curvature 2/m.
const SPRINGS: f64 = 3.0;
const YIELD: f64 = 2.0;
/// Duration of a change of the moment, and of that with the rest after it, s.
const RAMP: f64 = 2.0;
const HELD: f64 = 6.0;

/// A rod along x under a moment at its tip, without gravity, damped so that it follows without overshoot.
fn rod() -> String {
    format!(
        "[rod]\nshape = {{ kind = \"straight\", length = {LENGTH}, direction = [1, 0, 0] }}\nsection = {{ kind = \"circle\", radius = 0.004 }}\n\
         segments = 10\n[material]\nyoungs_modulus = 2e7\ndensity = 1200\n[supports]\nstart = \"clamped\"\n"
    )
}

/// The tips, m, after each of the moments (over EI, 1/m), which follow each other on straight lines with rests.
fn tips(moments: &[f64]) -> Vec<[f64; 3]> {
    let mut text = rod();
    text += &format!(
        "[loads.damping]\nmass = 15\nstiffness = 0.02\nfriction = {{ stiffness = {SPRINGS}, curvature = {YIELD} }}\n\
         [time]\nend = {}\nstep = 0.005\n",
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
    let run = Scene::from_toml(&text, ".").unwrap().problem().unwrap().simulate().unwrap();
    let per_moment = (run.times().len() - 1) / moments.len();
    (1..=moments.len()).map(|k| run.tip(k * per_moment)).collect()
}

/// The tip of the elastic rod at a curvature, 1/m, on the same mesh.
fn tip_at(curvature: f64) -> [f64; 3] {
    let moment = BENDING * curvature;
    let load = format!("[[loads.point]]\nnode = \"tip\"\nmoment = [0, 0, {moment}]\n");
    rest(&Scene::from_toml(&(rod() + &load), ".").unwrap()).tip
}

/// The curvature, 1/m, at which the elastic rod has this height of the tip.
fn curvature_of(tip: [f64; 3]) -> f64 {
    let (mut low, mut high) = (-8.0, 8.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if tip_at(middle)[1] < tip[1] { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// A moment of 11 EI/m: past the yield moment `EI (1 + 3) 2/m`, at which the slope falls from 4 EI to EI.
#[test]
fn loading_cycle_is_that_of_the_bilinear_law() {
    // Elastic unloading ends where the moment has changed by twice the yield moment: at 11 - 16 = -5.
    let moments = [11.0, 0.0, -5.0, -11.0, 0.0, 5.0, 11.0];
    let curvatures = [5.0, 5.0 - 11.0 / 4.0, 1.0, -5.0, 11.0 / 4.0 - 5.0, -1.0, 5.0];
    let tips = tips(&moments);
    for ((tip, curvature), moment) in tips.iter().zip(curvatures).zip(moments) {
        let exact = tip_at(curvature);
        let off = (tip[0] - exact[0]).hypot(tip[1] - exact[1]) / LENGTH;
        println!("moment {moment}: curvature {curvature}, off by {off:.1e} of the length");
        assert!(off < 1e-6, "{moment} {off:e}");
    }
    // The corners of the loop, in the order of the cycle; the area is that of the law.
    let corners: Vec<[f64; 2]> = [0, 2, 3, 5].map(|k| [curvature_of(tips[k]), moments[k]]).to_vec();
    let next = corners.iter().cycle().skip(1);
    let area = 0.5 * corners.iter().zip(next).map(|(a, b)| b[0] * a[1] - a[0] * b[1]).sum::<f64>();
    let exact = 4.0 * SPRINGS * YIELD * (5.0 - YIELD);
    println!("area of the loop {area:.7} EI, {exact} by the law");
    assert!((area - exact).abs() < 1e-6 * exact, "{area}");
}
