//! `experiments real-dlo`: a rope fitted to recordings of a real one, judged on others.
//!
//! The recordings are those of Mamedov, Geist, Viljoen, Trimpe and Swevers, of a foam cylinder
//! that a robot moves and a motion-capture system watches. Everything is simulated from the first
//! row on, from rest, without a look at the tip on the way.

mod fit;
mod model;
mod recording;

use super::experiment::number;
use super::picture::{self, Curve};
use crate::args::RealDloArgs;
use crate::program::program;
use crate::report::{Column, print_table};
use anyhow::{Context, bail, ensure};
use cli_output::{OrInput, Outcome, Stage};
use model::{Physics, Values};
use recording::Recording;
use run_log::files;
use serde::Serialize;
use serde_json::{Value, json};
use shared_types::ipc::message::Progress;
use shared_types::{RopeParams, VERSION};
use std::path::Path;

const NAME: &str = "real-dlo";
/// Where recordings come from.
const SOURCE: &str =
    "https://github.com/shamilmamedov/PRB_Net, commit a9c478d6, folder dataset/pool-noodle";
/// The recording that the authors predict, and what two of their models reach (m), as
/// [`Errors::motion_5_s_m`] and [`Errors::all_20_s_m`]: from `evaluation/data` of their
/// repository (commit aa153518), files `pool_noodle_*_predictions_5001steps.csv`, one simulation
/// from the first row on, as here.
const AUTHORS_RECORDING: &str = "traj8";
const AUTHORS: [(&str, [f64; 2]); 2] = [
    ("the authors' network (rnn_LFK)", [0.0408, 0.0593]),
    ("the authors' physical model (rfem)", [0.1765, 0.3075]),
];
/// Time from when the base moves, and from the first row (s).
const SHORT_S: f64 = 5.0;
const LONG_S: f64 = 20.0;

/// Roots of mean squared distances of the tip (m).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Errors {
    /// Before the base moves.
    still_m: f64,
    /// In the first 5 s of its motion.
    motion_5_s_m: f64,
    /// In the first 20 s of the recording.
    all_20_s_m: f64,
}

/// A recording, or several, with one kind of rope.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Row {
    recording: String,
    /// Whether the rope was fitted to it.
    fitted: bool,
    rope: &'static str,
    #[serde(flatten)]
    errors: Errors,
}

/// A fitted rope.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Fitted {
    physics: Physics,
    /// Mass per length and lead are assumed; the motion tells ratios to them only.
    rope: RopeParams,
    tilt_rad: [f64; 2],
    /// Numbers that ended at the bounds of the search.
    at_bounds: Vec<&'static str>,
}

fn mm(m: f64) -> String {
    number(1e3 * m, 1)
}

const TABLE: [Column<Row>; 5] = [
    ("tip, mm RMS", |row| {
        let remark = if row.fitted { " (fitted)" } else { "" };
        format!("{}{remark}", row.recording)
    }),
    ("at rest", |row| mm(row.errors.still_m)),
    ("first 5 s of motion", |row| mm(row.errors.motion_5_s_m)),
    ("first 20 s", |row| mm(row.errors.all_20_s_m)),
    ("rope", |row| row.rope.to_owned()),
];

