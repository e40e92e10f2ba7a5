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
//! starts from the mode that [`modes`](crate::modes) finds in plain numbers. The parts of `x` along
//! other modes, its derivatives' included, fall with the shift's distance over that of the mode's
//! neighbour, and the quotient is off by their square. First derivatives are those of Hellmann and
//! Feynman; second ones know how the mode itself changes.
//!
//! [`Trajectory::at_rest`]: crate::Trajectory::at_rest

use crate::banded::{BandMatrix, Ldlt};
use crate::energy::Derivatives;
use crate::error::Error;
use crate::frame::Frames;
use crate::model::{Model, SpatialModel};
use crate::modes::{Kind, Own, lowest, out_of_plane};
use crate::parameter::{Parameter, Properties};
use crate::problem::{AnyProblem, Posed, Problem, Settled};
use crate::rod::Rod;
use crate::scalar::Nestable;
use num_dual::Dual64;
use std::ops::Range;

/// The shift's distance from the eigenvalue, as a part of it.
const OFF: f64 = 1e-7;
/// Each makes the parts along other modes smaller by a thousandth at least; the first finds the
/// shift's own derivatives.
const ITERATIONS: usize = 4;
/// Modes of frequencies nearer than this part mix, and have no derivatives of their own.
const APART: f64 = 1e-6;

/// A frequency and its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Tone {
    /// Angular frequency, rad/s.
    pub frequency_rad_s: f64,
    /// By each of the parameters, rad/s over their units.
    pub derivatives: Vec<f64>,
}

impl Problem {
    /// The frequencies of the modes `numbers` about the equilibrium under the loads, with their exact
    /// derivatives by `parameters`. Modes count from 1 in the order of
    /// [`modes`](Problem::modes)`(_, About::Equilibrium)`, whose frequencies these are.
    ///
    /// A mode that is unstable or meets no resistance is refused by [`Error::Mode`], and so is one
    /// that another of the same kind vibrates as fast as: of a round rod in space, bending modes come
    /// in such pairs.
    pub fn tones(&self, numbers: &[usize], parameters: &[Parameter]) -> Result<Vec<Tone>, Error> {
        let vibrations = Vibrations::of(self, numbers, !parameters.is_empty())?;
        let tone = |(_, own): &(Kind, Own)| Tone {
            frequency_rad_s: own.frequency(),
            derivatives: Vec::with_capacity(parameters.len()),
        };
        let mut tones: Vec<Tone> = vibrations.modes.iter().map(tone).collect();
        for parameter in parameters {
            self.check_parameter(*parameter)?;
            let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
            for (tone, frequency) in tones.iter_mut().zip(vibrations.over(seed)?) {
                tone.derivatives.push(frequency.eps);
            }
        }
        Ok(tones)
    }

    /// The same frequencies, rad/s, over any scalar; `seed` makes the numbers of the parameters.
    pub fn tones_over<D: Nestable>(
        &self,
        numbers: &[usize],
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Result<Vec<D>, Error> {
        Vibrations::of(self, numbers, D::ORDER > 0)?.over(seed)
    }
}

/// An equilibrium by its model.
enum AnySettled {
    /// With the spatial model, where modes out of the plane are asked for.
    Planar(Settled<()>, Option<Box<SpatialModel>>),
    Spatial(Settled<Frames<f64>>),
}

/// Modes to be differentiated.
struct Vibrations<'a> {
    problem: &'a Problem,
    settled: AnySettled,
    modes: Vec<(Kind, Own)>,
}

impl<'a> Vibrations<'a> {
    /// The modes `numbers`; `apart` if derivatives are asked for.
    fn of(problem: &'a Problem, numbers: &[usize], apart: bool) -> Result<Self, Error> {
        // The next one tells whether the last stands alone.
        let count = numbers.iter().max().map_or(0, |most| most.saturating_add(1));
        let (mut all, settled) = match problem.posed() {
            AnyProblem::Planar(posed) => {
                let settled = posed.settled()?;
                let q = &settled.rest.q;
                let mut all =
                    of_kind(Kind::InPlane, lowest(&posed, (q, &()), count, Kind::InPlane)?);
                let mut model = None;
                if problem.can_twist() {
                    let spatial = &**model.insert(Box::new(problem.spatial_model()?));
                    let outside = out_of_plane(&posed, &problem.posed_as(spatial), q, count)?;
                    all.extend(of_kind(Kind::OutOfPlane, outside));
                }
                (all, AnySettled::Planar(settled, model))
            }
            AnyProblem::Spatial(posed) => {
                let settled = posed.settled()?;
                let state = (&settled.rest.q[..], &settled.rest.frames);
                let all = lowest(&posed, state, count, Kind::Spatial)?;
                (of_kind(Kind::Spatial, all), AnySettled::Spatial(settled))
            }
        };
        all.sort_by(|(_, a), (_, b)| a.frequency().total_cmp(&b.frequency()));
        let modes = numbers.iter().map(|number| single(&all, *number, apart));
        Ok(Self { problem, modes: modes.collect::<Result<_, _>>()?, settled })
    }

