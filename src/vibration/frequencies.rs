//! How the frequencies of small vibrations about an equilibrium change with the parameters.
//!
//! A parameter changes the tangent and the masses, and it moves the equilibrium that the tangent is
//! taken at. So the equilibrium gets its derivatives first ([`Trajectory::at_rest`]); tangent `K` and
//! masses `M` are assembled there in dual numbers, and inverse iteration with the shift
//! `s = (1 - 1e-7) lambda`,
//!
//! ```text
//! y = (K - s M)^-1 M x,   lambda = s + y.Mx / y.My,   x = y / |y|,
//! ```
//!
//! starts from the mode that [`modes`](crate::vibration::modes) finds in plain numbers. The parts of `x` along
//! other modes, its derivatives' included, fall with the shift's distance over that of the mode's
//! neighbour, and the quotient is off by their square. First derivatives are those of Hellmann and
//! Feynman; second ones know how the mode itself changes.
//!
//! [`Trajectory::at_rest`]: crate::Trajectory::at_rest

use crate::energy::frame::Frames;
use crate::error::Error;
use crate::numerics::scalar::Nestable;
use crate::numerics::tangent::{Factors, Tangent};
use crate::problem::Model;
use crate::problem::SpatialModel;
use crate::problem::{AnyProblem, ModelWithSetup, Problem};
use crate::rod::Rod;
use crate::scene::Parameter;
use crate::statics::CheckedEquilibrium;
use crate::statics::Pencil;
use crate::vibration::modes::{Eigenpair, ModePlane, Vibrating, across};
use crate::vibration::name::ModeName;
use num_dual::Dual64;

/// The shift's distance from the eigenvalue, as a part of it.
const OFF: f64 = 1e-7;
/// Each makes the parts along other modes smaller by a thousandth at least; the first finds the
/// shift's own derivatives.
const ITERATIONS: usize = 4;
/// Modes of frequencies nearer than this part mix, and have no derivatives of their own.
const APART: f64 = 1e-6;

/// A natural frequency and its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct NaturalFrequency {
    /// Angular frequency, rad/s.
    pub frequency_rad_s: f64,
    /// Its derivative by each of the parameters, rad/s over their units.
    pub derivatives: Vec<f64>,
}

impl Problem {
    /// The frequencies of named modes about the equilibrium under the loads, with their exact
    /// derivatives by `parameters`. A mere number counts, from 1 on in the order of rising frequency,
    /// the modes in the plane of a planar scene, and all those of a spatial one; see [`ModeName`].
    ///
    /// # Errors
    /// Those of [`equilibrium`](Problem::equilibrium). A mode that is unstable or meets no resistance is
    /// refused by [`Error::Mode`], and so is one that another in the same plane vibrates as fast as: of
    /// a round rod in space, bending modes come in such pairs.
    pub fn natural_frequencies<N: Into<ModeName> + Copy>(
        &self,
        modes: &[N],
        parameters: &[Parameter],
    ) -> Result<Vec<NaturalFrequency>, Error> {
        let modes: Vec<ModeName> = modes.iter().map(|name| (*name).into()).collect();
        self.named_frequencies(&modes, parameters)
    }

    fn named_frequencies(
        &self,
        modes: &[ModeName],
        parameters: &[Parameter],
    ) -> Result<Vec<NaturalFrequency>, Error> {
        let vibrations = Vibrations::of(self, modes, !parameters.is_empty())?;
        let natural_frequency = |(_, pair): &(Option<ModePlane>, Eigenpair)| NaturalFrequency {
            frequency_rad_s: pair.frequency(),
            derivatives: Vec::with_capacity(parameters.len()),
        };
        let mut natural_frequencies: Vec<NaturalFrequency> =
            vibrations.modes.iter().map(natural_frequency).collect();
        for parameter in parameters {
            self.check_parameter(*parameter)?;
            let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
            for (found, over) in natural_frequencies.iter_mut().zip(vibrations.over(seed)?) {
                found.derivatives.push(over.eps);
            }
        }
        Ok(natural_frequencies)
    }

    /// The same frequencies, rad/s, over any scalar; `seed` makes the numbers of the parameters.
    ///
    /// # Errors
    /// Those of [`natural_frequencies`](Self::natural_frequencies).
    pub fn natural_frequencies_over<D: Nestable, N: Into<ModeName> + Copy>(
        &self,
        modes: &[N],
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Result<Vec<D>, Error> {
        let modes: Vec<ModeName> = modes.iter().map(|name| (*name).into()).collect();
        Vibrations::of(self, &modes, D::ORDER > 0)?.over(seed)
    }
}

/// An equilibrium by its model.
enum AnySettled {
    /// With the spatial model, where modes out of the plane are asked for.
    Planar(CheckedEquilibrium<()>, Option<Box<ModelWithSetup<SpatialModel>>>),
    Spatial(CheckedEquilibrium<Frames<f64>>),
}

/// Modes to be differentiated.
struct Vibrations<'a> {
    problem: &'a Problem,
    settled: AnySettled,
    modes: Vec<(Option<ModePlane>, Eigenpair)>,
}

