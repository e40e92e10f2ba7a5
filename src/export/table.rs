//! CSV of the constants along a rod: stiffnesses, mass per length and radius, a row per edge.
//!
//! Input: a [`RodChain`]. Columns: arc length `s` of the middle of the edge, m; EA, N; EI1 (bending towards the first
//! director) and EI2, N m^2; GJ, N m^2 (0 without a shear modulus); mass per length, kg/m; radius, m.

use crate::export::links::RodChain;
use std::fmt::Write;

/// The text of the table of a chain: a header with units, then a row per edge.
pub(super) fn csv(chain: &RodChain) -> String {
    let mut text =
        String::from("s[m],EA[N],EI1[N m^2],EI2[N m^2],GJ[N m^2],mass[kg/m],radius[m]\n");
    for (j, link) in chain.links.iter().enumerate() {
        let place = 0.5 * (chain.places[j] + chain.places[j + 1]);
        let [twist, second, first] = link.rigidity;
        let _ = writeln!(
            text,
            "{place},{:e},{first:e},{second:e},{twist:e},{:e},{}",
            link.axial, link.line_density, link.radius
        );
    }
    text
}
