//! The runs before: newest first, each with what came of it, and its report.

use anyhow::{Context, ensure};
use run_log::ledger::{self, Entry};
use run_log::{CellHere, Run, files};
use serde::Serialize;
use shared_types::Task;
use std::path::{Path, PathBuf};
use viewer::report;

/// Most runs that are told.
const RUNS_MAX: usize = 30;

/// One run of the history.
#[derive(Debug, Serialize)]
pub(crate) struct Past {
    /// Name of its folder.
    name: String,
    /// Whether a throw can be planned with its rope.
    has_rope: bool,
    /// Whether its throw can be corrected.
    has_throw: bool,
    /// Whether its arm was simulated: a real one refuses its rope.
    is_simulated: bool,
    entry: Entry,
}

/// The newest runs.
pub(crate) fn newest(runs: &Path) -> Vec<Past> {
    let inside = runs.read_dir().into_iter().flatten().flatten();
    let mut folders: Vec<PathBuf> = inside
        .map(|entry| entry.path())
        .filter(|path| {
            path.file_name()
                .is_some_and(|name| is_plain(&name.to_string_lossy()))
        })
        .filter(|path| ledger::is_run(path))
        .collect();
    // The names that commands give begin with the time.
    folders.sort();
    let newest = folders.iter().rev().take(RUNS_MAX);
    newest.filter_map(|folder| past(folder)).collect()
}

/// Whether a name needs no care in an address, and leads nowhere else.
fn is_plain(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    name.chars().all(plain) && !name.starts_with('.')
}

fn past(folder: &Path) -> Option<Past> {
    let entry = ledger::read(folder).ok()?;
    Some(Past {
        name: folder.file_name()?.to_str()?.to_owned(),
        has_rope: folder.join(files::ROPE).is_file(),
        // Only strikes are corrected.
        has_throw: entry.camera_m.is_some()
            && entry.task.as_deref() == Some(Task::Strike.name())
            && folder.join(files::PLAN).is_file(),
        is_simulated: Run::open(folder).is_ok_and(|run| run.is_simulated().unwrap_or(false)),
        entry,
    })
}

/// The folder of a run by its name.
///
/// # Errors
/// There is no such run in `runs`.
pub(crate) fn folder(runs: &Path, name: &str) -> anyhow::Result<PathBuf> {
    let folder = runs.join(name);
    ensure!(
        is_plain(name) && ledger::is_run(&folder),
        "there is no run `{name}`"
    );
    Ok(folder)
}

/// The report of a run that has ended; made where there is none since its summary.
///
/// # Errors
/// There is no such run, or it has nothing to report.
pub(crate) fn report(runs: &Path, name: &str, here: &CellHere) -> anyhow::Result<Vec<u8>> {
    let folder = folder(runs, name)?;
    let written = |file: &str| folder.join(file).metadata().and_then(|m| m.modified()).ok();
    let summary = written(files::SUMMARY);
    ensure!(summary.is_some(), "the run `{name}` has not ended");
    let kept = folder.join("report.html");
    let path = if written("report.html") >= summary {
        kept
    } else {
        report::write(&folder, None, here)?.path
    };
    std::fs::read(&path).with_context(|| format!("cannot read `{}`", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_told_newest_first_and_nothing_else_is_reached() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["20260101-run", "20260102-run", "notes"] {
            std::fs::create_dir(dir.path().join(name)).unwrap();
        }
        for name in ["20260101-run", "20260102-run"] {
            let summary = r#"{"ok": true, "target_m": [1.0, 0.0, 0.2]}"#;
            std::fs::write(dir.path().join(name).join(files::SUMMARY), summary).unwrap();
        }
        let names: Vec<_> = newest(dir.path()).into_iter().map(|p| p.name).collect();
        assert_eq!(names, ["20260102-run", "20260101-run"]);
        assert!(folder(dir.path(), "20260101-run").is_ok());
        for name in ["notes", "..", ".", "", "../x", "a/b", "20260103-run"] {
            assert!(folder(dir.path(), name).is_err(), "{name}");
        }
        assert_eq!(newest(&dir.path().join("none")).len(), 0);
    }
}
