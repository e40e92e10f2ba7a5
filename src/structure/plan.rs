//! Discrete choices of a structure, which have no derivatives: supports of rod ends, coordinates of bodies, places
//! of rods.
//!
//! Input: a validated scene, in a plane or in space. A [`StructurePlan`] states for every end of a rod whether it is
//! free, recorded, at a wall, or on a body. A wall or body holds its direction (clamped), or not (pinned), a body also
//! through a spring. A joint without a body of `[[bodies]]` gets a body of its own, which does not rotate if its ends
//! are pinned. Coordinates of bodies and springs are numbered for a small envelope of the tangent (reverse
//! Cuthill-McKee).
//!
//! Each rod is placed by its origin, or by the first joint to a placed rod or a body with an offset. The first rod is
//! at zero without an origin. Joints of one body without offsets are at one point.
//!
//! Errors: roller supports, unknown names, ends held twice, joints with two bodies or fewer than two entries, and
//! springs (or hinges in space) whose body is not the first entry. So are rods that nothing places, and rods or bodies
//! without joint and support.

use crate::error::{Error, ensure};
use crate::numerics::envelope::reverse_cuthill_mckee;
use crate::scene::Support;
use crate::scene::structure::{JointEnd, StructureJoint, StructureScene};

/// Support of an end of a rod.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EndSupport {
    /// Nothing holds the end.
    Free,
    /// A wall holds the end: position and direction, or position alone (`pinned`).
    Wall { pinned: bool },
    /// A body holds the end: position and direction, position alone (`pinned`), or the direction by a spring.
    Body { body: usize, spring: Option<usize>, pinned: bool },
    /// The end follows recorded markers; the number is the index of the support.
    Recorded(usize),
}

impl EndSupport {
    /// The support of the end in the scene of the rod alone: free, pinned at a hinge, or clamped at a wall, a rigid
    /// joint or a spring. A recorded end is free there, as its motion is prescribed in the assembly.
    pub fn support(self) -> Support {
        match self {
            Self::Free | Self::Recorded(_) => Support::Free,
            Self::Wall { pinned: true } | Self::Body { pinned: true, .. } => Support::Pinned,
            Self::Wall { .. } | Self::Body { .. } => Support::Clamped,
        }
    }
}

/// A body of `[[bodies]]`, or the common pose of a joint.
#[derive(Clone, Debug)]
pub(super) struct BodyPlan {
    /// Index in `[[bodies]]`; none of a joint.
    pub own: Option<usize>,
    /// Index of its joint; none of a body.
    pub joint: Option<usize>,
    /// Whether it has a rotation.
    pub rotates: bool,
    /// Coordinate x; the others follow, and then the rotation.
    pub coordinate: usize,
}

/// A rotational spring of a joint, or in space its hinge.
#[derive(Clone, Debug)]
pub(super) struct SpringPlan {
    /// Index of the joint.
    pub joint: usize,
    /// The body that it acts on.
    pub body: usize,
    /// First coordinate of the rotation of the sprung clamp.
    pub coordinate: usize,
}

/// A point of a joint: an end of a rod, or a point of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JointPoint {
    /// Rod and end.
    Rod(usize, usize),
    /// Body of `[[bodies]]`, with the index of the connection that gives the offset.
    Body(usize, usize),
}

/// The place of a rod: by itself, or by a joint.
#[derive(Clone, Copy, Debug)]
pub(super) enum Placement {
    /// By its own origin, or at the origin.
    Origin(usize),
    /// By a joint: the end of the rod is at another point of the joint.
    Joint { rod: usize, end: usize, joint: usize, at: JointPoint },
}

/// The discrete choices of a structure.
#[derive(Clone, Debug)]
pub(super) struct StructurePlan {
    /// Both ends of every rod.
    pub ends: Vec<[EndSupport; 2]>,
    pub bodies: Vec<BodyPlan>,
    pub springs: Vec<SpringPlan>,
    /// Number of coordinates of all bodies and springs.
    pub coordinates: usize,
    /// The places of all rods, each after those that it depends on.
    pub placements: Vec<Placement>,
    /// The points of every joint.
    pub joints: Vec<Vec<JointPoint>>,
}