impl<'a> Vibrations<'a> {
    /// The named modes; `apart` if derivatives are asked for.
    fn of(problem: &'a Problem, names: &[ModeName], apart: bool) -> Result<Self, Error> {
        for name in names {
            name.among.check(problem, "modes")?;
        }
        let planes: Vec<Option<ModePlane>> =
            names.iter().map(|n| n.among.plane_of(problem)).collect();
        let own = |plane: Option<ModePlane>| -> Vec<ModeName> {
            names.iter().zip(&planes).filter(|(_, p)| **p == plane).map(|(n, _)| *n).collect()
        };
        let (found, settled) = match problem.discretized() {
            AnyProblem::Planar(discretized) => {
                let settled = discretized.checked_equilibrium()?;
                let q = &settled.rest.q;
                let mut found = vec![(Some(ModePlane::In), Vec::new())];
                let inside = own(Some(ModePlane::In));
                if !inside.is_empty() {
                    found[0].1 = named(&Vibrating::of(&discretized, q, &())?, &inside, apart)?;
                }
                let mut model = None;
                let outside = own(Some(ModePlane::Out));
                if !outside.is_empty() {
                    let spatial =
                        problem.discretized_as(&**model.insert(Box::new(problem.spatial_model()?)));
                    let (q, frames) = across(&discretized, &spatial, q);
                    let vibrating = Vibrating::across(&spatial, &q, &frames)?;
                    found.push((Some(ModePlane::Out), named(&vibrating, &outside, apart)?));
                }
                (found, AnySettled::Planar(settled, model))
            }
            AnyProblem::Spatial(discretized) => {
                let settled = discretized.checked_equilibrium()?;
                let vibrating = Vibrating::of(&discretized, &settled.rest.q, &settled.rest.frames)?;
                (vec![(None, named(&vibrating, names, apart)?)], AnySettled::Spatial(settled))
            }
        };
        // Back in the order of the names.
        let mut found: Vec<_> = found.into_iter().map(|(p, all)| (p, all.into_iter())).collect();
        let modes = planes.iter().filter_map(|plane| {
            let (_, own) = found.iter_mut().find(|(p, _)| p == plane)?;
            Some((*plane, own.next()?))
        });
        Ok(Self { problem, modes: modes.collect(), settled })
    }

    /// Their frequencies with the derivatives that `D` carries, rad/s.
    fn over<D: Nestable>(&self, seed: impl Fn(Parameter, f64) -> D) -> Result<Vec<D>, Error> {
        let picked = |plane| self.modes.iter().enumerate().filter(move |(_, m)| m.0 == plane);
        let mut frequencies = vec![D::from(0.0); self.modes.len()];
        let mut add = |plane: Option<ModePlane>, one: &dyn Fn(&Eigenpair) -> Result<D, Error>| {
            for (k, (_, pair)) in picked(plane) {
                frequencies[k] = one(pair)?;
            }
            Ok::<(), Error>(())
        };
        match (self.problem.discretized(), &self.settled) {
            (AnyProblem::Planar(discretized), AnySettled::Planar(settled, spatial)) => {
                let (rod, q) = discretized
                    .differentiated_equilibrium(settled, &discretized.setup_over(&seed))?;
                let pencil = Pencil::at(&discretized, &rod, &q, &());
                add(Some(ModePlane::In), &|pair| frequency(&pencil, pair))?;
                if let Some(model) = spatial.as_deref() {
                    let place = |i: usize| discretized.model.position(&q, i);
                    let nodes: Vec<[D; 3]> = (0..discretized.nodes()).map(place).collect();
                    let discretized = self.problem.discretized_as(model);
                    let setup = discretized.setup_over(&seed);
                    let (q, frames) = discretized.placed(&setup, &nodes);
                    let whole =
                        Pencil::at(&discretized, &setup.rod(discretized.model), &q, &frames);
                    let pencil = whole.across(discretized.model.components(discretized.normal()));
                    add(Some(ModePlane::Out), &|pair| frequency(&pencil, pair))?;
                }
            }
            (AnyProblem::Spatial(discretized), AnySettled::Spatial(settled)) => {
                let (rod, q) = discretized
                    .differentiated_equilibrium(settled, &discretized.setup_over(&seed))?;
                // Angles are coordinates whose inertia is theirs about the moved frames only.
                let mut frames = SpatialModel::frames_over::<D>(&settled.rest.frames);
                <SpatialModel as Model>::Rod::<D>::rebase(&mut frames, &q);
                let pencil = Pencil::at(&discretized, &rod, &q, &frames);
                add(None, &|pair| frequency(&pencil, pair))?;
            }
            _ => unreachable!("a problem keeps its model"),
        }
        Ok(frequencies)
    }
}

