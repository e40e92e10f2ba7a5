//! Checks of [energies of one's own](crate::energy::own).

use crate::check::{CheckReport, Routes, Tolerance};
use crate::energy::adapter::{AnyEnergy, Local, MOST, Over, Site};
use crate::energy::own::{By, OwnEnergy};
use crate::energy::place::{Directors, Place, numbers};
use crate::energy::{Analytic, Derivatives, Energy};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, dot};

/// Where an energy over `N` nodes is looked at, and where it is at rest; all in the world, m. Of the
/// edges the first `N - 1` count.
#[derive(Clone, Copy, Debug)]
pub struct Configuration<const N: usize> {
    /// Arc length from the wall.
    pub arc_length: f64,
    /// How much of the rod's length it stands for.
    pub length: f64,
    /// Nodes and edges at rest.
    pub rest: ([Vector<f64>; N], [Directors<f64>; 2]),
    /// Nodes and edges now.
    pub now: ([Vector<f64>; N], [Directors<f64>; 2]),
}

/// Checks the derivatives of an energy of one's own by nodes and directors, each independent of all
/// others, with these values of its parameters: those by hand, if it has any, against automatic ones,
/// and both against finite differences.
///
/// ```
/// use rodfit::check::{Configuration, Tolerance, check_own};
/// use rodfit::energy::{By, Curvatures, Directors, OwnEnergy, Place, Slopes};
/// use rodfit::numerics::vector::{Vector, scale, sub};
/// use rodfit::{Scalar, scene::number::Quantity};
///
/// /// A spring to a point.
/// struct Spring([f64; 3]);
///
/// impl OwnEnergy<1, 1> for Spring {
///     const PARAMETERS: [(&'static str, Quantity); 1] = [("k", Quantity::positive("N/m"))];
///
///     fn energy<D: Scalar>(
///         &self, _: &Place<D>, [k]: &[D; 1], [x]: &[Vector<D>; 1], _: &[Directors<D>],
///     ) -> D {
///         let way = sub(*x, self.0.map(D::from));
///         *k * (way[0] * way[0] + way[1] * way[1] + way[2] * way[2]) * 0.5
///     }
///     fn gradient<D: Scalar>(
///         &self, _: &Place<D>, [k]: &[D; 1], [x]: &[Vector<D>; 1], _: &[Directors<D>],
///     ) -> Option<Slopes<D, 1>> {
///         let way = sub(*x, self.0.map(D::from));
///         Some(Slopes::default().with(By::Node(0), scale(way, *k)))
///     }
///     fn hessian<D: Scalar>(
///         &self, _: &Place<D>, [k]: &[D; 1], _: &[Vector<D>; 1], _: &[Directors<D>],
///     ) -> Option<Curvatures<D, 1>> {
///         let entry = |r, c| if r == c { *k } else { D::from(0.0) };
///         let block = [0, 1, 2].map(|r| [0, 1, 2].map(|c| entry(r, c)));
///         Some(Curvatures::default().with(By::Node(0), By::Node(0), block))
///     }
/// }
///
/// let none = [[[0.0; 3]; 3]; 2];
/// let at = |x| Configuration { arc_length: 0.1, length: 0.01, rest: ([[0.0; 3]], none), now: ([x], none) };
/// let states = [at([0.1, 0.2, -0.3]), at([2.0, 0.0, 1.0])];
/// let report = check_own(&Spring([0.0, 1.0, 0.0]), [3.0], &states, Tolerance::default());
/// assert!(report.passed(), "{report}");
/// ```
pub fn check_own<E, const N: usize, const P: usize>(
    energy: &E,
    parameters: [f64; P],
    states: &[Configuration<N>],
    tolerance: Tolerance,
) -> CheckReport
where
    E: OwnEnergy<N, P>,
{
    let mut report = CheckReport::new(tolerance);
    for (k, state) in states.iter().enumerate() {
        let (nodes, edges) = &state.rest;
        let lengths = [state.arc_length, state.length];
        let numbers = numbers(lengths, nodes, &edges[..N - 1]);
        let there = There { energy, parameters, numbers };
        let (nodes, edges) = &state.now;
        let now = nodes.iter().chain(edges[..N - 1].iter().flatten()).flatten().copied();
        let inputs: Vec<f64> = now.collect();
        let name = format!("state {k}");
        let dof = |i: usize| {
            let by = By::all(N).nth(i / 3).expect("so many inputs");
            format!("{by:?}.{}", ["x", "y", "z"][i % 3])
        };
        macro_rules! sized {
            ($n:literal) => {{
                let inputs: &[f64; $n] = inputs.first_chunk().expect("so many inputs");
                report.compare(&there, inputs, &name, dof);
            }};
        }
        match N {
            1 => sized!(3),
            2 => sized!(15),
            _ => sized!(27),
        }
    }
    report
}

/// An energy over all it is given.
struct There<'a, E, const N: usize, const P: usize> {
    energy: &'a E,
    parameters: [f64; P],
    numbers: Vec<f64>,
}

