//! What a test needs and the machine lacks: said aloud, and a failure where it has to be there.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "every crate's tests compile their own copy and use a part"
)]

use std::path::PathBuf;

/// Says that a tool is missing: in CI, which installs all, that fails.
pub fn tool(said: &str) {
    assert!(std::env::var_os("CI").is_none(), "{said}");
    println!("skipped: {said}");
}

/// What an environment variable names; [`tool`] where it names nothing.
pub fn named(variable: &str, what: &str) -> Option<std::ffi::OsString> {
    let value = std::env::var_os(variable);
    if value.is_none() {
        tool(&format!("{variable} names no {what}"));
    }
    value
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
