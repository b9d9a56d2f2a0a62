//! A run as a bag of ROS 2, which its tools play, show and read.

mod bag;
mod convert;
mod definitions;
mod messages;
mod topics;
mod translation;

pub use definitions::Definition;
pub use topics::{ALL, PICTURES, Promise, Topic};
pub use translation::{Messages, Translation};

use crate::destination_folder::Destination;
use crate::written::{Written, WrittenFile};
use anyhow::Context;
use bag::{Bag, MARK, MESSAGES, METADATA};
use cli_output::{OrInput, Outcome, bad_input};
use run_log::Run;
use serde_json::{Deserializer, json};
use std::path::Path;

/// Name of the bag's folder, where none is given.
const FOLDER: &str = "ros2";

/// Writes the folder `out`, or else `ros2` in the run's folder: a bag of rosbag2 with the
/// messages of `run.mcap` for which ROS has types. Stamps are wall clock, as there. The folder
/// must not exist, or be an earlier export, which is replaced.
///
/// # Errors
/// The run has no `run.mcap`, or one with a message that is not as this program writes it, or none
/// at all; the folder is something else, or cannot be written.
pub fn ros2(run: &Path, out: Option<&Path>) -> Outcome<Written> {
    let opened = Run::open(run).or_input()?;
    let out = out.map_or_else(|| opened.folder().join(FOLDER), Path::to_owned);
    let destination = Destination::new(&out, is_bag).or_input()?;
    let folder = destination.building();
    let fail = || format!("cannot write `{}`", out.display());
    let mut bag = Bag::create(folder).with_context(fail).or_failed()?;
    let mut translation = Translation::default();
    let missing = opened.messages(|channel, at_ns, data| {
        let mut json = Deserializer::from_slice(data);
        translation.message(channel, at_ns, &mut json, &mut bag)?;
        match Translation::knows(channel) {
            true => Ok(json.end()?),
            false => Ok(()),
        }
    });
    let mut missing = if bag.is_failed() {
        missing.with_context(fail).or_failed()?
    } else {
        missing.or_input()?
    };
    let absent = ALL.iter().filter(|topic| !bag.has(topic));
    let absent: Vec<_> = absent.map(|topic| topic.name.to_owned()).collect();
    if absent.len() == ALL.len() {
        let name = run.display();
        return Err(bad_input!(
            "`{name}` holds no message for which ROS has a type"
        ));
    }
    missing.extend(absent);
    let count = bag.finish(folder).with_context(fail).or_failed()?;
    destination.put().or_failed()?;
    Ok(Written {
        run: run.to_owned(),
        files: vec![WrittenFile {
            path: out.join(MESSAGES),
            count,
            of: "messages",
        }],
        figures: json!({ "folder": out, "messages": count }),
        missing,
    })
}

/// Whether a folder is an earlier export and nothing beside.
fn is_bag(folder: &Path) -> bool {
    let text = std::fs::read_to_string(folder.join(METADATA));
    let is_own = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.is_ok_and(|entry| {
            [METADATA, MESSAGES]
                .iter()
                .any(|own| entry.file_name() == *own)
        })
    };
    text.is_ok_and(|text| text.starts_with(MARK))
        && std::fs::read_dir(folder).is_ok_and(|mut entries| entries.all(is_own))
}
