//! A motion thinned to a bounded number of frames and samples, for the animation and the plots of a page.
//!
//! Input: the number of steps of a run, and its states, step after step, from the initial one on (`Film::push`).
//! Samples (tip, m, and energies, J) are kept at regular intervals of steps, at most [`SAMPLES`] beside the first and
//! the last state. Frames (positions of selected nodes, m, at most [`EDGES`] edges) are kept at every n-th sample, at
//! most [`FRAMES`] beside the first and the last. Output: `frames` and `samples` with their times (s); every frame is
//! at a sample. `Film::thinned` describes the omitted steps and nodes for a caption.

use crate::dynamics::run::Snapshot;
use crate::problem::Problem;
use crate::rod::Energies;
use crate::scene::Stencil;

/// Largest number of shapes of a film, beside the first and the last. More shapes make larger pages and smoother
/// animations.
const FRAMES: usize = 200;
/// Largest number of samples of tip and energies, beside the first and the last: more than the pixels of a plot add
/// nothing.
const SAMPLES: usize = 1000;
/// Largest number of edges of a shape.
const EDGES: usize = 100;

/// A motion with a bounded number of frames and samples.
#[derive(Clone, Debug)]
pub struct Film {
    /// The selected nodes, ascending, with both ends.
    nodes: Vec<usize>,
    /// The tip as a weighted sum of nodes.
    tip: Stencil,
    /// Number of steps of the run.
    steps: usize,
    /// Steps from one sample to the next, and samples from one frame to the next.
    every: [usize; 2],
    /// Number of states added so far.
    seen: usize,
    frames: Vec<Frame>,
    samples: Vec<FilmSample>,
}

/// The shape of a rod at a time.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Time, s.
    pub time: f64,
    /// Positions of the selected nodes, m.
    pub nodes: Vec<[f64; 3]>,
}

/// Tip and energies at a time.
#[derive(Clone, Copy, Debug)]
pub struct FilmSample {
    /// Time, s.
    pub time: f64,
    /// Position of the tip, m.
    pub tip: [f64; 3],
    /// The energies, J.
    pub energies: Energies,
}

impl Film {
    /// An empty film for a run of `steps` steps. Chooses the nodes of frames, evenly spaced with both ends included, so
    /// that there are at most `EDGES` edges. Samples are taken at intervals of `steps/SAMPLES` steps, rounded up.
    /// Frames are taken at a multiple of that interval, so that there are at most `FRAMES` beside the first and the
    /// last.
    pub fn new(problem: &Problem, steps: usize) -> Self {
        // Intervals are rounded up, so that the bounds hold for any number of steps and nodes.
        let (last, sample) = (problem.nodes() - 1, steps.div_ceil(SAMPLES).max(1));
        let between = last.div_ceil(EDGES).max(1);
        let mut nodes: Vec<usize> = (0..last).step_by(between).collect();
        nodes.push(last);
        // Frames are samples too, so that the animation and the plots have common times.
        let frame = steps.div_ceil(sample).div_ceil(FRAMES).max(1);
        let every = [sample, frame];
        let (frames, samples) = (Vec::new(), Vec::new());
        Self { nodes, tip: problem.tip(), steps, every, seen: 0, frames, samples }
    }

    /// Adds the initial state of a simulation, or the state after a step; it must be called once for each, in their
    /// order. Tip and energies are kept at the sampling interval, the shape at the frame interval, both also at the
    /// last step of the run. States between are dropped.
    pub fn push(&mut self, simulation: &dyn Snapshot) {
        let [sample, frame] = self.every;
        let step = self.seen;
        self.seen += 1;
        let is_last = step == self.steps;
        // The last state is always shown.
        if !step.is_multiple_of(sample) && !is_last {
            return;
        }
        let time = simulation.time();
        let (tip, energies) = (simulation.place(&self.tip), simulation.energies());
        self.samples.push(FilmSample { time, tip, energies });
        if step.is_multiple_of(sample * frame) || is_last {
            let nodes = self.nodes.iter().map(|i| simulation.position(*i)).collect();
            self.frames.push(Frame { time, nodes });
        }
    }

    /// The kept shapes in the order of time, the first state included, the last one once it was added.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Tip position and energies of all samples in the order of time; every frame is one of them.
    pub fn samples(&self) -> &[FilmSample] {
        &self.samples
    }

    /// A description of the thinning for a caption, such as `every 5th step of 1000, 51 of 101 nodes`: interval of
    /// frames, number of nodes, and interval of tip and energies. `None` if nothing was omitted.
    pub fn thinned(&self, problem: &Problem) -> Option<String> {
        let [sample, frame] = self.every;
        let mut words = Vec::new();
        if sample * frame > 1 {
            words.push(format!("every {} step of {}", ordinal(sample * frame), self.steps));
        }
        if self.nodes.len() < problem.nodes() {
            words.push(format!("{} of {} nodes", self.nodes.len(), problem.nodes()));
        }
        if sample > 1 {
            words.push(format!("tip and energies at every {} step", ordinal(sample)));
        }
        (!words.is_empty()).then(|| words.join(", "))
    }
}

/// An ordinal number in digits as text, such as `2nd` or `13th`.
fn ordinal(n: usize) -> String {
    let ending = match (n % 10, n % 100) {
        (_, 11..=13) => "th",
        (1, _) => "st",
        (2, _) => "nd",
        (3, _) => "rd",
        _ => "th",
    };
    format!("{n}{ending}")
}
