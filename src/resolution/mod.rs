//! Mesh, step and scheme where a scene leaves them to the program.
//!
//! A motion is looked at where the rod moves most freely: at its free ends, or halfway. Runs of which each is twice as
//! fine as the one before tell what the last is off by (`off`) and the order this falls with (`ladder`); what is chosen is as
//! fine as the error that is asked for needs it (`motion`, `steps`, `rival`, `mix`, `still`). Where loads bend the rod little its
//! small motions tell as well, at a fraction of the work (`small`). `cargo run --release --example accuracy -- costs` tells what
//! all that costs.

mod aim;
mod ladder;
mod mix;
mod motion;
mod off;
mod rival;
mod runs;
mod small;
mod steps;
mod still;
mod tried;

pub use aim::Aim;

use crate::error::Error;
use crate::problem::Problem;
use crate::problem::natural_turn::turning;
use crate::resolution::aim::{MOST_EDGES, OF_ACCURACY, allowed_edges, is_struck, solved_for};
use crate::resolution::motion::Search;
use crate::resolution::still::still;
use crate::scene::Scene;

/// Fewest edges of a first mesh, at an accuracy of 1 %; the number goes with the fourth root of the accuracy, as a
/// better one needs higher modes in the coarse runs too.
const FIRST_EDGES: f64 = 4.0;
/// The same where supports move or the rod starts with a velocity: that strikes higher modes than loads do.
const FIRST_EDGES_STRUCK: f64 = 8.0;
/// The same for what does not move, whose meshes cost little.
const FIRST_EDGES_STILL: f64 = 6.0;
/// Largest turn of an edge of a first mesh, rad.
const FIRST_TURN: f64 = 1.5;
/// First steps in the shortest of the times that a scene is made of, likewise, and fewest in all.
const FIRST_STEPS: f64 = 7.0;

impl Scene {
    /// Validates the scene, [chooses](self) mesh, step and scheme where they are left out, and builds what a
    /// simulation needs.
    ///
    /// # Errors
    /// [`Error::Invalid`] with file, key, what was found and what is allowed. Where something is to be chosen,
    /// those of a simulation.
    pub fn problem(&self) -> Result<Problem, Error> {
        self.problem_for(if self.time.is_some() { Aim::Motion } else { Aim::Rest })
    }

    /// The same, chosen for another aim.
    ///
    /// # Errors
    /// Those of [`problem`](Self::problem), and of what is aimed at.
    pub fn problem_for(&self, aim: Aim) -> Result<Problem, Error> {
        self.validate()?;
        let open = self.left_open();
        let checked = self.accuracy.is_some() && aim == Aim::Motion;
        if !open.any() && !checked {
            return self.posed();
        }
        let mut scene = self.clone();
        scene.read_shapes().map_err(|error| error.in_file(self.path.as_deref()))?;
        let edges = first_edges(&scene, aim)?;
        let step = first_step(&scene, edges)?;
        let guess = scene.resolved(edges, step);
        let mut work = 0.0;
        let mut scheme = guess.scheme();
        let (segments, step, error, bound) = match aim {
            Aim::Motion => {
                let search = Search::new(&scene, guess)?;
                let found;
                (found, scheme) = search.motion(step)?;
                work = search.runs.work.get();
                found
            }
            Aim::Guess => (edges, step, None, None),
            _ if !open.segments => (edges, step, None, None),
            Aim::Rest | Aim::Modes(_) => still(&scene, aim, (edges, step))?,
        };
        let mut scene = scene.resolved(segments, step).by(scheme);
        if let Some(resolution) = &mut scene.resolution {
            let known = error.filter(|error| error.is_finite());
            (resolution.error, resolution.bound, resolution.work) = (known, bound, work);
        }
        if aim == Aim::Motion {
            solved_for(&mut scene, OF_ACCURACY);
        }
        scene.posed()
    }
}

/// Edges of a first mesh.
fn first_edges(scene: &Scene, aim: Aim) -> Result<usize, Error> {
    let shape = &scene.rod.shape;
    let turning = turning(scene, shape.turning().unwrap_or(0.0), shape.length());
    let first = match aim {
        Aim::Motion if is_struck(scene) || scene.supports.path.is_some() => FIRST_EDGES_STRUCK,
        Aim::Motion => FIRST_EDGES,
        _ => FIRST_EDGES_STILL,
    };
    let fine = first * fineness(scene);
    let modes = if let Aim::Modes(count) = aim { 2.0 * count as f64 } else { 0.0 };
    let edges = fine.max(turning / FIRST_TURN).max(modes).ceil() as usize;
    if edges > MOST_EDGES {
        let found = format!("left out for a rod that needs {edges}");
        let allowed = format!("left out where {MOST_EDGES} are enough, or a number");
        return Err(Error::invalid("rod.segments", found, allowed));
    }
    Ok(allowed_edges(scene, edges))
}

/// How much finer first runs are than for an accuracy of 1 %.
fn fineness(scene: &Scene) -> f64 {
    (1e-2 / scene.asked()).max(1.0).powf(0.25)
}

/// A first step, s: a part of the shortest of the times that the scene is made of.
fn first_step(scene: &Scene, edges: usize) -> Result<f64, Error> {
    let Some(time) = &scene.time else { return Ok(0.0) };
    let (section, material) = scene.at(0.5);
    let (moments, length) = (section.moments(), scene.resolved(edges, 1.0).mesh()?.length);
    let [i1, i2] = moments.second_moments;
    let per_length = material.density * moments.area;
    let bending = material.youngs_modulus * i1.max(i2) / (per_length * length.powi(4));
    let size = |v: &[f64; 3]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
    let pulls = scene.loads.point.iter().chain(&scene.initial.point).map(|load| size(&load.force));
    let pull = pulls.sum::<f64>() / (per_length * length);
    let squares = [12.4 * bending, (size(&scene.loads.gravity) + pull) / length];
    let rates = [
        squares.into_iter().fold(0.0, f64::max).sqrt(),
        size(&scene.initial.velocity) / length,
        size(&scene.initial.angular_velocity),
    ];
    let shortest = std::f64::consts::TAU / rates.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    let frames = scene.supports.path.as_ref().map(|path| path.track()).transpose()?;
    let frame = frames.map_or(f64::INFINITY, |track| track.end() / track.times().len() as f64);
    let good = scene.supports.largest_good_step();
    Ok((shortest.min(time.end) / (FIRST_STEPS * fineness(scene))).min(good).min(frame))
}
