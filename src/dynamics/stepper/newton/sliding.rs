//! The rod with internal friction while Newton's method iterates.

use crate::numerics::scalar::Nestable;
use crate::rod::{InternalVariables, Rod};

/// The rod with internal friction, as it is where the springs are stretched as far as the unknowns of an
/// iteration say.
#[derive(Clone, Debug)]
pub(super) struct Sliding<D, R> {
    pub rod: R,
    strains: Vec<D>,
    /// How far the springs would be stretched if they did not slip.
    z: Vec<D>,
}

impl<D: Nestable, R> Sliding<D, R> {
    /// Of a rod.
    pub fn of(rod: R) -> Self {
        Self { rod, strains: Vec::new(), z: Vec::new() }
    }

    /// The rod at the unknowns `q` of a step that began with these internal variables; `law` is the rod without friction.
    pub fn at<const W: usize>(
        &mut self,
        law: &R,
        elastic: &R,
        before: &InternalVariables<D>,
        (q, frames): (&[D], &R::Frames),
    ) -> &R
    where
        R: Rod<D, W>,
    {
        elastic.strains(q, frames, &mut self.strains);
        stretched(elastic.slides(), before, &self.strains, &mut self.z);
        self.rod.set_sliders(law, elastic, &self.strains, &self.z);
        &self.rod
    }
}

/// Writes how far `count` springs are stretched if they do not slip while the strains become these.
pub fn stretched<D: Nestable>(
    count: usize,
    before: &InternalVariables<D>,
    strains: &[D],
    z: &mut Vec<D>,
) {
    let first = strains.len() - count;
    let changes = strains[first..].iter().zip(&before.strain[first..]);
    z.clear();
    z.extend(changes.zip(&before.slid).map(|((now, then), slid)| *slid + *now - *then));
}
