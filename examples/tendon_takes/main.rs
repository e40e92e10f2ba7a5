//! Modulus and density of a soft tentacle from its shapes under the tensions of two tendons, with their intervals and their
//! error on takes that the fit had not.
//!
//! `cargo run --release --example tendon_takes -- FOLDER`, where `FOLDER` has `takes.csv` and `train/NAME.csv` of the
//! motion-capture takes of the SoRoMoX project (github.com/tud-phi/soromox, secVa_system_identification). Without a
//! folder it ends with a sentence. Behind the folder, `divisions` prints the error on held-out takes by several random
//! divisions, and `models` that of models with more parameters.

mod takes;
mod tentacle;
mod validation;

use rodfit::fit::FitReport;
use std::error::Error;
use std::path::Path;
use std::time::Instant;
use tentacle::{BASIC, Model, Take, fit};
use validation::{mean_distance, validate};

/// Random divisions of the takes with `divisions`.
const DIVISIONS: usize = 5;
/// Factor on all tensions in a fit that shows which ratios are determined.
const TENSION_FACTOR: f64 = 1.1;

/// The models, those of physics alone first. The others have the place of the markers or the clamp as parameters.
const MODELS: [Model; 6] = [
    BASIC,
    Model {
        name: "neo-Hookean stretch",
        law: "poisson_ratio = 0.5\nstretch_law = \"neo-hookean\"",
        ..BASIC
    },
    Model {
        name: "cubic bending law",
        parameters: &["youngs_modulus", "density", "material.bending_law.coefficient"],
        law: "poisson_ratio = 0.45\nbending_law = { kind = \"cubic\", coefficient = 0 }",
        ..BASIC
    },
    Model {
        name: "tilt of the clamp",
        parameters: &[
            "youngs_modulus",
            "density",
            "rod.shape.direction.x",
            "rod.shape.direction.y",
        ],
        ..BASIC
    },
    Model {
        name: "shift of all markers",
        parameters: &[
            "youngs_modulus",
            "density",
            "clamp_position.x",
            "clamp_position.y",
            "clamp_position.z",
        ],
        ..BASIC
    },
    Model {
        name: "tilt and shift",
        parameters: &[
            "youngs_modulus",
            "density",
            "rod.shape.direction.x",
            "rod.shape.direction.y",
            "clamp_position.x",
            "clamp_position.y",
            "clamp_position.z",
        ],
        ..BASIC
    },
];

/// Prints the estimates of a report.
fn print(report: &FitReport) {
    for estimate in &report.parameters {
        let value = estimate.value.map_or("-".into(), |value| format!("{value:.4e}"));
        let interval = match estimate.interval95 {
            Some([low, high]) => format!("95 % [{low:.4e}, {high:.4e}]"),
            None => "not determined".into(),
        };
        println!("    {:34} {value:>11} {} {interval}", estimate.name, estimate.name.unit());
        let Some(jackknife) = &estimate.cluster_jackknife else { continue };
        let own = jackknife.estimates.iter().map(|own| own.value);
        let [low, high] =
            own.fold([f64::MAX, f64::MIN], |[low, high], x| [low.min(x), high.max(x)]);
        if low <= high {
            println!("    {:34} single takes, linearized: {low:.3e} to {high:.3e}", "");
        }
    }
}

/// Errors of some models on the takes that a fit had and on others, with the time of all fits.
fn compare(models: &[Model], takes: &[Take], divisions: usize) -> Result<(), Box<dyn Error>> {
    println!("Mean distance of the markers, mm");
    println!("  {:22} {:>7} {:>10} {:>8}", "model", "numbers", "all fitted", "held out");
    for model in models {
        let since = Instant::now();
        let fitted = mean_distance(model, takes, &fit(model, takes, false)?)?;
        let held_out = validate(model, takes, divisions)?;
        let held_out: Vec<String> = held_out.iter().map(|e| format!("{:.2}", 1e3 * e)).collect();
        println!(
            "  {:22} {:7} {:10.2} {:>8} {:6.1} s",
            model.name,
            model.parameters.len(),
            1e3 * fitted,
            held_out.join(" "),
            since.elapsed().as_secs_f64()
        );
    }
    Ok(())
}

/// Estimates from all takes, from those of each tendon, and with other tensions or a free Poisson's ratio.
fn show_estimates(takes: &[Take]) -> Result<(), Box<dyn Error>> {
    println!("\nModulus and density at the stated tensions");
    let report = fit(&BASIC, takes, true)?;
    println!("{report}");
    println!("  all {} takes:", takes.len());
    print(&report);
    for (name, is_used) in [
        ("first tendon alone", [true, false]),
        ("second tendon alone", [false, true]),
        ("both tendons", [true, true]),
    ] {
        let pulls = |take: &&Take| take.tensions.map(|tension| tension > 0.0) == is_used;
        let own: Vec<Take> = takes.iter().filter(pulls).cloned().collect();
        if own.len() > 1 {
            println!("  {name}, {} takes:", own.len());
            print(&fit(&BASIC, &own, false)?);
        }
    }
    println!(
        "  all tensions times {TENSION_FACTOR}: only modulus and density over the tension are determined"
    );
    let scaled = |take: &Take| Take {
        tensions: take.tensions.map(|tension| TENSION_FACTOR * tension),
        ..take.clone()
    };
    let other = fit(&BASIC, &takes.iter().map(scaled).collect::<Vec<_>>(), false)?;
    for (own, other) in report.parameters.iter().zip(&other.parameters) {
        if let (Some(own_value), Some(value)) = (own.value, other.value) {
            println!("    {:34} changes by the factor {:.4}", own.name, value / own_value);
        }
    }
    println!("  Poisson's ratio free:");
    let with_ratio = Model { parameters: &["youngs_modulus", "density", "poisson_ratio"], ..BASIC };
    print(&fit(&with_ratio, takes, true)?);
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let Some(folder) = std::env::args().nth(1) else {
        println!(
            "No folder of takes is given: nothing to fit. The header of this example names the data."
        );
        return Ok(());
    };
    let takes = takes::read(Path::new(&folder))?;
    match std::env::args().nth(2).as_deref() {
        Some("models") => compare(&MODELS, &takes, 1),
        Some("divisions") => compare(&MODELS[..1], &takes, DIVISIONS),
        _ => show_estimates(&takes),
    }
}
