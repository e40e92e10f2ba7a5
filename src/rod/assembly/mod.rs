//! Assemblies: several planar rods whose ends are carried by [rigid bodies](bodies).
//!
//! Unknowns are those of all rods, one rod after the other, and then the coordinates of the bodies. A joint is a clamp
//! whose pose is unknown: the nodes that a body carries follow from its coordinates, as those at a wall follow from the
//! wall. Their own unknowns have no effect: gradients there are zero, and rows and columns of the tangent are those of the
//! identity. [`Assembly::place_carried`] writes them.

pub mod bodies;
mod member;
mod tangent;

pub use member::{FixedNode, Member};
pub use tangent::{AssemblyFactors, AssemblyTangent};

use crate::energy::Derivatives;
use crate::numerics::envelope::Envelope;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::numerics::tangent::Tangent;
use crate::rod::assembly::bodies::{Bodies, CarriedPosition};
use crate::rod::assembly::member::{MemberWorkspace, RodUnknowns};
use crate::rod::assembly::tangent::{Coupling, MemberTangent, ROWS};
use crate::rod::{Energies, Rod, Viscosity};
use num_dual::Dual64;
use std::ops::Range;

/// Planar rods with the bodies that join them.
#[derive(Clone, Debug)]
pub struct Assembly<D: Scalar> {
    members: Vec<Member<D>>,
    bodies: Bodies<D>,
    /// First coordinate of the bodies.
    first: usize,
    /// Mass of every unknown, kg; without a meaning for carried and fixed nodes.
    mass: Vec<D>,
    room: MemberWorkspace<D>,
}

impl<D: Nestable> Assembly<D> {
    /// An assembly of rods with consecutive ranges of unknowns, and of bodies with `coordinates` in all.
    pub fn new(members: Vec<Member<D>>, bodies: Bodies<D>, coordinates: usize) -> Self {
        let first = members.last().map_or(0, |member| member.range.end);
        let mut mass: Vec<D> =
            members.iter().flat_map(|member| member.rod.mass.iter().copied()).collect();
        mass.resize(first + coordinates, D::from(0.0));
        bodies.masses(&mut mass[first..]);
        // Carried and fixed nodes have the mass of a body, so that none is zero.
        let any = mass[first..].iter().chain(&mass).copied().find(|mass| mass.value() > 0.0);
        for member in &members {
            for i in member.tied() {
                mass[member.range.start + i] = any.unwrap_or(D::from(1.0));
            }
        }
        Self { members, bodies, first, mass, room: MemberWorkspace::default() }
    }

    /// The rods.
    pub fn members(&self) -> &[Member<D>] {
        &self.members
    }

    /// The bodies and springs.
    pub fn bodies(&self) -> &Bodies<D> {
        &self.bodies
    }

    /// Range of the coordinates of bodies.
    pub fn body_coordinates(&self) -> Range<usize> {
        self.first..self.mass.len()
    }

    /// The unknowns without effect: those of carried and fixed nodes.
    pub fn tied(&self) -> impl Iterator<Item = usize> {
        self.members.iter().flat_map(|member| member.tied().map(|i| member.range.start + i))
    }

    /// Writes the unknowns of carried and fixed nodes that follow from the coordinates of the bodies.
    pub fn place_carried(&self, q: &mut [D]) {
        let (rods, z) = q.split_at_mut(self.first);
        let mut carried = Vec::new();
        for member in &self.members {
            member.place(&self.bodies, z, &mut rods[member.range.clone()], &mut carried);
        }
    }

    /// Writes the velocities of carried nodes that follow from those of the bodies' coordinates; those of fixed nodes are
    /// zero.
    pub fn set_carried_rates(&self, q: &[D], rates: &mut [D]) {
        let (rods, z_rates) = rates.split_at_mut(self.first);
        let mut carried = Vec::new();
        for member in &self.members {
            member.carry(&self.bodies, &q[self.first..], &mut carried);
            member.set_rates(&carried, z_rates, &mut rods[member.range.clone()]);
        }
    }

