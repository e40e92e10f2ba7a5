//! Rods whose section and material change along them: deflections by integrals of the compliance, frequencies by Kirchhoff and
//! the Ritz method.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rodfit::scene::{Along, BreakPoints, Dimension, Material, Scene, Section, Shape, Taper};
use rodfit::vibration::{LinearizationPoint, ModeKind};
use std::f64::consts::PI;

use crate::common::{at_tip, rest};

const MODULUS: f64 = 1e8;
const DENSITY: f64 = 1000.0;
const RADIUS: f64 = 5e-3;
const LENGTH: f64 = 0.5;

fn rod(segments: usize, section: Section, taper: &Taper) -> Scene {
    let shape = Shape::Straight { length: LENGTH, direction: [1.0, 0.0, 0.0] };
    let material = Material { poisson_ratio: Some(0.5), ..Material::new(DENSITY, MODULUS) };
    let mut scene = Scene::new(segments, shape, section, material);
    scene.rod.taper = taper.clone();
    scene
}

fn circle() -> Section {
    Section::Circle { radius: RADIUS }
}

fn on_radius(factor: Along) -> Taper {
    Taper { radius: Some(factor), ..Taper::default() }
}

fn on_modulus(factor: Along) -> Taper {
    Taper { youngs_modulus: Some(factor), ..Taper::default() }
}

/// The linear function from 1 to another number.
fn line(to: f64) -> impl Fn(f64) -> f64 {
    move |x| 1.0 - (1.0 - to) * x
}

/// The integral from 0 to 1 by Simpson's rule, in pieces between which the function may jump.
fn integral(breaks: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    let piece = |w: &[f64]| {
        let (n, h) = (200, (w[1] - w[0]) / 200.0);
        let weight = |k: usize| if k == 0 || k == n { 1.0 } else { 2.0 + 2.0 * (k % 2) as f64 };
        // The ends belong to this side of a jump.
        let at = |k: usize| w[0] + h * (k as f64).clamp(1e-9, n as f64 - 1e-9);
        (0..=n).map(|k| weight(k) * f(at(k))).sum::<f64>() * h / 3.0
    };
    breaks.windows(2).map(piece).sum()
}

/// A small force on the tip bends it by the integral of M^2/EI: at second order whether stiffness falls in a
/// line, jumps, or both. A cone's is in closed form, P L^3/(3 EI) by its radius at the wall over that at
/// the tip.
#[test]
fn tapered_rod_deflection_is_the_integral_of_compliance() {
    let (force, stiffness) = (1e-7, MODULUS * PI * RADIUS.powi(4) / 4.0);
    let unit = force * LENGTH.powi(3) / stiffness;
    // Closed form of a cone with ratio 0.4 of its radii; Simpson's rule.
    assert!(
        (integral(&[0.0, 1.0], |x| ((1.0 - x) / line(0.4)(x).powi(2)).powi(2)) - 1.0 / 1.2).abs()
            < 1e-8
    );
    let parts = vec![1.0, 0.3, 2.0];
    let part = |x: f64| -> f64 { [1.0, 0.3, 2.0][(3.0 * x) as usize] };
    let thirds = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0];
    let both =
        Taper { youngs_modulus: Some(parts.clone().into()), ..on_radius(Along::linear(1.0, 0.4)) };
    let arm = |x: f64| (1.0 - x) * (1.0 - x);
    // Break points at arc lengths of a rod of this length.
    let cones = BreakPoints { at: vec![0.0, 0.7 * LENGTH, LENGTH], factor: vec![1.0, 0.6, 0.9] };
    let cones = Along::BreakPoints(cones);
    let two = |x: f64| if x < 0.7 { 1.0 - 0.4 * x / 0.7 } else { 0.6 + (x - 0.7) };
    for (name, taper, exact) in [
        ("cone", on_radius(Along::linear(1.0, 0.4)), 1.0 / 1.2),
        (
            "modulus in a line",
            on_modulus(Along::linear(1.0, 0.2)),
            integral(&thirds, |x| arm(x) / line(0.2)(x)),
        ),
        ("modulus in parts", on_modulus(parts.into()), integral(&thirds, |x| arm(x) / part(x))),
        ("two cones", on_radius(cones), integral(&[0.0, 0.7, 1.0], |x| arm(x) / two(x).powi(4))),
        ("both", both, integral(&thirds, |x| arm(x) / part(x) / line(0.4)(x).powi(4))),
    ] {
        for dimension in [Dimension::Planar, Dimension::Spatial] {
            let error = |segments: usize| {
                let mut scene = rod(segments, circle(), &taper);
                scene.rod.dimension = dimension;
                scene.loads.point = at_tip([0.0, -force, 0.0]);
                -rest(&scene).tip[1] / (unit * exact) - 1.0
            };
            // Meshes that meet the jumps in all ways.
            for edges in [20, 21, 22, 23, 61, 62, 63, 67, 200, 201] {
                let scaled = error(edges) * (edges as f64 - 0.5).powi(2);
                println!("{name}, {dimension:?}, {edges}: {scaled:.2} squared edges");
                assert!(scaled.abs() < 4.0, "{name} {dimension:?} {edges}: {scaled}");
            }
        }
    }
}

