//! Gain and delay of a signal are identified, together with the modulus.

use rodfit::Parameter;
use rodfit::scene::{PointForce, Signal, SignalKind};

use crate::common::fits::{fit_with, found, observe, same_mesh};
use crate::common::{at_tip, coarse};

#[test]
fn gain_and_delay_of_a_signal_are_identified() {
    let mut scene = coarse(20, 2e-3, 0.4);
    let signal = Some("tap".to_string());
    let tap = at_tip([0.0, 0.2, 0.0])
        .into_iter()
        .map(|load| PointForce { signal: signal.clone(), ..load });
    scene.loads.point = tap.collect();
    let pulse = Signal {
        kind: Some(SignalKind::Pulse),
        duration: Some(0.06),
        rise: Some(0.02),
        ..Signal::new("tap")
    };
    scene.signals = vec![Signal { gain: 1.7, delay: 0.0533, ..pulse.clone() }];
    let data = observe(&scene, 200);
    scene.signals = vec![Signal { gain: 1.0, delay: 0.04, ..pulse }];
    let [gain, delay]: [Parameter; 2] =
        ["signals.tap.gain", "signals.tap.delay"].map(|name| name.parse().unwrap());
    let report = fit_with(&scene, &data, &[Parameter::YoungsModulus, gain, delay], same_mesh());
    // The values with which the data are simulated, without noise.
    found(&report, &[(Parameter::YoungsModulus, 1e8), (gain, 1.7), (delay, 0.0533)], 1e-6);
}
