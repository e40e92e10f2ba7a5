//! Natural frequencies about an equilibrium with exact derivatives with respect to parameters.
//!
//! A parameter changes tangent and masses, and it moves the equilibrium. So the equilibrium is differentiated first
//! ([`Trajectory::at_rest`]). Tangent `K` and masses `M` are assembled there in dual numbers. Inverse iteration with
//! the shift `s = (1 - 1e-7) lambda`,
//!
//! ```text
//! y = (K - s M)^-1 M x,   lambda = s + y.Mx / y.My,   x = y / |y|,
//! ```
//!
//! starts from the mode that [`modes`](crate::vibration::modes) finds in plain numbers. Every iteration reduces the
//! components of `x` along other modes, and those of its derivatives. The factor is the ratio of the distances of the
//! shift from `lambda` and from the next eigenvalue. The error of the quotient is of second order in them. First
//! derivatives agree with the Hellmann-Feynman theorem; second ones include the change of the mode. Bending modes whose
//! names have `timoshenko` have frequencies that shear and rotary inertia reduce.
//!
//! Input: names of modes ([`ModeName`]) and parameters. Output: one angular frequency per name, in their order, rad/s,
//! with its derivative with respect to each parameter (`natural_frequencies`; `natural_frequencies_over` over any
//! scalar). Errors: a mode without stiffness, a number above that of the modes, a filter or parameter that the scene
//! cannot have, and a load without a potential. With parameters also a mode whose frequency agrees with another one in
//! its plane within `CLUSTER_DISTANCE`.
//!
//! [`Trajectory::at_rest`]: crate::Trajectory::at_rest

use crate::energy::frame::Frames;
use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::{Factors, Tangent};
use crate::problem::{AnyProblem, Model, ModelWithSetup, Problem, SpatialModel};
use crate::rod::Rod;
use crate::scene::Parameter;
use crate::statics::{CheckedEquilibrium, Pencil};
use crate::vibration::mode::{ModeKind, ModePlane};
use crate::vibration::modes::{Eigenpair, VibratingRod, spatial_state};
use crate::vibration::name::ModeName;
use crate::vibration::timoshenko::VibrationState;
use num_dual::Dual64;

/// Relative distance of the shift from the eigenvalue. A smaller one converges faster, with larger rounding errors of
/// the factors.
const SHIFT_OFFSET: f64 = 1e-7;
/// Number of inverse iterations. Each reduces components along other modes by a factor of a thousand at least; the
/// first one yields the derivatives of the shift.
const ITERATIONS: usize = 4;
/// Relative distance of frequencies up to which modes mix and have no separate derivatives.
const CLUSTER_DISTANCE: f64 = 1e-6;

/// A natural frequency and its derivatives by parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct NaturalFrequency {
    /// Angular frequency, rad/s.
    pub frequency_rad_s: f64,
    /// Derivative by each of the parameters, rad/s per unit of the parameter.
    pub derivatives: Vec<f64>,
}

impl Problem {
    /// The angular frequencies, rad/s, of named modes about the equilibrium under the loads, in the order of the names.
    /// Each has its exact derivatives by the `parameters`, in their order. A number without a filter as a name counts
    /// from 1 on in ascending order: the modes in the plane of a planar scene, or all modes of a spatial one; see
    /// [`ModeName`]. Free rigid motions are not counted.
    ///
    /// # Errors
    /// Those of [`equilibrium`](Problem::equilibrium). [`Error::Mode`] for a mode without stiffness. With `parameters`
    /// also for a mode with the frequency of another one in the same plane, as the pairs of bending modes of a round
    /// rod in space. [`Error::OutOfRange`] for a number above that of the modes, [`Error::Invalid`] for a filter or
    /// parameter that the scene cannot have, and for a load without a potential. [`Error::Indifferent`] at a stability
    /// limit.
    pub fn natural_frequencies<N: Into<ModeName> + Copy>(
        &self,
        modes: &[N],
        parameters: &[Parameter],
    ) -> Result<Vec<NaturalFrequency>, Error> {
        let modes: Vec<ModeName> = modes.iter().map(|name| (*name).into()).collect();
        let named = NamedModes::new(self, &modes, !parameters.is_empty())?;
        let without_derivatives = |frequency_rad_s: f64| NaturalFrequency {
            frequency_rad_s,
            derivatives: Vec::with_capacity(parameters.len()),
        };
        let plain = named.plain_frequencies()?;
        let mut frequencies: Vec<_> = plain.into_iter().map(without_derivatives).collect();
        for parameter in parameters {
            self.check_parameter(*parameter)?;
            let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
            for (frequency, dual) in frequencies.iter_mut().zip(named.frequencies(seed)?) {
                frequency.derivatives.push(dual.eps);
            }
        }
        Ok(frequencies)
    }

