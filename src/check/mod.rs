//! Comparison of hand-derived derivatives with dual numbers (num-dual) and with finite differences.
//!
//! The error of an entry is relative to the sum of its absolute terms ([`CancellationBound`]), which distinguishes
//! rounding errors of a cancellation from a wrong formula. The sum includes the change of the terms by rounding errors
//! of the strains, so that an element at rest, whose terms vanish, is not compared with zero. Finite differences
//! (`finite_difference`), each at its best step, have a verdict of their own: whether both derivatives are those of the
//! energy. [`check`] compares any energy with hand-derived derivatives at given states, [`check_own`] a user-defined
//! one, and [`check_hessian`] a given Hessian. [`check_problem`] (`scene`) compares the elements of a scene, also at
//! `random_states`. [`Scaled`] is an energy of unknowns in other units. The result is a [`CheckReport`]: largest
//! errors, verdicts, the worst entry and the first entries above the [`Tolerance`] (default 1e-12 against dual numbers,
//! 1e-7 against finite differences). It passes ([`CheckReport::passed`]) if at least one state was compared and both
//! verdicts agree; `derivatives_agree` leaves finite differences out. `CheckReport::compare` adds one energy at one
//! state to a report, and `summary` returns its text.
//!
//! Parts of a report: `Errors` are the largest relative errors, `Verdicts` those by dual numbers and by finite
//! differences, `Worst` the entry with the largest difference from dual numbers, `Above` the listed entries, and
//! `ValleyPoint` the errors of finite differences at one step size.

mod finite_difference;
mod own;
mod random_states;
mod scaled;
mod scene;

pub use crate::numerics::term_bound::CancellationBound;
#[doc(hidden)]
#[deprecated(since = "0.2.0", note = "renamed to CancellationBound")]
pub use crate::numerics::term_bound::CancellationBound as Terms;
pub use own::{Configuration, NodesAndEdges, check_own};
pub use scaled::Scaled;
pub use scene::check_problem;

use crate::check::finite_difference::{
    Difference, Expected, STEPS, compare_differences, relative, scale,
};
use crate::code::Code;
use crate::energy::{Analytic, Energy};
use crate::numerics::out_of_line::OutOfLine;
use crate::summary::quantity::counted;
use crate::summary::{ItemTable, Summary, SummaryTable, TextColumn, Tone};
use num_dual::HyperDual64;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Largest allowed relative errors of derivatives. Defaults: 1e-12 against dual numbers, 1e-7 against finite
/// differences.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tolerance {
    /// Largest error of hand-derived gradients against dual numbers.
    pub gradient: f64,
    /// Largest error of hand-derived Hessians against dual numbers.
    pub hessian: f64,
    /// Largest error of either against finite differences, each at its best step.
    pub finite_difference: f64,
}

impl Default for Tolerance {
    /// Tolerances of 1e-12 for gradients and Hessians against dual numbers, and of 1e-7 against finite differences.
    fn default() -> Self {
        Self { gradient: 1e-12, hessian: 1e-12, finite_difference: 1e-7 }
    }
}

/// Largest relative errors found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Errors {
    /// Largest error of hand-derived gradients against dual numbers.
    #[serde(deserialize_with = "crate::input::arrays::or_infinite")]
    pub gradient: f64,
    /// Largest error of hand-derived Hessians against dual numbers.
    #[serde(deserialize_with = "crate::input::arrays::or_infinite")]
    pub hessian: f64,
    /// Largest error of either against finite differences, each at its best step.
    #[serde(deserialize_with = "crate::input::arrays::or_infinite")]
    pub finite_difference: f64,
}

/// Entry with the largest difference between the hand-derived value and dual numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Worst {
    /// Name of the element.
    pub element: String,
    /// `gradient` or `hessian`.
    pub quantity: String,
    /// Name of the unknown, or of the two of a Hessian's entry.
    pub dof: String,
    /// The hand-derived value.
    pub hand: f64,
    /// The value by num-dual.
    pub dual: f64,
    /// Difference over the sum of absolute terms.
    #[serde(deserialize_with = "crate::input::arrays::or_infinite")]
    pub relative_error: f64,
}

