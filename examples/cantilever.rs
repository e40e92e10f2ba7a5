//! The cantilever of Huang & Jawed (2019), released under gravity: first maximum and minimum of the sag of its tip over
//! the length, for four pairs of beta and time step. Prints also the position of the middle and its derivative by E.
//!
//! `cargo run --release --example cantilever`

use rodfit::scene::{Material, Scene, Section, Shape, Time};
use rodfit::{Error, Point};

fn main() -> Result<(), Error> {
    let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
    let section = Section::Circle { radius: 0.005 };
    let mut scene = Scene::new(50, shape, section, Material::new(1273.52, 1e8));
    scene.loads.gravity = [0.0, -9.8, 0.0];
    println!("   beta    step   first maximum and minimum of the sag over the length");
    for (beta, step) in [(1.0, 5e-3), (0.75, 5e-3), (0.5, 5e-3), (0.5, 1e-3)] {
        scene.time = Some(Time { beta, ..Time::new(0.75, step) });
        let trajectory = scene.problem()?.simulate()?;
        let sag = |range: std::ops::Range<f64>| {
            let times = trajectory.times().to_vec();
            let trajectory = &trajectory;
            (0..times.len())
                .filter(move |k| range.contains(&times[*k]))
                .map(|k| -trajectory.tip(k)[1] / 0.5)
        };
        let highest = sag(0.15..0.45).fold(f64::MIN, f64::max);
        let lowest = sag(0.45..0.76).fold(f64::MAX, f64::min);
        println!("{beta:7} {step:7} s   {highest:.5}   {lowest:.5}");
    }

    // Positions of any point at any time, with derivatives by the requested parameters.
    scene.time = Some(Time::new(0.5, 1e-3));
    let run = scene.problem()?.simulate_with(&[rodfit::Parameter::YoungsModulus])?;
    let (x, by_e) = run.at(Point::ArcLength(0.25), 0.3)?;
    println!("middle of the rod at 0.3 s: {x:.4?} m; d/dlnE {:.4?} m", by_e[0].map(|d| d * 1e8));
    println!("work: {:?}", run.work());
    Ok(())
}
