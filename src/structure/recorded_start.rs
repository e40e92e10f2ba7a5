//! Initial state of a structure in space from the first two frames of its recording.
//!
//! In each frame the structure is in equilibrium under its weight with stiff springs between its observed markers and
//! their recorded positions, and with recorded ends at theirs. The axial stiffness of the rods is increased, so that
//! errors of positions do not stretch them. The descent to the first equilibrium starts from the
//! [pose](Structure::pose_at) through the markers, the second one from the first. Angles of both are then measured from
//! the frames of the pose, which do not depend on numbers of the scene.
//!
//! Output: [`StartFromRecording`] with unknowns (m, rad) and frames in the first frame, the change of the unknowns to
//! the second, and the time between, s, which give the velocity. Held edges have no rate of rotation about the rod.
//! Derivatives with respect to numbers of the scene are those of the implicit function theorem. Relaxed shapes in plain
//! numbers are computed once per structure. Errors: a structure in a plane, too few markers, markers on bodies, one
//! frame only, no equilibrium.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::prescribed_dofs::PrescribedDofs;
use crate::numerics::rotation::{logarithm, product, transpose};
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::{Factors, Tangent};
use crate::problem::PointTie;
use crate::rod::assembly::AssemblyFrames;
use crate::rod::{Assembly, ReferenceFrames, Rod};
use crate::scene::structure_point::{PointOfRod, StructurePoint};
use crate::scene::{Stencil, StructureRecording, StructureScene};
use crate::statics::{Descent, DescentSettings, EquilibriumState};
use crate::structure::blueprint::{AssemblyAtRest, MarkerTies};
use crate::structure::definition::Structure;
use crate::structure::marker_place::{MarkerPlace, RelaxedFrames};
use crate::structure::plan::EndSupport;
use crate::structure::recorded_ends::held_edges;
use std::f64::consts::TAU;

/// The initial state of a recorded motion.
pub(super) struct StartFromRecording<D> {
    /// Unknowns in the first frame, m (rad for angles).
    pub q: Vec<D>,
    /// Frames of the assembly in that state, from which angles are measured.
    pub frames: AssemblyFrames<D>,
    /// Change of the unknowns until the second frame, m (rad for angles).
    pub change: Vec<D>,
    /// Time between both frames, s.
    pub interval: f64,
}

impl Structure {
    /// The state in the first frame of the recording over the number type of `scene`, and the change until the second.
    /// `assembly` is that of the scene. The first call stores the relaxed shapes in plain numbers in the structure.
    ///
    /// # Errors
    /// A structure without `[recording]` or in a plane, too few markers on a rod, observed points of bodies, a
    /// recording of one frame, no equilibrium, and a singular tangent.
    pub(super) fn recorded_start<D: RodScalar>(
        &self,
        scene: &StructureScene<D>,
        assembly: &Assembly<D>,
    ) -> Result<StartFromRecording<D>, Error> {
        let in_file = |error: Error| error.in_file(self.scene.path.as_deref());
        let recording = self.scene.recording.as_ref().ok_or_else(|| {
            in_file(Error::invalid("recording", "no such table", "a recording to start from"))
        })?;
        let places = self.marker_places(recording).map_err(in_file)?;
        if self.start.get().is_none() {
            let found = self.relaxed_frames(recording, &places).map_err(in_file)?;
            // Another thread may have stored the same result.
            let _ = self.start.set(found);
        }
        let Some(found) = self.start.get() else { return Err(Error::SingularEquilibrium) };
        let over = |k: usize| self.relaxed_over(scene, recording, &places, k, found);
        let (q, next) = (over(0)?, over(1)?);
        let pose = found.pose.map(D::from);
        let mut frames = pose.clone();
        assembly.move_frames(&mut frames, &q);
        let mut change = change_between(assembly, [&pose, &frames], [&q, &next]);
        // Held edges do not spin: relaxed angles of two frames differ by noise, and nothing would end that rotation.
        let held = self.recorded.prescribed.iter().filter(|i| i % 4 == 3);
        held.for_each(|i| change[i] = D::from(0.0));
        let times = recording.track()?.times();
        Ok(StartFromRecording { q, frames, change, interval: times[1] - times[0] })
    }

