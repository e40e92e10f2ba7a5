//! The option `--known NAME=SIGMA`: adds inputs with a standard uncertainty (GUM: type B) to a fit file.
//!
//! NAME is a number of the scene, as `rod.section.radius` or by its short name; SIGMA is the standard uncertainty in
//! its unit. The fit then gives expanded intervals with the contribution of these inputs. Texts of another form and
//! unknown names are errors. `rodfit fit` and `rodfit design` have the option.

use rodfit::Error;
use rodfit::fit::{FitFile, Known};

/// Appends the inputs of all `NAME=SIGMA` texts to those of a fit file. A text without `=`, an unknown name or a sigma
/// that is no number is an error.
pub fn add_known_inputs(file: &mut FitFile, texts: &[String]) -> Result<(), Error> {
    for text in texts {
        file.knowns.push(known_input(text)?);
    }
    Ok(())
}

/// An input with its standard uncertainty in its unit, from the text `NAME=SIGMA`. Without `=`, with an unknown name or
/// a sigma that is no number it is an error.
fn known_input(text: &str) -> Result<Known, Error> {
    let invalid = || Error::invalid("--known", text, "NAME=SIGMA, as in rod.section.radius=5e-5");
    let (name, sigma) = text.split_once('=').ok_or_else(invalid)?;
    let sigma = sigma.trim().parse().map_err(|_| invalid())?;
    Ok(Known::new(name.trim().parse()?, sigma))
}
