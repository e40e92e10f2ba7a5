//! The equilibrium of a structure under its loads, and its stability in its plane or in space.
//!
//! The [descent](crate::statics::Descent) starts from the rest shape, under the full loads. Recorded ends are moved to
//! their markers at t = 0 in stages of at most `LARGEST_SHIFT` lengths of the structure, with a descent after each.
//! [`Structure::equilibrium`] returns a [`StructureEquilibrium`] with shape, m, energies, J, counts of unstable and
//! marginal motions, iterations and the largest unbalanced force, N; its `summary` is text. Unstable equilibria are
//! results too. No equilibrium, and a singular tangent, are errors.
//!
//! Stability follows from the eigenvalues of the tangent in units of the negligible stiffness of each unknown. Those
//! below -1 are motions that lower the energy, those between -1 and 1 marginal ones. In a plane only motions in the
//! plane are examined. Straight round rods without a clamped end spin without resistance in space; they are counted
//! separately, not as marginal.

use crate::code::Code;
use crate::energy::Derivatives;
use crate::error::Error;
use crate::rod::assembly::AssemblyFrames;
use crate::rod::{Energies, Rod};
use crate::scene::{Scene, Support};
use crate::statics::{Descent, DescentSettings, EquilibriumState, MeshError, Pencil};
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
    /// Whether the energy rises along every examined motion: in the plane, or in space.
    pub stable_in_plane: bool,
    /// Whether the energy rises along every motion; of a structure in space.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stable: Option<bool>,
    /// Number of straight round rods between balls, which spin about themselves without resistance. They do not count
    /// as marginal.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub spinning_rods: usize,
    /// Number of independent motions that lower the energy.
    pub negative_directions: usize,
    /// Number of independent motions without a measurable stiffness.
    pub marginal_directions: usize,
    /// Number of Newton iterations.
    pub newton_iterations: usize,
    /// Largest unbalanced force, N.
    pub residual: f64,
    /// Estimated error of the mesh; absent without an estimate ([`Structure::add_mesh_error`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh_error: Option<MeshError>,
    /// Reasons to doubt the mesh.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

/// Largest displacement of a recorded end per stage of an equilibrium, as a fraction of the length of the structure.
/// Newton's method converges from one stage to the next.
const LARGEST_SHIFT: f64 = 0.02;

