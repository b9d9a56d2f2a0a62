//! The features of a set: what an episode's frames hold, under the names that LeRobot knows.

use super::columns::{Column, Values};
use super::episode::Episode;
use super::statistics::Distribution;
use arm_model::JOINTS;
use serde_json::{Value, json};

/// Where an episode stands in its set.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Number of the episode.
    pub(super) episode: usize,
    /// Number of its first frame in the whole set.
    pub(super) first_frame: usize,
    /// Number of its task.
    pub(super) task: usize,
}

/// A feature of an episode.
#[derive(Debug)]
pub(super) struct Feature {
    /// As `info.json` describes it: type, shape and names.
    pub(super) described: Value,
    /// Its values of all frames, a row each.
    pub(super) column: Column,
    /// The same values without their order, each element apart.
    pub(super) gathered: FeatureValues,
}

/// What the statistics of a feature are made of.
#[derive(Debug, Clone)]
pub(super) struct FeatureValues {
    /// The feature's, as `info.json` has it.
    pub(super) name: String,
    /// Shape of each statistic; the library spreads it over the feature's own.
    pub(super) shape: Vec<usize>,
    /// Values of each element of that shape, in all frames.
    pub(super) values: Vec<Distribution>,
    /// Frames that have the feature.
    pub(super) frames: usize,
}

impl Feature {
    /// Numbers, so many a frame, of which each has statistics of its own.
    fn vector(name: &str, numbers: &[f32], names: &[String]) -> Self {
        let count = names.len();
        Self {
            described: json!({ "dtype": "float32", "shape": [count], "names": names }),
            gathered: FeatureValues::of(name, &[count], numbers, count),
            column: Column::lists(name, &[count], Values::Singles(numbers.to_vec())),
        }
    }

    /// A whole number a frame.
    fn number(name: &str, numbers: impl Iterator<Item = usize>) -> Self {
        // No set has frames enough for the largest numbers.
        let numbers: Vec<i64> = numbers.map(|number| number as i64).collect();
        let values = numbers.iter().map(|number| *number as f64);
        Self {
            described: json!({ "dtype": "int64", "shape": [1], "names": null }),
            gathered: FeatureValues {
                name: name.to_owned(),
                shape: vec![1],
                values: vec![Distribution::of(values)],
                frames: numbers.len(),
            },
            column: Column::single(name, Values::Integers(numbers)),
        }
    }

    /// Time from the first frame (s).
    fn timestamp(frames: usize, fps: u32) -> Self {
        let name = "timestamp";
        let times = (0..frames).map(|frame| (frame as f64 / f64::from(fps)) as f32);
        let times: Vec<f32> = times.collect();
        Self {
            described: json!({ "dtype": "float32", "shape": [1], "names": null }),
            gathered: FeatureValues::of(name, &[1], &times, 1),
            column: Column::single(name, Values::Singles(times)),
        }
    }

    /// Pixels along the rope; the statistics are those of `u` and of `v` of all keypoints.
    fn keypoints(numbers: &[f32], count: usize) -> Self {
        let (name, shape) = ("observation.keypoints", [count, 2]);
        Self {
            described: json!({ "dtype": "float32", "shape": shape, "names": ["keypoint", "u_v"] }),
            gathered: FeatureValues::of(name, &[2], numbers, 2 * count),
            column: Column::lists(name, &shape, Values::Singles(numbers.to_vec())),
        }
    }
}

impl FeatureValues {
    /// Of numbers, so many a frame. A frame without its first number has none.
    fn of(name: &str, shape: &[usize], numbers: &[f32], a_frame: usize) -> Self {
        let elements: usize = shape.iter().product();
        let of_element = |element| {
            let numbers = numbers.iter().skip(element).step_by(elements);
            Distribution::of(numbers.map(|number| f64::from(*number)))
        };
        let frames = numbers.chunks_exact(a_frame);
        Self {
            name: name.to_owned(),
            shape: shape.to_vec(),
            values: (0..elements).map(of_element).collect(),
            frames: frames.filter(|frame| !frame[0].is_nan()).count(),
        }
    }

    /// Takes in another episode.
    pub(super) fn add(&mut self, more: &Self) {
        self.frames += more.frames;
        for (all, more) in self.values.iter_mut().zip(&more.values) {
            all.add(more);
        }
    }
}

/// All features of an episode, in the order of their columns.
pub(super) fn features(episode: &Episode, place: Place) -> Vec<Feature> {
    let Episode { frames, kind, .. } = *episode;
    let joints: Vec<String> = (1..=JOINTS).map(|joint| format!("joint{joint}")).collect();
    let mut all = vec![
        Feature::vector("observation.state", &episode.state, &joints),
        Feature::vector("action", &episode.action, &joints),
    ];
    all.extend(image(episode));
    if kind.keypoints > 0 {
        all.push(Feature::keypoints(&episode.keypoints, kind.keypoints));
    }
    let same = |number| std::iter::repeat_n(number, frames);
    all.extend([
        Feature::timestamp(frames, kind.fps),
        Feature::number("frame_index", 0..frames),
        Feature::number("episode_index", same(place.episode)),
        Feature::number("index", place.first_frame..place.first_frame + frames),
        Feature::number("task_index", same(place.task)),
    ]);
    all
}

/// The left image, as it was recorded.
fn image(episode: &Episode) -> Option<Feature> {
    let name = "observation.images.left";
    let pictures = episode.pictures.as_ref()?;
    let [width, height] = pictures.size_px;
    let jpegs = pictures.jpegs.clone();
    let called = (0..jpegs.len()).map(|frame| format!("frame-{frame:06}.jpg"));
    let called = called.collect();
    Some(Feature {
        described: json!({
            "dtype": "image", "shape": [height, width, 3], "names": ["height", "width", "channels"],
        }),
        gathered: FeatureValues {
            name: name.to_owned(),
            shape: vec![3, 1, 1],
            values: pictures.colours(),
            frames: jpegs.len(),
        },
        column: Column::single(name, Values::Pictures(jpegs, called)),
    })
}
