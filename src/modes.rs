//! Small vibrations: the lowest frequencies and shapes about a state.
//!
//! `K v = omega^2 M v` with the exact tangent `K` at the state, by subspace iteration with the
//! shifted inverse: `Y = (K + shift M)^-1 M X` on the band factors, a Rayleigh-Ritz step on `Y`
//! (the small eigenproblem is faer's), until the frequencies stand. A planar scene that says how
//! stiff the rod is in torsion vibrates out of its plane too; those modes are found apart from the
//! plane's, so that equal frequencies do not mix.

use crate::banded::{BandMatrix, Ldlt};
use crate::energy::Derivatives;
use crate::error::Error;
use crate::model::Model;
use crate::problem::{AnyProblem, FramesOf, PlanarProblem, Posed, Problem, SpatialProblem};
use crate::rod::Rod;
use faer::{Mat, Side};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// Vectors iterated beyond those asked for: they speed up the last ones.
const EXTRA: usize = 8;
/// Iterations at most.
const ITERATIONS: usize = 300;
/// Frequencies that change by less than this part stand.
const STANDS: f64 = 1e-13;

/// The state vibrations are about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum About {
    /// Where the rod hangs under its loads.
    #[default]
    Equilibrium,
    /// The rest shape, whatever the loads.
    Rest,
}

/// Which way a mode goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// In the plane of a planar scene.
    InPlane,
    /// Out of it, twisting included.
    OutOfPlane,
    /// Of a spatial scene.
    Spatial,
}

/// A mode of vibration.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Mode {
    /// Angular frequency, rad/s; of an unstable direction minus its growth rate, 1/s. Zero where
    /// nothing resists, such as a free rod's motion as a rigid body.
    pub frequency_rad_s: f64,
    /// Which way it goes.
    pub kind: Kind,
    /// Displacement of every node in world axes; the largest is 1.
    pub shape: Vec<[f64; 3]>,
}

/// The lowest modes about a state.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Modes {
    /// Which state.
    pub about: About,
    /// Angular frequencies, ascending, in and out of plane, rad/s; unstable directions first, as
    /// minus their growth rates.
    pub frequencies_rad_s: Vec<f64>,
    /// The modes, in the same order.
    pub modes: Vec<Mode>,
}

impl Problem {
    /// The `count` lowest modes about a state.
    pub fn modes(&self, count: usize, about: About) -> Result<Modes, Error> {
        let mut modes = match self.posed() {
            AnyProblem::Planar(posed) => {
                let state = state(&posed, about)?;
                let modes = lowest(&posed, (&state.0, &state.1), count, Kind::InPlane)?;
                let mut modes: Vec<Mode> =
                    modes.into_iter().map(|own| own.mode(&posed, Kind::InPlane)).collect();
                if self.can_twist() {
                    let model = self.spatial_model()?;
                    let spatial = self.posed_as(&model);
                    let own = out_of_plane(&posed, &spatial, &state.0, count)?;
                    modes.extend(own.into_iter().map(|own| own.mode(&spatial, Kind::OutOfPlane)));
                }
                modes
            }
            AnyProblem::Spatial(posed) => {
                let state = state(&posed, about)?;
                let modes = lowest(&posed, (&state.0, &state.1), count, Kind::Spatial)?;
                modes.into_iter().map(|own| own.mode(&posed, Kind::Spatial)).collect()
            }
        };
        modes.sort_by(|a, b| a.frequency_rad_s.total_cmp(&b.frequency_rad_s));
        modes.truncate(count);
        let frequencies_rad_s = modes.iter().map(|mode| mode.frequency_rad_s).collect();
        Ok(Modes { about, frequencies_rad_s, modes })
    }
}

type State<M, const W: usize> = (Vec<f64>, FramesOf<M, W>);

fn state<M: Model<W>, const W: usize>(
    posed: &Posed<'_, M, W>,
    about: About,
) -> Result<State<M, W>, Error> {
    Ok(match about {
        About::Rest => (posed.rest(), posed.model.frames()),
        About::Equilibrium => {
            let rest = posed.equilibrium()?;
            (rest.q, rest.frames)
        }
    })
}

/// A vibration in a model's own terms.
#[derive(Clone, Debug)]
pub(crate) struct Own {
    /// Square of the angular frequency, 1/s^2.
    pub squared: f64,
    /// Rates of the unknowns.
    pub vector: Vec<f64>,
}

impl Own {
    /// As in [`Mode::frequency_rad_s`].
    pub fn frequency(&self) -> f64 {
        self.squared.signum() * self.squared.abs().sqrt()
    }

    fn mode<M: Model<W>, const W: usize>(&self, posed: &Posed<'_, M, W>, kind: Kind) -> Mode {
        let mut shape: Vec<[f64; 3]> =
            (0..posed.nodes()).map(|i| posed.model.rate(&self.vector, i)).collect();
        let largest =
            shape.iter().map(|x| Vector3::from(*x).norm()).fold(f64::MIN_POSITIVE, f64::max);
        shape.iter_mut().flatten().for_each(|x| *x /= largest);
        Mode { frequency_rad_s: self.frequency(), kind, shape }
    }
}

/// The lowest modes out of the plane of a planar problem that is at `q`.
pub(crate) fn out_of_plane(
    planar: &PlanarProblem<'_>,
    spatial: &SpatialProblem<'_>,
    q: &[f64],
    count: usize,
) -> Result<Vec<Own>, Error> {
    let place = |i: usize| planar.model.position(q, i);
    let (q, frames) = spatial.placed(&(0..planar.nodes()).map(place).collect::<Vec<_>>());
    lowest(spatial, (&q, &frames), count, Kind::OutOfPlane)
}

