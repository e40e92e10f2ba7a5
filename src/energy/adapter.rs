//! Energy and derivatives of a [user-defined energy](super::own) by the unknowns of a rod, behind a pointer
//! ([`AnyEnergy`]), for each scalar of rods.
//!
//! An energy is a function of positions and directors `y`; a [`Chart`] maps the unknowns `q` of an element to `y`. With
//! derivatives by hand, `g` and `H` by `y`, the chain rule gives those by `q`: `J' g` and `J' H J + d2(g.y)/dq2`. Nodes
//! are linear in the unknowns; `J` of the directors, and the second derivatives of `g.y` at a constant `g`, are
//! computed in dual numbers. Without derivatives by hand, or if they are not requested, the energy itself is evaluated
//! in dual numbers. A chart also returns the number of unknowns of several nodes (`unknowns`), the number of unknowns
//! per node (`stride`), the world axis of a coordinate (`axis`), and nodes and directors of an element (`world`). Input
//! of [`EnergyOver`]: a [`ElementContext`] (chart, reference frames, numbers of the place, values of the parameters,
//! weight) and the unknowns of an element of one to three nodes. Output: energy, J, gradient, N (N m for angles), and
//! the lower triangle of the Hessian, all times the weight of the element (1 without one). Entries beyond the unknowns
//! of the element have no meaning. [`Adapter`] makes these of a user's type.

use crate::energy::Derivatives;
use crate::energy::autodiff::{self, ScalarFunction};
use crate::energy::frame::EdgeFrame;
use crate::energy::own::{Argument, MOST_NODES, OwnEnergy};
use crate::energy::place::{Directors, Place};
use crate::numerics::out_of_line::OutOfLine;
use crate::numerics::scalar::{ForEachScalar, RodScalar, Scalar};
use crate::numerics::term_bound::CancellationBound;
use crate::numerics::vector::{
    Vector, add, components, cross, dot, map_components, scale, sub, unit,
};
use crate::scene::number::Quantity;
use num_dual::{Dual, Dual64, DualSVec64, HyperDual64};

/// Largest number of unknowns of an element: three nodes and two edges in space.
pub const MOST: usize = 11;
/// Gradient and lower triangle of the Hessian of an element; entries beyond its unknowns have no meaning.
pub type OwnLocal<D> = ([D; MOST], [[D; MOST]; MOST]);
/// Number of components of the directors of two edges: three vectors each.
const OF_EDGES: usize = 18;
/// The largest number of arguments of an energy: components of nodes and directors.
const INPUTS: usize = 3 * MOST_NODES + OF_EDGES;

/// The map from the unknowns of an element to positions of nodes, m, and directors of edges in the world.
#[derive(Clone, Debug)]
pub enum Chart<D> {
    /// Two unknowns a node.
    Plane {
        /// A point of the plane, m.
        origin: [f64; 3],
        /// The plane's axes.
        axes: [[f64; 3]; 2],
        /// The first director's part across the tangent in the plane, and along the normal: no
        /// motion in the plane changes it.
        across: [D; 2],
    },
    /// Three unknowns a node and the angle of the edge behind it.
    Space {
        /// The model's axes, if they are not the world's.
        axes: Option<[[f64; 3]; 3]>,
    },
}

/// The vector `axis` times `factor`.
#[inline]
fn scaled<D: Scalar>(axis: &[f64; 3], factor: D) -> Vector<D> {
    [factor * axis[0], factor * axis[1], factor * axis[2]]
}

/// The vector in the world with the components `along` along the `M` given axes: the sum of each axis times its
/// component.
#[inline]
fn along<D: Scalar, const M: usize>(axes: &[[f64; 3]; M], along: [D; M]) -> Vector<D> {
    let mut sum = scaled(&axes[0], along[0]);
    for k in 1..M {
        sum = add(sum, scaled(&axes[k], along[k]));
    }
    sum
}

impl<B: Scalar> Chart<B> {
    /// Number of unknowns from one node to the next: 2 in a plane, 4 in space.
    pub fn stride(&self) -> usize {
        match self {
            Self::Plane { .. } => 2,
            Self::Space { .. } => 4,
        }
    }