/// Derivative with an error above the tolerance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Above {
    /// Name of the element.
    pub element: String,
    /// `gradient` or `hessian`.
    pub quantity: String,
    /// Name of the unknown, or of the two of a Hessian's entry.
    pub dof: String,
    /// The hand-derived value.
    pub hand: f64,
    /// Method of comparison: `dual` or `finite difference`.
    pub against: String,
    /// The value by that.
    pub other: f64,
    /// Difference over the sum of absolute terms.
    #[serde(deserialize_with = "crate::input::arrays::or_infinite")]
    pub relative_error: f64,
}

/// Whether derivatives of two methods agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// They agree at every state.
    Agree,
    /// They disagree at one state or more.
    Disagree,
}

/// Verdicts on the hand-derived derivatives by both methods.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Verdicts {
    /// Hand-derived against automatic derivatives.
    pub hand_dual: Verdict,
    /// Hand-derived derivatives against finite differences.
    pub finite_difference: Verdict,
}

/// Largest size of an entry that must vanish, relative to its terms. Smaller values report rounding errors, larger ones
/// hide small forces out of the plane.
const LARGEST_ZERO: f64 = 1e-9;
/// Number of entries above the limits that a report lists.
const MOST_ABOVE: usize = 20;

/// Errors of finite differences at one step size: large steps truncate, small ones round.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ValleyPoint {
    /// Step over the energy's own scale, the length over which it is smooth.
    pub step: f64,
    /// Largest error of a gradient.
    #[serde(deserialize_with = "crate::input::arrays::or_infinite")]
    pub gradient: f64,
    /// Largest error of a Hessian.
    #[serde(deserialize_with = "crate::input::arrays::or_infinite")]
    pub hessian: f64,
}

/// The result of a check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct CheckReport {
    /// Largest errors over all states.
    pub max_relative_error: Errors,
    /// Entry with the largest difference; absent if all hand-derived entries equal those by dual numbers.
    pub worst: Option<Worst>,
    /// Verdicts by both methods.
    pub verdicts: Verdicts,
    /// The first twenty derivatives above the limits.
    pub above: Vec<Above>,
    /// Number of all derivatives above the limits.
    pub above_count: usize,
    /// Errors of finite differences over all states, by step size.
    pub valley: Vec<ValleyPoint>,
    /// Number of compared states.
    pub states: usize,
    /// The limits that errors must stay below.
    pub tolerance: Tolerance,
}

impl CheckReport {
    /// An empty report before the first state: errors of zero at every step size, both verdicts `Agree`, no worst or
    /// listed entries, no compared states.
    pub fn new(tolerance: Tolerance) -> Self {
        let valley = STEPS.map(|step| ValleyPoint { step, gradient: 0.0, hessian: 0.0 });
        Self {
            max_relative_error: Errors::default(),
            worst: None,
            verdicts: Verdicts { hand_dual: Verdict::Agree, finite_difference: Verdict::Agree },
            above: Vec::new(),
            above_count: 0,
            valley: valley.to_vec(),
            states: 0,
            tolerance,
        }
    }

    /// Whether at least one state was compared, and hand-derived derivatives agree with dual numbers and with finite
    /// differences.
    pub fn passed(&self) -> bool {
        self.derivatives_agree() && self.verdicts.finite_difference == Verdict::Agree
    }

    /// Whether at least one state was compared and hand-derived derivatives agree with dual numbers, independent of
    /// finite differences.
    pub fn derivatives_agree(&self) -> bool {
        self.states > 0 && self.verdicts.hand_dual == Verdict::Agree
    }

