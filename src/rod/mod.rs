//! What the stepper asks of a rod, whatever its dimension.
//!
//! A rod is a list of [elements](crate::energy), a diagonal mass and dead loads. The stepper sees
//! only this trait; [`PlanarRod`] is a rod of the plane, [`SpatialRod`] one of space.

mod blocks;
mod discrete;
mod drag;
mod edges;
mod extra;
mod joint_law;
pub mod layout;
mod moments;
pub mod planar;
mod sensitive;
pub mod spatial;
mod state;
mod sweeps;
mod transposed;
mod viscosity;

pub use discrete::DiscreteRod;
pub use drag::{DragSlopes, NodalDrag};
pub use extra::Extra;
pub(crate) use extra::Placed;
pub use layout::Layout;
pub use moments::Moments;
pub use planar::PlanarRod;
pub use sensitive::{EffectiveStrains, FrameRate, Sensitive};
pub use spatial::SpatialRod;
pub use state::{InternalVariables, State};
pub use transposed::{Laws, Strained, Transposed, still_frames, strained};
pub use viscosity::{OwnViscosity, Viscosity};

use crate::energy::Derivatives;
use crate::energy::frame::EdgeFrame;
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use num_dual::Dual64;
use serde::{Deserialize, Serialize};

/// Energies by term, J.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Energy of motion, J.
    pub kinetic: f64,
    /// Energy of stretching, J.
    pub stretch: f64,
    /// Energy of bending, J.
    pub bend: f64,
    /// Energy of twisting, J.
    pub twist: f64,
    /// Potential of the dead loads, weight and point forces, J.
    pub potential: f64,
    /// Of [energies of one's own](crate::energy::own).
    #[serde(default, skip_serializing_if = "is_zero")]
    pub own: f64,
}

fn is_zero(energy: &f64) -> bool {
    *energy == 0.0
}

impl Energies {
    /// The sum of all terms, J.
    pub fn total(&self) -> f64 {
        self.kinetic + self.stretch + self.bend + self.twist + self.potential + self.own
    }
}

/// A discrete rod with unknowns `q`.
pub trait Rod<D: Scalar>: Clone + Send + Sync {
    /// The second derivatives of the energy.
    type Tangent: Tangent<D>;
    /// The same rod over dual numbers: with a derivative along one parameter in every quantity.
    type Dual: Rod<Dual64>;
    /// What angles are measured from: [`crate::energy::frame::Frames`], or `()` where there are none.
    type Frames: Clone + std::fmt::Debug + Send + Sync;

    /// Where the edges are and how they are strained, in plain numbers: what derivatives along all
    /// parameters have in common.
    type Geometry: Clone + std::fmt::Debug + Default + Send + Sync;

    /// Whether there are frames at all.
    const HAS_FRAMES: bool;

    /// Whether unknown `i` is an angle in rad, and not a length in m.
    fn is_angle(i: usize) -> bool;

    /// Lumped mass of every degree of freedom, kg (kg m^2 for angles).
    fn mass(&self) -> &[D];

    /// Writes the gradient of the elastic energy less the dead loads, N (N m for angles).
    fn gradient(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        gradient: &mut [D],
    );

    /// Writes the gradient as [`gradient`](Rod::gradient) does, and its tangent, N/m.
    fn tangent(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut Self::Tangent,
    );

    /// The same, but where there are `tensions`, N, of all edges: the tangent as it would be under these, whatever the
    /// edges are stretched by. A rod that does not know how takes its own.
    fn tangent_under(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        _tensions: Option<&[D]>,
        (gradient, tangent): (&mut [D], &mut Self::Tangent),
    ) {
        self.tangent(q, frames, derivatives, gradient, tangent);
    }

    /// Writes the tensions of all edges, N, to first order after `change`, where the rod has come to `q` by that.
    fn tensions_after(&self, _change: &[D], _q: &[D], _tensions: &mut Vec<D>) {}

    /// Measures the rod at `q`.
    fn measure(&self, q: &[D], frames: &Self::Frames, geometry: &mut Self::Geometry);

    /// Writes gradient and [tangent](Rod::tangent), and [measures](Rod::measure) the rod; one in other than plain numbers need not
    /// be measured.
    fn measured_tangent(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        forces: (&mut [D], &mut Self::Tangent),
        geometry: &mut Self::Geometry,
    ) {
        self.tangent(q, frames, derivatives, forces.0, forces.1);
        self.measure(q, frames, geometry);
    }

    /// Writes the tangent in terms of edges instead of nodes: edge `j` stands where node `j + 1`
    /// does, and the first node has no stiffness left.
    fn edge_tangent(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        tangent: &mut Self::Tangent,
    );

    /// Moves the frames to `q`, without changing any energy there.
    fn rebase(frames: &mut Self::Frames, q: &[D]);

    /// Moves the frames to `q` and writes the gradient there.
    fn moved_gradient(
        &self,
        q: &[D],
        frames: &mut Self::Frames,
        derivatives: Derivatives,
        gradient: &mut [D],
    ) {
        Self::rebase(frames, q);
        self.gradient(q, frames, derivatives, gradient);
    }

    /// Writes frames without their derivatives.
    fn real_frames(dual: &DualFrames<Self, D>, frames: &mut Self::Frames);

    /// Measures the angles of `q`, which are from `from`, from `to` instead.
    fn refer(q: &mut [D], from: &Self::Frames, to: &Self::Frames);

    /// The first material director of an edge, if edges have one.
    fn director(_q: &[D], _frames: &Self::Frames, _edge: usize) -> Option<[D; 3]> {
        None
    }

