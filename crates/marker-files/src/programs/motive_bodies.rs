//! Reader of the rigid bodies in CSV exports of OptiTrack Motive: position and rotation of every body at every frame.
//!
//! Input: the bytes of an export with columns of the type Rigid Body, with the properties Rotation and Position. The
//! setting `Rotation Type` of the first line is `Quaternion` (columns X, Y, Z, W) or the order of Euler angles, as
//! `XYZ` (columns X, Y, Z, in degrees). Euler angles are those about the axes of the body, one after the other, in the
//! stated order (relative, right-handed): R = R_x R_y R_z for XYZ. Output ([`RecordedBodies`]): times, s, and the poses
//! of the bodies, positions in m and quaternions from the axes of the body to those of the world; a frame in which all
//! numbers of a body are blank is `None`. Markers and errors of bodies are skipped.
//!
//! Errors, with the line: no rigid body, a body without all of its columns, a rotation type other than these, local
//! coordinates, a pose that is blank in part, times that do not increase, and no row.

use crate::error::Error;
use crate::marker_file::{FieldLine, LengthUnit, is_same_name};
use crate::programs::motive::MotiveExport;
use std::collections::HashMap;
use std::path::Path;

/// Position and rotation of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedBodyPose {
    /// Position of the pivot of the body, m.
    pub position: [f64; 3],
    /// Quaternion `[w, x, y, z]` of the rotation from the axes of the body to those of the world, as in the file; its
    /// length is not checked.
    pub quaternion: [f64; 4],
}

/// Poses of a rigid body in all frames.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedBody {
    /// Name of the body.
    pub name: String,
    /// Pose at every frame; `None` where the body was not tracked.
    pub poses: Vec<Option<RecordedBodyPose>>,
}

/// The rigid bodies of a file, and the times of the frames.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedBodies {
    /// Line of every frame in the file, counted from 1.
    pub lines: Vec<u64>,
    /// Time of every frame, s, increasing.
    pub times: Vec<f64>,
    /// The bodies in the order of the file.
    pub bodies: Vec<RecordedBody>,
}

impl RecordedBodies {
    /// The body with a name, ignoring case, or the only one without a name. The error is a message with all names.
    pub fn select(&self, name: Option<&str>) -> Result<&RecordedBody, String> {
        let names: Vec<&str> = self.bodies.iter().map(|body| &body.name[..]).collect();
        let names = names.join(", ");
        match (name, &self.bodies[..]) {
            (Some(name), bodies) => {
                let found = bodies.iter().find(|body| is_same_name(&body.name, name));
                found.ok_or_else(|| {
                    format!("found no rigid body `{name}`, allowed: one of the names {names}")
                })
            }
            (None, [body]) => Ok(body),
            (None, _) => Err(format!(
                "found several rigid bodies, allowed: the key body with one of the names {names}"
            )),
        }
    }
}

/// Form of the rotations in a file.
#[derive(Clone, Copy)]
enum RotationType {
    Quaternion,
    /// Axes (0 to 2) in the order of the Euler angles.
    Euler([usize; 3]),
}

impl RotationType {
    /// The form with this name, `Quaternion` or the order of three different axes as `XYZ`; `None` for another text.
    fn named(name: &str) -> Option<Self> {
        if name.eq_ignore_ascii_case("Quaternion") {
            return Some(Self::Quaternion);
        }
        let axes = name.split_whitespace().next()?.as_bytes();
        let axis = |letter: u8| b"XYZ".iter().position(|own| own.eq_ignore_ascii_case(&letter));
        let [a, b, c] = *axes else { return None };
        let order = [axis(a)?, axis(b)?, axis(c)?];
        (order[0] != order[1] && order[1] != order[2] && order[0] != order[2])
            .then_some(Self::Euler(order))
    }

    /// Number of columns of a rotation.
    fn width(self) -> usize {
        match self {
            Self::Quaternion => 4,
            Self::Euler(_) => 3,
        }
    }

    /// The quaternion `[w, x, y, z]` of the numbers in the columns X, Y, Z and W.
    fn quaternion(self, [x, y, z, w]: [f64; 4]) -> [f64; 4] {
        let Self::Euler(order) = self else { return [w, x, y, z] };
        // Rotations about the axes of the body, one after the other, are multiplied from the right.
        order.into_iter().fold([1.0, 0.0, 0.0, 0.0], |before, axis| {
            let (sine, cosine) = (0.5 * [x, y, z][axis].to_radians()).sin_cos();
            let mut about = [cosine, 0.0, 0.0, 0.0];
            about[axis + 1] = sine;
            product(before, about)
        })
    }
}

/// Product of two quaternions `[w, x, y, z]`.
fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// Columns of a body in a file: of the rotation in the order X, Y, Z, W, and of the position.
#[derive(Default)]
struct BodyColumns {
    name: String,
    rotation: [Option<usize>; 4],
    position: [Option<usize>; 3],
}

