//! Cross-sections of the rod, with their areas, second moments, torsion constants and shear coefficients.
//!
//! Kinds are circle, tube (outer radius, wall thickness), rectangle (width, height) and custom sections; sizes in m.
//! `up` orients rectangles and custom sections by its component normal to the first edge.
//!
//! [`Section::moments`] returns area, m^2, second moments in the plane of `up` and across it, m^4, and torsion
//! constant, m^4, over any number type. The torsion constant of a rectangle is Saint-Venant's series; a custom section
//! gives all of these numbers. `shear_coefficient` is Timoshenko's kappa by Cowper (1966), for custom sections that of
//! a rectangle; `shear_flexibility` is the ratio `E/(kappa G)` of vibrating rods. `radius_of_gyration` is `sqrt(I/A)`
//! with the larger second moment, m.
//!
//! `check` rejects sizes that are not positive and a wall thicker than the radius, `check_up` a direction `up` along
//! the first edge.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, cross, dot, scale, sub, unit};
use crate::scene::number::{Candidates, Quantity};
use crate::scene::table::{NumberTree, TABLE, table};
use crate::scene::validate::direction;
use std::f64::consts::PI;

/// Quantity of a radius, thickness, width or height, m; a search covers 1e-4 to 0.1 of the rod length.
const SIZE: Quantity = Quantity::positive("m").searched(Candidates::OfLength(1e-4, 0.1, 2.0));
/// Quantity of a second moment of area, or torsion constant, m^4.
const SECOND_MOMENT: Quantity = Quantity::positive("m^4");

/// Squared sine of the angle between `up` and the first edge below which both are parallel.
const PARALLEL: f64 = 1e-18;

/// Number of terms of Saint-Venant's series of a rectangle, which decrease like n^-5.
const SERIES_TERMS: u32 = 200;

table! {
    /// Cross-section of the rod.
    pub enum Section {
        /// A full circle.
        Circle {
            /// Radius, m.
            radius: D = SIZE,
        },
        /// A circle with a round hole in its middle.
        Tube {
            /// Outer radius, m.
            radius: D = SIZE,
            /// Wall thickness, m; at most the radius.
            thickness: D = SIZE,
        },
        /// A rectangle, `height` along `up`.
        Rectangle {
            /// Width across `up`, m.
            width: D = SIZE,
            /// Height along `up`, m.
            height: D = SIZE,
            /// Direction of the height; its component across the first edge counts.
            #[serde(deserialize_with = "crate::input::arrays::numbers")]
            up: [D; 3] = Quantity::signed(""),
        },
        /// Any section, by its area, second moments and torsion constant.
        Custom {
            /// Area of the section, m^2.
            area: D = Quantity::positive("m^2"),
            /// Second moment that resists bending in the plane of `up`, m^4.
            i1: D = SECOND_MOMENT,
            /// Second moment that resists bending across `up`, m^4.
            i2: D = SECOND_MOMENT,
            /// Torsion constant, m^4.
            j: D = SECOND_MOMENT,
            /// Direction of the height; its component across the first edge counts.
            #[serde(deserialize_with = "crate::input::arrays::numbers")]
            up: [D; 3] = Quantity::signed(""),
        },
    }
}

impl Section {
    /// Rejects sizes, areas and moments that are not positive and finite, a wall thicker than the radius, and a
    /// direction `up` of no length.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.check_numbers("rod.section", TABLE)?;
        match self {
            Self::Tube { radius, thickness } if thickness > radius => {
                let allowed = format!("up to the radius, {radius:.4e} m");
                Err(Error::invalid("rod.section.thickness", thickness, allowed))
            }
            _ => self.up().map_or(Ok(()), |up| direction("rod.section.up", &up)),
        }
    }

    /// Rejects a direction `up` parallel to the first edge of the `nodes`, m, which does not determine the orientation
    /// of the section. `Ok` for a circle or a tube.
    pub(crate) fn check_up(&self, nodes: &[Vector<f64>]) -> Result<(), Error> {
        let Some(up) = self.up() else { return Ok(()) };
        let first_edge = unit(sub(nodes[1], nodes[0]));
        let across = cross(first_edge, up);
        if dot(across, across) > PARALLEL * dot(up, up) {
            return Ok(());
        }
        let found = "a direction along the first edge";
        Err(Error::invalid(
            "rod.section.up",
            found,
            "a direction with a component normal to the \
                            first edge",
        ))
    }

    /// Largest radius of gyration about an axis in the section, m: `sqrt(I/A)` with the larger second moment I and the
    /// area A.
    pub(crate) fn radius_of_gyration(&self) -> f64 {
        let SectionProperties { area, second_moments: [i1, i2], .. } = self.moments();
        (i1.max(i2) / area).sqrt()
    }
}

