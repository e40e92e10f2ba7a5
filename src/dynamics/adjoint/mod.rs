//! The derivatives of a misfit with respect to any number of parameters, at the cost of about one more run.
//!
//! Forward sensitivities cost a part of a run for every parameter. A misfit is one number, and its derivatives can be
//! carried the other way: from what it makes of the places and velocities at the end, step by step back to the start, as
//! derivatives by the state. Each step takes one solve with the factors of its own matrix, which is symmetric, and on
//! the way sums what the laws of all elements count for. At the start stands what a change of every stiffness, natural
//! curvature, mass and load, of damping and of the start itself makes of the misfit; what a parameter makes of those is
//! all that is asked of it.
//!
//! Going back needs the states of the run. Where they are more than there is room for, only simulations at the starts
//! of stretches are kept, and every stretch is run again.

mod backward;
mod course;
mod lists;
mod numbers;
mod start;
mod supports;
mod viscous;

use crate::dynamics::adjoint::backward::{Backward, Constants};
use crate::dynamics::adjoint::course::Course;
use crate::dynamics::adjoint::lists::Asked;
use crate::dynamics::adjoint::supports::MovingSupports;
use crate::dynamics::record::{Motion, Record};
use crate::dynamics::run;
use crate::dynamics::sensitivity::{Nodes, Sensitivities};
use crate::dynamics::trajectory::{Motions, Trajectory};
use crate::error::Error;
use crate::problem::{AnyProblem, Discretized, Model, Problem};
use crate::rod::{PlanarRod, SpatialRod, Transposed, still_frames};
use crate::scene::{Parameter, Point, Scheme};
use num_dual::Dual64;
use std::collections::HashMap;

/// What a run keeps at most to be gone back over, bytes, beside a few states and simulations.
const ROOM: usize = 56 << 20;

/// A run that derivatives can be carried back over.
///
/// ```
/// use rodfit::{Parameter, Point, Reversible, Scene};
/// let problem = Scene::load("data/cantilever.toml")?.problem()?;
/// let tip = problem.nodes() - 1;
/// let run = Reversible::run(&problem, &[tip], 100)?;
/// // A misfit: half the sum of the squares of how far the tip is from where it was seen.
/// let (mut misfit, mut slopes) = (0.0, run.slopes());
/// for k in 0..=100 {
///     let [x, y, z] = run.trajectory().node(tip, k); // m
///     let off = [x - 0.1, y, z];
///     misfit += 0.5 * off.iter().map(|c| c * c).sum::<f64>(); // m^2
///     slopes.add(Point::Node(tip), run.trajectory().times()[k], off)?; // its derivative by the place, m
/// }
/// // One number for each parameter, m^2 over the parameter's unit, at the cost of about one more run.
/// let gradient = run.gradient(&[Parameter::YoungsModulus, Parameter::Density], &slopes)?;
/// # assert!(misfit > 0.0 && gradient.len() == 2 && gradient.iter().all(|g| *g != 0.0));
/// # Ok::<(), rodfit::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Reversible {
    problem: Problem,
    trajectory: Trajectory,
    course: AnyCourse,
    /// How many steps it was asked for, and bytes to go back over them.
    asked: (usize, usize),
}

/// A course by its model.
#[derive(Clone, Debug)]
enum AnyCourse {
    Planar(Box<Course<PlanarRod<f64>>>),
    Spatial(Box<Course<SpatialRod<f64>>>),
}

impl Problem {
    /// Refuses a scene whose runs cannot be gone back over: those of schemes whose steps are no equations or average over
    /// the step, of rods with internal friction and of those with energies of one's own. Forward derivatives
    /// ([`simulate_with`](Self::simulate_with)) go with all.
    ///
    /// # Errors
    /// [`Error::Invalid`], which says why.
    pub fn check_reversible(&self) -> Result<(), Error> {
        let scene = self.scene();
        let refused = |key: &str, found: &str, allowed: &str| {
            let allowed = format!("{allowed} to carry derivatives back over a run");
            Err(Error::invalid(key, found, allowed).in_file(scene.path.as_deref()))
        };
        if !matches!(scene.scheme(), Scheme::NewmarkBeta | Scheme::GeneralisedAlpha) {
            let found = scene.scheme().name();
            return refused("time.scheme", found, "newmark-beta or generalised-alpha");
        }
        if scene.loads.damping.friction.is_some() {
            return refused("loads.damping.friction", "internal friction", "none");
        }
        if !scene.energies.is_empty() {
            return refused("energies", "energies of one's own", "none");
        }
        Ok(())
    }
}

