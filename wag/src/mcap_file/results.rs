//! What becomes known after the fact: plan, parameters, the rope, the figures. The
//! files of the run folder appear whole, so one that is there can be taken in.

use super::channel::Channel;
use super::clock::{Clock, time};
use super::scene::rope;
use super::writer::McapFile;
use crate::{files, report};
use serde_json::{Value, json};
use shared_types::MonotonicNs;
use std::path::{Path, PathBuf};

/// Every second frame of the report's 60 Hz.
const ROPE_EVERY: usize = 2;
/// Files that come while the run goes on, with their channels and fields.
const FILES: [(&str, Channel, &str); 3] = [
    ("plan.json", Channel::Plan, "plan"),
    ("params.toml", Channel::Parameters, "parameters"),
    ("summary.json", Channel::Summary, "summary"),
];

/// Results of a run folder, each taken in once.
#[derive(Debug)]
pub struct Results {
    run: PathBuf,
    taken: [bool; FILES.len()],
}

impl Results {
    /// Those of `run`, none of them yet.
    pub fn of(run: &Path) -> Self {
        Self {
            run: run.to_owned(),
            taken: [false; FILES.len()],
        }
    }

    /// Takes in what has appeared.
    pub fn look(&mut self, file: &mut McapFile, clock: Clock) -> anyhow::Result<()> {
        for ((name, channel, field), taken) in FILES.into_iter().zip(&mut self.taken) {
            let path = self.run.join(name);
            if *taken || !path.is_file() {
                continue;
            }
            *taken = true;
            match read(&path) {
                Ok(value) => {
                    let at_ns = clock.now_ns();
                    let message = json!({ "timestamp": time(at_ns), field: value });
                    file.json(channel, at_ns, &message)?;
                }
                Err(reason) => tracing::warn!("not in the recording: {reason:#}"),
            }
        }
        Ok(())
    }

    /// The identified rope on the motions of the run, once its figures are there.
    pub fn simulate(&self, file: &mut McapFile, clock: Clock) -> anyhow::Result<()> {
        let Ok(summary) = read(&self.run.join("summary.json")) else {
            return Ok(());
        };
        let Some(epoch_ns) = summary["epoch_ns"].as_u64() else {
            return Ok(());
        };
        let scenes = match report::scenes(&self.run) {
            Ok(scenes) => scenes,
            Err(reason) => {
                tracing::warn!("no rope in the recording: {reason:#}");
                return Ok(());
            }
        };
        for scene in scenes {
            for (index, nodes) in scene.rope.iter().enumerate().step_by(ROPE_EVERY) {
                let t_s = scene.begin_s + scene.from_s + index as f64 * scene.period_s;
                let at_ns = clock.wall_ns(MonotonicNs(epoch_ns).plus_s(t_s).0);
                file.json(Channel::Rope, at_ns, &rope(at_ns, nodes, scene.radii_m))?;
            }
        }
        Ok(())
    }
}

/// A JSON or TOML file as JSON.
fn read(path: &Path) -> anyhow::Result<Value> {
    let text = files::read_text(path)?;
    Ok(if path.extension().is_some_and(|e| e == "toml") {
        serde_json::to_value(toml::from_str::<toml::Table>(&text)?)?
    } else {
        serde_json::from_str(&text)?
    })
}
