//! Reliability of reported intervals in synthetic laboratories. Each seeded laboratory has a rod, errors of its
//! calipers and scales, a camera with a wrong scale, a roll and a late clock, whole pixels and autocorrelated noise. The
//! data come from a mesh far finer than that of a fit, or from the modes of the continuum; fit files have no
//! numerical settings. For Young's modulus and damping: the share of expanded intervals that contain the truth, the number of
//! fits graded `refine-numerics`, and the cost of a fit.
//!
//! `cargo run --release --example laboratories` for six, `-- 300` for the campaign, `-- 1 17` for the one of seed 17
//! with its report.

use indicatif::{ParallelProgressIterator, ProgressBar};
use rayon::prelude::*;
use rodfit::fit::{FitFile, Grade};
use rodfit::{Error, FitReport, Parameter};

mod laboratory;
use laboratory::Laboratory;

/// Required share of intervals that contain the truth, %: 95 within the scatter of a few hundred laboratories.
const COVERED: [f64; 2] = [92.5, 97.5];
/// Largest accepted median cost of a fit, full simulations.
const COST: f64 = 25.0;
/// Number of laboratories from which on the share of intervals is judged.
const ENOUGH: u64 = 200;

/// The result of the fit of a laboratory.
struct Outcome {
    seed: u64,
    grade: Grade,
    /// By how many of its standard uncertainties each parameter is off, and whether its interval covers.
    found: Option<Vec<(f64, bool)>>,
    simulations: f64,
    /// How much finer the data's mesh is than that of the fit.
    finer: f64,
}

/// The report of the fit of a laboratory, by its files in a temporary folder.
fn fitted(laboratory: &Laboratory) -> Result<FitReport, Error> {
    let folder = tempfile::tempdir().map_err(|e| Error::Fit(e.to_string()))?;
    laboratory.write(folder.path())?;
    FitFile::load(folder.path().join("fit.toml"))?.fit().solve()
}

/// Fits the laboratory of a seed and compares the estimates with the truth.
fn outcome(seed: u64) -> Result<Outcome, Error> {
    let laboratory = Laboratory::new(seed);
    let report = fitted(&laboratory)?;
    let of = |(parameter, truth): (Parameter, f64)| {
        let estimate = report.estimate(parameter)?;
        let (value, [low, high]) = (estimate.value?, estimate.expanded95?);
        Some(((value - truth) / estimate.combined_std?, (low..=high).contains(&truth)))
    };
    let chosen = report.resolution.first().copied().flatten();
    Ok(Outcome {
        seed,
        grade: report.grade,
        found: laboratory.truths().into_iter().map(of).collect(),
        simulations: report.simulations,
        finer: chosen.map_or(f64::NAN, |chosen| laboratory.edges() / chosen.segments as f64),
    })
}

fn main() -> Result<(), Error> {
    let number = |n: usize| std::env::args().nth(n).and_then(|word| word.parse::<u64>().ok());
    if let Some(seed) = number(2) {
        let laboratory = Laboratory::new(seed);
        println!("{laboratory:#?}\n{}", fitted(&laboratory)?);
        return Ok(());
    }
    let count = number(1).unwrap_or(6);
    let outcomes: Vec<Outcome> = (0..count)
        .into_par_iter()
        .progress_with(ProgressBar::new(count))
        .map(outcome)
        .collect::<Result<_, _>>()?;

    // The share of intervals that contain the truth, and the RMS deviation in standard uncertainties (1 if these are right).
    let mut kept = true;
    for (k, (parameter, _)) in Laboratory::new(0).truths().into_iter().enumerate() {
        let given: Vec<(f64, bool)> =
            outcomes.iter().filter_map(|o| Some(o.found.as_ref()?[k])).collect();
        let covered = given.iter().filter(|(_, inside)| *inside).count();
        let share = 100.0 * covered as f64 / given.len() as f64;
        let square = given.iter().map(|(off, _)| off * off).sum::<f64>() / given.len() as f64;
        println!(
            "{parameter}: {share:.1} % of the {} expanded intervals of {count} fits contain the truth; off by {:.2} \
             standard uncertainties, root mean square",
            given.len(),
            square.sqrt()
        );
        kept &= count < ENOUGH || (COVERED[0]..=COVERED[1]).contains(&share);
    }
    for grade in [Grade::ModelDoesNotExplain, Grade::NotIdentifiable, Grade::NotUsable] {
        let seeds: Vec<u64> =
            outcomes.iter().filter(|o| o.grade == grade).map(|o| o.seed).collect();
        if !seeds.is_empty() {
            println!("{grade}: {} of {count}, seeds {seeds:?}", seeds.len());
        }
    }
    let refine: Vec<u64> =
        outcomes.iter().filter(|o| o.grade == Grade::RefineNumerics).map(|o| o.seed).collect();
    println!("verdicts that ask for finer numerics: {} {refine:?}", refine.len());
    // The median cost of a fit.
    let mut costs: Vec<f64> = outcomes.iter().map(|o| o.simulations).collect();
    costs.sort_by(f64::total_cmp);
    let median = costs[costs.len() / 2];
    println!("full simulations of a fit: median {median:.1}, most {:.1}", costs[costs.len() - 1]);
    let least = outcomes.iter().map(|o| o.finer).fold(f64::INFINITY, f64::min);
    println!("the data's mesh is at least {least:.1} times finer than that of the fit");
    match kept && refine.is_empty() && median <= COST {
        true => Ok(()),
        false => Err(Error::Fit(format!(
            "asked for: {COVERED:?} % covered, no verdict that asks for finer numerics, {COST} simulations"
        ))),
    }
}