    /// Number of unknowns of `nodes` consecutive nodes and the edges between them: `2 nodes` in a plane, `4 nodes - 1`
    /// in space.
    pub fn unknowns(&self, nodes: usize) -> usize {
        match self {
            Self::Plane { .. } => 2 * nodes,
            Self::Space { .. } => 4 * nodes - 1,
        }
    }

    /// The constant derivative of a node's position in the world by its coordinate number `component` (0 or 1 in a
    /// plane, 0 to 2 in space): an axis of the model.
    pub fn axis(&self, component: usize) -> [f64; 3] {
        match self {
            Self::Plane { axes, .. } => axes[component],
            Self::Space { axes: Some(axes) } => axes[component],
            Self::Space { axes: None } => components(|c| f64::from(c == component)),
        }
    }

    /// Positions of the `N` nodes, m, and directors of the `N - 1` edges between them (zeros in unused places), in the
    /// world, of an element with unknowns `q`. In space directors are transported from the reference `frames` and
    /// turned by the edge's angle. `over` converts the numbers of the chart to the scalar of `q`.
    #[inline]
    pub fn world<D: Scalar, const N: usize>(
        &self,
        over: impl Fn(B) -> D,
        q: &[D],
        frames: &[EdgeFrame<B>],
    ) -> ([Vector<D>; N], [Directors<D>; 2]) {
        let zero = [D::from(0.0); 3];
        let (mut nodes, mut edges) = ([zero; N], [[zero; 3]; 2]);
        match self {
            Self::Plane { origin, axes: [x, y], across } => {
                for i in 0..N {
                    let place = along(&[*x, *y], [q[2 * i], q[2 * i + 1]]);
                    nodes[i] = components(|c| place[c] + origin[c]);
                }
                // Directors in the plane: tangent, and both components across it, which no motion
                // in the plane changes.
                let normal = map_components(&cross(*x, *y), D::from);
                for j in 0..N - 1 {
                    let e = [q[2 * j + 2] - q[2 * j], q[2 * j + 3] - q[2 * j + 1]];
                    let inverse = (e[0] * e[0] + e[1] * e[1]).sqrt().recip();
                    let [a, b] = [e[0] * inverse, e[1] * inverse];
                    let [in_plane, out] = [over(across[0]), over(across[1])];
                    let aside = along(&[*x, *y], [-b, a]);
                    edges[j] = [
                        along(&[*x, *y], [a, b]),
                        add(scale(aside, in_plane), scale(normal, out)),
                        sub(scale(normal, in_plane), scale(aside, out)),
                    ];
                }
            }
            Self::Space { axes } => {
                let to_world = |v: Vector<D>| match axes {
                    Some(axes) => along(axes, v),
                    None => v,
                };
                let node = |i: usize| [q[4 * i], q[4 * i + 1], q[4 * i + 2]];
                for i in 0..N {
                    nodes[i] = to_world(node(i));
                }
                for (j, frame) in frames.iter().enumerate().take(N - 1) {
                    // Directors in space: the reference director, transported to the tangent and
                    // turned by the angle.
                    let tangent = unit(sub(node(j + 1), node(j)));
                    let [first, second] = frame.map(&over).material(tangent, q[4 * j + 3]);
                    edges[j] = [to_world(tangent), to_world(first), to_world(second)];
                }
            }
        }
        (nodes, edges)
    }
}

/// The place of an element at which an energy is evaluated, with the energy's parameters.
#[derive(Clone, Copy, Debug)]
pub struct ElementContext<'a, D> {
    /// Map from the unknowns to nodes and directors.
    pub chart: &'a Chart<D>,
    /// The references of the element's edges; none in a plane.
    pub frames: &'a [EdgeFrame<D>],
    /// Values of the parameters.
    pub values: &'a [D],
    /// The numbers of its [`Place`].
    pub place: &'a [D],
    /// A factor on the energy; none is 1.
    pub weight: Option<D>,
}

