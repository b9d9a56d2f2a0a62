//! Set-up of the rig, as read from a file or made in code.

use super::camera::CameraConfig;
use super::error::RigError;
use crate::hidden::hidden_rope;
use crate::render::Appearance;
use crate::room::{Kind, Room, RopeSurface};
use arm_model::joint::START_POSE;
use arm_model::{Cell, JOINTS, JointVector, Limits};
use serde::{Deserialize, Serialize};
use shared_types::{RopeParams, Task};
use std::net::IpAddr;
use xarm_sim::{ArmConfig, FaultScript, Firmware, Intake, JointLag, Obstacle};

/// Height (m) and upward tilt (rad) of a camera that looks down onto boards.
const BOARD_CAMERA: (f64, f64) = (0.60, -0.30);
/// How far in front of the arm a camera stands that sees both sides of walls (m).
const WALL_CAMERA_X_M: f64 = 1.05;

/// Rooms the rig may stand in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RoomChoice {
    /// A bright one with a plain wall, without shadows of moving things.
    #[default]
    Plain,
    /// The seed's [`Kind::Ordinary`] room.
    Ordinary,
}

/// Set-up of the simulated rig. Every key has a default; `seed` alone gives a
/// new rope, new colours and slightly different joints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RigConfig {
    /// Shared-memory domain the rig lives in.
    pub domain: String,
    /// Seed of rope, colours, joint lags and sensor noise.
    pub seed: u64,
    /// Address the arm listens on.
    pub bind: IpAddr,
    /// The arm's command port; 0 takes any free one.
    pub command_port: u16,
    /// The arm's report ports 30000, 30001, 30002, 30003; 0 takes any free one.
    pub report_ports: [u16; 4],
    /// How the joints follow setpoints.
    pub lag: JointLag,
    /// How each joint follows; left out, drawn from the seed around `lag`.
    pub joint_lags: Option<[JointLag; JOINTS]>,
    /// Firmware of the arm's controller.
    pub firmware: Firmware,
    /// What the controller's clock gains (µs/s).
    pub clock_ppm: f64,
    /// Whose clock paces setpoints.
    pub intake: Intake,
    /// The pole, and what stands around the arm.
    pub cell: Cell,
    /// What stands in the arm's way besides.
    pub obstacles: Vec<Obstacle>,
    /// Faults of arm and wire to inject.
    pub faults: FaultScript,
    /// Ranges, speeds and accelerations of the joints.
    pub limits: Limits,
    /// Pose at the start (rad).
    pub initial_q: JointVector,
    /// The rope; left out, it is drawn from the seed.
    pub rope: Option<RopeParams>,
    /// Colours; left out, they are drawn from the seed.
    pub appearance: Option<Appearance>,
    /// The room the camera sees behind the arm.
    pub room: RoomChoice,
    /// Centre of the target ball in the world (m); left out, there is none.
    pub target_m: Option<[f64; 3]>,
    /// The stereo camera.
    pub camera: CameraConfig,
}

impl Default for RigConfig {
    fn default() -> Self {
        let arm = ArmConfig::default();
        // Near the start pose, but not in it: the first thing to do is to move.
        let mut initial_q = START_POSE;
        initial_q[0] += 0.10;
        initial_q[1] -= 0.15;
        initial_q[5] -= 0.10;
        Self {
            domain: "rig".to_owned(),
            seed: 0,
            bind: arm.bind,
            command_port: arm.command_port,
            report_ports: arm.report_ports,
            lag: arm.lag,
            joint_lags: arm.joint_lags,
            firmware: arm.firmware,
            clock_ppm: arm.clock_ppm,
            intake: arm.intake,
            cell: Cell::default(),
            obstacles: arm.obstacles,
            faults: arm.faults,
            limits: arm.limits,
            initial_q,
            rope: None,
            appearance: None,
            room: RoomChoice::Plain,
            target_m: None,
            camera: CameraConfig::default(),
        }
    }
}

impl RigConfig {
    /// The same with a camera that sees what a task is thrown at: onto a board, and both sides
    /// of a wall.
    #[must_use]
    pub fn seeing(mut self, task: Task) -> Self {
        let camera = &mut self.camera;
        match task {
            Task::Strike => {}
            Task::Lob => (camera.position_m[2], camera.tilt_up_rad) = BOARD_CAMERA,
            Task::Drape => camera.position_m[0] = WALL_CAMERA_X_M,
        }
        self
    }

    /// The rope on the pole.
    #[must_use]
    pub fn rope(&self) -> RopeParams {
        self.rope.unwrap_or_else(|| hidden_rope(self.seed))
    }

