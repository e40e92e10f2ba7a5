//! A synthetic laboratory: a rod, a camera and their errors, drawn from a seed, and the scene, data and fit file that such a
//! laboratory would have.
//!
//! Two motions: release of a straight rod under gravity, simulated on a mesh of [`EDGES`] edges; and release of a rod that is
//! bent by a force at its tip, by the modes of an Euler-Bernoulli beam. Measured dimensions differ from the true ones by their
//! standard uncertainties [`KNOWN`]; the camera has a wrong scale, a roll, a late clock, rounding to pixels and AR(1) noise.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rodfit::scene::{Material, Scene, Section, Shape, Time};
use rodfit::{Error, Parameter, Point};
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::path::Path;

/// Edges of the simulated data.
const EDGES: usize = 384;
/// Time steps of the simulated data in the first period.
const STEPS: f64 = 960.0;
/// Relative standard uncertainties of length, radius, density and the scale of the camera.
const KNOWN: [f64; 4] = [1e-3, 5e-3, 5e-3, 2e-3];
/// Gravity, m/s^2.
const GRAVITY: f64 = 9.81;
/// `beta L` of the first four modes of a clamped beam: roots of `cos x cosh x = -1`.
const ROOTS: [f64; 4] =
    [1.8751040687119611, 4.694091132974175, 7.854757438237613, 10.99554073487547];
/// Position of the clamp in the image, pixels.
const CLAMP: [f64; 2] = [140.0, 310.0];

/// The cause of the rod's motion.
#[derive(Clone, Copy, Debug)]
enum Motion {
    /// It falls from where it is straight.
    Falls,
    /// It is pulled aside at its tip, by a part of its length, and let go where gravity does not matter.
    LetGo(f64),
}

/// All true values of a laboratory, and its measured ones.
#[derive(Debug)]
pub struct Laboratory {
    motion: Motion,
    /// Length, radius, m, and density, kg/m^3, as they are and as they were measured.
    rod: [f64; 3],
    measured: [f64; 3],
    modulus: f64,
    /// Damping by mass, 1/s.
    damping: f64,
    /// End of the recording, s.
    end: f64,
    fps: f64,
    /// Nominal meters per pixel. After it: the true scale over the nominal one, the roll, rad, and the delay of the clock, s.
    scale: f64,
    lens: f64,
    roll: f64,
    late: f64,
    /// Error of the clicked position of the clamp, pixels.
    missed: [f64; 2],
    /// Standard deviation of the noise, pixels; after it the correlation of neighboring frames.
    noise: f64,
    memory: f64,
    seed: u64,
}

impl Laboratory {
    /// The laboratory of a seed; equal seeds give equal laboratories.
    pub fn new(seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut between = |low: f64, high: f64| low + (high - low) * random.random::<f64>();
        let measured = [between(0.2, 0.5), between(1e-3, 3e-3), between(1000.0, 2000.0)];
        let falls = between(0.0, 1.0) < 0.6;
        // Weight over the load that bends the rod by about its length; or the frequency, Hz, of a rod bent by a force.
        let (load, hz) = (between(0.1_f64.ln(), 3.0_f64.ln()).exp(), between(1.0, 6.0));
        let (part, ratio) = (between(0.01, 0.025), between(5e-3, 0.03));
        let (periods, frames) = (between(3.0, 8.0), between(20.0, 50.0));
        let pixels = between(700.0, 1600.0);
        let [roll, late] = [between(-0.02, 0.02), between(0.0, 1.5)];
        let [noise, memory] = [between(0.4, 1.5), between(0.0, 0.9)];
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let rod = std::array::from_fn(|i| measured[i] * (1.0 + KNOWN[i] * normal()));
        let lens = 1.0 + KNOWN[3] * normal();
        let missed = std::array::from_fn(|_| 1.5 * normal());

        let [length, radius, density] = rod;
        let (area, bending) = (PI * radius * radius, PI * radius.powi(4) / 4.0);
        let inertia = density * area * length.powi(4) / bending;
        let modulus = match falls {
            true => density * area * GRAVITY * length.powi(3) / (bending * load),
            false => inertia * (TAU * hz / ROOTS[0].powi(2)).powi(2),
        };
        let first = ROOTS[0].powi(2) * (modulus / inertia).sqrt();
        // Frame rate, damping and duration are relative to the lowest frequency.
        let fps = (frames * first / TAU).ceil();
        let motion = if falls { Motion::Falls } else { Motion::LetGo(part) };
        let (damping, late) = (2.0 * ratio * first, late / fps);
        let (end, scale) = (periods * TAU / first, length / pixels);
        Self {
            motion,
            rod,
            measured,
            modulus,
            damping,
            end,
            fps,
            scale,
            lens,
            roll,
            late,
            missed,
            noise,
            memory,
            seed,
        }
    }

