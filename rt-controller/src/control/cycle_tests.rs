//! Tests of whole cycles, in virtual time.

use super::*;
use crate::control::exchange::Order;
use crate::control::limiter::{Allowance, Limiter};
use crate::control::{LinkInput, Thresholds};
use crate::point_to_point::plan_move;
use crate::xarm::StateRequest;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use shared_types::JointTrajectory;
use shared_types::ipc::{JointReport, OperatorBeat, Reports};
use shared_types::plan::START_POSE;

const PERIOD_NS: u64 = 4_000_000;

/// A controller with an arm that follows two cycles late.
struct Bench {
    state: ControlState,
    now_ns: u64,
    beat: u64,
    commanded: [JointVector; 3],
    /// Judges what is sent, independently of the state's own limiter.
    judge: Limiter,
    events: Vec<ControlEvent>,
    sent: Vec<JointVector>,
    requests: Vec<StateRequest>,
}

impl Bench {
    fn offline() -> Self {
        let limits = Limits::default();
        Self {
            judge: Limiter::at_rest(START_POSE, &limits),
            state: ControlState::new(limits, Thresholds::relaxed()),
            now_ns: 1_000_000_000_000,
            beat: 0,
            commanded: [START_POSE; 3],
            events: Vec::new(),
            sent: Vec::new(),
            requests: Vec::new(),
        }
    }

    fn holding() -> Self {
        let mut bench = Self::offline();
        bench.order(Order::Adopt { hold: START_POSE });
        for _ in 0..100 {
            bench.cycle();
        }
        assert_eq!(bench.state.mode(), ControllerMode::Idle);
        bench.events.clear();
        bench
    }

    fn input(&mut self, missed: u32) -> CycleInput {
        self.now_ns += PERIOD_NS * (1 + u64::from(missed));
        self.beat += 1;
        CycleInput {
            deadline_ns: self.now_ns,
            missed,
            order: None,
            operator: OperatorBeat {
                count: self.beat,
                ..OperatorBeat::default()
            },
            link: LinkInput {
                status: Some(Status(0)),
                reply_ns: 1000,
                ..LinkInput::default()
            },
            reports: Some(JointReport {
                arm_state: 1,
                arm_mode: 1,
                stamp_ns: self.now_ns - 1_000_000,
                arrival_ns: self.now_ns - 500_000,
                q: self.commanded[2],
                ..JointReport::default()
            })
            .into(),
            ..CycleInput::default()
        }
    }

    fn step(&mut self, input: CycleInput) {
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
        self.events.extend(out.events.iter().copied());
        self.requests.extend(out.request);
    }

    fn cycle(&mut self) {
        let input = self.input(0);
        self.step(input);
    }

    /// Where the judge's even steps do not fit.
    fn cycle_unjudged(&mut self, missed: u32) {
        let input = self.input(missed);
        let out = self.state.step(input);
        if let Some(q) = out.setpoint() {
            self.commanded = [q, self.commanded[0], self.commanded[1]];
        }
        self.events.extend(out.events.iter().copied());
        self.requests.extend(out.request);
    }

    fn order(&mut self, order: Order) {
        let mut input = self.input(0);
        input.order = Some(order);
        self.step(input);
    }

    fn run(&mut self, motion: Motion) {
        let motion = Box::new(motion);
        self.order(Order::Run { id: 7, motion });
    }

    fn cycles_until_still(&mut self) -> usize {
        (0..5000)
            .take_while(|_| {
                self.cycle();
                self.state.mode().is_moving()
            })
            .count()
    }

    fn latched(&self) -> Option<FaultCode> {
        self.events.iter().find_map(|event| match event {
            ControlEvent::Latched(cause) => Some(cause.fault()),
            _ => None,
        })
    }
}

fn swing() -> Motion {
    let mut up = START_POSE;
    (up[5], up[1]) = (up[5] - 0.6, up[1] - 0.2);
    let times = [0.0, 0.6, 1.2];
    Motion::Spline(JointTrajectory::new(&times, &[START_POSE, up, START_POSE]).unwrap())
}

