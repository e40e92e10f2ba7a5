use rodfit::*;
fn main() -> Result<(), Error> {
    let mut scene = Scene::load("data/cantilever.toml")?;
    for (beta, h) in [(0.5,1e-3)] {
        let t = scene.time.as_mut().unwrap();
        t.beta=beta; t.step=h; t.end=0.8;
        scene.supports.clamp = scene::Clamp::Nodes;
        let p = scene.problem()?;
        let tr = p.simulate()?;
        let d: Vec<f64> = (0..tr.times().len()).map(|k| -tr.tip(k)[1]/0.5).collect();
        let par = |a: f64,b: f64,c: f64| b + (a-c)*(a-c)/(8.0*(2.0*b - a - c));
        let (mut mx, mut mn) = (0,0);
        for k in 0..d.len() { let t=tr.times()[k]; if t>=0.15 && t<=0.45 && (mx==0 || d[k]>d[mx]) {mx=k} if t>=0.45&&t<=0.75&&(mn==0||d[k]<d[mn]) {mn=k} }
        println!("{beta} {h} {:.6} {:.6} {:?} {:?}", par(d[mx-1],d[mx],d[mx+1]), par(d[mn-1],d[mn],d[mn+1]), tr.work(), tr.stepping());
    }
    Ok(())
}
