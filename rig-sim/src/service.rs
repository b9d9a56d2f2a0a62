//! Answers about the rig: ports, camera and colours, target, truth.

use super::config::RigConfig;
use super::error::RigError;
use super::record::Record;
use nalgebra::Vector3;
use shared_types::MonotonicNs;
use shared_types::ipc::message::{RigEvent, RigRequest, RigRpc};
use shared_types::ipc::rpc::{Call, RpcClient, RpcServer};
use shared_types::ipc::{Bus, DomainSweep, IpcError};
use std::time::Duration;
use xarm_sim::ArmPorts;

const PAUSE: Duration = Duration::from_millis(4);
/// What the library says of a second server.
const TOO_MANY_SERVERS: &str = "ExceedsMaxSupportedServers";
/// How long a question about the very last moments waits for physics.
const PATIENCE: Duration = Duration::from_millis(500);

/// Longest wait for the rig's answer.
const ANSWERED_WITHIN: Duration = Duration::from_secs(5);

/// The command port of the rig that runs in a shared-memory domain, if one does.
///
/// # Errors
/// The name is none, shared memory cannot be used, or what runs there does not answer.
pub fn port_of_rig(domain: &str) -> Result<Option<u16>, IpcError> {
    // Removed last: it looks for others in the domain.
    let _sweep = DomainSweep::new(domain);
    let bus = Bus::join(domain)?;
    let asked = match RpcClient::<RigRpc>::open(&bus)?.call(&RigRequest::Ports) {
        Ok(asked) => asked,
        Err(IpcError::Gone { .. }) => return Ok(None),
        Err(error) => return Err(error),
    };
    match asked.finish::<IpcError>(ANSWERED_WITHIN, || Ok(()), |_| ())? {
        RigEvent::Ports { command, .. } => Ok(Some(command)),
        other => Err(IpcError::Failed(format!(
            "the rig of domain `{domain}` answered with {other:?}"
        ))),
    }
}

/// The rig's end of its service; stays in the thread that opened it.
pub(super) struct Service {
    // Order matters: the server ends before its connection.
    server: RpcServer<RigRpc>,
    _bus: Bus,
}

impl Service {
    /// Opens the service.
    ///
    /// # Errors
    /// Another rig serves in the domain; [`RigError::Ipc`].
    pub(super) fn open(domain: &str) -> Result<Self, RigError> {
        let bus = Bus::join(domain)?;
        let server = RpcServer::<RigRpc>::open(&bus).map_err(|error| match error {
            IpcError::Open { ref reason, .. } if reason.contains(TOO_MANY_SERVERS) => {
                RigError::Failed(format!(
                    "domain `{domain}` is in use by another rig; end that one or name another domain"
                ))
            }
            other => other.into(),
        })?;
        Ok(Self { server, _bus: bus })
    }

    /// Serves until it is `over`.
    pub(super) fn run(
        &self,
        config: &RigConfig,
        ports: ArmPorts,
        record: &Record,
        over: impl Fn() -> bool,
    ) -> Result<(), RigError> {
        while !over() {
            match self.server.receive() {
                Ok(Some(call)) => reply(&call, &answer(&call.request, config, ports, record)),
                Ok(None) => std::thread::sleep(PAUSE),
                // One damaged question must not end the rig.
                Err(error @ IpcError::Message { .. }) => tracing::warn!(%error, "question dropped"),
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }
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
        RigRequest::PlaceTarget { task, target_m } => {
            if !target_m.iter().all(|v| v.abs() < 10.0) {
                return RigEvent::Failed {
                    message: format!("target {target_m:?} does not lie within 10 m of the robot"),
                };
            }
            match record.place(Some((task, Vector3::from(target_m))), PATIENCE) {
                Ok(()) => RigEvent::Done,
                Err(message) => RigEvent::Failed { message },
            }
        }
        RigRequest::Tidy => match record.place(None, PATIENCE) {
            Ok(()) => RigEvent::Done,
            Err(message) => RigEvent::Failed { message },
        },
        RigRequest::Scene => {
            let colours = config.appearance();
            RigEvent::Scene {
                camera: Box::new(config.camera.stereo_camera()),
                tip_rgb: colours.lead_rgb,
                target_rgb: colours.target_rgb,
            }
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
                    seen: Box::new(truth.seen),
                },
                Err(message) => RigEvent::Failed { message },
            }
        }
    }
}