/// A user-defined energy, J, and its derivatives by the unknowns `q` of an element, in one scalar.
pub trait EnergyOver<D> {
    /// The energy, J, at the unknowns `q` of the element at `context`, times the weight of the element (1 without one).
    fn energy(&self, context: &ElementContext<D>, q: &[D]) -> D;
    /// Writes the derivatives by `q`, N (N m for angles), times the weight of the element, by the method of
    /// `derivatives`. Entries of `gradient` beyond the unknowns stay as they are.
    fn gradient(
        &self,
        context: &ElementContext<D>,
        q: &[D],
        derivatives: Derivatives,
        gradient: &mut [D; MOST],
    );
    /// Writes the gradient and the lower triangle of the Hessian by `q`, times the weight of the element, to `local`,
    /// by the method of `derivatives`. Other entries have no meaning.
    fn tangent(
        &self,
        context: &ElementContext<D>,
        q: &[D],
        derivatives: Derivatives,
        local: &mut OwnLocal<D>,
    );
}

/// A user-defined energy behind a pointer, in every scalar of rods.
pub trait AnyEnergy:
    EnergyOver<f64>
    + EnergyOver<Dual64>
    + EnergyOver<HyperDual64>
    + EnergyOver<DualSVec64<2>>
    + EnergyOver<DualSVec64<8>>
    + Send
    + Sync
{
    /// The number of neighboring nodes of one element, 1 to 3.
    fn nodes(&self) -> usize;
    /// Names and quantities (unit, allowed range) of its parameters.
    fn parameters(&self) -> &'static [(&'static str, Quantity)];
    /// Whether a rod in the plane with this normal through this point, m, stays in it, at these parameter values: see
    /// [`OwnEnergy::keeps_plane`].
    fn keeps_plane(&self, values: &[f64], normal: [f64; 3], point: [f64; 3]) -> bool;
    /// Sums of the absolute terms in each entry of the gradient and Hessian by `q`, the measure of relative errors: see
    /// [`CancellationBound`].
    fn terms(&self, context: &ElementContext<f64>, q: &[f64]) -> OwnLocal<f64>;
}

impl ForEachScalar for dyn AnyEnergy {
    type Instance<D: Scalar> = dyn EnergyOver<D>;
    /// The energy over `f64`, without derivatives.
    fn plain(&self) -> &Self::Instance<f64> {
        self
    }
    /// The energy over dual numbers with one first derivative.
    fn dual(&self) -> &Self::Instance<Dual64> {
        self
    }
    /// The energy over hyper-dual numbers: two first derivatives and the mixed second one.
    fn hyper_dual(&self) -> &Self::Instance<HyperDual64> {
        self
    }
    /// The energy over dual numbers with two first derivatives.
    fn pair(&self) -> &Self::Instance<DualSVec64<2>> {
        self
    }
    /// The energy over dual numbers with eight first derivatives.
    fn eight(&self) -> &Self::Instance<DualSVec64<8>> {
        self
    }
}

/// Wrapper of a user-defined energy over `N` nodes with `P` parameters; implements [`EnergyOver`] for every scalar and
/// [`AnyEnergy`].
pub struct Adapter<E, const N: usize, const P: usize>(pub E);

/// Calls a method with the number of an element's unknowns as a constant.
macro_rules! by_size {
    ($q:expr, |$own:ident| $call:expr) => {{
        macro_rules! sized {
            ($n:literal) => {{
                let $own: &[_; $n] = $q.first_chunk().expect("so many unknowns");
                $call
            }};
        }
        // The number of nodes is a constant of the energy: other sizes are not compiled.
        match (N, $q.len()) {
            (1, 2) => sized!(2),
            (1, _) => sized!(3),
            (2, 4) => sized!(4),
            (2, _) => sized!(7),
            (_, 6) => sized!(6),
            (_, _) => sized!(11),
        }
    }};
}

impl<E: OwnEnergy<N, P>, const N: usize, const P: usize> Adapter<E, N, P> {
    /// The energy at the unknowns `q`, J, times the weight of the element (1 without one); `over` converts the numbers
    /// of the context to the scalar of `q`.
    #[inline]
    fn value<B: Scalar, D: Scalar>(
        &self,
        context: &ElementContext<B>,
        over: impl Fn(B) -> D + Copy,
        q: &[D],
    ) -> D {
        let (nodes, edges) = context.chart.world::<D, N>(over, q, context.frames);
        let energy =
            self.at(context, over, |place, p| self.0.energy(place, p, &nodes, &edges[..N - 1]));
        match context.weight {
            Some(weight) => energy * over(weight),
            None => energy,
        }
    }

