//! Files with columns of standard deviations: rows are weighted by their variances, and invalid columns are rejected.

use rodfit::fit::{FitFile, FitReport};
use rodfit::{Parameter, Point, Scene};
use std::fmt::Write;
use tempfile::TempDir;

use crate::common::coarse;
use crate::common::fits::{noisy, observe};

const ROWS: usize = 40;

/// Standard deviations of x and y in a row, mm: some are ten times as large.
fn sigmas(k: usize) -> [f64; 2] {
    let far = if k.is_multiple_of(3) { 10.0 } else { 1.0 };
    [0.5 * far, 0.25 * far + 0.01 * k as f64]
}

fn scene() -> Scene {
    coarse(8, 4e-3, 0.4)
}

/// A folder with a scene and a table of its tip, mm, with these columns behind the places.
fn folder(columns: &str, of: impl Fn(usize) -> Vec<f64>) -> TempDir {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("scene.toml"), scene().to_toml().unwrap()).unwrap();
    let (clean, noise) = (observe(&scene(), ROWS), noisy(&observe(&scene(), ROWS), 1e-3, 5));
    let mut table = format!("t,x[mm],y[mm]{columns}\n");
    for (k, (clean, noise)) in clean.samples.iter().zip(&noise.samples).enumerate() {
        let place = |c: usize| {
            let clean = clean.position[c].unwrap();
            1e3 * clean + sigmas(k)[c] * 1e3 * (noise.position[c].unwrap() - clean)
        };
        let _ = write!(table, "{},{},{}", clean.time, place(0), place(1));
        of(k).iter().for_each(|sigma| write!(table, ",{sigma}").unwrap());
        table.push('\n');
    }
    std::fs::write(folder.path().join("tip.csv"), table).unwrap();
    folder
}

/// A fit file whose observation has these additional keys.
fn load(folder: &TempDir, said: &str) -> Result<FitFile, rodfit::Error> {
    let text = format!(
        "scene = \"scene.toml\"\n[[observation]]\nfile = \"tip.csv\"\n{said}\n[[parameter]]\nname = \"youngs_modulus\"\n\
         start = 1e8\n[analysis]\ndiscretization_error = \"none\"\nwhat_if = false\ntolerance = 0\n"
    );
    FitFile::from_toml(&text, folder.path())
}

fn solve(folder: &TempDir, said: &str) -> FitReport {
    load(folder, said).unwrap().fit().solve().unwrap()
}

/// A number and a column of equal values give the same result to the last bit.
#[test]
fn sigma_column_of_one_value_equals_a_number() {
    let folder = folder(",sd,sx[m]", |_| vec![2.0, 2e-3]);
    let json = |said: &str| {
        let mut report = solve(&folder, said);
        report.wall_seconds = 0.0;
        serde_json::to_string(&report).unwrap()
    };
    let columns = "sigma = { x = \"sx\", y = \"SD\" }";
    // The table has columns that the number does not name.
    let bare = std::fs::read_to_string(folder.path().join("tip.csv")).unwrap();
    let both = json(columns);
    let bare: Vec<String> =
        bare.lines().map(|line| line.split(',').take(3).collect::<Vec<_>>().join(",")).collect();
    std::fs::write(folder.path().join("tip.csv"), bare.join("\n")).unwrap();
    assert_eq!(json("sigma = 2e-3"), both);
}

/// The estimate minimizes the sum of squares over the variances, and its error is that of weighted least squares.
#[test]
fn row_sigmas_weight_their_rows() {
    let folder = folder(",sx,sy", |k| sigmas(k).to_vec());
    let report = solve(&folder, "sigma = { x = \"sx\", y = \"sy\" }");
    let file = load(&folder, "sigma = { x = \"sx\", y = \"sy\" }").unwrap();
    let observation = file.experiments[0].measurements[0].motion().unwrap();
    let weighed = |report: &FitReport| {
        let problem = scene().problem().unwrap().with(report.parameters()).unwrap();
        let run = problem.simulate_with(&[Parameter::YoungsModulus]).unwrap();
        let (mut slope, mut square) = (0.0, 0.0);
        for (k, sample) in observation.samples.iter().enumerate() {
            let (place, by) = run.at(Point::Tip, sample.time).unwrap();
            for c in 0..2 {
                let weight = (1e-3 * sigmas(k)[c]).powi(-2);
                slope += weight * (place[c] - sample.position[c].unwrap()) * by[0][c];
                square += weight * by[0][c].powi(2);
            }
        }
        [slope / square, square.sqrt().recip()]
    };
    let [off, error] = weighed(&report);
    let found = report.estimate(Parameter::YoungsModulus).unwrap();
    // The gradient of the weighted sum of squares vanishes at the estimate.
    assert!(off.abs() < 1e-5 * error, "{off:e} of {error:e}");
    // Weighted least squares: the inverse root of the sum of squared weighted sensitivities.
    assert!((found.std_error.unwrap() / error - 1.0).abs() < 1e-6, "{found:?}");
    // The modulus of the simulation, within four standard errors.
    assert!((found.value.unwrap() - 1e8).abs() < 4.0 * error);
    // With equal weights the estimate is another one, with a larger error.
    let bare = self::folder(",sx", |k| vec![sigmas(k)[0]]);
    let alike = solve(&bare, "sigma = \"sx\"");
    assert!(weighed(&alike)[0].abs() > 1e-2 * error);
}

