//! Cross-sections.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, cross, dot, scale, sub, unit};
use crate::scene::number::{Candidates, Numbers, Quantity, Written};
use crate::scene::validate::{direction, positive};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Cross-section of the rod.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(bound = "D: Written + schemars::JsonSchema"))]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields, bound = "D: Written")]
pub enum Section<D = f64> {
    /// A full circle.
    Circle {
        /// Radius, m.
        radius: D,
    },
    /// A circle with a round hole in its middle.
    Tube {
        /// Outer radius, m.
        radius: D,
        /// Wall thickness, m; at most the radius.
        thickness: D,
    },
    /// A rectangle, `height` along `up`.
    Rectangle {
        /// Width across `up`, m.
        width: D,
        /// Height along `up`, m.
        height: D,
        /// Direction of the height; its component across the first edge counts.
        #[serde(deserialize_with = "crate::input::arrays::numbers")]
        up: [D; 3],
    },
    /// Any section, by its area, second moments and torsion constant.
    Custom {
        /// Area of the section, m^2.
        area: D,
        /// Second moment that resists bending in the plane of `up`, m^4.
        i1: D,
        /// Second moment that resists bending across `up`, m^4.
        i2: D,
        /// Torsion constant, m^4.
        j: D,
        /// Direction of the height; its component across the first edge counts.
        #[serde(deserialize_with = "crate::input::arrays::numbers")]
        up: [D; 3],
    },
}

impl Section {
    pub(super) fn over<D>(&self, n: &mut Numbers<'_, D>) -> Section<D> {
        let size = Quantity::positive("m").searched(Candidates::OfLength(1e-4, 0.1, 2.0));
        let second_moment = Quantity::positive("m^4");
        let axis = Quantity::signed("");
        match *self {
            Self::Circle { radius } => Section::Circle { radius: n.number("radius", radius, size) },
            Self::Tube { radius, thickness } => Section::Tube {
                radius: n.number("radius", radius, size),
                thickness: n.number("thickness", thickness, size),
            },
            Self::Rectangle { width, height, up } => Section::Rectangle {
                width: n.number("width", width, size),
                height: n.number("height", height, size),
                up: n.vector("up", up, axis),
            },
            Self::Custom { area, i1, i2, j, up } => Section::Custom {
                area: n.number("area", area, Quantity::positive("m^2")),
                i1: n.number("i1", i1, second_moment),
                i2: n.number("i2", i2, second_moment),
                j: n.number("j", j, second_moment),
                up: n.vector("up", up, axis),
            },
        }
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        let key = |name: &str| format!("rod.section.{name}");
        match self {
            Self::Circle { radius } => positive(&key("radius"), *radius),
            Self::Tube { radius, thickness } => {
                positive(&key("radius"), *radius)?;
                positive(&key("thickness"), *thickness)?;
                if thickness > radius {
                    let allowed = format!("up to the radius, {radius:.4e} m");
                    return Err(Error::invalid(key("thickness"), thickness, allowed));
                }
                Ok(())
            }
            Self::Rectangle { width, height, up } => {
                positive(&key("width"), *width)?;
                positive(&key("height"), *height)?;
                direction(&key("up"), up)
            }
            Self::Custom { area, i1, i2, j, up } => {
                for (name, value) in [("area", area), ("i1", i1), ("i2", i2), ("j", j)] {
                    positive(&key(name), *value)?;
                }
                direction(&key("up"), up)
            }
        }
    }
}

impl Section {
    /// Refuses a direction `up` that says nothing of how the section lies across the rod.
    pub(crate) fn check_up(&self, nodes: &[Vector<f64>]) -> Result<(), Error> {
        let Some(up) = self.up() else { return Ok(()) };
        let first_edge = unit(sub(nodes[1], nodes[0]));
        let across = cross(first_edge, up);
        if dot(across, across) > 1e-18 * dot(up, up) {
            return Ok(());
        }
        let found = "a direction along the first edge";
        Err(Error::invalid("rod.section.up", found, "a direction with a part across it"))
    }
}

impl<D: Scalar> Section<D> {
    /// The direction the section is oriented by; none for a circle or a tube.
    pub fn up(&self) -> Option<Vector<D>> {
        match self {
            Self::Circle { .. } | Self::Tube { .. } => None,
            Self::Rectangle { up, .. } | Self::Custom { up, .. } => Some(*up),
        }
    }

