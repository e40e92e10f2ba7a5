//! Time of the shipped fits without start values, with and without the estimate of their discretization errors. Prints the
//! cost of each fit in full simulations.
//!
//! `cargo bench --package rodfit-benches --bench fit`

use criterion::{Criterion, criterion_group, criterion_main};
use rodfit::fit::{Analysis, FitFile, Refinement};

/// Fits of E of the cantilever, of beta, and of E of the helix, with 20 samples each.
fn shipped(c: &mut Criterion) {
    let mut group = c.benchmark_group("shipped fit");
    group.sample_size(20);
    for file in ["cantilever-fit.toml", "beta-fit.toml", "helix-fit.toml"] {
        let fit = FitFile::load(format!("{}/../data/{file}", env!("CARGO_MANIFEST_DIR")))
            .expect("shipped")
            .fit();
        let report = fit.solve().expect("a fit");
        println!("{file}: {:.2} simulations", report.simulations);
        group.bench_function(file, |b| b.iter(|| fit.solve()));
        let none = Analysis { discretization_error: Refinement::None, ..Analysis::default() };
        let plain = fit.analyse(none);
        group.bench_function(format!("{file}, no discretisation error"), |b| {
            b.iter(|| plain.solve())
        });
    }
    group.finish();
}

criterion_group!(benches, shipped);
criterion_main!(benches);
