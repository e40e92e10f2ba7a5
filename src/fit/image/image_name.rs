//! Names of pictures: one file, or a pattern with the number of a frame.
//!
//! A pattern has one placeholder: `{}`, `{:N}` (padded to N characters with blanks) or `{:0N}` (with zeros). Input: the
//! text of the key. Output: [`ImageName`], and with a number the name of a file. Other braces, and widths of more than
//! [`WIDEST`] characters, are errors with a message.

/// Largest width of a number in a name, characters: that of the largest integers.
const WIDEST: usize = 20;

/// The name of a picture, or the pattern of the names of several.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ImageName {
    /// One picture.
    Single(String),
    /// A picture for each frame.
    Numbered {
        before: String,
        after: String,
        /// Least number of characters of the number.
        width: usize,
        /// Whether it is padded with zeros rather than with blanks.
        has_zeros: bool,
    },
}

impl ImageName {
    /// The name with the text of the key. An error for an empty text, for braces without a valid width, and for more
    /// than one placeholder: the allowed texts.
    pub fn new(text: &str) -> Result<Self, String> {
        let allowed = || {
            format!(
                "the name of a picture, with one {{}}, {{:N}} or {{:0N}} for the number of the frame, N up to {WIDEST}"
            )
        };
        let Some((before, rest)) = text.split_once('{') else {
            return match text.is_empty() || text.contains('}') {
                true => Err(allowed()),
                false => Ok(Self::Single(text.into())),
            };
        };
        let (inside, after) = rest.split_once('}').ok_or_else(allowed)?;
        if before.contains('}') || after.contains(['{', '}']) {
            return Err(allowed());
        }
        let digits = match inside.strip_prefix(':') {
            Some(digits) if !digits.is_empty() => digits,
            None if inside.is_empty() => "0",
            _ => return Err(allowed()),
        };
        let is_number = digits.bytes().all(|b| b.is_ascii_digit());
        let width: Option<usize> = digits.parse().ok().filter(|width| *width <= WIDEST);
        let width = width.filter(|_| is_number).ok_or_else(allowed)?;
        let has_zeros = digits.starts_with('0');
        Ok(Self::Numbered { before: before.into(), after: after.into(), width, has_zeros })
    }

    /// The name of the file of the frame with this number; of a single picture its own.
    pub fn of_frame(&self, number: i64) -> String {
        match self {
            Self::Single(name) => name.clone(),
            Self::Numbered { before, after, width, has_zeros: true } => {
                format!("{before}{number:0width$}{after}")
            }
            Self::Numbered { before, after, width, has_zeros: false } => {
                format!("{before}{number:width$}{after}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn number_of_a_frame_takes_the_place_of_the_braces() {
        for (pattern, number, name) in [
            ("frame_{:04}.png", 37, "frame_0037.png"),
            ("frame_{:04}.png", 12345, "frame_12345.png"),
            ("{}.jpg", 0, "0.jpg"),
            ("video{:3}/f.png", 7, "video  7/f.png"),
            ("photo.jpg", 5, "photo.jpg"),
            ("%04d.png", 5, "%04d.png"),
        ] {
            assert_eq!(ImageName::new(pattern).unwrap().of_frame(number), name, "{pattern}");
        }
        for wrong in [
            "",
            "{",
            "}",
            "a}b",
            "{}{}",
            "{:}",
            "{:x}",
            "{:-3}",
            "{4}",
            "{:99}",
            "{:0999999999999999999999}",
        ] {
            let allowed = ImageName::new(wrong).unwrap_err();
            assert!(allowed.contains("{:0N}"), "{wrong}");
        }
    }
}
