//! From films and keypoints to cameras, keypoints and ropes, by the commands.
#![cfg(test)]

mod eyes;
mod identify;
#[path = "../../../camera-ingest/tests/printed_board/mod.rs"]
mod printed_board;
#[path = "../support/mod.rs"]
mod support;
mod video;

use std::path::{Path, PathBuf};

/// A file or folder of the shared data; `None`, said aloud, where it is not there.
fn shared(path: &str) -> Option<PathBuf> {
    let shared = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared"));
    let path = shared.join(path);
    if !path.exists() {
        println!("skipped: {} not found", path.display());
    }
    path.exists().then_some(path)
}
