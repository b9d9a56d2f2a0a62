//! What a run folder keeps of the reasons for a stop.

use super::{CAUSE_FILE, Explanation, Run, explain};
use crate::files;
use std::path::Path;

/// Explains the recording of a run folder and keeps the explanation there as
/// `cause.json` when the arm was stopped. `None` when there is no recording to
/// explain; that never spoils the run itself.
pub fn keep_cause(run: &Path) -> Option<Explanation> {
    let found = explain(&Run::open(run).ok()?.log().ok()?);
    if found.stopped
        && let Err(reason) = files::write_json(&run.join(CAUSE_FILE), &found)
    {
        tracing::warn!(%reason, "the cause of the stop could not be kept");
    }
    Some(found)
}
