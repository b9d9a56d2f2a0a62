//! The simulated rig: arm, hidden rope and stereo camera in real time.
//!
//! ```text
//! arm (true joints, 1 kHz) -> physics -> record -> camera -> frames
//!                                          |-----> service -> truth
//! ```
//!
//! Physics follows the arm a few milliseconds behind; the camera exposes what
//! physics has finished. Every stamp is CLOCK_MONOTONIC and true: a machine that
//! cannot keep up sees later frames and dropped frames, never wrong ones.

#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

pub mod body;
mod camera;
mod config;
mod filming;
pub mod hidden;
mod physics;
mod record;
pub mod render;
mod service;
pub mod wiggle_film;

pub use camera::{CameraConfig, Resolution};
pub use config::RigConfig;

use nalgebra::Vector3;
use record::Record;
use rope_sim::SimulateError;
use service::Service;
use shared_types::ipc::IpcError;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use xarm_sim::{ArmPorts, ArmStartError, SimulatedArm};

/// Why the rig did not start or did not go on.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// A number of the set-up makes no rig.
    #[error("`{key}` is {value}, but must lie between {min} and {max}")]
    Config {
        /// Key.
        key: &'static str,
        /// Value found.
        value: f64,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// Another rig answers in this domain.
    #[error("domain `{domain}` is in use by another rig; end that one or name another domain")]
    DomainInUse {
        /// The domain.
        domain: String,
    },
    /// The arm did not start.
    #[error(transparent)]
    Arm(#[from] ArmStartError),
    /// The rope could not be simulated.
    #[error("the rope cannot be simulated")]
    Rope(#[from] SimulateError),
    /// The rope's motion became infinite.
    #[error("the simulated rope diverged; choose a rope within the documented ranges")]
    RopeDiverged,
    /// The machine lost the thread of the arm's motion.
    #[error(
        "the simulation lost {gap_s:.2} s of the arm's motion; the machine is too busy, stop other programs"
    )]
    FellBehind {
        /// Missing time (s).
        gap_s: f64,
    },
    /// Shared memory failed.
    #[error(transparent)]
    Ipc(#[from] IpcError),
    /// A thread could not be started.
    #[error("cannot start the thread `{name}`")]
    Thread {
        /// Which one.
        name: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// A part of the rig ended by a bug.
    #[error("the rig's thread `{name}` panicked; see the messages above")]
    Panicked {
        /// Which one.
        name: &'static str,
    },
}

/// Refuses settings no thread could work with.
///
/// # Errors
/// [`RigError::Config`]: the first number that makes no rig, and its limits.
pub fn check(config: &RigConfig) -> Result<(), RigError> {
    let camera = &config.camera;
    // The last row is exposed before the next frame begins.
    let rows = f64::from(camera.stereo_camera().height_px - 1);
    let spare_s = 1.0 / camera.frame_rate_hz - camera.exposure_s;
    let longest_line_s = (spare_s / rows * 1e9).floor().max(0.0) / 1e9;
    let bounds = [
        ("camera.frame_rate_hz", camera.frame_rate_hz, 1.0, 200.0),
        ("camera.exposure_s", camera.exposure_s, 1e-5, 0.1),
        (
            "camera.line_time_s",
            camera.line_time_s,
            0.0,
            longest_line_s,
        ),
        ("camera.baseline_m", camera.baseline_m, 0.01, 1.0),
        ("camera.tilt_up_rad", camera.tilt_up_rad, -1.5, 1.5),
        ("camera.latency_s", camera.latency_s, 0.0, 0.5),
        (
            "camera.noise_levels",
            f64::from(camera.noise_levels),
            0.0,
            40.0,
        ),
    ];
    for (key, value, min, max) in bounds {
        if !(value >= min && value <= max) {
            return Err(RigError::Config {
                key,
                value,
                min,
                max,
            });
        }
    }
    Ok(())
}

/// Runs the rig until `stop` is set or a part of it fails.
///
/// # Errors
/// [`RigError`]: a bad set-up, a port in use, shared memory, a machine too slow.
pub fn run(config: &RigConfig, stop: &AtomicBool) -> Result<(), RigError> {
    run_announced(config, stop, |_| ())
}

/// [`run`] that tells its ports as soon as the arm listens.
///
/// # Errors
/// As [`run`].
pub fn run_announced(
    config: &RigConfig,
    stop: &AtomicBool,
    announce: impl FnOnce(ArmPorts),
) -> Result<(), RigError> {
    check(config)?;
    // Before the arm listens: a second rig must not answer for the first.
    let service = Service::open(&config.domain)?;
    let rope = config.rope();
    let record = Record::default();
    record.place_target(config.target_m.map(Vector3::from));
    let arm = SimulatedArm::start(config.arm())?;
    let (history, ports) = (arm.history(), arm.ports());
    tracing::info!(command = ports.command, domain = %config.domain, "rig started");
    announce(ports);
    let ended = AtomicBool::new(false);
    let (record, ended) = (&record, &ended);
    let outcome = thread::scope(|scope| {
        let part = |name: &'static str, work: Box<dyn FnOnce() -> Result<(), RigError> + Send>| {
            let guarded = move || {
                // Whatever ends a part, panic included, ends the whole rig.
                let _end = EndWhenDropped(ended);
                work()
            };
            thread::Builder::new()
                .name(name.to_owned())
                .spawn_scoped(scope, guarded)
                .map(|handle| (name, handle))
                .map_err(|source| {
                    ended.store(true, Ordering::Release);
                    RigError::Thread { name, source }
                })
        };
        let started = [
            part(
                "rig-physics",
                Box::new(move || physics::run(&rope, &config.cell, &history, record, ended)),
            ),
            part("rig-camera", Box::new(move || film(config, record, ended))),
        ];
        let over = || stop.load(Ordering::Acquire) || ended.load(Ordering::Acquire);
        let served = {
            let _end = EndWhenDropped(ended);
            service.run(config, ports, record, over)
        };
        let parts = started.into_iter().try_for_each(|part| {
            let (name, handle) = part?;
            handle.join().unwrap_or(Err(RigError::Panicked { name }))
        });
        served.and(parts)
    });
    arm.stop();
    outcome
}

/// The camera's part; without a camera it only waits.
fn film(config: &RigConfig, record: &Record, stop: &AtomicBool) -> Result<(), RigError> {
    if config.camera.enabled {
        return filming::run(config, record, stop);
    }
    while !stop.load(Ordering::Acquire) {
        thread::sleep(Duration::from_millis(10));
    }
    Ok(())
}

struct EndWhenDropped<'a>(&'a AtomicBool);

