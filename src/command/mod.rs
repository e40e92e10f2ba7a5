//! The command `rodfit`, as a function: what the command line may say, and who does it.
//!
//! Every subcommand goes the same way: read the inputs, look at the outputs, estimate what it takes, compute, write
//! everything it can, say the rest. It uses the library as anybody does; the program and the Python package call it.

mod bench;
mod campaign;
mod check;
mod design;
mod explain;
mod extend;
mod fit;
mod init;
mod inspect;
mod limits;
mod modes;
mod output;
mod parameters;
mod rest;
mod schema;
mod simulate;
mod study;
mod terminal;

use crate::command::output::{Output, Outputs};
use clap::{CommandFactory, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use rodfit::scene::{Chosen, Resolution};
use rodfit::{Derivatives, Error, Problem, Scene};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// What stands below the help.
const EXITS: &str = "Exit codes: 0 done; 2 bad input; 3 not computed, not converged or not identifiable. `rodfit explain` \
                     says more of them, and of the word in brackets behind a warning.";

/// Simulates slender elastic rods and identifies their parameters from recorded motion.
#[derive(Parser)]
#[command(version, after_help = EXITS)]
struct Arguments {
    #[command(flatten)]
    manner: Manner,
    #[command(subcommand)]
    command: Command,
}

/// How a run goes about it, whatever it does.
#[derive(Clone, Copy, clap::Args)]
struct Manner {
    /// No progress and no summary; errors are still printed.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Run what is estimated to take more than the limits of memory, time and disk; let results that Ctrl-C cut
    /// short take the place of older ones, and what `init` writes that of files that are there.
    #[arg(long, global = true)]
    force: bool,
}

#[derive(Subcommand)]
enum Command {
    /// Simulate a scene.
    Simulate(simulate::Options),
    /// Find where a rod comes to rest under its loads, and whether it stays there.
    Static(rest::Options),
    /// The lowest frequencies and shapes of small vibrations.
    Modes(modes::Options),
    /// Speed against error over schemes, steps and meshes.
    Study(study::Options),
    /// List the numbers of a scene that can be identified, with their values and units.
    Parameters(parameters::Options),
    /// How fast this machine is at the shipped scenes: steps a second, and seconds of a fit.
    Bench(bench::Options),
    /// Compare hand-derived derivatives with num-dual's and with finite differences.
    Check(check::Options),
    /// Identify parameters from recorded motion.
    Fit(fit::Options),
    /// Many fits, on many machines: plan them, run them in shards that may be killed at any moment, collect their results.
    #[command(subcommand)]
    Campaign(campaign::Campaign),
    /// Say what a fit would tell before anything is recorded, and where to put the marker, how long and how fast to
    /// film.
    Design(design::Options),
    /// Tell what is in a file of markers, and write the observation of a fit file.
    Inspect(inspect::Options),
    /// Write a scene and a fit to begin with.
    Init(init::Options),
    /// Say what a word in brackets behind a warning, or an exit code, means; without one, list all.
    Explain(explain::Options),
    /// Print the JSON schema of scenes, of fits or of results, for editors and for programs.
    Schema(schema::Options),
    /// Print a manual page, to be read (`rodfit man fit | man -l -`) or to be put where `man` looks for it.
    Man {
        /// The subcommand; the page of the whole command without it.
        command: Option<String>,
    },
    /// Print what a shell needs to complete this command, to be put where it looks for that.
    Completions {
        /// The shell.
        shell: Shell,
    },
}

/// Where a report goes.
#[derive(clap::Args)]
struct Json {
    /// Write the report here (JSON); `-` is stdout.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Json {
    /// The option with its path.
    fn output(&self) -> (&'static str, Option<&Path>) {
        ("--json", self.json.as_deref())
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Route {
    /// The hand-derived formulas.
    Hand,
    /// num-dual's derivatives of the energies.
    Dual,
}

impl From<Route> for Derivatives {
    fn from(route: Route) -> Self {
        match route {
            Route::Hand => Self::Hand,
            Route::Dual => Self::Dual,
        }
    }
}

/// Does what a command line says, of which the first word is the program's name. The exit code: 0 done; 2 bad input;
/// 3 could not be computed, did not converge, or not identifiable.
pub fn run(words: impl IntoIterator<Item = OsString>) -> u8 {
    let Arguments { manner, command } = match Arguments::try_parse_from(words) {
        Ok(arguments) => arguments,
        Err(said) => {
            // Help and versions among them; there is nobody to tell when that fails.
            let _ = said.print();
            return u8::try_from(said.exit_code()).unwrap_or(2);
        }
    };
    limits::bound_threads(manner);
    let outcome = match command {
        Command::Simulate(options) => simulate::run(&options, manner),
        Command::Static(options) => rest::run(&options, manner),
        Command::Modes(options) => modes::run(&options, manner),
        Command::Study(options) => study::run(&options, manner),
        Command::Parameters(options) => parameters::run(&options, manner),
        Command::Bench(options) => bench::run(&options, manner),
        Command::Check(options) => check::run(&options, manner),
        Command::Fit(options) => fit::run(&options, manner),
        Command::Campaign(what) => campaign::run(&what, manner),
        Command::Design(options) => design::run(&options, manner),
        Command::Inspect(options) => inspect::run(&options, manner),
        Command::Init(options) => init::run(&options, manner),
        Command::Explain(options) => explain::run(&options),
        Command::Schema(options) => schema::run(&options),
        Command::Man { command } => man(command.as_deref()),
        Command::Completions { shell } => completions(shell),
    };
    outcome.unwrap_or_else(|error| {
        terminal::complain(&error);
        code_of(&error)
    })
}

fn completions(shell: Shell) -> Result<u8, Error> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "rodfit", &mut script);
    terminal::print(&String::from_utf8_lossy(&script).trim_end()).map(|()| 0)
}

fn man(subcommand: Option<&str>) -> Result<u8, Error> {
    let mut command = Arguments::command();
    command.build();
    let found = match subcommand {
        None => Some(&command),
        Some(name) => command.find_subcommand(name),
    };
    let found = found.ok_or_else(|| {
        let names: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
        Error::Invalid {
            file: None,
            key: "man".into(),
            found: subcommand.unwrap_or_default().into(),
            allowed: names.join(", "),
        }
    })?;
    let mut page = Vec::new();
    let manual = clap_mangen::Man::new(found.clone());
    manual.render(&mut page).map_err(terminal::stdout_error)?;
    terminal::print(&String::from_utf8_lossy(&page).trim_end()).map(|()| 0)
}

/// The scene of a subcommand, and a place for each of its outputs, by its option; they are checked before
/// anything runs.
fn open<const N: usize>(
    scene: &Path,
    outputs: [(&str, Option<&Path>); N],
    manner: Manner,
) -> Result<(Scene, Outputs, [Option<Output>; N]), Error> {
    let scene = Scene::load(scene)?;
    let mut all = Outputs::new(manner);
    let places = outputs.map(|(option, path)| all.add(option, path));
    all.check(&scene.files())?;
    Ok((scene, all, places))
}

/// 2 where the input is at fault, 3 where the computation is.
fn code_of(error: &Error) -> u8 {
    if error.is_input() { 2 } else { 3 }
}

/// What a mesh chosen for what does not move is worth; none where the scene has its own.
fn chosen_mesh(problem: &Problem) -> Option<Resolution> {
    let chosen = Chosen { segments: true, ..Chosen::default() };
    let found = problem.resolution().filter(|found| found.chosen.segments)?;
    Some(Resolution { step: None, scheme: None, chosen, ..*found })
}

/// Says what could not be written, and what the run is worth then.
fn conclude(code: u8, written: impl IntoIterator<Item = Result<(), Error>>) -> u8 {
    written.into_iter().filter_map(Result::err).fold(code, |code, error| {
        terminal::complain(&error);
        code.max(code_of(&error))
    })
}
