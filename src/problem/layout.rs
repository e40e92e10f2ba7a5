//! Discrete choices of a problem, which have no derivatives: planar or spatial model, and corrections of the elements.
//! The mesh of a scene and its checks are here too: `mesh` builds it, `made_mesh` does for a scene whose mesh was built
//! before (else it panics), `check_edges` rejects lengths of edges, and `behind_walls` returns the fractions of the
//! outermost edges behind walls.
//!
//! [`choose`] returns the model that `rod.dimension` requests, with its setup and the reason as text. With `auto` it is
//! the planar model if rest shape, loads and section lie in one plane, else the spatial one. A requested planar model
//! that does not represent the scene is an error. So are, in space, moments of `initial.point`, moments with signals in
//! some schemes, a `supports.angle` other than zero, and a missing shear modulus or Poisson's ratio. [`correction`]
//! decides: arcs replace chords unless the discretization is `paper`. Joints and masses next to walls are corrected for
//! `corrected-statics` and for curved rods. [`check_on_mesh`] rejects loads, masses, actuators and energies outside the
//! rod, and shapes that do not fit the mesh. A problem makes these choices once, for all values of its varying
//! parameters.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, dot, sub};
use crate::problem::line_loads::check_line_loads;
use crate::problem::model::Correction;
use crate::problem::model_with_setup::{AnyModel, ModelWithSetup};
use crate::problem::planar::PlanarModel;
use crate::problem::setup;
use crate::problem::spatial::SpatialModel;
use crate::scene::mesh::Mesh;
use crate::scene::{
    Clamp, Dimension, Discretization, Parameter, PointForce, Scene, Scheme, Shape, Support,
    Supports,
};

impl<D: Scalar> Scene<D> {
    /// Mesh of the rest shape, with the parts of its outermost edges behind walls. It has `remeshed` edges if that is
    /// set, else those of `rod.segments`. After a change of mesh or walls, `named` has the arc lengths of the mesh of
    /// the scene file, to which node indices refer. An error for a missing number of edges or a polyline that is not
    /// read.
    pub(crate) fn mesh(&self) -> Result<Mesh<D>, Error> {
        let mesh = |segments, behind| self.rod.shape.mesh(segments, behind);
        let own = mesh(self.rod.segments, behind_walls(&self.supports, self.soft_by_itself))?;
        if self.remeshed.is_none() && self.soft == self.soft_by_itself {
            return Ok(own);
        }
        let segments = self.remeshed.or(self.rod.segments);
        let other = mesh(segments, behind_walls(&self.supports, self.soft))?;
        Ok(Mesh { named: Some(own.arc_length), ..other })
    }

    /// [`mesh`](Self::mesh) of a scene whose mesh has been built before. It panics otherwise.
    pub(crate) fn made_mesh(&self) -> Mesh<D> {
        self.mesh().expect("a problem's scene has a mesh")
    }
}

/// End of the message that a factor on the curvature has no effect.
pub(super) const BESIDE_STRAIGHT: &str =
    "in a scene with a straight rest shape, whose curvature is zero";

/// Allowed lengths of edges, m, whose fourth powers double precision can represent.
const EDGES: std::ops::RangeInclusive<f64> = 1e-50..=1e50;

/// Relative excess of an arc over its chord above which an edge is curved: a turning angle of 5e-6 rad. Smaller
/// excesses may be rounding errors.
const CURVED_EXCESS: f64 = 1e-12;

/// Rejects the first edge between consecutive nodes, m, whose length is outside [`EDGES`]. `key` is that of the shape,
/// for the error.
pub(crate) fn check_edges(key: &str, nodes: &[[f64; 3]]) -> Result<(), Error> {
    let length = |p: &[[f64; 3]]| {
        let [x, y, z] = sub(p[1], p[0]);
        x.hypot(y).hypot(z)
    };
    match nodes.windows(2).map(length).find(|length| !EDGES.contains(length)) {
        Some(length) => {
            let allowed = format!("edges of {:e} to {:e} m", EDGES.start(), EDGES.end());
            Err(Error::invalid(key, format!("an edge of {length:e} m"), allowed))
        }
        None => Ok(()),
    }
}

