//! Cameras with white noise, recordings of tip positions, and their fits of E and mass damping with everything else chosen by
//! the library.

use crate::cantilever::STORED_RATE;
use crate::kinds::{DENSITY, GRAVITY, LENGTH, RADIUS};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rodfit::fit::Sample;
use rodfit::{Error, Fit, FitReport, Observation, Parameter, Scene};

/// The modulus that the scene states, Pa: far from the truth, and without influence on a fit without a start value.
const STATED_MODULUS: f64 = 1e7;
/// Time by which the simulation continues beyond the last frame, s.
const MARGIN: f64 = 0.01;

/// A camera with white noise.
pub struct Camera {
    pub name: &'static str,
    /// Frames per second, a divisor of [`STORED_RATE`].
    pub rate: usize,
    /// Standard deviation per coordinate, m.
    pub noise: f64,
    /// Largest accepted share of fits without reservation whose interval misses the truth.
    pub accepted_silent: f64,
}

/// Two pixels of 0.5 mm at 60 frames per second, and a tenth of a millimeter at 1 kHz.
pub const CAMERAS: [Camera; 2] = [
    Camera { name: "poor", rate: 60, noise: 1e-3, accepted_silent: 0.10 },
    Camera { name: "good", rate: 1000, noise: 1e-4, accepted_silent: 0.02 },
];

impl Camera {
    /// The recorded tip, from positions at [`STORED_RATE`]; without a seed there is no noise.
    pub fn record(&self, positions: &[[f64; 2]], seed: Option<u64>) -> Observation {
        let mut random = seed.map(ChaCha8Rng::seed_from_u64);
        let mut seen = |x: f64| {
            let noise = random.as_mut().map_or(0.0, |random| StandardNormal.sample(random));
            Some(x + self.noise * noise)
        };
        let frame = |(k, [x, y]): (usize, &[f64; 2])| Sample {
            time: k as f64 / self.rate as f64,
            position: [seen(*x), seen(*y), None],
        };
        let frames = positions.iter().step_by(STORED_RATE / self.rate);
        Observation::new(frames.enumerate().map(frame).collect())
    }
}

/// The stated rod; mesh, step and scheme are chosen by the library.
fn scene(end: f64) -> Result<Scene, Error> {
    let text = format!(
        "[rod]\n\
         shape = {{ kind = \"straight\", length = {LENGTH}, direction = [1, 0, 0] }}\n\
         section = {{ kind = \"circle\", radius = {RADIUS} }}\n\
         [material]\n\
         density = {DENSITY:?}\n\
         youngs_modulus = {STATED_MODULUS:?}\n\
         poisson_ratio = 0.5\n\
         [loads]\n\
         gravity = [0, -{GRAVITY}, 0]\n\
         [time]\n\
         end = {end:?}\n"
    );
    Scene::from_toml(&text, ".")
}

/// Fits E and mass damping without start values and without a stated noise.
pub fn fit(observation: Observation, end: f64) -> Result<FitReport, Error> {
    Fit::new(&scene(end + MARGIN)?.problem()?)
        .observe(observation)
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::DampingMass)
        .solve()
}
