//! What a test needs and the machine lacks: said aloud, and a failure where it has to be there.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "every crate's tests compile their own copy and use a part"
)]

use std::path::PathBuf;

/// Says what a test is without: a failure in CI, and where `.ci/run` has installed it.
pub fn without(said: &str) {
    let must = ["CI", "WAG_REQUIRE_TOOLS"].map(std::env::var_os);
    assert!(must.iter().all(Option::is_none), "{said}");
    println!("skipped: {said}");
}

/// What an environment variable names; [`without`] it where it names nothing.
pub fn named(variable: &str, what: &str) -> Option<std::ffi::OsString> {
    let value = std::env::var_os(variable);
    if value.is_none() {
        without(&format!("{variable} names no {what}"));
    }
    value
}

/// Whether no ONNX Runtime is named: there is nothing to test with.
pub fn no_onnx_runtime() -> bool {
    named("ORT_DYLIB_PATH", "ONNX Runtime library").is_none()
}

/// A file or folder of the reference data in `shared` beside the checkout. `WAG_REQUIRE_SHARED`
/// says that they are there.
pub fn shared(path: &str) -> Option<PathBuf> {
    let path = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared")).join(path);
    if path.exists() {
        return Some(path);
    }
    let said = format!("{} not found", path.display());
    assert!(std::env::var_os("WAG_REQUIRE_SHARED").is_none(), "{said}");
    println!("skipped: {said}");
    None
}
