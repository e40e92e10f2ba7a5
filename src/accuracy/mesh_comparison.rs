//! Errors of a mesh that the user gave, from the same calculation on another mesh.
//!
//! An error `C h^p` of the edge length `h` changes by the factor `1 - r^-p` on a mesh of `r` times as many edges, with
//! the order `p` of the method. The difference of both results over that factor is the error of the given mesh
//! (Richardson). The other mesh has four times as many edges for coarse meshes, which resolve little, and less for fine
//! ones ([`other_meshes`]).
//!
//! [`MeshComparison`] has the numbers of edges and the order. [`PositionError`] is the error of an equilibrium, m, and
//! [`FrequencyErrors`] are those of modes, relative to the frequencies. Both have `excess`, the error over the largest
//! one without a warning, and `finding`, the first part of the warning. An error is above the limit if it exceeds
//! [`MAX_OF_DISPLACEMENT`], [`MAX_OF_LENGTH`] or [`MAX_OF_FREQUENCY`]. `sufficient` is the number of edges with which
//! there would be no warning.

use crate::accuracy::extrapolation::Extrapolation;
use crate::numerics::vector::{norm, sub};
use crate::statics::MeshError;
use crate::summary::quantity::{counted, number};

/// Largest error of a displacement without a warning, over the largest displacement of the equilibrium. A modulus that
/// is read from a deflection has the same relative error.
const MAX_OF_DISPLACEMENT: f64 = 0.02;
/// Largest error of a position without a warning, over the length of the rod.
const MAX_OF_LENGTH: f64 = 0.01;
/// Largest error of a frequency without a warning. A modulus has twice this error.
const MAX_OF_FREQUENCY: f64 = 0.02;
/// Largest displacement over the length that is rounding, so that its relative error has no meaning.
const NO_DISPLACEMENT: f64 = 1e-7;
/// Error over the largest displacement above which two meshes have different equilibria.
const OTHER_EQUILIBRIUM: f64 = 1.0;
/// Margin of the number of edges that suffices.
const MARGIN: f64 = 1.1;
/// Edges per half wave of a mode that the given mesh does not have. The error of a sine wave is `1 - (sin(x)/x)^2` with
/// `x = pi/(2 n)` for n edges per half wave, 1.3 %.
const EDGES_PER_MODE: usize = 8;
/// Largest numbers of edges with four times, and with twice as many edges on the other mesh. Finer meshes are compared
/// with a coarser one, which takes less time and has smaller rounding errors.
const COARSE: [usize; 2] = [100, 500];
/// Largest number of edges with 16 times as many on the other mesh, for a method of first order. Its errors of first
/// and of second order cancel on some meshes, and only a much finer mesh shows that.
const COARSE_OF_FIRST_ORDER: usize = 40;
/// Smallest and largest number of edges that is compared with half as many. Rounding errors of frequencies on finer
/// meshes are above 1 % of the limit, and grow with the fourth power.
const FINE: std::ops::RangeInclusive<usize> = 8..=5000;

/// Numbers of edges of other meshes over that of a given one with so many `segments`, the most suitable one first.
/// `order` is that of the method. The next one is for calculations that the mesh before does not permit. Empty for very
/// fine meshes.
pub(super) fn other_meshes(segments: usize, order: f64) -> impl Iterator<Item = f64> {
    let is_mixed = order < 2.0 && segments <= COARSE_OF_FIRST_ORDER;
    let [four, two] = COARSE.map(|most| segments <= most);
    let all = [(16.0, is_mixed), (4.0, four), (2.0, two), (0.5, FINE.contains(&segments))];
    all.into_iter().filter_map(|(ratio, is_used)| is_used.then_some(ratio))
}

/// A given mesh and another one.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshComparison {
    /// Number of edges of the given mesh.
    pub segments: usize,
    /// Edges of the other mesh over those of the given one.
    pub ratio: f64,
    /// Order of the method: 2, or 1 with clamps at nodes.
    pub order: f64,
}

impl MeshComparison {
    /// The error of a result over its difference from that on the other mesh, `1/(1 - r^-p)`.
    fn error_ratio(self) -> f64 {
        Extrapolation { ratio: self.ratio, order: self.order }.error_before()
    }

