//! Element for stretching of one edge, in the plane or in space: the simplest element, and the one to read first.
//!
//! Energy (Eq. 1a): `E = 1/2 EA (eps - eps_natural)^2 l`, with rest length `l` and strain `eps = |e|/l - 1` of the edge vector
//! `e`. The strain is computed as `(e.e - l^2) / (l (|e| + l))`, which loses no digits when the edge is nearly at rest.
//! With the force `F = EA (eps - eps_natural)` and the tangent `t`: `dE/de = F t`, `d2E/de2 = (K/l - F/|e|) t t' + F/|e| I`,
//! where `K = dF/deps` is EA. A law that is not linear in the strain adds its [`NonlinearPart`] to energy, `F` and `K`.

use crate::energy::law::{Law, NonlinearPart};
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
    /// Strain at which the edge is free of stress; not zero in viscous steps only.
    pub natural_strain: D,
    /// The part of a law that is not linear in the strain.
    pub nonlinear: Option<NonlinearPart<D>>,
}

/// The edge vector from the first node of `q` to the second, m; `N = 2 M`.
#[inline]
fn edge<D: Scalar, const N: usize, const M: usize>(q: &[D; N]) -> [D; M] {
    components(|i| q[M + i] - q[i])
}

/// Gradient by the two nodes from the gradient `g` by the edge vector.
#[inline]
fn to_nodes<D: Scalar, const N: usize, const M: usize>(g: [D; M]) -> [D; N] {
    components(|i| if i < M { -g[i] } else { g[i - M] })
}

impl<D: Scalar, const M: usize> Stretch<D, M> {
    /// An edge without stiffness, with the rest length 1 m and a linear law, as padding of SIMD lanes.
    pub(crate) fn none() -> Self {
        let (zero, one) = (D::from(0.0), D::from(1.0));
        Self { stiffness: zero, rest_length: one, natural_strain: zero, nonlinear: None }
    }

