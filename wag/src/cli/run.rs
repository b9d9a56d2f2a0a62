//! Arguments of what goes from wiggle to throw: run, demo.

use super::values::{Colour, TASKS, mass_kg, one_of};
use super::{ArmArgs, CameraArgs, Point};
use clap::{ArgGroup, Args};
use cli_output::seed;
use planner::identify::tape_length_m;
use shared_types::Task;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(
    group(ArgGroup::new("entry").args(["from", "again"])),
    after_help = "EXAMPLES:\n  \
        wag run strike --arm 192.168.1.200 --camera /dev/video0 --target 0.9,0,0.3 --target-rgb 38,168,74\n  \
        wag run --from plan runs/RUN --arm 192.168.1.200 --camera /dev/video0\n  \
        wag run --again runs/RUN --arm 192.168.1.200 --camera /dev/video0\n\n\
        Rehearsal: `wag rig --rope random --camera lab` in another terminal, then\n  \
        wag run strike --arm 127.0.0.1 --camera lab"
)]
pub struct RunArgs {
    /// What the throw is for. Default: strike, or what the run resumed was for.
    #[arg(value_parser = one_of(TASKS))]
    pub task: Option<Task>,
    #[command(flatten)]
    pub camera: CameraArgs,
    /// Target x,y,z in the arm's base frame (m). Default: that of the run resumed; in front of
    /// a simulated rig's camera, one drawn from the seed, where the rig puts its ball.
    #[arg(long, allow_hyphen_values = true)]
    pub target: Option<Point>,
    /// Resume an earlier run at one of these stages: identify (with its keypoints), plan (with its
    /// rope), throw (with its plan).
    #[arg(long, num_args = 2, value_names = ["STAGE", "RUN"])]
    pub from: Vec<String>,
    /// Throw the strike of this run again, changed so that its miss is taken out.
    #[arg(long, value_name = "RUN", conflicts_with_all = [
        "task", "target", "lead_mass", "length", "robust", "dry_run", "seed",
    ])]
    pub again: Option<PathBuf>,
    /// Colour of the target, or of a lob's domino, R,G,B from 0 to 255: by it the film of the
    /// throw tells how much it missed, or whether the domino fell.
    #[arg(long)]
    pub target_rgb: Option<Colour>,
    /// Colour of the tip, R,G,B from 0 to 255. Default: as it was tracked through the wiggle.
    #[arg(long)]
    pub tip_rgb: Option<Colour>,
    /// Mass of the lead if it was weighed (kg); fixes the absolute masses.
    #[arg(long, value_parser = mass_kg)]
    pub lead_mass: Option<f64>,
    /// Length of the rope measured by tape, clamp to lead centre (m); taken to be right to 2 mm.
    #[arg(long, value_name = "M", value_parser = tape_length_m)]
    pub length: Option<f64>,
    /// Plan for this many ropes drawn from the posterior of identification.
    #[arg(long, default_value_t = 0, value_name = "K")]
    pub robust: usize,
    /// Strike out of the swing that a short wiggle leaves, without calming the rope: half the
    /// time. It is calmed, with a warning, where the forecast is too wide or the plan too late.
    /// Wiggled again at length where no rope explains the short film. Where somebody confirms each
    /// motion, THROW is asked for before the plan is made.
    #[arg(long, conflicts_with_all = ["from", "again", "robust", "keep_films"])]
    pub fast: bool,
    /// Go on although the track of the rope is unconfirmed.
    #[arg(long)]
    pub accept_unconfirmed: bool,
    /// Seed of every search.
    #[arg(long, default_value_t = 1, value_parser = seed)]
    pub seed: u64,
    #[command(flatten)]
    pub arm: ArmArgs,
    /// Folder for the run; it must not exist. Default: runs/TIME-run.
    #[arg(long)]
    pub out: Option<PathBuf>,
}

/// Where an earlier run is resumed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FromStage {
    Identify,
    Plan,
    Throw,
}

impl RunArgs {
    /// Which run is resumed, and where; `Err` says what is known instead.
    pub fn from(&self) -> Result<Option<(FromStage, PathBuf)>, String> {
        let (stage, run) = match self.from.as_slice() {
            [] => return Ok(None),
            [stage, run] => (stage, run),
            _ => return Err("--from resumes one run: name it once".to_owned()),
        };
        let stage = match stage.as_str() {
            "identify" => FromStage::Identify,
            "plan" => FromStage::Plan,
            "throw" => FromStage::Throw,
            other => {
                return Err(format!(
                    "--from {other}: a run can be resumed at identify, plan or throw"
                ));
            }
        };
        Ok(Some((stage, run.into())))
    }
}

#[derive(Debug, Args)]
pub struct DemoArgs {
    /// What the throw is for.
    #[arg(long, default_value = "strike", value_parser = one_of(TASKS))]
    pub task: Task,
    /// Seed of the hidden rope, the target, the noise and every search. When frames are taken is the
    /// machine's affair, so that two demos of one seed differ a little.
    #[arg(long, default_value_t = 1, value_parser = seed)]
    pub seed: u64,
    /// Folder for the run; it must not exist. Default: runs/TIME-demo-SEED.
    #[arg(long)]
    pub out: Option<PathBuf>,
    /// Target x,y,z in the arm's base frame (m); default: random from the seed.
    #[arg(long, allow_hyphen_values = true)]
    pub target: Option<Point>,
    /// Set-up of the simulated rig (TOML), as configs/rig/demo.toml; default: that
    /// file. Domain, seed, ports and target are the demo's own.
    #[arg(long, value_name = "FILE")]
    pub rig_config: Option<PathBuf>,
    /// Strike out of the swing that a short wiggle leaves, without calming the rope: half the
    /// time. It is calmed, with a warning, where the forecast is too wide or the plan too late.
    #[arg(long, conflicts_with = "again")]
    pub fast: bool,
    /// Go on although the track of the rope is unconfirmed.
    #[arg(long)]
    pub accept_unconfirmed: bool,
    /// Throw at the target of this demo again, with its rope, corrected by the miss that its
    /// camera measured; again for a third throw, with the run of the second.
    #[arg(long, value_name = "RUN", conflicts_with_all = [
        "task", "seed", "target", "rig_config",
    ])]
    pub again: Option<PathBuf>,
}
