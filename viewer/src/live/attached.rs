//! A connection to one run's shared memory: a reader of the blackboards and of what is
//! published. Nothing here can make the controller or the camera wait.

use super::facts::{Facts, folder_of_process};
use super::film::Film;
use shared_types::ipc::message::ControllerRpc;
use shared_types::ipc::rpc::RpcClient;
use shared_types::ipc::{
    Bus, ControllerState, CycleSubscriber, DomainSweep, IpcError, JointSubscriber, OperatorReader,
    StateReader, running_controllers,
};
use std::path::Path;
use std::time::{Duration, Instant};

/// A state that has not changed for this long is no state any more.
const SILENCE: Duration = Duration::from_secs(1);
/// Within this time a controller makes several cycles.
const BEAT: Duration = Duration::from_millis(50);
/// An operator that has not beaten for this long is none.
const OPERATOR_SILENCE: Duration = Duration::from_secs(1);

/// A number that grows as long as somebody lives.
#[derive(Debug, Clone, Copy)]
struct Pulse {
    count: u64,
    since: Option<Instant>,
}

impl Pulse {
    fn new(count: u64) -> Self {
        Self { count, since: None }
    }

    /// Notes the newest count; whether it grew within `patience`.
    fn beats(&mut self, count: u64, patience: Duration) -> bool {
        if count != self.count {
            *self = Self {
                count,
                since: Some(Instant::now()),
            };
        }
        self.since.is_some_and(|at| at.elapsed() < patience)
    }
}

#[derive(Debug)]
pub(crate) struct Controller {
    state: StateReader,
    operator: OperatorReader,
    cycle: Pulse,
    beat: Pulse,
    opened: Instant,
    /// Its run folder, if it has one, and what lies there.
    pub facts: Facts,
    /// Where a page's requests go: open already, because to open it takes some tenths of a
    /// second, which a stop must not wait for.
    pub requests: Option<RpcClient<ControllerRpc>>,
}

/// What a controller shows at one moment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    pub state: ControllerState,
    /// Whether its cycles go on.
    pub alive: bool,
    /// Whether an operator's program gives signs of life.
    pub operator: bool,
}

impl Controller {
    fn open(bus: &Bus, run: Option<&Path>) -> Result<Self, IpcError> {
        // What opens after this is alive.
        bus.remove_leftovers();
        let state = StateReader::open(bus)?;
        let operator = OperatorReader::open(bus)?;
        let now = state.get();
        let folder = run
            .map(Path::to_owned)
            .or_else(|| folder_of_process(now.pid));
        Ok(Self {
            cycle: Pulse::new(now.cycle),
            beat: Pulse::new(operator.get().count),
            state,
            operator,
            opened: Instant::now(),
            facts: Facts::of(folder),
            requests: None,
        })
    }

    /// Whether it has not ended: its process is there, or its cycles go on. A blackboard is there
    /// for as long as somebody reads it, also when its controller is not.
    fn lives(&mut self) -> bool {
        let state = self.state.get();
        if Path::new(&format!("/proc/{}", state.pid)).exists() {
            return true;
        }
        std::thread::sleep(BEAT);
        self.state.get().cycle != state.cycle
    }

    fn look(&mut self) -> Seen {
        let state = self.state.get();
        let alive = self.cycle.beats(state.cycle, SILENCE);
        let beat = self.operator.get().count;
        Seen {
            state,
            alive: alive || self.opened.elapsed() < SILENCE,
            operator: self.beat.beats(beat, OPERATOR_SILENCE),
        }
    }
}

/// One domain, and the controller that runs there. Fields are dropped in order: readers,
/// connection, sweep.
#[derive(Debug)]
pub struct Joined {
    pub(crate) controller: Option<Controller>,
    bus: Bus,
    _sweep: DomainSweep,
    pub(crate) domain: String,
}

impl Joined {
    /// Joins a domain, whether a controller runs there yet or not.
    ///
    /// # Errors
    /// The domain has no valid name, or shared memory cannot be used.
    pub fn join(domain: &str) -> Result<Self, IpcError> {
        let sweep = DomainSweep::new(domain);
        Ok(Self {
            controller: None,
            bus: Bus::join(domain)?,
            _sweep: sweep,
            domain: domain.to_owned(),
        })
    }

    /// The connection.
    pub fn bus(&self) -> &Bus {
        &self.bus
    }

    /// Whether a controller runs there. One that has ended is let go; one that is new is found
    /// when `search` says to look, and so is what its folder tells: the one named, or else its
    /// own.
    pub fn has_controller(&mut self, search: bool, run: Option<&Path>) -> bool {
        let there = self.look(search, run).is_some();
        if let Some(controller) = self.controller.as_mut().filter(|_| search) {
            controller.facts.look();
        }
        there
    }

