//! Line loads on the nodes of a mesh: [`line_loads`] returns nodal forces (N, world axes), [`check_line_loads`]
//! rejects loads outside the rod.
//!
//! Input: loads with a force `f` per unit length of the rod at rest (N/m), which acts between two arc lengths (m).
//! Without an end a load lasts to that of the rod. A point of an edge at the fraction `t` of its length moves as
//! `(1 - t) x_i + t x_{i+1}`. The nodal forces do the same virtual work: node `i + 1` carries `f w t_m` and node `i`
//! carries `f w (1 - t_m)`. Here `w` is the loaded length of the edge, and `t_m` the fraction of its middle. Each
//! loaded edge of each load has two entries, without moments; parts behind a wall carry nothing. The check rejects an
//! end beyond the rod, and a start that is not before the end. The setup of a problem adds the forces to its rod.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::problem::model::NodalLoad;
use crate::scene::LineForce;
use crate::scene::mesh::Mesh;

/// Rejects line loads that end beyond a rod of a `length`, m, or do not end after they begin. A load without an end
/// lasts to that of the rod. Negative arc lengths are rejected by the quantities.
///
/// # Errors
/// [`Error::Invalid`] with the key.
pub(crate) fn check_line_loads<D: Scalar>(
    loads: &[LineForce<D>],
    length: f64,
) -> Result<(), Error> {
    for (k, load) in loads.iter().enumerate() {
        let (from, to) = (load.from.value(), load.to.map_or(length, |to| to.value()));
        let (key, found) = if to > length { ("to", to) } else { ("from", from) };
        if to > length || from >= to {
            let allowed = format!("from < to, both arc lengths between 0 and {length} m");
            return Err(Error::invalid(format!("loads.line[{k}].{key}"), found, allowed));
        }
    }
    Ok(())
}

/// Forces of line loads on the nodes of a mesh, N in the world, without moments. Each loaded edge gives two entries,
/// one for each of its nodes, so that a node may have several. The force on its loaded part is divided between both by
/// the lever rule at the middle of that part. Parts outside the rod, where a length or an end varies in a fit, carry no
/// load.
pub(crate) fn line_loads<D: Scalar>(loads: &[LineForce<D>], mesh: &Mesh<D>) -> Vec<NodalLoad<D>> {
    let mut nodal = Vec::new();
    for load in loads {
        let to = match load.to {
            Some(to) if to.value() < mesh.length.value() => to,
            _ => mesh.length,
        };
        for (i, ends) in mesh.arc_length.windows(2).enumerate() {
            // An arc length behind a wall is negative; loads begin at zero at the earliest.
            let low = if load.from.value() > ends[0].value() { load.from } else { ends[0] };
            let high = if to.value() < ends[1].value() { to } else { ends[1] };
            let loaded = high - low;
            if loaded.value() <= 0.0 {
                continue;
            }
            // A uniform load acts at the middle of its part: the lever rule there keeps force and
            // moment.
            let middle = ((low + high) * 0.5 - ends[0]) / (ends[1] - ends[0]);
            for (node, share) in [(i, loaded * (-middle + 1.0)), (i + 1, loaded * middle)] {
                let force = load.force.map(|c| c * share);
                nodal.push(NodalLoad { node, force, moment: [D::from(0.0); 3] });
            }
        }
    }
    nodal
}
