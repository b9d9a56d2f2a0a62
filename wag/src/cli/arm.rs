//! The commands that move an arm, the one that simulates it, and those that measure its
//! control loop.

use super::values::{TASKS, host, one_of};
use super::{CameraArgs, Point};
use clap::{ArgGroup, Args, ValueEnum};
use cli_output::seed;
use shared_types::Task;
use std::net::IpAddr;
use std::path::PathBuf;

/// Ports of an arm's controller.
#[derive(Debug, Args)]
pub struct ArmPorts {
    /// Command port.
    #[arg(long, default_value_t = 502)]
    pub command_port: u16,
    /// Report port with joint states (250 Hz).
    #[arg(long, default_value_t = 30000)]
    pub report_port: u16,
    /// Report port with the arm's status (5 Hz), the rich report.
    #[arg(long, default_value_t = 30002)]
    pub status_port: u16,
}

/// How to reach an arm.
#[derive(Debug, Args)]
pub struct ArmArgs {
    /// Address or name of the arm's controller.
    #[arg(long = "arm", value_name = "ADDR", value_parser = host)]
    pub address: Option<IpAddr>,
    /// Controller that runs as a service, by its shared-memory domain, instead of one started
    /// for this command: arm, limits and measured response are as that one is configured.
    #[arg(long, value_name = "NAME", conflicts_with_all = [
        "address", "command_port", "report_port", "status_port", "limits", "arm_response", "dry_run",
    ])]
    pub controller: Option<String>,
    /// Go on although the controller of --controller has stopped: you know why, and the arm may
    /// be enabled again.
    #[arg(long, requires = "controller", conflicts_with = "address")]
    pub acknowledge: bool,
    #[command(flatten)]
    pub ports: ArmPorts,
    /// The area is clear and the emergency stop is in reach for the bring-up and the move to
    /// the start pose. Confirmed at the terminal unless this is given or the arm proves that it is
    /// simulated.
    /// In the start pose a real arm's motion is confirmed at standard input all the same.
    #[arg(long, alias = "confirm")]
    pub yes: bool,
    /// Ask as for a real arm where the arm is simulated, too, for practice.
    #[arg(long)]
    pub ask: bool,
    /// Who operates the arm, for the run's record. Default: the user's name.
    #[arg(long, value_name = "NAME")]
    pub operator: Option<String>,
    /// Limits of the arm (TOML), laid over the effective ones (`wag config show limits`).
    #[arg(long)]
    pub limits: Option<PathBuf>,
    /// How the arm follows its setpoints, as written by `wag latency` (TOML): its joints are
    /// compared with that. A real arm needs it for a wiggle or a throw; its default is
    /// arm-response.toml in the folder of configurations (~/.config/wag).
    #[arg(long, value_name = "FILE")]
    pub arm_response: Option<PathBuf>,
    /// Check the motion against the limits and stop there: connects to nothing,
    /// needs no --arm.
    #[arg(long)]
    pub dry_run: bool,
    /// Watch standard input, as for every real arm: Enter, any other input that was not asked
    /// for, or its end stops the arm.
    #[arg(long)]
    pub dead_man: bool,
    /// Use standard input as a hold-to-run control: the arm moves only while Enter is held down
    /// (or a button's driver sends empty lines, at least every 0.3 s).
    #[arg(long, conflicts_with = "dead_man")]
    pub hold_to_run: bool,
}

impl ArmArgs {
    /// Whether an arm is named.
    pub const fn names_arm(&self) -> bool {
        self.address.is_some() || self.controller.is_some()
    }
}

