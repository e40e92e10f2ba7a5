//! The motion of the true rod: a planar, geometrically exact, inextensible cantilever, independent of the library's rods.
//!
//! The tangent angle is expanded as `theta(s, t) = theta_0(s) + sum_k q_k(t) phi_k(s)`. The `phi_k` are the lowest modes of
//! vibration about the stress-free shape without gravity. They are expanded in functions whose curvatures are
//! `(EI(0)/EI(s)) P_n` with shifted Legendre polynomials, so that bending moments stay polynomials where EI jumps; a
//! compliant clamp adds a constant. The position is `r(s) = int_0^s (cos theta, sin theta)`, its Jacobian
//! `J_k = int_0^s phi_k n`, and Lagrange's equations are
//!
//! ```text
//! M q'' = int J^T (f - rho A a_c) ds - K q,   M = int rho A J^T J ds,   K = int EI phi' phi'^T ds
//! ```
//!
//! with the centripetal acceleration `a_c = -int theta'^2 t` and the forces `f` of gravity, damping and drag. The
//! classical Runge-Kutta method integrates them in steps within its stability limit.

use crate::grid::{Grid, legendre};
use crate::rod::Cantilever;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};

/// Rate at which positions are stored, 1/s: a multiple of the frame rates of all cameras.
pub const STORED_RATE: usize = 3000;
/// Product of time step and highest angular frequency: about a quarter of the stability limit 2.83 of the classical
/// Runge-Kutta method, for accuracy.
const STABLE: f64 = 0.75;

/// Resolution of the expansion and of the time integration.
#[derive(Clone, Copy)]
pub struct Fineness {
    /// Legendre polynomials of each mode's bending moment.
    pub polynomials: usize,
    /// Modes of the tangent angle.
    pub modes: usize,
    /// Quadrature nodes of a panel.
    pub nodes: usize,
    /// Factor on the time step.
    pub step: f64,
}

/// The fineness of all data: tip errors below 1e-6 m.
pub const FINE: Fineness = Fineness { polynomials: 26, modes: 14, nodes: 30, step: 1.0 };

/// The discrete equations of motion.
pub struct Equations {
    /// Of the stress-free rod, and weights of forces per length and masses, at the quadrature nodes and the tip.
    rest: DVector<f64>,
    weights: DVector<f64>,
    masses: DVector<f64>,
    cumulative: DMatrix<f64>,
    modes: DMatrix<f64>,
    elastic: DMatrix<f64>,
    damping: f64,
    drag: f64,
    gravity: f64,
    step: f64,
}

/// Functions with polynomial bending moments at the quadrature nodes (columns), and the matrix of their elastic energies. A
/// compliant clamp adds a constant function.
fn polynomials(rod: &Cantilever, grid: &Grid, count: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let (nodes, length) = (&grid.nodes, rod.length);
    let columns = count + usize::from(rod.compliance > 0.0);
    let mut curvatures = DMatrix::zeros(nodes.len(), columns);
    for (i, s) in nodes.iter().enumerate() {
        let part = rod.stiffness(0.0) / rod.stiffness(*s);
        for (k, value) in legendre(count, 2.0 * s / length - 1.0).iter().enumerate() {
            curvatures[(i, k)] = part * value / length;
        }
    }
    let mut functions = &grid.cumulative * &curvatures;
    let weighted = DVector::from_fn(nodes.len(), |i, _| grid.weights[i] * rod.stiffness(nodes[i]));
    let mut elastic = curvatures.transpose() * DMatrix::from_diagonal(&weighted) * &curvatures;
    if rod.compliance > 0.0 {
        functions.column_mut(count).fill(1.0);
        elastic[(count, count)] = 1.0 / rod.compliance;
    }
    (functions, elastic)
}

/// Cosine and sine of the tangent angle, and the Jacobian of the positions x and y by the coordinates.
struct Kinematics {
    cos: DVector<f64>,
    sin: DVector<f64>,
    jacobian: [DMatrix<f64>; 2],
}

impl Equations {
    /// The equations of a rod at this resolution, in its lowest modes, with the time step from the highest frequency.
    pub fn new(rod: &Cantilever, fineness: Fineness) -> Self {
        let length = rod.length;
        // A panel ends where the stiffness jumps.
        let bounds =
            if rod.grip == 1.0 { vec![0.0, length] } else { vec![0.0, 0.25 * length, length] };
        let grid = Grid::new(&bounds, fineness.nodes);
        let count = grid.nodes.len();
        let at = |i: usize| grid.nodes.get(i).copied().unwrap_or(length);
        let weight = |i: usize| grid.weights.get(i).copied().unwrap_or(0.0);
        let mass = |i: usize| match i == count {
            true => rod.tip_mass,
            false => weight(i) * rod.density * rod.area(at(i)),
        };
        let (modes, elastic) = polynomials(rod, &grid, fineness.polynomials);
        let mut equations = Self {
            rest: DVector::from_fn(count + 1, |i, _| rod.tilt + rod.arc * at(i) / length),
            weights: DVector::from_fn(count + 1, |i, _| weight(i)),
            masses: DVector::from_fn(count + 1, |i, _| mass(i)),
            cumulative: grid.cumulative,
            modes,
            elastic,
            damping: rod.damping,
            drag: rod.drag,
            gravity: rod.gravity,
            step: 0.0,
        };
        equations.reduce(fineness.modes);
        let highest = equations.frequencies().into_iter().fold(0.0, f64::max);
        equations.step = fineness.step * STABLE / highest;
        equations
    }

