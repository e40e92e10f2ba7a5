//! The initial state of a simulation and of its derivatives: positions and velocities at t = 0, over any scalar.
//!
//! Input: a discretized scene. Positions: rest shape, initial shape of the scene, or equilibrium under the loads and
//! the forces `initial.point`, each with the perturbation of the scene. For a recorded motion: the shape of least
//! energy near the markers of its first frame. Velocities: those of a rigid body (`initial.velocity` of the center of
//! mass, `initial.angular_velocity` about it), or of the recorded motion over its first interval, extrapolated to t
//! = 0. The equilibrium is found once in plain numbers; its derivatives follow from linear systems with the tangent. At
//! a neutral equilibrium, or with a singular tangent, they are those of a rod that moves with its initial position, and
//! a small stiffness is added; [`Error::Indifferent`] if the tangent is singular even so. Output: a [`Simulation`] with
//! supports, loads in time, actuators, drag and scheme (Newmark-beta without `[time]`), or the [`Sensitivities`] of one
//! simulation in dual numbers per parameter. Errors are those of the search for the equilibrium or the recorded shape.
//!
//! `simulation_over` is the simulation over any scalar, `sensitivities` the derivatives by parameters. `start` returns
//! the positions with frames, and `start_velocity` the velocities of a rigid body, `None` over plain numbers if they
//! are zero.

use crate::dynamics::sensitivity::Sensitivities;
use crate::dynamics::simulation::Simulation;
use crate::dynamics::step::StepperSettings;
use crate::error::Error;
use crate::numerics::scalar::RodScalar;
use crate::numerics::vector::{add, cross, dot, scale, sub, unit};
use crate::problem::Discretized;
use crate::problem::Model;
use crate::problem::Setup;
use crate::problem::UnknownsAndFrames;
use crate::rod::{ForwardSensitivity, Rod};
use crate::scene::InitialState;
use crate::scene::Parameter;
use crate::scene::prescribed_motion::MotionTime;
use crate::statics::RecordedStart;
use num_dual::Dual64;

