//! `rodfit fit`

use crate::command::campaign::COMPARISON;
use crate::command::extend::extended;
use crate::command::output::{Output, Outputs};
use crate::command::predict::{Places, predicted};
use crate::command::{Json, Manner, Route, code_of, conclude, limits, terminal};
use rodfit::fit::{Experiment, FieldFit, FitFile, FitReport, FitSummary, Known};
use rodfit::summary::{Summary, SummaryTable, TextColumn, Tone};
use rodfit::{Code, Error, Parameter, Problem, Unknown, page};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The first line of a scene with values of a fit that was stopped.
const INTERRUPTED: &str =
    "# interrupted: the best values when the fit was stopped, not its result\n";

#[derive(clap::Args)]
pub struct Options {
    /// Fit files (TOML); several are fitted in order, and each output file gets the name of its fit.
    #[arg(required = true)]
    fit: Vec<PathBuf>,
    #[command(flatten)]
    json: Json,
    /// Write the scene with the fitted values to this file (TOML), `-` is standard output. Experiments that differ in
    /// their recordings only share one file.
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
    /// Write a page with data, model and warnings (`fit.html`) and its data (`fit.json`) into this folder; for several
    /// fits also a page that compares them (`comparison.html`).
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Standard uncertainty of an input in its unit, as radius=5e-5; repeatable.
    #[arg(long, value_name = "NAME=SIGMA")]
    known: Vec<String>,
    /// Verify the uncertainty budget by N fits with random inputs and noise.
    #[arg(long, value_name = "N")]
    monte_carlo: Option<usize>,
    /// Refit with the omitted effects that best explain the residuals, and keep the best fit.
    #[arg(long)]
    extend: bool,
    /// Derivatives of the energies in the time stepper.
    #[arg(long, value_enum, default_value = "hand")]
    derivatives: Route,
}

pub fn run(options: &Options, manner: Manner) -> Result<u8, Error> {
    // All are looked at before any is solved.
    let mut runs: Vec<Run> = Vec::new();
    for (path, name) in options.fit.iter().zip(names(&options.fit)?) {
        runs.push(Run::new(path, name.as_deref(), options, manner)?);
    }
    let inputs: Vec<PathBuf> = runs.iter().flat_map(Run::inputs).collect();
    for (i, run) in runs.iter().enumerate() {
        run.outputs.check(&inputs)?;
        runs[..i].iter().try_for_each(|before| run.outputs.check_beside(&before.outputs))?;
        limits::of_fit(&run.file, run.path.clone()).admit(manner)?;
    }
    let stop = terminal::stop_on_ctrl_c(manner);
    let several = runs.len() > 1;
    let has_overview = several && runs.iter().all(|run| run.outputs.has_summary());
    let mut comparison = Outputs::new(manner);
    let folder = options.report.as_deref().filter(|_| several);
    let page = comparison.add_in_folder("--report", folder, COMPARISON);
    comparison.check(&inputs)?;
    runs.iter().try_for_each(|run| comparison.check_beside(&run.outputs))?;
    let mut summaries = Vec::new();
    let mut code = 0;
    let mut table = Vec::new();
    for (k, run) in runs.into_iter().enumerate() {
        let path = run.path.display().to_string();
        let name = run.name.clone().unwrap_or_default();
        if stop.load(Ordering::Relaxed) {
            table.push((path, "not begun".into()));
            continue;
        }
        if has_overview && k > 0 {
            terminal::print(&"")?;
        }
        match run.solve(stop.clone()) {
            Ok(Solved { code: own, line, summary }) => {
                code = code.max(own);
                let address = format!("{name}/fit.html");
                summaries.extend(summary.map(|fit| fit.named(&name).with_page(address)));
                table.push((path, line));
            }
            Err(error) if several => {
                terminal::complain(&error);
                summaries.push(FitSummary::without_result(&name, error.to_string()));
                code = code.max(code_of(&error));
                table.push((path, error.code().map_or("no result", Code::name).into()));
            }
            Err(error) => return Err(error),
        }
    }
    if has_overview {
        terminal::print(&"")?;
        terminal::print_summary(&overview(table))?;
    }
    let title = format!("{} fits", summaries.len());
    let written =
        comparison.write(page, || Ok(page::comparison_page(&summaries, &title).into_bytes()));
    Ok(conclude(code, [written]))
}

