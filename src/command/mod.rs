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
mod predict;
mod rest;
mod schema;
mod simulate;
mod study;
mod style;
mod terminal;

use crate::command::output::{Output, Outputs};
use clap::{CommandFactory, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use rodfit::scene::{Chosen, Resolution};
use rodfit::{Derivatives, Error, Problem, Scene, printable_name};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The last paragraph of the help.
const EXITS: &str = "Exit codes: 0 done; 2 bad input; 3 not computed, not converged or not identifiable.\n\
                     `rodfit explain CODE` explains an exit code, or the code in brackets after a warning.\n\n\
                     Example: rodfit fit data/cantilever-fit.toml --report page";

/// Simulates slender elastic rods and identifies their parameters from recorded motion.
#[derive(Parser)]
#[command(version, after_help = EXITS)]
struct Arguments {
    #[command(flatten)]
    manner: Manner,
    #[command(subcommand)]
    command: Command,
}

/// The heading of the options that every command has.
const SHARED_OPTIONS: &str = "Options of all commands";

/// Options of every command.
#[derive(Clone, Copy, clap::Args)]
struct Manner {
    /// Print errors only: no progress and no summary.
    #[arg(short, long, global = true, help_heading = SHARED_OPTIONS)]
    quiet: bool,
    /// Replace existing files by those of `init` and by interrupted results.
    #[arg(long, global = true, help_heading = SHARED_OPTIONS)]
    overwrite: bool,
    /// Run computations that exceed the limits of memory, time and disk.
    #[arg(long, global = true, help_heading = SHARED_OPTIONS)]
    no_limits: bool,
    /// Both `--overwrite` and `--no-limits`: the flag of version 0.1.
    #[arg(long, global = true, hide = true)]
    force: bool,
}

impl Manner {
    /// Whether existing files may be replaced where they are kept by default.
    const fn overwrites(self) -> bool {
        self.overwrite || self.force
    }

    /// Whether the limits of memory, time and disk are ignored.
    const fn ignores_limits(self) -> bool {
        self.no_limits || self.force
    }
}

#[derive(Subcommand)]
enum Command {
    /// Simulate the motion of a rod.
    #[command(
        after_help = "Example: rodfit simulate data/cantilever.toml --out nodes.csv --report page"
    )]
    Simulate(simulate::Options),
    /// Compute the equilibrium of a rod under its loads, and its stability.
    #[command(after_help = "Example: rodfit static data/cantilever.toml --out shape.csv")]
    Static(rest::Options),
    /// Compute the lowest natural frequencies and mode shapes.
    #[command(after_help = "Example: rodfit modes data/cantilever.toml --count 4")]
    Modes(modes::Options),
    /// Measure time and error over schemes, time steps and meshes.
    #[command(after_help = "Example: rodfit study data/cantilever.toml --report page")]
    Study(study::Options),
    /// List the parameters of a scene that can be identified, with their values and units.
    #[command(after_help = "Example: rodfit parameters data/cantilever.toml")]
    Parameters(parameters::Options),
    /// Benchmark the shipped scenes on this machine: steps per second, and seconds per fit.
    #[command(after_help = "Example: rodfit bench --seconds 0.1")]
    Bench(bench::Options),
    /// Compare hand-derived derivatives with those of dual numbers and with finite differences.
    #[command(after_help = "Example: rodfit check data/cantilever.toml")]
    Check(check::Options),
    /// Identify parameters from recorded motion, shapes at rest and natural frequencies.
    #[command(
        after_help = "Example: rodfit fit data/cantilever-fit.toml --report page --known radius=5e-5"
    )]
    Fit(fit::Options),
    /// Compare a scene with recordings, without a fit.
    #[command(
        after_help = "Example: rodfit predict data/cantilever.toml --on data/cantilever-tip.csv"
    )]
    Predict(predict::Options),
    /// Run many fits on one or several machines: plan, run, collect.
    #[command(subcommand)]
    #[command(after_help = "Example: rodfit campaign plan data/campaign.toml --out out")]
    Campaign(campaign::Campaign),
    /// Compute the expected uncertainty of a planned experiment, and the best marker position, duration and frame rate.
    #[command(after_help = "Example: rodfit design data/cantilever-fit.toml --sigma 1e-3")]
    Design(design::Options),
    /// Describe a file of markers, and print the observation for a fit file.
    #[command(after_help = "Example: rodfit inspect data/cantilever-tip.csv")]
    Inspect(inspect::Options),
    /// Write a scene, a fit and synthetic data as a template.
    #[command(after_help = "Example: rodfit init cantilever --out mine")]
    Init(init::Options),
    /// Explain the code of a warning, a grade or an exit code; without an argument, list all codes.
    #[command(after_help = "Example: rodfit explain beyond-sigma")]
    Explain(explain::Options),
    /// Print the JSON schema of an input file or of a result.
    #[command(after_help = "Example: rodfit schema scene")]
    Schema(schema::Options),
    /// Print a manual page.
    #[command(after_help = "Example: rodfit man fit")]
    Man {
        /// Subcommand of the page; default: the whole command.
        command: Option<String>,
    },
    /// Print the completion script of a shell.
    #[command(after_help = "Example: rodfit completions bash")]
    Completions {
        /// Name of the shell.
        shell: Shell,
    },
}

/// Destination of a report.
#[derive(clap::Args)]
struct Json {
    /// Write the report to this file (JSON); `-` is standard output.
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
    /// Hand-derived formulas.
    Hand,
    /// Automatic differentiation with dual numbers.
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
    let words: Vec<OsString> = words.into_iter().collect();
    let parsed = Arguments::try_parse_from(&words).map_err(|said| {
        // The message quotes words, which may be names of files from elsewhere.
        let shown = words.iter().map(|word| printable_name(&word.to_string_lossy()).into_owned());
        Arguments::try_parse_from(shown).err().unwrap_or(said)
    });
    let Arguments { manner, command } = match parsed {
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
        Command::Predict(options) => predict::run(&options, manner),
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
