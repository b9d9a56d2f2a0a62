//! A fault-injection scenario for every fault: how the loop is brought to it while
//! it moves.

use super::arm::Replies;
use super::{Bench, Watch};
use arm_model::joint::START_POSE;
use arm_model::{JOINTS, JointTrajectory, JointVector, Limits, LimitsSpec};
use rt_controller::control::phases::{AxisPhases, AxisState, MAX_PHASES, Phase, PhasedMotion};
use rt_controller::control::{ControlCommand, Motion};
use rt_controller::point_to_point::plan_move;
use shared_types::ipc::ControllerMode;
use shared_types::{Arming, CommandInterface, FaultCode, OperatingMode};
use std::collections::BTreeSet;

/// A scenario that ends in a fault.
enum Scenario {
    /// A motion runs and this is done to it.
    Spoilt(fn(&mut Bench<'_>)),
    /// This motion is begun.
    Motion(fn(&Limits) -> Motion, OperatingMode),
    /// Nothing moves for it: a command is refused.
    Refused(fn(&mut Bench<'_>)),
    /// The loop cannot meet it, because ...
    Never(&'static str),
}

/// Every code has its arm here: a new one has to say how it is met.
#[allow(clippy::too_many_lines, reason = "one line per code")]
fn scenario_of(code: FaultCode) -> Scenario {
    use FaultCode as F;
    use Scenario::{Motion, Never, Refused, Spoilt};
    const BRIDGE: Scenario = Never("the bridge's, before the loop hears of a motion");
    match code {
        F::None => Never("no fault"),
        F::OperatorStop => Spoilt(|b| b.operator.stop()),
        F::OperatorLost => Spoilt(|b| b.disturbance.operator_silent = true),
        F::GuardianLost => Spoilt(|b| b.disturbance.guardian_silent = true),
        F::DeadManReleased => Spoilt(|b| b.operator.let_go()),
        F::Disarmed => Spoilt(|b| b.command(ControlCommand::Disarm)),
        F::SetpointNotFinite => Motion(|_| not_finite(), OperatingMode::Throw),
        F::SetpointPosition => Refused(|b| {
            b.command(ControlCommand::Stop);
            let hold = Bench::pose(2, 3.0);
            b.command(ControlCommand::Engage { hold });
        }),
        F::SetpointVelocity => Motion(|_| spline(7, 4.6, 2.0), OperatingMode::Throw),
        F::SetpointAcceleration => Motion(|_| spline(7, 0.2, 0.2), OperatingMode::Throw),
        F::SetpointTcpSpeed => Motion(|_| spline(1, 3.4, 1.55), OperatingMode::Throw),
        F::SetpointJerk => Motion(jerky, OperatingMode::Throw),
        // Ten millimetres per cycle are slower than the tool may be at 100 Hz.
        F::SetpointStep => Motion(|_| spline(1, 2.6, 1.55), OperatingMode::Throw),
        F::SetpointUnstoppable => Motion(|_| spline(6, 2.2, 1.2), OperatingMode::Throw),
        F::OperatingModeExceeded => Motion(|_| spline(1, 3.4, 1.55), OperatingMode::Wiggle),
        F::DeadlineMissed => Spoilt(|b| b.disturbance.missed = 7),
        F::LateCycles => Spoilt(|b| b.disturbance.missed = 4),
        F::ReplyStalled => Spoilt(|b| b.arm.replies = Replies::Mute),
        F::LinkLost => Spoilt(|b| b.arm.replies = Replies::HangUp),
        F::ArmError => Spoilt(|b| b.arm.replies = Replies::Error),
        F::ArmNotReady => Spoilt(|b| b.arm.replies = Replies::NotReady),
        F::SecondCommander => Spoilt(|b| b.arm.replies = Replies::Foreign),
        F::ReportStale => Spoilt(|b| b.disturbance.reports_stop = true),
        F::ReportFrozen => Spoilt(|b| {
            b.disturbance.reports = Some(|r, before, _| (r.q, r.qd) = (before.q, before.qd));
        }),
        F::ReportClock => {
            Spoilt(|b| b.disturbance.reports = Some(|r, _, _| r.stamp_ns -= 1_000_000_000))
        }
        F::ReportBroken => {
            Spoilt(|b| b.disturbance.reports = Some(|r, _, _| r.q = JointVector::splat(f64::NAN)))
        }
        F::TrackingError => Spoilt(|b| {
            b.disturbance.reports = Some(|r, _, cycles| r.q[2] += 0.003 * f64::from(cycles));
        }),
        F::JointStuck => {
            Spoilt(|b| b.disturbance.reports = Some(|r, before, _| r.q[5] = before.q[5]))
        }
        F::EncoderJump => Spoilt(|b| b.disturbance.reports = Some(|r, _, _| r.q[3] += 0.3)),
        F::ArmModeChanged => Spoilt(|b| b.disturbance.reports = Some(|r, _, _| r.arm_mode = 0)),
        F::StartPoseMismatch => Refused(|b| {
            let from = Bench::pose(3, 0.1);
            let motion = JointTrajectory::hold(from, 1.0).unwrap();
            b.begin(super::Motion::Spline(motion), OperatingMode::Throw, 0);
        }),
        F::WrongMode => Refused(|b| {
            b.begin(swing(), OperatingMode::Throw, 20);
            let motion = Box::new(swing());
            b.command(ControlCommand::Run { id: 2, motion });
        }),
        F::NotArmed => Refused(|b| {
            let motion = Box::new(swing());
            b.command(ControlCommand::Run { id: 1, motion });
        }),
        F::ArmingExpired => Refused(|b| {
            b.command(ControlCommand::Arm(Arming {
                operating_mode: OperatingMode::Wiggle,
                expires_ns: b.now_ns + 20_000_000,
                area_clear: true,
            }));
            b.hold();
        }),
        F::PlanOutOfLimits | F::PlanHashMismatch | F::UploadTimedOut => BRIDGE,
        F::UnsupportedFirmware | F::ArmDiffers => Never("the set-up's, before any link"),
    }
}

/// A stretch of `joint` (1-based) by `by_rad` in `span_s`, and back.
fn spline(joint: usize, by_rad: f64, span_s: f64) -> Motion {
    let poses = [START_POSE, Bench::pose(joint, by_rad), START_POSE];
    let times_s = [0.0, span_s, 2.0 * span_s];
    Motion::Spline(JointTrajectory::new(&times_s, &poses).unwrap())
}

/// Within the limits, joints 2, 4 and 6.
fn swing() -> Motion {
    let mut out = START_POSE;
    (out[1], out[3], out[5]) = (out[1] - 0.1, out[3] - 0.1, out[5] - 0.6);
    let poses = [START_POSE, out, START_POSE];
    Motion::Spline(JointTrajectory::new(&[0.0, 0.8, 1.6], &poses).unwrap())
}

/// Within the limits, from pose to pose.
fn go(limits: &Limits) -> Motion {
    let mut to = START_POSE;
    (to[1], to[5]) = (to[1] + 0.2, to[5] + 0.9);
    plan_move(&START_POSE, &to, 0.3, limits).unwrap()
}

/// Rests for a while and then is no number.
fn not_finite() -> Motion {
    let axes: [AxisPhases; JOINTS] = core::array::from_fn(|j| {
        let mut phases = [Phase::default(); MAX_PHASES];
        phases[0].duration_s = 0.2;
        (phases[1].duration_s, phases[1].jerk_rad_s3) = (0.2, f64::NAN);
        let start = AxisState {
            q: START_POSE[j],
            ..AxisState::default()
        };
        AxisPhases::new(start, phases)
    });
    let (phases, end) = (PhasedMotion::new(axes), START_POSE);
    Motion::Move { phases, end }
}

/// A move with twice the jerk that is allowed.
fn jerky(limits: &Limits) -> Motion {
    let harder = Limits::try_from(LimitsSpec {
        jerk_max_rad_s3: limits.jerk_max_rad_s3 * 2.0,
        ..limits.clone().into()
    })
    .unwrap();
    plan_move(&START_POSE, &Bench::pose(7, 1.0), 1.0, &harder).unwrap()
}

/// Brings the loop to `code`, with each kind of motion where one is spoilt;
/// false where it cannot be brought there.
fn lead_to(bench: &mut Bench<'_>, code: FaultCode) -> bool {
    let motions = [swing(), go(&bench.limits)];
    match scenario_of(code) {
        Scenario::Never(_because) => return false,
        Scenario::Refused(ask) => {
            bench.recover();
            bench.cycle();
            ask(bench);
            bench.until_still();
            assert!(bench.met.contains(&(code as u16)), "{code:?}");
        }
        Scenario::Motion(make, operating_mode) => {
            bench.recover();
            bench.last_cause = FaultCode::None;
            bench.begin(make(&bench.limits), operating_mode, 0);
            bench.until_still();
            assert_eq!(bench.last_cause, code);
        }
        Scenario::Spoilt(spoil) => {
            for motion in motions {
                bench.recover();
                bench.hold();
                bench.begin(motion, OperatingMode::Throw, 30);
                let stopped_by = bench.last_cause;
                assert!(bench.mode().is_moving(), "{code:?}: {stopped_by:?}");
                bench.last_cause = FaultCode::None;
                spoil(bench);
                bench.until_still();
                assert_eq!(bench.last_cause, code);
            }
        }
    }
    true
}

/// Runs at least `cycles` through every mode and every fault that can be met,
/// by every command interface, and says how many ran.
pub(crate) fn run(cycles: u64, watch: &mut dyn Watch) -> u64 {
    let (mut met, mut seen, mut ran) = (BTreeSet::new(), [0; 6], 0);
    // At 250 Hz the tool's speed limit comes before its largest step, at 100 Hz
    // after it.
    let (step, tool_speed) = (FaultCode::SetpointStep, FaultCode::SetpointTcpSpeed);
    for (interface, rate_hz, hidden) in [
        (CommandInterface::ServoPosition, 250.0, step),
        (CommandInterface::JointVelocity, 250.0, step),
        (CommandInterface::ServoPosition, 100.0, tool_speed),
    ] {
        let mut bench = Bench::new(interface, rate_hz, watch);
        for _ in 0..5 {
            bench.cycle();
        }
        while bench.cycles < cycles / 3 + 1 {
            for code in FaultCode::ALL {
                if code != hidden && lead_to(&mut bench, code) {
                    met.insert(code as u16);
                }
            }
            bench.recover();
            bench.begin(swing(), OperatingMode::Throw, 0);
            bench.until_still();
            assert_eq!(bench.mode(), ControllerMode::Idle, "a throw in peace");
        }
        ran += bench.cycles;
        for (sum, more) in seen.iter_mut().zip(bench.seen) {
            *sum += more;
        }
    }
    println!("{ran} cycles, by mode (Offline to Faulted): {seen:?}; codes met: {met:?}");
    assert!(seen.iter().all(|cycles| *cycles > 0), "{seen:?}");
    let expected: BTreeSet<u16> = FaultCode::ALL
        .into_iter()
        .filter(|code| !matches!(scenario_of(*code), Scenario::Never(_)))
        .map(|code| code as u16)
        .collect();
    assert_eq!(met, expected);
    ran
}
