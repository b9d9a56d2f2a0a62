//! Whole-file writes: a temporary file beside the target, then a rename.

use anyhow::Context;
use std::io::Write;
use std::path::Path;

/// Writes `bytes` to `path` so that a reader sees the old or the new file,
/// never a part of one.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    let folder = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let fail = || {
        format!(
            "cannot write `{}`; check that its folder exists and is writable",
            path.display()
        )
    };
    let mut file = tempfile::NamedTempFile::new_in(folder).with_context(fail)?;
    file.write_all(bytes).with_context(fail)?;
    file.as_file().sync_all().with_context(fail)?;
    // Temporary files are private by default; results are for everybody the folder is for.
    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o644);
    file.as_file().set_permissions(mode).with_context(fail)?;
    file.persist(path).with_context(fail)?;
    Ok(())
}

/// Writes `value` as indented JSON with a final newline.
pub fn write_json<T: serde::Serialize>(path: &Path, value: &T) -> anyhow::Result<()> {
    let mut text = serde_json::to_string_pretty(value)?;
    text.push('\n');
    write_atomic(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.json");
        write_json(&path, &[1, 2]).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "[\n  1,\n  2\n]\n");
        let error = write_atomic(&dir.path().join("none/b"), b"x").unwrap_err();
        assert!(error.to_string().contains("none/b"), "{error}");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
