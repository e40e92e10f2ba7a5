//! A reading of a gauge or of a sensor (value, and time in s, none at rest), and the typical size of a list of readings
//! ([`spread_or_size`]). The latter is their root mean square about their mean, in their unit. A single reading,
//! readings at rest, and readings that are all equal have the magnitude of their mean; an empty list has zero.

/// A reading of a gauge or of a sensor: a value, with its time in a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Time from the start of the motion, s; none of a rod at rest under the loads of the scene.
    pub time: Option<f64>,
    /// Value of the quantity, in its unit.
    pub value: f64,
}

/// Root mean square of readings about their mean, in their unit; the magnitude of their mean for a single reading, for
/// readings at rest, which repeat one value, and for readings that are all equal; zero without readings.
pub(crate) fn spread_or_size(readings: &[Reading]) -> f64 {
    let values = || readings.iter().map(|r| r.value);
    let n = readings.len().max(1) as f64;
    let mean = values().sum::<f64>() / n;
    let spread = (values().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
    // The spread of readings at rest is noise. Equal readings have none; their size is the value.
    let is_at_rest = readings.iter().all(|reading| reading.time.is_none());
    if spread > 0.0 && !is_at_rest { spread } else { mean.abs() }
}
