//! Reading and writing of scene files (TOML), and reading of the files of shapes, recordings and signals that they
//! name.
//!
//! [`Scene::load`] parses a file, validates the scene and reads polylines, recordings and samples of signals; paths are
//! relative to the folder of the file. A `time.end` that is left out becomes the end of the recording `supports.path`.
//! Errors have the path; for a text that cannot be parsed they list missing keys or a likely mistake.
//! [`Scene::from_toml`] takes a text and the folder of its paths; `read` and `read_with` (with changes before the
//! validation) take a text and its path. `read_shapes` reads the named files unless they have been read.
//! [`Scene::load_with`] attaches user-defined energies before the validation. [`Scene::to_toml`] returns the scene as
//! text. [`Scene::follow`] replaces the recording of driven ends (an error without one), and
//! [`Scene::differs_in_recording_only`] compares two scenes without it. [`Scene::files`] lists the scene file and those
//! of its polylines, recordings and signals; [`Scene::make_paths_absolute`] replaces their paths.

use crate::error::{Error, GIVEN_AS_TEXT};
use crate::input::hints::{SCENE, explained};
use crate::input::missing_keys::{has_key, parse};
use crate::scene::required::REQUIRED;
use crate::scene::scheme::Scheme;
use crate::scene::shape::Shape;
use crate::scene::structure::StructureRod;
use crate::scene::time::Time;
use crate::scene::{Contact, Scene};
use std::path::{Path, PathBuf};

impl Scene {
    /// Reads the points of polylines, the recordings of motions and the samples of signals, unless they have been read.
    /// Examines recordings for defects, and replaces a missing `time.end` by the end of the recording `supports.path`.
    /// An error for a file that cannot be read, and for a simulation beyond the end of a recording or of the samples of
    /// a signal in use.
    pub(crate) fn read_shapes(&mut self) -> Result<(), Error> {
        let folder = self.folder();
        self.rod.shape.read(&folder, false)?;
        for motion in &mut self.supports.motion {
            motion.read(&folder)?;
        }
        for contact in &mut self.contacts {
            contact.motions_mut().iter_mut().try_for_each(|motion| motion.read(&folder))?;
        }
        for signal in &mut self.signals {
            signal.read(&folder)?;
        }
        let ends = [self.supports.start, self.supports.end];
        if let Some(path) = &mut self.supports.path {
            path.read(&folder, ends)?;
            // The end of a recording is known only after it is read.
            if let (Some(time), Ok(track)) = (&mut self.time, path.track())
                && time.end == Time::TO_THE_END
            {
                time.end = track.end();
                self.end_of_recording = Some(track.end());
            }
        }
        if let Some(time) = &self.time {
            self.supports.check_end(time)?;
            self.check_obstacle_recordings(time)?;
            self.used_signals().try_for_each(|signal| signal.check_end(time))?;
        }
        self.initial.shape.as_mut().map_or(Ok(()), |shape| shape.read(&folder, true))
    }

