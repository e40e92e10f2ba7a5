//! Initial state of a rod whose motion was recorded: shape and twist in the first two frames of the markers, by
//! minimization of energy.
//!
//! Markers are measured with errors, and their distances differ from the lengths of the rod's edges. A rod placed
//! exactly on them would start with large axial forces. Therefore the rod, without loads and supports, takes the shape
//! of least energy in each frame, with springs between marked nodes and markers. For this its axial stiffness is
//! multiplied by [`AXIAL_FACTOR`]. The stiffness of a spring is the geometric mean of this axial stiffness and the
//! bending stiffness of an edge, and larger by the factor `HELD_FACTOR` at nodes whose positions are prescribed later.
//! An edge between two such marked nodes has no axial stiffness.
//!
//! The change between the two frames over the time between them is the velocity in the middle. The caller
//! extrapolates it to the start by half of that time times the acceleration that
//! [a step resolves](crate::dynamics::stepper::acceleration_within); otherwise measurement errors would act as
//! forces.
//!
//! Markers on the center line do not determine the rotation about it. A rod in space with a curved shape or
//! `rod.natural_bending` gets the rotation of least energy before it relaxes in the first frame. The second frame
//! starts from the result of the first. For a straight rod these energies would be noise; its section is oriented by
//! `up`. Additional twist by a gripper is a number of the scene, the twist of `supports.motion`.
//!
//! Output of `recorded_start`: [`RecordedStart`] with the unknowns (m, rad) in the first frame of the recording, and
//! the reference frames of the unrelaxed initial shape. The unknowns include the twist of grippers and the places that
//! supports prescribe at t = 0. The change to the second frame is without both. Unknowns, frames and change have
//! derivatives with respect to parameters if requested; the time between the frames, s, has none. `recorded_shape` is
//! the relaxed shape of the first frame with the twist, without the prescribed places. Errors: no `supports.path`, no
//! nodes at the markers, no equilibrium, and a singular tangent where derivatives are requested.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::prescribed_dofs::PrescribedDofs;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::{Factors, Singular, Tangent};
use crate::numerics::vector::sub;
use crate::problem::{
    Discretized, FramesOf, Model, NodeTie, Setup, UnknownsAndFrames, between_markers,
};
use crate::rod::{ReferenceFrames, Rod};
use crate::scene::prescribed_motion::MotionTime;
use crate::scene::{Recorded, Track};
use crate::statics::descent::{Descent, DescentSettings};
use std::f64::consts::TAU;

/// Number of rotations about the center line that are compared before a rod relaxes. More find narrower minima.
const ROTATIONS: usize = 12;
/// Golden sections around the best rotation, which locate the minimum to half a millionth of a rotation.
const SECTIONS: usize = 26;
/// Factor on the axial stiffness while the rod relaxes. The spring stiffness lies between the axial and the bending
/// stiffness; the factor increases both distances. Much more would buckle a rod that is longer than the recorded one in
/// one of many ways.
pub(crate) const AXIAL_FACTOR: f64 = 30.0;
/// Factor on the stiffness of the springs of markers on held nodes, whose positions are prescribed later.
const HELD_FACTOR: f64 = 1e3;
/// Factor on the negligible stiffness in the springs on angles: large enough for a regular matrix, without effect on
/// the shape.
const ANGLE_SPRING_FACTOR: f64 = 10.0;
/// Relative difference of energies below which they count as equal: a straight round rod has no preferred rotation.
const EQUAL_ENERGY: f64 = 1e-9;

/// The initial state of a rod whose motion was recorded.
pub(crate) struct RecordedStart<D: RodScalar, M: Model> {
    /// Unknowns and frames in the first frame of the recording.
    pub start: UnknownsAndFrames<D, M>,
    /// Change of the unknowns until the second frame, m (rad for angles).
    pub change: Vec<D>,
    /// Time between the two frames, s.
    pub interval: f64,
}

