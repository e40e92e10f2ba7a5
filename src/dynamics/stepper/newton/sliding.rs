//! Where the springs of internal friction are at the end of a step.

use crate::numerics::scalar::Nestable;
use crate::rod::{InternalVariables, Rod};

/// A correction of a node by less than this part of its edge's length changes no strain by more than one.
const SURELY: f64 = 20.0;

/// The strains where a step ends, and where they take the springs of internal friction.
#[derive(Clone, Debug)]
pub(super) struct Sliding<D> {
    pub strains: Vec<D>,
    /// How far the springs would be stretched if they did not slip, and how far they are.
    z: Vec<D>,
    pub slid: Vec<D>,
    /// Whether this is so at the unknowns of now.
    pub seen: bool,
}

impl<D: Nestable> Sliding<D> {
    /// Before the first step.
    pub fn new() -> Self {
        Self { strains: Vec::new(), z: Vec::new(), slid: Vec::new(), seen: false }
    }

    /// Looks at the unknowns `q` of a step that began with these internal variables.
    pub fn look<R: Rod<D>>(
        &mut self,
        elastic: &R,
        before: &InternalVariables<D>,
        (q, frames): (&[D], &R::Frames),
    ) {
        elastic.strains(q, frames, &mut self.strains);
        stretched(elastic.slides(), before, &self.strains, &mut self.z);
        self.slid.clone_from(&self.z);
        elastic.slip(&mut self.slid);
        self.seen = true;
    }

    /// Whether, where it looked last, the last correction by up to `size`, as a part of the rod's length, let no
    /// spring begin to slip or stick again.
    pub fn goes_on<R: Rod<D>>(&self, elastic: &R, size: f64) -> bool {
        let edges = (self.strains.len() - self.z.len()) as f64;
        elastic.distance_to_slipping(&self.z) > SURELY * size * edges
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
    z.clone_from(&before.slid);
    for (z, (now, then)) in z.iter_mut().zip(strains[first..].iter().zip(&before.strain[first..])) {
        *z = *z + *now - *then;
    }
}
