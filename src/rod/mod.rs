//! Discrete elastic rods: elements on a polygon of straight edges, in the plane or in space.
//!
//! A rod is a list of [elements](crate::energy), a diagonal mass matrix and loads. The trait [`Rod`] is the interface
//! that steppers, equilibria and modes use. Input: the unknowns `q` (m, in space also rad) and the reference frames.
//! Output: energies (J), and gradient (N, N m) and tangent (N/m) of elastic energy less work of the loads; loads
//! without a potential (follower loads) are subtracted from the gradient too. Other functions return strains, replace
//! elastic laws by those with the viscous stress of a step, and evaluate springs of internal friction. Checks of a step
//! find folds, large rotations and passed obstacles. [`DiscreteRod`] implements it over a [`Layout`]: [`PlanarRod`] in
//! the plane, [`SpatialRod`] in space. [`Assembly`] joins several rods. [`AssembledRod`] adds masses, forces, energies,
//! contacts and follower loads to a rod. [`Energies::total`] is the sum of all terms of the energy. `strain_rates`
//! returns the rates of all strains (1/s) of a motion by central differences.
//!
//! Other files: `actuators` and `timed_loads` (signals), `contacts`, `drag`, `moments`, `nonlinear`, `extra`
//! (user-defined energies), `follower_loads` and `frames`. `state` has the state between steps, `viscosity` the viscous
//! stress as changed laws, `forward_sensitivity` and `transposed` forward and adjoint derivatives along parameters.
//! `sweeps`, `blocks`, `columns` and `edges` are the loops in SIMD lanes.
//!
//! `TangentOf` and `FactorsOf` are the types of the matrix of a rod and of its factors, `DualFrames` its frames with
//! derivatives along one parameter. `RotationRates` are the velocities and coefficients of a step for the inertia of
//! rotating bodies.

mod actuators;
pub mod assembly;
mod blocks;
mod columns;
mod contacts;
mod discrete;
mod drag;
mod edges;
mod extra;
mod follower_loads;
mod forward_sensitivity;
mod frames;
pub mod layout;
mod moments;
mod moved_obstacles;
mod nonlinear;
pub mod planar;
pub mod spatial;
mod state;
mod sweeps;
mod timed_loads;
mod transposed;
mod viscosity;

pub use actuators::{Actuator, ActuatorEffect, Actuators, EdgeShift, JointShift, NaturalShifts};
pub use assembly::Assembly;
pub(crate) use contacts::{MovedObstacle, RodContact};
pub use contacts::{RodContacts, StepVelocities};
pub use discrete::DiscreteRod;
pub use drag::{DragSlopes, NodalDrag};
pub(crate) use extra::Placed;
pub use extra::UserEnergies;
pub use follower_loads::{EdgeFollower, FollowerGroup, FollowerLoads};
pub use forward_sensitivity::{ChangedRods, EffectiveStrains, ForwardSensitivity};
pub use frames::{
    FrameRate, ReferenceFrames, RodGeometry, frame_rates, set_dual_frames, set_real_frames,
    zero_frame_rates,
};
pub use layout::Layout;
pub use moments::Moments;
pub use nonlinear::NonlinearParts;
pub use planar::PlanarRod;
pub use spatial::SpatialRod;
pub use state::{ExchangedEnergy, InternalVariables, State};
pub use timed_loads::{EdgeMoment, TimedLoad, TimedLoads, UnknownForce, work_of};
pub use transposed::{LawDerivatives, StressInputs, Transposed, strained};
pub use viscosity::{OwnViscosity, RodViscosity, Viscosity};

#[doc(hidden)]
#[deprecated(since = "0.3.0", note = "renamed to UserEnergies")]
pub use extra::UserEnergies as Extra;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to EffectiveStrains")]
pub use forward_sensitivity::EffectiveStrains as Counted;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to ForwardSensitivity")]
pub use forward_sensitivity::ForwardSensitivity as Sensitive;
#[doc(hidden)]
#[deprecated(since = "0.3.0", note = "renamed to LawDerivatives")]
pub use transposed::LawDerivatives as Laws;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to StressInputs")]
pub use transposed::StressInputs as Strained;

