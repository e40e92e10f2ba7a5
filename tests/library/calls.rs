//! Calls of the library with invalid arguments are errors, in any order of calls; fits and results can be sent to threads.

use rodfit::fit::{Frequencies, Sample};
use rodfit::scene::{Scene, Stencil};
use rodfit::{Error, Fit, Observation, Parameter, Point, Trajectory};

use crate::common::coarse;
use crate::common::fits::record;

/// The cantilever with few edges for a short time.
pub fn short() -> Scene {
    coarse(12, 2e-3, 0.1)
}

/// Key, found value and allowed values of a rejected input or of a number out of range. Panics for a success and for any
/// other error.
pub fn refused<T>(result: Result<T, Error>) -> [String; 3] {
    match result {
        Err(Error::Invalid { key, found, allowed, .. }) => [key, found, allowed],
        Err(Error::OutOfRange { what, found, low, high }) => {
            [what.into(), found.to_string(), format!("{low} .. {high}")]
        }
        Err(other) => panic!("another error: {other}"),
        Ok(_) => panic!("accepted"),
    }
}

/// Fits, problems and reports can be shared between threads, and a fit can be solved in another thread.
#[test]
fn fit_and_its_result_are_send_and_sync() {
    fn is_send<T: Send>() {}
    fn is_shared<T: Send + Sync>() {}
    is_shared::<Fit>();
    is_shared::<rodfit::Problem>();
    is_shared::<rodfit::FitReport>();
    is_send::<rodfit::fit::Residuals>();
    let problem = short().problem().unwrap();
    let data = crate::common::fits::record(&problem.simulate().unwrap(), 10);
    let fit = Fit::new(&problem).observe(data).identify(Parameter::YoungsModulus);
    let fit = fit.on_progress(|_, _| ());
    let report = std::thread::spawn(move || fit.solve()).join().unwrap().unwrap();
    assert!(report.converged, "{report}");
}

#[test]
fn vector_of_another_length_is_rejected() {
    let problem = short().problem().unwrap();
    let run = problem.simulate().unwrap();
    let fit = Fit::new(&problem)
        .observe(record(&run, 10).sigma(1e-3))
        .identify(Parameter::YoungsModulus)
        .identify(Parameter::Density);
    let residuals = fit.residuals().unwrap();
    for x in [&[][..], &[18.0], &[18.0, 7.0, 1.0]] {
        let found = format!("{} numbers", x.len());
        let expected = ["x".to_string(), found, "2 numbers, one for each unknown".into()];
        assert_eq!(refused(residuals.residuals(x)), expected);
        assert_eq!(refused(residuals.jacobian_at(x)), expected);
        assert_eq!(refused(residuals.hessian_at(x)), expected);
        let x = x.to_vec();
        assert!(argmin::core::CostFunction::cost(&residuals, &x).is_err());
        assert!(argmin::core::Gradient::gradient(&residuals, &x).is_err());
    }
    // Logarithms: 18 is a modulus of 6.6e7 Pa, and 1e5 overflows.
    for x in [[f64::NAN, 7.0], [1e5, 7.0], [f64::NEG_INFINITY, 7.0]] {
        assert!(residuals.residuals(&x).is_err());
        assert!(residuals.hessian_at(&x).is_err());
    }
    assert_eq!(residuals.residuals(&[1e8_f64.ln(), 1273.52_f64.ln()]).unwrap().len(), 20);
}

#[test]
fn trajectory_contains_one_run_of_its_problem() {
    let problem = short().problem().unwrap();
    let steps = problem.time().unwrap().steps();
    let none = |_: &dyn rodfit::Snapshot| {};
    let mut run = Trajectory::new(&problem, &[12], &[]).unwrap();
    let before = refused(run.at(Point::Tip, 0.0));
    assert_eq!(before, ["trajectory", "no record", "a trajectory that has run"]);
    let other = problem.with([(Parameter::YoungsModulus, 2e8)]).unwrap();
    assert_eq!(refused(run.run(&other, steps, none))[0], "problem");
    assert_eq!(refused(run.run(&problem, steps + 1, none))[..2], ["steps", "51"]);
    run.run(&problem, steps, none).unwrap();
    assert_eq!(
        refused(run.run(&problem, steps, none))[..2],
        ["trajectory", "a record of 51 times"]
    );
    assert_eq!(run.times().len(), 51);
    // Between the samples of a node that was not tracked there is nothing to read.
    assert_eq!(refused(run.at(Point::Node(3), 0.0))[0], "a node that was not tracked");
    assert!(
        run.at(Point::ArcLength(f64::NAN), 0.0).is_err() && run.at(Point::Tip, f64::NAN).is_err()
    );
}

#[test]
fn order_of_tracked_nodes_does_not_change_the_run() {
    let problem = short().problem().unwrap();
    // 12 edges have the nodes 0 to 12.
    let outside = refused(Trajectory::new(&problem, &[3, 13], &[]).map(|_| ()));
    assert_eq!(outside, ["node", "13", "0 .. 12"]);
    let parameters = [Parameter::YoungsModulus];
    let of = |tracked: &[usize]| {
        let mut run = Trajectory::new(&problem, tracked, &parameters).unwrap();
        run.run(&problem, 50, |_| {}).unwrap();
        run
    };
    let (mixed, sorted) = (of(&[12, 5, 7, 5]), of(&[5, 7, 12]));
    for node in [5, 7, 12] {
        let read = |run: &Trajectory| run.at(Point::Node(node), 0.0731).unwrap();
        assert_eq!(read(&mixed), read(&sorted));
    }
    let rest = |tracked: &[usize]| Trajectory::at_rest(&problem, tracked, &[]).unwrap();
    assert_eq!(rest(&[12, 5]).node(5, 0), rest(&[5, 12]).node(5, 0));
    assert!(Trajectory::at_rest(&problem, &[13], &[]).is_err());
}

#[test]
fn invalid_call_is_rejected() {
    let problem = short().problem().unwrap();
    let modes = refused(Frequencies::hz(&[1.0, 2.0], 0.1).of_modes(&[1]).map(|_| ()));
    assert_eq!(modes, ["modes", "1 modes", "2, one per frequency"]);
    assert_eq!(refused(Fit::of([]).identify(Parameter::Density).solve())[0], "observation");
    let nothing = Fit::new(&problem).identify(Parameter::YoungsModulus);
    assert_eq!(refused(nothing.solve())[0], "observation");
    assert_eq!(refused(nothing.residuals().map(|_| ()))[0], "observation");
    let nan =
        Observation::new(vec![Sample { time: f64::NAN, position: [Some(0.1), None, None] }; 5]);
    assert!(Fit::new(&problem).observe(nan).identify(Parameter::Density).solve().is_err());
    assert!(problem.with([(Parameter::YoungsModulus, f64::NAN)]).is_err());
    assert!(problem.with([(Parameter::Radius, -1.0)]).is_err());
    assert!(problem.stencil(Point::Node(usize::MAX)).is_err());
    // Without nodes there is nothing to interpolate; with one node it is that node.
    assert_eq!(Stencil::<f64>::between(&[], 0.1).nodes, []);
    assert_eq!(Stencil::between(&[0.2], 0.1).nodes, [(0, 1.0)]);
    assert!(problem.modes(0, Default::default()).is_ok_and(|modes| modes.modes.is_empty()));
}