/// The named modes of a vibrating rod; if they are to stand `apart`, each with a frequency of its
/// own.
pub(super) fn named<M: Model, T: Tangent<f64>>(
    vibrating: &Vibrating<'_, M, T>,
    names: &[ModeName],
    apart: bool,
) -> Result<Vec<Eigenpair>, Error> {
    let mass = vibrating.node_masses();
    let most = names.iter().map(|name| name.number).max().unwrap_or(0);
    // Free motions come first, and the next one tells whether the last stands alone. Modes of one
    // kind may be few among others.
    let mut count = most.saturating_add(1 + vibrating.most_free()).min(vibrating.available());
    loop {
        let all = vibrating.lowest(count)?;
        let place = |name: &ModeName| {
            let mut own = (0..all.len()).filter(|k| name.among.has(&all[*k], |i| mass[i]));
            own.nth(name.number.checked_sub(1)?)
        };
        let is_last = count == vibrating.available();
        let places: Vec<Option<usize>> = names.iter().map(place).collect();
        if is_last || places.iter().all(|k| k.is_some_and(|k| k + 1 < all.len())) {
            let one = |(name, place): (&ModeName, &Option<usize>)| match *place {
                Some(k) => single(&all, k, name, apart),
                None => {
                    let own = all.iter().filter(|pair| name.among.has(pair, |i| mass[i]));
                    let (found, high) = (name.number as f64, own.count() as f64);
                    Err(Error::OutOfRange { what: "mode", found, low: 1.0, high })
                }
            };
            return names.iter().zip(&places).map(one).collect();
        }
        count = (2 * count).min(vibrating.available());
    }
}

/// Mode `k` of `all`, if it has a frequency, and, if it is to stand `apart`, one of its own.
fn single(all: &[Eigenpair], k: usize, name: &ModeName, apart: bool) -> Result<Eigenpair, Error> {
    let pair = &all[k];
    let refused = |reason: String| {
        Err(Error::Mode {
            number: name.number,
            among: name.among.words(),
            frequency_rad_s: pair.frequency(),
            reason,
        })
    };
    if pair.squared <= 0.0 {
        return refused("it has no stiffness and does not vibrate".into());
    }
    let as_fast = |other: &Eigenpair| (other.frequency() / pair.frequency() - 1.0).abs() < APART;
    match (0..all.len()).find(|i| apart && *i != k && as_fast(&all[*i])) {
        Some(i) => refused(format!(
            "{} mode {} of all vibrates as fast, so that neither has derivatives of its own",
            all[i].kind.name(),
            all[..=i].iter().filter(|pair| !pair.is_free()).count()
        )),
        None => Ok(pair.clone()),
    }
}

/// The frequency of a mode of the same rod in plain numbers, rad/s, with its derivatives.
fn frequency<D: Nestable, T: Tangent<D>>(
    pencil: &Pencil<D, T>,
    pair: &Eigenpair,
) -> Result<D, Error> {
    let Pencil { tangent, mass, free } = pencil;
    let mut factors = T::Factors::with_order(mass.len());
    let mut x: Vec<D> = pair.vector.iter().map(|x| D::from(*x)).collect();
    let mut squared = D::from(pair.squared);
    for _ in 0..ITERATIONS {
        let shift = squared * (1.0 - OFF);
        factors
            .factor_sum(mass, -shift, tangent, D::from(1.0), free.clone())
            .map_err(|_| Error::SingularEquilibrium)?;
        let image: Vec<D> = x.iter().zip(mass).map(|(x, m)| *x * *m).collect();
        x.copy_from_slice(&image);
        factors.solve(&mut x);
        if factors.negative_pivots() > 0 {
            x = refined(x, (pencil, shift), &factors, &image);
        }
        let mut own = D::from(0.0);
        let mut across = D::from(0.0);
        for i in free.clone() {
            across += x[i] * image[i];
            own += x[i] * x[i] * mass[i];
        }
        squared = shift + across / own;
        let scale = own.sqrt().recip();
        x.iter_mut().for_each(|x| *x *= scale);
    }
    // Rounding errors of the quotient are larger than those of the modes.
    Ok((squared - D::from(squared.value()) + pair.squared).sqrt())
}

/// A better solution `x` of `(K - shift M) x = right`. Above the first mode this matrix is indefinite, and an
/// elimination without pivoting may happen to meet a small pivot, which costs digits of the derivatives. A
/// correction by the residual brings them back; it is taken where the residual falls.
fn refined<D: Nestable, T: Tangent<D>>(
    x: Vec<D>,
    (Pencil { tangent, mass, free }, shift): (&Pencil<D, T>, D),
    factors: &T::Factors,
    right: &[D],
) -> Vec<D> {
    let residual = |x: &[D]| {
        let right: Vec<D> = (0..x.len()).map(|i| right[i] + shift * mass[i] * x[i]).collect();
        tangent.residual(free.clone(), x, &right)
    };
    let size = |residual: &[D]| residual.iter().fold(0.0_f64, |most, r| most.max(r.value().abs()));
    let left = residual(&x);
    let mut better = vec![D::from(0.0); x.len()];
    better[free.clone()].copy_from_slice(&left);
    factors.solve(&mut better);
    better.iter_mut().zip(&x).for_each(|(better, x)| *better += *x);
    if size(&residual(&better)) < size(&left) { better } else { x }
}
