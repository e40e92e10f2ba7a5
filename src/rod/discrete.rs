//! A rod of straight edges, in the plane or in space: [`DiscreteRod`], the [`Rod`] of a scene with one rod and of
//! each rod of an assembly.
//!
//! Contents: one stretching law per edge, one bending (and twisting) law per inner node, lumped masses, dead loads and
//! constant moments. Springs of internal friction, user-defined energies, contacts, and loads without a potential
//! (follower loads) are optional. Input: unknowns `q` (coordinates, m, and in space angles of edges, rad) and reference
//! frames of edges. Output: energies (J), gradient of the energy less the work of the loads (N), its tangent (N/m),
//! strains, and checks of a step for folds and large rotations. Minus the follower loads is part of the gradient, which
//! then is not that of an energy. For viscous stresses of a step, the laws are overwritten by other stiffnesses and
//! natural strains; `set_viscous_from` and `set_dashpots_from` do so for one rod of an assembly. `elements` are
//! references to the laws and loads, `stretch_element` is the whole law of an edge. The [`Layout`] has the element
//! formulas, evaluated for several edges at a time in SIMD lanes. The method is Discrete Elastic Rods (Bergou et al.
//! 2008, 2010).

mod rates;
mod transposed;

pub use rates::{RateLayout, StressRate};

use crate::energy::law::Spring;
use crate::energy::{DeadLoad, Derivatives, Element, HyperelasticStretch, Law, Stretch};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::tangent::{PatternByOrder, Tangent};
use crate::numerics::vector::components;
use crate::rod::frames::ReferenceFrames;
use crate::rod::layout::{
    AdditionalStresses, At, Elements, Layout, LayoutBending, LayoutSprings, NodeSink,
};
use crate::rod::moments::Moments;
use crate::rod::nonlinear::NonlinearParts;
use crate::rod::sweeps::{EdgeTangent, Elastic, GeometrySweep, Strains, TangentSweep};
use crate::rod::{
    AssembledRod, EdgeShift, Energies, FollowerLoads, InternalVariables, JointShift, NaturalShifts,
    Rod, RodContacts, RodViscosity, StepVelocities, UserEnergies, Viscosity,
};
use num_dual::Dual64;

/// The elements, masses and loads of a rod whose nodes have `N` coordinates and whose joints have `S` strains.
#[derive(Clone, Debug)]
pub struct DiscreteRod<D: Scalar, L: Layout<N, S>, const N: usize, const S: usize> {
    /// One per edge: the linear law.
    pub stretch: Vec<Stretch<D, N>>,
    /// The parts of laws that are not linear in the strain.
    pub nonlinear: NonlinearParts<D>,
    /// One per inner node: `joint[i]` is that of node `i + 1`.
    pub joint: Vec<L::Joint<D>>,
    /// Lumped mass of every degree of freedom, kg, and rotational inertia of every edge with an angle, kg m^2.
    pub mass: Vec<D>,
    /// Weight and point forces, one per node.
    pub load: Vec<DeadLoad<D, N>>,
    /// Constant moments.
    pub moments: Moments<D>,
    /// Nonlinear bending of every joint; empty for linear laws.
    pub bending: Vec<LayoutBending<L, D, N, S>>,
    /// Springs of internal friction beside the joints.
    pub sliders: Option<LayoutSprings<L, D, N, S>>,
    /// User-defined energies, and those of tendons and of springs to fixed points.
    pub own: UserEnergies<D>,
    /// Loads without a potential.
    pub followers: FollowerLoads<D>,
    /// Contacts with obstacles.
    pub contacts: RodContacts<D>,
}

/// Whether two bends to opposite sides are together at least half a turn, from the product of their curvatures
/// `2 tan(phi/2)`, summed over both directions: `tan(a/2) tan(b/2) <= -1` for `a + b >= pi`.
#[inline]
fn half_a_turn_apart(product: f64) -> bool {
    product <= -4.0
}

