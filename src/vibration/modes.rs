//! Modes of small vibrations about a state, the equilibrium or the rest shape: the lowest frequencies (rad/s), their
//! shapes and kinds.
//!
//! They solve `K v = omega^2 M v` with the exact tangent `K` at the state. The requested number of lowest modes is
//! computed, and all unstable ones if these are more (up to [`MAX_UNSTABLE`] in each plane). An unstable mode has minus
//! its growth rate (1/s) as frequency. Under loads without a potential there are growth rates beside frequencies, which
//! stay positive where a vibration grows (`follower_modes`). A planar scene with a shear modulus or Poisson's ratio and
//! without moments has modes out of its plane too. These are computed separately, so that modes of equal frequency do
//! not mix; both are sorted together by frequency, and the lowest of them are returned.
//!
//! A mode has a plane (none in space), a [`ModeKind`] and a number among the modes of its plane. Torsion: the energy of
//! twist exceeds both others. Axial: that of stretch exceeds bending, and most kinetic energy is along the rod. Rigid:
//! without strains, or a spin without stiffness. Bending: all others. Free rigid motions of frequency zero have no
//! number. Shapes are displacements of the nodes in world axes, the largest 1. Output: [`Modes`] (`mode`), and the
//! eigenpairs for frequencies with derivatives.
//!
//! [`VibratingRod`] has tangent, masses and the numbers of unstable and marginal modes at a state; `out_of_plane` is
//! that of motions out of the plane, in the spatial model at the same shape. `lowest` are its lowest modes, in
//! ascending order, of the `available` ones. Among them are at most `most_free` free rigid motions.

use crate::error::Error;
use crate::numerics::scalar::Scalar;
use crate::numerics::tangent::Tangent;
use crate::numerics::total_order;
use crate::numerics::vector::{dot, sub, unit};
use crate::problem::{
    AnyProblem, Discretized, FramesOf, Model, PlanarProblem, Problem, Purpose, SpatialModel,
    SpatialProblem, UnknownsAndFrames,
};
use crate::rod::{Rod, TangentOf};
use crate::scene::{End, Support};
use crate::statics::{
    MAX_UNCERTAIN, OutOfPlaneTangent, Pencil, PencilMode, Stability, UNCERTAIN_LEVELS,
    linear_combination, spatial_motion,
};
use crate::vibration::follower_modes::{FollowerMode, follower_modes};
use crate::vibration::mode::{LinearizationPoint, Mode, ModeKind, ModePlane, Modes};
use nalgebra::Vector3;
use std::ops::Range;

/// Largest number of unstable modes that are listed beyond the requested ones, so that the result stays bounded.
const MAX_UNSTABLE: usize = 200;

