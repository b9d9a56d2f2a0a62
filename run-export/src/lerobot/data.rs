//! The frames of a set, in files of a size that the library likes.

use super::columns::{Column, Table};
use super::meta::{FILE_MB, data_path};
use crate::written::WrittenFile;
use anyhow::Result;
use std::path::PathBuf;

/// The data files of a set, of which each holds whole episodes.
#[derive(Debug)]
pub(super) struct DataFiles {
    folder: PathBuf,
    open: Option<Open>,
    /// The finished ones, their paths from the folder on.
    written: Vec<WrittenFile>,
}

/// The file that episodes go into.
#[derive(Debug)]
struct Open {
    table: Table,
    file: WrittenFile,
    bytes: usize,
}

impl DataFiles {
    /// Files in a set's folder, none yet.
    pub(super) const fn new(folder: PathBuf) -> Self {
        Self {
            folder,
            open: None,
            written: Vec::new(),
        }
    }

    /// Adds an episode of about so many bytes; `texts` are for programs that look for them.
    /// Returns the number of its file.
    pub(super) fn add(
        &mut self,
        episode: &[Column],
        texts: &[(&str, String)],
        [frames, bytes]: [usize; 2],
    ) -> Result<usize> {
        let too_large = |open: &Open| open.bytes + bytes > FILE_MB << 20;
        if self.open.as_ref().is_some_and(too_large) {
            self.close()?;
        }
        let number = self.written.len();
        let open = match &mut self.open {
            Some(open) => open,
            none => {
                let path = PathBuf::from(data_path(number));
                let table = Table::create(&self.folder.join(&path), episode, texts)?;
                let file = WrittenFile {
                    path,
                    count: 0,
                    of: "frames",
                };
                none.insert(Open {
                    table,
                    file,
                    bytes: 0,
                })
            }
        };
        open.table.add(episode)?;
        open.file.count += frames as u64;
        open.bytes += bytes;
        Ok(number)
    }

    fn close(&mut self) -> Result<()> {
        if let Some(open) = self.open.take() {
            open.table.finish()?;
            self.written.push(open.file);
        }
        Ok(())
    }

    /// Writes the end of the last file. Returns all of them, their paths from the folder on.
    pub(super) fn finish(mut self) -> Result<Vec<WrittenFile>> {
        self.close()?;
        Ok(self.written)
    }
}
