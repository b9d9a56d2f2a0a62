//! What a recording is made of.

use crate::control::{ControlState, Motion};
use serde::{Deserialize, Serialize};
use shared_types::ipc::{CauseRecord, CycleRecord, InputRecord};

/// Version of the program whose core made a recording.
pub const CORE_VERSION: &str = shared_types::VERSION;

/// One cycle: its inputs and outputs. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct RecordedCycle {
    /// Its inputs.
    pub input: InputRecord,
    /// Its outputs.
    pub record: CycleRecord,
}

/// Longest snapshot (bytes).
pub(super) const SNAPSHOT_MAX: usize = 16 * 1024;

/// The core's state before a cycle as bytes, the running motion only named.
/// Fixed size, for a ring; RT-safe to copy.
#[derive(Debug, Clone, Copy)]
pub struct Snapshot {
    /// Cycle that comes next.
    pub next_cycle: u64,
    len: u16,
    bytes: [u8; SNAPSHOT_MAX],
}

impl Snapshot {
    /// The state as it is now; `None` when it does not fit, which a test
    /// excludes. RT-safe.
    #[must_use]
    pub fn of(control: &ControlState) -> Option<Self> {
        let mut bytes = [0; SNAPSHOT_MAX];
        let len = control.write_to(&mut bytes)?;
        Some(Self {
            next_cycle: control.cycle().wrapping_add(1),
            len: u16::try_from(len).ok()?,
            bytes,
        })
    }

    /// The bytes.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or_default()
    }
}

/// Where a replay can begin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Keyframe {
    /// [`CORE_VERSION`] of the program that wrote it.
    pub core: String,
    /// Cycle that comes next.
    pub next_cycle: u64,
    /// The core's state before it: limits, thresholds and all it remembers.
    pub state: Vec<u8>,
    /// The motions handed over last, by number: one may run, one may begin next.
    pub motions: Vec<(u64, Box<Motion>)>,
}

impl Keyframe {
    /// The state, ready to be stepped; `None` when it cannot be read.
    #[must_use]
    pub fn state(&self) -> Option<ControlState> {
        ControlState::read_from(&self.state, |id, hash| self.motion(id, hash))
    }

    fn motion(&self, id: u64, hash: u64) -> Option<Box<Motion>> {
        self.motions
            .iter()
            .find(|(n, motion)| *n == id && motion.fingerprint() == hash)
            .map(|(_, motion)| motion.clone())
    }
}

/// One thing in a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Item {
    /// Where a replay can begin.
    Keyframe(Box<Keyframe>),
    /// A motion, before the cycle that begins it.
    Motion {
        /// Number that commands name it by.
        id: u64,
        /// All of it.
        motion: Box<Motion>,
    },
    /// A cycle.
    Cycle(Box<RecordedCycle>),
    /// Why the arm was stopped; comes within some cycles of the stop.
    Cause(Box<CauseRecord>),
}

impl Item {
    /// An item of layout 1 in today's: only states were written otherwise. One that cannot
    /// be read is left out, so that [`Keyframe::state`] gives none either.
    pub(super) fn into_layout_2(mut self) -> Self {
        if let Self::Keyframe(keyframe) = &mut self {
            let state =
                ControlState::read_layout_1(&keyframe.state, |id, hash| keyframe.motion(id, hash));
            keyframe.state = state
                .and_then(|state| Snapshot::of(&state))
                .map_or_else(Vec::new, |snapshot| snapshot.as_bytes().to_vec());
        }
        self
    }
}
