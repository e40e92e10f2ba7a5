//! Random unknowns of planar and spatial rods, for the check of derivatives at states far from those of a simulation.
//!
//! Input: a rod and a seeded generator of the caller, whose state moves on. Each edge has its own strain within 30 %,
//! and the first node is at the origin. Planar turning angles are within [`LARGEST_TURN`] of both signs, spatial ones
//! up to it about random axes. Output: `random_planar` returns x and y of all nodes, m. `random_spatial` returns x, y,
//! z of the nodes (m) alternating with the angles of the edges, and frames. Their reference directions are rotated from
//! the edges by up to [`LARGEST_ROTATION`]; both limits are in degrees. Edge angles and reference twists are within 6
//! rad of zero.

use crate::energy::frame::Frames;
use crate::numerics::vector::{Vector, add, cross, dot, scale, unit};
use crate::rod::{PlanarRod, SpatialRod};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Largest turning angle of random states, degrees, up to which finite differences have errors of 1e-7. At 180 degrees
/// the bending energy is singular.
const LARGEST_TURN: f64 = 150.0;
/// Largest rotation of an edge from its reference direction in random states, degrees.
const LARGEST_ROTATION: f64 = 120.0;

/// Coordinates x, y of all nodes of a planar rod, m, with the first node at the origin. The first direction is random,
/// turning angles are within [`LARGEST_TURN`] of both signs, and edge strains within 30 %, each uniform and
/// independent. The state of the generator `random` moves on.
pub(super) fn random_planar(rod: &PlanarRod<f64>, random: &mut ChaCha8Rng) -> Vec<f64> {
    let mut angle: f64 = random.random_range(-3.1..3.1);
    let mut q = vec![0.0, 0.0];
    for edge in &rod.stretch {
        // Strains and turning angles beyond those of simulations, within which every formula must
        // hold.
        let length = edge.rest_length * random.random_range(0.7..1.3);
        let [x, y] = [q[q.len() - 2], q[q.len() - 1]];
        q.extend([x + length * angle.cos(), y + length * angle.sin()]);
        angle += random.random_range(-LARGEST_TURN..LARGEST_TURN).to_radians();
    }
    q
}

/// Random unit vector, uniform over the sphere, by rejection from the cube.
fn random_unit(random: &mut ChaCha8Rng) -> Vector<f64> {
    // Rejection from the cube; the center is left out, where the direction is ill-conditioned.
    loop {
        let v = [0; 3].map(|_| random.random_range(-1.0..1.0));
        if (0.01..1.0).contains(&dot(v, v)) {
            return unit(v);
        }
    }
}

/// The unit vector `t` after a rotation by `angle`, rad, about a random axis normal to it.
fn rotated_randomly(t: Vector<f64>, angle: f64, random: &mut ChaCha8Rng) -> Vector<f64> {
    let across = loop {
        let across = cross(t, random_unit(random));
        if dot(across, across) > 0.01 {
            break unit(across);
        }
    };
    unit(add(scale(t, angle.cos()), scale(across, angle.sin())))
}

/// Unknowns (x, y, z of each node and the angle of each edge, alternating, the first node at the origin) and frames of
/// a spatial rod. Edge strains are within 30 %, turning angles up to [`LARGEST_TURN`] about random axes, and edge
/// angles and reference twists within 6 rad. Reference directions of the frames differ from the edges by up to
/// [`LARGEST_ROTATION`].
pub(super) fn random_spatial(
    rod: &SpatialRod<f64>,
    random: &mut ChaCha8Rng,
) -> (Vec<f64>, Frames<f64>) {
    let mut t = random_unit(random);
    let mut x = [0.0; 3];
    let mut q = x.to_vec();
    let mut references = Vec::new();
    for edge in &rod.stretch {
        let length = edge.rest_length * random.random_range(0.7..1.3);
        // The unknowns of an edge: its twist angle, then the position of its end.
        x = add(x, scale(t, length));
        q.push(random.random_range(-6.0..6.0));
        q.extend(x);
        // Reference directions differ from the edges, so that parallel transport is tested too.
        let rotation = random.random_range(0.0..LARGEST_ROTATION).to_radians();
        references.push(rotated_randomly(t, rotation, random));
        let turn = random.random_range(0.0..LARGEST_TURN).to_radians();
        t = rotated_randomly(t, turn, random);
    }
    let director = unit(cross(references[0], random_unit(random)));
    let mut frames = Frames::bishop(&references, director);
    for twist in &mut frames.twist {
        *twist = random.random_range(-6.0..6.0);
    }
    (q, frames)
}

/// An error planted in one entry of one kind of element is found in random states.
#[cfg(test)]
mod tests {
    use crate::check::random_states::{random_planar, random_spatial};
    use crate::check::{CheckReport, Scaled, Tolerance};
    use crate::energy::{Analytic, AsEnergy, Energy};
    use crate::numerics::scalar::Scalar;
    use crate::problem::AnyProblem;
    use crate::scene::{Point, PointForce, Scene};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    /// Random states in which an error must be found.
    const STATES: usize = 20;

    /// Relative error of the planted entry.
    const PLANTED: f64 = 1e-6;

