//! The plane of a planar scene: its choice from the nodes and vectors of the scene, and its coordinates.
//!
//! [`Plane::through`] takes the plane of the first edge and the first edge or vector that is not parallel to it. If all
//! are parallel, a hint that is not, or else the world axis farthest from the line, is the second direction. An edge or
//! vector whose component along the normal exceeds `TOLERANCE` of its length is an error: the name of the edge or the
//! key of the vector.
//!
//! The axes are world axes if the plane is parallel to two of them: y and z, z and x, or x and y, as x and y of the
//! plane. Otherwise x is along the first edge, and y is the normal times x. The origin is the point of the plane
//! nearest to that of the world. `project` and `to_world` convert positions, m, between world and plane;
//! `direction_to_world` and `components` convert vectors. The planar model uses the plane.

use crate::numerics::scalar::Scalar;
use nalgebra::{Vector2, Vector3};

/// Largest component of a vector out of the plane, relative to its length.
const TOLERANCE: f64 = 1e-9;

/// Difference of a component of the normal from 0 or 1 that is a rounding error.
const SNAP: f64 = 1e-14;

/// Plane with its own x and y axes. These are world axes if the plane is parallel to two of them, so that planar and
/// world coordinates are equal.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Point of the plane nearest to the origin of the world, m.
    pub origin: Vector3<f64>,
    /// Unit vector of the x axis, in the world.
    pub x: Vector3<f64>,
    /// Unit vector of the y axis, in the world.
    pub y: Vector3<f64>,
}

/// Vector of a scene with its key.
#[derive(Clone, Debug)]
pub struct KeyedVector<D = f64> {
    /// Key of the vector, for messages.
    pub key: String,
    /// Components in world axes.
    pub vector: [D; 3],
}

impl Plane {
    /// The plane through `nodes`, m, at least two, that contains all `vectors`. It is spanned by the first edge and the
    /// first edge or vector across it. If nodes and vectors are on one line, the second direction is `hint`, or,
    /// without one across the line, the world axis farthest from the line. Axes of the plane are world axes if it is
    /// parallel to two of them, else x is along the first edge. The error is the name of the first edge that leaves the
    /// plane, or else the key of the first such vector.
    pub fn through(
        nodes: &[[f64; 3]],
        vectors: &[KeyedVector],
        hint: Option<Vector3<f64>>,
    ) -> Result<Self, String> {
        let start = Vector3::from(nodes[0]);
        let edges = || nodes.windows(2).map(|p| Vector3::from(p[1]) - Vector3::from(p[0]));
        let along = edges().next().expect("a rod has edges").normalize();
        let across = |v: &Vector3<f64>| {
            let part = v - along * along.dot(v);
            (v.norm() > 0.0 && part.norm() > TOLERANCE * v.norm()).then_some(part)
        };
        // The plane is spanned by the first edge and the first direction across it.
        let second = edges()
            .chain(vectors.iter().map(|v| v.vector.into()))
            .find_map(|v| across(&v))
            .or_else(|| hint.and_then(|v| across(&v)))
            .unwrap_or_else(|| along.cross(&least_axis(&along)).cross(&along));
        let normal = snapped(along.cross(&second).normalize());
        let leaves = |v: &Vector3<f64>| v.dot(&normal).abs() > TOLERANCE * v.norm();
        if let Some(i) = edges().position(|edge| leaves(&edge)) {
            return Err(format!("edge {i} of the rest shape"));
        }
        if let Some(v) = vectors.iter().find(|v| leaves(&v.vector.into())) {
            return Err(v.key.clone());
        }
        let x = match normal.iter().position(|c| c.abs() == 1.0) {
            // In an axis-parallel plane x is the next world axis in cyclic order.
            Some(axis) => Vector3::ith((axis + 1) % 3, 1.0),
            None => along,
        };
        // A normal against a world axis would exchange the axes of the plane.
        let normal = if normal.iter().any(|c| *c == -1.0) { -normal } else { normal };
        Ok(Self { origin: normal * normal.dot(&start), x, y: normal.cross(&x) })
    }

