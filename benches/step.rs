//! Time of a step: the parts of a Newton iteration, the band solver against faer's sparse LDL^T, the cost of sensitivities,
//! and the time per step over the number of segments with its exponent.
//!
//! `cargo bench --package rodfit-benches --bench step`; `cargo bench --package rodfit-benches --bench step -- scaling`
//! prints the exponent as well.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Conj, Mat, Par, Side};
use rodfit::numerics::tangent::{Factors, Tangent};
use rodfit::problem::Model;
use rodfit::rod::Rod;
use rodfit::scene::Scheme;
use rodfit::{AnyProblem, Derivatives, Discretized, Parameter, Problem, Scene, Trajectory};
use std::hint::black_box;
use std::time::Duration;

/// Folder of the shipped scenes.
const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../data");
/// Names of the shipped scenes: a planar and a spatial one.
const SCENES: [&str; 2] = ["cantilever", "helix"];

/// A shipped scene with this number of segments and steps.
fn scene(name: &str, segments: usize, steps: usize) -> Problem {
    let mut scene = Scene::load(format!("{DATA}/{name}.toml")).expect("shipped scene");
    scene.rod.segments = Some(segments);
    if let Some(time) = &mut scene.time {
        time.end = steps as f64 * time.step_size();
    }
    scene.problem().expect("a valid scene")
}

/// The parts of an iteration for both scenes with 50 segments.
fn iterations(c: &mut Criterion) {
    for name in SCENES {
        match scene(name, 50, 1000).discretized() {
            AnyProblem::Planar(discretized) => iteration(c, name, &discretized),
            AnyProblem::Spatial(discretized) => iteration(c, name, &discretized),
        }
    }
}

/// The parts of a Newton iteration after 200 steps of 1 ms: gradient and tangent (by hand and by dual numbers), factorization and
/// solution by the band solver, and the same matrix in faer.
fn iteration<M: Model>(c: &mut Criterion, name: &str, discretized: &Discretized<'_, M>) {
    let mut simulation = discretized.simulation().unwrap();
    for k in 1..=200 {
        simulation.step_to(f64::from(k) * 1e-3).expect("a step");
    }
    let (rod, free) = (discretized.rod(), discretized.free());
    // The frames of the step before, as in the middle of an iteration.
    let (q, frames) = (&simulation.state().q, &simulation.previous().frames);
    let (mut gradient, mut tangent) = (vec![0.0; q.len()], rod.zero_tangent());
    rod.tangent(q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
    let end = 1e-6 / 4.0;
    // The tangent of a step: masses plus the stiffness times the square of the step over 4 (beta 1/2).
    let mut factors = tangent.new_factors();
    let mut group = c.benchmark_group(format!("{name}, 50 segments"));
    for route in [Derivatives::Hand, Derivatives::Dual] {
        group.bench_function(format!("gradient, {route:?}"), |b| {
            b.iter(|| rod.gradient(black_box(q), frames, route, &mut gradient))
        });
        group.bench_function(format!("gradient and tangent, {route:?}"), |b| {
            b.iter(|| rod.tangent(black_box(q), frames, route, &mut gradient, &mut tangent))
        });
    }
    // The linear solver alone, then a whole iteration.
    let mass = rod.mass();
    group.bench_function("factor", |b| {
        b.iter(|| factors.factor_sum(mass, 1.0, black_box(&tangent), end, free.clone()))
    });
    let mut x = gradient.clone();
    group.bench_function("solve", |b| {
        b.iter(|| {
            x.copy_from_slice(&gradient);
            factors.solve(black_box(&mut x));
        })
    });
    group.bench_function("Newton iteration", |b| {
        b.iter(|| {
            rod.tangent(black_box(q), frames, Derivatives::Hand, &mut gradient, &mut tangent);
            factors.factor_sum(mass, 1.0, &tangent, end, free.clone()).expect("regular");
            x.copy_from_slice(&gradient);
            factors.solve(&mut x);
        })
    });

    // The same matrix in faer: symbolic work done before, numeric factor and solve measured.
    let n = free.len();
    let entry = |i: usize, j: usize| {
        let mass = if i == j { mass[i] } else { 0.0 };
        mass + end * tangent.get(i, j)
    };
    let upper: Vec<Triplet<usize, usize, f64>> = free
        .clone()
        .flat_map(|j| (j..tangent.coupled(j, free.end).end).map(move |i| (i, j)))
        .map(|(i, j)| Triplet::new(j - free.start, i - free.start, entry(i, j)))
        .collect();
    let sparse = SparseColMat::try_new_from_triplets(n, n, &upper).expect("a matrix");
    let symbolic = factorize_symbolic_cholesky(
        sparse.symbolic(),
        Side::Upper,
        SymmetricOrdering::Identity,
        Default::default(),
    )
    .expect("symbolic factors");
    let mut values = vec![0.0; symbolic.len_val()];
    let room = symbolic
        .factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default())
        .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
    let mut memory = MemBuffer::new(room);
    let rhs = Mat::from_fn(n, 1, |i, _| gradient[free.start + i]);
    let mut solution = rhs.clone();
    group.bench_function("faer sparse LDL^T factor and solve", |b| {
        b.iter(|| {
            let stack = MemStack::new(&mut memory);
            let factors = symbolic
                .factorize_numeric_ldlt(
                    &mut values,
                    black_box(sparse.as_ref()),
                    Side::Upper,
                    Default::default(),
                    Par::Seq,
                    stack,
                    Default::default(),
                )
                .expect("regular");
            solution.copy_from(&rhs);
            factors.solve_in_place_with_conj(Conj::No, solution.as_mut(), Par::Seq, stack);
        })
    });
    group.bench_function("band LDL^T factor and solve", |b| {
        b.iter(|| {
            factors.factor_sum(mass, 1.0, &tangent, end, free.clone()).expect("regular");
            x.copy_from_slice(&gradient);
            factors.solve(black_box(&mut x));
        })
    });
    group.finish();
}