    /// Calls `of` with the [`Place`] (rest shape) and the parameters of the context, both converted by `over`, and
    /// returns its result.
    #[inline]
    fn at<B: Scalar, D: Scalar, T>(
        &self,
        context: &ElementContext<B>,
        over: impl Fn(B) -> D,
        of: impl FnOnce(&Place<D>, &[D; P]) -> T,
    ) -> T {
        let parameters = components(|i| over(context.values[i]));
        of(&Place::new(N, &|i| over(context.place[i])), &parameters)
    }

    /// The gradient by the unknowns `q`, times the weight, from the user's first derivatives by nodes and directors.
    /// The part of the nodes uses the constant axes of the chart, that of the directors dual numbers. `None` if the
    /// energy has no hand-derived gradient.
    fn hand_gradient<B: RodScalar, const Q: usize>(
        &self,
        context: &ElementContext<B>,
        q: &[B; Q],
    ) -> Option<[B; Q]> {
        let (nodes, edges) = context.chart.world::<B, N>(|b| b, q, context.frames);
        // Slopes by positions and directors, by the user's formulas.
        let slopes =
            self.at(context, |b| b, |place, p| self.0.gradient(place, p, &nodes, &edges[..N - 1]))?;
        let mut gradient = [B::from(0.0); Q];
        self.add_by_nodes(context.chart, |i| slopes.by(Argument::Node(i)), &mut gradient);
        // The directors depend on the unknowns nonlinearly: their part of the chain rule in dual
        // numbers.
        if slopes.of_edges {
            let pull = DirectorPull::<_, _, N> { context, slope: |by| slopes.by(by) };
            for (sum, slope) in gradient.iter_mut().zip(autodiff::gradient(&pull, q)) {
                *sum += slope;
            }
        }
        if let Some(weight) = context.weight {
            gradient.iter_mut().for_each(|g| *g *= weight);
        }
        Some(gradient)
    }