/// The lowest modes of a model; out of plane, of those that go along its normal.
pub(crate) fn lowest<M: Model<W>, const W: usize>(
    posed: &Posed<'_, M, W>,
    (q, frames): (&[f64], &FramesOf<M, W>),
    count: usize,
    kind: Kind,
) -> Result<Vec<Own>, Error> {
    let (rod, free) = (posed.rod(), posed.free());
    let n = q.len();
    let (mut gradient, mut tangent) = (vec![0.0; n], BandMatrix::zeros(n));
    rod.tangent(q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
    let mass = rod.mass();
    // Any shift will do that makes a free rod's tangent regular.
    let shift = posed.bending_frequency_squared();
    let mut factors = Ldlt::with_order(n);
    factors
        .factor_sum(mass, shift, &tangent, 1.0, free.clone())
        .map_err(|singular| Error::SingularTangent { time: 0.0, row: singular.row })?;

    // Rounding errors must not bring the plane's modes back in.
    let normal = posed.model.components(posed.normal());
    let project = |x: &mut [f64]| {
        if kind == Kind::OutOfPlane {
            for x in x.chunks_mut(4) {
                let along = dot(&normal, &x[..3]);
                x.iter_mut().zip(normal).for_each(|(x, normal)| *x = normal * along);
            }
        }
    };
    let available = match kind {
        Kind::OutOfPlane => free.len() / 2,
        _ => free.len(),
    };
    let block = (count + EXTRA).min(available);
    let count = count.min(block);
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut basis: Vec<Vec<f64>> = (0..block)
        .map(|_| {
            let mut x = vec![0.0; n];
            x[free.clone()].fill_with(|| random.random_range(-1.0..1.0));
            project(&mut x);
            x
        })
        .collect();
    let mut values = vec![f64::INFINITY; block];
    for _ in 0..ITERATIONS {
        // Right-hand sides M X, and solutions Y; then Y made M-orthonormal, and M X with it.
        let mut images: Vec<Vec<f64>> = basis
            .iter()
            .map(|x| x.iter().zip(mass).map(|(x, m)| x * m).collect::<Vec<f64>>())
            .collect();
        basis.clone_from(&images);
        for x in &mut basis {
            factors.solve(x);
            project(x);
        }
        orthonormalize(&mut basis, &mut images, mass);
        let small = Mat::from_fn(block, block, |i, j| {
            0.5 * (dot(&basis[i], &images[j]) + dot(&basis[j], &images[i]))
        });
        let eigen = small
            .self_adjoint_eigen(Side::Lower)
            .map_err(|_| Error::SingularTangent { time: 0.0, row: free.start })?;
        let rotation = eigen.U();
        basis = (0..block)
            .map(|k| {
                let mut x = vec![0.0; n];
                for (j, y) in basis.iter().enumerate() {
                    let weight = rotation[(j, k)];
                    x.iter_mut().zip(y).for_each(|(x, y)| *x += weight * y);
                }
                x
            })
            .collect();
        let before = std::mem::take(&mut values);
        values = (0..block).map(|k| eigen.S()[k]).collect();
        let stand = |k: usize| (values[k] - before[k]).abs() <= STANDS * values[k].abs();
        if (0..count).all(stand) {
            break;
        }
    }
    let zero = posed.zero_frequency_squared(None);
    Ok((0..count)
        .map(|k| {
            let squared = Some(values[k] - shift).filter(|w2| w2.abs() > zero).unwrap_or(0.0);
            Own { squared, vector: std::mem::take(&mut basis[k]) }
        })
        .collect())
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Gram-Schmidt on `basis` in the metric `mass`, twice for accuracy, with the same combinations of
/// `images`.
fn orthonormalize(basis: &mut [Vec<f64>], images: &mut [Vec<f64>], mass: &[f64]) {
    let product = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).zip(mass).map(|((a, b), m)| a * b * m).sum()
    };
    for k in 0..basis.len() {
        for _ in 0..2 {
            for j in 0..k {
                let part = product(&basis[j], &basis[k]);
                for vectors in [&mut *basis, &mut *images] {
                    let (done, rest) = vectors.split_at_mut(k);
                    rest[0].iter_mut().zip(&done[j]).for_each(|(x, y)| *x -= part * y);
                }
            }
            let norm = product(&basis[k], &basis[k]).sqrt().recip();
            for vectors in [&mut *basis, &mut *images] {
                vectors[k].iter_mut().for_each(|x| *x *= norm);
            }
        }
    }
}

impl std::fmt::Display for Modes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let about = match self.about {
            About::Equilibrium => "equilibrium under the loads",
            About::Rest => "the rest shape",
        };
        write!(f, "about {about}:")?;
        for mode in &self.modes {
            let kind = match mode.kind {
                Kind::InPlane => "in plane",
                Kind::OutOfPlane => "out of plane",
                Kind::Spatial => "",
            };
            let w = mode.frequency_rad_s;
            match w < 0.0 {
                true => write!(f, "\n  unstable, grows by {:.6e} 1/s   {kind}", -w)?,
                false => {
                    write!(f, "\n  {w:.6e} rad/s   {:.6e} Hz   {kind}", w / std::f64::consts::TAU)?
                }
            }
        }
        Ok(())
    }
}