    /// Replaces the basis by the `count` lowest modes of vibration, of unit modal mass.
    fn reduce(&mut self, count: usize) {
        let straight = self.kinematics(&DVector::zeros(self.modes.ncols()));
        let inverse = Cholesky::new(self.mass_matrix(&straight.jacobian))
            .and_then(|factor| factor.l().try_inverse())
            .expect("the masses of a basis of independent functions are positive definite");
        let vibration = SymmetricEigen::new(&inverse * &self.elastic * inverse.transpose());
        let mut order: Vec<usize> = (0..self.modes.ncols()).collect();
        order.sort_by(|a, b| vibration.eigenvalues[*a].total_cmp(&vibration.eigenvalues[*b]));
        order.truncate(count);
        let vectors = inverse.transpose() * vibration.eigenvectors.select_columns(&order);
        self.modes = &self.modes * vectors;
        let squares = DVector::from_fn(order.len(), |k, _| vibration.eigenvalues[order[k]]);
        self.elastic = DMatrix::from_diagonal(&squares);
    }

    /// Angular frequencies of small vibrations about the stress-free shape without gravity, rad/s, ascending.
    pub fn frequencies(&self) -> Vec<f64> {
        self.elastic.diagonal().iter().map(|square| square.sqrt()).collect()
    }

    /// Tangent angles and Jacobian at the coordinates `q`.
    fn kinematics(&self, q: &DVector<f64>) -> Kinematics {
        let angle = &self.rest + &self.modes * q;
        let (cos, sin) = (angle.map(f64::cos), angle.map(f64::sin));
        let inner = self.cumulative.ncols();
        let integrated = |factor: &dyn Fn(usize) -> f64| {
            let rows =
                DMatrix::from_fn(inner, self.modes.ncols(), |i, k| factor(i) * self.modes[(i, k)]);
            &self.cumulative * rows
        };
        let jacobian = [integrated(&|i| -sin[i]), integrated(&|i| cos[i])];
        Kinematics { cos, sin, jacobian }
    }

    /// The mass matrix `int rho A J^T J ds` by quadrature.
    fn mass_matrix(&self, jacobian: &[DMatrix<f64>; 2]) -> DMatrix<f64> {
        let part = |j: &DMatrix<f64>| {
            let mut scaled = j.clone();
            for (mut row, mass) in scaled.row_iter_mut().zip(self.masses.iter()) {
                row *= *mass;
            }
            j.tr_mul(&scaled)
        };
        part(&jacobian[0]) + part(&jacobian[1])
    }

    /// The second derivative of the coordinates, by their values and rates; NaN if the mass matrix is singular.
    fn acceleration(&self, q: &DVector<f64>, rate: &DVector<f64>) -> DVector<f64> {
        let Kinematics { cos, sin, jacobian } = self.kinematics(q);
        let turning = &self.modes * rate;
        let velocity = [&jacobian[0] * rate, &jacobian[1] * rate];
        let inner = self.cumulative.ncols();
        let centripetal = [&cos, &sin].map(|tangent| {
            &self.cumulative * DVector::from_fn(inner, |i, _| -turning[i] * turning[i] * tangent[i])
        });
        let across = |i: usize| cos[i] * velocity[1][i] - sin[i] * velocity[0][i];
        // Gravity, mass damping, quadratic drag normal to the rod, and centripetal acceleration.
        let force = |axis: usize| {
            DVector::from_fn(inner + 1, |i, _| {
                let (gravity, normal) =
                    if axis == 0 { (0.0, -sin[i]) } else { (-self.gravity, cos[i]) };
                let speed = across(i);
                let per_mass = gravity - centripetal[axis][i] - self.damping * velocity[axis][i];
                self.masses[i] * per_mass
                    - self.weights[i] * self.drag * speed.abs() * speed * normal
            })
        };
        let right =
            jacobian[0].tr_mul(&force(0)) + jacobian[1].tr_mul(&force(1)) - &self.elastic * q;
        match Cholesky::new(self.mass_matrix(&jacobian)) {
            Some(factor) => factor.solve(&right),
            None => right.map(|_| f64::NAN),
        }
    }

    /// Position of the tip, m.
    fn tip(&self, q: &DVector<f64>) -> [f64; 2] {
        let angle = &self.rest + &self.modes * q;
        let last = self.cumulative.row(self.cumulative.nrows() - 1);
        let sum = |f: fn(f64) -> f64| last.iter().zip(angle.iter()).map(|(w, a)| w * f(*a)).sum();
        [sum(f64::cos), sum(f64::sin)]
    }

    /// Positions of the tip after a release from rest in the stress-free shape, at [`STORED_RATE`].
    pub fn tip_positions(&self, end: f64) -> Vec<[f64; 2]> {
        let interval = 1.0 / STORED_RATE as f64;
        let steps = (interval / self.step).ceil().max(1.0);
        let h = interval / steps;
        let mut q = DVector::zeros(self.modes.ncols());
        let mut rate = q.clone();
        let mut positions = vec![self.tip(&q)];
        for _ in 0..(end * STORED_RATE as f64).round() as usize {
            for _ in 0..steps as usize {
                // Classical Runge-Kutta method of fourth order.
                let a1 = self.acceleration(&q, &rate);
                let (r2, q2) = (&rate + &a1 * (0.5 * h), &q + &rate * (0.5 * h));
                let a2 = self.acceleration(&q2, &r2);
                let (r3, q3) = (&rate + &a2 * (0.5 * h), &q + &r2 * (0.5 * h));
                let a3 = self.acceleration(&q3, &r3);
                let (r4, q4) = (&rate + &a3 * h, &q + &r3 * h);
                let a4 = self.acceleration(&q4, &r4);
                q += (&rate + (r2 + r3) * 2.0 + r4) * (h / 6.0);
                rate += (a1 + (a2 + a3) * 2.0 + a4) * (h / 6.0);
            }
            positions.push(self.tip(&q));
        }
        positions
    }
}
