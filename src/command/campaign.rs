//! `rodfit campaign`

use crate::command::output::Outputs;
use crate::command::{Json, Manner, code_of, conclude, limits, terminal};
use rodfit::campaign::{Admission, Collected, Plan, Ran, Shard, Status, Way, useful_threads};
use rodfit::fit::FitSummary;
use rodfit::page::comparison_page;
use rodfit::summary::{Summary, Tone};
use rodfit::{Code, Error, Scene};
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::thread::available_parallelism;
use std::time::Duration;

/// Tasks that cannot be begun are named up to so many.
const NAMED: usize = 5;
/// How long fits may take to stop after TERM or Ctrl-C. Then the process ends without them: what is done is stored.
const STOP_TIME: Duration = Duration::from_secs(3);
/// File of the page that compares fits.
pub const COMPARISON: &str = "comparison.html";
/// Shards of a job script unless told.
const SHARDS: u64 = 100;

#[derive(clap::Subcommand)]
pub enum Campaign {
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
        part: Part,
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
        json: Json,
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
        /// Write a page that compares the fits (`comparison.html`) into this folder; it links `NAME/fit.html` where present.
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

#[derive(clap::Args)]
pub struct Part {
    /// Compute shard I of N, with I from 0 to N - 1; default in a Slurm job array: the job's own shard.
    #[arg(long, value_name = "I/N", conflicts_with = "shards")]
    shard: Option<Shard>,
    /// Number of shards; I is read from PBS_ARRAY_INDEX, HQ_TASK_ID or SLURM_ARRAY_TASK_ID.
    #[arg(long, value_name = "N")]
    shards: Option<NonZero<u64>>,
}

impl Part {
    fn shard(&self) -> Result<Option<Shard>, Error> {
        let variable = |name: &str| std::env::var(name).ok();
        match (self.shard, self.shards) {
            (Some(shard), _) => Ok(Some(shard)),
            (None, of) => {
                let shard = Shard::of_scheduler(variable, of.map(NonZero::get))?;
                match (of, shard) {
                    (Some(of), None) => Err(Error::Invalid {
                        file: None,
                        key: "--shards".into(),
                        found: format!(
                            "{of} outside a job array, where no scheduler gives the index of the shard"
                        ),
                        allowed: "--shard I/N".into(),
                    }),
                    _ => Ok(shard),
                }
            }
        }
    }
}

pub fn run(campaign: &Campaign, manner: Manner) -> Result<u8, Error> {
    match campaign {
        Campaign::Plan { campaign, out } => plan(campaign, out, manner),
        Campaign::Run { folder, part, threads } => {
            let threads = threads.or(available_parallelism().ok()).map_or(1, NonZero::get);
            work(folder, part.shard()?, threads, manner)
        }
        Campaign::Status { folder, json } => status(folder, json, manner),
        Campaign::Collect { folder, out, csv, report } => {
            let destinations = Destinations {
                out: out.as_deref(),
                csv: csv.as_deref(),
                report: report.as_deref(),
            };
            collect(folder, &destinations, manner)
        }
        Campaign::Sbatch { folder, time, shards, threads } => {
            let plan = Plan::open(folder)?;
            let shards = shards.map_or(SHARDS.min(plan.tasks.len() as u64).max(1), NonZero::get);
            let script = script(&plan, time, shards, threads.get())?;
            terminal::print(&script.trim_end()).map(|()| 0)
        }
    }
}

fn plan(campaign: &Path, out: &Path, manner: Manner) -> Result<u8, Error> {
    let admission = Admission {
        scene: &|scene: &Scene| limits::of_mesh(scene).admit(Manner { quiet: true, ..manner }),
        fit: &|fit, path| limits::of_fit(fit, path.into()).admit(Manner { quiet: true, ..manner }),
    };
    let planned = Plan::make(campaign, out, &admission)?;
    for error in planned.refused.iter().take(NAMED) {
        terminal::warn(Code::InvalidTask, format_args!("this fit will be rejected: {error}"));
    }
    if let Some(more) = planned.refused.len().checked_sub(NAMED + 1) {
        terminal::warn(Code::InvalidTask, format_args!("and {} more", more + 1));
    }
    let status = Status::of(&Collected::of(&planned.plan)?);
    if !manner.quiet {
        terminal::print_summary(&status.summary().of(out.display().to_string()))?;
    }
    Ok(0)
}

fn work(folder: &Path, shard: Option<Shard>, threads: usize, manner: Manner) -> Result<u8, Error> {
    let plan = Plan::open(folder)?;
    let useful = useful_threads(threads);
    if useful < threads && !manner.quiet {
        let words = format_args!(
            "--threads {threads} is more than this machine's processors; {useful} are used"
        );
        terminal::warn(Code::FewerThreads, words);
    }
    let way = Way { shard, threads: useful, stop: terminal::stop_on_ctrl_c(manner) };
    terminal::end_after_stop(&way.stop, STOP_TIME);
    let bar = terminal::progress_bar(manner, 1);
    let ran = plan.run(&way, |done, total| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    let ran = ran?;
    for task in &ran.panicked {
        let fit = task.fit.display();
        terminal::tell(format_args!(
            "error: {} ({fit}) has no result: the program failed. Report this fault",
            task.id
        ));
    }
    for (_, error) in ran.changed.iter().take(NAMED) {
        terminal::complain(error);
    }
    if let Some(more) = ran.changed.len().checked_sub(NAMED + 1) {
        terminal::tell(format_args!("error: and {} more", more + 1));
    }
    if !manner.quiet {
        terminal::print_summary(&summary(&ran).of(folder.display().to_string()))?;
    }
    let changed = ran.changed.iter().map(|(_, error)| code_of(error)).max().unwrap_or(0);
    Ok(if ran.panicked.is_empty() { changed } else { 3 })
}

fn summary(ran: &Ran) -> Summary {
    let usable = ran.codes.iter().filter(|code| **code == 0).count();
    let status = match ran.left() {
        0 => format!("all {} fits have a result", ran.tasks),
        left => format!("{left} of {} fits have no result yet", ran.tasks),
    };
    let tone = if ran.left() == 0 { Tone::Good } else { Tone::Doubtful };
    Summary::new(status, tone)
        .fact("This run", format!("{} fits, {usable} usable", ran.codes.len()))
        .fact("Earlier runs", format!("{} fits", ran.before))
}

fn status(folder: &Path, json: &Json, manner: Manner) -> Result<u8, Error> {
    let plan = Plan::open_results(folder)?;
    let mut outputs = Outputs::new(manner);
    let (option, path) = json.output();
    let json = outputs.add(option, path);
    outputs.check(&[])?;
    let collected = collected(&plan)?;
    let status = Status::of(&collected);
    let code = if status.left() == 0 { 0 } else { 3 };
    Ok(conclude(
        code,
        [
            outputs.write_json(json, &status),
            outputs.summary(&status.summary().of(folder.display().to_string())),
        ],
    ))
}

/// The results of a plan, and a word on lines that are damaged.
fn collected(plan: &Plan) -> Result<Collected<'_>, Error> {
    let collected = Collected::of(plan)?;
    for damage in collected.damaged.iter().filter(|damage| !damage.is_torn()) {
        terminal::warn(Code::DamagedResult, damage);
    }
    Ok(collected)
}

/// Destinations of collected results.
struct Destinations<'a> {
    out: Option<&'a Path>,
    csv: Option<&'a Path>,
    report: Option<&'a Path>,
}

