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

mod camera;
mod capture;
mod config;
mod contact;
mod error;
mod exposure;
pub mod hidden;
mod physics;
mod record;
pub mod render;
pub mod room;
pub mod room_film;
mod service;
mod target;
pub mod wiggle_film;

pub use camera::{CameraConfig, Resolution};
pub use config::{RigConfig, RoomChoice, check};
pub use error::RigError;
pub use service::port_of_rig;
pub use target::random_target;

use nalgebra::Vector3;
use record::Record;
use service::Service;
use shared_types::Task;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use xarm_sim::{ArmPorts, SimulatedArm};

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
    if let Some(target_m) = config.target_m {
        record.want(Some((Task::Strike, Vector3::from(target_m))));
    }
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
            handle.join().unwrap_or_else(|_| {
                Err(RigError::Failed(format!(
                    "the rig's thread `{name}` panicked; see the messages above"
                )))
            })
        });
        served.and(parts)
    });
    arm.stop();
    outcome
}

/// The camera's part; without a camera it only waits.
fn film(config: &RigConfig, record: &Record, stop: &AtomicBool) -> Result<(), RigError> {
    if config.camera.enabled {
        return capture::run(config, record, stop);
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
        let (reported, ports) = std::sync::mpsc::channel();
        thread::scope(|scope| {
            let first =
                scope.spawn(|| run_announced(&config, &stop, |p| reported.send(p).unwrap()));
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
