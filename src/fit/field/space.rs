//! The unknowns of a fit along the rod: a linear map from independent normal numbers `z` of variance one to the
//! parameters.
//!
//! [`FieldSpace::new`] validates the lists and single parameters and assigns each a prior: a smooth one along the rod,
//! or a normal one. Values of natural bending are at equal distances from end to end, those of other lists in the
//! middle of equal parts. Then `values = means + C z`, in the units of the parameters, with the symmetric root `C` of
//! the prior covariance. `C` has one block per list, and the standard deviation of each single parameter on its
//! diagonal. The means are the values of the scene for lists, those of the prior for single parameters; lists come
//! first. The search works on `z`; simulations take the [values](FieldSpace::values), derivatives the
//! [changes](FieldSpace::changes) `C z`.
//!
//! Errors: no list, a list twice or not in the scene, a standard deviation or correlation length that is not positive,
//! and parameters without derivatives. Single parameters without a prior, twice, in one of the lists, or of camera,
//! supports or shape of the rod are errors too.

use crate::error::{Error, ensure};
use crate::fit::field::prior::SmoothPrior;
use crate::fit::misfit::observation_row::affects_observation_operator;
use crate::fit::unknown::Unknown;
use crate::problem::Problem;
use crate::scene::Parameter;
use crate::scene::validate::positive;

/// Largest correlation length over the length of the rod. Beyond it all values are nearly the same, with standard
/// errors that are too small.
const LONGEST_CORRELATION: f64 = 2.0;

/// `[[field]]`: a list along the rod to identify with a smooth prior.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// List of the scene: `natural_curvature`, `natural_twist`, `rod.natural_bending.d1` or
    /// `rod.natural_bending.d2`.
    pub name: String,
    /// Prior standard deviation about the values of the scene, in their unit.
    pub sigma: f64,
    /// Prior correlation length along the rod, m: the correlation is 0.74 at this distance.
    pub length: f64,
}

/// All parameters of the fit: the values of the lists, list after list, then single parameters.
pub struct FieldSpace {
    /// Lists along the rod, in the order of the fit.
    pub lists: Vec<FieldList>,
    /// Single parameters, in the order of the fit.
    pub singles: Vec<SingleParameter>,
    /// All parameters, in the order of `z`.
    parameters: Vec<Parameter>,
}

/// A list of values along the rod with its prior.
pub struct FieldList {
    pub name: String,
    pub unit: &'static str,
    pub prior: SmoothPrior,
    /// Arc length of each value from the start of the rod, m.
    pub arc_lengths: Vec<f64>,
    /// Values of the scene, the mean of the prior.
    pub scene: Vec<f64>,
}

/// A single parameter with its normal prior, in its unit.
pub struct SingleParameter {
    pub parameter: Parameter,
    pub mean: f64,
    pub sigma: f64,
}

