//! The session a command works in: shared memory, supervised processes, the
//! operator's heartbeat, what is received, and the file of the run.

mod confirm;

use super::presence::{Presence, Switch};
use super::{ProcessSpec, Received, RunFile, Supervisor};
use anyhow::{Context, bail};
use cli_output::{is_interrupted, output};
use shared_types::ipc::rpc::{Pending, Rpc, RpcClient};
use shared_types::ipc::{Bus, DomainSweep, IpcError, OperatorEnd};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// What the operator confirmed by a word, and when.
#[derive(Debug, Clone, Copy)]
pub struct Confirmation {
    /// What was typed.
    pub word: &'static str,
    /// CLOCK_MONOTONIC (ns).
    pub at_ns: u64,
    /// The same by the wall clock.
    pub at: SystemTime,
}

/// Processes, shared memory and records of one command.
#[derive(Debug)]
pub struct Session {
    // Order matters: the heartbeat ends before the processes, the processes
    // before the connection to shared memory, and that before the sweep.
    operator: Option<OperatorEnd>,
    /// The operator at standard input, where somebody must be there.
    presence: Option<Presence>,
    /// A motion runs that nobody but the controller is needed for.
    committed: bool,
    supervisor: Supervisor,
    /// What stages work with.
    pub received: Received,
    /// Every word by which the operator confirmed a motion, in order.
    pub confirmed: Vec<Confirmation>,
    run_file: Option<RunFile>,
    bus: Bus,
    _sweep: DomainSweep,
    log_folder: PathBuf,
    last_beat: Instant,
}

/// How long a process may take to come up (s).
const STARTUP_S: f64 = 15.0;
/// Pause between two turns.
const TURN: Duration = Duration::from_millis(5);
const BEAT_EVERY: Duration = Duration::from_millis(20);
/// Two and a half periods of the reports that have the arm's codes (5 Hz).
const CODES_WITHIN: Duration = Duration::from_millis(500);

impl Session {
    /// Joins shared memory under `domain`; children log into `log_folder`.
    pub fn new(domain: &str, log_folder: &Path) -> anyhow::Result<Self> {
        let bus = Bus::join(domain)?;
        Ok(Self {
            operator: None,
            presence: None,
            committed: false,
            supervisor: Supervisor::default(),
            received: Received::open(&bus)?,
            confirmed: Vec::new(),
            run_file: None,
            bus,
            _sweep: DomainSweep::new(domain),
            log_folder: log_folder.to_owned(),
            last_beat: Instant::now(),
        })
    }

    /// Starts the process that records the whole run in `path`; call it before the
    /// controller is started.
    pub fn record_run(&mut self, spec: &ProcessSpec, path: &Path) {
        self.run_file = Some(RunFile::start(spec, path, &self.log_folder));
    }

    /// Finishes the file of the run, once all results lie in the run folder.
    ///
    /// # Errors
    /// The recorder was lost on the way.
    pub fn finish_run_file(&mut self) -> anyhow::Result<()> {
        self.run_file.take().map_or(Ok(()), RunFile::finish)
    }

    /// From now on the arm moves only as the operator at standard input lets it.
    pub fn watch_operator(&mut self, switch: Switch) -> anyhow::Result<()> {
        self.presence = Some(Presence::at_standard_input(switch)?);
        if output::tells_events() {
            return Ok(());
        }
        eprintln!(
            "{}; Ctrl-C stops as well",
            match switch {
                Switch::DeadMan =>
                    "Enter stops the arm, and so does any other input that was not asked for, or its end",
                Switch::HoldToRun => "The arm moves only while Enter is held down",
            }
        );
        Ok(())
    }

    /// Starts a process, which is watched from now on.
    ///
    /// # Errors
    /// It cannot be started.
    pub fn start(&mut self, spec: &ProcessSpec) -> anyhow::Result<()> {
        self.supervisor.start(spec, &self.log_folder)
    }

    /// One turn of everything that must go on while something else is waited
    /// for. Fails when a process died or the user pressed Ctrl-C.
    pub fn tick(&mut self) -> anyhow::Result<()> {
        // Also before the operator's place is taken: what is typed must not be read later as new.
        let let_go = self.presence.as_mut().is_some_and(Presence::is_let_go);
        if let Some(operator) = &mut self.operator {
            if let_go {
                operator.let_go();
            } else if self.last_beat.elapsed() >= BEAT_EVERY {
                operator.beat();
                self.last_beat = Instant::now();
            }
        }
        self.received.drain()?;
        if let Some(file) = &mut self.run_file {
            file.watch();
        }
        if self.committed {
            self.supervisor.check_arm()?;
        } else {
            self.supervisor.check()?;
        }
        if is_interrupted() {
            bail!(
                "interrupted; the arm was commanded to stop and all processes of this command were ended"
            );
        }
        Ok(())
    }

