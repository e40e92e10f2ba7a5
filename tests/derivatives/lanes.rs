//! Plain numbers go through the formulas several side by side. Each lane has what the same formulas make of one
//! number at a time, as dual numbers go through them, and what num-dual makes of the energy: for rods that fill all
//! lanes and that do not, bent by more than a right angle, rotated far from their references, with and without
//! springs of friction.

use num_dual::Dual64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::Derivatives;
use rodfit::energy::bend_twist::{JointLaw, Stiffness};
use rodfit::energy::frame::Frames;
use rodfit::energy::law::{ActiveSlipElements, SlipElements, Spring};
use rodfit::energy::{DeadLoad, PlanarBend, Stretch};
use rodfit::numerics::scalar::RodScalar;
use rodfit::numerics::tangent::Tangent;
use rodfit::rod::{
    Energies, FollowerLoads, Moments, NonlinearParts, PlanarRod, Rod, RodContacts, SpatialRod,
    UserEnergies,
};
use std::sync::Arc;

/// Rods of these many edges, each several times.
const EDGES: std::ops::RangeInclusive<usize> = 1..=13;
const TIMES: u64 = 12;

/// Edges of random length, each turned against the one before by up to `turn`, rad; in the plane where `flat`.
fn path(random: &mut ChaCha8Rng, edges: usize, turn: f64, flat: bool) -> Vec<[f64; 3]> {
    let mut nodes = vec![[0.0; 3]];
    let (mut around, mut up) = (random.random_range(-3.0..3.0), 0.0_f64);
    for _ in 0..edges {
        around += random.random_range(-turn..turn);
        up += if flat { 0.0 } else { random.random_range(-turn..turn) };
        let length = random.random_range(0.08..0.12);
        let [x, y, z] = nodes[nodes.len() - 1];
        let flat: [f64; 2] = [f64::cos(around), f64::sin(around)];
        let step = [flat[0] * up.cos(), flat[1] * up.cos(), up.sin()];
        nodes.push([x + length * step[0], y + length * step[1], z + length * step[2]]);
    }
    nodes
}

fn stretch<D: RodScalar, const M: usize>(random: &mut ChaCha8Rng) -> Stretch<D, M> {
    let mut next = |low: f64, high: f64| D::from(random.random_range(low..high));
    Stretch {
        stiffness: next(10.0, 90.0),
        rest_length: next(0.08, 0.12),
        natural_strain: next(-0.1, 0.1),
    }
}

fn planar<D: RodScalar>(seed: u64, edges: usize, slides: bool) -> (PlanarRod<D>, Vec<D>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let nodes = path(&mut random, edges, 2.4, true);
    let q = nodes.iter().flat_map(|[x, y, _]| [*x, *y].map(D::from)).collect();
    let stretch = (0..edges).map(|_| stretch(&mut random)).collect();
    let mut next = |low: f64, high: f64| D::from(random.random_range(low..high));
    let rod = PlanarRod {
        nonlinear: NonlinearParts::default(),
        stretch,
        joint: (1..edges)
            .map(|_| PlanarBend { stiffness: next(0.1, 3.0), natural_curvature: next(-1.0, 1.0) })
            .collect(),
        mass: vec![D::from(1.0); 2 * (edges + 1)],
        load: (0..=edges).map(|_| DeadLoad { force: [0; 2].map(|_| next(-1.0, 1.0)) }).collect(),
        moments: Moments { list: Vec::new(), heading: [D::from(1.0); 2] },
        bending: Vec::new(),
        sliders: slides.then(|| {
            let limits = (1..edges).map(|_| next(0.1, 1.0)).collect();
            let sliders = Arc::new(SlipElements { stiffness: D::from(1.3), limits });
            let acting = (1..edges)
                .map(|_| Spring { elastic: [next(0.1, 3.0)], offset: [next(-0.5, 0.5)] })
                .collect();
            ActiveSlipElements { sliders, acting }
        }),
        own: UserEnergies::default(),
        followers: FollowerLoads::none(),
        contacts: RodContacts::default(),
    };
    (rod, q)
}

