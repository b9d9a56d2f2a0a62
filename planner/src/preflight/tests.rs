use super::*;
use arm_model::JointVector;
use arm_model::joint::START_POSE;
use shared_types::CommandInterface;

fn swing(joint: usize, by_rad: f64, in_s: f64) -> JointTrajectory {
    let mut end = START_POSE;
    end[joint] += by_rad;
    JointTrajectory::new(&[0.0, in_s], &[START_POSE, end]).unwrap()
}

fn stop(trajectory: &JointTrajectory, arm: &JudgedArm) -> Option<u8> {
    let margins = arm_margins(trajectory, &Limits::default(), arm);
    first_stop(&margins).and_then(|m| m.rule.code())
}

/// Peak speed of a clamped segment is 1.5 times its mean.
#[test]
fn each_rule_stops_with_its_code() {
    let arm = JudgedArm::default();
    assert_eq!(stop(&swing(6, 0.5, 1.0), &arm), None);
    assert_eq!(stop(&swing(6, 2.2, 1.0), &arm), Some(24));
    assert_eq!(stop(&swing(0, 1.4, 1.0), &arm), Some(60));
    // Joint 4 begins at 2.4 and ends at 3.927.
    assert_eq!(stop(&swing(3, 1.6, 4.0), &arm), Some(23));
    let mut folded = JointVector::ZERO;
    folded[5] = 3.1;
    (folded[1], folded[3]) = (0.0, 0.0);
    let fold = JointTrajectory::new(&[0.0, 5.0], &[JointVector::ZERO, folded]).unwrap();
    assert_eq!(stop(&fold, &arm), Some(22));
    let narrow = JudgedArm {
        fence: Some(Fence::new([-1.0, 1.0, -0.05, 0.05, -1.0, 1.0]).unwrap()),
        ..arm
    };
    assert_eq!(stop(&swing(0, 0.2, 1.0), &narrow), Some(35));
    assert_eq!(stop(&swing(0, 0.04, 1.0), &narrow), None);
}

/// What a plan leaves is told with the instant at which it is least.
#[test]
fn margins_are_told_where_they_are_least() {
    let margins = arm_margins(
        &swing(0, 0.8, 1.0),
        &Limits::default(),
        &JudgedArm::default(),
    );
    let tool = margins.iter().find(|m| m.rule == Rule::ToolSpeed).unwrap();
    let radius_m = arm_model::kinematics::flange_pose(&START_POSE)
        .0
        .xy()
        .norm();
    assert!((tool.value - 1.2 * radius_m).abs() < 1e-3, "{tool:?}");
    assert!((tool.time_s - 0.5).abs() < 0.005 && tool.left() > 0.0);
}

/// Velocities keep a distance from what only the position is judged by.
#[test]
fn by_velocities_the_end_of_the_range_is_kept_clear_of() {
    let near = swing(3, 1.527 - 0.003, 4.0);
    assert_eq!(stop(&near, &JudgedArm::default()), None);
    let interface = CommandInterface::JointVelocity;
    let arm = JudgedArm {
        interface,
        ..JudgedArm::default()
    };
    assert_eq!(stop(&near, &arm), Some(23));
    assert_eq!(stop(&swing(3, 1.527 - 0.012, 4.0), &arm), None);
}

#[test]
fn a_boundary_without_an_inside_is_refused() {
    let wrong = Fence::new([-1.0, 1.0, 0.5, -0.5, 0.0, 1.0]).unwrap_err();
    assert!(
        wrong.to_string().contains("in y, found 0.5 and -0.5 m"),
        "{wrong}"
    );
    assert!(Fence::new([f64::NAN, 1.0, 0.0, 1.0, 0.0, 1.0]).is_err());
}
