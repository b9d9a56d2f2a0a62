//! Whole-file writes: a temporary file beside the target, then a rename. What is
//! no regular file (a device, a pipe) is written to as it is.

use anyhow::{Result, anyhow};
use shared_types::file_error::why;
use std::fs::{File, Metadata};
use std::io::{self, ErrorKind, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Links that lead to links that lead to links are followed this often.
const LINKS_MAX: usize = 40;
const NO_FOLDER: &str = "there is no such folder";
/// Names of this program's own standard output.
const STANDARD_OUTPUT: [&str; 3] = ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];

/// Where bytes for a path go.
#[derive(Debug)]
enum Target {
    /// This program's standard output.
    StandardOutput,
    /// A device or a pipe.
    Stream(PathBuf),
    /// A regular file with its present permissions, or one that is still to be made.
    File(PathBuf, Option<Metadata>),
}

impl Target {
    fn of(path: &Path) -> io::Result<Self> {
        if STANDARD_OUTPUT.iter().any(|name| path == Path::new(name)) {
            return Ok(Self::StandardOutput);
        }
        let real = follow(path)?;
        match real.metadata() {
            Ok(found) if found.is_dir() => Err(ErrorKind::IsADirectory.into()),
            Ok(found) if found.is_file() => Ok(Self::File(real, Some(found))),
            Ok(_) => Ok(Self::Stream(real)),
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(Self::File(real, None)),
            Err(e) => Err(e),
        }
    }
}

/// The file a chain of links ends at, whether or not it exists. Links into
/// `/proc` lead to what has no name and are left for the system to follow.
fn follow(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..LINKS_MAX {
        match path.read_link() {
            Ok(_) if path.starts_with("/proc") => return Ok(path),
            Ok(next) => path = folder_of(&path).join(next),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other("its links lead nowhere"))
}

fn folder_of(path: &Path) -> &Path {
    path.parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."))
}

/// A temporary file beside `path`. The library's own error would tell its name,
/// which tells nobody anything.
fn temporary(path: &Path) -> io::Result<NamedTempFile> {
    tempfile::Builder::new()
        .permissions(PermissionsExt::from_mode(0o666))
        .tempfile_in(folder_of(path))
        .map_err(|e| e.kind().into())
}

/// What a failure to write `path` is called.
pub(crate) fn cannot_write(path: &Path) -> impl FnOnce(io::Error) -> anyhow::Error + '_ {
    move |error| {
        let why = match error.kind() {
            ErrorKind::NotFound => NO_FOLDER.to_owned(),
            _ => why(&error),
        };
        anyhow!("cannot write `{}`: {why}", path.display())
    }
}

/// Writes `bytes` to `path` so that a reader sees the old or the new file,
/// never a part of one. Links stay links, permissions stay as they are.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> Result<()> {
    put(path, bytes).map_err(cannot_write(path))
}

fn put(path: &Path, bytes: &[u8]) -> io::Result<()> {
    match Target::of(path)? {
        Target::StandardOutput => {
            cli_output::output::data(bytes);
            Ok(())
        }
        Target::Stream(real) => {
            let mut stream = File::options().write(true).open(real)?;
            stream.write_all(bytes)?;
            stream.flush()
        }
        Target::File(real, found) => {
            let mut file = temporary(&real)?;
            file.as_file_mut().write_all(bytes)?;
            if let Some(found) = found {
                file.as_file().set_permissions(found.permissions())?;
            }
            file.as_file().sync_all()?;
            file.persist(&real).map_err(|e| e.error)?;
            Ok(())
        }
    }
}

/// Makes a folder, and those above it, unless it is there.
pub fn create_folder(path: &Path) -> Result<()> {
    std::fs::create_dir_all(path).map_err(cannot_write(path))
}

/// Finds out before any work whether its result can be written to `path`.
pub fn check_writable(path: &Path) -> Result<()> {
    let tried = match Target::of(path) {
        // A pipe without a reader would block here; a device answers when written.
        Ok(Target::StandardOutput | Target::Stream(_)) => Ok(()),
        Ok(Target::File(real, _)) => temporary(&real).map(drop),
        Err(e) => Err(e),
    };
    tried.map_err(cannot_write(path))
}

/// Writes `value` as indented JSON with a final newline.
pub fn write_json<T: serde::Serialize>(path: &Path, value: &T) -> Result<()> {
    let mut text = serde_json::to_string_pretty(value)?;
    text.push('\n');
    write_atomic(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::symlink;

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.json");
        write_json(&path, &[1, 2]).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "[\n  1,\n  2\n]\n");
        let error = write_atomic(&dir.path().join("none/b"), b"x").unwrap_err();
        assert!(error.to_string().contains("none/b"), "{error}");
        assert!(!format!("{error:#}").contains("at path"), "{error:#}");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn links_stay_links_and_permissions_stay() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::create_dir(at("far")).unwrap();
        fs::write(at("far/real"), "old").unwrap();
        fs::set_permissions(at("far/real"), PermissionsExt::from_mode(0o640)).unwrap();
        symlink("far/real", at("near")).unwrap();
        symlink("near", at("link")).unwrap();
        symlink("far/new", at("dangling")).unwrap();
        write_atomic(&at("link"), b"new").unwrap();
        write_atomic(&at("dangling"), b"made").unwrap();
        assert_eq!(fs::read_to_string(at("far/real")).unwrap(), "new");
        assert_eq!(fs::read_to_string(at("far/new")).unwrap(), "made");
        let mode = at("far/real").metadata().unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o640);
        for name in ["link", "near", "dangling"] {
            assert!(at(name).symlink_metadata().unwrap().is_symlink(), "{name}");
        }
        symlink("round", at("round")).unwrap();
        assert!(write_atomic(&at("round"), b"x").is_err());
    }

    #[test]
    fn what_cannot_be_written_is_found_before_the_work() {
        let dir = tempfile::tempdir().unwrap();
        check_writable(&dir.path().join("new")).unwrap();
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
        for (path, named) in [("", "it is a folder"), ("none/a.csv", "none/a.csv")] {
            let error = check_writable(&dir.path().join(path)).unwrap_err();
            let said = format!("{error:#}");
            assert!(said.contains(named) && !said.contains("at path"), "{said}");
        }
    }
}
