//! The command line.

mod arm;
mod config;
mod images;
mod ledger;
mod plans;
mod run;
mod runs;
mod values;

pub use arm::*;
pub use config::*;
pub use images::*;
pub use ledger::*;
pub use plans::*;
pub use run::*;
pub use runs::*;
pub use values::Point;

use values::{host, mass_kg, offset_ms, one_of, rate_hz};

use clap::{Args, Parser, Subcommand, ValueEnum};
use cli_output::seed;
use planner::identify::{Method, tape_length_m};
use rope_sim::Precision;
use std::net::IpAddr;
use std::path::PathBuf;

/// Heading of what every command takes, below its own options.
const GLOBAL: &str = "Global options";

/// Identify a rope from one wiggle, plan a throw, execute it.
#[derive(Debug, Parser)]
#[command(
    name = "wag",
    version,
    about = "Wiggle and Go: identify a rope from one wiggle, plan a throw, execute it",
    after_help = "EXAMPLES:\n  \
        wag demo                                   everything, on a simulated robot\n  \
        wag run strike --arm ADDR --camera /dev/video0 --target 0.9,0,0.3\n  \
        wag rig --command-port 5502                a simulated xArm 7 for your own client\n  \
        wag plan strike --rope rope.toml --target 1.0,0,0.4 --out plan.json\n  \
        wag check plan.json\n\n\
        Exit codes: 0 done, 1 ran and failed, 2 bad usage or input."
)]
pub struct Cli {
    /// Print one JSON object on standard output and nothing else there.
    #[arg(long, global = true, help_heading = GLOBAL)]
    pub json: bool,
    /// Seed of everything random; a command without chance takes it and ignores it.
    #[arg(long, global = true, help_heading = GLOBAL, value_parser = seed)]
    pub seed: Option<u64>,
    /// The cell: the pole on the arm, and what stands around it (TOML, as
    /// configs/cell/lab.toml); it contains only what differs. Default: that of the
    /// run, else the effective one.
    #[arg(long, global = true, help_heading = GLOBAL, value_name = "FILE")]
    pub cell: Option<PathBuf>,
    /// Log more to standard error (-v info, -vv debug).
    #[arg(short, long, global = true, help_heading = GLOBAL, action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Tell the program that runs this one how far it is: one JSON object a line on standard
    /// error, after a record separator.
    #[arg(long, global = true, hide = true)]
    pub events: bool,
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The whole pipeline on a simulated rig with a hidden random rope.
    Demo(DemoArgs),
    /// From wiggle to throw with an arm and a camera: film, identify, plan, throw, score.
    Run(RunArgs),
    /// Run the simulated xArm 7 as a server, with a rope and a camera if asked.
    Rig(RigArgs),
    /// Simulate a rope.
    #[command(subcommand)]
    Sim(SimCommand),
    /// Write the wiggle as joint positions, or execute it on an arm.
    Wiggle(WiggleArgs),
    /// Record a stereo camera as a raw film that `wag track` and `wag score` read.
    Film(FilmArgs),
    /// Track the rope through a video.
    Track(TrackArgs),
    /// Identify the rope parameters from a video or from keypoints.
    Identify(IdentifyArgs),
    /// Write a rope file to begin with.
    #[command(subcommand)]
    Rope(RopeCommand),
    /// Plan a throw.
    #[command(subcommand)]
    Plan(PlanCommand),
    /// Check a plan against the arm's limits: every margin, where and when.
    Check(CheckArgs),
    /// Execute a plan on an arm, record it, measure latencies.
    Throw(ThrowArgs),
    /// Measure latencies: the control loop, each joint, the camera.
    Latency(LatencyArgs),
    /// Live web view of a run: arm, rope, camera, control loop.
    Watch(WatchArgs),
    /// The page where one works: target, wiggle, plan, throw, result, history.
    Studio(StudioArgs),
    /// Attach to a running controller and record every one of its cycles.
    Record(RecordArgs),
    /// Replay a recorded run through the controller's core, compared bit-exactly.
    Replay {
        /// Run folder, or its file run.mcap (cycles.bin of an older version).
        run: PathBuf,
        /// First cycle to compare; the core is stepped from the keyframe before.
        #[arg(long, default_value_t = 0)]
        from_cycle: u64,
    },
    /// Report why a run was stopped, or its margins to the limits.
    Explain {
        /// Run folder, or its file run.mcap (cycles.bin of an older version).
        run: PathBuf,
    },
    /// Write a recorded run in another format: tables, arrays for numpy, files of other programs.
    #[command(subcommand)]
    Export(run_export::ExportCommand),
    /// Write a run as one HTML file: replay in space, joints, limits, rope, times.
    Report {
        /// Run folder.
        run: PathBuf,
        /// The report; default: report.html in the run folder.
        #[arg(long, value_name = "FILE.html")]
        out: Option<PathBuf>,
    },
    /// List runs, compare two of them, rerun one.
    Ledger(LedgerArgs),
    /// Measure the closest approach of tip and target in a stereo video; judge a lob or drape by
    /// its film again.
    Score(ScoreArgs),
    /// Estimate or check the camera's extrinsics.
    #[command(subcommand)]
    Calib(CalibCommand),
    /// Measure the timing of the control loop on this machine.
    Bench(BenchArgs),
    /// Show the effective configuration or check files: built in, site, rig, run.
    #[command(subcommand)]
    Config(ConfigCommand),
    /// Check whether this machine is fit to drive an arm, and how to fix what is not.
    Doctor {
        /// Address or name of an arm's controller to check too; nothing on it is changed.
        #[arg(long = "arm", value_name = "ADDR", value_parser = host)]
        address: Option<IpAddr>,
        #[command(flatten)]
        ports: ArmPorts,
    },
    /// Write man pages, one for each command.
    Man {
        /// Folder for the pages; made if it does not exist.
        #[arg(value_name = "DIR")]
        folder: PathBuf,
    },
    /// Print a shell completion script.
    Completions {
        /// Shell.
        #[arg(value_enum)]
        shell: clap_complete::Shell,
    },
    /// Run one of the processes in the foreground (what `wag` itself starts).
    #[command(hide = true)]
    Process(ProcessArgs),
}

