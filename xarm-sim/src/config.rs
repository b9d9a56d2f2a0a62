//! How a simulated arm is set up, and why it may fail to start.

use super::collision::Obstacle;
use super::fault::FaultScript;
use super::firmware::Firmware;
use super::joint::{JointDynamics, JointLag};
use super::pacer::Intake;
use super::start_error::ArmStartError;
use arm_model::{Cell, JOINTS, JointVector, Limits};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rt_controller::xarm::{COMMAND_PORT, REPORT_PORTS};
use serde::{Deserialize, Serialize};
use std::net::{IpAddr, Ipv4Addr};

/// Set-up of a simulated arm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ArmConfig {
    /// Address to listen on.
    pub bind: IpAddr,
    /// Port for commands; 0 takes any free one.
    pub command_port: u16,
    /// Ports of the real-time, normal, rich and real report; 0 takes any free
    /// one.
    pub report_ports: [u16; 4],
    /// Seed of everything random in this arm.
    pub seed: u64,
    /// Nominal lag of the joints.
    pub lag: JointLag,
    /// Largest relative deviation of a joint's lag from the nominal one.
    pub lag_spread: f64,
    /// Ranges, speeds and accelerations of the joints.
    pub limits: Limits,
    /// Pose at the start (rad).
    pub initial_q: JointVector,
    /// Step of the joint encoders (rad).
    pub encoder_resolution_rad: f64,
    /// Standard deviation of the positions that the encoders tell (rad).
    pub encoder_noise_rad: f64,
    /// Linear speed limit in servo mode at the start, as a factor of 1 m/s.
    pub speed_limit_factor: f64,
    /// Firmware: sizes of reports, what is known to the command port.
    pub firmware: Firmware,
    /// Lag of each joint; left out, it is drawn from the seed around `lag`.
    pub joint_lags: Option<[JointLag; JOINTS]>,
    /// Time that the controller has been on at the start (s).
    pub uptime_s: f64,
    /// What the controller's clock gains (µs/s).
    pub clock_ppm: f64,
    /// Whose clock paces setpoints.
    pub intake: Intake,
    /// The cell it stands in, whose pole it carries; left out, it stands free.
    pub cell: Option<Cell>,
    /// What stands in the arm's way besides.
    pub obstacles: Vec<Obstacle>,
    /// Whether self collision is looked for at the start (register 77).
    pub self_collision_check: bool,
    /// Safety boundary at the start, as register 52 holds it: x+, x-, y+, y-, z+, z-
    /// (mm); none if it is switched off.
    pub fence_mm: Option<[i32; 6]>,
    /// Levels of the control box's digital inputs, bit `i` of input `i`; open ones are high.
    pub digital_inputs: u16,
    /// Faults to inject.
    pub faults: FaultScript,
}

impl Default for ArmConfig {
    fn default() -> Self {
        Self {
            bind: IpAddr::V4(Ipv4Addr::LOCALHOST),
            command_port: COMMAND_PORT,
            report_ports: REPORT_PORTS,
            seed: 0,
            lag: JointLag::default(),
            lag_spread: 0.1,
            limits: Limits::default(),
            initial_q: JointVector::ZERO,
            encoder_resolution_rad: 1e-5,
            encoder_noise_rad: 0.0,
            speed_limit_factor: 1.2,
            firmware: Firmware::default(),
            joint_lags: None,
            uptime_s: 100.0,
            clock_ppm: 0.0,
            intake: Intake::default(),
            cell: None,
            obstacles: Vec::new(),
            self_collision_check: false,
            fence_mm: None,
            digital_inputs: u16::MAX,
            faults: FaultScript::default(),
        }
    }
}

