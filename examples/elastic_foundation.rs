//! A rod on an elastic foundation (Winkler) by a user-defined energy along the rod, once with derivatives by dual numbers and
//! once with hand-derived ones. Both are checked, compared with beam theory, and timed.
//!
//! `cargo run --release --example elastic_foundation`

use rodfit::check::{Tolerance, check_problem};
use rodfit::energy::{Argument, At, Directors, EnergyGradient, EnergyHessian, OwnEnergy, Place};
use rodfit::numerics::vector::{Vector, dot, scale, sub};
use rodfit::scene::number::Quantity;
use rodfit::scene::{Material, Scene, Section, Shape, Time};
use rodfit::vibration::LinearizationPoint;
use rodfit::{Error, Scalar};
use std::f64::consts::PI;

/// Springs of stiffness `k`, N/m per meter of the rod, from its rest position: `E = k/2 |x - x_rest|^2 l`.
struct Foundation;

impl OwnEnergy<1, 1> for Foundation {
    const PARAMETERS: [(&'static str, Quantity); 1] = [("k", Quantity::positive("N/m^2"))];

    fn energy<D: Scalar>(
        &self,
        place: &Place<D>,
        [k]: &[D; 1],
        [x]: &[Vector<D>; 1],
        _: &[Directors<D>],
    ) -> D {
        let way = sub(*x, place.node(0));
        *k * dot(way, way) * place.length() * 0.5
    }

    fn keeps_plane(&self, _: &[f64; 1], _: [f64; 3], _: [f64; 3]) -> bool {
        true
    }
}

/// The same energy with hand-derived derivatives.
struct ByHand;

impl OwnEnergy<1, 1> for ByHand {
    const PARAMETERS: [(&'static str, Quantity); 1] = Foundation::PARAMETERS;

    fn energy<D: Scalar>(
        &self,
        place: &Place<D>,
        k: &[D; 1],
        x: &[Vector<D>; 1],
        edges: &[Directors<D>],
    ) -> D {
        Foundation.energy(place, k, x, edges)
    }

    fn gradient<D: Scalar>(
        &self,
        place: &Place<D>,
        [k]: &[D; 1],
        [x]: &[Vector<D>; 1],
        _: &[Directors<D>],
    ) -> Option<EnergyGradient<D, 1>> {
        let force = scale(sub(*x, place.node(0)), *k * place.length());
        Some(EnergyGradient::default().with(Argument::Node(0), force))
    }

    fn hessian<D: Scalar>(
        &self,
        place: &Place<D>,
        [k]: &[D; 1],
        _: &[Vector<D>; 1],
        _: &[Directors<D>],
    ) -> Option<EnergyHessian<D, 1>> {
        let (stiffness, zero) = (*k * place.length(), D::from(0.0));
        let block = [0, 1, 2].map(|r| [0, 1, 2].map(|c| if r == c { stiffness } else { zero }));
        Some(EnergyHessian::default().with(Argument::Node(0), Argument::Node(0), block))
    }

    fn keeps_plane(&self, _: &[f64; 1], _: [f64; 3], _: [f64; 3]) -> bool {
        true
    }
}

/// The shortest time of a step among seven runs, us.
fn microseconds(scene: &Scene) -> Result<f64, Error> {
    let problem = scene.problem()?;
    let mut best = f64::INFINITY;
    for _ in 0..7 {
        let run = problem.simulate()?;
        best = best.min(run.stepping().as_secs_f64() / run.work().steps as f64);
    }
    Ok(1e6 * best)
}

fn main() -> Result<(), Error> {
    let (length, radius, density, modulus, k) = (0.5, 0.005, 1273.52, 1e8, 60.0);
    let shape = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
    let section = Section::Circle { radius };
    let material = Material { poisson_ratio: Some(0.5), ..Material::new(density, modulus) };
    let mut scene = Scene::new(50, shape, section, material);
    scene.time = Some(Time::new(0.2, 1e-3));
    let dual = scene.clone().with_energy("foundation", At::Whole, Foundation, [k]);
    let hand = scene.clone().with_energy("foundation", At::Whole, ByHand, [k]);

    let report = check_problem(&hand.problem()?, Tolerance::default())?;
    println!("{report}\n");
    assert!(report.passed());

    // Beam theory: omega^2 = omega_0^2 + k/(rho A), with omega_0 of a clamped beam (first root 1.8751).
    let line_density = density * PI * radius * radius;
    let second_moment = PI * radius.powi(4) / 4.0;
    for (name, scene) in [("dual", &dual), ("hand", &hand)] {
        let modes = scene.problem()?.modes(1, LinearizationPoint::Equilibrium)?;
        let squared = 1.875_104_068_711_961_f64.powi(4) * modulus * second_moment
            / (line_density * length.powi(4));
        let (found, theory) = (modes.frequencies_rad_s[0], (squared + k / line_density).sqrt());
        println!("{name}: first frequency {found:.6} rad/s, in theory {theory:.6}");
        assert!((found / theory - 1.0).abs() < 1e-3);
    }

    // Time of a step without the foundation, with hand-derived derivatives, and with dual numbers.
    let mut names = ["in the plane", "in space"].into_iter();
    for dimension in [rodfit::scene::Dimension::Planar, rodfit::scene::Dimension::Spatial] {
        let of = |scene: &Scene| {
            let mut scene = scene.clone();
            scene.rod.dimension = dimension;
            scene.loads.gravity = [0.0, -9.8, 0.0];
            microseconds(&scene)
        };
        let (none, by_hand, by_dual) = (of(&scene)?, of(&hand)?, of(&dual)?);
        println!(
            "{}: a step takes {none:.1} us without foundation, {by_hand:.1} us by hand, {by_dual:.1} us in \
             dual numbers: {:.2} times as much",
            names.next().unwrap_or_default(),
            by_dual / by_hand
        );
    }
    Ok(())
}
