//! A rig on which a fast throw is about to run, by either command interface.

use arm_model::limits::LimitKind;
use arm_model::{JointTrajectory, JointVector, Limits};
use hil_tests::scenario::entry;
use hil_tests::virtual_rig::{VirtualRig, VirtualRigConfig};
use rt_controller::control::{ControlCommand, ControlEvent, ControlSettings, Motion, Thresholds};
use rt_controller::xarm::{ArmState, Register};
use shared_types::ipc::{ControllerMode, CycleRecord};
use shared_types::{Arming, CommandInterface, MonotonicNs, OperatingMode};
use std::ops::Range;
use xarm_sim::ArmEvent;

/// Both ways setpoints travel.
pub(crate) const INTERFACES: [CommandInterface; 2] = [
    CommandInterface::ServoPosition,
    CommandInterface::JointVelocity,
];

/// A fault in the middle of the throw, when a joint is asked for more than 1.2 rad/s.
pub(crate) fn mid_throw(fault: &str) -> String {
    entry("on = 'speed:1.2'", fault)
}

/// Back and forth with joint 7, possible wherever the arm stopped.
pub(crate) fn nod(from: JointVector) -> Motion {
    let mut out = from;
    out[6] += if from[6] > 0.0 { -0.2 } else { 0.2 };
    let times = [0.0, 0.4, 0.8];
    Motion::Spline(JointTrajectory::new(&times, &[from, out, from]).unwrap())
}

/// A wind-up and a throw with joints 2, 4 and 6, as fast as the limits allow to
/// five milliseconds.
pub(crate) fn fast_throw(from: JointVector) -> JointTrajectory {
    let by = |two: f64, four: f64, six: f64| {
        let mut q = from;
        (q[1], q[3], q[5]) = (q[1] + two, q[3] + four, q[5] + six);
        q
    };
    let poses = [
        from,
        by(-0.25, 0.30, -0.5),
        by(0.25, -0.35, 0.9),
        by(0.1, -0.1, 0.3),
    ];
    fastest_through(&poses, &Limits::default(), 0.005, 20..400)
        .expect("slow enough, it fits the limits")
}

/// The fastest of the throws through `poses`, evenly in time, that keeps `limits`: between
/// two poses it takes one of `counts` times `tick_s`.
pub(crate) fn fastest_through(
    poses: &[JointVector; 4],
    limits: &Limits,
    tick_s: f64,
    mut counts: Range<u32>,
) -> Option<JointTrajectory> {
    let throw = |step_s: f64| {
        let times = [0.0, step_s, 2.0 * step_s, 3.0 * step_s];
        JointTrajectory::new(&times, poses).unwrap()
    };
    // The same path in another time: speeds scale with one over it, accelerations with the
    // square, positions not. None that is faster than this can keep the limits.
    let needed_s = limits.margins(&throw(1.0)).into_iter().map(|margin| {
        let times_limit = 1.0 - margin.left;
        match margin.kind {
            LimitKind::PositionMin | LimitKind::PositionMax if margin.left < 0.0 => f64::INFINITY,
            LimitKind::PositionMin | LimitKind::PositionMax => 0.0,
            LimitKind::Velocity | LimitKind::TcpSpeed => times_limit,
            LimitKind::Acceleration => times_limit.sqrt(),
        }
    });
    // The tool's peak speed is sampled, so one tick is left to be tried.
    let needed = needed_s.fold(0.0, f64::max) / tick_s - 1.0;
    counts.find_map(|k| {
        let throw = (f64::from(k) >= needed).then(|| throw(f64::from(k) * tick_s))?;
        limits.worst_violation(&throw).is_none().then_some(throw)
    })
}

/// A rig, the command interface it uses and what it is to throw.
pub(crate) struct Stage {
    pub(crate) rig: VirtualRig,
    pub(crate) via: CommandInterface,
    pub(crate) throw: JointTrajectory,
}

/// The set-up of a stage: strict thresholds, arming and guardian required.
pub(crate) fn config(via: CommandInterface, script: &str) -> VirtualRigConfig {
    let settings = ControlSettings {
        interface: via,
        arming_required: true,
        guardian_required: true,
        ..Thresholds::strict().into()
    };
    VirtualRigConfig::new(settings, script.parse().unwrap())
}

impl Stage {
    /// The arm is held and has settled; nothing is armed.
    pub(crate) fn ready(via: CommandInterface, script: &str) -> Self {
        Self::of(config(via, script))
    }

    /// The same of another set-up.
    pub(crate) fn of(config: VirtualRigConfig) -> Self {
        Self::throwing_from(config, fast_throw)
    }

    /// The same with the throw that it is given for the pose in which the arm is held.
    pub(crate) fn throwing_from(
        config: VirtualRigConfig,
        throw: impl FnOnce(JointVector) -> JointTrajectory,
    ) -> Self {
        let via = config.settings.interface;
        let mut rig = VirtualRig::new(config);
        rig.bring_up().unwrap();
        rig.run_for(0.5);
        let throw = throw(rig.commanded());
        Self { rig, via, throw }
    }