impl<M: Model> Discretized<'_, M> {
    /// The initial state of the recorded motion: the relaxed shape of the first frame, to which the twist of the ends
    /// and the places prescribed at t = 0 are applied. The change to the relaxed shape of the second frame is without
    /// these twists and places; the time between the frames is in s.
    ///
    /// # Errors
    /// [`Error::Invalid`] without `supports.path`, those of the descents to the relaxed shapes, and
    /// [`Error::Indifferent`] where derivatives are requested and the tangent is singular.
    pub(crate) fn recorded_start<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
    ) -> Result<RecordedStart<D, M>, Error> {
        let track = self.track()?;
        // Shapes of least energy in the first two frames.
        let [mut q, next] = self.relaxed_over(setup, track)?;
        let (_, frames) = self.begin(setup);
        let change = q.iter().zip(&next).map(|(q0, q1)| *q1 - *q0).collect();
        // The stated twist of the ends, and the places that supports prescribe at t = 0.
        self.turn_ends(setup, &mut q);
        if let Some(boundary_motion) = self.boundary_motion(setup) {
            let moment = MotionTime::Time(0.0);
            boundary_motion.advance::<M::Rod<D>>(moment, moment, &mut q, &frames);
        }
        let interval = track.times()[1] - track.times()[0];
        Ok(RecordedStart { start: (q, frames), change, interval })
    }

    /// Unknowns and initial frames of the rod, relaxed in the first frame of the recording, with the twist that the
    /// scene gives to its ends. Places at t = 0 are not prescribed. Errors are those of
    /// [`recorded_start`](Self::recorded_start).
    pub(crate) fn recorded_shape<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
    ) -> Result<UnknownsAndFrames<D, M>, Error> {
        let [mut q, _] = self.relaxed_over(setup, self.track()?)?;
        self.turn_ends(setup, &mut q);
        Ok((q, self.begin(setup).1))
    }

    /// The recorded markers of `supports.path`; [`Error::Invalid`] without that table.
    fn track(&self) -> Result<&Track, Error> {
        let path = self.scene().supports.path.as_ref();
        path.map_or_else(
            || {
                Err(Error::invalid(
                    "supports.path",
                    "no such table",
                    "this table with a recorded \
                                   start",
                ))
            },
            Recorded::track,
        )
    }

    /// The rod without loads and supports, with springs between marked nodes and the markers of frame `frame` (0 or 1).
    /// A spring has the stiffness `sqrt(AXIAL_FACTOR) E sqrt(A I)/l^2`, N/m, at a held node [`HELD_FACTOR`] times that.
    /// The axial stiffness of edges is multiplied by [`AXIAL_FACTOR`], or by zero if both nodes of an edge are held and
    /// marked. An error where the mesh has no nodes at the markers.
    fn sprung_rod<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
        track: &Track,
        frame: usize,
    ) -> Result<M::Rod<D>, Error> {
        let path = setup.scene.supports.path.as_ref();
        let segments = self.nodes() - 1;
        let nodes = path.map_or(Ok(Vec::new()), |path| path.nodes(segments))?;
        let prescribed = self.prescribed();
        let is_held = |node: usize| nodes.contains(&node) && self.is_held(node, &prescribed);
        let time = track.times()[frame];
        // The geometric mean of axial and bending stiffness, with the axial factor.
        let stiffness = marker_spring(setup, segments);
        let tie = |(node, marker): (&usize, &crate::scene::track::Marker)| {
            let stiffness = stiffness * if is_held(*node) { HELD_FACTOR } else { 1.0 };
            NodeTie { node: *node, point: marker.at(time), stiffness }
        };
        let ties: Vec<_> = nodes.iter().zip(track.markers()).map(tie).collect();
        // The length of an edge between two held nodes does not affect the motion, and must not displace them.
        let axial = |j: usize| if is_held(j) && is_held(j + 1) { 0.0 } else { AXIAL_FACTOR };
        Ok(setup.tied(self.model, axial, &ties))
    }

    /// The unknowns of least energy in the first two frames, m and rad, without derivatives: one list per frame. They
    /// are computed at the first call, then stored in the problem. Errors are those of [`relax`](Self::relax), with the
    /// file of the scene.
    fn relaxed(&self, track: &Track) -> Result<&[Vec<f64>], Error> {
        let start = &self.problem.start;
        if start.get().is_none() {
            let file = self.scene().path.as_deref();
            let found = self.relax(track).map_err(|error| error.in_file(file))?;
            // Another thread may have stored the same result.
            let _ = start.set(found);
        }
        Ok(start.get().map_or(&[], Vec::as_slice))
    }

    /// The unknowns of least energy in the first two frames, by two descents without supports. The first starts from
    /// the initial shape, rotated about the center line to least energy if the rod is curved or has
    /// `rod.natural_bending`. The second starts from the first result, whose nodes are displaced by the motion of the
    /// markers, interpolated between them. Angles are measured from the initial frames. [`Error::Equilibrium`] if a
    /// descent finds no equilibrium.
    fn relax(&self, track: &Track) -> Result<Vec<Vec<f64>>, Error> {
        let (mut q, frames) = self.begin(self.setup);
        let rod = self.sprung_rod(self.setup, track, 0)?;
        // The rotation about the center line is determined by curvature only.
        if !self.problem.mesh.is_straight() || !self.scene().rod.natural_bending.is_empty() {
            minimize_rotation_energy::<M>(&rod, &mut q, &frames);
        }
        let reference = frames.clone();
        let descend = |rod: &M::Rod<f64>, q: Vec<f64>, frames| {
            let settings = DescentSettings {
                free: 0..q.len(),
                prescribed: PrescribedDofs::default(),
                length: self.problem.length(),
                negligible: self.negligible_stiffness(None),
                springs: self.angle_springs(),
                edges: None,
                derivatives: self.problem.derivatives(),
            };
            Descent::new(rod, settings, q).descend(frames)
        };
        // Both descents hold the ends by springs, not by supports.
        let first = descend(&rod, q, frames)?;
        let rod = self.sprung_rod(self.setup, track, 1)?;
        // The second frame starts from the first one, displaced by the motion of the markers.
        let mut q = first.q.clone();
        let [before, after] = [0, 1]
            .map(|frame| between_markers::<f64>(track, track.times()[frame], self.nodes() - 1));
        for (i, (before, after)) in before.iter().zip(&after).enumerate() {
            let displacement = self.model.components(sub(*after, *before));
            for c in 0..M::STRIDE.min(3) {
                q[M::STRIDE * i + c] += displacement[c];
            }
        }
        let second = descend(&rod, q, first.frames.clone())?;
        Ok([first, second]
            .into_iter()
            .map(|rest| {
                let mut q = rest.q;
                rest.frames.convert_angles(&mut q, &reference);
                q
            })
            .collect())
    }

    /// The unknowns of least energy in the first two frames over `D`, one list per frame, with the derivatives that `D`
    /// carries, by the implicit function theorem. Plain numbers are those stored in the problem. Errors: those of
    /// [`relax`](Self::relax), and [`Error::Indifferent`] for a singular tangent.
    fn relaxed_over<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
        track: &Track,
    ) -> Result<[Vec<D>; 2], Error> {
        let (_, frames) = self.begin(setup);
        let found = self.relaxed(track)?;
        let mut both = [0, 1].map(|k| found[k].iter().map(|x| D::from(*x)).collect::<Vec<D>>());
        // Derivatives of both equilibria, by the implicit function theorem.
        if D::ORDER > 0 {
            for (frame, q) in both.iter_mut().enumerate() {
                let rod = self.sprung_rod(setup, track, frame)?;
                let plain = self.sprung_rod(self.setup, track, frame)?;
                let plain_frames = self.begin(self.setup).1;
                self.differentiate_sprung(&rod, &frames, &plain, &plain_frames, q)
                    .map_err(|singular| Error::Indifferent { node: singular.row / M::STRIDE })?;
            }
        }
        Ok(both)
    }

    /// Stiffness of weak springs on all unknowns of a rod with springs to markers: [`ANGLE_SPRING_FACTOR`] times the
    /// negligible stiffness for angles, N m, zero for coordinates. Nothing else holds the spin of a straight rod.
    fn angle_springs(&self) -> Vec<f64> {
        let angles = |(i, k): (usize, f64)| match M::Rod::<f64>::is_angle(i) {
            true => ANGLE_SPRING_FACTOR * k,
            false => 0.0,
        };
        self.negligible_stiffness(None).into_iter().enumerate().map(angles).collect()
    }

    /// Adds the derivatives to the unknowns `q` of a relaxed rod, by Newton steps with the tangent of the rod in
    /// `plain` numbers and the springs on angles. Forces that remain in plain numbers are subtracted, so that the
    /// values of `q` stay. One step removes rounding errors, and one more per order adds derivatives. The row of a zero
    /// pivot is the error.
    fn differentiate_sprung<D: RodScalar>(
        &self,
        rod: &M::Rod<D>,
        frames: &<M::Rod<D> as Rod<D>>::Frames,
        plain: &M::Rod<f64>,
        plain_frames: &FramesOf<M>,
        q: &mut [D],
    ) -> Result<(), Singular> {
        let n = q.len();
        let found: Vec<f64> = q.iter().map(|x| x.value()).collect();
        // Forces of the springs on angles, in equilibrium with the gradient.
        let (mut spring_forces, mut tangent) = (vec![0.0; n], plain.zero_tangent());
        plain.tangent(&found, plain_frames, Derivatives::Hand, &mut spring_forces, &mut tangent);
        let springs = self.angle_springs();
        let mut factors = tangent.new_factors();
        factors.factor_sum(&springs, 1.0, &tangent, 1.0, 0..n)?;
        let mut change = vec![D::from(0.0); n];
        // Each Newton step with the plain tangent doubles no digits, but adds one order of
        // derivatives exactly.
        for _ in 0..1 + D::ORDER {
            rod.gradient(q, frames, Derivatives::Hand, &mut change);
            for i in 0..n {
                change[i] += (q[i] - found[i]) * springs[i] - spring_forces[i];
            }
            factors.solve(&mut change);
            for (q, change) in q.iter_mut().zip(&change) {
                *q -= *change;
            }
        }
        Ok(())
    }
}