fn collect(folder: &Path, destinations: &Destinations, manner: Manner) -> Result<u8, Error> {
    let Destinations { out, csv, report } = *destinations;
    let plan = Plan::open_results(folder)?;
    let mut outputs = Outputs::new(manner);
    let lines = outputs.add("--out", out);
    let sheet = outputs.add("--csv", csv);
    let page = outputs.add_in_folder("--report", report, COMPARISON);
    outputs.check(&plan.files())?;
    let collected = collected(&plan)?;
    let status = Status::of(&collected);
    let lines = lines.map_or(Ok(()), |output| {
        let mut writing = outputs.begin(output)?;
        let written = collected.write_lines(&mut writing);
        outputs.finish(writing, written)
    });
    let written = [
        lines,
        outputs.write(sheet, || collected.sheet()),
        outputs.write(page, || {
            let mut fits = collected.summaries()?;
            fits.iter_mut()
                .for_each(|fit| fit.page = report.and_then(|folder| page_of(fit, folder)));
            Ok(comparison_page(&fits, &title_of(folder)).into_bytes())
        }),
        outputs.summary(&status.summary().of(folder.display().to_string())),
    ];
    let left = status.left();
    if left > 0 {
        terminal::tell(format_args!("error: {left} of {} fits have no result yet", status.tasks));
    }
    Ok(conclude(if left == 0 { 0 } else { 3 }, written))
}

/// The address of the page of a fit in a folder, if it is there.
fn page_of(fit: &FitSummary, folder: &Path) -> Option<String> {
    let is_name = Path::new(&fit.name).components().count() == 1 && !fit.name.starts_with('.');
    let page = format!("{}/fit.html", fit.name);
    (is_name && folder.join(&page).is_file()).then_some(page)
}

/// The name of the campaign's folder.
fn title_of(folder: &Path) -> String {
    let whole = folder.canonicalize().unwrap_or_else(|_| folder.into());
    whole.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// A job array whose jobs are shards. Jobs that end early, at their time or with their machine, leave the rest to the
/// next submission.
fn script(plan: &Plan, time: &str, shards: u64, threads: usize) -> Result<String, Error> {
    let is_time = !time.is_empty() && time.chars().all(|c| c.is_ascii_digit() || ":-".contains(c));
    if !is_time {
        return Err(Error::Invalid {
            file: None,
            key: "--time".into(),
            found: time.into(),
            allowed: "minutes, h:m:s or d-h:m:s, as in 1:00:00".into(),
        });
    }
    let folder = plan.folder.canonicalize();
    let folder =
        folder.map_err(|source| Error::Io { named_in: None, path: plan.folder.clone(), source })?;
    let name =
        folder.file_name().unwrap_or_default().to_string_lossy().replace(char::is_whitespace, "-");
    let folder = folder.display().to_string().replace('\'', r"'\''");
    let last = shards - 1;
    Ok(format!(
        "#!/bin/sh
#SBATCH --job-name={name}
#SBATCH --array=0-{last}
#SBATCH --time={time}
#SBATCH --cpus-per-task={threads}
#SBATCH --requeue
# A minute before the time is over the job ends by itself, with all its results stored.
#SBATCH --signal=B:TERM@60
# Submit it again until `rodfit campaign status` says that all is done: what has a result is skipped.
exec rodfit campaign run '{folder}' --threads {threads}
"
    ))
}