use crate::energy::Derivatives;
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use num_dual::Dual64;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Displacement of the fastest unknown in the central difference of `strain_rates`, over the length of the rod. The
/// error of the difference grows with its square, that by rounding with its inverse: both are about ten digits below
/// the rates.
const STRAIN_RATE_DISPLACEMENT: f64 = 1e-5;
/// Lowest speed, in lengths of the rod per second, for which the displacement is chosen: the derivatives of small
/// velocities may be much larger than the velocities.
const LOWEST_SPEED: f64 = 1e-3;

/// Terms of the energy of a rod, J.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Energies {
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// Energy of stretching, J.
    pub stretch: f64,
    /// Energy of bending, J.
    pub bend: f64,
    /// Energy of twisting, J.
    pub twist: f64,
    /// Potential of weight, constant forces and, in a plane, constant moments, less the work of loads with signals
    /// since the start of a motion, J.
    pub potential: f64,
    /// Energy of [user-defined energies](crate::energy::own), tendons and contacts, J.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub own: f64,
}

/// Whether an energy is exactly zero, so that the JSON of a report omits it.
fn is_zero(energy: &f64) -> bool {
    *energy == 0.0
}

impl Energies {
    /// The sum of all terms, J: kinetic, stretching, bending, twisting, potential of the loads, and `own` (user-defined
    /// energies, tendons and contacts).
    pub fn total(&self) -> f64 {
        self.kinetic + self.stretch + self.bend + self.twist + self.potential + self.own
    }
}

/// Velocities and coefficients of a step for the inertia forces of rotating bodies.
#[derive(Clone, Copy, Debug)]
pub struct RotationRates<'a, D> {
    /// Velocities of all unknowns at the end of the step, m/s (rad/s).
    pub velocity: &'a [D],
    /// Derivative of a velocity by the change of its unknown over the step, 1/s.
    pub slope: D,
    /// Factor of the masses over that of the tangent in the matrix of the step, 1/s^2.
    pub mass_weight: D,
    /// Mass damping, 1/s.
    pub mass_damping: D,
}

/// A discrete rod with the unknowns `q`: node coordinates, m, and in space the angle of every edge, rad. `frames` are
/// the reference frames of the angles.
pub trait Rod<D: Scalar>: Clone + Send + Sync {
    /// The matrix of the second derivatives of the energy.
    type Tangent: Tangent<D>;
    /// The same rod over dual numbers: with a derivative along one parameter in every quantity.
    type Dual: Rod<Dual64>;
    /// The reference frames of the angles: [`crate::energy::frame::Frames`], or `()` in the plane.
    type Frames: ReferenceFrames<D>;

    /// Geometry and strains of edges and joints in plain numbers, as the derivatives along all parameters need them.
    type Geometry: Clone + std::fmt::Debug + Default + Send + Sync;

    /// Whether there are frames at all.
    const HAS_FRAMES: bool;

    /// Whether the unknown with index `i` is an angle in rad; otherwise it is a coordinate in m. Always false in the
    /// plane.
    fn is_angle(i: usize) -> bool;

    /// Whether unknown `i` of this rod is an angle in rad, and not a length in m. The default is
    /// [`is_angle`](Rod::is_angle); an [`Assembly`] depends on its layout.
    #[inline(always)]
    fn has_angle_at(&self, i: usize) -> bool {
        Self::is_angle(i)
    }

    /// A zero matrix with the order and the sparsity pattern of the tangent.
    fn zero_tangent(&self) -> Self::Tangent;

    /// Lumped mass of every degree of freedom, kg (kg m^2 for angles), in the order of the unknowns.
    fn mass(&self) -> &[D];

    /// Overwrites `gradient` with that of the elastic energy less the work of the loads at `q`, N (N m for angles),
    /// angles being measured from `frames`. Loads without a potential are subtracted. `derivatives` selects
    /// hand-derived formulas or num-dual. Edges and joints over numbers that carry derivatives always use the former.
    fn gradient(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        gradient: &mut [D],
    );