    /// A stage whose throw has begun.
    pub(crate) fn throwing(via: CommandInterface, script: &str) -> Self {
        let mut stage = Self::ready(via, script);
        stage.begin();
        stage
    }

    /// A stage whose throw has ended; after a part of it something happened to the rig.
    pub(crate) fn disturbed(
        via: CommandInterface,
        part: f64,
        happens: impl FnOnce(&mut VirtualRig),
    ) -> Self {
        let mut stage = Self::throwing(via, "");
        stage.run_fraction(part);
        happens(&mut stage.rig);
        stage.finish();
        stage
    }

    /// A stage whose throw has ended, one way or the other.
    pub(crate) fn thrown(via: CommandInterface, script: &str) -> Self {
        let mut stage = Self::throwing(via, script);
        stage.finish();
        stage
    }

    pub(crate) fn assert_mode(&self, mode: ControllerMode) {
        let log = &self.rig.log;
        assert_eq!(self.rig.mode(), mode, "{:?} {:?}", log.causes, log.events);
    }

    /// Arms for a throw.
    pub(crate) fn arm(&mut self) {
        self.arm_for(OperatingMode::Throw);
    }

    /// Arms, for a throw with the area declared clear.
    pub(crate) fn arm_for(&mut self, operating_mode: OperatingMode) {
        self.rig.command(ControlCommand::Arm(Arming {
            operating_mode,
            expires_ns: u64::MAX,
            area_clear: operating_mode == OperatingMode::Throw,
        }));
    }

    /// Orders a nod from where the arm is commanded to be.
    pub(crate) fn start_nod(&mut self) {
        self.rig.start(nod(self.rig.commanded()));
    }

    /// Arms and begins the throw.
    pub(crate) fn begin(&mut self) {
        self.assert_mode(ControllerMode::Idle);
        self.arm();
        self.rig.start(Motion::Spline(self.throw));
        self.rig.run_cycles(2);
        self.assert_mode(ControllerMode::Streaming);
    }

    /// Runs until the throw is over by far.
    pub(crate) fn finish(&mut self) {
        self.rig.run_for(self.throw.duration_s() + 1.5);
    }

    /// Runs for a part of the throw.
    pub(crate) fn run_fraction(&mut self, part: f64) {
        self.rig.run_for(part * self.throw.duration_s());
    }

    /// Commands that the arm got from the controller: setpoints or velocities.
    pub(crate) fn commands(&self) -> usize {
        self.rig.log.arrivals().count()
    }

    /// Requests by the controller to change the arm's state.
    pub(crate) fn state_requests_since(&self, since: MonotonicNs) -> usize {
        let register = Register::SetState.code();
        let events = self.rig.log.arm_events.iter();
        let own = events.filter(|e| e.client != Some(u32::MAX) && e.at >= since);
        own.filter(|e| e.event == ArmEvent::Request { register })
            .count()
    }

    /// Errors that the arm raised.
    pub(crate) fn arm_errors(&self) -> Vec<u8> {
        let events = self.rig.log.arm_events.iter();
        events
            .filter_map(|e| match e.event {
                ArmEvent::Error(code) => Some(code.0),
                _ => None,
            })
            .collect()
    }

    /// When fault `entry` of the script, from 1, began.
    pub(crate) fn fault_began(&self, entry: usize) -> MonotonicNs {
        let mut events = self.rig.log.arm_events.iter();
        events
            .find_map(|e| match e.event {
                ArmEvent::Fault {
                    entry: found,
                    begins: true,
                    ..
                } if found == entry => Some(e.at),
                _ => None,
            })
            .expect("the fault began")
    }

    /// Refusals so far: the number of the motion, and why.
    pub(crate) fn refusals(&self) -> Vec<(Option<u64>, shared_types::FaultCode)> {
        let events = self.rig.log.events.iter();
        events
            .filter_map(|(_, event)| match event {
                ControlEvent::Refused { id, fault } => Some((*id, *fault)),
                _ => None,
            })
            .collect()
    }

    /// Motions that were followed to their end.
    pub(crate) fn finished(&self) -> usize {
        let events = self.rig.log.events.iter();
        events
            .filter(|(_, event)| matches!(event, ControlEvent::Finished { .. }))
            .count()
    }

    /// Cycles in which a motion was followed.
    pub(crate) fn on_path(&self) -> impl Iterator<Item = &CycleRecord> {
        let records = self.rig.log.records.iter();
        records.filter(|r| r.sent == 1 && r.trajectory_s >= 0.0)
    }

    /// State that the arm is in.
    pub(crate) fn arm_state(&self) -> ArmState {
        self.rig.with_arm(|arm| arm.model().state())
    }

    /// True speed of the fastest joint now (rad/s).
    pub(crate) fn speed(&self) -> f64 {
        self.rig
            .with_arm(|arm| arm.model().true_motion().qd.max_abs())
    }
}
