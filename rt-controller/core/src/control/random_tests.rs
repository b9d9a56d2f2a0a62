//! Random inputs of every kind, for as many cycles as wanted: nothing panics, no
//! setpoint and no velocity breaks a limit, every stop has exactly one cause, and every
//! cycle can be stepped again from its record.
//!
//! `WAG_LONG_TESTS=1` runs ten million cycles on each interface instead of 150 000.

use super::bench::{PERIOD_NS, quiet_input};
use super::*;
use crate::control::record::{record_input, restore_input};
use crate::control::{ArmCodes, ControlCommand, Thresholds};
use crate::overrun::min_gap_ns;
use crate::point_to_point::plan_move;
use arm_model::joint::START_POSE;
use arm_model::{JOINTS, JointTrajectory, kinematics};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shared_types::ipc::{InputRecord, JointReport, Reports};
use shared_types::{Arming, OperatingMode};

const PERIOD_S: f64 = 0.004;

/// Motions that begin in the start pose: gentle, at the limits, and wild.
fn motions(rng: &mut ChaCha8Rng, limits: &Limits) -> Vec<Motion> {
    let mut near =
        |reach: f64| START_POSE + JointVector([0.0; 7].map(|_| rng.random_range(-reach..reach)));
    let mut pool = Vec::new();
    for k in 0..if cfg!(miri) { 2 } else { 16 } {
        let reach = 0.1 + 0.06 * f64::from(k);
        let step_s = 0.1 + 0.04 * f64::from(k % 7);
        let times = [0.0, step_s, 2.0 * step_s, 3.0 * step_s];
        let poses = [START_POSE, near(reach), near(reach), near(reach)];
        pool.push(Motion::Spline(
            JointTrajectory::new(&times, &poses).unwrap(),
        ));
        let to = near(0.3);
        if !cfg!(miri) && limits.position_violation(&to).is_none() {
            pool.push(plan_move(&START_POSE, &to, 0.2 + 0.04 * f64::from(k), limits).unwrap());
        }
    }
    pool
}

/// Any bit pattern, often a special one.
fn any_f64(rng: &mut ChaCha8Rng) -> f64 {
    match rng.random_range(0..6) {
        0 => f64::NAN,
        1 => f64::INFINITY,
        2 => f64::NEG_INFINITY,
        3 => rng.random_range(-10.0..10.0),
        _ => f64::from_bits(rng.random()),
    }
}

/// Makes inputs: mostly those of a good day, now and then anything.
struct Chaos {
    rng: ChaCha8Rng,
    pool: Vec<Motion>,
    now_ns: u64,
    /// Instant of the last setpoint.
    sent_ns: u64,
    beat: u64,
    commanded: [JointVector; 3],
}

impl Chaos {
    fn new(seed: u64, limits: &Limits) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        Self {
            pool: motions(&mut rng, limits),
            rng,
            now_ns: 1_000_000_000_000,
            sent_ns: 0,
            beat: 0,
            commanded: [START_POSE; 3],
        }
    }

    fn input(&mut self, mode: ControllerMode) -> CycleInput {
        let rng = &mut self.rng;
        let mut missed = if rng.random_ratio(1, 200) {
            rng.random_range(0..9)
        } else {
            0
        };
        self.now_ns += PERIOD_NS * (1 + u64::from(missed));
        if self.now_ns < self.sent_ns + min_gap_ns(PERIOD_NS) {
            self.now_ns += PERIOD_NS;
            missed += 1;
        }
        let late_ns = if rng.random_ratio(1, 20) {
            rng.random_range(200_000..4_000_000)
        } else {
            0
        };
        self.sent_ns = self.now_ns + u64::from(late_ns);
        self.beat += 1;
        let mut input = CycleInput {
            missed,
            late_ns,
            ..quiet_input(self.now_ns, self.beat, self.commanded[2])
        };
        input.command = self.command(mode);
        if self.rng.random_ratio(1, 150) {
            self.spoil(&mut input);
        }
        input
    }

    fn command(&mut self, mode: ControllerMode) -> Option<ControlCommand> {
        let rng = &mut self.rng;
        let kind = match mode {
            ControllerMode::Faulted | ControllerMode::Offline => rng.random_range(0..3),
            ControllerMode::Idle => rng.random_range(2..8),
            _ if rng.random_ratio(1, 300) => rng.random_range(0..8),
            _ => return None,
        };
        Some(match kind {
            0 => ControlCommand::Engage { hold: START_POSE },
            1 => ControlCommand::Engage {
                hold: START_POSE + JointVector::splat(any_f64(rng)),
            },
            2 => ControlCommand::Arm(Arming {
                operating_mode: OperatingMode::from_raw(rng.random_range(1..4)).unwrap(),
                expires_ns: self.now_ns + rng.random_range(0..2_000_000_000),
                area_clear: rng.random_ratio(3, 4),
            }),
            3 if rng.random_ratio(1, 8) => ControlCommand::Stop,
            4 if rng.random_ratio(1, 8) => ControlCommand::Disarm,
            _ => {
                let id = rng.random_range(0..self.pool.len());
                let motion = Box::new(self.pool[id].clone());
                ControlCommand::Run {
                    id: id as u64,
                    motion,
                }
            }
        })
    }

    fn spoil(&mut self, input: &mut CycleInput) {
        let rng = &mut self.rng;
        let vector = |rng: &mut ChaCha8Rng| JointVector([0.0; 7].map(|_| any_f64(rng)));
        match rng.random_range(0..14) {
            0 => input.deadline_ns = rng.random(),
            1 => input.missed = rng.random(),
            2 => input.operator.stop = 1,
            3 => input.operator.released = 1,
            4 => input.operator.count = rng.random(),
            5 => input.link.status = Some(Status(rng.random())),
            6 => input.link.unanswered_ns = rng.random(),
            7 => input.link.unanswered = rng.random(),
            8 => input.link.lost = true,
            9 => input.link.foreign = rng.random(),
            10 => input.broken_reports = rng.random(),
            11 => {
                let q = vector(rng);
                input.reports.push(JointReport {
                    q,
                    qd: vector(rng),
                    q_target: vector(rng),
                    stamp_ns: rng.random(),
                    arrival_ns: rng.random(),
                    arm_clock: 1,
                    arm_state: rng.random(),
                    arm_mode: rng.random(),
                    ..JointReport::default()
                });
            }
            12 => input.reports = Reports::default(),
            _ => {
                input.codes = Some(ArmCodes {
                    error: rng.random_range(0..3),
                    arrival_ns: input.deadline_ns,
                    ..ArmCodes::default()
                });
            }
        }
    }
}

