//! Simulates the shipped helix and prints the drop of its tip and its energies over time, the change of the total energy,
//! and the Newton iterations per step.
//!
//! `cargo run --release --example helix`

use rodfit::dynamics::SimulationReport;
use rodfit::{Scene, Trajectory};

fn main() -> Result<(), rodfit::Error> {
    let scene = Scene::load(concat!(env!("CARGO_MANIFEST_DIR"), "/data/helix.toml"))?;
    let problem = scene.problem()?;
    let (model, why) = problem.model();
    println!("{model} model, {} unknowns: {why}", problem.dof());

    let tip = problem.nodes() - 1;
    let steps = problem.time()?.steps();
    let mut report = SimulationReport::new(&problem);
    let mut run = Trajectory::new(&problem, &[tip], &[])?;
    run.run(&problem, steps, |now| report.push(&problem, now))?;
    println!(" t, s    drop, m    kinetic, J    bend, J   twist, J");
    for k in (0..=steps).step_by(steps / 20) {
        let drop = run.tip(0)[2] - run.tip(k)[2];
        let [t, kinetic, _, bend, twist, _] = report.energy[k];
        println!("{t:5.2}   {drop:8.5}    {kinetic:10.3e} {bend:10.3e} {twist:10.3e}");
    }
    println!(
        "energy changes by {:.1e} of the largest kinetic energy; {:.2} Newton iterations a step",
        report.energy_drift(),
        run.work().newton_iterations as f64 / steps as f64
    );
    Ok(())
}
