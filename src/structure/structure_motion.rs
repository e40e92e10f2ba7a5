//! Simulations of structures: steps with bisection, and the start at rest, in equilibrium or by a recording.
//!
//! [`Structure::simulation`] returns a [`StructureMotion`] at t = 0, without velocity unless it starts from a
//! recording, which advances to given times (`step_to`). A step that fails, or that the step control rejects, is
//! replaced by two halves, and so on. The control limits rotations of edges and, without recorded ends only, the change
//! of the energy: by the scene of the first rod with a table of the bending moment, else of the first rod. A step after
//! which a spring in space is rotated too far is an error.
//!
//! [`Structure::simulation_over`] is a simulation over dual numbers, for derivatives, without bisection;
//! `equilibrium_over` is the equilibrium with derivatives. In space only Newmark-beta and generalised-alpha integrate;
//! other schemes are errors. So are a scene without `[time]`, and steps that do not resolve a recording which moves
//! ends.

use crate::dynamics::{BisectedSteps, Simulation, StepControl, StepperSettings, advance};
use crate::energy::Derivatives;
use crate::error::{Error, ensure};
use crate::numerics::scalar::RodScalar;
use crate::numerics::tangent::{Factors, Tangent};
use crate::numerics::vector::sub;
use crate::rod::assembly::AssemblyFrames;
use crate::rod::{Assembly, Energies, Rod};
use crate::scene::number::Quantity;
use crate::scene::{InitialState, Scene, Scheme, StructurePoint, StructureScene, Time};
use crate::structure::blueprint::AssemblyAtRest;
use crate::structure::definition::Structure;
use crate::structure::structure_shape::StructureShape;

/// A simulation of a structure, step by step.
#[derive(Clone, Debug)]
pub struct StructureMotion<'a> {
    structure: &'a Structure,
    simulation: Simulation<f64, Assembly<f64>>,
    control: StepControl,
    /// Ends of all steps taken, s.
    taken: Vec<f64>,
}

impl BisectedSteps for StructureMotion<'_> {
    type Rod = Assembly<f64>;

    /// The simulation of the assembly at its present state.
    fn simulation(&self) -> &Simulation<f64, Assembly<f64>> {
        &self.simulation
    }

    /// Makes a trial step to a time, s, without bisection. Errors are those of the step; the state is then the one
    /// before it.
    fn step_to(&mut self, time: f64) -> Result<(), Error> {
        self.simulation.step_to(time)
    }

    /// Restores the state before the last step.
    fn step_back(&mut self) {
        self.simulation.step_back();
    }

    /// Adds the end of the accepted step, s, to the times. An error, with the state before the step restored, if a
    /// spring in space is rotated too far.
    fn accepted(&mut self) -> Result<(), Error> {
        if let Err(error) = self.check_springs() {
            self.simulation.step_back();
            return Err(error);
        }
        self.taken.push(self.simulation.state().time);
        Ok(())
    }

    /// The step control, which limits the change of the energy and rotations of edges, and the simulation that it
    /// controls.
    fn control(&mut self) -> (&mut StepControl, &Simulation<f64, Assembly<f64>>) {
        (&mut self.control, &self.simulation)
    }
}

impl StructureMotion<'_> {
    /// Advances to `time`, s, in one step. A step that fails or that the step control rejects is replaced by two of
    /// half its size, and so on.
    ///
    /// # Errors
    /// Those of a step that bisection does not save; the state is then the last valid one.
    pub fn step_to(&mut self, time: f64) -> Result<(), Error> {
        advance(self, time)
    }

    /// Rejects the present state if a spring in space is rotated by more than 0.9 of half a turn; the error has its
    /// time.
    fn check_springs(&self) -> Result<(), Error> {
        let (assembly, state) = (self.simulation.rod(), self.simulation.state());
        self.structure.check_springs(assembly, &state.q, &state.frames, Some(state.time))
    }

    /// The simulated structure.
    pub fn structure(&self) -> &Structure {
        self.structure
    }

    /// Time of the present state, s, from t = 0 on.
    pub fn time(&self) -> f64 {
        self.simulation.state().time
    }

    /// Times of the ends of all steps taken so far, s, in order: also of those that bisection made.
    pub fn taken(&self) -> &[f64] {
        &self.taken
    }

    /// Names of the rods in the order of the scene.
    pub fn rod_names(&self) -> impl Iterator<Item = &str> {
        self.structure.scene.rods.iter().map(|rod| &rod.name[..])
    }

    /// Positions of all rods and bodies at the present state, m.
    pub fn shape(&self) -> StructureShape {
        let state = self.simulation.state();
        self.structure.shape_at(&state.q, &state.frames)
    }

    /// Position of a point at the present state, m, in world axes.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a point that the structure does not have.
    pub fn position(&self, point: &StructurePoint) -> Result<[f64; 3], Error> {
        let (structure, state) = (self.structure, self.simulation.state());
        let stencil = structure.nodes().stencil(point, "point")?;
        let motions =
            structure.node_motions(self.simulation.rod(), [&state.q, &state.v], &state.frames);
        Ok(stencil.place(|node| motions[node][0]))
    }

    /// The force of each contact on all rods at the present state, N, in world axes, in the order of `[[contacts]]`.
    pub fn contact_forces(&self) -> Vec<[f64; 3]> {
        let (assembly, state) = (self.simulation.rod(), self.simulation.state());
        let gradients = assembly.contact_gradients([&state.q, &state.v], &state.frames);
        let force = |gradient: Vec<f64>| {
            let ranges = assembly.rod_ranges().into_iter();
            let nodes =
                ranges.flat_map(|range| self.structure.node_vectors(&gradient[range], false));
            nodes.fold([0.0; 3], sub)
        };
        gradients.into_iter().map(force).collect()
    }

    /// Energies at the present state, J.
    pub fn energies(&self) -> Energies {
        self.simulation.energies()
    }

    /// The simulation of the assembly, with unknowns, velocities and frames of its present state.
    pub fn simulation(&self) -> &Simulation<f64, Assembly<f64>> {
        &self.simulation
    }
}

