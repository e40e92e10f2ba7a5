//! Mesh, step and scheme for a motion.
//!
//! Errors of mesh and step hardly depend on each other. So [steps](crate::resolution::steps) are found on a coarse mesh, and edges doubled
//! in steps that are a few times too large, until the differences between one mesh and the next say which will do;
//! only the run itself is as fine as it must be.

use crate::error::Error;
use crate::problem::Problem;
use crate::resolution::aim::{Found, PART, allowed_edges, order_of_mesh};
use crate::resolution::ladder::Ladder;
use crate::resolution::runs::Runs;
use crate::scene::resolution::Bound;
use crate::scene::{Scene, Scheme};

/// How many times as fine as the finest of three meshes that were looked at, or of two, the one that is chosen may be.
const FAR: [f64; 2] = [2.0, 1.5];
/// Most of the accuracy that the mesh may take where the step leaves some of its part.
const MOST: f64 = 0.5;
/// Differences of meshes without an order that show steps to be too large.
const ORDERLESS: usize = 3;

/// Where a resolution is looked for.
pub(super) struct Search<'a> {
    pub scene: &'a Scene,
    pub runs: Runs<'a>,
}

impl<'a> Search<'a> {
    pub fn new(scene: &'a Scene, guess: Scene) -> Result<Self, Error> {
        Ok(Self { scene, runs: Runs::new(scene, guess)? })
    }

    /// Mesh, step and scheme for the motion, from a first step, s.
    pub fn motion(&self, first: f64) -> Result<(Found, Scheme), Error> {
        let Runs { guess, open, .. } = &self.runs;
        let time = guess.time()?;
        let (own, given) = (guess.segments(), !open.segments);
        let asked = self.scene.asked();
        let part = PART * asked;
        let coarse_mesh = if given { coarser(guess) } else { own };
        let steps = match open.step {
            true => self.steps(coarse_mesh, first, part)?,
            false => self.given_steps(coarse_mesh, part)?,
        };
        let left = (2.0 * part - steps.error).clamp(part, MOST * asked);
        let (segments, mesh_error, mesh_bound) = match given && self.comes_with_points() {
            true => (own, 0.0, None),
            false => self.edges((coarse_mesh, own), steps.coarse, left)?,
        };
        let count = (time.end / steps.step - 1e-6).ceil().max(1.0);
        let step = if open.step { time.end / count } else { time.step };
        let error = steps.error + mesh_error;
        let bound = match (error > asked, steps.bound.or(mesh_bound)) {
            (false, _) => None,
            (true, Some(Bound::Work)) if open.any() => Some(Bound::Work),
            (true, _) => Some(Bound::Given),
        };
        Ok(((segments, step, Some(error), bound), steps.scheme))
    }

    /// Whether the mesh is that of a polyline's points.
    fn comes_with_points(&self) -> bool {
        self.scene.rod.segments.is_none()
    }

    /// The edges that make no more than `allowed`, in steps of one length: from a mesh, and the scene's own
    /// where it has one.
    fn edges(
        &self,
        (first, own): (usize, usize),
        (step, scheme): (f64, Scheme),
        allowed: f64,
    ) -> Result<(usize, f64, Option<Bound>), Error> {
        let (end, order) = (self.runs.guess.time()?.end, order_of_mesh(self.scene));
        let seen = |segments: usize, step: f64| {
            Ok::<_, Error>(self.runs.run((segments, step, scheme))?.map(|ran| ran.seen))
        };
        let mut ladder = Ladder::default();
        if !self.runs.open.segments {
            ladder.add(seen(first, step)?);
            ladder.add(seen(own, step)?);
            let ratio = own as f64 / first as f64;
            let error =
                ladder.apart().last().map(|apart| apart / (ratio.powf(order) - 1.0).max(0.1));
            return Ok((own, error.unwrap_or(0.0), Some(Bound::Given)));
        }
        let (mut segments, mut step) = (first, step);
        loop {
            let ran = seen(segments, step)?;
            let failed = ran.is_none();
            ladder.add(ran);
            if failed || ladder.apart().len() >= ORDERLESS && ladder.error(order).is_none() {
                // Finer edges may not take the steps that coarse ones take: all again in smaller ones.
                step *= 0.5;
                if end / step * segments as f64 > self.runs.most_work {
                    return Ok((segments, f64::INFINITY, Some(Bound::Work)));
                }
                ladder = Ladder::default();
                segments = (segments / 4).max(first);
                continue;
            }
            if let Some((finer, [error, order])) = ladder.reaches(allowed, order, FAR) {
                let chosen = (segments as f64 * finer.max(0.4)).ceil().max(4.0);
                let chosen = allowed_edges(self.scene, chosen as usize);
                let error = error * (segments as f64 / chosen as f64).powf(order);
                return Ok((chosen, error, None));
            }
            if 2.0 * end / step * 2.0 * segments as f64 > self.runs.most_work {
                let last = ladder.apart().last().copied().unwrap_or(f64::INFINITY);
                return Ok((segments, last, Some(Bound::Work)));
            }
            segments *= 2;
        }
    }
}

/// Fewer edges than a problem's own.
fn coarser(problem: &Problem) -> usize {
    let (own, scene) = (problem.segments(), problem.scene());
    let path = scene.supports.path.is_some();
    if path { 2 * own } else { (own / 2).max(2) }
}
