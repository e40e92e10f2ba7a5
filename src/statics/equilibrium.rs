//! The equilibrium of a problem: shape, energies, reactions and stability, and their summary as text.
//!
//! [`Problem::equilibrium`] finds it by a [descent](crate::statics::descent) from the initial shape. Output:
//! [`Equilibrium`] with nodes and tip (m), energies (J), residual (N), reactions (N, N m), and counts of unstable and
//! marginal motions; [`Equilibrium::summary`] is its text. Warnings with codes are about implausible values, large
//! strains and deep contacts. An unstable equilibrium is no error; a failed search, an interruption and a singular
//! tangent are.
//!
//! The equilibrium is stable if no motion decreases the energy to second order (unstable) and none that deforms the rod
//! is without stiffness (marginal). Motions are counted by the negative pivots of the factored tangent (Sylvester's law
//! of inertia), near zero by the second variation. Rigid motions and spins without resistance do not count. A planar
//! rod is also examined out of its plane, in the spatial model. This requires a shear modulus or Poisson's ratio, and
//! no moments; else `stable` is absent. Under loads without a potential stability is not examined.

use crate::code::Code;
use crate::error::Error;
use crate::problem::Model;
use crate::problem::penetration::PenetrationRecord;
use crate::problem::{AnyProblem, Discretized, Problem, Purpose};
use crate::rod::State;
use crate::rod::{Energies, Rod};
use crate::scene::Resolution;
use crate::statics::mesh_error::MeshError;
use crate::statics::pencil::{Pencil, spatial_motion};
use crate::statics::reaction::Reactions;
use crate::statics::stability::Stability;
use crate::summary::{Summary, Tone};
use serde::{Deserialize, Serialize};

/// The equilibrium of a rod under its loads.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Equilibrium {
    /// `planar` or `spatial`.
    pub model: String,
    /// Position of the rod's end, m: its last node, or the wall that holds this end between two nodes.
    pub tip: [f64; 3],
    /// Elastic energy and potential of the loads, J.
    pub energy: f64,
    /// The energy by terms, J.
    pub energies: Energies,
    /// Number of Newton iterations.
    pub newton_iterations: usize,
    /// Largest unbalanced force on a node, N (N m for angles). Rounding errors of positions contribute about
    /// `1e-16 EI L/l^3` with edges of length `l`, much on very fine meshes.
    pub residual: f64,
    /// Whether no direction is unstable or marginal, out of the plane included. Absent for a planar scene without a
    /// shear modulus, which determines the stability out of the plane, or with a moment, and under loads without a
    /// potential.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stable: Option<bool>,
    /// Whether no direction in the plane is unstable or marginal; planar models without follower loads only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stable_in_plane: Option<bool>,
    /// Number of independent unstable directions, of those examined.
    pub negative_directions: usize,
    /// Number of independent directions that deform the rod without a measurable stiffness, as at a critical load.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub marginal_directions: usize,
    /// Forces and moments of the supports on the rod.
    pub reactions: Reactions,
    /// Position of every node, m.
    pub nodes: Vec<[f64; 3]>,
    /// The mesh that the command chose, and its error; absent for a stated mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution: Option<Resolution>,
    /// Estimated error of a mesh that the scene gives; absent for a mesh that the program chose, and without an
    /// estimate ([`Problem::add_mesh_error`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh_error: Option<MeshError>,
    /// Reasons to doubt the result: a coarse mesh, implausible values (other units than SI), no gravity, large strains,
    /// deep contacts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// The codes of the warnings, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warning_codes: Vec<Code>,
}

/// Whether a count is zero, so that the JSON omits it.
fn is_zero(count: &usize) -> bool {
    *count == 0
}

impl Equilibrium {
    /// Whether the counts of unstable and marginal directions are both zero. They are those in the model until the
    /// directions out of the plane are added.
    fn is_stable(&self) -> bool {
        self.negative_directions + self.marginal_directions == 0
    }
}

