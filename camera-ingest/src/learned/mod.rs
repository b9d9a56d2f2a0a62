//! A learned tracker of points from an ONNX file.
//!
//! [`OnnxTracker`] is a [`PointTracker`](crate::track::PointTracker). Names, types and
//! shapes of its inputs and outputs are checked when a file is loaded; sizes that a graph
//! fixes are kept (pictures are scaled to them), sizes that it leaves open are those of
//! the film.

mod graph;
mod picture;
mod tracker;

pub use tracker::OnnxTracker;
