//! The controller process: four threads, their rings, and how they end.
//!
//! | thread | owns | scheduling |
//! |---|---|---|
//! | control loop | command link, blackboards, control state | FIFO, absolute deadlines |
//! | joint reports | 250 Hz report connection | FIFO, ten below |
//! | arm status | 5 Hz report connection | ordinary |
//! | bridge (the caller's) | services, histograms, set-up connection | ordinary |

use crate::bridge::Bridge;
use crate::config::ControllerConfig;
use crate::control::ControlState;
use crate::error::ControllerError;
use crate::os::{MonotonicClock, RealTimeSettings, enter_real_time, shared_memory_free_mb};
use crate::ports::{RtPorts, rings};
use crate::report_stream::{ReportStream, code_decoder, joint_decoder};
use crate::rt_loop::RtLoop;
use crate::transport::ArmTransport;
use crate::transport::tcp::TcpLink;
use crate::warm_up::CacheWarmUp;
use crate::watchdog::Progress;
use shared_types::ipc::{Bus, ControllerBoards, DomainSweep, IpcError};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Name of the control thread, by which the guardian finds it.
pub(crate) const CONTROL_THREAD: &str = "control loop";
/// Pause between two turns of the bridge.
const TURN: Duration = Duration::from_millis(2);
/// Room that the controller's services take in shared memory, with some to spare
/// for those who attach (MB); 97 were found in use.
const ROOM_MB: u64 = 128;
/// Longest wait for the brake when the process is asked to end.
const BRAKE_WAIT: Duration = Duration::from_secs(3);
/// Longest wait for the blackboards of a controller that was killed.
const BOARDS_WAIT: Duration = Duration::from_millis(500);

/// Runs the controller until `stop` is set. A moving arm is braked first; it
/// then holds its last setpoint by itself. Blocks the calling thread.
///
/// # Errors
/// [`ControllerError`]: wrong configuration, no shared memory, or missing
/// real-time properties where they are required.
pub fn run(config: ControllerConfig, stop: &AtomicBool) -> Result<(), ControllerError> {
    config.check()?;
    let limits = config.resolve_limits()?;
    let settings = config.control_settings()?;
    require_room()?;
    let _sweep = DomainSweep::new(&config.domain);
    let bus = Bus::join(&config.domain)?;
    bus.remove_leftovers();
    let rings = rings();
    let mut threads = Threads::default();
    let control = ControlState::new(limits.clone(), settings).measured(&config.measured_lags()?);
    let broken = rings.rt.broken.clone();
    let quit = Arc::clone(&threads.quit);
    let body = move |mut rt: RtLoop<TcpLink, MonotonicClock>| {
        // A panic is a defect; caught here, the bridge can still stop the arm.
        if catch_unwind(AssertUnwindSafe(|| rt.run(&quit))).is_err() {
            tracing::error!("the control loop panicked");
        }
    };
    let real_time = &config.real_time;
    let (thread, warnings) = start_loop(&config.domain, real_time, control, rings.rt, body)?;
    threads.control_loop = Some(thread);
    let warnings = ControllerError::unless_real_time(config.requires_real_time(), warnings)?;
    let joints = ReportStream {
        arm: config.arm,
        ports: vec![config.report_port, config.fallback_report_port],
        decoder: joint_decoder,
        rings: rings.reports,
        broken: broken.clone(),
        quit: Arc::clone(&threads.quit),
    };
    let priority = config.real_time.priority.map(|p| p.saturating_sub(10));
    let codes = ReportStream {
        arm: config.arm,
        ports: config.status_ports.to_vec(),
        decoder: code_decoder,
        rings: rings.codes,
        broken,
        quit: Arc::clone(&threads.quit),
    };
    // Each is kept before the next is spawned: if that fails, it is ended and joined.
    let receiver = joints.spawn("joint reports", priority);
    threads
        .receivers
        .push(receiver.map_err(ControllerError::Thread)?);
    let receiver = codes.spawn("arm status", None);
    threads
        .receivers
        .push(receiver.map_err(ControllerError::Thread)?);
    let held_to = (limits, settings);
    let mut bridge = Bridge::open(&bus, config, held_to, warnings, rings.bridge)?;
    let progress = Progress::default();
    progress.report()?;
    serve(&mut bridge, &threads, &progress, stop)
}

/// Refuses to begin where shared memory is too small or full.
fn require_room() -> Result<(), ControllerError> {
    match shared_memory_free_mb() {
        Some(free_mb) if free_mb < ROOM_MB => Err(ControllerError::SharedMemoryFull {
            free_mb,
            needed_mb: ROOM_MB,
        }),
        // Where the system does not say, the library says what it misses.
        _ => Ok(()),
    }
}

