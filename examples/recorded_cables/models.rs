//! The models of a cable by their parameters, from three to more than ten, and their fits from the results of simpler models.

use super::cable::Cable;
use rodfit::fit::FitReport;
use rodfit::scene::{Friction, Taper};
use rodfit::{Parameter, Scene, Unknown};
use std::collections::BTreeMap;
use std::error::Error;

/// A model: its name, the largest number of clips that it is fitted to, its edges between neighboring markers, and its
/// parameters.
pub struct Rung {
    pub name: &'static str,
    pub most: usize,
    pub edges: usize,
    pub numbers: Vec<String>,
}

/// The models for cables with this number of markers and of edges between neighboring ones, simplest first. The last two with
/// ten parameters are alternatives.
pub fn ladder(markers: usize, edges: usize) -> Vec<Rung> {
    let listed = |names: &[&str]| names.iter().map(|name| name.to_string()).collect::<Vec<_>>();
    let rung = |name, most, numbers: Vec<String>| Rung { name, most, edges, numbers };
    let bending =
        |marker: usize| ["d1", "d2"].map(|d| format!("rod.natural_bending.{}.{d}", marker * edges));
    let b3 = listed(&["youngs_modulus", "damping.stiffness", "damping.mass"]);
    let t5 = [b3.clone(), listed(&["rod.natural_curvature", "shear_modulus"])].concat();
    let friction =
        listed(&["loads.damping.friction.stiffness", "loads.damping.friction.curvature"]);
    let t7 = [t5.clone(), friction].concat();
    let along = ["rod.taper.youngs_modulus.0", "rod.taper.youngs_modulus.2", "rod.shape.scale"];
    let t10 = [t7.clone(), listed(&along)].concat();
    let without = |names: &[String], not: &[&str]| -> Vec<String> {
        names.iter().filter(|name| !not.contains(&name.as_str())).cloned().collect()
    };
    // The grippers do not hold the cable along its line: turning angles at their edges replace the drag.
    let turns = [1, markers - 2].into_iter().flat_map(bending).collect();
    let t10e = [without(&t7, &["damping.mass"]), turns].concat();
    // Curvatures of every marker include the factor on the curvature on the table.
    let curvatures = (1..markers - 1).flat_map(bending).collect();
    let k = [without(&t7, &["rod.natural_curvature"]), listed(&along[2..]), curvatures].concat();
    vec![
        rung("B3", 16, b3),
        rung("T5", 16, t5),
        rung("T7", 16, t7),
        rung("T10", 16, t10),
        rung("T10e", 16, t10e),
        rung("K", 16, k),
    ]
}

/// An estimate below this, in its unit, counts as zero.
const NOTHING: f64 = 1e-9;
/// Name of the curvatures in addition to those on the table.
const BENDING: &str = "rod.natural_bending";
/// Standard deviation of the prior of these curvatures, 1/m.
const SHARPEST: f64 = 2.0;

/// The start value of a parameter that no simpler model has, in SI units.
pub fn start(name: &str) -> f64 {
    match name {
        "youngs_modulus" => 1e8,
        "shear_modulus" => 5e7,
        "damping.stiffness" => 0.08,
        "damping.mass" => 0.2,
        "rod.natural_curvature" => 0.6,
        "loads.damping.friction.stiffness" => 1.0,
        "loads.damping.friction.curvature" => 1.5,
        _ if name.starts_with(BENDING) => 0.0,
        _ => 1.0,
    }
}

/// Values that a model found, by name, including those that are zero.
pub type Found = BTreeMap<String, f64>;

/// The scene of a model with these values; the start value for missing ones.
pub fn scene_of(cable: &Cable, rung: &Rung, found: &Found) -> Result<Scene, Box<dyn Error>> {
    let has = |part: &str| rung.numbers.iter().any(|name| name.contains(part));
    let mut scene = cable.scene(has("shear_modulus"), rung.edges);
    if has("friction") {
        scene.loads.damping.friction = Some(Friction { stiffness: 1.0, curvature: 1.5 });
    }
    if has("taper") {
        scene.rod.taper = Taper { youngs_modulus: Some(vec![1.0; 3].into()), ..Taper::default() };
    }
    if has("natural_bending") {
        scene.rod.natural_bending = vec![[0.0; 2]; cable.lengths.len() * rung.edges + 1];
    }
    if !has("damping.mass") {
        scene.loads.damping.mass = 0.0;
    }
    if has("natural_bending") && !has("rod.natural_curvature") {
        // Curvatures of its own go on from the table's as the model before found them.
        if let Some(value) = found.get("rod.natural_curvature") {
            "rod.natural_curvature".parse::<Parameter>()?.set(&mut scene, *value)?;
        }
    }
    for name in &rung.numbers {
        let value = found.get(name).copied().unwrap_or_else(|| start(name));
        name.parse::<Parameter>()?.set(&mut scene, value)?;
    }
    Ok(scene)
}

/// The start values from a simpler model. Parameters that it estimated as zero are omitted: the new model may need them.
pub fn kept(before: &Found) -> Found {
    before.iter().filter(|(_, x)| x.abs() > NOTHING).map(|(n, x)| (n.clone(), *x)).collect()
}

/// The start value of a parameter of a model that continues `from` a simpler one; none if it is to be scanned.
pub fn begin(name: &str, from: &Found) -> Option<f64> {
    match from.get(name) {
        Some(value) => Some(*value),
        // The modulus has no prior start value.
        None => (name != "youngs_modulus").then(|| start(name)),
    }
}

/// Fits a model to some clips, starting from the results of simpler ones.
pub fn fit(
    cable: &Cable,
    rung: &Rung,
    clips: &[usize],
    before: &Found,
) -> Result<(FitReport, Found), Box<dyn Error>> {
    let from = kept(before);
    let mut fit = cable.fit(&scene_of(cable, rung, &from)?, clips)?;
    for name in &rung.numbers {
        let unknown = Unknown::new(name.parse()?);
        // A common rotation of all curvatures about the cable gives the same cable: a prior keeps them near the table's.
        let unknown = match rung.name == "K" && name.starts_with(BENDING) {
            true => unknown.prior(0.0, SHARPEST),
            false => unknown,
        };
        fit = fit.identify(match begin(name, &from) {
            Some(value) => unknown.start(value),
            None => unknown,
        });
    }
    let report = fit.solve()?;
    // Values that these recordings do not determine, such as a turn of all curvatures about the cable, are kept as the fit
    // left them: the values of the other parameters depend on them.
    let left = report.local_minima.list.iter().find(|basin| basin.chosen);
    let mut found = before.clone();
    for name in &rung.numbers {
        let parameter: Parameter = name.parse()?;
        let Some(k) = report.parameters.iter().position(|e| e.name == parameter) else { continue };
        let left = left.and_then(|basin| basin.values.get(k).copied());
        if let Some(value) = report.parameters[k].value.or(left) {
            found.insert(name.clone(), value);
        }
    }
    Ok((report, found))
}
