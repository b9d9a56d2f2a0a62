//! Where a recording lies.

use super::CYCLES_FILE;
use crate::mcap_file::{RUN_FILE, is_mcap, replay_bytes};
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
        // Either will do; the smaller one is read sooner.
        [CYCLES_FILE, RUN_FILE]
            .map(|name| run.join(name))
            .into_iter()
            .find(|file| file.is_file())
            .with_context(|| {
                format!(
                    "`{}` is no run folder with a recording: it holds neither {CYCLES_FILE} nor {RUN_FILE}",
                    run.display()
                )
            })?
    } else {
        run.to_owned()
    };
    let bytes = std::fs::read(&file).with_context(|| {
        format!(
            "cannot read `{}`; check its permissions and the memory of this machine",
            file.display()
        )
    })?;
    if is_mcap(&bytes) {
        return replay_bytes(&bytes).with_context(|| format!("`{}`", file.display()));
    }
    Ok(bytes)
}
