//! Draws from the posterior distribution of a fit, as a table for programs that analyze them.
//!
//! [`PosteriorDraws`] has the values of all parameters, in their units, and the log posterior density of every draw, in
//! the order of the chains. `to_csv` writes a table with the columns `chain`, `draw`, one per parameter, and `lp`,
//! which pandas and ArviZ read.

use std::fmt::Write;

/// Draws from the posterior distribution.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PosteriorDraws {
    /// Names of the parameters, with their experiments where these are not all.
    pub names: Vec<String>,
    /// Draws of every chain, in their order.
    pub chains: Vec<Vec<PosteriorDraw>>,
}

/// A draw from the posterior distribution.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PosteriorDraw {
    /// Value of each parameter, in its unit.
    pub values: Vec<f64>,
    /// Logarithm of the posterior density by the unknowns on the scales of the fit (logarithms of positive
    /// parameters), up to a constant.
    pub log_density: f64,
}

impl PosteriorDraws {
    /// The draws as CSV: the columns `chain` and `draw` (numbers from 0), the parameters in their units with all
    /// digits, and `lp`, the log posterior density.
    pub fn to_csv(&self) -> String {
        let quoted = |name: &String| format!("\"{}\"", name.replace('"', "\"\""));
        let is_plain = |name: &&String| !name.contains([',', '"', '\n', '\r']);
        let column = |name| Some(name).filter(is_plain).map_or_else(|| quoted(name), String::clone);
        let names: Vec<String> = self.names.iter().map(column).collect();
        let mut text = format!("chain,draw,{},lp\n", names.join(","));
        for (chain, draws) in self.chains.iter().enumerate() {
            for (number, draw) in draws.iter().enumerate() {
                let values: String =
                    draw.values.iter().map(|value| format!("{value:e},")).collect();
                // Writing to a string does not fail.
                let _ = writeln!(text, "{chain},{number},{values}{:e}", draw.log_density);
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A name with a comma is quoted, and numbers keep all digits.
    #[test]
    fn draws_as_csv_have_a_row_per_draw() {
        let draw = |x: f64| PosteriorDraw { values: vec![x, 0.1], log_density: -1.5 };
        let draws = PosteriorDraws {
            names: vec!["youngs_modulus".into(), "damping (a, b)".into()],
            chains: vec![vec![draw(1.0 / 3.0)], vec![draw(2e8)]],
        };
        let text = "chain,draw,youngs_modulus,\"damping (a, b)\",lp\n0,0,3.333333333333333e-1,1e-1,-1.5e0\n\
                    1,0,2e8,1e-1,-1.5e0\n";
        assert_eq!(draws.to_csv(), text);
    }
}
