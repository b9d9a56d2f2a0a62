//! What the messages of a run are for ROS: which of them there, on which topics.

use super::convert::{self, Calibration};
use super::messages::{TfMessage, cdr};
use super::topics::{
    CAMERA, COMMANDED, FIXED_FRAMES, FRAMES, KEYPOINTS, LINES, MEASURED, PICTURES, Topic,
};
use anyhow::Result;
use run_log::Channel;
use serde::{Deserializer, Serialize};

/// Optical frame of the left eye.
const CAMERA_FRAME: &str = "camera_left";

/// Takes the messages of topics: a bag, or those who listen.
pub trait Messages {
    /// Takes a message of the instant `at_ns` (wall clock), in CDR with its encapsulation header.
    ///
    /// # Errors
    /// It cannot be written or sent.
    fn add(&mut self, topic: &'static Topic, at_ns: u64, message: Vec<u8>) -> Result<()>;
}

/// Makes messages for ROS from those of one run, in their order.
#[derive(Debug, Default)]
pub struct Translation {
    /// Told once in a run, before the first picture.
    calibration: Option<Calibration>,
}

impl Translation {
    /// Whether ROS has a type for what a channel tells.
    #[must_use]
    pub const fn knows(channel: Channel) -> bool {
        matches!(
            channel,
            Channel::Measured
                | Channel::Commanded
                | Channel::Frames
                | Channel::Image
                | Channel::Calibration
                | Channel::Keypoints
                | Channel::Log
        )
    }

    /// Hands on what a message of the instant `at_ns` (wall clock) is for ROS, if it is anything.
    ///
    /// # Errors
    /// It is not as this program writes it, or those of `to`.
    pub fn message<'de>(
        &mut self,
        channel: Channel,
        at_ns: u64,
        data: impl Deserializer<'de, Error = serde_json::Error>,
        to: &mut impl Messages,
    ) -> Result<()> {
        let mut tell = |topic, message: &dyn Encoded| to.add(topic, at_ns, message.encoded()?);
        match channel {
            Channel::Measured => tell(&MEASURED, &convert::joints(at_ns, data)?),
            Channel::Commanded => tell(&COMMANDED, &convert::joints(at_ns, data)?),
            Channel::Frames => {
                let transforms = convert::transforms(at_ns, data)?;
                let (fixed, moving): (Vec<_>, Vec<_>) = transforms
                    .into_iter()
                    .partition(|place| place.child_frame_id == CAMERA_FRAME);
                let of_topics = [(&FIXED_FRAMES, fixed), (&FRAMES, moving)];
                let told = of_topics.into_iter().filter(|(_, t)| !t.is_empty());
                told.map(|(topic, transforms)| (topic, TfMessage { transforms }))
                    .try_for_each(|(topic, message)| tell(topic, &message))
            }
            Channel::Image => {
                let picture = convert::picture(at_ns, data)?;
                tell(&PICTURES, &picture)?;
                // Here each picture has one of its own stamp.
                let seen = self.calibration.as_ref();
                let info = seen.map(|seen| seen.of_picture(picture.header));
                info.iter().try_for_each(|info| tell(&CAMERA, info))
            }
            Channel::Calibration => {
                self.calibration = Some(convert::calibration(data)?);
                Ok(())
            }
            Channel::Keypoints => {
                let keypoints = convert::keypoints(at_ns, CAMERA_FRAME, data)?;
                tell(&KEYPOINTS, &keypoints)
            }
            Channel::Log => tell(&LINES, &convert::log(at_ns, data)?),
            _ => Ok(()),
        }
    }
}

/// A message of any type.
trait Encoded {
    fn encoded(&self) -> Result<Vec<u8>>;
}

impl<T: Serialize> Encoded for T {
    fn encoded(&self) -> Result<Vec<u8>> {
        cdr(self)
    }
}
