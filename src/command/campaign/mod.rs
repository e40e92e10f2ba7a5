//! `rodfit campaign`: many fits on one or several machines, by the subcommands plan, run, status, collect and sbatch.
//!
//! `plan` expands a campaign file (TOML) into a list of fits in a folder. `run` computes those without a stored result,
//! or one shard of them; several processes may run on a shared folder. `status` prints the progress, `collect` gathers
//! the results, and `sbatch` prints a Slurm script. The exit code is 3 while results are missing (`status`, `collect`)
//! or if a fit panicked (`run`), and in general 2 for changed input files (`run`). Else it is 0, or that of an output
//! that cannot be written. Fits that are not usable do not change it.

mod collect;
mod job_script;

use crate::command::campaign::collect::{collect, collected_results};
use crate::command::campaign::job_script::job_script;
use crate::command::output::Outputs;
use crate::command::{GlobalOptions, JsonOption, exit_code, limits, terminal};
use rodfit::campaign::{
    Admission, Collected, Plan, RunOptions, RunSummary, Shard, Status, useful_threads,
};
use rodfit::summary::{Summary, Tone};
use rodfit::{Code, Error, Scene};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;
use std::time::Duration;

pub use collect::COMPARISON_PAGE;

/// Most errors of one kind that are printed; the remaining ones are only counted, so that thousands do not flood the
/// terminal.
const MAX_PRINTED: usize = 5;
/// Time that fits get to stop after TERM or Ctrl-C. After that the process ends with fits unfinished: finished results
/// are stored. Schedulers kill a process some seconds after TERM.
const STOP_TIME: Duration = Duration::from_secs(3);
/// Most jobs of a job script without `--shards`; with fewer fits than this, there is one job per fit.
const DEFAULT_SHARDS: u64 = 100;

