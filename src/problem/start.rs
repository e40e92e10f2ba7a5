//! Where a problem's rod begins: in its rest shape, in a given shape, or in equilibrium; and the
//! equilibria that `rodfit static` looks for from there.

use super::{FramesOf, Posed, SpatialProblem};
use crate::banded::{BandMatrix, Ldlt};
use crate::chain::Chain;
use crate::drive::{Drive, DrivenEnd};
use crate::energy::Derivatives;
use crate::error::Error;
use crate::flow::{Flow, Rest};
use crate::frame::Frames;
use crate::model::Model;

use crate::rod::{Rod, SpatialRod};
use crate::scalar::Nestable;
use crate::scene::supports::Moment;
use crate::scene::{Clamp, End, Motion, Support};
use crate::vector::{add, cross, dot, scale, sub, unit};

/// Unknowns with the frames their angles count from.
pub(crate) type Placed<M, const W: usize> = (Vec<f64>, FramesOf<M, W>);

impl SpatialProblem<'_> {
    /// The unknowns and frames of a rod that has moved to `nodes` without turning about itself.
    pub(crate) fn placed(&self, nodes: &[[f64; 3]]) -> (Vec<f64>, Frames<f64>) {
        let mut q = self.rest();
        for (i, x) in nodes.iter().enumerate() {
            q[4 * i..4 * i + 3].copy_from_slice(&self.model.components(*x));
        }
        let mut frames = self.model.frames();
        SpatialRod::<f64>::rebase(&mut frames, &q);
        (q, frames)
    }
}