/// The lowest squared frequencies of a clamped beam with stiffness and mass per length `b` and `m` by Ritz, in
/// polynomials from the second power on.
fn ritz(breaks: &[f64], b: impl Fn(f64) -> f64, m: impl Fn(f64) -> f64) -> Vec<f64> {
    let (n, power) = (9, |k: usize| (k + 2) as f64);
    let entry = |f: &dyn Fn(f64, f64, f64) -> f64| {
        DMatrix::from_fn(n, n, |i, j| integral(breaks, |x| f(x, power(i), power(j))))
    };
    let bending =
        |x: f64, p: f64, q: f64| b(x) * p * (p - 1.0) * q * (q - 1.0) * x.powf(p + q - 4.0);
    let stiffness = entry(&bending);
    let mass = entry(&|x, p, q| m(x) * x.powf(p + q));
    let inverse = mass.cholesky().unwrap().l().try_inverse().unwrap();
    let mut squares: DVector<f64> =
        SymmetricEigen::new(&inverse * stiffness * inverse.transpose()).eigenvalues;
    squares.as_mut_slice().sort_by(f64::total_cmp);
    squares.as_slice().to_vec()
}

/// The lowest frequency of a clamped beam whose outer half has so many times the radius of the inner, exactly:
/// deflection, slope, moment and force are carried from one end to the other, where the last two vanish.
fn stepped(factor: f64) -> f64 {
    let left_over = |w: f64| {
        let carry = |f: f64| {
            let (b, k) = (f.powi(4), (w / f).sqrt());
            let (c, h, s, z) =
                ((0.5 * k).cos(), (0.5 * k).cosh(), (0.5 * k).sin(), (0.5 * k).sinh());
            let (s1, s2, s3, s4) = ((h + c) / 2.0, (z + s) / 2.0, (h - c) / 2.0, (z - s) / 2.0);
            let (k2, k3) = (k * k, k * k * k);
            DMatrix::from_row_slice(
                4,
                4,
                &[
                    s1,
                    s2 / k,
                    s3 / (k2 * b),
                    s4 / (k3 * b),
                    k * s4,
                    s1,
                    s2 / (k * b),
                    s3 / (k2 * b),
                    b * k2 * s3,
                    b * k * s4,
                    s1,
                    s2 / k,
                    b * k3 * s2,
                    b * k2 * s3,
                    k * s4,
                    s1,
                ],
            )
        };
        let all = carry(factor) * carry(1.0);
        all[(2, 2)] * all[(3, 3)] - all[(2, 3)] * all[(3, 2)]
    };
    let (mut low, mut high) = (0.5, 6.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if left_over(middle) > 0.0 { low = middle } else { high = middle }
    }
    low
}

