//! `rodfit fit`: identifies parameters from measurements, for one fit file or several in order.
//!
//! All fit files are read and all output paths checked before the first fit begins. Each fit prints a summary and
//! writes the requested report (`--json`), page (`--report`), fitted scene (`--save`) and draws (`--draws`). Several
//! fits also get a printed overview and, with `--report`, a comparison page, and a fit that fails does not stop the
//! others. The exit code is the largest of all: 2 invalid input, 3 not computed, not converged or not identifiable.

mod extend;
mod fit_name;
mod fit_run;
mod save;

use crate::command::campaign::COMPARISON_PAGE;
use crate::command::fit::fit_name::fit_names;
use crate::command::fit::fit_run::FitRun;
use crate::command::output::Outputs;
use crate::command::{
    DerivativesOption, GlobalOptions, JsonOption, conclude, exit_code, limits, terminal,
};
use rodfit::fit::FitSummary;
use rodfit::summary::{ItemTable, Summary, Tone};
use rodfit::{Code, Error, page};
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Options of `rodfit fit`.
#[derive(clap::Args)]
pub struct FitOptions {
    /// Fit files (TOML); several are fitted in order, and each output file gets the name of its fit.
    #[arg(required = true)]
    fit: Vec<PathBuf>,
    #[command(flatten)]
    json: JsonOption,
    /// Write the scene with the fitted values to this file (TOML), `-` is standard output. Experiments that differ
    /// only in their recordings are written to one file.
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
    /// Write a page with data, model and warnings (`fit.html`) and its data (`fit.json`) into this folder; for several
    /// fits also a page that compares them (`comparison.html`).
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Standard uncertainty of an input in its unit, such as radius=5e-5; may be repeated.
    #[arg(long, value_name = "NAME=SIGMA")]
    known: Vec<String>,
    /// Verify the uncertainty budget by N fits with random inputs and noise.
    #[arg(long, value_name = "N")]
    monte_carlo: Option<usize>,
    /// Sample the posterior distribution with N draws of each chain.
    #[arg(long, value_name = "N")]
    posterior: Option<usize>,
    /// Write the draws from the posterior distribution to this file (CSV), `-` is standard output.
    #[arg(long, value_name = "FILE")]
    draws: Option<PathBuf>,
    /// Refit with the omitted effects that best explain the residuals, and keep the best fit.
    #[arg(long)]
    extend: bool,
    /// Derivatives of the energies in the time stepper.
    #[arg(long, value_enum, default_value = "hand")]
    derivatives: DerivativesOption,
}

/// A row of the overview of several fits: path of the fit file, and its result on one line, the grade first.
struct OverviewLine {
    file: String,
    result: String,
}

/// Reads all fit files and checks all outputs and costs, then solves the fits in order and writes their outputs. An
/// error before the first fit is returned. After a stop by the user the remaining fits are not begun. Of several fits
/// an overview is printed unless `--quiet` or an output on standard output, and with `--report` a comparison page is
/// written. Returns the largest exit code of all fits and outputs. If the solution of a fit fails, the error is
/// returned for a single fit, and printed for one of several.
pub fn run(options: &FitOptions, global: GlobalOptions) -> Result<u8, Error> {
    // All files are read and all outputs checked before the first fit begins.
    let mut runs: Vec<FitRun> = Vec::new();
    for (path, name) in options.fit.iter().zip(fit_names(&options.fit)?) {
        runs.push(FitRun::new(path, name, options, global)?);
    }
    let inputs: Vec<PathBuf> = runs.iter().flat_map(FitRun::inputs).collect();
    for (i, run) in runs.iter().enumerate() {
        run.outputs.check(&inputs)?;
        runs[..i].iter().try_for_each(|before| run.outputs.check_beside(&before.outputs))?;
        limits::fit_cost(&run.file, run.path.clone()).admit(global)?;
    }
    // From here on Ctrl-C stops the current fit and skips the others.
    let stop = terminal::stop_on_ctrl_c(global);
    let are_several = runs.len() > 1;
    let has_overview = are_several && runs.iter().all(|run| run.outputs.has_summary());
    // The page that compares several fits has no report of its own.
    let mut comparison = Outputs::empty(global);
    let folder = options.report.as_deref().filter(|_| are_several);
    let page = comparison.add_in_folder("--report", folder, COMPARISON_PAGE);
    comparison.check(&inputs)?;
    runs.iter().try_for_each(|run| comparison.check_beside(&run.outputs))?;
    let mut summaries = Vec::new();
    let mut code = 0;
    let mut lines = Vec::new();
    // Fits run one after the other: each uses all processors.
    for (k, run) in runs.into_iter().enumerate() {
        let file = run.path.display().to_string();
        let name = run.name.clone().unwrap_or_default();
        if stop.load(Ordering::Relaxed) {
            lines.push(OverviewLine { file, result: "not begun".into() });
            continue;
        }
        if has_overview && k > 0 {
            terminal::print(&"")?;
        }
        let result = match run.solve(stop.clone()) {
            Ok(solved) => {
                code = code.max(solved.code);
                let page = format!("{name}/fit.html");
                summaries.extend(solved.summary.map(|fit| fit.named(&name).with_page(page)));
                solved.line
            }
            Err(error) if are_several => {
                terminal::print_error(&error);
                summaries.push(FitSummary::without_result(&name, error.to_string()));
                code = code.max(exit_code(&error));
                error.code().map_or("no result", Code::name).into()
            }
            Err(error) => return Err(error),
        };
        lines.push(OverviewLine { file, result });
    }
    if has_overview {
        terminal::print(&"")?;
        terminal::print_summary(&overview(&lines))?;
    }
    let title = format!("{} fits", summaries.len());
    let page =
        comparison.write(page, || Ok(page::comparison_page(&summaries, &title).into_bytes()));
    Ok(conclude(code, [page]))
}

/// The overview of several fits as a table, one row per fit: fit file, grade, and estimates. Two spaces separate grade
/// and estimates in a line's result.
fn overview(lines: &[OverviewLine]) -> Summary {
    let columns = |line: &OverviewLine| {
        let (grade, estimates) = line.result.split_once("  ").unwrap_or((&line.result, ""));
        [grade, estimates.trim()].map(String::from)
    };
    let table = ItemTable::new(lines)
        .left("fit", |line| line.file.clone())
        .left("grade", |line| columns(line)[0].clone())
        .wrapped("estimate +- standard error", |line| columns(line)[1].clone());
    Summary::new(format!("{} fits", lines.len()), Tone::Neutral).table("", table)
}
