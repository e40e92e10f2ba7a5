//! Synthetic recordings of the same kind: a short move of the strip, and poses whose wrench is noise.
//!
//! Output: the tables of [`strip`] and [`poses`], with the columns of the originals, in a folder. The strip has the
//! modulus [`MODULUS`] and the damping [`DAMPING`]; its moment has a constant offset and normal noise. The wrench of
//! the poses does not depend on the rod, so that a fit must not return a modulus.

use crate::strip::Recordings;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rodfit::{Parameter, Scene, Trajectory};
use std::error::Error;
use std::path::{Path, PathBuf};

/// True modulus of the synthetic strip, Pa.
const MODULUS: f64 = 1.95e11;
/// True Kelvin-Voigt time, s.
const DAMPING: f64 = 1e-3;
/// Offset of the moment, N m, and standard deviation of its noise.
const OFFSET: f64 = 0.8;
const NOISE: f64 = 5e-3;
/// Time between rows, s.
const INTERVAL: f64 = 0.01;
/// Rows of a take.
const ROWS: usize = 301;
/// Duration, s, and size, m, of the move of the clamp.
const MOVE: (f64, f64) = (0.5, 0.15);
/// Number of poses.
const POSES: usize = 10;

/// Writes one take of the strip, which is flat and moves up, to the folder `work`, and returns the recordings.
pub fn strip(work: &Path) -> Result<Recordings, Box<dyn Error>> {
    let recordings = Recordings {
        folder: PathBuf::from(work),
        takes: &["synthetic"],
        time_zero: 0.0,
        window: [1.0, 2.9],
        segments: 8,
        step: 0.5 * INTERVAL,
    };
    let rows = |moment: &dyn Fn(usize) -> f64| {
        let mut text =
            String::from("t_s,px_m,py_m,pz_m,qx,qy,qz,qw,Fx_N,Fy_N,Fz_N,Tx_Nm,Ty_Nm,Tz_Nm\n");
        for k in 0..ROWS {
            let time = k as f64 * INTERVAL;
            let (duration, size) = MOVE;
            let part = (time / duration).min(1.0);
            let z = size * part * part * (3.0 - 2.0 * part);
            // The quaternion turns y of the clamp to the world's z.
            let half = std::f64::consts::FRAC_1_SQRT_2;
            text += &format!("{time},0,0,{z},{half},0,0,{half},0,0,0,0,0,{}\n", moment(k));
        }
        std::fs::write(work.join("synthetic.csv"), text)
    };
    // The poses first: the scene of the simulation reads them.
    rows(&|_| 0.0)?;
    let scene = Scene::from_toml(&recordings.scene("synthetic", DAMPING), work)?;
    let problem = scene.problem()?.with([(Parameter::YoungsModulus, MODULUS)])?;
    let mut run = Trajectory::new(&problem, &[], &[])?.keep_reactions();
    run.run(&problem, problem.time()?.steps(), |_| {})?;
    let reactions = run.reactions();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let noise: Vec<f64> = (0..ROWS).map(|_| StandardNormal.sample(&mut random)).collect();
    // The z axis of the clamp is the world's -y.
    // There are two steps between rows.
    let moment = |k: usize| reactions.get(2 * k).map_or(0.0, |own| -own.start.moment[1]);
    rows(&|k| moment(k) + OFFSET + NOISE * noise[k])?;
    println!("strip: youngs_modulus {MODULUS:e} Pa, damping.stiffness {DAMPING:e} s");
    Ok(recordings)
}

/// Writes poses with a wrench of pure noise to the folder `work`, and returns the path of the table.
pub fn poses(work: &Path) -> Result<PathBuf, Box<dyn Error>> {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let mut text = String::from(
        "end_x_m,end_y_m,end_z_m,end_qx,end_qy,end_qz,end_qw,start_x_m,start_y_m,start_z_m,start_qx,start_qy,start_qz,\
         start_qw,fx_N,fy_N,fz_N,tx_Nm,ty_Nm,tz_Nm\n",
    );
    // The quaternion turns z of the grippers to the world's x.
    let turned = "0,0.7071068,0,0.7071068";
    for _ in 0..POSES {
        let noise: [f64; 9] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
        let [x, y, z, wrench @ ..] = noise;
        let (x, y, z) = (0.35 + 0.03 * x, 0.05 * y, 0.05 * z);
        let wrench = wrench.map(|own| format!("{}", 0.05 * own)).join(",");
        text += &format!("{x},{y},{z},{turned},0,0,0,{turned},{wrench}\n");
    }
    let path = work.join("wrench_poses.csv");
    std::fs::write(&path, text)?;
    println!("poses: a wrench that does not depend on the rod");
    Ok(path)
}
