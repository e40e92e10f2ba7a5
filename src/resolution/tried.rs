//! What was tried of steps, and what is found of them.

use crate::resolution::mix::Finest;
use crate::resolution::off::apart;
use crate::resolution::runs::Ran;
use crate::scene::Scheme;
use crate::scene::resolution::Bound;

/// The scheme that is tried beside the first.
pub(super) const RIVAL: Scheme = Scheme::Rodas4;
/// Step errors may be so many times the step's part where meshes are compared: they are alike on both. But of a scheme that damps
/// what its steps do not resolve, and with that what finer meshes change.
const ALIKE: f64 = 30.0;
const ALIKE_DAMPED: f64 = 5.0;
/// And not more than this part of the length, nor those of so many times the finest step.
const LARGE: f64 = 0.02;
const COARSEST: f64 = 4.0;

/// What is found of steps.
pub(super) struct Steps {
    /// The finest that was looked at, s.
    pub step: f64,
    pub finest: Finest,
    pub scheme: Scheme,
    /// Step, s, and scheme in which meshes are compared.
    pub coarse: (f64, Scheme),
    pub bound: Option<Bound>,
}

/// The runs on one mesh by step and scheme, and the error that the step may make.
pub(super) struct Tried {
    pub allowed: f64,
    pub runs: Vec<(f64, Scheme, Option<Ran>)>,
}

impl Tried {
    /// Step and scheme in which meshes are compared: the cheapest that is near enough to the finest run, or what was chosen.
    pub fn coarse(&self, finest: Option<&Ran>, chosen: (f64, Scheme)) -> (f64, Scheme) {
        let near = |scheme: Scheme, ran: &Ran| {
            let alike = if scheme == RIVAL { ALIKE_DAMPED } else { ALIKE };
            let most = (alike * self.allowed).min(LARGE);
            finest.is_some_and(|finest| apart(&ran.seen, &finest.seen) <= most)
        };
        let runs = self.runs.iter().filter_map(|(step, scheme, ran)| {
            let ran = ran.as_ref().filter(|ran| near(*scheme, ran))?;
            let fine = *step <= 1.01 * COARSEST * chosen.0;
            fine.then_some((ran.iterations, (*step, *scheme)))
        });
        let cheapest = runs.min_by(|a, b| a.0.total_cmp(&b.0));
        cheapest.map_or(chosen, |(_, cheapest)| cheapest)
    }
}