impl Reversible {
    /// Simulates `steps` steps of a scene, records the nodes `tracked` and keeps up to 56 MB to go back over the run.
    ///
    /// # Errors
    /// Those of [`Problem::check_reversible`], [`Trajectory::new`] and [`Trajectory::run`].
    pub fn run(problem: &Problem, tracked: &[usize], steps: usize) -> Result<Self, Error> {
        Self::run_within(problem, tracked, steps, ROOM)
    }

    /// The same with about so many bytes to go back over the run. With fewer than its states take, derivatives cost
    /// another run, and with very few two.
    ///
    /// # Errors
    /// Those of [`run`](Self::run).
    pub fn run_within(
        problem: &Problem,
        tracked: &[usize],
        steps: usize,
        bytes: usize,
    ) -> Result<Self, Error> {
        problem.check_reversible()?;
        let mut trajectory = Trajectory::new(problem, tracked, &[])?;
        let course = match problem.discretized() {
            AnyProblem::Planar(planar) => AnyCourse::Planar(Box::new(course(
                problem,
                &planar,
                (steps, bytes),
                &mut trajectory,
            )?)),
            AnyProblem::Spatial(spatial) => AnyCourse::Spatial(Box::new(course(
                problem,
                &spatial,
                (steps, bytes),
                &mut trajectory,
            )?)),
        };
        Ok(Self { problem: problem.clone(), trajectory, course, asked: (steps, bytes) })
    }

    /// The run that the derivatives by these parameters are of, where it is another one.
    fn with_trace_viscosity(&self, parameters: &[Parameter]) -> Result<Option<Self>, Error> {
        let Some(problem) = self.problem.with_trace_viscosity(parameters)? else { return Ok(None) };
        let ((steps, bytes), tracked) = (self.asked, self.trajectory.record().tracked());
        Self::run_within(&problem, &tracked, steps, bytes).map(Some)
    }

    /// What it is a run of.
    pub(crate) fn problem(&self) -> &Problem {
        &self.problem
    }

    /// The run.
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory
    }

    /// No slopes, for the slopes of a misfit to be added.
    pub fn slopes(&self) -> Slopes<'_> {
        let motions = vec![[[0.0; 3]; 2]; self.trajectory.record().motions().len()];
        Slopes { trajectory: &self.trajectory, problem: &self.problem, motions }
    }

    /// The derivatives of a misfit with these slopes by each of the parameters, in the unit of the misfit over that of the
    /// parameter.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a parameter that the scene does not have; [`Error::SingularTangent`] where a step has no
    /// derivatives; those of a step where stretches are run again, and of
    /// [`Discretized::simulation_over`](crate::Discretized::simulation_over).
    pub fn gradient(
        &self,
        parameters: &[Parameter],
        slopes: &Slopes<'_>,
    ) -> Result<Vec<f64>, Error> {
        let asked = (Asked::new(&self.problem, parameters)?, parameters);
        if let Some(felt) = self.with_trace_viscosity(parameters)? {
            return felt.gradient(parameters, slopes);
        }
        let misfit = (&slopes.motions[..], self.trajectory.record());
        match (&self.course, self.problem.discretized()) {
            (AnyCourse::Planar(course), AnyProblem::Planar(planar)) => {
                gradient(&planar, course, misfit, asked)
            }
            (AnyCourse::Spatial(course), AnyProblem::Spatial(spatial)) => {
                gradient(&spatial, course, misfit, asked)
            }
            _ => unreachable!("a course is of its problem's model"),
        }
    }
}

