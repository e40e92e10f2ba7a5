//! Hand-derived derivatives against num-dual against finite differences.
//!
//! An entry's error is relative to the sum of the absolute terms that make it ([`Terms`]), so that
//! rounding errors of a cancellation are not mistaken for a wrong formula, nor a wrong formula for
//! rounding. That sum has a floor of the element's own scale: what rounding errors of its strains change of
//! the terms, so that an element at rest, whose terms vanish, is not compared with zero. Finite differences are a third opinion with a verdict of its own: they say whether both
//! derivatives are those of the energy. [`check`] takes any energy with hand-derived derivatives, [`check_hessian`] a Hessian
//! from elsewhere, and [`check_problem`] all elements of a scene.

mod finite_difference;
mod own;
mod scaled;
mod scene;

pub use crate::numerics::term_bound::Terms;
pub use own::{Configuration, check_own};
pub use scaled::Scaled;
pub use scene::check_problem;

use crate::check::finite_difference::{Difference, STEPS, difference, relative, scale};
use crate::code::Code;
use crate::energy::{Analytic, Energy};
use crate::numerics::out_of_line::OutOfLine;
use crate::summary::quantity::counted;
use crate::summary::{Summary, SummaryTable, TextColumn, Tone};
use num_dual::HyperDual64;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Largest errors that pass.
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

/// The entry where hand and dual differ most.
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

/// A derivative whose error is above what passes.
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
    /// What it is compared with: `dual` or `finite difference`.
    pub against: String,
    /// The value by that.
    pub other: f64,
    /// Difference over the sum of absolute terms.
    #[serde(deserialize_with = "crate::input::arrays::or_infinite")]
    pub relative_error: f64,
}

/// Whether two ways to a derivative agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// At every state.
    Agree,
    /// Somewhere not.
    Disagree,
}

/// What the check says of the derivation, and what the third opinion is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Verdicts {
    /// Hand-derived against automatic derivatives.
    pub hand_dual: Verdict,
    /// Hand-derived derivatives against finite differences.
    pub finite_difference: Verdict,
}

/// What ought to be zero may be this part of what is beside it.
const STAYS: f64 = 1e-9;
/// So many entries above the limits are kept.
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
    /// Absent when hand and dual agree to the last bit everywhere.
    pub worst: Option<Worst>,
    /// Which ways to the derivatives agree.
    pub verdicts: Verdicts,
    /// The first twenty derivatives above the limits.
    pub above: Vec<Above>,
    /// How many there are.
    pub above_count: usize,
    /// Over all states, by step size.
    pub valley: Vec<ValleyPoint>,
    /// How many states were compared.
    pub states: usize,
    /// The limits that errors must stay below.
    pub tolerance: Tolerance,
}

impl CheckReport {
    /// A report of nothing yet.
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

    /// Whether every error is within its tolerance.
    pub fn passed(&self) -> bool {
        self.derivatives_agree() && self.verdicts.finite_difference == Verdict::Agree
    }

    /// Whether hand-derived and automatic derivatives agree, whatever finite differences say.
    pub fn derivatives_agree(&self) -> bool {
        self.states > 0 && self.verdicts.hand_dual == Verdict::Agree
    }

    /// Compares one state; `element` and `dof` name it and its unknowns.
    pub fn compare<const N: usize>(
        &mut self,
        energy: &impl Analytic<N>,
        q: &[f64; N],
        element: &str,
        dof: impl Fn(usize) -> String,
    ) {
        let array = |q: &[f64]| *q.first_chunk::<N>().expect("so many unknowns");
        let terms = energy.energy(&Terms::rounded_unknowns(q).map(OutOfLine)).0;
        let routes = Routes {
            energy: &|q| energy.energy(&array(q)),
            gradient: &|q| energy.gradient(&array(q)).to_vec(),
            hand: both(&energy.gradient(q), &energy.hessian(q)),
            dual: both(&dual_gradient(energy, q), &dual_hessian(energy, q)),
            terms: both(&terms.first, &terms.second),
        };
        self.compare_routes(routes, q, element, &dof);
    }

