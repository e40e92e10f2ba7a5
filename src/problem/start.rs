//! Where a problem's rod begins: in its rest shape, in a given shape, or in equilibrium; and the
//! equilibria that `rodfit static` looks for from there.

use super::setup::Setup;
use super::{FramesOf, Posed, SpatialProblem};
use crate::banded::{BandMatrix, Ldlt, Singular};
use crate::chain::Chain;
use crate::drive::{Drive, DrivenEnd};
use crate::energy::Derivatives;
use crate::error::Error;
use crate::flow::{Flow, Rest};
use crate::frame::Frames;
use crate::model::{Model, SpatialModel};
use crate::modes::pencil::Pencil;
use crate::rod::{Rod, SpatialRod};
use crate::scalar::Nestable;
use crate::scene::supports::Moment;
use crate::scene::{Clamp, End, Motion, Support};
use crate::simulation::strain_rates;
use crate::vector::{add, cross, dot, scale, sub, unit};

/// Frames over any scalar.
type FramesOver<D, M, const W: usize> = <<M as Model<W>>::Rod<D> as Rod<D, W>>::Frames;
/// Unknowns with the frames their angles count from.
pub(crate) type Placed<D, M, const W: usize> = (Vec<D>, FramesOver<D, M, W>);

/// An equilibrium, and what its [derivatives](Posed::settled_over) need beside it.
pub(crate) struct Settled<F> {
    /// The equilibrium.
    pub rest: Rest<F>,
    /// Whether it may move without a force.
    indifferent: bool,
}

/// What a motion does whose largest displacement is the rod's length, or whose largest turn of an
/// edge about itself is 1 rad.
pub(crate) struct Moving {
    /// The node that moves most.
    pub node: usize,
    /// How far, in lengths of the rod.
    moved: f64,
    /// The sum of all strains.
    deformed: f64,
    /// Energies of stretching, bending and twisting by those strains alone, J.
    pub energies: [f64; 3],
}

impl Moving {
    /// Whether edges turn about themselves and nodes stay.
    pub fn is_spin(&self) -> bool {
        self.moved <= 1e-6
    }
    /// Whether the rod keeps its shape.
    pub fn is_rigid(&self) -> bool {
        self.deformed <= 1e-2
    }
}

impl SpatialProblem<'_> {
    /// The unknowns and frames of a rod that has moved from its rest shape to `nodes` without turning
    /// about itself.
    pub(crate) fn placed<D: Nestable>(
        &self,
        setup: &Setup<D, SpatialModel, { crate::rod::spatial::HALF_BANDWIDTH }>,
        nodes: &[[D; 3]],
    ) -> (Vec<D>, Frames<D>) {
        let mut q = self.model.unknowns(&setup.rest);
        for (i, x) in nodes.iter().enumerate() {
            q[4 * i..4 * i + 3].copy_from_slice(&self.model.components(*x));
        }
        let mut frames = self.model.frames(&setup.rest);
        SpatialRod::<D>::rebase(&mut frames, &q);
        (q, frames)
    }

    /// The same in plain numbers.
    pub(crate) fn placed_still(&self, nodes: &[[f64; 3]]) -> (Vec<f64>, Frames<f64>) {
        self.placed(self.setup, nodes)
    }
}

