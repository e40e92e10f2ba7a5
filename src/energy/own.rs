//! User-defined energies: the trait [`OwnEnergy`] and its derivatives [`EnergyGradient`] and [`EnergyHessian`].
//!
//! A potential that acts on a rod and is not built in is written once, over any
//! [`Scalar`], and attached to a scene by its place: [`Scene::with_energy`]. From then on it is a
//! part of the rod in simulations, equilibria, modes, derivatives, fits and [`crate::check`]. Its
//! parameters are `energy.<name>.<parameter>`.
//!
//! An energy, J, is a function of one to three neighbouring nodes and of the material directors of the edges between
//! them, all in the world. The angles of the rod's edges are no arguments, because their reference frames move with the
//! rod. Derivatives are computed in dual numbers, unless [`OwnEnergy::gradient`] returns the first ones as
//! [`EnergyGradient`], and [`OwnEnergy::hessian`] the second ones as [`EnergyHessian`], by each node and director
//! ([`Argument`]). A Hessian without gradient is not used.
//!
//! ```
//! use rodfit::energy::{Directors, OwnEnergy, Place};
//! use rodfit::scene::number::Quantity;
//! use rodfit::scene::*;
//! use rodfit::{Parameter, Scalar};
//!
//! /// A magnet along the rod in a uniform field, T: `E = -moment t.B`.
//! struct Magnet {
//!     field: [f64; 3],
//! }
//!
//! impl OwnEnergy<2, 1> for Magnet {
//!     const PARAMETERS: [(&'static str, Quantity); 1] = [("moment", Quantity::signed("A m^2"))];
//!
//!     fn energy<D: Scalar>(
//!         &self,
//!         _: &Place<D>,
//!         [moment]: &[D; 1],
//!         _: &[[D; 3]; 2],
//!         edges: &[Directors<D>],
//!     ) -> D {
//!         let [tangent, ..] = edges[0];
//!         let along = |c: usize| tangent[c] * self.field[c];
//!         -(*moment * (along(0) + along(1) + along(2)))
//!     }
//!
//!     fn keeps_plane(&self, _: &[f64; 1], normal: [f64; 3], _: [f64; 3]) -> bool {
//!         (0..3).map(|c| normal[c] * self.field[c]).sum::<f64>() == 0.0
//!     }
//! }
//!
//! let shape = Shape::Straight { length: 0.1, direction: [1.0, 0.0, 0.0] };
//! let section = Section::Circle { radius: 5e-4 };
//! let scene = Scene::new(20, shape, section, Material::new(1100.0, 1e6))
//!     .with_energy("magnet", At::End, Magnet { field: [0.0, 0.05, 0.0] }, [1e-3]);
//! let problem = scene.problem()?;
//! assert!(problem.equilibrium()?.tip[1] > 0.0);
//! let moment: Parameter = "energy.magnet.moment".parse()?;
//! assert_eq!(moment.unit(), "A m^2");
//! let stronger = problem.with([(moment, 2e-3)])?;
//! assert!(stronger.equilibrium()?.tip[1] > problem.equilibrium()?.tip[1]);
//! # Ok::<(), rodfit::Error>(())
//! ```
//!
//! [`Scene::with_energy`]: crate::Scene::with_energy
//!
//! `MOST_NODES` is the largest number of nodes of an energy, `Block` a block of second derivatives.

use crate::energy::place::{Directors, Place};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, add};
use crate::scene::number::Quantity;

/// Three by three second derivatives.
pub type Block<D> = [[D; 3]; 3];

/// Largest number of nodes on which an energy may depend.
pub(crate) const MOST_NODES: usize = 3;

/// An energy of one's own over `N` neighbouring nodes, one to three, with `P` parameters. See the
/// [module](self).
///
/// Other numbers, such as an external field, are fields of the type. It must be smooth enough for two derivatives, and
/// may be attached to any rod. A value that is not a finite number ends a run with an error.
pub trait OwnEnergy<const N: usize, const P: usize>: Send + Sync + 'static {
    /// Names of the parameters, with unit, limits and scale.
    const PARAMETERS: [(&'static str, Quantity); P];

    /// The energy, J, of one [place](Place) of the rod, from the positions of its nodes in the world,
    /// m, and the directors of the `N - 1` edges between them. A density per length is
    /// multiplied by [`Place::length`].
    fn energy<D: Scalar>(
        &self,
        place: &Place<D>,
        parameters: &[D; P],
        nodes: &[Vector<D>; N],
        edges: &[Directors<D>],
    ) -> D;

    /// First derivatives of the energy by nodes and directors, each an independent argument, by formulas of the user.
    /// `None` by default: the derivatives are then computed in dual numbers.
    fn gradient<D: Scalar>(
        &self,
        _place: &Place<D>,
        _parameters: &[D; P],
        _nodes: &[Vector<D>; N],
        _edges: &[Directors<D>],
    ) -> Option<EnergyGradient<D, N>> {
        None
    }

    /// Second derivatives by nodes and directors, each an independent argument. They are used only together with the
    /// [gradient](Self::gradient). `None` by default: both derivatives of a tangent are then computed in dual numbers.
    fn hessian<D: Scalar>(
        &self,
        _place: &Place<D>,
        _parameters: &[D; P],
        _nodes: &[Vector<D>; N],
        _edges: &[Directors<D>],
    ) -> Option<EnergyHessian<D, N>> {
        None
    }

    /// Whether a rod that lies in the plane with this normal through this point, m, stays there at these parameters: no
    /// force along the normal and no moment about the tangents. False by default: the scene is then simulated in space.
    fn keeps_plane(&self, _parameters: &[f64; P], _normal: [f64; 3], _point: [f64; 3]) -> bool {
        false
    }
}

/// An argument of an energy by which it is differentiated: three components each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Argument {
    /// The position of a node.
    Node(usize),
    /// The tangent of an edge.
    Tangent(usize),
    /// The first director of an edge.
    First(usize),
    /// The second director of an edge.
    Second(usize),
}