impl Reversible {
    /// The derivatives of the places, m, and velocities, m/s, of the tracked nodes along a direction in the space of
    /// parameters, record after record, at the cost of a part of a run however many they are. The direction has every
    /// parameter's component in its unit. Summed with slopes they make the same as [`gradient`](Self::gradient) with
    /// the direction.
    ///
    /// # Errors
    /// Those of [`gradient`](Self::gradient).
    pub fn along(&self, direction: &[(Parameter, f64)]) -> Result<Motions, Error> {
        let parameters: Vec<Parameter> =
            direction.iter().map(|(parameter, _)| *parameter).collect();
        Asked::new(&self.problem, &parameters)?;
        if let Some(felt) = self.with_trace_viscosity(&parameters)? {
            return felt.along(direction);
        }
        let record = self.trajectory.record();
        match (&self.course, self.problem.discretized()) {
            (AnyCourse::Planar(course), AnyProblem::Planar(planar)) => {
                along(&planar, course, (direction, record))
            }
            (AnyCourse::Spatial(course), AnyProblem::Spatial(spatial)) => {
                along(&spatial, course, (direction, record))
            }
            _ => unreachable!("a course is of its problem's model"),
        }
    }
}

/// The derivatives of what was recorded along a direction.
fn along<M: Model>(
    discretized: &Discretized<'_, M>,
    course: &Course<M::Rod<f64>>,
    (direction, record): (&[(Parameter, f64)], &Record),
) -> Result<Motions, Error>
where
    M::Rod<f64>: Transposed,
{
    let components: HashMap<Parameter, f64> = direction.iter().copied().collect();
    let seed = |p, value| Dual64::new(value, components.get(&p).copied().unwrap_or(0.0));
    let dual = discretized.simulation_over::<Dual64>(seed)?;
    let mut sensitivities = Sensitivities::<M::Rod<f64>>::new(vec![dual]);
    let (tracked, times) = (record.tracked(), record.times());
    let mut motions = Vec::with_capacity(record.motions().len());
    let mut row = 0;
    course.forth(&mut |state, step| {
        step.map_or(Ok(()), |step| sensitivities.advance_over(step))?;
        if times.get(row) == Some(&state.time) {
            row += 1;
            let nodes = Nodes { nodes: &tracked, stride: M::STRIDE, axes: M::STRIDE.min(3) };
            sensitivities.of_nodes(0, nodes, |own| {
                motions.push(own.map(|own| discretized.model.rate(&own, 0)));
            });
        }
        Ok(())
    })?;
    Ok(motions)
}

/// The derivatives of a misfit by the places and velocities of the tracked nodes at every record.
#[derive(Clone, Debug)]
pub struct Slopes<'a> {
    problem: &'a Problem,
    trajectory: &'a Trajectory,
    /// In the order of the records.
    pub(crate) motions: Vec<Motion>,
}

impl Slopes<'_> {
    /// Adds the derivative of the misfit by the place of a point at a time, in world axes, unit of the misfit over m.
    /// Between steps places are interpolated from places and velocities, as [`Trajectory::at`] does.
    ///
    /// # Errors
    /// Those of [`Trajectory::at`].
    pub fn add(&mut self, point: Point, time: f64, slope: [f64; 3]) -> Result<(), Error> {
        let stencil = self.problem.stencil(point)?;
        let record = self.trajectory.record();
        for (index, [place, velocity]) in record.read().weights(&stencil, time)? {
            for c in 0..3 {
                self.motions[index][0][c] += place * slope[c];
                self.motions[index][1][c] += velocity * slope[c];
            }
        }
        Ok(())
    }

    /// Adds the derivatives by the place of a tracked node after `k` steps, unit of the misfit over m, and by its velocity,
    /// over m/s, in world axes: of [`Trajectory::node`] and [`Trajectory::velocity`].
    ///
    /// # Errors
    /// [`Error::OutOfRange`] for a node that was not tracked, and for a step that was not recorded.
    pub fn add_motion(
        &mut self,
        node: usize,
        k: usize,
        slopes: [[f64; 3]; 2],
    ) -> Result<(), Error> {
        let index = self.trajectory.record().index_of(node, k)?;
        for (to, from) in self.motions[index].iter_mut().flatten().zip(slopes.as_flattened()) {
            *to += from;
        }
        Ok(())
    }
}

