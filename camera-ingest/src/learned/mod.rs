//! Learned models from ONNX files, in the place of parts of the tracker.
//!
//! [`OnnxSegmenter`] is a [`FirstMask`](crate::track::FirstMask), [`OnnxTracker`] a
//! [`PointTracker`](crate::track::PointTracker). Names, types and shapes of their inputs
//! and outputs are checked when a file is loaded; sizes that a graph fixes are kept
//! (pictures are scaled to them), sizes that it leaves open are those of the film.

mod graph;
mod picture;
mod segmenter;
mod tracker;

pub use segmenter::OnnxSegmenter;
pub use tracker::OnnxTracker;