    /// Compares the hand-derived gradient and Hessian of `energy` at the unknowns `q` with dual numbers and finite
    /// differences, and adds the errors and one state to this report. `element` names the energy, `dof(i)` its unknown
    /// `i`. Errors are relative to the sum of absolute terms ([`CancellationBound`]).
    pub fn compare<const N: usize>(
        &mut self,
        energy: &impl Analytic<N>,
        q: &[f64; N],
        element: &str,
        dof: impl Fn(usize) -> String,
    ) {
        // DerivativeSources of any size share one comparison: the number of unknowns is not a type there.
        let array = |q: &[f64]| *q.first_chunk::<N>().expect("so many unknowns");
        // One evaluation with bounds of the terms gives the sizes of all derivatives.
        let terms = energy.energy(&CancellationBound::rounded_unknowns(q).map(OutOfLine)).0;
        let routes = DerivativeSources {
            energy: &|q| energy.energy(&array(q)),
            gradient: &|q| energy.gradient(&array(q)).to_vec(),
            hand: GradientAndHessian::new(&energy.gradient(q), &energy.hessian(q)),
            dual: GradientAndHessian::new(&dual_gradient(energy, q), &dual_hessian(energy, q)),
            terms: GradientAndHessian::new(&terms.first, &terms.second),
        };
        self.compare_routes(routes, q, element, &dof);
    }

    /// Compares hand-derived derivatives at the unknowns `q` with dual numbers and finite differences. It updates the
    /// largest errors, the worst entry, verdicts, listed entries and errors by step size, and adds one state. Errors of
    /// finite differences, each at its best step `h`, are relative to the terms plus their change over a step. With the
    /// largest diagonal sum `s` of the Hessian's terms and the length scale `l` this change is `h s` for gradients and
    /// `h s/l` for Hessians.
    fn compare_routes(
        &mut self,
        routes: DerivativeSources<'_>,
        q: &[f64],
        element: &str,
        dof: &dyn Fn(usize) -> String,
    ) {
        let DerivativeSources { energy, gradient: by_hand, hand, dual, terms } = routes;
        // Entry by entry: hand-derived against dual numbers, relative to the sum of absolute
        // terms.
        for i in 0..q.len() {
            let name = || dof(i);
            let entry = DerivativeEntry { quantity: "gradient", element, dof: &name };
            self.compare_entry(&entry, hand.gradient[i], dual.gradient[i], terms.gradient[i]);
            for j in 0..q.len() {
                let name = || format!("{} {}", dof(i), dof(j));
                let entry = DerivativeEntry { quantity: "hessian", element, dof: &name };
                let terms = terms.hessian[i][j];
                self.compare_entry(&entry, hand.hessian[i][j], dual.hessian[i][j], terms);
            }
        }
        // A difference depends on the values around the state too. So where a derivative vanishes, its error is
        // relative to the values that it reaches within a step.
        let stiffest = (0..q.len()).map(|i| terms.hessian[i][i]).fold(0.0, f64::max);
        let scale = scale(q, by_hand, stiffest);
        let gradients = compare_differences(q, scale, &|q| vec![energy(q)], &|[j, _], h| {
            Expected { derivative: hand.gradient[j], size: terms.gradient[j] + h * stiffest }
        });
        let hessians = compare_differences(q, scale, by_hand, &|[j, i], h| Expected {
            derivative: hand.hessian[i][j],
            size: terms.hessian[i][j] + h / scale * stiffest,
        });
        // Errors by step size: truncation at large steps, rounding at small ones.
        for (k, point) in self.valley.iter_mut().enumerate() {
            point.gradient = point.gradient.max(gradients.worst_per_step[k]);
            point.hessian = point.hessian.max(hessians.worst_per_step[k]);
        }
        for d in gradients.best {
            let name = || dof(d.place[0]);
            self.compare_difference(
                &DerivativeEntry { quantity: "gradient", element, dof: &name },
                &d,
            );
        }
        for d in hessians.best {
            let name = || format!("{} {}", dof(d.place[1]), dof(d.place[0]));
            self.compare_difference(
                &DerivativeEntry { quantity: "hessian", element, dof: &name },
                &d,
            );
        }
        self.states += 1;
    }