impl<D: Copy> Section<D> {
    /// Outer radius of a circle or tube, m; `None` for other sections.
    pub(crate) fn outer_radius(&self) -> Option<D> {
        match self {
            Self::Circle { radius } | Self::Tube { radius, .. } => Some(*radius),
            Self::Rectangle { .. } | Self::Custom { .. } => None,
        }
    }
}

impl<D: Scalar> Section<D> {
    /// Shear coefficient kappa of Timoshenko's beam at Poisson's ratio `nu` (G. R. Cowper, J. Appl. Mech. 33 (1966)
    /// 335). It is `6 (1 + nu)/(7 + 6 nu)` for a circle, `10 (1 + nu)/(12 + 11 nu)` for rectangles and custom sections.
    /// For a tube with the ratio `m` of inner to outer radius it is `6 (1 + nu) c/((7 + 6 nu) c + (20 + 12 nu) m^2)`
    /// with `c = (1 + m^2)^2`.
    pub(crate) fn shear_coefficient(&self, nu: D) -> D {
        match self {
            Self::Circle { .. } => (nu + 1.0) * 6.0 / (nu * 6.0 + 7.0),
            Self::Tube { radius, thickness } => {
                // (1 + m^2)^2 with the ratio m of the inner radius to the outer.
                let inner = -(*thickness / *radius) + 1.0;
                let sum = inner * inner + 1.0;
                let whole = sum * sum;
                (nu + 1.0) * 6.0 * whole
                    / ((nu * 6.0 + 7.0) * whole + (nu * 12.0 + 20.0) * inner * inner)
            }
            // A section of unknown outline counts as a rectangle.
            Self::Rectangle { .. } | Self::Custom { .. } => (nu + 1.0) * 10.0 / (nu * 11.0 + 12.0),
        }
    }

    /// Ratio `E/(kappa G)` of a vibrating rod of an isotropic material with Poisson's ratio `nu`. For solid sections it
    /// is `2.4 + 0.483 nu + 5.208 nu^2`: the terms of `T1` in ASTM E1876 of first order in the squared thickness, of
    /// round and rectangular bars alike. That of a tube is `2 (1 + nu)/kappa` with Cowper's coefficient.
    pub(crate) fn shear_flexibility(&self, nu: D) -> D {
        match self {
            Self::Tube { .. } => (nu + 1.0) * 2.0 / self.shear_coefficient(nu),
            _ => (nu * 5.208 + 0.483) * nu + 2.4,
        }
    }
}

impl<D: Scalar> Section<D> {
    /// The direction `up` that orients the section, as given and of any length; none for a circle or a tube.
    pub fn up(&self) -> Option<Vector<D>> {
        match self {
            Self::Circle { .. } | Self::Tube { .. } => None,
            Self::Rectangle { up, .. } | Self::Custom { up, .. } => Some(*up),
        }
    }

    /// Unit vector, in the world, along the component of `up` normal to the first edge of the `nodes`; none for a
    /// circle or a tube.
    pub(crate) fn up_across(&self, nodes: &[Vector<D>]) -> Option<Vector<D>> {
        let first_edge = unit(sub(nodes[1], nodes[0]));
        self.up().map(|up| unit(sub(up, scale(first_edge, dot(first_edge, up)))))
    }

    /// Area, second moments (in the plane of `up`, then across it) and torsion constant. They follow from the formulas
    /// of the section's kind, or are given for a custom section.
    pub fn moments(&self) -> SectionProperties<D> {
        match *self {
            Self::Circle { radius } => circle(radius),
            Self::Tube { radius, thickness } => tube(radius, thickness),
            Self::Rectangle { width, height, .. } => rectangle(width, height),
            Self::Custom { area, i1, i2, j, .. } => {
                SectionProperties { area, second_moments: [i1, i2], torsion_constant: j }
            }
        }
    }
}

/// Area, second moments and torsion constant of a cross-section.
#[derive(Clone, Copy, Debug)]
pub struct SectionProperties<D> {
    /// Area of the section, m^2.
    pub area: D,
    /// Second moments of area in the plane of `up` and across it, m^4.
    pub second_moments: [D; 2],
    /// Torsion constant J, m^4: the polar moment of a circle or a tube, Saint-Venant's of a rectangle.
    pub torsion_constant: D,
}

/// Area `pi r^2`, second moments `pi r^4/4` and torsion constant `pi r^4/2` of a circle with this radius, m.
pub fn circle<D: Scalar>(radius: D) -> SectionProperties<D> {
    let square = radius * radius;
    let second_moment = square * square * (PI / 4.0);
    SectionProperties {
        area: square * PI,
        second_moments: [second_moment; 2],
        torsion_constant: second_moment * 2.0,
    }
}

