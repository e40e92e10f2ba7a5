//! The start of a recording: where the rod is, how it lies about itself, and how fast it is, from the
//! first two frames of the markers along it.
//!
//! Markers are seen a little beside the rod, and their distances are not quite its edges' lengths. A rod
//! put right on them would begin stretched, and ring. So in both frames the rod takes the shape of least
//! energy with springs between its marked nodes and the markers: much weaker than the rod is along
//! itself, and much stronger than it is in bending. Edges between nodes that are both held are left out of that.
//!
//! The change from one frame to the other over the time between them is the velocity in the middle. Half of that time
//! times the acceleration takes it to the start: the acceleration that [a step
//! resolves](crate::dynamics::stepper::acceleration_within), since errors of places would else be taken for forces.
//!
//! Markers on the rod's line say nothing of its turn about itself. A curved rod is given the turn of least
//! energy before it relaxes, and goes on from there in the second frame; a straight one, whose energies would tell the
//! noise of the markers, lies as `up` of its section says. By how much more a hand holds it turned is a number of the
//! scene, the twist of `supports.motion`.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::scalar::Nestable;
use crate::numerics::tangent::{Factors, Singular, Tangent};
use crate::numerics::vector::sub;
use crate::problem::{
    Discretized, Framed, Model, NodeTie, Setup, UnknownsAndFrames, between_markers,
};
use crate::rod::{FactorsOf, Rod};
use crate::scene::prescribed_motion::MotionTime;
use crate::scene::{Recorded, Track};
use crate::statics::Descent;
use std::f64::consts::TAU;

/// Turns about itself that are tried before a rod relaxes.
const TURNS: usize = 12;
/// In so many sections of the room about the best of them the least energy is found to half a millionth of a turn.
const SECTIONS: usize = 26;
/// By how much edges are stiffer while the rod relaxes than they are: the springs, in between, then yield less to
/// bending, and still stretch it less. Much more would fold a rod that is longer than what was seen of it in one
/// of many ways.
const STIFFER: f64 = 30.0;
/// By how much the springs of held markers are stiffer than those of free ones.
const HELD: f64 = 1e3;

/// The unknowns in the first two frames, with the frames of the edges that all angles count from.
type Relaxed<D, M> = (UnknownsAndFrames<D, M>, Vec<D>);

/// The unknowns and frames at the start of a recording, how they change until its next frame, and how long that
/// takes, s.
type Start<D, M> = (UnknownsAndFrames<D, M>, (Vec<D>, f64));