    /// Their frequencies with the derivatives that `D` carries, rad/s.
    fn over<D: Nestable>(&self, seed: impl Fn(Parameter, f64) -> D) -> Result<Vec<D>, Error> {
        let properties = Properties::of(self.problem.scene(), seed);
        let picked = |kind: Kind| self.modes.iter().enumerate().filter(move |(_, m)| m.0 == kind);
        let mut frequencies = vec![D::from(0.0); self.modes.len()];
        let mut add = |kind: Kind, one: &dyn Fn(&Own) -> Result<D, Error>| {
            for (k, (_, own)) in picked(kind) {
                frequencies[k] = one(own)?;
            }
            Ok::<(), Error>(())
        };
        match (self.problem.posed(), &self.settled) {
            (AnyProblem::Planar(posed), AnySettled::Planar(settled, spatial)) => {
                let (rod, q) = posed.settled_over(settled, &properties)?;
                let tangent = Tangent::at(&posed, &rod, &q, &());
                add(Kind::InPlane, &|own| tangent.frequency(own))?;
                if let Some(model) =
                    spatial.as_deref().filter(|_| picked(Kind::OutOfPlane).count() > 0)
                {
                    let place = |i: usize| posed.model.position(&q, i);
                    let nodes: Vec<[D; 3]> = (0..posed.nodes()).map(place).collect();
                    let posed = self.problem.posed_as(model);
                    let (q, frames) = posed.placed(&nodes);
                    let rod = model.rod(&properties);
                    let tangent = Tangent::at(&posed, &rod, &q, &frames);
                    add(Kind::OutOfPlane, &|own| tangent.frequency(own))?;
                }
            }
            (AnyProblem::Spatial(posed), AnySettled::Spatial(settled)) => {
                let (rod, q) = posed.settled_over(settled, &properties)?;
                // Angles are coordinates whose inertia is theirs about the moved frames only.
                let mut frames = SpatialModel::lift::<D>(&settled.rest.frames);
                <SpatialModel as Model<_>>::Rod::<D>::rebase(&mut frames, &q);
                let tangent = Tangent::at(&posed, &rod, &q, &frames);
                add(Kind::Spatial, &|own| tangent.frequency(own))?;
            }
            _ => unreachable!("a problem keeps its model"),
        }
        Ok(frequencies)
    }
}

fn of_kind(kind: Kind, modes: Vec<Own>) -> Vec<(Kind, Own)> {
    modes.into_iter().map(|own| (kind, own)).collect()
}

/// Mode `number` of `all`, if it has a frequency, and, if it is to stand `apart`, one of its own.
fn single(all: &[(Kind, Own)], number: usize, apart: bool) -> Result<(Kind, Own), Error> {
    let Some((kind, own)) = number.checked_sub(1).and_then(|k| all.get(k)) else {
        let high = all.len() as f64;
        return Err(Error::OutOfRange { what: "mode", found: number as f64, low: 1.0, high });
    };
    let refused =
        |reason: String| Err(Error::Mode { number, frequency_rad_s: own.frequency(), reason });
    if own.squared <= 0.0 {
        return refused("nothing resists it, so that it does not vibrate".into());
    }
    let as_fast = |(k, (other, mode)): (usize, &(Kind, Own))| {
        let same = other == kind && k + 1 != number;
        same && (mode.frequency() / own.frequency() - 1.0).abs() < APART
    };
    match all.iter().enumerate().position(|other| apart && as_fast(other)) {
        Some(k) => refused(format!(
            "mode {} vibrates as fast, so that neither has derivatives of its own",
            k + 1
        )),
        None => Ok((*kind, own.clone())),
    }
}

/// A rod's tangent and masses at a state.
struct Tangent<'a, D, const W: usize> {
    free: Range<usize>,
    mass: &'a [D],
    tangent: BandMatrix<D, W>,
}

impl<'a, D: Nestable, const W: usize> Tangent<'a, D, W> {
    fn at<M: Model<W>>(
        posed: &Posed<'_, M, W>,
        rod: &'a M::Rod<D>,
        q: &[D],
        frames: &<M::Rod<D> as Rod<D, W>>::Frames,
    ) -> Self {
        let mut tangent = BandMatrix::zeros(q.len());
        let mut gradient = vec![D::from(0.0); q.len()];
        rod.tangent(q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
        Self { free: posed.free(), mass: rod.mass(), tangent }
    }

    /// The frequency of a mode of the same rod in plain numbers, rad/s, with its derivatives.
    fn frequency(&self, own: &Own) -> Result<D, Error> {
        let mut factors = Ldlt::with_order(self.mass.len());
        let mut x: Vec<D> = own.vector.iter().map(|x| D::from(*x)).collect();
        let mut squared = D::from(own.squared);
        for _ in 0..ITERATIONS {
            let shift = squared * (1.0 - OFF);
            factors
                .factor_sum(self.mass, -shift, &self.tangent, D::from(1.0), self.free.clone())
                .map_err(|singular| Error::SingularTangent { time: 0.0, row: singular.row })?;
            let image: Vec<D> = x.iter().zip(self.mass).map(|(x, m)| *x * *m).collect();
            x.copy_from_slice(&image);
            factors.solve(&mut x);
            let mut own = D::from(0.0);
            let mut across = D::from(0.0);
            for i in self.free.clone() {
                across += x[i] * image[i];
                own += x[i] * x[i] * self.mass[i];
            }
            squared = shift + across / own;
            let scale = own.sqrt().recip();
            x.iter_mut().for_each(|x| *x *= scale);
        }
        // Rounding errors of the quotient are larger than those of the modes.
        Ok((squared - D::from(squared.value()) + own.squared).sqrt())
    }
}
