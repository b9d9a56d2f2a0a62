//! What latencies are found from.

use anyhow::Context;
use arm_model::response::Excitation;
use planner::arm_response::{Recording, Sample, Setpoint};
use rt_controller::bridge::Latencies;
use run_log::{Cycles, Run, files};
use shared_types::MonotonicNs;
use std::path::{Path, PathBuf};

/// What was recorded, live or before.
pub(super) struct Evidence {
    /// Arm or run.
    pub source: String,
    pub folder: PathBuf,
    /// Control cycles and joint reports.
    pub run: Cycles,
    /// Whether the reports tell the arm's own targets.
    pub has_targets: bool,
    /// The motion it was measured with.
    pub excitation: Option<Excitation>,
    /// How much later the camera's clock is than the arm's (s), if known.
    pub camera_offset_s: Option<f64>,
}

impl Evidence {
    /// What a folder's cycles show alone.
    pub(super) fn of(source: String, folder: &Path, run: Cycles) -> Self {
        Self {
            source,
            folder: folder.to_owned(),
            has_targets: run.joints.iter().any(|r| r.arm_clock != 0),
            run,
            excitation: None,
            camera_offset_s: None,
        }
    }

    /// A recorded run as evidence.
    ///
    /// # Errors
    /// The run holds no recording, or a file of it is damaged.
    pub(super) fn recorded(path: &Path) -> anyhow::Result<Self> {
        let run = Run::open(path)?;
        let cycles = run.recording()?.cycles()?;
        Ok(Self {
            camera_offset_s: camera_offset_s(&run.folder().join(files::ROPE))?,
            ..Self::of(format!("run {}", path.display()), run.folder(), cycles)
        })
    }

    /// Setpoints when they were sent and joints when they were measured, both in
    /// seconds since the first cycle.
    pub(super) fn recording(&self, latencies: &Latencies) -> Recording {
        let cycles = &self.run.cycles;
        let epoch = MonotonicNs(cycles.first().map_or(0, |c| c.deadline_ns));
        let sent = cycles.iter().filter(|c| c.sent != 0);
        let mut setpoints: Vec<Setpoint> = sent
            .map(|c| Setpoint {
                sent_s: MonotonicNs(c.deadline_ns).since_s(epoch)
                    + 1e-9 * (f64::from(c.wake_late_ns) + f64::from(c.send_ns)),
                q: c.q_c,
            })
            .collect();
        setpoints.sort_by(|a, b| a.sent_s.total_cmp(&b.sent_s));
        setpoints.dedup_by(|next, kept| next.sent_s <= kept.sent_s);
        let first_s = setpoints.first().map_or(0.0, |s| s.sent_s);
        let samples = self.run.reports().into_iter().map(|r| Sample {
            at_s: MonotonicNs(r.stamp_ns).since_s(epoch),
            q: r.q,
            q_target: self.has_targets.then_some(r.q_target),
        });
        Recording {
            setpoints,
            samples: samples.filter(|s| s.at_s >= first_s).collect(),
            round_trip_s: 1e-6 * latencies.report().reply.p50_us,
        }
    }
}

/// The offset that `wag identify` and `wag demo` leave in their result (s).
fn camera_offset_s(path: &Path) -> anyhow::Result<Option<f64>> {
    if !path.is_file() {
        return Ok(None);
    }
    let table: toml::Table = toml::from_str(&files::read_text(path)?)
        .with_context(|| format!("`{}`", path.display()))?;
    let offset = table.get("fit").and_then(|fit| fit.get("time_offset_s"));
    Ok(offset.and_then(toml::Value::as_float))
}
