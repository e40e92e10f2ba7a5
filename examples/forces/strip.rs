//! The steel strip that a robot arm moves: its scene, and its fits to the bending moment at the clamp.
//!
//! Input: a folder with one table per take (columns `t_s`, pose of the clamp `px_m` .. `qw`, wrench `Fx_N` .. `Tz_Nm`
//! in the axes of the clamp). The recorded pose is the prescribed motion of the clamped start. The z axis of the clamp,
//! about which the strip bends, is the world's -y in all takes. Output: texts of fit files, for one take or for all,
//! with scenes that are written beside them. Parameters are Young's modulus, common to all takes, and a Kelvin-Voigt
//! time of each take. The offset of the moment is a free tare.

use std::error::Error;
use std::path::{Path, PathBuf};

/// Recordings of the strip, with the numerics of their simulation.
pub struct Recordings {
    /// Folder of the tables.
    pub folder: PathBuf,
    /// Names of the tables.
    pub takes: &'static [&'static str],
    /// Time of the first row, s.
    pub time_zero: f64,
    /// First and last time of the fitted readings after `time_zero`, s: the arm stands still.
    pub window: [f64; 2],
    /// Number of edges of the strip.
    pub segments: usize,
    /// Time step, s.
    pub step: f64,
}

/// The recordings of the arm, whose tables are in `folder`.
pub fn recorded(folder: PathBuf) -> Recordings {
    Recordings {
        folder,
        takes: &["flat_15cm", "flat_35cm", "down_15cm", "down_35cm", "up_15cm", "up_35cm"],
        time_zero: 0.002,
        window: [2.0, 6.0],
        segments: 12,
        step: 0.0025,
    }
}

/// Keys of a moment about the bending axis, after the file.
const MOMENT: &str = r#"quantity = "moment"
of = "start"
columns = { t = "t_s", mx = "Tx_Nm", my = "Ty_Nm", mz = "Tz_Nm" }
axes = ["none", "-z", "none"]
tare = "free"
"#;

/// Start value and bounds of Young's modulus: steel, with a margin.
const MODULUS: &str = r#"
[[parameter]]
name = "youngs_modulus"
start = 1.88e11
bounds = [1.75e11, 2.05e11]
"#;

/// Score tests for omitted effects are left out: they cost more than the fits.
const ANALYSIS: &str = "[analysis]\nsensitivity_analysis = false\n";

/// Start value and bounds of the Kelvin-Voigt time, s.
const DAMPING: &str = r#"
[[parameter]]
name = "damping.stiffness"
start = 1e-3
bounds = [1e-4, 5e-3]
"#;

impl Recordings {
    /// The scene of a take, with the given Kelvin-Voigt time, s.
    pub fn scene(&self, take: &str, damping: f64) -> String {
        let file = self.folder.join(format!("{take}.csv"));
        format!(
            r#"[rod]
segments = {}
shape = {{ kind = "straight", length = 0.52, direction = [1, 0, 0] }}
section = {{ kind = "rectangle", width = 0.08, height = 0.001, up = [0, 1, 0] }}
[material]
density = 7870
youngs_modulus = 1.9e11
poisson_ratio = 0.3
[[supports.motion]]
end = "start"
file = {:?}
columns = {{ t = "t_s", x = "px_m", y = "py_m", z = "pz_m", qx = "qx", qy = "qy", qz = "qz", qw = "qw" }}
time_zero = {}
pose = {{}}
[loads]
gravity = [0, 0, -9.81]
damping = {{ stiffness = {damping} }}
[initial]
state = "equilibrium"
[time]
end = {}
step = {}
scheme = "generalised-alpha"
tolerance = 1e-8
"#,
            self.segments, file, self.time_zero, self.window[1], self.step
        )
    }

    /// Writes the scene of a take to the folder `work`, and returns the lines of the fit file that name it and its
    /// observation, whose table is `[[{prefix}observation]]`.
    fn experiment(&self, take: &str, prefix: &str, work: &Path) -> Result<String, Box<dyn Error>> {
        let scene = format!("{take}-scene.toml");
        std::fs::write(work.join(&scene), self.scene(take, 1e-3))?;
        let file = self.folder.join(format!("{take}.csv"));
        let [first, last] = self.window;
        Ok(format!(
            "scene = {scene:?}\n[[{prefix}observation]]\nfile = {file:?}\n{MOMENT}time_zero = {}\n\
             window = [{first}, {last}]\n",
            self.time_zero
        ))
    }

    /// The fit file of one take.
    pub fn fit_of(&self, take: &str, work: &Path) -> Result<String, Box<dyn Error>> {
        Ok(self.experiment(take, "", work)? + MODULUS + DAMPING + ANALYSIS)
    }

    /// The fit file of all takes: one modulus, and a damping of each take.
    pub fn joint_fit(&self, work: &Path) -> Result<String, Box<dyn Error>> {
        let mut text = String::new();
        for take in self.takes {
            let own = self.experiment(take, "experiment.", work)?;
            text +=
                &format!("[[experiment]]\nname = {take:?}\n{own}{DAMPING}experiment = {take:?}\n");
        }
        Ok(text + MODULUS + ANALYSIS)
    }
}