impl Structure {
    /// The table `[time]` of the scene: duration, step and scheme.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a scene without it, and for a step that does not resolve the recorded motion of the ends
    /// or the motion of an obstacle.
    pub fn time(&self) -> Result<&Time, Error> {
        let StructureScene { time, recording, supports, path, .. } = &self.scene;
        let in_file = |error: Error| error.in_file(path.as_deref());
        let Some(time) = time else {
            let allowed = "[time] with end and step, which a simulation requires";
            return Err(in_file(Error::invalid("time", "no such table", allowed)));
        };
        if let Some(recording) = recording {
            recording.check_step(supports, time.step_size()).map_err(in_file)?;
        }
        // All rods touch the same obstacles.
        if let Some(part) = self.parts().next() {
            part.check_step(time.step_size()).map_err(in_file)?;
        }
        Ok(time)
    }

    /// A simulation at t = 0. By `initial.state` it is at rest, or in the equilibrium under the loads, without
    /// velocity, or has shape and velocities by the first two frames of the recording. The step control has the limits
    /// that the scene of the first rod gives. If an end follows a recording, it limits rotations of edges only, not the
    /// energy.
    ///
    /// # Errors
    /// A scene without `[time]` or rods, another scheme than Newmark-beta and generalized-alpha in space, and those of
    /// the [equilibrium](Self::equilibrium) or recorded start. At rest also recorded ends that are away from their
    /// markers. Also steps that do not resolve the recorded motion of the ends, and a spring that is rotated too far.
    pub fn simulation(&self) -> Result<StructureMotion<'_>, Error> {
        let simulation = self.simulation_of(&self.scene)?;
        // Damping and scheme of the structure are in the scene of each rod. A table of the bending moment of one of
        // them changes the limits; else the first one serves.
        let has_table = |scene: &&Scene| scene.material.has_bending_table();
        let part = self.parts().find(has_table).or_else(|| self.parts().next());
        let control = match part {
            Some(scene) if self.recorded.is_empty() => StepControl::new(scene, &simulation),
            Some(scene) => StepControl::without_limits(scene, &simulation),
            None => return Err(Error::invalid("rods", "an empty list", "at least one rod")),
        };
        let motion = StructureMotion { structure: self, simulation, control, taken: Vec::new() };
        motion.check_springs()?;
        Ok(motion)
    }

    /// A simulation at t = 0 over another number type `D`, without bisection of steps. `seed` returns the number for
    /// the path, value and quantity (unit and limits) of each number of the scene. With dual numbers it has the
    /// derivatives of the motion, also those of an equilibrium at the start.
    ///
    /// # Errors
    /// As [`simulation`](Self::simulation).
    pub fn simulation_over<D: RodScalar>(
        &self,
        seed: impl FnMut(&str, f64, Quantity) -> D,
    ) -> Result<Simulation<D, Assembly<D>>, Error> {
        self.simulation_of(&self.scene.map_numbers(seed))
    }

    /// The assembly with its unknowns and frames at equilibrium under the loads, over another number type. `seed`
    /// returns the number of a path, value and quantity of the scene. With dual numbers it has the derivatives of the
    /// equilibrium.
    ///
    /// # Errors
    /// As [`equilibrium`](Self::equilibrium); [`Error::SingularEquilibrium`] where the tangent is singular, over dual
    /// numbers only.
    pub fn equilibrium_over<D: RodScalar>(
        &self,
        seed: impl FnMut(&str, f64, Quantity) -> D,
    ) -> Result<AssemblyAtRest<D>, Error> {
        let AssemblyAtRest { assembly, frames, meshes, .. } = self.at_rest_over(seed)?;
        let (q, frames) = self.differentiated_equilibrium(&assembly, &frames)?;
        Ok(AssemblyAtRest { assembly, q, frames, meshes })
    }

    /// The simulation of a scene over any number type, at its start: rest, equilibrium or recorded start, with recorded
    /// ends as moving supports. Steps are not controlled. Errors: a scene without `[time]`, in space a scheme that does
    /// not integrate rotations of bodies, and those of the equilibrium or the recorded start.
    fn simulation_of<D: RodScalar>(
        &self,
        scene: &StructureScene<D>,
    ) -> Result<Simulation<D, Assembly<D>>, Error> {
        let time = self.time()?;
        let AssemblyAtRest { assembly, mut q, mut frames, .. } = self.blueprint.build(scene)?;
        // Other schemes do not have the inertia forces of rotating bodies in their equations.
        if assembly.is_spatial() {
            check_scheme(time).map_err(|error| error.in_file(self.scene.path.as_deref()))?;
        }
        let mut start = None;
        match self.scene.initial.state {
            InitialState::Equilibrium => {
                (q, frames) = self.differentiated_equilibrium(&assembly, &frames)?;
            }
            InitialState::Recorded => {
                let found = self.recorded_start(scene, &assembly)?;
                (q, frames) = (found.q, found.frames);
                start = Some((found.change, found.interval));
            }
            _ => self.check_recorded_rest()?,
        }
        self.recorded.place(0.0, &mut q, &frames);
        let (n, assembly) = (q.len(), assembly.by_increments());
        let parameter = scene.time.as_ref().map_or(D::from(0.5), Time::parameter);
        let settings = StepperSettings {
            scheme: time.scheme,
            parameter,
            tolerance: time.tolerance,
            length: self.length(),
        };
        let (damping, derivatives) = (scene.loads.damping.in_branches(), self.derivatives);
        let mut simulation =
            Simulation::new(assembly, q, frames, 0..n, damping, settings, derivatives);
        if !self.recorded.is_empty() {
            simulation.move_supports(self.recorded.motion(), self.recorded.prescribed.clone());
        }
        if let Some((change, interval)) = start {
            simulation.set_velocity_from_change(&change, interval)?;
        }
        Ok(simulation)
    }

    /// Rejects a structure that starts at rest with a recorded end away from its markers at t = 0. A coordinate of its
    /// nodes in the rest shape may differ by up to [`AT_MARKERS`] lengths of the structure.
    fn check_recorded_rest(&self) -> Result<(), Error> {
        let (rest, mut q) = (&self.at_rest.q, self.at_rest.q.clone());
        self.recorded.place(0.0, &mut q, &self.at_rest.frames);
        let away = rest.iter().zip(&q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let allowed = "initial.state = \"recorded\" or \"equilibrium\": recorded ends are away from their markers at rest";
        ensure(
            away <= AT_MARKERS * self.length(),
            "initial.state",
            format!("\"rest\" with markers {away:e} m away"),
            allowed,
        )
        .map_err(|error| error.in_file(self.scene.path.as_deref()))
    }

    /// Unknowns and frames of the equilibrium of an `assembly`, with the derivatives that its numbers carry. From the
    /// equilibrium in plain numbers, one Newton iteration over `D` is made per order of derivatives, none for `f64`.
    /// The frames at walls have the derivatives of those in `rest`, the frames at rest. Errors: no equilibrium,
    /// [`Error::SingularEquilibrium`] for a singular tangent.
    fn differentiated_equilibrium<D: RodScalar>(
        &self,
        assembly: &Assembly<D>,
        rest: &AssemblyFrames<D>,
    ) -> Result<(Vec<D>, AssemblyFrames<D>), Error> {
        let found = self.equilibrium_state()?;
        let mut q: Vec<D> = found.q.iter().map(|x| D::from(*x)).collect();
        let mut frames = found.frames.map(D::from);
        // Frames are arbitrary, except at walls, which turn with numbers of the scene.
        assembly.hold_walls(rest, &mut frames);
        let (mut change, mut tangent) = (q.clone(), assembly.zero_tangent());
        let mut factors = tangent.new_factors();
        // From the equilibrium on, every Newton iteration completes one more order of derivatives.
        for _ in 0..D::ORDER {
            assembly.tangent(&q, &frames, Derivatives::Hand, &mut change, &mut tangent);
            self.recorded.prescribed.eliminate_rows_and_columns(&mut tangent);
            self.recorded.prescribed.fill(&mut change, D::from(0.0));
            factors.factor(&tangent, 0..q.len()).map_err(|_| Error::SingularEquilibrium)?;
            factors.solve(&mut change);
            q.iter_mut().zip(&change).for_each(|(q, change)| *q -= *change);
        }
        if D::ORDER > 0 {
            // Rates of angles are spins only in frames at the present shape, with its derivatives.
            assembly.move_frames(&mut frames, &q);
        }
        Ok((q, frames))
    }
}

/// Distance of recorded ends from their markers at t = 0, over the length of the structure, up to which the rest shape
/// is the initial state.
const AT_MARKERS: f64 = 1e-6;

/// Rejects every scheme but Newmark-beta and generalized-alpha, with the key `time.scheme`. It is called for structures
/// in space.
fn check_scheme(time: &Time) -> Result<(), Error> {
    let allowed = "\"newmark-beta\" or \"generalised-alpha\", for a structure in space: only these integrate rotations of bodies";
    let integrates = matches!(time.scheme, Scheme::NewmarkBeta | Scheme::GeneralisedAlpha);
    ensure(integrates, "time.scheme", format!("\"{}\"", time.scheme.name()), allowed)
}
