//! A run's file as a film: pictures of the left eye, the camera, and the measured joints
//! on the pictures' clock.

use super::channel::Channel;
use super::messages::mode_name;
use super::read::{Walked, walk};
use super::urdf::joint_name;
use crate::files::JointsCsv;
use crate::files::cannot_read;
use anyhow::{Context, Result, anyhow, bail, ensure};
use arm_model::{JOINTS, JointVector};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use camera_ingest::calib::check_camera;
use camera_ingest::{FrameSource, ImageFrame, SourceError};
use mcap::records::Record;
use serde::Deserialize;
use shared_types::ipc::ControllerMode;
use shared_types::{MonotonicNs, StereoCamera};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Table of texts that holds the camera, and its only entry.
pub(super) const CAMERA: [&str; 2] = ["camera", "json"];
/// Table of texts and the entry that tells how far its clock was ahead of CLOCK_MONOTONIC (ns).
pub(super) const AHEAD: [&str; 2] = ["wag", "wall_minus_monotonic_ns"];
/// Joints are taken from so much before the first picture to so much after the last (ns).
const MARGIN_NS: u64 = 500_000_000;
/// A longer time without a record means that some are missing (ns).
pub(crate) const GAP_NS: u64 = 250_000_000;
/// Fewest joint reports that tell a motion.
const MIN_JOINTS: usize = 8;
/// Most pictures that are taken into memory (bytes): an hour of them.
const MAX_BYTES: usize = 2 << 30;

/// One picture, compressed.
#[derive(Debug, Clone)]
struct Picture {
    stamp_ns: u64,
    jpeg: Vec<u8>,
}

/// What a run's file shows of the rope.
#[derive(Debug, Default)]
pub struct RunFilm {
    path: PathBuf,
    pictures: Vec<Picture>,
    picture_bytes: usize,
    /// The camera, or why what the file tells is none.
    camera: Option<Result<StereoCamera, String>>,
    /// How far the file's clock was ahead of CLOCK_MONOTONIC (ns), where it tells.
    ahead_ns: Option<u64>,
    joints: Vec<(u64, JointVector)>,
    /// The motions that were streamed.
    streamed: Vec<Streamed>,
    /// When the last cycle was, and whether it streamed.
    last_cycle: Option<(u64, bool)>,
    walked: Walked,
}

/// A motion that was streamed to the arm.
#[derive(Debug, Clone, Copy)]
struct Streamed {
    begin_ns: u64,
    end_ns: u64,
    /// The cycles before it are there.
    from_its_begin: bool,
    /// And those after it.
    to_its_end: bool,
}