/// Fractions of the first and of the last edge behind walls. At a clamp in the middle of an edge it is one half, or 1
/// if the clamp is compliant (`soft`). Otherwise, also with walls at nodes, it is 0.
pub(crate) fn behind_walls<D>(supports: &Supports<D>, soft: [bool; 2]) -> [f64; 2] {
    let behind =
        |support, soft| match support == Support::Clamped && supports.clamp == Clamp::MidEdge {
            true if soft => 1.0,
            true => 0.5,
            false => 0.0,
        };
    [behind(supports.start, soft[0]), behind(supports.end, soft[1])]
}

/// Corrections of the elements of a scene on its mesh, valid for all values of the `varying` parameters. `arcs`: arcs
/// replace chords, unless the discretization is `paper`; without it no other correction has an effect. `behind`: the
/// fractions of the outermost edges behind walls. `joints`: joints and masses next to walls are corrected. It is set
/// for `corrected-statics`, and for a curved rest shape ([`CURVED_EXCESS`]) whose curvature factor is not zero. A
/// curvature factor or arc angle that varies counts as not zero.
pub(crate) fn correction(scene: &Scene, mesh: &Mesh, varying: &[Parameter]) -> Correction {
    let varies = |place: &str| varying.iter().any(|p| p.path().starts_with(place));
    let edges = mesh.nodes.windows(2).zip(&mesh.arcs);
    // An arc that is longer than its chord by more than rounding errors.
    let mut longer = edges.map(|(p, arc)| {
        let edge = sub(p[1], p[0]);
        arc / dot(edge, edge).sqrt() - 1.0 > CURVED_EXCESS
    });
    let bends = matches!(scene.rod.shape, Shape::Arc { .. }) && varies("rod.shape.angle");
    let natural =
        !scene.rod.natural_curvature.is_zero() || varies(Parameter::NaturalCurvature.path());
    let curved = natural && (bends || longer.any(|longer| longer));
    Correction {
        arcs: scene.discretization() != Discretization::Paper,
        behind: behind_walls(&scene.supports, scene.soft),
        joints: curved || scene.discretization() == Discretization::CorrectedStatics,
    }
}

/// Rejects a section whose `up` is along the first edge. Also rejected are energies, actuators, loads and masses
/// outside the rod, recorded markers between nodes, and initial shapes that do not fit the mesh. The error has the key
/// and the allowed range. Returns the nodes of the initial shape, m; none if that is the rest shape.
pub(crate) fn check_on_mesh(scene: &Scene, mesh: &Mesh) -> Result<Option<Vec<Vector<f64>>>, Error> {
    scene.rod.section.check_up(&mesh.nodes)?;
    for energy in &scene.energies {
        energy.at().check(&energy.key(), mesh.length)?;
    }
    for (i, actuator) in scene.actuation.iter().enumerate() {
        actuator.check_on_rod(&format!("actuation[{i}]"), mesh.length)?;
    }
    if let Some(path) = &scene.supports.path {
        let ends = [scene.supports.start, scene.supports.end];
        path.check_nodes(ends, mesh.nodes.len() - 1)?;
    }
    let start = setup::start_shape(scene, mesh)?;
    if let Some(start) = &start {
        let recorded = scene.supports.path.is_some();
        check_edges(if recorded { "supports.path" } else { "initial.shape" }, start)?;
    }
    setup::nodal(&scene.loads.point, "loads", mesh)?;
    check_line_loads(&scene.loads.line, mesh.length.value())?;
    setup::nodal(&scene.initial.point, "initial", mesh)?;
    setup::nodal_masses(scene, mesh)?;
    Ok(start)
}