impl Problem {
    /// The `count` lowest modes about a state, and all unstable ones (up to 200 in either plane), in ascending order
    /// of frequency. Those of a planar scene are in its plane and, if it has a torsional stiffness and no moments,
    /// out of it. Warnings are about implausible values and large
    /// strains.
    ///
    /// ```
    /// use rodfit::vibration::{LinearizationPoint, ModeKind};
    /// let problem = rodfit::Scene::load("data/cantilever.toml")?.problem()?;
    /// let modes = problem.modes(3, LinearizationPoint::Rest)?;
    /// // A clamped beam: (1.875/L)^2 sqrt(EI/(rho A)).
    /// let exact = (1.8751_f64 / 0.5).powi(2) * 0.0025 * (1e8_f64 / 1273.52).sqrt();
    /// assert!((modes.frequencies_rad_s[0] / exact - 1.0).abs() < 1e-2); // rad/s
    /// assert_eq!(modes.modes[0].kind, ModeKind::Bending);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`equilibrium`](Problem::equilibrium), about it. Eigenvalues that do not converge, singular matrices,
    /// and too many unknowns under loads without a potential are errors about either state.
    pub fn modes(&self, count: usize, about: LinearizationPoint) -> Result<Modes, Error> {
        let (mut modes, mut all) = (Vec::new(), Stability::default());
        let mut notes = self.plausibility_notes(Purpose::Modes);
        match self.discretized() {
            AnyProblem::Planar(discretized) => {
                // Vibrations in the plane are those of the planar model.
                let q = linearization_state(&discretized, about)?.0;
                notes.extend(self.strain_warnings(|i| discretized.model.position(&q, i)));
                all += VibratingRod::new(&discretized, &q, &())?.add_modes(count, &mut modes)?;
                // Out of the plane the rod vibrates only if a torsional stiffness is given.
                if self.can_twist() {
                    let model = self.spatial_model();
                    let spatial = self.discretized_as(&model);
                    let (q, frames) = spatial_state(&discretized, &spatial, &q);
                    let rod = VibratingRod::out_of_plane(&spatial, &q, &frames)?;
                    all += rod.add_modes(count, &mut modes)?;
                }
            }
            AnyProblem::Spatial(discretized) => {
                let (q, frames) = linearization_state(&discretized, about)?;
                notes.extend(self.strain_warnings(|i| discretized.model.position(&q, i)));
                all +=
                    VibratingRod::new(&discretized, &q, &frames)?.add_modes(count, &mut modes)?;
            }
        }
        // Both planes together in ascending order; unstable modes are kept beyond the count.
        modes.sort_by_cached_key(|x| total_order(x.frequency_rad_s));
        let growing = modes.iter().rposition(Mode::is_growing).map_or(0, |last| last + 1);
        modes.truncate(count.max(growing));
        Ok(Modes {
            about,
            unstable: all.unstable,
            marginal: all.marginal,
            frequencies_rad_s: modes.iter().map(|mode| mode.frequency_rad_s).collect(),
            growth_rates_1_s: modes.iter().filter_map(|mode| mode.growth_rate_1_s).collect(),
            modes,
            resolution: None,
            warnings: notes.iter().map(|(code, words)| code.behind(words)).collect(),
            warning_codes: notes.iter().map(|(code, _)| *code).collect(),
        })
    }
}

/// Unknowns and frames at the state about which vibrations are linearized: the rest shape, or the equilibrium under the
/// loads, which is searched here. Errors are those of the search.
pub(super) fn linearization_state<M: Model>(
    discretized: &Discretized<'_, M>,
    about: LinearizationPoint,
) -> Result<UnknownsAndFrames<f64, M>, Error> {
    Ok(match about {
        LinearizationPoint::Rest => (discretized.rest(), discretized.rest_frames()),
        LinearizationPoint::Equilibrium => {
            let rest = discretized.equilibrium()?;
            (rest.q, rest.frames)
        }
    })
}

/// Unknowns and frames of the spatial model of a planar problem, with its nodes at those of the planar state `q`, m,
/// and sections that are not rotated about the rod.
pub(super) fn spatial_state(
    planar: &PlanarProblem<'_>,
    spatial: &SpatialProblem<'_>,
    q: &[f64],
) -> UnknownsAndFrames<f64, SpatialModel> {
    let place = |i: usize| planar.model.position(q, i);
    spatial.placed_still(&(0..planar.nodes()).map(place).collect::<Vec<_>>())
}

/// The unknowns of a model for a `vector` over those of the pencil of a `plane`. For `Out` the deflections become
/// motions along the normal of the scene's plane; other vectors are copied.
pub(super) fn motion_in_model<M: Model, D: Scalar>(
    discretized: &Discretized<'_, M>,
    plane: Option<ModePlane>,
    vector: &[D],
) -> Vec<D> {
    match plane {
        Some(ModePlane::Out) => {
            spatial_motion(vector, discretized.model.components(discretized.normal()))
        }
        _ => vector.to_vec(),
    }
}

/// A mode with its eigenvector in the unknowns of a [`Pencil`].
#[derive(Clone, Debug)]
pub(crate) struct Eigenpair {
    /// Square of the angular frequency, 1/s^2.
    pub squared: f64,
    /// Eigenvector over the unknowns of the pencil.
    pub vector: Vec<f64>,
    /// Dominant deformation.
    pub kind: ModeKind,
    /// Displacements of all nodes in world axes; the largest is 1.
    pub shape: Vec<[f64; 3]>,
}

impl Eigenpair {
    /// The angular frequency, rad/s, or minus the growth rate, 1/s, of an unstable mode: the root of the absolute
    /// `squared`, with its sign.
    pub fn frequency(&self) -> f64 {
        self.squared.signum() * self.squared.abs().sqrt()
    }

    /// Whether it is a free motion: rigid, and its squared frequency is exactly zero. Free motions have no number.
    pub fn is_free(&self) -> bool {
        self.squared == 0.0 && self.kind == ModeKind::Rigid
    }
}