    /// Overwrites `gradient`, N (N m for angles), with that of elastic energy less work of the loads at `q`, and
    /// `tangent`, N/m, with its derivative by the unknowns. `derivatives` selects hand-derived formulas or num-dual.
    fn tangent(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut Self::Tangent,
    );

    /// Overwrites gradient and tangent as [`tangent`](Rod::tangent) does. `tensions` of all edges, N, if given,
    /// replace the axial forces in the geometric stiffness of the tangent; the gradient does not change. The default
    /// ignores `tensions`.
    fn tangent_with_tensions(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        _tensions: Option<&[D]>,
        gradient: &mut [D],
        tangent: &mut Self::Tangent,
    ) {
        self.tangent(q, frames, derivatives, gradient, tangent);
    }

    /// Overwrites `tensions` with predicted axial forces of all edges, N. They are those at `q - change` plus their
    /// first-order change by `change`, a change of all unknowns. The default leaves `tensions` as they are.
    fn tensions_after(
        &self,
        _change: &[D],
        _q: &[D],
        _frames: &Self::Frames,
        _tensions: &mut Vec<D>,
    ) {
    }

    /// Overwrites `geometry` with lengths, directions and strains of edges and joints at `q`, in plain numbers
    /// (without derivatives).
    fn measure(&self, q: &[D], frames: &Self::Frames, geometry: &mut Self::Geometry);

    /// Overwrites gradient and tangent as [`tangent`](Rod::tangent) does, and the geometry at `q` as
    /// [`measure`](Rod::measure) does. [`DiscreteRod`] leaves `geometry` unchanged over numbers that carry
    /// derivatives.
    fn tangent_with_geometry(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut Self::Tangent,
        geometry: &mut Self::Geometry,
    ) {
        self.tangent(q, frames, derivatives, gradient, tangent);
        self.measure(q, frames, geometry);
    }

    /// Overwrites `tangent` with the second derivative of the energy by edge vectors instead of node positions, N/m.
    /// Edge `j` has the rows and columns of node `j + 1`, angles keep theirs; those of the first node's coordinates are
    /// zero. User-defined energies, contacts and follower loads are left out. An [`Assembly`] has no edge coordinates;
    /// its result is the tangent by the unknowns.
    fn edge_tangent(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        tangent: &mut Self::Tangent,
    );

    /// Moves the reference frames to the edges at the unknowns `q` by parallel transport. Angles, strains and
    /// energies at `q` do not change; no operation in the plane.
    fn update_reference_frames(frames: &mut Self::Frames, q: &[D]) {
        frames.move_to(q);
    }

    /// Moves the frames of this rod to the unknowns `q`, without changing any energy there. The default is
    /// [`update_reference_frames`](Rod::update_reference_frames).
    #[inline(always)]
    fn move_frames(&self, frames: &mut Self::Frames, q: &[D]) {
        Self::update_reference_frames(frames, q);
    }

    /// Range of the coordinates of bodies in space. Changes of a rotation among them over a step are rotation vectors,
    /// and its velocities are angular velocities in the axes of the body, both times a length. Empty by default.
    #[inline(always)]
    fn rotation_coordinates(&self) -> Range<usize> {
        0..0
    }

    /// Adds the inertia forces of rotating bodies beyond those of the diagonal masses, N, to `forces`, which contains
    /// the gradient. Their derivatives are added to `tangent` if it is given. The default does nothing.
    fn add_rotational_inertia(
        &self,
        _q: &[D],
        _frames: &Self::Frames,
        _rates: &RotationRates<'_, D>,
        _forces: &mut [D],
        _tangent: Option<&mut Self::Tangent>,
    ) {
    }

    /// Whether contacts have forces that depend on the velocity. False by default.
    #[inline(always)]
    fn has_contact_losses(&self) -> bool {
        false
    }

