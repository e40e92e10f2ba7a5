//! Derivatives of a misfit by entries of lists of natural curvatures and twists along the rod. Each entry changes the
//! laws (stiffness and natural stress) of a few joints only.
//!
//! Input: the requested parameters ([`RequestedParameters`] divides them into list entries and others), and the
//! derivatives of the misfit by the laws of all joints. The natural strain `c_i` at joint `i` is interpolated from the
//! entries `e_k`, `c_i = sum_k w_ik e_k`. One rod in dual numbers, with a derivative along all entries of a list,
//! contains the derivative of every joint's law by `c_i`. Its product with those of the misfit by the law is `dJ/dc_i`,
//! and the derivative by an entry is `dJ/de_k = sum_i w_ik dJ/dc_i`. So one rod serves a whole list. `separate_lists`
//! treats all entries as other parameters, which is needed if the initial state depends on them. Output:
//! `add_natural_strains` overwrites their entries of the gradient, at their indices in the request, zero without
//! influence. A parameter that the scene does not have, or its model cannot vary, is an error.
//!
//! `NaturalStrains` is a list, `ListEntryParameter` a requested entry of one, and `UnlistedParameter` another
//! parameter.

use crate::error::Error;
use crate::problem::{Discretized, Model, Problem};
use crate::rod::{ForwardSensitivity, LawDerivatives, Transposed};
use crate::scene::{Parameter, Scene};
use num_dual::Dual64;
use std::collections::HashSet;

/// A list of natural strains, which only the laws of joints depend on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NaturalStrains {
    /// `rod.natural_curvature`.
    Curvature,
    /// `rod.natural_twist`.
    Twist,
    /// `rod.natural_bending`, along the first director or the second.
    Bending(usize),
}

impl NaturalStrains {
    /// The list that contains a parameter, from its path (such as `rod.natural_curvature.3`), and its index there;
    /// `None` for parameters outside of these lists.
    fn of(parameter: Parameter) -> Option<(Self, usize)> {
        let (list, place) = parameter.path().strip_prefix("rod.natural_")?.split_once('.')?;
        match (list, place.split_once('.')) {
            ("curvature", None) => Some((Self::Curvature, place.parse().ok()?)),
            ("twist", None) => Some((Self::Twist, place.parse().ok()?)),
            ("bending", Some((place, "d1"))) => Some((Self::Bending(0), place.parse().ok()?)),
            ("bending", Some((place, "d2"))) => Some((Self::Bending(1), place.parse().ok()?)),
            _ => None,
        }
    }

    /// The entries of the list from which the value at the inner node `node` is interpolated, with their weights.
    /// `places` are the arc lengths of all nodes, as fractions of the rod length.
    fn shares(self, scene: &Scene, node: usize, places: &[f64]) -> Vec<(usize, f64)> {
        let rod = &scene.rod;
        match self {
            Self::Curvature => rod.natural_curvature.shares(places[node]),
            Self::Twist => rod.natural_twist.shares(places[node]),
            Self::Bending(_) => rod.bending_shares(node, places).into_iter().flatten().collect(),
        }
    }
}

/// A parameter outside of lists.
#[derive(Clone, Copy, Debug)]
pub struct UnlistedParameter {
    /// Its index in the gradient.
    pub index: usize,
    /// The parameter.
    pub parameter: Parameter,
}

/// A parameter that is an entry of a list.
#[derive(Clone, Copy, Debug)]
pub struct ListEntryParameter {
    /// The list.
    pub list: NaturalStrains,
    /// The index of the entry in the list.
    pub place: usize,
    /// Its index in the gradient.
    pub index: usize,
}

/// The parameters of a gradient, divided into entries of lists and others.
#[derive(Debug, Default)]
pub struct RequestedParameters {
    /// All parameters, in the order of the gradient.
    pub all: Vec<Parameter>,
    /// Parameters outside of lists.
    pub single: Vec<UnlistedParameter>,
    /// Entries of lists.
    pub listed: Vec<ListEntryParameter>,
}

