//! User-defined energies for the tests of this folder: magnet, foundation, bending, stretching, floor.

use rodfit::Scalar;
use rodfit::energy::{Argument, Directors, EnergyGradient, EnergyHessian, OwnEnergy, Place};
use rodfit::numerics::vector::{Vector, add, cross, dot, scale, sub};
use rodfit::scene::number::{Candidates, Quantity};

type Named = (&'static str, Quantity);

/// A magnet along the rod in a uniform field, T.
pub struct Magnet {
    pub field: [f64; 3],
    /// Whether it gives its derivatives.
    pub by_hand: bool,
}

impl OwnEnergy<2, 1> for Magnet {
    const PARAMETERS: [Named; 1] =
        [("moment", Quantity::positive("A m^2").searched(Candidates::Decades(1e-5, 1e-1, 2.0)))];

    fn energy<D: Scalar>(
        &self,
        _: &Place<D>,
        [moment]: &[D; 1],
        _: &[Vector<D>; 2],
        edges: &[Directors<D>],
    ) -> D {
        -(*moment * dot(edges[0][0], self.field.map(D::from)))
    }
    fn gradient<D: Scalar>(
        &self,
        _: &Place<D>,
        [moment]: &[D; 1],
        _: &[Vector<D>; 2],
        _: &[Directors<D>],
    ) -> Option<EnergyGradient<D, 2>> {
        let slope = self.field.map(|b| *moment * -b);
        self.by_hand.then(|| EnergyGradient::default().with(Argument::Tangent(0), slope))
    }
    fn hessian<D: Scalar>(
        &self,
        _: &Place<D>,
        _: &[D; 1],
        _: &[Vector<D>; 2],
        _: &[Directors<D>],
    ) -> Option<EnergyHessian<D, 2>> {
        self.by_hand.then(EnergyHessian::default)
    }
    fn keeps_plane(&self, _: &[f64; 1], normal: [f64; 3], _: [f64; 3]) -> bool {
        dot(normal, self.field).abs() < 1e-12
    }
}

/// Springs of stiffness k, N/m^2, and k3, N/m^4, from where the rod is at rest.
pub struct Foundation {
    pub by_hand: bool,
}

impl OwnEnergy<1, 2> for Foundation {
    const PARAMETERS: [Named; 2] =
        [("k", Quantity::positive("N/m^2")), ("k3", Quantity::signed("N/m^4"))];

    fn energy<D: Scalar>(
        &self,
        place: &Place<D>,
        [k, k3]: &[D; 2],
        nodes: &[Vector<D>; 1],
        _: &[Directors<D>],
    ) -> D {
        let way = sub(nodes[0], place.node(0));
        let square = dot(way, way);
        (*k * square * 0.5 + *k3 * square * square * 0.25) * place.length()
    }
    fn gradient<D: Scalar>(
        &self,
        place: &Place<D>,
        [k, k3]: &[D; 2],
        nodes: &[Vector<D>; 1],
        _: &[Directors<D>],
    ) -> Option<EnergyGradient<D, 1>> {
        let way = sub(nodes[0], place.node(0));
        let force = scale(way, (*k + *k3 * dot(way, way)) * place.length());
        self.by_hand.then(|| EnergyGradient::default().with(Argument::Node(0), force))
    }
    fn hessian<D: Scalar>(
        &self,
        place: &Place<D>,
        [k, k3]: &[D; 2],
        nodes: &[Vector<D>; 1],
        _: &[Directors<D>],
    ) -> Option<EnergyHessian<D, 1>> {
        let way = sub(nodes[0], place.node(0));
        let along = (*k + *k3 * dot(way, way)) * place.length();
        let block = [0, 1, 2].map(|r| {
            [0, 1, 2].map(|c| {
                let entry = way[r] * way[c] * *k3 * 2.0 * place.length();
                if r == c { entry + along } else { entry }
            })
        });
        self.by_hand
            .then(|| EnergyHessian::default().with(Argument::Node(0), Argument::Node(0), block))
    }
    fn keeps_plane(&self, _: &[f64; 2], _: [f64; 3], _: [f64; 3]) -> bool {
        true
    }
}

/// The rod's own bending and twisting once more, over three nodes and their directors.
pub struct Bending {
    /// A twisted or bent rod, or one whose directors stay across a plane.
    pub in_space: bool,
}

impl Bending {
    /// Turns of the second edge's directors against the first's, and `2 t x t/(1 + t.t)`.
    fn strains<D: Scalar>(edges: &[Directors<D>]) -> [D; 3] {
        let [[t, a1, a2], [u, b1, b2]] = [edges[0], edges[1]];
        let binormal = scale(cross(t, u), (dot(t, u) + 1.0).recip() * 2.0);
        let back = |v: Vector<D>| {
            let sum = add(u, t);
            sub(v, scale(sum, dot(t, v) / (dot(t, u) + 1.0)))
        };
        let there = back(b1);
        [
            dot(binormal, add(a2, b2)) * 0.5,
            dot(binormal, add(a1, b1)) * -0.5,
            dot(there, a2).atan2(dot(there, a1)),
        ]
    }
}

impl OwnEnergy<3, 3> for Bending {
    const PARAMETERS: [Named; 3] = [
        ("ei1", Quantity::positive("N m^2")),
        ("ei2", Quantity::positive("N m^2")),
        ("gj", Quantity::positive("N m^2")),
    ];

    fn energy<D: Scalar>(
        &self,
        place: &Place<D>,
        stiffness: &[D; 3],
        _: &[Vector<D>; 3],
        edges: &[Directors<D>],
    ) -> D {
        let now = Self::strains(edges);
        let rest = Self::strains(&[place.edge(0), place.edge(1)]);
        let change: [D; 3] = std::array::from_fn(|k| now[k] - rest[k]);
        let sum = dot([0, 1, 2].map(|k| stiffness[k] * change[k]), change);
        // Chords, as the paper has them.
        let [a, b, c] = [0, 1, 2].map(|i| place.node(i));
        let [e, f] = [sub(b, a), sub(c, b)].map(|edge| dot(edge, edge).sqrt());
        sum / (e + f)
    }
    fn keeps_plane(&self, _: &[f64; 3], _: [f64; 3], _: [f64; 3]) -> bool {
        !self.in_space
    }
}

/// The rod's own stretching once more.
pub struct Stretching;

impl OwnEnergy<2, 1> for Stretching {
    const PARAMETERS: [Named; 1] = [("ea", Quantity::positive("N"))];

    fn energy<D: Scalar>(
        &self,
        place: &Place<D>,
        [stiffness]: &[D; 1],
        nodes: &[Vector<D>; 2],
        _: &[Directors<D>],
    ) -> D {
        let length = |edge: Vector<D>| dot(edge, edge).sqrt();
        let rest = length(sub(place.node(1), place.node(0)));
        let strain = length(sub(nodes[1], nodes[0])) / rest - 1.0;
        *stiffness * strain * strain * rest * 0.5
    }
    fn keeps_plane(&self, _: &[f64; 1], _: [f64; 3], _: [f64; 3]) -> bool {
        true
    }
}

/// A floor that pushes back, N/m^2.5 along the rod, below a height; no number below a second one.
pub struct Floor {
    pub height: f64,
    pub bottom: f64,
}

impl OwnEnergy<1, 1> for Floor {
    const PARAMETERS: [Named; 1] = [("stiffness", Quantity::positive("N/m^2.5"))];

    fn energy<D: Scalar>(
        &self,
        place: &Place<D>,
        [stiffness]: &[D; 1],
        nodes: &[Vector<D>; 1],
        _: &[Directors<D>],
    ) -> D {
        let depth = -nodes[0][1] + self.height;
        if nodes[0][1] < self.bottom {
            return D::from(f64::NAN);
        }
        if depth > 0.0 { *stiffness * depth.powf(2.5) * place.length() } else { D::from(0.0) }
    }
    fn keeps_plane(&self, _: &[f64; 1], [_, y, _]: [f64; 3], _: [f64; 3]) -> bool {
        y == 0.0
    }
}

/// An energy of the second director and of a position between two nodes: all kinds of arguments that an energy can have. Its
/// derivatives are derived by hand; with `wrong` other than zero the last of them is wrong.
pub struct Everything {
    pub wrong: f64,
}

const PULLS: [[f64; 3]; 4] =
    [[0.3, -0.2, 0.5], [0.1, 0.7, -0.4], [-0.6, 0.2, 0.3], [0.2, 0.1, 0.9]];

/// `a b'`.
fn outer<D: Scalar>(a: Vector<D>, b: Vector<D>, factor: D) -> [[D; 3]; 3] {
    a.map(|a| b.map(|b| a * b * factor))
}

impl OwnEnergy<3, 1> for Everything {
    const PARAMETERS: [Named; 1] = [("size", Quantity::positive("J"))];

    /// `size (1/2 (a.m2_0)^2 + (b.m1_1) (c.t_0) + (d.(x2 - x0)) (a.m2_1))`.
    fn energy<D: Scalar>(
        &self,
        _: &Place<D>,
        [size]: &[D; 1],
        nodes: &[Vector<D>; 3],
        edges: &[Directors<D>],
    ) -> D {
        let [a, b, c, d] = PULLS.map(|pull| pull.map(D::from));
        let first = dot(a, edges[0][2]);
        let second = dot(b, edges[1][1]) * dot(c, edges[0][0]);
        let third = dot(d, sub(nodes[2], nodes[0])) * dot(a, edges[1][2]);
        *size * (first * first * 0.5 + second + third)
    }
    fn gradient<D: Scalar>(
        &self,
        _: &Place<D>,
        [size]: &[D; 1],
        nodes: &[Vector<D>; 3],
        edges: &[Directors<D>],
    ) -> Option<EnergyGradient<D, 3>> {
        let [a, b, c, d] = PULLS.map(|pull| pull.map(|x| *size * x));
        let unit = PULLS.map(|pull| pull.map(D::from));
        let by_node = scale(d, dot(unit[0], edges[1][2]));
        Some(
            EnergyGradient::default()
                .with(Argument::Second(0), scale(a, dot(unit[0], edges[0][2])))
                .with(Argument::First(1), scale(b, dot(unit[2], edges[0][0])))
                .with(Argument::Tangent(0), scale(c, dot(unit[1], edges[1][1])))
                .with(Argument::Node(2), by_node)
                .with(Argument::Node(0), by_node.map(|g| -g))
                .with(Argument::Second(1), scale(a, dot(unit[3], sub(nodes[2], nodes[0])))),
        )
    }
    fn hessian<D: Scalar>(
        &self,
        _: &Place<D>,
        [size]: &[D; 1],
        _: &[Vector<D>; 3],
        _: &[Directors<D>],
    ) -> Option<EnergyHessian<D, 3>> {
        let [a, b, c, d] = PULLS.map(|pull| pull.map(D::from));
        Some(
            EnergyHessian::default()
                .with(Argument::Second(0), Argument::Second(0), outer(a, a, *size))
                .with(Argument::First(1), Argument::Tangent(0), outer(b, c, *size))
                .with(Argument::Node(2), Argument::Second(1), outer(d, a, *size))
                .with(
                    Argument::Node(0),
                    Argument::Second(1),
                    outer(d, a, -*size * (1.0 + self.wrong)),
                ),
        )
    }
}