    /// Calls `visit` with each rod and its unknowns at `q`, carried nodes included.
    fn for_each_placed(&self, q: &[D], mut visit: impl FnMut(&Member<D>, &mut RodUnknowns<D>)) {
        let mut room = self.room.borrow();
        for member in &self.members {
            let RodUnknowns { q: own, carried, .. } = &mut *room;
            own.clear();
            own.extend_from_slice(&q[member.range.clone()]);
            member.place(&self.bodies, &q[self.first..], own, carried);
            visit(member, &mut room);
        }
    }

    /// The first place that `find` returns for a rod with its unknowns `before` and `now`, plus the number of such places,
    /// `count`, of the rods before it.
    fn find_place(
        &self,
        [before, now]: [&[D]; 2],
        count: impl Fn(&Member<D>) -> usize,
        find: impl Fn(&Member<D>, &[D], &[D]) -> Option<usize>,
    ) -> Option<usize> {
        let (mut found, mut first) = (None, 0);
        self.for_each_placed(now, |member, RodUnknowns { q, other, other_carried, .. }| {
            if found.is_some() {
                return;
            }
            other.clear();
            other.extend_from_slice(&before[member.range.clone()]);
            member.place(&self.bodies, &before[self.first..], other, other_carried);
            found = find(member, other, q).map(|place| first + place);
            first += count(member);
        });
        found
    }
}

/// Adds the derivatives by the coordinates of bodies through carried nodes, from the gradient of a rod by those nodes, which
/// it sets to zero.
fn reduce_gradient<D: Nestable>(
    member: &Member<D>,
    carried: &[CarriedPosition<D>],
    rod: &mut [D],
    bodies: &mut [D],
) {
    for ((_, node), carried) in member.carried().zip(carried) {
        let force = [rod[2 * node.node], rod[2 * node.node + 1]];
        for k in 0..carried.count {
            let slope = carried.slopes[k];
            bodies[carried.coordinates[k]] += slope[0] * force[0] + slope[1] * force[1];
        }
    }
    member.tied().for_each(|i| rod[i] = D::from(0.0));
}

/// Adds the second derivatives by the coordinates of bodies through carried nodes, from the band of a rod and its gradient.
fn reduce_tangent<D: Nestable>(
    member: &Member<D>,
    carried: &[CarriedPosition<D>],
    gradient: &[D],
    own: &mut MemberTangent<D>,
    bodies: &mut Envelope<D>,
) {
    let (zero, mut first) = (D::from(0.0), 0);
    for (attachment, coupling) in member.attachments.iter().zip(&mut own.couplings) {
        let Coupling { rows, columns, entries } = coupling;
        entries.fill([zero; ROWS]);
        let moved = &carried[first..first + attachment.nodes.len()];
        first += attachment.nodes.len();
        for (node, motion) in attachment.nodes.iter().zip(moved) {
            let place = 2 * node.node;
            // Between the rows beside the end and the coordinates.
            for (r, row) in rows.clone().enumerate() {
                let by = [own.band.get(row, place), own.band.get(row, place + 1)];
                for (entries, slope) in entries.iter_mut().zip(&motion.slopes) {
                    entries[r] += by[0] * slope[0] + by[1] * slope[1];
                }
            }
            // Between coordinates, by the curvature of the position.
            let force = [gradient[place], gradient[place + 1]];
            for (i, curvature) in columns.iter().zip(&motion.curvatures) {
                bodies.add(*i, *i, force[0] * curvature[0] + force[1] * curvature[1]);
            }
            // And by pairs of carried nodes.
            for (other, also) in attachment.nodes.iter().zip(moved) {
                let at = 2 * other.node;
                let block = [
                    [own.band.get(place, at), own.band.get(place, at + 1)],
                    [own.band.get(place + 1, at), own.band.get(place + 1, at + 1)],
                ];
                for (i, slope) in columns.iter().zip(&motion.slopes) {
                    let by = [
                        slope[0] * block[0][0] + slope[1] * block[1][0],
                        slope[0] * block[0][1] + slope[1] * block[1][1],
                    ];
                    for (j, other) in columns.iter().zip(&also.slopes) {
                        if j <= i {
                            bodies.add(*i, *j, by[0] * other[0] + by[1] * other[1]);
                        }
                    }
                }
            }
        }
    }
    member.tied().for_each(|i| own.band.uncouple(i));
}

