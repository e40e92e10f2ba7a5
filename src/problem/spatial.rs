//! The model of a scene in space.

use crate::energy::adapter::Chart;
use crate::energy::bend_twist::{JointLaw, Stiffness};
use crate::energy::frame::{EdgeFrame, Frames};
use crate::energy::{DeadLoad, Stretch};
use crate::error::Error;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::{Vector, components, dot, sub, unit};
use crate::problem::curved_joints::{PLAIN, lean, resistances, slants};
use crate::problem::model::{
    Correction, Model, NodalLoad, first_director, rolling, springs, tilted,
};
use crate::problem::profile::{Constants, Profile};
use crate::problem::soft_clamp::SoftClamps;
use crate::problem::tributary::TributaryLengths;
use crate::rod::{Extra, SpatialRod};
use crate::scene::mesh::Mesh;
use crate::scene::{End, Scene, Support};
use nalgebra::Vector3;

/// The axes of a scene in space.
#[derive(Clone, Debug)]
pub struct SpatialModel {
    correction: Correction,
    nodes: usize,
    /// The model's axes in the world: the world's own, unless an end rolls.
    axes: [Vector3<f64>; 3],
    /// Of the plane of a planar scene, about which the rod as a whole may be turned.
    normal: Option<Vector3<f64>>,
}

/// The rest shape and its material frames, in the model's axes.
#[derive(Clone, Debug)]
pub struct SpatialRest<D> {
    /// Positions, m.
    nodes: Vec<Vector<D>>,
    length: Vec<D>,
    tributary: TributaryLengths<D>,
    /// The corrected form's: how the curve's tangents lie to the joints'.
    slants: Option<Vec<[D; 2]>>,
    /// Integrated curvatures in the material frame.
    curvature: Vec<[D; 2]>,
    /// Where the nodes are, as parts of the length.
    places: Vec<f64>,
    /// Space-parallel: no twist.
    frames: Frames<D>,
}

impl SpatialModel {
    pub(crate) fn new(
        scene: &Scene,
        mesh: &Mesh,
        correction: Correction,
        loads: &[NodalLoad],
        normal: Option<Vector3<f64>>,
    ) -> Result<Self, Error> {
        if let Some(load) = loads.iter().find(|load| load.moment != [0.0; 3]) {
            let found = format!("{:?} on node {} of a spatial scene", load.moment, load.node);
            let allowed = "planar scenes only: in space the work of a constant moment depends on \
                           the way; turn an end by [[supports.motion]]";
            return Err(Error::invalid("loads.point.moment", found, allowed));
        }
        let turned = normal.map(|normal| tilted(scene, &mesh.nodes, &normal));
        let nodes = turned.as_deref().unwrap_or(&mesh.nodes);
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
        Ok(Self { correction, nodes: nodes.len(), axes, normal })
    }
}

impl Model for SpatialModel {
    const STRIDE: usize = 4;
    type Rod<D: Nestable> = SpatialRod<D>;
    type Rest<D: Nestable> = SpatialRest<D>;

    fn at_rest<D: Nestable>(&self, scene: &Scene<D>, mesh: &Mesh<D>) -> SpatialRest<D> {
        let turned = self.normal.map(|normal| tilted(scene, &mesh.nodes, &normal));
        let nodes = turned.as_deref().unwrap_or(&mesh.nodes);
        let director = self.components(first_director(scene, nodes));
        let nodes: Vec<Vector<D>> = nodes.iter().map(|x| self.components(*x)).collect();
        let edges: Vec<Vector<D>> = nodes.windows(2).map(|p| sub(p[1], p[0])).collect();
        let tangents: Vec<Vector<D>> = edges.iter().map(|e| unit(*e)).collect();
        let frames = Frames::bishop(&tangents, director);
        let zero = D::from(0.0);
        let stiffness = Stiffness { bend: [zero; 3], twist: zero, coupling: [zero; 2] };
        let law = JointLaw { stiffness, natural: [zero; 3] };
        let curvature: Vec<[D; 2]> = (0..nodes.len() - 2)
            .map(|i| {
                let joint = law.at([frames.edges[i], frames.edges[i + 1]], zero);
                let [a, b, c] = [nodes[i], nodes[i + 1], nodes[i + 2]];
                let q = [a[0], a[1], a[2], zero, b[0], b[1], b[2], zero, c[0], c[1], c[2]];
                let [k1, k2, _] = joint.strains(&q);
                [k1, k2]
            })
            .collect();
        let length: Vec<D> = edges.iter().map(|e| dot(*e, *e).sqrt()).collect();
        let arcs = self.correction.arcs(mesh);
        SpatialRest {
            tributary: arcs
                .map_or_else(|| TributaryLengths::plain(&length), TributaryLengths::corrected),
            slants: arcs.map(|arcs| slants(&nodes, arcs.lengths, &frames.edges, &curvature)),
            nodes,
            length,
            curvature,
            places: mesh.places(),
            frames,
        }
    }

