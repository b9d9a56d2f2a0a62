//! Files of a run: plans, ropes, keypoint tracks.

use arm_model::JointTrajectory;
use serde::Serialize;
use serde::de::DeserializeOwned;
use shared_types::{KeypointTrack, Plan, RopeEstimate, RopeParams};

/// What can be read can be written and read again.
fn json<T: Serialize + DeserializeOwned>(text: &str) -> Option<T> {
    let value: T = serde_json::from_str(text).ok()?;
    let written = serde_json::to_string(&value).unwrap();
    let back: T = serde_json::from_str(&written).expect("what was written is read");
    assert_eq!(serde_json::to_string(&back).unwrap(), written);
    Some(value)
}

/// Reads `data` as each kind.
pub fn run(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    if let Some(plan) = json::<Plan>(text) {
        finite(&plan.trajectory);
    }
    if let Some(trajectory) = json::<JointTrajectory>(text) {
        finite(&trajectory);
    }
    let _ = json::<KeypointTrack>(text);
    let _ = toml::from_str::<RopeParams>(text);
    let _ = toml::from_str::<RopeEstimate>(text);
}

fn finite(trajectory: &JointTrajectory) {
    for part in 0..=20 {
        let t_s = trajectory.duration_s() * f64::from(part) / 20.0;
        assert!(trajectory.state_at(t_s).is_finite(), "{trajectory:?}");
    }
}

/// The files as we write them.
pub fn seeds() -> Vec<Vec<u8>> {
    let pose = arm_model::joint::START_POSE;
    let trajectory = JointTrajectory::new(&[0.0, 0.5, 1.0], &[pose, pose * 0.9, pose]).unwrap();
    vec![
        serde_json::to_vec(&trajectory).unwrap(),
        br#"{"keypoints":1,"frames":[{"t_s":0.0,"points":[[1.0,2.0]],"confidence":[0.5],"lost":false}]}"#
            .to_vec(),
        b"links = 18\nlength_m = 0.7\njoint_damping_nms_per_rad = 1e-4\n\
          joint_stiffness_nm_per_rad = 1e-3\nradius_m = 0.004\n\
          mass_per_length_kg_per_m = 0.02\nlead_mass_kg = 0.02\nlead_radius_m = 0.01\n\
          link_extra_scale = 1.0\n"
            .to_vec(),
    ]
}
