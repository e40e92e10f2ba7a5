//! The model of a scene that lies in a plane.

use super::line::Line;
use super::{Arcs, Model, NodalLoad, rolling};
use crate::energy::{DeadLoad, DeadMoment, PlanarBend, Stretch, planar_bend};
use crate::error::Error;
use crate::parameter::Properties;
use crate::rod::PlanarRod;
use crate::rod::planar::HALF_BANDWIDTH;
use crate::scalar::{Nestable, Scalar};
use crate::scene::shape::Mesh;
use crate::scene::{End, Plane, Scene, Support};
use nalgebra::{Rotation3, Vector3};

/// Rest shape and loads in the scene's plane.
#[derive(Clone, Debug)]
pub struct PlanarModel {
    /// The plane.
    pub plane: Plane,
    /// Rest positions, m.
    nodes: Vec<[f64; 2]>,
    rest_length: Vec<f64>,
    line: Line,
    /// The corrected form's.
    corrected: bool,
    rest_curvature: Vec<f64>,
    /// Where the joints are, as parts of the length.
    places: Vec<f64>,
    /// Which of the section's two second moments resists bending in the plane.
    second_moment: usize,
    /// m/s^2.
    gravity: [f64; 2],
    loads: Vec<NodalLoad>,
}

impl PlanarModel {
    /// The model, or what leaves the plane of the rest. `start` is the shape the rod starts in, if
    /// not the rest shape of the `mesh`.
    pub(crate) fn new(
        scene: &Scene,
        mesh: &Mesh,
        start: Option<&[[f64; 3]]>,
        arcs: Option<Arcs>,
        loads: &[NodalLoad],
    ) -> Result<Result<Self, String>, Error> {
        let nodes = &mesh.nodes[..];
        let along = Vector3::from(nodes[1]) - Vector3::from(nodes[0]);
        let (mut vectors, turns) = vectors(scene, nodes, start);
        // A turn lies across its plane.
        vectors.extend(turns.iter().map(|(key, turn)| (key.clone(), turn.cross(&along))));
        let up = scene.rod.section.up().map(Vector3::from);
        let leaves = |what: &str| Ok(Err(format!("{what} leaves the plane of the rest")));
        let mut plane = match Plane::through(nodes, &vectors, up) {
            Ok(plane) => plane,
            Err(what) => return leaves(&what),
        };
        for (key, turn) in &turns {
            if plane.components(*turn).0.norm() > 1e-9 * turn.norm() {
                return leaves(key);
            }
        }
        if !scene.rod.natural_twist.is_zero() {
            return leaves("rod.natural_twist");
        }
        if let Some(i) = scene.supports.motion.iter().position(|motion| motion.twist != 0.0) {
            return leaves(&format!("supports.motion[{i}].twist"));
        }
        // The rod turns, and what lies in the plane stays.
        let normal = plane.x.cross(&plane.y);
        let wall = Vector3::from(nodes[0]);
        let tilt = Rotation3::from_scaled_axis(normal * scene.supports.angle);
        let tilted: Vec<[f64; 3]> =
            nodes.iter().map(|x| (wall + tilt * (Vector3::from(*x) - wall)).into()).collect();
        let nodes = if scene.supports.angle == 0.0 { nodes } else { &tilted };
        // A roller at the end holds the last coordinate of its node, one at the start the first, so
        // that the free unknowns stay side by side.
        if let Some((end, direction)) = rolling(scene, nodes) {
            let along = direction.normalize();
            (plane.x, plane.y) = match end {
                End::End => (along, normal.cross(&along)),
                End::Start => (along.cross(&normal), along),
            };
        }
        let second_moment = match second_moment_in(scene, &plane, nodes)? {
            Some(second_moment) => second_moment,
            None => {
                let why = "rod.section.up is neither in the plane of the rest nor across it";
                return Ok(Err(why.to_string()));
            }
        };
        let nodes: Vec<[f64; 2]> = nodes.iter().map(|x| plane.project((*x).into())).collect();
        let rest_length: Vec<f64> =
            nodes.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).collect();
        let rest_curvature: Vec<f64> = nodes
            .windows(3)
            .map(|p| planar_bend::curvature(p.first_chunk().expect("windows of three")))
            .collect();
        Ok(Ok(Self {
            gravity: plane.project(scene.loads.gravity.into()),
            loads: loads.to_vec(),
            plane,
            nodes,
            line: arcs.map_or_else(|| Line::plain(&rest_length), Line::corrected),
            corrected: arcs.is_some(),
            rest_length,
            rest_curvature,
            places: mesh.places(),
            second_moment,
        }))
    }
}

impl PlanarModel {
    /// Of an edge at rest, m.
    fn direction(&self, edge: usize) -> [f64; 2] {
        let [a, b] = [self.nodes[edge], self.nodes[edge + 1]];
        [b[0] - a[0], b[1] - a[1]]
    }
}

impl Model<HALF_BANDWIDTH> for PlanarModel {
    const STRIDE: usize = 2;
    type Rod<D: Nestable> = PlanarRod<D>;