/// A rod in space that has moved from its references by up to a turn of `since`, rad.
fn spatial<D: RodScalar>(
    seed: u64,
    edges: usize,
    since: f64,
    slides: bool,
) -> (SpatialRod<D>, Vec<D>, Frames<D>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let nodes = path(&mut random, edges, 1.2, false);
    let mut q = Vec::new();
    for (i, node) in nodes.iter().enumerate() {
        q.extend(node.map(D::from));
        if i < edges {
            q.push(D::from(random.random_range(-9.0..9.0)));
        }
    }
    let tangents: Vec<[f64; 3]> = nodes
        .windows(2)
        .map(|pair| {
            let e = [0, 1, 2].map(|c| pair[1][c] - pair[0][c]);
            let length = e.iter().map(|x| x * x).sum::<f64>().sqrt();
            let moved = e.map(|x| x / length + since * random.random_range(-0.5..0.5));
            let length = moved.iter().map(|x| x * x).sum::<f64>().sqrt();
            moved.map(|x| x / length)
        })
        .collect();
    let [x, y, z] = tangents[0];
    let across = [y - z, z - x, x - y];
    let length = across.iter().map(|x| x * x).sum::<f64>().sqrt();
    let tangents: Vec<[D; 3]> = tangents.iter().map(|t| t.map(D::from)).collect();
    let frames = Frames::bishop(&tangents, across.map(|x| D::from(x / length)));
    let stretch = (0..edges).map(|_| stretch(&mut random)).collect();
    let mut next = |low: f64, high: f64| D::from(random.random_range(low..high));
    let stiffness = |next: &mut dyn FnMut(f64, f64) -> D| Stiffness {
        bend: [next(0.5, 2.0), next(-0.1, 0.1), next(0.5, 2.0)],
        twist: next(0.5, 2.0),
        coupling: [next(-0.1, 0.1), next(-0.1, 0.1)],
    };
    let rod = SpatialRod {
        moments: Moments::none(),
        nonlinear: NonlinearParts::default(),
        stretch,
        joint: (1..edges)
            .map(|_| JointLaw {
                stiffness: stiffness(&mut next),
                natural: [0; 3].map(|_| next(-0.5, 0.5)),
            })
            .collect(),
        mass: vec![D::from(1.0); 4 * edges + 3],
        load: (0..=edges).map(|_| DeadLoad { force: [0; 3].map(|_| next(-1.0, 1.0)) }).collect(),
        bending: Vec::new(),
        sliders: slides.then(|| {
            let limits = (1..edges).map(|_| next(0.1, 1.0)).collect();
            let sliders = Arc::new(SlipElements { stiffness: D::from(1.3), limits });
            let acting = (1..edges)
                .map(|_| Spring {
                    elastic: stiffness(&mut next),
                    offset: [0; 3].map(|_| next(-0.5, 0.5)),
                })
                .collect();
            ActiveSlipElements { sliders, acting }
        }),
        own: UserEnergies::default(),
        followers: FollowerLoads::none(),
        contacts: RodContacts::default(),
    };
    (rod, q, frames)
}

/// All outputs of a rod: energies, gradients, tangents and strains.
#[derive(Debug)]
struct RodOutputs {
    gradient: Vec<f64>,
    tangent: Vec<f64>,
    by_edges: Vec<f64>,
    /// The tangent under other tensions than its own.
    under: Vec<f64>,
    strains: Vec<f64>,
    energies: Energies,
    /// The gradient and the strains with frames that moved with the rod.
    moved: [Vec<f64>; 2],
}