impl<D: Nestable> Rod<D> for Assembly<D> {
    type Tangent = AssemblyTangent<D>;
    type Dual = Assembly<Dual64>;
    type Frames = ();
    type Geometry = ();

    const HAS_FRAMES: bool = false;

    /// Coordinates of rotations are lengths.
    fn is_angle(_: usize) -> bool {
        false
    }

    /// A zero matrix with the sparsity pattern of the tangent.
    fn zero_tangent(&self) -> AssemblyTangent<D> {
        let member = |member: &Member<D>| MemberTangent {
            band: member.rod.zero_tangent(),
            range: member.range.clone(),
            couplings: member.couplings(&self.bodies),
        };
        let members: Vec<MemberTangent<D>> = self.members.iter().map(member).collect();
        let mut first: Vec<usize> = (0..self.mass.len() - self.first).collect();
        for member in &members {
            let all = || member.couplings.iter().flat_map(|coupling| &coupling.columns);
            let Some(least) = all().min() else { continue };
            all().for_each(|i| first[*i] = first[*i].min(*least));
        }
        AssemblyTangent { members, bodies: Envelope::zeros(first) }
    }

    /// Lumped mass of every degree of freedom, kg (kg m^2 for angles).
    fn mass(&self) -> &[D] {
        &self.mass
    }

    /// Writes the gradient of the elastic energy less the dead loads, N (N m for angles).
    fn gradient(&self, q: &[D], (): &(), derivatives: Derivatives, gradient: &mut [D]) {
        let (rods, bodies) = gradient.split_at_mut(self.first);
        self.bodies.gradient(&q[self.first..], bodies);
        self.for_each_placed(q, |member, RodUnknowns { q, carried, .. }| {
            let own = &mut rods[member.range.clone()];
            member.rod.gradient(q, &(), derivatives, own);
            reduce_gradient(member, carried, own, bodies);
        });
    }

    /// Writes the gradient as `gradient` does, and its tangent, N/m.
    fn tangent(
        &self,
        q: &[D],
        (): &(),
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut AssemblyTangent<D>,
    ) {
        self.tangent_under(q, &(), derivatives, None, gradient, tangent);
    }

    /// Writes gradient and tangent, the tangent for the given `tensions` of all edges, N, instead of those of their
    /// stretches.
    fn tangent_under(
        &self,
        q: &[D],
        (): &(),
        derivatives: Derivatives,
        tensions: Option<&[D]>,
        gradient: &mut [D],
        tangent: &mut AssemblyTangent<D>,
    ) {
        let (rods, bodies) = gradient.split_at_mut(self.first);
        let AssemblyTangent { members, bodies: corner } = tangent;
        self.bodies.gradient(&q[self.first..], bodies);
        corner.clear();
        self.bodies.add_tangent(&q[self.first..], |i, j, entry| corner.add(i, j, entry));
        let (mut members, mut edges) = (members.iter_mut(), 0);
        self.for_each_placed(q, |member, RodUnknowns { q, carried, .. }| {
            let Some(own) = members.next() else { return };
            let forces = &mut rods[member.range.clone()];
            let count = member.rod.stretch.len();
            let tensions = tensions.map(|all| &all[edges..edges + count]);
            edges += count;
            let band = &mut own.band;
            member.rod.tangent_under(q, &(), derivatives, tensions, forces, band);
            reduce_tangent(member, carried, forces, own, corner);
            reduce_gradient(member, carried, forces, bodies);
        });
    }

    /// Writes the tensions of all edges at `q`, N, to first order in the `change` that led to `q`.
    fn tensions_after(&self, change: &[D], q: &[D], tensions: &mut Vec<D>) {
        tensions.clear();
        self.for_each_placed(q, |member, RodUnknowns { q, carried, other, elements, .. }| {
            other.clear();
            other.extend_from_slice(&change[member.range.clone()]);
            member.set_rates(carried, &change[self.first..], other);
            member.rod.tensions_after(other, q, elements);
            tensions.extend_from_slice(elements);
        });
    }