/// The inner product `a.b`, without derivatives.
#[inline(always)]
fn inner<D: Scalar, const N: usize>(a: &[D; N], b: &[D; N]) -> f64 {
    let mut sum = a[0].value() * b[0].value();
    for c in 1..N {
        sum += a[c].value() * b[c].value();
    }
    sum
}

/// Whether an edge with the vector `a`, m, before and `b` after has turned by more than 45 degrees:
/// `a.b < |a| |b|/sqrt(2)`.
#[inline]
fn turned_far<D: Scalar, const N: usize>(a: [D; N], b: [D; N]) -> bool {
    let along = inner(&a, &b);
    along < 0.0 || 2.0 * along * along < inner(&a, &a) * inner(&b, &b)
}

impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> DiscreteRod<D, L, N, S> {
    /// References to the elements of the rod. The springs of internal friction are included only while they are active.
    pub(super) fn elements(&self) -> Elements<'_, D, L, N, S> {
        let Self { stretch, nonlinear, joint, load, sliders, bending, .. } = self;
        let springs = sliders.as_ref().filter(|springs| !springs.acting.is_empty());
        let has_additional = springs.is_some() || !bending.is_empty();
        let additional = has_additional.then_some(AdditionalStresses { springs, bending });
        Elements { stretch, nonlinear: &nonlinear.edges, joint, load, additional, tensions: None }
    }

    /// Edge `i` as an element with its whole law, also where it is not linear in the strain.
    pub fn stretch_element(&self, i: usize) -> HyperelasticStretch<D, N> {
        self.elements().stretch_element(i)
    }

    /// The elements of the rod together with the unknowns `q` and the frames, as the sweeps over edges need them.
    pub(super) fn at<'a>(&'a self, q: &'a [D], frames: &'a L::Frames<D>) -> At<'a, D, L, N, S> {
        At { elements: self.elements(), q, frames }
    }

    /// [`set_viscous`](Rod::set_viscous) for one rod of several: overwrites the linear laws with those of the `elastic`
    /// rod under the viscous stress. Tensions of tendons, natural strains of nonlinear bending and factors of follower
    /// loads are copied from `elastic`, as they may follow signals, and so are the places of obstacles.
    pub(super) fn set_viscous_from(&mut self, elastic: &Self, viscosity: RodViscosity<'_, D>) {
        viscosity.set_laws(&elastic.stretch, &mut self.stretch, 0);
        viscosity.set_laws(&elastic.joint, &mut self.joint, elastic.stretch.len());
        // Tensions of tendons and natural curvatures of nonlinear bending may follow signals.
        self.own.copy_values(&elastic.own);
        for (own, elastic) in self.bending.iter_mut().zip(&elastic.bending) {
            own.natural = elastic.natural;
        }
        self.followers.copy_factors(&elastic.followers);
        self.contacts.copy_obstacles(&elastic.contacts);
    }

    /// [`set_dashpots`](Rod::set_dashpots) for one rod of several: overwrites the linear laws with those of `dashpots`,
    /// stiffnesses times their factors and shifts as natural strains.
    pub(super) fn set_dashpots_from(&mut self, dashpots: &Self, viscosity: RodViscosity<'_, D>) {
        viscosity.set_dashpots(&dashpots.stretch, &mut self.stretch, 0);
        viscosity.set_dashpots(&dashpots.joint, &mut self.joint, dashpots.stretch.len());
    }

    /// Overwrites `gradient`, N, and `tangent`, N/m, of energy less work of the loads at the unknowns and frames of
    /// `at`, and the geometry if one is given. User-defined energies, contacts and follower loads are included.
    /// `derivatives` selects the hand-derived formulas or, for checks with plain numbers, num-dual.
    #[inline(always)]
    fn assemble(
        &self,
        at: At<'_, D, L, N, S>,
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut L::Tangent<D>,
        geometry: Option<&mut L::Geometry>,
    ) {
        // Derivatives by num-dual on request, for checks: one element after the other.
        if D::PLAIN && derivatives == Derivatives::Dual {
            let mut nodes = L::node_sink::<D, D>((), &self.load, gradient, tangent);
            L::derive_by_duals(at, &mut nodes);
            nodes.end();
            if let Some(geometry) = geometry {
                D::run_sweep(GeometrySweep { at, geometry });
            }
        } else {
            let under_tension = at.elements.tensions.is_some();
            let (linear, to) = (&self.stretch, (&mut *gradient, &mut *tangent));
            D::run_sweep(TangentSweep { at, gradient: &mut *to.0, tangent: &mut *to.1, geometry });
            self.nonlinear.add_tangent::<L, N, S>(linear, at.q, under_tension, to.0, to.1);
        }
        // Constant moments and user-defined energies are few, and come after the sweep.
        self.moments.add_tangent(at.q, gradient, tangent);
        self.own.add_tangent(at.q, at.frames.edge_frames(), derivatives, gradient, tangent);
        self.followers.add_tangent::<L, N, S>(at.q, at.frames, gradient, tangent);
        self.contacts.add_tangent::<N>(at.q, gradient, tangent);
    }
}

impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> Rod<D>
    for DiscreteRod<D, L, N, S>
{
    type Tangent = L::Tangent<D>;
    type Dual = DiscreteRod<Dual64, L, N, S>;
    type Frames = L::Frames<D>;
    type Geometry = L::Geometry;

    const HAS_FRAMES: bool = L::STRIDE > N;

    /// Whether unknown `i` is an angle in rad, and not a length in m: in space every fourth unknown (`i % 4 == 3`), in
    /// the plane none.
    fn is_angle(i: usize) -> bool {
        i % L::STRIDE >= N
    }

    /// A zero band matrix with a row for every unknown.
    fn zero_tangent(&self) -> Self::Tangent {
        PatternByOrder::zeros(self.mass.len())
    }

    /// Lumped mass of every unknown, kg (kg m^2 for angles), in their order.
    fn mass(&self) -> &[D] {
        &self.mass
    }

    /// Overwrites `gradient` with that of energy less work of loads and moments at `q`, N (N m for angles). Edges and
    /// joints use num-dual for plain numbers with `Derivatives::Dual`, else the hand-derived formulas. Moments,
    /// user-defined energies, contacts and minus the follower loads are included.
    fn gradient(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        gradient: &mut [D],
    ) {
        let at = self.at(q, frames);
        if D::PLAIN && derivatives == Derivatives::Dual {
            gradient.fill(D::from(0.0));
            for (i, load) in self.load.iter().enumerate() {
                let to = gradient[L::STRIDE * i..].iter_mut();
                to.zip(load.force).for_each(|(to, force)| *to -= force);
            }
            L::dual_gradients(at, |first, local| {
                gradient[first..].iter_mut().zip(local).for_each(|(to, local)| *to += *local);
            });
        } else {
            L::gradient(at, gradient);
            self.nonlinear.add_gradient::<L, N, S>(&self.stretch, q, gradient);
        }
        self.moments.add_gradient(q, gradient);
        self.own.add_gradient(q, frames.edge_frames(), derivatives, gradient);
        self.followers.add_forces::<L, N, S>(-1.0, q, frames, gradient);
        self.contacts.add_gradient::<N>(q, gradient);
    }

    /// Overwrites gradient, N, and tangent, N/m, of energy less work of loads and moments at `q`. User-defined
    /// energies, contacts and minus the follower loads are included; the derivatives of the latter are not symmetric.
    /// `derivatives` selects as in `gradient`.
    fn tangent(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut Self::Tangent,
    ) {
        self.assemble(self.at(q, frames), derivatives, gradient, tangent, None);
    }

    /// Overwrites gradient and tangent as [`tangent`](Rod::tangent) does. If `tensions` of all edges, N, are given,
    /// they replace the axial forces in the geometric stiffness of the edges.
    fn tangent_with_tensions(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        tensions: Option<&[D]>,
        gradient: &mut [D],
        tangent: &mut Self::Tangent,
    ) {
        let at = At { elements: Elements { tensions, ..self.elements() }, q, frames };
        self.assemble(at, derivatives, gradient, tangent, None);
    }

    /// Overwrites `tensions` with the axial force of every edge, N, at `q - change` plus its first-order change by
    /// `change`: the predicted tension, without the spurious stretch of an edge that rotates on a straight line.
    fn tensions_after(&self, change: &[D], q: &[D], _: &Self::Frames, tensions: &mut Vec<D>) {
        tensions.clear();
        for (i, stretch) in self.stretch.iter().enumerate() {
            let (now, change) = (L::edge(q, i), L::edge(change, i));
            let strain = stretch.strain_after(&components(|c| now[c] - change[c]), &now);
            tensions.push(stretch.stress(&[strain])[0] + self.nonlinear.axial_force(i, strain));
        }
    }

    /// Resizes `geometry` and overwrites it with lengths, directions and strains of all edges and joints at `q`, as
    /// plain numbers.
    fn measure(&self, q: &[D], frames: &Self::Frames, geometry: &mut Self::Geometry) {
        D::run_sweep(GeometrySweep { at: self.at(q, frames), geometry });
    }

    /// Overwrites gradient, N, and tangent, N/m, at `q` and, over plain numbers only, the geometry, in one sweep.
    /// Numbers with derivatives leave `geometry` unchanged.
    fn tangent_with_geometry(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut Self::Tangent,
        geometry: &mut Self::Geometry,
    ) {
        // Dual numbers have their derivatives themselves.
        let geometry = D::PLAIN.then_some(geometry);
        self.assemble(self.at(q, frames), derivatives, gradient, tangent, geometry);
    }

    /// Overwrites `tangent` with the second derivatives of the energy by edge vectors and angles, N/m. Edge `j` has the
    /// rows and columns of node `j + 1`; those of the first node's coordinates are zero. Constant moments are included;
    /// user-defined energies, contacts and follower loads are not.
    fn edge_tangent(
        &self,
        q: &[D],
        frames: &Self::Frames,
        derivatives: Derivatives,
        tangent: &mut Self::Tangent,
    ) {
        tangent.clear();
        let at = self.at(q, frames);
        if D::PLAIN && derivatives == Derivatives::Dual {
            let mut edges = L::edge_sink::<D, D>(tangent, self.joint.len());
            L::derive_by_duals(at, &mut edges);
        } else {
            D::run_sweep(EdgeTangent { at, tangent: &mut *tangent });
            self.nonlinear.add_edge_tangent::<L, N, S>(&self.stretch, q, tangent);
        }
        self.moments.add_edge_tangent(q, tangent);
    }

    /// Moves the frames to `q` by parallel transport and overwrites `gradient` there, N (N m for angles), with the same
    /// parts as in `gradient`. The hand-derived formulas do both in one sweep, which in space leaves out active
    /// friction springs; the explicit schemes, which use it, reject internal friction. With nonlinear bending, or
    /// num-dual, the frames move first.
    fn moved_gradient(
        &self,
        q: &[D],
        frames: &mut Self::Frames,
        derivatives: Derivatives,
        gradient: &mut [D],
    ) {
        if D::PLAIN && derivatives == Derivatives::Dual || !self.bending.is_empty() {
            frames.move_to(q);
            return self.gradient(q, frames, derivatives, gradient);
        }
        L::moved_gradient(self.elements(), q, frames, gradient);
        self.nonlinear.add_gradient::<L, N, S>(&self.stretch, q, gradient);
        self.moments.add_gradient(q, gradient);
        self.own.add_gradient(q, frames.edge_frames(), derivatives, gradient);
        self.followers.add_forces::<L, N, S>(-1.0, q, frames, gradient);
        self.contacts.add_gradient::<N>(q, gradient);
    }

    /// The first inner node (index >= 1) whose joint passed through a fold in the step from `before` to `now`; `None`
    /// if no joint did. Criterion: the joint turns by more than a right angle at `now`. Its bends before and after are
    /// to opposite sides, and together at least half a turn.
    fn folded_node(&self, before: &[D], now: &[D], frames: &Self::Frames) -> Option<usize> {
        let at = self.at(now, frames);
        let struck = |i: usize| {
            let [a, b] = [before, now].map(|q| L::joint_strains(&at, q, i));
            // Strains of bending come first. A fold of 180 degrees has infinite curvature: a step beyond it shows as
            // bends to opposite sides.
            half_a_turn_apart((0..S.min(2)).map(|c| a[c].value() * b[c].value()).sum())
        };
        // Inexpensive test first: hardly any edge is at more than a right angle to the one before it, and without one
        // no joint can be folded.
        let (mut last, mut least) = (L::edge(now, 0), 0.0);
        for i in 1..self.stretch.len() {
            let edge = L::edge(now, i);
            let dot = inner(&last, &edge);
            least = if dot < least { dot } else { least };
            last = edge;
        }
        if least == 0.0 {
            return None;
        }
        let sharp = |i: &usize| inner(&L::edge(now, *i), &L::edge(now, i + 1)) < 0.0;
        (0..self.joint.len()).filter(sharp).find(|i| struck(*i)).map(|i| i + 1)
    }

    /// The index of the first edge that turned by more than 45 degrees in a step from the unknowns `before` to `now`;
    /// `None` without one.
    fn over_rotated_edge(&self, before: &[D], now: &[D], _: &Self::Frames) -> Option<usize> {
        (0..self.stretch.len()).find(|i| turned_far(L::edge(before, *i), L::edge(now, *i)))
    }

    /// The index of the first contact through whose obstacle some edge passes in a step from the unknowns `before` to
    /// `now`; `None` without one.
    fn passed_obstacle(&self, before: &[D], now: &[D], _: &Self::Frames) -> Option<usize> {
        self.contacts.passed_obstacle::<N>(before, now)
    }

    /// The correction of the potential of the constant moments, J, in a step in which the angle of the first edge, in
    /// (-pi, pi], jumps by a whole turn. It is minus the jump of `energies`; zero in every other step and without
    /// moments.
    fn winding_jump(&self, before: &[D], now: &[D]) -> f64 {
        self.moments.jump(before, now)
    }

    /// Name and arc length, m, of the first user-defined energy whose value or gradient at `q` is not finite; `None` if
    /// all are.
    fn non_finite_energy(&self, q: &[D], frames: &Self::Frames) -> Option<(String, f64)> {
        self.own.non_finite_energy(q, frames.edge_frames())
    }

    /// The energies at `q`, J: stretching, bending, twisting, `own` (user-defined energies and contacts), and the
    /// potential of dead loads and constant moments. The angle of a moment's edge is counted along the rod beyond half
    /// a turn. The kinetic energy is zero; friction springs, and follower loads, which have no potential, are left out.
    fn energies(&self, q: &[D], frames: &Self::Frames) -> Energies {
        let at = self.at(q, frames);
        let mut sums = D::run_sweep(Elastic { at });
        sums.stretch += self.nonlinear.stretch_energy::<L, N, S>(&self.stretch, q);
        for (i, load) in self.load.iter().enumerate() {
            sums.potential += load.energy(L::node(q, i)).value();
        }
        // A moment follows the angle beyond half a turn: the sum of all turning angles.
        let turning = |i: usize| 2.0 * (0.5 * L::joint_strains(&at, q, i)[0].value()).atan();
        sums.potential += self.moments.potential(q, turning);
        for (i, bending) in self.bending.iter().enumerate() {
            sums.bend += bending.energy(&L::joint_strains(&at, q, i)).value();
        }
        sums.own = self.own.energy(q, frames.edge_frames()) + self.contacts.energy::<N>(q);
        sums
    }

    /// Overwrites `strains` with those of all edges, then of all joints, `S` per joint: the order of
    /// [`Viscosity::shift`].
    fn strains(&self, q: &[D], frames: &Self::Frames, strains: &mut Vec<D>) {
        let edges = self.stretch.len();
        strains.resize(edges + S * self.joint.len(), D::from(0.0));
        let (edges, joints) = strains.split_at_mut(edges);
        let joints = joints.as_chunks_mut::<S>().0;
        D::run_sweep(Strains { at: self.at(q, frames), edges, joints });
    }

    /// A copy whose elements act as dashpots: strains stand for strain rates. Natural strains, loads, moments,
    /// user-defined energies, contacts and nonlinear parts of laws are removed; stiffnesses, masses and friction
    /// springs stay.
    fn dashpots(&self) -> Self {
        let mut rod = self.clone();
        let zero = D::from(0.0);
        // Dashpots: the strains of the elements stand for rates, whose natural values are zero.
        for edge in &mut rod.stretch {
            *edge = edge.with(edge.stiffness(), [zero]);
        }
        rod.nonlinear = NonlinearParts::default();
        rod.joint.iter_mut().for_each(|joint| *joint = joint.with(joint.stiffness(), [zero; S]));
        rod.bending.clear();
        rod.load.iter_mut().for_each(|load| load.force = [zero; N]);
        rod.moments.list.clear();
        rod.own = UserEnergies::default();
        rod.followers = FollowerLoads::none();
        rod.contacts = RodContacts::default();
        rod
    }

    /// Energies of stretching, bending and twisting of the linear laws, J, at the `strains` of all elements (edges,
    /// then joints), with natural strains taken as zero.
    fn strain_energies(&self, strains: &[D]) -> [D; 3] {
        let (stretch, joints) = strains.split_at(self.stretch.len());
        let mut energies = [D::from(0.0); 3];
        let edges = self.stretch.iter().zip(stretch).map(|(edge, s)| edge.energies(&[*s]));
        let joints = self.joint.iter().zip(joints.as_chunks::<S>().0);
        for kinds in edges.chain(joints.map(|(joint, s)| joint.energies(s))) {
            (0..3).for_each(|kind| energies[kind] += kinds[kind]);
        }
        energies
    }

    /// Overwrites the linear laws of all elements with those of the `elastic` rod under the `viscosity`: scaled
    /// stiffnesses and shifted natural strains, with the stress `K (factor s - natural - shift)`. Tensions of tendons,
    /// natural strains of nonlinear bending, factors of follower loads and places of obstacles are copied from
    /// `elastic`.
    fn set_viscous(&mut self, elastic: &Self, viscosity: &Viscosity<D>) {
        self.set_viscous_from(elastic, viscosity.of_single_rod());
    }

    /// Adds `factor` times the changes to the natural strains of edges and joints, also to those of nonlinear bending.
    fn shift_natural_strains(&mut self, shifts: &NaturalShifts<D>, factor: D) {
        for EdgeShift { edge, strain } in &shifts.edges {
            self.stretch[*edge].natural_strain += *strain * factor;
        }
        for JointShift { joint, strains } in &shifts.joints {
            let law = &mut self.joint[*joint];
            let mut natural = law.natural();
            for c in 0..S {
                natural[c] += strains[c] * factor;
            }
            *law = law.with(law.stiffness(), natural);
            if let Some(bending) = self.bending.get_mut(*joint) {
                bending.natural = natural;
            }
        }
    }

    /// Sets the first parameter of the user-defined energies with the indices `energies`, the tension of tendons, N.
    fn set_tensions(&mut self, energies: &[usize], tension: D) {
        self.own.set_first_value(energies, tension);
    }

    /// Whether there are loads without a potential.
    fn has_follower_loads(&self) -> bool {
        !self.followers.is_empty()
    }

    /// Adds the forces of the loads without a potential at `q`, N (N m for angles), to `forces`.
    fn add_follower_forces(&self, q: &[D], frames: &Self::Frames, forces: &mut [D]) {
        self.followers.add_forces::<L, N, S>(1.0, q, frames, forces);
    }

    /// Whether contacts have damping or friction.
    fn has_contact_losses(&self) -> bool {
        self.contacts.have_losses()
    }

    /// Adds minus the forces of contacts that depend on the velocity (damping and friction) at `q`, N, to `forces`. If
    /// `tangent` is given, their derivatives by the unknowns at the end of the step, N/m, not symmetric, are added to
    /// it.
    fn add_contact_losses(
        &self,
        q: &[D],
        _: &Self::Frames,
        velocities: StepVelocities<'_, D>,
        forces: &mut [D],
        tangent: Option<&mut Self::Tangent>,
    ) {
        self.contacts.add_losses::<N>(q, velocities, forces, tangent);
    }

    /// Minus the forces of each contact on all unknowns, N, damping and friction included, at the unknowns `q` and
    /// velocities `v`, m/s: one list per contact.
    fn contact_gradients(&self, [q, v]: [&[D]; 2], _: &Self::Frames) -> Vec<Vec<D>> {
        self.contacts.gradients::<N>(q, v)
    }

    /// Whether an obstacle has a prescribed motion.
    fn has_moved_obstacles(&self) -> bool {
        self.contacts.have_moved_obstacles()
    }

    /// Moves the obstacles to their places at the end of a step between two times, s.
    fn move_obstacles(&mut self, interval: [f64; 2]) {
        self.contacts.move_obstacles(interval);
    }

    /// The work, J, of the obstacles in their movement between two times, s, with the forces at `q` and `v`.
    fn obstacle_work(&self, interval: [f64; 2], [q, v]: [&[D]; 2], _: &Self::Frames) -> f64 {
        self.contacts.obstacle_work::<N>(interval, q, v)
    }

    /// Sets the factor of the group of loads without a potential with the index `group`; without it nothing happens.
    fn set_follower_factor(&mut self, group: usize, factor: D) {
        self.followers.set_factor(group, factor);
    }

    /// Overwrites the linear laws of all elements with those of `dashpots`: every stiffness times the factor of its
    /// kind in `viscosity` (common plus additional one), and the shifts as natural strains.
    fn set_dashpots(&mut self, dashpots: &Self, viscosity: &Viscosity<D>) {
        self.set_dashpots_from(dashpots, viscosity.of_single_rod());
    }

    /// The number of strains with springs of internal friction: `S` per joint, or zero without internal friction.
    fn sliding_strains(&self) -> usize {
        if self.sliders.is_some() { S * self.joint.len() } else { 0 }
    }

    /// Activates the springs of internal friction for a step that began with the strains `s0` and stretches `z0` of
    /// `before`: the stretch without slip is `s - s0 + z0`. Stiffnesses are those of the `elastic` rod. `None`
    /// deactivates the springs; without internal friction nothing changes.
    fn set_springs(&mut self, elastic: &Self, before: Option<&InternalVariables<D>>) {
        let Some(springs) = &mut self.sliders else { return };
        springs.acting.clear();
        let Some(InternalVariables { strain, slid, .. }) = before else { return };
        let strains = strain[elastic.stretch.len()..].as_chunks::<S>().0;
        let starts = strains.iter().zip(slid.as_chunks::<S>().0);
        springs.acting.extend(elastic.joint.iter().zip(starts).map(|(joint, (strain, slid))| {
            // z = s - s0 + z0: the offset is the stretch less the strain at the start of the
            // step.
            Spring { elastic: joint.stiffness(), offset: components(|c| slid[c] - strain[c]) }
        }));
    }

    /// Reduces the stretches `z`, `S` per joint, of friction springs beyond their slip limit `R` to `z R/|z|`. Without
    /// internal friction they stay.
    fn slip(&self, z: &mut [D]) {
        let Some(springs) = &self.sliders else { return };
        for (i, z) in z.as_chunks_mut::<S>().0.iter_mut().enumerate() {
            *z = springs.sliders.stretch_with_slip(i, &self.joint[i].stiffness(), *z);
        }
    }

    /// The smallest distance, over all joints, of the size of the stretch in `z` from the slip limit of its springs;
    /// infinite without internal friction.
    fn distance_to_slipping(&self, z: &[D]) -> f64 {
        let Some(springs) = &self.sliders else { return f64::INFINITY };
        let stretches = z.as_chunks::<S>().0.iter().zip(&self.joint).enumerate();
        stretches
            .map(|(i, (z, joint))| springs.sliders.distance_to_slipping(i, &joint.stiffness(), z))
            .fold(f64::INFINITY, f64::min)
    }

    /// Elastic energy of the springs of internal friction at the stretches `z`, J; zero without them.
    fn slider_energy(&self, z: &[D]) -> f64 {
        let Some(springs) = &self.sliders else { return 0.0 };
        let stretches = z.as_chunks::<S>().0.iter().zip(&self.joint);
        stretches.map(|(z, joint)| springs.sliders.energy(&joint.stiffness(), z).value()).sum()
    }
}

