//! Frames against the dynamic stiffness method: exact frequencies of Euler-Bernoulli beams with axial motion.

use crate::joints::frequencies;
use crate::scenes::{STEEL, bending, joint, line_density, rod, structure, support};
use nalgebra::{DMatrix, SMatrix};
use std::f64::consts::PI;

/// A beam between two joints, of which those above the last are walls.
struct Beam {
    joints: [usize; 2],
    /// Vector from the first joint to the second, m.
    vector: [f64; 2],
}

/// Dynamic stiffness of a beam at the angular frequency `w` by displacement along, across and rotation of both ends
/// (Banerjee 1997, doi:10.1016/S0045-7949(96)00126-8), in world axes.
fn dynamic_stiffness(beam: &Beam, w: f64) -> SMatrix<f64, 6, 6> {
    let [x, y] = beam.vector;
    let l = x.hypot(y);
    let axial = STEEL[0] * PI * STEEL[2].powi(2);
    let b = (line_density() * w * w / bending()).powf(0.25) * l;
    let (s, c, sh, ch) = (b.sin(), b.cos(), b.sinh(), b.cosh());
    let unit = bending() / l.powi(3) / (1.0 - c * ch);
    let (t, r) = (unit * b.powi(3), unit * l * b * b);
    let m = unit * l * l * b;
    let (a11, a12) = (t * (c * sh + s * ch), -t * (s + sh));
    let (b11, b12) = (r * s * sh, r * (ch - c));
    let (c11, c12) = (m * (s * ch - c * sh), m * (sh - s));
    let k = w * (line_density() / axial).sqrt() * l;
    let (p, q) = (axial / l * k / k.tan(), -axial / l * k / k.sin());
    #[rustfmt::skip]
    let local = SMatrix::<f64, 6, 6>::new(
        p, 0.0, 0.0, q, 0.0, 0.0,
        0.0, a11, b11, 0.0, a12, b12,
        0.0, b11, c11, 0.0, -b12, c12,
        q, 0.0, 0.0, p, 0.0, 0.0,
        0.0, a12, -b12, 0.0, a11, -b11,
        0.0, b12, c12, 0.0, -b11, c11,
    );
    let (ux, uy) = (x / l, y / l);
    let mut turn = SMatrix::<f64, 6, 6>::identity();
    for e in [0, 3] {
        (turn[(e, e)], turn[(e, e + 1)]) = (ux, uy);
        (turn[(e + 1, e)], turn[(e + 1, e + 1)]) = (-uy, ux);
    }
    turn.transpose() * local * turn
}

/// The lowest frequencies of a frame with `free` joints: zeros of the determinant, found from changes of its sign between
/// `low` and `high`, rad/s, that are no poles.
fn exact(beams: &[Beam], free: usize, [low, high]: [f64; 2]) -> Vec<f64> {
    let determinant = |w: f64| {
        let mut whole = DMatrix::zeros(3 * free, 3 * free);
        for beam in beams {
            let own = dynamic_stiffness(beam, w);
            for (i, from) in beam.joints.iter().enumerate() {
                for (j, to) in beam.joints.iter().enumerate() {
                    if *from < free && *to < free {
                        for r in 0..3 {
                            for c in 0..3 {
                                whole[(3 * from + r, 3 * to + c)] += own[(3 * i + r, 3 * j + c)];
                            }
                        }
                    }
                }
            }
        }
        // In units of the statics of one beam.
        (whole / (bending() * 1e4)).determinant()
    };
    let steps = 4000;
    let at = |i: usize| low + (high - low) * i as f64 / steps as f64;
    let mut roots = Vec::new();
    for i in 0..steps {
        let (mut a, mut b) = (at(i), at(i + 1));
        if determinant(a) * determinant(b) < 0.0 {
            let size = determinant(a).abs().max(determinant(b).abs());
            for _ in 0..60 {
                let middle = 0.5 * (a + b);
                *if determinant(a) * determinant(middle) <= 0.0 { &mut b } else { &mut a } = middle;
            }
            if determinant(a).abs() < size {
                roots.push(a);
            }
        }
    }
    roots
}