impl<M: Model> Discretized<'_, M> {
    /// A simulation in its initial state at t = 0, over plain numbers. The state is the rest shape, the initial shape
    /// or the equilibrium of the scene, with its perturbation and velocities. For a recorded start it is the shape of
    /// the first frame, with velocities from the first two.
    ///
    /// # Errors
    /// Those of the [equilibrium](Discretized::equilibrium), for a scene that starts from one. For a recorded start: no
    /// recording, no equilibrium of the rod between the markers, [`Error::SingularTangent`].
    pub fn simulation(&self) -> Result<Simulation<f64, M::Rod<f64>>, Error> {
        self.simulation_of(self.setup)
    }

    /// A simulation in its initial state at t = 0 over any scalar. `seed` converts the value of each parameter to it,
    /// with derivatives if wanted.
    ///
    /// ```no_run
    /// # use rodfit::{Scene, Parameter};
    /// use num_dual::Dual64;
    /// let problem = Scene::load("cantilever.toml")?.problem()?;
    /// let planar = problem.planar().expect("the cantilever lies in a plane");
    /// let mut simulation = planar.simulation_over(|parameter, value| {
    ///     Dual64::new(value, if parameter == Parameter::YoungsModulus { 1.0 } else { 0.0 })
    /// })?;
    /// simulation.step_to(1e-3)?;
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`simulation`](Self::simulation), and [`Error::Indifferent`] where the equilibrium it
    /// starts from has no derivatives.
    pub fn simulation_over<D: RodScalar>(
        &self,
        seed: impl Fn(Parameter, f64) -> D,
    ) -> Result<Simulation<D, M::Rod<D>>, Error> {
        self.simulation_of(&self.setup_over(seed))
    }

    /// The simulation of a setup in its initial state over the scalar `D`: positions and velocities of the scene or of
    /// its recording, then scheme, drag, loads in time, actuators and moving supports. Velocities are set after the
    /// supports, whose recordings prescribe some of them. A scene without `[time]` gets Newmark-beta at 0.5. Errors are
    /// those of
    /// [`simulation_over`](Self::simulation_over).
    fn simulation_of<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
    ) -> Result<Simulation<D, M::Rod<D>>, Error> {
        let scene = &setup.scene;
        let rod = setup.rod_in_motion(self.model);
        let recorded = self.scene().initial.state == InitialState::Recorded;
        // Initial places and velocities: recorded, or of the scene (rest shape or equilibrium).
        let (start, velocity, change) = match recorded {
            true => {
                let RecordedStart { start, change, interval } = self.recorded_start(setup)?;
                (start, None, Some((change, interval)))
            }
            false => {
                let start = self.start(setup, &rod)?;
                let velocity = self.start_velocity(setup, &rod, &start.0);
                (start, velocity, None)
            }
        };
        // Supports, scheme and tolerance; 0.5 replaces the parameter of a scene without [time].
        let boundary_motion = self.boundary_motion(setup);
        let parameter = scene.time.as_ref().map_or(D::from(0.5), |time| time.parameter());
        let settings = StepperSettings {
            scheme: scene.scheme(),
            parameter,
            tolerance: scene.tolerance(),
            length: self.problem.length(),
        };
        let (q, frames) = start;
        let mut simulation = Simulation::new(
            rod,
            q,
            frames,
            self.free(),
            scene.loads.damping.in_branches(),
            settings,
            self.problem.derivatives(),
        );
        // Supports before the velocities: they prescribe the velocities of some unknowns.
        if let Some(drag) = setup.drag(self.model) {
            simulation.immerse(drag);
        }
        let timed_loads = setup.timed_loads(self.model);
        if !timed_loads.is_empty() {
            simulation.load_in_time(timed_loads);
        }
        simulation.follow(setup.actuators(self.model));
        if let Some(boundary_motion) = boundary_motion {
            simulation.move_supports(boundary_motion, self.prescribed());
        }
        if let Some(velocity) = velocity {
            simulation.set_velocity(&velocity);
        }
        // A recorded start has a change over its first interval instead of a velocity.
        if let Some((change, h)) = change {
            simulation.set_velocity_from_change(&change, h)?;
        }
        Ok(simulation)
    }

    /// The sensitivities of a simulation to `parameters`, in the initial state: one simulation in dual numbers per
    /// parameter.
    ///
    /// # Errors
    /// Those of [`simulation_over`](Self::simulation_over).
    pub fn sensitivities(
        &self,
        parameters: &[Parameter],
    ) -> Result<Sensitivities<M::Rod<f64>>, Error>
    where
        M::Rod<f64>: ForwardSensitivity,
    {
        let along = |parameter: &Parameter| {
            self.simulation_over::<Dual64>(|p, value| {
                Dual64::new(value, f64::from(p == *parameter))
            })
        };
        Ok(Sensitivities::new(parameters.iter().map(along).collect::<Result<_, _>>()?))
    }

    /// The unknowns of the equilibrium at t = 0 with the forces that hold the rod until then, m and rad, angles being
    /// measured from the initial frames. Computed at the first call and then stored in the problem. Errors are those of
    /// the search, with the file of the scene.
    fn equilibrium_start(&self) -> Result<&[f64], Error> {
        let start = &self.problem.start;
        if start.get().is_none() {
            let file = self.scene().path.as_deref();
            let found = self.held_equilibrium().map_err(|error| error.in_file(file))?;
            // Another thread may have set the same result.
            let _ = start.set(vec![found]);
        }
        Ok(start.get().map_or(&[], |start| start[0].as_slice()))
    }

    /// The unknowns at t = 0 with their frames, with the derivatives that `D` carries: rest shape, initial shape or
    /// equilibrium, plus the perturbation of the scene (also added to an equilibrium). The frames are moved to the
    /// perturbed shape. Errors are those of the equilibrium.
    pub(crate) fn start<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
        rod: &M::Rod<D>,
    ) -> Result<UnknownsAndFrames<D, M>, Error> {
        let (mut q, mut frames) = self.unperturbed_start(setup, rod)?;
        if self.scene().initial.perturbation != 0.0 {
            self.perturb(setup, &mut q);
            M::Rod::<D>::update_reference_frames(&mut frames, &q);
        }
        Ok((q, frames))
    }

    /// The unknowns and frames at the start, without the perturbation of the scene, with the derivatives that `D`
    /// carries. They are the rest shape, the initial shape of the scene, or the equilibrium under the loads and the
    /// forces `initial.point`, which hold the rod until t = 0. The derivatives of the equilibrium follow from linear
    /// systems with its tangent. At a neutral equilibrium, or with a singular tangent, they are those of a rod that
    /// moves with its initial position, and a small stiffness is added. [`Error::Indifferent`] if that tangent is
    /// singular too.
    fn unperturbed_start<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
        rod: &M::Rod<D>,
    ) -> Result<UnknownsAndFrames<D, M>, Error> {
        let (begin, mut frames) = self.begin(setup);
        if self.scene().initial.state != InitialState::Equilibrium {
            return Ok((begin, frames));
        }
        let found = self.equilibrium_start()?;
        let mut q: Vec<D> = found.iter().map(|x| D::from(*x)).collect();
        // Frames at the equilibrium: transport over nearly 180 degrees would be almost singular.
        M::Rod::<D>::update_reference_frames(&mut frames, &q);
        if D::ORDER == 0 {
            return Ok((q, frames));
        }
        self.hold(setup, MotionTime::Approach { progress: 1.0, settled: false }, &mut q, &frames)?;
        // Derivatives of an equilibrium: one linear system with the tangent, over dual numbers.
        // Signals have their values at t = 0 there.
        let loaded = (!setup.scene.signals.is_empty()).then(|| setup.rod_at(self.model, 0.0));
        let held = setup.rod_with_release_forces(self.model, loaded.as_ref().unwrap_or(rod));
        let mut plain_frames = self.begin(self.setup).1;
        M::Rod::<f64>::update_reference_frames(&mut plain_frames, found);
        let plain = self.setup.rod_at(self.model, 0.0);
        let plain = self.setup.rod_with_release_forces(self.model, &plain);
        // A rod that nothing holds moves with its initial position.
        let neutral = self.is_neutral(found, &plain_frames).unwrap_or(false);
        let differentiate = |q: &mut [D], neutral: bool| {
            self.differentiate(&held, &frames, &plain, &plain_frames, q, neutral)
        };
        // A tangent that is singular belongs to a rod that can move without a force.
        let mut followed = q.clone();
        if neutral || differentiate(&mut followed, false).is_err() {
            followed = q;
            self.add_start_derivatives(&begin, &mut followed);
            differentiate(&mut followed, true)
                .map_err(|singular| Error::Indifferent { node: singular.row / M::STRIDE })?;
        }
        // Rates of angles are spins of edges only in frames at the current shape, with all derivatives.
        M::Rod::<D>::update_reference_frames(&mut frames, &followed);
        Ok((followed, frames))
    }

    /// The initial velocities of a rod at the unknowns `q`, m/s and rad/s: those of a rigid body. A node at `x` has
    /// `velocity + angular_velocity x (x - c)`, with the center of mass `c` and the vectors of `[initial]`. The angle
    /// of an edge in space has the component of `angular_velocity` along the edge. `None` over plain numbers if both
    /// vectors are zero.
    pub(crate) fn start_velocity<D: RodScalar>(
        &self,
        setup: &Setup<D, M>,
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
        // Velocity of the center of mass, plus the rotation about it.
        let total = (0..nodes).map(mass).fold(zero, |sum, mass| sum + mass);
        let centre =
            (0..nodes).fold([zero; 3], |sum, i| add(sum, scale(place(i), mass(i) / total)));
        let mut v = vec![zero; q.len()];
        for i in 0..nodes {
            let own = add(velocity, cross(spin, sub(place(i), centre)));
            v[M::STRIDE * i..][..axes].copy_from_slice(&own[..axes]);
            // Spatial rods also spin about their own axis.
            if M::STRIDE > axes && i + 1 < nodes {
                v[M::STRIDE * i + axes] = dot(spin, unit(sub(place(i + 1), place(i))));
            }
        }
        Some(v)
    }
}