impl<D: RodScalar, L: Layout<N, S>, const N: usize, const S: usize> AssembledRod<D>
    for DiscreteRod<D, L, N, S>
{
    /// Adds a mass, kg, to the `N` coordinates of a node, and its weight under the first `N` components of `gravity` in
    /// the rod's axes, m/s^2, to the node's load.
    fn add_mass(&mut self, node: usize, mass: D, gravity: [D; 3]) {
        for c in 0..N {
            self.mass[L::STRIDE * node + c] += mass;
            self.load[node].force[c] += mass * gravity[c];
        }
    }

    /// Adds the first `N` components of a dead force, N, in the rod's axes to the load on a node.
    fn add_force(&mut self, node: usize, force: [D; 3]) {
        for c in 0..N {
            self.load[node].force[c] += force[c];
        }
    }

    /// The dead load of all coordinates, N: weight and dead forces, with zero for angles.
    fn dead_load(&self) -> Vec<D> {
        let mut load = vec![D::from(0.0); self.mass.len()];
        for (i, own) in self.load.iter().enumerate() {
            load[L::STRIDE * i..][..N].copy_from_slice(&own.force);
        }
        load
    }

    /// Multiplies the axial stiffness of every edge `j`, and the modulus of a nonlinear law, by `factor(j)`.
    fn stiffen_edges(&mut self, factor: impl Fn(usize) -> f64) {
        for (j, edge) in self.stretch.iter_mut().enumerate() {
            edge.stiffness *= factor(j);
        }
        for (j, part) in self.nonlinear.edges.iter_mut().enumerate() {
            *part = part.scaled(factor(j));
        }
    }

    /// Replaces all user-defined energies by `own`.
    fn set_own(&mut self, own: UserEnergies<D>) {
        self.own = own;
    }

    /// Replaces all loads without a potential by `loads`.
    fn set_follower_loads(&mut self, loads: FollowerLoads<D>) {
        self.followers = loads;
    }

    /// Replaces all contacts with obstacles by `contacts`.
    fn set_contacts(&mut self, contacts: RodContacts<D>) {
        self.contacts = contacts;
    }

    /// Appends the energies `own` to the user-defined ones of the rod.
    fn add_own(&mut self, own: UserEnergies<D>) {
        self.own = std::mem::take(&mut self.own).with(own);
    }
}
