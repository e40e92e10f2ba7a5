//! CSV of the constants along a rod: stiffnesses, mass per length and radius, a row per edge.
//!
//! Input: a [`RodChain`]. Columns: arc length `s` of the middle of the edge, m; EA, N; EI1 (bending towards the first
//! director) and EI2, N m^2; GJ, N m^2 (0 without a shear modulus); mass per length, kg/m; radius, m. Bending and
//! torsion are means of those of the joints beside the edge.

use crate::export::links::RodChain;
use std::fmt::Write;

/// The text of the table of a chain: a header with units, then a row per edge.
pub(super) fn csv(chain: &RodChain) -> String {
    let mut text =
        String::from("s[m],EA[N],EI1[N m^2],EI2[N m^2],GJ[N m^2],mass[kg/m],radius[m]\n");
    for (j, link) in chain.links.iter().enumerate() {
        let place = 0.5 * (chain.places[j] + chain.places[j + 1]);
        let [twist, second, first] = rigidity(chain, j);
        let _ = writeln!(
            text,
            "{place},{:e},{first:e},{second:e},{twist:e},{:e},{}",
            link.axial, link.line_density, link.radius
        );
    }
    text
}

/// Mean of the rigidities `stiffness * length` of the joints beside edge `j`: torsion, then bending about the first and
/// the second director, N m^2.
fn rigidity(chain: &RodChain, j: usize) -> [f64; 3] {
    let beside = [j.checked_sub(1), (j < chain.joints.len()).then_some(j)];
    let joints: Vec<_> = beside.into_iter().flatten().map(|i| &chain.joints[i]).collect();
    let mean = |k: usize| {
        joints.iter().map(|joint| joint.stiffness[k] * joint.length).sum::<f64>()
            / joints.len() as f64
    };
    [0, 1, 2].map(mean)
}
