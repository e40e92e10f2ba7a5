//! Assemblies: several planar rods whose ends are carried by [rigid bodies](bodies).
//!
//! Unknowns are those of all rods, one rod after the other, and then the coordinates of the bodies. A joint is a clamp
//! whose pose is unknown: the nodes that a body carries follow from its coordinates, as those at a wall follow from the
//! wall. Their own unknowns have no effect: gradients there are zero, and rows and columns of the tangent are those of the
//! identity. [`Assembly::place_carried`] writes them.

pub mod bodies;
mod members;
mod tangent;

pub use members::{FixedNode, Member};
pub use tangent::{AssemblyFactors, AssemblyTangent};

use crate::energy::Derivatives;
use crate::numerics::envelope::Envelope;
use crate::numerics::scalar::{Nestable, Scalar};
use crate::rod::assembly::bodies::Bodies;
use crate::rod::assembly::members::Room;
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
    room: Room<D>,
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
        Self { members, bodies, first, mass, room: Room::default() }
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
        for member in &self.members {
            member.place(&self.bodies, z, &mut rods[member.range.clone()]);
        }
    }

    /// Writes the velocities of carried nodes that follow from those of the bodies' coordinates; those of fixed nodes are
    /// zero.
    pub fn set_carried_rates(&self, q: &[D], rates: &mut [D]) {
        let (rods, z_rates) = rates.split_at_mut(self.first);
        for member in &self.members {
            let rates = &mut rods[member.range.clone()];
            member.set_rates(&self.bodies, &q[self.first..], z_rates, rates);
        }
    }

    /// Calls `visit` with each rod and its unknowns at `q`, carried nodes included.
    fn for_each_placed(&self, q: &[D], mut visit: impl FnMut(&Member<D>, &[D])) {
        let mut room = self.room.borrow();
        for member in &self.members {
            room.q.clear();
            room.q.extend_from_slice(&q[member.range.clone()]);
            member.place(&self.bodies, &q[self.first..], &mut room.q);
            visit(member, &room.q);
        }
    }

    /// Adds the derivatives by the coordinates of bodies through carried nodes, from the gradient by those nodes, which it
    /// sets to zero.
    fn reduce_gradient(&self, z: &[D], member: &Member<D>, rod: &mut [D], bodies: &mut [D]) {
        for (attachment, node) in member.carried() {
            let carried = self.bodies.carried(z, attachment, node);
            let force = [rod[2 * node.node], rod[2 * node.node + 1]];
            for k in 0..carried.count {
                let slope = carried.slopes[k];
                bodies[carried.coordinates[k]] += slope[0] * force[0] + slope[1] * force[1];
            }
        }
        member.tied().for_each(|i| rod[i] = D::from(0.0));
    }

    /// Adds the second derivatives by the coordinates of bodies through carried nodes, from the band of a rod and its
    /// gradient.
    fn reduce_tangent(
        &self,
        z: &[D],
        member: &Member<D>,
        gradient: &[D],
        own: &mut MemberTangent<D>,
        bodies: &mut Envelope<D>,
    ) {
        use crate::numerics::tangent::Tangent;
        let zero = D::from(0.0);
        for (attachment, coupling) in member.attachments.iter().zip(&mut own.couplings) {
            let Coupling { rows, columns, entries } = coupling;
            entries.fill([zero; ROWS]);
            for node in &attachment.nodes {
                let carried = self.bodies.carried(z, attachment, node);
                let place = 2 * node.node;
                for k in 0..carried.count {
                    let (slope, curvature) = (carried.slopes[k], carried.curvatures[k]);
                    // Between the rows beside the end and the coordinates.
                    for (r, row) in rows.clone().enumerate() {
                        let by = [0, 1].map(|c| own.band.get(row, place + c));
                        entries[k][r] += by[0] * slope[0] + by[1] * slope[1];
                    }
                    // Between coordinates: by curvature of the position, and by pairs of carried nodes.
                    let (i, force) = (columns[k], [gradient[place], gradient[place + 1]]);
                    bodies.add(i, i, force[0] * curvature[0] + force[1] * curvature[1]);
                    for other in &attachment.nodes {
                        let moved = self.bodies.carried(z, attachment, other);
                        for (l, j) in columns.iter().enumerate() {
                            if *j > i {
                                continue;
                            }
                            let mut sum = zero;
                            for c in 0..2 {
                                for d in 0..2 {
                                    let entry = own.band.get(place + c, 2 * other.node + d);
                                    sum += slope[c] * entry * moved.slopes[l][d];
                                }
                            }
                            bodies.add(i, *j, sum);
                        }
                    }
                }
            }
        }
        member.tied().for_each(|i| own.band.uncouple(i));
    }
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

    fn mass(&self) -> &[D] {
        &self.mass
    }

    fn gradient(&self, q: &[D], (): &(), derivatives: Derivatives, gradient: &mut [D]) {
        let (z, (rods, bodies)) = (&q[self.first..], gradient.split_at_mut(self.first));
        self.bodies.gradient(z, bodies);
        self.for_each_placed(q, |member, q| {
            let own = &mut rods[member.range.clone()];
            member.rod.gradient(q, &(), derivatives, own);
            self.reduce_gradient(z, member, own, bodies);
        });
    }

    fn tangent(
        &self,
        q: &[D],
        (): &(),
        derivatives: Derivatives,
        gradient: &mut [D],
        tangent: &mut AssemblyTangent<D>,
    ) {
        self.tangent_under(q, &(), derivatives, None, (gradient, tangent));
    }

    fn tangent_under(
        &self,
        q: &[D],
        (): &(),
        derivatives: Derivatives,
        tensions: Option<&[D]>,
        (gradient, tangent): (&mut [D], &mut AssemblyTangent<D>),
    ) {
        let (z, (rods, bodies)) = (&q[self.first..], gradient.split_at_mut(self.first));
        let AssemblyTangent { members, bodies: corner } = tangent;
        self.bodies.gradient(z, bodies);
        corner.clear();
        self.bodies.add_tangent(|i, j, entry| corner.add(i, j, entry));
        let (mut members, mut edges) = (members.iter_mut(), 0);
        self.for_each_placed(q, |member, q| {
            let Some(own) = members.next() else { return };
            let forces = &mut rods[member.range.clone()];
            let count = member.rod.stretch.len();
            let tensions = tensions.map(|all| &all[edges..edges + count]);
            edges += count;
            member.rod.tangent_under(q, &(), derivatives, tensions, (forces, &mut own.band));
            self.reduce_tangent(z, member, forces, own, corner);
            self.reduce_gradient(z, member, forces, bodies);
        });
    }

    fn tensions_after(&self, change: &[D], q: &[D], tensions: &mut Vec<D>) {
        tensions.clear();
        let (mut moved, mut own) = (Vec::new(), Vec::new());
        self.for_each_placed(q, |member, q_member| {
            moved.clear();
            moved.extend_from_slice(&change[member.range.clone()]);
            member.set_rates(&self.bodies, &q[self.first..], &change[self.first..], &mut moved);
            member.rod.tensions_after(&moved, q_member, &mut own);
            tensions.extend_from_slice(&own);
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

    fn folded(&self, before: &[D], now: &[D], (): &()) -> Option<usize> {
        let (mut found, mut nodes, mut start) = (None, 0, Vec::new());
        self.for_each_placed(now, |member, now| {
            start.clear();
            start.extend_from_slice(&before[member.range.clone()]);
            member.place(&self.bodies, &before[self.first..], &mut start);
            found = found.or(member.rod.folded(&start, now, &()).map(|node| nodes + node));
            nodes += member.nodes();
        });
        found
    }

    fn leapt(&self, before: &[D], now: &[D]) -> Option<usize> {
        let (mut found, mut edges, mut start) = (None, 0, Vec::new());
        self.for_each_placed(now, |member, now| {
            start.clear();
            start.extend_from_slice(&before[member.range.clone()]);
            member.place(&self.bodies, &before[self.first..], &mut start);
            found = found.or(member.rod.leapt(&start, now).map(|edge| edges + edge));
            edges += member.nodes() - 1;
        });
        found
    }

    fn energies(&self, q: &[D], (): &()) -> Energies {
        let mut sums = Energies::default();
        self.for_each_placed(q, |member, q| {
            let own = member.rod.energies(q, &());
            sums.stretch += own.stretch;
            sums.bend += own.bend;
            sums.potential += own.potential;
        });
        self.bodies.add_energies(&q[self.first..], &mut sums);
        sums
    }

    fn strains(&self, q: &[D], (): &(), strains: &mut Vec<D>) {
        let mut own = Vec::new();
        strains.clear();
        self.for_each_placed(q, |member, q| {
            member.rod.strains(q, &(), &mut own);
            strains.extend_from_slice(&own);
        });
    }

    fn dashpots(&self) -> Self {
        let mut assembly = self.clone();
        assembly.members.iter_mut().for_each(|member| member.rod = member.rod.dashpots());
        assembly.bodies = self.bodies.passive();
        assembly
    }

    fn strain_energies(&self, strains: &[D]) -> [D; 3] {
        let mut sums = [D::from(0.0); 3];
        for (member, range) in self.with_strains() {
            let own = member.rod.strain_energies(&strains[range]);
            (0..3).for_each(|kind| sums[kind] += own[kind]);
        }
        sums
    }

    fn set_viscous(&mut self, elastic: &Self, viscosity: &Viscosity<D>) {
        let mut first = 0;
        for (to, from) in self.members.iter_mut().zip(&elastic.members) {
            to.rod.set_viscous_from(&from.rod, viscosity, first);
            first += from.strains();
        }
    }

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