impl FieldSpace {
    /// The space of some lists (`fields`) and single parameters (`unknowns`) of a problem. Values of natural bending
    /// are at equal distances from one end of the rod to the other. Those of other lists are in the middle of equal
    /// parts. The correlation length of a list, m, is converted to these spacings. Errors: no list, one that the scene
    /// lacks or that is given twice, a sigma or length that is not positive, a length above [`LONGEST_CORRELATION`]
    /// rods, and parameters without derivatives. Single parameters need a prior, must not be of camera, supports or
    /// shape of the rod, and must not stand twice or in a list.
    pub fn new(problem: &Problem, fields: &[Field], unknowns: &[Unknown]) -> Result<Self, Error> {
        let scene = problem.scene();
        let (mut lists, mut parameters): (Vec<FieldList>, Vec<Parameter>) = Default::default();
        for (i, field) in fields.iter().enumerate() {
            let key = |own: &str| format!("field[{i}].{own}");
            // The user named the list in this table: an error of the scene is reported with its key.
            let own = Parameter::list(scene, &field.name).map_err(|error| match error {
                Error::Invalid { found, allowed, .. } => {
                    Error::invalid(key("name"), found, allowed)
                }
                error => error,
            })?;
            ensure(!parameters.contains(&own[0]), key("name"), own[0], "each list once")?;
            positive(&key("sigma"), field.sigma)?;
            positive(&key("length"), field.length)?;
            let longest = LONGEST_CORRELATION * problem.length();
            let allowed = format!(
                "a correlation length up to {longest} m, {LONGEST_CORRELATION} lengths of the rod; a value that is the same \
                 everywhere is a parameter"
            );
            ensure(field.length <= longest, key("length"), field.length, allowed)?;
            // All values of a list have derivatives of the same kind: the first one stands for all.
            problem.check_parameter(own[0])?;
            let (count, length) = (own.len(), problem.length());
            // Natural bending has values from one end to the other, other lists in the middle of equal parts.
            let has_ends = own[0].path().contains("bending");
            let gaps = if has_ends { count.saturating_sub(1).max(1) } else { count };
            let spacing = length / gaps as f64;
            let first = if has_ends { 0.0 } else { 0.5 * spacing };
            lists.push(FieldList {
                name: field.name.clone(),
                unit: own[0].unit(),
                prior: SmoothPrior::new(count, field.sigma, field.length / spacing),
                arc_lengths: (0..count).map(|k| first + k as f64 * spacing).collect(),
                scene: own.iter().filter_map(|p| p.of(scene)).collect(),
            });
            parameters.extend(own);
        }
        let allowed = "at least one list of values along the rod";
        ensure(!lists.is_empty(), "field", "none", allowed)?;
        // Single parameters need a prior too: the optimum is that of the posterior probability.
        let mut singles = Vec::new();
        for (i, unknown) in unknowns.iter().enumerate() {
            let (parameter, key) = (unknown.parameter, |own: &str| format!("parameter[{i}].{own}"));
            let Some(prior) = unknown.prior else {
                let allowed = "{ mean = .., sigma = .. } together with [[field]]";
                return Err(Error::invalid(key("prior"), "none", allowed));
            };
            positive(&key("prior.sigma"), prior.sigma)?;
            let is_supported =
                !affects_observation_operator(parameter) && !parameters.contains(&parameter);
            let allowed = "together with [[field]] parameters of material, section, loads and initial \
                 state, each once";
            ensure(is_supported, key("name"), parameter, allowed)?;
            problem.check_parameter(parameter)?;
            singles.push(SingleParameter { parameter, mean: prior.mean, sigma: prior.sigma });
            parameters.push(parameter);
        }
        Ok(Self { lists, singles, parameters })
    }

    /// The parameters in the order of `z`: list after list, then the single ones.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// The first parameter of each list and all single ones. For their changes the layout of the unknowns of a
    /// simulation is chosen, which is then the same for all values of all parameters.
    pub fn layout_parameters(&self) -> Vec<Parameter> {
        let mut rest = &self.parameters[..];
        let mut chosen = Vec::new();
        // Values of one list act alike on the layout: one of each is sufficient.
        for list in &self.lists {
            chosen.extend(rest.first());
            rest = &rest[list.scene.len()..];
        }
        chosen.extend(rest);
        chosen
    }

    /// Multiplies `z`, in place, by the symmetric root `C` of the prior covariance: independent numbers become changes
    /// of the parameters in their units.
    pub fn multiply(&self, z: &mut [f64]) {
        // C is block diagonal: a smooth prior for each list, a standard deviation for each single parameter.
        let mut rest = z;
        for list in &self.lists {
            let (own, others) = rest.split_at_mut(list.scene.len());
            list.prior.multiply(own);
            rest = others;
        }
        rest.iter_mut().zip(&self.singles).for_each(|(z, single)| *z *= single.sigma);
    }

    /// All parameters, in their order, with their changes `C z` in their units, along a direction `z` with one number
    /// per parameter.
    pub fn changes(&self, z: &[f64]) -> Vec<(Parameter, f64)> {
        let mut changes = z.to_vec();
        self.multiply(&mut changes);
        self.parameters.iter().copied().zip(changes).collect()
    }

    /// All parameters, in their order, with their values in their units at `z`: values of the scene (lists) or means of
    /// the priors (single ones) plus the changes `C z`.
    pub fn values(&self, z: &[f64]) -> Vec<(Parameter, f64)> {
        let scene = self.lists.iter().flat_map(|list| list.scene.iter().copied());
        let all = scene.chain(self.singles.iter().map(|single| single.mean));
        let mut values = self.changes(z);
        values.iter_mut().zip(all).for_each(|((_, value), mean)| *value += mean);
        values
    }
}
