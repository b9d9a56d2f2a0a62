//! Answers about the rig: ports, target, truth.

use super::RigError;
use super::config::RigConfig;
use super::record::Record;
use crate::arm::ArmPorts;
use nalgebra::Vector3;
use shared_types::MonotonicNs;
use shared_types::ipc::message::{RigEvent, RigRequest, RigRpc};
use shared_types::ipc::rpc::{Call, RpcServer};
use shared_types::ipc::{Bus, IpcError};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

const PAUSE: Duration = Duration::from_millis(4);
/// How long a question about the very last moments waits for physics.
const PATIENCE: Duration = Duration::from_millis(500);

/// Serves until `stop`.
pub(super) fn run(
    config: &RigConfig,
    ports: ArmPorts,
    record: &Record,
    stop: &AtomicBool,
) -> Result<(), RigError> {
    let bus = Bus::join(&config.domain)?;
    let server = RpcServer::<RigRpc>::open(&bus)?;
    while !stop.load(Ordering::Acquire) {
        match server.receive() {
            Ok(Some(call)) => reply(&call, &answer(&call.request, config, ports, record)),
            Ok(None) => std::thread::sleep(PAUSE),
            // One damaged question must not end the rig.
            Err(error @ IpcError::Message { .. }) => tracing::warn!(%error, "question dropped"),
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

fn reply(call: &Call<RigRpc>, event: &RigEvent) {
    if let Err(error) = call.send(event) {
        tracing::warn!(%error, "nobody took the answer");
    }
}

fn answer(request: &RigRequest, config: &RigConfig, ports: ArmPorts, record: &Record) -> RigEvent {
    match *request {
        RigRequest::Ports => RigEvent::Ports {
            command: ports.command,
            reports: ports.reports,
        },
        RigRequest::PlaceTarget { target_m } => {
            if !target_m.iter().all(|v| v.abs() < 10.0) {
                return RigEvent::Failed {
                    message: format!("target {target_m:?} does not lie within 10 m of the robot"),
                };
            }
            record.place_target(Some(Vector3::from(target_m)));
            RigEvent::Done
        }
        RigRequest::Truth { from_ns, to_ns } => {
            record.wait_for(MonotonicNs(to_ns), PATIENCE);
            match record.truth(MonotonicNs(from_ns), MonotonicNs(to_ns)) {
                Ok(truth) => RigEvent::Truth {
                    rope: config.rope(),
                    closest_m: truth.closest_m,
                    closest_ns: truth.closest_at.0,
                    peak_tip_speed_m_s: truth.peak_tip_speed_m_s,
                    touched: truth.touched,
                },
                Err(message) => RigEvent::Failed { message },
            }
        }
    }
}
