//! The ends of the blackboards between the real-time thread and the rest.

use super::payload::{ControllerState, GuardianBeat, OperatorBeat, PAYLOAD_VERSION};
use super::slots::{BoardReader, Place, create};
use super::{Bus, IpcError};

/// Reads the controller's state.
pub type StateReader = BoardReader<ControllerState>;
/// Sees whether somebody has the operator's place, without taking it: the count of the
/// heartbeat stands still when there is no operator.
pub type OperatorReader = BoardReader<OperatorBeat>;

/// The controller's end: writes its state, reads the heartbeats of operator and
/// guardian. Open it in the real-time thread before the loop; then all calls
/// are RT-safe.
#[derive(Debug)]
pub struct ControllerBoards {
    state: Place<ControllerState>,
    operator: BoardReader<OperatorBeat>,
    guardian: BoardReader<GuardianBeat>,
}

impl ControllerBoards {
    /// Creates the blackboards of the domain. There is one controller.
    ///
    /// # Errors
    /// [`IpcError::Open`], for instance when another controller runs.
    pub fn create(bus: &Bus) -> Result<Self, IpcError> {
        let state = ControllerState {
            version: PAYLOAD_VERSION,
            ..ControllerState::default()
        };
        Ok(Self {
            state: Place::of(&create(bus, state)?)?,
            operator: BoardReader::of(&create(bus, OperatorBeat::default())?)?,
            guardian: BoardReader::of(&create(bus, GuardianBeat::default())?)?,
        })
    }

    /// Writes the newest state. RT-safe.
    pub fn publish(&mut self, state: ControllerState) {
        self.state.write(state);
    }

    /// Reads the newest heartbeat. RT-safe.
    #[must_use]
    pub fn operator(&self) -> OperatorBeat {
        self.operator.get()
    }

    /// Reads the guardian's newest beat. RT-safe.
    #[must_use]
    pub fn guardian(&self) -> GuardianBeat {
        self.guardian.get()
    }
}

/// The operator's end: proves that somebody watches, and can stop the arm.
#[derive(Debug)]
pub struct OperatorEnd {
    place: Place<OperatorBeat>,
    last: OperatorBeat,
}

impl OperatorEnd {
    /// Takes the operator's place in a running controller's domain. There is
    /// one operator at a time; one that was killed leaves its place free. What the one
    /// before asked for or let go of is not this one's.
    ///
    /// # Errors
    /// [`IpcError::Open`] when there is no controller or the place is taken.
    pub fn take(bus: &Bus) -> Result<Self, IpcError> {
        let (place, before) = Place::<OperatorBeat>::take(bus)?;
        let last = OperatorBeat {
            version: PAYLOAD_VERSION,
            stop: 0,
            released: 0,
            ..before
        };
        Ok(Self { place, last })
    }

    /// One sign of life; call it at least ten times a second while the arm moves.
    pub fn beat(&mut self) {
        self.last.count = self.last.count.wrapping_add(1);
        self.place.write(self.last);
    }

    /// Asks for a stop, at once and for good.
    pub fn stop(&mut self) {
        self.last.stop = 1;
        self.beat();
    }

    /// The dead-man switch was let go: a motion that runs is braked.
    pub fn let_go(&mut self) {
        self.last.released = 1;
        self.beat();
    }

    /// The dead-man switch is held again.
    pub fn hold(&mut self) {
        self.last.released = 0;
        self.beat();
    }

    /// Withdraws the stop, so that it can be acknowledged.
    pub fn release_stop(&mut self) {
        self.last.stop = 0;
        self.beat();
    }
}

/// The guardian's end: proves that somebody would stop the arm if the
/// controller could not.
#[derive(Debug)]
pub struct GuardianEnd {
    place: Place<GuardianBeat>,
    count: u64,
}

impl GuardianEnd {
    /// Takes the guardian's place in a running controller's domain. There is
    /// one guardian at a time.
    ///
    /// # Errors
    /// [`IpcError::Open`] when there is no controller or the place is taken.
    pub fn take(bus: &Bus) -> Result<Self, IpcError> {
        let (place, before) = Place::<GuardianBeat>::take(bus)?;
        Ok(Self {
            place,
            count: before.count,
        })
    }

    /// One sign of life; version and count of `beat` are set here. RT-safe.
    pub fn beat(&mut self, beat: GuardianBeat) {
        self.count = self.count.wrapping_add(1);
        self.place.write(GuardianBeat {
            version: PAYLOAD_VERSION,
            count: self.count,
            ..beat
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ipc::ControllerMode;

    #[test]
    fn newest_values_cross_both_ways_and_the_operator_can_change() {
        let bus = Bus::join(&format!("test_boards_{}", std::process::id())).unwrap();
        assert!(StateReader::open(&bus).is_err());
        let mut controller = ControllerBoards::create(&bus).unwrap();
        assert!(
            ControllerBoards::create(&bus).is_err(),
            "one controller only"
        );
        let reader = StateReader::open(&bus).unwrap();
        let state = ControllerState {
            version: PAYLOAD_VERSION,
            mode: ControllerMode::Moving as u8,
            cycle: 9,
            ..ControllerState::default()
        };
        controller.publish(state);
        assert_eq!(reader.get(), state);
        let mut operator = OperatorEnd::take(&bus).unwrap();
        assert!(OperatorEnd::take(&bus).is_err(), "one operator only");
        let watcher = OperatorReader::open(&bus).unwrap();
        operator.beat();
        operator.stop();
        assert_eq!(watcher.get(), controller.operator());
        assert_eq!(
            (controller.operator().count, controller.operator().stop),
            (2, 1)
        );
        let mut guardian = GuardianEnd::take(&bus).unwrap();
        guardian.beat(GuardianBeat {
            stamp_ns: 77,
            ..GuardianBeat::default()
        });
        assert_eq!(
            (controller.guardian().count, controller.guardian().stamp_ns),
            (1, 77)
        );
        drop(operator);
        let mut next = OperatorEnd::take(&bus).unwrap();
        next.beat();
        assert_eq!(
            (controller.operator().count, controller.operator().stop),
            (3, 0)
        );
    }

    /// Set for the child that is to be killed while it holds the operator's place.
    const DOMAIN: &str = "WAG_TEST_OPERATOR_OF";

    /// Not a test by itself: the child of the next one.
    #[test]
    fn an_operator_that_waits_to_be_killed() {
        let Ok(domain) = std::env::var(DOMAIN) else {
            return;
        };
        let bus = Bus::join(&domain).unwrap();
        let mut operator = OperatorEnd::take(&bus).unwrap();
        loop {
            operator.beat();
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    }

    #[test]
    fn killed_operators_leave_their_place_to_the_next() {
        let domain = format!("test_killed_{}", std::process::id());
        let bus = Bus::join(&domain).unwrap();
        let controller = ControllerBoards::create(&bus).unwrap();
        let mut beats = 0;
        for _ in 0..3 {
            let mut child = std::process::Command::new(std::env::current_exe().unwrap())
                .args([
                    "--exact",
                    "ipc::boards::tests::an_operator_that_waits_to_be_killed",
                ])
                .env(DOMAIN, &domain)
                .stdout(std::process::Stdio::null())
                .spawn()
                .unwrap();
            while controller.operator().count < beats + 3 {
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
            child.kill().unwrap();
            child.wait().unwrap();
            beats = controller.operator().count;
        }
        let mut operator = OperatorEnd::take(&bus).unwrap();
        operator.beat();
        assert_eq!(controller.operator().count, beats + 1);
    }
}