    /// The frequencies of named modes about the equilibrium under the loads, rad/s, in the order of the names, over
    /// any scalar. `seed` returns the number of a parameter over it.
    ///
    /// # Errors
    /// Those of [`natural_frequencies`](Self::natural_frequencies).
    pub fn natural_frequencies_over<D: RodScalar, N: Into<ModeName> + Copy>(
        &self,
        modes: &[N],
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Result<Vec<D>, Error> {
        let modes: Vec<ModeName> = modes.iter().map(|name| (*name).into()).collect();
        NamedModes::new(self, &modes, D::ORDER > 0)?.frequencies(seed)
    }
}

/// The equilibrium of a planar or spatial problem, about which its modes vibrate.
enum AnyEquilibrium {
    /// With the spatial model if there are modes out of the plane.
    Planar(CheckedEquilibrium<()>, Option<Box<ModelWithSetup<SpatialModel>>>),
    Spatial(CheckedEquilibrium<Frames<f64>>),
}

/// A mode and its plane (in or out of the plane of a planar problem); no plane in spatial problems.
struct PlaneMode {
    plane: Option<ModePlane>,
    pair: Eigenpair,
    /// Whether its frequency includes shear deformation and rotary inertia.
    timoshenko: bool,
}

/// Named modes of a problem, in plain numbers, with the equilibrium that they are about.
struct NamedModes<'a> {
    problem: &'a Problem,
    equilibrium: AnyEquilibrium,
    modes: Vec<PlaneMode>,
}

impl<'a> NamedModes<'a> {
    /// The named modes in plain numbers, in the order of the names, with the equilibrium, which is searched here. Modes
    /// in and out of the plane of a planar problem are computed separately. If they are `differentiated`, every one
    /// must have a frequency of its own in its plane. Errors are those of [`Problem::natural_frequencies`].
    fn new(problem: &'a Problem, names: &[ModeName], differentiated: bool) -> Result<Self, Error> {
        for name in names {
            name.check(problem, "modes")?;
        }
        let scene = problem.scene();
        if let Some(load) = scene.loads.first_follower(problem.spatial().is_some()) {
            let allowed = "no such load for named natural frequencies; `rodfit modes` takes it";
            let found = "a load without a potential";
            return Err(Error::invalid(load.key(), found, allowed).in_file(scene.path.as_deref()));
        }
        // Modes in and out of the plane are computed separately, each for its names.
        let planes: Vec<Option<ModePlane>> =
            names.iter().map(|n| n.among.plane_of(problem)).collect();
        let names_in = |plane: ModePlane| -> Vec<ModeName> {
            let own = names.iter().zip(&planes).filter(|(_, p)| **p == Some(plane));
            own.map(|(name, _)| *name).collect()
        };
        let (mut inside, mut outside) = (Vec::new().into_iter(), Vec::new().into_iter());
        let equilibrium = match problem.discretized() {
            AnyProblem::Planar(discretized) => {
                let equilibrium = discretized.checked_equilibrium()?;
                let q = &equilibrium.rest.q;
                let names = names_in(ModePlane::In);
                if !names.is_empty() {
                    let rod = VibratingRod::new(&discretized, q, &())?;
                    inside = find_named_modes(&rod, &names, differentiated)?.into_iter();
                }
                let mut model = None;
                let names = names_in(ModePlane::Out);
                if !names.is_empty() {
                    let spatial =
                        problem.discretized_as(&**model.insert(Box::new(problem.spatial_model())));
                    let (q, frames) = spatial_state(&discretized, &spatial, q);
                    let rod = VibratingRod::out_of_plane(&spatial, &q, &frames)?;
                    outside = find_named_modes(&rod, &names, differentiated)?.into_iter();
                }
                AnyEquilibrium::Planar(equilibrium, model)
            }
            AnyProblem::Spatial(discretized) => {
                let equilibrium = discretized.checked_equilibrium()?;
                let rest = &equilibrium.rest;
                let rod = VibratingRod::new(&discretized, &rest.q, &rest.frames)?;
                inside = find_named_modes(&rod, names, differentiated)?.into_iter();
                AnyEquilibrium::Spatial(equilibrium)
            }
        };
        // Back in the order of the names.
        let modes = planes.iter().zip(names).filter_map(|(plane, name)| {
            let own = if *plane == Some(ModePlane::Out) { &mut outside } else { &mut inside };
            let pair = own.next()?;
            let timoshenko = name.timoshenko && pair.kind == ModeKind::Bending;
            Some(PlaneMode { plane: *plane, pair, timoshenko })
        });
        Ok(Self { problem, modes: modes.collect(), equilibrium })
    }

