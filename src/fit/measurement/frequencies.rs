//! Measured natural frequencies of small vibrations about the equilibrium, assigned to modes.
//!
//! Input: angular frequencies, rad/s (or Hz, converted), with one standard deviation in the same unit. Each belongs to
//! the mode with a number up to [`MOST_MODES`], counted from 1 in rising frequency among the modes of a filter (plane,
//! kind, direction). By default these are modes 1, 2 and so on, in the plane of a planar scene or all of a spatial one.
//! `of_modes` sets the numbers; `plane`, `of_kind` and `along` set the filters. Simulated frequencies of bending modes
//! include shear deformation and rotary inertia on request (`timoshenko`). `names` are those of the modes. Output:
//! [`Frequencies`], a data set whose differences in a fit are simulated less measured angular frequency, rad/s.
//! Frequencies that are not above 0, frequencies that fall with the mode number, repeated modes, another number of
//! modes than frequencies, and filters that the scene does not allow (a structure allows none) are errors.

use crate::error::{Error, ensure};
use crate::fit::measurement::dataset::{
    Abscissa, DataKind, DataUnit, Dataset, Header, ValidationContext,
};
use crate::fit::measurement::quantity::GaugeScalar;
use crate::fit::measurement::simulated::{Requirements, SimulatedOutput};
use crate::fit::structure::structure_frequencies::check_names;
use crate::problem::Problem;
use crate::vibration::{ModeFilter, ModeKind, ModeName, ModePlane};

/// Largest accepted mode number; higher ones are rejected before a simulation.
const MOST_MODES: usize = 200;

/// Smallest ratio of a frequency to that of a lower mode. A larger one rejects noisy frequencies of close modes.
const LEAST_RISE: f64 = 0.9;

/// A measured natural frequency with the number of its mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frequency {
    /// Number of the mode, from 1 on in the order of rising frequency, as `rodfit modes` numbers them.
    pub mode: usize,
    /// Angular frequency, rad/s.
    pub rad_s: f64,
}

/// Natural frequencies of small vibrations about the equilibrium, with their modes.
#[derive(Clone, Debug)]
pub struct ModeFrequencies {
    /// The frequencies with their mode numbers.
    pub values: Vec<Frequency>,
    /// The modes among which the numbers count; default: those in the plane of a planar scene, all of a spatial one.
    pub among: ModeFilter,
    /// Whether the frequencies of bending modes include shear deformation and rotary inertia; default: those of a
    /// slender rod.
    pub timoshenko: bool,
    /// Whether the mode numbers are assumed (1, 2 and so on), not given.
    pub are_modes_assumed: bool,
}

/// Measured natural frequencies, rad/s, with their header.
pub type Frequencies = Dataset<ModeFrequencies>;

impl Frequencies {
    /// The lowest natural frequencies of a rod, rad/s, in rising order, as those of modes 1, 2 and so on, with the
    /// standard deviation of each, rad/s.
    pub fn new(rad_s: &[f64], sigma: f64) -> Self {
        let number = |(k, rad_s): (usize, &f64)| Frequency { mode: k + 1, rad_s: *rad_s };
        let values = rad_s.iter().enumerate().map(number).collect();
        let data = ModeFrequencies {
            values,
            among: ModeFilter::default(),
            timoshenko: false,
            are_modes_assumed: true,
        };
        Self { header: Header::with_sigma("rad/s", sigma), data }
    }

    /// The lowest natural frequencies of a rod given in Hz, in rising order, with the standard deviation of each in Hz.
    /// They are converted to rad/s; reports display Hz.
    ///
    /// ```
    /// use rodfit::fit::Frequencies;
    /// let measured = Frequencies::hz(&[4.21, 26.3], 0.02); // Hz
    /// assert_eq!(measured.values(), 2);
    /// ```
    pub fn hz(hz: &[f64], sigma: f64) -> Self {
        let tau = std::f64::consts::TAU;
        let mut own = Self::new(&hz.iter().map(|f| f * tau).collect::<Vec<_>>(), sigma * tau);
        own.header.data_unit = Some(DataUnit::HERTZ);
        own
    }

    /// The frequencies with these mode numbers (from 1) instead of those of the lowest modes.
    ///
    /// # Errors
    ///
    /// Another count of modes than of frequencies.
    pub fn of_modes(mut self, modes: &[usize]) -> Result<Self, Error> {
        let (count, found) = (self.values.len(), format!("{} modes", modes.len()));
        let allowed = format!("{count}, one per frequency");
        ensure(modes.len() == count, "modes", found, allowed)?;
        self.values.iter_mut().zip(modes).for_each(|(value, mode)| value.mode = *mode);
        self.are_modes_assumed = false;
        Ok(self)
    }

    /// The frequencies with mode numbers that count only the modes in or out of the plane of a planar scene, besides
    /// other filters that are set. Without this filter those in the plane count.
    pub fn plane(mut self, plane: ModePlane) -> Self {
        self.among.plane = Some(plane);
        self
    }

    /// The frequencies with mode numbers that count only the modes of one kind, besides other filters that are set.
    pub fn of_kind(mut self, kind: ModeKind) -> Self {
        self.among.kind = Some(kind);
        self
    }

    /// The frequencies of bending modes as those of Timoshenko's beam, with shear deformation and rotary inertia. The
    /// scene must have Poisson's ratio or a shear modulus, which is checked with the fit.
    pub fn timoshenko(mut self) -> Self {
        self.timoshenko = true;
        self
    }