    /// Turns all edges but the first about themselves until no joint is twisted.
    fn untwist(_q: &mut [D], _frames: &Self::Frames) {}

    /// Turns an edge so that its first material director is `director`, on the turn nearest to
    /// `turn` beyond its angle in `q`.
    fn align(_q: &mut [D], _frames: &Self::Frames, _edge: usize, _director: [D; 3], _turn: f64) {}

    /// The inner node that was folded shut on the way from `before` to `now`: a joint there turns
    /// by more than a right angle, and the other way than before. No motion gets there, as a fold
    /// has infinite energy; a large step does.
    fn folded(&self, before: &[D], now: &[D], frames: &Self::Frames) -> Option<usize>;

    /// The first edge that turned by more than 45 degrees on the way from `before` to `now`.
    fn leapt(&self, before: &[D], now: &[D]) -> Option<usize>;

    /// By how much the potential of the loads in [`energies`](Rod::energies) is short, J, after a step
    /// in which an angle it counts has started over.
    fn wound(&self, _before: &[D], _now: &[D]) -> f64 {
        0.0
    }

    /// The first energy of one's own that is no finite number at `q`, nor its slopes; and where along
    /// the rod, m.
    fn not_finite(&self, _q: &[D], _frames: &Self::Frames) -> Option<(String, f64)> {
        None
    }

    /// Elastic energies and the potential of the loads; kinetic energy zero.
    fn energies(&self, q: &[D], frames: &Self::Frames) -> Energies;

    /// Writes the strains of all elements, in the order [`set_viscous`](Rod::set_viscous) expects.
    fn strains(&self, q: &[D], frames: &Self::Frames, strains: &mut Vec<D>);

    /// The same stiffnesses without loads and natural strains: its energy is that of a rate of strain.
    fn dashpots(&self) -> Self;

    /// Energies of stretching, bending and twisting by `strains` of all elements, natural ones taken
    /// as zero, J.
    fn strain_energies(&self, strains: &[D]) -> [D; 3];

    /// Becomes `elastic` with viscous stress, as stiffnesses and natural strains.
    fn set_viscous(&mut self, elastic: &Self, viscosity: &Viscosity<D>);

    /// Becomes [dashpots](Rod::dashpots) with every stiffness times its factor, and the shifts as natural strains.
    fn set_dashpots(&mut self, dashpots: &Self, viscosity: &Viscosity<D>);

    /// How many strains of bending and twisting have springs of internal friction: all or none.
    fn slides(&self) -> usize {
        0
    }

    /// Lets the springs of internal friction act, as stretched as they are in a step that began with these internal
    /// variables; without, they do not. The stiffness they are a part of is that of `elastic`.
    fn set_springs(&mut self, _elastic: &Self, _before: Option<&InternalVariables<D>>) {}

    /// How far that of the springs is from beginning or ceasing to slip which is nearest to it.
    fn distance_to_slipping(&self, _z: &[D]) -> f64 {
        f64::INFINITY
    }

    /// Lets springs slip that are stretched beyond their limit.
    fn slip(&self, _z: &mut [D]) {}

    /// Energy of springs that are stretched by `z`: of bending and twisting, J.
    fn slider_energy(&self, _z: &[D]) -> f64 {
        0.0
    }
}

/// A [`Rod`] to which masses, forces and energies can be added.
pub trait AssembledRod<D: Scalar>: Rod<D> {
    /// Adds a mass, kg, to a node, with its weight under the gravity in the rod's axes, m/s^2.
    fn add_mass(&mut self, node: usize, mass: D, gravity: [D; 3]);

    /// Adds a dead force, N, in the rod's axes to a node.
    fn add_force(&mut self, node: usize, force: [D; 3]);

    /// Multiplies the axial stiffness of every edge by its factor.
    fn stiffen_edges(&mut self, factor: impl Fn(usize) -> f64);

    /// Replaces the user-defined energies.
    fn set_own(&mut self, own: Extra<D>);

    /// The frames of the edges, if there are any.
    fn edge_frames(frames: &Self::Frames) -> &[EdgeFrame<D>];
}

/// The second derivatives of the energy of a rod over `D`.
pub type TangentOf<R, D> = <R as Rod<D>>::Tangent;

/// The factors of [these](TangentOf).
pub type FactorsOf<R, D> = <TangentOf<R, D> as Tangent<D>>::Factors;

/// The frames of a rod with derivatives along one parameter.
pub type DualFrames<R, D> = <<R as Rod<D>>::Dual as Rod<Dual64>>::Frames;

/// Writes the rates of all strains of a rod that moves with `v`, 1/s: the central difference over
/// a motion of a hundred-thousandth of its length, right to about ten digits. A velocity below a
/// thousandth of its length per second counts as that, as its derivatives may be much larger.
pub(crate) fn strain_rates<D: Scalar, R: Rod<D>>(
    rod: &R,
    (q, frames): (&[D], &R::Frames),
    v: &[D],
    length: f64,
    rates: &mut Vec<D>,
) {
    let fastest = v.iter().fold(1e-3 * length, |most, v| most.max(v.value().abs()));
    let dt = 1e-5 * length / fastest;
    let at = |dt: f64| {
        let moved: Vec<D> = q.iter().zip(v).map(|(q, v)| *q + *v * dt).collect();
        let mut strains = Vec::new();
        rod.strains(&moved, frames, &mut strains);
        strains
    };
    rates.clear();
    rates.extend(at(dt).iter().zip(at(-dt)).map(|(a, b)| (*a - b) * (0.5 / dt)));
}