impl BodyColumns {
    /// The pose in a row, with positions times `unit`, m; `None` if all numbers are blank. An error for a pose that is
    /// blank in part.
    fn pose(
        &self,
        export: &MotiveExport,
        row: &FieldLine,
        rotation: RotationType,
        unit: f64,
    ) -> Result<Option<RecordedBodyPose>, Error> {
        let (mut numbers, mut blank) = ([0.0; 7], 0);
        let columns = self.rotation.iter().chain(&self.position).enumerate();
        let mut all = 0;
        for (k, column) in columns.filter_map(|(k, column)| Some((k, (*column)?))) {
            all += 1;
            match export.lines.number(row, column, &self.name)? {
                Some(number) => numbers[k] = number,
                None => blank += 1,
            }
        }
        if blank == all {
            return Ok(None);
        }
        if blank > 0 {
            let message = format!(
                "found a pose of `{}` with {blank} of {all} numbers blank, allowed: all of its numbers, or none",
                self.name
            );
            return Err(export.lines.error(row.number, message));
        }
        let [x, y, z, w, position @ ..] = numbers;
        let position = position.map(|coordinate| coordinate * unit);
        Ok(Some(RecordedBodyPose { position, quaternion: rotation.quaternion([x, y, z, w]) }))
    }
}

/// Reads the bytes of an export of Motive into the poses of its rigid bodies; `path` is for messages.
///
/// # Errors
///
/// A file that is no export of Motive or has no rigid body, and lines that cannot be used.
///
/// ```
/// let text = "Format Version,1.23,Rotation Type,Quaternion,Length Units,Millimeters\n\n\
///     ,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body\n\
///     ,Name,hand,hand,hand,hand,hand,hand,hand\n,ID,1,1,1,1,1,1,1\n\
///     ,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position\n\
///     Frame,Time (Seconds),X,Y,Z,W,X,Y,Z\n0,0.0,0,0,0,1,250,0,0\n1,0.01,0,0,0,1,251,0,0\n";
/// let found = marker_files::read_bodies("take.csv".as_ref(), text.as_bytes())?;
/// assert_eq!(found.select(Some("hand")).unwrap().poses[1].unwrap().position[0], 0.251);
/// # Ok::<(), marker_files::Error>(())
/// ```
pub fn read_bodies(path: &Path, bytes: &[u8]) -> Result<RecordedBodies, Error> {
    let export = MotiveExport::open(path, bytes)?;
    let stated = export.setting("Rotation Type").unwrap_or("Quaternion");
    let Some(rotation) = RotationType::named(stated) else {
        let found = format!("Rotation Type `{stated}`");
        return export.lines.rejected(1, &found, "Quaternion, or an order of angles such as XYZ");
    };
    let space = export.setting("Coordinate Space").unwrap_or("Global");
    if !space.eq_ignore_ascii_case("Global") {
        return export.lines.rejected(1, &format!("Coordinate Space `{space}`"), "Global");
    }
    let (LengthUnit::Known(_, unit), header) = (export.lengths, export.columns()) else {
        return export.lines.rejected(1, "no unit of length", "Millimeters, Centimeters or Meters");
    };
    let mut bodies: Vec<BodyColumns> = Vec::new();
    let mut indices = HashMap::new();
    for column in 2..header.len() {
        let [kind, name, property] = export.column(column);
        let axis = ["X", "Y", "Z", "W"].iter().position(|own| *own == header.field(column));
        let (true, Some(axis)) = (kind == "Rigid Body", axis) else { continue };
        let body = *indices.entry(name.to_string()).or_insert_with(|| {
            bodies.push(BodyColumns { name: name.into(), ..BodyColumns::default() });
            bodies.len() - 1
        });
        let slot = match property {
            "Rotation" => bodies[body].rotation.get_mut(axis),
            "Position" => bodies[body].position.get_mut(axis),
            _ => None,
        };
        if slot.is_some_and(|slot| slot.replace(column).is_some()) {
            let message = format!("found two columns of one coordinate of `{name}`, allowed: one");
            return Err(export.lines.error(header.number, message));
        }
    }
    if bodies.is_empty() {
        let remedy = "columns of rigid bodies. Export the file with `Rigid Bodies` switched on";
        return export.without("Rigid Body", remedy);
    }
    let is_whole = |body: &BodyColumns| {
        let own = body.rotation.map(|column| column.is_some());
        let stated = std::array::from_fn(|k| k < rotation.width());
        own == stated && body.position.iter().all(Option::is_some)
    };
    if let Some(body) = bodies.iter().find(|body| !is_whole(body)) {
        let found = format!("the rigid body `{}` without all of its columns", body.name);
        let allowed = format!("Rotation ({stated}) and Position");
        return export.lines.rejected(header.number, &found, &allowed);
    }
    let (mut lines, mut times) = (Vec::new(), Vec::<f64>::new());
    let mut poses: Vec<Vec<Option<RecordedBodyPose>>> = vec![Vec::new(); bodies.len()];
    for row in export.rows() {
        if row.len() < header.len() || row.fields().skip(header.len()).any(|f| !f.is_empty()) {
            let message =
                format!("found {} fields, allowed: {} as in the header", row.len(), header.len());
            return Err(export.lines.error(row.number, message));
        }
        let time = export.time(row)?;
        if let Some(before) = times.last().filter(|before| **before >= time) {
            let message =
                format!("found the time {time} after {before}, allowed: increasing values");
            return Err(export.lines.error(row.number, message));
        }
        for (body, poses) in bodies.iter().zip(&mut poses) {
            poses.push(body.pose(&export, row, rotation, unit)?);
        }
        lines.push(row.number);
        times.push(time);
    }
    if times.is_empty() {
        let message = "found no row below the header, allowed: at least one";
        return Err(export.lines.error(header.number, message));
    }
    let bodies = bodies.into_iter().zip(poses);
    let bodies = bodies.map(|(body, poses)| RecordedBody { name: body.name, poses }).collect();
    Ok(RecordedBodies { lines, times, bodies })
}
