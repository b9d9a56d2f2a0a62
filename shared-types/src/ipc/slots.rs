//! Blackboards whose writer may be killed.
//!
//! The library marks an entry as taken for as long as its writer lives, and a
//! writer that is killed takes the mark with it into the grave. A blackboard of
//! this kind therefore has several entries: whoever writes next takes the first
//! that is free, and the reader takes the entry with the largest count.

use super::bus::{Transport, open_error};
use super::payload::{GuardianBeat, OperatorBeat};
use super::{Bus, IpcError};
use iceoryx2::port::reader::{EntryHandle, Reader};
use iceoryx2::port::writer::{EntryHandleMut, Writer};
use iceoryx2::prelude::ZeroCopySend;
use iceoryx2::service::port_factory::blackboard::PortFactory;

/// Entries: as many writers may be killed while one controller lives, less one.
const SLOTS: u32 = 32;

/// Key of an entry of a blackboard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, ZeroCopySend)]
#[repr(C)]
pub(super) struct Key(pub(super) u32);

fn opened(bus: &Bus, name: &'static str) -> Result<PortFactory<Transport, Key>, IpcError> {
    bus.service(name)?
        .blackboard_opener::<Key>()
        .open()
        .map_err(open_error(name))
}

/// A reader of a blackboard that exists.
pub(super) fn reader_of(bus: &Bus, name: &'static str) -> Result<Reader<Transport, Key>, IpcError> {
    let reader = opened(bus, name)?.reader_builder().create();
    reader.map_err(open_error(name))
}

/// A value that counts up with every write.
pub(super) trait Beat:
    ZeroCopySend + Copy + Default + PartialEq + core::fmt::Debug + Send + Sync + 'static
{
    /// Its count.
    fn count(&self) -> u64;
}

impl Beat for OperatorBeat {
    fn count(&self) -> u64 {
        self.count
    }
}

impl Beat for GuardianBeat {
    fn count(&self) -> u64 {
        self.count
    }
}

/// The reader's end.
pub(super) struct Slots<T: Beat> {
    entries: Vec<EntryHandle<Transport, Key, T>>,
    _keep: Reader<Transport, Key>,
}

impl<T: Beat> Slots<T> {
    pub(super) fn read(
        reader: Reader<Transport, Key>,
        name: &'static str,
    ) -> Result<Self, IpcError> {
        let entries: Result<_, _> = (0..SLOTS).map(|k| reader.entry(&Key(k))).collect();
        Ok(Self {
            entries: entries.map_err(open_error(name))?,
            _keep: reader,
        })
    }

    /// The value written last. RT-safe.
    pub(super) fn newest(&self) -> T {
        let mut newest = T::default();
        for entry in &self.entries {
            let value = *entry.get();
            if value.count() > newest.count() {
                newest = value;
            }
        }
        newest
    }
}

/// Creates the blackboard; there is one creator per domain.
pub(super) fn create_slots<T: Beat>(bus: &Bus, name: &'static str) -> Result<Slots<T>, IpcError> {
    let mut creator = bus
        .service(name)?
        .blackboard_creator::<Key>()
        .max_readers(8)
        .max_nodes(8);
    for k in 0..SLOTS {
        creator = creator.add::<T>(Key(k), T::default());
    }
    let service = creator.create().map_err(open_error(name))?;
    let reader = service
        .reader_builder()
        .create()
        .map_err(open_error(name))?;
    Slots::read(reader, name)
}

/// The writer's end: one entry.
pub(super) struct Place<T: Beat> {
    entry: EntryHandleMut<Transport, Key, T>,
    _keep: Writer<Transport, Key>,
}

impl<T: Beat> core::fmt::Debug for Place<T> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Place").finish_non_exhaustive()
    }
}

impl<T: Beat> Place<T> {
    /// Takes the writer's place, and the value written last. There is one living
    /// writer at a time.
    pub(super) fn take(bus: &Bus, name: &'static str) -> Result<(Self, T), IpcError> {
        bus.remove_leftovers();
        let before = Slots::read(reader_of(bus, name)?, name)?.newest();
        let writer = opened(bus, name)?
            .writer_builder()
            .create()
            .map_err(open_error(name))?;
        let entry = (0..SLOTS)
            .find_map(|k| writer.entry(&Key(k)).ok())
            .ok_or_else(|| IpcError::Open {
                service: name,
                reason: format!(
                    "all {SLOTS} places were left by killed programs; restart the controller"
                ),
            })?;
        let place = Self {
            entry,
            _keep: writer,
        };
        Ok((place, before))
    }

    /// Writes. RT-safe.
    pub(super) fn write(&self, value: T) {
        self.entry.update_with_copy(value);
    }
}
