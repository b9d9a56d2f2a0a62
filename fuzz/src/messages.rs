//! Messages between the processes: requests and events of every service.

use serde::Serialize;
use serde::de::DeserializeOwned;
use planner::service::{PlannerEvent, PlannerRequest};
use shared_types::ipc::message::{
    CameraEvent, CameraRequest, ControllerEvent, ControllerRequest, RigEvent, RigRequest,
};
use shared_types::ipc::rpc::{decode, encode};
use shared_types::ipc::{CauseRecord, CycleRecord, InputRecord};

/// Reads `body` in its envelope and bare; what can be read can be written and
/// read again.
fn message<T: Serialize + DeserializeOwned>(body: &[u8]) {
    let _ = decode::<T>("fuzz", body);
    let Ok(message) = postcard::from_bytes::<T>(body) else {
        return;
    };
    let enveloped = encode("fuzz", &message).unwrap();
    let back: T = decode("fuzz", &enveloped).unwrap();
    assert_eq!(encode("fuzz", &back).unwrap(), enveloped);
}

/// Reads `data` as the message that its first byte picks.
///
/// # Panics
/// When a message that was read cannot be written and read again.
pub fn run(data: &[u8]) {
    let Some((kind, body)) = data.split_first() else {
        return;
    };
    match kind % 11 {
        0 => message::<ControllerRequest>(body),
        1 => message::<ControllerEvent>(body),
        2 => message::<PlannerRequest>(body),
        3 => message::<PlannerEvent>(body),
        4 => message::<CameraRequest>(body),
        5 => message::<CameraEvent>(body),
        6 => message::<RigRequest>(body),
        7 => message::<RigEvent>(body),
        8 => message::<CycleRecord>(body),
        9 => message::<InputRecord>(body),
        _ => message::<CauseRecord>(body),
    }
}

/// Some of each kind.
pub fn seeds() -> Vec<Vec<u8>> {
    let with = |kind: u8, body: Vec<u8>| [vec![kind], body].concat();
    let bytes = |value: &ControllerRequest| postcard::to_allocvec(value).unwrap();
    vec![
        with(0, bytes(&ControllerRequest::Status)),
        with(0, bytes(&ControllerRequest::Latency)),
        with(8, postcard::to_allocvec(&CycleRecord::default()).unwrap()),
        with(9, postcard::to_allocvec(&InputRecord::default()).unwrap()),
        with(10, postcard::to_allocvec(&CauseRecord::default()).unwrap()),
        with(0, encode("fuzz", &ControllerRequest::Status).unwrap()),
    ]
}
