//! How far identified parameters are from those of edges and steps of no length.

use crate::fit::uncertainty::covariance::gauss_newton::Covariance;

/// Part of a correction that is left open.
pub(crate) const OPEN: f64 = 0.5;
/// Part of the residuals that mesh and step must leave to be blamed for them before the model.
pub(crate) const MESH_TO_BLAME: f64 = 0.5;
/// Part of the residuals that mesh and step must leave to explain a weak excess over the noise: a quarter adds 3 % to the
/// residuals, of which a correction for mesh and step leaves a part.
const TRACES: f64 = 0.25;

/// How far the unknowns are, on their scales, from those of the limit of zero mesh and step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shifts {
    /// By the mesh; none where no experiment has another.
    pub mesh: Option<Vec<Option<f64>>>,
    /// By the step.
    pub step: Option<Vec<Option<f64>>>,
    /// Whether the program chose mesh, and step, of all experiments.
    pub chosen: [bool; 2],
    /// What both leave in the residuals, over these.
    pub left: f64,
}

impl Shifts {
    /// Both with whether they were chosen.
    pub fn parts(&self, i: usize) -> [(Option<f64>, bool); 2] {
        let of = |part: &Option<Vec<Option<f64>>>| part.as_ref()?[i];
        [(of(&self.mesh), self.chosen[0]), (of(&self.step), self.chosen[1])]
    }

    /// Shifts of the sum of the unknowns with these factors, by mesh and by step, each with whether the program chose it.
    pub fn along(&self, factors: &[f64]) -> [(f64, bool); 2] {
        let mut sums = self.chosen.map(|is_chosen| (0.0, is_chosen));
        for (j, factor) in factors.iter().enumerate().filter(|(_, factor)| **factor != 0.0) {
            for (sum, (shift, _)) in sums.iter_mut().zip(self.parts(j)) {
                sum.0 += factor * shift.unwrap_or(0.0);
            }
        }
        sums
    }

    /// By how much unknown `i` is corrected on its scale.
    pub fn correction(&self, i: usize) -> f64 {
        self.parts(i).iter().filter(|(_, chosen)| *chosen).filter_map(|(shift, _)| *shift).sum()
    }

    /// What the corrections leave open of unknown `i`, on its scale.
    pub fn open(&self, i: usize) -> f64 {
        let chosen = self.parts(i).into_iter().filter(|(_, chosen)| *chosen);
        chosen.map(|(shift, _)| OPEN * shift.unwrap_or(0.0).abs()).sum()
    }

    /// Whether a mesh and a step that the program chose leave a visible part of the residuals.
    pub fn leave_traces(&self) -> bool {
        self.chosen == [true; 2] && self.left > TRACES
    }

    /// Whether what is left of the data is mostly what a mesh and a step leave that the program chose.
    pub fn are_to_blame(&self) -> bool {
        self.chosen == [true; 2] && self.left > MESH_TO_BLAME
    }
}

/// The changes of the unknowns, on their scales, and of the residuals by a change of the model.
pub(crate) struct Response {
    /// Of those that are identifiable.
    pub unknowns: Vec<Option<f64>>,
    /// Once the unknowns have followed.
    pub residuals: Vec<f64>,
}

impl Response {
    /// To a `change` of the residuals at fixed unknowns.
    pub fn to(
        change: &[f64],
        covariance: &Covariance,
        weights: &[f64],
        jacobian: &[Vec<f64>],
    ) -> Self {
        // One weight of the change, one of the row.
        let weighted: Vec<f64> = change.iter().zip(weights).map(|(c, w)| w * w * c).collect();
        let unknowns = covariance.response(jacobian, &weighted);
        let moved = |row: &Vec<f64>| -> f64 {
            row.iter().zip(&unknowns).map(|(d, by)| d * by.unwrap_or(0.0)).sum()
        };
        let residuals = change.iter().zip(jacobian).map(|(c, row)| c + moved(row)).collect();
        Self { unknowns, residuals }
    }
}
