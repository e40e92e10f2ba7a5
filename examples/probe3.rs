use rodfit::*;
fn main() -> Result<(), Error> {
    let n: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    let scene = Scene::load("data/cantilever.toml")?;
    let p = scene.problem()?;
    let ps = [Parameter::YoungsModulus, Parameter::Density, Parameter::Radius, Parameter::Beta];
    let mut t = Trajectory::new(&p, &[50], &ps[..n])?;
    t.run(&p, 1000, |_| {})?;
    println!("{:?} {:?}", t.stepping(), t.work());
    Ok(())
}