/// Pictures of one motion, the first before it begins.
#[derive(Debug)]
pub struct RunPart {
    path: PathBuf,
    pictures: Vec<Picture>,
    /// The camera, where the file tells it, or why what it tells is none.
    pub camera: Option<Result<StereoCamera, String>>,
    /// Measured joints; t = 0 is the first picture.
    pub joints: JointsCsv,
    /// What is missing or damaged.
    pub warnings: Vec<String>,
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

/// What can be seen with; a reason, if nothing can.
fn camera_of(text: Option<&String>) -> Result<StereoCamera, String> {
    let text = text.ok_or("the table is empty")?;
    let camera: StereoCamera = serde_json::from_str(text).map_err(|error| error.to_string())?;
    check_camera(&camera)?;
    Ok(camera)
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
    pub fn read(path: &Path) -> Result<Self> {
        let fail = || format!("run file `{}`", path.display());
        let bytes = std::fs::read(path).map_err(cannot_read(path));
        let bytes = bytes.with_context(fail)?;
        let mut film = Self {
            path: path.to_owned(),
            ..Self::default()
        };
        film.take_in(&bytes).with_context(fail)?;
        Ok(film)
    }

    fn take_in(&mut self, bytes: &[u8]) -> Result<()> {
        let mut topics = BTreeMap::new();
        self.walked = walk(bytes, |record| {
            match record {
                Record::Channel(channel) => {
                    topics.insert(channel.id, channel.topic.clone());
                }
                Record::Metadata(table) if table.name == CAMERA[0] => {
                    self.camera = Some(camera_of(table.metadata.get(CAMERA[1])));
                }
                Record::Metadata(table) if table.name == AHEAD[0] => {
                    let ahead_ns = table.metadata.get(AHEAD[1]);
                    self.ahead_ns = ahead_ns.and_then(|ns| ns.parse().ok());
                }
                Record::Message { header, data } => {
                    let Some(topic) = topics.get(&header.channel_id) else {
                        return Ok(());
                    };
                    let at_ns = header.log_time;
                    self.message(topic, at_ns, data)
                        .with_context(|| format!("channel `{topic}`, time {at_ns} ns"))?;
                }
                _ => {}
            }
            Ok(())
        })?;
        self.pictures.sort_by_key(|picture| picture.stamp_ns);
        self.joints.sort_by_key(|(at_ns, _)| *at_ns);
        self.joints.dedup_by_key(|(at_ns, _)| *at_ns);
        Ok(())
    }

    fn message(&mut self, topic: &str, at_ns: u64, data: &[u8]) -> Result<()> {
        if topic == Channel::Image.topic() {
            let image: ImageMessage = serde_json::from_slice(data)?;
            let format = image.format;
            ensure!(format == "jpeg", "a picture is `{format}`, not jpeg");
            let jpeg = STANDARD
                .decode(image.data)
                .map_err(|error| anyhow!("a picture is not base64: {error}"))?;
            self.picture_bytes += jpeg.len();
            ensure!(
                self.picture_bytes <= MAX_BYTES,
                "the pictures take more than {} MB",
                MAX_BYTES >> 20
            );
            self.pictures.push(Picture {
                stamp_ns: at_ns,
                jpeg,
            });
        } else if topic == Channel::Measured.topic() {
            let reported: JointsMessage = serde_json::from_slice(data)?;
            self.joints.extend(reported.vector().map(|q| (at_ns, q)));
        } else if topic == Channel::Cycles.topic() {
            let cycle: CycleMessage = serde_json::from_slice(data)?;
            self.cycle(at_ns, cycle.mode == mode_name(ControllerMode::Streaming));
        }
        Ok(())
    }

    /// Takes note of a control cycle.
    fn cycle(&mut self, at_ns: u64, streams: bool) {
        let before = self
            .last_cycle
            .filter(|(last_ns, _)| at_ns.saturating_sub(*last_ns) < GAP_NS);
        match (before, self.streamed.last_mut()) {
            (Some((_, true)), Some(motion)) => {
                motion.end_ns = if streams { at_ns } else { motion.end_ns };
                motion.to_its_end = !streams;
            }
            _ if streams => self.streamed.push(Streamed {
                begin_ns: at_ns,
                end_ns: at_ns,
                from_its_begin: before.is_some(),
                to_its_end: false,
            }),
            _ => {}
        }
        self.last_cycle = Some((at_ns, streams));
    }

    /// Every picture of the left eye in order of time: when its exposure began (CLOCK_MONOTONIC,
    /// ns), and the JPEG.
    ///
    /// # Errors
    /// There are pictures, and the file does not tell how its clock goes with that one.
    pub fn pictures(&self) -> Result<Vec<(u64, &[u8])>> {
        let ahead_ns = self.ahead_ns.or(self.pictures.is_empty().then_some(0));
        let ahead_ns = ahead_ns.with_context(|| {
            let [table, entry] = AHEAD;
            let path = self.path.display();
            format!("run file `{path}` lacks the entry `{entry}` of its table of texts `{table}`")
        })?;
        let on_clock = |picture: &Picture| picture.stamp_ns.saturating_sub(ahead_ns);
        let pictures = self.pictures.iter();
        Ok(pictures.map(|p| (on_clock(p), &p.jpeg[..])).collect())
    }

    /// What is missing of a motion's pictures, first to last, and of the whole file.
    fn warnings(&self, number: usize, motion: Streamed, pictures: &[Picture]) -> Vec<String> {
        let damaged = self.walked.damaged_chunks;
        let missing_ns: u64 = pictures
            .windows(2)
            .map(|pair| pair[1].stamp_ns - pair[0].stamp_ns)
            .filter(|step_ns| *step_ns > GAP_NS)
            .sum();
        let missing_s = MonotonicNs(missing_ns).since_s(MonotonicNs(0));
        let damage =
            format!(": {damaged} damaged chunks are left out, and motions may be counted wrongly");
        let end = format!(": the end of motion {number} is missing");
        let gaps = format!(": pictures of {missing_s:.1} s of motion {number} are missing");
        let warnings = [
            (damaged > 0, &*damage),
            (!self.walked.whole, " breaks off before its end"),
            (!motion.to_its_end, &end),
            (missing_ns > 0, &gaps),
        ];
        let said = warnings.into_iter().filter(|(holds, _)| *holds);
        said.map(|(_, what)| format!("run file `{}`{what}", self.path.display()))
            .collect()
    }

    /// Pictures of the `number`-th streamed motion, from 1.
    ///
    /// # Errors
    /// There is no such motion, or no pictures of it.
    pub fn part(mut self, number: usize) -> Result<RunPart> {
        let count = self.streamed.len();
        let path = self.path.clone();
        let name = format!("run file `{}`", path.display());
        let broken = match self.walked {
            Walked {
                damaged_chunks: 1..,
                ..
            } => "; damaged chunks are left out",
            Walked { whole: false, .. } => "; the file breaks off before its end",
            _ => "",
        };
        ensure!(
            count > 0,
            "{name}: no motion was streamed to the arm while it was recorded, so no wiggle is \
             in it{broken}"
        );
        let motion = number.checked_sub(1).and_then(|i| self.streamed.get(i));
        let motion = *motion.with_context(|| {
            format!(
                "{name}: --part is {number}, but {count} motions were streamed to the arm{broken}"
            )
        })?;
        ensure!(
            motion.from_its_begin,
            "{name}: the beginning of motion {number} is missing, in which the rope hangs still"
        );
        let first = self
            .pictures
            .iter()
            .rposition(|picture| picture.stamp_ns <= motion.begin_ns)
            .filter(|first| motion.begin_ns - self.pictures[*first].stamp_ns < GAP_NS)
            .with_context(|| {
                format!(
                    "{name}: no picture is there from just before motion {number} began, when \
                     the rope hung still: wiggle again with --camera, or name the film with \
                     --video and its motion with --joints"
                )
            })?;
        let count = self.pictures[first..]
            .iter()
            .take_while(|picture| picture.stamp_ns <= motion.end_ns)
            .count();
        let pictures: Vec<Picture> = self.pictures.drain(first..first + count).collect();
        let [first, .., last] = &pictures[..] else {
            bail!("{name}: no pictures were recorded during motion {number}");
        };
        let (zero_ns, last_ns) = (first.stamp_ns, last.stamp_ns);
        let span = zero_ns.saturating_sub(MARGIN_NS)..=last_ns.saturating_add(MARGIN_NS);
        let around = self.joints.iter().filter(|(t, _)| span.contains(t));
        let (times_s, q): (Vec<f64>, Vec<JointVector>) = around
            .map(|(t, q)| (MonotonicNs(*t).since_s(MonotonicNs(zero_ns)), *q))
            .unzip();
        ensure!(
            times_s.len() >= MIN_JOINTS,
            "{name}: the arm reported its joints {} times during motion {number}, but \
             {MIN_JOINTS} are needed at least",
            times_s.len()
        );
        Ok(RunPart {
            warnings: self.warnings(number, motion, &pictures),
            path,
            pictures,
            camera: self.camera,
            joints: JointsCsv { times_s, q },
        })
    }
}

impl FrameSource for RunPart {
    fn len(&self) -> usize {
        self.pictures.len()
    }

    fn read_left(&mut self, index: usize) -> Result<ImageFrame, SourceError> {
        let picture = self
            .pictures
            .get(index)
            .ok_or_else(|| SourceError::out_of_range(&self.path, index, self.pictures.len()))?;
        ImageFrame::from_jpeg(&picture.jpeg, picture.stamp_ns, index as u64)
            .map_err(|source| SourceError::frame(&self.path, index, &source))
    }
}

#[cfg(test)]
#[path = "film_tests.rs"]
mod tests;
