//! A controller and a camera as shared memory shows them, without an arm.

use arm_model::JointVector;
use arm_model::joint::START_POSE;
use rt_controller::os::now_ns;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest, ControllerRpc};
use shared_types::ipc::rpc::RpcServer;
use shared_types::ipc::{
    Bus, ControllerBoards, ControllerMode, ControllerState, CycleRecord, DomainSweep, FrameHeader,
    JointReport, OperatorEnd, PAYLOAD_VERSION, PIXEL_FORMAT_YUYV,
};
use shared_types::rope::RANGES;
use shared_types::{FaultCode, OperatingMode, RopeParams};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time between two cycles; a quarter of the real rate is enough to look at.
const CYCLE: Duration = Duration::from_millis(16);
/// Size of a side-by-side frame (pixels).
const SIZE: [u32; 2] = [256, 96];
const FRAME_BYTES: usize = (SIZE[0] * SIZE[1] * 2) as usize;

/// What others may see of it and do to it.
#[derive(Debug, Default)]
pub(crate) struct Wires {
    end: AtomicBool,
    operate: AtomicBool,
    pub(crate) stops: AtomicUsize,
    pub(crate) disarms: AtomicUsize,
}

/// One that runs until it is dropped.
pub(crate) struct Fake {
    pub(crate) wires: Arc<Wires>,
    pub(crate) domain: String,
    thread: Option<JoinHandle<()>>,
}

impl Fake {
    /// A streaming controller in `domain`, whose process no longer exists once it is
    /// silent.
    pub(crate) fn start(domain: &str) -> Self {
        let wires = Arc::new(Wires::default());
        let (name, shared) = (domain.to_owned(), Arc::clone(&wires));
        let (ready, wait) = std::sync::mpsc::channel();
        let thread = std::thread::spawn(move || run(&name, &shared, &ready));
        wait.recv().unwrap();
        Self {
            wires,
            domain: domain.to_owned(),
            thread: Some(thread),
        }
    }

    /// An operator's program comes or goes.
    pub(crate) fn operate(&self, there: bool) {
        self.wires.operate.store(there, Ordering::SeqCst);
    }
}

impl Drop for Fake {
    fn drop(&mut self) {
        self.wires.end.store(true, Ordering::SeqCst);
        self.thread.take().unwrap().join().unwrap();
    }
}

/// The arm's joints at a time.
fn joints(t_s: f64) -> JointVector {
    let mut q = START_POSE;
    q[5] += 0.25 * (4.0 * t_s).sin();
    q
}

fn run(domain: &str, wires: &Wires, ready: &std::sync::mpsc::Sender<()>) {
    let _sweep = DomainSweep::new(domain);
    let bus = Bus::join(domain).unwrap();
    let mut boards = ControllerBoards::create(&bus).unwrap();
    let cycles = bus.cycle_publisher().unwrap();
    let reports = bus.joint_publisher().unwrap();
    let frames = bus.frame_publisher(FRAME_BYTES).unwrap();
    let server = RpcServer::<ControllerRpc>::open(&bus).unwrap();
    let mut operator: Option<OperatorEnd> = None;
    let mut fault = FaultCode::None;
    let began = Instant::now();
    let mut cycle = 0;
    ready.send(()).unwrap();
    while !wires.end.load(Ordering::SeqCst) {
        cycle += 1;
        let stamp_ns = now_ns();
        let q = joints(began.elapsed().as_secs_f64());
        let mode = match fault {
            FaultCode::None => ControllerMode::Streaming,
            _ => ControllerMode::Faulted,
        } as u8;
        boards.publish(ControllerState {
            version: PAYLOAD_VERSION,
            mode,
            fault: fault as u16,
            cycle,
            stamp_ns,
            q_c: q,
            q,
            operating_mode: OperatingMode::Wiggle as u8,
            pid: u32::MAX,
            ..ControllerState::default()
        });
        let record = CycleRecord {
            mode,
            fault: fault as u16,
            cycle,
            wake_late_ns: 20_000,
            compute_ns: 9_000,
            ..CycleRecord::default()
        };
        cycles.send_copy(record).unwrap();
        let report = JointReport {
            stamp_ns,
            q,
            ..JointReport::default()
        };
        reports.send_copy(report).unwrap();
        let header = FrameHeader {
            version: PAYLOAD_VERSION,
            pixel_format: PIXEL_FORMAT_YUYV,
            sequence: cycle,
            stamp_ns,
            width_px: SIZE[0],
            height_px: SIZE[1],
        };
        let mut frame = frames.loan_slice(FRAME_BYTES).unwrap();
        *frame.user_header_mut() = header;
        frame.payload_mut().fill(128 + (cycle % 64) as u8);
        frame.send().unwrap();
        serve(&server, wires, &mut fault);
        if wires.operate.load(Ordering::SeqCst) {
            let end = operator.get_or_insert_with(|| OperatorEnd::take(&bus).unwrap());
            end.beat();
        } else {
            operator = None;
        }
        std::thread::sleep(CYCLE);
    }
}

fn serve(server: &RpcServer<ControllerRpc>, wires: &Wires, fault: &mut FaultCode) {
    while let Some(call) = server.receive().unwrap() {
        match call.request {
            ControllerRequest::Stop => {
                *fault = FaultCode::OperatorStop;
                wires.stops.fetch_add(1, Ordering::SeqCst);
            }
            ControllerRequest::Disarm => {
                wires.disarms.fetch_add(1, Ordering::SeqCst);
            }
            _ => {}
        }
        call.send(&ControllerEvent::Done).unwrap();
    }
}

/// A run folder whose controller is `domain`, with an identified rope.
pub(crate) fn run_folder(folder: &Path, domain: &str) {
    std::fs::create_dir(folder.join("config")).unwrap();
    let config = rt_controller::ControllerConfig {
        domain: domain.to_owned(),
        ..rt_controller::ControllerConfig::default()
    };
    let text = toml::to_string(&config).unwrap();
    std::fs::write(folder.join("config/rt-controller.toml"), text).unwrap();
    put_rope(folder);
}

/// An identified rope, in the middle of all ranges.
pub(crate) fn put_rope(folder: &Path) {
    let rope = RopeParams::from_array(RANGES.map(|r| 0.5 * (r.min + r.max)));
    std::fs::write(folder.join("params.toml"), toml::to_string(&rope).unwrap()).unwrap();
}
