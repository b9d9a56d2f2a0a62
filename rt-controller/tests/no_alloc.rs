//! The real-time thread touches the heap in no cycle: counted over the real
//! loop body, through every mode and a fault.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    unsafe_code,
    reason = "tests may fail loudly; a counting allocator is unsafe by nature"
)]

use rt_controller::control::{ControlState, Motion, Order, Thresholds};
use rt_controller::os::Clock;
use rt_controller::point_to_point::plan_move;
use rt_controller::ports::{Mail, Rings, rings};
use rt_controller::rt_loop::RtLoop;
use rt_controller::transport::tcp::{LinkSettings, TcpLink};
use rt_controller::xarm::frame::MAX_FRAME_LEN;
use rt_controller::xarm::{FrameReader, ReplyData, Status};
use shared_types::ipc::{
    Bus, ControllerBoards, ControllerMode, CycleRecord, JointReport, OperatorEnd,
};
use shared_types::plan::START_POSE;
use shared_types::{JointTrajectory, JointVector, Limits};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener};
use std::time::Duration;

struct Counting;

thread_local! {
    static TOUCHES: Cell<u64> = const { Cell::new(0) };
}

fn touched() {
    let _ = TOUCHES.try_with(|count| count.set(count.get() + 1));
}

// SAFETY: every call is passed on to the system's allocator unchanged; the
// count is thread-local, const-initialised and does not allocate.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        touched();
        // SAFETY: the caller's obligations are those of `System.alloc`.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        touched();
        // SAFETY: `pointer` came from `System` with this layout.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        touched();
        // SAFETY: `pointer` came from `System` with this layout.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn touches() -> u64 {
    TOUCHES.with(Cell::get)
}

/// Time that moves by hand.
struct Hand(u64);

impl Clock for Hand {
    fn now_ns(&self) -> u64 {
        self.0
    }
    fn sleep_until(&mut self, deadline_ns: u64) {
        self.0 = deadline_ns;
    }
}

const PERIOD_NS: u64 = 4_000_000;

/// Answers every setpoint on one connection, like an arm without a body.
fn echo_arm() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let mut reader = FrameReader::new();
            let mut out = [0; MAX_FRAME_LEN];
            while let Ok(n @ 1..) = stream.read(reader.space()) {
                reader.commit(n);
                while let Ok(Some(frame)) = reader.next_frame() {
                    let request = frame.as_request().unwrap();
                    let n = ReplyData::None.emit(&mut out, &request, Status(0)).unwrap();
                    if stream.write_all(&out[..n]).is_err() {
                        break;
                    }
                }
            }
        }
    });
    address
}

struct Bench {
    rt: RtLoop<TcpLink, Hand>,
    rings: Rings<TcpLink>,
    operator: OperatorEnd,
    now_ns: u64,
    newest: CycleRecord,
    seen: [u64; 6],
    touched: u64,
    cycles: u64,
}

impl Bench {
    /// One cycle of the real loop body, its heap touches counted.
    fn cycle(&mut self) {
        self.operator.beat();
        self.now_ns += PERIOD_NS;
        let report = JointReport {
            arm_state: 1,
            arm_mode: 1,
            stamp_ns: self.now_ns,
            arrival_ns: self.now_ns,
            q: self.newest.q_c,
            ..JointReport::default()
        };
        self.rings.reports_to_rt.push(report).unwrap();
        let before = touches();
        self.rt.cycle(self.now_ns, 0, self.now_ns);
        self.touched += touches() - before;
        self.cycles += 1;
        self.newest = self.rings.relay.records.pop().unwrap();
        self.seen[usize::from(self.newest.mode)] += 1;
        while self.rings.relay.retired.pop().is_ok() {}
        while self.rings.relay.events.pop().is_ok() {}
        if self.cycles.is_multiple_of(16) {
            // Lets the echo answer; time in the loop does not pass meanwhile.
            std::thread::sleep(Duration::from_micros(500));
        }
    }

    fn order(&mut self, order: Order, link: Option<Box<TcpLink>>) {
        self.rings.relay.orders.push(Mail { order, link }).unwrap();
        self.cycle();
    }

    fn mode(&self) -> ControllerMode {
        ControllerMode::from_raw(self.newest.mode)
    }

    fn until_still(&mut self) {
        while self.mode().is_moving() {
            self.cycle();
        }
    }

    fn adopt(&mut self, arm: SocketAddr) {
        let settings = LinkSettings::new(200, PERIOD_NS);
        let link = Box::new(TcpLink::connect(arm, Duration::from_secs(1), settings).unwrap());
        let hold = if self.mode() == ControllerMode::Offline {
            START_POSE
        } else {
            self.newest.q_c
        };
        self.order(Order::Adopt { hold }, Some(link));
        assert_eq!(self.mode(), ControllerMode::Idle);
    }

    fn go(&mut self, to: JointVector, limits: &Limits) {
        let motion = Box::new(plan_move(&self.newest.q_c, &to, 0.5, limits).unwrap());
        self.order(Order::Run { id: 1, motion }, None);
    }
}

#[test]
fn no_cycle_touches_the_heap() {
    let name = format!("test_noalloc_{}", std::process::id());
    let bus = Bus::join(&name).unwrap();
    let boards = ControllerBoards::create(&bus).unwrap();
    let limits = Limits::default();
    let thresholds = Thresholds {
        operator_timeout_ns: 500_000_000,
        reply_stall_ns: 2_000_000_000,
        report_stale_ns: 100_000_000,
        tracking_error_max_rad: 0.05,
        tracking_window_ns: 100_000_000,
        missed_cycles_max: 5,
        ..Thresholds::relaxed()
    };
    let mut rings = rings();
    let rt_ports = std::mem::replace(&mut rings.rt, self::rings::<TcpLink>().rt);
    let control = ControlState::new(limits.clone(), thresholds);
    let mut bench = Bench {
        rt: RtLoop::new(control, Hand(1_000_000_000_000), boards, rt_ports),
        operator: OperatorEnd::take(&bus).unwrap(),
        rings,
        now_ns: 1_000_000_000_000,
        newest: CycleRecord::default(),
        seen: [0; 6],
        touched: 0,
        cycles: 0,
    };
    let arm = echo_arm();
    let mut swing = START_POSE;
    swing[5] -= 0.4;
    let spline = JointTrajectory::new(&[0.0, 0.8, 1.6], &[START_POSE, swing, START_POSE]).unwrap();
    bench.cycle();
    bench.adopt(arm);
    while bench.cycles < 10_000 {
        let motion = Box::new(Motion::Spline(spline));
        bench.order(Order::Run { id: 2, motion }, None);
        bench.until_still();
        bench.go(swing, &limits);
        for _ in 0..40 {
            bench.cycle();
        }
        bench.order(Order::Stop, None);
        bench.until_still();
        assert_eq!(bench.mode(), ControllerMode::Faulted);
        bench.cycle();
        bench.adopt(arm);
        bench.go(START_POSE, &limits);
        bench.until_still();
        assert_eq!(bench.mode(), ControllerMode::Idle);
    }
    println!("cycles by mode (Offline to Faulted): {:?}", bench.seen);
    assert!(bench.seen.iter().all(|cycles| *cycles > 0));
    assert_eq!(bench.touched, 0);
}

#[test]
fn the_counter_sees_a_vec() {
    let before = touches();
    std::hint::black_box(vec![0_u8; 100]);
    assert_eq!(touches() - before, 2);
}
