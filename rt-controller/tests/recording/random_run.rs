//! A seeded run of the core alone, with motions, commands and everything that can
//! go wrong on the way in, recorded like the controller records it.

#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "tests and an example use this, each a part of it, and may fail loudly"
)]

use arm_model::joint::START_POSE;
use arm_model::{JOINTS, JointTrajectory, JointVector, Limits};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rt_controller::control::monitor::prediction::MeasuredLag;
use rt_controller::control::record::record_input;
use rt_controller::control::{
    ArmCodes, ControlCommand, ControlEvent, ControlState, CycleInput, Motion, Thresholds,
};
use rt_controller::point_to_point::plan_move;
use rt_controller::recording::{ChunkWriter, RecordedCycle, Snapshot};
use rt_controller::xarm::Status;
use shared_types::ipc::{ControllerMode, JointReport, PAYLOAD_VERSION};
use std::ops::Range;

/// One cycle.
const PERIOD_NS: u64 = 4_000_000;
/// Cycles from keyframe to keyframe.
const KEYFRAME_EVERY: u64 = 250;
/// How late the imagined arm follows (cycles).
const LAG: usize = 3;

/// A recorded run, as it would lie on the disk.
pub(crate) fn record_run(seed: u64, cycles: u64) -> Vec<u8> {
    record_run_with(seed, cycles, 0..0, |_| ())
}

/// The same of an arm that was measured but for its last joint.
pub(crate) fn record_measured_run(seed: u64, cycles: u64) -> Vec<u8> {
    let mut lags = [Some(MeasuredLag {
        dead_time_s: 0.001 * LAG as f64 * 4.0,
        natural_frequency_rad_s: 2000.0,
        damping_ratio: 1.0,
    }); JOINTS];
    lags[6] = None;
    let control = ControlState::new(Limits::default(), Thresholds::strict());
    record(control.measured(&lags), seed, cycles, 0..0, |_| ())
}

/// A run of which the cycles `lost` are not recorded and every other is changed by
/// `change`.
pub(crate) fn record_run_with(
    seed: u64,
    cycles: u64,
    lost: Range<u64>,
    change: impl FnMut(&mut RecordedCycle),
) -> Vec<u8> {
    let control = ControlState::new(Limits::default(), Thresholds::strict());
    record(control, seed, cycles, lost, change)
}

fn record(
    mut control: ControlState,
    seed: u64,
    cycles: u64,
    lost: Range<u64>,
    mut change: impl FnMut(&mut RecordedCycle),
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = ChunkWriter::default();
    let mut world = World::new(seed);
    for cycle in 1..=cycles {
        if cycle % KEYFRAME_EVERY == 1 {
            let snapshot = Snapshot::of(&control).expect("a state fits into a snapshot");
            bytes.extend(writer.keyframe(&snapshot).unwrap_or_default());
        }
        let input = world.input(control.mode());
        if let Some(ControlCommand::Run { id, motion }) = &input.command {
            writer.motion(*id, motion);
        }
        let recorded = record_input(&input, cycle);
        let out = control.step(input);
        world.take(&out.record);
        let mut recorded = RecordedCycle {
            input: recorded,
            record: out.record,
        };
        recorded.record.compute_ns = 1234;
        change(&mut recorded);
        if !lost.contains(&cycle) {
            bytes.extend(writer.cycle(&recorded).unwrap_or_default());
        }
        for event in &out.events {
            if let ControlEvent::Latched(cause) = event {
                writer.cause(cause);
            }
        }
    }
    bytes.extend(writer.flush().unwrap_or_default());
    bytes
}

/// An arm that follows late, an operator, and bad luck.
struct World {
    rng: ChaCha8Rng,
    now_ns: u64,
    beat: u64,
    followed: [JointVector; LAG],
    commanded: JointVector,
    last_id: u64,
}