fn go() -> Motion {
    let mut to = START_POSE;
    (to[0], to[3]) = (0.5, 1.9);
    plan_move(&START_POSE, &to, 0.2, &Limits::default()).unwrap()
}

#[test]
fn a_trajectory_is_streamed_at_its_planned_times() {
    let mut bench = Bench::holding();
    bench.sent.clear();
    let motion = swing();
    bench.run(motion.clone());
    assert_eq!(bench.state.mode(), ControllerMode::Streaming);
    let start = bench.now_ns;
    bench.cycles_until_still();
    assert_eq!(bench.state.mode(), ControllerMode::Idle);
    let end = start + 1_200_000_000;
    assert_eq!(
        bench.events,
        [
            ControlEvent::Started {
                id: 7,
                start_ns: start
            },
            ControlEvent::Finished {
                id: 7,
                start_ns: start,
                end_ns: end
            }
        ]
    );
    for (k, q) in (0..301_u32).zip(&bench.sent) {
        let expected = motion.state_at(f64::from(k) * 0.004).q;
        assert!((*q - expected).max_abs() < 1e-9, "cycle {k}");
    }
}

#[test]
fn a_missed_cycle_costs_its_setpoint_and_no_time() {
    let mut bench = Bench::holding();
    let motion = swing();
    bench.run(motion.clone());
    let start = bench.now_ns;
    for missed in [0, 0, 2, 0, 5, 0, 1] {
        let input = bench.input(missed);
        bench.step(input);
        let t_s = f64::from(u32::try_from((bench.now_ns - start) / 1000).unwrap()) * 1e-6;
        let off = bench.commanded[0] - motion.state_at(t_s).q;
        assert!(off.max_abs() < 1e-9, "{missed}");
    }
    let last = bench.commanded[0];
    let input = bench.input(6);
    bench.step(input);
    assert_eq!(bench.latched(), Some(FaultCode::DeadlineMissed));
    assert_eq!((bench.commanded[0], bench.requests.len()), (last, 1));
}

#[test]
fn every_fault_ends_as_its_table_says() {
    type Break = fn(&mut CycleInput);
    let cases: [(FaultCode, Break); 10] = [
        (FaultCode::OperatorStop, |i| i.operator.stop = 1),
        (FaultCode::OperatorStop, |i| i.order = Some(Order::Stop)),
        (FaultCode::OperatorLost, |i| i.operator.count = 1),
        (FaultCode::ReplyStalled, |i| {
            i.link.unanswered_ns = 100_000_001;
        }),
        (FaultCode::ReportStale, |i| i.reports = Reports::default()),
        (FaultCode::EncoderJump, |i| {
            for report in i.reports.as_mut_slice() {
                // Five degrees.
                report.q[2] += 0.0873;
            }
        }),
        (FaultCode::ArmError, |i| i.link.status = Some(Status(0x50))),
        (FaultCode::ArmNotReady, |i| {
            i.link.status = Some(Status(0x10));
        }),
        (FaultCode::ArmModeChanged, |i| {
            for report in i.reports.as_mut_slice() {
                report.arm_mode = 0;
            }
        }),
        (FaultCode::LinkLost, |i| i.link.lost = true),
    ];
    for (fault, spoil) in cases {
        for motion in [swing(), go()] {
            let mut bench = Bench::holding();
            bench.run(motion);
            for _ in 0..60 {
                bench.cycle();
            }
            let before = bench.sent.len();
            for _ in 0..400 {
                let mut input = bench.input(0);
                spoil(&mut input);
                bench.step(input);
            }
            let braked = bench.sent.len() - before;
            assert_eq!(bench.latched(), Some(fault));
            assert_eq!(bench.state.mode(), ControllerMode::Faulted, "{fault:?}");
            assert_eq!(
                braked > 5,
                reaction(fault).path < Path::Silence,
                "{fault:?} {braked}"
            );
            let stops = usize::from(reaction(fault).stop_arm);
            assert_eq!(bench.requests.len(), stops, "{fault:?}");
            // Nothing but an adoption wakes it.
            bench.run(swing());
            assert_eq!(bench.state.mode(), ControllerMode::Faulted);
            let hold = bench.commanded[0];
            bench.judge = Limiter::at_rest(hold, &Limits::default());
            bench.order(Order::Adopt { hold });
            assert_eq!(bench.state.mode(), ControllerMode::Idle);
        }
    }
}

