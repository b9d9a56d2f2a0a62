//! Where a data set goes: it appears whole, in place of nothing or of an earlier one.

use anyhow::{Context, Result, anyhow, ensure};
use shared_types::file_error::why;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// File of a set by which an export knows an earlier one; the library leaves it alone.
pub(super) const MARK: &str = "meta/wag.json";
/// What a set's folder holds.
const FOLDERS: [&str; 2] = ["data", "meta"];

/// A folder that is to hold a set, and the one beside it in which the set is built.
#[derive(Debug)]
pub(super) struct Destination {
    folder: PathBuf,
    beside: TempDir,
}

impl Destination {
    /// Looks at what is there.
    ///
    /// # Errors
    /// There is something else than an earlier set, or nothing can be written there.
    pub(super) fn new(folder: &Path) -> Result<Self> {
        let name = folder.display();
        ensure!(
            folder.symlink_metadata().is_err() || is_set(folder),
            "`{name}` exists and is not an earlier export: name a folder that does not exist yet"
        );
        let parent = folder.parent().filter(|p| !p.as_os_str().is_empty());
        let builder = &mut tempfile::Builder::new();
        let beside = builder
            .prefix(".lerobot-")
            .tempdir_in(parent.unwrap_or(Path::new(".")))
            // The library's own error tells a name that nobody knows.
            .map_err(|error| anyhow!("cannot write `{name}`: {}", why(&error.kind().into())))?;
        Ok(Self {
            folder: folder.to_owned(),
            beside,
        })
    }

    /// Where the set is built.
    pub(super) fn building(&self) -> PathBuf {
        self.beside.path().join("new")
    }

    /// Puts the set in its place. Between the two renames nothing is there; a second one that
    /// fails brings the earlier set back.
    pub(super) fn put(self) -> Result<()> {
        let fail = || format!("cannot write `{}`", self.folder.display());
        let earlier = self.beside.path().join("earlier");
        if is_set(&self.folder) {
            fs::rename(&self.folder, &earlier).with_context(fail)?;
        }
        let put = fs::rename(self.building(), &self.folder);
        if put.is_err() && earlier.exists() {
            fs::rename(&earlier, &self.folder).with_context(fail)?;
        }
        put.with_context(fail)
    }
}

/// Whether a folder holds a set that was exported, and nothing beside it.
fn is_set(folder: &Path) -> bool {
    let is_own = |entry: std::io::Result<fs::DirEntry>| {
        let name = entry.map(|entry| entry.file_name());
        name.is_ok_and(|name| FOLDERS.iter().any(|own| name == *own))
    };
    let is_folder = folder.symlink_metadata().is_ok_and(|found| found.is_dir());
    is_folder
        && folder.join(MARK).is_file()
        && fs::read_dir(folder).is_ok_and(|mut entries| entries.all(is_own))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn build(at: &Destination, words: &str) {
        fs::create_dir_all(at.building().join("meta")).unwrap();
        fs::write(at.building().join(MARK), words).unwrap();
    }

    #[test]
    fn a_set_takes_the_place_of_an_earlier_one_and_of_nothing_else() {
        let place = tempfile::tempdir().unwrap();
        let (set, held) = (place.path().join("set"), || fs::read_dir(place.path()).unwrap().count());
        for words in ["first", "second"] {
            let at = Destination::new(&set).unwrap();
            build(&at, words);
            at.put().unwrap();
            assert_eq!(fs::read_to_string(set.join(MARK)).unwrap(), words);
            assert_eq!(held(), 1, "nothing is left beside it");
        }
        drop(Destination::new(&set).unwrap());
        assert_eq!(held(), 1);
        fs::write(set.join("notes.txt"), "mine").unwrap();
        let error = Destination::new(&set).unwrap_err().to_string();
        assert!(error.contains("not an earlier export"), "{error}");
        // What came in the meantime is not taken away either.
        fs::remove_file(set.join("notes.txt")).unwrap();
        let at = Destination::new(&set).unwrap();
        build(&at, "third");
        fs::write(set.join("notes.txt"), "mine").unwrap();
        at.put().unwrap_err();
        assert_eq!(fs::read_to_string(set.join(MARK)).unwrap(), "second");
        for other in [place.path().join("file"), place.path().join("file/below")] {
            fs::write(place.path().join("file"), "words").unwrap();
            let error = format!("{:#}", Destination::new(&other).unwrap_err());
            assert!(error.contains(&other.display().to_string()), "{error}");
        }
    }
}
