//! What a set tells of itself: `meta/`, as LeRobot writes it.

use super::columns::{Column, Values};
use super::episode::Kind;
use super::features::{Feature, FeatureValues};
use super::statistics::NAMES;
use anyhow::{Context, Result};
use serde_json::{Map, Value, json};

/// Version of the format.
const VERSION: &str = "v3.0";
/// Where each episode lies: one file is enough for a million of them.
pub(super) const EPISODES: &str = "meta/episodes/chunk-000/file-000.parquet";
/// Files of a folder (`chunk-NNN`), and megabytes from which the library begins another file.
const CHUNK_FILES: usize = 1000;
pub(super) const FILE_MB: usize = 100;

/// Statistics of a feature.
#[derive(Debug, Clone)]
pub(super) struct Statistics {
    name: String,
    shape: Vec<usize>,
    frames: usize,
    /// Of each element of that shape, in the order of [`NAMES`].
    elements: Vec<[f64; NAMES.len()]>,
}

impl Statistics {
    /// Computes them.
    ///
    /// # Errors
    /// There is nothing to compute them of.
    pub(super) fn of(gathered: &FeatureValues) -> Result<Self> {
        let elements = gathered.values.iter().map(|values| values.statistics());
        let elements: Option<Vec<_>> = elements.collect();
        Ok(Self {
            name: gathered.name.clone(),
            shape: gathered.shape.clone(),
            frames: gathered.frames,
            elements: elements.with_context(|| format!("{} has no values", gathered.name))?,
        })
    }

    /// Those of all elements with one name.
    fn named(&self, number: usize) -> Vec<f64> {
        let elements = self.elements.iter();
        elements.map(|statistics| statistics[number]).collect()
    }

    fn json(&self) -> Value {
        let mut told = Map::new();
        for (number, name) in NAMES.into_iter().enumerate() {
            told.insert(name.to_owned(), nested(&self.named(number), &self.shape));
        }
        told.insert("count".to_owned(), json!([self.frames]));
        told.into()
    }
}

/// Numbers as lists in lists.
fn nested(numbers: &[f64], shape: &[usize]) -> Value {
    match shape {
        [_, inner @ ..] if !inner.is_empty() => {
            let lists = numbers.chunks(inner.iter().product());
            lists.map(|numbers| nested(numbers, inner)).collect()
        }
        _ => json!(numbers),
    }
}

/// An episode, as the set tells of it.
#[derive(Debug)]
pub(super) struct EpisodeMeta {
    /// Number of its task.
    pub(super) task: usize,
    /// Number of its data file.
    pub(super) file: usize,
    /// Number of its first frame in the set.
    pub(super) first_frame: usize,
    /// How many frames it has.
    pub(super) frames: usize,
    /// Statistics of its features.
    pub(super) statistics: Vec<Statistics>,
}

/// Folder and number of a data file by its number in the set.
const fn place_of(file: usize) -> [usize; 2] {
    [file / CHUNK_FILES, file % CHUNK_FILES]
}

/// The path of a data file, by its number.
pub(super) fn data_path(file: usize) -> String {
    let [chunk, file] = place_of(file);
    format!("data/chunk-{chunk:03}/file-{file:03}.parquet")
}

/// The features, as `info.json` has them.
pub(super) fn described(features: &[Feature]) -> Value {
    let each = features.iter();
    each.map(|feature| (feature.column.name.clone(), feature.described.clone()))
        .collect::<Map<_, _>>()
        .into()
}

/// `info.json`: the features, and how many episodes, frames and tasks there are.
pub(super) fn info(kind: Kind, features: &Value, totals: [usize; 3]) -> Value {
    let [episodes, frames, tasks] = totals;
    json!({
        "codebase_version": VERSION,
        "robot_type": "xarm7",
        "fps": kind.fps,
        "features": features,
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": tasks,
        "splits": { "train": format!("0:{episodes}") },
        "chunks_size": CHUNK_FILES,
        "data_files_size_in_mb": FILE_MB,
        "video_files_size_in_mb": 200,
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "video_path": null,
    })
}

