//! Blackboards of one value: the newest, without allocation or system calls on either side
//! once opened. A writer may be killed.
//!
//! The library marks an entry as taken for as long as its writer lives, and a
//! writer that is killed takes the mark with it into the grave. A blackboard whose writers
//! change therefore has several entries: whoever writes next takes the first
//! that is free, and the reader takes the entry with the largest count.

use super::bus::{Transport, open_error};
use super::payload::{ControllerState, GuardianBeat, OperatorBeat};
use super::{Bus, IpcError};
use core::fmt;
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::ZeroCopySend;
use iceoryx2::service::port_factory::blackboard::PortFactory;

/// Key of an entry of a blackboard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, ZeroCopySend)]
#[repr(C)]
pub(super) struct Key(u32);

/// What a blackboard holds; it counts up with every write.
pub trait Board:
    ZeroCopySend + Copy + Default + PartialEq + fmt::Debug + Send + Sync + 'static
{
    /// Service of the blackboard.
    const NAME: &'static str;
    /// Entries: as many writers may be killed while one controller lives, less one.
    const ENTRIES: u32;
    /// Its count.
    fn count(&self) -> u64;
}

impl Board for ControllerState {
    const NAME: &'static str = "wag/v1/controller/state";
    // Its writer, the controller, makes the blackboard itself.
    const ENTRIES: u32 = 1;
    fn count(&self) -> u64 {
        self.cycle
    }
}

impl Board for OperatorBeat {
    const NAME: &'static str = "wag/v1/controller/operator";
    const ENTRIES: u32 = 32;
    fn count(&self) -> u64 {
        self.count
    }
}

impl Board for GuardianBeat {
    const NAME: &'static str = "wag/v1/controller/guardian";
    const ENTRIES: u32 = 32;
    fn count(&self) -> u64 {
        self.count
    }
}

/// Creates the blackboard; there is one creator per domain.
pub(super) fn create<T: Board>(
    bus: &Bus,
    value: T,
) -> Result<PortFactory<Transport, Key>, IpcError> {
    let mut creator = bus
        .service(T::NAME)?
        .blackboard_creator::<Key>()
        .max_readers(8)
        .max_nodes(8);
    for k in 0..T::ENTRIES {
        creator = creator.add::<T>(Key(k), value);
    }
    creator.create().map_err(open_error(T::NAME))
}

// These two are not generic, so that the library's part of them is compiled once, in this crate.

fn opened(bus: &Bus, name: &'static str) -> Result<PortFactory<Transport, Key>, IpcError> {
    let opener = bus.service(name)?.blackboard_opener::<Key>();
    opener.open().map_err(open_error(name))
}

fn reader_of(
    service: &PortFactory<Transport, Key>,
    name: &'static str,
) -> Result<Reader<Transport, Key>, IpcError> {
    let reader = service.reader_builder().create();
    reader.map_err(open_error(name))
}

/// Reads a blackboard of a running controller.
pub struct BoardReader<T: Board> {
    entries: Vec<EntryHandle<Transport, Key, T>>,
    _keep: Reader<Transport, Key>,
}

impl<T: Board> fmt::Debug for BoardReader<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct(T::NAME).finish_non_exhaustive()
    }
}

impl<T: Board> BoardReader<T> {
    /// Opens the blackboard.
    ///
    /// # Errors
    /// [`IpcError::Open`] when there is no controller in this domain.
    pub fn open(bus: &Bus) -> Result<Self, IpcError> {
        Self::of(&opened(bus, T::NAME)?)
    }

    pub(super) fn of(service: &PortFactory<Transport, Key>) -> Result<Self, IpcError> {
        let reader = reader_of(service, T::NAME)?;
        let entries: Result<_, _> = (0..T::ENTRIES).map(|k| reader.entry(&Key(k))).collect();
        Ok(Self {
            entries: entries.map_err(open_error(T::NAME))?,
            _keep: reader,
        })
    }

    /// The value written last. RT-safe.
    #[must_use]
    pub fn get(&self) -> T {
        let values = self.entries.iter().map(|entry| *entry.get());
        let newer = |a: T, b: T| if b.count() > a.count() { b } else { a };
        values.reduce(newer).unwrap_or_default()
    }
}

/// The writer's end: one entry.
pub(super) struct Place<T: Board> {
    entry: EntryHandleMut<Transport, Key, T>,
    _keep: Writer<Transport, Key>,
}

impl<T: Board> fmt::Debug for Place<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct(T::NAME).finish_non_exhaustive()
    }
}

impl<T: Board> Place<T> {
    /// Takes the writer's place, and the value written last. There is one living
    /// writer at a time.
    pub(super) fn take(bus: &Bus) -> Result<(Self, T), IpcError> {
        bus.remove_leftovers();
        let service = opened(bus, T::NAME)?;
        let before = BoardReader::of(&service)?.get();
        Ok((Self::of(&service)?, before))
    }

    pub(super) fn of(service: &PortFactory<Transport, Key>) -> Result<Self, IpcError> {
        let writer = service.writer_builder().create();
        let writer = writer.map_err(open_error(T::NAME))?;
        let entry = (0..T::ENTRIES)
            .find_map(|k| writer.entry(&Key(k)).ok())
            .ok_or_else(|| IpcError::Open {
                service: T::NAME,
                reason: format!(
                    "all {} places were left by killed programs; restart the controller",
                    T::ENTRIES
                ),
            })?;
        Ok(Self {
            entry,
            _keep: writer,
        })
    }

    /// Writes. RT-safe.
    pub(super) fn write(&self, value: T) {
        self.entry.update_with_copy(value);
    }
}
