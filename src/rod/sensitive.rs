//! What the derivatives of a rod's motion with respect to parameters are made of.

use crate::energy::Derivatives;
use crate::numerics::banded::BandMatrix;
use crate::numerics::lanes::Lanes;
use crate::rod::{DualFrames, Rod};

/// How the reference frame of an edge changes with `G` parameters.
#[derive(Clone, Copy, Debug)]
pub struct FrameRate<const G: usize> {
    /// Its tangent.
    pub tangent: [Lanes<G>; 3],
    /// How fast its directors turn about the tangent, rad.
    pub turn: Lanes<G>,
}

/// A rod whose forces have derivatives with respect to `G` parameters side by side. Dual rods, one for
/// each parameter, say what the parameters change; each derivative is what it would be alone.
pub trait Sensitive<const W: usize>: Rod<f64, W> {
    /// What parameters change: loads, and stresses as functions of the strains.
    type Rates<const G: usize>: Clone + std::fmt::Debug + Default;

    /// Writes what the parameters of dual rods change.
    fn set_rates<const G: usize>(duals: &[Self::Dual; G], rates: &mut Self::Rates<G>);

    /// Writes the derivatives of the gradient at fixed unknowns and frames, where the rod is measured, along
    /// what has `changed`: dual rods with their rates.
    fn gradient_rate<const G: usize>(
        changed: (&[Self::Dual; G], &Self::Rates<G>),
        geometry: &Self::Geometry,
        at: (&[f64], &Self::Frames),
        derivatives: Derivatives,
        out: &mut [[f64; G]],
    );

    /// Adds the derivatives of the gradient along those of the frames, at fixed `q`, where the rod is
    /// measured and the gradient and its tangent are those given.
    fn frame_rate<const G: usize>(
        frames: &[FrameRate<G>],
        geometry: &Self::Geometry,
        gradient: &[f64],
        tangent: &BandMatrix<f64, W>,
        out: &mut [[f64; G]],
    );

    /// Moves the frames to where the rod is measured and has the derivatives `q`, without changing any energy there.
    fn rebase_rates<const G: usize>(
        frames: &mut [FrameRate<G>],
        geometry: &Self::Geometry,
        q: &[[f64; G]],
    );

    /// The derivatives that frames carry.
    fn frame_rates<const G: usize>(frames: [&DualFrames<Self, f64, W>; G]) -> Vec<FrameRate<G>>;

    /// Writes frames with the derivatives along parameter `lane`.
    fn set_dual_frames<const G: usize>(
        frames: &Self::Frames,
        rates: &[FrameRate<G>],
        lane: usize,
        dual: &mut DualFrames<Self, f64, W>,
    );
}