/// A rod at the state of linearization, with the pencil of all vibrations of its model, or of those out of the plane.
pub(crate) struct VibratingRod<'a, M: Model, T: Tangent<f64>> {
    /// The discretized problem.
    pub(super) discretized: &'a Discretized<'a, M>,
    /// Unknowns at the state, m (rad for angles).
    pub(super) q: &'a [f64],
    /// Frames at the state, from which angles are measured.
    pub(super) frames: &'a FramesOf<M>,
    /// Stiffness `K` and masses `M` at the state.
    pub(super) pencil: Pencil<f64, T>,
    /// Numbers of unstable and marginal modes; zero under loads without a potential.
    stability: Stability,
    /// Whether there are loads without a potential: the tangent is not symmetric.
    follows: bool,
    /// The plane of the vibrations of a planar scene.
    pub plane: Option<ModePlane>,
}

impl<'a, M: Model> VibratingRod<'a, M, TangentOf<M::Rod<f64>, f64>> {
    /// All vibrations of a model about the state `q`, with tangent, masses and the numbers of unstable and marginal
    /// modes there. In a planar model they are in the plane. An error where the tangent is singular at all shifts.
    pub fn new(
        discretized: &'a Discretized<'a, M>,
        q: &'a [f64],
        frames: &'a FramesOf<M>,
    ) -> Result<Self, Error> {
        let rod = discretized.rod();
        let pencil = Pencil::at(discretized, &rod, q, frames);
        let follows = discretized.has_follower_loads();
        let stability = match follows {
            true => Stability::default(),
            false => {
                let resting = Pencil::resting(discretized, &rod, q, frames);
                discretized.stability(q, frames, &resting, <[f64]>::to_vec)?
            }
        };
        let plane = (M::STRIDE < 3).then_some(ModePlane::In);
        Ok(Self { discretized, q, frames, pencil, stability, follows, plane })
    }
}

impl<'a> VibratingRod<'a, SpatialModel, OutOfPlaneTangent<f64>> {
    /// The out-of-plane vibrations of a planar problem at the state `q` of its spatial model, `discretized`, with the
    /// numbers of unstable and marginal modes among them. An error where the tangent is singular at all shifts.
    pub fn out_of_plane(
        discretized: &'a SpatialProblem<'a>,
        q: &'a [f64],
        frames: &'a FramesOf<SpatialModel>,
    ) -> Result<Self, Error> {
        let normal = discretized.model.components(discretized.normal());
        let rod = discretized.rod();
        let pencil = Pencil::at(discretized, &rod, q, frames).out_of_plane(normal);
        let follows = discretized.has_follower_loads();
        let stability = match follows {
            true => Stability::default(),
            false => {
                let resting = Pencil::resting(discretized, &rod, q, frames).out_of_plane(normal);
                let in_model = |x: &[f64]| spatial_motion(x, normal);
                discretized.stability(q, frames, &resting, in_model)?
            }
        };
        Ok(Self { discretized, q, frames, pencil, stability, follows, plane: Some(ModePlane::Out) })
    }
}

