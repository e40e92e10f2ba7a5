//! Element for stretching of one edge, in the plane or in space: the simplest element, and the one to read first.
//!
//! Energy (Eq. 1a): `E = 1/2 EA (eps - eps_natural)^2 l`, with rest length `l` and strain `eps = |e|/l - 1` of the edge
//! vector `e`. The strain is computed as `(e.e - l^2) / (l (|e| + l))`, which loses no digits when the edge is nearly
//! at rest. With the force `F = EA (eps - eps_natural)` and the tangent `t`: `dE/de = F t`,
//! `d2E/de2 = (K/l - F/|e|) t t' + F/|e| I`, where `K = dF/deps` is EA. Input: EA, N, rest length, m, natural strain,
//! and the coordinates of both nodes, m; output: energy, J, gradient, N, and full Hessian, N/m. The part of a law that
//! is not linear in the strain is added by [`HyperelasticStretch`](crate::energy::HyperelasticStretch).
//!
//! `edge` is the edge vector of two nodes, `strain` the strain of an edge vector, and `force` the axial force, positive
//! in tension. `strain_of`, `energy_at` and `tension` (`[F, dF/d|e|]`, N and N/m) take the squared length and the
//! length of an edge. `strain_after` is the strain to first order in the change of the edge. For a given axial force
//! `along` is the force vector, `axial_hessian` the Hessian by the edge vector, and `axial_tangent` gradient and
//! Hessian by both nodes. `to_nodes` turns the gradient by the edge vector into that by both nodes. `none` and
//! `pack_lanes` serve SIMD lanes of several edges.

use crate::energy::law::Law;
use crate::energy::{Element, Local};
use crate::numerics::scalar::{Scalar, SimdScalar};
use crate::numerics::vector::{components, map_components};

/// One edge of `M` components. Unknowns, m: `[x0, y0, x1, y1]` in the plane, `[x0, y0, z0, x1, y1, z1]` in space.
#[derive(Clone, Copy, Debug)]
pub struct Stretch<D, const M: usize> {
    /// Axial stiffness EA, N.
    pub stiffness: D,
    /// Rest length, m.
    pub rest_length: D,
    /// Strain at which the edge is free of stress; not zero with actuators of the stretch and in viscous steps only.
    pub natural_strain: D,
}

/// The edge vector from the first node of `q` to the second, m; `N = 2 M`.
#[inline]
pub(crate) fn edge<D: Scalar, const N: usize, const M: usize>(q: &[D; N]) -> [D; M] {
    components(|i| q[M + i] - q[i])
}

/// Gradient by the coordinates of both nodes from the gradient `g` by the edge vector: `-g` for the first node, `g` for
/// the second.
#[inline]
pub(crate) fn to_nodes<D: Scalar, const N: usize, const M: usize>(g: [D; M]) -> [D; N] {
    components(|i| if i < M { -g[i] } else { g[i - M] })
}

impl<D: Scalar, const M: usize> Stretch<D, M> {
    /// An edge without stiffness, with the rest length 1 m, as padding of SIMD lanes.
    pub(crate) fn none() -> Self {
        let (zero, one) = (D::from(0.0), D::from(1.0));
        Self { stiffness: zero, rest_length: one, natural_strain: zero }
    }

    /// The edges `all` as one edge in SIMD lanes: lane `k` has the numbers of edge `k`. Panics for fewer edges than
    /// lanes.
    #[inline(always)]
    pub(crate) fn pack_lanes<V: SimdScalar<D>>(level: V::Level, all: &[Self]) -> Stretch<V, M> {
        Stretch {
            stiffness: V::gather(level, |lane| all[lane].stiffness),
            rest_length: V::gather(level, |lane| all[lane].rest_length),
            natural_strain: V::gather(level, |lane| all[lane].natural_strain),
        }
    }

    /// Strain `|e|/l - 1`, dimensionless, of the edge vector `e`, m, with the rest length `l`; the natural strain is
    /// not subtracted.
    #[inline]
    pub fn strain(&self, e: &[D; M]) -> D {
        let squared = squared(e);
        self.strain_of(squared, squared.sqrt())
    }

