//! What is wrong with one rope of a group stays in its lane. The public interface
//! refuses such ropes, so they are put into a group directly.

use crate::base_path::BasePath;
use crate::frames::FrameTimes;
use crate::group::{GroupTask, Member, MemberResult};
use crate::lanes::Kernel;
use crate::motion::PlannedArm;
use arm_model::{JointTrajectory, JointVector, Pole};
use shared_types::RopeParams;

fn ropes(count: usize) -> Vec<RopeParams> {
    let base = RopeParams::from_array([20.0, 0.55, 0.01, 0.2, 0.006, 0.06, 0.06, 0.03, 1.0]);
    (0..count)
        .map(|i| RopeParams {
            length_m: 0.45 + 0.01 * i as f64,
            ..base
        })
        .collect()
}

/// End of the simulation (s).
const HORIZON_S: f64 = 0.3;

fn path() -> BasePath {
    let waypoints = [
        JointVector([0.0, -0.6, 0.0, 0.9, 0.0, 1.5, 0.0]),
        JointVector([0.1, -0.3, 0.1, 0.8, -0.1, 1.2, 0.2]),
    ];
    let throw = JointTrajectory::new(&[0.0, 0.2], &waypoints).unwrap();
    let arm = PlannedArm::new(throw, Pole::default());
    BasePath::new_in(Vec::new(), &arm, 1e-3, HORIZON_S).unwrap()
}

fn run(kernel: Kernel, ropes: &[RopeParams], path: &BasePath) -> Vec<MemberResult> {
    let members: Vec<Member> = ropes
        .iter()
        .map(|rope| Member {
            extras: crate::RopeExtras::NONE,
            rope,
            path,
            links: vec![[1.0, 0.0, 0.0, 0.0]; rope.links as usize],
        })
        .collect();
    kernel.run(GroupTask::<true> {
        scene: &crate::Scene::EMPTY,
        max_step_s: 1e-3,
        members: &members,
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 0.01,
            count: 30,
        },
        watch: crate::Watch::point([0.4, 0.0, 0.3]),
        horizon_s: HORIZON_S,
        single_precision: kernel.is_single_precision(),
    })
}

/// All that a caller sees of a result.
fn seen(result: &MemberResult) -> (Vec<u64>, crate::watch::Watched, u64, bool) {
    (
        result
            .nodes
            .to_f64()
            .into_iter()
            .map(f64::to_bits)
            .collect(),
        result.watched.clone(),
        result.peak_tip_speed_m_s.to_bits(),
        result.survived,
    )
}

#[test]
fn nan_in_one_lane_changes_no_bit_of_the_others() {
    let path = path();
    for kernel in Kernel::ALL
        .into_iter()
        .filter(|k| k.is_available() && k.lanes() > 1)
    {
        let healthy = ropes(kernel.lanes());
        let want: Vec<_> = run(kernel, &healthy, &path).iter().map(seen).collect();
        assert!(want.iter().all(|w| w.3), "{kernel:?}");
        let sick = 1;
        let mut ropes = healthy.clone();
        ropes[sick].joint_stiffness_nm_per_rad = f64::NAN;
        for (lane, result) in run(kernel, &ropes, &path).iter().enumerate() {
            if lane == sick {
                assert!(!result.survived, "{kernel:?}");
            } else {
                assert!(
                    seen(result) == want[lane],
                    "{kernel:?}: lane {sick} reached lane {lane}"
                );
            }
        }
    }
}