fn rod_outputs<D: RodScalar, R: Rod<D>>(
    rod: &R,
    q: &[D],
    frames: &R::Frames,
    derivatives: Derivatives,
) -> RodOutputs {
    let zero = vec![D::from(f64::NAN); q.len()];
    let (mut gradient, mut beside, mut strains) = (zero.clone(), zero, Vec::new());
    // What was there before must not count.
    let mut tangent = rod.zero_tangent();
    tangent.add_corner(0, 3, &[[D::from(7.0); 3]; 3]);
    rod.tangent(q, frames, derivatives, &mut beside, &mut tangent);
    rod.gradient(q, frames, derivatives, &mut gradient);
    let size = beside.iter().fold(0.0_f64, |size, x| size.max(x.value().abs()));
    for (gradient, beside) in gradient.iter().zip(&beside) {
        assert!((gradient.value() - beside.value()).abs() <= 1e-13 * size);
    }
    let mut tensions = own_tensions(rod, q, frames);
    let mut under = rod.zero_tangent();
    for shift in [0.0, SHIFT] {
        tensions.iter_mut().enumerate().for_each(|(i, t)| *t += shift * (1.0 + i as f64));
        let mut forces = gradient.clone();
        rod.tangent_with_tensions(q, frames, derivatives, Some(&tensions), &mut forces, &mut under);
        assert!(forces.iter().zip(&beside).all(|(a, b)| a.value() == b.value()));
        let off = (0..q.len()).flat_map(|i| (0..=i).map(move |j| (i, j)));
        let off = off.map(|(i, j)| (under.get(i, j) - tangent.get(i, j)).value().abs());
        let off = off.fold(0.0_f64, f64::max);
        assert!(if shift == 0.0 { off < 1e-9 } else { off > 1.0 }, "{shift} {off:e}");
    }
    let mut by_edges = rod.zero_tangent();
    rod.edge_tangent(q, frames, derivatives, &mut by_edges);
    rod.strains(q, frames, &mut strains);
    let entries = |of: &R::Tangent| {
        let all = (0..q.len()).flat_map(|i| (0..=i).map(move |j| (i, j)));
        all.map(|(i, j)| of.get(i, j).value()).collect()
    };
    let values = |of: &[D]| of.iter().map(|x| x.value()).collect();
    let (mut moved, mut after) = (vec![D::from(f64::NAN); q.len()], Vec::new());
    let mut with = frames.clone();
    rod.moved_gradient(q, &mut with, derivatives, &mut moved);
    rod.strains(q, &with, &mut after);
    let mut other = frames.clone();
    R::update_reference_frames(&mut other, q);
    assert_eq!(format!("{with:?}"), format!("{other:?}"));
    RodOutputs {
        moved: [values(&moved), values(&after)],
        gradient: values(&gradient),
        tangent: entries(&tangent),
        by_edges: entries(&by_edges),
        under: entries(&under),
        strains: values(&strains),
        energies: rod.energies(q, frames),
    }
}

/// By how much more the first edge is pulled, N; the others twice as much, three times, and so on.
const SHIFT: f64 = 2.5;

fn own_tensions<D: RodScalar, R: Rod<D>>(rod: &R, q: &[D], frames: &R::Frames) -> Vec<D> {
    let mut tensions = Vec::new();
    rod.tensions_after(&vec![D::from(0.0); q.len()], q, frames, &mut tensions);
    tensions
}

