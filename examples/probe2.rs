use rodfit::*; use rodfit::rod::Rod; use std::time::Instant; use std::hint::black_box;
fn time(name:&str, mut f: impl FnMut()) { let mut best=f64::MAX; for _ in 0..20 { let s=Instant::now(); for _ in 0..2000 {f()} best=best.min(s.elapsed().as_secs_f64()/2000.0);} println!("{name} {:.3} us", best*1e6); }
fn main() -> Result<(), Error> {
    let scene = Scene::load("data/cantilever.toml")?;
    let p = scene.problem()?;
    let mut sim = p.simulation();
    for k in 1..300 { sim.step_to(k as f64*1e-3)?; }
    let q = sim.state().q.clone(); let rod = p.rod();
    let mut g = vec![0.0; q.len()]; let mut k = banded::BandMatrix::zeros(q.len()); let mut f = banded::Ldlt::with_order(q.len()); let mut r = vec![0.0; q.len()];
    for d in [Derivatives::Hand, Derivatives::Dual] {
    time("tangent", || rod.tangent(black_box(&q), d, &mut g, &mut k));
    time("gradient", || rod.gradient(black_box(&q), d, &mut g)); }
    rod.tangent(&q, Derivatives::Hand, &mut g, &mut k);
    time("factor", || f.factor_sum(rod.mass(), 1.0, black_box(&k), 1e-6/4.0, p.free()).unwrap());
    time("solve", || { r.copy_from_slice(&g); f.solve(black_box(&mut r)) });
    time("abs", || { k.absolute_product(black_box(&q), &mut r) });
    time("clear", || { k.clear(); black_box(&mut k); });
    let t=Instant::now(); let n=sim.work(); for k in 300..1300 { sim.step_to(k as f64*1e-3)?; } let w=sim.work();
    println!("step {:.3} us, its {}", t.elapsed().as_secs_f64()*1e3, w.newton_iterations-n.newton_iterations);
    Ok(())
}
