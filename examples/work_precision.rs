//! Work-precision of all schemes: wall time against error of the tip for the paper's cantilever and helix on their own mesh,
//! 1 s, with the error against a much finer run.
//!
//! `cargo run --release --example work_precision`

use rodfit::scene::{Scheme, Time};
use rodfit::{AnyProblem, Error, Point, Problem, Scene, Trajectory};

/// Positions of the tip at 400 times, and the shortest of up to three stepping times in s.
fn run(scene: &Scene, scheme: Scheme, step: f64) -> Result<(Vec<[f64; 3]>, f64), Error> {
    let mut scene = scene.clone();
    scene.time = Some(Time { scheme, ..Time::new(1.0, step) });
    let problem = scene.problem()?;
    let (mut tips, mut seconds) = (Vec::new(), f64::INFINITY);
    for _ in 0..3 {
        let mut run = Trajectory::new(&problem, &[problem.nodes() - 1], &[])?;
        run.run(&problem, problem.time()?.steps(), |_| {})?;
        seconds = seconds.min(run.stepping().as_secs_f64());
        let tip = |k: i32| Ok(run.at(Point::Tip, f64::from(k) / 400.0)?.0);
        tips = (1..=400).map(tip).collect::<Result<_, Error>>()?;
        if seconds > 0.1 {
            break;
        }
    }
    Ok((tips, seconds))
}

/// The largest stable step of an explicit scheme, s; none of an implicit one.
fn largest_step(scene: &Scene, scheme: Scheme) -> Result<Option<f64>, Error> {
    let mut scene = scene.clone();
    scene.time = Some(Time { scheme, ..Time::new(1.0, 1e-3) });
    let problem: Problem = scene.problem()?;
    Ok(match problem.discretized() {
        AnyProblem::Planar(discretized) => discretized.largest_step().unwrap(),
        AnyProblem::Spatial(discretized) => discretized.largest_step().unwrap(),
    })
}

fn main() -> Result<(), Error> {
    for name in ["cantilever", "helix"] {
        let scene = Scene::load(format!("data/{name}.toml"))?;
        // The reference is by a scheme of fourth order far within its stability limit.
        let finest = 0.2 * largest_step(&scene, Scheme::Pefrl)?.expect("an explicit scheme");
        let (reference, _) = run(&scene, Scheme::Pefrl, finest)?;
        println!(
            "{name}, {:?} segments\nscheme                 step, s   error/L   time, ms",
            scene.rod.segments
        );
        for scheme in [
            Scheme::NewmarkBeta,
            Scheme::AverageVectorField,
            Scheme::Rodas4,
            Scheme::Verlet,
            Scheme::Pefrl,
        ] {
            let steps = match largest_step(&scene, scheme)? {
                Some(largest) => [0.95, 0.5, 0.25].map(|part| part * largest).to_vec(),
                None => vec![5e-3, 2.5e-3, 1e-3, 5e-4],
            };
            for step in steps {
                let line = format!("{:<20} {step:9.2e}", format!("{scheme:?}"));
                match run(&scene, scheme, step) {
                    Ok((tips, seconds)) => {
                        let apart = |(a, b): (&[f64; 3], &[f64; 3])| {
                            (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt() / 0.5
                        };
                        let error = tips.iter().zip(&reference).map(apart).fold(0.0, f64::max);
                        println!("{line} {error:9.1e} {:9.2}", 1e3 * seconds);
                    }
                    Err(error) => println!("{line} {error}"),
                }
            }
        }
    }
    Ok(())
}
