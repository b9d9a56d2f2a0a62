//! A learned tracker of points.
//!
//! A film is longer than what such a network sees at once: it is looked at in chunks
//! that share frames. A point goes on from that shared frame in which the chunk
//! before saw it best.

use std::path::Path;

use super::graph::Axis::{Is, Named};
use super::graph::{Graph, Wanted};
use super::picture::{append_planes, place_in, size_of};
use crate::frame::ImageFrame;
use crate::track::{ModelError, PointTracker, SeenPoint};

const FRAMES: Wanted = Wanted {
    name: "frames",
    axes: &[Is(1), Named("T"), Is(3), Named("H"), Named("W")],
};
const QUERIES: Wanted = Wanted {
    name: "queries",
    axes: &[Is(1), Named("N"), Is(3)],
};
const TRACKS: Wanted = Wanted {
    name: "tracks",
    axes: &[Is(1), Named("T"), Named("N"), Is(2)],
};
const VISIBILITY: Wanted = Wanted {
    name: "visibility",
    axes: &[Is(1), Named("T"), Named("N")],
};

/// Frames of a chunk where the graph takes any number: 73 MB of 672x376.
const CHUNK: usize = 24;
/// Of a chunk's frames this part is shared with the next one.
const SHARED: usize = 4;
/// Fewest frames of a chunk, and fewest points that make a rope.
const MIN_FRAMES: usize = 2;
const MIN_POINTS: usize = 4;

/// A tracker from an ONNX file (inputs and outputs: `docs/src/camera.md`).
#[derive(Debug)]
pub struct OnnxTracker {
    graph: Graph,
}

/// Where a point is looked for from: frame of the film, raw pixel.
type Query = (usize, [f64; 2]);

impl OnnxTracker {
    /// Loads a file.
    ///
    /// # Errors
    /// The reason why the file is not used.
    pub fn load(path: &Path) -> Result<Self, ModelError> {
        let graph = Graph::load(path, &[FRAMES, QUERIES], &[TRACKS, VISIBILITY])?;
        let too_few = |wanted: &Wanted, axis: &str, least: usize| {
            let found = graph.fixed(axis).filter(|found| *found < least)?;
            let form = |length: &dyn core::fmt::Display| format!("of {axis} = {length}");
            let least = format!("{least} or more");
            Some(graph.unfit("input", wanted.name, &form(&found), &form(&least)))
        };
        let refused =
            too_few(&FRAMES, "T", MIN_FRAMES).or_else(|| too_few(&QUERIES, "N", MIN_POINTS));
        match refused {
            Some(error) => Err(error),
            None => Ok(Self { graph }),
        }
    }

    /// Hash of the file (SHA-256, hexadecimal).
    #[must_use]
    pub fn sha256(&self) -> &str {
        self.graph.sha256()
    }

    /// Frames of a chunk of a film.
    fn chunk(&self, film: usize) -> usize {
        self.graph.fixed("T").unwrap_or_else(|| CHUNK.min(film))
    }

    /// Follows points through the chunk of frames that begins at `start`.
    fn look(
        &mut self,
        frames: &[ImageFrame],
        start: usize,
        queries: &[Query],
    ) -> Result<Vec<Vec<SeenPoint>>, ModelError> {
        let (length, count) = (self.chunk(frames.len()), queries.len());
        let film = size_of(&frames[0]);
        let size = self.graph.size(film);
        let mut pictures = Vec::with_capacity(length * 3 * size[0] * size[1]);
        for at in start..start + length {
            // A film shorter than a chunk stands still at its end.
            append_planes(&frames[at.min(frames.len() - 1)], size, &mut pictures);
        }
        let requested: Vec<f32> = queries
            .iter()
            .flat_map(|(frame, pixel)| {
                let [x, y] = place_in(*pixel, film, size);
                [(frame - start) as f32, x as f32, y as f32]
            })
            .collect();
        let inputs = [
            (
                FRAMES.name,
                vec![1, length, 3, size[1], size[0]],
                &pictures[..],
            ),
            (QUERIES.name, vec![1, count, 3], &requested),
        ];
        let outputs = [
            (TRACKS.name, vec![1, length, count, 2]),
            (VISIBILITY.name, vec![1, length, count]),
        ];
        let [tracks, visibility] = self.graph.run(&inputs, outputs)?;
        let seen = tracks.chunks_exact(2).zip(&visibility).map(|(p, v)| {
            let pixel = [f64::from(p[0]), f64::from(p[1])];
            SeenPoint {
                pixel: place_in(pixel, size, film),
                visible: f64::from(*v).clamp(0.0, 1.0),
            }
        });
        let seen: Vec<SeenPoint> = seen.collect();
        Ok(seen.chunks_exact(count).map(<[_]>::to_vec).collect())
    }
}

/// First frames of the chunks of a film: each shares frames with the one before, the
/// last ends with the film.
fn starts(film: usize, chunk: usize) -> Vec<usize> {
    let last = film.saturating_sub(chunk);
    let step = chunk - (chunk / SHARED).max(1);
    let mut starts: Vec<usize> = (0..last).step_by(step).collect();
    starts.push(last);
    starts
}

impl PointTracker for OnnxTracker {
    fn points(&self) -> Option<usize> {
        self.graph.fixed("N")
    }

    fn follow(
        &mut self,
        frames: &[ImageFrame],
        points: &[[f64; 2]],
    ) -> Result<Vec<Vec<SeenPoint>>, ModelError> {
        let mut queries: Vec<Query> = points.iter().map(|p| (0, *p)).collect();
        let mut tracks: Vec<Vec<SeenPoint>> = Vec::new();
        for start in starts(frames.len(), self.chunk(frames.len())) {
            let shared = tracks.len() - start;
            for (point, query) in queries.iter_mut().enumerate() {
                let best = (start..start + shared).max_by(|&a, &b| {
                    let visible = |frame: usize| tracks[frame][point].visible;
                    visible(a).total_cmp(&visible(b))
                });
                if let Some(frame) = best {
                    *query = (frame, tracks[frame][point].pixel);
                }
            }
            let seen = self.look(frames, start, &queries)?;
            let left = frames.len() - tracks.len();
            tracks.extend(seen.into_iter().skip(shared).take(left));
        }
        Ok(tracks)
    }
}

#[cfg(test)]
mod tests {
    use super::starts;

    #[test]
    fn chunks_share_frames_and_end_with_the_film() {
        assert_eq!(starts(24, 24), [0]);
        assert_eq!(starts(10, 24), [0]);
        assert_eq!(starts(25, 24), [0, 1]);
        assert_eq!(starts(60, 24), [0, 18, 36]);
        assert_eq!(starts(61, 24), [0, 18, 36, 37]);
        assert_eq!(starts(3, 2), [0, 1]);
    }
}