    /// The same of what is known of an energy at `q`.
    fn compare_routes(
        &mut self,
        routes: Routes<'_>,
        q: &[f64],
        element: &str,
        dof: &dyn Fn(usize) -> String,
    ) {
        let Routes { energy, gradient: by_hand, hand, dual, terms } = routes;
        let ((hand_gradient, hand_hessian), (gradient, hessian)) = (hand, dual);
        let (first_terms, second_terms) = terms;
        for i in 0..q.len() {
            let name = || dof(i);
            let pair = [hand_gradient[i], gradient[i]];
            self.entry("gradient", pair, first_terms[i], element, &name);
            for j in 0..q.len() {
                let name = || format!("{} {}", dof(i), dof(j));
                let pair = [hand_hessian[i][j], hessian[i][j]];
                self.entry("hessian", pair, second_terms[i][j], element, &name);
            }
        }
        // A difference sees the values around the state too, so where a derivative vanishes its
        // error is measured by what it grows to within a step.
        let stiffest = (0..q.len()).map(|i| second_terms[i][i]).fold(0.0, f64::max);
        let scale = scale(q, by_hand, stiffest);
        let (by_energy, gradients) = difference(q, scale, &|q| vec![energy(q)], &|[j, _], h| {
            (hand_gradient[j], first_terms[j] + h * stiffest)
        });
        let (by_gradient, hessians) = difference(q, scale, by_hand, &|[j, i], h| {
            (hand_hessian[i][j], second_terms[i][j] + h / scale * stiffest)
        });
        for (k, point) in self.valley.iter_mut().enumerate() {
            point.gradient = point.gradient.max(by_energy[k]);
            point.hessian = point.hessian.max(by_gradient[k]);
        }
        for d in gradients {
            self.third_opinion("gradient", d, element, &|| dof(d.place[0]));
        }
        for d in hessians {
            let [j, i] = d.place;
            self.third_opinion("hessian", d, element, &|| format!("{} {}", dof(i), dof(j)));
        }
        self.states += 1;
    }

    fn entry(
        &mut self,
        quantity: &'static str,
        [hand, dual]: [f64; 2],
        terms: f64,
        element: &str,
        dof: &dyn Fn() -> String,
    ) {
        let relative_error = relative(hand - dual, terms);
        let (largest, allowed) = match quantity {
            "gradient" => (&mut self.max_relative_error.gradient, self.tolerance.gradient),
            _ => (&mut self.max_relative_error.hessian, self.tolerance.hessian),
        };
        *largest = largest.max(relative_error);
        if relative_error > allowed {
            self.verdicts.hand_dual = Verdict::Disagree;
            let (element, dof) = (element.to_string(), dof());
            self.list(Above {
                element,
                quantity: quantity.into(),
                dof,
                hand,
                against: "dual".into(),
                other: dual,
                relative_error,
            });
        }
        let before = self.worst.as_ref().map_or(0.0, |worst| worst.relative_error);
        if relative_error > before {
            let (element, dof) = (element.to_string(), dof());
            let quantity = quantity.into();
            self.worst = Some(Worst { element, quantity, dof, hand, dual, relative_error });
        }
    }

    /// Takes a difference at its best step.
    fn third_opinion(
        &mut self,
        quantity: &'static str,
        d: Difference,
        element: &str,
        dof: &dyn Fn() -> String,
    ) {
        let largest = &mut self.max_relative_error.finite_difference;
        *largest = largest.max(d.error);
        if d.error > self.tolerance.finite_difference {
            self.verdicts.finite_difference = Verdict::Disagree;
            let (element, dof) = (element.to_string(), dof());
            let (hand, other, relative_error) = (d.expected, d.found, d.error);
            let (quantity, against) = (quantity.into(), "finite difference".into());
            self.list(Above { element, quantity, dof, hand, against, other, relative_error });
        }
    }

    /// Something that ought to be zero beside what is of some `size`.
    fn stays(&mut self, what: &str, found: f64, size: f64, element: &str) {
        let relative_error = relative(found, size);
        if relative_error > STAYS {
            self.verdicts.hand_dual = Verdict::Disagree;
            self.list(Above {
                element: element.into(),
                quantity: "gradient".into(),
                dof: what.into(),
                hand: 0.0,
                against: "the energy in space".into(),
                other: found,
                relative_error,
            });
        }
    }

    fn list(&mut self, above: Above) {
        self.above_count += 1;
        if self.above.len() < MOST_ABOVE {
            self.above.push(above);
        }
    }
}

/// Gradient and Hessian, or their terms. Of any size: nobody waits for a check, but for its compilation.
type Both = (Vec<f64>, Vec<Vec<f64>>);

fn both<const N: usize>(gradient: &[f64; N], hessian: &[[f64; N]; N]) -> Both {
    (gradient.to_vec(), hessian.iter().map(|row| row.to_vec()).collect())
}

/// An energy by all routes at a state.
struct Routes<'a> {
    energy: &'a dyn Fn(&[f64]) -> f64,
    gradient: &'a dyn Fn(&[f64]) -> Vec<f64>,
    hand: Both,
    dual: Both,
    terms: Both,
}

/// The energy by num-dual along two unknowns, by two at a time: what numbers of a size for each number of unknowns would save is
/// nothing beside the time to compile them.
fn along<const N: usize>(energy: &impl Energy<N>, q: &[f64; N], pair: [usize; 2]) -> HyperDual64 {
    let [one, other] = pair.map(|i| move |k: usize| f64::from(u8::from(k == i)));
    let along = |k: usize| OutOfLine(HyperDual64::new(q[k], one(k), other(k), 0.0));
    energy.energy(&std::array::from_fn(along)).0
}

/// The gradient by num-dual.
fn dual_gradient<const N: usize>(energy: &impl Energy<N>, q: &[f64; N]) -> [f64; N] {
    std::array::from_fn(|i| along(energy, q, [i, i]).eps1)
}

