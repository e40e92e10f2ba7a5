//! From recordings of a cable to its physical parameters: a sequence of models, each fitted to some of the
//! recordings and tested on all others, which it predicts from their first two frames.
//!
//! `cargo run --release --example recorded_cables` generates a synthetic cable, moves it between two grippers,
//! and identifies it. With the environment variable `RODFIT_MOCAP_DIR` set to the folder of the DEFORM
//! recordings (Chen et al., CoRL 2024, arXiv 2406.05931; files `DLO1_train_48.csv`, ..,
//! `DLO1_rest_raw.csv`, ..) it identifies the real ones: all five, or those named behind `--`.
//! Behind `--`, `fine` puts two edges between neighboring markers; `k` adds a curvature at rest for every marker; `halves`
//! fits B3, T5 and T7 to two halves of the recordings, each without the other; `twins` measures the coverage of
//! intervals: it simulates recordings with known parameters between the same grippers, twenty times for every cable, and
//! identifies them.

mod cable;
mod models;
mod twins;

use cable::{Cable, DENSITY, RADIUS, recordings};
use models::{Found, fit, ladder, scene_of};
use rodfit::fit::FitReport;
use std::error::Error;
use std::path::Path;
use std::time::Instant;
use twins::{twin, twins};

/// Indices of `most` clips, evenly spread over `total`, at most two thirds; the others are validation data.
fn spread(total: usize, most: usize) -> Vec<usize> {
    let count = most.min(2 * total / 3);
    (0..count).map(|i| i * total / count).collect()
}

/// Fits the models of increasing complexity in sequence, and prints their errors on fitted and validation recordings.
fn climb(cable: &Cable, edges: usize, with_curvatures: bool) -> Result<(), Box<dyn Error>> {
    let total = cable.clips.len();
    let markers = cable.lengths.len() + 1;
    println!(
        "{}: {total} recordings of {markers} markers, {:.3} m long",
        cable.name,
        cable.lengths.iter().sum::<f64>()
    );
    let mut found = Found::new();
    // Alternative models start from the same simpler one; curvatures of every marker from those at the grippers.
    let mut t7 = None;
    for rung in ladder(markers, edges) {
        if rung.name == "K" && !with_curvatures {
            continue;
        }
        if rung.name == "T10e" {
            found = t7.clone().unwrap_or(found);
        }
        let since = Instant::now();
        let fitted = spread(total, rung.most);
        let (report, values) = fit(cable, &rung, &fitted, &found)?;
        found = values;
        if rung.name == "T7" {
            t7 = Some(found.clone());
        }
        let took = since.elapsed().as_secs_f64();
        // Errors of fitted recordings, and of those that the model predicts.
        let scene = scene_of(cable, &rung, &found)?;
        let mut errors = [Vec::new(), Vec::new()];
        for clip in 0..total {
            match cable.error(&scene, clip) {
                Ok(error) => errors[usize::from(!fitted.contains(&clip))].push(error),
                Err(error) => println!("         {}: {error}", cable.name_of(clip)),
            }
        }
        let mean = |x: &[f64]| 100.0 * x.iter().sum::<f64>() / x.len() as f64;
        println!(
            "  {:4} {:2} numbers, {:2} recordings: {:.3} cm off, {:.3} cm on {} of the {} others; {took:.1} s, {:.0} simulations",
            rung.name,
            report.parameters.len(),
            fitted.len(),
            mean(&errors[0]),
            mean(&errors[1]),
            errors[1].len(),
            total - fitted.len(),
            report.simulations,
        );
        print(&report, 10);
    }
    Ok(())
}

/// Prints the first `most` estimates of a report.
fn print(report: &FitReport, most: usize) {
    for estimate in report.parameters.iter().take(most) {
        let interval = match (estimate.interval95, estimate.upper95) {
            (Some([a, b]), _) => format!("[{a:.4e}, {b:.4e}]"),
            (None, Some(upper)) => format!("at most {upper:.4e}"),
            (None, None) => "not determined".into(),
        };
        let value = estimate.value.map_or(String::new(), |value| format!("{value:.4e} "));
        println!("         {} = {value}{interval} {}", estimate.name, estimate.name.unit());
    }
}

/// Fits B3, T5 and T7 to both halves of the recordings separately, and compares the difference of the moduli with their
/// intervals.
fn halves(cable: &Cable) -> Result<(), Box<dyn Error>> {
    let rungs = ladder(cable.lengths.len() + 1, 1);
    let mut found = [Found::new(), Found::new()];
    for rung in rungs.iter().filter(|rung| matches!(rung.name, "B3" | "T5" | "T7")) {
        let mut logs = Vec::new();
        for (half, found) in found.iter_mut().enumerate() {
            let clips: Vec<usize> = (0..cable.clips.len()).filter(|k| k % 2 == half).collect();
            let (report, values) = fit(cable, rung, &clips, found)?;
            *found = values;
            let modulus = &report.parameters[0];
            let (Some(value), Some([low, high])) = (modulus.value, modulus.interval95) else {
                println!("{} {}: half {half}: E is not determined", cable.name, rung.name);
                continue;
            };
            println!(
                "{} {}: half {half}, {} recordings: EI/(rho A) = {:.4e} [{:.4e}, {:.4e}] m^4/s^2",
                cable.name,
                rung.name,
                clips.len(),
                flexural(value),
                flexural(low),
                flexural(high)
            );
            logs.push((value.ln(), 0.5 * (high / low).ln()));
        }
        // Both halves should agree within their intervals, in the logarithm of the modulus.
        if let [(a, da), (b, db)] = logs[..] {
            println!(
                "{} {}: halves are {:.1} % apart, the intervals say {:.1} %",
                cable.name,
                rung.name,
                100.0 * (a - b).abs(),
                100.0 * da.hypot(db)
            );
        }
    }
    Ok(())
}

/// `EI/(rho A)`, m^4/s^2, of a modulus, Pa.
fn flexural(modulus: f64) -> f64 {
    modulus * RADIUS * RADIUS / (4.0 * DENSITY)
}

fn main() -> Result<(), Box<dyn Error>> {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let said = |word: &str| asked.iter().any(|asked| asked == word);
    let study = |cable: &Cable| match () {
        () if said("halves") => halves(cable),
        () if said("twins") => twins(cable),
        () => climb(cable, if said("fine") { 2 } else { 1 }, said("k")),
    };
    let Some(folder) = std::env::var_os("RODFIT_MOCAP_DIR") else {
        println!("RODFIT_MOCAP_DIR names no folder of recordings: a synthetic cable instead");
        let folder = tempfile::tempdir()?;
        twin(folder.path())?;
        return study(&recordings(folder.path(), "twin")?);
    };
    let all = ["DLO1", "DLO2", "DLO3", "DLO4", "DLO5"];
    let named = all.iter().any(|name| said(name));
    for name in all.into_iter().filter(|name| !named || said(name)) {
        study(&recordings(Path::new(&folder), name)?)?;
    }
    Ok(())
}
