//! A run's recording with the messages of the Foxglove SDK, in Protobuf, which Foxglove and Rerun
//! show without set-up.
//!
//! Recordings themselves are JSON, which any tool reads: `encoding` turns their messages into the
//! SDK's types, `file` writes the rest as it is. Needs the feature `foxglove`: the SDK brings
//! crates that nothing else here has.

mod encoding;
mod file;

use crate::destination_file::{check_file, write_file};
use crate::written::{Written, WrittenFile};
use cli_output::{OrInput, Outcome, bad_input};
use run_log::Run;
use serde_json::json;
use std::path::Path;

/// Name of the file, where none is given.
const FILE: &str = "run.foxglove.mcap";

/// Writes the file `out`, or else `run.foxglove.mcap` in the run's folder: `run.mcap` with the
/// same topics, times, attachments and tables of texts, its `foxglove.*` messages in Protobuf
/// with the descriptors of Foxglove's SDK. The messages of this program stay JSON; the exact
/// recording for replay is left out.
///
/// # Errors
/// The run has no `run.mcap`, or one with a message that is not as this program writes it, or
/// none of a type of Foxglove's; `out` is a file that is no earlier export, or cannot be written.
pub fn foxglove(run: &Path, out: Option<&Path>) -> Outcome<Written> {
    let opened = Run::open(run).or_input()?;
    let path = out.map_or_else(|| opened.folder().join(FILE), Path::to_owned);
    check_file(&path, file::is_export).or_input()?;
    let mut file = file::FoxgloveFile::new().or_failed()?;
    let mut missing = opened.records(|record| file.add(record)).or_input()?;
    let (messages, converted) = file.counts();
    if converted == 0 {
        let name = run.display();
        return Err(bad_input!(
            "`{name}` holds no message of a type of Foxglove's"
        ));
    }
    missing.extend(file.silent_topics());
    let bytes = file.finish().or_failed()?;
    write_file(&path, &bytes).or_failed()?;
    Ok(Written {
        run: run.to_owned(),
        files: vec![WrittenFile {
            path,
            count: messages,
            of: "messages",
        }],
        figures: json!({ "messages": messages, "protobuf": converted, "bytes": bytes.len() }),
        missing,
    })
}
