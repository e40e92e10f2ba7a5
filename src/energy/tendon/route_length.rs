//! First and second derivatives of the length of a part of a tendon by the strains of its element.
//!
//! Input: the numbers of a [`RoutePart`], the mean length `l` of the edges of the element (m), the curvatures and the
//! twist of [`tendon`](crate::energy::tendon). Output of [`RouteLength`]: the derivatives of the length of the
//! part, derived by hand. With the vector `v = (a, f, s)` of the part and `n = v/|v|` they are `n . dv/dx` and
//! `(dv/dx . dv/dy - (n . dv/dx)(n . dv/dy))/|v|`, because `v` is linear in its arguments. The differences are written
//! as sums of squares.

use crate::energy::law::Stiffness;
use crate::energy::tendon::RoutePart;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{dot, scale};

/// Derivatives of the length of a part of a route by the mean length `l` of its edges and by the twist `t`. Those by
/// each curvature are those by `l` times minus the offset towards its director.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RouteLength<D> {
    /// By `l`.
    pub by_length: D,
    /// By `l` twice, 1/m.
    pub by_length_twice: D,
    /// By the twist, m.
    by_twist: D,
    /// By `l` and the twist.
    by_length_and_twist: D,
    /// By the twist twice, m.
    by_twist_twice: D,
    /// The twist.
    twist: D,
    /// Offsets towards both directors, m.
    offset: [D; 2],
}

impl<D: Scalar> RouteLength<D> {
    /// The derivatives of the length of a part at the mean `length` of the edges, m, both integrated curvatures, and
    /// the twist.
    #[inline]
    pub fn new(part: &RoutePart<D>, length: D, curvature: [D; 2], twist: D) -> Self {
        let RoutePart { weight, offset: [r1, r2], .. } = *part;
        let vector = part.vector(length, curvature, twist);
        let length = dot(vector, vector).sqrt();
        let inverse = length.recip();
        let [along, first, second] = scale(vector, inverse);
        let (towards, across) = (first * r1 + second * r2, second * r1 - first * r2);
        let (by_length, by_twist) = (weight * along, weight * across);
        // 1 - along^2, and |r|^2 - across^2.
        let square = weight * weight * inverse;
        let beside = first * first + second * second;
        let turned = along * along * (r1 * r1 + r2 * r2) + towards * towards;
        Self {
            by_length,
            by_length_twice: square * beside,
            by_twist,
            by_length_and_twist: -(by_length * by_twist * inverse),
            by_twist_twice: square * turned,
            twist,
            offset: [r1, r2],
        }
    }

    /// First derivatives by both curvatures, m, and by the angle `tau` of the twist `2 tan(tau/2)`, m/rad.
    #[inline]
    pub fn by_strains(&self) -> [D; 3] {
        let [r1, r2] = self.offset;
        [-(self.by_length * r1), -(self.by_length * r2), self.by_twist * self.slope()]
    }

    /// Derivatives by `l` and by each of the strains of [`by_strains`](Self::by_strains).
    #[inline]
    pub fn by_length_and_strains(&self) -> [D; 3] {
        let [r1, r2] = self.offset;
        let own = self.by_length_twice;
        [-(own * r1), -(own * r2), self.by_length_and_twist * self.slope()]
    }

    /// Second derivatives by the strains of [`by_strains`](Self::by_strains), m, times `factor`.
    #[inline]
    pub fn by_strains_twice(&self, factor: D) -> Stiffness<D> {
        let ([r1, r2], slope) = (self.offset, self.slope());
        let (own, mixed) =
            (self.by_length_twice * factor, self.by_length_and_twist * slope * factor);
        // The second derivative of 2 tan(tau/2) is half of it times the first one.
        let bow = self.by_twist * self.twist * 0.5;
        Stiffness {
            bend: [own * r1 * r1, own * r1 * r2, own * r2 * r2],
            twist: (self.by_twist_twice * slope + bow) * slope * factor,
            coupling: [-(mixed * r1), -(mixed * r2)],
        }
    }

    /// The derivative `1 + t^2/4` of the twist `t = 2 tan(tau/2)` by its angle.
    #[inline]
    fn slope(&self) -> D {
        let half = self.twist * 0.5;
        half * half + 1.0
    }
}
