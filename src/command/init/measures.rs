//! Options of `rodfit init` for the user's rod: cross-section, length and density, written into the scene of a
//! template.
//!
//! The scene text is edited line by line: a given measure (m, kg/m^3) replaces the template's value. The mark of the
//! value as an example (`# measure` in its comment) is then removed. A section without `--section` follows from its
//! sizes; missing sizes have defaults, and the mark stays unless all are given. Measures without an option keep the
//! template's value and its mark, which shows the user what is still to be measured. The length of the cable is that
//! between its markers: `--length` is an error. So are sizes that are not positive, sizes of different sections, and a
//! rectangle for a spatial rod.

use clap::ValueEnum;
use rodfit::Error;

/// Text of the length in the templates, m, which `--length` replaces.
const LENGTH: &str = "length = 0.5";
/// Start of the line with the density in the templates, kg/m^3.
const DENSITY: &str = "density = ";
/// Start of the line with the cross-section in the templates.
const SECTION: &str = "section = {";
/// Start of the comment that marks a value of a template as an example to be measured by the user.
const EXAMPLE: &str = "# measure";
/// Width of a rectangle without `--width`, that of a plastic ruler, m.
const WIDTH: f64 = 0.02;
/// Height of a rectangle without `--height`, m.
const HEIGHT: f64 = 0.002;
/// Radius of a circle, or outer radius of a tube, without `--radius`: that of a drinking straw, m.
const RADIUS: f64 = 0.005;
/// Wall thickness of a tube without `--thickness`, m.
const THICKNESS: f64 = 0.0005;

/// Options for the rod of the user.
#[derive(clap::Args)]
pub struct Measures {
    /// Cross-section of the rod; default: the one with the given sizes, else a circle.
    #[arg(long)]
    section: Option<SectionKind>,
    /// Length of the rod from the wall to the tip, m.
    #[arg(long, value_name = "M")]
    length: Option<f64>,
    /// Radius of a circle, or outer radius of a tube, m.
    #[arg(long, value_name = "M")]
    radius: Option<f64>,
    /// Wall thickness of a tube, m.
    #[arg(long, value_name = "M")]
    thickness: Option<f64>,
    /// Width of a rectangle, across the plane in which it bends, m.
    #[arg(long, value_name = "M")]
    width: Option<f64>,
    /// Height of a rectangle, in the plane in which it bends, m.
    #[arg(long, value_name = "M")]
    height: Option<f64>,
    /// Density of the material, kg/m^3.
    #[arg(long, value_name = "KG_M3")]
    density: Option<f64>,
}

/// Kind of cross-section.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SectionKind {
    /// A full circle.
    Circle,
    /// A rectangle.
    Rectangle,
    /// A hollow circle.
    Tube,
}

/// A size option: its name, as `--length`, and its value if given, m (density: kg/m^3).
struct SizeOption {
    name: &'static str,
    value: Option<f64>,
}

impl Measures {
    /// The text of a template's `scene` with the given measures in place of its values. `is_planar`: the rod bends in
    /// the x-y plane, which a rectangle needs. Sizes that are not positive, sizes of different sections, and a length
    /// for a scene without one are errors.
    pub fn apply(&self, scene: &str, is_planar: bool) -> Result<String, Error> {
        self.check(is_planar)?;
        if let Some(length) = self.length.filter(|_| !scene.contains(LENGTH)) {
            let allowed = "no such option for a cable, whose length is that between its markers";
            return Err(Error::invalid("--length", length, allowed));
        }
        Ok(scene.lines().map(|line| self.line(line) + "\n").collect())
    }

    /// A line of the scene with the given length, density or section in it, without the mark of an example if it is
    /// given whole. Unchanged if it has no such value, or none is given.
    fn line(&self, line: &str) -> String {
        // Templates mark examples in comments; a value of the user loses this mark.
        if let (Some(length), true) = (self.length, line.contains(LENGTH)) {
            return measured(&line.replacen(LENGTH, &format!("length = {length:?}"), 1));
        }
        if let (Some(density), true) = (self.density, line.starts_with(DENSITY)) {
            let text = format!("{DENSITY}{density:?}");
            return measured(&format!("{text:<28}{}", comment(line)));
        }
        if let (Some(kind), true) = (self.kind(), line.starts_with(SECTION)) {
            return self.section_line(kind, line);
        }
        line.into()
    }

