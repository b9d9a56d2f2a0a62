//! The live preview of the rope: the process that follows it, and what it tells.

mod child;
mod heard;

pub use child::{PreviewChild, PreviewProcess};
pub(crate) use heard::Heard;