#[test]
fn the_first_braking_setpoint_comes_in_the_very_cycle() {
    let mut bench = Bench::holding();
    bench.run(swing());
    for _ in 0..60 {
        bench.cycle();
    }
    let last = bench.commanded[0];
    bench.order(Order::Stop);
    assert_eq!(bench.state.mode(), ControllerMode::Braking);
    let planned = swing().state_at(61.0 * 0.004).q;
    let (braked, planned) = (bench.commanded[0] - last, planned - last);
    assert!(braked.max_abs() < planned.max_abs());
}

#[test]
fn orders_that_do_not_fit_are_refused() {
    let mut bench = Bench::offline();
    bench.run(swing());
    bench.order(Order::Adopt {
        hold: JointVector::splat(f64::NAN),
    });
    assert!(
        bench
            .events
            .iter()
            .all(|e| matches!(e, ControlEvent::Refused { .. }))
    );
    let mut bench = Bench::holding();
    bench.run(swing());
    bench.run(go());
    let mut bench2 = Bench::holding();
    bench2.run(Motion::Spline(
        JointTrajectory::hold(JointVector::splat(0.1), 1.0).unwrap(),
    ));
    for (bench, fault) in [
        (bench, FaultCode::WrongMode),
        (bench2, FaultCode::StartPoseMismatch),
    ] {
        let id = Some(7);
        assert!(bench.events.contains(&ControlEvent::Refused { id, fault }));
    }
}

/// Throws that use the limits fully, stopped at every eighth cycle: the brake
/// itself stays within the limits, so the arm need not stop by itself.
#[test]
fn a_throw_is_braked_softly_wherever_it_is_stopped() {
    let limits = Limits::default();
    let (mut stops, mut hard) = (0, 0);
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    while stops < 1500 {
        let Some(throw) = throw(&mut rng, &limits) else {
            continue;
        };
        let cycles = throw.duration_s() / 0.004;
        for k in (1..).step_by(8).take_while(|k| f64::from(*k) < cycles) {
            let mut bench = Bench::holding();
            bench.run(Motion::Spline(throw));
            (1..k).for_each(|_| bench.cycle());
            bench.order(Order::Stop);
            bench.cycles_until_still();
            assert_eq!(bench.latched(), Some(FaultCode::OperatorStop));
            stops += 1;
            hard += usize::from(!bench.requests.is_empty());
        }
    }
    println!("{hard} of {stops} stops left the brake to the arm");
    assert!(hard * 20 < stops, "{hard} of {stops}");
}

