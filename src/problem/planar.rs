//! The model of a scene that lies in a plane.

use crate::energy::adapter::Chart;
use crate::energy::{DeadLoad, DeadMoment, PlanarBend, Stretch, planar_bend};
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::{Vector, dot, sub};
use crate::problem::model::{
    Correction, Model, NodalLoad, first_director, rolling, springs, tilted,
};
use crate::problem::own;
use crate::problem::profile::Profile;
use crate::problem::soft_clamp::SoftClamps;
use crate::problem::tributary::TributaryLengths;
use crate::rod::{Extra, Moments, PlanarRod};
use crate::scene::mesh::Mesh;
use crate::scene::supports::Moment;
use crate::scene::{End, Plane, Scene, Support, Track};
use nalgebra::Vector3;
use num_dual::Dual64;

/// The plane of a scene, and how its rod lies in it.
#[derive(Clone, Debug)]
pub struct PlanarModel {
    /// The plane.
    pub plane: Plane,
    correction: Correction,
    /// Which of the section's two second moments resists bending in the plane.
    second_moment: usize,
    nodes: usize,
}

/// The rest shape in the plane.
#[derive(Clone, Debug)]
pub struct PlanarRest<D> {
    /// Positions, m.
    nodes: Vec<[D; 2]>,
    length: Vec<D>,
    tributary: TributaryLengths<D>,
    curvature: Vec<D>,
    /// Where the nodes are, as parts of the length.
    places: Vec<f64>,
}

/// How far from the plane a vector may point, relative to its length.
const TOLERANCE: f64 = 1e-9;
/// Changes of what changes slower than this part of the fastest, for their sizes, are rounding errors.
const ROUNDING: f64 = 1e-10;

impl PlanarModel {
    /// Which of the section's two second moments resists bending in the plane.
    pub(crate) fn second_moment(&self) -> usize {
        self.second_moment
    }

    /// The model, or what leaves the plane of the rest. `start` is the shape the rod starts in, if
    /// not the rest shape of the `mesh`.
    pub(crate) fn new(
        scene: &Scene,
        mesh: &Mesh,
        start: Option<&[Vector<f64>]>,
        correction: Correction,
    ) -> Result<Self, String> {
        let nodes = &mesh.nodes[..];
        let along = Vector3::from(nodes[1]) - Vector3::from(nodes[0]);
        let Directions { within, across } = Directions::of(scene, nodes, start);
        let vector = |(key, v): &Named<f64>| (key.clone(), Vector3::from(*v));
        let mut vectors: Vec<(String, Vector3<f64>)> = within.iter().map(vector).collect();
        // A turn lies across its plane.
        let turns = || across.iter().map(vector);
        vectors.extend(turns().map(|(key, turn)| (key, turn.cross(&along))));
        let up = scene.rod.section.up().map(Vector3::from);
        let leaves = |what: &str| format!("{what} leaves the plane of the rest");
        let mut plane = Plane::through(nodes, &vectors, up).map_err(|what| leaves(&what))?;
        for (key, turn) in turns() {
            if plane.components(turn).0.norm() > TOLERANCE * turn.norm() {
                return Err(leaves(&key));
            }
        }
        if let Some((key, _)) = turns_of_the_rod(scene).into_iter().find(|(_, t)| *t != 0.0) {
            return Err(leaves(&key));
        }
        if !scene.rod.natural_bending.is_empty() {
            return Err(leaves("rod.natural_bending"));
        }
        let normal = plane.x.cross(&plane.y);
        if let Some(energy) = own::leaving(&scene.energies, normal, plane.origin) {
            return Err(leaves(&energy));
        }
        let mut model = Self { plane: plane.clone(), correction, second_moment: 0, nodes: 0 };
        let tilted = tilted(scene, nodes, &model.normal());
        // A roller at the end holds the last coordinate of its node, one at the start the first, so
        // that the free unknowns stay side by side.
        if let Some((end, direction)) = rolling(scene, &tilted) {
            let normal = plane.x.cross(&plane.y);
            let along = direction.normalize();
            (plane.x, plane.y) = match end {
                End::End => (along, normal.cross(&along)),
                End::Start => (along.cross(&normal), along),
            };
        }
        let second_moment = second_moment_in(scene, &plane, &tilted)
            .ok_or("rod.section.up is neither in the plane of the rest nor across it")?;
        model = Self { plane, second_moment, nodes: nodes.len(), ..model };
        Ok(model)
    }

