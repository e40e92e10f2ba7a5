//! The numbers of a fit along the rod as independent ones of variance one.

use crate::error::Error;
use crate::fit::field::prior::Smooth;
use crate::fit::misfit::observation_row::affects_observation_operator;
use crate::fit::unknown::Unknown;
use crate::problem::Problem;
use crate::scene::Parameter;
use crate::scene::validate::positive;

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

/// All numbers: those of lists, list after list, then single ones.
pub struct Space {
    pub lists: Vec<List>,
    pub singles: Vec<Single>,
    parameters: Vec<Parameter>,
}

/// A list along the rod.
pub struct List {
    pub name: String,
    pub unit: &'static str,
    pub prior: Smooth,
    /// Where each number stands, m from the start.
    pub places: Vec<f64>,
    /// Those of the scene.
    pub scene: Vec<f64>,
}

/// A single number with its prior.
pub struct Single {
    pub parameter: Parameter,
    pub mean: f64,
    pub sigma: f64,
}

impl Space {
    pub fn new(problem: &Problem, fields: &[Field], unknowns: &[Unknown]) -> Result<Self, Error> {
        let scene = problem.scene();
        let (mut lists, mut parameters): (Vec<List>, Vec<Parameter>) = Default::default();
        for (i, field) in fields.iter().enumerate() {
            let key = |own: &str| format!("field[{i}].{own}");
            let own = Parameter::list(scene, &field.name).map_err(|error| match error {
                Error::Invalid { found, allowed, .. } => {
                    Error::invalid(key("name"), found, allowed)
                }
                error => error,
            })?;
            if let Some(first) = own.first().filter(|p| parameters.contains(p)) {
                let allowed = "each list once";
                return Err(Error::invalid(key("name"), first, allowed));
            }
            positive(&key("sigma"), field.sigma)?;
            positive(&key("length"), field.length)?;
            problem.check_parameter(own[0])?;
            let (count, length) = (own.len(), problem.length());
            // Pairs stand at places from one end to the other, and parts in their middle.
            let pairs = own[0].path().contains("bending");
            let gaps = if pairs { count.saturating_sub(1).max(1) } else { count };
            let spacing = length / gaps as f64;
            let first = if pairs { 0.0 } else { 0.5 * spacing };
            lists.push(List {
                name: field.name.clone(),
                unit: own[0].unit(),
                prior: Smooth::new(count, field.sigma, field.length / spacing),
                places: (0..count).map(|k| first + k as f64 * spacing).collect(),
                scene: own.iter().filter_map(|p| p.of(scene)).collect(),
            });
            parameters.extend(own);
        }
        if lists.is_empty() {
            return Err(Error::invalid("field", "none", "a list of numbers along the rod or more"));
        }
        let mut singles = Vec::new();
        for (i, unknown) in unknowns.iter().enumerate() {
            let (parameter, key) = (unknown.parameter, |own: &str| format!("parameter[{i}].{own}"));
            let Some(prior) = unknown.prior else {
                let allowed = "{ mean = .., sigma = .. } beside [[field]]";
                return Err(Error::invalid(key("prior"), "none", allowed));
            };
            positive(&key("prior.sigma"), prior.sigma)?;
            if affects_observation_operator(parameter) || parameters.contains(&parameter) {
                let allowed =
                    "beside [[field]] numbers of material, section, loads and start, each once";
                return Err(Error::invalid(key("name"), parameter, allowed));
            }
            problem.check_parameter(parameter)?;
            singles.push(Single { parameter, mean: prior.mean, sigma: prior.sigma });
            parameters.push(parameter);
        }
        Ok(Self { lists, singles, parameters })
    }

    pub fn len(&self) -> usize {
        self.parameters.len()
    }

    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Parameters for whose values a problem is laid out: one stands for its list.
    pub fn decisive(&self) -> Vec<Parameter> {
        let mut first = 0;
        let of_lists = self.lists.iter().map(|list| {
            first += list.scene.len();
            self.parameters[first - list.scene.len()]
        });
        let all: Vec<Parameter> = of_lists.collect();
        all.into_iter().chain(self.singles.iter().map(|single| single.parameter)).collect()
    }

    /// Makes independent numbers differences of the parameters; the map is symmetric.
    pub fn spread(&self, z: &mut [f64]) {
        let mut rest = z;
        for list in &self.lists {
            let (own, others) = rest.split_at_mut(list.scene.len());
            list.prior.spread(own);
            rest = others;
        }
        rest.iter_mut().zip(&self.singles).for_each(|(z, single)| *z *= single.sigma);
    }

    /// A direction.
    pub fn direction(&self, z: &[f64]) -> Vec<(Parameter, f64)> {
        let mut changes = z.to_vec();
        self.spread(&mut changes);
        self.parameters.iter().copied().zip(changes).collect()
    }

    /// The parameters' values.
    pub fn values(&self, z: &[f64]) -> Vec<(Parameter, f64)> {
        let scene = self.lists.iter().flat_map(|list| list.scene.iter().copied());
        let all = scene.chain(self.singles.iter().map(|single| single.mean));
        let mut values = self.direction(z);
        values.iter_mut().zip(all).for_each(|((_, value), mean)| *value += mean);
        values
    }

    /// Derivatives by the independent numbers from those by the parameters.
    pub fn gathered(&self, gradient: &[f64]) -> Vec<f64> {
        let mut by = gradient.to_vec();
        self.spread(&mut by);
        by
    }
}