/// Frequencies of cones, wedges and stepped rods converge to second order to those by Ritz's method, and for pointed cones and
/// wedges to Kirchhoff's.
#[test]
fn tapered_rod_frequencies_agree_with_kirchhoff_and_ritz() {
    let whole = [0.0, 1.0];
    let sharp = 1e-4;
    let cone = ritz(&whole, |x| line(sharp)(x).powi(4), |x| line(sharp)(x).powi(2));
    let wedge = ritz(&whole, |x| line(sharp)(x).powi(3), |x| line(sharp)(x));
    // Kirchhoff's number of the cone that ends in a point.
    assert!((cone[0].sqrt() - 8.719).abs() < 2e-3, "{}", cone[0].sqrt());
    // Of one thickness: the table's number.
    assert!((stepped(1.0) - 1.87510407_f64.powi(2)).abs() < 1e-6, "{}", stepped(1.0));
    assert!((wedge[0].sqrt() - 5.315).abs() < 2e-3, "{}", wedge[0].sqrt());

    let up = [0.0, 1.0, 0.0];
    let flat = Section::Rectangle { width: 0.02, height: 2.0 * RADIUS, up };
    let on_height = Taper { height: Some(Along::linear(1.0, 0.3)), ..Taper::default() };
    for (name, section, taper, slenderness, exact) in [
        (
            "cone",
            circle(),
            on_radius(Along::linear(1.0, 0.3)),
            0.5,
            ritz(&whole, |x| line(0.3)(x).powi(4), |x| line(0.3)(x).powi(2)),
        ),
        (
            "wedge",
            flat,
            on_height,
            1.0 / 3f64.sqrt(),
            ritz(&whole, |x| line(0.3)(x).powi(3), line(0.3)),
        ),
        ("step", circle(), on_radius(vec![1.0, 0.7].into()), 0.5, vec![stepped(0.7).powi(2)]),
    ] {
        let unit = slenderness * RADIUS * (MODULUS / DENSITY).sqrt() / LENGTH.powi(2);
        for dimension in [Dimension::Planar, Dimension::Spatial] {
            let errors = [30, 60, 120].map(|segments| {
                let mut scene = rod(segments, section.clone(), &taper);
                scene.rod.dimension = dimension;
                let found =
                    scene.problem().unwrap().modes(6, LinearizationPoint::Equilibrium).unwrap();
                // The wedge is stiffer across.
                let lowest = found.modes.iter().find(|m| m.kind == ModeKind::Bending).unwrap();
                lowest.frequency_rad_s / (exact[0].sqrt() * unit) - 1.0
            });
            println!("{name}, {dimension:?}: {errors:?}");
            // Second order in the mesh, against Kirchhoff and Ritz.
            assert!(errors[2].abs() < 3e-4, "{errors:?}");
            // A jump moves against the mesh: its part of the error goes up and down.
            let order = (errors[0] / errors[2]).abs().log2() / 2.0;
            assert!(order > 1.7, "{name} {dimension:?}: {order} {errors:?}");
        }
    }
}

/// Torsional frequencies of a shaft of two stiffnesses: tan(w a) tan(w b) is the ratio of the impedances, with the travel times
/// a and b of waves along its halves.
#[test]
fn stepped_shaft_torsional_frequencies_agree_with_impedances() {
    let factor: f64 = 0.3;
    let slow = (MODULUS / 3.0 / DENSITY).sqrt();
    let [a, b] = [1.0, factor.sqrt()].map(|c| 0.5 * LENGTH / (slow * c));
    let equation = |w: f64| (w * a).tan() * (w * b).tan() - 1.0 / factor.sqrt();
    let (mut low, mut high) = (0.0, PI / 2.0 / b - 1e-9);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if equation(middle) < 0.0 { low = middle } else { high = middle }
    }
    let errors = [20, 40, 80].map(|segments| {
        let mut scene = rod(segments, circle(), &on_modulus(vec![1.0, factor].into()));
        scene.rod.dimension = Dimension::Spatial;
        let found = scene.problem().unwrap().modes(40, LinearizationPoint::Equilibrium).unwrap();
        let torsion = found.modes.iter().find(|m| m.kind == ModeKind::Torsion).unwrap();
        torsion.frequency_rad_s / low - 1.0
    });
    println!("{errors:?}");
    // Frequency equation of the two-part shaft, with the error of the mesh.
    assert!(errors[2].abs() < 3e-4, "{errors:?}");
    // Second order in the mesh.
    assert!((errors[0] / errors[2]).abs().log2() / 2.0 > 1.7, "{errors:?}");
}

