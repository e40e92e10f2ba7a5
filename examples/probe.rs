use rodfit::*;
fn main() -> Result<(), Error> {
    let mut scene = Scene::load("data/cantilever.toml")?;
    for end in [5.0] {
    for i in [-1,0,1] {
        let e = 10f64.powf(7.0 + i as f64*0.5);
        scene.material.youngs_modulus = e;
        scene.time.as_mut().unwrap().end = end;
        let p = scene.problem()?;
        let tr = match p.simulate() { Ok(t)=>t, Err(er)=>{println!("{e:e} {er}"); continue}};
        let samples = (1..=(end*100.0) as usize).map(|k| { let x = tr.at(Point::Tip, k as f64*0.01).unwrap().0; fit::Sample{time: k as f64*0.01, position:[Some(x[0]),Some(x[1]),None]} }).collect();
        let full = tr.stepping().as_secs_f64();
        match Fit::new(&p).observe(Observation::new(samples)).identify(Parameter::YoungsModulus).solve() {
          Ok(f) => println!("{e:e} err {:.1e} sims {:.2} t {:.3} full {:.3} {} {:?}", f.parameters[0].value.unwrap()/e-1.0, f.simulations, f.wall_seconds, full, f.status, f.warnings),
          Err(er) => println!("{e:e} {er}"),
        }
    } }
    Ok(())
}
