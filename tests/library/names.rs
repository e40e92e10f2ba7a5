//! Names of types and modules: one name, one type, and modules named after topics of the field.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Type names that occur more than once, each with the reason. The number of types with a repeated name is at most 20.
const REPEATED_TYPES: &[(&str, &str)] = &[
    (
        "At",
        "different topics, not renamed yet: rod/layout, rod/planar/sweep, rod/spatial/sweep, scene/own",
    ),
    ("ByEdge", "different topics, not renamed yet: energy/joint, rod/planar/edges"),
    (
        "Elements",
        "counterparts in the plane and in space: rod/layout, rod/planar/sweep, rod/spatial/sweep",
    ),
    (
        "Geometry",
        "counterparts in the plane and in space: rod/planar/geometry, rod/spatial/geometry",
    ),
    ("Motion", "different topics, not renamed yet: dynamics/record, scene/prescribed_motion"),
    ("Plane", "different topics, not renamed yet: rod/layout, scene/plane"),
];

/// Names of all files and folders in `src`, without `mod.rs`, `lib.rs` and `main.rs`. A new module is named after its
/// topic, with a noun of the field, and added here.
const MODULES: &str = "
acceleration accuracy actuation actuators adapter adequacy adjoint adjoint_gradient along analysis
anchor_spring ar1 arrays assembly assessment attach attachment autocorrelation autodiff averaging
axes banded basis bench bend_twist beside_walls bias bisection blocks blueprint bodies bootstrap
bordered boundary branch_relaxation break_points buckling buckling_form budget cable calculation
camera camera_needs campaign candidate_designs card
carried_velocities carrying cases changes chart check checkpoints
closed_forms cluster_jackknife coarse code coefficients collect columns combinations combined
command comparison compute constant_axes contact contact_loss contact_losses contacts contact_pairs contributions
convergence conversion coordinate_series correlation coupling
covariance coverage_factor critical_load csv
csv_table curved_joints damping data data_precheck dataset dead_load dead_moment definition dense_lu density
descent design determined_groups diagnostics dial_gauge_effects difference directions director_axes discrepancy
discrete discretization displacement_driven display drag drag_forces drawing draws duplicates
dynamics edge_contact edge_pair edge_coordinates edge_tie edges effects element elimination energy
energy_balance entries envelope envelope_lu equilibrium equilibrium_derivatives error errors
estimate estimate_table estimated_weights experiment experiment_effect experiment_estimates experiment_form explain
export extend extra extrapolation faults field figure file film find_equilibrium findings
finite_difference fit fit_name fit_pattern fit_run fit_statistics fit_summary fitted follower_load
follower_loads follower_modes foot_point force_rates forces form former_names former_results
forward_derivatives forward_sensitivity frame frame_products frames free_run frequencies
frequencies_form gauge gauss_newton generate geometry given_mesh grade gravity_effects grid gripper_frame gripper_pose hash
held_nodes hermite hessian hints history html hyperelastic hyperelastic_stretch identifiability
image image_file image_form image_name image_overlay image_placement inertia init initial
initial_sigmas input input_changes input_directions input_errors input_sensitivities inspect
inspection inspection_summary job_script joined_rods joint joint_law journal known lanczos
largest_step law layout ldlt levenberg_marquardt limit limits line_loads line_search linearization
linearized links lists load_cell_effects load_deflection load_deflection_form loads local_analysis local_minima loss
low_pass lowest_eigenvalues lu marker marker_place mass material maxwell mean_rotation mean_stretch measured_run
measurement measurement_tables measures member member_factors mesh mesh_comparison mesh_error
method_intervals method_table minimum
minimum_comparison misfit missing_keys mode mode_numbers model model_with_setup modes moments
momentum motion motion_rate moved_obstacles moving mujoco name natural_turn nearest neighbors
neutral_equilibrium newton nodal node_history noise noise_comparison noise_scale nonlinear nonlinear_bending number
numbers numerics observation_form observation_row observed_experiment observed_information
observed_nodes obstacle_motion obstacles omitted_effects one_sided_bound onset operators optimum
out_of_line outcome outlying_experiments output overlap overlay overlay_run own page pair_loss pair_losses parameter
parameter_form parameters part_file path pencil penetration per_axis perturbation phi_function place placeholder_frames
placement plan planar planar_bend planarity plane platform plausibility player plot_data plotted
point point_acceleration point_angle point_channel point_pose point_strain points polyline pose_form
pose_sensor pose_table posterior power_law predict prediction predictor prescribed_dofs
prescribed_motion prior problem products profile profile_likelihood published pyelastica quantity
quoted random_states ranking rate rates reaction reading record recorded recorded_ends
recorded_motion recorded_point recorded_pose recorded_reactions recorded_start recordings reduction
reference_stiffness reference_strains refined_residuals refinement relinearize remesh renamed_keys
repeat repeated_frames replay report required resampling residual_acceptance residual_noise
residual_tests residuals resolution resolved rest rest_line rod rod_contact rod_couplings rod_sizes rod_surfaces rodas4 rosenbrock
rotating_bodies rotation rotation_readings rotational_inertia rounding route_length row run sampled
sampler samples save scalar scaled scan scene scene_catalog scene_file scene_notes schema scheme
scheme_support score_tests search secant_stiffness section section_profile sensitivity
sensitivity_carrier sensitivity_growth sensitivity_pipeline sensor sensor_channel sensor_form sensor_gain_effects
sensor_model sensor_reference sensor_table settings setup shape shape_columns shape_form shard
shear shear_deflection signal signal_curve signal_samples signal_steps simd simulate simulated simulation
skew_part slenderness slip slip_state snapshots soft_clamp space spatial spatial_bodies spatial_inertia
spatial_motion spectrum splitting spring_rotation stability standardization standing start
start_forces starts state static_mesh statics status step step_control step_error step_map stepper stiffness
stopwatch store strain stretch structure structure_catalog structure_effects structure_experiment
structure_file structure_film structure_frequencies structure_mesh structure_motion structure_places
structure_point structure_problem structure_recording structure_report structure_run structure_shape
structure_support structure_warnings study style substitution summaries summary support supports
sweep sweeps swept_edge swept_pair synthetic_data table table_keys tangent taper target tendon tensions
term_bound terminal tested_effects tests text_cell thickness thickness_note time timed_forces timed_loads timing
timoshenko tolerance touching_edges track track_defect trajectory transposed trial tributary trigonometry tuning
uncertainty undetected_bias unknown unstable_state usable_rows usd validate validation
validation_errors vector vibration viscosity vtk warning_list warnings weighted_search work
workspace writer zero_bound";

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
    // A guard against a search that finds no types.
    assert!(types.len() > 500, "only {} types are found", types.len());
    types.retain(|_, files| files.len() > 1);
    let listed: BTreeSet<&str> = REPEATED_TYPES.iter().map(|(name, _)| *name).collect();
    let unlisted: Vec<_> =
        types.iter().filter(|(name, _)| !listed.contains(name.as_str())).collect();
    assert!(unlisted.is_empty(), "type names that are used more than once: {unlisted:#?}");
    let unique: Vec<_> = listed.iter().filter(|name| !types.contains_key(**name)).collect();
    assert!(unique.is_empty(), "listed as repeated, but unique: {unique:?}");
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