impl std::fmt::Display for Equilibrium {
    /// Writes the [summary](Self::summary) without colors.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.summary().fmt(f)
    }
}

impl Equilibrium {
    /// The result as text for a terminal. Headline: stable, stable in its plane only, not examined (loads without a
    /// potential), marginal, or unstable with the number of directions; marginal and unstable ones have a code. Below
    /// it tip (m), energy (J), warnings (that of a coarse mesh first) and model. Then numerics if the command chose or
    /// checked them, or the estimated error of a given mesh, and a line with Newton iterations and residual (N).
    pub fn summary(&self) -> Summary {
        let directions = |n: usize| match n {
            1 => "1 unstable direction".to_string(),
            n => format!("{n} unstable directions"),
        };
        // Headline: stable, not examined out of the plane, marginal, or unstable.
        let status = match (self.stable, self.stable_in_plane, self.negative_directions) {
            (Some(true), ..) => Summary::new("stable equilibrium", Tone::Good),
            (None, Some(true), _) => Summary::new(
                "stable equilibrium in its plane; stability out of the plane not computed (requires a shear modulus, no moment)",
                Tone::Good,
            ),
            (None, None, _) => Summary::new(
                "equilibrium; its stability is not examined under loads without a potential: `rodfit modes` has growth rates",
                Tone::Good,
            ),
            (.., 0) => Summary::new(
                match self.marginal_directions {
                    1 => "marginal equilibrium: the stiffness of 1 direction is below rounding errors".into(),
                    n => format!("marginal equilibrium: the stiffness of {n} directions is below rounding errors"),
                },
                Tone::Doubtful,
            )
            .with_code(Some(Code::Marginal)),
            (Some(false), Some(true), n) => {
                let status = format!("unstable equilibrium: {} out of its plane", directions(n));
                Summary::new(status, Tone::Bad).with_code(Some(Code::Unstable))
            }
            (.., n) => Summary::new(format!("unstable equilibrium: {}", directions(n)), Tone::Bad)
                .with_code(Some(Code::Unstable)),
        };
        let [x, y, z] = self.tip;
        let resolution = self.resolution.as_ref();
        let coarse = resolution.and_then(|resolution| resolution.warning_over("the length"));
        let coarse = coarse.map(|(code, words)| code.behind(words));
        let mut summary = status
            .fact("Tip", format!("({x:.6}, {y:.6}, {z:.6}) m"))
            .fact(
                "Energy",
                format!("{:.6e} J (elastic energy and potential of the loads)", self.energy),
            )
            .warnings(coarse.into_iter().chain(self.warnings.iter().cloned()))
            .naming_warnings()
            .fact("Model", &self.model);
        if let Some(resolution) = resolution {
            summary = summary.fact("Numerics", resolution.words_over("the length"));
        }
        if let Some(error) = &self.mesh_error {
            summary = summary.fact("Mesh", error.fact());
        }
        let text = format!(
            "Newton iterations: {}, residual {:.1e} N",
            self.newton_iterations, self.residual
        );
        summary.fact("Solution", text)
    }
}