/// Tensions after a change are those before it with their slopes, and the tangent under some is that of a rod whose
/// natural strains make them.
fn tensions_are_consistent<R: Rod<f64>>(
    (rod, pulled): (&R, &R),
    (q, frames): (&[f64], &R::Frames),
    under: &[f64],
) {
    let change: Vec<f64> = (0..q.len()).map(|i| 0.01 * (7.3 * i as f64).sin()).collect();
    let at = |part: f64| {
        let moved: Vec<f64> = q.iter().zip(&change).map(|(q, d)| q + part * d).collect();
        own_tensions(rod, &moved, frames)
    };
    let [after, before, ahead, behind] = [1.0, 0.0, 1e-4, -1e-4].map(at);
    let moved: Vec<f64> = q.iter().zip(&change).map(|(q, d)| q + d).collect();
    let mut expected = Vec::new();
    rod.tensions_after(&change, &moved, frames, &mut expected);
    for i in 0..expected.len() {
        let slope = (ahead[i] - behind[i]) / 2e-4;
        assert!((expected[i] - (before[i] + slope)).abs() < 1e-6);
        assert!((after[i] - expected[i]).abs() > 1e-9, "of second order");
    }
    let (mut gradient, mut tangent) = (vec![0.0; q.len()], rod.zero_tangent());
    pulled.tangent(q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
    let all = (0..q.len()).flat_map(|i| (0..=i).map(move |j| (i, j)));
    for ((i, j), under) in all.zip(under) {
        assert!((tangent.get(i, j) - under).abs() < 1e-9, "{i} {j}");
    }
}

/// Pulls at an edge by another natural strain.
fn pull<const M: usize>(stretch: &mut [Stretch<f64, M>]) {
    for (i, edge) in stretch.iter_mut().enumerate() {
        edge.natural_strain -= SHIFT * (1.0 + i as f64) / edge.stiffness;
    }
}

/// The largest difference of two, each kind of number over the largest one of its kind.
fn difference(a: &RodOutputs, b: &RodOutputs) -> f64 {
    let energies = |e: &Energies| vec![e.stretch, e.bend, e.twist, e.potential];
    let kinds = [
        (&a.gradient, &b.gradient),
        (&a.tangent, &b.tangent),
        (&a.by_edges, &b.by_edges),
        (&a.under, &b.under),
        (&a.strains, &b.strains),
        (&energies(&a.energies), &energies(&b.energies)),
        (&a.moved[0], &b.moved[0]),
        (&a.moved[1], &b.moved[1]),
    ];
    let mut worst: f64 = 0.0;
    for (a, b) in kinds {
        assert_eq!(a.len(), b.len());
        let size = b.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        for (a, b) in a.iter().zip(b) {
            let part = (a - b).abs() / size;
            assert!(part.is_finite(), "{a} {b}");
            worst = worst.max(part);
        }
    }
    worst
}

#[test]
fn simd_lanes_of_planar_rods_equal_single_lanes() {
    for edges in EDGES {
        for seed in 0..TIMES {
            let slides = seed % 3 == 2;
            let (rod, q) = planar::<f64>(seed, edges, slides);
            let (one, one_q) = planar::<Dual64>(seed, edges, slides);
            let wide = rod_outputs(&rod, &q, &(), Derivatives::Hand);
            let alone = rod_outputs(&one, &one_q, &(), Derivatives::Hand);
            let found = difference(&wide, &alone);
            // The order of sums may differ: a few roundings; num-dual has other formulas, and
            // more of them.
            assert!(found < 1e-14, "{edges} edges, {seed}: {found:e}");
            let dual = rod_outputs(&rod, &q, &(), Derivatives::Dual);
            let found = difference(&wide, &dual);
            assert!(found < 1e-12, "{edges} edges, {seed}: {found:e} from num-dual");
            let mut pulled = rod.clone();
            pull(&mut pulled.stretch);
            tensions_are_consistent((&rod, &pulled), (&q, &()), &wide.under);
        }
    }
}

#[test]
fn simd_lanes_of_spatial_rods_equal_single_lanes() {
    for edges in EDGES {
        for seed in 0..TIMES {
            let (since, slides) = ([1e-3, 0.3, 1.5][seed as usize % 3], seed % 4 == 3);
            let (rod, q, frames) = spatial::<f64>(seed, edges, since, slides);
            let (one, one_q, one_frames) = spatial::<Dual64>(seed, edges, since, slides);
            let wide = rod_outputs(&rod, &q, &frames, Derivatives::Hand);
            let alone = rod_outputs(&one, &one_q, &one_frames, Derivatives::Hand);
            let found = difference(&wide, &alone);
            assert!(found < 1e-14, "{edges} edges, {seed}: {found:e}");
            let mut dual = rod_outputs(&rod, &q, &frames, Derivatives::Dual);
            if slides {
                // No scheme that moves frames within a step has springs that act.
                dual.moved = wide.moved.clone();
            }
            let found = difference(&wide, &dual);
            assert!(found < 1e-12, "{edges} edges, {seed}: {found:e} from num-dual");
            let mut pulled = rod.clone();
            pull(&mut pulled.stretch);
            tensions_are_consistent((&rod, &pulled), (&q, &frames), &wide.under);
        }
    }
}