/// Area `pi t (R + r)`, second moments `A (R^2 + r^2)/4` and torsion constant (twice these) of a tube with this outer
/// radius R and wall thickness t, m; `r = R - t`. No difference of two circles is formed, in which a thin wall would
/// lose its digits.
pub fn tube<D: Scalar>(radius: D, thickness: D) -> SectionProperties<D> {
    let inner = radius - thickness;
    let area = thickness * (radius + inner) * PI;
    let second_moment = area * (radius * radius + inner * inner) * 0.25;
    SectionProperties {
        area,
        second_moments: [second_moment; 2],
        torsion_constant: second_moment * 2.0,
    }
}

/// Area, second moments (`A height^2/12` in the plane of `up`, `A width^2/12` across it) and torsion constant of a
/// rectangle with this width and height, m. The torsion constant is Saint-Venant's `a b^3 (1/3 - 64/pi^5 b/a S)` with
/// the sides `a >= b`. The series `S` is the sum of `tanh(n pi a/(2 b))/n^5` over odd n, with `SERIES_TERMS` terms.
pub fn rectangle<D: Scalar>(width: D, height: D) -> SectionProperties<D> {
    let area = width * height;
    let (long, short) =
        if width.value() > height.value() { (width, height) } else { (height, width) };
    // Odd terms of the series; exponentials of negative arguments do not overflow.
    let mut series = D::from(0.0);
    for n in (0..SERIES_TERMS).map(|k| f64::from(2 * k + 1)) {
        let decay = (long / short * (-n * PI)).exp();
        let tanh = (-decay + 1.0) / (decay + 1.0);
        series += tanh * n.powi(-5);
    }
    // J = a b^3 (1/3 - 64/pi^5 b/a sum tanh(n pi a/(2 b))/n^5) over odd n, with the sides a >= b.
    let part = -(series * short / long) * (64.0 / PI.powi(5)) + 1.0 / 3.0;
    SectionProperties {
        area,
        second_moments: [height * height, width * width].map(|square| area * square * (1.0 / 12.0)),
        torsion_constant: long * short.powi(3) * part,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn second_moments_of_a_rectangle_follow_up() {
        let section = Section::Rectangle { width: 0.01, height: 0.002, up: [0.0, 1.0, 0.0] };
        let [in_plane, across] = section.moments().second_moments;
        // w h^3/12 along `up`, and (w/h)^2 = 25 times as much across it.
        assert_relative_eq!(in_plane, 0.01 * 0.002_f64.powi(3) / 12.0);
        assert_relative_eq!(across / in_plane, 25.0, max_relative = 1e-14);
    }

    #[test]
    fn a_tube_is_the_difference_of_two_circles() {
        // A usual tube, one without a hole, and a foil.
        for (outer, wall) in [(0.005, 0.001), (0.005, 0.005), (0.02, 1e-5)] {
            let (tube, whole, hole) = (tube(outer, wall), circle(outer), circle(outer - wall));
            let differences = [
                (tube.area, whole.area - hole.area),
                (tube.second_moments[0], whole.second_moments[0] - hole.second_moments[0]),
                (tube.second_moments[1], whole.second_moments[1] - hole.second_moments[1]),
                (tube.torsion_constant, whole.torsion_constant - hole.torsion_constant),
            ];
            for (of_tube, difference) in differences {
                assert_relative_eq!(of_tube, difference, max_relative = 1e-12);
            }
        }
    }

    /// Cowper's table of shear coefficients at nu = 0.3, and the limits of a tube: a full circle and a thin wall,
    /// 2 (1 + nu)/(4 + 3 nu).
    #[test]
    fn shear_coefficients_are_cowpers() {
        let tube = |thickness| Section::Tube { radius: 1.0, thickness }.shear_coefficient(0.3);
        let rectangle = Section::Rectangle { width: 1.0, height: 2.0, up: [0.0, 1.0, 0.0] };
        let circle = Section::Circle { radius: 1.0 }.shear_coefficient(0.3);
        assert!((circle - 0.886).abs() < 5e-4 && (tube(1.0) / circle - 1.0).abs() < 1e-12);
        assert!((tube(1e-6) - 2.6 / 4.9).abs() < 1e-5, "{}", tube(1e-6));
        assert!((rectangle.shear_coefficient(0.3) - 0.850).abs() < 5e-4);
    }

    /// Timoshenko & Goodier, Theory of Elasticity, table of section 109: J = k1 (long) (short)^3.
    #[test]
    fn torsion_of_a_rectangle_is_saint_venants() {
        for (ratio, k1) in
            [(1.0_f64, 0.1406), (1.5, 0.196), (2.0, 0.229), (5.0, 0.291), (10.0, 0.312)]
        {
            let flat = rectangle(0.01 * ratio, 0.01);
            let j = flat.torsion_constant;
            assert!((j / (ratio * 1e-8) - k1).abs() < 6e-4, "{ratio}: {j}");
            assert_eq!(j, rectangle(0.01, 0.01 * ratio).torsion_constant);
        }
    }
}
