//! Natural frequencies and mode shapes of a structure in its plane or in space.
//!
//! [`Structure::modes`] solves `K x = w^2 M x` with the tangent K at the equilibrium, or at rest, and the diagonal
//! masses M. It returns the given number of lowest eigenpairs ([`StructureModes`]), ascending: `w` in rad/s, and
//! displacements of all rod nodes in world axes, the longest of length 1. Squared frequencies within rounding errors of
//! zero become zero. An unstable mode (negative square) has minus its growth rate, 1/s, as the frequency. A warning
//! follows if rounding errors of fine meshes affect the frequencies; the summary is a table.
//!
//! `natural_frequencies_over` returns the first frequencies, rad/s, about the equilibrium over another number type,
//! with exact first derivatives. Motions without resistance are skipped. An unstable structure, one with fewer modes
//! than requested, and one in space are errors there.

use crate::energy::Derivatives;
use crate::error::{Error, ensure};
use crate::numerics::scalar::{RodScalar, Scalar};
use crate::numerics::tangent::Tangent;
use crate::rod::Rod;
use crate::scene::number::Quantity;
use crate::statics::PencilMode;
use crate::structure::blueprint::AssemblyAtRest;
use crate::structure::definition::{NEGLIGIBLE, Structure};
use crate::summary::quantity::{number, signed_percent};
use crate::summary::{Summary, SummaryTable, TextColumn, Tone};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Significant digits of frequencies in the terminal table.
const DIGITS: usize = 7;

/// Estimated rounding error of a squared frequency, over itself, above which a warning is given.
const MAX_ROUNDING: f64 = 2e-3;

/// Largest number of free motions that precede the modes with stiffness: those of three rigid bodies.
const MOST_FREE_MOTIONS: usize = 9;

/// A mode of vibration of a structure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct StructureMode {
    /// Angular frequency, rad/s; for an unstable mode minus its growth rate, 1/s; zero without resistance.
    pub frequency_rad_s: f64,
    /// Estimated relative error of the frequency by the mesh, negative if the frequency is too low. Absent for a motion
    /// without resistance, and without an estimate ([`Structure::add_mesh_errors`]).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh_error: Option<f64>,
    /// Displacement of every node of every rod in world axes; the largest is 1.
    pub shapes: BTreeMap<String, Vec<[f64; 3]>>,
}

/// The lowest modes of a structure, in its plane or in space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct StructureModes {
    /// Modes in ascending order.
    pub modes: Vec<StructureMode>,
    /// Whether motions out of a plane are included.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub in_space: bool,
    /// Reasons to doubt the result.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

impl Structure {
    /// Angular frequencies, rad/s, of the first `count` modes with stiffness about the equilibrium, ascending, over
    /// another number type. `seed` returns the number over `D` of a path, value and quantity of the scene. The
    /// structure must be in a plane.
    ///
    /// A squared frequency is the Rayleigh quotient `x' K x/x' M x` of its mode x, whose own change has no first-order
    /// effect. First derivatives are exact, second ones are not.
    ///
    /// # Errors
    /// Those of [`equilibrium`](Self::equilibrium), iterations that do not converge, unstable or missing modes, and a
    /// structure in space.
    pub fn natural_frequencies_over<D: RodScalar>(
        &self,
        count: usize,
        seed: impl FnMut(&str, f64, Quantity) -> D,
    ) -> Result<Vec<D>, Error> {
        ensure(
            !self.is_spatial(),
            "frequencies",
            "a structure in space",
            "a structure in a plane",
        )?;
        let state = self.equilibrium_state()?;
        let pencil = self.pencil(&state, self.at_rest.assembly.mass().to_vec());
        let scale = self.bending_frequency_squared();
        let zero = scale * NEGLIGIBLE + self.rounding_frequency_squared();
        // Free motions are no modes with stiffness: as many modes follow them.
        let free = |found: &[PencilMode]| found.iter().filter(|m| m.squared.abs() < zero).count();
        let mut found = pencil.lowest(count, scale)?;
        if free(&found) > 0 {
            found = pencil.lowest(count + MOST_FREE_MOTIONS, scale)?;
        }
        found.retain(|mode| mode.squared.abs() >= zero);
        found.truncate(count);
        if found.len() < count || found.iter().any(|mode| mode.squared < 0.0) {
            let text = format!("{count} modes with positive frequencies");
            return Err(Error::invalid("modes", "an unstable or free structure", text));
        }
        let AssemblyAtRest { assembly, q, frames, .. } = self.equilibrium_over(seed)?;
        let (mut gradient, mut tangent) = (vec![D::from(0.0); q.len()], assembly.zero_tangent());
        assembly.tangent(&q, &frames, Derivatives::Hand, &mut gradient, &mut tangent);
        let tied: Vec<usize> = assembly.unknowns_without_effect().collect();
        // Rayleigh quotient of a constant mode: the change of the mode has no effect of first
        // order.
        let frequency = |mode: &PencilMode| {
            let mut vector: Vec<D> = mode.vector.iter().map(|x| D::from(*x)).collect();
            tied.iter().for_each(|i| vector[*i] = D::from(0.0));
            let mut product = vec![D::from(0.0); vector.len()];
            tangent.product(&vector, &mut product);
            let pairs = vector.iter().zip(&product).zip(assembly.mass());
            let (mut stiffness, mut mass) = (D::from(0.0), D::from(0.0));
            pairs.for_each(|((x, force), own)| {
                stiffness += *x * *force;
                mass += *own * *x * *x;
            });
            Scalar::sqrt(stiffness / mass)
        };
        Ok(found.iter().map(frequency).collect())
    }