/// The rod and end, or the body, of entry `number` of a joint: `rod` with `at`, or `body` with an optional offset.
/// Other combinations and unknown names are an error with `key`.
fn joint_point(
    scene: &StructureScene,
    key: &str,
    number: usize,
    end: &JointEnd,
) -> Result<JointPoint, Error> {
    let allowed = "{ rod = \"..\", at = \"start\" or \"end\" } or { body = \"..\", offset = [..] }";
    match (&end.rod, end.at, &end.body, &end.offset) {
        (Some(rod), Some(at), None, None) => {
            Ok(JointPoint::Rod(scene.rod(&format!("{key}.rod"), rod)?, at.index()))
        }
        (None, None, Some(body), _) => {
            Ok(JointPoint::Body(scene.body(&format!("{key}.body"), body)?, number))
        }
        _ => Err(Error::invalid(key, "neither an end of a rod nor a body", allowed)),
    }
}

impl StructurePlan {
    /// The choices for a validated scene, in a plane or in space, from supports, then joints in order. Errors: rollers,
    /// unknown names, an end in two joints or supports, a joint with fewer than two entries or with two bodies. A
    /// spring or a hinge in space whose body is not the first entry, rods and bodies that nothing connects, and a rod
    /// that nothing places, are errors too.
    pub fn new(scene: &StructureScene, in_space: bool) -> Result<Self, Error> {
        let mut plan = Self {
            ends: vec![[EndSupport::Free; 2]; scene.rods.len()],
            bodies: Vec::new(),
            springs: Vec::new(),
            coordinates: 0,
            placements: Vec::new(),
            joints: Vec::new(),
        };
        let own = |i| BodyPlan { own: Some(i), joint: None, rotates: true, coordinate: 0 };
        plan.bodies.extend((0..scene.bodies.len()).map(own));
        for (i, support) in scene.supports.iter().enumerate() {
            let rod = scene.rod(&format!("supports[{i}].of.rod"), &support.of.rod)?;
            let end = support.of.at.index();
            let key = format!("supports[{i}].kind");
            let hold = match support.kind {
                Support::Clamped => EndSupport::Wall { pinned: false },
                Support::Pinned => EndSupport::Wall { pinned: true },
                Support::Free => EndSupport::Free,
                Support::Recorded => EndSupport::Recorded(i),
                Support::Roller => {
                    let found = format!("\"{:?}\"", support.kind).to_lowercase();
                    let allowed =
                        "\"clamped\", \"pinned\", \"recorded\" or \"free\", in a structure";
                    return Err(Error::invalid(key, found, allowed));
                }
            };
            plan.hold(scene, (rod, end), hold, &format!("supports[{i}].of"))?;
        }
        for (i, joint) in scene.joints.iter().enumerate() {
            plan.add_joint(scene, i, joint, in_space)?;
        }
        plan.check_connected(scene)?;
        plan.number_coordinates(in_space);
        plan.place_rods(scene)?;
        Ok(plan)
    }

    /// Sets the support `hold` of an end, `(rod, end)`. An error, with `key`, if a joint or another support holds it
    /// already.
    fn hold(
        &mut self,
        scene: &StructureScene,
        (rod, end): (usize, usize),
        hold: EndSupport,
        key: &str,
    ) -> Result<(), Error> {
        let found = format!("the {} of rod {}", END_NAMES[end], scene.rods[rod].name);
        let is_free = self.ends[rod][end] == EndSupport::Free;
        ensure(is_free, key, found, "an end in no other joint and support")?;
        self.ends[rod][end] = hold;
        Ok(())
    }

