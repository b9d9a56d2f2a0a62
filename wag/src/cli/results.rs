//! Arguments of what measures: bench, reproduce.

use super::MethodName;
use clap::{Args, ValueEnum};
use cli_output::seed;
use std::path::PathBuf;

/// Arguments of `wag bench`.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// What to measure.
    #[arg(value_enum)]
    pub name: BenchName,
    /// Few candidates, once each: seconds instead of a minute, rough figures.
    #[arg(long)]
    pub quick: bool,
    /// Seed of the ropes and motions.
    #[arg(long, default_value_t = 5, allow_negative_numbers = true, value_parser = seed)]
    pub seed: u64,
    /// `rt`, `record`: time of each contender (s).
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    pub seconds: u32,
    /// `rt`: core of the control loop; default: the last one.
    #[arg(long)]
    pub cpu: Option<usize>,
    /// `track`: folder with video.avi, camera.toml and pose.csv or joints.csv.
    #[arg(long)]
    pub video: Option<PathBuf>,
    /// `track`: the tracker that sees every frame once, in its order.
    #[arg(long)]
    pub live: bool,
}

/// Benchmarks known by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BenchName {
    /// The rope simulator: kernels, jobs, scaling.
    Rope,
    /// The control loop: wake-up error beside `cyclictest`, times within a cycle.
    Rt,
    /// Identification: time of each method.
    Identify,
    /// Planning: time of one throw of each task, and what it is spent on.
    Plan,
    /// Recording: times within a control cycle without and with the recorder.
    Record,
    /// Tracking: time of each stage per frame, and memory, on a recorded wiggle.
    Track,
}

/// Arguments of `wag reproduce`.
#[derive(Debug, Args)]
pub struct ReproduceArgs {
    /// Which result.
    #[arg(value_enum)]
    pub name: ReproduceName,
    /// Simulated ropes; default: 1000, for sim-pipeline 100, for wiggle-ablation 24 with
    /// each wiggle, for lob-drape its own 24, for robust 200,
    /// for parameter-importance 30, for sensitivity-maps 8
    /// (motion-fidelity has its own).
    #[arg(long)]
    pub ropes: Option<u64>,
    /// Seed of the ropes, the films and the searches.
    #[arg(long, default_value_t = 1)]
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
    /// Result file (JSON); a run that was broken off goes on from it. A picture of the
    /// result (SVG) is drawn beside it.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Results known by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ReproduceName {
    /// Errors of identified parameters (the paper's in-domain table) and coverage.
    Sysid,
    /// Telling ropes outside the parameter ranges from those inside.
    SysidOod,
    /// Errors of identified parameters with each of the paper's nine wiggles.
    WiggleAblation,
    /// Motion of an identified rope in a throw it was not identified from.
    MotionFidelity,
    /// Error of planned strikes: true, identified and random parameters.
    SimPipeline,
    /// Success of lobs and drapes planned with identified parameters.
    LobDrape,
    /// Strikes planned for every rope it might be, beside plain ones, and their forecasts.
    Robust,
    /// Error of strikes planned with only some parameters identified.
    ParameterImportance,
    /// What in a film the network's answer hangs on, parameter by parameter.
    SensitivityMaps,
}