/// Stiffness of the springs of markers on a rod with `segments` edges, N/m: the geometric mean of [`AXIAL_FACTOR`]
/// times the axial stiffness and the bending stiffness of an edge.
pub(crate) fn marker_spring<D: RodScalar, M: Model>(setup: &Setup<D, M>, segments: usize) -> D {
    spring(setup, segments) * AXIAL_FACTOR.sqrt()
}

/// The geometric mean of axial and bending stiffness of an edge, `E sqrt(A I)/l^2`, N/m, of a rod with so many
/// `segments`. `I` is the first second moment of area, `l` the edge length.
fn spring<D: RodScalar, M: Model>(setup: &Setup<D, M>, segments: usize) -> D {
    let (material, section) = (&setup.scene.material, setup.scene.rod.section.moments());
    let edge = setup.mesh.length * (segments as f64).recip();
    let [i1, _] = section.second_moments;
    material.youngs_modulus * (section.area * i1).sqrt() / (edge * edge)
}

/// Adds one angle, rad, to the angles of all edges in `q`: the one of least energy of `rod`. It is the best of
/// [`ROTATIONS`] evenly spaced angles, refined by [`SECTIONS`] golden sections between its neighbors. If the energies
/// differ by at most [`EQUAL_ENERGY`] of the largest, as for a straight round rod, angles stay, and so they do in the
/// plane.
fn minimize_rotation_energy<M: Model>(
    rod: &M::Rod<f64>,
    q: &mut [f64],
    frames: &<M::Rod<f64> as Rod<f64>>::Frames,
) {
    if !M::Rod::<f64>::HAS_FRAMES {
        return;
    }
    let angles: Vec<usize> = (0..q.len()).filter(|i| M::Rod::<f64>::is_angle(*i)).collect();
    let initial: Vec<f64> = angles.iter().map(|i| q[*i]).collect();
    let energy = |rotation: f64, q: &mut [f64]| {
        angles.iter().zip(&initial).for_each(|(i, initial)| q[*i] = initial + rotation);
        rod.energies(q, frames).total()
    };
    // Global search on a grid of rotations, so that the local search finds the right minimum.
    let spacing = TAU / ROTATIONS as f64;
    let energies: [f64; ROTATIONS] = std::array::from_fn(|k| energy(k as f64 * spacing, q));
    let least = (0..ROTATIONS).fold(0, |a, b| if energies[b] < energies[a] { b } else { a });
    let most = energies.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
    // A straight round rod has the same energy at all angles.
    if most - energies[least] <= EQUAL_ENERGY * most.abs() {
        energy(0.0, q);
        return;
    }
    let best = least as f64 * spacing;
    // Golden section search around the best grid point.
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let [mut low, mut high] = [best - spacing, best + spacing];
    for _ in 0..SECTIONS {
        let part = golden * (high - low);
        match energy(high - part, q) < energy(low + part, q) {
            true => high = low + part,
            false => low = high - part,
        }
    }
    energy(0.5 * (low + high), q);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::SpatialModel;
    use crate::scene::{Dimension, Material, Scene, Section, Shape};

    /// A helix in its stress-free shape, except for its curvature, has the least energy without rotation, whatever
    /// rotation it starts with.
    #[test]
    fn rotation_of_least_energy_is_found_from_any_start() {
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
            minimize_rotation_energy::<SpatialModel>(&spatial.rod(), &mut q, &frames);
            for i in angles {
                let left = q[i] - begun[i];
                let left = left - (left / TAU).round() * TAU;
                assert!(left.abs() < 1e-5, "from {turn}: {left:e}");
            }
        }
    }
}