    /// The relative error of a frequency, rad/s, by the `other` one. It is 1 if the extrapolated one has another sign:
    /// the rod is stable on one mesh only. `None` where a frequency is zero.
    pub fn frequency_error(self, given: f64, other: f64) -> Option<f64> {
        if given == 0.0 || other == 0.0 {
            return None;
        }
        let exact = given - (given - other) * self.error_ratio();
        Some(if exact * given > 0.0 { given / exact - 1.0 } else { 1.0 })
    }

    /// A number of edges with which an error of `excess` times the limit is below it.
    pub fn sufficient(self, excess: f64) -> usize {
        (self.segments as f64 * MARGIN * excess.powf(self.order.recip())).ceil() as usize
    }
}

/// Positions, m, of the compared points of an equilibrium.
#[derive(Clone, Debug, Default)]
pub(super) struct ComparedPoints {
    /// At rest, without loads.
    pub rest: Vec<[f64; 3]>,
    /// At the equilibrium.
    pub loaded: Vec<[f64; 3]>,
}

impl ComparedPoints {
    /// Adds a point.
    pub fn push(&mut self, rest: [f64; 3], loaded: [f64; 3]) {
        self.rest.push(rest);
        self.loaded.push(loaded);
    }

    /// Displacements by the loads, m.
    fn displacements(&self) -> impl Iterator<Item = [f64; 3]> {
        self.loaded.iter().zip(&self.rest).map(|(loaded, rest)| sub(*loaded, *rest))
    }
}

/// Estimated error of an equilibrium by its mesh.
#[derive(Clone, Copy, Debug)]
pub(super) struct PositionError {
    /// Largest error of a displacement by the loads, m.
    displacement: f64,
    /// Largest error of a position, m. Other than the former it contains that of the shape without loads.
    position: f64,
    /// Largest displacement, m.
    extent: f64,
    /// Length of the rod, m.
    length: f64,
}

impl PositionError {
    /// The error of the `given` positions, by those of the same points on the `other` mesh, for a rod of the `length`,
    /// m.
    pub fn new(
        comparison: MeshComparison,
        given: &ComparedPoints,
        other: &ComparedPoints,
        length: f64,
    ) -> Self {
        let ratio = comparison.error_ratio().abs();
        let largest =
            |vectors: &mut dyn Iterator<Item = [f64; 3]>| vectors.map(norm).fold(0.0, f64::max);
        let pairs = given.displacements().zip(other.displacements());
        let positions = given.loaded.iter().zip(&other.loaded);
        Self {
            displacement: ratio * largest(&mut pairs.map(|(a, b)| sub(a, b))),
            position: ratio * largest(&mut positions.map(|(a, b)| sub(*a, *b))),
            extent: largest(&mut given.displacements()),
            length,
        }
    }

    /// Whether displacements are more than rounding errors.
    fn is_displaced(&self) -> bool {
        self.extent > NO_DISPLACEMENT * self.length
    }

    /// The error over the largest one without a warning.
    pub fn excess(&self) -> f64 {
        let of_length = self.position / (MAX_OF_LENGTH * self.length);
        match self.is_displaced() {
            true => of_length.max(self.displacement / (MAX_OF_DISPLACEMENT * self.extent)),
            false => of_length,
        }
    }

    /// Whether both meshes have the same equilibrium, so that the error is that of a converging sequence.
    pub fn is_converging(&self) -> bool {
        !self.is_displaced() || self.displacement < OTHER_EQUILIBRIUM * self.extent
    }

    /// The error for a report of a given mesh with so many `segments` in all.
    pub fn report(&self, segments: usize) -> MeshError {
        let relative = self.is_displaced().then(|| self.displacement / self.extent);
        MeshError::new(segments, self.displacement, relative)
    }

    /// What a warning says about a `mesh`.
    pub fn finding(&self, mesh: &str) -> String {
        if !self.is_converging() {
            return format!(
                "the equilibrium on {mesh} differs from that on another mesh by more than the largest \
                 displacement: the mesh is too coarse, or the rod has several equilibria"
            );
        }
        let of_length = match self.position > MAX_OF_LENGTH * self.length {
            true => {
                let part = 100.0 * self.position / self.length;
                format!(", and positions one of {} % of the length", number(part, 2))
            }
            false => String::new(),
        };
        format!(
            "displacements on {mesh} have an estimated error of {}{of_length}",
            self.report(0).words()
        )
    }
}

