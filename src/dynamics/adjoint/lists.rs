//! Lists of numbers along the rod, each of which changes a few joints only.
//!
//! What one number of such a list makes of a misfit could be asked number by number, and each would cost a rod built
//! anew. All numbers of a list at once tell how every joint's law changes with the value *there*; what that makes of the
//! misfit is shared out to the numbers that the value is made of.

use crate::error::Error;
use crate::problem::{Discretized, Model, Problem};
use crate::rod::{Laws, Sensitive, Transposed};
use crate::scene::{Parameter, Scene};
use num_dual::Dual64;
use std::collections::HashSet;

/// A list of numbers that only the laws of joints follow from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum List {
    /// `rod.natural_curvature`.
    Curvature,
    /// `rod.natural_twist`.
    Twist,
    /// `rod.natural_bending`, along the first director or the second.
    Bending(usize),
}

impl List {
    /// The list that a parameter is one of, and its place there.
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

    /// The numbers of the list that its value at an inner node is made of, with their weights.
    fn shares(self, scene: &Scene, node: usize, places: &[f64]) -> Vec<(usize, f64)> {
        let rod = &scene.rod;
        match self {
            Self::Curvature => rod.natural_curvature.shares(places[node]),
            Self::Twist => rod.natural_twist.shares(places[node]),
            Self::Bending(_) => {
                rod.bending_shares(node, places.len() - 1).into_iter().flatten().collect()
            }
        }
    }
}

/// What a gradient is asked by.
#[derive(Debug, Default)]
pub struct Asked {
    /// Numbers by themselves, with their place in the gradient.
    pub single: Vec<(usize, Parameter)>,
    /// Numbers of lists: the list, the place there and that in the gradient.
    pub listed: Vec<(List, usize, usize)>,
}

impl Asked {
    /// Sorts parameters.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a parameter that the scene does not have, or that its model cannot vary.
    pub fn new(problem: &Problem, parameters: &[Parameter]) -> Result<Self, Error> {
        let mut asked = Self::default();
        let known: HashSet<Parameter> = match parameters.iter().any(|p| List::of(*p).is_some()) {
            true => Parameter::all(problem.scene()).into_iter().collect(),
            false => HashSet::new(),
        };
        let mut checked: Vec<List> = Vec::new();
        for (k, parameter) in parameters.iter().enumerate() {
            match List::of(*parameter).filter(|_| known.contains(parameter)) {
                Some((list, place)) => {
                    // What keeps one number of a list from being varied keeps all.
                    if !checked.contains(&list) {
                        problem.check_parameter(*parameter)?;
                        checked.push(list);
                    }
                    asked.listed.push((list, place, k));
                }
                None => {
                    problem.check_parameter(*parameter)?;
                    asked.single.push((k, *parameter));
                }
            }
        }
        Ok(asked)
    }

    /// Numbers of lists by themselves too, where the start of a run follows them in ways of its own.
    pub fn one_by_one(&mut self, parameters: &[Parameter]) {
        self.single.extend(self.listed.drain(..).map(|(.., k)| (k, parameters[k])));
    }
}

/// Writes the derivatives by numbers of lists.
pub fn share_out<M: Model>(
    discretized: &Discretized<'_, M>,
    laws: &Laws,
    listed: &[(List, usize, usize)],
    gradient: &mut [f64],
) where
    M::Rod<f64>: Transposed,
{
    let mut lists: Vec<List> = Vec::new();
    listed.iter().for_each(|(list, ..)| {
        if !lists.contains(list) {
            lists.push(*list);
        }
    });
    let places = discretized.setup.mesh.places();
    for list in lists {
        let in_list = |p| List::of(p).is_some_and(|(own, _)| own == list);
        let seed = |p, value| Dual64::new(value, f64::from(u8::from(in_list(p))));
        let rod = discretized.setup_over::<Dual64>(seed).rod(discretized.model);
        let mut rates = <M::Rod<f64> as Sensitive>::Rates::default();
        <M::Rod<f64> as Sensitive>::set_rates(std::array::from_ref(&rod), &mut rates);
        let joints = <M::Rod<f64> as Transposed>::along_joints(&rates, laws);
        let mut by_place: Vec<f64> = Vec::new();
        for (i, joint) in joints.iter().enumerate() {
            for (place, weight) in list.shares(discretized.scene(), i + 1, &places) {
                by_place.resize(by_place.len().max(place + 1), 0.0);
                by_place[place] += weight * joint;
            }
        }
        for (_, place, k) in listed.iter().filter(|(own, ..)| *own == list) {
            gradient[*k] = by_place.get(*place).copied().unwrap_or(0.0);
        }
    }
}
