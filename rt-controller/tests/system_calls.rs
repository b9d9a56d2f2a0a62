//! Per cycle the real-time thread makes these system calls and no others: one
//! clock sleep, one receive and one send at most.
//!
//! Counted over the loop body through every mode and fault, and over the whole
//! loop while an armed arm moves and readers come and are killed; after its first second
//! the loop meets no page fault either.
#![cfg(all(target_os = "linux", target_arch = "x86_64"))]
#![cfg(test)]
#![allow(unsafe_code, reason = "a seccomp filter is unsafe by nature")]

#[path = "system_calls/counter.rs"]
mod counter;
mod gauntlet;

use arm_model::Limits;
use arm_model::joint::START_POSE;
use counter::Calls;
use gauntlet::Watch;
use gauntlet::arm::EchoArm;
use libc::{SYS_clock_nanosleep, SYS_recvmsg, SYS_sendto};
use rt_controller::control::{ControlCommand, ControlSettings, ControlState};
use rt_controller::driver::CommandMsg;
use rt_controller::os::{Clock, MonotonicClock, RealTimeSettings, enter_real_time, now_ns};
use rt_controller::ports::{BridgePorts, Rings, rings};
use rt_controller::rt_loop::RtLoop;
use rt_controller::transport::tcp::{LinkSettings, TcpLink};
use rt_controller::warm_up::{CacheWarmUp, patient, report, swinging};
use rtrb::Producer;
use shared_types::ipc::{
    Bus, ControllerBoards, ControllerMode, CyclePublisher, CycleRecord, JointReport, OperatorEnd,
    StateReader,
};
use shared_types::{Arming, OperatingMode};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What a cycle may call.
const ALLOWED: [libc::c_long; 3] = [SYS_clock_nanosleep, SYS_recvmsg, SYS_sendto];

/// What cycles called.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
struct Sums {
    cycles: u64,
    sleeps: u64,
    receives: u64,
    sends: u64,
    /// Cycles before the first that received.
    unlinked: u64,
}

impl Sums {
    /// Judges the calls of one cycle.
    fn add(&mut self, calls: &Calls) {
        let others = calls.beside(&ALLOWED);
        assert!(others.is_empty(), "system calls (number, count) {others:?}");
        let [sleeps, receives, sends] = ALLOWED.map(|number| calls.of(number));
        assert_eq!(sleeps, 1, "sleeps");
        assert!(receives <= 1 && sends <= 1, "{receives} and {sends}");
        self.cycles += 1;
        self.sleeps += u64::from(sleeps);
        self.receives += u64::from(receives);
        self.sends += u64::from(sends);
        self.unlinked += u64::from(self.receives == 0);
    }
}

/// Counts around each turn of the loop's body, with the sleep before it.
#[derive(Default)]
struct Watched {
    begun: bool,
    sums: Sums,
}

impl Watch for Watched {
    fn around(&mut self, body: &mut dyn FnMut()) {
        if !std::mem::replace(&mut self.begun, true) {
            counter::watch_this_thread();
        }
        counter::take();
        counter::count(true);
        MonotonicClock.sleep_until(now_ns() + 1000);
        body();
        counter::count(false);
        self.sums.add(&counter::take());
    }
}

#[test]
fn through_every_mode_and_fault_a_cycle_sleeps_receives_and_sends_once_at_most() {
    let thread = std::thread::spawn(|| {
        let mut watched = Watched::default();
        gauntlet::scenarios::run(30_000, &mut watched);
        watched.sums
    });
    let sums = thread.join().expect("a cycle called something else");
    println!("{sums:?}");
    assert!(sums.cycles >= 30_000 && sums.receives * 10 > sums.cycles * 9);
    assert!(sums.sends * 2 > sums.cycles);
}

/// Page faults of this thread so far.
fn page_faults() -> i64 {
    // SAFETY: all zeros is a value of this plain struct.
    let mut usage: libc::rusage = unsafe { core::mem::zeroed() };
    // SAFETY: the pointer is to a struct that outlives the call.
    let failed = unsafe { libc::getrusage(libc::RUSAGE_THREAD, &raw mut usage) };
    assert_eq!(failed, 0);
    usage.ru_minflt + usage.ru_majflt
}

/// The loop's clock, which knows where a cycle ends.
struct CountedClock {
    inner: MonotonicClock,
    begun: bool,
    sums: Sums,
    /// Page faults when the first second had passed, and by now.
    page_faults: Option<[i64; 2]>,
}

impl Clock for CountedClock {
    fn now_ns(&self) -> u64 {
        self.inner.now_ns()
    }

