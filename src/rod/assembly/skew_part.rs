//! What a bordered matrix that is not symmetric has beside its symmetric storage: [`SkewPart`].
//!
//! The matrix stores the entries of bodies below the diagonal, and those of couplings in the rows of the rods. The
//! entries at the transposed places are the sums of these and of the differences here. In the bands of the rods the
//! matrix has such differences itself. Steps with damping or friction of contacts have them; they are allocated by
//! the first one. Each rod also has two bands as work space for the derivatives of these forces. `allocate` makes
//! the lists, `activate` sets them to zero for a matrix, `clear` makes that symmetric, and `active` are the
//! differences of a matrix that is not.

use crate::numerics::envelope::Envelope;
use crate::numerics::scalar::Scalar;
use crate::rod::assembly::coupling::Coupling;

/// The part of a rod.
#[derive(Clone, Debug)]
pub struct MemberSkewPart<D, T> {
    /// Entries in the rows of the bodies less those in the rows of the rod, in the order of its couplings.
    pub couplings: Vec<Coupling<D>>,
    /// Work space: derivatives of the forces with velocities that follow the unknowns, and at constant velocities.
    pub bands: [T; 2],
}

/// Differences between the entries of a bordered matrix at transposed places.
#[derive(Clone, Debug)]
pub struct SkewPart<D, T> {
    /// Whether the matrix has them.
    is_active: bool,
    /// One per rod.
    pub members: Vec<MemberSkewPart<D, T>>,
    /// Below the diagonal: entries above it at the transposed place less those below.
    pub bodies: Envelope<D>,
}

impl<D: Scalar, T: Clone> SkewPart<D, T> {
    /// That of a symmetric matrix, without allocated lists.
    pub fn none() -> Self {
        Self { is_active: false, members: Vec::new(), bodies: Envelope::zeros(Vec::new()) }
    }

    /// Allocates the lists for rods with these bands and couplings, and for the matrix of the `bodies`. Nothing happens
    /// where they are allocated.
    pub fn allocate<'a>(
        &mut self,
        bands: impl Iterator<Item = &'a T>,
        couplings: impl Iterator<Item = &'a Vec<Coupling<D>>>,
        bodies: &Envelope<D>,
    ) where
        D: 'a,
        T: 'a,
    {
        if !self.members.is_empty() {
            return;
        }
        self.members.extend(bands.zip(couplings).map(|(band, couplings)| MemberSkewPart {
            couplings: couplings.clone(),
            bands: [band.clone(), band.clone()],
        }));
        self.bodies.clone_from(bodies);
    }

    /// Sets the allocated differences of a symmetric matrix to zero, and makes it one that has them.
    pub fn activate(&mut self) {
        if !self.is_active {
            self.is_active = true;
            self.bodies.clear();
            let couplings = self.members.iter_mut().flat_map(|member| &mut member.couplings);
            couplings.for_each(|coupling| coupling.entries.fill(D::from(0.0)));
        }
    }

    /// The differences; `None` of a symmetric matrix.
    pub fn active(&self) -> Option<&Self> {
        self.is_active.then_some(self)
    }

    /// The differences, mutable; `None` of a symmetric matrix.
    pub fn active_mut(&mut self) -> Option<&mut Self> {
        self.is_active.then_some(self)
    }

    /// Makes the matrix symmetric. The lists stay allocated.
    pub fn clear(&mut self) {
        self.is_active = false;
    }

    /// Adds the products of the differences of bodies and couplings with the parts `rods` and `bodies` of `G` vectors
    /// to `out`, the rows of the bodies. `starts` are the first unknowns of the rods. Nothing for a symmetric matrix.
    pub fn add_product<const G: usize>(
        &self,
        starts: impl Iterator<Item = usize>,
        [rods, bodies]: [&[[D; G]]; 2],
        out: &mut [[D; G]],
    ) {
        let Some(Self { members, bodies: differences, .. }) = self.active() else { return };
        for (member, start) in members.iter().zip(starts) {
            for coupling in &member.couplings {
                let own = &rods[start + coupling.rows.start..];
                for (body, entries) in coupling.iter() {
                    for (entry, x) in entries.iter().zip(own) {
                        (0..G).for_each(|g| out[body][g] += *entry * x[g]);
                    }
                }
            }
        }
        differences.for_each(|i, j, entry| {
            if j < i {
                (0..G).for_each(|g| out[j][g] += entry * bodies[i][g]);
            }
        });
    }
}
