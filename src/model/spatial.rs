//! The model of a scene in space.

use super::{Model, NodalLoad, rolling, voronoi_share};
use crate::energy::bend_twist::{JointLaw, Stiffness};
use crate::energy::{DeadLoad, Stretch};
use crate::error::Error;
use crate::frame::{EdgeFrame, Frames};
use crate::parameter::Properties;
use crate::rod::SpatialRod;
use crate::rod::spatial::HALF_BANDWIDTH;
use crate::scalar::{Nestable, Scalar};
use crate::scene::{End, Scene, Support};
use nalgebra::Vector3;

/// Rest shape, material frames and loads.
#[derive(Clone, Debug)]
pub struct SpatialModel {
    /// Rest positions, m.
    nodes: Vec<[f64; 3]>,
    rest_length: Vec<f64>,
    /// What dl, masses and weight count: chords, or arcs in the corrected form.
    line_length: Vec<f64>,
    /// The corrected form's.
    corrected: bool,
    /// Integrated curvatures of the rest shape in the material frame.
    rest_curvature: Vec<[f64; 2]>,
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
        nodes: &[[f64; 3]],
        arcs: Option<&[f64]>,
        loads: &[NodalLoad],
    ) -> Result<Self, Error> {
        if let Some(load) = loads.iter().find(|load| load.moment != [0.0; 3]) {
            let found = format!("{:?} on node {} of a spatial scene", load.moment, load.node);
            let allowed = "planar scenes only: in space the work of a constant moment depends on \
                           the way; turn an end by [[supports.motion]]";
            return Err(Error::invalid("loads.point.moment", found, allowed));
        }
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
        let stiffness = Stiffness { bend: [0.0; 3], twist: 0.0 };
        let zero = JointLaw { stiffness, natural: [0.0; 3] };
        let rest_curvature = (0..nodes.len() - 2)
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
            nodes,
            line_length: arcs.map_or(rest_length.clone(), <[f64]>::to_vec),
            corrected: arcs.is_some(),
            rest_length,
            rest_curvature,
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
        let stretch = self.rest_length.iter().zip(&self.line_length).map(|(l, arc)| Stretch {
            stiffness: axial * (l / arc),
            rest_length: D::from(*l),
            natural_strain: D::from(0.0),
        });
        let joints = self.line_length.windows(2).zip(&self.rest_curvature);
        let joint = joints.map(|(l, k)| {
            let per_length = 2.0 / (l[0] + l[1]);
            let natural = k.map(|k| p.natural_curvature * k);
            let ([s11, s12, s22], twist) = match self.corrected {
                true => polygon_factors(natural),
                false => ([1.0, 0.0, 1.0].map(D::from), D::from(1.0)),
            };
            // S diag(EI1, EI2) S.
            let bend = [
                ei1 * (s11 * s11) + ei2 * (s12 * s12),
                ei1 * (s11 * s12) + ei2 * (s12 * s22),
                ei1 * (s12 * s12) + ei2 * (s22 * s22),
            ];
            JointLaw {
                stiffness: Stiffness {
                    bend: bend.map(|b| b * per_length),
                    twist: gj * twist * per_length,
                },
                natural: [natural[0], natural[1], p.natural_twist * per_length.recip()],
            }
        });
        let line_density = p.density * p.area;
        let line_inertia = p.density * (p.second_moments[0] + p.second_moments[1]);
        let count = self.nodes.len();
        let mut mass = Vec::with_capacity(self.dof());
        let mut load = Vec::with_capacity(count);
        for i in 0..count {
            let node_mass = line_density * voronoi_share(&self.line_length, i);
            mass.extend([node_mass; 3]);
            mass.extend(self.line_length.get(i).map(|l| line_inertia * *l));
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

    fn components(&self, vector: [f64; 3]) -> [f64; 3] {
        self.axes.map(|axis| axis.dot(&Vector3::from(vector)))
    }

    fn position(&self, q: &[f64], i: usize) -> [f64; 3] {
        let [x, y, z] = self.axes;
        (x * q[4 * i] + y * q[4 * i + 1] + z * q[4 * i + 2]).into()
    }

    fn rate(&self, v: &[f64], i: usize) -> [f64; 3] {
        self.position(v, i)
    }
}

/// How much softer than the curve's a joint with the natural curvature `k` must be: the symmetric
/// matrix `S = [s11, s12, s22]` that takes strains to rotations of one edge against the other, and
/// the factor of the torsional stiffness. See [`super`].
fn polygon_factors<D: Scalar>(k: [D; 2]) -> ([D; 3], D) {
    let squared = k[0] * k[0] + k[1] * k[1];
    let c2 = (squared * 0.25 + 1.0).recip();
    let c = c2.sqrt();
    // (c2 - c)/squared: 1 - c = (1 - c2)/(1 + c), and 1 - c2 = c2 squared/4.
    let along = -(c2 * c) / (c + 1.0) * 0.25;
    ([c + along * k[0] * k[0], along * k[0] * k[1], c + along * k[1] * k[1]], c2)
}