impl RequestedParameters {
    /// Divides the `parameters` into entries of natural-strain lists and others, each in their order, and checks them.
    /// Of a list only the first requested entry is checked: all of its entries are variable, or none.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a parameter that the scene does not have, or that its model cannot vary.
    pub fn new(problem: &Problem, parameters: &[Parameter]) -> Result<Self, Error> {
        let mut requested = Self { all: parameters.to_vec(), ..Self::default() };
        // The parameters of a scene are listed once, and only if an entry of a list is requested.
        let known: HashSet<Parameter> =
            match parameters.iter().any(|p| NaturalStrains::of(*p).is_some()) {
                true => Parameter::all(problem.scene()).into_iter().collect(),
                false => HashSet::new(),
            };
        let mut checked: Vec<NaturalStrains> = Vec::new();
        for (index, parameter) in parameters.iter().enumerate() {
            match NaturalStrains::of(*parameter).filter(|_| known.contains(parameter)) {
                Some((list, place)) => {
                    // All entries of a list are variable, or none.
                    if !checked.contains(&list) {
                        problem.check_parameter(*parameter)?;
                        checked.push(list);
                    }
                    requested.listed.push(ListEntryParameter { list, place, index });
                }
                None => {
                    problem.check_parameter(*parameter)?;
                    requested.single.push(UnlistedParameter { index, parameter: *parameter });
                }
            }
        }
        Ok(requested)
    }

    /// Moves all entries of lists behind the other parameters, so that `listed` is empty. Needed if the initial state
    /// depends on them other than through the laws of joints.
    pub fn separate_lists(&mut self) {
        for ListEntryParameter { index, .. } in self.listed.drain(..) {
            self.single.push(UnlistedParameter { index, parameter: self.all[index] });
        }
    }
}

/// Overwrites the entries of `gradient` for the list parameters `listed` with the derivatives of the misfit by them.
/// `laws` are its derivatives by the laws (stiffness and natural stress) of all joints. Per list, one rod in dual
/// numbers gives the derivative by the natural strain at each joint. That by an entry is the sum of these, times the
/// entry's interpolation weight at the joint; it is zero for an entry without influence.
pub fn add_natural_strains<M: Model>(
    discretized: &Discretized<'_, M>,
    laws: &LawDerivatives,
    listed: &[ListEntryParameter],
    gradient: &mut [f64],
) where
    M::Rod<f64>: Transposed,
{
    let mut lists: Vec<NaturalStrains> = Vec::new();
    listed.iter().for_each(|own| {
        if !lists.contains(&own.list) {
            lists.push(own.list);
        }
    });
    let places = discretized.setup.mesh.places();
    // One rod with a unit derivative along all entries of a list contains the derivative of every
    // joint.
    for list in lists {
        let in_list = |p| NaturalStrains::of(p).is_some_and(|(own, _)| own == list);
        let seed = |p, value| Dual64::new(value, f64::from(u8::from(in_list(p))));
        let rod = discretized.setup_over::<Dual64>(seed).rod(discretized.model);
        let mut rates = <M::Rod<f64> as ForwardSensitivity>::Rates::default();
        <M::Rod<f64> as ForwardSensitivity>::set_rates(std::array::from_ref(&rod), &mut rates);
        let joints = <M::Rod<f64> as Transposed>::along_joints(&rates, laws);
        let mut by_place: Vec<f64> = Vec::new();
        for (i, joint) in joints.iter().enumerate() {
            // A joint between two entries interpolates them: its derivative is shared by their
            // weights.
            for (place, weight) in list.shares(discretized.scene(), i + 1, &places) {
                by_place.resize(by_place.len().max(place + 1), 0.0);
                by_place[place] += weight * joint;
            }
        }
        for own in listed.iter().filter(|own| own.list == list) {
            gradient[own.index] = by_place.get(own.place).copied().unwrap_or(0.0);
        }
    }
}