    /// Compares a hand-derived entry with its value by dual numbers, relative to `terms`, the sum of its absolute
    /// terms. Updates the largest error and the worst entry; an error above the tolerance is counted and listed, and
    /// sets the verdict `hand_dual` to `Disagree`.
    fn compare_entry(&mut self, entry: &DerivativeEntry<'_>, hand: f64, dual: f64, terms: f64) {
        let relative_error = relative(hand - dual, terms);
        let (largest, allowed) = match entry.quantity {
            "gradient" => (&mut self.max_relative_error.gradient, self.tolerance.gradient),
            _ => (&mut self.max_relative_error.hessian, self.tolerance.hessian),
        };
        // The largest error counts, whether it is above the limit or not.
        *largest = largest.max(relative_error);
        if relative_error > allowed {
            self.verdicts.hand_dual = Verdict::Disagree;
            self.list_above(entry, hand, "dual", dual, relative_error);
        }
        // The worst entry of all states, by its relative error.
        let before = self.worst.as_ref().map_or(0.0, |worst| worst.relative_error);
        if relative_error > before {
            let (element, quantity) = (entry.element.into(), entry.quantity.into());
            let dof = (entry.dof)();
            self.worst = Some(Worst { element, quantity, dof, hand, dual, relative_error });
        }
    }

    /// Compares a hand-derived entry with its finite difference at the best step. Updates the largest error; one above
    /// the tolerance is counted and listed, and sets the verdict `finite_difference` to `Disagree`.
    fn compare_difference(&mut self, entry: &DerivativeEntry<'_>, d: &Difference) {
        let largest = &mut self.max_relative_error.finite_difference;
        *largest = largest.max(d.error);
        if d.error > self.tolerance.finite_difference {
            self.verdicts.finite_difference = Verdict::Disagree;
            self.list_above(entry, d.expected, "finite difference", d.found, d.error);
        }
    }

    /// Compares `found`, a component of a gradient that must vanish, with `size`, the size of its terms. Above
    /// [`LARGEST_ZERO`] the entry `name` is listed and the verdict `hand_dual` becomes `Disagree`; largest errors do
    /// not change.
    fn compare_with_zero(&mut self, name: &str, found: f64, size: f64, element: &str) {
        let relative_error = relative(found, size);
        if relative_error > LARGEST_ZERO {
            self.verdicts.hand_dual = Verdict::Disagree;
            let name = || name.to_string();
            let entry = DerivativeEntry { quantity: "gradient", element, dof: &name };
            self.list_above(&entry, 0.0, "the energy in space", found, relative_error);
        }
    }

    /// Counts an entry with an error above its limit in `above_count`, and lists it if it is one of the first
    /// [`MOST_ABOVE`]. The list has both values, the method of comparison (`against`) and the error.
    fn list_above(
        &mut self,
        entry: &DerivativeEntry<'_>,
        hand: f64,
        against: &str,
        other: f64,
        relative_error: f64,
    ) {
        self.above_count += 1;
        if self.above.len() < MOST_ABOVE {
            self.above.push(Above {
                element: entry.element.into(),
                quantity: entry.quantity.into(),
                dof: (entry.dof)(),
                hand,
                against: against.into(),
                other,
                relative_error,
            });
        }
    }
}

/// Names of an entry of a gradient or Hessian, for a report.
struct DerivativeEntry<'a> {
    /// `gradient` or `hessian`.
    quantity: &'static str,
    /// Name of the element.
    element: &'a str,
    /// Name of the unknown, or of the two of a Hessian's entry.
    dof: &'a dyn Fn() -> String,
}

/// Gradient and Hessian of any size, or the sums of their absolute terms. Its size is no type parameter, because
/// compile time matters more than run time here.
struct GradientAndHessian {
    gradient: Vec<f64>,
    hessian: Vec<Vec<f64>>,
}

impl GradientAndHessian {
    /// Copies a gradient and a full Hessian by `N` unknowns into lists, the Hessian row by row.
    fn new<const N: usize>(gradient: &[f64; N], hessian: &[[f64; N]; N]) -> Self {
        Self {
            gradient: gradient.to_vec(),
            hessian: hessian.iter().map(|row| row.to_vec()).collect(),
        }
    }
}

/// Energy and its derivatives at a state, from independent formulas.
struct DerivativeSources<'a> {
    /// Energy of given unknowns.
    energy: &'a dyn Fn(&[f64]) -> f64,
    /// Hand-derived gradient of given unknowns.
    gradient: &'a dyn Fn(&[f64]) -> Vec<f64>,
    /// Hand-derived derivatives at the state.
    hand: GradientAndHessian,
    /// Derivatives by dual numbers at the state.
    dual: GradientAndHessian,
    /// Sums of the absolute terms of every entry.
    terms: GradientAndHessian,
}

