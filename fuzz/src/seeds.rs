//! The corpora that fuzzing begins with.

use std::path::Path;

/// Folder under which each target finds its corpus.
const FOLDER: &str = "WAG_FUZZ_SEEDS";

/// Writes `seeds` as the corpus of `target`, where a folder is asked for.
///
/// # Panics
/// When they cannot be written.
pub fn write(target: &str, seeds: Vec<Vec<u8>>) {
    let Some(folder) = std::env::var_os(FOLDER) else {
        return;
    };
    let folder = Path::new(&folder).join(target);
    std::fs::create_dir_all(&folder).expect("the folder of the corpus");
    for (k, seed) in seeds.iter().enumerate() {
        std::fs::write(folder.join(format!("seed-{k:02}")), seed).expect("a seed");
    }
}
