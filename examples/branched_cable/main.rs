//! Stiffnesses and joints of branched cables whose ends follow recorded markers, from their other markers.
//!
//! `cargo run --release --example branched_cable` fits a synthetic cable, and compares the identified numbers with those of
//! the simulation. With `-- FOLDER` it fits the sequence of models to the DEFT recordings in that folder (Chen et al., arXiv
//! 2502.15037; see [`cable`] for its files), to three clips of each cable, and tests them on all others. Behind the folder may
//! stand names of cables, `-- FOLDER BDLO5 BDLO6`, and `complete`: only the complete model, from its start values.

mod cable;
mod metric;
mod model;
mod synthetic;

use cable::Cable;
use model::{JUDGED, Model, Number, Values, fit, models, scene};
use rayon::prelude::*;
use std::error::Error;
use std::path::Path;
use std::time::Instant;

/// The recorded cables.
const CABLES: [&str; 6] = ["BDLO1", "BDLO2", "BDLO3", "BDLO4", "BDLO5", "BDLO6"];
/// Indices of the fitted clips in the order of their names; all others are validation data.
const CLIPS: [usize; 3] = [0, 4, 8];

/// Root of the mean square errors of clips, m.
fn error(cable: &Cable, values: &Values, clips: &[usize]) -> Result<f64, rodfit::Error> {
    let squares = clips.par_iter().map(|k| {
        let own = scene(cable, JUDGED, values, &cable.clips[*k])?;
        metric::mean_square(cable, &own)
    });
    let squares = squares.collect::<Result<Vec<f64>, rodfit::Error>>()?;
    Ok((squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// Fits the models of a cable in sequence, each from the values of the one before, or only the complete one. Prints their
/// errors and the values of the last one.
fn climb(cable: &Cable, is_complete: bool) -> Result<(), Box<dyn Error>> {
    let others: Vec<usize> = (0..cable.clips.len()).filter(|k| !CLIPS.contains(k)).collect();
    println!("{}: {} clips, {} markers", cable.name, cable.clips.len(), cable.markers.len());
    let (mut values, mut numbers): (Values, Vec<&Number>) = Default::default();
    let all = models(cable);
    for (k, Model { name, numbers: own }) in all.iter().enumerate() {
        numbers.extend(own);
        if is_complete && k + 1 < all.len() {
            continue;
        }
        let since = Instant::now();
        let simulations = fit(cable, &mut values, &numbers, &CLIPS)?;
        let seconds = since.elapsed().as_secs_f64();
        let [fitted, judged] = [&CLIPS[..], &others].map(|clips| error(cable, &values, clips));
        println!(
            "  {name}: {} numbers, {:.2} mm on fitted clips, {:.2} mm on others; {seconds:.0} s, {simulations:.0} simulations",
            numbers.len(),
            1e3 * fitted?,
            1e3 * judged?,
        );
    }
    for (name, value) in &values {
        println!("    {name} = {value:.4e}");
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((folder, words)) = arguments.split_first() else { return Ok(synthetic::run()?) };
    let is_complete = words.iter().any(|word| word == "complete");
    let named = |name: &&&str| words.iter().any(|word| word == **name);
    let mut chosen: Vec<&str> = CABLES.iter().filter(named).copied().collect();
    if chosen.is_empty() {
        chosen = CABLES.to_vec();
    }
    for name in chosen {
        climb(&Cable::read(Path::new(folder), name)?, is_complete)?;
    }
    Ok(())
}