    /// Coordinates of a point of the world, m, in the axes of the plane, m: its scalar products with x and y. A point
    /// beside the plane is projected along the normal.
    pub fn project(&self, point: Vector3<f64>) -> [f64; 2] {
        [point.dot(&self.x), point.dot(&self.y)]
    }

    /// World coordinates, m, of a point with the coordinates `point` (a and b) in the axes of the plane, m: these are
    /// `origin + a x + b y`.
    pub fn to_world<D: Scalar>(&self, point: [D; 2]) -> [D; 3] {
        let [x, y, z] = self.direction_to_world(point);
        [x + self.origin.x, y + self.origin.y, z + self.origin.z]
    }

    /// World components of a vector with the components `x` and `y` in the axes of the plane, without the origin.
    pub fn direction_to_world<D: Scalar>(&self, [x, y]: [D; 2]) -> [D; 3] {
        [0, 1, 2].map(|c| x * self.x[c] + y * self.y[c])
    }

    /// Components of the world vector `v` along the two axes of the plane, and along its normal (x times y).
    pub fn components(&self, v: Vector3<f64>) -> (Vector2<f64>, f64) {
        (Vector2::new(v.dot(&self.x), v.dot(&self.y)), v.dot(&self.x.cross(&self.y)))
    }
}

/// World axis, as a unit vector, along which `v` has the smallest absolute component.
fn least_axis(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::ith(v.map(f64::abs).imin(), 1.0)
}

/// The vector with the nearest of -1, 0 and 1 in place of each component that differs from it by less than [`SNAP`].
fn snapped(v: Vector3<f64>) -> Vector3<f64> {
    v.map(|c| if (c.abs() - c.abs().round()).abs() < SNAP { c.round() } else { c })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plane of a straight rod with this direction under this gravity, or the key that leaves it.
    fn plane(direction: [f64; 3], gravity: [f64; 3]) -> Result<Plane, String> {
        let nodes: Vec<[f64; 3]> = (0..4).map(|i| direction.map(|d| d * i as f64)).collect();
        Plane::through(
            &nodes,
            &[KeyedVector { key: "loads.gravity".into(), vector: gravity }],
            None,
        )
    }

    #[test]
    fn axes_of_the_xy_plane_are_world_axes() {
        for (direction, gravity) in [
            ([1.0, 0.0, 0.0], [0.0, -9.8, 0.0]),
            ([0.6, 0.8, 0.0], [0.0, -9.8, 0.0]),
            ([0.0, -2.0, 0.0], [3.0, 1.0, 0.0]),
        ] {
            let plane = plane(direction, gravity).unwrap();
            assert_eq!((plane.x, plane.y), (Vector3::x(), Vector3::y()));
        }
    }

    #[test]
    fn projection_and_world_coordinates_are_inverse() {
        let plane = plane([1.0, 2.0, -0.5], [0.3, 0.0, -9.0]).unwrap();
        for v in [[2.0, 4.0, -1.0], [0.3, 0.0, -9.0]] {
            let world = plane.to_world(plane.project(v.into()));
            // Coordinates of order ten: a few roundings.
            assert!((Vector3::from(world) - Vector3::from(v)).norm() < 1e-14);
        }
    }

    #[test]
    fn vector_out_of_the_plane_is_reported_by_its_key() {
        let mut nodes = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 1.0, 0.0]];
        let load = [KeyedVector { key: "loads.point[0].force".into(), vector: [0.0, 0.0, 1.0] }];
        assert_eq!(Plane::through(&nodes, &load, None), Err("loads.point[0].force".into()));
        nodes.push([3.0, 1.0, 1e-6]);
        assert_eq!(Plane::through(&nodes, &[], None), Err("edge 2 of the rest shape".into()));
    }

    #[test]
    fn plane_of_a_straight_rod_contains_the_hint() {
        let nodes = [[0.0; 3], [1.0, 0.0, 0.0]];
        let plane = Plane::through(&nodes, &[], Some(Vector3::z())).unwrap();
        // The hint z is in the plane: normal to its normal.
        assert!(plane.x.cross(&plane.y).dot(&Vector3::z()).abs() < 1e-15);
    }
}
