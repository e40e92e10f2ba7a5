//! Rods that fall on a floor and other obstacles, fixed and moved: whether every run ends, how far the energy rises above its
//! lowest value before, and how deep obstacles press into the rod. The axis of a rod that passes an obstacle is inside of it.
//!
//! `cargo run --release --example drops` for 50 scenes, `-- 1000` for more.

use rayon::prelude::*;
use rodfit::Error;

mod scenes;
use scenes::{Outcome, run, scene};

fn main() -> Result<(), Error> {
    let count: u64 = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(50);
    let results: Vec<(u64, Result<Outcome, Error>)> = (0..count)
        .into_par_iter()
        .map(|seed| (seed, scene(seed).and_then(|scene| run(&scene))))
        .collect();
    let (mut failed, mut worst) = (0, Outcome { rise: 0.0, overlap: 0.0, steps: 0 });
    for (seed, result) in results {
        match result {
            Ok(Outcome { rise, overlap, steps }) => {
                println!("{seed:4}: rise {rise:.1e}, overlap {overlap:.3} radii, {steps} steps");
                worst.rise = worst.rise.max(rise);
                worst.overlap = worst.overlap.max(overlap);
            }
            Err(error) => {
                failed += 1;
                println!("{seed:4}: {error}");
            }
        }
    }
    println!(
        "{failed} of {count} failed; energy rises by at most {:.1e} of the largest kinetic energy, overlaps are at most {:.2} \
         radii",
        worst.rise, worst.overlap
    );
    Ok(())
}
