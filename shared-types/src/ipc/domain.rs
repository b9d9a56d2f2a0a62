//! Where a domain's files lie on this machine, and what they are called.
//!
//! Every user has a folder of their own for the services' descriptions: the
//! library makes it readable for its owner only, so a shared one would lock out
//! every user but the first.

use super::IpcError;
use iceoryx2::prelude::{Config, FileName, Path as IpcPath, SemanticString, SemanticStringError};
use std::fs::DirBuilder;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

/// The folder of `user` (a numeric user id). It depends on nothing but the user,
/// so that a daemon and a terminal meet.
fn folder_of(user: u32) -> PathBuf {
    PathBuf::from(format!("/tmp/wag-{user}"))
}

/// This user's folder, made when it is missing; refused when it belongs to somebody else.
pub(super) fn root_folder() -> Result<PathBuf, IpcError> {
    let user = rustix::process::getuid().as_raw();
    let folder = folder_of(user);
    own_folder(&folder, user)?;
    Ok(folder)
}

fn own_folder(folder: &Path, user: u32) -> Result<(), IpcError> {
    match DirBuilder::new().mode(0o700).create(folder) {
        Ok(()) => return Ok(()),
        Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
        Err(e) => return Err(IpcError::folder(folder, e)),
    }
    let found = folder.symlink_metadata();
    let found = found.map_err(|e| IpcError::folder(folder, e))?;
    if !found.is_dir() {
        return Err(IpcError::folder(folder, "it is not a folder"));
    }
    if found.uid() != user {
        let of = format!("it belongs to user {}", found.uid());
        return Err(IpcError::folder(folder, of));
    }
    Ok(())
}

/// The library's configuration for a domain: a prefix of its own for every file,
/// in this user's folder.
pub(super) fn config_of(domain: &str) -> Result<Config, IpcError> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if domain.is_empty() || domain.len() > 40 || !domain.chars().all(plain) {
        return Err(IpcError::Domain(domain.to_owned()));
    }
    let root = root_folder()?;
    let fail = |e: SemanticStringError| IpcError::join(domain, &root, e);
    let mut config = Config::default();
    config.global.prefix = FileName::new(prefix_of(domain).as_bytes()).map_err(fail)?;
    let path = IpcPath::new(root.as_os_str().as_encoded_bytes()).map_err(fail)?;
    config.global.set_root_path(&path);
    Ok(config)
}

/// What the name of every file of a domain begins with.
pub(super) fn prefix_of(domain: &str) -> String {
    format!("wag_{domain}_")
}

/// Whether this is the hash of a service in the name of a file.
pub(super) fn is_hash(text: &str) -> bool {
    text.len() == 40 && text.bytes().all(|b| b.is_ascii_hexdigit())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_user_has_a_folder_of_their_own() {
        assert_ne!(folder_of(0), folder_of(1000));
        let user = rustix::process::getuid().as_raw();
        let dir = std::env::temp_dir().join(format!("wag-own-{}", std::process::id()));
        own_folder(&dir, user).unwrap();
        own_folder(&dir, user).unwrap();
        assert_eq!(dir.metadata().unwrap().mode() & 0o777, 0o700);
        let said = own_folder(&dir, user + 1).unwrap_err().to_string();
        assert!(
            said.contains("wag-own") && said.contains("belongs to user"),
            "{said}"
        );
        std::fs::remove_dir(&dir).unwrap();
        std::fs::write(&dir, "x").unwrap();
        let said = own_folder(&dir, user).unwrap_err().to_string();
        std::fs::remove_file(&dir).unwrap();
        assert!(said.contains("not a folder"), "{said}");
    }
}
