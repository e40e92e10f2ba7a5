//! The helix of Huang & Jawed (2019): extension against independent values, energy, and Newton iterations with the exact
//! and the published tangent.

use num_dual::Dual64;
use rodfit::dynamics::{Simulation, StepperSettings};
use rodfit::energy::Element;
use rodfit::energy::bend_twist::Published;
use rodfit::energy::frame::Frames;
use rodfit::numerics::banded::BandMatrix;
use rodfit::numerics::tangent::Tangent;
use rodfit::rod::{Energies, Rod, SpatialRod, Viscosity};
use rodfit::scene::{Clamp, StepTolerance};
use rodfit::{Derivatives, Problem};

use crate::common::{extremum, helix_with};

/// Extension of the tip over the axial length at every step.
fn extension(problem: &Problem) -> (Vec<f64>, Vec<f64>) {
    let run = problem.simulate().unwrap();
    let axial = 0.5 * 0.05 / (0.05_f64.powi(2) + (std::f64::consts::TAU * 0.02).powi(2)).sqrt();
    let start = run.tip(0)[2];
    let values = (0..run.times().len()).map(|k| (start - run.tip(k)[2]) / axial).collect();
    (run.times().to_vec(), values)
}

/// Independent values of the first maximum and minimum of the extension, walls at the nodes.
#[test]
fn helix_moves_as_published() {
    for (segments, beta, step, maximum, minimum) in [
        (50, 0.5, 1e-4, Some(0.127335), 0.012742),
        (50, 1.0, 1e-3, None, 0.018793),
        (50, 1.0, 5e-3, None, 0.035955),
        (100, 0.5, 1e-4, Some(0.135717), 0.012572),
    ] {
        let mut scene = helix_with(beta, step, 0.27, Clamp::Nodes);
        scene.rod.segments = Some(segments);
        let (times, values) = extension(&scene.problem().unwrap());
        let highest = extremum(&times, &values, [0.05, 0.16], 1.0);
        let lowest = extremum(&times, &values, [0.16, 0.26], -1.0);
        println!("{segments} segments, beta {beta}, {step} s: {highest:.6} {lowest:.6}");
        if let Some(maximum) = maximum {
            // Independent values, given to six digits.
            assert!((highest - maximum).abs() < 3e-6, "{highest}");
        }
        assert!((lowest - minimum).abs() < 3e-6, "{lowest}");
    }
}

/// At beta = 0.5 energy stays, and no step needs more than a few iterations.
#[test]
fn helix_conserves_its_energy() {
    let problem = helix_with(0.5, 1e-3, 5.0, Clamp::Nodes).problem().unwrap();
    let mut report = rodfit::dynamics::SimulationReport::new(&problem);
    let mut trajectory = rodfit::Trajectory::new(&problem, &[], &[]).unwrap();
    trajectory.run(&problem, 5000, |now| report.push(&problem, now)).unwrap();
    let work = trajectory.work();
    println!(
        "energy changes by {:.1e} of the largest kinetic energy; {:.2} iterations a step",
        report.energy_drift(),
        work.newton_iterations as f64 / work.steps as f64
    );
    // Error of second order in the step.
    assert!(report.energy_drift() < 1e-4);
    assert!(work.newton_iterations <= 3 * work.steps);
    // Twisting takes part.
    let twist = report.energy.iter().map(|e| e[4]).fold(0.0, f64::max);
    let bend = report.energy.iter().map(|e| e[3]).fold(0.0, f64::max);
    assert!(twist > 0.3 * bend, "{twist} {bend}");
}

/// A spatial rod with the tangent of the literature, which takes every state for the reference.
#[derive(Clone)]
struct PublishedRod(SpatialRod<f64>);

impl Rod<f64> for PublishedRod {
    type Tangent = BandMatrix<f64, 10>;
    type Dual = SpatialRod<Dual64>;
    type Frames = Frames<f64>;
    type Geometry = ();
    const HAS_FRAMES: bool = true;