/// The grades and estimates of several fits, with the files of the fits.
fn overview(results: Vec<(String, String)>) -> Summary {
    let columns =
        [TextColumn::left("fit"), TextColumn::left("grade"), TextColumn::wrapped("estimates")];
    let status = format!("{} fits", results.len());
    let mut table = SummaryTable::new(columns);
    for (path, line) in results {
        let (grade, estimates) = line.split_once("  ").unwrap_or((&line, ""));
        table.row([&path, grade, estimates.trim()]);
    }
    Summary::new(status, Tone::Neutral).table("", table)
}

/// What is added to the names of what several fits write: the names of their files, with as many of their folders as
/// tell them apart; nothing for one alone.
fn names(fits: &[PathBuf]) -> Result<Vec<Option<String>>, Error> {
    if fits.len() < 2 {
        return Ok(vec![None; fits.len()]);
    }
    let parts: Vec<Vec<String>> = fits.iter().map(|fit| parts_of(fit)).collect();
    let name = |i: usize, depth: usize| {
        let of: Vec<&str> = parts[i].iter().take(depth).rev().map(|part| &part[..]).collect();
        of.join("-")
    };
    (0..fits.len())
        .map(|i| {
            let most = parts[i].len();
            let alone = |depth: &usize| {
                (0..fits.len()).all(|j| j == i || name(j, *depth) != name(i, *depth))
            };
            let depth = (1..=most).find(alone).ok_or_else(|| Error::Invalid {
                file: None,
                key: "fit".into(),
                found: format!("{} twice", fits[i].display()),
                allowed: "each fit file once".into(),
            })?;
            Ok(Some(name(i, depth)))
        })
        .collect()
}

/// A fit file's name without its extension, and those of its folders from the last on.
fn parts_of(fit: &Path) -> Vec<String> {
    let whole = std::path::absolute(fit).unwrap_or_else(|_| fit.into());
    let stem = whole.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folders = whole.parent().into_iter().flat_map(Path::components).rev();
    let folders = folders.filter_map(|part| match part {
        Component::Normal(name) => Some(name.to_string_lossy().into_owned()),
        _ => None,
    });
    std::iter::once(stem).chain(folders).collect()
}

/// The end of a run: its exit code, the result in a line, and its summary for a comparison.
struct Solved {
    code: u8,
    line: String,
    summary: Option<FitSummary>,
}

/// A fit, and where its results go.
struct Run {
    path: PathBuf,
    /// Name of the fit among several.
    name: Option<String>,
    file: FitFile,
    manner: Manner,
    outputs: Outputs,
    json: Option<Output>,
    page: Option<Output>,
    numbers: Option<Output>,
    saves: Vec<Save>,
    /// Whether to fit again with what explains best what is left.
    extend: bool,
}

impl Run {
    /// Reads a fit file; `name` is added to what is written, if it is one of several.
    fn new(
        path: &Path,
        name: Option<&str>,
        options: &Options,
        manner: Manner,
    ) -> Result<Self, Error> {
        let admit = |scene: &_| limits::of_mesh(scene).admit(manner);
        let mut file = FitFile::load_if(path, admit)?;
        for known in &options.known {
            file.knowns.push(self::known(known)?);
        }
        file.analysis.monte_carlo = options.monte_carlo.unwrap_or(file.analysis.monte_carlo);
        for experiment in &mut file.experiments {
            experiment.problem =
                experiment.problem.clone().with_derivatives(options.derivatives.into());
        }
        let of = |asked: &Option<PathBuf>, option: &str| -> Result<Option<PathBuf>, Error> {
            match (asked, name) {
                (Some(path), Some(name)) if path == Path::new("-") => Err(Error::Invalid {
                    file: None,
                    key: option.into(),
                    found: format!("- with several fits, such as {name}"),
                    allowed: "a file; the names of the fits are appended to its name".into(),
                }),
                (Some(path), Some(name)) => {
                    let extension = path.extension().unwrap_or_default().to_string_lossy();
                    Ok(Some(path_of(
                        path,
                        name,
                        if option == "--save" { "toml" } else { &extension },
                    )))
                }
                (asked, _) => Ok(asked.clone()),
            }
        };
        let mut outputs = Outputs::new(manner);
        let json = of(&options.json.json, "--json")?;
        let json = outputs.add("--json", json.as_deref());
        let folder =
            options.report.as_ref().map(|folder| name.map_or(folder.clone(), |n| folder.join(n)));
        let page = outputs.add_in_folder("--report", folder.as_deref(), "fit.html");
        let numbers = outputs.add_in_folder("--report", folder.as_deref(), "fit.json");
        let saves: Vec<Save> = match of(&options.save, "--save")? {
            Some(path) => saves(&path, &file, &mut outputs)?,
            None => Vec::new(),
        };
        let (path, extend) = (path.into(), options.extend);
        let name = name.map(String::from);
        Ok(Self { path, name, file, manner, outputs, json, page, numbers, saves, extend })
    }

