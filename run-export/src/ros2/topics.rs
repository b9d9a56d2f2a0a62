//! The topics of a run: their names, types and what is promised to those who read them.

use super::definitions::{
    CAMERA_INFO, COMPRESSED_IMAGE, Definition, IMAGE_MARKER, JOINT_STATE, LOG, TF,
};

/// What is promised to those who read a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Promise {
    /// Every message (reliable).
    Reliable,
    /// Every message, and the last ones to whoever comes late (reliable, transient local).
    Latched {
        /// How many of them.
        depth: u32,
    },
    /// What gets through (best effort), as a camera's pictures: a late one is worth nothing.
    BestEffort,
}

/// A topic.
#[derive(Debug)]
pub struct Topic {
    /// Its name.
    pub name: &'static str,
    /// What its messages are.
    pub definition: &'static Definition,
    /// What is promised to those who read it while it is sent.
    pub promise: Promise,
}

const fn topic(name: &'static str, definition: &'static Definition, promise: Promise) -> Topic {
    Topic {
        name,
        definition,
        promise,
    }
}

pub(super) static MEASURED: Topic = topic("/joint_states", &JOINT_STATE, Promise::Reliable);
pub(super) static COMMANDED: Topic = topic("/joint_setpoints", &JOINT_STATE, Promise::Reliable);
pub(super) static FRAMES: Topic = topic("/tf", &TF, Promise::Reliable);
/// The camera's pose, which holds for the whole run.
pub(super) static FIXED_FRAMES: Topic = topic("/tf_static", &TF, Promise::Latched { depth: 1 });
/// The camera's pictures.
pub static PICTURES: Topic = topic(
    "/camera/left/image/compressed",
    &COMPRESSED_IMAGE,
    Promise::BestEffort,
);
pub(super) static CAMERA: Topic = topic(
    "/camera/left/camera_info",
    &CAMERA_INFO,
    Promise::BestEffort,
);
pub(super) static KEYPOINTS: Topic =
    topic("/camera/left/keypoints", &IMAGE_MARKER, Promise::Reliable);
/// To those who come late, too, as nodes of ROS do.
pub(super) static LINES: Topic = topic("/rosout", &LOG, Promise::Latched { depth: 100 });

/// All of them.
pub static ALL: [&Topic; 8] = [
    &MEASURED,
    &COMMANDED,
    &FRAMES,
    &FIXED_FRAMES,
    &PICTURES,
    &CAMERA,
    &KEYPOINTS,
    &LINES,
];
