//! What becomes known after the fact: plan, parameters, the rope, the figures. The
//! files of the run folder appear whole, so one that is there can be taken in.

use super::channel::Channel;
use super::clock::Clock;
use super::feed::Sink;
use super::messages::time;
use super::scene::rope;
use super::writer::McapFile;
use crate::files;
use anyhow::Result;
use serde_json::{Value, json};
use shared_types::MonotonicNs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Every second frame of the report's 60 Hz.
const ROPE_EVERY: usize = 2;
/// Files that come while the run goes on, with their channels and fields.
const FILES: [(&str, Channel, &str); 3] = [
    (files::PLAN, Channel::Plan, "plan"),
    (files::ROPE, Channel::Parameters, "parameters"),
    (files::SUMMARY, Channel::Summary, "summary"),
];

/// The identified rope, simulated on one motion of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RopeMotion {
    /// Instant of the first frame.
    pub begin: MonotonicNs,
    /// Time between frames (s).
    pub period_s: f64,
    /// Each frame: x, y, z of the rope's nodes in the world frame (0.1 mm).
    pub nodes: Vec<Vec<i32>>,
    /// Radius of the rope and of its lead (m).
    pub radii_m: [f64; 2],
}

/// Simulates the rope of a finished run folder; this crate must not depend on a simulator.
pub type SimulateRope = fn(&Path) -> Result<Vec<RopeMotion>>;

/// Results of a run folder, each taken in once.
#[derive(Debug)]
pub(super) struct Results {
    run: PathBuf,
    taken: [bool; FILES.len()],
}

impl Results {
    /// Those of `run`, none of them yet.
    pub(super) fn of(run: &Path) -> Self {
        Self {
            run: run.to_owned(),
            taken: [false; FILES.len()],
        }
    }

    /// Takes in what has appeared.
    pub(super) fn look(&mut self, sink: &mut impl Sink, clock: Clock) -> Result<()> {
        for ((name, channel, field), taken) in FILES.into_iter().zip(&mut self.taken) {
            let path = self.run.join(name);
            if *taken || !sink.wants(channel) || !path.is_file() {
                continue;
            }
            *taken = true;
            if let Some(value) = read_or_warn(&path) {
                let at_ns = clock.now_ns();
                sink.message(channel, at_ns, &message(at_ns, field, &value))?;
            }
        }
        Ok(())
    }

    /// The identified rope on the motions of the run.
    pub(super) fn simulate(
        &self,
        file: &mut McapFile,
        clock: Clock,
        simulate: SimulateRope,
    ) -> Result<()> {
        let motions = match simulate(&self.run) {
            Ok(motions) => motions,
            Err(reason) => {
                tracing::warn!("no rope in the recording: {reason:#}");
                return Ok(());
            }
        };
        for motion in motions {
            for (index, nodes) in motion.nodes.iter().enumerate().step_by(ROPE_EVERY) {
                let at = motion.begin.plus_s(index as f64 * motion.period_s);
                let at_ns = clock.wall_ns(at.0);
                file.json(Channel::Rope, at_ns, &rope(at_ns, nodes, motion.radii_m))?;
            }
        }
        Ok(())
    }
}

/// Results of a run's folder as they are now, for those who come late.
#[derive(Debug)]
pub struct LatestResults {
    run: PathBuf,
    /// When each file was written that was read last, and what it holds; nothing where it cannot
    /// be read.
    kept: [Option<(SystemTime, Option<Value>)>; FILES.len()],
}

impl LatestResults {
    /// Those of `run`.
    pub fn of(run: &Path) -> Self {
        Self {
            run: run.to_owned(),
            kept: [const { None }; FILES.len()],
        }
    }

    /// The run's folder.
    pub fn folder(&self) -> &Path {
        &self.run
    }

    /// Tells all that there are: plan, identified rope, figures.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn tell(&mut self, sink: &mut impl Sink) -> Result<()> {
        let at_ns = Clock::compare().now_ns();
        for ((name, channel, field), kept) in FILES.into_iter().zip(&mut self.kept) {
            let path = self.run.join(name);
            let written = path.metadata().and_then(|m| m.modified()).ok();
            let Some(written) = written.filter(|_| sink.wants(channel)) else {
                continue;
            };
            if kept.as_ref().is_none_or(|(at, _)| *at != written) {
                *kept = Some((written, read_or_warn(&path)));
            }
            if let Some((_, Some(value))) = kept {
                sink.message(channel, at_ns, &message(at_ns, field, value))?;
            }
        }
        Ok(())
    }
}

fn message(at_ns: u64, field: &str, value: &Value) -> Value {
    json!({ "timestamp": time(at_ns), field: value })
}

fn read_or_warn(path: &Path) -> Option<Value> {
    let read = read(path);
    read.map_err(|reason| tracing::warn!("a result is left out: {reason:#}"))
        .ok()
}

/// A JSON or TOML file as JSON.
fn read(path: &Path) -> Result<Value> {
    if path.extension().is_some_and(|e| e == "toml") {
        let table: toml::Table = toml::from_str(&files::read_text(path)?)?;
        return Ok(serde_json::to_value(table)?);
    }
    files::read_json(path)
}
