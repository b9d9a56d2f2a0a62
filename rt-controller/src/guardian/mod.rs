//! The guardian: a process of its own that knows one thing. When the controller
//! is lost while the arm moves, it asks the arm to stop.
//!
//! The arm has no command watchdog in servo mode: without setpoints it stands
//! still at once, from whatever speed it had, and keeps taking whatever comes
//! next. The guardian has a connection of its own, so it stops the arm also
//! when the controller's process was killed, hangs, or lost its link. It reads
//! the controller's newest state from a blackboard every 2 ms; a sign of life
//! older than any gap that the controller rides out, or the end of its control thread,
//! is a loss; so is a controller that stopped and whose own link failed. What it does
//! about it is decided by [`decision`], pure and tested in virtual time; [`mod@line`]
//! talks to the arm without ever waiting.
//!
//! It writes a beat of its own, which the controller wants to see before it
//! moves anything.

pub mod decision;
pub mod line;
mod watched;

use crate::config::ControllerConfig;
use crate::error::ControllerError;
use crate::os::{Clock, MonotonicClock, RealTimeSettings, enter_real_time};
use crate::watchdog::Progress;
use decision::{Emergency, Guardian, GuardianInput, GuardianPhase};
use line::ArmLine;
use shared_types::ipc::{Bus, DomainSweep, GuardianBeat};
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use watched::Watched;

/// Time between two turns (ns).
const TURN_NS: u64 = 2_000_000;
/// Time between two looks for a controller (ns).
const LOOK_EVERY_NS: u64 = 50_000_000;
/// Longest stay after being asked to end while the arm moves (ns): the
/// controller brakes first.
const LEAVE_WITHIN_NS: u64 = 4_000_000_000;
/// The same where no connection to the arm can be had (ns): its host is down or
/// gone, and whoever ends the guardian is told to look at the arm.
const LEAVE_UNCONFIRMED_WITHIN_NS: u64 = 1_500_000_000;

/// Guards the arm and the controller of `config` until `stop` is set; when the
/// arm moves then, until it stands. Blocks the calling thread.
///
/// # Errors
/// [`ControllerError`]: wrong configuration, no shared memory, or missing
/// real-time properties where they are required.
pub fn run(config: &ControllerConfig, stop: &AtomicBool) -> Result<(), ControllerError> {
    config.check()?;
    let _sweep = DomainSweep::new(&config.domain);
    let bus = Bus::join(&config.domain)?;
    // Its thread would inherit the real-time priority of this one.
    let progress = Progress::default();
    progress.report()?;
    set_up_thread(config)?;
    let mut runner = Runner {
        watchdog: Guardian::new(config.guardian_silence_ns()?),
        line: ArmLine::new(SocketAddr::new(config.arm, config.command_port)),
        watched: None,
        looked_ns: 0,
    };
    let mut clock = MonotonicClock;
    let mut next_ns = clock.now_ns();
    let mut leaving_ns = None;
    loop {
        next_ns = next_ns.saturating_add(TURN_NS).max(clock.now_ns());
        clock.sleep_until(next_ns);
        let now_ns = clock.now_ns();
        let moving = runner.turn(&bus, now_ns);
        progress.reached(now_ns);
        if stop.load(Ordering::Relaxed) {
            let since_ns = now_ns.saturating_sub(*leaving_ns.get_or_insert(now_ns));
            let most_ns = if runner.line.is_connected() {
                LEAVE_WITHIN_NS
            } else {
                LEAVE_UNCONFIRMED_WITHIN_NS
            };
            if moving && since_ns > most_ns {
                tracing::error!(
                    "leaving an arm that was not seen stopped: press its emergency stop"
                );
            }
            if !moving || since_ns > most_ns {
                return Ok(());
            }
        }
    }
}

/// Real-time priority for the calling thread, which does all the work.
fn set_up_thread(config: &ControllerConfig) -> Result<(), ControllerError> {
    let settings = RealTimeSettings {
        priority: config.guardian.priority,
        cpu: None,
        ..config.real_time.clone()
    };
    let warnings = enter_real_time(&settings);
    ControllerError::unless_real_time(config.requires_real_time(), warnings).map(drop)
}

/// Runs the watchdog: its connection to the arm, the controller it watches.
struct Runner {
    watchdog: Guardian,
    line: ArmLine,
    watched: Option<Watched>,
    looked_ns: u64,
}

impl Runner {
    /// One turn; whether the arm may be moving.
    fn turn(&mut self, bus: &Bus, now_ns: u64) -> bool {
        let arm_state = self.line.turn(now_ns);
        let pulse = self.watched.as_mut().and_then(Watched::pulse);
        let out = self.watchdog.step(&GuardianInput {
            now_ns,
            pulse,
            arm_state,
            connected: self.line.is_connected(),
        });
        if out.ask_stop && !self.line.ask_stop(now_ns) {
            self.watchdog.was_not_sent();
        }
        if let Some(phase) = out.changed {
            self.tell(phase);
        }
        if let Some(watched) = &mut self.watched {
            watched.end.beat(GuardianBeat {
                phase: self.watchdog.phase() as u8,
                connected: u8::from(self.line.is_answered(now_ns)),
                stamp_ns: now_ns,
                ..GuardianBeat::default()
            });
        }
        if out.look_again && now_ns.saturating_sub(self.looked_ns) > LOOK_EVERY_NS {
            self.look(bus, now_ns);
        }
        match self.watchdog.phase() {
            GuardianPhase::Stopping => true,
            GuardianPhase::Watching => pulse.is_some_and(|p| p.moving),
            GuardianPhase::Waiting | GuardianPhase::Stopped | GuardianPhase::StopUnconfirmed => {
                false
            }
        }
    }

    /// Looks for a controller. The blackboards of a lost one are let go first,
    /// so that the next one can create them.
    fn look(&mut self, bus: &Bus, now_ns: u64) {
        self.looked_ns = now_ns;
        self.watched = None;
        bus.remove_leftovers();
        self.watched = Watched::open(bus).ok();
    }

    fn tell(&self, phase: GuardianPhase) {
        let reaction_ms = self.watchdog.reaction_ns().map(|ns| ns / 1_000_000);
        match phase {
            GuardianPhase::Waiting => tracing::info!("no controller to guard"),
            GuardianPhase::Watching => tracing::info!("guarding the controller"),
            GuardianPhase::Stopping => {
                let why = match self.watchdog.emergency() {
                    Emergency::Lost => "the controller was lost while the arm moved",
                    Emergency::CutOff => "the controller lost its link while the arm moved",
                };
                tracing::error!(reaction_ms, "{why}; the arm is asked to stop");
            }
            GuardianPhase::Stopped => tracing::error!(reaction_ms, "the arm was seen stopped"),
            GuardianPhase::StopUnconfirmed => tracing::error!(
                "the arm was asked to stop for 3 s but was not seen stopped: press its emergency stop"
            ),
        }
    }
}