pub(super) fn run(args: &RealDloArgs) -> Outcome<Option<Value>> {
    let picture = args.out.as_deref().map(picture::beside);
    for path in args.out.iter().chain(&picture) {
        files::check_writable(path).or_input()?;
    }
    let recordings = recordings(&args.dir).or_input()?;
    let names: Vec<String> = args.fitted.iter().map(|n| format!("traj{n}")).collect();
    check(&names, &recordings).or_input()?;
    let is_fitted = |r: &Recording| names.contains(&r.name);
    let fitted: Vec<&Recording> = recordings.iter().filter(|r| is_fitted(r)).collect();
    cli_output::watch_interrupts().or_failed()?;
    let stage = Stage::begin(NAME);
    let threads = usize::from(args.threads);
    let all = Physics::ALL.iter().enumerate().map(|(number, physics)| {
        let progress = |part: f64, rms_m: f64| {
            let percent = 100.0 * (number as f64 + part) / Physics::ALL.len() as f64;
            stage.progress(&Progress {
                done: percent as u32,
                total: 100,
                value: 1e3 * rms_m,
                label: format!("%, {}, mm RMS", physics.name()),
            });
        };
        fit::fit(*physics, &fitted, threads, &progress)
    });
    let all: Vec<Values> = all.collect::<Result<_, _>>().or_failed()?;
    let mut rows = Vec::new();
    let mut curves = Physics::ALL.map(|physics| Curve::cm(physics.name(), [].into_iter(), None));
    for recording in &recordings {
        let fitted = is_fitted(recording);
        let distances = fit::distances(recording, &all, threads).or_failed()?;
        for ((physics, distances), curve) in Physics::ALL.iter().zip(distances).zip(&mut curves) {
            rows.push(Row {
                recording: recording.name.clone(),
                fitted,
                rope: physics.name(),
                errors: errors(recording, &distances),
            });
            if !fitted {
                curve.values.extend(distances.iter().map(|m| 100.0 * m));
            }
        }
    }
    rows.extend(Physics::ALL.map(|physics| mean_of_others(&rows, physics)));
    let axis = "distance of the tip in each row of the recordings not fitted (cm)";
    let picture = picture::write(args.out.as_deref(), NAME, axis, &curves)?;
    let fits = Physics::ALL.into_iter().zip(&all);
    let fits: Vec<Fitted> = fits
        .map(|(physics, x)| Fitted {
            physics,
            rope: model::rope(x),
            tilt_rad: model::tilt_rad(x),
            at_bounds: model::at_bounds(x, physics),
        })
        .collect();
    let authors = AUTHORS.map(|(rope, [motion_5_s_m, all_20_s_m])| {
        json!({ "rope": rope, "recording": AUTHORS_RECORDING, "motion_5_s_m": motion_5_s_m, "all_20_s_m": all_20_s_m })
    });
    let value = json!({
        "ok": true, "command": NAME, "version": VERSION, "program": program().or_failed()?,
        "recordings": args.dir, "fitted": names, "rows": rows, "authors": authors, "fits": fits,
        "out": args.out, "picture": picture,
    });
    stage.done(&format!(
        "{} recordings, {} fitted",
        recordings.len(),
        fitted.len()
    ));
    print_table(&rows, 1, TABLE);
    if recordings.iter().any(|r| r.name == AUTHORS_RECORDING) {
        for (rope, [short_m, long_m]) in AUTHORS {
            let [short, long] = [short_m, long_m].map(mm);
            println!(
                "{AUTHORS_RECORDING}, {rope}: {short} mm in the first 5 s of motion, {long} mm in 20 s"
            );
        }
    }
    if let (Some(out), Some(picture)) = (&args.out, &picture) {
        files::write_json(out, &value).or_failed()?;
        println!(
            "written to `{}`, drawn in `{}`",
            out.display(),
            picture.display()
        );
    }
    Ok(Some(value))
}

/// Every `traj*.csv` of a folder, by name.
fn recordings(dir: &Path) -> anyhow::Result<Vec<Recording>> {
    let entries = std::fs::read_dir(dir).with_context(|| format!("folder `{}`", dir.display()))?;
    let mut paths = Vec::new();
    for entry in entries {
        let path = entry?.path();
        let is_csv = path.extension().is_some_and(|ending| ending == "csv");
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        if is_csv && stem.starts_with("traj") {
            paths.push(path);
        }
    }
    paths.sort();
    if paths.is_empty() {
        bail!(
            "`{}` has no traj*.csv: fetch them from {SOURCE}",
            dir.display()
        );
    }
    paths.iter().map(|path| Recording::read(path)).collect()
}