impl<M: Model<W>, const W: usize> Posed<'_, M, W> {
    /// The unknowns before supports move and loads pull, and their frames: of the rest shape, or of
    /// the scene's initial shape, without twist.
    pub(crate) fn begin(&self) -> Placed<M, W> {
        let (mut q, mut frames) = (self.rest(), self.model.frames());
        let Some(nodes) = &self.problem.start_shape else { return (q, frames) };
        for (i, x) in nodes.iter().enumerate() {
            let own = self.model.components(*x);
            let axes = M::STRIDE.min(3);
            q[M::STRIDE * i..][..axes].copy_from_slice(&own[..axes]);
        }
        M::Rod::<f64>::rebase(&mut frames, &q);
        M::Rod::<f64>::untwist(&mut q, &frames);
        (q, frames)
    }

    /// The supports that move, if any do.
    pub(crate) fn drive(&self) -> Option<Drive> {
        let supports = &self.problem.scene().supports;
        let moved = |end: End| supports.motion.iter().filter(move |motion| motion.end == end);
        if supports.motion.is_empty() {
            return None;
        }
        let (q, frames) = self.begin();
        let last = self.nodes() - 1;
        let place = |i: usize| {
            let mut x = [0.0; 3];
            let axes = M::STRIDE.min(3);
            x[..axes].copy_from_slice(&q[M::STRIDE * i..][..axes]);
            x
        };
        let ends = [End::Start, End::End].into_iter().filter(|end| moved(*end).next().is_some());
        let ends = ends.map(|end| {
            let ([outer, inner], edge) = match end {
                End::Start => ([0, 1], 0),
                End::End => ([last, last - 1], last - 1),
            };
            let clamped = supports.at(end) == Support::Clamped;
            let held = if clamped { vec![outer, inner] } else { vec![outer] };
            let centre = match supports.clamp {
                Clamp::MidEdge if clamped => scale(add(place(outer), place(inner)), 0.5),
                _ => place(outer),
            };
            let motions = moved(end).map(|motion| Motion {
                displacement: self.model.components(motion.displacement),
                rotation: self.model.components(motion.rotation),
                ..motion.clone()
            });
            DrivenEnd {
                end,
                motions: motions.collect(),
                centre,
                nodes: held.into_iter().map(|i| (i, place(i))).collect(),
                edge: M::Rod::<f64>::director(&q, &frames, edge).filter(|_| clamped).map(
                    |director| {
                        let tangent = unit(sub(place(edge + 1), place(edge)));
                        (edge, [tangent, director])
                    },
                ),
            }
        });
        Some(Drive::new::<M, W>(ends.collect()))
    }

    /// The rod with the forces that hold it until t = 0.
    fn held_rod<D: Nestable>(&self, rod: &M::Rod<D>) -> M::Rod<D> {
        let mut held = rod.clone();
        self.model.add_loads(&mut held, &self.problem.held);
        held
    }

    /// The state the rod creeps into under its loads, from where it begins; moved ends are where
    /// their motion leaves them.
    pub fn equilibrium(&self) -> Result<Rest<FramesOf<M, W>>, Error> {
        self.equilibrium_of(&self.rod(), true)
    }

    /// The same of a rod with other loads, with ends where their motion leaves them (`settled`), or
    /// where it has them at t = 0. Ends far from where they begin are moved there step by step.
    fn equilibrium_of(
        &self,
        rod: &M::Rod<f64>,
        settled: bool,
    ) -> Result<Rest<FramesOf<M, W>>, Error> {
        self.problem.check_stop()?;
        let (mut q, mut frames) = self.begin();
        let drive = self.drive();
        let parts = drive.as_ref().map_or(1, |drive| drive.parts(self.problem.length(), settled));
        let mut iterations = 0;
        for k in 1..=parts {
            if let Some(drive) = &drive {
                let part = |k: usize| k as f64 / parts as f64;
                let [from, to] = [k - 1, k].map(|k| Moment::Approach { part: part(k), settled });
                drive.carry(from, to, &mut q, |end, node| self.reach(end, node));
                drive.advance::<f64, M::Rod<f64>, W>(from, to, &mut q, &frames);
            }
            let chain = self.chain();
            let scales = (self.problem.length(), self.zero_frequency_squared(chain));
            let derivatives = self.problem.derivatives();
            let rest =
                Flow::new(rod, self.free(), scales, chain, derivatives, q).descend(frames)?;
            iterations += rest.newton_iterations;
            if k == parts {
                return Ok(Rest { newton_iterations: iterations, ..rest });
            }
            (q, frames) = (rest.q, rest.frames);
        }
        unreachable!("there is at least one part")
    }

    /// How far node `i` goes along with a moved end: wholly where nothing holds the other end, else
    /// less and less towards it.
    fn reach(&self, end: End, i: usize) -> f64 {
        let supports = &self.problem.scene().supports;
        let part = i as f64 / (self.nodes() - 1) as f64;
        let (other, part) = match end {
            End::Start => (supports.end, 1.0 - part),
            End::End => (supports.start, part),
        };
        if other == Support::Free { 1.0 } else { part }
    }

    /// The rod as a chain, where it is one and long.
    pub(crate) fn chain(&self) -> Option<Chain> {
        Chain::of(M::STRIDE, &self.free(), self.model.dof())
    }

    /// Squared frequencies below this are zero, 1/s^2: a billionth of the slowest bending
    /// vibration's, or what rounding errors in a tangent that goes with the fourth power of the
    /// mesh, or a chain's with the second, amount to.
    pub(crate) fn zero_frequency_squared(&self, chain: Option<Chain>) -> f64 {
        let power = if chain.is_some() { 2 } else { 4 };
        let noise = f64::EPSILON * (self.nodes() as f64).powi(power);
        self.bending_frequency_squared() * (1e-9 + 10.0 * noise)
    }

    /// Unknowns of the equilibrium at t = 0, angles measured from the frames the rod begins with.
    pub(crate) fn equilibrium_held(&self) -> Result<Vec<f64>, Error> {
        let rod = self.held_rod(&self.rod());
        let found = self.equilibrium_of(&rod, false)?;
        let mut q = found.q;
        M::Rod::<f64>::refer(&mut q, &found.frames, &self.begin().1);
        Ok(q)
    }

    /// The unknowns at t = 0 with their frames. One step of Newton's method per order of
    /// derivatives that `D` carries gives an equilibrium its exact derivatives.
    pub(crate) fn start<D: Nestable>(
        &self,
        rod: &M::Rod<D>,
    ) -> (Vec<D>, <M::Rod<D> as Rod<D, W>>::Frames) {
        let (begin, frames) = self.begin();
        let frames = M::lift::<D>(&frames);
        let equilibrium = &self.problem.initial;
        let at = if equilibrium.is_empty() { &begin } else { equilibrium };
        let mut q: Vec<D> = at.iter().map(|x| D::from(*x)).collect();
        if equilibrium.is_empty() || D::ORDER == 0 {
            return (q, frames);
        }
        let held = self.held_rod(rod);
        let n = q.len();
        let (mut gradient, mut tangent) = (vec![D::from(0.0); n], BandMatrix::zeros(n));
        let mut factors = Ldlt::with_order(n);
        for _ in 0..D::ORDER {
            held.tangent(&q, &frames, Derivatives::Hand, &mut gradient, &mut tangent);
            // Where nothing resists, such as the spin of a round rod between hinges, any answer
            // along that direction will do.
            if factors.factor(&tangent, self.free()).is_err() {
                let (free, zero) = (self.free(), D::from(self.zero_frequency_squared(None)));
                let (mass, one) = (held.mass(), D::from(1.0));
                if factors.factor_sum(mass, zero, &tangent, one, free).is_err() {
                    // Not finite: the first step says so.
                    return (vec![D::from(f64::NAN); n], frames);
                }
            }
            factors.solve(&mut gradient);
            for i in self.free() {
                q[i] -= gradient[i];
            }
        }
        (q, frames)
    }

    /// The velocities at t = 0 of a rod at `q`, as a rigid body's; none at rest.
    pub(crate) fn start_velocity(&self, q: &[f64]) -> Option<Vec<f64>> {
        let initial = &self.problem.scene().initial;
        if !initial.moves() {
            return None;
        }
        let velocity = self.model.components(initial.velocity);
        let spin = self.model.components(initial.angular_velocity);
        let rod = self.rod();
        let axes = M::STRIDE.min(3);
        let place = |i: usize| {
            let mut x = [0.0; 3];
            x[..axes].copy_from_slice(&q[M::STRIDE * i..][..axes]);
            x
        };
        let nodes = self.nodes();
        let mass = |i: usize| rod.mass()[M::STRIDE * i];
        let total: f64 = (0..nodes).map(mass).sum();
        let centre = (0..nodes).fold([0.0; 3], |sum, i| add(sum, scale(place(i), mass(i) / total)));
        let mut v = vec![0.0; q.len()];
        for i in 0..nodes {
            let own = add(velocity, cross(spin, sub(place(i), centre)));
            v[M::STRIDE * i..][..axes].copy_from_slice(&own[..axes]);
            if M::STRIDE > axes && i + 1 < nodes {
                v[M::STRIDE * i + axes] = dot(spin, unit(sub(place(i + 1), place(i))));
            }
        }
        Some(v)
    }
}
