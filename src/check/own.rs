//! Check of the derivatives of [user-defined energies](crate::energy::own) at given states.
//!
//! [`check_own`] takes an energy over one to three nodes, values of its parameters, and states. It regards positions of
//! nodes and directors of edges as independent inputs. It compares the gradient and Hessian by hand (by dual numbers
//! without them) with dual numbers and finite differences. Output: one [`CheckReport`] of all states with the largest
//! errors, the worst entry and the first entries above the limits; an entry has the name `state k` of its state.
//! `compare` does so by the unknowns of a rod, for an energy in a scene, with lengths in units of the edge length.
//! `check_plane_is_kept` checks that an energy that keeps a plane has no force along its normal and no moment about the
//! tangents. Both add their errors to the report of a scene's check.
//!
//! `Configuration` is the state of an element and its state at rest, each as `NodesAndEdges` (positions, m, and
//! directors). `EnergyAt` is a user-defined energy at one place of a rod.

use crate::check::{CheckReport, DerivativeSources, GradientAndHessian, Tolerance};
use crate::energy::adapter::{AnyEnergy, ElementContext, EnergyOver, MOST, OwnLocal};
use crate::energy::own::{Argument, OwnEnergy};
use crate::energy::place::{Directors, Place, numbers};
use crate::energy::{Analytic, Derivatives, Energy};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, dot};

/// State of the nodes and edges of an energy over `N` nodes, and its state at rest, in the world.
#[derive(Clone, Copy, Debug)]
pub struct Configuration<const N: usize> {
    /// Arc length from the wall, m.
    pub arc_length: f64,
    /// Length of the rod that the element represents, m.
    pub length: f64,
    /// Nodes and edges at rest.
    pub rest: NodesAndEdges<N>,
    /// Nodes and edges in the present state.
    pub now: NodesAndEdges<N>,
}

/// Positions of `N` nodes, m, and directors of edges, of which the first `N - 1` are used.
#[derive(Clone, Copy, Debug)]
pub struct NodesAndEdges<const N: usize> {
    /// Positions of the nodes, m.
    pub nodes: [Vector<f64>; N],
    /// Directors of the edges.
    pub edges: [Directors<f64>; 2],
}

/// Checks the derivatives of a user-defined energy by nodes and directors, as independent variables, with these values
/// of its parameters. Hand-derived ones are compared with automatic ones and with finite differences; without them the
/// automatic ones stand in their place. Entries that the report lists have the element `state k`, with the index `k` of
/// the state from 0.
///
/// ```
/// use rodfit::check::{Configuration, NodesAndEdges, Tolerance, check_own};
/// use rodfit::energy::{Argument, EnergyHessian, Directors, OwnEnergy, Place, EnergyGradient};
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
///     ) -> Option<EnergyGradient<D, 1>> {
///         let way = sub(*x, self.0.map(D::from));
///         Some(EnergyGradient::default().with(Argument::Node(0), scale(way, *k)))
///     }
///     fn hessian<D: Scalar>(
///         &self, _: &Place<D>, [k]: &[D; 1], _: &[Vector<D>; 1], _: &[Directors<D>],
///     ) -> Option<EnergyHessian<D, 1>> {
///         let entry = |r, c| if r == c { *k } else { D::from(0.0) };
///         let block = [0, 1, 2].map(|r| [0, 1, 2].map(|c| entry(r, c)));
///         Some(EnergyHessian::default().with(Argument::Node(0), Argument::Node(0), block))
///     }
/// }
///
/// let none = [[[0.0; 3]; 3]; 2];
/// let state = |x| NodesAndEdges { nodes: [x], edges: none };
/// let at = |x| Configuration { arc_length: 0.1, length: 0.01, rest: state([0.0; 3]), now: state(x) };
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
        let NodesAndEdges { nodes, edges } = &state.rest;
        let lengths = [state.arc_length, state.length];
        let numbers = numbers(lengths, nodes, &edges[..N - 1]);
        let there = IndependentInputs { energy, parameters, numbers };
        let NodesAndEdges { nodes, edges } = &state.now;
        // All inputs in one list: nodes, then the directors of the edges.
        let now = nodes.iter().chain(edges[..N - 1].iter().flatten()).flatten().copied();
        let inputs: Vec<f64> = now.collect();
        let name = format!("state {k}");
        let dof = |i: usize| {
            let by = Argument::all(N).nth(i / 3).expect("so many inputs");
            format!("{by:?}.{}", ["x", "y", "z"][i % 3])
        };
        macro_rules! sized {
            ($n:literal) => {{
                let inputs: &[f64; $n] = inputs.first_chunk().expect("so many inputs");
                report.compare(&there, inputs, &name, dof);
            }};
        }
        // An element of N nodes has N - 1 edges with three directors each: 3 N + 9 (N - 1)
        // inputs.
        match N {
            1 => sized!(3),
            2 => sized!(15),
            _ => sized!(27),
        }
    }
    report
}

/// User-defined energy as a function of the coordinates of its nodes and directors, at constant parameters and place.
struct IndependentInputs<'a, E, const N: usize, const P: usize> {
    energy: &'a E,
    parameters: [f64; P],
    numbers: Vec<f64>,
}

impl<E: OwnEnergy<N, P>, const N: usize, const P: usize> IndependentInputs<'_, E, N, P> {
    /// The result of `of` at the rest shape, the parameters, the nodes and the edges. `inputs` are the coordinates of
    /// the nodes, then those of the three directors of each edge.
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
    for IndependentInputs<'_, E, N, P>
{
    /// The energy, J, at the coordinates of nodes and directors.
    fn energy<D: Scalar>(&self, inputs: &[D; M]) -> D {
        self.with(inputs, |place, p, nodes, edges| self.energy.energy(place, p, nodes, edges))
    }
}

