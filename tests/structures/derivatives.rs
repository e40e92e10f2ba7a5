//! Derivatives of motions of seeded structures by every number.

use crate::scenes::{joint, rod, structure, support};
use num_dual::Dual64;
use rodfit::Structure;
use std::cell::RefCell;

/// Numbers between 0 and 1 from a seed (Lehmer's generator).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0 * 48271 % 2_147_483_647;
        self.0 as f64 / 2_147_483_647.0
    }
}

/// A random chain of two to four rubber rods from a wall, with joints of all kinds; every other one with a body at its end,
/// and every third one with a hinged strut to another wall.
fn seeded(seed: u64) -> Structure {
    let mut numbers = Numbers(seed * 7919 + 1);
    for _ in 0..5 {
        numbers.next();
    }
    let count = 2 + (seed % 3) as usize;
    let soft =
        |text: String| text.replace("steel", "rubber").replace("radius = 1e-3", "radius = 4e-3");
    let (mut parts, mut x, mut y) = (Vec::new(), 0.0, 0.0);
    for k in 0..count {
        let angle = 0.9 * k as f64 + 1.2 * numbers.next();
        let length = 0.1 + 0.05 * numbers.next();
        parts.push(soft(rod(&format!("r{k}"), 6 + k, length, [angle.cos(), angle.sin()])));
        x += length * angle.cos();
        y += length * angle.sin();
        if k > 0 {
            let ends = [format!("r{}.end", k - 1), format!("r{k}.start")];
            let ends = [&*ends[0], &*ends[1]];
            parts.push(match (numbers.next() * 3.0) as usize {
                0 => joint("rigid", &ends, ""),
                1 => joint("ball", &ends, ""),
                _ => joint("spring", &ends, "rotation = 20.0\nrest = 0.1\ndamping = 2e-3"),
            });
        }
    }
    let last = format!("r{}.end", count - 1);
    match seed % 3 {
        0 => {
            parts.push(soft(rod("strut", 7, 0.12, [0.2, -1.0])));
            parts.push(joint("ball", &[&last, "strut.start"], ""));
            parts.push(support("strut.end", "pinned"));
        }
        1 => {
            let (x, y) = (x + 0.02, y + 0.01);
            parts.push(format!(
                "[[bodies]]\nname = \"bob\"\nmass = 0.03\ninertia = 1e-5\nposition = [{x}, {y}, 0]\n"
            ));
            parts.push(joint("rigid", &["bob", &last], ""));
        }
        _ => {}
    }
    parts.push(support("r0.start", "clamped"));
    parts.push(
        "[[materials]]\nname = \"rubber\"\ndensity = 1100\nyoungs_modulus = 3e6\n\
         [loads]\ngravity = [1.5, -9.81, 0]\ndamping = { mass = 0.3, stiffness = 1e-4 }\n\
         [[loads.point]]\nrod = \"r1\"\nnode = 3\nforce = [0.01, -0.02, 0]\n\
         [time]\nend = 0.02\nstep = 1e-3\ntolerance = \"rounding\"\n"
            .into(),
    );
    structure(&parts)
}

/// The positions of all nodes after 20 steps over a number type. `seed` converts numbers.
fn positions<D: rodfit::numerics::scalar::RodScalar>(
    structure: &Structure,
    seed: impl FnMut(&str, f64) -> D,
) -> Vec<D> {
    let seed = RefCell::new(seed);
    let mut simulation =
        structure.simulation_over(|path, value, _| (seed.borrow_mut())(path, value)).unwrap();
    for k in 1..=20 {
        simulation.step_to(1e-3 * f64::from(k)).unwrap();
    }
    let mut q = simulation.state().q.clone();
    simulation.rod().place_carried(&mut q, &simulation.state().frames);
    q.truncate(simulation.rod().body_coordinates().start);
    q
}

/// Oracle: differences of fourth order of plain runs, to 1e-6 of the largest derivative by each number.
#[test]
fn derivatives_of_seeded_structures_by_every_number_equal_differences() {
    let (mut count, mut worst) = (0, 0.0_f64);
    for number in 0..24 {
        let structure = seeded(number);
        let mut paths = Vec::new();
        structure.scene().map_numbers(|path, value, _| {
            paths.push((path.to_string(), value));
            value
        });
        for (path, value) in paths {
            // Components out of the plane, and damping without a two-sided difference.
            let one_sided = path.starts_with("loads.damping") && value == 0.0;
            if path.ends_with(".z") || path.contains("time.") || one_sided {
                continue;
            }
            let dual = positions(&structure, |own, x| Dual64::new(x, f64::from(own == path)));
            let size = dual.iter().fold(0.0_f64, |size, q| size.max(q.eps.abs()));
            // Damping of one rod has a small effect; a larger step keeps rounding errors of the difference small.
            let relative = if path.ends_with("damping_factor") { 1e-2 } else { 1e-3 };
            let h = relative * if value == 0.0 { 1e-2 } else { value.abs() };
            let at = |steps: f64| {
                positions(&structure, |own, x| if own == path { x + steps * h } else { x })
            };
            let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(at);
            for i in 0..dual.len() {
                let difference = (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * h);
                let scale = size.max(1e-9 / h);
                let error = (dual[i].eps - difference).abs() / scale;
                assert!(error < 1e-6, "{number} {path} {i}: {} {difference}", dual[i].eps);
                worst = worst.max(error);
            }
            count += 1;
        }
    }
    println!("{count} numbers, largest difference {worst:e} of the largest derivative");
    assert!(count > 500, "{count}");
}
