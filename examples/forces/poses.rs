//! A rod held at both ends: static poses of both ends with the wrench at one, as a slow motion through all poses.
//!
//! Input: the table of the poses and wrenches, without times. Every pose is held for [`HOLD`] and reached within
//! [`MOVE`]; strong damping and implicit Euler steps keep the rod at rest. The source states neither the frame of the
//! wrench, nor its sign, nor modulus and diameter of the rod. Each [`Assumption`] is a sign; the frame is
//! taken parallel to that of the held start. Output: the text of a fit file, with its scene, clock and tables written
//! beside it. A free tare is an offset of the sensor common to all poses.

use std::error::Error;
use std::path::Path;

/// Duration of a pose, s.
const HOLD: f64 = 6.0;
/// Duration of the motion to the next pose, s.
const MOVE: f64 = 4.0;

/// An assumption about the wrench.
pub struct Assumption {
    /// Name of the fit.
    pub name: &'static str,
    /// Factor of the recorded wrench: 1 if it acts on the rod, -1 if the rod exerts it.
    pub sign: f64,
}

/// Both signs of the wrench.
pub const ASSUMPTIONS: [Assumption; 2] = [
    Assumption { name: "wrench on the rod", sign: 1.0 },
    Assumption { name: "wrench of the rod", sign: -1.0 },
];

/// Columns of the poses in the table: those of the start and of the end.
const POSES: [&str; 2] = ["start", "end"];
/// Numbers of a pose, in the order of the columns written here.
const POSE: [&str; 7] = ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"];
/// Components of the wrench in the table, N and N m.
const WRENCH: [&str; 6] = ["fx_N", "fy_N", "fz_N", "tx_Nm", "ty_Nm", "tz_Nm"];

/// The fit file of the poses and wrenches in `table`, under one assumption about the sensor. The scene and the tables
/// with a clock are written to the folder `work`.
pub fn fit(table: &Path, assumption: &Assumption, work: &Path) -> Result<String, Box<dyn Error>> {
    let text = std::fs::read_to_string(table).map_err(|e| format!("{}: {e}", table.display()))?;
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let column = |name: &str| {
        let found = header.iter().position(|own| *own == name);
        found.ok_or_else(|| format!("{}: no column {name}", table.display()))
    };
    let poses: Vec<usize> = POSES
        .iter()
        .flat_map(|end| POSE.map(|name| column(&format!("{end}_{name}"))))
        .collect::<Result<_, _>>()?;
    let wrench: Vec<usize> = WRENCH.map(column).into_iter().collect::<Result<_, _>>()?;
    let names = POSES.iter().flat_map(|end| {
        POSE.iter().map(move |name| format!("{end}_{}", name.trim_end_matches("_m")))
    });
    let mut grippers = format!("t,{}\n", names.collect::<Vec<_>>().join(","));
    let mut readings = String::from("t,fx,fy,fz,mx,my,mz\n");
    let mut start = 0.0;
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let own = |columns: &[usize]| -> String {
            columns
                .iter()
                .map(|c| cells.get(*c).copied().unwrap_or(""))
                .collect::<Vec<_>>()
                .join(",")
        };
        let pose = own(&poses);
        grippers += &format!("{start},{pose}\n{},{pose}\n", start + HOLD);
        readings += &(start + HOLD).to_string();
        for column in &wrench {
            let value: f64 = cells.get(*column).ok_or("a row is too short")?.parse()?;
            readings += &format!(",{}", assumption.sign * value);
        }
        readings.push('\n');
        start += HOLD + MOVE;
    }
    std::fs::write(work.join("grippers.csv"), grippers)?;
    std::fs::write(work.join("wrench.csv"), readings)?;
    std::fs::write(work.join("poses-scene.toml"), scene(start - MOVE))?;
    let mut text = String::from("scene = \"poses-scene.toml\"\n");
    for quantity in ["force", "moment"] {
        text += &format!(
            "[[observation]]\nquantity = {quantity:?}\nof = \"start\"\nfile = \"wrench.csv\"\n\
             axes = [\"z\", \"y\", \"-x\"]\ntare = \"free\"\n"
        );
    }
    text += "[[parameter]]\nname = \"youngs_modulus\"\n";
    // The residuals are as large as the readings: the discretization error is of no interest.
    Ok(text + "[analysis]\ndiscretization_error = \"none\"\n")
}

/// The scene of the rod between both grippers for this duration, s. The z axes of the grippers are along the rod.
/// Length and density are those of the source, radius and modulus one of several values there.
fn scene(duration: f64) -> String {
    let mut text = String::from(
        r#"[rod]
segments = 20
shape = { kind = "straight", length = 0.6, direction = [1, 0, 0] }
section = { kind = "circle", radius = 0.005 }
[material]
density = 1400
youngs_modulus = 1e7
poisson_ratio = 0.5
[supports]
start = "clamped"
end = "clamped"
"#,
    );
    for end in POSES {
        text += &format!(
            "[[supports.motion]]\nend = {end:?}\nfile = \"grippers.csv\"\npose = {{ axes = [\"z\", \"x\", \"y\"] }}\n"
        );
    }
    text + &format!(
        r#"[loads]
gravity = [0, 0, -9.81]
damping = {{ mass = 4.0, stiffness = 0.05 }}
[initial]
state = "equilibrium"
[time]
end = {duration}
step = 0.5
scheme = "newmark-beta"
beta = 1.0
tolerance = 1e-8
"#
    )
}