    fn is_angle(i: usize) -> bool {
        SpatialRod::<f64>::is_angle(i)
    }
    fn zero_tangent(&self) -> BandMatrix<f64, 10> {
        self.0.zero_tangent()
    }
    fn mass(&self) -> &[f64] {
        &self.0.mass
    }
    fn gradient(&self, q: &[f64], frames: &Frames<f64>, d: Derivatives, gradient: &mut [f64]) {
        self.0.gradient(q, frames, d, gradient);
    }
    fn tangent(
        &self,
        q: &[f64],
        frames: &Frames<f64>,
        derivatives: Derivatives,
        gradient: &mut [f64],
        tangent: &mut BandMatrix<f64, 10>,
    ) {
        self.0.gradient(q, frames, derivatives, gradient);
        *tangent = BandMatrix::zeros(q.len());
        for (i, element) in self.0.stretch.iter().enumerate() {
            let local = element.tangent(&std::array::from_fn(|k| q[4 * i + k + k / 3])).hessian;
            let with_angle = |k: usize| match k {
                0..3 => Some(k),
                3 => None,
                _ => Some(k - 1),
            };
            let block: [[f64; 7]; 7] = std::array::from_fn(|r| {
                std::array::from_fn(|c| match (with_angle(r), with_angle(c)) {
                    (Some(r), Some(c)) => local[r][c],
                    _ => 0.0,
                })
            });
            tangent.add_corner(4 * i, 7, &block);
        }
        for i in 0..self.0.joint.len() {
            let own = q[4 * i..].first_chunk().unwrap();
            let local = Published(self.0.bend_twist(i, frames)).tangent(own);
            tangent.add_corner(4 * i, 11, &local.hessian);
        }
    }
    fn measure(&self, _: &[f64], _: &Frames<f64>, (): &mut ()) {}
    fn edge_tangent(
        &self,
        q: &[f64],
        frames: &Frames<f64>,
        derivatives: Derivatives,
        tangent: &mut BandMatrix<f64, 10>,
    ) {
        self.0.edge_tangent(q, frames, derivatives, tangent);
    }
    fn over_rotated_edge(
        &self,
        before: &[f64],
        now: &[f64],
        frames: &Frames<f64>,
    ) -> Option<usize> {
        self.0.over_rotated_edge(before, now, frames)
    }
    fn folded_node(&self, before: &[f64], now: &[f64], frames: &Frames<f64>) -> Option<usize> {
        self.0.folded_node(before, now, frames)
    }
    fn energies(&self, q: &[f64], frames: &Frames<f64>) -> Energies {
        self.0.energies(q, frames)
    }
    fn strains(&self, q: &[f64], frames: &Frames<f64>, strains: &mut Vec<f64>) {
        self.0.strains(q, frames, strains);
    }
    fn dashpots(&self) -> Self {
        Self(self.0.dashpots())
    }
    fn strain_energies(&self, strains: &[f64]) -> [f64; 3] {
        self.0.strain_energies(strains)
    }
    fn set_viscous(&mut self, elastic: &Self, viscosity: &Viscosity<f64>) {
        self.0.set_viscous(&elastic.0, viscosity);
    }
    fn set_dashpots(&mut self, dashpots: &Self, viscosity: &Viscosity<f64>) {
        self.0.set_dashpots(&dashpots.0, viscosity);
    }
}

/// Newton's method with the exact tangent against the published one, for the same equations.
#[test]
fn exact_tangent_reduces_iterations() {
    let problem = helix_with(0.5, 5e-3, 1.0, Clamp::Nodes).problem().unwrap();
    let discretized = problem.spatial().unwrap();
    let mut exact = discretized.simulation().unwrap();
    let (q, frames) = (discretized.rest(), exact.state().frames.clone());
    let undamped = rodfit::scene::Damping::default();
    let (rod, hand) = (PublishedRod(discretized.rod()), Derivatives::Hand);
    let settings = StepperSettings {
        scheme: rodfit::scene::Scheme::NewmarkBeta,
        parameter: 0.5,
        tolerance: StepTolerance::default(),
        length: 0.5,
    };
    let mut published =
        Simulation::new(rod, q, frames, discretized.free(), undamped, settings, hand);
    for k in 1..=200 {
        exact.step_to(f64::from(k) * 5e-3).unwrap();
        published.step_to(f64::from(k) * 5e-3).unwrap();
    }
    let per_step = [exact.work(), published.work()].map(|w| w.newton_iterations as f64 / 200.0);
    println!("iterations a step: exact tangent {:.2}, published {:.2}", per_step[0], per_step[1]);
    let apart = exact.state().q.iter().zip(&published.state().q).map(|(a, b)| (a - b).abs());
    // Both solve the same equations: tolerance of Newton's method.
    assert!(apart.fold(0.0, f64::max) < 1e-8);
    // The exact tangent needs 30 % fewer iterations at least.
    assert!(per_step[0] < 4.0 && per_step[1] > 1.3 * per_step[0], "{per_step:?}");
}
