//! `run.mcap`: a run in one file that Foxglove and PlotJuggler show.
//!
//! A process of its own writes it while the run goes on. It only listens, with low
//! priority: it loses records of its own where it is slow and holds neither the
//! controller nor the camera up. The file grows by whole chunks, so that of a killed recorder's file
//! everything but the last second is there and [`recover()`] makes it whole.

mod channel;
mod clock;
mod counts;
mod feed;
mod film;
mod image;
mod messages;
mod read;
mod recorder;
mod recover;
mod results;
mod scene;
mod schema;
mod thread;
mod urdf;
mod writer;

pub use channel::{Channel, NamedSchema};
pub use counts::RecordingCounts;
pub use feed::{Feed, Sink, StandingScene};
pub(crate) use film::GAP_NS;
pub use film::{RunFilm, RunPart};
pub use image::left_jpeg;
pub(crate) use read::{Walked, is_mcap, messages, replay_bytes, walk};
pub use recorder::{Recorded, RecorderConfig, run as record};
pub use recover::{Recovered, recover};
pub use results::{LatestResults, RopeMotion, SimulateRope};
pub use thread::RunFileThread;
pub use writer::McapFile;
