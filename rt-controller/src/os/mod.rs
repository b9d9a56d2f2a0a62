//! The operating system: clock, scheduling, memory. The only unsafe code of
//! the crate, each block with its reason; Linux only.
#![allow(unsafe_code, reason = "system calls without a safe wrapper")]

pub mod clock;
pub mod process;
pub mod receive;
mod room;
pub mod schedule;

pub use clock::{Clock, MonotonicClock, now_ns};
pub use room::shared_memory_free_mb;
pub use schedule::{RealTimeSettings, enter_real_time};
