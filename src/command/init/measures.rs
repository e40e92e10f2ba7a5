//! Measures of the person's own rod in the scene of a template.

use clap::ValueEnum;
use rodfit::Error;

/// Places in the templates that are replaced.
const LENGTH: &str = "length = 0.5";
const DENSITY: &str = "density = ";
const SECTION: &str = "section = {";
/// What templates write before the numbers that are only examples.
const EXAMPLE: &str = "# measure";
/// Sizes of a rectangle and a tube in a template if the person gives none: a plastic ruler and a drinking straw, m.
const WIDTH: f64 = 0.02;
const HEIGHT: f64 = 0.002;
const RADIUS: f64 = 0.005;
const THICKNESS: f64 = 0.0005;

/// The rod that the person has.
#[derive(clap::Args)]
pub struct Measures {
    /// Cross-section of the rod; without it that of the given sizes, or a circle.
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

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SectionKind {
    /// A full circle.
    Circle,
    /// A rectangle.
    Rectangle,
    /// A hollow circle.
    Tube,
}

impl Measures {
    /// The scene of a template with the given measures; with `is_planar` the rod bends in the x-y plane.
    pub fn applied(&self, scene: &str, is_planar: bool) -> Result<String, Error> {
        self.check(is_planar)?;
        let lines = scene.lines().map(|line| self.line(line) + "\n");
        Ok(lines.collect())
    }

    fn line(&self, line: &str) -> String {
        if let (Some(length), true) = (self.length, line.contains(LENGTH)) {
            return measured(&line.replacen(LENGTH, &format!("length = {length:?}"), 1));
        }
        if let (Some(density), true) = (self.density, line.starts_with(DENSITY)) {
            let comment = line.find('#').map_or("", |start| &line[start..]);
            return measured(&format!("{:<28}{comment}", format!("{DENSITY}{density:?}")));
        }
        if let (Some(kind), true) = (self.kind(), line.starts_with(SECTION)) {
            return self.section_line(kind, line);
        }
        line.into()
    }

    /// The kind of section that is asked for, if any is.
    fn kind(&self) -> Option<SectionKind> {
        self.section.or(match () {
            () if self.width.or(self.height).is_some() => Some(SectionKind::Rectangle),
            () if self.thickness.is_some() => Some(SectionKind::Tube),
            () if self.radius.is_some() => Some(SectionKind::Circle),
            () => None,
        })
    }

    fn section_line(&self, kind: SectionKind, line: &str) -> String {
        let radius = self.radius.unwrap_or(RADIUS);
        let (section, sizes): (_, &[Option<f64>]) = match kind {
            SectionKind::Circle => {
                (format!("kind = \"circle\", radius = {radius:?}"), &[self.radius])
            }
            SectionKind::Tube => {
                let thickness = self.thickness.unwrap_or(THICKNESS);
                let text =
                    format!("kind = \"tube\", radius = {radius:?}, thickness = {thickness:?}");
                (text, &[self.radius, self.thickness])
            }
            SectionKind::Rectangle => {
                let (width, height) = (self.width.unwrap_or(WIDTH), self.height.unwrap_or(HEIGHT));
                let text = format!(
                    "kind = \"rectangle\", width = {width:?}, height = {height:?}, up = [0, 1, 0]"
                );
                (text, &[self.width, self.height])
            }
        };
        let comment = line.find('#').map_or("", |start| &line[start..]);
        let new = format!("section = {{ {section} }}   {comment}");
        if sizes.iter().all(Option::is_some) { measured(&new) } else { new }
    }

    fn check(&self, is_planar: bool) -> Result<(), Error> {
        let sizes = [
            ("--length", self.length),
            ("--radius", self.radius),
            ("--thickness", self.thickness),
            ("--width", self.width),
            ("--height", self.height),
            ("--density", self.density),
        ];
        for (option, size) in sizes {
            if let Some(size) = size.filter(|size| !(size.is_finite() && *size > 0.0)) {
                return Err(refused(option, size.to_string(), "a number above 0"));
            }
        }
        let others: &[&str] = match self.kind() {
            Some(SectionKind::Rectangle) => &["--radius", "--thickness"],
            Some(SectionKind::Tube) => &["--width", "--height"],
            Some(SectionKind::Circle) | None => &["--width", "--height", "--thickness"],
        };
        let is_other =
            |(option, size): &&(&str, Option<f64>)| size.is_some() && others.contains(option);
        if let Some((option, size)) = sizes.iter().find(is_other) {
            let found = format!("{} and another section", size.unwrap_or_default());
            return Err(refused(option, found, "the dimensions of one section"));
        }
        if self.kind() == Some(SectionKind::Rectangle) && !is_planar {
            let allowed = "circle or tube for a rod in space; write `up` of a rectangle into the scene by hand";
            return Err(refused("--section", "rectangle".into(), allowed));
        }
        Ok(())
    }
}

/// A line whose number is no example any more.
fn measured(line: &str) -> String {
    match line.find(EXAMPLE) {
        Some(start) => {
            let rest = line[start + EXAMPLE.len()..].trim_start_matches([':', ',']);
            format!("{}#{rest}", &line[..start])
        }
        None => line.into(),
    }
}

fn refused(key: &str, found: String, allowed: &str) -> Error {
    Error::Invalid { file: None, key: key.into(), found, allowed: allowed.into() }
}
