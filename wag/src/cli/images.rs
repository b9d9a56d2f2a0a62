//! Arguments of what looks: film, track, score, calib.

use super::SceneArgs;
use super::values::{Colour, one_of, rate_hz};
use camera_ingest::calib::VideoMode;
use clap::{ArgGroup, Args, Subcommand};
use std::path::PathBuf;

/// What films.
#[derive(Debug, Args)]
pub struct CameraArgs {
    /// Who films: the shared-memory domain of a camera that runs (`wag rig --camera DOMAIN`,
    /// `wag process camera`), or a device of this machine, /dev/videoN.
    #[arg(long, value_name = "DOMAIN|DEVICE")]
    pub camera: Option<String>,
    /// Calibration and extrinsics of that camera (camera.toml). Default: camera.toml in the folder
    /// of configurations (~/.config/wag); a simulated rig tells its own.
    #[arg(long, value_name = "FILE", requires = "camera")]
    pub calibration: Option<PathBuf>,
    /// Keep the films of wiggle and throw whole, both images, in the run's folder: 1 MB a frame
    /// of 672x376, 0.6 GB a run; else it keeps the left image as JPEG at half the rate.
    #[arg(long, requires = "camera")]
    pub keep_films: bool,
}

#[derive(Debug, Args)]
pub struct FilmArgs {
    /// The camera, /dev/videoN.
    #[arg(long)]
    pub device: PathBuf,
    /// Size of one image: VGA 672x376, HD 1280x720, FHD 1920x1080, 2K 2208x1242.
    #[arg(long, default_value = "VGA", value_parser = one_of([
        ("VGA", "672x376", VideoMode::Vga),
        ("HD", "1280x720", VideoMode::Hd),
        ("FHD", "1920x1080", VideoMode::FullHd),
        ("2K", "2208x1242", VideoMode::TwoK),
    ]))]
    pub mode: VideoMode,
    /// Frames per second.
    #[arg(long, default_value_t = 60)]
    pub fps: u32,
    /// Frames to record.
    #[arg(long, default_value_t = 400, value_parser = clap::value_parser!(u64).range(1..=36_000))]
    pub frames: u64,
    /// The camera's standard gain control.
    #[arg(long)]
    pub gain: Option<i32>,
    /// Exposure in the sensor's own units; disables automatic exposure (ZED only).
    #[arg(long)]
    pub exposure_raw: Option<u32>,
    /// Gain in the sensor's own units (ZED only).
    #[arg(long, requires = "exposure_raw")]
    pub sensor_gain_raw: Option<u32>,
    /// Prefix of the file names: NAME_WIDTHxHEIGHT.yuyv and .csv.
    #[arg(long, value_name = "NAME")]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub struct TrackArgs {
    /// AVI file, raw NAME_WIDTHxHEIGHT.yuyv, folder with video.avi or with PNG or JPEG
    /// pictures, and timestamps.csv, or a run: its folder or run.mcap.
    #[arg(long)]
    pub video: PathBuf,
    /// Frames per second, for a recording that does not tell its frames' times.
    #[arg(long, value_parser = rate_hz)]
    pub fps: Option<f64>,
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Keypoints per frame.
    #[arg(long, default_value_t = 20)]
    pub keypoints: usize,
    #[command(flatten)]
    pub models: ModelArgs,
    /// Keypoints drawn in: a film if the name ends in .avi, else a contact sheet (PNG).
    #[arg(long)]
    pub overlay: Option<PathBuf>,
    /// Keypoints (JSON).
    #[arg(long)]
    pub out: PathBuf,
}

/// A learned model instead of a part of the tracker.
#[derive(Debug, Args)]
pub struct ModelArgs {
    /// ONNX point tracker that follows the rope through the film once it is found, instead
    /// of the one camera.toml names or the built-in reading.
    #[arg(long, value_name = "ONNX")]
    pub tracker: Option<PathBuf>,
}

/// A stereo film and what filmed it.
#[derive(Debug, Args)]
pub struct StereoArgs {
    /// AVI file, raw NAME_WIDTHxHEIGHT.yuyv, or folder with video.avi or with PNG or
    /// JPEG pictures, and timestamps.csv.
    #[arg(long)]
    pub video: PathBuf,
    /// Frames per second, for a recording that does not tell its frames' times.
    #[arg(long, value_parser = rate_hz)]
    pub fps: Option<f64>,
    /// Camera calibration and extrinsics; `wag calib check` checks the extrinsics.
    #[arg(long)]
    pub camera: PathBuf,
}

#[derive(Debug, Args)]
pub struct ScoreArgs {
    /// The film, as `wag track` takes it. Default: that of the throw, of a run with --keep-films.
    #[arg(long)]
    pub video: Option<PathBuf>,
    /// Frames per second, for a recording that does not tell its frames' times.
    #[arg(long, value_parser = rate_hz, requires = "video")]
    pub fps: Option<f64>,
    /// Camera calibration and extrinsics; may be left out with --run.
    #[arg(long)]
    pub camera: Option<PathBuf>,
    /// Colour of the tip, R,G,B from 0 to 255; may be left out with --run.
    #[arg(long)]
    pub tip_rgb: Option<Colour>,
    /// Colour of the target or of a lob's domino, R,G,B from 0 to 255; may be left out with --run.
    #[arg(long)]
    pub target_rgb: Option<Colour>,
    /// Folder of the throw's run, which tells camera and colours and keeps the miss, for `--again`,
    /// or the verdict on a lob or drape.
    #[arg(long, value_name = "RUN")]
    pub run: Option<PathBuf>,
}

/// The camera's extrinsics.
#[derive(Debug, Subcommand)]
pub enum CalibCommand {
    /// Estimate the camera's extrinsics and write them into a camera.toml.
    Extrinsics {
        #[command(flatten)]
        shown: ShownArgs,
        /// The camera's settings with the estimated extrinsics (TOML).
        #[arg(long)]
        out: PathBuf,
    },
    /// Compare the extrinsics in camera.toml with what the camera sees.
    Check {
        #[command(flatten)]
        shown: ShownArgs,
        /// Largest residual that passes (px, RMS over both images).
        #[arg(long, default_value_t = 2.0)]
        limit_px: f64,
    },
}

/// What the camera is shown.
#[derive(Debug, Args)]
#[command(group(ArgGroup::new("shown").args(["board", "lead"]).required(true)))]
pub struct ShownArgs {
    #[command(flatten)]
    pub film: StereoArgs,
    /// Printed ChArUco board that hangs still (board.toml); a build from source reads it with
    /// `--features calibration` only.
    #[arg(long, conflicts_with = "lead_rgb")]
    pub board: Option<PathBuf>,
    /// The arm shows its lead: CSV with columns frame,x,y,z (m, world).
    #[arg(long, requires = "lead_rgb")]
    pub lead: Option<PathBuf>,
    /// Colour of that lead, R,G,B from 0 to 255.
    #[arg(long)]
    pub lead_rgb: Option<Colour>,
}