    fn rod<D: Nestable>(&self, p: &Properties<D>) -> PlanarRod<D> {
        let axial = p.youngs_modulus * p.area;
        let bending = p.youngs_modulus * p.second_moments[self.second_moment];
        let stretch = self.rest_length.iter().zip(&self.line.stretch).map(|(l, arc)| Stretch {
            stiffness: axial * (l / arc),
            rest_length: D::from(*l),
            natural_strain: D::from(0.0),
        });
        let bends = self.line.joint.iter().zip(&self.rest_curvature).zip(&self.places);
        let bend = bends.map(|((l, k), place)| {
            let natural = p.natural_curvature.at(*place) * *k;
            // EI over the joint's length, times cos^4(phi/2) in the corrected form.
            let mut stiffness = bending * l.recip();
            if self.corrected {
                stiffness /= (natural * natural * 0.25 + 1.0).powi(2);
            }
            PlanarBend { stiffness, natural_curvature: natural }
        });
        let line_density = p.density * p.area;
        let node_mass: Vec<D> = self.line.node.iter().map(|l| line_density * *l).collect();
        // Turning the rod turns the weight the other way, as the rod sees it.
        let (sin, cos) = (p.clamp_angle.sin(), p.clamp_angle.cos());
        let [x, y] = self.gravity;
        let gravity = [cos * x + sin * y, cos * y - sin * x];
        let load: Vec<DeadLoad<D, 2>> =
            node_mass.iter().map(|m| DeadLoad { force: gravity.map(|g| *m * g) }).collect();
        let mut rod = PlanarRod {
            stretch: stretch.collect(),
            bend: bend.collect(),
            mass: node_mass.iter().flat_map(|m| [*m, *m]).collect(),
            load,
            moment: Vec::new(),
            heading: self.direction(0).map(D::from),
        };
        self.add_loads(&mut rod, &self.loads);
        rod
    }

    fn add_loads<D: Nestable>(&self, rod: &mut PlanarRod<D>, loads: &[NodalLoad]) {
        for load in loads {
            let force = self.plane.project(load.force.into());
            for c in 0..2 {
                rod.load[load.node].force[c] += D::from(force[c]);
            }
            let (_, moment) = self.plane.components(load.moment.into());
            if moment != 0.0 {
                let last = self.rest_length.len() - 1;
                for edge in [load.node.saturating_sub(1), load.node.min(last)] {
                    let rest = self.direction(edge).map(D::from);
                    rod.moment.push((edge, DeadMoment { moment: D::from(0.5 * moment), rest }));
                }
            }
        }
    }

    fn dof(&self) -> usize {
        2 * self.nodes.len()
    }

    fn rest(&self) -> Vec<f64> {
        self.nodes.iter().flatten().copied().collect()
    }

    fn frames(&self) {}

    fn lift<D: Nestable>((): &()) {}

    fn held(&self, support: Support) -> usize {
        match support {
            Support::Free => 0,
            Support::Roller => 1,
            Support::Pinned => 2,
            Support::Clamped => 4,
        }
    }

    fn components<D: Scalar>(&self, [x, y, z]: [D; 3]) -> [D; 3] {
        let axes = [self.plane.x, self.plane.y, self.plane.x.cross(&self.plane.y)];
        axes.map(|axis| x * axis.x + y * axis.y + z * axis.z)
    }

    fn position<D: Scalar>(&self, q: &[D], i: usize) -> [D; 3] {
        self.plane.to_world([q[2 * i], q[2 * i + 1]])
    }

    fn rate<D: Scalar>(&self, v: &[D], i: usize) -> [D; 3] {
        self.plane.direction_to_world([v[2 * i], v[2 * i + 1]])
    }
}

/// A vector with the key it stands under.
type Named = (String, Vector3<f64>);

/// What must lie in the plane beside the rest shape, and the turns, which must lie across it.
fn vectors(
    scene: &Scene,
    nodes: &[[f64; 3]],
    start: Option<&[[f64; 3]]>,
) -> (Vec<Named>, Vec<Named>) {
    let mut vectors: Vec<Named> = vec![
        ("loads.gravity".into(), scene.loads.gravity.into()),
        ("initial.velocity".into(), scene.initial.velocity.into()),
    ];
    let mut turns: Vec<Named> =
        vec![("initial.angular_velocity".into(), scene.initial.angular_velocity.into())];
    for (table, points) in [("loads", &scene.loads.point), ("initial", &scene.initial.point)] {
        for (i, load) in points.iter().enumerate() {
            vectors.push((format!("{table}.point[{i}].force"), load.force.into()));
            turns.push((format!("{table}.point[{i}].moment"), load.moment.into()));
        }
    }
    for (i, motion) in scene.supports.motion.iter().enumerate() {
        let key = format!("supports.motion[{i}]");
        vectors.push((format!("{key}.displacement"), motion.displacement.into()));
        turns.push((format!("{key}.rotation"), motion.rotation.into()));
    }
    if let Some(roller) = scene.supports.roller {
        vectors.push(("supports.roller".into(), roller.into()));
    }
    if let Some(start) = start {
        let from = Vector3::from(nodes[0]);
        let shape = start.iter().map(|x| ("initial.shape".into(), Vector3::from(*x) - from));
        vectors.extend(shape);
    }
    (vectors, turns)
}

/// Which second moment resists bending in the plane: 0 with `up` in the plane, 1 across it; none
/// when bending leaves the plane.
fn second_moment_in(
    scene: &Scene,
    plane: &Plane,
    nodes: &[[f64; 3]],
) -> Result<Option<usize>, Error> {
    let Some(up) = scene.rod.section.up_across(nodes)? else { return Ok(Some(0)) };
    let [i1, i2] = scene.rod.section.second_moments();
    let (in_plane, out) = plane.components(up);
    Ok(match () {
        () if i1 == i2 || out.abs() <= 1e-9 => Some(0),
        () if in_plane.norm() <= 1e-9 => Some(1),
        () => None,
    })
}
