//! What latencies are found from, and what is found.

use anyhow::Context;
use arm_model::ArmResponse;
use arm_model::response::Excitation;
use planner::arm_response::delay::TargetDelay;
use rt_controller::bridge::Latencies;
use run_log::{Cycles, Run, files};
use std::path::{Path, PathBuf};

/// File written into the run folder.
pub(super) const RESPONSE_FILE: &str = "arm-response.toml";

/// What was recorded, live or before.
pub(super) struct Evidence {
    /// Arm or run.
    pub source: String,
    /// Run folder.
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
}

/// Everything that was found.
pub(super) struct Findings {
    pub latencies: Latencies,
    pub target_delay: Option<TargetDelay>,
    pub response: ArmResponse,
    pub camera_offset_s: Option<f64>,
}

/// A recorded run as evidence.
///
/// # Errors
/// The run holds no recording, or a file of it is damaged.
pub(super) fn recorded(run: &Path) -> anyhow::Result<Evidence> {
    let cycles = Run::open(run)?.recording()?.cycles()?;
    Ok(Evidence {
        camera_offset_s: camera_offset_s(&run.join(files::ROPE))?,
        ..Evidence::of(format!("run {}", run.display()), run, cycles)
    })
}

/// The offset that `wag identify` and `wag demo` leave in their result (s).
fn camera_offset_s(path: &Path) -> anyhow::Result<Option<f64>> {
    if !path.is_file() {
        return Ok(None);
    }
    let table: toml::Table = toml::from_str(&files::read_text(path)?)
        .with_context(|| format!("`{}`", path.display()))?;
    Ok(table
        .get("fit")
        .and_then(|fit| fit.get("time_offset_s"))
        .and_then(toml::Value::as_float))
}
