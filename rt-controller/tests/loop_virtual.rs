//! The real loop in virtual time, on an ideal arm: pacing when the machine is
//! late, and a link that stalls or goes away.
#![cfg(test)]

use arm_model::Limits;
use arm_model::joint::START_POSE;
use rt_controller::control::{ControlCommand, ControlEvent, ControlState, Thresholds};
use rt_controller::driver::CommandMsg;
use rt_controller::os::Clock;
use rt_controller::ports::{BridgePorts, rings};
use rt_controller::rt_loop::RtLoop;
use rt_controller::transport::sim::IdealArm;
use rt_controller::warm_up::CacheWarmUp;
use shared_types::FaultCode;
use shared_types::ipc::{Bus, ControllerBoards, CycleRecord};
use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

const PERIOD_NS: u64 = 4_000_000;
const BEGIN_NS: u64 = 1_000_000_000_000;

/// Time that passes while the loop sleeps; every so often it oversleeps, by the
/// next of `late_ns`. Sets `quit` after `sleeps`.
struct LateClock {
    now_ns: Cell<u64>,
    late_ns: Vec<u64>,
    sleeps: usize,
    quit: Arc<AtomicBool>,
}

impl Clock for LateClock {
    fn now_ns(&self) -> u64 {
        // A look at the clock takes time, too.
        self.now_ns.replace(self.now_ns.get() + 1)
    }

    fn sleep_until(&mut self, deadline_ns: u64) {
        let late_ns = self.late_ns.get(self.sleeps).copied().unwrap_or_default();
        self.now_ns
            .set(self.now_ns.get().max(deadline_ns) + late_ns);
        self.sleeps = self.sleeps.saturating_sub(1);
        self.quit.store(self.sleeps == 0, Ordering::Relaxed);
    }
}

/// Runs the loop with an arm for as many cycles as `late_ns` has entries, warming up
/// `ahead_us` before each deadline.
fn run(
    name: &str,
    arm: IdealArm,
    late_ns: Vec<u64>,
    ahead_us: u32,
) -> (Vec<CycleRecord>, BridgePorts<IdealArm>) {
    let bus = Bus::join(&format!("test_{name}_{}", std::process::id())).unwrap();
    let boards = ControllerBoards::create(&bus).unwrap();
    let thresholds = Thresholds {
        operator_timeout_ns: 500_000_000,
        reply_stall_ns: 20_000_000,
        report_stale_ns: 100_000_000,
        tracking_error_max_rad: 0.05,
        tracking_window_ns: 100_000_000,
        missed_cycles_max: 5,
        ..Thresholds::relaxed()
    };
    let rings = rings();
    let mut bridge = rings.bridge;
    let command = ControlCommand::Engage { hold: START_POSE };
    let link = Some(Box::new(arm));
    bridge.commands.push(CommandMsg { command, link }).unwrap();
    let quit = Arc::new(AtomicBool::new(false));
    let clock = LateClock {
        now_ns: Cell::new(BEGIN_NS),
        sleeps: late_ns.len(),
        late_ns,
        quit: Arc::clone(&quit),
    };
    let control = ControlState::new(Limits::default(), thresholds);
    let interface = control.settings().interface;
    let mut rt = RtLoop::new(control, clock, boards, rings.rt);
    rt.set_warm_up(CacheWarmUp::new(Limits::default(), interface, ahead_us).unwrap());
    rt.run(&quit);
    let records = std::iter::from_fn(|| bridge.records.pop().ok()).collect();
    (records, bridge)
}

fn latched(bridge: &mut BridgePorts<IdealArm>) -> Option<FaultCode> {
    std::iter::from_fn(|| bridge.events.pop().ok()).find_map(|event| match event {
        ControlEvent::Latched(cause) => Some(cause.fault()),
        _ => None,
    })
}

#[test]
fn a_late_machine_loses_cycles_but_neither_phase_nor_distance() {
    // Microseconds late, entries consumed from the back.
    let late_us = [0, 30, 3900, 0, 0, 9_500, 200, 0, 1200, 0, 799, 801, 0, 0];
    let late_ns = late_us.map(|us: u64| us * 1000).to_vec();
    let (records, mut bridge) = run("late", IdealArm::default(), late_ns, 0);
    assert_eq!(records.len(), late_us.len());
    let mut cycles = 0;
    for pair in records.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let span_ns = b.deadline_ns - a.deadline_ns;
        assert_eq!(span_ns, PERIOD_NS * (1 + u64::from(b.missed)));
        let woke = |r: &CycleRecord| r.deadline_ns + u64::from(r.wake_late_ns);
        assert!(woke(b) - woke(a) >= PERIOD_NS / 5 * 4, "{a:?} {b:?}");
        cycles += u64::from(b.missed);
    }
    // 9.5 ms passes two deadlines and its wake-up is too close to the next
    // one; 3.9, 1.2 and 0.801 ms are too close to theirs.
    assert_eq!(cycles, 6);
    assert_eq!(latched(&mut bridge), None);
    assert!(records.iter().all(|r| r.sent == 1));
}

/// A loop that wakes early to warm up tells the arm the same, and lateness up to
/// the time ahead is over at the deadline.
#[test]
fn a_warm_up_takes_lateness_away_and_changes_nothing_else() {
    let late_us = [0, 30, 150, 0, 0, 90, 9_500, 0, 199, 0, 400, 0, 3_990, 0];
    let late_ns = late_us.map(|us: u64| us * 1000).to_vec();
    let so = |name, ahead_us| run(name, IdealArm::default(), late_ns.clone(), ahead_us);
    let (plain, _) = so("plain", 0);
    let (early, mut bridge) = so("early", 200);
    assert_eq!(latched(&mut bridge), None);
    let late = |r: &CycleRecord| u64::from(r.wake_late_ns);
    // The first wake-up is punctual.
    let wakes_us = std::iter::once(&0).chain(late_us.iter().rev());
    for (record, wake_us) in early.iter().zip(wakes_us) {
        let left_ns = (wake_us % 4000 * 1000).saturating_sub(200_000);
        assert!(
            late(record).abs_diff(left_ns) < 5_000,
            "{wake_us} {record:?}"
        );
        assert_eq!(record.q_c, START_POSE);
    }
    let lost = |all: &[CycleRecord]| all.iter().map(|r| r.missed).sum::<u32>();
    assert!(
        lost(&early) <= lost(&plain),
        "{} {}",
        lost(&early),
        lost(&plain)
    );
    assert!(early.iter().all(|r| r.sent == 1));
    assert!(late(&plain[2]) + late(&plain[1]) > 0);
}

#[test]
fn a_stalled_link_is_latched_and_a_broken_one_never_engaged() {
    let stalled = IdealArm {
        stalled: true,
        ..IdealArm::default()
    };
    let (records, mut bridge) = run("stalled", stalled, vec![0; 20], 0);
    assert_eq!(latched(&mut bridge), Some(FaultCode::ReplyStalled));
    // 20 ms without a reply: noticed in the sixth cycle after the first setpoint.
    assert_eq!(records.iter().filter(|r| r.sent == 1).count(), 6);
    let gone = IdealArm {
        gone: true,
        ..IdealArm::default()
    };
    let (records, mut bridge) = run("gone", gone, vec![0; 20], 0);
    let (id, fault) = (None, FaultCode::LinkLost);
    assert_eq!(bridge.events.pop(), Ok(ControlEvent::Refused { id, fault }));
    assert!(records.iter().all(|r| r.sent == 0));
    assert!(bridge.retired.pop().is_ok(), "the broken link comes back");
}
