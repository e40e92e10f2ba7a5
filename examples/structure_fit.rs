//! Modulus and stiffness of a joint of a structure from the motion of a tip: Gauss-Newton iterations with exact derivatives
//! by dual numbers, from data that the program makes with 0.1 mm of noise.
//!
//! `cargo run --release --example structure_fit`

use nalgebra::{DMatrix, DVector};
use num_dual::Dual64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::{Error, Scalar, Structure, StructureScene};

/// Paths of the identified parameters in the scene.
const PATHS: [&str; 2] = ["materials.rubber.youngs_modulus", "joints.0.rotation"];
/// Their values in the data: Pa, and rad/(N m).
const TRUTH: [f64; 2] = [2.4e6, 35.0];
/// Standard deviation of the data, m.
const SIGMA: f64 = 1e-4;
/// Number of observed times.
const TIMES: usize = 100;

/// An arm that is connected to a mast by a spring joint and sags when it is released.
const SCENE: &str = r#"
[[rods]]
name = "mast"
segments = 15
shape = { kind = "straight", length = 0.15, direction = [0.0, 1.0, 0.0] }
section = { kind = "circle", radius = 5e-3 }
material = "rubber"
[[rods]]
name = "arm"
segments = 15
shape = { kind = "straight", length = 0.15, direction = [1.0, 0.0, 0.0] }
section = { kind = "circle", radius = 5e-3 }
material = "rubber"
[[materials]]
name = "rubber"
density = 1100
youngs_modulus = 1e6
[[joints]]
kind = "spring"
connects = [{ rod = "mast", at = "end" }, { rod = "arm", at = "start" }]
rotation = 10.0
[[supports]]
of = { rod = "mast", at = "start" }
kind = "clamped"
[loads]
gravity = [0.0, -9.81, 0.0]
damping = { mass = 0.5 }
[time]
end = 0.5
step = 5e-3
"#;

/// The coordinates of the arm's tip at all times, m; `seed` returns the value of an identified parameter by its index.
fn tip<D: rodfit::numerics::scalar::RodScalar>(
    structure: &Structure,
    seed: impl Fn(usize) -> D,
) -> Result<Vec<D>, Error> {
    let number = |path: &str, value: f64| match PATHS.iter().position(|own| *own == path) {
        Some(k) => seed(k),
        None => D::from(value),
    };
    let mut simulation = structure.simulation_over(|path, value, _| number(path, value))?;
    let mut observed = Vec::new();
    for k in 1..=TIMES {
        simulation.step_to(5e-3 * k as f64)?;
        let end = simulation.rod().rod_ranges()[1].end;
        observed.extend_from_slice(&simulation.state().q[end - 2..end]);
    }
    Ok(observed)
}

fn main() -> Result<(), Error> {
    let structure = Structure::new(StructureScene::from_toml(SCENE, ".")?)?;
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut normal = || {
        let [u, v]: [f64; 2] = [random.random(), random.random()];
        (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    };
    let data: Vec<f64> =
        tip(&structure, |k| TRUTH[k])?.into_iter().map(|x| x + SIGMA * normal()).collect();
    // Gauss-Newton iterations in the logarithms of both numbers.
    let mut x = [1e6_f64.ln(), 10.0_f64.ln()];
    let mut covariance = DMatrix::identity(2, 2);
    for iteration in 0..20 {
        let columns: Vec<Vec<Dual64>> = (0..2)
            .map(|along| {
                let seed = |k: usize| Dual64::new(x[k], f64::from(k == along)).exp();
                tip(&structure, seed)
            })
            .collect::<Result<_, _>>()?;
        let residual =
            DVector::from_fn(data.len(), |i, _| (columns[0][i].value() - data[i]) / SIGMA);
        let jacobian = DMatrix::from_fn(data.len(), 2, |i, k| columns[k][i].eps / SIGMA);
        let normal_matrix = jacobian.transpose() * &jacobian;
        covariance = normal_matrix.clone().try_inverse().expect("both numbers act on the tip");
        let change = &covariance * (jacobian.transpose() * &residual);
        // Steps of at most a factor of two.
        let scale = (0.7 / change.amax()).min(1.0);
        (0..2).for_each(|k| x[k] -= scale * change[k]);
        println!(
            "iteration {iteration}: chi^2 {:.1} of {} residuals",
            residual.norm_squared(),
            data.len()
        );
        if change.amax() < 1e-8 {
            break;
        }
    }
    for k in 0..2 {
        let (value, sigma) = (x[k].exp(), covariance[(k, k)].sqrt() * x[k].exp());
        println!("{} = {value:.5e} +- {sigma:.1e} (truth {:.3e})", PATHS[k], TRUTH[k]);
        assert!(
            (value - TRUTH[k]).abs() < 4.0 * sigma,
            "the truth is outside of four standard errors"
        );
    }
    Ok(())
}