/// Wall time of `steps` steps with derivatives of the tip by `parameters`, without output.
fn stepping(problem: &Problem, steps: usize, parameters: &[Parameter]) -> Duration {
    let tip = problem.nodes() - 1;
    let mut trajectory = Trajectory::new(problem, &[tip], parameters).expect("a record");
    trajectory.run(problem, steps, |_| {}).expect("a run");
    trajectory.stepping()
}

/// Time of 1000 steps with 0, 1, 2 and 4 parameters, and the ratio of one sensitivity to none.
fn runs(c: &mut Criterion) {
    let all = [Parameter::YoungsModulus, Parameter::Density, Parameter::Radius, Parameter::Beta];
    for name in SCENES {
        let problem = scene(name, 50, 1000);
        let mut group = c.benchmark_group(format!("{name}, 1000 steps of 1 ms"));
        group.sample_size(20);
        for count in [0, 1, 2, 4] {
            group.bench_function(BenchmarkId::new("sensitivities", count), |b| {
                b.iter(|| stepping(&problem, 1000, &all[..count]))
            });
        }
        group.finish();
        // Pairs in alternation, so that a slow period of the machine affects both.
        let mut ratios: Vec<f64> = (0..31)
            .map(|_| {
                let plain = stepping(&problem, 1000, &[]);
                stepping(&problem, 1000, &all[..1]).as_secs_f64() / plain.as_secs_f64()
            })
            .collect();
        ratios.sort_by(f64::total_cmp);
        println!("{name}: one sensitivity over the plain run, median of 31: {:.2}", ratios[15]);
    }
}

/// The scaling of four schemes.
fn scaling(_: &mut Criterion) {
    for scheme in [Scheme::NewmarkBeta, Scheme::Rodas4, Scheme::Verlet, Scheme::Pefrl] {
        scaling_of(scheme);
    }
}

/// Prints the time per step for 10 to 100 000 segments, and its exponent by a least-squares line in logarithms. The median of
/// seven runs counts.
fn scaling_of(scheme: Scheme) {
    for name in SCENES {
        let mut points = Vec::new();
        for segments in [10, 100, 1000, 10_000, 100_000] {
            // A coarse polygon of a helix is a different rod: the turning angle per edge is kept for all sizes.
            let steps = (200_000 / segments).clamp(20, 2000);
            let mut problem = match name {
                "helix" => long_helix(segments, steps),
                _ => scene(name, segments, steps),
            };
            if scheme != Scheme::NewmarkBeta {
                problem = with_scheme(&problem, scheme, steps);
            }
            let mut runs: Vec<(f64, f64)> = (0..7)
                .map(|_| {
                    let mut trajectory = Trajectory::new(&problem, &[], &[]).expect("a record");
                    trajectory.run(&problem, steps, |_| {}).expect("a run");
                    let time = trajectory.stepping().as_secs_f64() / steps as f64;
                    (time, trajectory.work().newton_iterations as f64 / steps as f64)
                })
                .collect();
            runs.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (time, iterations) = runs[3];
            println!(
                "{name}, {scheme:?}, {segments:7} segments: {:10.2} us a step, {iterations:.2} iterations",
                1e6 * time
            );
            points.push(((segments as f64).ln(), time.ln()));
        }
        // Slope of the least-squares line through all five points.
        let n = points.len() as f64;
        let [x, y] = [0, 1].map(|c| points.iter().map(|p| [p.0, p.1][c]).sum::<f64>() / n);
        let slope = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>()
            / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>();
        println!("{name}, {scheme:?}: time per step goes with segments^{slope:.3}");
    }
}

/// The problem with another scheme; explicit schemes have nine tenths of their largest stable step.
fn with_scheme(problem: &Problem, scheme: Scheme, steps: usize) -> Problem {
    let mut scene = problem.scene().clone();
    if let Some(time) = &mut scene.time {
        time.scheme = scheme;
    }
    let largest = match scene.problem().expect("a valid scene").discretized() {
        AnyProblem::Planar(discretized) => discretized.largest_step().unwrap(),
        AnyProblem::Spatial(discretized) => discretized.largest_step().unwrap(),
    };
    if let (Some(time), Some(largest)) = (&mut scene.time, largest) {
        time.step = Some(0.9 * largest);
        time.end = steps as f64 * time.step_size();
    }
    scene.problem().expect("a valid scene")
}

/// A helix whose length is proportional to its number of segments, without gravity but with a force at its tip.
fn long_helix(segments: usize, steps: usize) -> Problem {
    let mut scene = Scene::load(format!("{DATA}/helix.toml")).expect("shipped scene");
    if let rodfit::scene::Shape::Helix { length, .. } = &mut scene.rod.shape {
        *length = 0.01 * segments as f64;
    }
    scene.rod.segments = Some(segments);
    scene.loads.gravity = [0.0; 3];
    let force = [0.0, 0.0, -0.1];
    scene.loads.point = vec![rodfit::scene::PointForce { force, ..Default::default() }];
    if let Some(time) = &mut scene.time {
        time.end = steps as f64 * time.step_size();
    }
    scene.problem().expect("a valid scene")
}

criterion_group!(benches, iterations, runs, scaling);
criterion_main!(benches);