impl<M: Model<W>, const W: usize> Posed<'_, M, W> {
    /// The unknowns before supports move and loads pull, and their frames: of the rest shape, or of
    /// the scene's initial shape, without twist.
    pub(crate) fn begin<D: Nestable>(&self, setup: &Setup<D, M, W>) -> Placed<D, M, W> {
        let mut q = self.model.unknowns(&setup.rest);
        let mut frames = self.model.frames(&setup.rest);
        let Some(nodes) = &setup.start else { return (q, frames) };
        for (i, x) in nodes.iter().enumerate() {
            let own = self.model.components(*x);
            let axes = M::STRIDE.min(3);
            q[M::STRIDE * i..][..axes].copy_from_slice(&own[..axes]);
        }
        M::Rod::<D>::rebase(&mut frames, &q);
        M::Rod::<D>::untwist(&mut q, &frames);
        (q, frames)
    }

    /// The ends that supports hold in place, if any of them moves.
    pub(crate) fn drive<D: Nestable>(&self, setup: &Setup<D, M, W>) -> Option<Drive<D>> {
        (!setup.scene.supports.motion.is_empty()).then(|| self.held_ends(setup))
    }

    /// The same in plain numbers.
    pub(crate) fn moved_ends(&self) -> Option<Drive> {
        self.drive(self.setup)
    }

    /// The ends that supports hold in place, moved or not.
    fn held_ends<D: Nestable>(&self, setup: &Setup<D, M, W>) -> Drive<D> {
        let supports = &setup.scene.supports;
        let (q, frames) = self.begin(setup);
        let last = self.nodes() - 1;
        let place = |i: usize| {
            let mut x = [D::from(0.0); 3];
            let axes = M::STRIDE.min(3);
            x[..axes].copy_from_slice(&q[M::STRIDE * i..][..axes]);
            x
        };
        let holds = |end: &End| matches!(supports.at(*end), Support::Clamped | Support::Pinned);
        let ends = [End::Start, End::End].into_iter().filter(holds);
        let ends = ends.map(|end| {
            let ([outer, inner], edge) = match end {
                End::Start => ([0, 1], 0),
                End::End => ([last, last - 1], last - 1),
            };
            let clamped = supports.at(end) == Support::Clamped;
            let held = if clamped { vec![outer, inner] } else { vec![outer] };
            let centre = match supports.clamp {
                Clamp::MidEdge if clamped => scale(add(place(outer), place(inner)), D::from(0.5)),
                _ => place(outer),
            };
            let moved = supports.motion.iter().filter(|motion| motion.end == end);
            let motions = moved.map(|motion| Motion {
                displacement: self.model.components(motion.displacement),
                rotation: self.model.components(motion.rotation),
                ..motion.clone()
            });
            DrivenEnd {
                end,
                motions: motions.collect(),
                centre,
                nodes: held.into_iter().map(|i| (i, place(i))).collect(),
                edge: M::Rod::<D>::director(&q, &frames, edge).filter(|_| clamped).map(
                    |director| {
                        let tangent = unit(sub(place(edge + 1), place(edge)));
                        (edge, [tangent, director])
                    },
                ),
            }
        });
        Drive::new::<M, W>(ends.collect())
    }

    /// Puts the unknowns that supports hold where they are at a moment, with their derivatives.
    fn hold<D: Nestable>(
        &self,
        setup: &Setup<D, M, W>,
        moment: Moment<f64>,
        q: &mut [D],
        frames: &FramesOver<D, M, W>,
    ) {
        let (begin, _) = self.begin(setup);
        let free = self.free();
        let held = (0..q.len()).filter(|i| !free.contains(i) && !M::Rod::<D>::is_angle(*i));
        for i in held {
            q[i] = begin[i];
        }
        self.held_ends(setup).advance::<M::Rod<D>, W>(moment, moment, q, frames);
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
        let (mut q, mut frames) = self.begin(self.setup);
        let drive = self.drive(self.setup);
        let parts = drive.as_ref().map_or(1, |drive| drive.parts(self.problem.length(), settled));
        let mut iterations = 0;
        for k in 1..=parts {
            if let Some(drive) = &drive {
                let part = |k: usize| k as f64 / parts as f64;
                let [from, to] = [k - 1, k].map(|k| Moment::Approach { part: part(k), settled });
                drive.carry(from, to, &mut q, |end, node| self.reach(end, node));
                drive.advance::<M::Rod<f64>, W>(from, to, &mut q, &frames);
            }
            let chain = self.chain();
            let scales = (self.problem.length(), self.negligible(chain));
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
    /// vibration's, and what rounding errors of the edges' stiffness, each another, add up to where
    /// edges lie askew to the axes. A rod that no end holds moves along itself, against all of them
    /// and those of eliminating one edge after the other.
    pub(crate) fn zero_frequency_squared(&self) -> f64 {
        let material = &self.scene().material;
        let speed_squared = material.youngs_modulus / material.density;
        let supports = &self.scene().supports;
        let held = [supports.start, supports.end]
            .iter()
            .any(|s| matches!(s, Support::Clamped | Support::Pinned));
        let nodes = self.nodes() as f64;
        let noise = f64::EPSILON * if held { nodes.powf(1.5) } else { 10.0 * nodes.powi(2) };
        self.bending_frequency_squared() * 1e-9
            + noise * speed_squared / self.problem.length().powi(2)
    }

    /// A stiffness of every unknown that counts as none, N/m (N m for angles): a billionth of the
    /// rod's own in bending and twisting as a whole, or what rounding errors amount to in a tangent
    /// that goes with the fourth power of the mesh, or a chain's with the second.
    pub(crate) fn negligible(&self, chain: Option<Chain>) -> Vec<f64> {
        let nodes = self.nodes() as f64;
        let (p, section) = (&self.scene().material, self.scene().rod.section.moments());
        let [i1, i2] = section.second_moments;
        let length = self.problem.length();
        let power = if chain.is_some() { 2 } else { 4 };
        let noise = 10.0 * f64::EPSILON * nodes.powi(power);
        let bending = self.bending_frequency_squared() * (1e-9 + noise);
        let moving = match chain {
            Some(_) => bending,
            None => bending + self.zero_frequency_squared(),
        };
        // An angle's inertia about the edge is so small that it would not show: it counts like the
        // edge's mass on a lever of the rod's length, as much more as twisting is stiffer.
        let bend = p.youngs_modulus * i1.min(i2);
        let twist = (p.shear_modulus() * section.torsion_constant / bend).max(1.0);
        let angle = bending * twist * p.density * section.area * length.powi(3) / nodes;
        let stiffness = |(i, metric): (usize, f64)| match M::Rod::<f64>::is_angle(i) {
            true => angle,
            false => metric * moving,
        };
        self.metric(chain).into_iter().enumerate().map(stiffness).collect()
    }

    /// Unknowns of the equilibrium at t = 0, angles measured from the frames the rod begins with.
    pub(crate) fn equilibrium_held(&self) -> Result<Vec<f64>, Error> {
        let rod = self.setup.held(self.model, &self.rod());
        let found = self.equilibrium_of(&rod, false)?;
        let mut q = found.q;
        M::Rod::<f64>::refer(&mut q, &found.frames, &self.begin(self.setup).1);
        Ok(q)
    }

    /// Gives an equilibrium `q` of a rod its exact derivatives: one step of Newton's method per
    /// order that `D` carries; `indifferent` with a [negligible](Self::negligible) stiffness added,
    /// which needs one more. A long chain is solved by its edges.
    fn follow<D: Nestable>(
        &self,
        rod: &M::Rod<D>,
        frames: &<M::Rod<D> as Rod<D, W>>::Frames,
        q: &mut [D],
        indifferent: bool,
    ) -> Result<(), Singular> {
        let n = q.len();
        let (mut gradient, mut tangent) = (vec![D::from(0.0); n], BandMatrix::zeros(n));
        let mut factors = Ldlt::with_order(n);
        let (free, chain) = (self.free(), self.chain());
        let one = D::from(1.0);
        let added: Vec<D> = match indifferent {
            true => self.negligible(chain).into_iter().map(D::from).collect(),
            false => vec![D::from(0.0); n],
        };
        for _ in 0..D::ORDER + usize::from(indifferent) {
            match chain {
                Some(chain) => {
                    rod.gradient(q, frames, Derivatives::Hand, &mut gradient);
                    rod.edge_tangent(q, frames, Derivatives::Hand, &mut tangent);
                    chain.gather::<D, M::Rod<D>, W>(&mut gradient);
                }
                None => rod.tangent(q, frames, Derivatives::Hand, &mut gradient, &mut tangent),
            }
            factors.factor_sum(&added, one, &tangent, one, free.clone())?;
            factors.solve(&mut gradient);
            if let Some(chain) = chain {
                chain.spread::<D, M::Rod<D>, W>(&mut gradient);
            }
            for i in free.clone() {
                q[i] -= gradient[i];
            }
        }
        Ok(())
    }

    /// What measures changes of the unknowns: masses, or a chain's metric.
    fn metric(&self, chain: Option<Chain>) -> Vec<f64> {
        let rod = self.rod();
        chain.map_or_else(|| rod.mass().to_vec(), |chain| chain.metric(&rod))
    }

    /// An [equilibrium](Self::equilibrium) to be differentiated.
    pub(crate) fn settled(&self) -> Result<Settled<FramesOf<M, W>>, Error> {
        let rest = self.equilibrium()?;
        Ok(Settled { indifferent: self.is_indifferent(&rest)?, rest })
    }

    /// Its unknowns with the derivatives that `D` carries, and the rod that is in it. The frames stay
    /// where they are.
    pub(crate) fn settled_over<D: Nestable>(
        &self,
        Settled { rest, indifferent }: &Settled<FramesOf<M, W>>,
        setup: &Setup<D, M, W>,
    ) -> Result<(M::Rod<D>, Vec<D>), Error> {
        let rod = setup.rod(self.model);
        let mut q: Vec<D> = rest.q.iter().map(|x| D::from(*x)).collect();
        let frames = M::lift(&rest.frames);
        self.hold(setup, Moment::Approach { part: 1.0, settled: true }, &mut q, &frames);
        self.follow(&rod, &frames, &mut q, *indifferent)
            .map_err(|singular| Error::Indifferent { node: singular.row / M::STRIDE })?;
        Ok((rod, q))
    }

    /// Whether a direction is left in which no force resists. That may be a motion as a rigid body,
    /// or the spin of a round rod between hinges, which does not move a node: parameters do not push
    /// that way, and any answer will do. Everything else is refused.
    fn is_indifferent(&self, rest: &Rest<FramesOf<M, W>>) -> Result<bool, Error> {
        let pencil = Pencil::resting(self, &rest.q, &rest.frames);
        let node = |row: usize| row / M::STRIDE;
        let refused = |error: Error| match error {
            Error::SingularTangent { row, .. } => Error::Indifferent { node: node(row) },
            error => error,
        };
        let factors = pencil.factors(1.0).map_err(refused)?;
        if pencil.below(-1.0).map_err(refused)? == factors.negative_pivots() {
            return Ok(false);
        }
        // Inverse iteration finds such a direction.
        let n = rest.q.len();
        let mut x: Vec<f64> = (0..n).map(|i| 1.0 + (i * 71 % 101) as f64 / 101.0).collect();
        for _ in 0..3 {
            factors.solve(&mut x);
            let largest = x.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
            x.iter_mut().zip(&pencil.mass).for_each(|(x, m)| *x *= m / largest);
        }
        factors.solve(&mut x);
        if let Some(chain) = self.chain() {
            chain.spread::<f64, M::Rod<f64>, W>(&mut x);
        }
        let motion = self.motion((&rest.q, &rest.frames), &x);
        match motion.is_spin() || motion.is_rigid() {
            true => Ok(true),
            false => Err(Error::Indifferent { node: motion.node }),
        }
    }

    /// What a motion from a state with the rates `x` of all unknowns does.
    pub(crate) fn motion(&self, (q, frames): (&[f64], &FramesOf<M, W>), x: &[f64]) -> Moving {
        let length = self.problem.length();
        let size = |of_angles: bool| {
            let own = (0..x.len()).filter(|i| M::Rod::<f64>::is_angle(*i) == of_angles);
            own.map(|i| (i / M::STRIDE, x[i].abs()))
                .fold((0, 0.0), |a: (usize, f64), b| if b.1 > a.1 { b } else { a })
        };
        let ((node, moved), (_, turned)) = (size(false), size(true));
        let largest = (moved / length).max(turned).max(f64::MIN_POSITIVE);
        let x: Vec<f64> = x.iter().map(|x| x / largest).collect();
        let (rod, mut strains) = (self.rod(), Vec::new());
        strain_rates(&rod, (q, frames), &x, length, &mut strains);
        Moving {
            node,
            moved: moved / length / largest,
            deformed: strains.iter().map(|rate| rate.abs()).sum(),
            energies: rod.strain_energies(&strains),
        }
    }

    /// The unknowns at t = 0 with their frames, those of an equilibrium with exact derivatives.
    pub(crate) fn start<D: Nestable>(
        &self,
        setup: &Setup<D, M, W>,
        rod: &M::Rod<D>,
    ) -> Placed<D, M, W> {
        let (begin, frames) = self.begin(setup);
        let equilibrium = &self.problem.initial;
        if equilibrium.is_empty() {
            return (begin, frames);
        }
        let mut q: Vec<D> = equilibrium.iter().map(|x| D::from(*x)).collect();
        if D::ORDER == 0 {
            return (q, frames);
        }
        self.hold(setup, Moment::Approach { part: 1.0, settled: false }, &mut q, &frames);
        let held = setup.held(self.model, rod);
        // Where nothing resists, such as the spin of a round rod between hinges, any answer along
        // that direction will do.
        let followed = [false, true].into_iter().find_map(|indifferent| {
            let mut q = q.clone();
            self.follow(&held, &frames, &mut q, indifferent).ok().map(|()| q)
        });
        // Not finite: the first step says so.
        (followed.unwrap_or_else(|| vec![D::from(f64::NAN); q.len()]), frames)
    }

    /// The velocities at t = 0 of a rod at `q`, as a rigid body's; none of one at rest whose numbers
    /// carry no derivatives.
    pub(crate) fn start_velocity<D: Nestable>(
        &self,
        setup: &Setup<D, M, W>,
        rod: &M::Rod<D>,
        q: &[D],
    ) -> Option<Vec<D>> {
        if D::ORDER == 0 && !self.problem.scene().initial.moves() {
            return None;
        }
        let velocity = self.model.components(setup.scene.initial.velocity);
        let spin = self.model.components(setup.scene.initial.angular_velocity);
        let axes = M::STRIDE.min(3);
        let zero = D::from(0.0);
        let place = |i: usize| {
            let mut x = [zero; 3];
            x[..axes].copy_from_slice(&q[M::STRIDE * i..][..axes]);
            x
        };
        let nodes = self.nodes();
        let mass = |i: usize| rod.mass()[M::STRIDE * i];
        let total = (0..nodes).map(mass).fold(zero, |sum, mass| sum + mass);
        let centre =
            (0..nodes).fold([zero; 3], |sum, i| add(sum, scale(place(i), mass(i) / total)));
        let mut v = vec![zero; q.len()];
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