impl<E: OwnEnergy<N, P>, const N: usize, const P: usize, const M: usize> Analytic<M>
    for IndependentInputs<'_, E, N, P>
{
    /// The gradient by the coordinates of nodes and directors, in their order: by hand, or by dual numbers if the
    /// energy has none by hand.
    fn gradient(&self, inputs: &[f64; M]) -> [f64; M] {
        let slopes = self
            .with(inputs, |place, p, nodes, edges| self.energy.gradient(place, p, nodes, edges));
        // Without a gradient by hand both sides of the comparison are dual numbers.
        let Some(slopes) = slopes else { return crate::check::dual_gradient(self, inputs) };
        let all: Vec<Vector<f64>> = Argument::all(N).map(|by| slopes.by(by)).collect();
        std::array::from_fn(|i| all[i / 3][i % 3])
    }

    /// The full Hessian by the coordinates of nodes and directors: by hand, or by dual numbers if there is none by
    /// hand.
    fn hessian(&self, inputs: &[f64; M]) -> [[f64; M]; M] {
        let curvatures =
            self.with(inputs, |place, p, nodes, edges| self.energy.hessian(place, p, nodes, edges));
        let Some(curvatures) = curvatures else { return crate::check::dual_hessian(self, inputs) };
        let all: Vec<Argument> = Argument::all(N).collect();
        std::array::from_fn(|r| {
            std::array::from_fn(|c| curvatures.by(all[r / 3], all[c / 3])[r % 3][c % 3])
        })
    }
}

/// User-defined energy at one place of a rod, with its name for the report.
#[derive(Clone, Copy)]
pub(super) struct EnergyAt<'a> {
    /// The energy.
    pub energy: &'a dyn AnyEnergy,
    /// Its place.
    pub context: &'a ElementContext<'a, f64>,
    /// Name for the report.
    pub name: &'a str,
    /// First node of the element.
    pub first: usize,
    /// Length of the edges there, m.
    pub length: f64,
}

/// Compares the derivatives of an energy by the unknowns `q` of its element with dual numbers and finite differences;
/// errors are added to the report. They are hand-derived if the energy has them. Lengths are in units of the edge
/// length and angles in rad, so that steps by both are comparable.
pub(super) fn compare(report: &mut CheckReport, place: EnergyAt<'_>, q: &[f64]) {
    let EnergyAt { energy, context, name, first, length } = place;
    let stride = context.chart.stride();
    let unit = |i: usize| if i % stride < 3 { length } else { 1.0 };
    let over: &dyn EnergyOver<f64> = energy;
    let unscaled = |x: &[f64]| -> Vec<f64> { (0..x.len()).map(|i| x[i] * unit(i)).collect() };
    // Derivatives by the scaled unknowns: multiplied with the unit of each.
    let scaled = |(first, second): OwnLocal<f64>| {
        let row = |r: usize| {
            let entry = |c: usize| second[r.max(c)][r.min(c)] * unit(r) * unit(c);
            (0..q.len()).map(entry).collect()
        };
        GradientAndHessian {
            gradient: (0..q.len()).map(|r| first[r] * unit(r)).collect(),
            hessian: (0..q.len()).map(row).collect(),
        }
    };
    let by = |derivatives: Derivatives| {
        let mut local = ([0.0; MOST], [[0.0; MOST]; MOST]);
        over.tangent(context, q, derivatives, &mut local);
        scaled(local)
    };
    // The comparison runs in scaled unknowns.
    let x: Vec<f64> = (0..q.len()).map(|i| q[i] / unit(i)).collect();
    let routes = DerivativeSources {
        energy: &|x| over.energy(context, &unscaled(x)),
        gradient: &|x| {
            let mut gradient = [0.0; MOST];
            over.gradient(context, &unscaled(x), Derivatives::Hand, &mut gradient);
            (0..x.len()).map(|i| gradient[i] * unit(i)).collect()
        },
        hand: by(Derivatives::Hand),
        // Three independent routes: by hand, by dual numbers, and differences of the energy.
        dual: by(Derivatives::Dual),
        terms: scaled(energy.terms(context, q)),
    };
    report.compare_routes(routes, &x, name, &|k| {
        format!("{}{}", ["x", "y", "z", "theta"][k % stride], first + k / stride)
    });
}

/// Checks that an energy that keeps a plane has no force along the plane's `normal` (axes of the model) and no moment
/// about the tangents. `q` are the unknowns of an element of a rod in space that lies in this plane. Sizes are those of
/// the largest terms; violations are added to the report.
pub(super) fn check_plane_is_kept(
    report: &mut CheckReport,
    place: EnergyAt<'_>,
    q: &[f64],
    normal: Vector<f64>,
) {
    let EnergyAt { energy, context, name, length, .. } = place;
    let over: &dyn EnergyOver<f64> = energy;
    let mut gradient = [0.0; MOST];
    over.gradient(context, q, Derivatives::Hand, &mut gradient);
    // Rounding errors are relative to the terms that cancel, and to the change of the forces with the unknowns: at rest
    // the terms may be rounding errors themselves.
    let (first, second) = energy.terms(context, q);
    let largest = |terms: &[f64]| terms.iter().fold(0.0_f64, |most, term| most.max(*term));
    let size = largest(&first) + largest(second.as_flattened()) * length;
    for node in gradient[..q.len()].chunks(context.chart.stride()) {
        let force = dot([node[0], node[1], node[2]], normal);
        report.compare_with_zero("force along the plane's normal", force, size, name);
        if let Some(moment) = node.get(3) {
            report.compare_with_zero("moment about the tangent", *moment, size, name);
        }
    }
}
