//! What a problem makes of its scene's numbers, whatever their type.

use crate::error::Error;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::vector::Vector;
use crate::problem::model::{Model, NodalLoad};
use crate::scene::shape::Mesh;
use crate::scene::{NamedNode, Node, PointForce, Scene};

/// A scene with its mesh and its rest shape in a model's terms.
#[derive(Clone, Debug)]
pub(crate) struct Setup<D: Nestable, M: Model<W>, const W: usize> {
    pub scene: Scene<D>,
    pub mesh: Mesh<D>,
    pub rest: M::Rest<D>,
    /// The nodes of the shape the rod begins in, if not the rest shape, m.
    pub start: Option<Vec<Vector<D>>>,
}

impl<D: Nestable, M: Model<W>, const W: usize> Setup<D, M, W> {
    pub fn new(model: &M, scene: Scene<D>) -> Self {
        let mesh = scene.made_mesh();
        let rest = model.at_rest(&scene, &mesh);
        let start = start_shape(&scene, &mesh).expect("a problem's start has been made");
        Self { scene, mesh, rest, start }
    }

    /// The rod under its loads.
    pub fn rod(&self, model: &M) -> M::Rod<D> {
        let mut rod = model.rod(&self.scene, &self.rest);
        self.load(model, &mut rod, &self.scene.loads.point);
        rod
    }

    /// The rod with the forces that hold it until t = 0.
    pub fn held(&self, model: &M, rod: &M::Rod<D>) -> M::Rod<D> {
        let mut held = rod.clone();
        self.load(model, &mut held, &self.scene.initial.point);
        held
    }

    fn load(&self, model: &M, rod: &mut M::Rod<D>, points: &[PointForce<D>]) {
        let loads = nodal(points, "loads", &self.mesh).expect("checked when the model was chosen");
        model.add_loads(rod, &self.rest, &loads);
    }
}

/// The nodes of the shape the rod begins in, where the scene gives one.
pub(crate) fn start_shape<D: Scalar>(
    scene: &Scene<D>,
    rest: &Mesh<D>,
) -> Result<Option<Vec<Vector<D>>>, Error> {
    scene.initial.shape.as_ref().map(|shape| shape.nodes_of(rest)).transpose()
}

/// The loads on the nodes of a mesh.
pub(crate) fn nodal<D: Scalar>(
    loads: &[PointForce<D>],
    table: &str,
    mesh: &Mesh<D>,
) -> Result<Vec<NodalLoad<D>>, Error> {
    let nodes = mesh.nodes.len();
    let on = |(k, load): (usize, &PointForce<D>)| {
        let node = match load.node {
            Node::Named(NamedNode::Tip) => nodes - 1,
            Node::Index(i) if i < nodes => i,
            Node::Index(i) => {
                let allowed = format!("\"tip\" or 0 .. {}", nodes - 1);
                return Err(Error::invalid(format!("{table}.point[{k}].node"), i, allowed));
            }
        };
        Ok(NodalLoad { node, force: load.force, moment: load.moment })
    };
    loads.iter().enumerate().map(on).collect()
}
