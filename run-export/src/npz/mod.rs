//! A run as arrays for numpy, under the names that `wag.load_run` of the Python package gives
//! them.

mod file;

use crate::destination_file::{check_file, write_file};
use crate::recorded::RecordedRun;
use crate::written::{Written, WrittenFile};
use anyhow::Result;
use arm_model::JOINTS;
use cli_output::{OrInput, Outcome};
use file::NpzFile;
use run_log::{Column, files};
use serde_json::json;
use shared_types::rope::RANGES;
use shared_types::{KeypointTrack, Plan, RopeParams};
use std::path::Path;

/// The array that stands first, by which an export knows an earlier one.
const FIRST: &str = "epoch_ns";
/// Name of the file, where none is given.
const FILE: &str = "run.npz";

/// Writes the file `out`, or else `run.npz` in the run's folder: `cycles/…` and `reports/…`, and,
/// where the run has them, `keypoints/…`, `plan/…` and `rope/…`. Times in ns are those of
/// CLOCK_MONOTONIC; `epoch_ns` is when the film of the wiggle began, or else the first cycle.
/// Units are the ends of the names; frames and joints are the first dimension's rows and the
/// second's columns.
///
/// # Errors
/// The run cannot be read or holds no cycle, or the file cannot be written.
pub fn npz(run: &Path, out: Option<&Path>) -> Outcome<Written> {
    let recorded = RecordedRun::read(run)?;
    let path = out.map_or_else(|| recorded.run.folder().join(FILE), Path::to_owned);
    check_file(&path, is_export).or_input()?;
    let keypoints = recorded.run.keypoints().or_input()?;
    let plan = recorded.run.plan().or_input()?;
    let rope = recorded.run.rope().or_input()?;
    let lacks = [
        (keypoints.is_none(), files::KEYPOINTS),
        (plan.is_none(), files::PLAN),
        (rope.is_none(), files::ROPE),
    ];
    let lacks = lacks.into_iter().filter(|(lacks, _)| *lacks);
    let lacks = lacks.map(|(_, name)| name.to_owned());
    let missing = recorded.flaws.iter().cloned().chain(lacks).collect();

    let mut file = NpzFile::new();
    let put = |file: &mut NpzFile| -> Result<()> {
        file.scalar(FIRST, recorded.epoch_ns)?;
        put_columns(file, "cycles", recorded.cycles.cycle_columns())?;
        put_columns(file, "reports", recorded.cycles.report_columns())?;
        keypoints.iter().try_for_each(|k| put_keypoints(file, k))?;
        plan.iter().try_for_each(|plan| put_plan(file, plan))?;
        rope.iter().try_for_each(|rope| put_rope(file, rope))
    };
    put(&mut file).or_failed()?;
    let (bytes, count) = file.finish().or_failed()?;
    write_file(&path, &bytes).or_failed()?;
    Ok(Written {
        run: run.to_owned(),
        files: vec![WrittenFile {
            path,
            count,
            of: "arrays",
        }],
        figures: json!({ "epoch_ns": recorded.epoch_ns, "arrays": count, "bytes": bytes.len() }),
        missing,
    })
}

/// Whether a file begins as the archive of an export does: a ZIP's header of 30 bytes, then a name.
fn is_export(begin: &[u8]) -> bool {
    let name = begin
        .strip_prefix(b"PK\x03\x04")
        .and_then(|rest| rest.get(26..));
    name.is_some_and(|name| name.starts_with(FIRST.as_bytes()))
}

/// Columns of the same rows under one name.
fn put_columns<const N: usize>(
    file: &mut NpzFile,
    under: &str,
    columns: [(&str, Column); N],
) -> Result<()> {
    for (name, column) in columns {
        let name = format!("{under}/{name}");
        match column {
            Column::Flags(flags) => file.row(&name, flags),
            Column::U32(counts) => file.row(&name, counts),
            Column::U64(counts) => file.row(&name, counts),
            Column::F64(numbers) => file.row(&name, numbers),
            Column::Joints(rows) => file.table(&name, &[JOINTS], rows.iter().map(|q| &q[..])),
            Column::Texts(texts) => file.texts(&name, &texts),
        }?;
    }
    Ok(())
}

/// As `wag.Track` has them: pixels of the left image as filmed, clamp first, lead's centre last;
/// times from the film's first frame.
fn put_keypoints(file: &mut NpzFile, track: &KeypointTrack) -> Result<()> {
    let (frames, count) = (&track.frames, track.keypoints);
    file.row("keypoints/t_s", frames.iter().map(|f| f.t_s))?;
    let points = frames.iter().map(|f| f.points.as_flattened());
    file.table("keypoints/points_px", &[count, 2], points)?;
    let confidence = frames.iter().map(|f| &f.confidence[..]);
    file.table("keypoints/confidence", &[count], confidence)?;
    file.row("keypoints/lost", frames.iter().map(|f| f.lost))?;
    file.texts("keypoints/unconfirmed", &track.unconfirmed)
}

/// As `wag.Plan` has it: a clamped cubic spline from rest to rest through waypoints.
fn put_plan(file: &mut NpzFile, plan: &Plan) -> Result<()> {
    let trajectory = &plan.trajectory;
    file.row("plan/target_m", plan.target_m)?;
    file.row("plan/times_s", trajectory.times_s().iter().copied())?;
    let waypoints = trajectory.waypoints().iter().map(|q| &q.0[..]);
    file.table("plan/waypoints_rad", &[JOINTS], waypoints)?;
    file.scalar("plan/predicted_error_m", plan.predicted_error_m)?;
    file.scalar("plan/predicted_time_s", plan.predicted_time_s)
}

/// As `wag.Rope` has it, a number each, and a text of JSON for what few ropes have.
fn put_rope(file: &mut NpzFile, rope: &RopeParams) -> Result<()> {
    file.scalar("rope/links", rope.links)?;
    let numbers = RANGES.iter().zip(rope.to_array()).skip(1);
    for (range, value) in numbers {
        file.scalar(&format!("rope/{}", range.key), value)?;
    }
    let extras = rope.extras.as_ref().map(serde_json::to_string);
    extras.map_or(Ok(()), |text| file.texts("rope/extras", &[text?]))
}