/// Checks that what is to be fitted is there, once, and something to judge by.
fn check(names: &[String], all: &[Recording]) -> anyhow::Result<()> {
    for (i, name) in names.iter().enumerate() {
        let is_there = all.iter().any(|r| r.name == *name);
        ensure!(is_there, "--fitted: there is no {name}.csv in the folder");
        ensure!(!names[..i].contains(name), "--fitted names {name} twice");
    }
    ensure!(
        names.len() < all.len(),
        "--fitted: none of the {} recordings is left to judge by",
        all.len()
    );
    Ok(())
}

/// How far the tip is off, from its distance in each row (m).
fn errors(recording: &Recording, distances: &[f64]) -> Errors {
    let rows = |seconds: f64| (seconds / recording.period_s()).round() as usize;
    let moves = recording.moves_from;
    let over = |from: usize, until: usize| {
        let part = &distances[from..until.min(distances.len())];
        (part.iter().map(|d| d * d).sum::<f64>() / part.len() as f64).sqrt()
    };
    Errors {
        still_m: over(0, moves),
        motion_5_s_m: over(moves, moves + rows(SHORT_S)),
        all_20_s_m: over(0, rows(LONG_S)),
    }
}

/// Means over the recordings that no rope was fitted to.
fn mean_of_others(rows: &[Row], physics: Physics) -> Row {
    let is_one = |row: &&Row| !row.fitted && row.rope == physics.name();
    let others: Vec<&Row> = rows.iter().filter(is_one).collect();
    let mean = |of: fn(&Errors) -> f64| {
        others.iter().map(|row| of(&row.errors)).sum::<f64>() / others.len() as f64
    };
    Row {
        recording: format!("mean of the {} not fitted", others.len()),
        fitted: false,
        rope: physics.name(),
        errors: Errors {
            still_m: mean(|e| e.still_m),
            motion_5_s_m: mean(|e| e.motion_5_s_m),
            all_20_s_m: mean(|e| e.all_20_s_m),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::recording::tests::{recorded, write};
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn errors_are_of_the_rest_the_motion_and_the_beginning() {
        let recording = recorded(&[Vector3::zeros(); 2000]);
        let moves = recording.moves_from;
        let distance = |row: usize| if row < moves { 1e-3 } else { 2e-3 };
        let distances: Vec<f64> = (0..2000).map(distance).collect();
        let found = errors(&recording, &distances);
        assert!((found.still_m - 1e-3).abs() < 1e-12);
        assert!((found.motion_5_s_m - 2e-3).abs() < 1e-12);
        let squares = (moves as f64 + 4.0 * (2000 - moves) as f64) / 2000.0;
        assert!((found.all_20_s_m - 1e-3 * squares.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn recordings_to_fit_must_be_there_once_and_leave_one_to_judge_by() {
        let dir = tempfile::tempdir().unwrap();
        let why = format!("{:#}", recordings(dir.path()).unwrap_err());
        assert!(why.contains("PRB_Net"), "{why}");
        for n in [1, 2] {
            let path = dir.path().join(format!("traj{n}.csv"));
            write(&path, &[Vector3::zeros(); 300]);
        }
        let all = recordings(dir.path()).unwrap();
        let refused = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
            check(&names, &all).unwrap_err().to_string()
        };
        assert!(refused(&["traj3"]).contains("no traj3.csv"));
        assert!(refused(&["traj1", "traj1"]).contains("twice"));
        assert!(refused(&["traj1", "traj2"]).contains("none of the 2"));
    }

    #[test]
    fn means_are_over_what_was_not_fitted() {
        let row = |fitted, m| Row {
            recording: "traj1".to_owned(),
            fitted,
            rope: Physics::Elastic.name(),
            errors: Errors {
                still_m: m,
                motion_5_s_m: 2.0 * m,
                all_20_s_m: 3.0 * m,
            },
        };
        let rows = [row(true, 9.0), row(false, 1.0), row(false, 3.0)];
        let mean = mean_of_others(&rows, Physics::Elastic);
        assert_eq!(mean.recording, "mean of the 2 not fitted");
        assert_eq!(mean.errors, row(false, 2.0).errors);
    }
}
