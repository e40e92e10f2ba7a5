//! Two recordings with forces: Young's modulus of a steel strip on a robot arm, and poses with a wrench that do not
//! determine a stiffness.
//!
//! `cargo run --release --example forces -- FOLDER [takes|together|poses]`, where `FOLDER` has `beam_handling/TAKE.csv`
//! of the strip (github.com/shamilmamedov/beam_handling, arXiv 2210.00578; clamp pose and wrench at 200 Hz) and
//! `cosserat_rod_estimation/wrench_poses.csv` (github.com/mseverac/cosserat_rod_estimation). Output: the reports of the
//! fits of single takes, of all takes together, and of the poses; without the second argument all three. Without a
//! folder the example writes short synthetic recordings of the same kind and fits these. Every fit is that of a fit
//! file, which is written to a temporary folder.

mod poses;
mod strip;
mod synthetic;

use rodfit::fit::{FitFile, FitReport};
use std::error::Error;
use std::path::Path;
use std::time::Instant;
use strip::{Recordings, recorded};

/// Solves the fit file `text` in the folder `work`, and prints its report with its time.
fn solve(text: &str, name: &str, work: &Path) -> Result<FitReport, Box<dyn Error>> {
    let path = work.join(format!("{name}.toml"));
    std::fs::write(&path, text)?;
    let since = Instant::now();
    let report = FitFile::load(&path)?.fit().solve()?;
    println!("\n{name}, {:.0} s:\n{report}", since.elapsed().as_secs_f64());
    Ok(report)
}

/// Fits each take of the strip alone, and prints the estimates in one table.
fn fit_takes(recordings: &Recordings, work: &Path) -> Result<(), Box<dyn Error>> {
    let mut rows = Vec::new();
    for take in recordings.takes {
        let report = solve(&recordings.fit_of(take, work)?, take, work)?;
        let [modulus, damping] = &report.parameters[..] else {
            return Err("a report without two parameters".into());
        };
        let value = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.4e}"));
        let interval = modulus
            .interval95
            .map_or("not determined".into(), |[low, high]| format!("[{low:.4e}, {high:.4e}]"));
        let (modulus, damping) = (value(modulus.value), value(damping.value));
        rows.push(format!("{take:12} {modulus:>12} {interval:26} {damping:>12}  {}", report.grade));
    }
    println!("\ntake         modulus, Pa  95 % interval              damping, s    grade");
    rows.iter().for_each(|row| println!("{row}"));
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let work = tempfile::tempdir()?;
    let work = work.path();
    let (recordings, table) = match arguments.first() {
        Some(folder) => {
            // Paths in scenes are relative to the scene.
            let folder = std::fs::canonicalize(folder).map_err(|e| format!("{folder}: {e}"))?;
            let strip = recorded(folder.join("beam_handling"));
            (strip, folder.join("cosserat_rod_estimation").join("wrench_poses.csv"))
        }
        None => {
            println!("No folder is given: synthetic recordings.");
            (synthetic::strip(work)?, synthetic::poses(work)?)
        }
    };
    let selected = arguments.get(1).map(String::as_str);
    if selected.is_none_or(|word| word == "takes") {
        fit_takes(&recordings, work)?;
    }
    if selected.is_none_or(|word| word == "together") {
        solve(&recordings.joint_fit(work)?, "together", work)?;
    }
    if selected.is_none_or(|word| word == "poses") {
        for assumption in poses::ASSUMPTIONS {
            let text = poses::fit(&table, &assumption, work)?;
            solve(&text, assumption.name, work)?;
        }
    }
    Ok(())
}
