//! Frames of the motion of a structure, at most 201, for the animation and the plots of a page.
//!
//! [`StructureFilm::new`] takes the number of steps of the run; [`StructureFilm::push`] is called with the
//! [`StructureMotion`] at the start and after each step. It keeps the start, every n-th step and the last step,
//! with the smallest `n` for which at most `FRAMES` steps are kept; the others are dropped. Output:
//! [`StructureFilm::frames`] has the time, s, and the positions of all nodes, m, rod after rod in the order of the
//! scene, with a NaN position between two rods. Bodies are left out. [`StructureFilm::samples`] has, at the same
//! times, the end (tip) of the last rod, m, and the energies, J.

use crate::dynamics::{FilmSample, Frame};
use crate::structure::structure_motion::StructureMotion;

/// Largest number of frames, beside the first.
const FRAMES: usize = 200;

/// A motion with a bounded number of frames.
#[derive(Clone, Debug)]
pub struct StructureFilm {
    steps: usize,
    every: usize,
    seen: usize,
    frames: Vec<Frame>,
    samples: Vec<FilmSample>,
}

impl StructureFilm {
    /// An empty film of a run of `steps` steps, of which every n-th is kept, with the smallest n for at most `FRAMES`
    /// steps.
    pub fn new(steps: usize) -> Self {
        let every = steps.div_ceil(FRAMES).max(1);
        Self { steps, every, seen: 0, frames: Vec::new(), samples: Vec::new() }
    }

    /// Adds the initial state of a motion, or the state after a step, if it is one that the film keeps: the start,
    /// every n-th step and the last one. It must be called once for each of them, in order.
    pub fn push(&mut self, motion: &StructureMotion<'_>) {
        let step = self.seen;
        self.seen += 1;
        if !step.is_multiple_of(self.every) && step != self.steps {
            return;
        }
        let (time, mut nodes) = (motion.time(), Vec::new());
        let mut tip = [0.0; 3];
        // The order of the scene: the tip is that of its last rod.
        let shape = motion.shape();
        for rod in motion.rod_names().filter_map(|name| shape.rods.get(name)) {
            if !nodes.is_empty() {
                nodes.push([f64::NAN; 3]);
            }
            nodes.extend_from_slice(&rod.nodes);
            tip = rod.tip;
        }
        self.frames.push(Frame { time, nodes });
        self.samples.push(FilmSample { time, tip, energies: motion.energies() });
    }

    /// The kept frames in the order of time; of a run that ended early the last state may be missing. Each has the
    /// time, s, and the positions of the nodes of all rods, m, with a NaN position between two rods.
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Time, s, tip of the last rod, m, and energies, J, of all kept frames.
    pub fn samples(&self) -> &[FilmSample] {
        &self.samples
    }
}
