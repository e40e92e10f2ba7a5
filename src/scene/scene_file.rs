//! A scene file of either kind: one rod, or a structure.
//!
//! Input of [`SceneFile::load`] is the path of a TOML file. Valid TOML with a key `rods` at its root is read as a
//! structure, any other text as the scene of one rod. Output is the validated scene, with the files that it names
//! (polylines, recordings, signals) read. Unreadable files and invalid values are errors.

use crate::error::Error;
use crate::scene::{Scene, StructureScene};
use std::path::Path;

/// The scene of a file.
#[derive(Clone, Debug)]
pub enum SceneFile {
    /// A scene of one rod.
    Rod(Box<Scene>),
    /// A structure.
    Structure(Box<StructureScene>),
}

impl SceneFile {
    /// Reads and validates a scene file, and the files that it names. One with a key `rods` is a structure, any other
    /// the scene of one rod.
    ///
    /// # Errors
    /// A file that cannot be read or is not a scene, and values that are not allowed.
    pub fn load(path: &Path) -> Result<Self, Error> {
        let text = marker_files::file::text(path)?;
        match StructureScene::is_text_of(&text) {
            true => Ok(Self::Structure(Box::new(StructureScene::read(&text, path)?))),
            false => Ok(Self::Rod(Box::new(Scene::read(&text, path)?))),
        }
    }
}