    /// Keeps turning for `duration`.
    pub fn idle(&mut self, duration: Duration) -> anyhow::Result<()> {
        let began = Instant::now();
        while began.elapsed() < duration {
            self.tick()?;
            std::thread::sleep(TURN);
        }
        Ok(())
    }

    /// Connects to a service and waits until its process answers `ping`.
    pub fn connect<R: Rpc>(&mut self, ping: &R::Request) -> anyhow::Result<RpcClient<R>> {
        let client = RpcClient::<R>::open(&self.bus)?;
        let began = Instant::now();
        loop {
            match client.call(ping) {
                Ok(pending) => {
                    self.finish(&pending, STARTUP_S, |_| ())?;
                    return Ok(client);
                }
                Err(IpcError::Gone { .. }) if began.elapsed().as_secs_f64() < STARTUP_S => {
                    self.idle(Duration::from_millis(10))?;
                }
                Err(IpcError::Gone { service }) => {
                    bail!("no process serves `{service}` after {STARTUP_S} s");
                }
                Err(e) => return Err(e.into()),
            }
        }
    }

    /// Connects to a service that serves already; `None` where nobody does.
    ///
    /// # Errors
    /// Its process does not answer `ping`.
    pub fn find<R: Rpc>(&mut self, ping: &R::Request) -> anyhow::Result<Option<RpcClient<R>>> {
        let client = RpcClient::<R>::open(&self.bus)?;
        match client.call(ping) {
            Ok(pending) => {
                self.finish(&pending, STARTUP_S, |_| ())?;
                Ok(Some(client))
            }
            Err(IpcError::Gone { .. }) => Ok(None),
            Err(e) => Err(e.into()),
        }
    }

    /// Takes the operator's place at a running controller.
    pub fn take_operator(&mut self) -> anyhow::Result<()> {
        let taken = "the operator's place at the controller cannot be had: end the other command that uses it, then run this one again";
        self.operator = Some(OperatorEnd::take(&self.bus).context(taken)?);
        Ok(())
    }

    /// Sends a request and waits for its last event while everything else goes
    /// on; earlier events go to `each`.
    pub fn ask<R: Rpc>(
        &mut self,
        client: &RpcClient<R>,
        request: &R::Request,
        within_s: f64,
        each: impl FnMut(&R::Event),
    ) -> anyhow::Result<R::Event> {
        // A motion begins only under an operator who has just given a sign of life.
        self.tick()?;
        let pending = client.call(request)?;
        self.finish(&pending, within_s, each)
    }

    /// Waits for the last event of a request under way.
    pub fn finish<R: Rpc>(
        &mut self,
        pending: &Pending<R>,
        within_s: f64,
        each: impl FnMut(&R::Event),
    ) -> anyhow::Result<R::Event> {
        let timeout = Duration::from_secs_f64(within_s);
        let result = pending.finish(timeout, || self.tick(), each);
        result.map_err(|error| self.explain(error))
    }

    /// Does `work` whose motion lies in the controller whole: the death of a process that
    /// does not hold the arm stops nothing. It is reported after the motion, by the error
    /// that this returns then.
    pub fn committed<T>(
        &mut self,
        work: impl FnOnce(&mut Self) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        self.committed = true;
        let result = work(self);
        self.committed = false;
        self.supervisor.check()?;
        result
    }

    /// Waits for the next event of a request under way.
    pub fn next<R: Rpc>(
        &mut self,
        pending: &Pending<R>,
        within_s: f64,
    ) -> anyhow::Result<R::Event> {
        let began = Instant::now();
        loop {
            self.tick()?;
            match pending.try_next() {
                Ok(Some(event)) => return Ok(event),
                Ok(None) if began.elapsed().as_secs_f64() < within_s => {
                    std::thread::sleep(Duration::from_millis(1));
                }
                Ok(None) => bail!("`{}` did not answer within {within_s} s", R::NAME),
                Err(e) => return Err(self.explain(e.into())),
            }
        }
    }

    /// A vanished server is explained by the process that died, if one did.
    fn explain(&mut self, error: anyhow::Error) -> anyhow::Error {
        for _ in 0..40 {
            if let Err(death) = self.supervisor.check() {
                return death;
            }
            if !matches!(error.downcast_ref(), Some(IpcError::Gone { .. })) {
                break;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        error
    }

    /// Ends the session. When its work is done the arm rests and the operator
    /// just leaves; otherwise the arm is told to stop. Then the processes end.
    pub fn end(&mut self, done: bool) {
        if let Some(mut operator) = self.operator.take()
            && !done
        {
            operator.stop();
            self.await_arm_codes();
        }
        let _ = self.received.drain();
        self.supervisor.stop();
        self.bus.remove_leftovers();
    }

    /// Why the arm stopped is in its slow reports only; the record goes on until two of them
    /// must have come, so that it can explain the stop.
    fn await_arm_codes(&mut self) {
        let began = Instant::now();
        while began.elapsed() < CODES_WITHIN
            && self.supervisor.check_arm().is_ok()
            && self.received.drain().is_ok()
        {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.end(false);
    }
}