    /// Adds minus the forces of contacts that depend on the velocity, N, to `forces`, which contains the gradient at
    /// `q`. Their derivatives by the unknowns at the end of a step, N/m, not symmetric, are added to `tangent` if it is
    /// given. The default does nothing.
    fn add_contact_losses(
        &self,
        _q: &[D],
        _frames: &Self::Frames,
        _velocities: StepVelocities<'_, D>,
        _forces: &mut [D],
        _tangent: Option<&mut Self::Tangent>,
    ) {
    }

    /// Minus the forces of each contact on all unknowns, N, damping and friction included, at the unknowns `q` and
    /// velocities `v`, m/s: one list per contact. An empty list by default.
    fn contact_gradients(&self, [_q, _v]: [&[D]; 2], _frames: &Self::Frames) -> Vec<Vec<D>> {
        Vec::new()
    }

    /// Whether an obstacle has a prescribed motion. False by default.
    #[inline(always)]
    fn has_moved_obstacles(&self) -> bool {
        false
    }

    /// Moves the obstacles to their places at the end of a step between two times, s. The default does nothing.
    #[inline(always)]
    fn move_obstacles(&mut self, _interval: [f64; 2]) {}

    /// The work, J, of the obstacles in their movement between two times, s, with the forces at the unknowns `q` and
    /// velocities `v`, and at the present places of the obstacles. Zero by default.
    fn obstacle_work(
        &self,
        _interval: [f64; 2],
        [_q, _v]: [&[D]; 2],
        _frames: &Self::Frames,
    ) -> f64 {
        0.0
    }

    /// Replaces increments of rotations in `correction`, the solution of a system with the [`tangent`](Rod::tangent) of
    /// a simulation, by changes of the unknowns at `q`. The default does nothing.
    #[inline(always)]
    fn convert_correction(&self, _q: &[D], _frames: &Self::Frames, _correction: &mut [D]) {}

    /// Adds to `out` the product of `factor`, the products of inertia, which the diagonal masses lack, and `rates`.
    /// Both lists have all unknowns. The default does nothing.
    #[inline(always)]
    fn add_products_of_inertia(&self, _rates: &[D], _factor: D, _out: &mut [D]) {}

    /// Moves the frames to `q` as [`update_reference_frames`](Rod::update_reference_frames) does, and overwrites
    /// `gradient` there as [`gradient`](Rod::gradient) does, N (N m for angles).
    fn moved_gradient(
        &self,
        q: &[D],
        frames: &mut Self::Frames,
        derivatives: Derivatives,
        gradient: &mut [D],
    ) {
        Self::update_reference_frames(frames, q);
        self.gradient(q, frames, derivatives, gradient);
    }

    /// The first inner node (index >= 1) that a step from the unknowns `before` to `now` has taken through a fold;
    /// `None` without one. Its edges at `now` form more than a right angle, and its bends before and after are to
    /// opposite sides, together at least half a turn. A fold of 180 degrees has infinite energy, so that only a step
    /// that is too large passes it.
    fn folded_node(&self, before: &[D], now: &[D], frames: &Self::Frames) -> Option<usize>;

    /// The index of the first edge that turned by more than 45 degrees in a step from `before` to `now`; `None` without
    /// one.
    fn over_rotated_edge(&self, before: &[D], now: &[D], frames: &Self::Frames) -> Option<usize>;

    /// The index of the first contact through whose obstacle some edge passes in a step from `before` to `now`, with
    /// nodes that move on straight lines; `None` without one, and by default.
    fn passed_obstacle(&self, _before: &[D], _now: &[D], _frames: &Self::Frames) -> Option<usize> {
        None
    }

    /// Index in `[[rod_contacts]]` of the first contact of rods of which one passes through the other in a step from
    /// `before` to `now`; `None` without one. Default: none.
    fn passed_rod(&self, _before: &[D], _now: &[D], _frames: &Self::Frames) -> Option<usize> {
        None
    }

    /// The correction, J, of the potential of constant moments in [`energies`](Rod::energies) for a step from `before`
    /// to `now`. The angle there is counted in (-pi, pi]; where it jumps by a whole turn, this is minus the jump of the
    /// potential. It is zero in other steps and by default.
    fn winding_jump(&self, _before: &[D], _now: &[D]) -> f64 {
        0.0
    }