    /// The process of the controller.
    pub fn pid(&self) -> Option<u32> {
        let controller = self.controller.as_ref()?;
        Some(controller.state.get().pid)
    }

    /// What the folder of the controller's run tells.
    pub fn facts(&self) -> Option<&Facts> {
        self.controller.as_ref().map(|controller| &controller.facts)
    }

    fn look(&mut self, search: bool, run: Option<&Path>) -> Option<Seen> {
        if self.controller.is_none() && search {
            let found = Controller::open(&self.bus, run).ok();
            self.controller = found.and_then(|mut found| found.lives().then_some(found));
        }
        let seen = self.controller.as_mut()?.look();
        let gone = !seen.alive && !Path::new(&format!("/proc/{}", seen.state.pid)).exists();
        if gone {
            self.controller = None;
            return None;
        }
        Some(seen)
    }
}

/// One domain with what the page shows of it. Fields are dropped in order: readers, connection.
#[derive(Debug)]
pub(crate) struct Attached {
    /// Its cycles; `None` where too many listen already.
    pub cycles: Option<CycleSubscriber>,
    /// Joints as measured.
    pub joints: Option<JointSubscriber>,
    pub film: Option<Film>,
    pub joined: Joined,
}

/// One that cannot be opened is warned of and done without.
fn opened_or_warned<T, E: Into<anyhow::Error>>(what: &str, opened: Result<T, E>) -> Option<T> {
    let said = |error: anyhow::Error| tracing::warn!("the page lacks {what}: {error:#}");
    opened.map_err(|e| said(e.into())).ok()
}

impl Attached {
    /// Joins a domain, whether a controller runs there yet or not.
    pub(crate) fn join(domain: &str) -> Result<Self, IpcError> {
        let joined = Joined::join(domain)?;
        let bus = joined.bus();
        Ok(Self {
            cycles: opened_or_warned("jitter", bus.cycle_subscriber()),
            joints: opened_or_warned("the rope", bus.joint_subscriber()),
            film: opened_or_warned("the camera", Film::open(bus)),
            joined,
        })
    }

    /// What the controller shows. One that has ended is let go; one that is new is
    /// found when `search` says to look.
    pub(crate) fn look(&mut self, search: bool, run: Option<&Path>) -> Option<Seen> {
        let seen = self.joined.look(search, run)?;
        let controller = self.joined.controller.as_mut()?;
        if controller.requests.is_none() && search {
            controller.requests = RpcClient::open(&self.joined.bus).ok();
        }
        Some(seen)
    }
}

/// The domain whose controller started last.
pub fn newest_domain() -> Option<String> {
    running_controllers()
        .into_iter()
        .filter_map(|domain| {
            let _sweep = DomainSweep::new(&domain);
            let pid = StateReader::open(&Bus::join(&domain).ok()?).ok()?.get().pid;
            Some((started(pid)?, domain))
        })
        .max()
        .map(|(_, domain)| domain)
}

/// When a process started (clock ticks since the machine did).
fn started(pid: u32) -> Option<u64> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The second field is a name in parentheses that may hold anything.
    stat.rsplit_once(')')?
        .1
        .split_whitespace()
        .nth(19)?
        .parse()
        .ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::ipc::{ControllerBoards, OperatorEnd, PAYLOAD_VERSION};

    #[test]
    fn a_controller_is_found_when_it_comes_and_let_go_when_its_process_ended() {
        let domain = format!("test_attached_{}", std::process::id());
        let mut attached = Attached::join(&domain).unwrap();
        assert!(attached.look(true, None).is_none());
        let bus = Bus::join(&domain).unwrap();
        let mut boards = ControllerBoards::create(&bus).unwrap();
        let mut state = ControllerState {
            version: PAYLOAD_VERSION,
            cycle: 5,
            pid: std::process::id(),
            ..ControllerState::default()
        };
        boards.publish(state);
        assert!(attached.look(false, None).is_none(), "not searched for");
        let seen = attached.look(true, None).unwrap();
        assert!(seen.alive && !seen.operator);
        let mut operator = OperatorEnd::take(&bus).unwrap();
        operator.beat();
        state.cycle = 6;
        boards.publish(state);
        let seen = attached.look(false, None).unwrap();
        assert!(seen.alive && seen.operator);
        // Its cycles end, but its process lives: that is shown, not hidden.
        std::thread::sleep(SILENCE + Duration::from_millis(20));
        let seen = attached.look(false, None).unwrap();
        assert!(!seen.alive && !seen.operator);
        state.pid = u32::MAX;
        boards.publish(state);
        assert!(attached.look(false, None).is_none());
        assert!(attached.joined.controller.is_none());
        assert!(attached.look(true, None).is_none(), "only its blackboard");
    }

    #[test]
    fn processes_have_an_age() {
        assert!(started(std::process::id()) > started(1).map(|_| 0));
        assert_eq!(started(u32::MAX), None);
    }
}