    /// The markers of recorded ends, then the observed ones, with their rods, arc lengths and positions at rest, m. An
    /// error for a marker that the recording does not have, a point of a body, and a place off its rod.
    fn marker_places(&self, recording: &StructureRecording) -> Result<Vec<MarkerPlace>, Error> {
        let mut places = Vec::new();
        for (rod, ends) in self.blueprint.plan.ends.iter().enumerate() {
            let mesh = &self.at_rest.meshes[rod];
            for (end, hold) in ends.iter().enumerate() {
                let EndSupport::Recorded(i) = *hold else { continue };
                let support = &self.scene.supports[i];
                let last = mesh.nodes.len() - 1;
                let edges = held_edges(support, &self.scene.rods[rod], last);
                for (k, name) in support.markers.iter().enumerate() {
                    let node = if end == 0 { k * edges } else { last - k * edges };
                    places.push(MarkerPlace {
                        rod,
                        arc_length: mesh.arc_length[node],
                        rest: mesh.nodes[node],
                        marker: recording.marker(&format!("supports[{i}].markers"), name)?,
                        is_held: true,
                    });
                }
            }
        }
        for (name, point) in &recording.markers {
            let key = format!("recording.markers.{name}");
            let marker = recording.marker(&key, name)?;
            let StructurePoint::Rod(PointOfRod { rod, at }) = point else {
                return Err(Error::invalid(key, "a point of a body", "a point of a rod"));
            };
            let rod = self.scene.rod(&format!("{key}.rod"), rod)?;
            let mesh = &self.at_rest.meshes[rod];
            let point = at.point();
            let stencil = point.stencil(mesh).map_err(|error| {
                let place = format!("of the rod {}", self.scene.rods[rod].name);
                error.at_key(format!("{key}.at"), &place)
            })?;
            let arc_length = point.place(mesh)?;
            let rest = stencil.place(|node| mesh.nodes[node]);
            places.push(MarkerPlace { rod, arc_length, rest, marker, is_held: false });
        }
        Ok(places)
    }

    /// The assembly at rest, over the number type of `scene`, with springs from the observed markers to their recorded
    /// positions in frame number `frame`. Markers of recorded ends have no springs. Errors: a recording that is not
    /// read, and those of building the assembly.
    fn sprung<D: RodScalar>(
        &self,
        scene: &StructureScene<D>,
        recording: &StructureRecording,
        places: &[MarkerPlace],
        frame: usize,
    ) -> Result<AssemblyAtRest<D>, Error> {
        let track = recording.track()?;
        let time = track.times()[frame];
        let mut ties: Vec<Vec<PointTie>> = vec![Vec::new(); self.scene.rods.len()];
        for place in places.iter().filter(|place| !place.is_held) {
            // On a straight line between two nodes.
            let mesh = &self.at_rest.meshes[place.rod];
            let stencil = Stencil::lever(&mesh.arc_length, place.arc_length);
            let last = mesh.nodes.len() - 2;
            let first = stencil.nodes.iter().map(|(node, _)| *node).min().unwrap_or(0).min(last);
            let weight = stencil.nodes.iter().find(|(node, _)| *node == first + 1);
            let weight = weight.map_or(0.0, |(_, weight)| *weight);
            let point = track.markers()[place.marker].at(time);
            ties[place.rod].push(PointTie { node: first, weight, point });
        }
        self.blueprint.build_tied(scene, Some(&MarkerTies(ties)))
    }

    /// The relaxed structure in the first two frames, by two descents: from the pose through the markers, then from the
    /// first result displaced by the motion of the pose. Errors: fewer than two frames, those of the pose, no
    /// equilibrium.
    fn relaxed_frames(
        &self,
        recording: &StructureRecording,
        places: &[MarkerPlace],
    ) -> Result<RelaxedFrames, Error> {
        let track = recording.track()?;
        if track.times().len() < 2 {
            return Err(Error::invalid("recording.file", "one frame", "two frames or more"));
        }
        let position = |frame: usize| {
            let time = track.times()[frame];
            move |place: &MarkerPlace| track.markers()[place.marker].at(time)
        };
        let (mut q, pose) = self.pose_at(places, position(0))?;
        let before = q.clone();
        self.recorded.place(track.times()[0], &mut q, &pose);
        let first = self.relax(recording, places, 0, q, pose.clone())?;
        // The second frame starts from the first one, displaced by the motion of the markers.
        let mut q = first.q.clone();
        let after = self.pose_at(places, position(1))?.0;
        for range in self.at_rest.assembly.rod_ranges() {
            for i in range.clone().filter(|i| i % 4 != 3) {
                q[i] += after[i] - before[i];
            }
        }
        self.recorded.place(track.times()[1], &mut q, &first.frames);
        let second = self.relax(recording, places, 1, q, first.frames.clone())?;
        let assembly = &self.at_rest.assembly;
        let q = [first, second].map(|found| measured_from(assembly, &found.frames, &pose, found.q));
        Ok(RelaxedFrames { pose, q })
    }

