//! The planar or spatial model of a problem together with its setup (scene, mesh, rest shape, initial shape) over
//! `f64`.
//!
//! [`AnyModel`], of either kind, is stored in a problem. [`ModelWithSetup`] has the type of its model; `new` makes
//! the setup of a validated scene for a given model. [`AnyModel::with_scene`] keeps the model and makes the setup
//! of another scene. That scene must have the same planarity and number of nodes, and the model's corrections of the
//! elements for arcs and walls (`Correction`) must be valid for it. Nothing is checked here. `Discretized` refers to
//! the two fields, model and setup.

use crate::problem::model::Model;
use crate::problem::planar::PlanarModel;
use crate::problem::setup::Setup;
use crate::problem::spatial::SpatialModel;
use crate::scene::Scene;

/// Planar or spatial model of a problem.
#[derive(Clone, Debug)]
pub(crate) enum AnyModel {
    /// Rod in a plane.
    Planar(ModelWithSetup<PlanarModel>),
    /// Rod in space.
    Spatial(ModelWithSetup<SpatialModel>),
}

/// Model of a scene, and the setup of the scene in plain numbers.
#[derive(Clone, Debug)]
pub(crate) struct ModelWithSetup<M: Model> {
    pub(crate) model: M,
    pub(crate) setup: Setup<f64, M>,
}

impl<M: Model> ModelWithSetup<M> {
    /// The model with the setup of a scene, which is cloned. The scene must be validated and fit the model.
    pub(crate) fn new(model: M, scene: &Scene) -> Self {
        let setup = Setup::new(&model, scene.clone());
        Self { model, setup }
    }
}

impl AnyModel {
    /// The same model with the setup of another scene, which has the same planarity, number of nodes and corrections.
    pub(crate) fn with_scene(&self, scene: &Scene) -> Self {
        match self {
            Self::Planar(own) => Self::Planar(ModelWithSetup::new(own.model.clone(), scene)),
            Self::Spatial(own) => Self::Spatial(ModelWithSetup::new(own.model.clone(), scene)),
        }
    }
}