    /// Name and arc length, m, of the first user-defined energy whose value or gradient at `q` is not finite; `None`
    /// if all are, and by default.
    fn non_finite_energy(&self, _q: &[D], _frames: &Self::Frames) -> Option<(String, f64)> {
        None
    }

    /// Energies at `q`, J: stretching, bending, twisting, `own` (user-defined energies, tendons and contacts), and
    /// potential of the loads. The kinetic energy is zero, and energies of friction springs are left out.
    fn energies(&self, q: &[D], frames: &Self::Frames) -> Energies;

    /// Overwrites `strains` with those of all edges, then of all joints (one curvature each in the plane; two
    /// curvatures and the twist in space). [`set_viscous`](Rod::set_viscous) expects this order.
    fn strains(&self, q: &[D], frames: &Self::Frames, strains: &mut Vec<D>);

    /// Whether joints between rods have a viscous moment of their own. False for one rod.
    fn has_viscous_joints(&self) -> bool {
        false
    }

    /// A copy whose elements act as dashpots: zero natural strains, linear laws, no loads, moments, contacts and
    /// user-defined energies. The stiffnesses stay; strains stand for strain rates.
    fn dashpots(&self) -> Self;

    /// Sums of the energies of stretching, bending and twisting of the linear laws, J, by `strains` of all elements
    /// (order of [`strains`](Rod::strains)), with natural strains taken as zero.
    fn strain_energies(&self, strains: &[D]) -> [D; 3];

    /// Energies of stretching, bending and twisting, J, of springs in Maxwell branches by their `stretches` (order of
    /// [`strains`](Rod::strains)), whose stiffness is that of the rod. The default is that of all linear laws.
    fn branch_energies(&self, stretches: &[D]) -> [D; 3] {
        self.strain_energies(stretches)
    }

    /// Overwrites the laws of all elements with those of the `elastic` rod under viscous stress. Stiffnesses and
    /// natural strains are changed such that the stress is `K (factor s - natural - shift)`. Stresses of kinds with
    /// additional times are added; a nonlinear part of the law stays. Values that follow signals are copied from
    /// `elastic`.
    fn set_viscous(&mut self, elastic: &Self, viscosity: &Viscosity<D>);

    /// Adds `factor` times the changes `shifts` to the natural strains of edges and joints. The default does nothing.
    fn shift_natural_strains(&mut self, _shifts: &NaturalShifts<D>, _factor: D) {}

    /// Sets the first parameter of the user-defined energies with the indices `energies`, the tension of tendons, N.
    /// The default does nothing.
    fn set_tensions(&mut self, _energies: &[usize], _tension: D) {}

    /// Whether there are loads without a potential (follower loads, and moments in space): the gradient is then not the
    /// derivative of the energies, and the tangent is not symmetric. False by default.
    fn has_follower_loads(&self) -> bool {
        false
    }

    /// Adds the forces of the loads without a potential at `q`, N (N m for angles), to `forces`. The default does
    /// nothing.
    fn add_follower_forces(&self, _q: &[D], _frames: &Self::Frames, _forces: &mut [D]) {}

    /// Sets the factor of the group of loads without a potential with the index `group`, the value of its signal. The
    /// default does nothing.
    fn set_follower_factor(&mut self, _group: usize, _factor: D) {}

    /// Overwrites the laws of all elements with those of [dashpots](Rod::dashpots). Every stiffness is multiplied by
    /// the factor of its kind; the shifts of `viscosity` become natural strains.
    fn set_dashpots(&mut self, dashpots: &Self, viscosity: &Viscosity<D>);

    /// The number of strains of bending and twisting with springs of internal friction: those of all joints, or zero
    /// without internal friction (the default).
    fn sliding_strains(&self) -> usize {
        0
    }

    /// Activates the springs of internal friction in parallel with the joints, for a step that began with the
    /// internal variables `before`. `None` deactivates them. Their stiffness is a fraction of that of the `elastic`
    /// rod. The default does nothing.
    fn set_springs(&mut self, _elastic: &Self, _before: Option<&InternalVariables<D>>) {}

