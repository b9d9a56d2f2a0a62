use super::*;
use arm_model::kinematics;
use rt_controller::xarm::{JointQuery, StateRequest};

const START: MonotonicNs = MonotonicNs(1_000_000_000);
const ENABLE: Command = Command::MotionEnable {
    joint: Command::ALL_JOINTS,
    enable: true,
};
const READY: Command = Command::SetState(StateRequest::Ready);

/// A model with a time of its own.
struct Bench {
    model: ArmModel,
    now: MonotonicNs,
}

impl Bench {
    fn new() -> Self {
        Self {
            model: ArmModel::new(ArmConfig::default(), START),
            now: START,
        }
    }

    /// Switched on and brought to ready in `mode`.
    fn ready(mode: Mode) -> Self {
        let mut bench = Self::new();
        bench.bring_up(mode);
        bench
    }

    fn bring_up(&mut self, mode: Mode) {
        for command in [Command::CleanError, ENABLE, Command::SetMode(mode), READY] {
            self.send(&command);
        }
    }

    fn send(&mut self, command: &Command) -> Status {
        self.model.command(self.now, command).status
    }

    fn wait(&mut self, span_s: f64) {
        self.now = self.now.plus_s(span_s);
        self.model.advance_to(self.now, |_| ());
    }

    fn q7(&self) -> f64 {
        self.model.true_motion().q[6]
    }

    /// Streams joint 7 at `speed_rad_s` for `cycles` setpoints of 4 ms.
    fn stream_joint7(&mut self, speed_rad_s: f64, cycles: usize) -> Status {
        let mut q = self.model.reference_motion().q;
        let mut status = Status(0);
        for _ in 0..cycles {
            q[6] += speed_rad_s * 0.004;
            status = self.send(&Command::ServoJoint(q));
            self.wait(0.004);
        }
        status
    }
}

fn joint7(rad: f64) -> JointVector {
    let mut q = JointVector::ZERO;
    q[6] = rad;
    q
}

#[test]
fn bring_up_passes_through_the_documented_states() {
    let mut arm = Bench::new();
    assert_eq!(arm.model.state(), ArmState::Stopped);
    // The vendor's example: enable answers with "not able to move".
    assert_eq!(arm.send(&ENABLE), Status(0x10));
    assert_eq!(arm.model.state(), ArmState::NeedsReset);
    assert_eq!(arm.send(&READY), Status(0));
    assert_eq!(arm.model.state(), ArmState::Ready);
    assert_eq!(arm.send(&Command::SetMode(Mode::Servo)), Status(0x10));
    assert_eq!(arm.model.state(), ArmState::NeedsReset);
    assert_eq!(arm.send(&Command::ServoJoint(joint7(0.01))), Status(0x10));
    arm.wait(0.2);
    assert_eq!(arm.q7(), 0.0);
}

#[test]
fn ready_without_enabled_motors_does_not_move() {
    let mut arm = Bench::new();
    arm.send(&Command::SetMode(Mode::Servo));
    assert!(arm.send(&READY).is_not_ready());
    assert!(arm.stream_joint7(0.3, 20).is_not_ready());
    assert_eq!(arm.q7(), 0.0);
}

#[test]
fn the_last_setpoint_is_held_in_silence() {
    let mut arm = Bench::ready(Mode::Servo);
    assert_eq!(arm.stream_joint7(0.5, 50), Status(0));
    assert_eq!(arm.model.state(), ArmState::Moving);
    arm.wait(5.0);
    assert!((arm.q7() - 0.1).abs() < 1e-9);
    assert_eq!(arm.model.state(), ArmState::Ready);
    assert!(arm.model.error.is_none());
}

#[test]
fn an_error_stops_clears_the_mode_and_needs_the_whole_recovery() {
    let mut arm = Bench::ready(Mode::Servo);
    arm.stream_joint7(0.5, 50);
    let status = arm.send(&Command::ServoJoint(joint7(1.5)));
    assert!(status.has_error() && status.is_not_ready());
    assert_eq!(arm.model.error, ErrorCode::SPEED_LIMIT);
    assert_eq!(
        (arm.model.state(), arm.model.mode),
        (ArmState::Stopped, Mode::Position)
    );
    arm.wait(0.3);
    let rest = arm.q7();
    assert!(rest < 0.12 && rest > 0.1, "{rest}");
    assert!(arm.stream_joint7(0.5, 10).has_error());
    assert_eq!(arm.q7(), rest);

    arm.send(&Command::CleanError);
    assert!(arm.stream_joint7(0.5, 10).is_not_ready());
    arm.bring_up(Mode::Servo);
    assert_eq!(arm.stream_joint7(0.5, 50), Status(0));
    arm.wait(0.3);
    assert!((arm.q7() - rest - 0.1).abs() < 1e-3);
}

/// Stopping from 0.5 rad/s is neither instantaneous nor slow: `v² / 2a` is
/// 6 mrad, and the lag still carries what was streamed before.
#[test]
fn a_stop_is_decelerated() {
    let mut arm = Bench::ready(Mode::Servo);
    arm.stream_joint7(0.5, 100);
    let requested = arm.model.reference_motion().q[6];
    arm.send(&Command::SetState(StateRequest::Stop));
    assert_eq!(arm.model.state(), ArmState::Stopped);
    let mut slowest_step = f64::INFINITY;
    let mut last = arm.model.true_motion().qd[6];
    for _ in 0..200 {
        arm.wait(0.001);
        let qd = arm.model.true_motion().qd[6];
        slowest_step = slowest_step.min(qd - last);
        last = qd;
    }
    assert!(slowest_step > -0.2, "{slowest_step} rad/s in a millisecond");
    assert!(
        (arm.q7() - requested - 0.00625).abs() < 2e-3,
        "{}",
        arm.q7() - requested
    );
    assert!(last.abs() < 1e-3);
}