/// Energy at `q` as a hyper-dual number with first derivatives by the two unknowns `pair` and their mixed second
/// derivative; of two equal indices the second derivative by that unknown. Larger dual numbers, with all unknowns,
/// would save less run time than they cost to compile.
fn energy_along<const N: usize>(
    energy: &impl Energy<N>,
    q: &[f64; N],
    pair: [usize; 2],
) -> HyperDual64 {
    let [one, other] = pair.map(|i| move |k: usize| f64::from(u8::from(k == i)));
    let along = |k: usize| OutOfLine(HyperDual64::new(q[k], one(k), other(k), 0.0));
    energy.energy(&std::array::from_fn(along)).0
}

/// Gradient of `energy` at `q` by hyper-dual numbers (num-dual), one evaluation for each unknown.
fn dual_gradient<const N: usize>(energy: &impl Energy<N>, q: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| energy_along(energy, q, [i, i]).eps1)
}

/// Symmetric Hessian of `energy` at `q` by hyper-dual numbers (num-dual), one evaluation for each pair of unknowns.
fn dual_hessian<const N: usize>(energy: &impl Energy<N>, q: &[f64; N]) -> [[f64; N]; N] {
    let mut hessian = [[0.0; N]; N];
    for (i, j) in (0..N).flat_map(|i| (0..=i).map(move |j| (i, j))) {
        // The Hessian is symmetric: one evaluation serves both entries of a pair.
        let slope = energy_along(energy, q, [i, j]).eps1eps2;
        (hessian[i][j], hessian[j][i]) = (slope, slope);
    }
    hessian
}

/// Checks the hand-derived gradient and Hessian of an energy against dual numbers and finite differences, at each of
/// the `states`, and returns the report of all. Unknowns are named `q[i]`.
///
/// ```
/// use rodfit::{Analytic, Energy, Scalar, check::{Tolerance, check}};
/// struct Spring;
/// impl Energy<2> for Spring {
///     fn energy<D: Scalar>(&self, q: &[D; 2]) -> D { (q[1] - q[0]).powi(2) * 0.5 }
/// }
/// impl Analytic<2> for Spring {
///     fn gradient(&self, q: &[f64; 2]) -> [f64; 2] { [q[0] - q[1], q[1] - q[0]] }
///     fn hessian(&self, _: &[f64; 2]) -> [[f64; 2]; 2] { [[1.0, -1.0], [-1.0, 1.0]] }
/// }
/// assert!(check(&Spring, &[[0.1, 0.5], [2.0, -1.0]], Tolerance::default()).passed());
/// ```
pub fn check<const N: usize>(
    energy: &impl Analytic<N>,
    states: &[[f64; N]],
    tolerance: Tolerance,
) -> CheckReport {
    let mut report = CheckReport::new(tolerance);
    for (k, q) in states.iter().enumerate() {
        report.compare(energy, q, &format!("state {k}"), |i| format!("q[{i}]"));
    }
    report
}

/// Checks a given full `hessian` of `energy` at the unknowns `q` against num-dual, and against finite differences of
/// the gradient by num-dual, with the default tolerances. Unknowns are named `q[i]`. The gradient of the report is that
/// of num-dual itself.
pub fn check_hessian<const N: usize>(
    energy: &impl Energy<N>,
    q: &[f64; N],
    hessian: &[[f64; N]; N],
) -> CheckReport {
    /// An energy with a Hessian given as numbers; its gradient is by num-dual.
    struct Foreign<'a, E, const N: usize>(&'a E, &'a [[f64; N]; N]);
    impl<E: Energy<N>, const N: usize> Energy<N> for Foreign<'_, E, N> {
        /// The energy, J, of the inner energy.
        fn energy<D: crate::Scalar>(&self, q: &[D; N]) -> D {
            self.0.energy(q)
        }
    }
    impl<E: Energy<N>, const N: usize> Analytic<N> for Foreign<'_, E, N> {
        /// The gradient by num-dual.
        fn gradient(&self, q: &[f64; N]) -> [f64; N] {
            dual_gradient(self.0, q)
        }
        /// The given Hessian.
        fn hessian(&self, _: &[f64; N]) -> [[f64; N]; N] {
            *self.1
        }
    }
    check(&Foreign(energy, hessian), &[*q], Tolerance::default())
}

