//! The recorder of control cycles: every cycle's inputs and outputs.
//!
//! ```text
//!  control loop --ring--> bridge: items -> chunks --pub-sub--> recorder: file
//!                                                              |
//!                                    same bytes, chunk by chunk, in RUN/run.mcap
//! ```
//!
//! A recording is a row of [`chunk`]s, each with a checksum, so that a file cut
//! anywhere reads up to its last whole chunk. A chunk holds [`Item`]s. Once a
//! second one begins with a [`Keyframe`], the whole state of the core before the
//! next cycle: from there [`replay()`] steps the core over the recorded inputs
//! again and compares, bit by bit. Keyframes also let a recorder attach late and
//! a reader go on behind a gap.
//!
//! The loop only pushes fixed-size values into rings; all else is the bridge's.

pub mod chunk;
pub mod compare;
mod found;
mod item;
mod log;
pub mod replay;
mod writer;

pub use found::{Difference, Gap, Replay, ReplayError};
pub use item::{CORE_VERSION, Item, Keyframe, RecordedCycle, Snapshot};
pub use log::{Flaw, LogError, LogReader, Read};
pub use replay::replay;
pub use writer::ChunkWriter;