#[test]
fn range_error_leaves_the_joint_inside() {
    let mut arm = Bench::ready(Mode::Servo);
    let mut q = JointVector::ZERO;
    while !arm.send(&Command::ServoJoint(q)).has_error() {
        q[3] -= 0.5 * 0.004;
        arm.wait(0.004);
        assert!(q[3] > -0.2, "never refused");
    }
    assert_eq!(arm.model.error, ErrorCode::JOINT_LIMIT);
    arm.wait(0.5);
    // The narrower published range of joint 4 begins at -0.10472 rad.
    assert!(arm.model.true_motion().q[3] > -0.10472 - 2e-4);
}

/// The flange turns about joint 1 on a circle whose radius comes from the pose, so the
/// speed at the limit is known.
#[test]
fn tool_speed_limit_follows_its_factor() {
    let mut pose = JointVector::ZERO;
    (pose[1], pose[3], pose[5]) = (0.8, 2.4, 1.6);
    let config = ArmConfig {
        initial_q: pose,
        ..ArmConfig::default()
    };
    let radius_m = kinematics::flange_pose(&pose).0.xy().norm();
    for (factor, speed_m_s, error) in [
        (1.2, 1.19, ErrorCode::NONE),
        (1.2, 1.21, ErrorCode::TCP_SPEED_LIMIT),
        (1.3, 1.29, ErrorCode::NONE),
        (1.3, 1.31, ErrorCode::TCP_SPEED_LIMIT),
    ] {
        let mut arm = Bench {
            model: ArmModel::new(config.clone(), START),
            now: START,
        };
        arm.bring_up(Mode::Servo);
        arm.send(&Command::SetSpeedLimitFactor(factor));
        let mut q = pose;
        for _ in 0..100 {
            q[0] += speed_m_s / radius_m * 0.004;
            arm.send(&Command::ServoJoint(q));
            arm.wait(0.004);
        }
        assert_eq!(arm.model.error, error, "{factor}: {speed_m_s} m/s");
    }
}

#[test]
fn moves_are_queued_paused_and_resumed() {
    let mut arm = Bench::ready(Mode::Position);
    let go = |rad| Command::MoveJoint {
        target: joint7(rad),
        speed_rad_s: 1.0,
        acceleration_rad_s2: 10.0,
        checked: None,
    };
    arm.send(&go(0.5));
    let answer = arm.model.command(arm.now, &go(0.2));
    assert_eq!(answer.data, AnswerData::Typed(ReplyData::Buffered(2)));
    arm.wait(0.2);
    assert_eq!(arm.model.state(), ArmState::Moving);
    arm.send(&Command::SetState(StateRequest::Pause));
    arm.wait(0.5);
    let paused_at = arm.q7();
    assert!(paused_at > 0.1 && paused_at < 0.4, "{paused_at}");
    arm.wait(0.5);
    assert_eq!((arm.q7(), arm.model.state()), (paused_at, ArmState::Paused));
    arm.send(&READY);
    arm.wait(3.0);
    assert!((arm.q7() - 0.2).abs() < 1e-4);
    assert_eq!(arm.model.state(), ArmState::Ready);
    assert_eq!(arm.model.buffered(), 0);
}

#[test]
fn joint_velocity_stops_by_itself_after_its_duration() {
    let mut arm = Bench::ready(Mode::JointVelocity);
    arm.send(&Command::JointVelocity {
        velocity: joint7(1.0),
        synchronised: true,
        duration_s: Some(0.2),
    });
    arm.wait(0.15);
    assert!((arm.model.true_motion().qd[6] - 1.0).abs() < 0.02);
    arm.wait(1.0);
    assert!((arm.q7() - 0.2).abs() < 3e-3, "{}", arm.q7());
    assert_eq!(arm.model.state(), ArmState::Ready);

    // Without a duration it ends at the end of the range.
    arm.send(&Command::JointVelocity {
        velocity: joint7(3.0),
        synchronised: true,
        duration_s: None,
    });
    arm.wait(4.0);
    assert_eq!(arm.model.error, ErrorCode::JOINT_LIMIT);
    assert!(arm.q7() < core::f64::consts::TAU + 1e-3);
}

#[test]
fn commanded_and_measured_positions_are_told_apart() {
    let mut arm = Bench::ready(Mode::Servo);
    arm.stream_joint7(1.0, 25);
    let ask = |arm: &mut Bench, query| {
        arm.model
            .command(arm.now, &Command::JointPosition(query))
            .data
    };
    let AnswerData::Typed(ReplyData::Joints(commanded)) = ask(&mut arm, JointQuery::Commanded)
    else {
        panic!("not the commanded joints");
    };
    let AnswerData::Typed(ReplyData::JointMotion { position, .. }) =
        ask(&mut arm, JointQuery::MEASURED)
    else {
        panic!("not the measured joints");
    };
    assert!((commanded[6] - 0.1).abs() < 1e-9);
    // Behind by dead time and lag, about 2 z / w + 8 ms = 19 ms.
    let behind_s = commanded[6] - position[6];
    assert!((0.014..0.026).contains(&behind_s), "{behind_s}");
    let steps = position[6] / 1e-5;
    assert!((steps - steps.round()).abs() < 1e-6);
}