/// Runs and keeps what is needed to go back.
fn course<M: Model>(
    problem: &Problem,
    discretized: &Discretized<'_, M>,
    (steps, bytes): (usize, usize),
    trajectory: &mut Trajectory,
) -> Result<Course<M::Rod<f64>>, Error>
where
    M::Rod<f64>: Transposed,
{
    trajectory.check_run(problem, steps)?;
    let mut course = None;
    let record = trajectory.record_mut();
    run::run(problem, discretized, (&[], steps), record, &mut |_| {}, &mut |simulation| {
        match &mut course {
            None => course = Some(Course::new(simulation, steps, bytes)),
            Some(course) => course.push(simulation),
        }
    })?;
    Ok(course.expect("a run shows its start"))
}

/// The derivatives by the parameters of a misfit with these slopes.
fn gradient<M: Model>(
    discretized: &Discretized<'_, M>,
    course: &Course<M::Rod<f64>>,
    (slopes, record): (&[Motion], &Record),
    (asked, parameters): (Asked, &[Parameter]),
) -> Result<Vec<f64>, Error>
where
    M::Rod<f64>: Transposed,
{
    let start = course.start();
    let own = [Parameter::DampingBending, Parameter::DampingTwisting, Parameter::DampingStretching];
    let apart = start.damping().additional_times().iter().any(|time| *time != 0.0)
        || parameters.iter().any(|parameter| own.contains(parameter));
    let moments = parameters.iter().any(|parameter| parameter.is_moment());
    let supports = moving_supports(discretized, course, &asked);
    let mut backward = Backward::new(start, supports, (apart, moments));
    let constants = Constants {
        damping: start.damping(),
        drag: start.drag(),
        parameter: start.newton().map_or(0.0, |newton| newton.parameter()),
    };
    let (tracked, times) = (record.tracked(), record.times());
    let mut row = times.len();
    course.back(&mut |state, step| {
        if row > 0 && times[row - 1] == state.time {
            row -= 1;
            for (node, slope) in tracked.iter().zip(&slopes[row * tracked.len()..]) {
                add_slope(discretized.model, *node, slope, [&mut backward.q, &mut backward.v]);
            }
        }
        step.map_or(Ok(()), |step| backward.go(&constants, step))
    })?;
    start::gradient(discretized, (&backward, start), (asked, parameters))
}

/// Adds the slopes by place and velocity of a node.
fn add_slope<M: Model>(model: &M, node: usize, slope: &Motion, to: [&mut Vec<f64>; 2]) {
    for (slope, to) in slope.iter().zip(to) {
        let own = model.components(*slope);
        let axes = M::STRIDE.min(3);
        to[M::STRIDE * node..][..axes].iter_mut().zip(own).for_each(|(to, own)| *to += own);
    }
}

/// The supports with the parameters that move them.
fn moving_supports<M: Model>(
    discretized: &Discretized<'_, M>,
    course: &Course<M::Rod<f64>>,
    asked: &Asked,
) -> MovingSupports<M::Rod<f64>>
where
    M::Rod<f64>: Transposed,
{
    let start = course.start();
    let frames = if M::STRIDE > 3 { start.rod().no_laws(false).stretch.len() } else { 0 };
    let mut supports = MovingSupports::new(start.boundary_motion(), still_frames(frames));
    if supports.are_led() {
        for (k, parameter) in &asked.single {
            let seed = |p, value| Dual64::new(value, f64::from(u8::from(p == *parameter)));
            let setup = discretized.setup_over(seed);
            let motion = discretized.boundary_motion(&setup);
            if let Some(motion) = motion.filter(|motion| motion.changes()) {
                supports.add(*k, motion, M::frames_over::<Dual64>(&start.state().frames));
            }
        }
    }
    supports
}
