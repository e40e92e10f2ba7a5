//! Derivatives of tendons by hand against those of the definition in dual numbers, at random states.

use crate::energy::Derivatives;
use crate::energy::adapter::{AnyEnergy, Chart, ElementContext, EnergyOver, MOST, OwnLocal};
use crate::energy::bend_twist::{EdgeState, to_edges};
use crate::energy::frame::EdgeFrame;
use crate::energy::joint::JointStrains;
use crate::energy::tendon::RoutePart;
use crate::energy::tendon::element::TendonElement;
use crate::numerics::scalar::RodScalar;
use crate::numerics::vector::{Vector, add, cross, scale, unit};
use num_dual::{Dual64, HyperDual64};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Largest turning angle of two edges, twist, and rotation since the reference, degrees. Nearer to half a turn the
/// energy is singular, and its definition in dual numbers loses digits.
const LARGEST_TURN: f64 = 170.0;

/// Uniform between both ends.
fn between(random: &mut ChaCha8Rng, from: f64, to: f64) -> f64 {
    random.random_range(from..to)
}

/// A vector with components between -1 and 1.
fn vector(random: &mut ChaCha8Rng) -> Vector<f64> {
    [0; 3].map(|_| between(random, -1.0, 1.0))
}

/// The unit vector `t` after a rotation by up to `degrees` about a random axis across it.
fn turned(random: &mut ChaCha8Rng, t: Vector<f64>, degrees: f64) -> Vector<f64> {
    let angle = between(random, 0.0, degrees.to_radians());
    let across = unit(cross(t, vector(random)));
    add(scale(t, angle.cos()), scale(across, angle.sin()))
}

/// Right-handed orthonormal axes.
fn axes(random: &mut ChaCha8Rng) -> [Vector<f64>; 3] {
    let x = unit(vector(random));
    let y = unit(cross(x, vector(random)));
    [x, y, cross(x, y)]
}

/// A place of a tendon over `nodes` nodes, with unknowns and references.
struct Case {
    chart: Chart<f64>,
    frames: Vec<EdgeFrame<f64>>,
    tension: f64,
    place: Vec<f64>,
    weight: Option<f64>,
    q: Vec<f64>,
}

impl Case {
    /// A random place: turning angles up to [`LARGEST_TURN`], any twist, references as far away, offsets up to 0.9 of
    /// the size of edges.
    fn new(random: &mut ChaCha8Rng, nodes: usize, planar: bool) -> Self {
        let size = 10_f64.powf(between(random, -4.0, 0.0));
        let [r1, r2, dr1, dr2] = [0; 4].map(|_| size * between(random, -0.9, 0.9));
        let part =
            RoutePart { weight: between(random, 0.1, 1.0), offset: [r1, r2], change: [dr1, dr2] };
        let mut tangent = if planar { [0.6, -0.8, 0.0] } else { unit(vector(random)) };
        let (mut position, mut frames) = (scale(vector(random), size), Vec::new());
        let mut q = Vec::new();
        for i in 0..nodes {
            q.extend(&position[..if planar { 2 } else { 3 }]);
            if i + 1 == nodes {
                break;
            }
            position = add(position, scale(tangent, size * between(random, 0.7, 1.5)));
            if planar {
                let angle = between(random, -LARGEST_TURN, LARGEST_TURN).to_radians();
                let [x, y, _] = tangent;
                tangent =
                    [angle.cos() * x - angle.sin() * y, angle.sin() * x + angle.cos() * y, 0.0];
                continue;
            }
            q.push(between(random, -6.0, 6.0));
            let reference = turned(random, tangent, LARGEST_TURN);
            let director = unit(cross(reference, vector(random)));
            frames.push(EdgeFrame { tangent: reference, director });
            tangent = turned(random, tangent, LARGEST_TURN);
        }
        let (own, angle) = (axes(random), between(random, -3.0, 3.0));
        let chart = match planar {
            true => Chart::Plane {
                origin: vector(random),
                axes: [own[0], own[1]],
                across: [angle.cos(), angle.sin()],
            },
            false => Chart::Space { axes: (angle > 0.0).then_some(own) },
        };
        let weight = (angle > 1.0).then(|| between(random, 0.1, 1.0));
        let tension = 10_f64.powf(between(random, -3.0, 3.0));
        Self { chart, frames, tension, place: part.numbers(0.1), weight, q }
    }

    /// Whether the twist between two edges in space is beyond [`LARGEST_TURN`]: false elsewhere.
    fn is_twisted_too_far(&self) -> bool {
        let ([a, b], Some(q)) = (self.frames.as_slice(), self.q.first_chunk()) else {
            return false;
        };
        let [e0, e1, e2, te, f0, f1, f2, tf] = to_edges(q);
        let [e, f] = [EdgeState::new(a, [e0, e1, e2], te), EdgeState::new(b, [f0, f1, f2], tf)];
        let twist = JointStrains::new(&e.edge, &f.edge, 0.0).cayley_twist(&e.edge, &f.edge);
        (0.5 * twist).atan().abs() > 0.5 * LARGEST_TURN.to_radians()
    }

