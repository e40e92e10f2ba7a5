//! What every fuzz target does with its bytes.

#[path = "targets.rs"]
#[allow(dead_code)]
mod targets;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// A file in a folder of this process alone.
fn place() -> &'static Path {
    static PLACE: OnceLock<PathBuf> = OnceLock::new();
    PLACE.get_or_init(|| {
        let folder = std::env::temp_dir().join(format!("rodfit-fuzz-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder for temporary files");
        folder.join("file")
    })
}

/// Takes them as the target of this name does.
pub fn target(name: &str, bytes: &[u8]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../data");
    let target = targets::TARGETS.iter().find(|(own, _)| *own == name);
    target.expect("a target of this name").1.take(bytes, &folder, place());
}