impl<E: OwnEnergy<N, P>, const N: usize, const P: usize> There<'_, E, N, P> {
    fn with<D: Scalar, T>(
        &self,
        inputs: &[D],
        of: impl FnOnce(&Place<D>, &[D; P], &[Vector<D>; N], &[Directors<D>]) -> T,
    ) -> T {
        let input = |i: usize| [inputs[3 * i], inputs[3 * i + 1], inputs[3 * i + 2]];
        let nodes = std::array::from_fn(input);
        let edges: Vec<Directors<D>> =
            (1..N).map(|j| std::array::from_fn(|k| input(N + 3 * (j - 1) + k))).collect();
        let place = |i: usize| D::from(self.numbers[i]);
        of(&Place::new(N, &place), &self.parameters.map(D::from), &nodes, &edges)
    }
}

impl<E: OwnEnergy<N, P>, const N: usize, const P: usize, const M: usize> Energy<M>
    for There<'_, E, N, P>
{
    fn energy<D: Scalar>(&self, inputs: &[D; M]) -> D {
        self.with(inputs, |place, p, nodes, edges| self.energy.energy(place, p, nodes, edges))
    }
}

impl<E: OwnEnergy<N, P>, const N: usize, const P: usize, const M: usize> Analytic<M>
    for There<'_, E, N, P>
{
    fn gradient(&self, inputs: &[f64; M]) -> [f64; M] {
        let slopes = self
            .with(inputs, |place, p, nodes, edges| self.energy.gradient(place, p, nodes, edges));
        let Some(slopes) = slopes else { return crate::check::dual_gradient(self, inputs) };
        let all: Vec<Vector<f64>> = By::all(N).map(|by| slopes.by(by)).collect();
        std::array::from_fn(|i| all[i / 3][i % 3])
    }

    fn hessian(&self, inputs: &[f64; M]) -> [[f64; M]; M] {
        let curvatures =
            self.with(inputs, |place, p, nodes, edges| self.energy.hessian(place, p, nodes, edges));
        let Some(curvatures) = curvatures else { return crate::check::dual_hessian(self, inputs) };
        let all: Vec<By> = By::all(N).collect();
        std::array::from_fn(|r| {
            std::array::from_fn(|c| curvatures.by(all[r / 3], all[c / 3])[r % 3][c % 3])
        })
    }
}

/// Compares an energy at a place of a rod by the rod's unknowns, of node `first` on, in units of a
/// `length`, m, and 1 rad.
pub(super) fn compare(
    report: &mut CheckReport,
    (energy, site): (&dyn AnyEnergy, &Site<f64>),
    q: &[f64],
    (name, first): (&str, usize),
    length: f64,
) {
    let stride = site.chart.stride();
    let unit = |i: usize| if i % stride < 3 { length } else { 1.0 };
    let over: &dyn Over<f64> = energy;
    let unscaled = |x: &[f64]| -> Vec<f64> { (0..x.len()).map(|i| x[i] * unit(i)).collect() };
    let scaled = |(first, second): Local<f64>| {
        let row = |r: usize| {
            let entry = |c: usize| second[r.max(c)][r.min(c)] * unit(r) * unit(c);
            (0..q.len()).map(entry).collect()
        };
        ((0..q.len()).map(|r| first[r] * unit(r)).collect(), (0..q.len()).map(row).collect())
    };
    let by = |derivatives: Derivatives| {
        let mut local = ([0.0; MOST], [[0.0; MOST]; MOST]);
        over.tangent(site, q, derivatives, &mut local);
        scaled(local)
    };
    let x: Vec<f64> = (0..q.len()).map(|i| q[i] / unit(i)).collect();
    let routes = Routes {
        energy: &|x| over.energy(site, &unscaled(x)),
        gradient: &|x| {
            let mut gradient = [0.0; MOST];
            over.gradient(site, &unscaled(x), Derivatives::Hand, &mut gradient);
            (0..x.len()).map(|i| gradient[i] * unit(i)).collect()
        },
        hand: by(Derivatives::Hand),
        dual: by(Derivatives::Dual),
        terms: scaled(energy.terms(site, q)),
    };
    report.compare_routes(routes, &x, name, &|k| {
        format!("{}{}", ["x", "y", "z", "theta"][k % stride], first + k / stride)
    });
}

/// Looks for a force along the normal, given in the rod's axes, or a moment about the tangents, of an
/// energy that says it keeps the plane in which the unknowns `q` of a rod in space lie, with edges of a
/// `length`, m.
pub(super) fn compare_across(
    report: &mut CheckReport,
    (energy, site): (&dyn AnyEnergy, &Site<f64>),
    q: &[f64],
    (name, length): (&str, f64),
    normal: Vector<f64>,
) {
    let over: &dyn Over<f64> = energy;
    let mut gradient = [0.0; MOST];
    over.gradient(site, q, Derivatives::Hand, &mut gradient);
    // Rounding errors are measured by the terms that cancel, and by what a change of the unknowns
    // makes of the forces: at rest these may be rounding errors themselves.
    let (first, second) = energy.terms(site, q);
    let largest = |terms: &[f64]| terms.iter().fold(0.0_f64, |most, term| most.max(*term));
    let size = largest(&first) + largest(second.as_flattened()) * length;
    for node in gradient[..q.len()].chunks(site.chart.stride()) {
        let force = dot([node[0], node[1], node[2]], normal);
        report.stays("force along the plane's normal", force, size, name);
        if let Some(moment) = node.get(3) {
            report.stays("moment about the tangent", *moment, size, name);
        }
    }
}
