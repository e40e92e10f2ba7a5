//! The true rod of the independent solver: its numbers, and cross-section area, bending stiffness and mass from them.

use std::f64::consts::PI;

/// All numbers of the true rod, in SI units.
#[derive(Clone, Debug)]
pub struct Cantilever {
    pub length: f64,
    /// At the clamp.
    pub radius: f64,
    /// Radius of the tip over that of the clamp; linear between them.
    pub taper: f64,
    pub density: f64,
    pub modulus: f64,
    /// Factor on the modulus in the first quarter.
    pub grip: f64,
    pub tip_mass: f64,
    /// Rotational compliance of the clamp, rad/(N m).
    pub compliance: f64,
    /// Mass damping, 1/s.
    pub damping: f64,
    /// Drag across the rod, kg/m^2.
    pub drag: f64,
    /// Turning angle of the stress-free rod from clamp to tip, rad, at constant curvature.
    pub arc: f64,
    /// Angle of the clamp, rad.
    pub tilt: f64,
    pub gravity: f64,
}

impl Cantilever {
    /// Area of the circular cross-section at arc length `s`, m^2.
    pub fn area(&self, s: f64) -> f64 {
        let radius = self.radius * (1.0 + (self.taper - 1.0) * s / self.length);
        PI * radius * radius
    }

    /// Bending stiffness EI at arc length `s`, N m^2.
    pub fn stiffness(&self, s: f64) -> f64 {
        let grip = if s < 0.25 * self.length { self.grip } else { 1.0 };
        let area = self.area(s);
        grip * self.modulus * area * area / (4.0 * PI)
    }

    /// Mass without the tip mass, kg.
    pub fn mass(&self) -> f64 {
        let t = self.taper;
        self.density * self.area(0.0) * self.length * (1.0 + t + t * t) / 3.0
    }
}
