//! User-defined measurements: exact derivatives, fits together with built-in ones, and invalid points.

use rodfit::fit::{Gauge, GaugeContext, Observable};
use rodfit::scene::Stencil;
use rodfit::{Fit, Parameter, Point, Problem, Scalar};

use crate::calls::{refused, short};
use crate::runs::sum;

/// Heading of the tip in the xy plane, rad.
#[derive(Debug)]
struct TipAngle;

impl Observable for TipAngle {
    fn points(&self) -> Vec<Point> {
        vec![Point::ArcLength(0.47), Point::Tip]
    }
    fn show<D: Scalar>(&self, rod: &GaugeContext<D>) -> D {
        let [a, b] = [0, 1].map(|i| rod.points[i].position);
        (b[1] - a[1]).atan2(b[0] - a[0])
    }
}

/// Bending moment near the wall, N m, and a little of how fast the place moves.
#[derive(Debug)]
struct ClampMoment;

impl Observable for ClampMoment {
    fn points(&self) -> Vec<Point> {
        [0.02, 0.06, 0.1].map(Point::ArcLength).into()
    }
    fn show<D: Scalar>(&self, rod: &GaugeContext<D>) -> D {
        let [a, b, c] = [0, 1, 2].map(|i| rod.points[i].position);
        let heading = |p: [D; 3], q: [D; 3]| (q[1] - p[1]).atan2(q[0] - p[0]);
        let curvature = (heading(b, c) - heading(a, b)) / 0.04;
        let stiffness =
            rod.scene.material.youngs_modulus * rod.scene.rod.section.moments().second_moments[0];
        stiffness * curvature + rod.points[2].velocity[1] * (1e-3 * (1.0 + rod.time))
    }
}

/// A quantity of a simulated motion, as a gauge would show it.
fn shown(problem: &Problem, quantity: &impl Observable, time: f64) -> f64 {
    let run = problem.simulate().unwrap();
    let step = 1e-7;
    let moving = |point: &Point| {
        let at = |t: f64| run.at(*point, t).unwrap().0;
        let (position, after, before) = (at(time), at(time + step), at(time - step));
        let velocity = [0, 1, 2].map(|c| (after[c] - before[c]) / (2.0 * step));
        rodfit::fit::PointState { position, velocity }
    };
    let points: Vec<_> = quantity.points().iter().map(moving).collect();
    quantity.show(&GaugeContext { time, points: &points, scene: problem.scene() })
}

const TIMES: [f64; 5] = [0.013, 0.031, 0.052, 0.074, 0.095];

/// The tip's angle and the clamp's moment over time, and the angle at rest.
fn gauges(problem: &Problem) -> [Gauge; 3] {
    let angle = TIMES.map(|t| (t, shown(problem, &TipAngle, t)));
    let moment = TIMES.map(|t| (t, shown(problem, &ClampMoment, t)));
    let rest = problem.equilibrium().unwrap().nodes;
    let between =
        Stencil::between(&(0..13).map(|i| (f64::from(i) - 0.5) / 23.0).collect::<Vec<_>>(), 0.47);
    let a = between.nodes.iter().fold([0.0; 3], |s, (i, w)| sum(s, rest[*i].map(|x| w * x)));
    let angle_at_rest = (rest[12][1] - a[1]).atan2(rest[12][0] - a[0]);
    [
        Gauge::over_time("angle of the tip", "rad", TipAngle, &angle, 1e-3),
        Gauge::over_time("moment of the clamp", "N m", ClampMoment, &moment, 1e-5),
        Gauge::at_rest("angle at rest", "rad", TipAngle, &[angle_at_rest], 1e-3),
    ]
}

