//! Plans that must not run: from elsewhere, damaged, out of limits, too late.

use super::stand::{Stand, execute, swing};
use arm_model::joint::START_POSE;
use arm_model::{JointTrajectory, JointVector};
use rt_controller::recording::RecordedCycle;
use serde::{Deserialize, Serialize};
use shared_types::ipc::message::{ControllerEvent, ControllerRequest, ControllerRpc};
use shared_types::ipc::rpc::{Rpc, RpcClient};
use shared_types::ipc::{Bus, IpcError};
use shared_types::plan::trajectory_hash;
use shared_types::{FaultCode, OperatingMode};
use std::time::Duration;

/// The controller's service, for requests that no proper program would make.
struct Anything;

/// The bytes of a request: its number, then whatever follows.
#[derive(Serialize, Deserialize)]
struct Execute {
    kind: u32,
    times_s: Vec<f64>,
    waypoints_rad: Vec<Vec<f64>>,
    sha256: [u8; 32],
}

impl Rpc for Anything {
    const NAME: &'static str = ControllerRpc::NAME;
    type Request = Vec<u8>;
    type Event = ControllerEvent;
    fn is_last(_event: &ControllerEvent) -> bool {
        true
    }
}

#[test]
fn fault_22_a_plan_that_begins_elsewhere_is_refused_with_the_distance() {
    let mut stand = Stand::ready("elsewhere");
    let mut from = START_POSE;
    from[2] += 0.6_f64.to_radians();
    assert_eq!(stand.arm_for(OperatingMode::Throw), ControllerEvent::Done);
    let (fault, message) = stand.refused(&execute(&swing(from)));
    assert_eq!(fault, FaultCode::StartPoseMismatch);
    assert!(message.contains("0.60 deg"), "{message}");
    stand.recovers();
}

#[test]
fn faults_23_and_24_a_damaged_or_too_fast_plan_is_refused_and_the_controller_goes_on_serving() {
    let mut stand = Stand::ready("damaged");
    let plan = swing(START_POSE);
    let request = ControllerRequest::Execute {
        trajectory: Box::new(plan),
        sha256: [9; 32],
    };
    assert_eq!(stand.refused(&request).0, FaultCode::PlanHashMismatch);
    let mut far = START_POSE;
    far[3] = 4.5;
    // The arm turns about its base, 0.6 m away from the tool: too fast, by so much, then.
    let mut turned = START_POSE;
    turned[0] += 1.7;
    let beyond: [(f64, JointVector, &[&str]); 2] =
        [(3.0, far, &["joint 4"]), (1.0, turned, &["m/s", " s"])];
    for (time_s, to, reported) in beyond {
        let plan = JointTrajectory::new(&[0.0, time_s], &[START_POSE, to]).unwrap();
        let (fault, message) = stand.refused(&execute(&plan));
        assert_eq!(fault, FaultCode::PlanOutOfLimits);
        assert!(
            reported.iter().all(|word| message.contains(word)),
            "{message}"
        );
    }

    // What no type of ours can hold: sent as bytes, it is not even a request.
    let bus = Bus::join(&stand.config.domain).unwrap();
    let client = RpcClient::<Anything>::open(&bus).unwrap();
    let proper = || Execute {
        kind: 3,
        times_s: plan.times_s().to_vec(),
        waypoints_rad: plan.waypoints().iter().map(|q| q.0.to_vec()).collect(),
        sha256: trajectory_hash(&plan),
    };
    let mut cases = [(); 4].map(|()| proper());
    cases[0].waypoints_rad[1][4] = f64::NAN;
    cases[1].times_s.swap(1, 2);
    cases[2].waypoints_rad[2].pop();
    cases[3].times_s.pop();
    for case in &cases {
        let pending = client.call(&postcard::to_allocvec(case).unwrap());
        let end =
            pending.and_then(|p| p.finish::<IpcError>(Duration::from_secs(2), || Ok(()), |_| ()));
        let begun = matches!(
            end,
            Ok(ControllerEvent::Started { .. } | ControllerEvent::Finished { .. })
        );
        assert!(!begun, "{end:?}");
        // It still answers.
        stand.mode();
    }
    let flight = stand.recovers();
    let on_path = |c: &&RecordedCycle| c.record.trajectory_s >= 0.0;
    let moved = flight.cycles.iter().filter(on_path).count();
    assert!(moved > 250, "the last throw only: {moved} cycles");
}

#[test]
fn fault_26_an_upload_that_hangs_is_refused_after_its_time() {
    let mut stand = Stand::ready("hangs");
    let plan = swing(START_POSE);
    let sha256 = trajectory_hash(&plan);
    let announce = ControllerRequest::Announce { sha256 };
    let late = ControllerRequest::ExecuteUploaded { sha256 };
    let upload = |plan, sha256| ControllerRequest::Upload {
        trajectory: Box::new(plan),
        sha256,
    };
    // Neither a damaged plan nor another one is the one that was announced.
    let pending = stand.call(&announce);
    let other = JointTrajectory::hold(START_POSE, 1.0).unwrap();
    let damaged = stand.refused(&upload(other, sha256));
    assert_eq!(damaged.0, FaultCode::PlanHashMismatch);
    let uploaded = stand.ask(&upload(other, trajectory_hash(&other)));
    assert_eq!(uploaded, ControllerEvent::Done);
    assert_eq!(stand.refuses(&pending).0, FaultCode::UploadTimedOut);
    assert_eq!(stand.refused(&late).0, FaultCode::WrongMode);
    let pending = stand.call(&announce);
    assert_eq!(stand.ask(&upload(plan, sha256)), ControllerEvent::Done);
    assert_eq!(stand.answer(&pending), ControllerEvent::Done);
    assert_eq!(stand.arm_for(OperatingMode::Throw), ControllerEvent::Done);
    let pending = stand.call(&late);
    stand.finishes(&pending);
    // It ran once; nobody runs it again by its hash alone.
    assert_eq!(stand.arm_for(OperatingMode::Throw), ControllerEvent::Done);
    assert_eq!(stand.refused(&late).0, FaultCode::WrongMode);
    stand.finish();
}