impl ArmConfig {
    /// Refuses a set-up that the model cannot run.
    ///
    /// # Errors
    /// [`ArmStartError::Config`] with the key.
    pub fn check(&self) -> Result<(), ArmStartError> {
        let refuse = |key, why| Err(ArmStartError::Config { key, why });
        for lag in [self.lag].iter().chain(self.joint_lags.iter().flatten()) {
            if !(0.0..=1.0).contains(&lag.dead_time_s) {
                return refuse("lag.dead_time_s", "must lie between 0 and 1 s");
            }
            // The joint model integrates in steps of 1 ms.
            let frequency_rad_s = lag.natural_frequency_rad_s;
            if !(frequency_rad_s > 0.0 && frequency_rad_s <= 1000.0) {
                let why = "must lie above 0 and up to 1000 rad/s";
                return refuse("lag.natural_frequency_rad_s", why);
            }
            if !(0.1..=2.0).contains(&lag.damping_ratio) {
                return refuse("lag.damping_ratio", "must lie between 0.1 and 2");
            }
        }
        if !(0.0..1.0).contains(&self.lag_spread) {
            return refuse("lag_spread", "must be at least 0 and below 1");
        }
        if self.limits.position_violation(&self.initial_q).is_some() {
            return refuse("initial_q", "lies outside the joint ranges");
        }
        if !(self.encoder_resolution_rad > 0.0 && self.encoder_resolution_rad < 0.1) {
            return refuse("encoder_resolution_rad", "must lie between 0 and 0.1 rad");
        }
        if !(0.0..0.1).contains(&self.encoder_noise_rad) {
            return refuse("encoder_noise_rad", "must be at least 0 and below 0.1 rad");
        }
        if !(self.speed_limit_factor > 0.0 && self.speed_limit_factor.is_finite()) {
            return refuse("speed_limit_factor", "must be above 0");
        }
        if !(0.0..1e9).contains(&self.uptime_s) {
            return refuse("uptime_s", "must lie between 0 and 1e9 s");
        }
        if !(-1e5..=1e5).contains(&self.clock_ppm) {
            return refuse("clock_ppm", "must lie between -1e5 and 1e5");
        }
        if !self.obstacles.iter().all(Obstacle::is_well_formed) {
            let why = "needs normals that are not zero, and boxes whose min_m lies below max_m";
            return refuse("obstacles", why);
        }
        Ok(())
    }

    /// The seven joints at rest in the initial pose, each with its own lag.
    pub(super) fn joints(&self) -> [JointDynamics; JOINTS] {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let mut vary =
            |nominal: f64| nominal * (1.0 + self.lag_spread * rng.random_range(-1.0..=1.0));
        core::array::from_fn(|i| {
            let drawn = JointLag {
                dead_time_s: vary(self.lag.dead_time_s),
                natural_frequency_rad_s: vary(self.lag.natural_frequency_rad_s),
                damping_ratio: vary(self.lag.damping_ratio),
            };
            let lag = self.joint_lags.map_or(drawn, |lags| lags[i]);
            JointDynamics::new(lag, self.initial_q[i], self.limits.velocity_max_rad_s[i])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn default_is_accepted_and_nonsense_refused_by_key() {
        assert!(ArmConfig::default().check().is_ok());
        let outside = ArmConfig {
            initial_q: JointVector::splat(6.0),
            ..ArmConfig::default()
        };
        let said = outside.check().unwrap_err().to_string();
        assert!(said.contains("initial_q"), "{said}");
    }

    #[test]
    fn a_file_may_name_only_what_differs() {
        let text = r#"
            seed = 5
            command_port = 0
            firmware = "2.8.2"
            intake = "clock"
            [[obstacles]]
            plane = { point_m = [0, 0, -0.1], normal = [0, 0, 1] }
            [[faults]]
            on = "speed:1.5"
            kind = "collision"
        "#;
        let config: ArmConfig = toml::from_str(text).unwrap();
        assert_eq!((config.seed, config.command_port), (5, 0));
        assert_eq!((config.obstacles.len(), config.faults.faults.len()), (1, 1));
        assert_eq!(config.firmware, Firmware(2, 8, 2));
        config.check().unwrap();
        let back: ArmConfig = toml::from_str(&toml::to_string(&config).unwrap()).unwrap();
        assert_eq!(back, config);
        assert_eq!(config.lag, JointLag::default());
    }
}