    /// The smallest distance of the stretches `z` of all friction springs, without slip, from the limit at which a
    /// spring begins or ceases to slip. It is infinite without internal friction and by default.
    fn distance_to_slipping(&self, _z: &[D]) -> f64 {
        f64::INFINITY
    }

    /// Reduces the stretches `z` of friction springs that exceed their slip limit to the limit. The default does
    /// nothing.
    fn slip(&self, _z: &mut [D]) {}

    /// Elastic energy of the springs of internal friction at the stretches `z`, J; zero without them and by default.
    fn slider_energy(&self, _z: &[D]) -> f64 {
        0.0
    }
}

/// A [`Rod`] to which masses, forces and energies can be added.
pub trait AssembledRod<D: Scalar>: Rod<D> {
    /// Adds a mass, kg, to the coordinates of a node, and its weight under the `gravity` in the rod's axes, m/s^2, to
    /// the node's load. In the plane the third component has no effect.
    fn add_mass(&mut self, node: usize, mass: D, gravity: [D; 3]);

    /// Adds a dead force, N, with components in the rod's axes, to the load on a node. In the plane the third one has
    /// no effect.
    fn add_force(&mut self, node: usize, force: [D; 3]);

    /// The dead load of all coordinates, N: weight and dead forces, with zero for angles.
    fn dead_load(&self) -> Vec<D>;

    /// Multiplies the axial stiffness of every edge `j`, and the modulus of a nonlinear law, by `factor(j)`.
    fn stiffen_edges(&mut self, factor: impl Fn(usize) -> f64);

    /// Replaces all user-defined energies by `own`.
    fn set_own(&mut self, own: UserEnergies<D>);

    /// Replaces all loads without a potential by `loads`.
    fn set_follower_loads(&mut self, loads: FollowerLoads<D>);

    /// Replaces all contacts with obstacles by `contacts`.
    fn set_contacts(&mut self, contacts: RodContacts<D>);

    /// Appends the energies `own` to the user-defined ones of the rod.
    fn add_own(&mut self, own: UserEnergies<D>);
}

/// The matrix of the second derivatives of the energy of a rod over `D`.
pub type TangentOf<R, D> = <R as Rod<D>>::Tangent;

/// The factors of a [`TangentOf`].
pub type FactorsOf<R, D> = <TangentOf<R, D> as Tangent<D>>::Factors;

/// The frames of a rod with derivatives along one parameter.
pub type DualFrames<R, D> = <<R as Rod<D>>::Dual as Rod<Dual64>>::Frames;

/// Overwrites `rates` with the rates of all strains, 1/s, of a rod that moves from `q` with the velocities `v`; the
/// order is that of [`Rod::strains`]. Method: central differences at `q + v dt` and `q - v dt`. In `dt` the fastest
/// unknown, m/s or rad/s, moves by the number `STRAIN_RATE_DISPLACEMENT` of the rod's `length`, m (accurate to about
/// ten digits). The fastest speed is taken as at least `LOWEST_SPEED` lengths per second.
pub(crate) fn strain_rates<D: Scalar, R: Rod<D>>(
    rod: &R,
    q: &[D],
    frames: &R::Frames,
    v: &[D],
    length: f64,
    rates: &mut Vec<D>,
) {
    // The step is chosen by displacement: slow and fast motions have the same relative error.
    let fastest = v.iter().fold(LOWEST_SPEED * length, |most, v| most.max(v.value().abs()));
    let dt = STRAIN_RATE_DISPLACEMENT * length / fastest;
    let at = |dt: f64| {
        let moved: Vec<D> = q.iter().zip(v).map(|(q, v)| *q + *v * dt).collect();
        let mut strains = Vec::new();
        rod.strains(&moved, frames, &mut strains);
        strains
    };
    rates.clear();
    // Central difference: the error is of second order in the displacement.
    rates.extend(at(dt).iter().zip(at(-dt)).map(|(a, b)| (*a - b) * (0.5 / dt)));
}
