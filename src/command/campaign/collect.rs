//! `rodfit campaign collect`: gathers the stored results of all fits of a campaign in one place.
//!
//! Input is the folder of the campaign's plan. Output are, each if requested, one line of JSON per task with a result
//! (`--out`), one row per fit (`--csv`, the parts of a bootstrap in one) and a page that compares the fits
//! (`--report`). The status is printed. Damaged lines of results give warnings, except the incomplete last line of a
//! killed process. Results of one task that differ are an error. The exit code is 3 while any fit has no result, else
//! 0, or that of an output that cannot be written.

use crate::command::output::Outputs;
use crate::command::{GlobalOptions, conclude, terminal};
use rodfit::campaign::{Collected, Plan, Status};
use rodfit::fit::FitSummary;
use rodfit::page::comparison_page;
use rodfit::{Code, Error};
use std::path::Path;

/// Name of the HTML file, in the folder of `--report`, that compares several fits.
pub const COMPARISON_PAGE: &str = "comparison.html";

/// The stored results of all tasks of a plan. Each damaged line gives a warning, except the incomplete last line that a
/// killed process leaves. Errors: results that contradict each other or cannot be read.
pub(super) fn collected_results(plan: &Plan) -> Result<Collected<'_>, Error> {
    let collected = Collected::new(plan)?;
    for damage in collected.damaged.iter().filter(|damage| !damage.is_torn()) {
        terminal::warn(Code::DamagedResult, damage);
    }
    Ok(collected)
}

/// Writes the results of the campaign in `folder`: JSON lines to the file `out`, a CSV table to the file `csv`, and a
/// comparison page into the folder `report`; each is omitted if `None`. Prints the status. Returns exit code 3 while
/// results are missing, the code of an output that cannot be written, or 0. Errors before anything is written: a folder
/// without a plan, outputs that cannot be used, and results that contradict each other.
pub(super) fn collect(
    folder: &Path,
    out: Option<&Path>,
    csv: Option<&Path>,
    report: Option<&Path>,
    global: GlobalOptions,
) -> Result<u8, Error> {
    let plan = Plan::open_results(folder)?;
    let mut outputs = Outputs::empty(global);
    let lines = outputs.add("--out", out);
    let table = outputs.add("--csv", csv);
    let page = outputs.add_in_folder("--report", report, COMPARISON_PAGE);
    outputs.check(&plan.files())?;
    let collected = collected_results(&plan)?;
    let status = Status::new(&collected);
    // Lines are written one by one, without a second copy of all results in memory.
    // An output that fails does not prevent the others: all outcomes are gathered and reported at the end.
    let lines = lines.map_or(Ok(()), |output| {
        let mut writer = outputs.begin(output)?;
        let written = collected.write_lines(&mut writer);
        outputs.end_pieces(writer, written)
    });
    let written = [
        lines,
        outputs.write(table, || collected.csv_table()),
        outputs.write(page, || {
            let mut fits = collected.summaries()?;
            for fit in &mut fits {
                // Pages of single fits may be in the same folder, and are linked.
                fit.page = report.and_then(|folder| fit_page_address(fit, folder));
            }
            Ok(comparison_page(&fits, &folder_name(folder)).into_bytes())
        }),
        outputs.print(&status.summary().with_subject(folder.display())),
    ];
    // Missing results are reported although the files are written: a script may collect early.
    let open = status.open_tasks();
    if open > 0 {
        let text = format_args!("error: {open} of {} fits have no result yet", status.tasks);
        terminal::print_note(text);
    }
    Ok(conclude(if open == 0 { 0 } else { 3 }, written))
}

/// The address of the page of a fit, `NAME/fit.html`, relative to `folder`, that of the comparison page. `None` if the
/// file does not exist, or if the name is a path or hidden.
fn fit_page_address(fit: &FitSummary, folder: &Path) -> Option<String> {
    let is_name = Path::new(&fit.name).components().count() == 1 && !fit.name.starts_with('.');
    let page = format!("{}/fit.html", fit.name);
    (is_name && folder.join(&page).is_file()).then_some(page)
}

/// The last component of the absolute path of a folder, which is the title of the page; empty for the root.
fn folder_name(folder: &Path) -> String {
    let whole = folder.canonicalize().unwrap_or_else(|_| folder.into());
    whole.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}