/// Judges setpoints by their finite differences; it knows nothing of the
/// limiter.
struct Judge {
    /// Newest first: deadline (ns) and pose (rad).
    last: [(u64, JointVector); 4],
}

impl Judge {
    fn holding(q: JointVector, now_ns: u64) -> Self {
        let at = |k: u64| (now_ns.wrapping_sub(k * PERIOD_NS), q);
        Self {
            last: [at(1), at(2), at(3), at(4)],
        }
    }

    /// Largest part of a limit that was used; above 1 it was broken.
    fn take(&mut self, at_ns: u64, q: JointVector, limits: &Limits) -> f64 {
        self.last = [(at_ns, q), self.last[0], self.last[1], self.last[2]];
        let span = |a: usize, b: usize| (self.last[a].0 - self.last[b].0) as f64 * 1e-9;
        let first = |a: usize| (self.last[a].1 - self.last[a + 1].1) * (1.0 / span(a, a + 1));
        let second = |a: usize| (first(a) - first(a + 1)) * (2.0 / span(a, a + 2));
        let third = (second(0) - second(1)) * (3.0 / span(0, 3));
        let mut worst = 0.0_f64;
        let mut part = |value: f64, limit: f64, rounding: f64| {
            worst = worst.max((value.abs() - rounding) / limit);
            assert!(value.is_finite());
        };
        for j in 0..JOINTS {
            let (low, high) = (limits.position_min_rad[j], limits.position_max_rad[j]);
            let middle = 0.5 * (low + high);
            part(q[j] - middle, 0.5 * (high - low), 1e-9);
            let a = limits.acceleration_max_rad_s2[j];
            part(first(0)[j], limits.velocity_max_rad_s[j], 1e-9);
            part(second(0)[j], a, 1e-8);
            part(third[j], limits.jerk_max_rad_s3[j] + a / PERIOD_S, 1e-5);
        }
        let tool = |q: &JointVector| kinematics::flange_pose(q).0;
        let way = (tool(&q) - tool(&self.last[1].1)).norm();
        part(way / span(0, 1), limits.tcp_speed_max_m_s, 1e-9);
        part(way, 0.01 * (span(0, 1) / PERIOD_S).max(1.0), 1e-9);
        worst
    }
}

/// Judges velocities on the wire: by the joints' limits, and how fast they change.
struct VelocityJudge {
    last: (u64, JointVector),
}

impl VelocityJudge {
    /// Largest part of a limit that was used by `qd`, sent in the pose `q`.
    fn take(&mut self, at_ns: u64, (q, qd): (&JointVector, JointVector), limits: &Limits) -> f64 {
        let (before_ns, before) = std::mem::replace(&mut self.last, (at_ns, qd));
        let span_s = at_ns.wrapping_sub(before_ns) as f64 * 1e-9;
        let tool = kinematics::tool_speed_m_s(q, &qd, &limits.tcp_offset());
        // What was allowed a cycle ago may be a little faster in the pose of this one.
        let mut worst = tool / (1.02 * limits.tcp_speed_max_m_s);
        for j in 0..JOINTS {
            let change = (qd[j] - before[j]).abs() - 1e-9;
            worst = worst
                .max(qd[j].abs() / limits.velocity_max_rad_s[j])
                .max(change / (limits.acceleration_max_rad_s2[j] * span_s));
            assert!(qd[j].is_finite());
        }
        worst
    }
}