/// Turns the bridge until `stop`, then until the arm rests.
fn serve(
    bridge: &mut Bridge,
    threads: &Threads,
    progress: &Progress,
    stop: &AtomicBool,
) -> Result<(), ControllerError> {
    let mut stopping: Option<Instant> = None;
    loop {
        bridge.turn();
        progress.reached(bridge.cycle());
        if !threads.loop_lives() {
            bridge.stop_arm();
            bridge.confirm_stop();
            bridge.end_recording();
            return Err(ControllerError::LoopEnded);
        }
        if stop.load(Ordering::Relaxed) {
            let since = *stopping.get_or_insert_with(|| {
                bridge.stop();
                Instant::now()
            });
            let settled = since.elapsed() > 10 * TURN && !bridge.mode().is_moving();
            if settled || since.elapsed() > BRAKE_WAIT {
                // Once more, for callers whose answer the last cycle brought.
                std::thread::sleep(TURN);
                bridge.turn();
                bridge.end_recording();
                bridge.confirm_stop();
                return Ok(());
            }
        }
        std::thread::sleep(TURN);
    }
}

/// Creates the blackboards. Those of a controller that was killed are let go by
/// its guardian within a moment.
fn create_boards(bus: &Bus) -> Result<ControllerBoards, IpcError> {
    let began = Instant::now();
    loop {
        match ControllerBoards::create(bus) {
            Err(_taken) if began.elapsed() < BOARDS_WAIT => {
                std::thread::sleep(10 * TURN);
                bus.remove_leftovers();
            }
            created => return created,
        }
    }
}

/// The threads beside the bridge. Dropping it ends and joins them.
#[derive(Debug, Default)]
struct Threads {
    quit: Arc<AtomicBool>,
    control_loop: Option<JoinHandle<()>>,
    receivers: Vec<JoinHandle<()>>,
}

impl Drop for Threads {
    fn drop(&mut self) {
        self.quit.store(true, Ordering::Relaxed);
        let control_loop = self.control_loop.take().into_iter();
        for thread in control_loop.chain(self.receivers.drain(..)) {
            if thread.join().is_err() {
                tracing::error!("a thread of the controller panicked");
            }
        }
    }
}

impl Threads {
    fn loop_lives(&self) -> bool {
        self.control_loop
            .as_ref()
            .is_some_and(|thread| !thread.is_finished())
    }
}

/// Starts a thread with a control loop in it, which `body` runs, and waits until it is
/// set up; what could not be had is returned in words.
pub(crate) fn start_loop<T: ArmTransport + Send + 'static>(
    domain: &str,
    settings: &RealTimeSettings,
    control: ControlState,
    ports: RtPorts<T>,
    body: impl FnOnce(RtLoop<T, MonotonicClock>) + Send + 'static,
) -> Result<(JoinHandle<()>, Vec<String>), ControllerError> {
    let (domain, settings) = (domain.to_owned(), settings.clone());
    let (limits, interface) = (control.limits().clone(), control.settings().interface);
    let warm_up = CacheWarmUp::new(limits, interface, settings.warm_up_us)?.for_arm_of(&control);
    let (ready, wait) = mpsc::channel();
    let thread = move || {
        // Blackboard handles stay in the thread that made them.
        let boards = match Bus::join(&domain).and_then(|bus| create_boards(&bus)) {
            Ok(boards) => boards,
            Err(error) => {
                let _ = ready.send(Err(error));
                return;
            }
        };
        let mut rt = RtLoop::new(control, MonotonicClock, boards, ports);
        rt.set_warm_up(warm_up);
        let warnings = enter_real_time(&settings);
        rt.set_real_time(
            warnings.is_empty() && settings.priority.is_some() && settings.lock_memory,
        );
        let _ = ready.send(Ok(warnings));
        body(rt);
    };
    let thread = std::thread::Builder::new()
        .name(CONTROL_THREAD.to_owned())
        .spawn(thread)
        .map_err(ControllerError::Thread)?;
    let warnings = wait
        .recv()
        .map_err(|_gone| ControllerError::LoopNotSetUp)??;
    Ok((thread, warnings))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn required_real_time_that_cannot_be_had_is_a_refusal() {
        let mut config = ControllerConfig {
            domain: format!("test_require_{}", std::process::id()),
            ..ControllerConfig::default()
        };
        config.real_time.cpu = Some(1_000_000);
        let error = run(config, &AtomicBool::new(false)).unwrap_err();
        assert!(error.to_string().contains("core 1000000"), "{error}");
    }
}
