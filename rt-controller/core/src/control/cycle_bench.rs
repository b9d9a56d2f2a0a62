//! A core with an arm that follows it, for tests of whole cycles in virtual time.

use super::*;
use crate::control::exchange::ControlCommand;
use crate::control::limiter::{Allowance, Limiter};
use crate::control::{LinkInput, Thresholds};
use crate::xarm::StateRequest;
use arm_model::JointTrajectory;
use arm_model::joint::START_POSE;
use shared_types::ipc::{CauseRecord, GuardianBeat, JointReport, OperatorBeat};

pub(super) const PERIOD_NS: u64 = 4_000_000;
pub(super) const ENGAGE: ControlCommand = ControlCommand::Engage { hold: START_POSE };

/// A cycle in which all is well: the heartbeats go on and the arm is in `q` (rad).
pub(super) fn quiet_input(now_ns: u64, count: u64, q: JointVector) -> CycleInput {
    CycleInput {
        deadline_ns: now_ns,
        operator: OperatorBeat {
            count,
            ..OperatorBeat::default()
        },
        guardian: GuardianBeat {
            count,
            phase: GuardianBeat::WATCHING,
            connected: 1,
            ..GuardianBeat::default()
        },
        link: LinkInput {
            status: Some(Status(0)),
            reply_ns: 1000,
            ..LinkInput::default()
        },
        reports: Some(JointReport {
            arm_state: 1,
            arm_mode: 1,
            stamp_ns: now_ns - 1_000_000,
            arrival_ns: now_ns - 500_000,
            q,
            ..JointReport::default()
        })
        .into(),
        ..CycleInput::default()
    }
}

/// A controller with an arm that follows two cycles late.
pub(super) struct Bench {
    pub(super) state: ControlState,
    pub(super) now_ns: u64,
    pub(super) beat: u64,
    pub(super) commanded: [JointVector; 3],
    /// Judges what is sent, independently of the state's own limiter.
    pub(super) judge: Limiter,
    pub(super) events: Vec<ControlEvent>,
    pub(super) sent: Vec<JointVector>,
    pub(super) requests: Vec<StateRequest>,
}

impl Bench {
    pub(super) fn offline() -> Self {
        Self::of(Thresholds::relaxed())
    }

    pub(super) fn of(settings: impl Into<ControlSettings>) -> Self {
        let limits = Limits::default();
        Self {
            judge: Limiter::at_rest(START_POSE, &limits),
            state: ControlState::new(limits, settings),
            now_ns: 1_000_000_000_000,
            beat: 0,
            commanded: [START_POSE; 3],
            events: Vec::new(),
            sent: Vec::new(),
            requests: Vec::new(),
        }
    }

    pub(super) fn holding() -> Self {
        Self::holding_with(Thresholds::relaxed())
    }

    pub(super) fn holding_with(settings: impl Into<ControlSettings>) -> Self {
        let mut bench = Self::of(settings);
        bench.command(ENGAGE);
        bench.cycles(100);
        assert_eq!(bench.state.mode(), ControllerMode::Idle);
        bench.events.clear();
        bench
    }

    pub(super) fn input(&mut self, missed: u32) -> CycleInput {
        self.now_ns += PERIOD_NS * (1 + u64::from(missed));
        self.beat += 1;
        CycleInput {
            missed,
            ..quiet_input(self.now_ns, self.beat, self.commanded[2])
        }
    }

    pub(super) fn step(&mut self, input: CycleInput) {
        let step_s = f64::from(input.missed + 1) * 0.004;
        let out = self.state.step(input);
        if let Some(q) = out.setpoint() {
            let limits = Limits::default();
            let allowed = Allowance {
                tcp_speed_max_m_s: limits.tcp_speed_max_m_s,
                streamed: true,
            };
            self.judge.admit(&q, step_s, &limits, &allowed).unwrap();
            self.sent.push(q);
            self.commanded = [q, self.commanded[0], self.commanded[1]];
        }
        self.events.extend(out.events);
        self.requests.extend(out.request);
    }

    pub(super) fn cycle(&mut self) {
        self.cycle_with(|_| ());
    }

    /// A cycle whose input `change` has changed.
    pub(super) fn cycle_with(&mut self, change: impl FnOnce(&mut CycleInput)) {
        let mut input = self.input(0);
        change(&mut input);
        self.step(input);
    }

    /// Cycles that are all spoilt, the first of them with a command.
    pub(super) fn spoilt_cycles(
        &mut self,
        count: usize,
        mut command: Option<ControlCommand>,
        spoil: impl Fn(&mut CycleInput),
    ) {
        for _ in 0..count {
            self.cycle_with(|input| {
                spoil(input);
                input.command = command.take();
            });
        }
    }

    pub(super) fn cycles(&mut self, count: usize) {
        (0..count).for_each(|_| self.cycle());
    }

    pub(super) fn command(&mut self, command: ControlCommand) {
        self.cycle_with(|input| input.command = Some(command));
    }

    pub(super) fn run(&mut self, motion: Motion) {
        self.command(run_command(7, motion));
    }

    pub(super) fn cycles_until_still(&mut self) -> usize {
        (0..5000)
            .take_while(|_| {
                self.cycle();
                self.state.mode().is_moving()
            })
            .count()
    }

    pub(super) fn latched(&self) -> Option<FaultCode> {
        cause_in(&self.events).map(|cause| cause.fault())
    }
}

pub(super) fn run_command(id: u64, motion: Motion) -> ControlCommand {
    let motion = Box::new(motion);
    ControlCommand::Run { id, motion }
}

pub(super) fn swing() -> Motion {
    let mut up = START_POSE;
    (up[5], up[1]) = (up[5] - 0.6, up[1] - 0.2);
    let times = [0.0, 0.6, 1.2];
    Motion::Spline(JointTrajectory::new(&times, &[START_POSE, up, START_POSE]).unwrap())
}

pub(super) fn cause_in(events: &[ControlEvent]) -> Option<CauseRecord> {
    let mut causes = events.iter().filter_map(|event| match event {
        ControlEvent::Latched(cause) => Some(*cause),
        _ => None,
    });
    let first = causes.next();
    assert!(causes.next().is_none(), "one cause per stop");
    first
}
