//! `experiments real-dlo`: a rope fitted to recordings of a real one, judged on others.
//!
//! The recordings are those of Mamedov, Geist, Viljoen, Trimpe and Swevers, of a foam cylinder
//! that a robot moves and a motion-capture system watches. Everything is simulated from the first
//! row on, from rest; the authors' models begin anew every 5 s, from what was measured then.

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
use nalgebra::Vector3;
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
/// What the authors' models reach: root of the mean squared distance (m) over the first
/// [`LONG_S`] of `traj8`, from `evaluation/data` of their repository (commit aa153518): the
/// recurrent network with a learnt decoder, and the physical model.
const AUTHORS: (&str, [f64; 2]) = ("traj8", [0.055, 0.305]);
/// Time from when the base moves, and from the first row (s).
const SHORT_S: f64 = 5.0;
const LONG_S: f64 = 20.016;

/// Roots of mean squared distances of the tip (m).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Rms {
    /// Before the base moves.
    still_m: f64,
    /// In the first [`SHORT_S`] of motion.
    short_m: f64,
    /// In the first [`LONG_S`] of the recording.
    long_m: f64,
}

/// A recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Row {
    name: String,
    /// Whether ropes were fitted to it.
    fitted: bool,
    moves_from_s: f64,
    /// With each [`Physics`].
    rms: [Rms; Physics::ALL.len()],
    /// The authors' network and physical model (m), as [`Rms::long_m`].
    authors_m: Option<[f64; 2]>,
}

/// A fitted rope.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Fitted {
    physics: Physics,
    rope: RopeParams,
    tilt_rad: [f64; 2],
}

fn mm(m: f64) -> String {
    number(1e3 * m, 1)
}

fn of_all(row: &Row, of: impl Fn(&Rms) -> f64) -> String {
    row.rms.each_ref().map(|rms| mm(of(rms))).join(", ")
}

const TABLE: [Column<Row>; 6] = [
    ("tip (mm RMS): elastic, elaborate, with friction", |row| {
        row.name.clone()
    }),
    ("moves from (s)", |row| number(row.moves_from_s, 2)),
    ("at rest", |row| of_all(row, |rms| rms.still_m)),
    ("first 5 s of motion", |row| of_all(row, |rms| rms.short_m)),
    ("first 20 s", |row| of_all(row, |rms| rms.long_m)),
    ("the authors' network, physical model", |row| {
        let authors = row.authors_m.unwrap_or([f64::NAN; 2]);
        authors.map(mm).join(", ")
    }),
];

pub(super) fn run(args: &RealDloArgs) -> Outcome<Option<Value>> {
    let recordings = recordings(&args.dir).or_input()?;
    let names: Vec<String> = args.fitted.iter().map(|n| format!("traj{n}")).collect();
    let is_fitted = |r: &Recording| names.contains(&r.name);
    let fitted: Vec<&Recording> = recordings.iter().filter(|r| is_fitted(r)).collect();
    check(&names, &fitted, &recordings).or_input()?;
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
    let mut curves = Vec::new();
    for recording in &recordings {
        let (rms, last) = judged(recording, &all, threads).or_failed()?;
        let fitted = is_fitted(recording);
        let remark = if fitted { ", fitted" } else { "" };
        let name = format!("{}{remark}", recording.name);
        curves.push(Curve::cm(&name, last.into_iter(), None));
        let authors_m = (recording.name == AUTHORS.0).then_some(AUTHORS.1);
        rows.push(Row {
            name,
            fitted,
            moves_from_s: recording.moves_from as f64 * recording.period_s(),
            rms,
            authors_m,
        });
    }
    rows.extend(mean_of_others(&rows));
    let axis = "distance of the tip, with friction (cm)";
    let picture = picture::write(args.out.as_deref(), (NAME, 0), axis, &curves)?;
    let fits = Physics::ALL.into_iter().zip(&all);
    let fits: Vec<Fitted> = fits
        .map(|(physics, x)| Fitted {
            physics,
            rope: model::rope(x),
            tilt_rad: model::tilt_rad(x),
        })
        .collect();
    let value = json!({
        "ok": true, "command": NAME, "version": VERSION, "program": program().or_failed()?,
        "recordings": args.dir, "fitted": names, "rows": rows, "fits": fits,
        "out": args.out, "picture": picture,
    });
    if let Some(out) = &args.out {
        files::write_json(out, &value).or_failed()?;
    }
    stage.done(&format!(
        "{} recordings, {} fitted",
        recordings.len(),
        fitted.len()
    ));
    print_table(&rows, 1, TABLE);
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

/// Checks that what is to be fitted is there, and something to judge by.
fn check(names: &[String], fitted: &[&Recording], all: &[Recording]) -> anyhow::Result<()> {
    for name in names {
        let is_there = all.iter().any(|r| r.name == *name);
        ensure!(is_there, "--fitted: there is no {name}.csv in the folder");
    }
    ensure!(
        fitted.len() < all.len(),
        "--fitted: none of the {} recordings is left to judge by",
        all.len()
    );
    Ok(())
}

/// How far the tip is off with each of some values, and all distances with the last (m).
fn judged(
    recording: &Recording,
    all: &[Values],
    threads: usize,
) -> anyhow::Result<([Rms; Physics::ALL.len()], Vec<f64>)> {
    let paths = fit::tips(recording, all, (f64::INFINITY, 1), threads)?;
    let distances = |path: Option<Vec<Vector3<f64>>>| -> Vec<f64> {
        // One that diverges is nowhere.
        let path = path.unwrap_or_else(|| vec![Vector3::repeat(f64::NAN); recording.tip_m.len()]);
        let pairs = path.iter().zip(&recording.tip_m);
        pairs.map(|(a, b)| (a - b).norm()).collect()
    };
    let distances: Vec<Vec<f64>> = paths.into_iter().map(distances).collect();
    let rows = |seconds: f64| (seconds / recording.period_s()).round() as usize;
    let moves = recording.moves_from;
    let rms = |of: &Vec<f64>| {
        let over = |from: usize, until: usize| {
            let part = &of[from..until.min(of.len())];
            (part.iter().map(|d| d * d).sum::<f64>() / part.len() as f64).sqrt()
        };
        Rms {
            still_m: over(0, moves),
            short_m: over(moves, moves + rows(SHORT_S)),
            long_m: over(0, rows(LONG_S)),
        }
    };
    let rms: Vec<Rms> = distances.iter().map(rms).collect();
    let last = distances.into_iter().next_back().unwrap_or_default();
    let rms = rms.try_into();
    let rms = rms.map_err(|rms: Vec<Rms>| anyhow::anyhow!("{} fits", rms.len()))?;
    Ok((rms, last))
}

/// Means over the recordings that no rope was fitted to.
fn mean_of_others(rows: &[Row]) -> Option<Row> {
    let others: Vec<&Row> = rows.iter().filter(|row| !row.fitted).collect();
    if others.is_empty() {
        return None;
    }
    let mean = |of: &dyn Fn(&Row) -> f64| {
        others.iter().map(|row| of(row)).sum::<f64>() / others.len() as f64
    };
    Some(Row {
        name: format!("mean of the {} not fitted", others.len()),
        fitted: false,
        moves_from_s: mean(&|row| row.moves_from_s),
        rms: std::array::from_fn(|i| Rms {
            still_m: mean(&|row| row.rms[i].still_m),
            short_m: mean(&|row| row.rms[i].short_m),
            long_m: mean(&|row| row.rms[i].long_m),
        }),
        authors_m: None,
    })
}
