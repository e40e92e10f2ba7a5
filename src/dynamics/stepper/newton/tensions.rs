//! Predicted tensions of edges for the tangents of Newton's method.
//!
//! A correction that rotates an edge by an angle `a` also lengthens it by the part `a^2/2`. In a nearly
//! inextensible rod this is a tension EA a^2/2 far above that of the motion. The next tangent, formed under it, has
//! a wrong stiffness across the edge, and the iteration diverges until rotations are tiny. To first order in the
//! correction, the linear system gives the tension that balances the forces. The next tangent is formed under that
//! one, as if tensions were unknowns, and a step begins with the tensions at the end of the one before. Only the
//! tangent changes, and not at the solution, where both tensions agree: convergence stays quadratic, in places and
//! tensions together (the "mixed integration points" of Magisano, Leonetti and Garcea, Comput. Methods Appl. Mech.
//! Engrg. 313, 2017, doi:10.1016/j.cma.2016.10.023).
//!
//! The cables of `data/cables` take 4 to 6 corrections a step without it, and 3.0 to 3.4 with it. No chord follows
//! such a tangent, so that steps with up to three usual tangents gain nothing. A step that needs a fourth tangent
//! forms it under predicted tensions, and the next step begins with them. They end where a step takes as many
//! tangents as the last usual one, or no more than two; after [`MOST`] tangents; and where a node moved by more
//! than [`SMALL`] edge lengths.
//!
//! Input after each correction: the correction, the largest displacement of a node (m), and the number of tangents of
//! the step. `begin` begins a step, `corrected` takes a correction, and `forget` ends the use of predictions until the
//! next one. Output: `Tensions::expected`, one tension (N) per edge for the next tangent, or `None` for those of the
//! strains.

use crate::numerics::scalar::RodScalar;
use crate::rod::Rod;

/// Two numbers of tangents in a step: usual ones up to which predicted tensions are not needed, and those under
/// predicted tensions up to which usual ones are tried again (see above).
const ENOUGH: [usize; 2] = [3, 2];
/// Largest number of tangents of a step after which tensions are predicted; with more the prediction does not help.
const MOST: usize = 8;
/// Largest displacement of nodes in a correction, over the length of an edge, for which the prediction to first order
/// holds.
const SMALL: f64 = 0.1;

/// Predicted tensions of all edges, N, and whether they replace those of the strains in the next tangent.
#[derive(Clone, Debug)]
pub(super) struct Tensions<D> {
    /// The predicted tensions, N.
    expected: Vec<D>,
    /// Whether the next tangent uses them.
    known: bool,
    /// Whether they were known at the beginning of the step.
    begun: bool,
    /// Number of tangents of the last step that began without them.
    usual: usize,
    /// Length of an edge, m.
    edge: f64,
}

/// The number of tangents of a step after one of its corrections.
#[derive(Clone, Copy, Debug)]
pub(super) struct TangentCount {
    /// Number of tangents formed in the step.
    pub tangents: usize,
    /// Whether that correction was the last of the step.
    pub is_done: bool,
}

impl<D: RodScalar> Tensions<D> {
    /// No prediction, for a rod with edges of the mean length `edge`, m.
    pub fn unknown(edge: f64) -> Self {
        Self { expected: Vec::new(), known: false, begun: false, usual: 0, edge }
    }

    /// Begins a step: records whether its first tangent uses predicted tensions.
    pub fn begin(&mut self) {
        self.begun = self.known;
    }

    /// The predicted tensions of all edges, N; `None` if the next tangent takes those of the strains.
    pub fn expected(&self) -> Option<&[D]> {
        self.known.then_some(&self.expected)
    }

    /// Decides whether the next tangent uses predicted tensions, after a `correction` to the unknowns `q` with their
    /// frames, that moved nodes by up to `moved`, m. A step that began without predicted tensions uses them from its
    /// fourth tangent on; if it had a fourth, the next step begins with them. A step that began with them uses them
    /// until its end. The next step then begins with them if this one took more than two tangents, and fewer than the
    /// last step that began without. They are never used after more than [`MOST`] tangents or for `moved` above
    /// [`SMALL`] edge lengths. If they are used, they are predicted to first order in the correction.
    pub fn corrected<R: Rod<D>>(
        &mut self,
        rod: &R,
        correction: &[D],
        moved: f64,
        (q, frames): (&[D], &R::Frames),
        TangentCount { tangents, is_done }: TangentCount,
    ) {
        let [usual, few] = ENOUGH;
        // No chord follows a tangent under predicted tensions, so that they gain only in steps with
        // many tangents.
        let gains = match (self.begun, is_done) {
            (true, true) => tangents > few && tangents < self.usual,
            (true, false) => true,
            (false, true) => tangents > usual,
            (false, false) => tangents >= usual,
        };
        if is_done && !self.begun {
            self.usual = tangents;
        }
        // The prediction is of first order: after a large displacement it is no approximation of
        // the next tensions.
        self.known = gains && tangents <= MOST && moved <= SMALL * self.edge;
        if self.known {
            rod.tensions_after(correction, q, frames, &mut self.expected);
        }
    }

    /// Ends the use of predicted tensions until [`corrected`](Self::corrected) decides again.
    pub fn forget(&mut self) {
        self.known = false;
    }
}