    /// Adds joint `number` of the scene: its points, and the support of each rod end that it connects. The ends are
    /// held by the body that the joint names, or by a new one, which does not rotate if they are pinned. The ends of a
    /// ball are pinned, and of a hinge in a plane. Springs, and hinges in space, add a spring for each rod end after
    /// the first entry. Errors: fewer than two entries, two bodies, an end held twice, and a spring whose body is not
    /// the first entry.
    fn add_joint(
        &mut self,
        scene: &StructureScene,
        number: usize,
        joint: &StructureJoint,
        in_space: bool,
    ) -> Result<(), Error> {
        let key = format!("joints[{number}].connects");
        let connects = joint.connects();
        ensure(connects.len() >= 2, &*key, connects.len(), "two or more entries")?;
        let ends = connects.iter().enumerate();
        let points = ends
            .map(|(k, end)| joint_point(scene, &format!("{key}[{k}]"), k, end))
            .collect::<Result<Vec<_>, _>>()?;
        let bodies = points.iter().filter_map(|point| match point {
            JointPoint::Body(body, _) => Some(*body),
            JointPoint::Rod(..) => None,
        });
        let bodies: Vec<usize> = bodies.collect();
        ensure(bodies.len() <= 1, &*key, "two bodies", "at most one body, and rods")?;
        let is_hinge = matches!(joint, StructureJoint::Hinge { .. });
        let pinned = matches!(joint, StructureJoint::Ball { .. }) || (is_hinge && !in_space);
        // The body of the scene, or a new one for the joint.
        let body = bodies.first().copied().unwrap_or_else(|| {
            let body = BodyPlan { own: None, joint: Some(number), rotates: !pinned, coordinate: 0 };
            self.bodies.push(body);
            self.bodies.len() - 1
        });
        let is_spring = matches!(joint, StructureJoint::Spring { .. }) || (is_hinge && in_space);
        let first_is_body = matches!(points[0], JointPoint::Body(..));
        let found = "a body that is not the first entry";
        ensure(!is_spring || bodies.is_empty() || first_is_body, &*key, found, "the body first")?;
        for (k, point) in points.iter().enumerate() {
            let JointPoint::Rod(rod, end) = *point else { continue };
            // The first entry is fixed to the body of the joint; each further one turns against it.
            let spring = (is_spring && k > 0).then(|| {
                self.springs.push(SpringPlan { joint: number, body, coordinate: 0 });
                self.springs.len() - 1
            });
            let hold = EndSupport::Body { body, spring, pinned };
            self.hold(scene, (rod, end), hold, &format!("{key}[{k}]"))?;
        }
        self.joints.push(points);
        Ok(())
    }

    /// Rejects a rod with two free ends, unless it may touch something, or is the only rod and there is no body. Also
    /// rejects a body of `[[bodies]]` that no joint connects to a rod. The error has the name of the first one.
    fn check_connected(&self, scene: &StructureScene) -> Result<(), Error> {
        let touches = !(scene.contacts.is_empty() && scene.rod_contacts.is_empty());
        let several = !touches && (self.ends.len() > 1 || !scene.bodies.is_empty());
        for (rod, ends) in scene.rods.iter().zip(&self.ends) {
            let alone = several && *ends == [EndSupport::Free; 2];
            let allowed = "a rod with a joint or a support, or a structure with contacts";
            ensure(!alone, format!("rods.{}", rod.name), "neither joint nor support", allowed)?;
        }
        for (i, body) in scene.bodies.iter().enumerate() {
            let held =
                |hold: &EndSupport| matches!(hold, EndSupport::Body { body, .. } if *body == i);
            let alone = !self.ends.iter().flatten().any(held);
            let allowed = "a body in one of [[joints]]";
            ensure(!alone, format!("bodies.{}", body.name), "no joint", allowed)?;
        }
        Ok(())
    }

    /// Numbers the coordinates of bodies and springs; those of bodies with a common rod are near each other (reverse
    /// Cuthill-McKee). A body that does not rotate has 2 in a plane and 4 in space; a rotating body 3 and 8; a spring 1
    /// and 4, after its body. In space every fourth one has no effect. Their sum becomes `coordinates`.
    fn number_coordinates(&mut self, in_space: bool) {
        // Coordinates of a point, of a rotating body and of a clamp; in space with gaps.
        let [point, body_size, clamp] = if in_space { [4, 8, 4] } else { [2, 3, 1] };
        let mut neighbors = vec![Vec::new(); self.bodies.len()];
        for ends in &self.ends {
            if let [EndSupport::Body { body: a, .. }, EndSupport::Body { body: b, .. }] = ends
                && a != b
            {
                neighbors[*a].push(*b);
                neighbors[*b].push(*a);
            }
        }
        // A spring couples with its body only, and is numbered directly after it.
        for body in reverse_cuthill_mckee(&neighbors) {
            self.bodies[body].coordinate = self.coordinates;
            self.coordinates += if self.bodies[body].rotates { body_size } else { point };
            for spring in self.springs.iter_mut().filter(|spring| spring.body == body) {
                spring.coordinate = self.coordinates;
                self.coordinates += clamp;
            }
        }
    }