    /// The edges `all` as one edge in SIMD lanes: lane `k` has the numbers of edge `k`. All have the kind of law of the
    /// first one; edges without a nonlinear part get the modulus zero. Panics for fewer edges than lanes.
    #[inline(always)]
    pub(crate) fn side_by_side<V: SimdScalar<D>>(level: V::Level, all: &[Self]) -> Stretch<V, M> {
        Stretch {
            stiffness: V::gather(level, |lane| all[lane].stiffness),
            rest_length: V::gather(level, |lane| all[lane].rest_length),
            natural_strain: V::gather(level, |lane| all[lane].natural_strain),
            nonlinear: NonlinearPart::side_by_side(level, all[0].nonlinear.as_ref(), |lane| {
                all[lane].nonlinear
            }),
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
    /// m: `EA (eps - eps_natural)`, plus the part of a nonlinear law.
    #[inline(always)]
    pub fn force(&self, squared: D, length: D) -> D {
        self.stress(&[self.strain_of(squared, length)])[0]
    }

    /// `[force, stiffness]` at the squared length, m^2, and the length, m: the axial force, N, and its derivative by
    /// the length, `(EA + C dx/ds)/l` with the nonlinear part, N/m.
    #[inline(always)]
    pub(crate) fn tension(&self, squared: D, length: D) -> [D; 2] {
        let ([stiffness], [force]) = self.response(&[self.strain_of(squared, length)]);
        [force, stiffness / self.rest_length]
    }

    /// The axial force, N, to first order in the change of an edge from `e` to `now`, m: at the strain `t.now/l - 1` with the
    /// tangent `t` of `e`.
    #[inline(always)]
    pub(crate) fn tension_after(&self, e: &[D; M], now: &[D; M]) -> D {
        let along = e.iter().zip(now).fold(D::from(0.0), |sum, (e, now)| sum + *e * *now);
        self.stress(&[along / (squared(e).sqrt() * self.rest_length) - 1.0])[0]
    }

    /// The change of the Hessian by the edge `e`, m, where `tension`, N, replaces its axial force in the geometric
    /// stiffness: `(T - F)/|e| (I - t t')`.
    #[inline]
    pub(crate) fn under(&self, e: &[D; M], tension: D) -> [[D; M]; M] {
        let squared = squared(e);
        let length = squared.sqrt();
        let across = (tension - self.force(squared, length)) / length;
        let over = across / squared;
        let mut gain = [[across; M]; M];
        for r in 0..M {
            for c in 0..M {
                let along = over * e[r] * e[c];
                gain[r][c] = if r == c { across - along } else { -along };
            }
        }
        gain
    }

    /// The energy `1/2 EA (eps - eps_natural)^2 l`, plus that of the nonlinear part of the law, J, at a squared length,
    /// m^2, and the length, m.
    #[inline(always)]
    pub(crate) fn energy_at(&self, squared: D, length: D) -> D {
        let strain = self.strain_of(squared, length);
        let linear = self.energies(&self.difference(&[strain]))[0];
        match self.nonlinear {
            None => linear,
            Some(nonlinear) => linear + nonlinear.energy(strain) * self.rest_length,
        }
    }

    /// The same edge without the nonlinear part of its law.
    pub(crate) fn linear(self) -> Self {
        Self { nonlinear: None, ..self }
    }

    /// The strain `|e|/l - 1` of an edge from its squared length, m^2, and its length, m, as `(|e|^2 - l^2)/(l (|e| +
    /// l))` without cancellation.
    #[inline(always)]
    pub(crate) fn strain_of(&self, squared: D, length: D) -> D {
        let rest = self.rest_length;
        (squared - rest * rest) / (rest * (length + rest))
    }

    /// The energy, J, of an edge vector `e`, m, with that of the nonlinear part of the law.
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
        let (force, inverse_length) = (self.force(squared, length), length.recip());
        map_components(&e, |x| force * (x * inverse_length))
    }

    /// Energy, gradient and full Hessian by the coordinates of both nodes, from `d2E/de2 = (K/l - F/|e|) t t' + F/|e| I` by the
    /// edge vector `e`, with the force `F`, its derivative `K` by the strain and the tangent `t`.
    #[inline]
    fn tangent_of<const N: usize>(&self, e: [D; M]) -> Local<D, N> {
        let squared = squared(&e);
        let length = squared.sqrt();
        let inverse_length = length.recip();
        let tangent = map_components(&e, |x| x * inverse_length);
        let [force, stiffness] = self.tension(squared, length);
        let across = force * inverse_length;
        let along = stiffness - across;
        // The Hessian by the edge vector, with signs + and - for both nodes.
        let mut hessian = [[across; N]; N];
        for r in 0..M {
            for c in 0..=r {
                let entry = along * tangent[c] * tangent[r];
                let entry = if r == c { entry + across } else { entry };
                for (r, c) in [(r, c), (c, r)] {
                    (hessian[r][c], hessian[M + r][M + c]) = (entry, entry);
                    (hessian[r][M + c], hessian[M + r][c]) = (-entry, -entry);
                }
            }
        }
        let gradient = to_nodes(map_components(&tangent, |t| force * t));
        Local { energy: self.energy_at(squared, length), gradient, hessian }
    }
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

    /// The edge with another stiffness, N, and another natural strain; the nonlinear part of its law stays.
    #[inline(always)]
    fn with(&self, [stiffness]: [D; 1], [natural_strain]: [D; 1]) -> Self {
        Self { stiffness, natural_strain, ..*self }
    }

    /// Replaces the stiffness and the natural strain, and nothing else of the edge.
    #[inline(always)]
    fn set(&mut self, [stiffness]: [D; 1], [natural_strain]: [D; 1]) {
        (self.stiffness, self.natural_strain) = (stiffness, natural_strain);
    }

    /// For a nonlinear law, the derivative by the strain and the value of the force beyond the linear law, N; `None`
    /// for a linear one.
    #[inline(always)]
    fn nonlinear_part(&self, [strain]: &[D; 1]) -> Option<([D; 1], [D; 1])> {
        // A copy: the call out of line takes an address, and the numbers of the edge stay in registers.
        let nonlinear = self.nonlinear?;
        let [slope, force] = nonlinear.response(*strain);
        Some(([slope], [force]))
    }

    /// Energies of stretching, bending (zero) and twisting (zero) of the linear law, J, at the difference of the strain from
    /// the natural one.
    #[inline(always)]
    fn energies(&self, [strain]: &[D; 1]) -> [D; 3] {
        let zero = strain.like(0.0);
        [self.stiffness * self.rest_length * *strain * *strain * 0.5, zero, zero]
    }
}

/// The squared length of the vector `e`, m^2.
#[inline]
fn squared<D: Scalar, const M: usize>(e: &[D; M]) -> D {
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
                    nonlinear: self.nonlinear.as_ref().map(|nonlinear| nonlinear.map(&convert)),
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