    /// The files that it reads.
    fn inputs(&self) -> Vec<PathBuf> {
        let mut inputs = self.file.files();
        inputs.push(self.path.clone());
        inputs
    }

    /// Computes the result and writes it.
    fn solve(self, stop: Arc<AtomicBool>) -> Result<Solved, Error> {
        if self.file.is_validation_only() {
            return self.predict(stop);
        }
        if let Some(fit) = self.file.field_fit()? {
            return self.solve_along(fit.stop_when(stop));
        }
        let Self {
            path, mut file, manner, mut outputs, json, page, numbers, saves, extend, ..
        } = self;
        let mut report = solve(&file, page.is_some(), stop.clone(), manner)?;
        if extend && !report.interrupted {
            let plots = page.is_some();
            let solve = |file: &FitFile| solve(file, plots, stop.clone(), manner);
            (file, report) = extended(file, report, solve)?;
        }
        if report.interrupted {
            outputs.are_interrupted();
        }
        let title = path.display().to_string();
        let mut written = vec![
            outputs.write_json(json, &report),
            outputs.write(page, || Ok(page::fit_page(&report, &title).into_bytes())),
            outputs.write_json(numbers, &report),
        ];
        for Save { experiment, output } in saves {
            written.push(outputs.write(output, || saved(&report, &file.experiments[experiment])));
        }
        written.push(outputs.summary(&report.summary().of(&title)));
        let code = if report.is_success() { 0 } else { 3 };
        if code != 0 {
            terminal::tell(format_args!("error: {} [{}]", report.status, report.grade.code()));
        }
        let summary = Some(FitSummary::new("", &report));
        Ok(Solved { code: conclude(code, written), line: report.in_a_line(), summary })
    }

    /// Compares the scenes with measurements that are all validation data.
    fn predict(self, stop: Arc<AtomicBool>) -> Result<Solved, Error> {
        let Self { path, file, outputs, json, page, numbers, saves, extend, .. } = self;
        let of_fits = [
            ("--extend", extend),
            ("--save", !saves.is_empty()),
            ("--known", !file.knowns.is_empty()),
        ];
        if let Some((option, _)) = of_fits.into_iter().find(|(_, is_given)| *is_given) {
            return Err(Error::Invalid {
                file: None,
                key: option.into(),
                found: "with validation data only, to which nothing is fitted".into(),
                allowed: "--json and --report with predictions".into(),
            });
        }
        let report = predicted(&file, page.is_some(), stop)?;
        let line = report.in_a_line();
        let places = Places { json, page, numbers };
        let code = places.write(&report, &outputs, &path.display().to_string())?;
        Ok(Solved { code, line, summary: None })
    }

    /// Solves a fit of numbers along the rod.
    fn solve_along(self, fit: FieldFit) -> Result<Solved, Error> {
        let Self { path, file, outputs, json, page, numbers, saves, extend, .. } = self;
        if extend {
            return Err(Error::Invalid {
                file: None,
                key: "--extend".into(),
                found: "with [[field]]".into(),
                allowed:
                    "--json, --report and --save with fits of distributed parameters ([[field]])"
                        .into(),
            });
        }
        let report = fit.solve()?;
        let title = path.display().to_string();
        let mut written = vec![
            outputs.write_json(json, &report),
            outputs.write(page, || Ok(page::field_page(&report, &title).into_bytes())),
            outputs.write_json(numbers, &report),
        ];
        for Save { experiment, output } in saves {
            written.push(outputs.write(output, || {
                let problem = &file.experiments[experiment].problem;
                scene_with(problem, report.values(problem.scene())?)
            }));
        }
        written.push(outputs.summary(&report.summary().of(&title)));
        let (code, line) = match report.converged {
            true => (0, "converged, distributed parameters".to_string()),
            false => (3, Code::NotUsable.to_string()),
        };
        if code != 0 {
            terminal::tell(format_args!("error: no minimum was reached [{}]", Code::NotUsable));
        }
        Ok(Solved { code: conclude(code, written), line, summary: None })
    }
}

/// A number with its standard uncertainty, `NAME=SIGMA`.
pub fn known(text: &str) -> Result<Known, Error> {
    let refused = || Error::Invalid {
        file: None,
        key: "--known".into(),
        found: text.into(),
        allowed: "NAME=SIGMA, as in rod.section.radius=5e-5".into(),
    };
    let (name, sigma) = text.split_once('=').ok_or_else(refused)?;
    let sigma = sigma.trim().parse().map_err(|_| refused())?;
    Ok(Known::new(name.trim().parse()?, sigma))
}