/// A factor of one has no effect, a constant factor equals another rod, a tube without a hole is a circle, and a written scene
/// is read unchanged.
#[test]
fn equivalent_descriptions_of_a_taper_are_equal() {
    let droop = |mut scene: Scene| {
        scene.loads.gravity = [0.0, -9.8, 0.0];
        let mut read = Scene::from_toml(&scene.to_toml().unwrap(), ".").unwrap();
        read.path = None;
        assert_eq!(read, scene);
        rest(&scene).tip[1]
    };
    let plain = droop(rod(20, circle(), &Taper::default()));
    for ones in [1.0.into(), vec![1.0; 3].into(), Along::linear(1.0, 1.0)] {
        let taper = Taper { density: Some(ones.clone()), ..on_radius(ones) };
        // The same rod in another notation: rounding errors.
        assert!((droop(rod(20, circle(), &taper)) / plain - 1.0).abs() < 1e-12);
    }
    let tube = Section::Tube { radius: RADIUS, thickness: RADIUS };
    assert!((droop(rod(20, tube, &Taper::default())) / plain - 1.0).abs() < 1e-12);
    let thin = droop(rod(20, Section::Circle { radius: 0.8 * RADIUS }, &Taper::default()));
    // A constant factor on the radius is a rod of that radius.
    assert!((droop(rod(20, circle(), &on_radius(0.8.into()))) / thin - 1.0).abs() < 1e-12);
    // A tube with half of its circle's radius open: area 3/4, second moments 15/16.
    let tube = Section::Tube { radius: RADIUS, thickness: RADIUS / 2.0 };
    let (area, i) = (0.75 * PI * RADIUS.powi(2), 15.0 / 64.0 * PI * RADIUS.powi(4));
    let custom = Section::Custom { area, i1: i, i2: i, j: 2.0 * i, up: [0.0, 1.0, 0.0] };
    let [tube, custom] = [tube, custom].map(|section| droop(rod(20, section, &Taper::default())));
    // Both sections have the same moments: rounding errors.
    assert!((tube / custom - 1.0).abs() < 1e-12);
}

#[test]
fn invalid_tapers_are_rejected() {
    let rejection = |section: Section, taper: Taper| {
        rod(20, section, &taper).problem().unwrap_err().to_string()
    };
    let width = Taper { width: Some(0.5.into()), ..Taper::default() };
    let message = rejection(circle(), width);
    assert!(
        message.contains("rod.taper.width") && message.contains("radius, density"),
        "{message}"
    );
    for factor in [0.0.into(), vec![1.0, -1.0].into(), Along::linear(1.0, 0.0)] {
        let message = rejection(circle(), on_radius(factor));
        assert!(
            message.contains("rod.taper.radius: found") && message.contains("above 0"),
            "{message}"
        );
    }
    for factor in [f64::NAN.into(), vec![].into(), Along::linear(1.0, f64::INFINITY)] {
        let message = rejection(circle(), on_radius(factor));
        assert!(
            message.contains("rod.taper.radius: found") && message.contains("finite"),
            "{message}"
        );
    }
    let tube = Section::Tube { radius: RADIUS, thickness: 0.5 * RADIUS };
    let message = rejection(tube, on_radius(Along::linear(1.0, 0.4)));
    assert!(
        message.contains("rod.taper: found") && message.contains("up to the radius"),
        "{message}"
    );
    // Solid where it is thickest is no tube that is thicker than that.
    let wide = Section::Tube { radius: RADIUS, thickness: 1.01 * RADIUS };
    assert!(rejection(wide, Taper::default()).contains("rod.section.thickness"));
    // A square whose sides taper by themselves has axes of its own, which lie askew here.
    let askew = Section::Rectangle { width: 0.01, height: 0.01, up: [0.0, 1.0, 1.0] };
    let alike = Taper { height: Some(0.5.into()), width: Some(0.5.into()), ..Taper::default() };
    assert!(rod(20, askew.clone(), &alike).problem().unwrap().planar().is_some());
    let one = Taper { height: Some(Along::linear(1.0, 0.5)), ..Taper::default() };
    let mut scene = rod(20, askew, &one);
    scene.loads.gravity = [0.0, -9.8, 0.0];
    assert!(scene.problem().unwrap().planar().is_none());
}

/// Pairs of `natural_bending` are at fixed arc lengths: the shape without loads converges to second order.
#[test]
fn natural_bending_between_pairs_converges_to_second_order() {
    let tip = |segments: usize| {
        let mut scene = rod(segments, circle(), &Taper::default());
        scene.rod.dimension = Dimension::Spatial;
        scene.rod.natural_bending = vec![[0.0, 3.0], [0.0, 0.0]];
        rest(&scene).tip
    };
    let fine = tip(320);
    let [coarse, half] = [10, 20].map(|segments| crate::common::distance(tip(segments), fine));
    println!("{coarse:.2e} m with 10 edges, {half:.2e} m with 20");
    // The tangent turns by the integral of the curvature, 0.75 rad: the tip is far from the axis.
    assert!(fine[1].hypot(fine[2]) > 0.1);
    assert!((3.3..5.0).contains(&(coarse / half)), "{coarse} {half}");
}

