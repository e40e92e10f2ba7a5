//! What the sensitivities of a step are made of, side by side and by hand, against the same rods in
//! dual numbers.

use num_dual::Dual64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rodfit::Derivatives;
use rodfit::energy::bend_twist::{JointLaw, Stiffness};
use rodfit::energy::frame::Frames;
use rodfit::energy::{DeadLoad, DeadMoment, PlanarBend, Stretch};
use rodfit::numerics::banded::BandMatrix;
use rodfit::numerics::scalar::RodScalar;
use rodfit::rod::{ChangedRods, frame_rates, set_dual_frames, set_real_frames};
use rodfit::rod::{
    FollowerLoads, ForwardSensitivity, FrameRate, Moments, NonlinearParts, PlanarRod, Rod,
    RodContacts, RodGeometry, SpatialRod, UserEnergies,
};

const EDGES: usize = 6;

/// Numbers with a value, the same for all parameters, and a derivative by each.
struct Numbers {
    values: ChaCha8Rng,
    rates: ChaCha8Rng,
}

impl Numbers {
    fn new(rates: u64) -> Self {
        Self { values: ChaCha8Rng::seed_from_u64(5), rates: ChaCha8Rng::seed_from_u64(rates) }
    }

    fn next(&mut self, low: f64, high: f64) -> Dual64 {
        Dual64::new(self.values.random_range(low..high), self.rates.random_range(-1.0..1.0))
    }
}

fn planar<D: RodScalar>(numbers: &mut Numbers, to: impl Fn(Dual64) -> D) -> PlanarRod<D> {
    let mut next = |low, high| to(numbers.next(low, high));
    PlanarRod {
        nonlinear: NonlinearParts::default(),
        stretch: (0..EDGES)
            .map(|_| Stretch {
                stiffness: next(10.0, 90.0),
                rest_length: next(0.05, 0.15),
                natural_strain: next(-0.1, 0.1),
            })
            .collect(),
        joint: (1..EDGES)
            .map(|_| PlanarBend { stiffness: next(0.1, 3.0), natural_curvature: next(-1.0, 1.0) })
            .collect(),
        mass: vec![D::from(1.0); 2 * (EDGES + 1)],
        load: (0..=EDGES).map(|_| DeadLoad { force: [0; 2].map(|_| next(-1.0, 1.0)) }).collect(),
        moments: Moments {
            list: vec![(2, DeadMoment { moment: next(-1.0, 1.0), rest: [D::from(1.0); 2] })],
            heading: [D::from(1.0); 2],
        },
        bending: Vec::new(),
        sliders: None,
        own: UserEnergies::default(),
        followers: FollowerLoads::none(),
        contacts: RodContacts::default(),
    }
}

fn spatial<D: RodScalar>(numbers: &mut Numbers, to: impl Fn(Dual64) -> D) -> SpatialRod<D> {
    let mut next = |low, high| to(numbers.next(low, high));
    SpatialRod {
        moments: Moments::none(),
        nonlinear: NonlinearParts::default(),
        stretch: (0..EDGES)
            .map(|_| Stretch {
                stiffness: next(10.0, 90.0),
                rest_length: next(0.05, 0.15),
                natural_strain: next(-0.1, 0.1),
            })
            .collect(),
        joint: (1..EDGES)
            .map(|_| JointLaw {
                stiffness: Stiffness {
                    bend: [next(1.0, 3.0), next(-0.5, 0.5), next(1.0, 3.0)],
                    twist: next(1.0, 3.0),
                    coupling: [0; 2].map(|_| next(-0.5, 0.5)),
                },
                natural: [0; 3].map(|_| next(-0.5, 0.5)),
            })
            .collect(),
        mass: vec![D::from(1.0); 4 * EDGES + 3],
        load: (0..=EDGES).map(|_| DeadLoad { force: [0; 3].map(|_| next(-1.0, 1.0)) }).collect(),
        bending: Vec::new(),
        sliders: None,
        own: UserEnergies::default(),
        followers: FollowerLoads::none(),
        contacts: RodContacts::default(),
    }
}

/// Unknowns along x, turned aside.
fn unknowns(numbers: &mut Numbers, stride: usize, count: usize) -> Vec<Dual64> {
    let place = |i: usize| if i.is_multiple_of(stride) { 0.1 * (i / stride) as f64 } else { 0.0 };
    let size = |i: usize| if i % stride == 3 { 2.0 } else { 0.04 };
    (0..count).map(|i| numbers.next(-1.0, 1.0) * size(i) + place(i)).collect()
}

fn assert_agree(found: impl IntoIterator<Item = f64>, exact: impl IntoIterator<Item = f64>) {
    let both: Vec<(f64, f64)> = found.into_iter().zip(exact).collect();
    let size = both.iter().fold(0.0_f64, |most, (_, exact)| most.max(exact.abs()));
    assert!(size > 0.0);
    for (i, (found, exact)) in both.iter().enumerate() {
        assert!((found - exact).abs() < 1e-13 * size, "{i}: {found} {exact}");
    }
}

