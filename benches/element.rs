//! Time of one element: value, gradient and Hessian of a planar bend, a planar stretch and a spatial bend-twist element, by
//! hand-derived formulas and by dual numbers (num-dual). Measured by criterion.
//!
//! `cargo bench --package rodfit-benches --bench element`

use criterion::{Criterion, criterion_group, criterion_main};
use rodfit::energy::bend_twist::{self, BendTwist, Stiffness};
use rodfit::energy::frame::EdgeFrame;
use rodfit::energy::{Element, PlanarBend, Stretch, dual_gradient, dual_tangent};
use std::hint::black_box;

/// Planar elements: single calls, and 50 bend elements in sequence with their sums, as in a simulation.
fn elements(c: &mut Criterion) {
    let bend = PlanarBend { stiffness: 4.9, natural_curvature: 0.02 };
    let q = [0.0, 0.0, 0.01, 0.0012, 0.0198, 0.0031];
    let mut group = c.benchmark_group("planar bend");
    group.bench_function("energy", |b| b.iter(|| bend.energy(black_box(&q))));
    group.bench_function("gradient, hand", |b| b.iter(|| bend.gradient(black_box(&q))));
    group.bench_function("gradient, num-dual", |b| b.iter(|| dual_gradient(&bend, black_box(&q))));
    group.bench_function("energy, gradient and Hessian, hand", |b| {
        b.iter(|| bend.tangent(black_box(&q)))
    });
    group.bench_function("energy, gradient and Hessian, num-dual", |b| {
        b.iter(|| dual_tangent(&bend, black_box(&q)))
    });
    group.finish();

    // As a simulation uses it: one element after the other, the sums kept, nothing returned.
    let elements: Vec<(PlanarBend<f64>, [f64; 6])> = (0..50)
        .map(|i| {
            let bend = PlanarBend { stiffness: 4.9, natural_curvature: 1e-3 * f64::from(i) };
            (bend, q.map(|x| x * (1.0 + 1e-3 * f64::from(i))))
        })
        .collect();
    c.bench_function("50 planar bends: energy, gradient and Hessian, hand", |b| {
        b.iter(|| {
            let (mut energy, mut gradient, mut hessian) = (0.0, [0.0; 6], [[0.0; 6]; 6]);
            for (element, q) in black_box(&elements[..]) {
                let local = element.tangent(q);
                energy += local.energy;
                for r in 0..6 {
                    gradient[r] += local.gradient[r];
                    for c in 0..=r {
                        hessian[r][c] += local.hessian[r][c];
                    }
                }
            }
            (energy, gradient, hessian)
        })
    });

    // The stretch element is the cheapest one: dual numbers cost least there.
    let stretch = Stretch::<f64, 2> { stiffness: 7854.0, rest_length: 0.0101, natural_strain: 0.0 };
    let q = [0.0, 0.0, 0.01, 0.0012];
    let mut group = c.benchmark_group("planar stretch");
    group.bench_function("gradient and Hessian, hand", |b| {
        b.iter(|| stretch.tangent(black_box(&q)))
    });
    group.bench_function("gradient and Hessian, num-dual", |b| {
        b.iter(|| dual_tangent(&stretch, black_box(&q)))
    });
    group.finish();
}

/// The spatial bend-twist element: 11 unknowns, by hand, by dual numbers on the edges, and by dual numbers on all unknowns.
fn spatial(c: &mut Criterion) {
    let frame = |t: [f64; 3], d: [f64; 3]| EdgeFrame { tangent: t, director: d };
    let element = BendTwist {
        stiffness: Stiffness { bend: [0.49, 0.05, 0.3], twist: 0.2, coupling: [0.01, -0.02] },
        natural: [0.3, -0.2, 0.05],
        frames: [
            frame([1.0, 0.0, 0.0], [0.0, 0.6, 0.8]),
            frame([0.8, 0.6, 0.0], [-0.48, 0.64, 0.6]),
        ],
        twist: 0.1,
    };
    let q = [0.0, 0.0, 0.0, 0.2, 0.0101, 0.0004, 0.0003, 0.3, 0.0178, 0.0068, -0.0005];
    // Dual numbers on the edges use that the energy depends on edge vectors only; those on all unknowns do not.
    let mut group = c.benchmark_group("spatial bend and twist");
    group.bench_function("energy", |b| b.iter(|| element.energy(black_box(&q))));
    group.bench_function("gradient, hand", |b| b.iter(|| element.gradient(black_box(&q))));
    group.bench_function("gradient, num-dual", |b| {
        b.iter(|| bend_twist::dual_gradient(&element, black_box(&q)))
    });
    group.bench_function("energy, gradient and Hessian, hand", |b| {
        b.iter(|| element.tangent(black_box(&q)))
    });
    group.bench_function("energy, gradient and Hessian, num-dual on the edges", |b| {
        b.iter(|| bend_twist::dual_tangent(&element, black_box(&q)))
    });
    group.bench_function("energy, gradient and Hessian, num-dual on all unknowns", |b| {
        b.iter(|| dual_tangent(&element, black_box(&q)))
    });
    group.finish();
}

criterion_group!(benches, elements, spatial);
criterion_main!(benches);
