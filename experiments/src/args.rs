//! The command line.

use crate::figures::FiguresCommand;
use clap::{Args, Parser, Subcommand, ValueEnum};
use cli_output::seed;
use planner::identify::Method;
use std::ops::RangeInclusive;
use std::path::PathBuf;

mod mujoco;
mod shard;
mod submit;

pub use mujoco::{
    ChannelName, ContactDynamicsArgs, MujocoArgs, OtherRealityArgs, RopeAccuracyArgs,
};
pub use shard::Shard;
pub use submit::{EngineName, MergeArgs, SubmitArgs};

/// Reproduce a result of the paper, or measure how fast this machine runs a part of the
/// system, on simulated ropes.
#[derive(Debug, Parser)]
#[command(
    name = "experiments",
    version,
    after_help = "Exit codes: 0 done, 1 ran and failed, 2 bad usage or input."
)]
pub struct Cli {
    /// Print one JSON object on standard output and nothing else there.
    #[arg(long, global = true)]
    pub json: bool,
    /// Log more to standard error (-v info, -vv debug).
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Measure how fast this machine runs a part of the system.
    Bench(BenchArgs),
    /// Film simulated wiggles in drawn rooms, with the truth in their pixels.
    Rooms(RoomsArgs),
    /// Count the wiggles in drawn rooms that the tracker follows, refuses and gets wrong.
    TrackRooms(TrackRoomsArgs),
    /// Make the library of throws that plans of strikes begin with.
    ///
    /// Takes a second for each search; interrupted, it keeps nothing. The library that comes with
    /// this version is configs/models/throws.bin, compiled into the programs.
    Throws(ThrowsArgs),
    /// Figures of README and book: make them, write them into the documents, check these.
    #[command(subcommand)]
    Figures(FiguresCommand),
    /// Join the shards of a study.
    Merge(MergeArgs),
    /// Make a study in many processes: start its shards, watch them, try again, merge.
    Submit(SubmitArgs),
    /// A result of the paper.
    #[command(flatten)]
    Result(ResultCommand),
}

/// Results known by name.
#[derive(Debug, Subcommand)]
pub enum ResultCommand {
    /// Errors of identified parameters (the paper's in-domain table) and coverage.
    Sysid(ResultArgs),
    /// Detection of ropes outside the parameter ranges.
    SysidOod(ResultArgs),
    /// Errors of identified parameters with each of the paper's nine wiggles.
    WiggleAblation(ResultArgs),
    /// Motion of an identified rope in a throw it was not identified from.
    MotionFidelity(ResultArgs),
    /// Error of planned strikes: true, identified and random parameters.
    SimPipeline(ResultArgs),
    /// Success of lobs and drapes planned with identified parameters, leads weighed and not.
    LobDrape(ResultArgs),
    /// Robust strikes compared with plain ones, and the coverage of their forecasts.
    Robust(ResultArgs),
    /// Error of strikes planned with only some parameters identified.
    ParameterImportance(ResultArgs),
    /// Sensitivity of the network's answer to each keypoint, parameter by parameter.
    SensitivityMaps(ResultArgs),
    /// Miss of strikes with ropes that MuJoCo simulates, with what the equations leave out.
    ///
    /// Needs a Python with MuJoCo, named by WAG_MUJOCO_PYTHON. Tune with odd seeds only: even
    /// ones are reserved for judging.
    OtherReality(OtherRealityArgs),
    /// The paper's full pipeline with five kinds of rope in six configurations that MuJoCo simulates,
    /// with all that the equations leave out at once; beside it throws planned for unrelated ropes.
    ///
    /// Needs a Python with MuJoCo, named by WAG_MUJOCO_PYTHON. Tune with odd seeds only: even
    /// ones are reserved for judging.
    FullPipeline(MujocoArgs),
    /// Motion of a real rope, fitted to some recordings of it and predicted for others.
    ///
    /// Reads the recordings of a foam cylinder at https://github.com/shamilmamedov/PRB_Net (commit
    /// a9c478d6, folder dataset/pool-noodle), which are not part of this program: fetch them. Takes
    /// about a minute; interrupted, it keeps nothing.
    RealDlo(RealDloArgs),
    /// Motion of ropes that touch a board, a domino, a wall or a floor, beside MuJoCo's.
    ///
    /// Needs a Python with MuJoCo, named by WAG_MUJOCO_PYTHON. Takes minutes; interrupted, it keeps
    /// nothing.
    ContactDynamics(ContactDynamicsArgs),
    /// How far the simulator's steps take a rope's tip from MuJoCo's, in wiggles and throws.
    ///
    /// Needs a Python with MuJoCo, named by WAG_MUJOCO_PYTHON. Takes a minute for each two ropes;
    /// interrupted, it keeps nothing.
    RopeAccuracy(RopeAccuracyArgs),
}

/// Arguments of `experiments real-dlo`.
#[derive(Debug, Args)]
pub struct RealDloArgs {
    /// Folder with the recordings: traj1.csv and so on.
    #[arg(value_name = "DIR")]
    pub dir: PathBuf,
    /// Recordings that the rope is fitted to, by number; it is judged on the others.
    #[arg(
        long,
        value_name = "N,N,…",
        value_delimiter = ',',
        default_value = "1,3,5"
    )]
    pub fitted: Vec<u32>,
    /// Threads; the result does not depend on them.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: u16,
    /// Result file (JSON). A picture of the distances (SVG) is drawn next to it.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Arguments of a result.