    /// Gradient and lower triangle of the Hessian by `q`, times the weight. They follow by the chain rule of the module
    /// from the user's first and second derivatives by nodes and directors. Derivatives of directors are computed in
    /// dual numbers, if used. `None` if the energy has no hand-derived gradient or no hand-derived Hessian.
    fn hand_tangent<B: RodScalar, const Q: usize>(
        &self,
        context: &ElementContext<B>,
        q: &[B; Q],
    ) -> Option<([B; Q], [[B; Q]; Q])> {
        let (nodes, edges) = context.chart.world::<B, N>(|b| b, q, context.frames);
        let edges = &edges[..N - 1];
        // First and second derivatives by the user's formulas.
        let slopes =
            self.at(context, |b| b, |place, p| self.0.gradient(place, p, &nodes, edges))?;
        let curvatures =
            self.at(context, |b| b, |place, p| self.0.hessian(place, p, &nodes, edges))?;
        let zero = B::from(0.0);
        let (mut gradient, mut hessian) = ([zero; Q], [[zero; Q]; Q]);
        self.add_by_nodes(context.chart, |i| slopes.by(Argument::Node(i)), &mut gradient);
        // Rows of J for the directors; those of the nodes are constants.
        let mut of_edges = [[zero; Q]; OF_EDGES];
        // Second derivatives of the directors times constant slopes: the part `d2(g.y)/dq2`.
        if slopes.of_edges || curvatures.of_edges {
            let pull = DirectorPull::<_, _, N> { context, slope: |by| slopes.by(by) };
            let (first, second) = autodiff::hessian(&pull, q);
            for r in 0..Q {
                gradient[r] += first[r];
                for c in 0..=r {
                    hessian[r][c] += second[r][c];
                }
            }
        }
        // Rows of directors in J only if the energy's Hessian depends on them.
        let inputs = if curvatures.of_edges { Argument::all(N).count() } else { N };
        if curvatures.of_edges {
            let flat = |over: fn(B) -> OutOfLine<Dual<B>>, q: &[OutOfLine<Dual<B>>]| {
                let (_, edges) = context.chart.world::<_, N>(over, q, context.frames);
                components(|k| edges[k / 9][k / 3 % 3][k % 3])
            };
            of_edges = autodiff::jacobian(flat, q);
        }
        // Row of J: a constant axis for a node, a computed one for a director.
        let row = |input: usize, component: usize| -> [B; Q] {
            if input < N {
                let mut row = [zero; Q];
                let axes = context.chart.stride().min(3);
                for k in 0..axes {
                    row[context.chart.stride() * input + k] =
                        B::from(context.chart.axis(k)[component]);
                }
                row
            } else {
                of_edges[3 * (input - N) + component]
            }
        };
        // J' (H J), block by block of three components; only the lower triangle of the sum is formed.
        let mut jacobian = [[zero; Q]; INPUTS];
        for (k, row_of) in jacobian.iter_mut().take(3 * inputs).enumerate() {
            *row_of = row(k / 3, k % 3);
        }
        for (i, a) in Argument::all(N).take(inputs).enumerate() {
            let mut product = [[zero; Q]; 3];
            for (j, b) in Argument::all(N).take(inputs).enumerate() {
                let block = curvatures.by(a, b);
                for r in 0..3 {
                    for c in 0..3 {
                        for k in 0..Q {
                            product[r][k] += block[r][c] * jacobian[3 * j + c][k];
                        }
                    }
                }
            }
            for r in 0..3 {
                for k in 0..Q {
                    let left = jacobian[3 * i + r][k];
                    for l in 0..=k {
                        hessian[k][l] += left * product[r][l];
                    }
                }
            }
        }
        if let Some(weight) = context.weight {
            gradient.iter_mut().chain(hessian.iter_mut().flatten()).for_each(|x| *x *= weight);
        }
        Some((gradient, hessian))
    }

    /// Adds the derivatives by node positions to a gradient by unknowns: for each coordinate of node `i` the product of
    /// its axis with `slope(i)`.
    fn add_by_nodes<B: Scalar>(
        &self,
        chart: &Chart<B>,
        slope: impl Fn(usize) -> Vector<B>,
        gradient: &mut [B],
    ) {
        let stride = chart.stride();
        for i in 0..N {
            let slope = slope(i);
            for k in 0..stride.min(3) {
                gradient[stride * i + k] += dot(map_components(&chart.axis(k), B::from), slope);
            }
        }
    }
}

/// A user-defined energy as a function of the unknowns of its element, for dual numbers.
struct EnergyOfUnknowns<'a, B, E, const N: usize, const P: usize> {
    energy: &'a Adapter<E, N, P>,
    context: &'a ElementContext<'a, B>,
}

impl<B: Scalar, E: OwnEnergy<N, P>, const N: usize, const P: usize> ScalarFunction<B>
    for EnergyOfUnknowns<'_, B, E, N, P>
{
    /// The energy, J, times the weight of the element, at the unknowns `q`; `over` converts numbers of the rod's scalar
    /// to that of the unknowns.
    #[inline]
    fn at<D: Scalar>(&self, over: impl Fn(B) -> D + Copy, q: &[D]) -> D {
        self.energy.value(self.context, over, q)
    }
}

/// The scalar product of all directors of an element over `N` nodes with constant slopes: `g.y` of the module's header.
struct DirectorPull<'a, B, S, const N: usize> {
    context: &'a ElementContext<'a, B>,
    slope: S,
}

impl<B: Scalar, S: Fn(Argument) -> Vector<B>, const N: usize> ScalarFunction<B>
    for DirectorPull<'_, B, S, N>
{
    /// The sum over all directors of the element of their scalar products with the constant slopes, at the unknowns
    /// `q`; `over` converts numbers of the rod's scalar to that of the unknowns.
    fn at<D: Scalar>(&self, over: impl Fn(B) -> D + Copy, q: &[D]) -> D {
        let (_, edges) = self.context.chart.world::<D, N>(over, q, self.context.frames);
        let mut sum = D::from(0.0);
        for (j, [tangent, first, second]) in edges[..N - 1].iter().enumerate() {
            for (by, director) in [
                (Argument::Tangent(j), tangent),
                (Argument::First(j), first),
                (Argument::Second(j), second),
            ] {
                sum += dot(map_components(&(self.slope)(by), over), *director);
            }
        }
        sum
    }
}