    fn sleep_until(&mut self, deadline_ns: u64) {
        if std::mem::replace(&mut self.begun, true) {
            counter::count(false);
            self.sums.add(&counter::take());
            if self.sums.cycles >= 250 {
                let now = page_faults();
                self.page_faults.get_or_insert([now; 2])[1] = now;
            }
        } else {
            counter::watch_this_thread();
        }
        counter::count(true);
        self.inner.sleep_until(deadline_ns);
    }
}

/// A running loop in a thread of its own, and what the bridge would hold: it passes
/// records on to whoever listens.
struct Running {
    /// System calls, and page faults by the first second and by the end, if the memory could
    /// be locked.
    thread: JoinHandle<(Sums, Option<[i64; 2]>)>,
    quit: Arc<AtomicBool>,
    bridge: BridgePorts<TcpLink>,
    reports: Producer<JointReport>,
    newest: CycleRecord,
    bus: Bus,
    cycles: CyclePublisher,
    operator: OperatorEnd,
}

fn start_loop(domain: &str) -> Running {
    let Rings {
        rt: ports,
        bridge,
        reports: [reports, _],
        ..
    } = rings();
    let quit = Arc::new(AtomicBool::new(false));
    let (its_quit, its_domain) = (Arc::clone(&quit), domain.to_owned());
    let (ready, wait) = std::sync::mpsc::channel();
    let thread = std::thread::spawn(move || {
        // As the controller does: what is allocated is there before it is touched.
        let locked = enter_real_time(&RealTimeSettings {
            priority: None,
            ..RealTimeSettings::default()
        });
        let bus = Bus::join(&its_domain).unwrap();
        let boards = ControllerBoards::create(&bus).unwrap();
        let clock = CountedClock {
            inner: MonotonicClock,
            begun: false,
            sums: Sums::default(),
            page_faults: None,
        };
        let settings = ControlSettings {
            arming_required: true,
            ..patient()
        };
        let control = ControlState::new(Limits::default(), settings);
        let mut rt = RtLoop::new(control, clock, boards, ports);
        let interface = patient().interface;
        rt.set_warm_up(CacheWarmUp::new(Limits::default(), interface, 200).unwrap());
        ready.send(()).unwrap();
        rt.run(&its_quit);
        counter::count(false);
        let page_faults = rt.clock().page_faults.filter(|_| locked.is_empty());
        (rt.clock().sums.clone(), page_faults)
    });
    wait.recv().unwrap();
    let bus = Bus::join(domain).unwrap();
    Running {
        thread,
        quit,
        bridge,
        reports,
        newest: CycleRecord::default(),
        cycles: bus.cycle_publisher().unwrap(),
        operator: OperatorEnd::take(&bus).unwrap(),
        bus,
    }
}

