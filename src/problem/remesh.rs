//! The scene of a problem with another number of edges, for refinements (discretization error, choice of the mesh).
//!
//! `Problem::remeshed` takes the number of edges, and returns a copy of the scene in which only the field `remeshed` is
//! set; it builds and checks nothing. As `rod.segments` stays, loads and masses on node indices keep their arc length.
//! On the new mesh that place may lie between nodes: up to four share a load (cubic weights), two a mass (lever rule).

use crate::problem::Problem;
use crate::scene::Scene;

impl Problem {
    /// A copy of the scene whose problem has `segments` edges. `rod.segments` is unchanged: a load on an inner node
    /// keeps its arc length, and the nodes around it share the load.
    pub(crate) fn remeshed(&self, segments: usize) -> Scene {
        Scene { remeshed: Some(segments), ..self.scene.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Point, PointForce, PointMass, Section, Shape};

    /// A cantilever with a force on an inner node droops alike on other meshes, but for the meshes' own
    /// error of second order (`forces_between_nodes` measures it). On the nearest node of 12 edges it would
    /// droop 1.5 % more, twice the allowed difference.
    #[test]
    fn load_on_inner_node_keeps_its_place_on_other_meshes() {
        let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
        let section = Section::Circle { radius: 0.005 };
        let mut scene = Scene::new(30, shape, section, Material::new(1273.52, 1e9));
        let at = |node, y: f64| PointForce { node, force: [0.0, y, 0.0], ..PointForce::default() };
        scene.loads.point =
            vec![at(Point::Node(17), -0.5), at(Point::Node(30), 0.02), at(Point::Node(0), 1.0)];
        let problem = scene.problem().unwrap();
        let tip = problem.equilibrium().unwrap().tip[1];
        let same = problem.remeshed(30).problem().unwrap();
        assert!((same.equilibrium().unwrap().tip[1] - tip).abs() < 1e-12);
        for segments in [12, 23, 38, 60] {
            let other = problem.remeshed(segments).problem().unwrap();
            let planar = other.planar().unwrap();
            let loads = planar.setup.loads(planar.model);
            assert!((loads.iter().map(|load| load.force[1]).sum::<f64>() - 0.52).abs() < 1e-14);
            let off = other.equilibrium().unwrap().tip[1] / tip - 1.0;
            // Edges over the distance of the force from the wall.
            let edge = |segments: usize| (0.5 / (segments as f64 - 0.5)) / (0.5 * 16.5 / 29.5);
            let allowed = 0.3 * (edge(segments).powi(2) + edge(30).powi(2));
            println!("{segments}: {off:.1e} of {tip}, allowed {allowed:.1e}");
            assert!(off.abs() < allowed, "{segments}: {off:e}");
        }
    }

    /// So do masses: one on an inner node of a rod that weighs next to nothing bends it alike on other meshes.
    #[test]
    fn mass_on_inner_node_keeps_its_place_on_other_meshes() {
        let shape = Shape::Straight { length: 0.5, direction: [1.0, 0.0, 0.0] };
        let section = Section::Circle { radius: 0.005 };
        let mut scene = Scene::new(30, shape, section, Material::new(1e-3, 1e9));
        scene.rod.mass = vec![PointMass::new(Point::Node(17), 0.05)];
        scene.loads.gravity = [0.0, -9.8, 0.0];
        let problem = scene.problem().unwrap();
        let tip = problem.equilibrium().unwrap().tip[1];
        for segments in [12, 23, 38, 60] {
            let off = problem.remeshed(segments).problem().unwrap().equilibrium().unwrap().tip[1];
            let edge = |segments: usize| (0.5 / (segments as f64 - 0.5)) / (0.5 * 16.5 / 29.5);
            let allowed = 0.3 * (edge(segments).powi(2) + edge(30).powi(2));
            println!("{segments}: {:.1e} of {tip}, allowed {allowed:.1e}", off / tip - 1.0);
            assert!((off / tip - 1.0).abs() < allowed, "{segments}");
        }
    }
}
