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
    // Rises in scenes of fixed and of moved obstacles.
    let (mut failed, mut rises, mut deepest) = (0, [0.0_f64; 2], 0.0_f64);
    for (seed, result) in results {
        match result {
            Ok(Outcome { moved, rise, overlap, steps }) => {
                println!("{seed:4}: rise {rise:.1e}, overlap {overlap:.3} radii, {steps} steps");
                rises[usize::from(moved)] = rises[usize::from(moved)].max(rise);
                deepest = deepest.max(overlap);
            }
            Err(error) => {
                failed += 1;
                println!("{seed:4}: {error}");
            }
        }
    }
    println!(
        "{failed} of {count} failed; the energy rises by at most {:.1e} of the largest kinetic energy between fixed obstacles and \
         {:.1e} between moved ones; overlaps are at most {deepest:.2} radii",
        rises[0], rises[1]
    );
    Ok(())
}