    /// What leaves the plane when the scene's numbers change as their derivatives say.
    pub(crate) fn left_by(
        &self,
        scene: &Scene<Dual64>,
        mesh: &Mesh<Dual64>,
        start: Option<&[Vector<Dual64>]>,
    ) -> Option<String> {
        let size = |v: &[f64]| v.iter().map(|c| c * c).sum::<f64>().sqrt();
        let rate = |v: Vector<Dual64>| self.components(v).map(|c| c.eps);
        let Directions { mut within, mut across } = Directions::of(scene, &mesh.nodes, start);
        within.extend(mesh.nodes.iter().map(|x| ("rod.shape".into(), *x)));
        if let Some(up) = scene.rod.section.up_across(&mesh.nodes) {
            let moments = scene.second_moments_along();
            let key = "rod.section.up".to_string();
            let [x, y, z] = self.components(up.map(|c| c.re));
            let (in_plane, out) = (x.hypot(y), z.abs());
            if moments.iter().any(|[i1, i2]| i1.re != i2.re) {
                if in_plane > out { &mut within } else { &mut across }.push((key, up));
            } else if moments.iter().any(|[i1, i2]| i1.eps != i2.eps)
                && in_plane.min(out) > TOLERANCE
            {
                // A square has no axes of its own until it stops being one.
                return Some("rod.section".into());
            }
        }
        // How fast it changes, for its size; what has none has no rounding errors either.
        let relative = |(_, v): &Named<Dual64>| match size(&v.map(|c| c.re)) {
            0.0 => None,
            whole => Some(size(&rate(*v)) / whole),
        };
        let fastest = within.iter().chain(&across).filter_map(relative).fold(0.0, f64::max);
        let changes =
            |named: &Named<Dual64>| relative(named).is_none_or(|r| r > ROUNDING * fastest);
        let out = |named: &Named<Dual64>| {
            let rate = rate(named.1);
            rate[2].abs() > TOLERANCE * size(&rate) && changes(named)
        };
        let off = |named: &Named<Dual64>| {
            let rate = rate(named.1);
            size(&rate[..2]) > TOLERANCE * size(&rate) && changes(named)
        };
        if let Some(energy) = own::left_by(&scene.energies, self.normal(), self.plane.origin) {
            return Some(energy);
        }
        let named = within.into_iter().find(out).or(across.into_iter().find(off));
        let turned = turns_of_the_rod(scene).into_iter().find(|(_, turn)| turn.eps != 0.0);
        named.map(|(key, _)| key).or(turned.map(|(key, _)| key))
    }

    /// The normal of the plane.
    pub(crate) fn normal(&self) -> Vector3<f64> {
        self.plane.x.cross(&self.plane.y)
    }

    /// A point in the plane's axes.
    fn projected<D: Scalar>(&self, point: Vector<D>) -> [D; 2] {
        let [x, y, _] = self.components(point);
        [x, y]
    }
}

impl<D: Scalar> PlanarRest<D> {
    /// Of an edge, m.
    fn direction(&self, edge: usize) -> [D; 2] {
        let [a, b] = [self.nodes[edge], self.nodes[edge + 1]];
        [b[0] - a[0], b[1] - a[1]]
    }
}

impl Model for PlanarModel {
    const STRIDE: usize = 2;
    type Rod<D: Nestable> = PlanarRod<D>;
    type Rest<D: Nestable> = PlanarRest<D>;

    fn at_rest<D: Nestable>(&self, scene: &Scene<D>, mesh: &Mesh<D>) -> PlanarRest<D> {
        let tilted = tilted(scene, &mesh.nodes, &self.normal());
        let nodes: Vec<[D; 2]> = tilted.iter().map(|x| self.projected(*x)).collect();
        let chord = |p: &[[D; 2]]| {
            let [x, y] = [p[1][0] - p[0][0], p[1][1] - p[0][1]];
            (x * x + y * y).sqrt()
        };
        let length: Vec<D> = nodes.windows(2).map(chord).collect();
        let joints = nodes.windows(3);
        let curvature = joints
            .map(|p| planar_bend::curvature(p.first_chunk().expect("windows of three")))
            .collect();
        let arcs = self.correction.arcs(mesh);
        let tributary =
            arcs.map_or_else(|| TributaryLengths::plain(&length), TributaryLengths::corrected);
        PlanarRest { nodes, length, tributary, curvature, places: mesh.places() }
    }

