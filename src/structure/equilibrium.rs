//! The equilibrium of a structure under its loads, and its stability in the plane.

use crate::code::Code;
use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::prescribed_dofs::PrescribedDofs;
use crate::rod::{Energies, Rod};
use crate::statics::{Descent, DescentSettings, EquilibriumState, Pencil};
use crate::structure::definition::Structure;
use crate::structure::structure_shape::StructureShape;
use crate::summary::{Summary, Tone};
use serde::{Deserialize, Serialize};

/// The equilibrium of a structure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct StructureEquilibrium {
    /// Rods and bodies.
    #[serde(flatten)]
    pub shape: StructureShape,
    /// Elastic energy and potential of the loads, J.
    pub energy: f64,
    /// The energy by terms, J.
    pub energies: Energies,
    /// Whether the energy rises along every motion in the plane.
    pub stable_in_plane: bool,
    /// Number of independent motions that lower the energy.
    pub negative_directions: usize,
    /// Number of independent motions without a measurable stiffness.
    pub marginal_directions: usize,
    /// Number of Newton iterations.
    pub newton_iterations: usize,
    /// Largest unbalanced force, N.
    pub residual: f64,
}

impl Structure {
    /// The equilibrium under the loads that the structure reaches from its rest shape.
    ///
    /// # Errors
    /// [`Error::Equilibrium`] where none is found.
    pub fn equilibrium(&self) -> Result<StructureEquilibrium, Error> {
        let found = self.equilibrium_state()?;
        let energies = self.at_rest.assembly.energies(&found.q, &());
        // Eigenvalues of stable motions are above 1, in units of the negligible stiffness.
        let pencil = self.pencil(&found.q, self.negligible_stiffness());
        let negative_directions = pencil.inertia(-1.0)?;
        let marginal_directions = pencil.inertia(1.0)?.saturating_sub(negative_directions);
        Ok(StructureEquilibrium {
            shape: self.shape(&found.q),
            energy: energies.total(),
            energies,
            stable_in_plane: negative_directions + marginal_directions == 0,
            negative_directions,
            marginal_directions,
            newton_iterations: found.newton_iterations,
            residual: found.residual,
        })
    }

    /// The unknowns of the equilibrium.
    pub(super) fn equilibrium_state(&self) -> Result<EquilibriumState<()>, Error> {
        let settings = DescentSettings {
            free: 0..self.at_rest.q.len(),
            prescribed: PrescribedDofs::default(),
            length: self.length(),
            negligible: self.negligible_stiffness(),
            springs: Vec::new(),
            edges: None,
            derivatives: Derivatives::Hand,
        };
        Descent::new(&self.at_rest.assembly, settings, self.at_rest.q.clone()).descend(())
    }

    /// The pencil of the tangent at `q` with masses, of which those of carried and fixed nodes are set to zero.
    pub(super) fn pencil(
        &self,
        q: &[f64],
        mut mass: Vec<f64>,
    ) -> Pencil<f64, <crate::rod::Assembly<f64> as Rod<f64>>::Tangent> {
        let assembly = &self.at_rest.assembly;
        let (mut gradient, mut tangent) = (vec![0.0; q.len()], assembly.zero_tangent());
        assembly.tangent(q, &(), Derivatives::Hand, &mut gradient, &mut tangent);
        assembly.tied().for_each(|i| mass[i] = 0.0);
        Pencil { tangent, mass, free: 0..q.len() }
    }
}

impl StructureEquilibrium {
    /// The result as text for a terminal.
    pub fn summary(&self) -> Summary {
        let summary = match [self.negative_directions, self.marginal_directions] {
            [0, 0] => Summary::new(
                "stable equilibrium in its plane; out of the plane not examined",
                Tone::Good,
            ),
            [0, n] => Summary::new(
                format!("marginal equilibrium; motions without a measurable stiffness: {n}"),
                Tone::Doubtful,
            )
            .with_code(Some(Code::Marginal)),
            [n, _] => Summary::new(
                format!("unstable equilibrium; motions that lower the energy: {n}"),
                Tone::Bad,
            )
            .with_code(Some(Code::Unstable)),
        };
        let tips = self.shape.rods.iter().map(|(name, rod)| {
            let [x, y, z] = rod.tip;
            format!("{name} ({x:.6}, {y:.6}, {z:.6}) m")
        });
        let work = format!(
            "Newton iterations: {}, residual {:.1e} N",
            self.newton_iterations, self.residual
        );
        summary
            .fact("Tips", tips.collect::<Vec<_>>().join(", "))
            .fact(
                "Energy",
                format!("{:.6e} J (elastic energy and potential of the loads)", self.energy),
            )
            .fact("Solution", work)
    }
}
