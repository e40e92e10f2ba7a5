//! Suggestions for unknown names in messages: the most similar known names, or the parameter of a common symbol (`E`,
//! `rho`).
//!
//! [`nearest`] orders given names by the larger Jaro-Winkler similarity (crate strsim) of the unknown name to the whole
//! name or to its part behind the last dot. It returns the best three as text, the most similar first, separated by
//! commas. One of six symbols of textbooks (`SYMBOLS`) gives its parameter alone, whether or not that is in the list.
//! For a name longer than [`LONGEST_NAME`] bytes the text is `none`. Errors of unknown parameters end with it.

use crate::numerics::total_order;
use std::cmp::Reverse;
/// Pairs of a symbol of textbooks and the name of its parameter.
const SYMBOLS: [(&str, &str); 6] = [
    ("E", "youngs_modulus"),
    ("G", "shear_modulus"),
    ("L", "rod.shape.length"),
    ("nu", "material.poisson_ratio"),
    ("r", "rod.section.radius"),
    ("rho", "material.density"),
];
/// Longest name, in bytes, for which suggestions are searched.
pub const LONGEST_NAME: usize = 200;

/// The three of `names` (all of fewer) that are most similar to `name`, the most similar first, separated by commas.
/// The measure is the larger Jaro-Winkler similarity of `name` to the whole name or to its part behind the last dot; of
/// equal ones the order is that of `names`. For a symbol of a textbook (`E`, `rho`) it is the parameter of the symbol
/// alone, also if `names` lacks it. `none` for a name longer than [`LONGEST_NAME`].
pub fn nearest(name: &str, names: &[&str]) -> String {
    let likeness = |other: &str| {
        // Short names and last parts of paths are the most likely inputs.
        let end = other.rsplit_once('.').map_or(other, |(_, end)| end);
        strsim::jaro_winkler(name, other).max(strsim::jaro_winkler(name, end))
    };
    if name.len() > LONGEST_NAME {
        return "none".into();
    }
    if let Some((_, meant)) = SYMBOLS.iter().find(|(symbol, _)| *symbol == name) {
        return meant.to_string();
    }
    let mut names: Vec<(f64, &str)> = names.iter().map(|n| (likeness(n), *n)).collect();
    names.sort_by_cached_key(|x| Reverse(total_order(x.0)));
    let names: Vec<&str> = names.into_iter().take(3).map(|(_, name)| name).collect();
    names.join(", ")
}