    fn rod<D: Nestable>(&self, scene: &Scene<D>, rest: &PlanarRest<D>) -> PlanarRod<D> {
        let profile = Profile::new(scene, &rest.places);
        let clamps = SoftClamps::new(scene, rest.length.len());
        let edges = rest.length.iter().zip(&rest.tributary.stretch).enumerate();
        let stretch = edges.map(|(j, (l, arc))| Stretch {
            stiffness: clamps.stretching(j, profile.edge(j).axial * (*l / *arc), *l),
            rest_length: *l,
            natural_strain: D::from(0.0),
        });
        let joints = rest.tributary.joint.iter().zip(&rest.curvature).enumerate();
        let bend = joints.map(|(i, (l, k))| {
            let natural = scene.rod.natural_curvature.at(rest.places[i + 1]) * *k;
            // EI over the joint's length, times cos^4(phi/2) in the corrected form.
            let own = profile.joint(i).bending[self.second_moment] * l.recip();
            let mut stiffness = clamps.bending(i, own);
            if self.correction.arcs {
                stiffness /= (natural * natural * 0.25 + 1.0).powi(2);
            }
            PlanarBend { stiffness, natural_curvature: natural }
        });
        // Springs slip by their energy over the mean bending stiffness, as in space, and here they bend in the plane only.
        let slips = |i: usize| {
            let per_length = rest.tributary.joint[i].recip();
            let both = profile.joint(i).bending.map(|ei| clamps.bending(i, ei * per_length));
            ((both[0] + both[1]) * 0.5 / both[self.second_moment]).sqrt()
        };
        let (node_mass, weighing) = rest.tributary.immersed(&profile, scene.loads.drag.as_ref());
        let gravity = self.projected(scene.loads.gravity);
        let load: Vec<DeadLoad<D, 2>> =
            weighing.iter().map(|m| DeadLoad { force: gravity.map(|g| *m * g) }).collect();
        PlanarRod {
            stretch: stretch.collect(),
            joint: bend.collect(),
            mass: node_mass.iter().flat_map(|m| [*m, *m]).collect(),
            load,
            moments: Moments { list: Vec::new(), heading: rest.direction(0) },
            sliders: springs(scene, &rest.tributary, slips),
            own: Extra::default(),
        }
    }

    fn add_moments<D: Nestable>(
        &self,
        rod: &mut PlanarRod<D>,
        rest: &PlanarRest<D>,
        loads: &[NodalLoad<D>],
    ) {
        for load in loads {
            let [_, _, moment] = self.components(load.moment);
            if moment.value() != 0.0 || D::ORDER > 0 {
                let last = rest.length.len() - 1;
                for edge in [load.node.saturating_sub(1), load.node.min(last)] {
                    let rest = rest.direction(edge);
                    rod.moments.list.push((edge, DeadMoment { moment: moment * 0.5, rest }));
                }
            }
        }
    }

    fn node_lengths<D: Nestable>(rest: &PlanarRest<D>) -> &[D] {
        &rest.tributary.node
    }

    fn chart<D: Nestable>(&self, scene: &Scene<D>, rest: &PlanarRest<D>) -> Chart<D> {
        let tilted = tilted(scene, &scene.made_mesh().nodes, &self.normal());
        let [along, aside, out] = self.components(first_director(scene, &tilted));
        let [x, y] = rest.direction(0);
        let length = (x * x + y * y).sqrt();
        let Plane { origin, x: right, y: up } = &self.plane;
        Chart::Plane {
            origin: (*origin).into(),
            axes: [(*right).into(), (*up).into()],
            across: [(x * aside - y * along) / length, out],
        }
    }

    fn dof(&self) -> usize {
        2 * self.nodes
    }

    fn unknowns<D: Nestable>(&self, rest: &PlanarRest<D>) -> Vec<D> {
        rest.nodes.iter().flatten().copied().collect()
    }

    fn frames<D: Nestable>(&self, _: &PlanarRest<D>) {}

    fn frames_over<D: Nestable>((): &()) {}

    fn held(&self, support: Support) -> usize {
        match support {
            Support::Free => 0,
            Support::Roller => 1,
            Support::Pinned => 2,
            // Of recorded ends more nodes may be held.
            Support::Clamped | Support::Recorded => 4,
        }
    }

    fn components<D: Scalar>(&self, [x, y, z]: [D; 3]) -> [D; 3] {
        let axes = [self.plane.x, self.plane.y, self.normal()];
        axes.map(|axis| x * axis.x + y * axis.y + z * axis.z)
    }