    /// The unit part of `up` across the first edge; none for a circle or a tube.
    pub(crate) fn up_across(&self, nodes: &[Vector<D>]) -> Option<Vector<D>> {
        let first_edge = unit(sub(nodes[1], nodes[0]));
        self.up().map(|up| unit(sub(up, scale(first_edge, dot(first_edge, up)))))
    }

    /// Area, second moments and torsion constant.
    pub fn moments(&self) -> Moments<D> {
        match *self {
            Self::Circle { radius } => circle(radius),
            Self::Tube { radius, thickness } => tube(radius, thickness),
            Self::Rectangle { width, height, .. } => rectangle(width, height),
            Self::Custom { area, i1, i2, j, .. } => {
                Moments { area, second_moments: [i1, i2], torsion_constant: j }
            }
        }
    }
}

impl Section {
    /// Shear coefficient kappa of Timoshenko's beam at Poisson's ratio `nu`: G. R. Cowper, J. Appl. Mech. 33 (1966) 335.
    pub(crate) fn shear_coefficient(&self, nu: f64) -> f64 {
        match self {
            Self::Circle { .. } => 6.0 * (1.0 + nu) / (7.0 + 6.0 * nu),
            Self::Tube { radius, thickness } => {
                // (1 + m^2)^2 with the ratio m of the inner radius to the outer.
                let inner = 1.0 - thickness / radius;
                let whole = (1.0 + inner * inner).powi(2);
                6.0 * (1.0 + nu) * whole
                    / ((7.0 + 6.0 * nu) * whole + (20.0 + 12.0 * nu) * inner * inner)
            }
            // A section of unknown outline counts as a rectangle.
            Self::Rectangle { .. } | Self::Custom { .. } => 10.0 * (1.0 + nu) / (12.0 + 11.0 * nu),
        }
    }

    /// Largest radius of gyration about an axis in the section, m.
    pub(crate) fn radius_of_gyration(&self) -> f64 {
        let Moments { area, second_moments: [i1, i2], .. } = self.moments();
        (i1.max(i2) / area).sqrt()
    }
}

/// What the stiffnesses and the inertia of a section come from.
#[derive(Clone, Copy, Debug)]
pub struct Moments<D> {
    /// Area of the section, m^2.
    pub area: D,
    /// Second moments of area in the plane of `up` and across it, m^4.
    pub second_moments: [D; 2],
    /// Torsion constant J, m^4: the polar moment of a circle or a tube, Saint-Venant's of a rectangle.
    pub torsion_constant: D,
}

/// Of a circle of a radius in m.
pub fn circle<D: Scalar>(radius: D) -> Moments<D> {
    let square = radius * radius;
    let second_moment = square * square * (PI / 4.0);
    Moments {
        area: square * PI,
        second_moments: [second_moment; 2],
        torsion_constant: second_moment * 2.0,
    }
}

/// Of a tube of an outer radius and a wall in m, without the difference of two circles, in which a thin
/// wall would lose its digits.
pub fn tube<D: Scalar>(radius: D, thickness: D) -> Moments<D> {
    let inner = radius - thickness;
    let area = thickness * (radius + inner) * PI;
    let second_moment = area * (radius * radius + inner * inner) * 0.25;
    Moments { area, second_moments: [second_moment; 2], torsion_constant: second_moment * 2.0 }
}

/// Of a rectangle of a width and a height in m.
pub fn rectangle<D: Scalar>(width: D, height: D) -> Moments<D> {
    let area = width * height;
    let (long, short) =
        if width.value() > height.value() { (width, height) } else { (height, width) };
    // The terms fall like n^-5.
    let mut series = D::from(0.0);
    for n in (0..200).map(|k| f64::from(2 * k + 1)) {
        let decay = (long / short * (-n * PI)).exp();
        let tanh = (-decay + 1.0) / (decay + 1.0);
        series += tanh * n.powi(-5);
    }
    let part = -(series * short / long) * (64.0 / PI.powi(5)) + 1.0 / 3.0;
    Moments {
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
        assert_relative_eq!(in_plane, 0.01 * 0.002_f64.powi(3) / 12.0);
        assert_relative_eq!(across / in_plane, 25.0, max_relative = 1e-14);
    }

    #[test]
    fn a_tube_is_the_difference_of_two_circles() {
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
