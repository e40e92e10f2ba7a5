//! Energy of a linear spring between a node and a fixed point of the world: `E = k |x - x0|^2/2`, J, as a soft
//! support.
//!
//! It is an element like a user-defined energy ([`AnyEnergy`]), with its stiffness `k`, N/m, as the only parameter;
//! weights of places are not used. Gradient: `k` times the displacement along each axis of the model, N. Hessian:
//! `k` times the identity, N/m, written to the lower triangle. Positions of nodes are linear in the unknowns, so
//! that these are two lines for any scalar. The [adapter](super::adapter) of a user-defined energy would compute
//! them in dual numbers.

use crate::energy::Derivatives;
use crate::energy::adapter::{AnyEnergy, ElementContext, EnergyOver, MOST, OwnLocal};
use crate::numerics::scalar::Scalar;
use crate::numerics::vector::{Vector, components, dot, map_components};
use crate::scene::number::Quantity;

/// Spring to the fixed point of the field, m. The stiffness, N/m, is the parameter of the energy.
pub(crate) struct AnchorSpring(pub [f64; 3]);

impl AnchorSpring {
    /// The vector from the fixed point to the node with the unknowns `q`, m.
    fn displacement<D: Scalar>(&self, context: &ElementContext<D>, q: &[D]) -> Vector<D> {
        let ([x], _) = context.chart.world::<D, 1>(|x| x, q, &[]);
        components(|c| x[c] - self.0[c])
    }
}

impl<D: Scalar> EnergyOver<D> for AnchorSpring {
    /// The energy `k |x - x0|^2/2`, J, at the coordinates `q` of the node, m; the weight of the element is not used.
    fn energy(&self, context: &ElementContext<D>, q: &[D]) -> D {
        let way = self.displacement(context, q);
        context.values[0] * dot(way, way) * 0.5
    }

    /// Writes the derivatives by the coordinates `q`, N, to the first entries of `gradient`: the stiffness times the
    /// displacement along each axis of the model. They are the same by either method of derivatives. The weight of the
    /// context is not used.
    fn gradient(
        &self,
        context: &ElementContext<D>,
        q: &[D],
        _: Derivatives,
        gradient: &mut [D; MOST],
    ) {
        let way = self.displacement(context, q);
        for k in 0..q.len() {
            gradient[k] =
                context.values[0] * dot(map_components(&context.chart.axis(k), D::from), way);
        }
    }

    /// Writes the gradient and the lower triangle of the Hessian, by the coordinates `q`. The axes are orthonormal, so
    /// that the Hessian is the stiffness times the identity.
    fn tangent(
        &self,
        context: &ElementContext<D>,
        q: &[D],
        derivatives: Derivatives,
        local: &mut OwnLocal<D>,
    ) {
        self.gradient(context, q, derivatives, &mut local.0);
        for k in 0..q.len() {
            local.1[k][..k].fill(D::from(0.0));
            local.1[k][k] = context.values[0];
        }
    }
}

impl AnyEnergy for AnchorSpring {
    /// The number of nodes of one element: one.
    fn nodes(&self) -> usize {
        1
    }

    /// The name, unit and range of the only parameter, the stiffness: positive, N/m.
    fn parameters(&self) -> &'static [(&'static str, Quantity)] {
        const { &[("stiffness", Quantity::positive("N/m"))] }
    }

    /// Always false. It has no effect, because the planar or spatial model is chosen before springs are added.
    fn keeps_plane(&self, _: &[f64], _: [f64; 3], _: [f64; 3]) -> bool {
        false
    }

    /// Sums of the absolute terms in the gradient (that of the displacement as `|x| + |x0|`) and in the Hessian by `q`,
    /// as the scale of rounding errors. Other entries are zero.
    fn terms(&self, context: &ElementContext<f64>, q: &[f64]) -> OwnLocal<f64> {
        let ([x], _) = context.chart.world::<f64, 1>(|x| x, q, &[]);
        let large = components(|c| x[c].abs() + self.0[c].abs());
        let mut local = ([0.0; MOST], [[0.0; MOST]; MOST]);
        for k in 0..q.len() {
            local.0[k] = context.values[0] * dot(context.chart.axis(k).map(f64::abs), large);
            local.1[k][k] = context.values[0];
        }
        local
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::energy::adapter::Chart;
    use num_dual::Dual64;

    /// Slopes of the energy, and of the gradient, by each unknown.
    #[test]
    fn derivatives_are_those_of_dual_numbers() {
        let axes = [[0.6, 0.8, 0.0], [-0.48, 0.36, 0.8], [0.64, -0.48, 0.6]];
        let plane = Chart::Plane {
            origin: [0.1, -0.2, 0.3],
            axes: [axes[0], axes[1]],
            across: [Dual64::from(1.0), Dual64::from(0.0)],
        };
        for (chart, q) in [
            (plane, [0.3, -0.7].as_slice()),
            (Chart::Space { axes: Some(axes) }, &[0.3, -0.7, 0.2]),
            (Chart::Space { axes: None }, &[0.3, -0.7, 0.2]),
        ] {
            let values = [Dual64::from(250.0)];
            let context = ElementContext {
                chart: &chart,
                frames: &[],
                values: &values,
                place: &[],
                weight: None,
            };
            let tie = AnchorSpring([0.4, 0.5, -0.6]);
            for i in 0..q.len() {
                let along: Vec<Dual64> =
                    (0..q.len()).map(|j| Dual64::new(q[j], f64::from(i == j))).collect();
                let unset = Dual64::from(f64::NAN);
                let mut local = ([unset; MOST], [[unset; MOST]; MOST]);
                tie.tangent(&context, &along, Derivatives::Hand, &mut local);
                let slope = tie.energy(&context, &along).eps;
                assert!((slope - local.0[i].re).abs() < 1e-13 * 250.0, "{slope} {}", local.0[i].re);
                for j in 0..q.len() {
                    let curvature = local.1[i.max(j)][i.min(j)].re;
                    assert!((local.0[j].eps - curvature).abs() < 1e-13 * 250.0, "{i} {j}");
                }
            }
        }
    }
}