/// `stats.json`.
pub(super) fn stats(statistics: &[Statistics]) -> Value {
    let each = statistics.iter();
    each.map(|feature| (feature.name.clone(), feature.json()))
        .collect::<Map<_, _>>()
        .into()
}

/// `tasks.parquet` with the text by which pandas knows that tasks are looked up by their words.
pub(super) fn tasks(tasks: &[String]) -> ([Column; 2], String) {
    let columns = [
        Column::single("task_index", integers(0..tasks.len())),
        Column::single("task", Values::Texts(tasks.to_vec())),
    ];
    let column = |name: &str, pandas: &str, numpy: &str| {
        json!({
            "name": name, "field_name": name, "pandas_type": pandas, "numpy_type": numpy,
            "metadata": null,
        })
    };
    let index = json!({
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [column("task_index", "int64", "int64"), column("task", "unicode", "object")],
        "creator": { "library": "wag", "version": shared_types::VERSION },
        "pandas_version": "2",
    });
    (columns, index.to_string())
}

/// The text by which the library `datasets` knows pictures and arrays in the columns.
pub(super) fn hugging_face(features: &[Feature]) -> String {
    let described = features.iter().map(
        |Feature {
             column, described, ..
         }| {
            let value = json!({ "dtype": described["dtype"], "_type": "Value" });
            let told = match (&column.values, &column.lengths[..]) {
                (Values::Pictures(..), _) => json!({ "_type": "Image" }),
                (_, []) => value,
                (_, [length]) => json!({ "feature": value, "length": length, "_type": "List" }),
                (_, shape) => {
                    json!({ "shape": shape, "dtype": described["dtype"], "_type": "Array2D" })
                }
            };
            (column.name.clone(), told)
        },
    );
    json!({ "info": { "features": described.collect::<Map<_, _>>() } }).to_string()
}

/// `episodes`: where each lies, and its statistics, of which the library makes those of joined or
/// divided sets.
pub(super) fn episodes(told: &[EpisodeMeta], tasks: &[String]) -> Vec<Column> {
    let each = |number: &dyn Fn(&EpisodeMeta) -> usize| integers(told.iter().map(number));
    let task = |told: &EpisodeMeta| tasks[told.task].clone();
    let mut columns = vec![
        Column::single("episode_index", integers(0..told.len())),
        Column::lists(
            "tasks",
            &[1],
            Values::Texts(told.iter().map(task).collect()),
        ),
        Column::single("length", each(&|told| told.frames)),
        Column::single("data/chunk_index", each(&|told| place_of(told.file)[0])),
        Column::single("data/file_index", each(&|told| place_of(told.file)[1])),
        Column::single("dataset_from_index", each(&|told| told.first_frame)),
        Column::single(
            "dataset_to_index",
            each(&|told| told.first_frame + told.frames),
        ),
    ];
    let first = told.first().map(|told| &told.statistics);
    for (feature, Statistics { name, shape, .. }) in first.into_iter().flatten().enumerate() {
        let of = |told: &EpisodeMeta, number| told.statistics[feature].named(number);
        for (number, statistic) in NAMES.into_iter().enumerate() {
            let values = told.iter().flat_map(|told| of(told, number)).collect();
            let name = format!("stats/{name}/{statistic}");
            columns.push(Column::lists(name, shape, Values::Doubles(values)));
        }
        let frames = each(&|told| told.statistics[feature].frames);
        columns.push(Column::lists(format!("stats/{name}/count"), &[1], frames));
    }
    for name in ["meta/episodes/chunk_index", "meta/episodes/file_index"] {
        columns.push(Column::single(name, each(&|_| 0)));
    }
    columns
}

/// Numbers of things, of which there are never too many for the format.
fn integers(numbers: impl Iterator<Item = usize>) -> Values {
    Values::Integers(numbers.map(|number| number as i64).collect())
}