#[test]
fn derivatives_of_user_defined_measurement_are_exact() {
    let problem = short().problem().unwrap();
    let [angle, moment, rest] = gauges(&problem);
    let fit = Fit::new(&problem)
        .observe(angle)
        .observe(moment)
        .observe(rest)
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::Density);
    let residuals = fit.residuals().unwrap();
    let truth = [1e8_f64.ln(), 1273.52_f64.ln()];
    // The remaining error is that of the finite difference of the velocity.
    assert!(residuals.residuals(&truth).unwrap().iter().all(|r| r.abs() < 1e-3));
    let x = [truth[0] + 0.1, truth[1] - 0.05];
    let jacobian = residuals.jacobian_at(&x).unwrap();
    let hessian = residuals.hessian_at(&x).unwrap();
    let gradient = |x: &[f64]| {
        let (rows, r) = (residuals.jacobian_at(x).unwrap(), residuals.residuals(x).unwrap());
        [0, 1].map(|j| rows.iter().zip(&r).map(|(row, r)| row[j] * r).sum::<f64>())
    };
    let h = 1e-3;
    for j in 0..2 {
        let at = |k: f64| {
            let mut x = x;
            x[j] += k * h;
            x
        };
        let difference = |values: [f64; 4]| {
            let [a, b, c, d] = values;
            (8.0 * (a - b) - (c - d)) / (12.0 * h)
        };
        let points = [1.0, -1.0, 2.0, -2.0].map(at);
        let all = points.map(|x| residuals.residuals(&x).unwrap());
        for (i, row) in jacobian.iter().enumerate() {
            let by_difference = difference([0, 1, 2, 3].map(|p| all[p][i]));
            // Five-point differences in steps of `h`: truncation and rounding errors.
            assert!((row[j] - by_difference).abs() < 1e-6 * (1.0 + row[j].abs()), "row {i}, {j}");
        }
        let gradients = points.map(|x| gradient(&x));
        for i in 0..2 {
            let by_difference = difference([0, 1, 2, 3].map(|p| gradients[p][i]));
            let size = hessian[i][i].abs().max(hessian[j][j].abs());
            // As above, for the gradient.
            assert!((hessian[i][j] - by_difference).abs() < 1e-7 * size, "{i} {j}");
        }
    }
}

#[test]
fn user_defined_measurement_is_fitted_with_others() {
    let problem = short().problem().unwrap();
    let [angle, moment, rest] = gauges(&problem);
    let report = Fit::new(&problem)
        .observe(angle)
        .observe(moment)
        .observe(rest.held_out())
        .identify(Parameter::YoungsModulus)
        .keep_plot_data()
        .solve()
        .unwrap();
    let estimate = report.estimate(Parameter::YoungsModulus).unwrap();
    // The data are simulated with 1e8 Pa, without noise.
    assert!((estimate.value.unwrap() / 1e8 - 1.0).abs() < 1e-5, "{report}");
    assert_eq!(report.units, ["rad", "N m"]);
    let prediction = &report.predictions[0];
    assert_eq!(
        (prediction.observation.as_str(), prediction.unit.as_str()),
        ("angle at rest", "rad")
    );
    // Exact data: the right model predicts them.
    assert!(prediction.rms < 1e-6);
    let series = &report.plot_data.as_ref().unwrap().series;
    assert_eq!(
        series.iter().map(|s| s.label.as_str()).collect::<Vec<_>>(),
        ["angle of the tip", "moment of the clamp"]
    );
    let page = rodfit::page::fit_page(&report, "gauges");
    assert!(page.contains("moment of the clamp") && !page.contains("NaN"));

    let refuse = |gauge: Gauge| {
        refused(Fit::new(&problem).observe(gauge).identify(Parameter::Density).solve())
    };
    let late = refuse(Gauge::over_time("late", "rad", TipAngle, &[(0.05, 0.0), (0.2, 0.0)], 1.0));
    assert_eq!(late[..2], ["late", "t = 0.2 s"]);
    let back = [(0.02, 0.0), (0.03, 0.0), (0.01, 0.0)];
    let unordered = refuse(Gauge::over_time("back", "rad", TipAngle, &back, 1.0));
    assert_eq!(unordered[..2], ["back", "t = 0.01 s after 0.03 s"]);
    #[derive(Debug)]
    struct Beyond;
    impl Observable for Beyond {
        fn points(&self) -> Vec<Point> {
            vec![Point::ArcLength(0.6)]
        }
        fn show<D: Scalar>(&self, rod: &GaugeContext<D>) -> D {
            rod.points[0].position[0]
        }
    }
    assert_eq!(refuse(Gauge::at_rest("beyond", "m", Beyond, &[0.0; 3], 1.0))[0], "beyond: points");
    let nan = refuse(Gauge::at_rest("bad", "rad", TipAngle, &[0.0, f64::NAN], 1.0));
    assert_eq!(nan[..2], ["bad", "other readings"]);
    assert_eq!(
        refuse(Gauge::at_rest("exact", "rad", TipAngle, &[0.0; 2], 0.0))[0],
        "gauge[0].sigma"
    );
}