    /// The drawn room, where one was chosen: with the camera's own noise, and with a plain
    /// rope where its colours are given.
    pub(crate) fn drawn_room(&self) -> Option<Room> {
        let mut room = match self.room {
            RoomChoice::Plain => return None,
            RoomChoice::Ordinary => Room::draw(self.seed, Kind::Ordinary),
        };
        room.picture.noise_levels = self.camera.noise_levels;
        if let Some(colours) = &self.appearance {
            room.rope = RopeSurface::plain(colours.rope_rgb, colours.lead_rgb);
        }
        Some(room)
    }

    /// Colours of rope, lead, target and wall.
    #[must_use]
    pub fn appearance(&self) -> Appearance {
        let own = Appearance::from_seed(self.seed);
        self.appearance
            .or_else(|| {
                self.drawn_room()
                    .map(|room| room.appearance(own.target_rgb))
            })
            .unwrap_or(own)
    }

    /// Set-up of the arm alone.
    #[must_use]
    pub fn arm(&self) -> ArmConfig {
        ArmConfig {
            bind: self.bind,
            command_port: self.command_port,
            report_ports: self.report_ports,
            seed: self.seed,
            lag: self.lag,
            joint_lags: self.joint_lags,
            firmware: self.firmware,
            clock_ppm: self.clock_ppm,
            intake: self.intake,
            cell: Some(self.cell),
            obstacles: self.obstacles.clone(),
            faults: self.faults.clone(),
            limits: self.limits.clone(),
            initial_q: self.initial_q,
            ..ArmConfig::default()
        }
    }
}

/// Refuses settings no thread could work with.
///
/// # Errors
/// [`RigError::Failed`]: the first number that makes no rig, and its limits.
pub fn check(config: &RigConfig) -> Result<(), RigError> {
    let camera = &config.camera;
    // The last row is exposed before the next frame begins.
    let rows = f64::from(camera.stereo_camera().height_px - 1);
    let spare_s = 1.0 / camera.frame_rate_hz - camera.exposure_s;
    let longest_line_s = (spare_s / rows * 1e9).floor().max(0.0) / 1e9;
    let noise_levels = f64::from(camera.noise_levels);
    let bounds = [
        ("frame_rate_hz", camera.frame_rate_hz, [1.0, 200.0]),
        ("exposure_s", camera.exposure_s, [1e-5, 0.1]),
        ("line_time_s", camera.line_time_s, [0.0, longest_line_s]),
        ("baseline_m", camera.baseline_m, [0.01, 1.0]),
        ("tilt_up_rad", camera.tilt_up_rad, [-1.5, 1.5]),
        ("latency_s", camera.latency_s, [0.0, 0.5]),
        ("noise_levels", noise_levels, [0.0, 40.0]),
    ];
    let mut bounds = bounds.into_iter();
    match bounds.find(|(_, value, [min, max])| !(*min..=*max).contains(value)) {
        None => Ok(()),
        Some((key, value, [min, max])) => Err(RigError::Failed(format!(
            "`camera.{key}` is {value}, but must lie between {min} and {max}"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_names_only_what_differs_and_typos_are_refused() {
        let text = "seed = 7\ncommand_port = 0\n[camera]\nenabled = false\n\
                    [[faults]]\nat_s = 3\nkind = \"stall\"\nduration_s = 0.19";
        let config: RigConfig = toml::from_str(text).unwrap();
        assert_eq!((config.seed, config.camera.enabled), (7, false));
        assert_eq!(config.initial_q, RigConfig::default().initial_q);
        assert_eq!(config.rope(), hidden_rope(7));
        assert!(toml::from_str::<RigConfig>("sed = 7").is_err());
        let back: RigConfig = toml::from_str(&toml::to_string(&config).unwrap()).unwrap();
        assert_eq!(back, config);
    }

    #[test]
    fn a_drawn_room_is_the_seeds_and_given_colours_win() {
        assert_eq!(RigConfig::default().drawn_room(), None);
        let mut config: RigConfig = toml::from_str("seed = 7\nroom = \"ordinary\"").unwrap();
        let room = config.drawn_room().unwrap();
        assert_eq!(room.wall, Room::draw(7, Kind::Ordinary).wall);
        assert_eq!(config.appearance().rope_rgb, room.rope.rope.rgb);
        assert_eq!(config.appearance().lead_rgb, room.rope.tip.rgb);
        let given = Appearance::from_seed(3);
        config.appearance = Some(given);
        assert_eq!(config.appearance(), given);
        assert_eq!(config.drawn_room().unwrap().rope.rope.rgb, given.rope_rgb);
    }
}
