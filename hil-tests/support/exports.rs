//! A run's exports, as the published libraries read them.

use super::missing::named;
use std::path::Path;
use std::process::Command;

/// Fails unless `.ci/validate-exports` finds in a run's exports what the run holds, on these topics
/// of a bag, too.
pub(crate) fn agree(run: &Path, topics: &[&str]) {
    let Some(python) = named("WAG_SDK_PYTHON", "Python with mcap, numpy and rosbags") else {
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../.ci/validate-exports");
    let mut python = Command::new(python);
    let output = python.arg(script).args([run, run]).args(topics).output();
    let output = output.unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    print!("{}", String::from_utf8_lossy(&output.stdout));
}
