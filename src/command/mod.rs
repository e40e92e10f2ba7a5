//! The command `rodfit` as a function: parses a command line, runs the subcommand and returns the exit code.
//!
//! Subcommands of computations have the same stages, in general in this order: read the inputs, check that the outputs
//! can be written, estimate the cost and reject it above a limit, compute, write, print. `output` writes files,
//! `limits` estimates costs, `terminal` and `style` print. Structures, benchmarks, `init` and `inspect` have no
//! estimate of the cost. Others print texts: manual pages, completions, schemas, codes. Each subcommand has a file of
//! its name (`static` is `rest`). The code is 0 if done, 2 for invalid input, 3 if not computed, not converged or not
//! identifiable; errors are printed on standard error. `conclude` prints those of outputs, and returns the largest exit
//! code. `chosen_mesh` is the mesh that was chosen, for reports. It uses the public library only; the program and the
//! Python package call [`run`].

mod bench;
mod campaign;
mod check;
mod design;
mod explain;
mod export;
mod fit;
mod init;
mod inspect;
mod known;
mod limits;
mod modes;
mod output;
mod parameters;
mod predict;
mod rest;
mod schema;
mod simulate;
mod structure;
mod study;
mod style;
mod terminal;

use clap::{CommandFactory, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use rodfit::scene::{Chosen, Resolution};
use rodfit::{Derivatives, Error, Problem, printable_name};
use std::ffi::OsString;
use std::path::PathBuf;

/// The last paragraph of the help.
const EXIT_CODES: &str = "Exit codes: 0 done; 2 bad input; 3 not computed, not converged or not identifiable.\n\
                     `rodfit explain CODE` explains an exit code, or the code in brackets after a warning.\n\n\
                     Example: rodfit fit data/cantilever-fit.toml --report page";

/// Simulates slender elastic rods and identifies their parameters from recorded motion.
#[derive(Parser)]
#[command(version, after_help = EXIT_CODES)]
struct Arguments {
    #[command(flatten)]
    global: GlobalOptions,
    #[command(subcommand)]
    command: Command,
}

/// The heading of the options that every command has.
const SHARED_OPTIONS: &str = "Options of all commands";

/// Options of every command.
#[derive(Clone, Copy, clap::Args)]
struct GlobalOptions {
    /// Print errors only: no progress and no summary.
    #[arg(short, long, global = true, help_heading = SHARED_OPTIONS)]
    quiet: bool,
    /// Allow `init` and interrupted computations to replace existing files.
    #[arg(long, global = true, help_heading = SHARED_OPTIONS)]
    overwrite: bool,
    /// Run computations that exceed the limits of memory, time and disk.
    #[arg(long, global = true, help_heading = SHARED_OPTIONS)]
    no_limits: bool,
    /// Both `--overwrite` and `--no-limits`: the flag of version 0.1.
    #[arg(long, global = true, hide = true)]
    force: bool,
}

impl GlobalOptions {
    /// Whether existing files may be replaced where they are kept by default: `--overwrite` or `--force`.
    const fn overwrites(self) -> bool {
        self.overwrite || self.force
    }

    /// Whether the limits of memory, time and disk are ignored: `--no-limits` or `--force`.
    const fn ignores_limits(self) -> bool {
        self.no_limits || self.force
    }
}

// Subcommands of `rodfit`: a doc comment here would replace the description in its help.
#[derive(Subcommand)]
enum Command {
    /// Simulate the motion of a rod.
    #[command(
        after_help = "Example: rodfit simulate data/cantilever.toml --out nodes.csv --report page"
    )]
    Simulate(simulate::SimulateOptions),
    /// Compute the equilibrium of a rod under its loads, and its stability.
    #[command(after_help = "Example: rodfit static data/cantilever.toml --out shape.csv")]
    Static(rest::StaticOptions),
    /// Compute the lowest natural frequencies and mode shapes.
    #[command(after_help = "Example: rodfit modes data/cantilever.toml --count 4")]
    Modes(modes::ModesOptions),
    /// Measure time and error over schemes, time steps and meshes.
    #[command(after_help = "Example: rodfit study data/cantilever.toml --report page")]
    Study(study::StudyOptions),
    /// List the parameters of a scene that can be identified, with their values and units.
    #[command(after_help = "Example: rodfit parameters data/cantilever.toml")]
    Parameters(parameters::ParametersOptions),
    /// Benchmark the shipped scenes on this machine: steps per second and seconds per fit, or errors against closed
    /// forms.
    #[command(after_help = "Example: rodfit bench --seconds 0.1")]
    Bench(bench::BenchOptions),
    /// Compare hand-derived derivatives with those of dual numbers and with finite differences.
    #[command(after_help = "Example: rodfit check data/cantilever.toml")]
    Check(check::CheckOptions),
    /// Identify parameters from recorded motion, shapes at rest and natural frequencies.
    #[command(
        after_help = "Example: rodfit fit data/cantilever-fit.toml --report page --known radius=5e-5"
    )]
    Fit(fit::FitOptions),
    /// Compare a scene with recordings, without a fit.
    #[command(
        after_help = "Example: rodfit predict data/cantilever.toml --on data/cantilever-tip.csv"
    )]
    Predict(predict::PredictOptions),
    /// Write a rod as a file for another simulator.
    #[command(
        after_help = "Example: rodfit export data/cantilever.toml --to mujoco --out cantilever.xml"
    )]
    Export(export::ExportOptions),
    /// Run many fits on one or several machines: plan, run, collect.
    #[command(subcommand)]
    #[command(after_help = "Example: rodfit campaign plan data/campaign.toml --out out")]
    Campaign(campaign::CampaignCommand),
    /// Compute the expected uncertainty of a planned experiment, and the best marker position, duration and frame rate.
    #[command(after_help = "Example: rodfit design data/cantilever-fit.toml --sigma 1e-3")]
    Design(design::DesignOptions),
    /// Summarize a marker file, and print the `[[observation]]` table for a fit file.
    #[command(after_help = "Example: rodfit inspect data/cantilever-tip.csv")]
    Inspect(inspect::InspectOptions),
    /// Write a scene, a fit and synthetic data as a template.
    #[command(after_help = "Example: rodfit init cantilever --out mine")]
    Init(init::InitOptions),
    /// Explain the code of a warning, a grade or an exit code; without an argument, list all codes.
    #[command(after_help = "Example: rodfit explain beyond-sigma")]
    Explain(explain::ExplainOptions),
    /// Print the JSON schema of an input file or of a result.
    #[command(after_help = "Example: rodfit schema scene")]
    Schema(schema::SchemaOptions),
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
struct JsonOption {
    /// Write the report to this file (JSON); `-` is standard output.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Derivatives of the energies in the time stepper.
#[derive(Clone, Copy, ValueEnum)]
enum DerivativesOption {
    /// Hand-derived formulas.
    Hand,
    /// Automatic differentiation with dual numbers.
    Dual,
}

impl From<DerivativesOption> for Derivatives {
    /// The library's kind of derivatives of the same name: hand-derived or by dual numbers.
    fn from(option: DerivativesOption) -> Self {
        match option {
            DerivativesOption::Hand => Self::Hand,
            DerivativesOption::Dual => Self::Dual,
        }
    }
}

/// Runs a command line, whose first argument is the name of the program. Errors are printed on standard error. Returns
/// the exit code: 0 done (also help and version); 2 bad input; 3 not computed, not converged or not identifiable.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    // The arguments are parsed twice if they are invalid, so they are kept.
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let parsed = Arguments::try_parse_from(&arguments).map_err(|error| {
        // The message quotes arguments, which may be names of files with control characters: these are escaped.
        let shown = arguments.iter().map(|a| printable_name(&a.to_string_lossy()).into_owned());
        Arguments::try_parse_from(shown).err().unwrap_or(error)
    });
    let Arguments { global, command } = match parsed {
        Ok(arguments) => arguments,
        Err(message) => {
            // Help and version come here too. A failure to print them cannot be reported.
            let _ = message.print();
            return u8::try_from(message.exit_code()).unwrap_or(2);
        }
    };
    // Before any thread pool exists.
    limits::limit_threads(global);
    // Each subcommand returns its exit code, or the error that ended it.
    let outcome = match command {
        Command::Simulate(options) => simulate::run(&options, global),
        Command::Static(options) => rest::run(&options, global),
        Command::Modes(options) => modes::run(&options, global),
        Command::Study(options) => study::run(&options, global),
        Command::Parameters(options) => parameters::run(&options, global),
        Command::Bench(options) => bench::run(&options, global),
        Command::Check(options) => check::run(&options, global),
        Command::Fit(options) => fit::run(&options, global),
        Command::Predict(options) => predict::run(&options, global),
        Command::Export(options) => export::run(&options, global),
        Command::Campaign(command) => campaign::run(&command, global),
        Command::Design(options) => design::run(&options, global),
        Command::Inspect(options) => inspect::run(&options, global),
        Command::Init(options) => init::run(&options, global),
        Command::Explain(options) => explain::run(&options),
        Command::Schema(options) => schema::run(&options),
        Command::Man { command } => man(command.as_deref()),
        Command::Completions { shell } => completions(shell),
    };
    outcome.unwrap_or_else(|error| {
        terminal::print_error(&error);
        exit_code(&error)
    })
}