/// Rejects, in space, moments other than zero: those of `initial.point`, and those of `loads.point` with a signal if
/// the scheme in `[time]` does not take actuators that follow signals.
fn check_moments_in_space(scene: &Scene) -> Result<(), Error> {
    let turns = |load: &PointForce| load.moment != [0.0; 3];
    if let Some(k) = scene.initial.point.iter().position(turns) {
        let key = format!("initial.point[{k}].moment");
        let allowed = "no moment in a spatial scene; a moment of [[loads.point]] acts there";
        return Err(Error::invalid(key, format!("{:?}", scene.initial.point[k].moment), allowed));
    }
    let Some(time) = &scene.time else { return Ok(()) };
    let timed = scene.loads.point.iter().position(|load| turns(load) && load.signal.is_some());
    match timed.filter(|_| !time.scheme.traits().takes_timed_actuation) {
        None => Ok(()),
        Some(k) => {
            let found =
                format!("a signal of a moment in space with the scheme {}", time.scheme.name());
            let takers = Scheme::names(|traits| traits.takes_timed_actuation);
            let allowed = format!("a constant; the schemes {takers} take signals");
            Err(Error::invalid(format!("loads.point[{k}].signal"), found, allowed))
        }
    }
}

/// The model of a scene on its mesh, with its setup, and the reason of the choice as text. It is the model that
/// `rod.dimension` requests. With `auto` it is the planar one if it represents the scene, else the spatial one.
/// Corrections are valid for all values of the `varying` parameters.
///
/// # Errors
///
/// Those of [`check_on_mesh`], and a requested planar model that cannot represent the scene. For a spatial one also a
/// `supports.angle` other than zero, moments that act until t = 0, and a missing shear modulus or Poisson's ratio. A
/// moment with a signal is an error too in a scheme without timed actuation.
pub(crate) fn choose(
    scene: &Scene,
    mesh: &Mesh,
    varying: &[Parameter],
) -> Result<(AnyModel, String), Error> {
    let correction = correction(scene, mesh, varying);
    let start = check_on_mesh(scene, mesh)?;
    let asked = scene.rod.dimension;
    let why = match asked {
        Dimension::Spatial => "requested by rod.dimension".to_string(),
        Dimension::Auto | Dimension::Planar => {
            // The planar model has fewer unknowns, and is chosen wherever it represents the
            // scene.
            match PlanarModel::new(scene, mesh, start.as_deref(), correction) {
                Ok(model) => {
                    let n = model.normal();
                    let n = [n.x, n.y, n.z].map(|c| (c * 1e6).round() / 1e6 + 0.0);
                    let why = match asked {
                        Dimension::Planar => "requested by rod.dimension".into(),
                        _ => format!(
                            "rest shape, loads and section lie in the plane with normal {n:?}"
                        ),
                    };
                    return Ok((AnyModel::Planar(ModelWithSetup::new(model, scene)), why));
                }
                // A requested planar model must not silently become a spatial one.
                Err(why) if asked == Dimension::Planar => {
                    let allowed = format!("\"auto\" or \"spatial\", as {why}");
                    return Err(Error::invalid("rod.dimension", "\"planar\"", allowed));
                }
                Err(why) => why,
            }
        }
    };
    // Keys that only one of the two models can have.
    if scene.supports.angle != 0.0 {
        let found = format!("{} in a spatial scene ({why})", scene.supports.angle);
        return Err(Error::invalid("supports.angle", found, "planar scenes only"));
    }
    if scene.material.shear_modulus.is_none() && scene.material.poisson_ratio.is_none() {
        let found = format!("neither shear_modulus nor poisson_ratio, in a spatial scene ({why})");
        return Err(Error::invalid("material", found, "one of the two: the rod can twist"));
    }
    check_moments_in_space(scene)?;
    let model = SpatialModel::new(scene, mesh, correction, None);
    Ok((AnyModel::Spatial(ModelWithSetup::new(model, scene)), why))
}