    /// The equilibrium of the structure with springs to the markers in frame number `frame`, by a descent from `q` and
    /// `frames`. Positions of recorded ends stay; their angles relax. Error: no equilibrium, or a recording that is not
    /// read.
    fn relax(
        &self,
        recording: &StructureRecording,
        places: &[MarkerPlace],
        frame: usize,
        q: Vec<f64>,
        frames: AssemblyFrames<f64>,
    ) -> Result<EquilibriumState<AssemblyFrames<f64>>, Error> {
        let assembly = self.sprung(&self.scene, recording, places, frame)?.assembly;
        let negligible = self.negligible_stiffness();
        let settings = DescentSettings {
            free: 0..q.len(),
            prescribed: self.positions_prescribed(),
            length: self.length(),
            springs: self.weak_angle_springs(&negligible),
            negligible,
            edges: None,
            derivatives: Derivatives::Hand,
        };
        Descent::new(&assembly, settings, q).descend(frames)
    }

    /// The relaxed unknowns in frame number `frame` over the number type of `scene`, with their derivatives with
    /// respect to its numbers: one Newton step per order, with the tangent in plain numbers. Forces that remain in
    /// plain numbers are subtracted, so that values do not change. A singular tangent is an error.
    fn relaxed_over<D: RodScalar>(
        &self,
        scene: &StructureScene<D>,
        recording: &StructureRecording,
        places: &[MarkerPlace],
        frame: usize,
        relaxed: &RelaxedFrames,
    ) -> Result<Vec<D>, Error> {
        let found = &relaxed.q[frame];
        let mut q: Vec<D> = found.iter().map(|x| D::from(*x)).collect();
        if D::ORDER == 0 {
            return Ok(q);
        }
        let frames = relaxed.pose.map(D::from);
        let plain = self.sprung(&self.scene, recording, places, frame)?.assembly;
        let assembly = self.sprung(scene, recording, places, frame)?.assembly;
        let n = q.len();
        let (mut held, mut tangent) = (vec![0.0; n], plain.zero_tangent());
        plain.tangent(found, &relaxed.pose, Derivatives::Hand, &mut held, &mut tangent);
        let prescribed = self.positions_prescribed();
        prescribed.eliminate_rows_and_columns(&mut tangent);
        let springs = self.weak_angle_springs(&self.negligible_stiffness());
        let mut factors = tangent.new_factors();
        factors
            .factor_sum(&springs, 1.0, &tangent, 1.0, 0..n)
            .map_err(|_| Error::SingularEquilibrium)?;
        let mut change = vec![D::from(0.0); n];
        for _ in 0..D::ORDER {
            assembly.gradient(&q, &frames, Derivatives::Hand, &mut change);
            for i in 0..n {
                change[i] += (q[i] - found[i]) * springs[i] - held[i];
            }
            prescribed.fill(&mut change, D::from(0.0));
            factors.solve(&mut change);
            for i in 0..n {
                q[i] -= change[i];
            }
        }
        Ok(q)
    }

    /// Stiffness of weak springs on all unknowns: [`ANGLE_SPRING`] times the `negligible` one for angles of edges, N m,
    /// else zero. Nothing else holds the spin of a straight round rod.
    fn weak_angle_springs(&self, negligible: &[f64]) -> Vec<f64> {
        let first = self.at_rest.assembly.body_coordinates().start;
        let of =
            |i: usize| if i % 4 == 3 && i < first { ANGLE_SPRING * negligible[i] } else { 0.0 };
        (0..negligible.len()).map(of).collect()
    }

    /// The indices of the prescribed unknowns of recorded ends that are positions of nodes. Angles of their edges are
    /// left
    /// out, and relax.
    fn positions_prescribed(&self) -> PrescribedDofs {
        let positions = self.recorded.prescribed.iter().filter(|i| i % 4 != 3);
        PrescribedDofs::new(positions.collect())
    }
}

