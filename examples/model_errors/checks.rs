//! Checks of the independent solver before its data are used: lowest frequency against beam theory, tip positions against a
//! finer resolution, and E of the library's fit to data without noise.

use crate::cantilever::{Equations, FINE, Fineness};
use crate::kinds::{Kind, RECORD, reference};
use crate::laboratory::{CAMERAS, fit};
use rayon::prelude::*;
use rodfit::Error;

/// First root of `cos x cosh x = -1`.
const FIRST_ROOT: f64 = 1.875104068711961;
/// Largest accepted relative error of the lowest frequency.
const FREQUENCY_ERROR: f64 = 1e-6;
/// Largest accepted error of the tip by truncation, m.
const TIP_ERROR: f64 = 1e-6;
/// Largest accepted relative error of E by a fit of data without noise.
const MODULUS_ERROR: f64 = 1e-4;
/// Kinds whose truncation error is checked: a jump of the stiffness, and the strongest taper.
const CHECKED: [&str; 2] = ["grip 1.3 times stiffer", "taper 40 %"];

/// Largest change of the tip with more modes and nodes and shorter steps, m.
fn truncation_error(kind: &Kind) -> f64 {
    let finer = Fineness {
        polynomials: FINE.polynomials + 4,
        modes: FINE.modes + 4,
        nodes: FINE.nodes + 6,
        step: 0.5 * FINE.step,
    };
    let [coarse, fine] =
        [FINE, finer].map(|fineness| Equations::new(&kind.rod, fineness).tip_positions(kind.end));
    let distance = |(p, q): (&[f64; 2], &[f64; 2])| (p[0] - q[0]).hypot(p[1] - q[1]);
    coarse.iter().zip(&fine).map(distance).fold(0.0, f64::max)
}

/// Panics if the solver is less accurate than the fits need; prints its errors.
pub fn check_solver(kinds: &[Kind]) -> Result<(), Error> {
    let rod = reference();
    let lowest = Equations::new(&rod, FINE).frequencies()[0];
    let inertia = rod.density * rod.area(0.0) * rod.length.powi(4);
    let theory = FIRST_ROOT.powi(2) * (rod.stiffness(0.0) / inertia).sqrt();
    let frequency_error = (lowest / theory - 1.0).abs();
    assert!(frequency_error < FREQUENCY_ERROR, "lowest frequency: {frequency_error:e}");

    let checked = kinds.par_iter().filter(|kind| CHECKED.contains(&kind.name.as_str()));
    let tip_error = checked.map(truncation_error).reduce(|| 0.0, f64::max);
    assert!(tip_error < TIP_ERROR, "the tip is off by {tip_error:e} m");

    let positions = Equations::new(&rod, FINE).tip_positions(RECORD);
    let report = fit(CAMERAS[1].record(&positions, None), RECORD)?;
    let modulus = report.parameters[0].value.unwrap_or(f64::NAN);
    let modulus_error = (modulus / rod.modulus - 1.0).abs();
    assert!(modulus_error < MODULUS_ERROR, "E without noise: {modulus_error:e}");
    println!(
        "solver: lowest frequency to {frequency_error:.1e}, tip to {tip_error:.1e} m; the library's E without noise to \
         {modulus_error:.1e}"
    );
    Ok(())
}