impl Drop for EndWhenDropped<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_out_of_bounds_are_refused_by_key() {
        let mut config = RigConfig::default();
        config.camera.frame_rate_hz = f64::NAN;
        let said = run(&config, &AtomicBool::new(false))
            .unwrap_err()
            .to_string();
        assert!(said.contains("camera.frame_rate_hz"), "{said}");
    }

    #[test]
    fn a_second_rig_in_a_domain_is_refused_before_its_arm_listens() {
        let mut config = RigConfig {
            domain: format!("test_two_rigs_{}", std::process::id()),
            command_port: 0,
            report_ports: [0; 4],
            ..RigConfig::default()
        };
        config.camera.enabled = false;
        let stop = AtomicBool::new(false);
        let (told, ports) = std::sync::mpsc::channel();
        thread::scope(|scope| {
            let first = scope.spawn(|| run_announced(&config, &stop, |p| told.send(p).unwrap()));
            assert_ne!(ports.recv().unwrap().command, 0);
            let mut listened = false;
            let second = run_announced(&config, &AtomicBool::new(true), |_| listened = true);
            stop.store(true, Ordering::Release);
            first.join().unwrap().unwrap();
            let said = second.unwrap_err().to_string();
            assert!(
                said.contains(&config.domain) && said.contains("another rig"),
                "{said}"
            );
            assert!(!listened);
        });
    }
}