#[derive(Debug, Subcommand)]
pub enum SimCommand {
    /// Free simulation of a rope under a prescribed motion of its attach frame.
    Rope(SimRopeArgs),
    /// Arm, pole and rope driven by a joint trajectory.
    Throw(SimThrowArgs),
}

#[derive(Debug, Args)]
pub struct SimRopeArgs {
    /// Rope parameters.
    #[arg(long)]
    pub rope: PathBuf,
    /// Attach-frame pose: CSV with columns t,x,y,z,qw,qx,qy,qz.
    #[arg(long)]
    pub pose: PathBuf,
    /// Frames per second of the output.
    #[arg(long)]
    pub fps: f64,
    /// Integration step (s).
    #[arg(long, default_value_t = 5e-4)]
    pub dt: f64,
    /// Arithmetic.
    #[arg(long, default_value = "f64", value_parser = one_of([
        ("f32", "Single precision, vector lanes", Precision::F32),
        ("f64", "Double precision", Precision::F64),
    ]))]
    pub precision: Precision,
    /// Rotation vector of joint 0 at the start (rad), x,y,z.
    #[arg(long, allow_hyphen_values = true, default_value = "0,0,0")]
    pub initial_joint0: Point,
    /// Start hanging at rest below the first pose instead of straight.
    #[arg(long, conflicts_with = "initial_joint0")]
    pub hanging: bool,
    /// Node positions, float64 .npy of shape (frames, links+1, 3).
    #[arg(long)]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub struct SimThrowArgs {
    /// Rope parameters.
    #[arg(long)]
    pub rope: PathBuf,
    /// Joint trajectory: CSV with columns t,q1..q7 (s, rad).
    #[arg(long)]
    pub joints: PathBuf,
    /// Integration step (s).
    #[arg(long, default_value_t = 5e-4)]
    pub dt: f64,
    /// Tip positions: CSV with columns t,x,y,z at 240 Hz.
    #[arg(long)]
    pub out: PathBuf,
}

/// Camera and motion of a recorded wiggle; a run's file contains both.
#[derive(Debug, Args)]
pub struct SceneArgs {
    /// Camera calibration and extrinsics (camera.toml); default for a run: the one in its file.
    #[arg(long)]
    pub camera: Option<PathBuf>,
    #[command(flatten)]
    pub motion: MotionArgs,
    /// Which of a run's motions that were streamed to the arm; default: 1, the wiggle. A
    /// demo's second one damps the swing, its third is the throw.
    #[arg(long, value_name = "N", requires = "video")]
    pub part: Option<usize>,
    /// Delay of the film's clock against the motion's, as `wag track` reports it (ms).
    #[arg(long, value_name = "MS", default_value_t = 0.0, value_parser = offset_ms)]
    pub film_late_ms: f64,
}

/// How the rope's clamp moved; a run's file contains it.
#[derive(Debug, Args)]
#[group(multiple = false)]
pub struct MotionArgs {
    /// Measured joints: CSV with columns t,q1..q7 (s, rad); t = 0 is the first frame.
    /// Default for a run: those in its file.
    #[arg(long)]
    pub joints: Option<PathBuf>,
    /// Attach-frame pose: CSV with columns t,x,y,z,qw,qx,qy,qz; t = 0 is the first frame.
    #[arg(long)]
    pub pose: Option<PathBuf>,
}

impl MotionArgs {
    /// Whether one is named.
    pub const fn is_given(&self) -> bool {
        self.joints.is_some() || self.pose.is_some()
    }
}

