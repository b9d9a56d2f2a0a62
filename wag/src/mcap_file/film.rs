//! A run's file as a film: pictures of the left eye, the camera, and the measured joints
//! on the pictures' clock.

use super::channel::Channel;
use super::read::walk;
use super::urdf::joint_name;
use crate::files::JointsCsv;
use anyhow::{Context, anyhow, bail, ensure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use camera_ingest::{EyeFrame, FrameSource, SourceError};
use mcap::records::Record;
use serde::Deserialize;
use shared_types::ipc::ControllerMode;
use shared_types::{JOINTS, JointVector, StereoCamera};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Table of texts that holds the camera, and its only entry.
pub const CAMERA: [&str; 2] = ["camera", "json"];
/// Joints are taken from so much before the first picture to so much after the last (ns).
const MARGIN_NS: u64 = 500_000_000;

/// One picture, compressed.
#[derive(Debug, Clone)]
struct Picture {
    stamp_ns: u64,
    jpeg: Vec<u8>,
}

/// What a run's file shows of the rope.
#[derive(Debug)]
pub struct RunFilm {
    path: PathBuf,
    pictures: Vec<Picture>,
    camera: Option<StereoCamera>,
    joints: Vec<(u64, JointVector)>,
    /// Begin and end of each streamed motion (ns).
    streamed: Vec<[u64; 2]>,
}

/// Pictures of one motion, the first before it begins.
#[derive(Debug)]
pub struct RunPart {
    path: PathBuf,
    pictures: Vec<Picture>,
    /// The camera, where the file tells it.
    pub camera: Option<StereoCamera>,
    /// Measured joints; t = 0 is the first picture.
    pub joints: JointsCsv,
}

#[derive(Deserialize)]
struct ImageMessage {
    data: String,
    format: String,
}

#[derive(Deserialize)]
struct JointMessage {
    name: String,
    position: Option<f64>,
}

#[derive(Deserialize)]
struct JointsMessage {
    joints: Vec<JointMessage>,
}

#[derive(Deserialize)]
struct CycleMessage {
    mode: String,
}

impl JointsMessage {
    /// All seven, if the arm told them.
    fn vector(&self) -> Option<JointVector> {
        let mut q = [f64::NAN; JOINTS];
        for joint in &self.joints {
            let i = (0..JOINTS).find(|i| joint_name(*i) == joint.name)?;
            q[i] = joint.position?;
        }
        q.iter().all(|q| q.is_finite()).then_some(JointVector(q))
    }
}

impl RunFilm {
    /// Reads a file, whole or cut off.
    ///
    /// # Errors
    /// It cannot be read, is no MCAP file, or a message in it is not as this program
    /// writes it.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let fail = || format!("run file `{}`", path.display());
        let bytes = std::fs::read(path).with_context(fail)?;
        let mut film = Self {
            path: path.to_owned(),
            pictures: Vec::new(),
            camera: None,
            joints: Vec::new(),
            streamed: Vec::new(),
        };
        film.take_in(&bytes).with_context(fail)?;
        Ok(film)
    }

    fn take_in(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        let mut topics = BTreeMap::new();
        let mut streaming = false;
        walk(bytes, |record| {
            match record {
                Record::Channel(channel) => {
                    topics.insert(channel.id, channel.topic.clone());
                }
                Record::Metadata(table) if table.name == CAMERA[0] => {
                    let text = table.metadata.get(CAMERA[1]).context("no camera told")?;
                    self.camera = Some(serde_json::from_str(text).context("the camera")?);
                }
                Record::Message { header, data } => {
                    let Some(topic) = topics.get(&header.channel_id) else {
                        return Ok(());
                    };
                    let at_ns = header.log_time;
                    self.message(topic, at_ns, data, &mut streaming)
                        .with_context(|| format!("channel `{topic}`, time {at_ns} ns"))?;
                }
                _ => {}
            }
            Ok(())
        })?;
        self.pictures.sort_by_key(|picture| picture.stamp_ns);
        Ok(())
    }

    fn message(
        &mut self,
        topic: &str,
        at_ns: u64,
        data: &[u8],
        streaming: &mut bool,
    ) -> anyhow::Result<()> {
        if topic == Channel::Image.topic() {
            let image: ImageMessage = serde_json::from_slice(data)?;
            ensure!(
                image.format == "jpeg",
                "a picture is `{}`, not jpeg",
                image.format
            );
            let jpeg = STANDARD
                .decode(image.data)
                .map_err(|error| anyhow!("a picture is no base64: {error}"))?;
            self.pictures.push(Picture {
                stamp_ns: at_ns,
                jpeg,
            });
        } else if topic == Channel::Measured.topic() {
            let told: JointsMessage = serde_json::from_slice(data)?;
            let later = self.joints.last().is_none_or(|(last, _)| at_ns > *last);
            self.joints
                .extend(told.vector().filter(|_| later).map(|q| (at_ns, q)));
        } else if topic == Channel::Cycles.topic() {
            let cycle: CycleMessage = serde_json::from_slice(data)?;
            let was = std::mem::replace(
                streaming,
                cycle.mode == format!("{:?}", ControllerMode::Streaming),
            );
            match self.streamed.last_mut() {
                Some([_, end]) if *streaming && was => *end = at_ns,
                _ if *streaming => self.streamed.push([at_ns; 2]),
                _ => {}
            }
        }
        Ok(())
    }

    /// Pictures of the `number`-th streamed motion, from 1.
    ///
    /// # Errors
    /// There is no such motion, or no pictures of it.
    pub fn part(self, number: usize) -> anyhow::Result<RunPart> {
        let count = self.streamed.len();
        let name = self.path.display();
        ensure!(
            count > 0,
            "run file `{name}`: no motion was streamed to the arm while it was recorded, so \
             no wiggle is in it"
        );
        let Some([begin_ns, end_ns]) = number.checked_sub(1).and_then(|i| self.streamed.get(i))
        else {
            bail!("run file `{name}`: --part is {number}, but must be from 1 to {count}");
        };
        let first = self
            .pictures
            .iter()
            .rposition(|picture| picture.stamp_ns <= *begin_ns)
            .with_context(|| {
                format!("run file `{name}`: no picture was recorded before motion {number} began")
            })?;
        let pictures: Vec<Picture> = self.pictures[first..]
            .iter()
            .take_while(|picture| picture.stamp_ns <= *end_ns)
            .cloned()
            .collect();
        let (zero_ns, last_ns) = match &pictures[..] {
            [first, .., last] => (first.stamp_ns, last.stamp_ns),
            _ => bail!("run file `{name}`: no pictures were recorded during motion {number}"),
        };
        let around = self
            .joints
            .iter()
            .filter(|(t, _)| (zero_ns.saturating_sub(MARGIN_NS)..=last_ns + MARGIN_NS).contains(t));
        let (times_s, q): (Vec<f64>, Vec<JointVector>) =
            around.map(|(t, q)| (since_s(*t, zero_ns), *q)).unzip();
        ensure!(
            times_s.len() >= 2,
            "run file `{name}`: the arm told no joints during motion {number}"
        );
        Ok(RunPart {
            path: self.path,
            pictures,
            camera: self.camera,
            joints: JointsCsv { times_s, q },
        })
    }
}

/// Seconds from one instant to another, which may be before it.
#[allow(
    clippy::cast_precision_loss,
    reason = "a run lasts far less than 2^53 ns"
)]
fn since_s(at_ns: u64, zero_ns: u64) -> f64 {
    if at_ns < zero_ns {
        return -since_s(zero_ns, at_ns);
    }
    (at_ns - zero_ns) as f64 * 1e-9
}

impl FrameSource for RunPart {
    fn len(&self) -> usize {
        self.pictures.len()
    }

    fn read_left(&mut self, index: usize) -> Result<EyeFrame, SourceError> {
        let path = || self.path.clone();
        let picture = self
            .pictures
            .get(index)
            .ok_or_else(|| SourceError::OutOfRange {
                path: path(),
                frame: index,
                len: self.pictures.len(),
            })?;
        EyeFrame::from_jpeg(&picture.jpeg, picture.stamp_ns, index as u64).map_err(|source| {
            SourceError::Frame {
                path: path(),
                frame: index,
                source,
            }
        })
    }
}

#[cfg(test)]
#[path = "film_tests.rs"]
mod tests;
