//! A rig on which a fast throw is about to run, by either command interface.

use arm_model::{JointTrajectory, JointVector, Limits};
use hil_tests::scenario::entry;
use hil_tests::virtual_rig::{VirtualRig, VirtualRigConfig};
use rt_controller::control::{ControlCommand, ControlEvent, ControlSettings, Motion, Thresholds};
use shared_types::ipc::{ControllerMode, CycleRecord};
use shared_types::{Arming, CommandInterface, MonotonicNs, OperatingMode};
use xarm_sim::ArmEvent;

/// Both ways setpoints travel.
pub(crate) const INTERFACES: [CommandInterface; 2] = [
    CommandInterface::ServoPosition,
    CommandInterface::JointVelocity,
];
/// In the middle of the throw: a joint is asked for more than 1.2 rad/s.
pub(crate) const MID_THROW: &str = "on = \"speed:1.2\"";

/// A fault in the middle of the throw.
pub(crate) fn mid_throw(rest: &str) -> String {
    entry(MID_THROW, rest)
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
    let limits = Limits::default();
    (20..400)
        .find_map(|k| {
            let step_s = f64::from(k) * 0.005;
            let times = [0.0, step_s, 2.0 * step_s, 3.0 * step_s];
            let throw = JointTrajectory::new(&times, &poses).unwrap();
            limits.worst_violation(&throw).is_none().then_some(throw)
        })
        .expect("slow enough, it fits the limits")
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
        let via = config.settings.interface;
        let mut rig = VirtualRig::new(config);
        rig.bring_up().unwrap();
        rig.run_for(0.5);
        let throw = fast_throw(rig.commanded());
        Self { rig, via, throw }
    }

    /// A stage whose throw has begun.
    pub(crate) fn throwing(via: CommandInterface, script: &str) -> Self {
        let mut stage = Self::ready(via, script);
        stage.begin();
        stage
    }

    /// A stage whose throw has ended, one way or the other.
    pub(crate) fn thrown(via: CommandInterface, script: &str) -> Self {
        let mut stage = Self::throwing(via, script);
        stage.finish();
        stage
    }

    /// Arms for a throw.
    pub(crate) fn arm(&mut self) {
        self.rig.command(ControlCommand::Arm(Arming {
            operating_mode: OperatingMode::Throw,
            expires_ns: u64::MAX,
            area_clear: true,
        }));
    }

    /// Arms and begins the throw.
    pub(crate) fn begin(&mut self) {
        assert_eq!(
            self.rig.mode(),
            ControllerMode::Idle,
            "{:?}",
            self.rig.log.causes
        );
        self.arm();
        self.rig.start(Motion::Spline(self.throw));
        self.rig.run_cycles(2);
        assert_eq!(
            self.rig.mode(),
            ControllerMode::Streaming,
            "{:?}",
            self.rig.log.events
        );
    }

    /// Runs until the throw is over by far.
    pub(crate) fn finish(&mut self) {
        self.rig.run_for(self.throw.duration_s() + 1.5);
    }

    /// Runs for a part of the throw.
    pub(crate) fn run_part(&mut self, part: f64) {
        self.rig.run_for(part * self.throw.duration_s());
    }

    /// Commands that the arm got from the controller: setpoints or velocities.
    pub(crate) fn commands(&self) -> usize {
        self.arrivals().len()
    }

    /// When the controller's commands reached the arm, and what they said (rad or
    /// rad/s).
    pub(crate) fn arrivals(&self) -> Vec<(MonotonicNs, JointVector)> {
        let own = self
            .rig
            .log
            .arm_events
            .iter()
            .filter(|e| e.client != Some(u32::MAX));
        own.filter_map(|e| match e.event {
            ArmEvent::Setpoint(q) => Some((e.at, q)),
            ArmEvent::Velocity { qd, .. } => Some((e.at, qd)),
            _ => None,
        })
        .collect()
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

    /// True speed of the fastest joint now (rad/s).
    pub(crate) fn speed(&self) -> f64 {
        self.rig
            .with_arm(|arm| arm.model().true_motion().qd.max_abs())
    }
}