    /// Axial force, N, positive in tension, of an edge with the squared length `squared`, m^2, and the length `length`,
    /// m: `EA (eps - eps_natural)`.
    #[inline(always)]
    pub fn force(&self, squared: D, length: D) -> D {
        self.stress(&[self.strain_of(squared, length)])[0]
    }

    /// `[force, stiffness]` at the squared length, m^2, and the length, m: the axial force, N, and its derivative by
    /// the length, `EA/l`, N/m.
    #[inline(always)]
    pub(crate) fn tension(&self, squared: D, length: D) -> [D; 2] {
        [self.force(squared, length), self.stiffness / self.rest_length]
    }

    /// The strain, to first order in the change of an edge from `e` to `now`, m: `t.now/l - 1` with the tangent `t` of
    /// `e`.
    #[inline(always)]
    pub(crate) fn strain_after(&self, e: &[D; M], now: &[D; M]) -> D {
        let along = e.iter().zip(now).fold(D::from(0.0), |sum, (e, now)| sum + *e * *now);
        along / (squared(e).sqrt() * self.rest_length) - 1.0
    }

    /// The energy `1/2 EA (eps - eps_natural)^2 l`, J, at a squared length, m^2, and the length, m.
    #[inline(always)]
    pub(crate) fn energy_at(&self, squared: D, length: D) -> D {
        self.energies(&self.difference(&[self.strain_of(squared, length)]))[0]
    }

    /// The strain `|e|/l - 1` of an edge from its squared length, m^2, and its length, m, as `(|e|^2 - l^2)/(l (|e| +
    /// l))` without cancellation.
    #[inline(always)]
    pub(crate) fn strain_of(&self, squared: D, length: D) -> D {
        // The difference of squares keeps digits that a difference of lengths would lose.
        let rest = self.rest_length;
        (squared - rest * rest) / (rest * (length + rest))
    }

    /// The energy, J, of an edge vector `e`, m.
    #[inline]
    fn energy_of(&self, e: [D; M]) -> D {
        let squared = squared(&e);
        self.energy_at(squared, squared.sqrt())
    }

    /// Gradient dE/de = F t by the edge vector `e`, N: the axial force `F` acts along the tangent `t`.
    #[inline]
    fn gradient_of(&self, e: [D; M]) -> [D; M] {
        let squared = squared(&e);
        let length = squared.sqrt();
        along(&e, length, self.force(squared, length))
    }

    /// Energy, J, gradient, N, and full Hessian, N/m, by the coordinates of both nodes, of an edge vector `e`, m.
    #[inline]
    fn tangent_of<const N: usize>(&self, e: [D; M]) -> Local<D, N> {
        let squared = squared(&e);
        let length = squared.sqrt();
        let [force, stiffness] = self.tension(squared, length);
        axial_tangent(&e, length, self.energy_at(squared, length), [force, stiffness])
    }
}

/// The axial `force`, N, as a vector along the edge vector `e` of the given `length`, m.
#[inline]
pub(crate) fn along<D: Scalar, const M: usize>(e: &[D; M], length: D, force: D) -> [D; M] {
    let inverse_length = length.recip();
    map_components(e, |x| force * (x * inverse_length))
}

/// The Hessian by the edge vector `e`, N/m, of the given `length`, m: `(K - F/|e|) t t' + F/|e| I`, with the axial
/// force `F`, N, its derivative `K` by the length, N/m, and the tangent `t`.
#[inline]
pub(crate) fn axial_hessian<D: Scalar, const M: usize>(
    e: &[D; M],
    length: D,
    [force, stiffness]: [D; 2],
) -> [[D; M]; M] {
    let inverse_length = length.recip();
    let tangent = map_components(e, |x| x * inverse_length);
    let across = force * inverse_length;
    let along = stiffness - across;
    let mut hessian = [[across; M]; M];
    for r in 0..M {
        for c in 0..=r {
            let entry = along * tangent[c] * tangent[r];
            let entry = if r == c { entry + across } else { entry };
            (hessian[r][c], hessian[c][r]) = (entry, entry);
        }
    }
    hessian
}