    fn rod<D: Nestable>(&self, scene: &Scene<D>, rest: &SpatialRest<D>) -> SpatialRod<D> {
        let profile = Profile::new(scene, &rest.places);
        let clamps = SoftClamps::new(scene, rest.length.len());
        let edges = rest.length.iter().zip(&rest.tributary.stretch).enumerate();
        let stretch = edges.map(|(j, (l, arc))| Stretch {
            stiffness: clamps.stretching(j, profile.edge(j).axial * (*l / *arc), *l),
            rest_length: *l,
            natural_strain: D::from(0.0),
        });
        let joint = rest.curvature.iter().enumerate().map(|(i, k)| {
            let per_length = rest.tributary.joint[i].recip();
            let Constants { bending, torsion, .. } = profile.joint(i);
            let [k1, k2] = bending.map(|ei| clamps.bending(i, ei * per_length));
            let k3 = torsion * per_length;
            let factor = scene.rod.natural_curvature.at(rest.places[i + 1]);
            let length = (rest.tributary.spin[i] + rest.tributary.spin[i + 1]) * 0.5;
            let bending = scene.rod.bending_at(i + 1, rest.length.len());
            let natural = [0, 1].map(|c| factor * k[c] + bending[c] * length);
            let twist = scene.rod.natural_twist.at(rest.places[i + 1]) * length;
            let [a, b, c] = match &rest.slants {
                Some(slants) => resistances(natural, lean(slants[i], factor, *k, twist)),
                None => PLAIN.map(|a| a.map(D::from)),
            };
            let entry =
                |r: usize, s: usize| k1 * (a[r] * a[s]) + k2 * (b[r] * b[s]) + k3 * (c[r] * c[s]);
            JointLaw {
                stiffness: Stiffness {
                    bend: [entry(0, 0), entry(0, 1), entry(1, 1)],
                    twist: entry(2, 2),
                    coupling: [entry(0, 2), entry(1, 2)],
                },
                natural: [natural[0], natural[1], twist],
            }
        });
        let gravity = self.components(scene.loads.gravity);
        let mut mass = Vec::with_capacity(self.dof());
        let mut load = Vec::with_capacity(rest.nodes.len());
        let (masses, weighing) = rest.tributary.immersed(&profile, scene.loads.drag.as_ref());
        for (i, node_mass) in masses.into_iter().enumerate() {
            mass.extend([node_mass; 3]);
            mass.extend(rest.tributary.spin.get(i).map(|l| profile.edge(i).line_inertia * *l));
            load.push(DeadLoad { force: gravity.map(|g| weighing[i] * g) });
        }
        let own = Extra::default();
        let sliders = springs(scene, &rest.tributary, |_| D::from(1.0));
        SpatialRod {
            stretch: stretch.collect(),
            joint: joint.collect(),
            mass,
            load,
            moments: (),
            sliders,
            own,
        }
    }

    fn node_lengths<D: Nestable>(rest: &SpatialRest<D>) -> &[D] {
        &rest.tributary.node
    }

    fn chart<D: Nestable>(&self, _: &Scene<D>, _: &SpatialRest<D>) -> Chart<D> {
        let axes = self.axes.map(Into::into);
        let world = [0, 1, 2].map(|k| [0, 1, 2].map(|c| f64::from(c == k)));
        Chart::Space { axes: (axes != world).then_some(axes) }
    }

    fn dof(&self) -> usize {
        4 * self.nodes - 1
    }

    fn unknowns<D: Nestable>(&self, rest: &SpatialRest<D>) -> Vec<D> {
        let zero = D::from(0.0);
        let mut q: Vec<D> = rest.nodes.iter().flat_map(|[x, y, z]| [*x, *y, *z, zero]).collect();
        q.pop();
        q
    }

    fn frames<D: Nestable>(&self, rest: &SpatialRest<D>) -> Frames<D> {
        rest.frames.clone()
    }

    fn frames_over<D: Nestable>(frames: &Frames<f64>) -> Frames<D> {
        let over = |v: [f64; 3]| v.map(D::from);
        let edge = |frame: &EdgeFrame<f64>| EdgeFrame {
            tangent: over(frame.tangent),
            director: over(frame.director),
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
            // Of recorded ends more nodes may be held.
            Support::Clamped | Support::Recorded => 7,
        }
    }

    fn components<D: Scalar>(&self, [x, y, z]: [D; 3]) -> [D; 3] {
        self.axes.map(|axis| x * axis.x + y * axis.y + z * axis.z)
    }

    #[inline]
    fn position<D: Scalar>(&self, q: &[D], i: usize) -> [D; 3] {
        let [x, y, z] = self.axes;
        components(|c| q[4 * i] * x[c] + q[4 * i + 1] * y[c] + q[4 * i + 2] * z[c])
    }

    #[inline]
    fn rate<D: Scalar>(&self, v: &[D], i: usize) -> [D; 3] {
        self.position(v, i)
    }
}
