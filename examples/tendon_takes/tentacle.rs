//! The tentacle as a scene, its models, and their fits: two cones in series that hang from a clamp, pulled by two tendons.
//!
//! Each take is an experiment: an equilibrium under the tensions of the take, with the markers as a shape at rest. A
//! [`Model`] is the list of its parameters and the law of its material. [`fit`] identifies the parameters from some takes,
//! and [`predict`] computes the markers with given values.

use rodfit::fit::{Analysis, Experiment, FitReport, Refinement, RestShape, ShapePoint};
use rodfit::{Fit, Parameter, Point, Scene, Unknown};
use std::error::Error;

/// Radii of the cones at the clamp, where they meet and at the tip, m.
const RADII: [f64; 3] = [15.41e-3, 6.42e-3, 4.80e-3];
/// Length of the first cone, in which the tendons run, and of both, m.
const LENGTHS: [f64; 2] = [0.305, 0.360];
/// Directions of both tendons from the first material director towards the second, rad.
const DIRECTIONS: [f64; 2] = [30.0 * DEGREE, 150.0 * DEGREE];
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Arc lengths of the markers, and offsets from there along the tangent and both material directors, m.
const MARKERS: [(f64, [f64; 3]); 4] = [
    (0.1291, [0.0, 0.0, 0.025]),
    (0.2195, [0.0, 0.0, -0.021]),
    (0.2800, [0.0, 0.0, 0.020]),
    (0.3600, [0.008, 0.0, 0.0]),
];

/// Start values of the search: modulus, Pa, and density, kg/m^3.
const START: [f64; 2] = [3e5, 1200.0];
/// Bounds of the search, Pa and kg/m^3: equilibria of softer rods are slow to find.
const BOUNDS: [[f64; 2]; 2] = [[1e5, 1e6], [600.0, 2400.0]];

/// A steady state under constant tensions.
#[derive(Clone, Debug)]
pub struct Take {
    pub name: String,
    /// Tensions of both tendons, N.
    pub tensions: [f64; 2],
    /// Positions of the markers, m.
    pub markers: Vec<[f64; 3]>,
}

/// A model of the tentacle.
#[derive(Clone, Copy)]
pub struct Model {
    pub name: &'static str,
    /// Identified parameters.
    pub parameters: &'static [&'static str],
    /// Lines of `[material]` in addition to density and modulus.
    pub law: &'static str,
    /// Edges of the rod.
    pub segments: usize,
}

/// Young's modulus and density.
pub const BASIC: Model = Model {
    name: "E, rho",
    parameters: &["youngs_modulus", "density"],
    law: "poisson_ratio = 0.45",
    // Markers move by less than 0.7 mm on finer meshes.
    segments: 20,
};

/// Distance of the tendons from the axis at an arc length, m: they are parallel to the surface of the cone.
fn tendon_radius(arc_length: f64) -> f64 {
    11.4e-3 - 0.0295 * arc_length
}

/// The scene with these tensions of both tendons, N; a tendon without tension is left out.
pub fn scene(model: &Model, tensions: [f64; 2]) -> Result<Scene, rodfit::Error> {
    let [root, middle, tip] = RADII;
    let [joint, length] = LENGTHS;
    let mut text = format!(
        "[rod]\n\
         segments = {}\n\
         dimension = \"spatial\"\n\
         shape = {{ kind = \"straight\", length = {length}, direction = [0, 0, -1] }}\n\
         section = {{ kind = \"circle\", radius = {root} }}\n\
         [rod.taper]\n\
         radius = {{ at = [0, {joint}, {length}], factor = [1, {}, {}] }}\n\
         [material]\n\
         youngs_modulus = {}\n\
         density = {}\n\
         {}\n\
         [loads]\n\
         gravity = [0, 0, -9.81]\n",
        model.segments,
        middle / root,
        tip / root,
        START[0],
        START[1],
        model.law
    );
    for (tension, direction) in tensions.into_iter().zip(DIRECTIONS).filter(|(t, _)| *t > 0.0) {
        let place = |at: f64| {
            let [d1, d2] = [direction.cos(), direction.sin()].map(|x| x * tendon_radius(at));
            format!("{{ at = {at}, offset = [{d1}, {d2}] }}")
        };
        text += &format!(
            "[[actuation]]\nkind = \"tendon\"\ntension = {tension}\nroute = [{}, {}]\n",
            place(0.0),
            place(joint)
        );
    }
    Scene::from_toml(&text, ".")
}

/// A take as an experiment; `sigma` is the standard deviation of its coordinates, m, or `None` to estimate it.
fn experiment(model: &Model, take: &Take, sigma: Option<f64>) -> Result<Experiment, rodfit::Error> {
    let sightings = MARKERS.iter().zip(&take.markers).map(|((arc_length, offset), position)| {
        ShapePoint::new(Point::ArcLength(*arc_length), position.map(Some)).offset(*offset)
    });
    let mut shape = RestShape::new(sightings.collect());
    if let Some(sigma) = sigma {
        shape = shape.sigma(sigma);
    }
    Ok(Experiment::new(&take.name, &scene(model, take.tensions)?.problem()?).observe(shape))
}

/// The parameters of a model; modulus and density start at [`START`], others at their values in the scene.
fn unknowns(model: &Model) -> Result<Vec<Unknown>, rodfit::Error> {
    let unknown = |name: &&str| {
        let parameter: Parameter = name.parse()?;
        let unknown = Unknown::new(parameter);
        Ok(match *name {
            "youngs_modulus" => unknown.start(START[0]).bounds(BOUNDS[0][0], BOUNDS[0][1]),
            "density" => unknown.start(START[1]).bounds(BOUNDS[1][0], BOUNDS[1][1]),
            _ => unknown,
        })
    };
    model.parameters.iter().map(unknown).collect()
}

/// The fit of a model to some takes, with the whole analysis or without.
pub fn fit(model: &Model, takes: &[Take], analysed: bool) -> Result<FitReport, Box<dyn Error>> {
    let experiments = takes.iter().map(|take| experiment(model, take, None));
    let fit = Fit::of(experiments.collect::<Result<Vec<_>, _>>()?);
    let fit = unknowns(model)?.into_iter().fold(fit, Fit::identify);
    let fit = match analysed {
        true => fit,
        false => fit.analyse(Analysis {
            discretization_error: Refinement::None,
            sensitivity_analysis: Some(false),
            ..Analysis::default()
        }),
    };
    Ok(fit.solve()?)
}

/// Positions of the markers, m, of these takes with the `values` of the parameters of a model, in their units.
pub fn predict(
    model: &Model,
    takes: &[Take],
    values: &[f64],
) -> Result<Vec<Vec<[f64; 3]>>, Box<dyn Error>> {
    let experiments = takes.iter().map(|take| experiment(model, take, Some(1.0)));
    let fit = Fit::of(experiments.collect::<Result<Vec<_>, _>>()?);
    let residuals = unknowns(model)?.into_iter().fold(fit, Fit::identify).residuals()?;
    let scales = residuals.unknowns().iter().zip(values);
    let point: Vec<f64> = scales.map(|(unknown, value)| unknown.to_scale(*value)).collect();
    let differences = residuals.residuals(&point)?;
    // With a standard deviation of 1 m the residuals are predicted less measured coordinates, m.
    let of_take = |(take, own): (&Take, &[f64])| {
        let markers = take.markers.iter().zip(own.chunks(3));
        markers.map(|(marker, r)| std::array::from_fn(|c| marker[c] + r[c])).collect()
    };
    Ok(takes.iter().zip(differences.chunks(3 * MARKERS.len())).map(of_take).collect())
}