// Subcommands of `rodfit campaign`: a doc comment here would replace the description in its help.
#[derive(clap::Subcommand)]
pub enum CampaignCommand {
    /// Write the list of fits (`tasks.jsonl`) of a campaign into a folder; existing results of unchanged fits are kept.
    #[command(after_help = "Example: rodfit campaign plan data/campaign.toml --out out")]
    Plan {
        /// Campaign file (TOML).
        campaign: PathBuf,
        /// Folder of plan and results.
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Compute all fits without a result; processes may be killed, repeated and run in parallel on a shared folder.
    #[command(after_help = "Example: rodfit campaign run out --threads 2")]
    Run {
        /// Folder of the plan.
        folder: PathBuf,
        #[command(flatten)]
        shard: ShardOptions,
        /// Number of processors; default: all.
        #[arg(long, value_name = "N")]
        threads: Option<NonZero<usize>>,
    },
    /// Print progress and remaining time; the exit code is 3 while results are missing.
    #[command(after_help = "Example: rodfit campaign status out")]
    Status {
        /// Folder of the plan.
        folder: PathBuf,
        #[command(flatten)]
        json: JsonOption,
    },
    /// Write the results of all fits to one file; the exit code is 3 while results are missing.
    #[command(after_help = "Example: rodfit campaign collect out --csv all.csv")]
    Collect {
        /// Folder of the plan.
        folder: PathBuf,
        /// Write all reports to this file, one line of JSON each, sorted by id; `-` is standard output.
        #[arg(long, value_name = "FILE")]
        out: Option<PathBuf>,
        /// Write one row per fit to this file (CSV); `-` is standard output.
        #[arg(long, value_name = "FILE")]
        csv: Option<PathBuf>,
        /// Write a page that compares the fits (`comparison.html`) into this folder; it links `NAME/fit.html` where
        /// present.
        #[arg(long, value_name = "DIR")]
        report: Option<PathBuf>,
    },
    /// Print the script of a Slurm job array for `sbatch`; nothing is submitted.
    #[command(after_help = "Example: rodfit campaign sbatch out --time 1:00:00 --shards 40")]
    Sbatch {
        /// Folder of the plan.
        folder: PathBuf,
        /// Time limit of a job in the notation of Slurm, as 1:00:00.
        #[arg(long)]
        time: String,
        /// Number of jobs; default: the number of fits, at most 100.
        #[arg(long, value_name = "N")]
        shards: Option<NonZero<u64>>,
        /// Number of processors of a job.
        #[arg(long, value_name = "N", default_value = "1")]
        threads: NonZero<usize>,
    },
}

/// The part of a campaign that a process runs.
#[derive(clap::Args)]
pub struct ShardOptions {
    /// Compute shard I of N, with I from 0 to N - 1; default in a Slurm job array: the job's own shard.
    #[arg(long, value_name = "I/N", conflicts_with = "shards")]
    shard: Option<Shard>,
    /// Number of shards; I is read from PBS_ARRAY_INDEX, HQ_TASK_ID or SLURM_ARRAY_TASK_ID.
    #[arg(long, value_name = "N")]
    shards: Option<NonZero<u64>>,
}

impl ShardOptions {
    /// The shard of `--shard`, or that of the scheduler's job array by its environment variable; `None` outside a job
    /// array: all fits. `--shards` outside a job array is an error, because no environment variable gives the index.
    fn shard(&self) -> Result<Option<Shard>, Error> {
        if self.shard.is_some() {
            return Ok(self.shard);
        }
        let variable = |name: &str| std::env::var(name).ok();
        let shard = Shard::from_scheduler(variable, self.shards.map(NonZero::get))?;
        match (self.shards, shard) {
            // Without an index all processes would run the same shard.
            (Some(count), None) => {
                let found = format!(
                    "{count} outside a job array, where no scheduler gives the index of the shard"
                );
                Err(Error::invalid("--shards", found, "--shard I/N"))
            }
            _ => Ok(shard),
        }
    }
}

/// Runs a subcommand of `rodfit campaign` and returns its exit code. Defaults: `run` uses all processors, `sbatch` one
/// job per fit, at most [`DEFAULT_SHARDS`]. Errors are those of the subcommand.
pub fn run(command: &CampaignCommand, global: GlobalOptions) -> Result<u8, Error> {
    match command {
        CampaignCommand::Plan { campaign, out } => plan(campaign, out, global),
        CampaignCommand::Run { folder, shard, threads } => {
            let threads = threads.or(available_parallelism().ok()).map_or(1, NonZero::get);
            run_tasks(folder, shard.shard()?, threads, global)
        }
        CampaignCommand::Status { folder, json } => status(folder, json, global),
        CampaignCommand::Collect { folder, out, csv, report } => {
            let [out, csv, report] = [out, csv, report].map(Option::as_deref);
            collect(folder, out, csv, report, global)
        }
        CampaignCommand::Sbatch { folder, time, shards, threads } => {
            let plan = Plan::open(folder)?;
            // More jobs than fits would have nothing to compute.
            let default = DEFAULT_SHARDS.min(plan.tasks.len() as u64).max(1);
            let shards = shards.map_or(default, NonZero::get);
            let script = job_script(&plan.folder, time, shards, threads.get())?;
            terminal::print(&script.trim_end()).map(|()| 0)
        }
    }
}

/// Expands the campaign file `campaign` into the plan in the folder `out` and prints its status. Fits that would be
/// rejected give warnings (at most [`MAX_PRINTED`], the others counted) and remain in the plan; a fit above a limit of
/// memory, time or disk is an error. Returns exit code 0.
fn plan(campaign: &Path, out: &Path, global: GlobalOptions) -> Result<u8, Error> {
    // Costs of single fits are not announced while thousands are planned.
    let silent = GlobalOptions { quiet: true, ..global };
    let admission = Admission {
        scene: &|scene: &Scene| limits::mesh_cost(scene).admit(silent),
        fit: &|fit, path| limits::fit_cost(fit, path.into()).admit(silent),
    };
    let planned = Plan::make(campaign, out, &admission)?;
    for error in planned.refused.iter().take(MAX_PRINTED) {
        terminal::warn(Code::InvalidTask, format_args!("this fit will be rejected: {error}"));
    }
    // The other errors are counted.
    if let Some(more) = planned.refused.len().checked_sub(MAX_PRINTED + 1) {
        terminal::warn(Code::InvalidTask, format_args!("and {} more", more + 1));
    }
    // The folder may have results of an earlier plan, which count for unchanged tasks.
    let status = Status::new(&Collected::new(&planned.plan)?);
    Outputs::empty(global).print(&status.summary().with_subject(out.display()))?;
    Ok(0)
}

/// Computes the fits of a shard (all fits if `None`) that have no result, on up to `threads` threads, stores the
/// results, and prints a summary. TERM and Ctrl-C stop it. Returns exit code 3 if a fit panicked, else the largest code
/// of tasks whose files changed since the plan, else 0.
fn run_tasks(
    folder: &Path,
    shard: Option<Shard>,
    threads: usize,
    global: GlobalOptions,
) -> Result<u8, Error> {
    let plan = Plan::open(folder)?;
    let useful = useful_threads(threads);
    if useful < threads && !global.quiet {
        let text = format_args!(
            "--threads {threads} is more than this machine's processors; {useful} are used"
        );
        terminal::warn(Code::FewerThreads, text);
    }
    let options = RunOptions { shard, threads: useful, stop: terminal::stop_on_ctrl_c(global) };
    // A scheduler kills the process soon after TERM.
    terminal::end_after_stop(&options.stop, STOP_TIME);
    let bar = terminal::progress_bar(global, 1);
    let run = plan.run(&options, |done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    let run = run?;
    // A panic is a fault of the program: each one is printed, without an upper limit on their number.
    for task in &run.panicked {
        let fit = task.fit.display();
        terminal::print_note(format_args!(
            "error: {} ({fit}) has no result: the program failed. Report this fault",
            task.id
        ));
    }
    for task in run.changed.iter().take(MAX_PRINTED) {
        terminal::print_error(&task.error);
    }
    if let Some(more) = run.changed.len().checked_sub(MAX_PRINTED + 1) {
        terminal::print_note(format_args!("error: and {} more", more + 1));
    }
    Outputs::empty(global).print(&summary(&run).with_subject(folder.display()))?;
    let changed = run.changed.iter().map(|task| exit_code(&task.error)).max().unwrap_or(0);
    // A fault of the program has precedence over changed files.
    Ok(if run.panicked.is_empty() { changed } else { 3 })
}

/// The result of a run as text: fits with a result, fits of this run and how many of them are usable (exit code 0), and
/// fits of earlier runs. The tone is good if all fits have a result, else doubtful.
fn summary(run: &RunSummary) -> Summary {
    let usable = run.codes.iter().filter(|code| **code == 0).count();
    let status = match run.open_tasks() {
        0 => format!("all {} fits have a result", run.tasks),
        open => format!("{open} of {} fits have no result yet", run.tasks),
    };
    let tone = if run.open_tasks() == 0 { Tone::Good } else { Tone::Doubtful };
    Summary::new(status, tone)
        .fact("This run", format!("{} fits, {usable} usable", run.codes.len()))
        .fact("Earlier runs", format!("{} fits", run.before))
}

/// Writes (JSON) and prints the progress of the campaign in `folder`. Returns exit code 3 while results are missing,
/// else 0. Errors: a folder without a plan, an output that cannot be used, and results that contradict each other.
fn status(folder: &Path, json: &JsonOption, global: GlobalOptions) -> Result<u8, Error> {
    let plan = Plan::open_results(folder)?;
    let outputs = Outputs::with_json(json, &[], global)?;
    let status = Status::new(&collected_results(&plan)?);
    let code = if status.open_tasks() == 0 { 0 } else { 3 };
    let summary = status.summary().with_subject(folder.display());
    Ok(outputs.finish(code, &status, None, &summary))
}