    #[inline]
    fn position<D: Scalar>(&self, q: &[D], i: usize) -> [D; 3] {
        self.plane.to_world([q[2 * i], q[2 * i + 1]])
    }

    #[inline]
    fn rate<D: Scalar>(&self, v: &[D], i: usize) -> [D; 3] {
        self.plane.direction_to_world([v[2 * i], v[2 * i + 1]])
    }
}

/// A vector with the key it stands under.
type Named<D> = (String, Vector<D>);

/// What must lie in the plane beside the rest shape, and the turns, which must lie across it.
struct Directions<D> {
    within: Vec<Named<D>>,
    across: Vec<Named<D>>,
}

impl<D: Scalar> Directions<D> {
    fn of(scene: &Scene<D>, nodes: &[Vector<D>], start: Option<&[Vector<D>]>) -> Self {
        let mut within = vec![
            ("loads.gravity".to_string(), scene.loads.gravity),
            ("initial.velocity".into(), scene.initial.velocity),
        ];
        let mut across =
            vec![("initial.angular_velocity".to_string(), scene.initial.angular_velocity)];
        if let Some(drag) = &scene.loads.drag {
            within.push(("loads.drag.fluid_velocity".into(), drag.fluid_velocity));
        }
        for (table, points) in [("loads", &scene.loads.point), ("initial", &scene.initial.point)] {
            for (i, load) in points.iter().enumerate() {
                within.push((format!("{table}.point[{i}].force"), load.force));
                across.push((format!("{table}.point[{i}].moment"), load.moment));
            }
        }
        for (i, motion) in scene.supports.motion.iter().enumerate() {
            let key = format!("supports.motion[{i}]");
            within.push((format!("{key}.displacement"), motion.displacement));
            across.push((format!("{key}.rotation"), motion.rotation));
            let times = motion.track.as_ref().map_or(&[][..], |track| track.times());
            let way = times.iter().filter_map(|t| motion.recorded(Moment::Time(D::from(*t))));
            within.extend(way.map(|x| (format!("{key}.file"), x)));
        }
        // A recording has no derivatives.
        if D::PLAIN
            && let Some(track) = scene.supports.path.as_ref().and_then(|p| p.track.as_ref())
        {
            within.extend(seen_from(nodes, track).map(|x| ("supports.path".into(), x)));
        }
        if let Some(roller) = scene.supports.roller {
            within.push(("supports.roller".into(), roller.map(D::from)));
        }
        if let Some(start) = start {
            let key = if scene.supports.path.is_some() { "supports.path" } else { "initial.shape" };
            within.extend(start.iter().map(|x| (key.into(), sub(*x, nodes[0]))));
        }
        Self { within, across }
    }
}

/// Where the markers are at all frames, from the first node; but for those that are at it.
fn seen_from<D: Scalar>(nodes: &[Vector<D>], track: &Track) -> impl Iterator<Item = Vector<D>> {
    let places = track.markers().iter().flat_map(|marker| marker.seen.iter().flatten());
    let origin = nodes[0].map(|x| x.value());
    let vectors = places.map(move |x| sub(*x, origin));
    let reach = vectors.clone().map(|v| dot(v, v)).fold(0.0, f64::max);
    vectors.filter(move |v| dot(*v, *v) > 1e-12 * reach).map(|v| v.map(D::from))
}

/// What turns the rod about itself, rad or rad/m.
fn turns_of_the_rod<D: Scalar>(scene: &Scene<D>) -> Vec<(String, D)> {
    let twists = scene.rod.natural_twist.values().into_iter();
    let twists = twists.map(|t| ("rod.natural_twist".into(), t));
    let motions = scene.supports.motion.iter().enumerate();
    let motions = motions.map(|(i, motion)| (format!("supports.motion[{i}].twist"), motion.twist));
    twists.chain(motions).collect()
}

/// Which second moment resists bending in the plane: 0 with `up` in the plane, 1 across it; none
/// when bending leaves the plane.
fn second_moment_in(scene: &Scene, plane: &Plane, nodes: &[Vector<f64>]) -> Option<usize> {
    let Some(up) = scene.rod.section.up_across(nodes) else { return Some(0) };
    let square = scene.second_moments_along().iter().all(|[i1, i2]| i1 == i2);
    let (in_plane, out) = plane.components(up.into());
    match () {
        // Of a square's two equal ones, the one that it is when the square stops being one.
        () if out.abs() <= TOLERANCE => Some(0),
        () if in_plane.norm() <= TOLERANCE => Some(1),
        () if square => Some(0),
        () => None,
    }
}
