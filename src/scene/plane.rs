//! The plane a scene lies in.

use crate::numerics::scalar::Scalar;
use nalgebra::{Vector2, Vector3};

/// How far out of the plane, relative to its own length, a vector may point.
const TOLERANCE: f64 = 1e-9;

/// A plane with its own x and y axes. Where the plane allows it these are world axes, so that
/// planar and world coordinates are the same numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// A point of the plane: the one nearest to the world's origin, m.
    pub origin: Vector3<f64>,
    /// The plane's x axis.
    pub x: Vector3<f64>,
    /// The plane's y axis.
    pub y: Vector3<f64>,
}

impl Plane {
    /// The plane through `nodes` that holds every vector of `vectors`, or the key of the first
    /// vector that leaves it. A straight scene takes the plane of `hint`, or any.
    pub fn through(
        nodes: &[[f64; 3]],
        vectors: &[(String, Vector3<f64>)],
        hint: Option<Vector3<f64>>,
    ) -> Result<Self, String> {
        let start = Vector3::from(nodes[0]);
        let edges = || nodes.windows(2).map(|p| Vector3::from(p[1]) - Vector3::from(p[0]));
        let along = edges().next().expect("a rod has edges").normalize();
        let across = |v: &Vector3<f64>| {
            let part = v - along * along.dot(v);
            (v.norm() > 0.0 && part.norm() > TOLERANCE * v.norm()).then_some(part)
        };
        let second = edges()
            .chain(vectors.iter().map(|(_, v)| *v))
            .find_map(|v| across(&v))
            .or_else(|| hint.and_then(|v| across(&v)))
            .unwrap_or_else(|| along.cross(&least_axis(&along)).cross(&along));
        let normal = snapped(along.cross(&second).normalize());
        let leaves = |v: &Vector3<f64>| v.dot(&normal).abs() > TOLERANCE * v.norm();
        if let Some(i) = edges().position(|edge| leaves(&edge)) {
            return Err(format!("edge {i} of the rest shape"));
        }
        if let Some((key, _)) = vectors.iter().find(|(_, v)| leaves(v)) {
            return Err(key.clone());
        }
        let x = match normal.iter().position(|c| c.abs() == 1.0) {
            // x of an axis-parallel plane: the next world axis in cyclic order.
            Some(axis) => Vector3::ith((axis + 1) % 3, 1.0),
            None => along,
        };
        let normal = if normal.iter().any(|c| *c == -1.0) { -normal } else { normal };
        Ok(Self { origin: normal * normal.dot(&start), x, y: normal.cross(&x) })
    }

    /// Coordinates of a point, m.
    pub fn project(&self, point: Vector3<f64>) -> [f64; 2] {
        [point.dot(&self.x), point.dot(&self.y)]
    }

    /// A point of the plane in world coordinates, m.
    pub fn to_world<D: Scalar>(&self, point: [D; 2]) -> [D; 3] {
        let [x, y, z] = self.direction_to_world(point);
        [x + self.origin.x, y + self.origin.y, z + self.origin.z]
    }

    /// A vector of the plane in world axes.
    pub fn direction_to_world<D: Scalar>(&self, [x, y]: [D; 2]) -> [D; 3] {
        [0, 1, 2].map(|c| x * self.x[c] + y * self.y[c])
    }

    /// Components of a vector in the plane's axes and along its normal.
    pub fn components(&self, v: Vector3<f64>) -> (Vector2<f64>, f64) {
        (Vector2::new(v.dot(&self.x), v.dot(&self.y)), v.dot(&self.x.cross(&self.y)))
    }
}

/// The world axis least along `v`.
fn least_axis(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::ith(v.map(f64::abs).imin(), 1.0)
}

/// Sets components within rounding of 0 and 1 to those.
fn snapped(v: Vector3<f64>) -> Vector3<f64> {
    v.map(|c| if (c.abs() - c.abs().round()).abs() < 1e-14 { c.round() } else { c })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(direction: [f64; 3], gravity: [f64; 3]) -> Result<Plane, String> {
        let nodes: Vec<[f64; 3]> = (0..4).map(|i| direction.map(|d| d * i as f64)).collect();
        Plane::through(&nodes, &[("loads.gravity".into(), gravity.into())], None)
    }

    #[test]
    fn the_xy_plane_keeps_world_coordinates() {
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
    fn any_plane_is_found_and_maps_back() {
        let plane = plane([1.0, 2.0, -0.5], [0.3, 0.0, -9.0]).unwrap();
        for v in [[2.0, 4.0, -1.0], [0.3, 0.0, -9.0]] {
            let world = plane.to_world(plane.project(v.into()));
            assert!((Vector3::from(world) - Vector3::from(v)).norm() < 1e-14);
        }
    }

    #[test]
    fn a_scene_in_space_names_what_leaves_the_plane() {
        let mut nodes = vec![[0.0; 3], [1.0, 0.0, 0.0], [2.0, 1.0, 0.0]];
        let load = [("loads.point[0].force".to_string(), Vector3::new(0.0, 0.0, 1.0))];
        assert_eq!(Plane::through(&nodes, &load, None), Err("loads.point[0].force".into()));
        nodes.push([3.0, 1.0, 1e-6]);
        assert_eq!(Plane::through(&nodes, &[], None), Err("edge 2 of the rest shape".into()));
    }

    #[test]
    fn a_hint_turns_the_plane_of_a_straight_rod() {
        let nodes = [[0.0; 3], [1.0, 0.0, 0.0]];
        let plane = Plane::through(&nodes, &[], Some(Vector3::z())).unwrap();
        assert!(plane.x.cross(&plane.y).dot(&Vector3::z()).abs() < 1e-15);
    }
}