/// The Hessian by num-dual.
fn dual_hessian<const N: usize>(energy: &impl Energy<N>, q: &[f64; N]) -> [[f64; N]; N] {
    let mut hessian = [[0.0; N]; N];
    for (i, j) in (0..N).flat_map(|i| (0..=i).map(move |j| (i, j))) {
        let slope = along(energy, q, [i, j]).eps1eps2;
        (hessian[i][j], hessian[j][i]) = (slope, slope);
    }
    hessian
}

/// Checks the hand-derived gradient and Hessian of an energy at `states`.
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

/// Checks a Hessian from elsewhere at one state, against num-dual and finite differences of
/// num-dual's gradient.
pub fn check_hessian<const N: usize>(
    energy: &impl Energy<N>,
    q: &[f64; N],
    hessian: &[[f64; N]; N],
) -> CheckReport {
    struct Foreign<'a, E, const N: usize>(&'a E, &'a [[f64; N]; N]);
    impl<E: Energy<N>, const N: usize> Energy<N> for Foreign<'_, E, N> {
        fn energy<D: crate::Scalar>(&self, q: &[D; N]) -> D {
            self.0.energy(q)
        }
    }
    impl<E: Energy<N>, const N: usize> Analytic<N> for Foreign<'_, E, N> {
        fn gradient(&self, q: &[f64; N]) -> [f64; N] {
            dual_gradient(self.0, q)
        }
        fn hessian(&self, _: &[f64; N]) -> [[f64; N]; N] {
            *self.1
        }
    }
    check(&Foreign(energy, hessian), &[*q], Tolerance::default())
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.summary().fmt(f)
    }
}

impl CheckReport {
    /// The result as text for a terminal.
    pub fn summary(&self) -> Summary {
        let (found, allowed) = (&self.max_relative_error, &self.tolerance);
        let is_confirmed = matches!(self.verdicts.finite_difference, Verdict::Agree);
        let states = counted(self.states, "state");
        let summary = match (self.derivatives_agree(), is_confirmed) {
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
            .coded(Some(Code::DerivativesDisagree)),
        };
        let mut table = SummaryTable::new([
            TextColumn::left("hand-derived"),
            TextColumn::left("compared with"),
            TextColumn::right("largest error"),
            TextColumn::right("allowed"),
            TextColumn::left("verdict"),
        ]);
        let verdict = |is_agreement: bool| if is_agreement { "agree" } else { "DISAGREE" };
        let mut row = |name: &str, against: &str, error: f64, limit: f64, agree: bool| {
            let [error, limit] = [format!("{error:.2e}"), format!("{limit:.0e}")];
            table.row([name, against, &error, &limit, verdict(agree)]);
        };
        let is_within = |error: f64, limit: f64| error <= limit;
        let dual = "dual numbers";
        let own = is_within(found.gradient, allowed.gradient);
        row("gradient", dual, found.gradient, allowed.gradient, own);
        let own = is_within(found.hessian, allowed.hessian);
        row("Hessian", dual, found.hessian, allowed.hessian, own);
        let (error, limit) = (found.finite_difference, allowed.finite_difference);
        row("both", "finite differences", error, limit, is_confirmed);
        let mut summary = summary
            .table("", table)
            .note("errors relative to the sum of absolute terms")
            .warnings(Vec::<String>::new());
        if let Some(w) = &self.worst {
            let text = format!(
                "{} of {}, {}: by hand {:e}, by dual numbers {:e}",
                w.quantity, w.element, w.dof, w.hand, w.dual
            );
            summary = summary.fact("Largest difference", text);
        }
        let mut above = SummaryTable::new([
            TextColumn::left("quantity"),
            TextColumn::left("element"),
            TextColumn::wrapped("unknowns"),
            TextColumn::wrapped("by hand"),
            TextColumn::wrapped("by the other method"),
            TextColumn::right("error"),
        ]);
        for a in &self.above {
            let hand = format!("{:e}", a.hand);
            let other = format!("{:e} ({})", a.other, a.against);
            let error = format!("{:.1e}", a.relative_error);
            above.row([
                a.quantity.to_string(),
                a.element.to_string(),
                a.dof.to_string(),
                hand,
                other,
                error,
            ]);
        }
        let title = match self.above_count > self.above.len() {
            true => {
                format!("Above the limits: the first {} of {}", self.above.len(), self.above_count)
            }
            false => "Above the limits".into(),
        };
        let mut steps = SummaryTable::new([
            TextColumn::right("step"),
            TextColumn::right("gradient"),
            TextColumn::right("Hessian"),
        ]);
        for p in &self.valley {
            let numbers = [format!("{:.0e}", p.step), format!("{:.2e}", p.gradient)];
            let [step, gradient] = numbers;
            steps.row([step, gradient, format!("{:.2e}", p.hessian)]);
        }
        summary.table(title, above).table("Errors of finite differences by their step", steps)
    }
}
