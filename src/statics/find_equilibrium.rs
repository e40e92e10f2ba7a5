//! The equilibria of a model: the state a rod creeps into under its loads, with the derivatives that it has
//! by the scene's numbers.

use crate::energy::Derivatives;
use crate::error::Error;
use crate::numerics::scalar::Nestable;
use crate::numerics::tangent::{Factors, Singular, Tangent};
use crate::problem::Model;
use crate::problem::Setup;
use crate::problem::{Discretized, Framed, FramesOf, UnknownsAndFrames};
use crate::rod::strain_rates;
use crate::rod::{FactorsOf, Rod};
use crate::scene::prescribed_motion::MotionTime;
use crate::scene::{End, InitialState, Support};
use crate::statics::descent::{Descent, EquilibriumState};
use crate::statics::edge_coordinates::EdgeCoordinates;
use crate::statics::pencil::Pencil;
use crate::statics::standing::StandingLoads;

/// Stiffness that is added to that of a rod which may move without a force, over a negligible one; and steps that undo what it
/// does to the others, each but for a hundred-thousandth.
const STIFFER: f64 = 1e4;
const MORE: usize = 3;

/// An equilibrium, and what its [derivatives](Discretized::differentiated_equilibrium) need beside it.
pub(crate) struct CheckedEquilibrium<F> {
    /// The equilibrium.
    pub rest: EquilibriumState<F>,
    /// Whether it may move without a force.
    indifferent: bool,
}

/// What a motion does whose largest displacement is the rod's length, or whose largest turn of an
/// edge about itself is 1 rad.
pub(crate) struct MotionMeasure {
    /// The node that moves most.
    pub node: usize,
    /// How far, in lengths of the rod.
    moved: f64,
    /// The sum of all strains.
    deformed: f64,
    /// Energies of stretching, bending and twisting by those strains alone, J.
    pub energies: [f64; 3],
}

impl MotionMeasure {
    /// Whether edges turn about themselves and nodes stay.
    pub fn is_spin(&self) -> bool {
        self.moved <= 1e-6
    }
    /// Whether the rod keeps its shape.
    pub fn is_rigid(&self) -> bool {
        self.deformed <= 1e-2
    }
}

