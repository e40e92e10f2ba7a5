//! The model of a scene in space.

use super::line::Line;
use super::polygon::{PLAIN, lean, resistances, slants};
use super::{Arcs, Model, NodalLoad, rolling};
use crate::energy::bend_twist::{JointLaw, Stiffness};
use crate::energy::{DeadLoad, Stretch};
use crate::error::Error;
use crate::frame::{EdgeFrame, Frames};
use crate::parameter::Properties;
use crate::rod::SpatialRod;
use crate::rod::spatial::HALF_BANDWIDTH;
use crate::scalar::{Nestable, Scalar};
use crate::scene::shape::Mesh;
use crate::scene::{End, Scene, Support};
use nalgebra::Vector3;

/// Rest shape, material frames and loads.
#[derive(Clone, Debug)]
pub struct SpatialModel {
    /// Rest positions, m.
    nodes: Vec<[f64; 3]>,
    rest_length: Vec<f64>,
    line: Line,
    /// The corrected form's: how the curve's tangents lie to the joints'.
    slants: Option<Vec<[f64; 2]>>,
    /// Integrated curvatures of the rest shape in the material frame.
    rest_curvature: Vec<[f64; 2]>,
    /// Where the joints are, as parts of the length.
    places: Vec<f64>,
    /// Space-parallel at rest: no twist.
    frames: Frames<f64>,
    /// m/s^2.
    gravity: [f64; 3],
    loads: Vec<NodalLoad>,
    /// The model's axes in the world: the world's own, unless an end rolls. All vectors above but
    /// the loads' are in these.
    axes: [Vector3<f64>; 3],
}

impl SpatialModel {
    pub(crate) fn new(
        scene: &Scene,
        mesh: &Mesh,
        arcs: Option<Arcs>,
        loads: &[NodalLoad],
    ) -> Result<Self, Error> {
        if let Some(load) = loads.iter().find(|load| load.moment != [0.0; 3]) {
            let found = format!("{:?} on node {} of a spatial scene", load.moment, load.node);
            let allowed = "planar scenes only: in space the work of a constant moment depends on \
                           the way; turn an end by [[supports.motion]]";
            return Err(Error::invalid("loads.point.moment", found, allowed));
        }
        let nodes = &mesh.nodes[..];
        let axes = match rolling(scene, nodes) {
            None => [Vector3::x(), Vector3::y(), Vector3::z()],
            // A roller at the end holds the last two coordinates of its node, one at the start the
            // first two, so that the free unknowns stay side by side.
            Some((end, direction)) => {
                let along = direction.normalize();
                let across =
                    along.cross(&Vector3::ith(along.map(f64::abs).imin(), 1.0)).normalize();
                match end {
                    End::End => [along, across, along.cross(&across)],
                    End::Start => [across, along.cross(&across), along],
                }
            }
        };
        let own = |v: &[f64; 3]| axes.map(|axis| axis.dot(&Vector3::from(*v)));
        let up = scene.rod.section.up_across(nodes)?.map(|up| Vector3::from(own(&up.into())));
        let nodes: Vec<[f64; 3]> = nodes.iter().map(own).collect();
        let edges: Vec<Vector3<f64>> =
            nodes.windows(2).map(|p| Vector3::from(p[1]) - Vector3::from(p[0])).collect();
        let tangents: Vec<[f64; 3]> = edges.iter().map(|e| e.normalize().into()).collect();
        // m1 along `up`; a circle takes any direction across, the one most across.
        let director = match up {
            Some(up) => up,
            None => {
                let t = Vector3::from(tangents[0]);
                let axis = Vector3::ith(t.map(f64::abs).imin(), 1.0);
                (axis - t * t.dot(&axis)).normalize()
            }
        };
        let frames = Frames::bishop(&tangents, director.into());
        let stiffness = Stiffness { bend: [0.0; 3], twist: 0.0, coupling: [0.0; 2] };
        let zero = JointLaw { stiffness, natural: [0.0; 3] };
        let rest_curvature: Vec<[f64; 2]> = (0..nodes.len() - 2)
            .map(|i| {
                let joint = zero.at([frames.edges[i], frames.edges[i + 1]], 0.0);
                let [a, b, c] = [nodes[i], nodes[i + 1], nodes[i + 2]];
                let q = [a[0], a[1], a[2], 0.0, b[0], b[1], b[2], 0.0, c[0], c[1], c[2]];
                let [k1, k2, _] = joint.strains(&q);
                [k1, k2]
            })
            .collect();
        let rest_length: Vec<f64> = edges.iter().map(Vector3::norm).collect();
        Ok(Self {
            line: arcs.map_or_else(|| Line::plain(&rest_length), Line::corrected),
            slants: arcs.map(|arcs| slants(&nodes, arcs, &frames.edges, &rest_curvature)),
            nodes,
            rest_length,
            rest_curvature,
            places: mesh.places(),
            frames,
            gravity: own(&scene.loads.gravity),
            loads: loads.to_vec(),
            axes,
        })
    }
}