    /// The identified parameters with their true values, Pa and 1/s.
    pub fn truths(&self) -> [(Parameter, f64); 2] {
        [(Parameter::YoungsModulus, self.modulus), (Parameter::DampingMass, self.damping)]
    }

    /// Number of edges of the data's mesh; infinite for data of the continuum.
    pub fn edges(&self) -> f64 {
        match self.motion {
            Motion::Falls => EDGES as f64,
            Motion::LetGo(_) => f64::INFINITY,
        }
    }

    /// Writes scene, data and fit into a folder.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let texts =
            [("scene.toml", self.scene()), ("tip.csv", self.data()?), ("fit.toml", self.fit())];
        for (name, text) in texts {
            let path = folder.join(name);
            std::fs::write(&path, text).map_err(|source| Error::Io {
                named_in: None,
                path,
                source,
            })?;
        }
        Ok(())
    }

    /// The scene file (TOML) with the measured dimensions.
    fn scene(&self) -> String {
        let [length, radius, density] = self.measured;
        let moved = match self.motion {
            Motion::Falls => format!("[loads]\ngravity = [0, -{GRAVITY}, 0]\n"),
            // The force is measured with an error of 3 %.
            Motion::LetGo(part) => format!(
                "[initial]\nstate = \"equilibrium\"\npoint = [{{ node = \"tip\", force = [0, {:e}, 0] }}]\n",
                1.03 * self.pull(part)
            ),
        };
        format!(
            "[rod]\nshape = {{ kind = \"straight\", length = {length}, direction = [1, 0, 0] }}\n\
             section = {{ kind = \"circle\", radius = {radius} }}\n\
             [material]\ndensity = {density}\nyoungs_modulus = 1e9\n{moved}[time]\nend = {}\n",
            self.end
        )
    }

    /// The fit file (TOML): E, damping, camera and, if applied, the force; dimensions with their uncertainties.
    fn fit(&self) -> String {
        let mut text = format!(
            "scene = \"scene.toml\"\n[[observation]]\nfile = \"tip.csv\"\nfps = {}\nscale = {:e}\ny = \"down\"\n\
             origin = [{}, {}, 0]\n",
            self.fps, self.scale, CLAMP[0], CLAMP[1]
        );
        let mut unknowns = vec![
            "youngs_modulus",
            "damping.mass",
            "camera.time_offset",
            "camera.in_plane_rotation",
            "camera.clamp_position.x",
            "camera.clamp_position.y",
        ];
        if let Motion::LetGo(_) = self.motion {
            unknowns.push("initial.point.0.force.y");
        }
        for name in unknowns {
            let _ = write!(text, "[[parameter]]\nname = \"{name}\"\n");
        }
        // Dimensions and the camera's scale are inputs with standard uncertainties.
        let [length, radius, density] = self.measured;
        let known = [
            ("rod.shape.length", length),
            ("rod.section.radius", radius),
            ("material.density", density),
            ("camera.pixel_scale", 1.0),
        ];
        for ((name, value), part) in known.iter().zip(KNOWN) {
            let _ = write!(text, "[[known]]\nname = \"{name}\"\nsigma = {:e}\n", part * value);
        }
        text
    }

    /// The table of a tracking program: frame numbers and positions of the tip in whole pixels.
    fn data(&self) -> Result<String, Error> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed ^ 0x5eed);
        let mut last: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
        let mut text = String::from("frame,x[px],y[px]\n");
        let frames = (self.end * self.fps).floor() as u32;
        let times: Vec<f64> = (0..=frames).map(|k| f64::from(k) / self.fps).collect();
        let seen: Vec<f64> = times.iter().map(|t| (t - self.late).max(0.0)).collect();
        for (frame, [x, y]) in self.tip(&seen)?.into_iter().enumerate() {
            let (sin, cos) = self.roll.sin_cos();
            let (x, y) = (self.lens * (cos * x - sin * y), self.lens * (sin * x + cos * y));
            let [from, down] = [0, 1].map(|c| CLAMP[c] + self.missed[c]);
            let places = [from + x / self.scale, down - y / self.scale];
            for (last, kept) in last.iter_mut().zip([self.memory; 2]) {
                let new: f64 = StandardNormal.sample(&mut random);
                *last = kept * *last + (1.0 - kept * kept).sqrt() * new;
            }
            let [x, y] = [0, 1].map(|c| (places[c] + self.noise * last[c]).round());
            let _ = writeln!(text, "{frame},{x},{y}");
        }
        Ok(text)
    }

    /// True positions of the tip at these times, from the clamp, m.
    fn tip(&self, times: &[f64]) -> Result<Vec<[f64; 2]>, Error> {
        match self.motion {
            Motion::Falls => self.falling(times),
            Motion::LetGo(part) => Ok(times.iter().map(|t| self.swinging(part, *t)).collect()),
        }
    }

    /// Positions of the tip of a rod released under gravity, by a mesh far finer than that of a fit.
    fn falling(&self, times: &[f64]) -> Result<Vec<[f64; 2]>, Error> {
        let [length, radius, density] = self.rod;
        let shape = Shape::Straight { length, direction: [1.0, 0.0, 0.0] };
        let material = Material::new(density, self.modulus);
        let mut scene = Scene::new(EDGES, shape, Section::Circle { radius }, material);
        scene.loads.gravity = [0.0, -GRAVITY, 0.0];
        scene.loads.damping.mass = self.damping;
        let first = TAU / (ROOTS[0].powi(2) * self.rate());
        scene.time = Some(Time::new(self.end, first / STEPS));
        let run = scene.problem()?.simulate()?;
        let tip = |t: &f64| run.at(Point::Tip, *t).map(|([x, y, _], _)| [x, y]);
        times.iter().map(tip).collect()
    }

    /// `sqrt(E I/(rho A L^4))`, 1/s.
    fn rate(&self) -> f64 {
        let [length, radius, density] = self.rod;
        (self.modulus / density).sqrt() * radius / 2.0 / length.powi(2)
    }

    /// The force that bends the tip by a part of the length (beam theory), N.
    fn pull(&self, part: f64) -> f64 {
        let [length, radius, _] = self.rod;
        3.0 * self.modulus * PI * radius.powi(4) / 4.0 * part / length.powi(2)
    }

    /// Position of the tip of a rod released from a bent shape, by the modes of a beam: each starts with its part of the static
    /// shape and is damped equally. The tip approaches the clamp by half the integral of the squared slope.
    fn swinging(&self, part: f64, time: f64) -> [f64; 2] {
        let length = self.rod[0];
        // Modes with mean square 1 have the tip at 2 or -2; the static shape is F s^2 (3 L - s)/(6 E I).
        let begins = |k: usize| {
            let sign = if k.is_multiple_of(2) { 2.0 } else { -2.0 };
            3.0 * part * length * sign / ROOTS[k].powi(4)
        };
        let now = |k: usize| {
            let half = 0.5 * self.damping;
            let own = ((ROOTS[k].powi(2) * self.rate()).powi(2) - half * half).sqrt();
            let (sin, cos) = (own * time).sin_cos();
            begins(k) * (-half * time).exp() * (cos + half / own * sin)
        };
        let size: Vec<f64> = (0..ROOTS.len()).map(now).collect();
        let slope = |s: f64| -> f64 {
            let of = |(k, root): (usize, &f64)| {
                let ratio = (root.cosh() + root.cos()) / (root.sinh() + root.sin());
                let x = root * s;
                size[k] * root * (x.sinh() + x.sin() - ratio * (x.cosh() - x.cos()))
            };
            ROOTS.iter().enumerate().map(of).sum::<f64>() / length
        };
        let points = 100;
        let squares = (0..points).map(|i| slope((f64::from(i) + 0.5) / f64::from(points)).powi(2));
        let shorter = 0.5 * length * squares.sum::<f64>() / f64::from(points);
        let aside =
            size.iter().enumerate().map(|(k, q)| if k % 2 == 0 { 2.0 * q } else { -2.0 * q });
        [length - shorter, aside.sum()]
    }
}
