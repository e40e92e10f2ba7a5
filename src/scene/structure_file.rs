//! Reading of the files of structures (TOML), and of the polylines and the recording that they name.
//!
//! [`StructureScene::load`] and [`StructureScene::from_toml`] parse a text, validate the scene, and read the points of
//! shapes and the recorded markers; paths are relative to the folder of the file. `read_without_recording` leaves out
//! the recording, which is to be replaced. Errors of `load` have the path; those of `from_toml` in the text itself name
//! no file. For a text that cannot be parsed they list the placeholders, or all required keys that are missing, or a
//! likely mistake.
//!
//! A text is that of a structure if it is valid TOML with a key `rods` at its root. [`StructureScene::files`] are the
//! file of the structure, if it has one, and then those that it names. [`StructureScene::follow`] replaces the file of
//! its recording by one relative to the working directory, and reads it; without `[recording]` it is an error.

use crate::error::{Error, GIVEN_AS_TEXT};
use crate::input::hints::{STRUCTURE, explained};
use crate::input::missing_keys::{Rule, always, has_key, if_there, parse};
use crate::scene::required::{section_keys, shape_keys};
use crate::scene::{Scheme, Shape, StructureRecording, StructureScene};
use std::path::{Path, PathBuf};

/// Required keys of every table of a structure.
const REQUIRED: [Rule; 10] = [
    always("rods[]", |_| &["name", "segments", "shape", "section", "material"]),
    if_there("rods[].shape", shape_keys),
    if_there("rods[].section", section_keys),
    if_there("materials[]", |_| &["name", "density", "youngs_modulus"]),
    if_there("bodies[]", |_| &["name", "mass", "inertia", "position"]),
    if_there("joints[]", |joint| match joint.get("kind").and_then(toml::Value::as_str) {
        Some("spring") => &["connects", "rotation"],
        _ => &["kind", "connects"],
    }),
    if_there("supports[]", |_| &["of", "kind"]),
    if_there("recording", |_| &["file"]),
    if_there("time", |_| &["end", "step"]),
    if_there("loads.point[]", |_| &["force"]),
];

impl StructureScene {
    /// Whether the text of a scene file is valid TOML with a key `rods` at its root, that of a structure. False for
    /// other texts.
    pub(crate) fn is_text_of(text: &str) -> bool {
        toml::from_str::<toml::Table>(text).is_ok_and(|table| table.contains_key("rods"))
    }

    /// Reads and validates the file of a structure, and reads the polylines and the recording that it names.
    ///
    /// # Errors
    /// A file that cannot be read or is not a structure, and values that are not allowed.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        Self::read(&marker_files::file::text(path)?, path)
    }

    /// Reads and validates the text of a structure, as [`load`](Self::load). Paths in it are relative to `folder`.
    /// Errors in the text itself name no file.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    ///
    /// ```
    /// let error = rodfit::StructureScene::from_toml("[[rods]]\nname = \"a\"", ".").unwrap_err().to_string();
    /// assert!(error.contains("rods[0].shape"), "{error}");
    /// ```
    pub fn from_toml(text: &str, folder: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read(text, &folder.as_ref().join(GIVEN_AS_TEXT))
    }

    /// Paths of the files of the structure: first its own, if it has one, then those of polylines and of the recording.
    /// Relative paths are below the folder of the structure. The files need not exist.
    pub fn files(&self) -> Vec<PathBuf> {
        let folder = self.path.as_deref().and_then(Path::parent).unwrap_or(Path::new(""));
        let shapes = self.rods.iter().filter_map(|rod| match &rod.shape {
            Shape::Polyline { file, .. } if !file.as_os_str().is_empty() => {
                Some(marker_files::file::at(folder, file))
            }
            _ => None,
        });
        let recordings = self.recording.iter().filter(|own| !own.file.as_os_str().is_empty());
        let recordings = recordings.map(|own| marker_files::file::at(folder, &own.file));
        self.path.iter().cloned().chain(shapes).chain(recordings).collect()
    }

    /// Reads and validates the text of the file of a structure with this path, and reads the polylines and the
    /// recording that it names. Errors have the path; a text that cannot be parsed lists missing keys, a likely
    /// mistake, or line and token.
    pub(crate) fn read(text: &str, path: &Path) -> Result<Self, Error> {
        let mut scene = Self::read_without_recording(text, path)?;
        let folder = path.parent().map(PathBuf::from).unwrap_or_default();
        if let Some(recording) = &mut scene.recording {
            recording.read(&folder, &scene.supports).map_err(|error| error.in_file(Some(path)))?;
        }
        Ok(scene)
    }

    /// As [`read`](Self::read), except that the recording is not read, as its file is to be replaced. Values at arc
    /// lengths that do not end with their rod are an error.
    pub(crate) fn read_without_recording(text: &str, path: &Path) -> Result<Self, Error> {
        let mut scene: Self = parse(text, &REQUIRED)
            .map_err(|error| explained(error, text, &STRUCTURE).in_file(Some(path)))?;
        scene.path = Some(path.into());
        if !(scene.contacts.is_empty() && scene.rod_contacts.is_empty())
            && let Some(time) = &mut scene.time
            && !["scheme", "beta"].into_iter().any(|key| has_key(text, "time", key))
        {
            time.scheme = Scheme::OF_CONTACTS;
        }
        scene.validate()?;
        let folder = path.parent().map(PathBuf::from).unwrap_or_default();
        for rod in &mut scene.rods {
            let read = rod.shape.read(&folder, false).and_then(|()| rod.check_ends_of_lists());
            read.map_err(|error| error.in_file(Some(path)))?;
        }
        Ok(scene)
    }

    /// Replaces the file of `[recording]` by `file`, relative to the working directory, and reads it. The structure is
    /// unchanged where that is an error.
    ///
    /// # Errors
    /// A structure without `[recording]`, a file that cannot be read, and markers that it does not have.
    pub fn follow(&mut self, file: impl AsRef<Path>) -> Result<(), Error> {
        let file = file.as_ref();
        let Some(recording) = &self.recording else {
            let allowed = "[recording] in the structure, whose file the recording replaces";
            return Err(Error::invalid("recording", "no such table", allowed));
        };
        let file = std::path::absolute(file).map_err(|source| Error::io(file, source))?;
        let mut followed = StructureRecording { file, track: None, ..recording.clone() };
        followed.read(Path::new(""), &self.supports)?;
        self.recording = Some(followed);
        Ok(())
    }
}