impl World {
    fn new(seed: u64) -> Self {
        Self {
            rng: ChaCha8Rng::seed_from_u64(seed),
            now_ns: 1_000_000_000,
            beat: 0,
            followed: [START_POSE; LAG],
            commanded: START_POSE,
            last_id: 0,
        }
    }

    /// True once in `cycles` cycles.
    fn once_in(&mut self, cycles: u32) -> bool {
        self.rng.random_range(0..cycles) == 0
    }

    fn take(&mut self, record: &shared_types::ipc::CycleRecord) {
        if record.sent != 0 {
            self.commanded = record.q_c;
        }
        self.followed.rotate_left(1);
        self.followed[LAG - 1] = self.commanded;
    }

    fn input(&mut self, mode: ControllerMode) -> CycleInput {
        let missed = if self.once_in(4000) {
            self.rng.random_range(1..9)
        } else {
            0
        };
        self.now_ns += PERIOD_NS * (1 + u64::from(missed));
        let mut input = CycleInput {
            deadline_ns: self.now_ns,
            missed,
            command: self.command(mode),
            ..CycleInput::default()
        };
        if !self.once_in(9) {
            self.beat += 1;
        }
        input.operator.version = PAYLOAD_VERSION;
        input.operator.count = self.beat;
        input.operator.stop = u32::from(mode.is_moving() && self.once_in(5000));
        input.link.status = Some(Status(u8::from(self.once_in(20_000)) * 0x40));
        input.link.reply_ns = self.rng.random_range(200_000..900_000);
        if mode.is_moving() && self.once_in(6000) {
            input.link.unanswered_ns = self.rng.random_range(0..30_000_000);
            input.link.unanswered = self.rng.random_range(0..8);
        }
        input.link.lost = self.once_in(20_000);
        input.link.duplicates = u16::from(self.once_in(300));
        if self.once_in(50) {
            input.codes = Some(ArmCodes {
                error: 0,
                warning: 0,
                state: 1,
                mode: 1,
                arrival_ns: self.now_ns,
            });
        }
        input.broken_reports = u32::from(self.once_in(500));
        if !self.once_in(40) {
            input.reports.push(self.report());
        }
        input
    }

    fn report(&mut self) -> JointReport {
        let [q, next, _] = self.followed;
        let jump = f64::from(u8::from(self.once_in(15_000))) * 0.1;
        let noise = JointVector::splat(self.rng.random_range(-1e-5..1e-5) + jump);
        JointReport {
            version: PAYLOAD_VERSION,
            arm_state: 1,
            arm_mode: 1,
            arm_clock: 1,
            stamp_ns: self.now_ns - 3_000_000,
            arrival_ns: self.now_ns - 1_000_000,
            q: q + noise,
            qd: (next - q) * 250.0,
            q_target: self.commanded,
        }
    }

    fn command(&mut self, mode: ControllerMode) -> Option<ControlCommand> {
        match mode {
            ControllerMode::Offline | ControllerMode::Faulted => {
                self.once_in(100).then_some(ControlCommand::Engage {
                    hold: self.commanded,
                })
            }
            ControllerMode::Idle if self.once_in(50) => Some(self.motion()),
            _ if self.once_in(10_000) => Some(ControlCommand::Stop),
            _ => None,
        }
    }

    fn motion(&mut self) -> ControlCommand {
        self.last_id += 1;
        let mut end = START_POSE;
        for joint in 0..7 {
            end[joint] += self.rng.random_range(-0.25..0.25);
        }
        let from = self.commanded;
        let limits = Limits::default();
        let motion = if self.once_in(2) {
            plan_move(&from, &end, self.rng.random_range(0.2..0.9), &limits).unwrap()
        } else {
            let middle = from + (end - from) * 0.6;
            Motion::Spline(JointTrajectory::new(&[0.0, 0.7, 1.2], &[from, middle, end]).unwrap())
        };
        ControlCommand::Run {
            id: self.last_id,
            motion: Box::new(motion),
        }
    }
}