/// Prints the completion script of a shell. Returns exit code 0. Error: standard output cannot be written.
fn completions(shell: Shell) -> Result<u8, Error> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "rodfit", &mut script);
    terminal::print(&String::from_utf8_lossy(&script).trim_end()).map(|()| 0)
}

/// Prints the manual page (roff) of the subcommand, or of the whole command if `None`. Returns exit code 0. An unknown
/// subcommand is an error with all names.
fn man(subcommand: Option<&str>) -> Result<u8, Error> {
    let mut command = Arguments::command();
    // Options of all commands are added to the subcommands.
    command.build();
    let found = match subcommand {
        None => Some(&command),
        Some(name) => command.find_subcommand(name),
    };
    let found = found.ok_or_else(|| {
        let names: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
        Error::invalid("man", subcommand.unwrap_or_default(), names.join(", "))
    })?;
    let mut page = Vec::new();
    let manual = clap_mangen::Man::new(found.clone());
    manual.render(&mut page).map_err(terminal::stdout_error)?;
    terminal::print(&String::from_utf8_lossy(&page).trim_end()).map(|()| 0)
}

/// The exit code of a command that ended with an error: 2 for invalid input (`Error::is_input`), 3 for a failed
/// computation.
fn exit_code(error: &Error) -> u8 {
    if error.is_input() { 2 } else { 3 }
}

/// The mesh that the program chose for an equilibrium or modes, with its estimated error, without step and scheme;
/// `None` for a scene with its own mesh.
fn chosen_mesh(problem: &Problem) -> Option<Resolution> {
    let chosen = Chosen { segments: true, ..Chosen::default() };
    let found = problem.resolution().filter(|found| found.chosen.segments)?;
    // A problem at rest has no step and no scheme.
    Some(Resolution { step: None, scheme: None, chosen, ..*found })
}

/// Prints the errors in `written`, the outcomes of the outputs, and returns the largest of their exit codes and `code`.
fn conclude(code: u8, written: impl IntoIterator<Item = Result<(), Error>>) -> u8 {
    // Every output that failed is reported; the worst code counts.
    written.into_iter().filter_map(Result::err).fold(code, |code, error| {
        terminal::print_error(&error);
        code.max(exit_code(&error))
    })
}
