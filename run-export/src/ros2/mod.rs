//! A run as a bag of ROS 2, which its tools play, show and read.

mod bag;
mod convert;
mod definitions;
mod messages;

use crate::destination::Destination;
use crate::written::{Written, WrittenFile};
use anyhow::{Context, Result};
use bag::{Bag, MARK, MESSAGES, METADATA, Topic};
use cli_output::{OrInput, Outcome, bad_input};
use convert::Calibration;
use definitions::{CAMERA_INFO, COMPRESSED_IMAGE, Definition, IMAGE_MARKER, JOINT_STATE, LOG, TF};
use messages::TfMessage;
use run_log::{Channel, Run};
use serde_json::json;
use std::path::Path;

/// Name of the bag's folder, where none is given.
const FOLDER: &str = "ros2";
/// Optical frame of the left eye.
const CAMERA_FRAME: &str = "camera_left";

const fn topic(name: &'static str, definition: &'static Definition) -> Topic {
    Topic {
        name,
        definition,
        is_latched: false,
    }
}

static MEASURED: Topic = topic("/joint_states", &JOINT_STATE);
static COMMANDED: Topic = topic("/joint_commands", &JOINT_STATE);
static FRAMES: Topic = topic("/tf", &TF);
/// The camera's pose, which holds for the whole run.
static FIXED_FRAMES: Topic = Topic {
    is_latched: true,
    ..topic("/tf_static", &TF)
};
static PICTURES: Topic = topic("/camera/left/image/compressed", &COMPRESSED_IMAGE);
static CAMERA: Topic = topic("/camera/left/camera_info", &CAMERA_INFO);
static KEYPOINTS: Topic = topic("/camera/left/keypoints", &IMAGE_MARKER);
static LINES: Topic = topic("/rosout", &LOG);
static ALL: [&Topic; 8] = [
    &MEASURED,
    &COMMANDED,
    &FRAMES,
    &FIXED_FRAMES,
    &PICTURES,
    &CAMERA,
    &KEYPOINTS,
    &LINES,
];

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
    let mut calibration = None;
    let missing = opened
        .messages(|channel, at_ns, data| add(&mut bag, &mut calibration, channel, at_ns, data));
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

/// Adds what a message of `run.mcap` is for ROS, if it is anything.
fn add(
    bag: &mut Bag,
    calibration: &mut Option<Calibration>,
    channel: Channel,
    at_ns: u64,
    data: &[u8],
) -> Result<()> {
    match channel {
        Channel::Measured => bag.add(&MEASURED, at_ns, &convert::joints(at_ns, data)?),
        Channel::Commanded => bag.add(&COMMANDED, at_ns, &convert::joints(at_ns, data)?),
        Channel::Frames => {
            let transforms = convert::transforms(at_ns, data)?;
            let (fixed, moving): (Vec<_>, Vec<_>) = transforms
                .into_iter()
                .partition(|place| place.child_frame_id == CAMERA_FRAME);
            let of_topics = [(&FIXED_FRAMES, fixed), (&FRAMES, moving)];
            let told = of_topics.into_iter().filter(|(_, t)| !t.is_empty());
            told.map(|(topic, transforms)| (topic, TfMessage { transforms }))
                .try_for_each(|(topic, message)| bag.add(topic, at_ns, &message))
        }
        Channel::Image => {
            let picture = convert::picture(at_ns, data)?;
            bag.add(&PICTURES, at_ns, &picture)?;
            // Told once in a run; here each picture has one of its own stamp.
            let seen = calibration.as_ref();
            let info = seen.map(|seen| seen.of_picture(picture.header));
            info.iter()
                .try_for_each(|info| bag.add(&CAMERA, at_ns, info))
        }
        Channel::Calibration => {
            *calibration = Some(convert::calibration(data)?);
            Ok(())
        }
        Channel::Keypoints => {
            let keypoints = convert::keypoints(at_ns, CAMERA_FRAME, data)?;
            bag.add(&KEYPOINTS, at_ns, &keypoints)
        }
        Channel::Log => bag.add(&LINES, at_ns, &convert::log(at_ns, data)?),
        _ => Ok(()),
    }
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