    /// First and second derivatives over the scalar `D`, by hand or in dual numbers, and the gradient alone.
    fn derivatives<D: RodScalar>(
        &self,
        energy: &dyn EnergyOver<D>,
        over: impl Fn(f64, usize) -> D + Copy,
        derivatives: Derivatives,
    ) -> (OwnLocal<D>, [D; MOST]) {
        let all = |numbers: &[f64]| -> Vec<D> {
            numbers.iter().enumerate().map(|(i, x)| over(*x, i)).collect()
        };
        let chart = match &self.chart {
            Chart::Plane { origin, axes, across } => {
                Chart::Plane { origin: *origin, axes: *axes, across: across.map(D::from) }
            }
            Chart::Space { axes } => Chart::Space { axes: *axes },
        };
        let frames: Vec<EdgeFrame<D>> = self.frames.iter().map(|f| f.map(D::from)).collect();
        let (values, place, q) = (all(&[self.tension]), all(&self.place), all(&self.q));
        let weight = self.weight.map(D::from);
        let context = ElementContext {
            chart: &chart,
            frames: &frames,
            values: &values,
            place: &place,
            weight,
        };
        let unset = D::from(f64::NAN);
        let mut local = ([unset; MOST], [[unset; MOST]; MOST]);
        let mut gradient = [unset; MOST];
        energy.tangent(&context, &q, derivatives, &mut local);
        energy.gradient(&context, &q, derivatives, &mut gradient);
        (local, gradient)
    }

    /// The largest difference of derivatives by hand from those in dual numbers, over the largest entry of gradient and
    /// Hessian, with lengths in units of the first edge; `parts` are the numbers of a scalar.
    fn error<D: RodScalar>(
        &self,
        energy: &dyn EnergyOver<D>,
        over: impl Fn(f64, usize) -> D + Copy,
        parts: impl Fn(D) -> [f64; 4],
    ) -> f64 {
        let (hand, gradient) = self.derivatives(energy, over, Derivatives::Hand);
        let (dual, _) = self.derivatives(energy, over, Derivatives::Dual);
        let (count, stride) = (self.q.len(), self.chart.stride());
        let length = (0..stride.min(3)).map(|c| (self.q[stride + c] - self.q[c]).powi(2));
        let length = length.sum::<f64>().sqrt();
        let unit = |r: usize| if stride == 4 && r % 4 == 3 { 1.0 } else { length };
        // Differences and largest entries, of first and of second derivatives and by each part of the scalar.
        let mut sums = [[[0.0_f64; 2]; 4]; 2];
        let mut compare = |order: usize, own: D, other: D, unit: f64| {
            for (k, (a, b)) in parts(own).into_iter().zip(parts(other)).enumerate() {
                let [error, largest] = &mut sums[order][k];
                let difference = (a - b).abs() * unit;
                // A value that is no number is the largest of all errors.
                *error = if difference <= *error { *error } else { difference };
                *largest = largest.max(b.abs() * unit);
            }
        };
        for r in 0..count {
            compare(0, hand.0[r], dual.0[r], unit(r));
            compare(0, gradient[r], dual.0[r], unit(r));
            for c in 0..=r {
                compare(1, hand.1[r][c], dual.1[r][c], unit(r) * unit(c));
            }
        }
        let relative =
            |[error, largest]: [f64; 2]| if error == 0.0 { 0.0 } else { error / largest };
        let all = sums.into_iter().flatten().map(relative);
        all.fold(0.0, |worst, error| if error <= worst { worst } else { error })
    }
}

/// The largest error of `count` random places over `nodes` nodes, in a plane or in space, as rods over each scalar.
fn worst(energy: &dyn AnyEnergy, nodes: usize, planar: bool, count: usize) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(57);
    let mut worst = 0.0;
    for k in 0..count {
        let case = Case::new(&mut random, nodes, planar);
        if case.is_twisted_too_far() {
            continue;
        }
        let mut errors = vec![case.error::<f64>(energy, |x, _| x, |x| [x, 0.0, 0.0, 0.0])];
        if k % 100 == 0 {
            // Derivatives along a direction in which unknowns, tension and route change.
            let along = |x: f64, i: usize| (0.3 + x) * (1.0 - 0.2 * i as f64);
            errors.push(case.error::<Dual64>(
                energy,
                |x, i| Dual64::new(x, along(x, i)),
                |x| [x.re, x.eps, 0.0, 0.0],
            ));
            errors.push(case.error::<HyperDual64>(
                energy,
                |x, i| HyperDual64::new(x, along(x, i), 0.4 * along(x, i + 1), 0.0),
                |x| [x.re, x.eps1, x.eps2, x.eps1eps2],
            ));
        }
        for error in errors {
            assert!(error < 1e-9, "place {k}: {error:e}");
            worst = f64::max(worst, error);
        }
    }
    worst
}

#[test]
fn derivatives_in_space_equal_those_in_dual_numbers() {
    let bent = worst(&TendonElement::<3>::default(), 3, false, 2000);
    let edge = worst(&TendonElement::<2>::default(), 2, false, 500);
    println!("largest relative errors: around a node {bent:.1e}, along an edge {edge:.1e}");
}

#[test]
fn derivatives_in_the_plane_equal_those_in_dual_numbers() {
    let bent = worst(&TendonElement::<3>::default(), 3, true, 2000);
    let edge = worst(&TendonElement::<2>::default(), 2, true, 500);
    println!("largest relative errors: around a node {bent:.1e}, along an edge {edge:.1e}");
}
