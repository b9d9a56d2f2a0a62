//! Where a recording lies.

use super::CYCLES_FILE;
use anyhow::{Context, ensure};
use std::path::Path;

/// The bytes of the recording in a run folder; a file is taken as it is.
pub fn read_recording(run: &Path) -> anyhow::Result<Vec<u8>> {
    ensure!(
        run.exists(),
        "`{}` does not exist; name a run folder as made by wag demo, throw, wiggle or record",
        run.display()
    );
    let file = if run.is_dir() {
        run.join(CYCLES_FILE)
    } else {
        run.to_owned()
    };
    ensure!(
        file.is_file(),
        "`{}` is no run folder with a recording: it holds no {CYCLES_FILE}",
        run.display()
    );
    std::fs::read(&file).with_context(|| {
        format!(
            "cannot read `{}`; check its permissions and the memory of this machine",
            file.display()
        )
    })
}
