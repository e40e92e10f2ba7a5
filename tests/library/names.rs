//! Names of types and modules: one name, one type, and modules named after topics of the field.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Type names that occur more than once, each with the reason. The number of types with a repeated name is at most 20.
const REPEATED_TYPES: &[(&str, &str)] = &[
    ("About", "planar and spatial, or several modules: campaign/plan.rs, campaign/store.rs"),
    ("Advice", "planar and spatial, or several modules: fit/design/report.rs, study.rs"),
    (
        "Along",
        "planar and spatial, or several modules: dynamics/sensitivity/mod.rs, rod/planar/sweep.rs, rod/spatial/sweep.rs, scene/along.rs",
    ),
    (
        "At",
        "planar and spatial, or several modules: numerics/simd.rs, rod/layout.rs, rod/planar/sweep.rs, rod/spatial/sweep.rs, scene/own.rs",
    ),
    ("Below", "planar and spatial, or several modules: rod/edges.rs, rod/planar/edges.rs"),
    (
        "Bent",
        "planar and spatial, or several modules: energy/planar_bend.rs, rod/spatial/geometry.rs",
    ),
    (
        "Block",
        "planar and spatial, or several modules: energy/own.rs, fit/design/candidate_designs.rs, summary/mod.rs",
    ),
    (
        "Bootstrap",
        "planar and spatial, or several modules: campaign/form.rs, fit/uncertainty/resampling/bootstrap.rs",
    ),
    ("ByEdge", "planar and spatial, or several modules: energy/joint.rs, rod/planar/edges.rs"),
    ("Chart", "planar and spatial, or several modules: energy/adapter.rs, page/chart.rs"),
    (
        "Columns",
        "planar and spatial, or several modules: numerics/banded/elimination.rs, rod/edges.rs, rod/planar/edges.rs",
    ),
    ("Edge", "planar and spatial, or several modules: energy/joint.rs, rod/planar/geometry.rs"),
    (
        "Elements",
        "planar and spatial, or several modules: rod/layout.rs, rod/planar/sweep.rs, rod/spatial/sweep.rs",
    ),
    ("Energy", "planar and spatial, or several modules: energy/adapter.rs, energy/mod.rs"),
    (
        "Estimate",
        "planar and spatial, or several modules: command/limits.rs, fit/uncertainty/estimate.rs",
    ),
    ("Field", "planar and spatial, or several modules: fit/field/space.rs, fit/search/starts.rs"),
    (
        "Forces",
        "planar and spatial, or several modules: rod/planar/sweep.rs, rod/spatial/forces.rs",
    ),
    ("Form", "planar and spatial, or several modules: campaign/form.rs, fit/file.rs"),
    (
        "Geometry",
        "planar and spatial, or several modules: rod/planar/geometry.rs, rod/spatial/geometry.rs",
    ),
    ("Grid", "planar and spatial, or several modules: fit/search/grid.rs, page/player.rs"),
    (
        "Group",
        "planar and spatial, or several modules: dynamics/sensitivity/mod.rs, fit/design/contributions.rs, fit/validation_errors/compute.rs",
    ),
    (
        "Kind",
        "planar and spatial, or several modules: dynamics/sensitivity/mod.rs, fit/design/candidate_designs.rs",
    ),
    ("Led", "planar and spatial, or several modules: dynamics/run.rs, fit/observation_form.rs"),
    (
        "List",
        "planar and spatial, or several modules: dynamics/adjoint/lists.rs, fit/field/space.rs",
    ),
    ("Local", "planar and spatial, or several modules: energy/adapter.rs, energy/mod.rs"),
    ("Markers", "planar and spatial, or several modules: dynamics/run.rs, fit/observation_form.rs"),
    ("Measured", "planar and spatial, or several modules: fit/report/plot_data.rs, rod/sweeps.rs"),
    (
        "Motion",
        "planar and spatial, or several modules: dynamics/record.rs, scene/prescribed_motion.rs",
    ),
    (
        "Motions",
        "planar and spatial, or several modules: dynamics/record.rs, dynamics/trajectory.rs",
    ),
    (
        "Moved",
        "planar and spatial, or several modules: dynamics/adjoint/supports.rs, rod/spatial/moving.rs",
    ),
    (
        "Moving",
        "planar and spatial, or several modules: fit/measurement/quantity.rs, rod/spatial/moving.rs",
    ),
    (
        "Numbers",
        "planar and spatial, or several modules: dynamics/adjoint/numbers.rs, dynamics/sensitivity/viscous.rs",
    ),
    ("Of", "planar and spatial, or several modules: command/schema.rs, dynamics/adjoint/start.rs"),
    (
        "Options",
        "planar and spatial, or several modules: command/bench.rs, command/check.rs, command/design.rs, command/explain.rs, command/fit.rs, command/init/mod.rs, command/inspect.rs, command/modes.rs, command/parameters.rs, command/predict.rs, command/rest.rs, command/schema.rs, command/simulate.rs, command/study.rs",
    ),
    (
        "Pairs",
        "planar and spatial, or several modules: rod/planar/sweep.rs, rod/spatial/moving.rs, rod/spatial/sweep.rs",
    ),
    (
        "Part",
        "planar and spatial, or several modules: campaign/fit_pattern.rs, command/campaign.rs",
    ),
    ("Plan", "planar and spatial, or several modules: campaign/plan.rs, fit/design/plan.rs"),
    ("Plane", "planar and spatial, or several modules: rod/layout.rs, scene/plane.rs"),
    ("Pull", "planar and spatial, or several modules: energy/adapter.rs, energy/joint.rs"),
    (
        "Quantity",
        "planar and spatial, or several modules: fit/measurement/quantity.rs, scene/number.rs",
    ),
    (
        "Record",
        "planar and spatial, or several modules: campaign/store.rs, dynamics/record.rs, fit/duplicates.rs",
    ),
    (
        "Recorded",
        "planar and spatial, or several modules: command/simulate.rs, dynamics/record.rs, scene/path.rs",
    ),
    ("Report", "planar and spatial, or several modules: campaign/sheet.rs, command/bench.rs"),
    (
        "Room",
        "planar and spatial, or several modules: dynamics/adjoint/backward.rs, dynamics/adjoint/course.rs, rod/blocks.rs",
    ),
    (
        "Rosenbrock",
        "planar and spatial, or several modules: dynamics/stepper/rosenbrock.rs, numerics/levenberg_marquardt/tests.rs",
    ),
    (
        "Row",
        "planar and spatial, or several modules: campaign/row.rs, campaign/sheet.rs, page/table.rs, study.rs",
    ),
    (
        "Run",
        "planar and spatial, or several modules: command/fit.rs, fit/misfit/observed_experiment.rs, study.rs",
    ),
    ("Running", "planar and spatial, or several modules: dynamics/follower.rs, dynamics/run.rs"),
    ("Said", "planar and spatial, or several modules: campaign/sheet.rs, command/inspect.rs"),
    (
        "Sample",
        "planar and spatial, or several modules: dynamics/film.rs, fit/measurement/motion.rs",
    ),
    ("Search", "planar and spatial, or several modules: fit/field/search.rs, fit/search/mod.rs"),
    ("Section", "planar and spatial, or several modules: scene/section.rs, summary/mod.rs"),
    ("Seen", "planar and spatial, or several modules: command/init/made_up.rs, dynamics/run.rs"),
    (
        "Series",
        "planar and spatial, or several modules: fit/misfit/observed_experiment.rs, fit/report/plot_data.rs",
    ),
    (
        "Simulated",
        "planar and spatial, or several modules: dynamics/run.rs, fit/measurement/simulated.rs",
    ),
    ("Slopes", "planar and spatial, or several modules: dynamics/adjoint/mod.rs, energy/own.rs"),
    ("Space", "planar and spatial, or several modules: fit/field/space.rs, rod/layout.rs"),
    (
        "Stage",
        "planar and spatial, or several modules: dynamics/coefficients.rs, fit/search/journal.rs",
    ),
    ("State", "planar and spatial, or several modules: rod/state.rs, vibration/modes.rs"),
    ("Step", "planar and spatial, or several modules: dynamics/step.rs, statics/descent.rs"),
    (
        "Stiffness",
        "planar and spatial, or several modules: energy/stiffness.rs, statics/stability.rs",
    ),
    (
        "Straight",
        "planar and spatial, or several modules: rod/planar/geometry.rs, rod/spatial/geometry.rs",
    ),
    ("Sum", "planar and spatial, or several modules: energy/joint.rs, numerics/banded/ldlt.rs"),
    ("Tangent", "planar and spatial, or several modules: energy/joint.rs, numerics/tangent.rs"),
    (
        "Task",
        "planar and spatial, or several modules: campaign/plan.rs, dynamics/run.rs, fit/search/mod.rs",
    ),
    ("ToEdges", "planar and spatial, or several modules: rod/edges.rs, rod/planar/edges.rs"),
    ("ToNodes", "planar and spatial, or several modules: rod/edges.rs, rod/planar/edges.rs"),
    ("Tone", "planar and spatial, or several modules: page/card.rs, summary/mod.rs"),
    (
        "Trial",
        "planar and spatial, or several modules: fit/field/search.rs, numerics/levenberg_marquardt.rs",
    ),
    ("Work", "planar and spatial, or several modules: dynamics/step.rs, fit/misfit/work.rs"),
];