impl Problem {
    /// The equilibrium under the loads that the rod reaches from its initial shape, with energies, reactions and
    /// warnings. Its stability is examined in the model, unless a load has no potential. That of a planar scene is
    /// examined out of the plane too, if a shear modulus or Poisson's ratio is given and no moment acts; otherwise
    /// `stable` is absent.
    ///
    /// ```
    /// let problem = rodfit::Scene::load("data/cantilever.toml")?.problem()?;
    /// let rest = problem.equilibrium()?;
    /// assert_eq!(rest.stable, Some(true));
    /// assert!(rest.tip[1] < 0.0 && rest.residual < 1e-6); // m, N
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Equilibrium`] where none is found, [`Error::Interrupted`], [`Error::SingularEquilibrium`] where the
    /// inertia of the tangent cannot be found. [`Error::Invalid`] for ends that move too far, and those of a recorded
    /// start.
    pub fn equilibrium(&self) -> Result<Equilibrium, Error> {
        match self.discretized() {
            AnyProblem::Planar(discretized) => {
                let mut found = model_equilibrium(self, &discretized)?;
                if discretized.has_follower_loads() {
                    return Ok(found);
                }
                // The planar model examines its own motions only.
                found.stable_in_plane = Some(found.is_stable());
                if self.can_twist() {
                    let model = self.spatial_model();
                    let spatial = self.discretized_as(&model);
                    // Stability out of the plane: the same shape in the spatial model.
                    let (q, frames) = spatial.placed_still(&found.nodes);
                    let normal = spatial.model.components(spatial.normal());
                    let pencil = Pencil::resting(&spatial, &spatial.rod(), &q, &frames);
                    let pencil = pencil.out_of_plane(normal);
                    let out_of_plane =
                        spatial.stability(&q, &frames, &pencil, |x| spatial_motion(x, normal))?;
                    found.negative_directions += out_of_plane.unstable;
                    found.marginal_directions += out_of_plane.marginal;
                    found.stable = Some(found.is_stable());
                }
                Ok(found)
            }
            AnyProblem::Spatial(discretized) => {
                let mut found = model_equilibrium(self, &discretized)?;
                found.stable = (!discretized.has_follower_loads()).then(|| found.is_stable());
                Ok(found)
            }
        }
    }
}

/// The equilibrium of a model with energies, reactions, positions of all nodes and the tip. Warnings, in this order:
/// implausible values, a large strain, deep contacts. The counts of unstable and marginal directions are those in the
/// model, zero under loads without a potential. The caller sets `stable` and `stable_in_plane`, which are absent, as
/// `resolution` is. Errors are those of the search.
fn model_equilibrium<M: Model>(
    problem: &Problem,
    discretized: &Discretized<'_, M>,
) -> Result<Equilibrium, Error> {
    // Equilibrium, then all that follows from it: energies, reactions, strains, stability.
    let rest = discretized.equilibrium()?;
    let rod = discretized.rod();
    let energies = rod.energies(&rest.q, &rest.frames);
    let still = State::at_rest(rest.q.clone(), rest.frames.clone());
    let reactions =
        discretized.reactions_at_rest(discretized.setup_over(|_, value: f64| value), &still);
    let nodes: Vec<[f64; 3]> =
        (0..problem.nodes()).map(|i| discretized.model.position(&rest.q, i)).collect();
    let mut warnings = problem.plausibility_notes(Purpose::Rest);
    let pencil = Pencil::resting(discretized, &rod, &rest.q, &rest.frames);
    // Without a potential the energy does not decide about stability.
    let stability = match discretized.has_follower_loads() {
        true => Stability::default(),
        false => discretized.stability(&rest.q, &rest.frames, &pencil, <[f64]>::to_vec)?,
    };
    // Large strains are outside of the linear law of the material.
    warnings.extend(problem.strain_warnings(|i| nodes[i]));
    let mut penetration = PenetrationRecord::new(problem.scene());
    penetration.add(|i| nodes[i], None);
    warnings.extend(penetration.warning());
    Ok(Equilibrium {
        model: problem.model().0.into(),
        tip: problem.tip().place(|i| nodes[i]),
        energy: energies.total(),
        energies,
        newton_iterations: rest.newton_iterations,
        residual: rest.residual,
        stable: None,
        stable_in_plane: None,
        negative_directions: stability.unstable,
        marginal_directions: stability.marginal,
        reactions,
        nodes,
        resolution: None,
        mesh_error: None,
        warnings: warnings.iter().map(|(code, words)| code.behind(words)).collect(),
        warning_codes: warnings.iter().map(|(code, _)| *code).collect(),
    })
}
