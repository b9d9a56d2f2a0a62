//! Arguments of `wag plan`, `wag check` and `wag rope`.

use super::Point;
use super::values::{mass_kg, one_of};
use clap::{Args, Subcommand};
use cli_output::seed;
use shared_types::CommandInterface;
use std::path::PathBuf;

/// What every plan is made with.
#[derive(Debug, Args)]
pub struct PlannerArgs {
    /// Limits of the arm (TOML), laid over the effective ones (`wag config show limits`).
    #[arg(long)]
    pub limits: Option<PathBuf>,
    /// Tuned values of the planner (TOML), laid over the effective ones (`wag config show
    /// planner`).
    #[arg(long)]
    pub config: Option<PathBuf>,
    /// The arm's response as written by `wag latency` (TOML): the throw is planned for an
    /// arm with this response, and its commands compensate for it.
    #[arg(long, value_name = "FILE")]
    pub arm_response: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct PlanArgs {
    /// Rope parameters.
    #[arg(long)]
    pub rope: PathBuf,
    /// Go on although the track of the rope is unconfirmed.
    #[arg(long)]
    pub accept_unconfirmed: bool,
    /// Target x,y,z in the arm's base frame (m).
    #[arg(long, allow_hyphen_values = true)]
    pub target: Point,
    #[command(flatten)]
    pub planner: PlannerArgs,
    /// Seed of the search; a strike from the library hardly depends on it.
    #[arg(long, default_value_t = 1, value_parser = seed)]
    pub seed: u64,
    /// Search the durations of the throw's segments too: each up to this many times as
    /// long or as short as configured (1 to 2). 1 keeps them; default: the configuration.
    #[arg(long, value_name = "FACTOR")]
    pub segment_stretch: Option<f64>,
    /// The plan (JSON).
    #[arg(long)]
    pub out: PathBuf,
    /// Also the joints as CSV with columns t,q1..q7 (s, rad) at 250 Hz.
    #[arg(long)]
    pub csv: Option<PathBuf>,
    /// Write the plan even if the tip is predicted, or forecast in the median, to miss the
    /// target by more than 5 cm, or the task to fail.
    #[arg(long)]
    pub allow_miss: bool,
    /// Plan for this many ropes drawn from the posterior of identification; 0 plans for the
    /// most likely rope alone.
    #[arg(long, default_value_t = 0, value_name = "K")]
    pub robust: usize,
    /// Draw the reachable targets of this rope (SVG), and refuse a target that is not reachable.
    #[arg(long, value_name = "FILE")]
    pub reach: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct AgainArgs {
    /// Run folder of a throw or a demo, which holds plan and miss; or the plan that was thrown
    /// (JSON).
    pub last: PathBuf,
    /// Where the tip passed, minus the target, as `wag score` prints it: x,y,z in the arm's
    /// base frame (m). Default: as the run keeps it (`wag score --run`).
    #[arg(long, allow_hyphen_values = true)]
    pub miss: Option<Point>,
    #[command(flatten)]
    pub planner: PlannerArgs,
    /// Write the plan even if it is predicted to pass its aim by more than 5 cm.
    #[arg(long)]
    pub allow_miss: bool,
    /// The corrected plan (JSON).
    #[arg(long)]
    pub out: PathBuf,
}

#[derive(Debug, Args)]
pub struct CheckArgs {
    /// The plan.
    pub plan: PathBuf,
    /// Limits of the arm (TOML), laid over the effective ones (`wag config show limits`).
    #[arg(long)]
    pub limits: Option<PathBuf>,
    /// Command interface: how setpoints reach the arm.
    #[arg(long, alias = "wire", default_value = "servo", value_parser = one_of([
        ("servo", "Joint positions, the arm's mode 1", CommandInterface::ServoPosition),
        ("velocity", "Joint velocities, the arm's mode 4", CommandInterface::JointVelocity),
    ]))]
    pub interface: CommandInterface,
    /// Linear speed limit set in the arm, as a factor of 1 m/s (servo only).
    #[arg(long, default_value_t = 1.2, value_name = "FACTOR")]
    pub speed_factor: f64,
    /// Safety boundary set in the arm: x-,x+,y-,y+,z-,z+ of the tool (m).
    #[arg(
        long,
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        value_name = "SIDES"
    )]
    pub fence: Option<Vec<f64>>,
}

#[derive(Debug, Subcommand)]
pub enum RopeCommand {
    /// Write a rope file from what can be measured; the rest are guesses.
    New(NewRopeArgs),
}

#[derive(Debug, Args)]
pub struct NewRopeArgs {
    /// Length by tape, clamp to the lead's centre (m).
    #[arg(long, value_name = "M")]
    pub length: Option<f64>,
    /// Mass of the rope without its lead, by scale (kg).
    #[arg(long, value_name = "KG", value_parser = mass_kg)]
    pub rope_mass: Option<f64>,
    /// Mass of the lead, by scale (kg).
    #[arg(long, value_name = "KG", value_parser = mass_kg)]
    pub lead_mass: Option<f64>,
    /// Radius of the rope (m).
    #[arg(long, value_name = "M")]
    pub radius: Option<f64>,
    /// Radius of the lead (m).
    #[arg(long, value_name = "M")]
    pub lead_radius: Option<f64>,
    /// The rope (TOML).
    #[arg(long)]
    pub out: PathBuf,
}