impl<M: Model, T: Tangent<f64>> VibratingRod<'_, M, T> {
    /// Number of modes that can be computed: free unknowns with a mass.
    pub fn available(&self) -> usize {
        self.pencil.order()
    }

    /// Largest possible number of free rigid motions: 0 with a clamp or a recorded end without `free_twist`, else 3 in
    /// or out of a plane and 6 in space.
    pub fn most_free(&self) -> usize {
        let supports = &self.discretized.scene().supports;
        let clamped = [End::Start, End::End].into_iter().any(|end| match supports.at(end) {
            Support::Recorded => !supports.turns_freely(end),
            support => support == Support::Clamped,
        });
        match (clamped, self.plane) {
            (true, _) => 0,
            (false, Some(_)) => 3,
            (false, None) => 6,
        }
    }

    /// The mass of every node, kg, from the first to the last.
    pub fn node_masses(&self) -> Vec<f64> {
        // The mass of a node is that of any of its coordinates.
        let rod = self.discretized.rod();
        (0..self.discretized.nodes()).map(|i| rod.mass()[M::STRIDE * i]).collect()
    }

    /// The `count` lowest modes in ascending order (all, if there are fewer), with kinds and shapes. Squared
    /// frequencies below [zero](Discretized::zero_squared_frequency) or their rounding error are set to zero, unless
    /// they are counted as unstable. If few modes have an uncertain sign, these are [recomputed](Self::refine) instead.
    /// Errors: no convergence, singular matrices.
    pub fn lowest(&self, count: usize) -> Result<Vec<Eigenpair>, Error> {
        let zero = self.discretized.zero_squared_frequency();
        let scale = self.discretized.bending_frequency_squared();
        let mut found = self.pencil.lowest(count, scale)?;
        // Near zero, signs of the eigenvalues are rounding errors: they are recomputed from the elements.
        let refined = self.refine(&mut found, zero + scale * self.discretized.tangent_rounding());
        // Eigenvalues below their rounding error are zero, unless the inertia counts them as unstable.
        let pair = |(k, PencilMode { squared, vector }): (usize, PencilMode)| {
            let is_zero = !refined.contains(&k)
                && k >= self.stability.unstable
                && squared <= zero.max(self.pencil.rounding(&vector));
            let squared = if is_zero { 0.0 } else { squared };
            let rates = self.in_model(&vector);
            let shape = self.shape(&rates);
            Eigenpair { squared, kind: self.kind(squared, &rates, &shape), shape, vector }
        };
        Ok(found.into_iter().enumerate().map(pair).collect())
    }

    /// Recomputes squared frequencies, 1/s^2, whose size is at most [`UNCERTAIN_LEVELS`] times the `rounding` error,
    /// from the second variation of the energy. One within its tolerance becomes zero. These modes of `found` are
    /// overwritten in ascending order, with vectors that combine the old ones; the range of their indices is returned.
    /// It is empty without such modes, with more than [`MAX_UNCERTAIN`], and in edge coordinates; then nothing changes.
    fn refine(&self, found: &mut [PencilMode], rounding: f64) -> Range<usize> {
        // Only eigenvalues within the uncertainty of their sign, if they are few.
        let level = UNCERTAIN_LEVELS * rounding;
        let is_uncertain = |mode: &PencilMode| mode.squared.abs() <= level;
        let first = found.iter().position(is_uncertain).unwrap_or(0);
        let last = found.iter().rposition(is_uncertain).map_or(0, |k| k + 1);
        let places = first..last.max(first);
        if places.is_empty()
            || places.len() > MAX_UNCERTAIN
            || self.discretized.edge_coordinates().is_some()
        {
            return 0..0;
        }
        // Principal stiffnesses in the space of the uncertain modes replace their eigenvalues.
        let vectors: Vec<Vec<f64>> =
            found[places.clone()].iter().map(|mode| mode.vector.clone()).collect();
        let motions: Vec<Vec<f64>> = vectors.iter().map(|x| self.in_model(x)).collect();
        let stiffnesses = self.discretized.stiffnesses(self.q, self.frames, &motions);
        for (place, stiffness) in places.clone().zip(stiffnesses) {
            let squared = if stiffness.is_zero() { 0.0 } else { stiffness.value };
            let vector = linear_combination(&vectors, &stiffness.combination);
            found[place] = PencilMode { squared, vector };
        }
        found[places.clone()].sort_by_cached_key(|mode| total_order(mode.squared));
        places
    }

    /// The unknowns of the model for a `vector` over those of the pencil: deflections out of the plane become motions
    /// along its normal, other vectors are copied.
    fn in_model(&self, vector: &[f64]) -> Vec<f64> {
        motion_in_model(self.discretized, self.plane, vector)
    }

    /// Kind of a mode from its `rates` of the unknowns and its nodal `shape`. Rigid: without strains, or a spin with
    /// `squared` zero. Torsion: the energy of twist exceeds both others. Axial: that of stretch exceeds that of
    /// bending, and the motion is [along the rod](Self::is_axial). Else bending.
    fn kind(&self, squared: f64, rates: &[f64], shape: &[[f64; 3]]) -> ModeKind {
        // Strains of the motion: none of a rigid one, twist only of a spin.
        let motion = self.discretized.measure_motion(self.q, self.frames, rates);
        if motion.is_rigid() || squared == 0.0 && motion.is_spin() {
            return ModeKind::Rigid;
        }
        // Axial modes of a curved rod bend too; lateral modes of a cable stretch too: the motion
        // decides between them.
        let [stretch, bend, twist] = motion.energies;
        match () {
            () if twist > bend.max(stretch) => ModeKind::Torsion,
            () if stretch > bend && self.is_axial(shape) => ModeKind::Axial,
            () => ModeKind::Bending,
        }
    }

    /// Whether more than half of the kinetic energy of the nodal `shape` is motion along the rod's tangents, which are
    /// central differences of nodes. Stretching alone does not distinguish axial modes: lateral modes of a sagging
    /// cable stretch it too.
    fn is_axial(&self, shape: &[[f64; 3]]) -> bool {
        let (masses, last) = (self.node_masses(), shape.len() - 1);
        let place = |i: usize| self.discretized.model.position(self.q, i);
        let mut sums = [0.0; 2];
        for (i, (x, mass)) in shape.iter().zip(masses).enumerate() {
            // Central difference of the nodes, one-sided at the ends.
            let tangent = unit(sub(place(last.min(i + 1)), place(i.saturating_sub(1))));
            sums[0] += mass * dot(*x, tangent).powi(2);
            sums[1] += mass * dot(*x, *x);
        }
        sums[0] > 0.5 * sums[1]
    }

    /// Displacements of all nodes in world axes from the `rates` of the unknowns, scaled such that the longest has
    /// length 1; zeros if no node moves.
    fn shape(&self, rates: &[f64]) -> Vec<[f64; 3]> {
        let mut shape: Vec<[f64; 3]> =
            (0..self.discretized.nodes()).map(|i| self.discretized.model.rate(rates, i)).collect();
        let largest =
            shape.iter().map(|x| Vector3::from(*x).norm()).fold(f64::MIN_POSITIVE, f64::max);
        shape.iter_mut().flatten().for_each(|x| *x /= largest);
        shape
    }

    /// Appends to `modes` the `count` lowest modes, or as many as there are unstable ones (at most [`MAX_UNSTABLE`]) if
    /// these are more. They are numbered from 1 on in ascending order, except for free motions, which have no number.
    /// Returns the numbers of unstable and marginal motions of the rod. Errors are those of the eigenvalue search.
    fn add_modes(&self, count: usize, modes: &mut Vec<Mode>) -> Result<Stability, Error> {
        if self.follows {
            return self.add_follower_modes(count, modes);
        }
        let pairs = self.lowest(count.max(self.stability.unstable.min(MAX_UNSTABLE)))?;
        let mut number = 0;
        for pair in pairs {
            // Free motions have no number: experiments do not measure them.
            number += usize::from(!pair.is_free());
            modes.push(Mode {
                frequency_rad_s: pair.frequency(),
                growth_rate_1_s: None,
                mesh_error: None,
                plane: self.plane,
                kind: pair.kind,
                number: (!pair.is_free()).then_some(number),
                shape: pair.shape,
            });
        }
        Ok(self.stability)
    }

    /// [`add_modes`](Self::add_modes) under loads without a potential, with growth rates. Appends the first
    /// `max(count, min(last, MAX_UNSTABLE))` modes in ascending order of frequency, where `last` is the number of modes
    /// up to the last growing one. Returns the number of all growing modes, and no marginal ones.
    fn add_follower_modes(&self, count: usize, modes: &mut Vec<Mode>) -> Result<Stability, Error> {
        let all = follower_modes(&self.pencil, self.discretized.bending_frequency_squared())?;
        let unstable = all.iter().filter(|mode| mode.growth_rate > 0.0).count();
        let last = all.iter().rposition(|mode| mode.growth_rate > 0.0).map_or(0, |last| last + 1);
        let mut number = 0;
        for FollowerMode { frequency, growth_rate, vector } in
            all.into_iter().take(count.max(last.min(MAX_UNSTABLE)))
        {
            let rates = self.in_model(&vector);
            let shape = self.shape(&rates);
            let kind = self.kind(frequency * frequency, &rates, &shape);
            let is_free = frequency == 0.0 && growth_rate == 0.0 && kind == ModeKind::Rigid;
            number += usize::from(!is_free);
            modes.push(Mode {
                frequency_rad_s: frequency,
                growth_rate_1_s: Some(growth_rate),
                mesh_error: None,
                plane: self.plane,
                kind,
                number: (!is_free).then_some(number),
                shape,
            });
        }
        Ok(Stability { unstable, marginal: 0 })
    }
}
