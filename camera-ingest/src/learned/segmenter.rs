//! A learned mask of the first frame.

use std::path::Path;

use super::graph::Axis::{Is, Named};
use super::graph::{Graph, Wanted};
use super::picture::{Size, append_planes, place_in, scaled, size_of};
use crate::track::{FirstMask, FirstScene, ModelError};

const IMAGE: Wanted = Wanted {
    name: "image",
    axes: &[Is(1), Is(3), Named("H"), Named("W")],
};
const POINTS: Wanted = Wanted {
    name: "points",
    axes: &[Is(1), Named("P"), Is(2)],
};
const LABELS: Wanted = Wanted {
    name: "labels",
    axes: &[Is(1), Named("P")],
};
const MASK: Wanted = Wanted {
    name: "mask",
    axes: &[Is(1), Is(1), Named("H"), Named("W")],
};

/// Label of a point on the rope, and of none.
const ON_ROPE: f32 = 1.0;
const NO_POINT: f32 = -1.0;

/// A segmenter from an ONNX file (inputs and outputs: `docs/src/camera.md`).
#[derive(Debug)]
pub struct OnnxSegmenter {
    graph: Graph,
}

impl OnnxSegmenter {
    /// Loads a file.
    ///
    /// # Errors
    /// The reason why the file is not used.
    pub fn load(path: &Path) -> Result<Self, ModelError> {
        let graph = Graph::load(path, &[IMAGE, POINTS, LABELS], &[MASK])?;
        Ok(Self { graph })
    }

    /// Hash of the file (SHA-256, hexadecimal).
    #[must_use]
    pub fn sha256(&self) -> &str {
        self.graph.sha256()
    }
}

/// Clamp and lead as prompts, filled up to `count` with points that are none.
fn prompts(scene: &FirstScene<'_>, size: Size, count: Option<usize>) -> (Vec<f32>, Vec<f32>) {
    let known = [Some(scene.clamp_px), scene.lead_px];
    let known: Vec<[f64; 2]> = known.into_iter().flatten().collect();
    let count = count.unwrap_or(known.len());
    let (mut points, mut labels) = (vec![0.0; 2 * count], vec![NO_POINT; count]);
    for ((point, label), pixel) in points.chunks_mut(2).zip(&mut labels).zip(known) {
        let place = place_in(pixel, size_of(scene.frame), size);
        (point[0], point[1]) = (place[0] as f32, place[1] as f32);
        *label = ON_ROPE;
    }
    (points, labels)
}

impl FirstMask for OnnxSegmenter {
    fn mask(&mut self, scene: &FirstScene<'_>) -> Result<Vec<bool>, ModelError> {
        let frame = size_of(scene.frame);
        let size = self.graph.size(frame);
        let mut image = Vec::with_capacity(3 * size[0] * size[1]);
        append_planes(scene.frame, size, &mut image);
        let (points, labels) = prompts(scene, size, self.graph.fixed("P"));
        let count = labels.len();
        let inputs = [
            (IMAGE.name, vec![1, 3, size[1], size[0]], &image[..]),
            (POINTS.name, vec![1, count, 2], &points),
            (LABELS.name, vec![1, count], &labels),
        ];
        let [logits] = self
            .graph
            .run(&inputs, [(MASK.name, vec![1, 1, size[1], size[0]])])?;
        let logits = if size == frame {
            logits
        } else {
            scaled(&logits, size, frame)
        };
        Ok(logits.iter().map(|logit| *logit > 0.0).collect())
    }
}
