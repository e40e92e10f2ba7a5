//! The numbers of a scene: what may be differentiated by, identified, and given an error.
//!
//! A physical number is declared once, in the `over` of its table: the key it stands under and its
//! [`Quantity`], that is unit, scale, limits and where to search for it. Its name is its place in the
//! file, `loads.point.0.force.y`. From that one line follow reading and changing a number by its name,
//! the list of what a scene has, and the scene over dual numbers.

use serde::Serialize;
use serde::de::DeserializeOwned;
use std::f64::consts::PI;

/// What the numbers of a scene that is read from a file or written to one can do.
pub trait Written: Copy + Serialize + DeserializeOwned + Default + From<f64> + PartialEq {
    /// Whether it is zero, as it is without the key.
    fn is_nothing(&self) -> bool {
        *self == Self::default()
    }
}
impl Written for f64 {}

/// What kind of number stands somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// Empty for pure numbers.
    pub unit: &'static str,
    /// Smallest and largest value it may take at all.
    pub limits: [f64; 2],
    /// Whether it is positive and identified in its logarithm.
    pub is_positive: bool,
    /// Whether it is positive or zero, where it stands for something that may not be there.
    pub may_vanish: bool,
    /// Whether only the recording depends on it, and not the motion.
    pub is_of_the_camera: bool,
    /// Where to look for it when nothing is known of it.
    pub candidates: Candidates,
}

/// Where to look for a number when nothing is known of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Candidates {
    /// Where the scene has it: it was set up by eye, or is a detail.
    Here,
    /// From the first to the second, in so many values a decade.
    Decades(f64, f64, f64),
    /// These values and no others.
    Values(&'static [f64]),
    /// These values over the rod's length.
    PerLength(&'static [f64]),
    /// From the first to the second part of the rod's length, in so many values a decade.
    OfLength(f64, f64, f64),
    /// From the first part of Young's modulus to it, in so many values a decade.
    OfYoungsModulus(f64, f64),
    /// A rate, 1/s: from the first over the record's length to the second over its first swing.
    Rate(f64, f64, f64),
    /// A time, s: from the first to the second part of the record's first swing.
    Time(f64, f64, f64),
}

impl Quantity {
    /// A positive number, searched for from the scene's.
    pub const fn positive(unit: &'static str) -> Self {
        Self {
            unit,
            limits: [f64::MIN_POSITIVE, f64::MAX],
            is_positive: true,
            may_vanish: false,
            is_of_the_camera: false,
            candidates: Candidates::Here,
        }
    }

    /// A number of either sign, searched for from the scene's.
    pub const fn signed(unit: &'static str) -> Self {
        Self { limits: [-1e12, 1e12], is_positive: false, ..Self::positive(unit) }
    }

    /// An angle in rad, up to half a turn.
    pub const ANGLE: Self = Self::signed("rad").within(-PI, PI);

    /// The same quantity with limits.
    pub const fn within(self, low: f64, high: f64) -> Self {
        Self { limits: [low, high], ..self }
    }

    /// With another place to search.
    pub const fn searched(self, candidates: Candidates) -> Self {
        Self { candidates, ..self }
    }

    /// That may be zero.
    pub const fn vanishing(self) -> Self {
        Self { may_vanish: true, ..self }
    }

    /// Of the camera only.
    pub const fn of_the_camera(self) -> Self {
        Self { is_of_the_camera: true, ..self }
    }
}

/// The path of a number in its file, `loads.point.0.force.y`. It is no part of [`Numbers`], so that it is compiled once for all
/// types of numbers and tables.
#[derive(Default)]
struct NumberPath(String);

impl NumberPath {
    /// Appends a key, and returns the length before it.
    #[inline(never)]
    fn push(&mut self, key: &str) -> usize {
        let outside = self.0.len();
        if outside > 0 {
            self.0.push('.');
        }
        self.0.push_str(key);
        outside
    }

    #[inline(never)]
    fn truncate(&mut self, length: usize) {
        self.0.truncate(length);
    }
}

/// A walk through the numbers of a scene, which makes a `D` of each.
pub struct Numbers<'a, D> {
    path: NumberPath,
    make: &'a mut dyn FnMut(&str, f64, Quantity) -> D,
}

impl<'a, D> Numbers<'a, D> {
    /// A walk that makes numbers of their names, values and quantities.
    pub fn new(make: &'a mut dyn FnMut(&str, f64, Quantity) -> D) -> Self {
        Self { path: NumberPath::default(), make }
    }

    /// The number under a key.
    pub fn number(&mut self, key: &str, value: f64, quantity: Quantity) -> D {
        let outside = self.path.push(key);
        let number = (self.make)(&self.path.0, value, quantity);
        self.path.truncate(outside);
        number
    }

    /// The number under a key, if it is there.
    pub fn maybe(&mut self, key: &str, value: Option<f64>, quantity: Quantity) -> Option<D> {
        value.map(|value| self.number(key, value, quantity))
    }

    /// The three components under a key.
    pub fn vector(&mut self, key: &str, [x, y, z]: [f64; 3], quantity: Quantity) -> [D; 3] {
        self.table(key, |n| {
            [("x", x), ("y", y), ("z", z)].map(|(axis, value)| n.number(axis, value, quantity))
        })
    }

    /// The numbers of a table.
    pub fn table<T>(&mut self, key: &str, inside: impl FnOnce(&mut Self) -> T) -> T {
        let outside = self.path.push(key);
        let found = inside(self);
        self.path.truncate(outside);
        found
    }

    /// Every entry of a list of tables.
    pub fn list<T, U>(
        &mut self,
        key: &str,
        entries: &[T],
        mut entry: impl FnMut(&T, &mut Self) -> U,
    ) -> Vec<U> {
        self.table(key, |n| {
            let each = |(i, e): (usize, &T)| n.table(&i.to_string(), |n| entry(e, n));
            entries.iter().enumerate().map(each).collect()
        })
    }
}