    /// Position of the wrong derivative.
    #[derive(Clone, Copy, Debug)]
    enum PlantedEntry {
        Gradient(usize),
        Hessian(usize, usize),
    }

    /// An energy with one wrong derivative.
    struct Planted<E>(E, PlantedEntry);

    impl<E: Energy<N>, const N: usize> Energy<N> for Planted<E> {
        /// The energy without an error.
        fn energy<D: Scalar>(&self, q: &[D; N]) -> D {
            self.0.energy(q)
        }
    }

    impl<E: Analytic<N>, const N: usize> Analytic<N> for Planted<E> {
        /// The gradient with the planted error.
        fn gradient(&self, q: &[f64; N]) -> [f64; N] {
            let mut gradient = self.0.gradient(q);
            if let PlantedEntry::Gradient(i) = self.1 {
                gradient[i] *= 1.0 + PLANTED;
            }
            gradient
        }
        /// The Hessian with the planted error.
        fn hessian(&self, q: &[f64; N]) -> [[f64; N]; N] {
            let mut hessian = self.0.hessian(q);
            if let PlantedEntry::Hessian(i, j) = self.1 {
                hessian[i][j] *= 1.0 + PLANTED;
            }
            hessian
        }
    }

    /// Plants an error in every entry that does not vanish in all states, checks that it is found, and returns their
    /// number.
    fn count_found_errors<E: Analytic<N> + Copy, const N: usize>(
        kind: &str,
        states: &[(E, [f64; N])],
    ) -> usize {
        let entries = (0..N).map(PlantedEntry::Gradient);
        let second = (0..N).flat_map(|i| (0..N).map(move |j| PlantedEntry::Hessian(i, j)));
        let mut planted = 0;
        for entry in entries.chain(second) {
            let value = |(energy, q): &(E, [f64; N])| match entry {
                PlantedEntry::Gradient(i) => energy.gradient(q)[i],
                PlantedEntry::Hessian(i, j) => energy.hessian(q)[i][j],
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

    /// Scene of a rod with six edges, a rectangular section and the shape of a TOML text.
    fn scene(shape: &str) -> Scene {
        let text = format!(
            "[rod]\nsegments = 6\nshape = {shape}\n\
             section = {{ kind = \"rectangle\", width = 0.02, height = 0.002, up = [0, 0, 1] }}\n\
             [material]\ndensity = 1200\nyoungs_modulus = 1e7\npoisson_ratio = 0.4\n"
        );
        Scene::from_toml(&text, ".").unwrap()
    }

    /// The `N` unknowns from `first` on, relative to the first node.
    fn local<const N: usize>(q: &[f64], first: usize) -> [f64; N] {
        let own: &[f64; N] = q[first..].first_chunk().unwrap();
        std::array::from_fn(|k| own[k] - own[k % 2])
    }

    #[test]
    fn planted_error_in_any_entry_of_planar_elements_is_found() {
        let mut scene = scene("{ kind = \"arc\", length = 0.5, angle = 1.0 }");
        let moment = [0.0, 0.0, 1e-3];
        scene.loads.point = vec![PointForce {
            node: Point::Node(3),
            force: [0.0; 3],
            moment,
            follower: false,
            signal: None,
        }];
        let problem = scene.problem().unwrap();
        let AnyProblem::Planar(discretized) = problem.discretized() else {
            panic!("a planar scene")
        };
        let rod = discretized.rod();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let states: Vec<Vec<f64>> = (0..STATES).map(|_| random_planar(&rod, &mut random)).collect();
        // An edge has 4 unknowns, a joint 6: so many entries of the gradient, and their square of
        // the Hessian.
        let stretch: Vec<_> =
            states.iter().map(|q| (AsEnergy(rod.stretch[2]), local::<4>(q, 4))).collect();
        assert_eq!(count_found_errors("stretch", &stretch), 4 + 16);
        let bend: Vec<_> =
            states.iter().map(|q| (AsEnergy(rod.joint[2]), local::<6>(q, 4))).collect();
        assert_eq!(count_found_errors("bend", &bend), 6 + 36);
        let (node, element) = rod.moments.list[0];
        let moments: Vec<_> =
            states.iter().map(|q| (AsEnergy(element), local(q, 2 * node))).collect();
        assert!(count_found_errors("moment", &moments) > 0);
    }

    #[test]
    fn planted_error_in_any_entry_of_spatial_elements_is_found() {
        let shape = "{ kind = \"helix\", length = 0.5, radius = 0.05, pitch = 0.1, axis = [0, 0, 1], \
                     handedness = \"left\" }";
        let problem = scene(shape).problem().unwrap();
        let AnyProblem::Spatial(discretized) = problem.discretized() else {
            panic!("a spatial scene")
        };
        let rod = discretized.rod();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let (mut stretch, mut joints) = (Vec::new(), Vec::new());
        for _ in 0..STATES {
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
        // 6 unknowns of an edge: 6 entries of the gradient, 36 of the Hessian.
        assert_eq!(count_found_errors("stretch", &stretch), 6 + 36);
        assert_eq!(count_found_errors("bend and twist", &joints), 11 + 121);
    }
}
