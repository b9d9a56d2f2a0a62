//! Messages between the processes: requests and events of every service.

use arm_model::joint::START_POSE;
use arm_model::{Cell, Limits, Pole};
use planner::PlannerConfig;
use planner::history::ArmHistory;
use planner::observation::Appearance;
use planner::plan::PlanRequest;
use planner::ropes::random_rope;
use planner::service::{IdentifyRequest, PlannerEvent, PlannerRequest};
use planner::settle::SettleRequest;
use planner::synthetic::side_camera;
use serde::Serialize;
use serde::de::DeserializeOwned;
use shared_types::Task;
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

/// One of each kind that the planner takes.
fn planner_requests() -> [PlannerRequest; 4] {
    let config = PlannerConfig::default();
    let rope = random_rope(1);
    let goal = config.goal(Task::Strike, [0.95, 0.0, 0.2]);
    [
        PlannerRequest::Ping,
        PlannerRequest::Identify(Box::new(IdentifyRequest {
            first_stamp_ns: 1_000_000_000,
            frames: 3,
            camera: side_camera(),
            joints: vec![(1_000_000_000, START_POSE)],
            pole: Pole::default(),
            appearance: Appearance::default(),
            options: config.identify,
        })),
        PlannerRequest::Plan(Box::new(PlanRequest::new(goal, &rope, config.search))),
        PlannerRequest::Settle(Box::new(SettleRequest {
            rope,
            before: ArmHistory {
                sway: Default::default(),
                times_s: vec![0.0],
                q: vec![START_POSE],
                start_s: 1.0,
                start_q: START_POSE,
            },
            end_q: START_POSE,
            limits: Limits::default(),
            cell: Cell::default(),
            config: config.settle,
        })),
    ]
}

/// Some of each kind.
pub fn seeds() -> Vec<Vec<u8>> {
    let planner = planner_requests().map(|r| postcard::to_allocvec(&r).unwrap());
    let with = |kind: u8, body: Vec<u8>| [vec![kind], body].concat();
    let bytes = |value: &ControllerRequest| postcard::to_allocvec(value).unwrap();
    let mut seeds = vec![
        with(0, bytes(&ControllerRequest::Status)),
        with(0, bytes(&ControllerRequest::Latency)),
        with(8, postcard::to_allocvec(&CycleRecord::default()).unwrap()),
        with(9, postcard::to_allocvec(&InputRecord::default()).unwrap()),
        with(10, postcard::to_allocvec(&CauseRecord::default()).unwrap()),
        with(0, encode("fuzz", &ControllerRequest::Status).unwrap()),
    ];
    seeds.extend(planner.map(|body| with(2, body)));
    seeds
}