/// The given `energy`, J, with its gradient, N, and full Hessian, N/m, by the coordinates of both nodes, of an edge
/// vector `e` of the given `length`, m. They follow from the axial `force`, N, and its derivative by the length,
/// `stiffness`, N/m.
#[inline]
pub(crate) fn axial_tangent<D: Scalar, const M: usize, const N: usize>(
    e: &[D; M],
    length: D,
    energy: D,
    [force, stiffness]: [D; 2],
) -> Local<D, N> {
    let block = axial_hessian(e, length, [force, stiffness]);
    // Signs + and - for both nodes.
    let mut hessian = [[energy; N]; N];
    for r in 0..M {
        for c in 0..M {
            let entry = block[r][c];
            (hessian[r][c], hessian[M + r][M + c]) = (entry, entry);
            (hessian[r][M + c], hessian[M + r][c]) = (-entry, -entry);
        }
    }
    Local { energy, gradient: to_nodes(along(e, length, force)), hessian }
}

impl<D: Scalar, const M: usize> Law<D, 1> for Stretch<D, M> {
    type Stiffness = [D; 1];

    const KINDS: [usize; 1] = [0];

    /// The axial stiffness EA, N.
    #[inline(always)]
    fn stiffness(&self) -> [D; 1] {
        [self.stiffness]
    }

    /// The natural strain, at which there is no stress.
    #[inline(always)]
    fn natural(&self) -> [D; 1] {
        [self.natural_strain]
    }

    /// The edge with another stiffness, N, and another natural strain.
    #[inline(always)]
    fn with(&self, [stiffness]: [D; 1], [natural_strain]: [D; 1]) -> Self {
        Self { stiffness, natural_strain, ..*self }
    }

    /// Replaces the stiffness and the natural strain, and nothing else of the edge.
    #[inline(always)]
    fn set(&mut self, [stiffness]: [D; 1], [natural_strain]: [D; 1]) {
        (self.stiffness, self.natural_strain) = (stiffness, natural_strain);
    }

    /// Energies of stretching, bending (zero) and twisting (zero), J, at the difference of the strain from the
    /// natural one.
    #[inline(always)]
    fn energies(&self, [strain]: &[D; 1]) -> [D; 3] {
        let zero = strain.like(0.0);
        [self.stiffness * self.rest_length * *strain * *strain * 0.5, zero, zero]
    }
}

/// The squared length of the vector `e`, m^2.
#[inline]
pub(crate) fn squared<D: Scalar, const M: usize>(e: &[D; M]) -> D {
    let mut sum = e[0] * e[0];
    for x in &e[1..] {
        sum += *x * *x;
    }
    sum
}

/// The element in the plane and in space: the same formulas on edges of two and three components.
macro_rules! element {
    ($n:literal, $m:literal) => {
        impl<D: Scalar> Element<D, $n> for Stretch<D, $m> {
            const NAME: &'static str = "stretch";
            type Over<E: Scalar> = Stretch<E, $m>;

            /// The element with every parameter converted to another number type.
            fn map<E: Scalar>(&self, convert: impl Fn(D) -> E) -> Stretch<E, $m> {
                Stretch {
                    stiffness: convert(self.stiffness),
                    rest_length: convert(self.rest_length),
                    natural_strain: convert(self.natural_strain),
                }
            }
            /// The energy, J, at the coordinates `q` of both nodes, m.
            #[inline]
            fn energy(&self, q: &[D; $n]) -> D {
                self.energy_of(edge(q))
            }
            /// dE/dq at the coordinates `q` of both nodes, derived by hand, N.
            #[inline]
            fn gradient(&self, q: &[D; $n]) -> [D; $n] {
                to_nodes(self.gradient_of(edge(q)))
            }
            /// E, J, dE/dq, N, and the full matrix d2E/dq2, N/m, at the coordinates `q` of both nodes, derived by hand.
            #[inline]
            fn tangent(&self, q: &[D; $n]) -> Local<D, $n> {
                self.tangent_of(edge(q))
            }
        }
    };
}

element!(4, 2);
element!(6, 3);
