//! The model of a scene that lies in a plane.

use super::{Model, voronoi_share};
use crate::energy::{DeadLoad, PlanarBend, Stretch, planar_bend};
use crate::error::Error;
use crate::parameter::Properties;
use crate::rod::PlanarRod;
use crate::rod::planar::HALF_BANDWIDTH;
use crate::scalar::Nestable;
use crate::scene::{Plane, Scene, Support};
use nalgebra::Vector3;

/// Rest shape and loads in the scene's plane.
#[derive(Clone, Debug)]
pub struct PlanarModel {
    /// The plane.
    pub plane: Plane,
    /// Rest positions, m.
    nodes: Vec<[f64; 2]>,
    rest_length: Vec<f64>,
    /// What dl, masses and weight count: chords, or arcs in the corrected form.
    line_length: Vec<f64>,
    /// The corrected form's.
    corrected: bool,
    rest_curvature: Vec<f64>,
    /// Which of the section's two second moments resists bending in the plane.
    second_moment: usize,
    /// m/s^2.
    gravity: [f64; 2],
    /// Node and force in world axes, N.
    forces: Vec<(usize, [f64; 3])>,
}

impl PlanarModel {
    /// The model, or what leaves the plane of the rest.
    pub(crate) fn new(
        scene: &Scene,
        nodes: &[[f64; 3]],
        arcs: Option<&[f64]>,
        forces: &[(usize, [f64; 3])],
    ) -> Result<Result<Self, String>, Error> {
        let mut vectors = vec![("loads.gravity".to_string(), Vector3::from(scene.loads.gravity))];
        for (i, (_, force)) in forces.iter().enumerate() {
            vectors.push((format!("loads.point[{i}].force"), (*force).into()));
        }
        for (i, load) in scene.initial.point.iter().enumerate() {
            vectors.push((format!("initial.point[{i}].force"), load.force.into()));
        }
        let up = scene.rod.section.up().map(Vector3::from);
        let plane = match Plane::through(nodes, &vectors, up) {
            Ok(plane) => plane,
            Err(what) => return Ok(Err(format!("{what} leaves the plane of the rest"))),
        };
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
            forces: forces.to_vec(),
            plane,
            nodes,
            line_length: arcs.map_or(rest_length.clone(), <[f64]>::to_vec),
            corrected: arcs.is_some(),
            rest_length,
            rest_curvature,
            second_moment,
        }))
    }
}

impl Model<HALF_BANDWIDTH> for PlanarModel {
    type Rod<D: Nestable> = PlanarRod<D>;

    fn rod<D: Nestable>(&self, p: &Properties<D>) -> PlanarRod<D> {
        let axial = p.youngs_modulus * p.area;
        let bending = p.youngs_modulus * p.second_moments[self.second_moment];
        let stretch = self.rest_length.iter().zip(&self.line_length).map(|(l, arc)| Stretch {
            stiffness: axial * (l / arc),
            rest_length: D::from(*l),
            natural_strain: D::from(0.0),
        });
        let bends = self.line_length.windows(2).zip(&self.rest_curvature);
        let bend = bends.map(|(l, k)| PlanarBend {
            // EI over the Voronoi length, times cos^4(phi/2) in the corrected form.
            stiffness: bending
                * (2.0 / (l[0] + l[1]))
                * if self.corrected { (1.0 + 0.25 * k * k).powi(-2) } else { 1.0 },
            natural_curvature: p.natural_curvature * *k,
        });
        let line_density = p.density * p.area;
        let node_mass: Vec<D> = (0..self.nodes.len())
            .map(|i| line_density * voronoi_share(&self.line_length, i))
            .collect();
        let load: Vec<DeadLoad<D, 2>> =
            node_mass.iter().map(|m| DeadLoad { force: self.gravity.map(|g| *m * g) }).collect();
        let mut rod = PlanarRod {
            stretch: stretch.collect(),
            bend: bend.collect(),
            mass: node_mass.iter().flat_map(|m| [*m, *m]).collect(),
            load,
        };
        self.add_forces(&mut rod, &self.forces);
        rod
    }

    fn add_forces<D: Nestable>(&self, rod: &mut PlanarRod<D>, forces: &[(usize, [f64; 3])]) {
        for (i, force) in forces {
            let force = self.plane.project((*force).into());
            for c in 0..2 {
                rod.load[*i].force[c] += D::from(force[c]);
            }
        }
    }

    fn dof(&self) -> usize {
        2 * self.nodes.len()
    }

    fn rest(&self) -> Vec<f64> {
        self.nodes.iter().flatten().copied().collect()
    }

    fn frames<D: Nestable>(&self) {}

    fn held(&self, support: Support) -> usize {
        match support {
            Support::Free => 0,
            Support::Pinned => 2,
            Support::Clamped => 4,
        }
    }

    fn position(&self, q: &[f64], i: usize) -> [f64; 3] {
        self.plane.to_world([q[2 * i], q[2 * i + 1]])
    }

    fn rate(&self, v: &[f64], i: usize) -> [f64; 3] {
        self.plane.direction_to_world([v[2 * i], v[2 * i + 1]]).into()
    }
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