    /// The `count` lowest modes (all, if there are fewer), in the plane or in space, about the equilibrium, or with
    /// `rest` about the rest shape.
    ///
    /// # Errors
    /// Those of the [equilibrium](Self::equilibrium), except with `rest`, and iterations for eigenvalues that do not
    /// converge.
    pub fn modes(&self, count: usize, rest: bool) -> Result<StructureModes, Error> {
        let state = match rest {
            true => self.rest_state(),
            false => self.equilibrium_state()?,
        };
        let pencil = self.pencil(&state, self.at_rest.assembly.mass().to_vec());
        let scale = self.bending_frequency_squared();
        let zero = scale * NEGLIGIBLE + self.rounding_frequency_squared();
        let found = pencil.lowest(count, scale)?;
        let is_rounded = |mode: &PencilMode| {
            let squared = mode.squared.abs();
            squared > zero && pencil.rounding(&mode.vector) > MAX_ROUNDING * squared
        };
        let frictionless = self.frictionless_warning();
        let mut warnings: Vec<String> =
            frictionless.into_iter().map(|(code, words)| code.behind(&words)).collect();
        if found.iter().any(is_rounded) {
            warnings.push(
                "rounding errors of fine edges may exceed 1e-3 of the lowest frequencies. Use fewer segments"
                    .to_string(),
            );
        }
        let modes = found.into_iter().map(|mode| {
            // Within rounding errors of zero the sign of a square has no meaning.
            let squared = if mode.squared.abs() < zero { 0.0 } else { mode.squared };
            let mut shapes = self.displacements(&state, &mode.vector);
            let length = |x: &[f64; 3]| (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]).sqrt();
            let largest = shapes.values().flatten().map(length).fold(f64::MIN_POSITIVE, f64::max);
            shapes.values_mut().flatten().flatten().for_each(|x| *x /= largest);
            let frequency_rad_s = squared.signum() * squared.abs().sqrt();
            StructureMode { frequency_rad_s, mesh_error: None, shapes }
        });
        let in_space = self.at_rest.assembly.is_spatial();
        Ok(StructureModes { modes: modes.collect(), in_space, warnings })
    }
}

impl StructureModes {
    /// The result as text for a terminal: the number of modes, or of unstable ones among them, and a table. It has a
    /// row per mode with frequency in Hz and rad/s, or for an unstable one the growth rate, 1/s, and the estimated
    /// error of the mesh. Warnings follow.
    pub fn summary(&self) -> Summary {
        let unstable = self.modes.iter().filter(|mode| mode.frequency_rad_s < 0.0).count();
        let count = self.modes.len();
        let summary = match unstable {
            0 if self.in_space => Summary::new(format!("{count} natural frequencies"), Tone::Good),
            0 => Summary::new(format!("{count} natural frequencies in the plane"), Tone::Good),
            n => Summary::new(format!("unstable: {n} of {count} modes grow"), Tone::Bad),
        };
        let mut table = SummaryTable::new(
            ["Hz", "rad/s", "growth rate, 1/s", "mesh error"].map(TextColumn::right),
        );
        for StructureMode { frequency_rad_s: w, mesh_error, .. } in &self.modes {
            let error = mesh_error.map(signed_percent).unwrap_or_default();
            table.row(match *w < 0.0 {
                true => [String::new(), "unstable".into(), number(-w, DIGITS), error],
                false => [number(w / TAU, DIGITS), number(*w, DIGITS), String::new(), error],
            });
        }
        summary.table("", table).warnings(&self.warnings).naming_warnings()
    }
}