impl<M: Model> Discretized<'_, M> {
    /// Where the recording starts, and how it goes on.
    pub(crate) fn recorded_start<D: Nestable>(
        &self,
        setup: &Setup<D, M>,
    ) -> Result<Start<D, M>, Error> {
        let track = self.track()?;
        let ((mut q, frames), next) = self.relaxed_over(setup, track)?;
        let change = q.iter().zip(&next).map(|(q0, q1)| *q1 - *q0).collect();
        self.turn_ends(setup, &mut q);
        if let Some(boundary_motion) = self.boundary_motion(setup) {
            let moment = MotionTime::Time(0.0);
            boundary_motion.advance::<M::Rod<D>>(moment, moment, &mut q, &frames);
        }
        Ok(((q, frames), (change, track.times()[1] - track.times()[0])))
    }

    /// How the rod lies between the hands when the recording starts, with the edges that they hold.
    pub(crate) fn recorded_shape<D: Nestable>(
        &self,
        setup: &Setup<D, M>,
    ) -> Result<UnknownsAndFrames<D, M>, Error> {
        let ((mut q, frames), _) = self.relaxed_over(setup, self.track()?)?;
        self.turn_ends(setup, &mut q);
        Ok((q, frames))
    }

    fn track(&self) -> Result<&Track, Error> {
        let path = self.scene().supports.path.as_ref();
        path.map_or_else(
            || Err(Error::invalid("supports.path", "no such table", "one beside a recorded start")),
            Recorded::track,
        )
    }

    /// The rod with springs to the markers of a frame.
    fn tied<D: Nestable>(
        &self,
        setup: &Setup<D, M>,
        track: &Track,
        frame: usize,
    ) -> Result<M::Rod<D>, Error> {
        let path = setup.scene.supports.path.as_ref();
        let segments = self.nodes() - 1;
        let nodes = path.map_or(Ok(Vec::new()), |path| path.nodes(segments))?;
        let led = self.led();
        let is_held = |node: usize| nodes.contains(&node) && self.is_held(node, &led);
        let time = track.times()[frame];
        // Between the two, however much stiffer the edges are.
        let stiffness = spring(setup, segments) * STIFFER.sqrt();
        let tie = |(node, marker): (&usize, &crate::scene::track::Marker)| {
            let stiffness = stiffness * if is_held(*node) { HELD } else { 1.0 };
            NodeTie { node: *node, point: marker.at(time), stiffness }
        };
        let ties: Vec<_> = nodes.iter().zip(track.markers()).map(tie).collect();
        // How long an edge is whose ends are both held makes no difference to the motion, and shall not pull them.
        let stiffer = |j: usize| if is_held(j) && is_held(j + 1) { 0.0 } else { STIFFER };
        Ok(setup.tied(self.model, stiffer, &ties))
    }

    /// The unknowns of both frames, in plain numbers; found when first asked for.
    fn relaxed(&self, track: &Track) -> Result<&[Vec<f64>], Error> {
        let start = &self.problem.start;
        if start.get().is_none() {
            let file = self.scene().path.as_deref();
            let found = self.relax(track).map_err(|error| error.in_file(file))?;
            // Another thread may have been quicker, and found the same.
            let _ = start.set(found);
        }
        Ok(start.get().map_or(&[], Vec::as_slice))
    }

    fn relax(&self, track: &Track) -> Result<Vec<Vec<f64>>, Error> {
        let (mut q, frames) = self.begin(self.setup);
        let rod = self.tied(self.setup, track, 0)?;
        if !self.problem.mesh.is_straight() || !self.scene().rod.natural_bending.is_empty() {
            turn_about_itself::<M>(&rod, &mut q, &frames);
        }
        let reference = frames.clone();
        let descend = |rod: &M::Rod<f64>, q: Vec<f64>, frames| {
            let scales = (self.problem.length(), self.negligible(None));
            let all = 0..q.len();
            let derivatives = self.problem.derivatives();
            let descent = Descent::new(rod, all, scales, None, derivatives, q);
            descent.holding(self.turn_springs()).descend(frames)
        };
        let first = descend(&rod, q, frames)?;
        let rod = self.tied(self.setup, track, 1)?;
        // From there by as much as the markers have gone.
        let mut q = first.q.clone();
        let [before, after] = [0, 1]
            .map(|frame| between_markers::<f64>(track, track.times()[frame], self.nodes() - 1));
        for (i, (before, after)) in before.iter().zip(&after).enumerate() {
            let way = self.model.components(sub(*after, *before));
            for c in 0..M::STRIDE.min(3) {
                q[M::STRIDE * i + c] += way[c];
            }
        }
        let second = descend(&rod, q, first.frames.clone())?;
        Ok([first, second]
            .into_iter()
            .map(|rest| {
                let mut q = rest.q;
                M::Rod::<f64>::refer(&mut q, &rest.frames, &reference);
                q
            })
            .collect())
    }

    /// The unknowns of both frames with the derivatives that `D` carries.
    fn relaxed_over<D: Nestable>(
        &self,
        setup: &Setup<D, M>,
        track: &Track,
    ) -> Result<Relaxed<D, M>, Error> {
        let (_, frames) = self.begin(setup);
        let found = self.relaxed(track)?;
        let mut both = [0, 1].map(|k| found[k].iter().map(|x| D::from(*x)).collect::<Vec<D>>());
        if D::ORDER > 0 {
            for (frame, q) in both.iter_mut().enumerate() {
                let rods = (self.tied(setup, track, frame)?, self.tied(self.setup, track, frame)?);
                let plain = self.begin(self.setup).1;
                self.follow_tied((&rods.0, &frames), (&rods.1, &plain), q)
                    .map_err(|singular| Error::Indifferent { node: singular.row / M::STRIDE })?;
            }
        }
        let [first, second] = both;
        Ok(((first, frames), second))
    }

    /// Springs, N m, on the angles of a rod that is tied to markers: weak, since they only hold what
    /// nothing else does, the turn of a straight rod about itself.
    fn turn_springs(&self) -> Vec<f64> {
        let angles = |(i, k): (usize, f64)| if M::Rod::<f64>::is_angle(i) { 10.0 * k } else { 0.0 };
        self.negligible(None).into_iter().enumerate().map(angles).collect()
    }

    /// Gives the unknowns `q` of a tied rod at rest, the second in plain numbers, their derivatives, by
    /// steps of Newton's method with the tangent of the plain rod: one, and one per order.
    fn follow_tied<D: Nestable>(
        &self,
        (rod, frames): Framed<'_, D, M>,
        (plain, plain_frames): Framed<'_, f64, M>,
        q: &mut [D],
    ) -> Result<(), Singular> {
        let n = q.len();
        let found: Vec<f64> = q.iter().map(|x| x.value()).collect();
        // What the springs bear there, against the same forces in the same angles.
        let (mut borne, mut tangent) = (vec![0.0; n], Tangent::zeros(n));
        plain.tangent(&found, plain_frames, Derivatives::Hand, &mut borne, &mut tangent);
        let springs = self.turn_springs();
        let mut factors = FactorsOf::<M::Rod<f64>, f64>::with_order(n);
        factors.factor_sum(&springs, 1.0, &tangent, 1.0, 0..n)?;
        let mut change = vec![D::from(0.0); n];
        for _ in 0..1 + D::ORDER {
            rod.gradient(q, frames, Derivatives::Hand, &mut change);
            for i in 0..n {
                change[i] += (q[i] - found[i]) * springs[i] - borne[i];
            }
            factors.solve(&mut change);
            for (q, change) in q.iter_mut().zip(&change) {
                *q -= *change;
            }
        }
        Ok(())
    }
}