    /// The end of a placed rod at the point of the body that is among `points`: of the first joint with this body,
    /// without an offset there, and with a placed rod. All such joints of a body are at one point. None without a body
    /// among `points`, or without such a joint. `placed` states for each rod whether it has a place.
    fn at_body(
        &self,
        scene: &StructureScene,
        points: &[JointPoint],
        placed: &[bool],
    ) -> Option<JointPoint> {
        let body = points.iter().find_map(|point| match point {
            JointPoint::Body(body, _) => Some(*body),
            JointPoint::Rod(..) => None,
        })?;
        self.joints.iter().zip(&scene.joints).find_map(|(others, joint)| {
            let has_body = others.iter().any(|point| match point {
                JointPoint::Body(other, number) => {
                    *other == body && joint.connects()[*number].offset.is_none()
                }
                JointPoint::Rod(..) => false,
            });
            let is_placed =
                |point: &&JointPoint| matches!(point, JointPoint::Rod(rod, _) if placed[*rod]);
            others.iter().find(is_placed).copied().filter(|_| has_body)
        })
    }

    /// Appends for each rod a [`Placement`] without coordinates: its own origin, or its end at a known point of a
    /// joint. Rods with an `origin` come first, then the first rod, at zero without one. Others follow one by one, by
    /// the first joint that connects them to a placed rod or to a body with an offset. Joints of a body without offsets
    /// are at one point ([`at_body`](Self::at_body)). An error for a rod that no joint places.
    fn place_rods(&mut self, scene: &StructureScene) -> Result<(), Error> {
        let mut placed = vec![false; scene.rods.len()];
        let with_origin = |i: &usize| scene.rods[*i].origin.is_some();
        let mut known: Vec<usize> = (0..scene.rods.len()).filter(with_origin).collect();
        // At least one rod needs a place that no joint gives: without an origin, the first one.
        if !with_origin(&0) {
            known.push(0);
        }
        for rod in known {
            placed[rod] = true;
            self.placements.push(Placement::Origin(rod));
        }
        // Each pass places one rod, at a joint with a point that is known by then.
        loop {
            let next = self.joints.iter().enumerate().find_map(|(joint, points)| {
                let gives_offset =
                    |number: usize| scene.joints[joint].connects()[number].offset.is_some();
                let known = points.iter().find(|point| match point {
                    JointPoint::Rod(rod, _) => placed[*rod],
                    JointPoint::Body(_, number) => gives_offset(*number),
                });
                let at = known.copied().or_else(|| self.at_body(scene, points, &placed))?;
                points.iter().find_map(|point| match *point {
                    JointPoint::Rod(rod, end) if !placed[rod] => {
                        Some(Placement::Joint { rod, end, joint, at })
                    }
                    _ => None,
                })
            });
            match (next, placed.iter().position(|placed| !placed)) {
                (_, None) => return Ok(()),
                (Some(placement), _) => {
                    if let Placement::Joint { rod, .. } = placement {
                        placed[rod] = true;
                    }
                    self.placements.push(placement);
                }
                (None, Some(rod)) => {
                    let key = format!("rods.{}.origin", scene.rods[rod].name);
                    let allowed = "a position, m, or the offset of the body in its joint: no joint places the rod";
                    return Err(Error::invalid(key, "no such key", allowed));
                }
            }
        }
    }
}

/// Names of both ends of a rod.
pub(super) const END_NAMES: [&str; 2] = ["start", "end"];