    /// Sensitivities of an assembly are those of simulations over dual numbers, which need no geometry.
    fn measure(&self, _: &[D], (): &(), (): &mut ()) {}

    /// The tangent by unknowns: an assembly has no edge coordinates.
    fn edge_tangent(
        &self,
        q: &[D],
        (): &(),
        derivatives: Derivatives,
        tangent: &mut AssemblyTangent<D>,
    ) {
        self.tangent(q, &(), derivatives, &mut vec![D::from(0.0); q.len()], tangent);
    }

    /// The first inner node that a step from `before` to `now` has taken through a fold: its joint turns by more than
    /// a right angle, to the opposite side.
    fn folded_node(&self, before: &[D], now: &[D], (): &()) -> Option<usize> {
        let folded = |member: &Member<D>, a: &[D], b: &[D]| member.rod.folded_node(a, b, &());
        self.find_place([before, now], Member::nodes, folded)
    }

    /// The first edge that turned by more than 45 degrees in a step from `before` to `now`.
    fn over_rotated_edge(&self, before: &[D], now: &[D]) -> Option<usize> {
        let over_rotated =
            |member: &Member<D>, a: &[D], b: &[D]| member.rod.over_rotated_edge(a, b);
        self.find_place([before, now], |member| member.nodes() - 1, over_rotated)
    }

    /// Elastic energies and the potential of the loads; kinetic energy zero.
    fn energies(&self, q: &[D], (): &()) -> Energies {
        let mut sums = Energies::default();
        self.for_each_placed(q, |member, RodUnknowns { q, .. }| {
            let own = member.rod.energies(q, &());
            sums.stretch += own.stretch;
            sums.bend += own.bend;
            sums.potential += own.potential;
        });
        self.bodies.add_energies(&q[self.first..], &mut sums);
        sums
    }

    /// Writes the strains of all elements, in the order `set_viscous` expects.
    fn strains(&self, q: &[D], (): &(), strains: &mut Vec<D>) {
        strains.clear();
        self.for_each_placed(q, |member, RodUnknowns { q, elements, .. }| {
            member.rod.strains(q, &(), elements);
            strains.extend_from_slice(elements);
        });
    }

    /// The rod without loads and natural strains, whose elements act as dashpots: strains stand for strain rates.
    fn dashpots(&self) -> Self {
        let mut assembly = self.clone();
        assembly.members.iter_mut().for_each(|member| member.rod = member.rod.dashpots());
        assembly.bodies = self.bodies.passive();
        assembly
    }

    /// Energies of stretching, bending and twisting by `strains` of all elements, natural ones taken as zero, J.
    fn strain_energies(&self, strains: &[D]) -> [D; 3] {
        let mut sums = [D::from(0.0); 3];
        for (member, range) in self.with_strains() {
            let own = member.rod.strain_energies(&strains[range]);
            (0..3).for_each(|kind| sums[kind] += own[kind]);
        }
        sums
    }

    /// Replaces the elements by those of `elastic` with viscous stress, expressed as stiffnesses and natural strains.
    fn set_viscous(&mut self, elastic: &Self, viscosity: &Viscosity<D>) {
        let mut first = 0;
        for (to, from) in self.members.iter_mut().zip(&elastic.members) {
            to.rod.set_viscous_from(&from.rod, viscosity, first);
            first += from.strains();
        }
    }

    /// Replaces the elements by dashpots with every stiffness times its factor, and the shifts as natural strains.
    fn set_dashpots(&mut self, dashpots: &Self, viscosity: &Viscosity<D>) {
        let mut first = 0;
        for (to, from) in self.members.iter_mut().zip(&dashpots.members) {
            to.rod.set_dashpots_from(&from.rod, viscosity, first);
            first += from.strains();
        }
    }
}

impl<D: Nestable> Assembly<D> {
    /// The rods with the ranges of their strains in the list of all strains.
    fn with_strains(&self) -> impl Iterator<Item = (&Member<D>, Range<usize>)> {
        let mut end = 0;
        self.members.iter().map(move |member| {
            let start = end;
            end += member.strains();
            (member, start..end)
        })
    }
}
