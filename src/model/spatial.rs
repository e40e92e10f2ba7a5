//! The model of a scene in space.

use super::{Model, voronoi_share};
use crate::energy::bend_twist::JointLaw;
use crate::energy::{DeadLoad, Stretch};
use crate::error::Error;
use crate::frame::{EdgeFrame, Frames};
use crate::parameter::Properties;
use crate::rod::SpatialRod;
use crate::rod::spatial::HALF_BANDWIDTH;
use crate::scalar::Nestable;
use crate::scene::{Scene, Support};
use nalgebra::Vector3;

/// Rest shape, material frames and loads.
#[derive(Clone, Debug)]
pub struct SpatialModel {
    /// Rest positions, m.
    nodes: Vec<[f64; 3]>,
    rest_length: Vec<f64>,
    /// Integrated curvatures of the rest shape in the material frame.
    rest_curvature: Vec<[f64; 2]>,
    /// Space-parallel at rest: no twist.
    frames: Frames<f64>,
    /// m/s^2.
    gravity: [f64; 3],
    /// Node and force, N.
    forces: Vec<(usize, [f64; 3])>,
}

impl SpatialModel {
    pub(crate) fn new(
        scene: &Scene,
        nodes: &[[f64; 3]],
        forces: &[(usize, [f64; 3])],
    ) -> Result<Self, Error> {
        let edges: Vec<Vector3<f64>> =
            nodes.windows(2).map(|p| Vector3::from(p[1]) - Vector3::from(p[0])).collect();
        let tangents: Vec<[f64; 3]> = edges.iter().map(|e| e.normalize().into()).collect();
        // m1 along `up`; a circle takes any direction across, the one most across.
        let director = match scene.rod.section.up_across(nodes)? {
            Some(up) => up,
            None => {
                let t = Vector3::from(tangents[0]);
                let axis = Vector3::ith(t.map(f64::abs).imin(), 1.0);
                (axis - t * t.dot(&axis)).normalize()
            }
        };
        let frames = Frames::bishop(&tangents, director.into());
        let zero = JointLaw { stiffness: [0.0; 3], natural: [0.0; 3] };
        let rest_curvature = (0..nodes.len() - 2)
            .map(|i| {
                let joint = zero.at([frames.edges[i], frames.edges[i + 1]], 0.0);
                let [a, b, c] = [nodes[i], nodes[i + 1], nodes[i + 2]];
                let q = [a[0], a[1], a[2], 0.0, b[0], b[1], b[2], 0.0, c[0], c[1], c[2]];
                let [k1, k2, _] = joint.strains(&q);
                [k1, k2]
            })
            .collect();
        Ok(Self {
            nodes: nodes.to_vec(),
            rest_length: edges.iter().map(Vector3::norm).collect(),
            rest_curvature,
            frames,
            gravity: scene.loads.gravity,
            forces: forces.to_vec(),
        })
    }
}

impl Model<HALF_BANDWIDTH> for SpatialModel {
    type Rod<D: Nestable> = SpatialRod<D>;

    fn rod<D: Nestable>(&self, p: &Properties<D>) -> SpatialRod<D> {
        let axial = p.youngs_modulus * p.area;
        let [ei1, ei2] = p.second_moments.map(|i| p.youngs_modulus * i);
        let gj = p.shear_modulus * p.torsion_constant;
        let stretch = self.rest_length.iter().map(|l| Stretch {
            stiffness: axial,
            rest_length: D::from(*l),
            natural_strain: D::from(0.0),
        });
        let joints = self.rest_length.windows(2).zip(&self.rest_curvature);
        let joint = joints.map(|(l, k)| {
            let per_length = 2.0 / (l[0] + l[1]);
            JointLaw {
                stiffness: [ei1 * per_length, ei2 * per_length, gj * per_length],
                natural: [p.natural_curvature * k[0], p.natural_curvature * k[1], D::from(0.0)],
            }
        });
        let line_density = p.density * p.area;
        let line_inertia = p.density * (p.second_moments[0] + p.second_moments[1]);
        let count = self.nodes.len();
        let mut mass = Vec::with_capacity(self.dof());
        let mut load = Vec::with_capacity(count);
        for i in 0..count {
            let node_mass = line_density * voronoi_share(&self.rest_length, i);
            mass.extend([node_mass; 3]);
            mass.extend(self.rest_length.get(i).map(|l| line_inertia * *l));
            load.push(DeadLoad { force: self.gravity.map(|g| node_mass * g) });
        }
        for (i, force) in &self.forces {
            for c in 0..3 {
                load[*i].force[c] += D::from(force[c]);
            }
        }
        SpatialRod { stretch: stretch.collect(), joint: joint.collect(), mass, load }
    }

    fn dof(&self) -> usize {
        4 * self.nodes.len() - 1
    }

    fn rest(&self) -> Vec<f64> {
        let mut q: Vec<f64> = self.nodes.iter().flat_map(|[x, y, z]| [*x, *y, *z, 0.0]).collect();
        q.pop();
        q
    }

    fn frames<D: Nestable>(&self) -> Frames<D> {
        let lift = |v: [f64; 3]| v.map(D::from);
        let edge = |frame: &EdgeFrame<f64>| EdgeFrame {
            tangent: lift(frame.tangent),
            director: lift(frame.director),
        };
        Frames {
            edges: self.frames.edges.iter().map(edge).collect(),
            twist: self.frames.twist.iter().map(|t| D::from(*t)).collect(),
        }
    }

    /// A wall holds the outermost edge with its angle.
    fn held(&self, support: Support) -> usize {
        match support {
            Support::Free => 0,
            Support::Pinned => 3,
            Support::Clamped => 7,
        }
    }

    fn position(&self, q: &[f64], i: usize) -> [f64; 3] {
        [q[4 * i], q[4 * i + 1], q[4 * i + 2]]
    }

    fn rate(&self, v: &[f64], i: usize) -> [f64; 3] {
        self.position(v, i)
    }
}
