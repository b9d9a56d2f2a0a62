//! Where domains lie on this machine, and which ones have a controller.
//!
//! Every user has a folder of their own for the services' descriptions: the
//! library makes it readable for its owner only, so a shared one would lock out
//! every user but the first.

use super::bus::prefix_of;
use super::{Bus, DomainSweep, IpcError, StateReader};
use std::fs::DirBuilder;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

/// Letters of the hash at the end of a service's name.
const HASH: usize = 40;
const SERVICE_SUFFIX: &str = ".service";

/// The folder of `user` (a numeric user id). It depends on nothing but the user,
/// so that a daemon and a terminal meet.
fn folder_of(user: u32) -> PathBuf {
    PathBuf::from(format!("/tmp/wag-{user}"))
}

/// This user's folder, made when it is missing.
///
/// # Errors
/// [`IpcError::Folder`] when it cannot be made or belongs to somebody else.
pub(super) fn root_folder() -> Result<PathBuf, IpcError> {
    let user = rustix::process::getuid().as_raw();
    let folder = folder_of(user);
    own_folder(&folder, user)?;
    Ok(folder)
}

fn own_folder(folder: &Path, user: u32) -> Result<(), IpcError> {
    let fail = |reason: String| IpcError::Folder {
        folder: folder.to_owned(),
        reason,
    };
    match DirBuilder::new().mode(0o700).create(folder) {
        Ok(()) => return Ok(()),
        Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
        Err(e) => return Err(fail(e.to_string())),
    }
    let found = folder.symlink_metadata().map_err(|e| fail(e.to_string()))?;
    if !found.is_dir() {
        return Err(fail("it is no folder".to_owned()));
    }
    if found.uid() != user {
        return Err(fail(format!("it belongs to user {}", found.uid())));
    }
    Ok(())
}

/// Domain of a service's file, `wag_DOMAIN_HASH.service`.
fn domain_in(file: &str) -> Option<&str> {
    let (head, hash) = file.strip_suffix(SERVICE_SUFFIX)?.rsplit_once('_')?;
    let whole = hash.len() == HASH && hash.bytes().all(|b| b.is_ascii_hexdigit());
    let domain = head.strip_prefix("wag_").filter(|_| whole)?;
    // The one place that builds the prefix must agree.
    (prefix_of(domain) == format!("{head}_")).then_some(domain)
}

/// Domains of this user in which a controller runs, in alphabetical order. Not
/// RT-safe.
#[must_use]
pub fn running_controllers() -> Vec<String> {
    let Ok(files) = root_folder().and_then(|root| {
        root.join("services")
            .read_dir()
            .map_err(|e| IpcError::Folder {
                folder: root,
                reason: e.to_string(),
            })
    }) else {
        return Vec::new();
    };
    let mut domains: Vec<String> = files
        .flatten()
        .filter_map(|file| domain_in(file.file_name().to_str()?).map(str::to_owned))
        .collect();
    domains.sort_unstable();
    domains.dedup();
    domains.retain(|domain| has_controller(domain));
    domains
}

fn has_controller(domain: &str) -> bool {
    let _sweep = DomainSweep::new(domain);
    // Joining removes what killed processes left; what opens then is alive.
    Bus::join(domain)
        .and_then(|bus| StateReader::open(&bus).map(|_| ()))
        .is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ipc::ControllerBoards;

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
        assert!(said.contains("no folder"), "{said}");
    }

    #[test]
    fn domains_are_read_from_file_names() {
        let hash = "0".repeat(40);
        let of = |name: String| domain_in(&name).map(str::to_owned);
        assert_eq!(
            of(format!("wag_my_cam_{hash}.service")).as_deref(),
            Some("my_cam")
        );
        assert_eq!(of(format!("wag_my_cam_{hash}.dynamic")), None);
        assert_eq!(of("wag_my_cam_123.service".to_owned()), None);
        assert_eq!(of(format!("iox2_{hash}.service")), None);
    }

    #[test]
    fn a_controller_is_listed_while_it_runs() {
        let domain = format!("test_domains_{}", std::process::id());
        let other = format!("{domain}_empty");
        let _sweeps = (DomainSweep::new(&domain), DomainSweep::new(&other));
        let (bus, empty) = (Bus::join(&domain).unwrap(), Bus::join(&other).unwrap());
        let _no_controller = empty.cycle_publisher().unwrap();
        let boards = ControllerBoards::create(&bus).unwrap();
        let listed = running_controllers();
        assert!(listed.contains(&domain), "{listed:?}");
        assert!(!listed.contains(&other), "{listed:?}");
        drop(boards);
        assert!(!running_controllers().contains(&domain));
    }
}
