//! Noise of cameras with a given standard deviation: white, autocorrelated, heavy-tailed, of whole pixels, and unequal in x
//! and y.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};
use rodfit::Observation;

/// Kinds of noise with equal standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// Normal and independent.
    White,
    /// Consecutive samples correlate by this coefficient, as in a process of first order.
    Correlated(f64),
    /// Student's t with 3 degrees of freedom: some values are far off.
    HeavyTailed,
    /// White noise, rounded to whole pixels as wide as two standard deviations.
    Pixels,
    /// White noise, three times as large in y as in x.
    Unlike,
}

impl Noise {
    /// Adds it to every measured coordinate; `gap` samples are lost after every 50th.
    pub fn add(self, observation: &mut Observation, sigma: f64, gap: usize, seed: u64) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // Where pixels begin.
        let offsets: [f64; 3] = std::array::from_fn(|_| random.random());
        let mut last: [Option<f64>; 3] = [None; 3];
        for sample in &mut observation.samples {
            for (c, x) in sample.position.iter_mut().enumerate() {
                let Some(x) = x else { continue };
                let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
                *x += sigma
                    * match self {
                        Self::White | Self::Pixels => normal(),
                        Self::Unlike => [1.0, 3.0, 1.0][c] * normal(),
                        Self::Correlated(rho) => {
                            let new = normal();
                            let noise = last[c].map_or(new, |last: f64| {
                                rho * last + (1.0 - rho * rho).sqrt() * new
                            });
                            last[c] = Some(noise);
                            noise
                        }
                        Self::HeavyTailed => match StudentT::new(3.0) {
                            Ok(student) => student.sample(&mut random) / 3.0_f64.sqrt(),
                            Err(_) => f64::NAN,
                        },
                    };
                if self == Self::Pixels {
                    let pixel = 2.0 * sigma;
                    *x = pixel * ((*x / pixel + offsets[c]).round() - offsets[c]);
                }
            }
        }
        let mut index = 0;
        observation.samples.retain(|_| {
            index += 1;
            index % 50 >= gap
        });
    }
}
