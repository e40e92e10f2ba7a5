//! Mesh, step and scheme for a motion.
//!
//! Errors of mesh and step hardly depend on each other. So [steps](crate::resolution::steps) are found on a coarse mesh, and edges doubled
//! in steps that are a few times too large, until the differences between one mesh and the next say what finer ones leave. Then
//! the cheapest mesh and step are taken that leave little enough [together](crate::resolution::mix); only the run itself is as
//! fine as it must be.

use crate::error::Error;
use crate::problem::Problem;
use crate::resolution::aim::{Found, allowed_edges, order_of_mesh};
use crate::resolution::ladder::Ladder;
use crate::resolution::mix::{Finest, Mixed, mixed};
use crate::resolution::off::Off;
use crate::resolution::runs::Runs;
use crate::resolution::tried::Steps;
use crate::scene::resolution::Bound;
use crate::scene::{Scene, Scheme};

/// Part of the accuracy that mesh and step may take each in the finest runs that are looked at, or in what these reach.
const PART: f64 = 0.45;
/// How many times as fine as the finest of three meshes that were looked at, or of two, the one that is chosen may be; and how
/// coarse.
const FAR: [f64; 2] = [3.0, 2.5];
const COARSER: f64 = 0.5;
/// What two meshes alone say counts so many times.
const UNSURE: f64 = 1.0;
/// Where steps of another scheme are taken than those that meshes are compared in, what meshes are off by counts so many times:
/// large steps of the first hide some of what finer edges change.
const HIDDEN: f64 = 1.2;
/// What small motions are off by counts so many times more for every length that loads would bend the rod by.
const BENT: f64 = 1.6;
/// Meshes that are looked at for the cheapest are finer by this factor, and have so many edges at least.
const NEXT: f64 = 1.09;
const FEWEST: f64 = 4.0;
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
        let (own, given) = (guess.segments(), !open.segments);
        let asked = self.scene.asked();
        let part = PART * asked;
        let coarse_mesh = if given { coarser(guess) } else { own };
        let steps = match open.step {
            true => self.steps(coarse_mesh, first, part)?,
            false => self.given_steps(coarse_mesh, part)?,
        };
        let meshes = match given && self.comes_with_points() {
            true => {
                let finest = Finest { off: Off::none(1.0), range: [1.0; 2] };
                Meshes { edges: own, finest, bound: None }
            }
            false => self.edges((coarse_mesh, own), steps.coarse, part)?,
        };
        let mut chosen = self.chosen(&meshes, &steps)?;
        if self.runs.small.is_some() {
            let (edges, step, ..) = chosen.0;
            if let Some(steps) = self.rivals((edges, step), part)? {
                chosen = self.chosen(&meshes, &steps)?;
            }
        }
        Ok(chosen)
    }

    /// The cheapest of these meshes and steps.
    fn chosen(&self, meshes: &Meshes, steps: &Steps) -> Result<(Found, Scheme), Error> {
        let Runs { guess, open, .. } = &self.runs;
        let (time, asked) = (guess.time()?, self.scene.asked());
        let mut finest = [&meshes.finest, &steps.finest].map(Finest::clone);
        match self.runs.small {
            Some(bent) => finest = finest.map(|finest| finest.times(1.0 + BENT * bent)),
            None if steps.scheme != time.scheme => finest[0] = finest[0].times(HIDDEN),
            None => {}
        }
        let Mixed { mesh, step: finer, error } =
            mixed(self.meshes(meshes).into_iter(), &finest[0], &finest[1], asked);
        let segments = (mesh * meshes.edges as f64 - 1e-6).ceil() as usize;
        let segments = match open.segments {
            true => allowed_edges(self.scene, segments),
            false => guess.segments(),
        };
        let count = (time.end * finer / steps.step - 1e-6).ceil().max(1.0);
        let step = if open.step { time.end / count } else { time.step };
        // Where all was open and nothing was in the way, this is the end of what runs say.
        let bound = steps.bound.or(meshes.bound).filter(|_| error > asked);
        Ok(((segments, step, Some(error), bound), steps.scheme))
    }

    /// The meshes that may be chosen, by how many times as fine as the finest that was looked at they are.
    fn meshes(&self, Meshes { edges, finest, .. }: &Meshes) -> Vec<f64> {
        let (edges, [least, most]) = (*edges as f64, finest.range);
        if least == most {
            return vec![least];
        }
        let count = ((most / least).ln() / NEXT.ln()).ceil() as i32;
        let number = |k| (edges * (least * NEXT.powi(k)).min(most)).max(FEWEST).ceil() as usize;
        let mut numbers: Vec<usize> =
            (0..=count).map(|k| allowed_edges(self.scene, number(k))).collect();
        numbers.dedup();
        numbers.into_iter().map(|number| number as f64 / edges).collect()
    }

    /// Whether the mesh is that of a polyline's points.
    fn comes_with_points(&self) -> bool {
        self.scene.rod.segments.is_none()
    }

    /// Meshes down to about what makes no more than `allowed`, in steps of one length: from a mesh, and the scene's own
    /// where it has one.
    fn edges(
        &self,
        (first, own): (usize, usize),
        (step, scheme): (f64, Scheme),
        allowed: f64,
    ) -> Result<Meshes, Error> {
        let (end, order) = (self.runs.guess.time()?.end, order_of_mesh(self.scene));
        let seen = |edges: usize, step: f64| {
            Ok::<_, Error>(self.runs.run((edges, step, scheme))?.map(|ran| ran.seen))
        };
        let found =
            |edges, off, range, bound| Ok(Meshes { edges, finest: Finest { off, range }, bound });
        let mut ladder = Ladder::new(UNSURE);
        if !self.runs.open.segments {
            ladder.add(seen(first, step)?);
            ladder.add(seen(own, step)?);
            let ratio = own as f64 / first as f64;
            let off = match ladder.apart() {
                [] => Off::none(order),
                _ => ladder.last_change((ratio.powf(order) - 1.0).max(0.1).recip(), order),
            };
            return found(own, off, [1.0; 2], Some(Bound::Given));
        }
        let (mut edges, mut step) = (first, step);
        loop {
            let ran = seen(edges, step)?;
            let failed = ran.is_none();
            ladder.add(ran);
            if failed || ladder.apart().len() >= ORDERLESS && ladder.off(order).is_none() {
                // Finer edges may not take the steps that coarse ones take: all again in smaller ones.
                step *= 0.5;
                if end / step * edges as f64 > self.runs.most_work {
                    return found(edges, Off::unknown(order), [1.0; 2], Some(Bound::Work));
                }
                ladder = Ladder::new(UNSURE);
                edges = (edges / 4).max(first);
                continue;
            }
            if let Some((off, far)) = ladder.reaches(allowed, order, FAR) {
                return found(edges, off, [COARSER, far], None);
            }
            if 2.0 * end / step * 2.0 * edges as f64 > self.runs.most_work {
                let off = ladder.last_change(1.0, order);
                return found(edges, off, [1.0; 2], Some(Bound::Work));
            }
            edges *= 2;
        }
    }
}

/// What is found of meshes.
struct Meshes {
    /// Edges of the finest that was looked at.
    edges: usize,
    finest: Finest,
    bound: Option<Bound>,
}

/// Fewer edges than a problem's own.
fn coarser(problem: &Problem) -> usize {
    let (own, scene) = (problem.segments(), problem.scene());
    let path = scene.supports.path.is_some();
    if path { 2 * own } else { (own / 2).max(2) }
}
