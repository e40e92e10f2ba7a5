//! A model with the scene it was chosen for.

use crate::problem::model::Model;
use crate::problem::planar::PlanarModel;
use crate::problem::setup::Setup;
use crate::problem::spatial::SpatialModel;
use crate::scene::Scene;

/// The model that was chosen.
#[derive(Clone, Debug)]
pub(crate) enum AnyModel {
    /// In a plane.
    Planar(Modelled<PlanarModel>),
    /// In space.
    Spatial(Modelled<SpatialModel>),
}

/// A model with the scene it was chosen for, in plain numbers.
#[derive(Clone, Debug)]
pub(crate) struct Modelled<M: Model> {
    pub(crate) model: M,
    pub(crate) setup: Setup<f64, M>,
}

impl<M: Model> Modelled<M> {
    pub(crate) fn new(model: M, scene: &Scene) -> Self {
        let setup = Setup::new(&model, scene.clone());
        Self { model, setup }
    }
}

impl AnyModel {
    /// The model of another scene of the same layout.
    pub(crate) fn of(&self, scene: &Scene) -> Self {
        match self {
            Self::Planar(own) => Self::Planar(Modelled::new(own.model.clone(), scene)),
            Self::Spatial(own) => Self::Spatial(Modelled::new(own.model.clone(), scene)),
        }
    }
}