impl<E: OwnEnergy<N, P>, D: RodScalar, const N: usize, const P: usize> EnergyOver<D>
    for Adapter<E, N, P>
{
    /// The energy, J, at the unknowns `q` of the element at `context`, times its weight.
    fn energy(&self, context: &ElementContext<D>, q: &[D]) -> D {
        self.value(context, |x| x, q)
    }

    /// Writes the derivatives by the unknowns `q` of the element, N (N m for angles), times the weight of the element
    /// (1 without one), to the first `q.len()` entries of `to`; the others stay. They are derived by hand if requested
    /// and available, else by dual numbers.
    fn gradient(
        &self,
        context: &ElementContext<D>,
        q: &[D],
        derivatives: Derivatives,
        to: &mut [D; MOST],
    ) {
        by_size!(q, |q| {
            // An energy without hand-derived derivatives is differentiated by dual numbers.
            let by_hand = match derivatives {
                Derivatives::Hand => self.hand_gradient(context, q),
                Derivatives::Dual => None,
            };
            let energy = EnergyOfUnknowns { energy: self, context };
            let gradient = by_hand.unwrap_or_else(|| autodiff::gradient(&energy, q));
            to[..gradient.len()].copy_from_slice(&gradient);
        })
    }

    /// Writes first derivatives and the lower triangle of the second ones by `q`, times the weight of the element (1
    /// without one), to the first entries of `to`; entries beyond the unknowns stay. They are derived by hand if
    /// requested and both are available, else by dual numbers.
    fn tangent(
        &self,
        context: &ElementContext<D>,
        q: &[D],
        derivatives: Derivatives,
        to: &mut OwnLocal<D>,
    ) {
        by_size!(q, |q| {
            let by_hand = match derivatives {
                Derivatives::Hand => self.hand_tangent(context, q),
                Derivatives::Dual => None,
            };
            let energy = EnergyOfUnknowns { energy: self, context };
            let (gradient, hessian) = by_hand.unwrap_or_else(|| autodiff::hessian(&energy, q));
            to.0[..gradient.len()].copy_from_slice(&gradient);
            for (to, row) in to.1.iter_mut().zip(&hessian) {
                to[..row.len()].copy_from_slice(row);
            }
        })
    }
}

impl<E: OwnEnergy<N, P>, const N: usize, const P: usize> AnyEnergy for Adapter<E, N, P> {
    /// The number `N` of neighboring nodes of one element.
    fn nodes(&self) -> usize {
        N
    }

    /// Names and quantities of the parameters that the user's type declares.
    fn parameters(&self) -> &'static [(&'static str, Quantity)] {
        const { &E::PARAMETERS }
    }

    /// Whether a rod in the plane with this normal through this point, m, stays in it at these parameter values, by the
    /// user's method.
    fn keeps_plane(&self, values: &[f64], normal: [f64; 3], point: [f64; 3]) -> bool {
        let parameters = components(|i| values[i]);
        self.0.keeps_plane(&parameters, normal, point)
    }

    /// Sums of the absolute terms in each entry of the gradient and Hessian by `q`, with the floor of rounding errors,
    /// from an evaluation in `CancellationBound`. Entries beyond the unknowns are zero.
    fn terms(&self, context: &ElementContext<f64>, q: &[f64]) -> OwnLocal<f64> {
        let mut local = ([0.0; MOST], [[0.0; MOST]; MOST]);
        by_size!(q, |q| {
            let unknowns = CancellationBound::rounded_unknowns(q);
            let CancellationBound { first, second, .. } =
                self.value(context, CancellationBound::from, &unknowns);
            local.0[..q.len()].copy_from_slice(&first);
            for (to, row) in local.1.iter_mut().zip(&second) {
                to[..q.len()].copy_from_slice(row);
            }
        });
        local
    }
}
