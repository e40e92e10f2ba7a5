//! Mesh and step whose errors are small enough together.
//!
//! The errors of mesh and step are known as motions, what a run is off by at all times. Where they point the same way they add
//! up, where they do not they cancel. What is chosen is the cheapest mesh and step whose sum is small enough.

use crate::resolution::off::Off;

/// Part of the accuracy that both may take together, and each alone.
const TOGETHER: f64 = 0.75;
const ALONE: f64 = 0.6;
/// Part of their sizes that is added to the sum: they are known from coarser runs, where they cancel too.
const NOT_KNOWN: f64 = 0.2;
/// Beyond what was looked at errors of mesh and step fall with this part of the order that was seen.
const SLOWER: [f64; 2] = [0.8, 0.75];
/// Where no sum is small enough, part of the accuracy that each may take, and how many times as fine as in their range they may be.
const HALF: f64 = 0.25;
const BEYOND: f64 = 1.5;
/// The next step that is tried is finer by this factor.
const NEXT: f64 = 1.06;

/// The finest run that was looked at: by how much it is off, and how many times as fine what is chosen may be, at least and at
/// most.
#[derive(Clone)]
pub(super) struct Finest {
    pub off: Off,
    pub range: [f64; 2],
}

impl Finest {
    /// Off by so many times as much.
    pub fn times(&self, factor: f64) -> Self {
        Self { off: self.off.clone().times(factor), range: self.range }
    }

    /// How many times as fine it takes to be off by `allowed` at most.
    fn alone(&self, allowed: f64) -> f64 {
        match self.range {
            [least, most] if least < most => self.off.finer(allowed).clamp(least, BEYOND * most),
            [given, _] => given,
        }
    }
}

/// How many times as fine as the finest runs mesh and step are, and the error that they leave together.
#[derive(Clone, Copy)]
pub(super) struct Mixed {
    pub mesh: f64,
    pub step: f64,
    pub error: f64,
}

/// The cheapest of these meshes, given by how many times as fine as the finest run they are, the coarsest first, and of the steps
/// in their range; where none does, as fine as each needs to be alone.
pub(super) fn mixed(
    meshes: impl Iterator<Item = f64>,
    mesh: &Finest,
    step: &Finest,
    asked: f64,
) -> Mixed {
    let both = Both::of(&mesh.off, &step.off);
    let left =
        |mesh_by, step_by| [mesh.off.left(mesh_by, SLOWER[0]), step.off.left(step_by, SLOWER[1])];
    let [least, most] = step.range;
    let mut best: Option<Mixed> = None;
    for mesh in meshes {
        let cheaper = |best: Mixed, step: f64| best.mesh * best.step > mesh * step;
        let mut step = least;
        while best.is_none_or(|best| cheaper(best, step)) {
            let parts = left(mesh, step);
            if both.do_for(parts, asked) {
                best = Some(Mixed { mesh, step, error: both.error(parts) });
            } else if step < most {
                step = (NEXT * step).min(most);
            } else {
                break;
            }
        }
    }
    best.unwrap_or_else(|| {
        let [mesh, step] = [mesh, step].map(|finest| finest.alone(HALF * asked));
        Mixed { mesh, step, error: both.error(left(mesh, step)) }
    })
}

/// What mesh and step are off by.
struct Both {
    /// How much each is at most.
    sizes: [f64; 2],
    /// At all times the squares, and twice the product between them.
    products: Vec<[f64; 3]>,
}

impl Both {
    fn of(mesh: &Off, step: &Off) -> Self {
        let dot = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let at = |off: &Off, k: usize| off.by.get(k).copied().unwrap_or([0.0; 3]);
        let products = |k| {
            let (a, b) = (at(mesh, k), at(step, k));
            [dot(&a, &a), 2.0 * dot(&a, &b), dot(&b, &b)]
        };
        let count = mesh.by.len().max(step.by.len());
        Self { sizes: [mesh.size(), step.size()], products: (0..count).map(products).collect() }
    }

