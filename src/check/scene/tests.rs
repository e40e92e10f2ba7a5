//! An error planted in one entry of one kind of element is found in the states of a scene's check.

use crate::check::scene::{RANDOM_STATES, random_planar, random_spatial};
use crate::check::{CheckReport, Scaled, Tolerance};
use crate::energy::{Analytic, AsEnergy, Energy};
use crate::numerics::scalar::Scalar;
use crate::problem::AnyProblem;
use crate::scene::{Point, PointForce, Scene};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// The error of the planted entry, over the entry.
const PLANTED: f64 = 1e-6;

/// Which derivative is wrong.
#[derive(Clone, Copy, Debug)]
enum Entry {
    Gradient(usize),
    Hessian(usize, usize),
}

/// An energy with one wrong derivative.
struct Planted<E>(E, Entry);

impl<E: Energy<N>, const N: usize> Energy<N> for Planted<E> {
    fn energy<D: Scalar>(&self, q: &[D; N]) -> D {
        self.0.energy(q)
    }
}

impl<E: Analytic<N>, const N: usize> Analytic<N> for Planted<E> {
    fn gradient(&self, q: &[f64; N]) -> [f64; N] {
        let mut gradient = self.0.gradient(q);
        if let Entry::Gradient(i) = self.1 {
            gradient[i] *= 1.0 + PLANTED;
        }
        gradient
    }
    fn hessian(&self, q: &[f64; N]) -> [[f64; N]; N] {
        let mut hessian = self.0.hessian(q);
        if let Entry::Hessian(i, j) = self.1 {
            hessian[i][j] *= 1.0 + PLANTED;
        }
        hessian
    }
}

/// Plants an error in every entry that does not vanish in all states; returns how many there are.
fn every_planted_error_is_found<E: Analytic<N> + Copy, const N: usize>(
    kind: &str,
    states: &[(E, [f64; N])],
) -> usize {
    let entries = (0..N).map(Entry::Gradient);
    let second = (0..N).flat_map(|i| (0..N).map(move |j| Entry::Hessian(i, j)));
    let mut planted = 0;
    for entry in entries.chain(second) {
        let value = |(energy, q): &(E, [f64; N])| match entry {
            Entry::Gradient(i) => energy.gradient(q)[i],
            Entry::Hessian(i, j) => energy.hessian(q)[i][j],
        };
        if states.iter().all(|state| value(state) == 0.0) {
            continue;
        }
        planted += 1;
        let mut report = CheckReport::new(Tolerance::default());
        for (energy, q) in states {
            report.compare(&Planted(*energy, entry), q, kind, |k| k.to_string());
        }
        assert!(!report.derivatives_agree(), "{kind}: {entry:?}\n{report}");
    }
    planted
}

fn scene(shape: &str) -> Scene {
    let text = format!(
        "[rod]\nsegments = 6\nshape = {shape}\n\
         section = {{ kind = \"rectangle\", width = 0.02, height = 0.002, up = [0, 0, 1] }}\n\
         [material]\ndensity = 1200\nyoungs_modulus = 1e7\npoisson_ratio = 0.4\n"
    );
    Scene::from_toml(&text, ".").unwrap()
}

fn local<const N: usize>(q: &[f64], first: usize) -> [f64; N] {
    let own: &[f64; N] = q[first..].first_chunk().unwrap();
    std::array::from_fn(|k| own[k] - own[k % 2])
}

#[test]
fn planted_error_in_any_entry_of_planar_elements_is_found() {
    let mut scene = scene("{ kind = \"arc\", length = 0.5, angle = 1.0 }");
    let moment = [0.0, 0.0, 1e-3];
    scene.loads.point = vec![PointForce { node: Point::Node(3), force: [0.0; 3], moment }];
    let problem = scene.problem().unwrap();
    let AnyProblem::Planar(discretized) = problem.discretized() else { panic!("a planar scene") };
    let rod = discretized.rod();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let states: Vec<Vec<f64>> =
        (0..RANDOM_STATES).map(|_| random_planar(&rod, &mut random)).collect();
    let stretch: Vec<_> =
        states.iter().map(|q| (AsEnergy(rod.stretch[2]), local::<4>(q, 4))).collect();
    assert_eq!(every_planted_error_is_found("stretch", &stretch), 4 + 16);
    let bend: Vec<_> = states.iter().map(|q| (AsEnergy(rod.joint[2]), local::<6>(q, 4))).collect();
    assert_eq!(every_planted_error_is_found("bend", &bend), 6 + 36);
    let (node, element) = rod.moments.list[0];
    let moments: Vec<_> = states.iter().map(|q| (AsEnergy(element), local(q, 2 * node))).collect();
    assert!(every_planted_error_is_found("moment", &moments) > 0);
}

#[test]
fn planted_error_in_any_entry_of_spatial_elements_is_found() {
    let shape = "{ kind = \"helix\", length = 0.5, radius = 0.05, pitch = 0.1, axis = [0, 0, 1], \
                 handedness = \"left\" }";
    let problem = scene(shape).problem().unwrap();
    let AnyProblem::Spatial(discretized) = problem.discretized() else { panic!("a spatial scene") };
    let rod = discretized.rod();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let (mut stretch, mut joints) = (Vec::new(), Vec::new());
    for _ in 0..RANDOM_STATES {
        let (q, frames) = random_spatial(&rod, &mut random);
        let own: &[f64; 11] = q[8..].first_chunk().unwrap();
        let length = rod.stretch[2].rest_length;
        let at = std::array::from_fn(|k| if k % 4 == 3 { own[k] } else { own[k] - own[k % 4] });
        let units = std::array::from_fn(|k| if k % 4 == 3 { 1.0 } else { length });
        let joint = Scaled { energy: AsEnergy(rod.bend_twist(2, &frames)), units };
        joints.push((joint, joint.scaled(&at)));
        let edge = std::array::from_fn(|k| if k < 3 { 0.0 } else { own[k + 1] - own[k - 3] });
        let units = [length; 6];
        let scaled = Scaled { energy: AsEnergy(rod.stretch[2]), units };
        stretch.push((scaled, scaled.scaled(&edge)));
    }
    assert_eq!(every_planted_error_is_found("stretch", &stretch), 6 + 36);
    assert_eq!(every_planted_error_is_found("bend and twist", &joints), 11 + 121);
}
