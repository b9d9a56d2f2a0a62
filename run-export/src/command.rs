//! `wag export` as it is typed.

use crate::{Write, csv, foxglove, lerobot, npz, ros2};
use clap::{Args, Subcommand};
use cli_output::{OrInput, Outcome, output, println, watch_interrupts};
use serde_json::Value;
use std::path::PathBuf;

/// A recorded run in another format.
#[derive(Debug, Subcommand)]
pub enum ExportCommand {
    /// Control cycles and measured joints as cycles.csv and joints.csv in the folder OUT.
    Csv(ExportArgs),
    /// Cycles, joints, keypoints, plan and rope as arrays for numpy, in the file run.npz or OUT.
    Npz(ExportArgs),
    /// A bag of ROS 2 (MCAP), in the folder ros2 or OUT: it must not exist, or be an earlier one,
    /// which is replaced; in builds with `--features ros2` only.
    Ros2(ExportArgs),
    /// The recording with Foxglove's messages in Protobuf (MCAP), for Foxglove and Rerun, in the
    /// file run.foxglove.mcap or OUT; in builds with `--features foxglove` only.
    Foxglove(ExportArgs),
    /// Runs as one data set for LeRobot (format v3.0), an episode each; in builds with
    /// `--features lerobot` only.
    Lerobot(LerobotArgs),
}

/// What, and where to.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// Run folder, or its file run.mcap (cycles.bin of an older version).
    pub run: PathBuf,
    /// Where to. Default: into the run folder.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// Which runs, where to, and how fast.
#[derive(Debug, Args)]
pub struct LerobotArgs {
    /// Run folders, which must agree in rate, size of pictures and number of keypoints.
    #[arg(value_name = "RUN", required = true)]
    pub runs: Vec<PathBuf>,
    /// Folder for the data set: it must not exist, or be an earlier one, which is replaced.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Frames per second. Default: as many as pictures were recorded.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=250))]
    pub fps: Option<u32>,
}

impl ExportCommand {
    /// Writes it, and tells people what was written, and programs all of it.
    ///
    /// # Errors
    /// The run cannot be read, or lacks what the format needs, or the export cannot be written.
    pub fn run(&self) -> Outcome<Value> {
        // Half a folder does not stay behind.
        watch_interrupts().or_failed()?;
        let of_run = |args: &ExportArgs, write: Write| write(&args.run, args.out.as_deref());
        let (format, written) = match self {
            Self::Csv(args) => ("csv", of_run(args, csv)),
            Self::Npz(args) => ("npz", of_run(args, npz)),
            Self::Ros2(args) => ("ros2", of_run(args, ros2)),
            Self::Foxglove(args) => ("foxglove", of_run(args, foxglove)),
            Self::Lerobot(args) => ("lerobot", lerobot(&args.runs, &args.out, args.fps)),
        };
        let written = written?;
        for file in &written.files {
            println!("{} ({} {})", file.path.display(), file.count, file.of);
        }
        for missing in &written.missing {
            match self {
                // Of several runs, each flaw names its own.
                Self::Lerobot(_) => output::remark(format_args!("{missing}")),
                _ => output::remark(format_args!("not in this run: {missing}")),
            }
        }
        Ok(written.report(format))
    }
}