    /// The error where these parts of both are left.
    fn error(&self, [a, b]: [f64; 2]) -> f64 {
        let [aa, ab, bb] = [a * a, a * b, b * b];
        let together = |p: &[f64; 3]| aa * p[0] + ab * p[1] + bb * p[2];
        let together = self.products.iter().map(together).fold(0.0, f64::max).sqrt();
        together + NOT_KNOWN * (a * self.sizes[0] + b * self.sizes[1])
    }

    /// Whether that is small enough.
    fn do_for(&self, [a, b]: [f64; 2], asked: f64) -> bool {
        let (mesh, step) = (a * self.sizes[0], b * self.sizes[1]);
        let left = TOGETHER * asked - NOT_KNOWN * (mesh + step);
        // The sum is between the difference of the sizes and their sum: most need no closer look.
        mesh.max(step) <= ALONE * asked
            && (mesh - step).abs() <= left
            && (mesh + step <= left || self.error([a, b]) <= TOGETHER * asked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a run is off by at one time.
    fn finest(by: [f64; 3], range: [f64; 2]) -> Finest {
        Finest { off: Off::of(&vec![by], &vec![[0.0; 3]], 1.0, 2.0), range }
    }

    fn among(mesh: &Finest, step: &Finest, asked: f64) -> Mixed {
        let meshes = (0..=20).map(|k| 0.5 + 0.1 * f64::from(k));
        mixed(meshes, mesh, step, asked)
    }

    #[test]
    fn errors_that_cancel_allow_less_than_errors_that_add_up_forbid() {
        let asked = 1e-2;
        let mesh = finest([4e-3, 0.0, 0.0], [0.5, 2.5]);
        let cost = |by: f64| {
            let mixed = among(&mesh, &finest([by, 0.0, 0.0], [0.5, 2.0]), asked);
            assert!(mixed.error <= TOGETHER * asked, "{:e}", mixed.error);
            mixed.mesh * mixed.step
        };
        assert!(cost(-4e-3) < cost(4e-3));
        // Neither may be large by itself, whatever the other does.
        let mixed = among(&mesh, &finest([-4e-3, 0.0, 0.0], [0.5, 2.0]), asked);
        for (finer, order) in [(mixed.mesh, 2.0), (mixed.step, 2.0)] {
            assert!(4e-3 * finer.powf(-order) <= ALONE * asked * (1.0 + 1e-12), "{finer}");
        }
    }

    #[test]
    fn the_cheapest_is_taken() {
        // Across each other, where sizes are what counts: no other pair of the same grid does it for less.
        let (mesh, step, asked) =
            (finest([6e-3, 0.0, 0.0], [0.5, 2.5]), finest([0.0, 3e-3, 0.0], [0.5, 2.0]), 1e-2);
        let best = among(&mesh, &step, asked);
        let both = Both::of(&mesh.off, &step.off);
        for k in 0..=20 {
            let by = 0.5 + 0.1 * f64::from(k);
            let mut finer = 0.5;
            while finer <= 2.0 {
                let parts = [mesh.off.left(by, SLOWER[0]), step.off.left(finer, SLOWER[1])];
                let cheaper = by * finer < 0.999 * best.mesh * best.step;
                assert!(!(cheaper && both.do_for(parts, asked)), "{by} {finer}");
                finer *= NEXT;
            }
        }
    }

    #[test]
    fn where_nothing_does_each_is_as_fine_as_it_can_be() {
        let (mesh, step) = (finest([1.0, 0.0, 0.0], [0.5, 2.0]), finest([0.0, 1.0, 0.0], [1.0; 2]));
        let mixed = among(&mesh, &step, 1e-2);
        assert_eq!((mixed.mesh, mixed.step), (BEYOND * 2.0, 1.0));
        assert!(mixed.error > 1e-2);
    }

    #[test]
    fn an_error_that_nobody_knows_is_not_small() {
        let unknown = Finest { off: Off::unknown(2.0), range: [1.0; 2] };
        let mixed = mixed([1.0].into_iter(), &unknown, &finest([1e-9, 0.0, 0.0], [1.0; 2]), 1e-2);
        assert!(mixed.error > 1e-2, "{:e}", mixed.error);
    }
}