/// Whether a count is left out of the JSON.
fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl Structure {
    /// The equilibrium under the loads that a descent (`statics::descent`) reaches from the rest shape, with positions,
    /// energies and stability. Unstable and marginal equilibria are results too, with the numbers of such motions. Of
    /// the marginal motions, spins of straight round rods between balls are subtracted.
    ///
    /// # Errors
    /// [`Error::Equilibrium`] where none is found; [`Error::SingularEquilibrium`] if the tangent has zero pivots at all
    /// shifts. [`Error::Invalid`] for a spring in space that is rotated by more than 0.9 of half a turn.
    pub fn equilibrium(&self) -> Result<StructureEquilibrium, Error> {
        let found = self.equilibrium_state()?;
        let energies = self.at_rest.assembly.energies(&found.q, &found.frames);
        // Eigenvalues of stable motions are above 1, in units of the negligible stiffness.
        let pencil = self.pencil(&found, self.negligible_stiffness());
        let negative_directions = pencil.inertia(-1.0)?;
        let neutral = pencil.inertia(1.0)?.saturating_sub(negative_directions);
        // A spin of a straight round rod changes no position: it is no sign of instability.
        let spinning_rods = self.spinning_rods().count().min(neutral);
        let marginal_directions = neutral - spinning_rods;
        let is_stable = negative_directions + marginal_directions == 0;
        Ok(StructureEquilibrium {
            shape: self.shape_at(&found.q, &found.frames),
            energy: energies.total(),
            energies,
            stable_in_plane: is_stable,
            stable: self.at_rest.assembly.is_spatial().then_some(is_stable),
            spinning_rods,
            negative_directions,
            marginal_directions,
            newton_iterations: found.newton_iterations,
            residual: found.residual,
            mesh_error: None,
            warnings: Vec::new(),
        })
    }

    /// Indices of the rods in space whose spin about themselves meets no resistance. These are straight at rest and
    /// round (second moments halfway along equal within 1e-9), without a clamped end: each end is free or pinned. Empty
    /// in a plane.
    fn spinning_rods(&self) -> impl Iterator<Item = usize> {
        let is_round = |scene: &Scene| {
            let [i1, i2] = scene.at(0.5).0.moments().second_moments;
            (i1 - i2).abs() <= 1e-9 * i1
        };
        let free_ends = |k: usize| {
            let ends = self.blueprint.plan.ends[k];
            ends.iter().all(|hold| hold.support() != Support::Clamped)
        };
        let spins = move |k: &usize| {
            let straight = self.at_rest.meshes[*k].is_straight();
            straight && is_round(&self.blueprint.parts[*k]) && free_ends(*k)
        };
        let count = if self.at_rest.assembly.is_spatial() { self.scene.rods.len() } else { 0 };
        (0..count).filter(spins)
    }

    /// Unknowns and frames of the equilibrium, by a descent from the rest shape, with the number of iterations and the
    /// largest unbalanced force, N. Springs of the negligible stiffness hold the angles of rods that spin freely.
    /// Recorded ends are moved in stages to their markers at t = 0. Derivatives are the hand-derived ones. An error
    /// where
    /// a descent finds no equilibrium, or one in which a spring in space is rotated too far.
    pub(super) fn equilibrium_state(&self) -> Result<EquilibriumState<AssemblyFrames<f64>>, Error> {
        let negligible = self.negligible_stiffness();
        // Weak springs hold the spins of rods.
        let (ranges, mut springs) = (self.at_rest.assembly.rod_ranges(), Vec::new());
        for k in self.spinning_rods() {
            springs.resize(negligible.len(), 0.0);
            let angles = ranges[k].clone().skip(3).step_by(4);
            angles.for_each(|i| springs[i] = negligible[i]);
        }
        let settings = || DescentSettings {
            free: 0..self.at_rest.q.len(),
            prescribed: self.recorded.prescribed.clone(),
            length: self.length(),
            negligible: negligible.clone(),
            springs: springs.clone(),
            edges: None,
            derivatives: Derivatives::Hand,
        };
        let (assembly, mut q) = (&self.at_rest.assembly, self.at_rest.q.clone());
        let mut frames = self.at_rest.frames.clone();
        // Recorded ends move from rest to their markers in stages.
        let mut target = q.clone();
        self.recorded.place(0.0, &mut target, &frames);
        let ways: Vec<f64> = target.iter().zip(&q).map(|(to, from)| to - from).collect();
        let largest = ways.iter().fold(0.0, |most: f64, way| most.max(way.abs()));
        let stages = (largest / (LARGEST_SHIFT * self.length())).ceil().max(1.0);
        let mut iterations = 0;
        for stage in 1..stages as usize {
            let part = stage as f64 / stages;
            for i in self.recorded.prescribed.iter() {
                q[i] = self.at_rest.q[i] + part * ways[i];
            }
            let found = Descent::new(assembly, settings(), q).descend(frames)?;
            (q, frames) = (found.q, found.frames);
            iterations += found.newton_iterations;
        }
        self.recorded.place(0.0, &mut q, &frames);
        let mut found = Descent::new(assembly, settings(), q).descend(frames)?;
        self.check_springs(assembly, &found.q, &found.frames, None)?;
        found.newton_iterations += iterations;
        Ok(found)
    }

    /// The state at rest, without the deformation by loads, as an equilibrium with zero iterations and zero residual.
    pub(super) fn rest_state(&self) -> EquilibriumState<AssemblyFrames<f64>> {
        EquilibriumState {
            q: self.at_rest.q.clone(),
            frames: self.at_rest.frames.clone(),
            newton_iterations: 0,
            residual: 0.0,
        }
    }

    /// The pencil `(K, M)` with the tangent K at a `state`, by hand-derived derivatives, over all unknowns. M is the
    /// diagonal `mass`, kg or another weight, with zeros for unknowns without effect (carried, fixed, gaps) and for
    /// recorded ends.
    pub(super) fn pencil(
        &self,
        state: &EquilibriumState<AssemblyFrames<f64>>,
        mut mass: Vec<f64>,
    ) -> Pencil<f64, <crate::rod::Assembly<f64> as Rod<f64>>::Tangent> {
        let (assembly, q) = (&self.at_rest.assembly, &state.q);
        let (mut gradient, mut tangent) = (vec![0.0; q.len()], assembly.zero_tangent());
        assembly.tangent(q, &state.frames, Derivatives::Hand, &mut gradient, &mut tangent);
        // Tied unknowns follow others, and must not count as motions of their own.
        assembly.unknowns_without_effect().for_each(|i| mass[i] = 0.0);
        self.recorded.prescribed.fill(&mut mass, 0.0);
        self.recorded.prescribed.eliminate_rows_and_columns(&mut tangent);
        Pencil { tangent, mass, free: 0..q.len() }
    }
}

impl StructureEquilibrium {
    /// The result as text for a terminal: stability, the end of each rod, m, energy, J, the estimated error of the
    /// mesh, iterations and residual, N. In a plane a stable equilibrium has the note that motions out of it are not
    /// examined. A marginal or unstable equilibrium has its code.
    pub fn summary(&self) -> Summary {
        let summary = match [self.negative_directions, self.marginal_directions] {
            [0, 0] if self.stable == Some(true) => Summary::new("stable equilibrium", Tone::Good),
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
        let summary = summary.fact("Tips", tips.collect::<Vec<_>>().join(", ")).fact(
            "Energy",
            format!("{:.6e} J (elastic energy and potential of the loads)", self.energy),
        );
        let summary = match &self.mesh_error {
            Some(error) => summary.fact("Mesh", error.fact()),
            None => summary,
        };
        summary.fact("Solution", work)
    }
}
