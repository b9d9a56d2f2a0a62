//! Why a file cannot be read or written, in words that say what to do.

use std::io::{Error, ErrorKind};

/// The reason of a failure at a path that the sentence before it names.
#[must_use]
pub fn why(error: &Error) -> String {
    let known = match error.kind() {
        ErrorKind::NotFound => "there is no such file or folder; check the path",
        ErrorKind::PermissionDenied => "its permissions, or its folder's, do not allow it",
        ErrorKind::IsADirectory => "it is a folder",
        ErrorKind::NotADirectory => "a part of its path is a file, not a folder",
        ErrorKind::AlreadyExists => "it exists already; name another",
        ErrorKind::InvalidData => "it is not a text file in UTF-8",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            "no room is left there; make some, or name another place"
        }
        ErrorKind::ReadOnlyFilesystem => "its file system can only be read; name another place",
        ErrorKind::InvalidFilename => "its name is too long or not allowed there",
        _ => return error.to_string(),
    };
    known.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_system_refuses_is_said_with_what_to_do() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("file");
        std::fs::write(&file, [0xff, 0xfe]).unwrap();
        let read = |path: &std::path::Path| why(&std::fs::read_to_string(path).unwrap_err());
        assert_eq!(read(dir.path()), "it is a folder");
        assert!(read(&file).contains("UTF-8"));
        assert!(read(&file.join("below")).contains("not a folder"));
        assert!(read(&dir.path().join("none")).contains("check the path"));
        assert!(read(&dir.path().join("x".repeat(300))).contains("name is too long"));
        let full = std::fs::write("/dev/full", "text").unwrap_err();
        assert!(why(&full).contains("no room is left"));
        assert!(!why(&Error::other("something else")).is_empty());
    }
}