/// The unknowns `q`, whose angles and rotations are measured from the frames `from`, converted to those measured from
/// the frames `to`. Carried nodes get their positions on the bodies. Unchanged in a plane.
fn measured_from<D: RodScalar>(
    assembly: &Assembly<D>,
    from: &AssemblyFrames<D>,
    to: &AssemblyFrames<D>,
    mut q: Vec<D>,
) -> Vec<D> {
    let Assembly::Space(rods) = assembly else { return q };
    assembly.place_carried(&mut q, from);
    for (k, range) in assembly.rod_ranges().into_iter().enumerate() {
        let own = &mut q[range.clone()];
        let before: Vec<D> = own.to_vec();
        from.rods[k].convert_angles(own, &to.rods[k]);
        // Of angles that differ by whole turns, that nearest to the angle before.
        for i in (3..own.len()).step_by(4) {
            let turns = ((own[i] - before[i]).value() / TAU).round();
            own[i] -= turns * TAU;
        }
    }
    let first = rods.body_coordinates().start;
    let z = q[first..].to_vec();
    for (rotation, axes) in rods.bodies().rotations_with_axes(&z, from) {
        let reference = &to.rotations[rotation.reference];
        let turn = logarithm(&product(&transpose(&reference.axes), &axes));
        for c in 0..3 {
            q[first + rotation.coordinate + c] =
                reference.coordinates[c] + turn[c] * rotation.length;
        }
    }
    q
}

/// The change of all unknowns from `q` to `next`, both measured from the frames `pose`. Angles and rotations of both
/// are first converted to the `frames` at `q`; the change of a rotation is a rotation vector times its scale. Unknowns
/// without effect have zero.
fn change_between<D: RodScalar>(
    assembly: &Assembly<D>,
    [pose, frames]: [&AssemblyFrames<D>; 2],
    [q, next]: [&[D]; 2],
) -> Vec<D> {
    let next = measured_from(assembly, pose, frames, next.to_vec());
    let mut start = q.to_vec();
    assembly.place_carried(&mut start, frames);
    let mut change: Vec<D> = next.iter().zip(&start).map(|(q1, q0)| *q1 - *q0).collect();
    // They would keep their velocity, and the kinetic energy of a mass that they do not have.
    assembly.unknowns_without_effect().for_each(|i| change[i] = D::from(0.0));
    change
}

/// Factor on the negligible stiffness in the springs on angles: large enough for a regular matrix, without effect on
/// the shape.
const ANGLE_SPRING: f64 = 10.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Support, Track};

    /// The markers of a recorded end over two of 20 edges of 1 m are those over four of 40.
    #[test]
    fn markers_of_recorded_ends_keep_their_arc_length_on_a_finer_mesh() {
        let text = "[[rods]]\nname = \"a\"\nsegments = 20\n\
                    shape = { kind = \"straight\", length = 1.0, direction = [1, 0, 0] }\n\
                    section = { kind = \"circle\", radius = 3e-3 }\n\
                    material = { density = 1100, youngs_modulus = 2e7 }\n\
                    [[supports]]\nof = { rod = \"a\", at = \"start\" }\nkind = \"pinned\"\n\
                    [[supports]]\nof = { rod = \"a\", at = \"end\" }\nkind = \"pinned\"\n";
        let mut scene = StructureScene::from_toml(text, ".").unwrap();
        for support in &mut scene.supports {
            (support.kind, support.edges) = (Support::Recorded, 2);
            support.markers = vec!["m0".into(), "m1".into()];
        }
        let marker = |name: &str| (name.to_string(), vec![Some([0.0; 3]); 2]);
        let track = Track::new(vec![0.0, 0.01], vec![marker("m0"), marker("m1")]).unwrap();
        scene.recording = Some(StructureRecording::of(track));
        let expected = [0.0, 0.1, 1.0, 0.9];
        for remeshed in [None, Some(40)] {
            scene.rods[0].remeshed = remeshed;
            let structure = Structure::new(scene.clone()).unwrap();
            let recording = structure.scene.recording.as_ref().unwrap();
            let places = structure.marker_places(recording).unwrap();
            let found: Vec<f64> = places.iter().map(|place| place.arc_length).collect();
            let apart = found.iter().zip(expected).map(|(s, expected)| (s - expected).abs());
            assert!(
                found.len() == 4 && apart.fold(0.0, f64::max) < 1e-12,
                "{remeshed:?} {found:?}"
            );
        }
    }
}
