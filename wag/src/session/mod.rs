//! A running set of processes: started, watched, recorded, ended together.

mod live;
mod recorder;
mod supervisor;

pub use live::{Session, interrupted, watch_interrupts};
pub use recorder::Recorder;
pub use supervisor::{ProcessSpec, Supervisor};
