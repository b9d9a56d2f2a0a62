//! Where a file that is exported goes, and whether exports go on.

use anyhow::{Result, ensure};
use cli_output::is_interrupted;
use run_log::files;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// So many bytes of a file tell whether it is an earlier export.
const BEGIN: u64 = 64;

/// Looks at a file that is to be written: there is nothing yet, or an earlier export, which
/// `is_export` knows by how it begins, and which is no run's own recording.
///
/// # Errors
/// There is something else, or nothing can be written there.
pub(crate) fn check_file(path: &Path, is_export: fn(&[u8]) -> bool) -> Result<()> {
    let name = path.display();
    if let Ok(real) = path.canonicalize()
        && real.is_file()
    {
        let mut begin = Vec::new();
        let read = File::open(&real).and_then(|file| file.take(BEGIN).read_to_end(&mut begin));
        let is_export = read.is_ok() && is_export(&begin);
        ensure!(
            is_export && real.file_name() != Some(files::RUN.as_ref()),
            "`{name}` is there and is no earlier export, so it is not replaced: name another file \
             with --out"
        );
    }
    make_parent(path)?;
    files::check_writable(path)
}

/// Fails where the command was interrupted: what was built goes by itself.
pub(crate) fn go_on() -> Result<()> {
    ensure!(!is_interrupted(), "interrupted: nothing was written");
    Ok(())
}

/// Writes a file, unless the command was interrupted.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    go_on()?;
    files::write_atomic(path, bytes)
}

/// Makes the folder that something is to lie in.
pub(crate) fn make_parent(path: &Path) -> Result<()> {
    let parent = path.parent().filter(|p| !p.as_os_str().is_empty());
    parent.map_or(Ok(()), files::create_folder)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_file_that_is_no_earlier_export_stays() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        let is_export: fn(&[u8]) -> bool = |begin| begin.starts_with(b"PK");
        check_file(&at("new/run.npz"), is_export).unwrap();
        for (name, words) in [
            ("mine.txt", "words"),
            (files::RUN, "PK, a recording"),
            ("empty", ""),
        ] {
            fs::write(at(name), words).unwrap();
            let refused = check_file(&at(name), is_export).unwrap_err().to_string();
            assert!(refused.contains("no earlier export"), "{refused}");
        }
        fs::write(at("run.npz"), "PK of before").unwrap();
        check_file(&at("run.npz"), is_export).unwrap();
    }
}