fn values(x: &[Dual64]) -> Vec<f64> {
    x.iter().map(|x| x.re).collect()
}

/// The derivatives of the gradient along two parameters at unknowns that stay, by hand or by num-dual.
fn gradient_rates<R: ForwardSensitivity>(
    (rod, duals): (&R, &[R::Dual; 2]),
    (q, frames): (&[f64], &R::Frames),
    derivatives: Derivatives,
) -> (Vec<[f64; 2]>, R::Geometry) {
    let (mut rates, mut geometry) = (R::Rates::default(), R::Geometry::default());
    R::set_rates(duals, &mut rates);
    rod.measure(q, frames, &mut geometry);
    let mut found = vec![[7.0; 2]; q.len()];
    let changed = ChangedRods { duals, rates: &rates };
    R::gradient_rate(changed, &geometry, q, frames, derivatives, &mut found);
    (found, geometry)
}

#[test]
fn rates_of_planar_rods_equal_dual_numbers() {
    let duals = [1, 2].map(|rates| planar(&mut Numbers::new(rates), |x| x));
    let rod = planar(&mut Numbers::new(1), |x| x.re);
    let q = values(&unknowns(&mut Numbers::new(1), 2, 2 * (EDGES + 1)));
    for derivatives in [Derivatives::Hand, Derivatives::Dual] {
        let (found, _) = gradient_rates((&rod, &duals), (&q, &()), derivatives);
        for (g, dual) in duals.iter().enumerate() {
            let mut exact = vec![Dual64::from(0.0); q.len()];
            let still: Vec<Dual64> = q.iter().map(|q| Dual64::from(*q)).collect();
            dual.gradient(&still, &(), Derivatives::Hand, &mut exact);
            assert_agree(found.iter().map(|x| x[g]), exact.iter().map(|x| x.eps));
        }
    }
}

/// A rod between two places, with frames that were moved along: from the first place in dual numbers, and
/// their derivatives side by side.
#[test]
fn rates_of_spatial_rods_and_frames_equal_dual_numbers() {
    let count = 4 * EDGES + 3;
    let duals = [1, 2].map(|rates| spatial(&mut Numbers::new(rates), |x| x));
    let rod = spatial(&mut Numbers::new(1), |x| x.re);
    // Two places for each parameter, of the same values.
    let [before, now] = [11, 13].map(|seed| {
        [0, 1].map(|k| {
            let mut numbers = Numbers::new(seed + k);
            (0..seed).for_each(|_| _ = numbers.next(0.0, 1.0));
            unknowns(&mut numbers, 4, count)
        })
    });
    let plain = |frames: &Frames<Dual64>| {
        let mut real = Frames::bishop(&[[0.0; 3]; EDGES], [0.0; 3]);
        set_real_frames(frames, &mut real);
        real
    };
    let frames = before.each_ref().map(|q| {
        let x = [1.0, 0.0, 0.0].map(Dual64::from);
        let mut frames = Frames::bishop(&[x; EDGES], [0.0, 0.6, 0.8].map(Dual64::from));
        SpatialRod::update_reference_frames(&mut frames, q);
        frames
    });
    let mut rates: Vec<FrameRate<2>> = frame_rates(frames.each_ref());
    let (real, q) = (plain(&frames[0]), values(&now[0]));

    let (mut gradient, mut tangent) = (vec![0.0; count], BandMatrix::zeros(count));
    rod.tangent(&q, &real, Derivatives::Hand, &mut gradient, &mut tangent);
    for derivatives in [Derivatives::Hand, Derivatives::Dual] {
        let (mut found, geometry) = gradient_rates((&rod, &duals), (&q, &real), derivatives);
        geometry.add_frame_rates(&rates, &gradient, &tangent, &mut found);
        for g in 0..2 {
            let still: Vec<Dual64> = q.iter().map(|q| Dual64::from(*q)).collect();
            let mut exact = vec![Dual64::from(0.0); count];
            duals[g].gradient(&still, &frames[g], Derivatives::Hand, &mut exact);
            assert_agree(found.iter().map(|x| x[g]), exact.iter().map(|x| x.eps));
        }
    }

    // Moved on to the second place.
    let (_, geometry) = gradient_rates((&rod, &duals), (&q, &real), Derivatives::Hand);
    let lanes: Vec<[f64; 2]> = (0..count).map(|i| [now[0][i].eps, now[1][i].eps]).collect();
    geometry.move_frame_rates(&mut rates, &lanes);
    for g in 0..2 {
        let mut exact = frames[g].clone();
        SpatialRod::update_reference_frames(&mut exact, &now[g]);
        let mut found = exact.clone();
        set_dual_frames(&plain(&exact), &rates, g, &mut found);
        let all = |frames: &Frames<Dual64>| -> Vec<f64> {
            let edges = frames.edges.iter().flat_map(|edge| [edge.tangent, edge.director]);
            edges.flatten().chain(frames.twist.iter().copied()).map(|x| x.eps).collect()
        };
        assert_agree(all(&found), all(&exact));
    }
}
