//! Identifies Young's modulus from the tip of a helix, and then the shear modulus in addition: a helix bends and twists when
//! it is stretched, so that its motion determines both.
//!
//! `cargo run --release --example fit_helix`

use rodfit::fit::FitFile;
use rodfit::{Fit, Observation, Parameter, Scene};

fn main() -> Result<(), rodfit::Error> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/data");
    println!("Young's modulus, truth 1e7 Pa, Poisson's ratio given:");
    println!("{}\n", FitFile::load(format!("{folder}/helix-fit.toml"))?.fit().solve()?);

    let mut scene = Scene::load(format!("{folder}/helix.toml"))?;
    // Moduli without a start value are searched for: those of the scene have no influence.
    (scene.material.poisson_ratio, scene.material.shear_modulus) = (None, Some(1.0));
    let report = Fit::new(&scene.problem()?)
        .observe(Observation::read(format!("{folder}/helix-tip.csv"))?)
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::ShearModulus)
        .solve()?;
    println!("Both moduli, truths 1e7 and 3.333e6 Pa:\n{report}");
    if let [Some(correlation), ..] = report.correlation[1][..] {
        println!("  correlation {correlation:.2}");
    }
    Ok(())
}