    /// Reads and validates a scene file.
    ///
    /// ```
    /// let scene = rodfit::Scene::load("data/cantilever.toml")?;
    /// assert_eq!(scene.rod.segments, Some(50));
    /// assert_eq!(scene.material.youngs_modulus, 1e8); // Pa
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// A file that cannot be read or is not a scene, values that are not allowed, and files named in it that cannot be
    /// read.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::load_file(path.as_ref())
    }

    /// [`load`](Self::load) for a path as `&Path`: a function without type parameter, so that programs do not compile
    /// the reading of scenes again.
    fn load_file(path: &Path) -> Result<Self, Error> {
        Self::read(&marker_files::file::text(path)?, path)
    }

    /// Reads and validates a scene file with [user-defined energies](crate::energy::own); `give`
    /// [attaches](Self::give_energy) their code.
    ///
    /// # Errors
    ///
    /// Those of [`load`](Self::load) and of `give`.
    pub fn load_with(
        path: impl AsRef<Path>,
        give: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let path = path.as_ref();
        Self::read_with(&marker_files::file::text(path)?, path, give)
    }

    /// Reads and validates the text of a scene file. Paths in it are relative to `folder`.
    ///
    /// # Errors
    ///
    /// Text that is not a scene, values that are not allowed, and files of shapes, recordings and signals that cannot
    /// be read.
    ///
    /// ```
    /// use rodfit::Scene;
    /// let text = std::fs::read_to_string("data/cantilever.toml")?;
    /// assert_eq!(Scene::from_toml(&text, "data")?.rod, Scene::load("data/cantilever.toml")?.rod);
    /// let error = Scene::from_toml("[rod]", "data").unwrap_err().to_string();
    /// assert!(error.starts_with("missing keys: rod.shape"), "{error}");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_toml(text: &str, folder: impl AsRef<Path>) -> Result<Self, Error> {
        Self::read(text, &folder.as_ref().join(GIVEN_AS_TEXT))
    }

    /// Reads and validates the text of a scene file with this path, and reads the files that it names. Errors have the
    /// path.
    pub(crate) fn read(text: &str, path: &Path) -> Result<Self, Error> {
        Self::parse_text(text, path)?.complete(path)
    }

    /// Reads the text of a scene file with this path, applies `give` to the scene, validates it and reads the files
    /// that it names. Errors have the path.
    pub(crate) fn read_with(
        text: &str,
        path: &Path,
        give: impl FnOnce(&mut Self) -> Result<(), Error>,
    ) -> Result<Self, Error> {
        let mut scene = Self::parse_text(text, path)?;
        give(&mut scene).map_err(|error| error.in_file(Some(path)))?;
        scene.complete(path)
    }

    /// Parses the text of a scene file with this path, without validation. Sets the path, and whether the text has no
    /// key `loads.gravity`. The scheme of a scene with contacts and a step is generalised-alpha if the text has neither
    /// a scheme nor `beta`. An error lists missing keys, a likely mistake, or line and token at fault.
    fn parse_text(text: &str, path: &Path) -> Result<Self, Error> {
        let mut scene: Self = parse(text, &REQUIRED)
            .map_err(|error| explained(error, text, &SCENE).in_file(Some(path)))?;
        scene.path = Some(path.into());
        // A gravity of zero in the file is intended, a missing one perhaps not.
        scene.gravity_left_out =
            scene.loads.gravity == [0.0; 3] && !has_key(text, "loads", "gravity");
        let has_contacts = !scene.contacts.is_empty();
        if let Some(time) = scene.time.as_mut().filter(|time| has_contacts && time.step.is_some())
            && !["scheme", "beta"].into_iter().any(|key| has_key(text, "time", key))
        {
            time.scheme = Scheme::OF_CONTACTS;
        }
        Ok(scene)
    }

    /// Validates the scene of a file with this path, and reads the files that it names. Errors have the path.
    fn complete(mut self, path: &Path) -> Result<Self, Error> {
        self.validate()?;
        // Numbers first: an invalid scene names its key without reading further files.
        self.read_shapes().map_err(|error| error.in_file(Some(path)))?;
        self.rod.check_ends_of_lists("rod").map_err(|error| error.in_file(Some(path)))?;
        Ok(self)
    }

    /// Replaces the recording that drives the ends by another `file`, relative to the working directory; it is read
    /// when the problem is built. A `time.end` that the scene file did not give is left to the new recording.
    ///
    /// # Errors
    ///
    /// A scene without `[supports.path]`, or a relative path in an unknown working directory.
    pub fn follow(&mut self, file: impl AsRef<Path>) -> Result<(), Error> {
        self.follow_file(file.as_ref())
    }

    /// [`follow`](Self::follow) for a path as `&Path`: sets the absolute path of the file, and removes the recording
    /// that has been read.
    fn follow_file(&mut self, file: &Path) -> Result<(), Error> {
        // An end that was taken from the old recording is not that of the new one.
        self.leave_end_to_recording();
        let Some(path) = &mut self.supports.path else {
            let allowed = "[supports.path] in the scene, whose file the recording replaces";
            return Err(Error::invalid("supports.path", "no such table", allowed));
        };
        path.file = std::path::absolute(file).map_err(|source| Error::io(file, source))?;
        path.track = None;
        Ok(())
    }

    /// Sets a `time.end` that was taken from a recording back to missing, so that another recording sets its own end.
    /// No effect on a given end.
    fn leave_end_to_recording(&mut self) {
        if self.ends_with_recording() {
            self.time.iter_mut().for_each(|time| time.end = Time::TO_THE_END);
            self.end_of_recording = None;
        }
    }

    /// Whether two scenes with recorded ends are equal except for the recording, an end taken from it, and mesh and
    /// step that the program chose. False without recorded ends.
    pub fn differs_in_recording_only(&self, other: &Self) -> bool {
        let without_recording = |scene: &Self| {
            let mut scene = scene.reopened();
            scene.leave_end_to_recording();
            if let Some(path) = &mut scene.supports.path {
                (path.file, path.track) = (PathBuf::new(), None);
            }
            scene
        };
        self.supports.path.is_some() && without_recording(self) == without_recording(other)
    }

    /// The scene as TOML text; without `time.end` if that was taken from a recording. Values equal to their defaults
    /// may be left out.
    ///
    /// ```
    /// use rodfit::Scene;
    /// let scene = Scene::load("data/cantilever.toml")?;
    /// let read = Scene::from_toml(&scene.to_toml()?, "data")?;
    /// assert_eq!(read.rod, scene.rod);
    /// # Ok::<(), rodfit::Error>(())
    /// ```
    pub fn to_toml(&self) -> Result<String, Error> {
        let mut written = self.clone();
        written.leave_end_to_recording();
        written.rod.end_lists_with_rod();
        // A scene that stands for a structure is written as this structure, with the camera of the scene.
        let text = match written.structure {
            Some(mut structure) => {
                structure.camera = written.camera;
                structure.rods.iter_mut().for_each(StructureRod::end_lists_with_rod);
                toml::to_string_pretty(&structure)
            }
            None => toml::to_string_pretty(&written),
        };
        text.map_err(|error| Error::Parse { file: None, message: error.to_string() })
    }

    /// Replaces the paths of polylines, recordings and signals in the scene, relative to its folder, by absolute ones,
    /// so that it can be saved anywhere. An error if the working directory is unknown.
    pub fn make_paths_absolute(&mut self) -> Result<(), Error> {
        let folder = self.folder();
        for file in self.named_files() {
            let path = marker_files::file::at(&folder, file);
            *file = std::path::absolute(&path).map_err(|source| Error::io(&path, source))?;
        }
        Ok(())
    }

    /// Paths of the files of the scene: first its own, if it has one, then those of polylines, recordings and signals,
    /// below its folder. They need not exist.
    pub fn files(&self) -> Vec<PathBuf> {
        let folder = self.folder();
        let mut files: Vec<PathBuf> = self.path.iter().cloned().collect();
        let mut scene = self.clone();
        files.extend(scene.named_files().map(|file| marker_files::file::at(&folder, file)));
        files
    }

    /// References to the paths of polylines without points, then of the recordings, of motions and of signals, as the
    /// scene gives them. Those of its structure are included, empty ones are left out.
    fn named_files(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let structure = self.structure.as_deref_mut();
        let (rods, recorded) = structure.map(|own| (&mut own.rods, &mut own.recording)).unzip();
        let shapes = [Some(&mut self.rod.shape), self.initial.shape.as_mut()].into_iter().flatten();
        let shapes = shapes.chain(rods.into_iter().flatten().map(|rod| &mut rod.shape));
        // Points in the scene itself need no file.
        let polylines = shapes.filter_map(|shape| match shape {
            Shape::Polyline { file, points, .. } if points.is_empty() => Some(file),
            _ => None,
        });
        let recording = self.supports.path.iter_mut().map(|path| &mut path.file);
        let recorded = recorded.into_iter().flatten().map(|own| &mut own.file);
        let motions = self.supports.motion.iter_mut().map(|motion| &mut motion.file);
        let obstacles = self.contacts.iter_mut().flat_map(Contact::motions_mut);
        let motions = motions.chain(obstacles.map(|motion| &mut motion.file));
        let signals = self.signals.iter_mut().map(|signal| &mut signal.file);
        let named = polylines.chain(recording).chain(recorded).chain(motions).chain(signals);
        named.filter(|file| !file.as_os_str().is_empty())
    }

    /// Folder of the scene file, to which its paths are relative; empty for a scene without a file.
    pub fn folder(&self) -> PathBuf {
        self.path.as_deref().and_then(Path::parent).map(Into::into).unwrap_or_default()
    }

    /// Whether `time.end` was taken from a recording, because the file gives none.
    fn ends_with_recording(&self) -> bool {
        let end = self.time.as_ref().map(|time| time.end);
        end.is_some() && end == self.end_of_recording
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 19.5 edges turn by 62 rad, more than half a turn each: an error of the problem, not of the text.
    #[test]
    fn error_of_a_scene_given_as_text_names_no_file() {
        let text = "[rod]\nsegments = 20\nshape = { kind = \"arc\", length = 0.5, angle = 1.0 }\n\
                    section = { kind = \"circle\", radius = 0.005 }\nnatural_curvature = 62.0\n\
                    [material]\ndensity = 1273.52\nyoungs_modulus = 1e8\n";
        let scene = Scene::from_toml(text, ".").unwrap();
        let message = scene.problem().err().unwrap().to_string();
        assert!(message.starts_with("rod.natural_curvature: found"), "{message}");
    }
}