    /// The frequencies with mode numbers that count only the modes with most of their motion along a direction in world
    /// axes, besides other filters that are set.
    pub fn along(mut self, direction: [f64; 3]) -> Self {
        self.among.direction = Some(direction);
        self
    }
}

impl ModeFrequencies {
    /// The name of the mode of every frequency, in their order: number and filter.
    pub(crate) fn names(&self) -> impl Iterator<Item = ModeName> {
        let Self { among, timoshenko, .. } = *self;
        self.values.iter().map(move |f| ModeName { number: f.mode, among, timoshenko })
    }
}

impl ModeFrequencies {
    /// Rejects a frequency below [`LEAST_RISE`] of that of a lower mode: modes are numbered in rising frequency, and
    /// noise reverses only frequencies close to each other. `key` is that of the table in the fit file.
    fn check_order(&self, key: &str) -> Result<(), Error> {
        let mut rising = self.values.clone();
        rising.sort_by_key(|value| value.mode);
        let mut highest: Option<Frequency> = None;
        for value in rising {
            if let Some(lower) = highest.filter(|lower| value.rad_s < LEAST_RISE * lower.rad_s) {
                let hertz = |value: Frequency| value.rad_s / std::f64::consts::TAU;
                let (own, other) = (hertz(value), hertz(lower));
                let found = format!(
                    "{own:.4} Hz as mode {} below {other:.4} Hz as mode {}",
                    value.mode, lower.mode
                );
                let allowed =
                    "frequencies that rise with the mode number; modes assigns the numbers";
                return Err(Error::invalid(format!("{key}.modes"), found, allowed));
            }
            highest = highest.filter(|lower| lower.rad_s > value.rad_s).or(Some(value));
        }
        Ok(())
    }
}

impl DataKind for ModeFrequencies {
    /// Name of the table of this kind of data in a fit file: `frequencies`.
    fn table(&self) -> &'static str {
        "frequencies"
    }

    /// A name for messages: `the frequencies` and the filter of the modes.
    fn label(&self, _header: &Header) -> String {
        format!("the frequencies{}", self.among.words())
    }

    /// The abscissa of plots: the mode number.
    fn abscissa(&self) -> Abscissa {
        Abscissa::Mode
    }

    /// The mode number of every frequency, in the order of the frequencies.
    fn abscissas(&self, _problem: &Problem) -> Vec<f64> {
        self.values.iter().map(|f| f.mode as f64).collect()
    }

    /// Name of the axis of frequencies in reports: `f`. Never `None`.
    fn axis(&self) -> Option<&'static str> {
        Some("f")
    }

    /// The measured angular frequencies, rad/s, in their order.
    fn scalars(&self) -> Vec<f64> {
        self.values.iter().map(|f| f.rad_s).collect()
    }

    /// Mutable references to the measured angular frequencies, rad/s, in their order.
    fn scalars_mut(&mut self) -> Vec<&mut f64> {
        self.values.iter_mut().map(|f| &mut f.rad_s).collect()
    }

    /// Mean of the measured angular frequencies, rad/s; zero without any.
    fn size(&self, _problem: &Problem) -> f64 {
        self.scalars().iter().sum::<f64>() / self.values.len().max(1) as f64
    }

    /// Rejects frequencies that are not finite and above 0, mode numbers outside of 1 to `MOST_MODES` or given twice,
    /// and filters that the problem does not allow. Errors have the key in the fit file.
    fn check(&self, _header: &Header, context: &ValidationContext) -> Result<(), Error> {
        let ValidationContext { problem, key, .. } = context;
        // Filters are defined for the modes of one rod. Those of a structure are all in its plane.
        match problem.scene().structure {
            Some(_) => check_names(&self.names().collect::<Vec<_>>(), key)?,
            None => ModeName { number: 1, among: self.among, timoshenko: self.timoshenko }
                .check(problem, key)?,
        }
        for (k, value) in self.values.iter().enumerate() {
            let is_valid = value.rad_s.is_finite() && value.rad_s > 0.0;
            ensure(is_valid, format!("{key}.rad_s[{k}]"), value.rad_s, "above 0")?;
            // Two frequencies of one mode would be compared with one simulated frequency.
            let twice = self.values[..k].iter().any(|before| before.mode == value.mode);
            let is_valid = (1..=MOST_MODES).contains(&value.mode) && !twice;
            let allowed = format!("1 .. {MOST_MODES}, each once");
            ensure(is_valid, format!("{key}.modes[{k}]"), value.mode, allowed)?;
        }
        self.check_order(key)
    }

    /// Adds the modes (number and filter) whose frequencies are measured to the required `outputs`.
    fn require(&self, outputs: &mut Requirements) {
        outputs.modes.extend(self.names());
    }

    /// Calls `each` with simulated less measured angular frequency, rad/s, in the order of the values; `simulated` has
    /// those of the same modes in the same order. There are no errors.
    fn differences<D: GaugeScalar>(
        &self,
        simulated: &SimulatedOutput<D>,
        each: &mut dyn FnMut(D),
    ) -> Result<(), Error> {
        for (value, frequency) in self.values.iter().zip(simulated.frequencies) {
            each(*frequency - D::from(value.rad_s));
        }
        Ok(())
    }
}
