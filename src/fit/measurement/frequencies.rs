//! Measured natural frequencies.

use crate::error::Error;
use crate::fit::measurement::loss::Loss;
use crate::vibration::{Among, ModeName};
use crate::vibration::{Kind, Plane};

/// A measured natural frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frequency {
    /// Which mode, from 1 on in the order of rising frequency, as `rodfit modes` numbers them.
    pub mode: usize,
    /// Angular frequency, rad/s.
    pub rad_s: f64,
}

/// Frequencies of small vibrations about the equilibrium.
#[derive(Clone, Debug)]
pub struct Frequencies {
    /// The frequencies, each of its mode.
    pub values: Vec<Frequency>,
    /// Among which modes they count: without a word among those in the plane of a planar scene,
    /// among all of a spatial one.
    pub among: Among,
    /// Standard deviation of each, rad/s.
    pub sigma: f64,
    /// Whether the frequencies were given in Hz; reports display them in Hz then.
    pub in_hz: bool,
    /// How residuals count.
    pub loss: Loss,
    /// Whether they are kept out of the fit and only predicted.
    pub held_out: bool,
}

impl Frequencies {
    /// The lowest frequencies, rad/s, in order, with the standard deviation of each.
    pub fn new(rad_s: &[f64], sigma: f64) -> Self {
        let number = |(k, rad_s): (usize, &f64)| Frequency { mode: k + 1, rad_s: *rad_s };
        Self {
            values: rad_s.iter().enumerate().map(number).collect(),
            among: Among::default(),
            sigma,
            in_hz: false,
            loss: Loss::Squares,
            held_out: false,
        }
    }

    /// Measured frequencies given in Hz.
    pub fn hz(hz: &[f64], sigma: f64) -> Self {
        let tau = std::f64::consts::TAU;
        let own = Self::new(&hz.iter().map(|f| f * tau).collect::<Vec<_>>(), sigma * tau);
        Self { in_hz: true, ..own }
    }

    /// Of other modes than the lowest.
    ///
    /// # Errors
    ///
    /// Another count of modes than of frequencies.
    pub fn of_modes(mut self, modes: &[usize]) -> Result<Self, Error> {
        if modes.len() != self.values.len() {
            let allowed = format!("{}, one per frequency", self.values.len());
            return Err(Error::invalid("modes", format!("{} modes", modes.len()), allowed));
        }
        self.values.iter_mut().zip(modes).for_each(|(value, mode)| value.mode = *mode);
        Ok(self)
    }

    /// Seen in or out of the plane of a planar scene.
    pub fn plane(self, plane: Plane) -> Self {
        Self { among: Among { plane: Some(plane), ..self.among }, ..self }
    }

    /// Of modes of one kind only, counted among themselves.
    pub fn of_kind(self, kind: Kind) -> Self {
        Self { among: Among { kind: Some(kind), ..self.among }, ..self }
    }

    /// Of modes only that move along this line, counted among themselves.
    pub fn along(self, direction: [f64; 3]) -> Self {
        Self { among: Among { direction: Some(direction), ..self.among }, ..self }
    }

    /// The names of the modes.
    pub(crate) fn names(&self) -> impl Iterator<Item = ModeName> {
        self.values.iter().map(|value| ModeName { number: value.mode, among: self.among })
    }

    /// With another loss than squares.
    pub fn loss(self, loss: Loss) -> Self {
        Self { loss, ..self }
    }

    /// Kept out of the fit, to be predicted by it.
    pub fn held_out(self) -> Self {
        Self { held_out: true, ..self }
    }
}