fn compare(name: &str, found: &[f64], expected: &[f64]) {
    for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
        println!("{name} mode {i}: {:e}", found / expected - 1.0);
        assert!((found / expected - 1.0).abs() < 1e-3, "{name} {i}: {found} {expected}");
    }
    assert!(expected.len() >= found.len(), "{expected:?}");
}

/// Two legs of 0.3 m and a beam of 0.2 m.
#[test]
fn frequencies_of_a_portal_frame_agree_with_dynamic_stiffness() {
    let frame = structure(&[
        rod("left", 100, 0.3, [0.0, 1.0]),
        rod("beam", 100, 0.2, [1.0, 0.0]),
        rod("right", 100, 0.3, [0.0, -1.0]),
        joint("rigid", &["left.end", "beam.start"], ""),
        joint("rigid", &["beam.end", "right.start"], ""),
        support("left.start", "clamped"),
        support("right.end", "clamped"),
    ]);
    let beams = [
        Beam { joints: [2, 0], vector: [0.0, 0.3] },
        Beam { joints: [0, 1], vector: [0.2, 0.0] },
        Beam { joints: [1, 3], vector: [0.0, -0.3] },
    ];
    compare("portal", &frequencies(&frame, 3), &exact(&beams, 2, [5.0, 2500.0]));
}

/// A stem of 0.3 m between a wall and the middle of a bar of 0.4 m, whose ends are free.
#[test]
fn frequencies_of_a_tee_agree_with_dynamic_stiffness() {
    let tee = structure(&[
        rod("stem", 100, 0.3, [0.0, 1.0]),
        rod("left", 100, 0.25, [-1.0, 0.0]),
        rod("right", 100, 0.15, [1.0, 0.0]),
        joint("rigid", &["stem.end", "left.start", "right.start"], ""),
        support("stem.start", "clamped"),
    ]);
    let beams = [
        Beam { joints: [3, 0], vector: [0.0, 0.3] },
        Beam { joints: [0, 1], vector: [-0.25, 0.0] },
        Beam { joints: [0, 2], vector: [0.15, 0.0] },
    ];
    compare("tee", &frequencies(&tee, 3), &exact(&beams, 3, [5.0, 1500.0]));
}

/// The buckling load of a portal frame with clamped legs of length `L` and a beam of length `b` under forces on both
/// joints: it sways at `P = EI k^2` with `kL cot(kL) = -6 L/b`, as each leg bends to `1 - cos kx` against the stiffness
/// `6 EI/b` of the beam (Timoshenko and Gere, *Theory of Elastic Stability*, section 2.4).
#[test]
fn buckling_load_of_a_portal_frame_agrees_with_the_stability_equation() {
    let (leg, beam) = (0.3, 0.2);
    let equation = |x: f64| x / x.tan() + 6.0 * leg / beam;
    let (mut low, mut high) = (PI / 2.0, PI - 1e-9);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *if equation(middle) > 0.0 { &mut low } else { &mut high } = middle;
    }
    let critical = bending() * (low / leg).powi(2);
    // The square of the sway frequency is nearly linear in the force, and zero at the critical one.
    let squared = |part: f64| {
        let force = -part * critical;
        let load = |rod: &str, node: &str| {
            format!("[[loads.point]]\nrod = \"{rod}\"\nnode = {node}\nforce = [0, {force:e}, 0]\n")
        };
        let frame = structure(&[
            rod("left", 100, leg, [0.0, 1.0]),
            rod("beam", 60, beam, [1.0, 0.0]),
            rod("right", 100, leg, [0.0, -1.0]),
            joint("rigid", &["left.end", "beam.start"], ""),
            joint("rigid", &["beam.end", "right.start"], ""),
            support("left.start", "clamped"),
            support("right.end", "clamped"),
            load("left", "\"tip\""),
            load("right", "{ arc_length = 0.0 }"),
        ]);
        let found = frame.equilibrium().unwrap();
        assert!(found.stable_in_plane, "{part}");
        frame.modes(1, false).unwrap().modes[0].frequency_rad_s.powi(2)
    };
    let [far, near] = [0.96, 0.98].map(squared);
    let found = 0.98 + 0.02 * near / (far - near);
    println!("buckling load: {:e}", found - 1.0);
    assert!((found - 1.0).abs() < 1e-3, "{found}");
}