    /// The section of `--section`, else the one that the given sizes imply: a rectangle (width or height), a tube
    /// (thickness), or a circle (radius alone). `None` without both.
    fn kind(&self) -> Option<SectionKind> {
        // Width and height are those of a rectangle, a thickness that of a tube; a radius alone is that of a circle.
        let of_sizes = [
            (self.width.or(self.height), SectionKind::Rectangle),
            (self.thickness, SectionKind::Tube),
            (self.radius, SectionKind::Circle),
        ];
        let given = of_sizes.into_iter().find(|(size, _)| size.is_some());
        self.section.or(given.map(|(_, kind)| kind))
    }

    /// The line of the cross-section of this `kind` with the given sizes, and defaults for the others, with the comment
    /// of `line`. Its comment still marks an example unless all sizes are given.
    fn section_line(&self, kind: SectionKind, line: &str) -> String {
        let size = |given: Option<f64>, default: f64| given.unwrap_or(default);
        let radius = size(self.radius, RADIUS);
        let (section, is_given) = match kind {
            SectionKind::Circle => {
                (format!("kind = \"circle\", radius = {radius:?}"), self.radius.is_some())
            }
            SectionKind::Tube => {
                let thickness = size(self.thickness, THICKNESS);
                let text =
                    format!("kind = \"tube\", radius = {radius:?}, thickness = {thickness:?}");
                (text, self.radius.and(self.thickness).is_some())
            }
            SectionKind::Rectangle => {
                let (width, height) = (size(self.width, WIDTH), size(self.height, HEIGHT));
                let text = format!(
                    "kind = \"rectangle\", width = {width:?}, height = {height:?}, up = [0, 1, 0]"
                );
                (text, self.width.and(self.height).is_some())
            }
        };
        let new = format!("section = {{ {section} }}   {}", comment(line));
        if is_given { measured(&new) } else { new }
    }

    /// Rejects sizes and a density that are not finite and positive, and sizes of another section than that of
    /// [`kind`](Self::kind). A rectangle for a rod that is not planar is rejected too. The first error has the name of
    /// its option.
    fn check(&self, is_planar: bool) -> Result<(), Error> {
        let option = |name, value| SizeOption { name, value };
        let options = [
            option("--length", self.length),
            option("--radius", self.radius),
            option("--thickness", self.thickness),
            option("--width", self.width),
            option("--height", self.height),
            option("--density", self.density),
        ];
        // Sizes of another section would be ignored silently.
        let excluded: &[&str] = match self.kind() {
            Some(SectionKind::Rectangle) => &["--radius", "--thickness"],
            Some(SectionKind::Tube) => &["--width", "--height"],
            Some(SectionKind::Circle) | None => &["--width", "--height", "--thickness"],
        };
        let given = || options.iter().filter_map(|option| Some((option.name, option.value?)));
        if let Some((name, size)) = given().find(|(_, size)| !(size.is_finite() && *size > 0.0)) {
            return Err(Error::invalid(name, size, "a number above 0"));
        }
        if let Some((name, size)) = given().find(|(name, _)| excluded.contains(name)) {
            let found = format!("{size} and another section");
            return Err(Error::invalid(name, found, "the dimensions of one section"));
        }
        if self.kind() == Some(SectionKind::Rectangle) && !is_planar {
            let allowed = "circle or tube for a rod in space; write `up` of a rectangle into the scene by hand";
            return Err(Error::invalid("--section", "rectangle", allowed));
        }
        Ok(())
    }
}

/// The part of a line from its first `#`; empty without one.
fn comment(line: &str) -> &str {
    line.find('#').map_or("", |start| &line[start..])
}

/// A line without the mark [`EXAMPLE`] in its comment; the rest of the comment is kept. Unchanged without the mark.
fn measured(line: &str) -> String {
    match line.split_once(EXAMPLE) {
        Some((text, rest)) => format!("{text}#{}", rest.trim_start_matches([':', ','])),
        None => line.into(),
    }
}