/// Where the observation of a wiggle comes from.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct ObservationArgs {
    /// Recording as `wag track` takes it.
    #[arg(long)]
    pub video: Option<PathBuf>,
    /// Keypoints as written by `wag track`; or the folder of a run whose wiggle was tracked, which
    /// tells camera and motion itself.
    #[arg(long)]
    pub keypoints: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct IdentifyArgs {
    #[command(flatten)]
    pub observation: ObservationArgs,
    /// Frames per second, for a recording without frame times.
    #[arg(long, value_parser = rate_hz, requires = "video")]
    pub fps: Option<f64>,
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Method.
    #[arg(long, default_value = "hybrid", value_parser = one_of([
        ("nn", "The network alone: at once, for the built-in wiggle only", Method::Network),
        ("cmaes", "The paper's Φ-CMA-ES: a wide search of the simulator, then refined", Method::Cmaes),
        (
            "hybrid",
            "A quick proposal of the network, or of a search where the film is out of its \
             distribution, then refined",
            Method::Hybrid,
        ),
        ("hybrid-search", "A quick proposal of a search, then refined", Method::HybridSearch),
    ]))]
    pub method: Method,
    /// Network for --method nn and hybrid instead of the built-in one (ONNX, written by
    /// phi-train).
    #[arg(long, value_name = "FILE")]
    pub model: Option<PathBuf>,
    /// Mass of the lead if it was weighed (kg); fixes the absolute masses.
    #[arg(long, value_parser = mass_kg)]
    pub lead_mass: Option<f64>,
    /// Length of the rope measured by tape, clamp to lead centre (m); taken to be right to 2 mm.
    #[arg(long, value_name = "M", value_parser = tape_length_m)]
    pub length: Option<f64>,
    /// Seed of the search.
    #[arg(long, default_value_t = 1, value_parser = seed)]
    pub seed: u64,
    /// Go on although the track of the rope is unconfirmed.
    #[arg(long)]
    pub accept_unconfirmed: bool,
    /// Rope parameters with their uncertainty (TOML).
    #[arg(long)]
    pub out: PathBuf,
}

#[derive(Debug, Subcommand)]
pub enum PlanCommand {
    /// The tip passes through the target.
    Strike(PlanArgs),
    /// The tip lands on a board and stays.
    Lob(PlanArgs),
    /// The rope comes to hang over a wall.
    Drape(PlanArgs),
    /// The last strike corrected by its miss: the same throw, hardly changed.
    Again(AgainArgs),
}

#[derive(Debug, Args)]
pub struct ProcessArgs {
    /// Which process.
    #[arg(value_enum)]
    pub name: ProcessName,
    /// Its configuration file.
    #[arg(long)]
    pub config: PathBuf,
    /// End when the parent is not this process any more.
    #[arg(long)]
    pub parent: Option<u32>,
}

/// Processes known by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ProcessName {
    /// Simulated rig.
    Rig,
    /// Real-time controller.
    RtController,
    /// Stops the arm when the controller is lost.
    Guardian,
    /// A stereo camera's frames into shared memory.
    Camera,
    /// Camera frames to keypoints.
    CameraIngest,
    /// Keypoints of the rope during filming, for display.
    Preview,
    /// Identification and planning.
    Planner,
    /// Records a run as one file.
    Recorder,
}

#[cfg(test)]
mod tests {
    use super::values::Colour;
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn every_command_takes_a_seed_before_or_after_its_name() {
        let of = |args: &[&str]| cli_output::parse::<Cli>(args.iter().map(Into::into));
        let demo = |args: &[&str]| match of(args).unwrap().command {
            Command::Demo(demo) => demo.seed,
            other => panic!("{other:?}"),
        };
        assert_eq!(demo(&["wag", "demo"]), 1);
        assert_eq!(demo(&["wag", "demo", "--seed", "7"]), 7);
        assert_eq!(demo(&["wag", "--seed", "7", "demo"]), 7);
        let check = of(&["wag", "check", "p", "--seed", "3"]).unwrap();
        assert_eq!(check.seed, Some(3));
        for line in ["ledger --seed 3", "ledger --seed-is 3", "--seed 3 ledger"] {
            let line: Vec<&str> = ["wag"].into_iter().chain(line.split(' ')).collect();
            let Command::Ledger(args) = of(&line).unwrap().command else {
                panic!("another command");
            };
            assert_eq!(args.seed, Some(3));
        }
        of(&["wag", "ledger", "compare", "a", "b", "--seed", "3"]).unwrap();
        for bad in ["-1", "1.5", "x"] {
            let said = of(&["wag", "demo", "--seed", bad]).unwrap_err().to_string();
            assert!(said.contains("whole number from 0"), "{said}");
        }
    }

    #[test]
    fn points_and_colours_are_checked() {
        assert_eq!("1, -0.5,0".parse(), Ok(Point([1.0, -0.5, 0.0])));
        for bad in ["1,2", "1,2,x", "1,2,nan", "", "1,2,3,4"] {
            assert!(bad.parse::<Point>().is_err(), "{bad}");
        }
        assert_eq!("0,128,255".parse(), Ok(Colour([0, 128, 255])));
        assert!("0,128,256".parse::<Colour>().is_err());
    }
}
