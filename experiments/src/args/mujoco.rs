//! Arguments of what is compared with ropes that MuJoCo simulates.

use super::ResultArgs;
use clap::{Args, ValueEnum};
use cli_output::seed;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Arguments of results with ropes that MuJoCo simulates.
#[derive(Debug, Args)]
pub struct MujocoArgs {
    #[command(flatten)]
    pub result: ResultArgs,
    /// Links in MuJoCo for each of the rope's own; bending stiffness and damping stay.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=4))]
    pub refinement: u32,
    /// Plan for this many ropes drawn from the posterior, as `wag plan --robust`; 0 plans for the
    /// most likely rope alone.
    #[arg(long, default_value_t = 0, value_name = "K")]
    pub robust: usize,
    /// Throw out of the swing of a short wiggle, as `wag run --fast`, where that is worth it.
    #[arg(long, conflicts_with = "robust")]
    pub fast: bool,
}

impl MujocoArgs {
    /// What distinguishes trials made with these from others, beside seed and method.
    pub fn remark(&self) -> String {
        let Self {
            refinement,
            robust,
            fast,
            ..
        } = self;
        match robust {
            0 if *fast => format!(", refined {refinement} times, out of the swing"),
            0 => format!(", refined {refinement} times"),
            _ => format!(", refined {refinement} times, robust over {robust} ropes"),
        }
    }
}

/// Arguments of `experiments other-reality`.
#[derive(Debug, Args)]
pub struct OtherRealityArgs {
    #[command(flatten)]
    pub mujoco: MujocoArgs,
    /// What differs from the model; again for more. Default: each in turn, then all at once.
    #[arg(long = "channel", value_name = "NAME", value_enum)]
    pub channels: Vec<ChannelName>,
}

/// How reality differs from the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChannelName {
    /// Not at all, but for the finer links.
    None,
    /// Hysteretic friction in bending, of 2 to 20 % of the moment at a clamp turned by 6 to 17
    /// degrees.
    Friction,
    /// The unloaded rope is curved, by 0.2 to 0.6 rad/m.
    Curvature,
    /// The rope swings by 1 to 4 degrees when the wiggle begins.
    Sway,
    /// The air drags, quadratically in the speed.
    Drag,
    /// The rope leaves the pole 1 degree off its axis.
    ClampTilt,
    /// The camera stands 5 mm and looks 0.5 degree off its calibration.
    Camera,
    /// Joint zeros are 0.2 degree off, and joints lag behind by 10 to 22 ms.
    Joints,
    /// All of these.
    All,
}

/// Arguments of `experiments contact-dynamics`.
#[derive(Debug, Args)]
pub struct ContactDynamicsArgs {
    /// A scene by name; again for more. Default: all ten.
    #[arg(long = "scene", value_name = "NAME")]
    pub scenes: Vec<String>,
    /// Step of the simulator (ms), at most that of throws, the default.
    #[arg(long, default_value_t = 0.5, value_name = "MS", value_parser = step_ms)]
    pub step_ms: f64,
    /// Threads; the result does not depend on them.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: u16,
    /// Result file (JSON).
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Arguments of `experiments rope-accuracy`.
#[derive(Debug, Args)]
pub struct RopeAccuracyArgs {
    /// Ropes, each wiggled and thrown.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub ropes: u64,
    /// Seed of the ropes, their targets and the searches for throws.
    #[arg(long, default_value_t = 1, value_parser = seed)]
    pub seed: u64,
    /// Threads; the result does not depend on them.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: u16,
    /// Result file (JSON).
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// A step at which contacts are trusted.
fn step_ms(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(step_ms) if (0.01..=0.5).contains(&step_ms) => Ok(step_ms),
        _ => Err(format!("`{text}` is not a step from 0.01 to 0.5 ms")),
    }
}
