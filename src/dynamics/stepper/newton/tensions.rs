//! The tensions that edges are taken to be under while Newton's method iterates.
//!
//! A rod hardly stretches. A correction that turns an edge by an angle `a` makes it longer by the part `a^2/2` all the
//! same, and EA times that is a tension far above what the motion asks for; the next tangent, formed under it, is too
//! stiff across the edge, or too soft, and the iteration goes astray until edges turn by next to nothing. The linear
//! system itself knows better: to first order in the correction, the tension is what balances the forces. So the next
//! tangent is formed under that one, as if tensions were unknowns of their own, and a step begins with those that the
//! one before has ended with. Only the tangent changes, and not at the solution, where both tensions are the same:
//! convergence stays quadratic, in places and tensions together (the "mixed integration points" of Magisano, Leonetti and
//! Garcea, Comput. Methods Appl. Mech. Engrg. 313, 2017, doi:10.1016/j.cma.2016.10.023).
//!
//! The cables of `data/cables` take 4 to 6 corrections a step without that, and 3.0 to 3.4 with it. No chord
//! follows such a tangent, so steps that three tangents of the usual kind do for gain nothing: it begins with a fourth one,
//! and ends where a step takes as many as the last of the usual kind, or no more than two.

use crate::numerics::scalar::Nestable;
use crate::rod::Rod;

/// Tangents of the usual kind that a step takes without trouble, and under tensions where the usual kind may do again.
const ENOUGH: [usize; 2] = [3, 2];
/// After so many tangents the way was not the right one.
const MOST: usize = 8;
/// A correction of nodes by more than this part of an edge is not small.
const SMALL: f64 = 0.1;

/// The tensions of all edges, N, if they are expected to be others than those of their strains.
#[derive(Clone, Debug)]
pub(super) struct Tensions<D> {
    expected: Vec<D>,
    known: bool,
    /// Whether they were when the step began.
    begun: bool,
    /// How many tangents the last step took that began without them.
    usual: usize,
    /// Length of an edge, m.
    edge: f64,
}

impl<D: Nestable> Tensions<D> {
    /// Before the first step of a rod with edges as long as `edge`, m.
    pub fn unknown(edge: f64) -> Self {
        Self { expected: Vec::new(), known: false, begun: false, usual: 0, edge }
    }

    /// A step begins.
    pub fn begin(&mut self) {
        self.begun = self.known;
    }

    pub fn expected(&self) -> Option<&[D]> {
        self.known.then_some(&self.expected)
    }

    /// Takes note of a correction that has moved nodes by up to `moved`, m, to `q`, after so many tangents; none will
    /// follow in this step where it is `done`.
    pub fn corrected<R: Rod<D>>(
        &mut self,
        rod: &R,
        (correction, moved): (&[D], f64),
        q: &[D],
        (tangents, done): (usize, bool),
    ) {
        let [usual, few] = ENOUGH;
        let gains = match (self.begun, done) {
            (true, true) => tangents > few && tangents < self.usual,
            (true, false) => true,
            (false, true) => tangents > usual,
            (false, false) => tangents >= usual,
        };
        if done && !self.begun {
            self.usual = tangents;
        }
        self.known = gains && tangents <= MOST && moved <= SMALL * self.edge;
        if self.known {
            rod.tensions_after(correction, q, &mut self.expected);
        }
    }

    pub fn forget(&mut self) {
        self.known = false;
    }
}