impl Running {
    /// Turns the bridge until `done` or for a minute.
    fn until(&mut self, mut done: impl FnMut(&CycleRecord) -> bool) {
        let began = Instant::now();
        while !done(&self.newest) {
            assert!(!self.thread.is_finished(), "the loop ended");
            let waited = began.elapsed();
            assert!(waited < Duration::from_secs(60), "{:?}", self.newest);
            self.operator.beat();
            while let Ok(record) = self.bridge.records.pop() {
                self.newest = record;
                self.cycles.send_copy(record).unwrap();
            }
            while self.bridge.retired.pop().is_ok() {}
            while self.bridge.events.pop().is_ok() {}
            let (q, interface) = (self.newest.q_c, patient().interface);
            let _ = self.reports.push(report(q, interface, now_ns(), now_ns()));
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn command(&mut self, command: ControlCommand, link: Option<Box<TcpLink>>) {
        let message = CommandMsg { command, link };
        self.bridge.commands.push(message).unwrap();
    }
}

/// Set for the children that read and wait to be killed.
const DOMAIN: &str = "WAG_TEST_READER_OF";

/// Not a test by itself: the child of the next one.
#[test]
fn a_reader_that_waits_to_be_killed() {
    let Ok(domain) = std::env::var(DOMAIN) else {
        return;
    };
    let bus = Bus::join(&domain).unwrap();
    let state = StateReader::open(&bus).unwrap();
    let cycles = bus.cycle_subscriber().unwrap();
    let mut received = 0;
    while received < 5 {
        while cycles.receive().unwrap().is_some() {
            received += 1;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(state.get().cycle > 0);
    println!("\nattached");
    loop {
        let _ = (state.get(), cycles.receive());
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn spawn_reader(domain: &str) -> Child {
    Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "a_reader_that_waits_to_be_killed", "--nocapture"])
        .env(DOMAIN, domain)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Says when the child has attached.
fn attached(child: &mut Child) -> Arc<AtomicBool> {
    let seen = Arc::new(AtomicBool::new(false));
    let (flag, lines) = (
        Arc::clone(&seen),
        BufReader::new(child.stdout.take().unwrap()),
    );
    std::thread::spawn(move || {
        for line in lines.lines().map_while(Result::ok) {
            flag.fetch_or(line == "attached", Ordering::SeqCst);
        }
    });
    seen
}

#[test]
fn readers_that_come_and_are_killed_while_an_armed_arm_moves_change_no_call() {
    let domain = format!("test_calls_{}", std::process::id());
    let mut running = start_loop(&domain);
    let mut arm = EchoArm::start();
    let address = arm.address();
    std::thread::spawn(move || {
        arm.accept();
        while arm.meet(1) {}
    });
    running.until(|newest| newest.cycle > 3);
    let settings = LinkSettings::new(250, 4_000_000);
    let link = TcpLink::connect(address, Duration::from_secs(5), settings).unwrap();
    let engage = ControlCommand::Engage { hold: START_POSE };
    running.command(engage, Some(Box::new(link)));
    let engaged = |r: &CycleRecord| r.mode == ControllerMode::Idle as u8;
    running.until(engaged);
    let arm_for_a_throw = ControlCommand::Arm(Arming {
        operating_mode: OperatingMode::Throw,
        expires_ns: now_ns() + 10_000_000_000,
        area_clear: true,
    });
    running.command(arm_for_a_throw, None);
    let motion = Box::new(swinging(START_POSE).unwrap());
    running.command(ControlCommand::Run { id: 1, motion }, None);
    let moves = |r: &CycleRecord| r.mode == ControllerMode::Streaming as u8;
    running.until(moves);
    for _ in 0..5 {
        let mut child = spawn_reader(&domain);
        let is_there = attached(&mut child);
        running.until(|_| is_there.load(Ordering::SeqCst));
        let at = running.newest.cycle;
        running.until(|r| r.cycle > at + 50);
        child.kill().unwrap();
        child.wait().unwrap();
        running.bus.remove_leftovers();
        let at = running.newest.cycle;
        running.until(|r| r.cycle > at + 50);
        assert!(moves(&running.newest), "{:?}", running.newest);
    }
    running.quit.store(true, Ordering::SeqCst);
    let joined = running.thread.join();
    let (sums, page_faults) = joined.expect("a cycle called something else");
    println!("{sums:?}, page faults {page_faults:?}");
    // Without CAP_IPC_LOCK or `memlock unlimited` they cannot be judged.
    let unjudged = page_faults.is_none() && std::env::var_os("CI").is_none();
    assert!(unjudged || page_faults.is_some_and(|[before, after]| before == after));
    assert!(sums.cycles >= 500, "{sums:?}");
    // Not one cycle without its receive once there is a link.
    assert_eq!(sums.receives + sums.unlinked, sums.cycles);
    assert!(sums.sends * 10 > sums.receives * 9);
}

/// The judge itself: what it must not overlook.
#[test]
fn a_second_receive_a_second_sleep_and_a_printed_line_are_seen() {
    let calls_of = |body: fn()| {
        std::thread::spawn(move || {
            counter::watch_this_thread();
            counter::take();
            counter::count(true);
            body();
            counter::count(false);
            counter::take()
        })
        .join()
        .unwrap()
    };
    let judge = |calls: &Calls| {
        let judged = std::panic::AssertUnwindSafe(|| Sums::default().add(calls));
        std::panic::catch_unwind(judged).is_ok()
    };
    let sleep = || MonotonicClock.sleep_until(1);
    assert!(judge(&calls_of(sleep)));
    assert!(!judge(&calls_of(|| {
        MonotonicClock.sleep_until(1);
        MonotonicClock.sleep_until(1);
    })));
    assert!(!judge(&calls_of(|| {
        MonotonicClock.sleep_until(1);
        // SAFETY: no descriptor and no message: the call fails and does nothing.
        unsafe { libc::recvmsg(-1, core::ptr::null_mut(), 0) };
        // SAFETY: as above.
        unsafe { libc::recvmsg(-1, core::ptr::null_mut(), 0) };
    })));
    let printed = calls_of(|| {
        MonotonicClock.sleep_until(1);
        let _ = std::io::Write::write_all(&mut std::io::stderr(), b"a line\n");
    });
    assert_eq!(printed.of(libc::SYS_write), 1);
    assert!(!judge(&printed));
}
