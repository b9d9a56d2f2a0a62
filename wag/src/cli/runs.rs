//! The commands that look at one run.

use super::values::{TASKS, host, one_of, span_s};
use super::{ArmPorts, CameraArgs};
use clap::{Args, Subcommand};
use cli_output::seed;
use shared_types::Task;
use std::net::{IpAddr, SocketAddr};
use std::path::PathBuf;
use telemetry::TelemetryArgs;

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct RecordArgs {
    #[command(subcommand)]
    pub instead: Option<RecordCommand>,
    /// Run folder of a running command; its controller is recorded.
    #[arg(conflicts_with = "domain")]
    pub run: Option<PathBuf>,
    /// Shared-memory domain of the controller, as in its configuration, whether it
    /// runs yet or not. Default: that of the only controller that runs.
    #[arg(long)]
    pub domain: Option<String>,
    /// Stop after this long (s); default: on Ctrl-C.
    #[arg(long, value_parser = span_s)]
    pub seconds: Option<f64>,
    /// Limits of the arm (TOML), laid over the effective ones and stored in the recording.
    #[arg(long)]
    pub limits: Option<PathBuf>,
    /// Folder for the run; it must not exist. Default: runs/TIME-record.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Subcommand)]
pub enum RecordCommand {
    /// Repair a run.mcap whose recorder was killed: at most its last second is
    /// missing then. A complete file stays as it is.
    Recover {
        /// The file.
        #[arg(value_name = "FILE.mcap")]
        file: PathBuf,
    },
}

#[derive(Debug, Args)]
#[command(after_help = "EXAMPLES:\n  \
    wag watch                       whichever run began last, then the next\n  \
    wag watch runs/NAME             a run that is under way\n  \
    wag watch --domain cell-1       a controller or camera that runs as a daemon\n  \
    wag watch --preview             with the rope's keypoints as the frames come\n  \
    wag watch --foxglove            for the application Foxglove, at ws://127.0.0.1:8765\n  \
    wag watch --ros2                for ROS 2, over DDS\n\n\
    The address it prints holds a secret: whoever knows it can look on and stop the arm.\n\
    From another machine: ssh -L PORT:127.0.0.1:PORT HOST, then the same address.")]
pub struct WatchArgs {
    /// Run folder of a running command. Default: the controller that started last, and
    /// after its end the next.
    #[arg(conflicts_with = "domain")]
    pub run: Option<PathBuf>,
    /// Shared-memory domain of a controller or a camera, whether it runs yet or not.
    #[arg(long)]
    pub domain: Option<String>,
    /// Address and port of the page; port 0 takes any free one. Anything but loopback
    /// lets other machines watch and stop the arm, without encryption.
    #[arg(long, value_name = "ADDR:PORT", default_value = "127.0.0.1:0")]
    pub bind: SocketAddr,
    /// Find the rope in the first seconds of a motion and draw its keypoints from
    /// then on. A process of the lowest priority does it while this page is served.
    #[arg(long)]
    pub preview: bool,
    /// Calibration for the preview; default: camera.toml in the run folder.
    #[arg(long, value_name = "camera.toml", requires = "preview")]
    pub camera: Option<PathBuf>,
    #[command(flatten)]
    pub telemetry: TelemetryArgs,
    /// Stop after this long (s); default: on Ctrl-C.
    #[arg(long, value_parser = span_s)]
    pub seconds: Option<f64>,
}

#[derive(Debug, Args)]
#[command(after_help = "EXAMPLES:\n  \
    wag studio                      on a simulated rig of its own\n  \
    wag studio --arm 192.168.1.200 --camera /dev/video0 --target-rgb 38,168,74\n\n\
    Limits and measured response come from the folder of configurations. The address that it \
    prints holds a secret: a page on this machine is the operator, who answers what a run asks and \
    holds the control that lets the arm move. From another machine one looks and stops, not more.")]
pub struct StudioArgs {
    /// Address or name of the arm's controller. Default: a simulated rig.
    #[arg(long = "arm", value_name = "ADDR", value_parser = host, requires = "camera")]
    pub address: Option<IpAddr>,
    /// Controller that runs as a service, by its shared-memory domain.
    #[arg(
        long,
        value_name = "NAME",
        conflicts_with = "address",
        requires = "camera"
    )]
    pub controller: Option<String>,
    #[command(flatten)]
    pub ports: ArmPorts,
    #[command(flatten)]
    pub camera: CameraArgs,
    /// Colour of the target, or of a lob's domino, R,G,B from 0 to 255.
    #[arg(long)]
    pub target_rgb: Option<String>,
    /// Who operates the arm, for the runs' records. Default: the user's name.
    #[arg(long, value_name = "NAME")]
    pub operator: Option<String>,
    /// What throws on the simulated rig are for: its camera stands so that it sees that.
    #[arg(long, default_value = "strike", value_parser = one_of(TASKS))]
    pub task: Task,
    /// Seed of the simulated rig's rope and noise.
    #[arg(long, default_value_t = 1, value_parser = seed)]
    pub seed: u64,
    /// Folder of the runs.
    #[arg(long, value_name = "DIR", default_value = run_log::ledger::RUNS)]
    pub runs: PathBuf,
    /// Address and port of the page; port 0 takes any free one.
    #[arg(long, value_name = "ADDR:PORT", default_value = "127.0.0.1:0")]
    pub bind: SocketAddr,
}