    /// The frequencies, rad/s, in the order of the modes, without derivatives. They are those of the computed modes. If
    /// any name requests shear and rotary inertia, all are computed by [`frequencies`](Self::frequencies), whose errors
    /// are passed on.
    fn plain_frequencies(&self) -> Result<Vec<f64>, Error> {
        // Those of slender rods need no inverse iteration.
        match self.modes.iter().any(|mode| mode.timoshenko) {
            true => self.frequencies(|_, value| value),
            false => Ok(self.modes.iter().map(|mode| mode.pair.frequency()).collect()),
        }
    }

    /// The frequencies, rad/s, in the order of the modes, with the derivatives that `D` carries, by inverse iteration
    /// at the differentiated equilibrium. `seed` returns the number of a parameter over `D`. [`Error::Indifferent`] or
    /// [`Error::SingularEquilibrium`] for singular matrices.
    fn frequencies<D: RodScalar>(
        &self,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Result<Vec<D>, Error> {
        let mut frequencies = vec![D::from(0.0); self.modes.len()];
        let mut set = |plane, frequency: &dyn Fn(&PlaneMode) -> Result<D, Error>| {
            for (own, mode) in frequencies.iter_mut().zip(&self.modes) {
                if mode.plane == plane {
                    *own = frequency(mode)?;
                }
            }
            Ok::<(), Error>(())
        };
        match (self.problem.discretized(), &self.equilibrium) {
            (AnyProblem::Planar(discretized), AnyEquilibrium::Planar(equilibrium, spatial)) => {
                // The equilibrium with derivatives first, then stiffness and masses there.
                let setup = discretized.setup_over(&seed);
                let (rod, q) = discretized.differentiated_equilibrium(equilibrium, &setup)?;
                let state = VibrationState {
                    discretized: &discretized,
                    setup: &setup,
                    q: &q,
                    frames: &(),
                    pencil: &Pencil::at(&discretized, &rod, &q, &()),
                    plane: Some(ModePlane::In),
                };
                set(Some(ModePlane::In), &|mode| frequency(&state, mode))?;
                // Modes out of the plane: the same shape with derivatives in the spatial model.
                if let Some(model) = spatial.as_deref() {
                    let place = |i: usize| discretized.model.position(&q, i);
                    let nodes: Vec<[D; 3]> = (0..discretized.nodes()).map(place).collect();
                    let discretized = self.problem.discretized_as(model);
                    let setup = discretized.setup_over(&seed);
                    let (q, frames) = discretized.placed(&setup, &nodes);
                    let rod = setup.rod(discretized.model);
                    let normal = discretized.model.components(discretized.normal());
                    let state = VibrationState {
                        discretized: &discretized,
                        setup: &setup,
                        q: &q,
                        frames: &frames,
                        pencil: &Pencil::at(&discretized, &rod, &q, &frames).out_of_plane(normal),
                        plane: Some(ModePlane::Out),
                    };
                    set(Some(ModePlane::Out), &|mode| frequency(&state, mode))?;
                }
            }
            (AnyProblem::Spatial(discretized), AnyEquilibrium::Spatial(equilibrium)) => {
                let setup = discretized.setup_over(&seed);
                let (rod, q) = discretized.differentiated_equilibrium(equilibrium, &setup)?;
                // The inertia of angles is diagonal only about the frames at the equilibrium.
                let mut frames = SpatialModel::frames_over::<D>(&equilibrium.rest.frames);
                <SpatialModel as Model>::Rod::<D>::update_reference_frames(&mut frames, &q);
                let state = VibrationState {
                    discretized: &discretized,
                    setup: &setup,
                    q: &q,
                    frames: &frames,
                    pencil: &Pencil::at(&discretized, &rod, &q, &frames),
                    plane: None,
                };
                set(None, &|mode| frequency(&state, mode))?;
            }
            _ => unreachable!("a problem keeps its model"),
        }
        Ok(frequencies)
    }
}

/// The modes of a rod with the given names, in their order. A number counts the modes that pass its filter, from 1 on.
/// The number of computed modes is doubled until all names are found, each with one more mode above it, or all modes
/// are computed. [`Error::OutOfRange`] for zero or a number above that of the modes which pass the filter. A mode
/// without stiffness is [`Error::Mode`], and, if they are `differentiated`, so is one with the frequency of another
/// mode.
pub(super) fn find_named_modes<M: Model, T: Tangent<f64>>(
    rod: &VibratingRod<'_, M, T>,
    names: &[ModeName],
    differentiated: bool,
) -> Result<Vec<Eigenpair>, Error> {
    let mass = rod.node_masses();
    let most = names.iter().map(|name| name.number).max().unwrap_or(0);
    // Free motions come first, and one more mode shows whether the last one has a frequency of its
    // own. Modes of one kind may be rare: the number is doubled until all are found.
    let mut count = most.saturating_add(1 + rod.most_free()).min(rod.available());
    loop {
        let all = rod.lowest(count)?;
        let place = |name: &ModeName| {
            let mut own = (0..all.len()).filter(|k| name.among.includes(&all[*k], |i| mass[i]));
            own.nth(name.number.checked_sub(1)?)
        };
        let is_last = count == rod.available();
        let places: Vec<Option<usize>> = names.iter().map(place).collect();
        if is_last || places.iter().all(|k| k.is_some_and(|k| k + 1 < all.len())) {
            let one = |(name, place): (&ModeName, &Option<usize>)| match *place {
                Some(k) => checked_mode(&all, k, name, differentiated),
                None => {
                    let own = all.iter().filter(|pair| name.among.includes(pair, |i| mass[i]));
                    let (found, high) = (name.number as f64, own.count() as f64);
                    Err(Error::OutOfRange { what: "mode", found, low: 1.0, high })
                }
            };
            return names.iter().zip(&places).map(one).collect();
        }
        count = (2 * count).min(rod.available());
    }
}

/// A copy of mode `k` of `all`, after checks of stiffness and, if it is `differentiated`, of a frequency of its own
/// within [`CLUSTER_DISTANCE`]; `name` identifies it in messages.
///
/// # Errors
/// [`Error::Mode`] for a mode without stiffness, and, if it is `differentiated`, for one with the frequency of another.
fn checked_mode(
    all: &[Eigenpair],
    k: usize,
    name: &ModeName,
    differentiated: bool,
) -> Result<Eigenpair, Error> {
    let pair = &all[k];
    let rejected = |reason: String| {
        Err(Error::Mode {
            number: name.number,
            among: name.among.words(),
            frequency_rad_s: pair.frequency(),
            reason,
        })
    };
    if pair.squared <= 0.0 {
        return rejected("it has no stiffness and does not vibrate".into());
    }
    let is_equal =
        |other: &Eigenpair| (other.frequency() / pair.frequency() - 1.0).abs() < CLUSTER_DISTANCE;
    match (0..all.len()).find(|i| differentiated && *i != k && is_equal(&all[*i])) {
        Some(i) => rejected(format!(
            "{} mode {} of all modes has the same frequency, so that neither has a unique \
             derivative",
            all[i].kind.name(),
            all[..=i].iter().filter(|pair| !pair.is_free()).count()
        )),
        None => Ok(pair.clone()),
    }
}

/// The angular frequency of a mode, rad/s, with the derivatives that `D` carries: [`ITERATIONS`] inverse iterations on
/// the pencil over `D` from the mode in plain numbers. The value is that of the mode in plain numbers; the derivatives
/// are those of the last Rayleigh quotient. With `timoshenko` the result is reduced by shear and rotary inertia.
/// [`Error::SingularEquilibrium`] for a zero pivot.
fn frequency<D: RodScalar, M: Model, T: Tangent<D>>(
    state: &VibrationState<'_, D, M, T>,
    PlaneMode { pair, timoshenko, .. }: &PlaneMode,
) -> Result<D, Error> {
    let pencil = state.pencil;
    let Pencil { tangent, mass, free } = pencil;
    let mut factors = tangent.new_factors();
    let mut x: Vec<D> = pair.vector.iter().map(|x| D::from(*x)).collect();
    let mut squared = D::from(pair.squared);
    for _ in 0..ITERATIONS {
        let shift = squared * (1.0 - SHIFT_OFFSET);
        factors
            .factor_sum(mass, -shift, tangent, D::from(1.0), free.clone())
            .map_err(|_| Error::SingularEquilibrium)?;
        // One inverse iteration, y = (K - s M)^-1 M x.
        let image: Vec<D> = x.iter().zip(mass).map(|(x, m)| *x * *m).collect();
        x.copy_from_slice(&image);
        factors.solve(&mut x);
        if factors.negative_pivots() > 0 {
            x = refine_solution(x, pencil, shift, &factors, &image);
        }
        // Rayleigh quotient of the shifted problem, y.Mx / y.My, and normalization of y.
        let mut own = D::from(0.0);
        let mut with_image = D::from(0.0);
        for i in free.clone() {
            with_image += x[i] * image[i];
            own += x[i] * x[i] * mass[i];
        }
        squared = shift + with_image / own;
        let scale = own.sqrt().recip();
        x.iter_mut().for_each(|x| *x *= scale);
    }
    // Rounding errors of the quotient are larger than those of the modes.
    let slender = (squared - D::from(squared.value()) + pair.squared).sqrt();
    Ok(if *timoshenko { slender * state.frequency_factor(slender, &x) } else { slender })
}

/// One step of iterative refinement of the solution `x` of `(K - shift M) x = right`; returns the refined solution if
/// its largest residual is lower, else `x`. Above the first mode the matrix is indefinite, and a small pivot of the
/// elimination without pivoting costs digits of the derivatives.
fn refine_solution<D: RodScalar, T: Tangent<D>>(
    x: Vec<D>,
    Pencil { tangent, mass, free }: &Pencil<D, T>,
    shift: D,
    factors: &T::Factors,
    right: &[D],
) -> Vec<D> {
    let residual = |x: &[D]| {
        let right: Vec<D> = (0..x.len()).map(|i| right[i] + shift * mass[i] * x[i]).collect();
        tangent.residual(free.clone(), x, &right)
    };
    let size = |residual: &[D]| residual.iter().fold(0.0_f64, |most, r| most.max(r.value().abs()));
    let before = residual(&x);
    let mut better = vec![D::from(0.0); x.len()];
    better[free.clone()].copy_from_slice(&before);
    factors.solve(&mut better);
    better.iter_mut().zip(&x).for_each(|(better, x)| *better += *x);
    if size(&residual(&better)) < size(&before) { better } else { x }
}