fn solve(
    file: &FitFile,
    plots: bool,
    stop: Arc<AtomicBool>,
    manner: Manner,
) -> Result<FitReport, Error> {
    let bar = terminal::spinner(manner);
    let shown = bar.clone();
    let mut fit = file.fit().stop_when(stop);
    if plots {
        fit = fit.keep_plot_data();
    }
    let report = fit
        .on_progress(move |stage, simulations| {
            shown.set_message(format!("{stage} ({simulations:.1} simulations)"));
            shown.tick();
        })
        .solve();
    bar.finish_and_clear();
    report
}

/// The scene of an experiment with the fitted values.
fn saved(report: &FitReport, experiment: &Experiment) -> Result<Vec<u8>, Error> {
    let mut saved = scene_with(&experiment.problem, report.parameters_of(experiment))?;
    if report.interrupted {
        saved.splice(..0, INTERRUPTED.bytes());
    }
    Ok(saved)
}

/// The scene of a problem with other values.
fn scene_with(problem: &Problem, values: Vec<(Parameter, f64)>) -> Result<Vec<u8>, Error> {
    let mut scene = problem.with(values)?.scene().reopened();
    scene.make_paths_absolute()?;
    Ok(scene.to_toml()?.into_bytes())
}

/// A fitted scene to write.
struct Save {
    /// Index of the experiment whose scene it is: the first of those that differ in their recordings only.
    experiment: usize,
    output: Option<Output>,
}

/// Files of the fitted scenes. Experiments that differ in their recordings only share one.
fn saves(path: &Path, file: &FitFile, outputs: &mut Outputs) -> Result<Vec<Save>, Error> {
    let groups = groups(file);
    if let [_, second, ..] = &groups[..]
        && path == Path::new("-")
    {
        let second = &file.experiments[second[0]].name;
        return Err(Error::Invalid {
            file: None,
            key: "--save".into(),
            found: format!("- with {} experiments, such as {second}", groups.len()),
            allowed: "a file; the names of the experiments are appended to its name".into(),
        });
    }
    let add = |own: &Vec<usize>| {
        let name = match (own.len(), groups.len()) {
            (2.., 1) => String::new(),
            (1, _) => file.experiments[own[0]].name.clone(),
            _ => group_name(file, own, &groups),
        };
        let output = match name.is_empty() {
            true => outputs.add("--save", Some(path)),
            false => {
                let option = format!("--save of experiment {name:?}");
                outputs.add(&option, Some(&path_of(path, &name, "toml")))
            }
        };
        Save { experiment: own[0], output }
    };
    Ok(groups.iter().map(add).collect())
}

/// Indices of the experiments that get one fitted scene each: same scene, same parameters, other recordings.
fn groups(file: &FitFile) -> Vec<Vec<usize>> {
    let all = &file.experiments;
    let share = |i: usize, j: usize| {
        let is_of = |u: &Unknown, k: usize| {
            u.experiments.is_empty() || u.experiments.contains(&all[k].name)
        };
        let parameters = file.unknowns.iter().all(|u| is_of(u, i) == is_of(u, j));
        let [a, b] = [i, j].map(|k| all[k].problem.scene());
        parameters && a.differs_in_recording_only(b)
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for i in 0..all.len() {
        match groups.iter_mut().find(|own| share(own[0], i)) {
            Some(own) => own.push(i),
            None => groups.push(vec![i]),
        }
    }
    groups
}

/// The name of the scene file of a group, or of its first experiment where another group has the same scene file.
fn group_name(file: &FitFile, own: &[usize], groups: &[Vec<usize>]) -> String {
    let stem = |group: &[usize]| {
        let path = file.experiments[group[0]].problem.scene().path.clone()?;
        Some(path.file_stem()?.to_string_lossy().into_owned())
    };
    let same = groups.iter().filter(|group| stem(group) == stem(own)).count();
    let first = file.experiments[own[0]].name.clone();
    stem(own).filter(|_| same == 1).unwrap_or(first)
}

/// Where what is of one of several experiments or fits is written: `fitted-NAME.toml`.
fn path_of(path: &Path, experiment: &str, extension: &str) -> PathBuf {
    // What file systems do not take.
    let plain = |c: char| if c.is_control() || r#"/\:*?"<>|"#.contains(c) { '_' } else { c };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name: String = experiment.chars().map(plain).collect();
    path.with_file_name(format!("{stem}-{name}.{extension}"))
}