#[derive(Debug, Args)]
pub struct WiggleArgs {
    /// Report how well it identifies ropes of the ranges, compared with the paper's wiggle.
    #[arg(long, conflicts_with = "camera")]
    pub evaluate: bool,
    /// Search for the most informative wiggle within the limits and report how well it does.
    #[arg(long, conflicts_with = "camera")]
    pub optimise: bool,
    /// Seed of the ropes a wiggle is judged by.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Write the wiggle as CSV with columns t,q1..q7 (s, rad) at 250 Hz.
    #[arg(long, conflicts_with = "camera")]
    pub csv: Option<PathBuf>,
    #[command(flatten)]
    pub camera: CameraArgs,
    /// Keep the film although the track of the rope is unconfirmed.
    #[arg(long, requires = "camera")]
    pub accept_unconfirmed: bool,
    #[command(flatten)]
    pub arm: ArmArgs,
    /// Folder for the run; it must not exist. Default: runs/TIME-wiggle.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(group(ArgGroup::new("thrown").args(["plan", "again"]).required(true)))]
pub struct ThrowArgs {
    /// The plan.
    pub plan: Option<PathBuf>,
    /// Throw the strike of this run again, changed so that its miss is taken out; the run keeps
    /// plan and miss (`wag score --run`), or --miss names where the tip passed.
    #[arg(long, value_name = "RUN")]
    pub again: Option<PathBuf>,
    /// Where the tip passed, minus the target: x,y,z in the arm's base frame (m).
    #[arg(
        long,
        allow_hyphen_values = true,
        requires = "again",
        conflicts_with = "plan"
    )]
    pub miss: Option<Point>,
    /// Go on although the track of the rope is unconfirmed.
    #[arg(long)]
    pub accept_unconfirmed: bool,
    #[command(flatten)]
    pub arm: ArmArgs,
    /// Folder for the run; it must not exist. Default: runs/TIME-throw.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct LatencyArgs {
    /// Arm to move: one joint after the other, a small sweep of rising frequency.
    #[command(flatten)]
    pub arm: ArmArgs,
    /// Folder of a recorded run to read instead.
    #[arg(long, conflicts_with_all = ["address", "controller", "joints", "excitation", "seed", "out"])]
    pub run: Option<PathBuf>,
    /// Measure how long and how far the arm goes on when it is stopped, instead of how its joints
    /// follow: swings of joint 1 as fast as set-up motions, wiggles and throws may be, stopped by
    /// the controller and by the arm itself.
    #[arg(long, conflicts_with_all = ["run", "joints", "excitation", "seed", "response", "dry_run"])]
    pub stops: bool,
    /// Joints to move (1 to 7); default: all.
    #[arg(long, value_delimiter = ',', value_parser = clap::value_parser!(u8).range(1..=7))]
    pub joints: Vec<u8>,
    /// Shape of the motion (TOML); default: the built-in one. In its pose the tool is
    /// far from the axes of joints 1 and 3, which the allowed tool speed then keeps
    /// too slow to be measured: set another with `pose_rad`.
    #[arg(long, value_name = "FILE")]
    pub excitation: Option<PathBuf>,
    /// Seed of the phases the motion begins with; default: the motion's own.
    #[arg(long, value_parser = seed)]
    pub seed: Option<u64>,
    /// Folder for the run; it must not exist. Default: runs/TIME-latency.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// The arm's response (TOML). Default: arm-response.toml in the run folder, where
    /// one that is there already is kept.
    #[arg(long)]
    pub response: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct RigArgs {
    /// Address to listen on. Anything but loopback lets others drive the simulated arm.
    #[arg(long, default_value = "127.0.0.1")]
    pub bind: IpAddr,
    /// Command port; 0 takes any free one.
    #[arg(long, default_value_t = 502)]
    pub command_port: u16,
    /// Report ports instead of 30000,30001,30002,30003; 0 takes any free one.
    #[arg(
        long,
        value_delimiter = ',',
        num_args = 1,
        default_value = "30000,30001,30002,30003"
    )]
    pub report_ports: Vec<u16>,
    /// Script of faults to inject; configs/rig/faults.toml shows every kind.
    #[arg(long, value_name = "FILE")]
    pub faults: Option<PathBuf>,
    /// Rope on the pole; `random` draws one from the seed. Default: no rope.
    #[arg(long, value_name = "FILE|random")]
    pub rope: Option<String>,
    /// Publish the simulated camera in this shared-memory domain (needs --rope).
    #[arg(long, value_name = "DOMAIN")]
    pub camera: Option<String>,
    /// What throws will be for: the camera stands so that it sees that.
    #[arg(long, default_value = "strike", value_parser = one_of(TASKS))]
    pub task: Task,
    /// Seed of the hidden rope and the noise.
    #[arg(long, default_value_t = 1, value_parser = seed)]
    pub seed: u64,
    /// Process without which it ends.
    #[arg(long, hide = true)]
    pub parent: Option<u32>,
}

#[derive(Debug, Args)]
pub struct BenchArgs {
    /// What to measure.
    #[arg(value_enum)]
    pub name: BenchName,
    /// Seconds instead of a minute, rough figures.
    #[arg(long)]
    pub quick: bool,
    /// Seed of the simulated rig of `record`.
    #[arg(long, default_value_t = 5, value_parser = seed)]
    pub seed: u64,
    /// `rt`, `record`: time of each contender (s).
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    pub seconds: u32,
    /// `rt`: core of the control loop; default: the last one.
    #[arg(long)]
    pub cpu: Option<usize>,
}

/// Benchmarks known by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BenchName {
    /// The control loop: wake-up latency compared with `cyclictest`, times within a cycle.
    Rt,
    /// Recording: times within a control cycle without and with the recorder.
    Record,
}