impl<M: Model> Discretized<'_, M> {
    /// The state the rod creeps into under its loads, from where it begins; moved ends are where
    /// their motion leaves them.
    ///
    /// # Errors
    /// [`Error::Equilibrium`] where none is found, [`Error::Interrupted`].
    pub fn equilibrium(&self) -> Result<EquilibriumState<FramesOf<M>>, Error> {
        self.equilibrium_of(&self.rod(), true)
    }

    /// The equilibrium of a rod with other loads, with ends where their motion leaves them (`settled`), or
    /// where it has them at t = 0. Ends far from where they begin are moved there step by step.
    fn equilibrium_of(
        &self,
        rod: &M::Rod<f64>,
        settled: bool,
    ) -> Result<EquilibriumState<FramesOf<M>>, Error> {
        self.problem.check_stop()?;
        let (mut q, mut frames) = self.begin_at_rest(self.setup)?;
        if self.scene().initial.perturbation != 0.0 {
            self.perturb(self.setup, &mut q);
        }
        let mut iterations = self.raise_loads(&mut q, &mut frames, settled);
        let boundary_motion = self.boundary_motion(self.setup);
        let stages = match &boundary_motion {
            Some(boundary_motion) => boundary_motion.stages(self.problem.length(), settled)?,
            None => 1,
        };
        for k in 1..=stages {
            self.problem.check_stop()?;
            if let Some(boundary_motion) = &boundary_motion {
                let progress = |k: usize| k as f64 / stages as f64;
                let [from, to] =
                    [k - 1, k].map(|k| MotionTime::Approach { progress: progress(k), settled });
                boundary_motion.carry(from, to, &mut q, |end, node| self.reach(end, node));
                boundary_motion.advance::<M::Rod<f64>>(from, to, &mut q, &frames);
            }
            let edges = self.edge_coordinates();
            let scales = (self.problem.length(), self.negligible(edges));
            let derivatives = self.problem.derivatives();
            let descent = Descent::new(rod, self.free(), scales, edges, derivatives, q);
            let rest = descent.leading(self.led()).descend(frames)?;
            iterations += rest.newton_iterations;
            if k == stages {
                return Ok(EquilibriumState { newton_iterations: iterations, ..rest });
            }
            (q, frames) = (rest.q, rest.frames);
        }
        unreachable!("there is at least one stage")
    }

    /// Where a rod begins to come to rest, with recorded ends turned about themselves by what the scene says: as it
    /// lies when the recording starts, if the scene starts there.
    fn begin_at_rest<D: Nestable>(
        &self,
        setup: &Setup<D, M>,
    ) -> Result<UnknownsAndFrames<D, M>, Error> {
        if self.scene().initial.state == InitialState::Recorded {
            return self.recorded_shape(setup);
        }
        let (mut q, frames) = self.begin(setup);
        self.turn_ends(setup, &mut q);
        Ok((q, frames))
    }

    /// Brings a limp rod that stands to the equilibria under parts of its loads, one after the other; returns the Newton
    /// iterations. A part without an equilibrium changes nothing.
    fn raise_loads(&self, q: &mut Vec<f64>, frames: &mut FramesOf<M>, settled: bool) -> usize {
        let Some(StandingLoads { parts, push }) = self.standing_loads(q) else { return 0 };
        if push > 0.0 && self.scene().initial.perturbation == 0.0 {
            self.perturb_by(self.setup, push, q);
        }
        let mut iterations = 0;
        for part in parts {
            let rod = self.under_part(part, !settled);
            let edges = self.edge_coordinates();
            let scales = (self.problem.length(), self.negligible(edges));
            let derivatives = self.problem.derivatives();
            let descent = Descent::new(&rod, self.free(), scales, edges, derivatives, q.clone());
            if let Ok(rest) = descent.leading(self.led()).descend(frames.clone()) {
                iterations += rest.newton_iterations;
                (*q, *frames) = (rest.q, rest.frames);
            }
        }
        iterations
    }

    /// Puts the unknowns that supports hold where they are at a moment, with their derivatives.
    pub(crate) fn hold<D: Nestable>(
        &self,
        setup: &Setup<D, M>,
        moment: MotionTime<f64>,
        q: &mut [D],
        frames: &<M::Rod<D> as Rod<D>>::Frames,
    ) -> Result<(), Error> {
        let (begin, begin_frames) = self.begin_at_rest(setup)?;
        let (free, supports) = (self.free(), &self.scene().supports);
        for i in (0..q.len()).filter(|i| !free.contains(i)) {
            if !M::Rod::<D>::is_angle(i) {
                q[i] = begin[i];
                continue;
            }
            // Recorded ends hold their edges turned about themselves as they begin.
            let end = if i < free.start { End::Start } else { End::End };
            if supports.at(end) == Support::Recorded
                && let edge = i / M::STRIDE
                && let Some(director) = M::Rod::<D>::director(&begin, &begin_frames, edge)
            {
                M::Rod::<D>::align(q, frames, edge, director, 0.0);
            }
        }
        self.held_ends(setup).advance::<M::Rod<D>>(moment, moment, q, frames);
        Ok(())
    }

    /// How far node `i` goes along with a moved end: wholly where nothing holds the other end, else
    /// less and less towards it.
    fn reach(&self, end: End, i: usize) -> f64 {
        let supports = &self.problem.scene().supports;
        let along = i as f64 / (self.nodes() - 1) as f64;
        let (other, share) = match end {
            End::Start => (supports.end, 1.0 - along),
            End::End => (supports.start, along),
        };
        if other == Support::Free { 1.0 } else { share }
    }

    /// The edges of a long rod that hangs from its start, as unknowns.
    pub(crate) fn edge_coordinates(&self) -> Option<EdgeCoordinates> {
        // Energies of one's own may depend on where nodes are.
        let alone = self.scene().energies.is_empty();
        let alone = alone && self.led().is_empty();
        EdgeCoordinates::of(M::STRIDE, &self.free(), self.model.dof()).filter(|_| alone)
    }

    /// Squared frequencies below this are zero, 1/s^2: a billionth of the slowest bending
    /// vibration's, and what rounding errors of the edges' stiffness, each another, add up to where
    /// edges lie askew to the axes. A rod that no end holds moves along itself, against all of them
    /// and those of eliminating one edge after the other.
    pub(crate) fn zero_squared_frequency(&self) -> f64 {
        let (_, material) = self.scene().at(0.5);
        let speed_squared = material.youngs_modulus / material.density;
        let supports = &self.scene().supports;
        let held = [supports.start, supports.end]
            .iter()
            .any(|s| matches!(s, Support::Clamped | Support::Pinned | Support::Recorded))
            || supports.path.is_some();
        let nodes = self.nodes() as f64;
        let noise = f64::EPSILON * if held { nodes.powf(1.5) } else { 10.0 * nodes.powi(2) };
        self.bending_frequency_squared() * 1e-9
            + noise * speed_squared / self.problem.length().powi(2)
    }

    /// A stiffness of every unknown that counts as none, N/m (N m for angles): a billionth of the
    /// rod's own in bending (its softer direction) and twisting as a whole, or what rounding errors amount to in a tangent
    /// that goes with the fourth power of the mesh, or in edge coordinates with the second.
    pub(crate) fn negligible(&self, edges: Option<EdgeCoordinates>) -> Vec<f64> {
        let nodes = self.nodes() as f64;
        let (section, p) = self.scene().at(0.5);
        let section = section.moments();
        let [i1, i2] = section.second_moments;
        let length = self.problem.length();
        let power = if edges.is_some() { 2 } else { 4 };
        let noise = 10.0 * f64::EPSILON * nodes.powi(power);
        let softest = self.bending_frequency_squared();
        let bending = softest * (1e-9 + noise);
        // Rounding errors are those of the stiffer direction, which bends too.
        let stiffer = i1.max(i2) / i1.min(i2);
        let moving = softest * (1e-9 + noise * stiffer)
            + if edges.is_some() { 0.0 } else { self.zero_squared_frequency() };
        // An angle's inertia about the edge is so small that it would not show: it counts like the
        // edge's mass on a lever of the rod's length, as much more as twisting is stiffer.
        let bend = p.youngs_modulus * i1.min(i2);
        let twist = (p.shear_modulus() * section.torsion_constant / bend).max(1.0);
        let angle = bending * twist * p.density * section.area * length.powi(3) / nodes;
        let stiffness = |(i, metric): (usize, f64)| match M::Rod::<f64>::is_angle(i) {
            true => angle,
            false => metric * moving,
        };
        self.metric(edges).into_iter().enumerate().map(stiffness).collect()
    }

    /// Rounding errors of squared frequencies over that of bending as a whole: the tangent goes with the fourth power of
    /// the mesh.
    pub(crate) fn tangent_rounding(&self) -> f64 {
        10.0 * f64::EPSILON * (self.nodes() as f64).powi(4)
    }

    /// A part of the stiffness of bending as a whole, for every unknown, N/m (N m for angles).
    pub(super) fn neutral(&self, part: f64) -> Vec<f64> {
        let (section, p) = self.scene().at(0.5);
        let section = section.moments();
        let [i1, i2] = section.second_moments;
        let twist = p.shear_modulus() * section.torsion_constant;
        let twist = (twist / (p.youngs_modulus * i1.min(i2))).max(1.0);
        let (length, nodes) = (self.problem.length(), self.nodes() as f64);
        let squared = part * self.bending_frequency_squared();
        let angle = squared * twist * p.density * section.area * length.powi(3) / nodes;
        let mass = self.metric(None).into_iter().enumerate();
        mass.map(|(i, mass)| if M::Rod::<f64>::is_angle(i) { angle } else { mass * squared })
            .collect()
    }

    /// Unknowns of the equilibrium at t = 0, angles measured from the frames the rod begins with.
    pub(crate) fn held_equilibrium(&self) -> Result<Vec<f64>, Error> {
        let rod = self.setup.rod_with_release_forces(self.model, &self.rod());
        let found = self.equilibrium_of(&rod, false)?;
        let mut q = found.q;
        M::Rod::<f64>::refer(&mut q, &found.frames, &self.begin(self.setup).1);
        Ok(q)
    }

    /// Gives an equilibrium `q` of a rod, the second in plain numbers, its exact derivatives, by steps of Newton's method
    /// with the tangent of the plain rod: one for what that was left with, and one per order that `D` carries, since each
    /// makes an error of an order one of the next; `neutral-equilibrium` with a small stiffness added, which needs some more. A long rod
    /// that hangs from its start is solved in edge coordinates.
    pub(crate) fn follow<D: Nestable>(
        &self,
        (rod, frames): Framed<'_, D, M>,
        (plain, plain_frames): Framed<'_, f64, M>,
        q: &mut [D],
        indifferent: bool,
    ) -> Result<(), Singular> {
        let n = q.len();
        let found: Vec<f64> = q.iter().map(|x| x.value()).collect();
        let mut tangent = Tangent::zeros(n);
        let mut factors = FactorsOf::<M::Rod<f64>, f64>::with_order(n);
        let (free, led, edges) = (self.free(), self.led(), self.edge_coordinates());
        let hand = Derivatives::Hand;
        match edges {
            Some(_) => plain.edge_tangent(&found, plain_frames, hand, &mut tangent),
            None => plain.tangent(&found, plain_frames, hand, &mut vec![0.0; n], &mut tangent),
        }
        led.uncouple(&mut tangent);
        let mut added = vec![0.0; n];
        if indifferent {
            // So much more than is negligible that rounding errors of the edges' stiffness move nothing.
            added = self.negligible(edges);
            added.iter_mut().for_each(|stiffness| *stiffness *= STIFFER);
        }
        factors.factor_sum(&added, 1.0, &tangent, 1.0, free.clone())?;
        let mut change = vec![D::from(0.0); n];
        for _ in 0..1 + D::ORDER + if indifferent { MORE } else { 0 } {
            rod.gradient(q, frames, hand, &mut change);
            if let Some(edges) = edges {
                edges.gather::<D, M::Rod<D>>(&mut change);
            }
            led.fill(&mut change, D::from(0.0));
            factors.solve(&mut change);
            if let Some(edges) = edges {
                edges.spread::<D, M::Rod<D>>(&mut change);
            }
            for i in free.clone() {
                q[i] -= change[i];
            }
        }
        Ok(())
    }

    /// Makes forces `x` on the free unknowns the changes by which an equilibrium of a rod gives way to them; none where
    /// it can move without a force, or is solved in edge coordinates.
    pub(crate) fn displacement_under_forces(
        &self,
        rod: &M::Rod<f64>,
        (q, frames): (&[f64], &FramesOf<M>),
        x: &mut [f64],
    ) -> Option<()> {
        if self.edge_coordinates().is_some() {
            return None;
        }
        let n = q.len();
        let (mut gradient, mut tangent) = (vec![0.0; n], Tangent::zeros(n));
        let mut factors = FactorsOf::<M::Rod<f64>, f64>::with_order(n);
        let added = vec![0.0; n];
        rod.tangent(q, frames, Derivatives::Hand, &mut gradient, &mut tangent);
        let led = self.led();
        led.fill(x, 0.0);
        led.uncouple(&mut tangent);
        factors.factor_sum(&added, 1.0, &tangent, 1.0, self.free()).ok()?;
        factors.solve(x);
        Some(())
    }

    /// What measures changes of the unknowns: masses, or the metric of its edges.
    fn metric(&self, edges: Option<EdgeCoordinates>) -> Vec<f64> {
        let rod = self.rod();
        edges.map_or_else(|| rod.mass().to_vec(), |edges| edges.metric(&rod))
    }

    /// An [equilibrium](Self::equilibrium) to be differentiated.
    pub(crate) fn checked_equilibrium(&self) -> Result<CheckedEquilibrium<FramesOf<M>>, Error> {
        let rest = self.equilibrium()?;
        Ok(CheckedEquilibrium { indifferent: self.is_neutral((&rest.q, &rest.frames))?, rest })
    }

    /// Its unknowns with the derivatives that `D` carries, and the rod that is in it. The frames stay
    /// where they are.
    pub(crate) fn differentiated_equilibrium<D: Nestable>(
        &self,
        CheckedEquilibrium { rest, indifferent }: &CheckedEquilibrium<FramesOf<M>>,
        setup: &Setup<D, M>,
    ) -> Result<(M::Rod<D>, Vec<D>), Error> {
        let rod = setup.rod(self.model);
        let mut q: Vec<D> = rest.q.iter().map(|x| D::from(*x)).collect();
        let frames = M::frames_over(&rest.frames);
        if *indifferent {
            self.add_start_derivatives(&self.begin_at_rest(setup)?.0, &mut q);
        }
        self.hold(setup, MotionTime::Approach { progress: 1.0, settled: true }, &mut q, &frames)?;
        self.follow((&rod, &frames), (&self.rod(), &rest.frames), &mut q, *indifferent)
            .map_err(|singular| Error::Indifferent { node: singular.row / M::STRIDE })?;
        Ok((rod, q))
    }

    /// Moves nodes of an equilibrium as fast as those of where the rod begins: where no force resists, they go along.
    pub(crate) fn add_start_derivatives<D: Nestable>(&self, begin: &[D], q: &mut [D]) {
        for i in (0..q.len()).filter(|i| !M::Rod::<D>::is_angle(*i)) {
            q[i] += begin[i] - D::from(begin[i].value());
        }
    }

    /// Whether a direction is left in which no force resists. That may be a motion as a rigid body, in which the rod
    /// stays as it begins, or the spin of a round rod between hinges, which does not move a node. Everything else is refused.
    pub(crate) fn is_neutral(&self, (q, frames): (&[f64], &FramesOf<M>)) -> Result<bool, Error> {
        let pencil = Pencil::resting(self, q, frames);
        let factors = pencil.factors(1.0).or_else(|_| pencil.factors(1.0137))?;
        if pencil.inertia(-1.0)? == factors.negative_pivots() {
            return Ok(false);
        }
        // Inverse iteration finds such a direction.
        let n = q.len();
        let mut x: Vec<f64> = (0..n).map(|i| 1.0 + (i * 71 % 101) as f64 / 101.0).collect();
        for _ in 0..3 {
            factors.solve(&mut x);
            let largest = x.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
            x.iter_mut().zip(&pencil.mass).for_each(|(x, m)| *x *= m / largest);
        }
        factors.solve(&mut x);
        if let Some(edges) = self.edge_coordinates() {
            edges.spread::<f64, M::Rod<f64>>(&mut x);
        }
        let motion = self.motion((q, frames), &x);
        match motion.is_spin() || motion.is_rigid() {
            true => Ok(true),
            false => Err(Error::Indifferent { node: motion.node }),
        }
    }

    /// What a motion from a state with the rates `x` of all unknowns does.
    pub(crate) fn motion(&self, (q, frames): (&[f64], &FramesOf<M>), x: &[f64]) -> MotionMeasure {
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
        MotionMeasure {
            node,
            moved: moved / length / largest,
            deformed: strains.iter().map(|rate| rate.abs()).sum(),
            energies: rod.strain_energies(&strains),
        }
    }
}