/// Estimated errors of the frequencies of modes by their mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct FrequencyErrors {
    /// Relative error of each mode; none for free motions and without a corresponding mode.
    pub errors: Vec<Option<f64>>,
    /// Number of modes that the other mesh has and the given one does not, of those requested.
    pub missing: usize,
    /// The largest number of half waves of one of the requested modes that the given mesh does not have, or has among
    /// higher ones.
    pub half_waves: usize,
}

impl FrequencyErrors {
    /// The largest of the first `count` errors, without sign.
    fn largest(&self, count: usize) -> f64 {
        self.errors.iter().take(count).flatten().fold(0.0, |most, error| error.abs().max(most))
    }

    /// The largest of the first `count` errors over the largest one without a warning. It is infinite if one of so many
    /// modes is missing.
    pub fn excess(&self, count: usize) -> f64 {
        if self.missing > 0 { f64::INFINITY } else { self.largest(count) / MAX_OF_FREQUENCY }
    }

    /// A number of edges with which there is no warning.
    pub fn sufficient(&self, count: usize, comparison: MeshComparison) -> usize {
        // The logarithm of a frequency that is much too low follows the order of the method down to coarser meshes.
        let sizes = self.errors.iter().take(count).flatten().map(|e| e.abs().max(e.ln_1p().abs()));
        let by_error = comparison.sufficient(sizes.fold(0.0, f64::max) / MAX_OF_FREQUENCY);
        by_error.max(EDGES_PER_MODE * self.half_waves)
    }

    /// What a warning says about a `mesh`, of which `count` modes were requested.
    pub fn finding(&self, count: usize, mesh: &str) -> String {
        let is_large = |error: &&f64| error.abs() > MAX_OF_FREQUENCY;
        let large = self.errors.iter().take(count).flatten().filter(is_large).count();
        let errors = match large {
            0 => None,
            n => Some(format!(
                "{} an estimated error above {} % on {mesh}, the largest {} %",
                if n == 1 { "1 frequency has".into() } else { format!("{n} frequencies have") },
                100.0 * MAX_OF_FREQUENCY,
                number(100.0 * self.largest(count), 2)
            )),
        };
        let missing = (self.missing > 0)
            .then(|| format!("{mesh} lacks {} of those requested", counted(self.missing, "mode")));
        errors.into_iter().chain(missing).collect::<Vec<_>>().join("; ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const COMPARISON: MeshComparison = MeshComparison { segments: 10, ratio: 4.0, order: 2.0 };

    /// Frequencies 100 (1 - 3/n^2) have the error -3/n^2.
    #[test]
    fn frequency_error_of_second_order_is_exact() {
        let on = |n: f64| 100.0 * (1.0 - 3.0 / (n * n));
        let error = COMPARISON.frequency_error(on(10.0), on(40.0)).unwrap();
        assert!((error + 0.03).abs() < 1e-12, "{error}");
        let coarser = MeshComparison { ratio: 0.5, ..COMPARISON };
        let error = coarser.frequency_error(on(10.0), on(5.0)).unwrap();
        assert!((error + 0.03).abs() < 1e-12, "{error}");
        assert_eq!(COMPARISON.frequency_error(0.0, 1.0), None);
        assert_eq!(COMPARISON.frequency_error(1.0, -1.0), Some(1.0));
    }

    /// Displacements of 0.1 m with an error of second order are above the limit from 2 % on, and the stated number of
    /// edges is sufficient.
    #[test]
    fn displacement_error_decides_about_warning() {
        let points = |error: f64| {
            let mut points = ComparedPoints::default();
            points.push([0.0; 3], [0.0, 0.1 * (1.0 + error), 0.0]);
            points.push([1.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
            points
        };
        for error in [0.019, 0.021, 0.1] {
            let given = points(error);
            let found = PositionError::new(COMPARISON, &given, &points(error / 16.0), 1.0);
            assert!((found.displacement - 0.1 * error).abs() < 1e-12, "{found:?}");
            let excess = error / 0.02 / (1.0 + error);
            assert!((found.excess() - excess).abs() < 1e-9, "{found:?}");
            let sufficient = COMPARISON.sufficient(found.excess()) as f64;
            assert!(error * (10.0 / sufficient).powi(2) < 0.02);
        }
    }
}