impl Argument {
    /// `[i, k]`: the index `i` of the node or edge, and the kind `k` of argument: 0 position, 1 tangent, 2 first and 3
    /// second director.
    fn place(self) -> [usize; 2] {
        match self {
            Self::Node(i) => [i, 0],
            Self::Tangent(j) => [j, 1],
            Self::First(j) => [j, 2],
            Self::Second(j) => [j, 3],
        }
    }

    /// All arguments of an energy over `nodes` nodes: the positions, then tangent, first and second director of each
    /// edge.
    pub(crate) fn all(nodes: usize) -> impl Iterator<Item = Self> {
        let of_edge = |j| [Self::Tangent(j), Self::First(j), Self::Second(j)];
        (0..nodes).map(Self::Node).chain((1..nodes).flat_map(move |j| of_edge(j - 1)))
    }
}

/// First derivatives of an energy over `N` nodes by positions and directors; zero where not set.
#[derive(Clone, Copy, Debug)]
pub struct EnergyGradient<D, const N: usize> {
    by: [[Vector<D>; 4]; N],
    pub(crate) of_edges: bool,
}

impl<D: Scalar, const N: usize> Default for EnergyGradient<D, N> {
    /// First derivatives by all positions and directors that are zero.
    fn default() -> Self {
        Self { by: [[[D::from(0.0); 3]; 4]; N], of_edges: false }
    }
}

impl<D: Scalar, const N: usize> EnergyGradient<D, N> {
    /// The slopes with the vector `slope` added to the derivative by `by`: the position of a node, or the tangent or a
    /// director of an edge.
    pub fn with(mut self, by: Argument, slope: Vector<D>) -> Self {
        let [i, k] = by.place();
        self.of_edges |= k > 0;
        self.by[i][k] = add(self.by[i][k], slope);
        self
    }

    /// The derivative by the three components of `by`, the position of a node, or the tangent or a director of an edge;
    /// zero if not set.
    pub fn by(&self, by: Argument) -> Vector<D> {
        let [i, k] = by.place();
        self.by[i][k]
    }
}

/// Second derivatives of an energy over `N` nodes by positions and directors; zero where not set.
#[derive(Clone, Copy, Debug)]
pub struct EnergyHessian<D, const N: usize> {
    by: [[[[Block<D>; 4]; 4]; N]; N],
    pub(crate) of_edges: bool,
}

impl<D: Scalar, const N: usize> Default for EnergyHessian<D, N> {
    /// Second derivatives by all positions and directors that are zero.
    fn default() -> Self {
        Self { by: [[[[[[D::from(0.0); 3]; 3]; 4]; 4]; N]; N], of_edges: false }
    }
}

impl<D: Scalar, const N: usize> EnergyHessian<D, N> {
    /// The second derivatives with `block` added to those by `row` (rows of the block) and `column`. Both are the
    /// position of a node, or the tangent or a director of an edge. The transposed block is added to those by `column`
    /// and `row`, if these differ.
    pub fn with(mut self, row: Argument, column: Argument, block: Block<D>) -> Self {
        let ([i, k], [j, l]) = (row.place(), column.place());
        self.of_edges |= k > 0 || l > 0;
        for r in 0..3 {
            for c in 0..3 {
                self.by[i][j][k][l][r][c] += block[r][c];
                // Second derivatives are symmetric: the transposed block belongs to the exchanged
                // arguments.
                if row != column {
                    self.by[j][i][l][k][c][r] += block[r][c];
                }
            }
        }
        self
    }

    /// The three by three second derivatives by the components of `row` (rows) and `column`; zeros if not set. Both are
    /// the position of a node, or the tangent or a director of an edge.
    pub fn by(&self, row: Argument, column: Argument) -> Block<D> {
        let ([i, k], [j, l]) = (row.place(), column.place());
        self.by[i][j][k][l]
    }
}
