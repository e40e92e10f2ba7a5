//! A magnet at the tip of a rod in a uniform field: a user-defined energy, whose magnetic moment is identified from the rod's
//! motion together with E.
//!
//! `cargo run --release --example magnetic_tip`

use rodfit::energy::{At, Directors, OwnEnergy, Place};
use rodfit::fit::Sample;
use rodfit::numerics::vector::{Vector, dot};
use rodfit::scene::number::{Candidates, Quantity};
use rodfit::scene::{Material, Scene, Section, Shape, Time};
use rodfit::{Error, Fit, Observation, Parameter, Point, Scalar};

/// A magnet along the rod: `E = -moment t.B`, with the tangent `t` of the edge at its place.
struct Magnet {
    /// B, T.
    field: [f64; 3],
}

impl OwnEnergy<2, 1> for Magnet {
    const PARAMETERS: [(&'static str, Quantity); 1] =
        [("moment", Quantity::positive("A m^2").searched(Candidates::Decades(1e-5, 1e-1, 2.0)))];

    fn energy<D: Scalar>(
        &self,
        _: &Place<D>,
        [moment]: &[D; 1],
        _: &[Vector<D>; 2],
        edges: &[Directors<D>],
    ) -> D {
        let [tangent, ..] = edges[0];
        -(*moment * dot(tangent, self.field.map(D::from)))
    }

    fn keeps_plane(&self, _: &[f64; 1], normal: [f64; 3], _: [f64; 3]) -> bool {
        dot(normal, self.field) == 0.0
    }
}

fn main() -> Result<(), Error> {
    let shape = Shape::Straight { length: 0.1, direction: [1.0, 0.0, 0.0] };
    let section = Section::Circle { radius: 5e-4 };
    let mut scene = Scene::new(20, shape, section, Material::new(1100.0, 1.5e8));
    scene.loads.gravity = [0.0, -9.8, 0.0];
    scene.time = Some(Time::new(0.3, 1e-3));
    let truth = 8e-4;
    let magnet = Magnet { field: [0.0, 0.02, 0.0] };
    let scene = scene.with_energy("magnet", At::End, magnet, [truth]);
    let problem = scene.problem()?;
    let moment: Parameter = "energy.magnet.moment".parse()?;

    // Synthetic data of the tip.
    let run = problem.simulate_with(&[moment])?;
    let mut samples = Vec::new();
    for k in 1..=60 {
        let time = f64::from(k) * 0.005;
        let ([x, y, _], _) = run.at(Point::Tip, time)?;
        samples.push(Sample { time, position: [Some(x), Some(y), None] });
    }
    let (_, by_moment) = run.at(Point::Tip, 0.3)?;
    println!("the tip moves {:.3e} m per A m^2 of {moment} at 0.3 s", by_moment[0][1]);

    // The fit begins elsewhere.
    let elsewhere = problem.with([(moment, 1e-4)])?;
    let fit = Fit::new(&elsewhere)
        .observe(Observation::new(samples))
        .identify(moment)
        .identify(Parameter::YoungsModulus)
        .solve()?;
    println!("{fit}");
    let found = fit.parameters()[0].1;
    let error = (found / truth - 1.0).abs();
    println!("moment {found:.12e} A m^2, true {truth:e}: relative error {error:.1e}");
    assert!(error < 1e-7);
    Ok(())
}
