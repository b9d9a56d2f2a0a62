//! Where a folder that is exported goes: it appears whole, in place of nothing or of an earlier
//! export.

use crate::destination_file::{go_on, make_parent};
use anyhow::{Context, Result, anyhow, ensure};
use shared_types::file_error::why;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder that is to hold an export, and the one beside it in which that is built.
#[derive(Debug)]
pub(crate) struct Destination {
    folder: PathBuf,
    is_export: fn(&Path) -> bool,
    building: TempDir,
}

impl Destination {
    /// Looks at what is there; `is_export` tells whether a folder is an earlier export, and
    /// nothing beside it.
    ///
    /// # Errors
    /// There is something else, or nothing can be written there.
    pub(crate) fn new(folder: &Path, is_export: fn(&Path) -> bool) -> Result<Self> {
        let name = folder.display();
        ensure!(
            folder.symlink_metadata().is_err() || is_export(folder),
            "`{name}` is there and is no earlier export, so it is not replaced: name a folder \
             that does not exist yet with --out"
        );
        Ok(Self {
            building: temporary(folder)?,
            folder: folder.to_owned(),
            is_export,
        })
    }

    /// Where the export is built.
    pub(crate) fn building(&self) -> &Path {
        self.building.path()
    }

    /// Puts it in its place. Between the two renames nothing is there; where the second fails, the
    /// earlier export comes back.
    pub(crate) fn put(self) -> Result<()> {
        go_on()?;
        let fail = || format!("cannot write `{}`", self.folder.display());
        let aside = temporary(&self.folder)?;
        let earlier = aside.path().join("earlier");
        if (self.is_export)(&self.folder) {
            fs::rename(&self.folder, &earlier).with_context(fail)?;
        }
        let put = fs::rename(self.building(), &self.folder);
        if put.is_err() && earlier.exists() {
            fs::rename(&earlier, &self.folder).with_context(fail)?;
        }
        put.with_context(fail)
    }
}

/// A folder of its own beside `folder`. The library's error tells a name that nobody knows.
fn temporary(folder: &Path) -> Result<TempDir> {
    make_parent(folder)?;
    let parent = folder.parent().filter(|p| !p.as_os_str().is_empty());
    let mut builder = tempfile::Builder::new();
    let builder = builder
        .prefix(".export-")
        .permissions(PermissionsExt::from_mode(0o777));
    let made = builder.tempdir_in(parent.unwrap_or(Path::new(".")));
    made.map_err(|error| {
        let why = why(&error.kind().into());
        anyhow!("cannot write `{}`: {why}", folder.display())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_export(folder: &Path) -> bool {
        fs::read_dir(folder).is_ok_and(|entries| entries.count() == 1)
            && folder.join("mark").is_file()
    }

    fn export(to: &Path, words: &str) -> Result<()> {
        let at = Destination::new(to, is_export)?;
        fs::write(at.building().join("mark"), words)?;
        at.put()
    }

    #[test]
    fn an_export_takes_the_place_of_an_earlier_one_and_of_nothing_else() {
        let place = tempfile::tempdir().unwrap();
        let to = place.path().join("export");
        let held = || fs::read_dir(place.path()).unwrap().count();
        for words in ["first", "second"] {
            export(&to, words).unwrap();
            assert_eq!(fs::read_to_string(to.join("mark")).unwrap(), words);
            assert_eq!(held(), 1, "nothing is left beside it");
        }
        // What fails on the way leaves everything as it was.
        drop(Destination::new(&to, is_export).unwrap());
        assert_eq!(held(), 1);
        // What came in the meantime is not taken away.
        let at = Destination::new(&to, is_export).unwrap();
        fs::write(to.join("notes.txt"), "mine").unwrap();
        at.put().unwrap_err();
        let refused = export(&to, "third").unwrap_err().to_string();
        assert!(refused.contains("no earlier export"), "{refused}");
        assert_eq!(fs::read_to_string(to.join("mark")).unwrap(), "second");
        assert_eq!(held(), 1);
        export(&place.path().join("none/export"), "first").unwrap();
        let nowhere = export(&to.join("mark/export"), "first").unwrap_err();
        assert!(nowhere.to_string().contains("mark"), "{nowhere}");
    }
}