/// Names of all files and folders in `src`, without `mod.rs`, `lib.rs` and `main.rs`. A new module is named after its
/// topic, with a noun of the field, and added here.
const MODULES: &str = "
acceleration accuracy adapter adequacy adjoint adjoint_gradient again aim along analysis ar1 arrays assessment
attach autocorrelation averaging axes backward banded basis bench bend_twist bias blocks bootstrap boundary
budget by_unknowns camera campaign candidate_designs card changes chart check cluster_jackknife coarse code
coefficients collect combinations combined command comparison compute constant_axes contributions convergence
coordinate_series correlation course covariance coverage_factor csv curved_joints damping data data_precheck
dataset dead_load dead_moment descent design determined_groups difference discrepancy discrete discretization
displacement_driven display drag dragging drawing duplicates dynamics edge_coordinates edges effects
elimination energy energy_balance entries equilibrium error errors estimate estimate_table experiment explain
extend extra extrapolation fault faults field figure file film findings finite_difference fit fit_pattern
fit_statistics fit_summary fitted follower foot_point forces form former_results frame free_run frequencies
frequencies_form friction gauge gauss_newton geometry grade grid guess hash hermite hessian hints html
identifiability implicit init initial initial_sigmas input input_changes input_directions input_errors
input_sensitivities inspect inspection inspection_summary joint joint_law journal known lanczos lanes
largest_step layout ldlt levenberg_marquardt limit limits linearization linearized lists loads local_analysis
local_minima loss lowest made made_up marker mass material measurement measures mesh minimum
minimum_comparison misfit missing_keys mode_numbers model model_with_setup modes moments motion motion_rate
moving name natural_turn nearest neighbors newton noise noise_scale number numbers numerics observation_form
observation_row observed_experiment observed_information omitted_effects one_sided_bound onset optimum
out_of_line outcome outlying_experiments output own page parameter parameter_form parameters part_file path
pencil perturbation phi_function place plan planar planar_bend planarity plane platform plausibility player
plot_data plotted point points polyline predict prediction prescribed_dofs prescribed_motion prior problem
profile profile_likelihood quantity quoted random_states ranking rates reaction record recorded_motion
recorded_point recorded_start recordings refined_residuals refinement remesh renamed_keys repeated_frames
replay report required resampling residual_acceptance residual_noise residual_tests residuals resolution
resolved rest rest_line rod rod_sizes rodas4 rosenbrock rounding row run samples scalar scaled scan scene
scene_notes schema scheme scheme_support score_tests search section section_profile sensitive sensitivity
sensitivity_growth settings setup shape shape_form shapes shard shear_deflection sheet simd simulate simulated
simulation slenderness sliding soft_clamp space spatial spectrum splitting stability standing start starts
state static_mesh statics status step step_control stepper stiffness store strain stretch study style
summaries summary support supports sweep sweeps table tangent taper tensions term_bound terminal
tested_effects tests text_cell thickness tie time tolerance track trajectory transposed trial tributary
trigonometry tuning uncertainty undetected_bias unknown unstable_state usable_rows validate validation
validation_errors vector vibration viscosity viscous warning_list warnings weighted_search work zero_bound
";