fn settings(seed: u64) -> ControlSettings {
    ControlSettings {
        interface: if seed % 4 < 2 {
            CommandInterface::ServoPosition
        } else {
            CommandInterface::JointVelocity
        },
        arming_required: seed.is_multiple_of(2),
        guardian_required: seed.is_multiple_of(3),
        ..if seed.is_multiple_of(5) {
            Thresholds::strict().into()
        } else {
            Thresholds::relaxed().into()
        }
    }
}

#[derive(Debug, Default)]
struct Tally {
    setpoints: u64,
    velocities: u64,
    stops: u64,
    codes: std::collections::BTreeSet<u16>,
    /// Largest part of a limit that was used.
    worst: f64,
}

fn play(seed: u64, cycles: u64, tally: &mut Tally) {
    let limits = Limits::default();
    let mut chaos = Chaos::new(seed, &limits);
    let mut state = ControlState::new(limits.clone(), settings(seed));
    let anew = |before: &ControlState| ControlState {
        cycle: before.cycle,
        motions_done: before.motions_done,
        ..ControlState::new(limits.clone(), settings(seed))
    };
    let mut again = anew(&state);
    let mut judge = Judge::holding(START_POSE, chaos.now_ns);
    let still = |at_ns| VelocityJudge {
        last: (at_ns, JointVector::ZERO),
    };
    let mut velocity_judge = still(chaos.now_ns);
    for _ in 0..cycles {
        let input = chaos.input(state.mode());
        let deadline_ns = input.deadline_ns.saturating_add(input.late_ns.into());
        let before = state.mode();
        let (recorded, engaged) = (record_input(&input, state.cycle + 1), anew(&state));
        let out = state.step(input);
        // The same from the bytes of its record; from an engagement on, whatever was before.
        if out.events.contains(&ControlEvent::Engaged) {
            again = engaged;
        }
        let bytes = postcard::to_allocvec(&recorded).unwrap();
        let read: InputRecord = postcard::from_bytes(&bytes).unwrap();
        let restored = restore_input(&read, |id, hash| {
            let motion = chaos.pool.get(usize::try_from(id).ok()?)?;
            (motion.fingerprint() == hash).then(|| Box::new(motion.clone()))
        });
        assert_eq!(bytes_of(&out), bytes_of(&again.step(restored.unwrap())));
        let mut latches = 0;
        for event in &out.events {
            match event {
                ControlEvent::Engaged => {
                    let hold = state.summary().q_c;
                    judge = Judge::holding(hold, deadline_ns);
                    velocity_judge = still(deadline_ns.wrapping_sub(PERIOD_NS));
                    chaos.commanded = [hold; 3];
                }
                ControlEvent::Latched(cause) => {
                    latches += 1;
                    tally.stops += 1;
                    tally.codes.insert(cause.code);
                    assert!(cause.cycle <= cause.rest_cycle && cause.code != 0);
                }
                _ => {}
            }
        }
        // Exactly one cause per stop.
        let stopped = before != ControllerMode::Faulted
            && before != ControllerMode::Offline
            && state.mode() == ControllerMode::Faulted;
        assert_eq!(latches, i32::from(stopped), "{before:?} {:?}", out.events);
        let Some(command) = out.command else {
            continue;
        };
        let q = state.summary().q_c;
        chaos.commanded = [q, chaos.commanded[0], chaos.commanded[1]];
        tally.setpoints += 1;
        let mut part = judge.take(deadline_ns, q, &limits);
        if let ArmCommand::Velocity { qd, .. } = command {
            tally.velocities += 1;
            part = part.max(velocity_judge.take(deadline_ns, (&q, qd), &limits));
        } else {
            assert_eq!(out.setpoint(), Some(q));
        }
        tally.worst = tally.worst.max(part);
        assert!(part <= 1.0 + 2e-9, "seed {seed}: {part} of a limit");
    }
}

#[test]
fn any_number_of_random_cycles_keep_every_limit() {
    let runs: u64 = match std::env::var("WAG_LONG_TESTS") {
        _ if cfg!(miri) => 1,
        Ok(on) if on == "1" => 2000,
        _ => 30,
    };
    let mut tally = Tally::default();
    for seed in 0..runs {
        play(seed, if cfg!(miri) { 60 } else { 10_000 }, &mut tally);
    }
    println!("{tally:?}");
    if !cfg!(miri) {
        assert!(tally.stops > 100 * runs / 30 && tally.codes.len() > 12);
        assert!(3 * tally.velocities > tally.setpoints);
    }
}

/// Bits of everything a cycle gives out.
fn bytes_of(out: &CycleOutput) -> (Vec<u8>, String) {
    let record = postcard::to_allocvec(&out.record).unwrap();
    // `{:?}` of a float is exact: it reads back to the same bits, or is NaN.
    let rest = format!("{:?} {:?} {:?}", out.command, out.request, out.events);
    (record, rest)
}
