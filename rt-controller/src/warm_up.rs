//! Warm caches for each cycle: a shadow controller steps shortly before its deadline.
//!
//! Between two deadlines the core does other things or sleeps, and loses the
//! loop's instructions from its caches: a cycle then takes five times as long as
//! it would right after another one. So the loop wakes a little early, steps a
//! second control core, which moves an imaginary arm and is connected to nothing,
//! and waits for the deadline by looking at the clock. The real core's step finds
//! warm caches and trained branch predictors then, and starts on time: what the
//! system took for waking up is over. It costs the time that the loop is awake.
//!
//! Nothing of the shadow controller gets into the real core, its outputs or its records: a
//! run is the same with and without.

use crate::control::record::record_input;
use crate::control::{
    ControlCommand, ControlSettings, ControlState, CycleInput, LinkInput, Motion, Thresholds,
};
use crate::xarm::Status;
use arm_model::joint::START_POSE;
use arm_model::{JointTrajectory, JointVector, Limits, TrajectoryError};
use core::hint::black_box;
use shared_types::CommandInterface;
use shared_types::ipc::{ControllerMode, GuardianBeat, JointReport, OperatorBeat};

/// Joint 7 to and fro by this (rad): in a pause of a second it never gets farther
/// than one setpoint may go.
const SWING_RAD: f64 = 0.1;

/// Settings with which nothing that a machine does to the loop stops a motion.
#[must_use]
pub fn patient() -> ControlSettings {
    const EVER_NS: u64 = u64::MAX / 4;
    ControlSettings::from(Thresholds {
        operator_timeout_ns: EVER_NS,
        reply_stall_ns: EVER_NS,
        unanswered_max: 250,
        report_stale_ns: EVER_NS,
        report_frozen_ns: EVER_NS,
        tracking_error_max_rad: f64::INFINITY,
        tracking_window_ns: EVER_NS,
        clock_resyncs_max: u32::MAX,
        report_broken_max: u32::MAX,
        late_cycles_max: u32::MAX,
        missed_cycles_max: u32::MAX,
        ..Thresholds::relaxed()
    })
}

/// Joint 7 to and fro for eight minutes, slowly, and never away from its middle;
/// it ends where it begins. Not RT-safe.
///
/// # Errors
/// [`TrajectoryError`]; a defect.
pub fn swinging(from: JointVector) -> Result<Motion, TrajectoryError> {
    let inwards = -SWING_RAD * from[6].signum();
    let (times_s, poses): (Vec<f64>, Vec<JointVector>) = (0..=240)
        .map(|k| {
            let mut q = from;
            q[6] += inwards * f64::from(k % 2);
            (2.0 * f64::from(k), q)
        })
        .unzip();
    JointTrajectory::new(&times_s, &poses).map(Motion::Spline)
}

/// The report of an arm that is where it was commanded to be (rad) by the setpoint due
/// at `due_ns`, received at `now_ns`.
#[must_use]
pub fn report(
    q: JointVector,
    interface: CommandInterface,
    due_ns: u64,
    now_ns: u64,
) -> JointReport {
    JointReport {
        arm_state: 1,
        arm_mode: interface.arm_mode(),
        stamp_ns: due_ns,
        arrival_ns: now_ns,
        q,
        ..JointReport::default()
    }
}

/// The second core and its imaginary arm.
#[derive(Debug)]
pub struct CacheWarmUp {
    shadow: ControlState,
    /// How long before a deadline it takes place (ns).
    pub(crate) ahead_ns: u64,
    /// The swing while it does not run; it is used again and again.
    motion: Option<Box<Motion>>,
    q: JointVector,
    due_ns: u64,
    cycles: u64,
}

impl CacheWarmUp {
    /// A warm-up `ahead_us` before each deadline of a loop with these limits and
    /// this command interface. Not RT-safe.
    ///
    /// # Errors
    /// [`TrajectoryError`]; a defect.
    pub fn new(
        limits: Limits,
        interface: CommandInterface,
        ahead_us: u32,
    ) -> Result<Self, TrajectoryError> {
        let settings = ControlSettings {
            interface,
            ..patient()
        };
        Ok(Self {
            shadow: ControlState::new(limits, settings),
            ahead_ns: u64::from(ahead_us).saturating_mul(1000),
            motion: Some(Box::new(swinging(START_POSE)?)),
            q: START_POSE,
            due_ns: 0,
            cycles: 0,
        })
    }

    /// The same for the arm that a controller drives: its predictions are warmed up, too.
    #[must_use]
    pub fn for_arm_of(mut self, control: &ControlState) -> Self {
        self.shadow = self.shadow.measured_as(control);
        self
    }

    /// One cycle of the shadow controller, due at `deadline_ns`. RT-safe.
    pub fn cycle(&mut self, deadline_ns: u64, operator: OperatorBeat, guardian: GuardianBeat) {
        self.cycles = self.cycles.wrapping_add(1);
        let input = CycleInput {
            deadline_ns,
            command: self.command(),
            operator: OperatorBeat {
                count: self.cycles,
                ..OperatorBeat::default()
            },
            link: LinkInput {
                status: Some(Status(0)),
                reply_ns: 1000,
                ..LinkInput::default()
            },
            reports: Some(report(
                self.q,
                self.shadow.settings().interface,
                self.due_ns,
                deadline_ns,
            ))
            .into(),
            ..CycleInput::default()
        };
        black_box((operator, guardian));
        black_box(record_input(&input, self.cycles));
        let mut out = self.shadow.step(input);
        self.motion = self.motion.take().or_else(|| out.retired.pop());
        (self.q, self.due_ns) = (out.record.q_c, deadline_ns);
        black_box(&out.record);
    }

    /// What makes the shadow controller move, or nothing.
    fn command(&mut self) -> Option<ControlCommand> {
        match self.shadow.mode() {
            ControllerMode::Offline | ControllerMode::Faulted => {
                Some(ControlCommand::Engage { hold: START_POSE })
            }
            ControllerMode::Idle => {
                let motion = self.motion.take()?;
                Some(ControlCommand::Run {
                    id: self.cycles,
                    motion,
                })
            }
            ControllerMode::Moving | ControllerMode::Streaming | ControllerMode::Braking => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_NS: u64 = 4_000_000;

    /// Over twenty minutes, with gaps of up to a second, it moves in nearly every cycle:
    /// its one motion is never lost.
    #[test]
    fn the_shadow_controller_moves_all_the_time_and_keeps_its_motion() {
        for interface in [
            CommandInterface::ServoPosition,
            CommandInterface::JointVelocity,
        ] {
            let mut warm_up = CacheWarmUp::new(Limits::default(), interface, 200).unwrap();
            let (mut now_ns, mut moving) = (1_000_000_000_000, 0);
            for k in 0..300_000_u64 {
                let gap = if k % 10_007 == 0 { 250 } else { 1 };
                now_ns += gap * PERIOD_NS;
                warm_up.cycle(now_ns, OperatorBeat::default(), GuardianBeat::default());
                moving += u64::from(warm_up.shadow.mode() == ControllerMode::Streaming);
            }
            assert!(moving > 299_000, "{interface:?}: {moving}");
        }
    }
}