impl fmt::Display for CheckReport {
    /// Writes the [summary](Self::summary) of the report.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}

impl CheckReport {
    /// The report as text for a terminal: the verdict as status, and a table of largest errors with their limits. Below
    /// are the largest difference, the listed entries above the limits, and the errors of finite differences by step
    /// size. Hand-derived derivatives that disagree with dual numbers have a code, and so has a report without a state.
    pub fn summary(&self) -> Summary {
        let (found, allowed) = (&self.max_relative_error, &self.tolerance);
        let is_confirmed = matches!(self.verdicts.finite_difference, Verdict::Agree);
        let states = counted(self.states, "state");
        let summary = match (self.derivatives_agree(), is_confirmed) {
            _ if self.states == 0 => {
                Summary::new("no state was compared: the derivatives are not checked", Tone::Bad)
            }
            (true, true) => Summary::new(format!("derivatives agree at {states}"), Tone::Good),
            (true, false) => Summary::new(
                format!(
                    "finite differences disagree with the hand-derived derivatives at {states}"
                ),
                Tone::Bad,
            ),
            (false, _) => Summary::new(
                format!("hand-derived and automatic derivatives disagree at {states}"),
                Tone::Bad,
            )
            .with_code(Some(Code::DerivativesDisagree)),
        };
        // One row for each comparison: error, limit, verdict.
        let mut table = SummaryTable::new([
            TextColumn::left("hand-derived"),
            TextColumn::left("compared with"),
            TextColumn::right("largest error"),
            TextColumn::right("allowed"),
            TextColumn::left("verdict"),
        ]);
        let mut row = |name: &str, against: &str, error: f64, limit: f64, agree: bool| {
            let verdict = if agree { "agree" } else { "DISAGREE" };
            table.row([name, against, &format!("{error:.2e}"), &format!("{limit:.0e}"), verdict]);
        };
        let mut dual = |name: &str, error: f64, limit: f64| {
            row(name, "dual numbers", error, limit, error <= limit);
        };
        dual("gradient", found.gradient, allowed.gradient);
        dual("Hessian", found.hessian, allowed.hessian);
        let (error, limit) = (found.finite_difference, allowed.finite_difference);
        row("both", "finite differences", error, limit, is_confirmed);
        let mut summary = summary
            .table("", table)
            .note("errors relative to the sum of absolute terms")
            .warnings(Vec::<String>::new());
        if let Some(w) = &self.worst {
            let text = format!(
                "{} of {}, {}: hand-derived {:e}, dual numbers {:e}",
                w.quantity, w.element, w.dof, w.hand, w.dual
            );
            summary = summary.fact("Largest difference", text);
        }
        // The listed entries above their limits.
        let above = ItemTable::new(&self.above)
            .left("quantity", |a| a.quantity.clone())
            .left("element", |a| a.element.clone())
            .wrapped("unknowns", |a| a.dof.clone())
            .wrapped("by hand", |a| format!("{:e}", a.hand))
            .wrapped("by the other method", |a| format!("{:e} ({})", a.other, a.against))
            .right("error", |a| format!("{:.1e}", a.relative_error));
        let title = match self.above_count > self.above.len() {
            true => {
                format!("Above the limits: the first {} of {}", self.above.len(), self.above_count)
            }
            false => "Above the limits".into(),
        };
        // Errors by step size: a valley with a low minimum confirms the formula.
        let steps = ItemTable::new(&self.valley)
            .right("step", |p| format!("{:.0e}", p.step))
            .right("gradient", |p| format!("{:.2e}", p.gradient))
            .right("Hessian", |p| format!("{:.2e}", p.hessian));
        summary.table(title, above).table("Errors of finite differences by their step", steps)
    }
}