#[test]
fn invalid_sigma_columns_are_rejected_with_their_lines() {
    let value = |bad: f64| move |k: usize| vec![if k == 6 { bad } else { 1.0 }];
    for (folder, said, words) in [
        (folder(",sd", value(-1.0)), "sigma = \"sd\"", &["tip.csv:8", "`sd`", "-1", "above 0"][..]),
        (folder(",sd", value(0.0)), "sigma = \"sd\"", &["tip.csv:8", "`sd`", "above 0"]),
        (folder(",sd", value(f64::NAN)), "sigma = \"sd\"", &["tip.csv:8", "`sd`", "blank"]),
        (folder(",sd", value(f64::INFINITY)), "sigma = \"sd\"", &["tip.csv:8", "`sd`", "inf"]),
        (folder(",sd", value(1.0)), "sigma = \"noise\"", &["tip.csv:1", "`sd`"]),
        (folder("", |_| vec![]), "sigma = \"sd\"", &["tip.csv:1", "no column `sd`"]),
        (folder("", |_| vec![]), "sigma = \"x\"", &["tip.csv:1", "`x`"]),
        (folder(",sd", value(1.0)), "sigma = { x = \"sd\" }", &["tip.csv:1", "for y"]),
        (folder(",sd[s]", value(1.0)), "sigma = \"sd\"", &["tip.csv:1", "unit [s]"]),
        (folder(",sd", value(1.0)), "sigma = { q = \"sd\" }", &["sigma", "name of a column"]),
        (folder(",sd", value(1.0)), "sigma = [1]", &["sigma", "name of a column"]),
    ] {
        let error = load(&folder, said).map(|_| ()).unwrap_err().to_string();
        for word in words {
            assert!(error.contains(word), "`{word}` in: {error}");
        }
    }
    // Rows from before the motion need none.
    let late = folder(",sd", |k| vec![if k < 3 { f64::NAN } else { 1.0 }]);
    assert!(load(&late, "sigma = \"sd\"\ntime_zero = 0.035").is_ok());
}

/// A photographed droop, point by point.
#[test]
fn shape_sigma_columns_are_read() {
    let folder = folder("", |_| vec![]);
    let write = |name: &str, table: &str| std::fs::write(folder.path().join(name), table).unwrap();
    write("droop.csv", "s,x,y,sd[mm]\n0.25,,-0.03,1\n0.5,0.47,-0.1,3\n");
    write("bare.csv", "s,x,y\n0.25,,-0.03\n0.5,0.47,-0.1\n");
    let text = "scene = \"scene.toml\"\n[[shape]]\nfile = \"droop.csv\"\nsigma = \"sd\"\n\
                [[parameter]]\nname = \"youngs_modulus\"\n";
    let rows = |text: &str| {
        let fit = FitFile::from_toml(text, folder.path()).unwrap().fit();
        fit.residuals().unwrap().jacobian_at(&[1e8_f64.ln()]).unwrap()
    };
    let (own, plain) = (rows(text), rows(&text.replace("\"sd\"", "1e-3").replace("droop", "bare")));
    for (k, ratio) in [(0, 1.0), (1, 3.0), (2, 3.0)] {
        // Rows of the Jacobian are divided by their sigmas, of which the ratios are 1, 3 and 3.
        assert!((plain[k][0] / own[k][0] / ratio - 1.0).abs() < 1e-12, "{own:?} {plain:?}");
    }
}
