//! Fuzzes one kind of input, which `WAG_FUZZ_TARGET` names. Each module has `run`, which
//! takes any bytes and panics when something is wrong, and `seeds`, examples to begin with.
//!
//! `.ci/fuzz SECONDS` builds this and runs every target. An input that fails is kept in
//! `fuzz/artifacts`; fix it with a test of the crate it fails in.
#![no_main]

mod artefacts;
mod calibration;
mod configs;
mod messages;
mod recording;
mod run_file;
mod tables;
mod video;
mod wire;

use std::path::Path;
use std::sync::OnceLock;
use tempfile::TempDir;

/// What is fuzzed by a name.
struct Target {
    name: &'static str,
    run: fn(&[u8]),
    seeds: fn() -> Vec<Vec<u8>>,
}

/// The target that the environment names; where that names a folder too, its corpus is
/// begun there.
fn target() -> &'static Target {
    static CHOSEN: OnceLock<Target> = OnceLock::new();
    CHOSEN.get_or_init(|| {
        macro_rules! targets {
            ($($name:ident),*) => {
                [$(Target { name: stringify!($name), run: $name::run, seeds: $name::seeds }),*]
            };
        }
        let named = std::env::var("WAG_FUZZ_TARGET").expect("WAG_FUZZ_TARGET");
        let all = targets!(
            artefacts,
            calibration,
            configs,
            messages,
            recording,
            run_file,
            tables,
            video,
            wire
        );
        let target = all.into_iter().find(|target| target.name == named);
        let target = target.unwrap_or_else(|| panic!("no target is called `{named}`"));
        if let Some(folder) = std::env::var_os("WAG_FUZZ_SEEDS") {
            let folder = Path::new(&folder).join(target.name);
            std::fs::create_dir_all(&folder).expect("the folder of the corpus");
            for (k, seed) in (target.seeds)().iter().enumerate() {
                std::fs::write(folder.join(format!("seed-{k:02}")), seed).expect("a seed");
            }
        }
        target
    })
}

/// A folder for the files of readers that take paths.
fn folder() -> &'static Path {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    FOLDER
        .get_or_init(|| TempDir::new().expect("a temporary folder"))
        .path()
}

libfuzzer_sys::fuzz_target!(
    init: { target(); },
    |data: &[u8]| (target().run)(data)
);