#[derive(Debug, Args)]
pub struct ResultArgs {
    /// Simulated ropes; default: 1000, for sim-pipeline 100, for wiggle-ablation 24 with
    /// each wiggle, for lob-drape 30, for robust 200,
    /// for parameter-importance 30, for sensitivity-maps 8, for other-reality 20 with each
    /// channel, for full-pipeline 30 (motion-fidelity has its own).
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    pub ropes: Option<u64>,
    /// Seed of the ropes, the films and the searches.
    #[arg(long, default_value_t = 1, value_parser = seed)]
    pub seed: u64,
    /// Method.
    #[arg(long, value_enum, default_value_t = MethodName::Hybrid)]
    pub method: MethodName,
    /// Threads; the result does not depend on them. Default: those of the configuration, 2.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Network for --method nn and hybrid instead of the built-in one (ONNX, written by
    /// phi-train).
    #[arg(long, value_name = "FILE")]
    pub model: Option<PathBuf>,
    /// Result file (JSON); the same program resumes from it when it was interrupted. A picture of the result
    /// (SVG) is drawn next to it.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Make a part of the trials only, 2/8 for the second of eight; `experiments merge` joins
    /// them.
    #[arg(long, value_name = "I/N", requires = "out", default_value_t = Shard::WHOLE, hide_default_value = true)]
    pub shard: Shard,
}

/// Which films, and how many at once.
#[derive(Debug, Args)]
pub struct FilmArgs {
    /// How hard it is to see the rope.
    #[arg(long, value_enum, default_value_t = KindName::Ordinary)]
    pub kind: KindName,
    /// Seeds, one or from-to. Even seeds from 1000000 on are reserved for judging.
    #[arg(long, value_name = "A-B", value_parser = seeds)]
    pub seeds: RangeInclusive<u64>,
    /// Threads; neither films nor results depend on them. Default: one a processor.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

/// Arguments of `experiments throws`.
#[derive(Debug, Args)]
pub struct ThrowsArgs {
    /// Searches, each for a random rope and target of its own.
    #[arg(long, default_value_t = 400, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub searches: u32,
    /// Throws kept of each search, about 270 bytes each.
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub kept: u16,
    /// Seed of ropes, targets and searches.
    #[arg(long, default_value_t = 1, value_parser = seed)]
    pub seed: u64,
    /// Threads; the library does not depend on them. Default: one a processor.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Library to write.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

/// Arguments of `experiments rooms`.
#[derive(Debug, Args)]
pub struct RoomsArgs {
    #[command(flatten)]
    pub which: FilmArgs,
    /// Folder for the films, each in a folder of its own named KIND-SEED.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// Arguments of `experiments track-rooms`.
#[derive(Debug, Args)]
pub struct TrackRoomsArgs {
    #[command(flatten)]
    pub which: FilmArgs,
    /// Folder of films, as `experiments rooms` writes them; missing ones are rendered into
    /// it. Left out, each film is rendered anew and removed.
    #[arg(long, value_name = "DIR")]
    pub films: Option<PathBuf>,
    /// Folder for the results, a file a seed; the same program resumes from it when it was
    /// interrupted. Name a new one for another tracker.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Kinds of room.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum KindName {
    /// As people have them; the rope stands out from the wall.
    Ordinary,
    /// With a rope in the wall's colour, somebody who walks by, cables, or glare.
    Hard,
}

/// `7` or `1-20`.
fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let (from, to) = text.split_once('-').unwrap_or((text, text));
    match (from.trim().parse::<u64>(), to.trim().parse::<u64>()) {
        (Ok(from), Ok(to)) if from <= to => Ok(from..=to),
        _ => Err(format!(
            "`{text}` is neither a seed nor two, the smaller first: 7 or 1-20"
        )),
    }
}

/// How to identify, as `wag identify --method`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum MethodName {
    /// The network alone.
    Nn,
    /// The paper's Φ-CMA-ES: a wide search of the simulator, then refined.
    Cmaes,
    /// A quick proposal of the network, or of a search where the film is
    /// out of its distribution, then refined.
    Hybrid,
    /// A quick proposal of a search, then refined.
    HybridSearch,
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Nn => Self::Network,
            MethodName::Cmaes => Self::Cmaes,
            MethodName::Hybrid => Self::Hybrid,
            MethodName::HybridSearch => Self::HybridSearch,
        }
    }
}

/// Arguments of `experiments bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// What to measure.
    #[arg(value_enum)]
    pub name: BenchName,
    /// Few candidates, once each: seconds instead of a minute, rough figures.
    #[arg(long)]
    pub quick: bool,
    /// Seed of the ropes and motions.
    #[arg(long, default_value_t = 5, value_parser = seed)]
    pub seed: u64,
    /// `track`: folder with video.avi, camera.toml and pose.csv or joints.csv.
    #[arg(long)]
    pub video: Option<PathBuf>,
}

/// Benchmarks known by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BenchName {
    /// The rope simulator: kernels, jobs, scaling.
    Rope,
    /// Identification: time of each method.
    Identify,
    /// Planning: time of one throw of each task, and what it is spent on.
    Plan,
    /// Planning strikes from the library of throws beside searching for them: time, and miss with
    /// ropes that differ by what identification leaves open.
    Library,
    /// Tracking: time of each stage per frame, and memory, on a recorded wiggle.
    Track,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_holds_together() {
        Cli::command().debug_assert();
    }
}