/// All Rust files below a folder.
fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}

/// Names of the types that a line declares at the top level of a file, or within the macro `table!`.
fn declared_type(line: &str) -> Option<&str> {
    let declaration =
        line.strip_prefix("    pub ").or(Some(line)).filter(|l| !l.starts_with(' '))?;
    let public = declaration.strip_prefix("pub").and_then(|rest| rest.split_once(' '));
    let declaration = public.map_or(declaration, |(_, rest)| rest);
    let keywords = ["struct ", "enum ", "trait ", "type ", "union "];
    let name = keywords.iter().find_map(|keyword| declaration.strip_prefix(keyword))?;
    let end = name.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(name.len());
    Some(&name[..end]).filter(|name| name.starts_with(char::is_uppercase))
}

#[test]
fn type_names_are_unique_except_for_listed_ones() {
    let mut types: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for path in rust_files(Path::new("src")) {
        let text = std::fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod ").next().unwrap();
        for name in code.lines().filter_map(declared_type) {
            types.entry(name.into()).or_default().push(path.display().to_string());
        }
    }
    assert!(types.len() > 500, "only {} types are found", types.len());
    types.retain(|_, files| files.len() > 1);
    let listed: BTreeSet<&str> = REPEATED_TYPES.iter().map(|(name, _)| *name).collect();
    let unlisted: Vec<_> =
        types.iter().filter(|(name, _)| !listed.contains(name.as_str())).collect();
    assert!(unlisted.is_empty(), "type names that are used more than once: {unlisted:#?}");
    let unique: Vec<_> = listed.iter().filter(|name| !types.contains_key(**name)).collect();
    assert!(unique.is_empty(), "listed as repeated, but unique by now: {unique:?}");
    println!(
        "{} names of {} types are repeated",
        types.len(),
        types.values().map(Vec::len).sum::<usize>()
    );
}

#[test]
fn module_names_are_listed() {
    let mut found = BTreeSet::new();
    for path in rust_files(Path::new("src")) {
        let parts = path.strip_prefix("src").unwrap().components();
        found.extend(parts.map(|part| part.as_os_str().to_str().unwrap().replace(".rs", "")));
    }
    found.retain(|name| !["mod", "lib", "main"].contains(&name.as_str()));
    let listed: BTreeSet<String> = MODULES.split_whitespace().map(Into::into).collect();
    let [new, gone]: [Vec<_>; 2] =
        [found.difference(&listed).collect(), listed.difference(&found).collect()];
    assert!(new.is_empty() && gone.is_empty(), "new modules: {new:?}, removed ones: {gone:?}");
}
