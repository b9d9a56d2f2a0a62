//! Blackboards between the real-time thread and the rest: the newest value,
//! without allocation or system calls on either side once opened.

use super::bus::{Transport, open_error};
use super::payload::{ControllerState, OperatorBeat, PAYLOAD_VERSION};
use super::{Bus, IpcError};
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::blackboard::PortFactory;

const STATE: &str = "wag/v1/controller/state";
const OPERATOR: &str = "wag/v1/controller/operator";

/// The single key of each blackboard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, ZeroCopySend)]
#[repr(C)]
struct Key(u32);

const KEY: Key = Key(0);

/// The controller's end: writes its state, reads the operator's heartbeat.
/// Open it in the real-time thread before the loop; then both calls are RT-safe.
pub struct ControllerBoards {
    state: EntryHandleMut<Transport, Key, ControllerState>,
    operator: EntryHandle<Transport, Key, OperatorBeat>,
    _keep: (Writer<Transport, Key>, Reader<Transport, Key>),
}

impl core::fmt::Debug for ControllerBoards {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("ControllerBoards").finish_non_exhaustive()
    }
}

impl ControllerBoards {
    /// Creates both blackboards of the domain. There is one controller.
    ///
    /// # Errors
    /// [`IpcError::Open`], for instance when another controller runs.
    pub fn create(bus: &Bus) -> Result<Self, IpcError> {
        let state = bus
            .service(STATE)?
            .blackboard_creator::<Key>()
            .max_readers(8)
            .max_nodes(8)
            .add::<ControllerState>(
                KEY,
                ControllerState {
                    version: PAYLOAD_VERSION,
                    ..ControllerState::default()
                },
            )
            .create()
            .map_err(open_error(STATE))?;
        let operator = bus
            .service(OPERATOR)?
            .blackboard_creator::<Key>()
            .max_readers(8)
            .max_nodes(8)
            .add::<OperatorBeat>(KEY, OperatorBeat::default())
            .create()
            .map_err(open_error(OPERATOR))?;
        let writer = state.writer_builder().create().map_err(open_error(STATE))?;
        let reader = operator
            .reader_builder()
            .create()
            .map_err(open_error(OPERATOR))?;
        Ok(Self {
            state: writer.entry(&KEY).map_err(open_error(STATE))?,
            operator: reader.entry(&KEY).map_err(open_error(OPERATOR))?,
            _keep: (writer, reader),
        })
    }

    /// Writes the newest state. RT-safe.
    pub fn publish(&mut self, state: ControllerState) {
        self.state.update_with_copy(state);
    }

    /// Reads the newest heartbeat. RT-safe.
    #[must_use]
    pub fn operator(&self) -> OperatorBeat {
        *self.operator.get()
    }
}

fn opened(bus: &Bus, name: &'static str) -> Result<PortFactory<Transport, Key>, IpcError> {
    bus.service(name)?
        .blackboard_opener::<Key>()
        .open()
        .map_err(open_error(name))
}

/// Reads the controller's state.
pub struct StateReader {
    state: EntryHandle<Transport, Key, ControllerState>,
    _keep: Reader<Transport, Key>,
}

impl core::fmt::Debug for StateReader {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("StateReader").finish_non_exhaustive()
    }
}

impl StateReader {
    /// Opens the state of a running controller.
    ///
    /// # Errors
    /// [`IpcError::Open`] when there is no controller in this domain.
    pub fn open(bus: &Bus) -> Result<Self, IpcError> {
        let reader = opened(bus, STATE)?
            .reader_builder()
            .create()
            .map_err(open_error(STATE))?;
        Ok(Self {
            state: reader.entry(&KEY).map_err(open_error(STATE))?,
            _keep: reader,
        })
    }

    /// The newest state. RT-safe.
    #[must_use]
    pub fn get(&self) -> ControllerState {
        *self.state.get()
    }
}

/// The operator's end: proves that somebody watches, and can stop the arm.
pub struct OperatorEnd {
    beat: EntryHandleMut<Transport, Key, OperatorBeat>,
    last: OperatorBeat,
    _keep: Writer<Transport, Key>,
}

impl core::fmt::Debug for OperatorEnd {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("OperatorEnd")
            .field("last", &self.last)
            .finish_non_exhaustive()
    }
}

impl OperatorEnd {
    /// Takes the operator's place in a running controller's domain. There is
    /// one operator at a time.
    ///
    /// # Errors
    /// [`IpcError::Open`] when there is no controller or the place is taken.
    pub fn take(bus: &Bus) -> Result<Self, IpcError> {
        let service = opened(bus, OPERATOR)?;
        let before = service
            .reader_builder()
            .create()
            .map_err(open_error(OPERATOR))?
            .entry::<OperatorBeat>(&KEY)
            .map_err(open_error(OPERATOR))?;
        let last = OperatorBeat {
            version: PAYLOAD_VERSION,
            stop: 0,
            ..*before.get()
        };
        let writer = service
            .writer_builder()
            .create()
            .map_err(open_error(OPERATOR))?;
        Ok(Self {
            beat: writer.entry(&KEY).map_err(open_error(OPERATOR))?,
            last,
            _keep: writer,
        })
    }

    /// One sign of life; call it at least ten times a second while the arm moves.
    pub fn beat(&mut self) {
        self.last.count = self.last.count.wrapping_add(1);
        self.beat.update_with_copy(self.last);
    }

    /// Asks for a stop, at once and for good.
    pub fn stop(&mut self) {
        self.last.stop = 1;
        self.beat();
    }

    /// Withdraws the stop, so that it can be acknowledged.
    pub fn release_stop(&mut self) {
        self.last.stop = 0;
        self.beat();
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
        operator.beat();
        operator.stop();
        assert_eq!(
            (controller.operator().count, controller.operator().stop),
            (2, 1)
        );
        drop(operator);
        let mut next = OperatorEnd::take(&bus).unwrap();
        next.beat();
        assert_eq!(
            (controller.operator().count, controller.operator().stop),
            (3, 0)
        );
    }
}
