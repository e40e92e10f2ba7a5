//! Identifies Young's modulus of a rod from the recorded motion of its tip: without a start value, from a start a hundred
//! times too small, and together with the density, which these data do not determine.
//!
//! `cargo run --release --example fit_youngs_modulus`

use rodfit::{Error, Fit, Observation, Parameter, Point, Scene, Unknown};

fn main() -> Result<(), Error> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data");
    let problem = Scene::load(format!("{folder}/cantilever.toml"))?.problem()?;
    let tip = Observation::read(format!("{folder}/cantilever-tip.csv"))?.at(Point::Tip);

    let fit = Fit::new(&problem).observe(tip.clone()).identify(Parameter::YoungsModulus).solve()?;
    println!("{fit}");

    // A start may be wrong by a factor of a hundred: the search also scans other values.
    let far = Unknown::new(Parameter::YoungsModulus).start(1e6);
    println!("from 1e6 Pa: {}", Fit::new(&problem).observe(tip.clone()).identify(far).solve()?);

    // Only gravity moves this rod, so that the data determine E/density alone; the fit reports it.
    let both = Fit::new(&problem)
        .observe(tip)
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::Density)
        .solve()?;
    println!("{both}");

    // The fitted rod, ready to simulate.
    let best = problem.with(fit.parameters())?;
    println!("tip at 0.3 s: {:.4?} m", best.simulate()?.at(Point::Tip, 0.3)?.0);
    Ok(())
}
