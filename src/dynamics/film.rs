//! A motion thinned out to what a page can show: so many moments of so many nodes, however long the run.

use crate::dynamics::run::Snapshot;
use crate::problem::Problem;
use crate::rod::Energies;
use crate::scene::Stencil;

/// Most moments with the whole rod, beside the first, and of its tip and energies.
const FRAMES: usize = 200;
const SAMPLES: usize = 1000;
/// Most edges of a drawn rod.
const EDGES: usize = 100;

/// A motion as a page shows it.
#[derive(Clone, Debug)]
pub struct Film {
    /// The nodes that are kept, ascending, both ends among them.
    nodes: Vec<usize>,
    /// The nodes and weights whose sum is the tip.
    tip: Stencil,
    steps: usize,
    /// Steps from one sample to the next, and samples from one frame to the next.
    every: [usize; 2],
    seen: usize,
    frames: Vec<Frame>,
    samples: Vec<Sample>,
}

/// The rod at a moment.
#[derive(Clone, Debug)]
pub struct Frame {
    /// When, s.
    pub time: f64,
    /// Where the nodes that are kept are, m.
    pub nodes: Vec<[f64; 3]>,
}

/// What is kept of more moments than the whole rod.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// When, s.
    pub time: f64,
    /// Where the tip is, m.
    pub tip: [f64; 3],
    /// The energies, J.
    pub energies: Energies,
}

impl Film {
    /// Of a run of so many steps.
    pub fn new(problem: &Problem, steps: usize) -> Self {
        let (last, sample) = (problem.nodes() - 1, steps.div_ceil(SAMPLES).max(1));
        let between = last.div_ceil(EDGES).max(1);
        let mut nodes: Vec<usize> = (0..last).step_by(between).collect();
        nodes.push(last);
        let frame = steps.div_ceil(sample).div_ceil(FRAMES).max(1);
        let every = [sample, frame];
        let (frames, samples) = (Vec::new(), Vec::new());
        Self { nodes, tip: problem.tip(), steps, every, seen: 0, frames, samples }
    }

    /// Takes the state of a simulation after a step, and before the first.
    pub fn push(&mut self, simulation: &dyn Snapshot) {
        let [sample, frame] = self.every;
        let step = self.seen;
        self.seen += 1;
        let is_last = step == self.steps;
        if !step.is_multiple_of(sample) && !is_last {
            return;
        }
        let time = simulation.time();
        let (tip, energies) = (simulation.place(&self.tip), simulation.energies());
        self.samples.push(Sample { time, tip, energies });
        if step.is_multiple_of(sample * frame) || is_last {
            let nodes = self.nodes.iter().map(|i| simulation.position(*i)).collect();
            self.frames.push(Frame { time, nodes });
        }
    }

    /// Moments with the whole rod, the first and the last among them.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Tip and energies at these and more moments.
    pub fn samples(&self) -> &[Sample] {
        &self.samples
    }

    /// What is left out, in words; nothing where nothing is.
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

/// `2nd`, `13th`.
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