impl Model<HALF_BANDWIDTH> for SpatialModel {
    const STRIDE: usize = 4;
    type Rod<D: Nestable> = SpatialRod<D>;

    fn rod<D: Nestable>(&self, p: &Properties<D>) -> SpatialRod<D> {
        let axial = p.youngs_modulus * p.area;
        let [ei1, ei2] = p.second_moments.map(|i| p.youngs_modulus * i);
        let gj = p.shear_modulus * p.torsion_constant;
        let stretch = self.rest_length.iter().zip(&self.line.stretch).map(|(l, arc)| Stretch {
            stiffness: axial * (l / arc),
            rest_length: D::from(*l),
            natural_strain: D::from(0.0),
        });
        let joint = self.rest_curvature.iter().enumerate().map(|(i, k)| {
            let per_length = self.line.joint[i].recip();
            let factor = p.natural_curvature.at(self.places[i]);
            let natural = k.map(|k| factor * k);
            let twist = p.natural_twist.at(self.places[i])
                * (0.5 * (self.line.spin[i] + self.line.spin[i + 1]));
            let [a, b, c] = match &self.slants {
                Some(slants) => resistances(natural, lean(slants[i], factor, *k, twist)),
                None => PLAIN.map(|a| a.map(D::from)),
            };
            let entry = |r: usize, s: usize| {
                (ei1 * (a[r] * a[s]) + ei2 * (b[r] * b[s]) + gj * (c[r] * c[s])) * per_length
            };
            JointLaw {
                stiffness: Stiffness {
                    bend: [entry(0, 0), entry(0, 1), entry(1, 1)],
                    twist: entry(2, 2),
                    coupling: [entry(0, 2), entry(1, 2)],
                },
                natural: [natural[0], natural[1], twist],
            }
        });
        let line_density = p.density * p.area;
        let line_inertia = p.density * (p.second_moments[0] + p.second_moments[1]);
        let mut mass = Vec::with_capacity(self.dof());
        let mut load = Vec::with_capacity(self.nodes.len());
        for (i, length) in self.line.node.iter().enumerate() {
            let node_mass = line_density * *length;
            mass.extend([node_mass; 3]);
            mass.extend(self.line.spin.get(i).map(|l| line_inertia * *l));
            load.push(DeadLoad { force: self.gravity.map(|g| node_mass * g) });
        }
        let mut rod = SpatialRod { stretch: stretch.collect(), joint: joint.collect(), mass, load };
        self.add_loads(&mut rod, &self.loads);
        rod
    }

    fn add_loads<D: Nestable>(&self, rod: &mut SpatialRod<D>, loads: &[NodalLoad]) {
        for load in loads {
            let force = self.components(load.force);
            for c in 0..3 {
                rod.load[load.node].force[c] += D::from(force[c]);
            }
        }
    }

    fn dof(&self) -> usize {
        4 * self.nodes.len() - 1
    }

    fn rest(&self) -> Vec<f64> {
        let mut q: Vec<f64> = self.nodes.iter().flat_map(|[x, y, z]| [*x, *y, *z, 0.0]).collect();
        q.pop();
        q
    }

    fn frames(&self) -> Frames<f64> {
        self.frames.clone()
    }

    fn lift<D: Nestable>(frames: &Frames<f64>) -> Frames<D> {
        let lift = |v: [f64; 3]| v.map(D::from);
        let edge = |frame: &EdgeFrame<f64>| EdgeFrame {
            tangent: lift(frame.tangent),
            director: lift(frame.director),
        };
        Frames {
            edges: frames.edges.iter().map(edge).collect(),
            twist: frames.twist.iter().map(|t| D::from(*t)).collect(),
        }
    }

    /// A wall holds the outermost edge with its angle.
    fn held(&self, support: Support) -> usize {
        match support {
            Support::Free => 0,
            Support::Roller => 2,
            Support::Pinned => 3,
            Support::Clamped => 7,
        }
    }

    fn components<D: Scalar>(&self, [x, y, z]: [D; 3]) -> [D; 3] {
        self.axes.map(|axis| x * axis.x + y * axis.y + z * axis.z)
    }

    fn position<D: Scalar>(&self, q: &[D], i: usize) -> [D; 3] {
        let [x, y, z] = self.axes;
        [0, 1, 2].map(|c| q[4 * i] * x[c] + q[4 * i + 1] * y[c] + q[4 * i + 2] * z[c])
    }

    fn rate<D: Scalar>(&self, v: &[D], i: usize) -> [D; 3] {
        self.position(v, i)
    }
}
