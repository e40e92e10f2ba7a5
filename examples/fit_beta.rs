//! Identifies beta of Newmark-beta, the numerical dissipation of a recorded simulation, alone and together with E.
//!
//! `cargo run --release --example fit_beta`

use rodfit::{Error, Fit, Observation, Parameter, Scene};

fn main() -> Result<(), Error> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data");
    let problem = Scene::load(format!("{folder}/cantilever-coarse-steps.toml"))?.problem()?;
    let tip = Observation::read(format!("{folder}/cantilever-beta-tip.csv"))?;

    let fit = Fit::new(&problem).observe(tip.clone()).identify(Parameter::Beta).solve()?;
    println!("{fit}");

    // Together with E: stiffness determines the period, beta the decay.
    let both = Fit::new(&problem)
        .observe(tip)
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::Beta)
        .solve()?;
    println!("{both}");
    if let Some(c) = both.correlation[0][1] {
        println!("  correlation {c:.2}");
    }
    Ok(())
}