/// A random three-waypoint throw within limits, 0 to 10 % below them.
fn throw(rng: &mut rand_chacha::ChaCha8Rng, limits: &Limits) -> Option<JointTrajectory> {
    let poses: Vec<JointVector> = (0..4)
        .map(|k| {
            let reach = if k == 0 { 0.0 } else { 0.7 };
            START_POSE + JointVector([0.0; 7].map(|_| reach * rng.random_range(-1.0..1.0)))
        })
        .collect();
    (4..40).find_map(|k| {
        let step_s = f64::from(k) * 0.05;
        let times = [0.0, step_s, 2.0 * step_s, 3.0 * step_s];
        let trajectory = JointTrajectory::new(&times, &poses).ok()?;
        limits
            .worst_violation(&trajectory)
            .is_none()
            .then_some(trajectory)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// Bit patterns of any kind: it returns, and what it sends is in limits.
    #[test]
    fn any_input_returns_and_no_setpoint_breaks_a_limit(
        bits in prop::collection::vec((any::<[u64; 7]>(), any::<[u64; 4]>(), 0_u8..16), 1..40),
    ) {
        let mut bench = Bench::holding();
        let limits = Limits::default();
        for (words, numbers, kind) in bits {
            let q = JointVector(words.map(f64::from_bits));
            let mut input = bench.input(0);
            match kind {
                0 => input.deadline_ns = numbers[0],
                1 => input.missed = numbers[1] as u32,
                2 => input.order = Some(Order::Adopt { hold: q }),
                3 => input.order = Some(Order::Stop),
                4 => input.reports = Some(JointReport {
                    q, qd: q, q_target: q, stamp_ns: numbers[2], arrival_ns: numbers[3],
                    arm_state: words[0] as u8, arm_mode: words[1] as u8,
                    ..JointReport::default()
                }).into(),
                5 => input.link.unanswered_ns = numbers[0],
                6 => input.link.status = Some(Status(numbers[0] as u8)),
                7 => input.operator = OperatorBeat { count: numbers[0], ..OperatorBeat::default() },
                8 => if let Ok(t) = JointTrajectory::new(&[0.0, 0.5], &[START_POSE, q]) {
                    input.order = Some(Order::Run { id: 1, motion: Box::new(Motion::Spline(t)) });
                },
                9 => input.order = Some(Order::Adopt { hold: START_POSE }),
                _ => input.order = Some(Order::Run { id: 2, motion: Box::new(swing()) }),
            }
            let out = bench.state.step(input);
            if let Some(q) = out.setpoint() {
                prop_assert!(q.is_finite() && limits.position_violation(&q).is_none());
            }
        }
    }

    /// Wild trajectories that no preflight saw: the limiter alone holds.
    #[test]
    fn wild_trajectories_are_braked_within_limits(
        steps in prop::collection::vec((0.004_f64..0.6, prop::array::uniform7(-1.5_f64..1.5)), 1..6),
        stop_at in 0_usize..300,
    ) {
        let mut bench = Bench::holding();
        let (mut times, mut poses) = (vec![0.0], vec![START_POSE]);
        for (dt, by) in steps {
            times.push(times[times.len() - 1] + dt);
            poses.push(START_POSE + JointVector(by));
        }
        bench.run(Motion::Spline(JointTrajectory::new(&times, &poses).unwrap()));
        for k in 0..600 {
            if k == stop_at {
                bench.order(Order::Stop);
            }
            bench.cycle();
        }
        prop_assert!(!bench.state.mode().is_moving());
    }
}

/// Spoils the reports of a swing from its begin and gives the cause.
fn swing_with(mut spoil: impl FnMut(usize, &mut JointReport)) -> Vec<ControlEvent> {
    let mut bench = Bench::holding();
    bench.run(swing());
    for k in 0..300 {
        let mut input = bench.input(0);
        for report in input.reports.as_mut_slice() {
            spoil(k, report);
        }
        bench.step(input);
    }
    bench.events
}

fn cause_in(events: &[ControlEvent]) -> Option<CauseRecord> {
    let mut causes = events.iter().filter_map(|event| match event {
        ControlEvent::Latched(cause) => Some(*cause),
        _ => None,
    });
    let first = causes.next();
    assert!(causes.next().is_none(), "one cause per stop");
    first
}

#[test]
fn what_is_wrong_with_an_arm_is_told_apart() {
    // Creeps away from its path.
    let events = swing_with(|k, report| report.q[6] += 0.001 * k as f64);
    let cause = cause_in(&events).unwrap();
    assert_eq!(cause.fault(), FaultCode::TrackingError);
    assert_eq!(cause.limit.joint, 7);
    assert!(cause.limit.value > 0.05 && cause.limit.limit == 0.05);
    // One joint stands still.
    let cause = cause_in(&swing_with(|_, report| report.q[5] = START_POSE[5])).unwrap();
    assert_eq!(cause.fault(), FaultCode::JointStuck);
    assert_eq!(cause.limit.joint, 6);
    // Everything stands still, to the bit.
    let mut frozen = None;
    let events = swing_with(|_, report| report.q = *frozen.get_or_insert(report.q));
    assert_eq!(cause_in(&events).unwrap().fault(), FaultCode::ReportFrozen);
    // Nonsense in every report.
    let cause = cause_in(&swing_with(|_, report| report.qd[0] = f64::NAN)).unwrap();
    assert_eq!(cause.fault(), FaultCode::ReportBroken);
    assert_eq!(
        (cause.limit.value, cause.counts.broken_reports > 4),
        (5.0, true)
    );
    // A clock that jumps to and fro.
    let events = swing_with(|k, report| report.stamp_ns -= 60_000_000 * (k as u64 % 2));
    assert_eq!(cause_in(&events).unwrap().fault(), FaultCode::ReportClock);
    // The arm's own target is somebody else's.
    let events = swing_with(|_, report| {
        report.arm_clock = 1;
        report.q_target = JointVector::ZERO;
    });
    assert_eq!(
        cause_in(&events).unwrap().fault(),
        FaultCode::SecondCommander
    );
    assert_eq!(cause_in(&swing_with(|_, _| ())), None);
}

/// A slowed swing stays on its path; a stop on the way makes it a brake, and
/// the first cause stays the cause.
#[test]
fn a_slowed_motion_keeps_to_its_path_unless_something_worse_comes() {
    for worse_after in [None, Some(5)] {
        let mut bench = Bench::holding();
        bench.run(swing());
        (0..60).for_each(|_| bench.cycle());
        let input = bench.input(0);
        let report_ns = input.deadline_ns;
        bench.step(input);
        for _ in 0..300 {
            let mut input = bench.input(0);
            input.reports = Reports::default();
            if worse_after.is_some() && input.deadline_ns > report_ns + 120_000_000 {
                input.operator.stop = 1;
            }
            bench.step(input);
            let q = bench.commanded[0];
            let near = (0..2400)
                .map(|i| (swing().state_at(f64::from(i) * 0.0005).q - q).max_abs())
                .fold(f64::INFINITY, f64::min);
            if worse_after.is_none() {
                assert!(near < 1e-3, "{near}");
            }
        }
        let cause = cause_in(&bench.events).unwrap();
        assert_eq!(cause.fault(), FaultCode::ReportStale);
        let second = worse_after.map_or(0, |_| FaultCode::OperatorStop as u16);
        assert_eq!(cause.second_code, second);
        assert_eq!(bench.requests.len(), 0);
    }
}

fn armed_bench() -> Bench {
    let mut bench = Bench::offline();
    let settings = ControlSettings {
        arming_required: true,
        ..Thresholds::relaxed().into()
    };
    bench.state = ControlState::new(Limits::default(), settings);
    bench.order(Order::Adopt { hold: START_POSE });
    (0..100).for_each(|_| bench.cycle());
    bench.events.clear();
    bench
}

fn throw_arming(bench: &Bench) -> Order {
    Order::Arm(shared_types::Arming {
        tier: MotionTier::Throw,
        expires_ns: bench.now_ns + 8_000_000_000,
        area_clear: true,
    })
}

#[test]
fn a_throw_is_armed_for_one_shot_and_nothing_re_arms_it() {
    let mut bench = armed_bench();
    let refused = |fault| ControlEvent::Refused { id: Some(7), fault };
    bench.run(swing());
    assert_eq!(bench.events, [refused(FaultCode::NotArmed)]);
    let order = throw_arming(&bench);
    bench.order(order);
    bench.run(swing());
    bench.cycles_until_still();
    assert!(bench.events.contains(&ControlEvent::Disarmed {
        fault: FaultCode::None
    }));
    bench.events.clear();
    bench.run(swing());
    assert_eq!(bench.events, [refused(FaultCode::NotArmed)]);
    // Expiry and the dead-man switch disarm while idle.
    for released in [0, 1] {
        let order = throw_arming(&bench);
        bench.order(order);
        let mut input = bench.input(0);
        input.operator.released = released;
        if released == 0 {
            bench.now_ns += 8_000_000_000;
            input = bench.input(0);
        }
        bench.step(input);
        bench.events.clear();
        bench.run(swing());
        assert_eq!(bench.events, [refused(FaultCode::NotArmed)]);
    }
}

#[test]
fn a_disarmed_or_released_motion_brakes_in_the_very_cycle() {
    for (fault, released) in [(FaultCode::Disarmed, 0), (FaultCode::DeadManReleased, 1)] {
        let mut bench = armed_bench();
        let order = throw_arming(&bench);
        bench.order(order);
        bench.run(swing());
        (0..60).for_each(|_| bench.cycle());
        let mut input = bench.input(0);
        input.operator.released = released;
        if released == 0 {
            input.order = Some(Order::Disarm);
        }
        bench.step(input);
        assert_eq!(bench.state.mode(), ControllerMode::Braking);
        bench.cycles_until_still();
        assert_eq!(bench.latched(), Some(fault));
        assert_eq!(bench.requests.len(), 0);
    }
}

#[test]
fn a_tier_slows_nobody_down_silently_but_stops_what_is_too_fast() {
    let mut bench = armed_bench();
    bench.order(Order::Arm(shared_types::Arming {
        tier: MotionTier::SetUp,
        expires_ns: u64::MAX,
        area_clear: false,
    }));
    bench.run(swing());
    bench.cycles_until_still();
    let cause = cause_in(&bench.events).unwrap();
    assert_eq!(cause.fault(), FaultCode::TierExceeded);
    assert!(cause.limit.value > 0.25 && cause.limit.limit == 0.25);
}

/// Late cycles slow the motion, a stall lets nothing pile up.
#[test]
fn lateness_slows_and_a_stall_holds_setpoints_back() {
    let strict = Thresholds::strict();
    let mut bench = Bench::holding();
    bench.state = ControlState::new(Limits::default(), strict);
    bench.order(Order::Adopt { hold: START_POSE });
    (0..100).for_each(|_| bench.cycle());
    bench.run(swing());
    (0..40).for_each(|_| bench.cycle());
    let mut input = bench.input(0);
    input.link.unanswered = strict.unanswered_max;
    let sent = bench.sent.len();
    bench.step(input);
    assert_eq!(bench.sent.len(), sent, "held back");
    bench.judge = Limiter::at_rest(bench.commanded[0], &Limits::default());
    bench.cycle_unjudged(0);
    bench.cycle_unjudged(3);
    assert_eq!(bench.state.mode(), ControllerMode::Braking);
    (0..400).for_each(|_| bench.cycle_unjudged(0));
    let cause = cause_in(&bench.events).unwrap();
    assert_eq!(cause.fault(), FaultCode::LateCycles);
    assert_eq!((cause.path, cause.counts.skipped), (1, 1));
}

/// An adoption on its way when the arm is stopped was meant for another state of
/// the world.
#[test]
fn a_stop_is_not_acknowledged_by_what_was_ordered_before_it() {
    let mut bench = Bench::holding();
    bench.run(swing());
    (0..60).for_each(|_| bench.cycle());
    let mut input = bench.input(0);
    input.link.status = Some(Status(0x50));
    input.order = Some(Order::Adopt { hold: START_POSE });
    bench.step(input);
    assert_eq!(bench.state.mode(), ControllerMode::Faulted);
    assert_eq!(bench.latched(), Some(FaultCode::ArmError));
    let fault = FaultCode::WrongMode;
    let refused = ControlEvent::Refused { id: None, fault };
    assert!(bench.events.contains(&refused));
}