/// The stiffness of the springs to free markers, N/m: between that of an edge along itself and that of
/// bending at its length.
fn spring<D: Nestable, M: Model>(setup: &Setup<D, M>, segments: usize) -> D {
    let (material, section) = (&setup.scene.material, setup.scene.rod.section.moments());
    let edge = setup.mesh.length * (segments as f64).recip();
    let [i1, _] = section.second_moments;
    material.youngs_modulus * (section.area * i1).sqrt() / (edge * edge)
}

/// Turns a rod as a whole about itself to where its energy is least: the best of a few turns, and the least about it by
/// golden sections. So where it relaxes to goes with the markers however they lie in the world.
fn turn_about_itself<M: Model>(
    rod: &M::Rod<f64>,
    q: &mut [f64],
    frames: &<M::Rod<f64> as Rod<f64>>::Frames,
) {
    if !M::Rod::<f64>::HAS_FRAMES {
        return;
    }
    let angles: Vec<usize> = (0..q.len()).filter(|i| M::Rod::<f64>::is_angle(*i)).collect();
    let begun: Vec<f64> = angles.iter().map(|i| q[*i]).collect();
    let turned = |turn: f64, q: &mut [f64]| {
        angles.iter().zip(&begun).for_each(|(i, begun)| q[*i] = begun + turn);
        rod.energies(q, frames).total()
    };
    let room = TAU / TURNS as f64;
    let energies: [f64; TURNS] = std::array::from_fn(|k| turned(k as f64 * room, q));
    let least = (0..TURNS).fold(0, |a, b| if energies[b] < energies[a] { b } else { a });
    let most = energies.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
    // A round rod that lies straight has the same energy in all of them.
    if most - energies[least] <= 1e-9 * most.abs() {
        turned(0.0, q);
        return;
    }
    let best = least as f64 * room;
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let [mut low, mut high] = [best - room, best + room];
    for _ in 0..SECTIONS {
        let part = golden * (high - low);
        match turned(high - part, q) < turned(low + part, q) {
            true => high = low + part,
            false => low = high - part,
        }
    }
    turned(0.5 * (low + high), q);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::SpatialModel;
    use crate::scene::{Dimension, Material, Scene, Section, Shape};

    /// A helix that lies as it would without stress but for its curvature has the least energy unturned, whatever turn
    /// it is given before.
    #[test]
    fn the_turn_of_least_energy_is_found_from_any_other() {
        let points = (0..13)
            .map(f64::from)
            .map(|s| [0.05 * s, 0.1 * (0.5 * s).sin(), 0.1 * (0.5 * s).cos()]);
        let shape = Shape::points(points.collect::<Vec<_>>());
        let material = Material { poisson_ratio: Some(0.4), ..Material::new(1100.0, 4e7) };
        let mut scene = Scene::new(12, shape, Section::Circle { radius: 2e-3 }, material);
        scene.rod.dimension = Dimension::Spatial;
        scene.rod.natural_curvature = 0.6.into();
        let problem = scene.problem().unwrap();
        let spatial = problem.spatial().unwrap();
        let (begun, frames) = spatial.begin(spatial.setup);
        let is_angle = |i: &usize| i % 4 == 3;
        for turn in [0.0, 0.2, -1.3, 3.0, 7.0] {
            let mut q = begun.clone();
            let angles: Vec<usize> = (0..q.len()).filter(is_angle).collect();
            angles.iter().for_each(|i| q[*i] += turn);
            turn_about_itself::<SpatialModel>(&spatial.rod(), &mut q, &frames);
            for i in angles {
                let left = q[i] - begun[i];
                let left = left - (left / TAU).round() * TAU;
                assert!(left.abs() < 1e-5, "from {turn}: {left:e}");
            }
        }
    }
}