/// A list of two factors on the natural curvature of an arc: without loads the rod consists of two circular arcs of the
/// curvatures `k1` and `k2`. Its tip converges to theirs to second order, wherever the boundary lies in the mesh.
#[test]
fn listed_natural_curvature_gives_arcs_to_second_order() {
    let angle = 1.2;
    let [k1, k2] = [0.5, 1.5].map(|factor| factor * angle / LENGTH);
    let [a1, a2] = [0.5 * LENGTH * k1, 0.5 * LENGTH * (k1 + k2)];
    let x = a1.sin() / k1 + (a2.sin() - a1.sin()) / k2;
    let y = (1.0 - a1.cos()) / k1 + (a1.cos() - a2.cos()) / k2;
    for dimension in [Dimension::Auto, Dimension::Spatial] {
        let error = |segments: usize| {
            let mut scene = rod(segments, circle(), &Taper::default());
            let text = format!("kind = \"arc\"\nlength = {LENGTH}\nangle = {angle}");
            scene.rod.shape = toml::from_str(&text).unwrap();
            scene.rod.dimension = dimension;
            scene.rod.natural_curvature = vec![0.5, 1.5].into();
            let tip = rest(&scene).tip;
            (tip[0] - x).hypot(tip[1] - y)
        };
        for segments in [50, 51, 53] {
            let [coarse, half] = [error(segments), error(2 * segments)];
            println!(
                "{dimension:?}: {coarse:.2e} m with {segments} edges, {half:.2e} m with twice as many"
            );
            assert!((3.3..5.0).contains(&(coarse / half)), "{segments}: {coarse} {half}");
            assert!(coarse < 2e-4 * LENGTH, "{segments}: {coarse}");
        }
    }
}

/// Lists at arc lengths end with the rod; in a scene that is saved after its length has changed they do again.
#[test]
fn lists_at_arc_lengths_end_with_the_rod() {
    let text = |last: f64| {
        format!(
            "[rod]\nsegments = 10\nshape = {{ kind = \"straight\", length = 0.5, direction = [1, 0, 0] }}\n\
             section = {{ kind = \"circle\", radius = 0.005 }}\n\
             taper.radius = {{ at = [0, 0.3, {last}], factor = [1, 0.8, 0.5] }}\n\
             [material]\ndensity = 1000.0\nyoungs_modulus = 1e8\n"
        )
    };
    let mut scene = Scene::from_toml(&text(0.5), ".").unwrap();
    for last in [0.4, 500.0] {
        let error = Scene::from_toml(&text(last), ".").unwrap_err().to_string();
        assert!(error.contains("rod.taper.radius.at: found"), "{error}");
    }
    let Shape::Straight { length, .. } = &mut scene.rod.shape else { unreachable!() };
    *length = 1.0;
    let saved = Scene::from_toml(&scene.to_toml().unwrap(), ".").unwrap();
    let Some(Along::BreakPoints(points)) = saved.rod.taper.radius else { panic!("no list") };
    assert_eq!(points.at, [0.0, 0.6, 1.0]);
}

/// Points in mm with the factor 1e-3 are those of a rod of 0.5 m, at which a list at arc lengths ends.
#[test]
fn lists_of_a_scaled_polyline_end_at_its_scaled_length() {
    let text = |last: f64| {
        format!(
            "[rod]\nsegments = 10\n\
             shape = {{ kind = \"polyline\", points = [[0, 0, 0], [250, 0, 0], [500, 0, 0]], scale = 1e-3 }}\n\
             section = {{ kind = \"circle\", radius = 0.005 }}\n\
             taper.radius = {{ at = [0, {last}], factor = [1, 0.5] }}\n\
             [material]\ndensity = 1000.0\nyoungs_modulus = 1e8\n"
        )
    };
    let scene = Scene::from_toml(&text(0.5), ".").unwrap();
    let saved = Scene::from_toml(&scene.to_toml().unwrap(), ".").unwrap();
    let Some(Along::BreakPoints(points)) = saved.rod.taper.radius else { panic!("no list") };
    assert!((points.at[1] - 0.5).abs() < 1e-12, "{:?}", points.at);
    assert!(Scene::from_toml(&text(500.0), ".").is_err());
}
