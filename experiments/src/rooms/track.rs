//! `experiments track-rooms`: how many films in drawn rooms the tracker follows.

use super::fate::{Fate, Tracked};
use super::folder;
use super::score::Score;
use super::summary::{Row, reliability, rows};
use super::{each, folder_of};
use crate::args::TrackRoomsArgs;
use crate::program::program;
use crate::report::{Column, print_table};
use anyhow::{Context, ensure};
use arm_model::Pole;
use camera_ingest::source::read_film;
use camera_ingest::{TrackError, USUAL_KEYPOINTS, load_camera, open_video, track};
use cli_output::{OrInput, Outcome, Stage};
use rig_sim::room::Kind;
use rope_sim::{MeasuredArm, npy};
use run_log::files;
use serde_json::{Value, json};
use shared_types::KeypointTrack;
use std::path::Path;

const TABLE: [Column<Row>; 9] = [
    ("films", |row| row.films.clone()),
    ("n", |row| row.n.to_string()),
    ("followed", |row| row.followed.to_string()),
    ("refused", |row| row.refused.to_string()),
    ("flagged", |row| row.flagged.to_string()),
    ("wrong", |row| row.wrong.to_string()),
    ("others", |row| row.others().to_string()),
    ("followed (%)", |row| percent(row.followed_fraction)),
    ("wrong (%)", |row| percent(row.wrong_fraction)),
];

/// A part with its limits in brackets.
fn percent([value, low, high]: [f64; 3]) -> String {
    let [value, low, high] = [value, low, high].map(|part| 100.0 * part);
    format!("{value:.0} ({low:.0}-{high:.0})")
}

/// Tracks the film in a folder as `wag track` does: the only call of the tracker here.
fn follow(folder: &Path) -> anyhow::Result<Result<KeypointTrack, TrackError>> {
    let mut video = open_video(&folder.join("video.avi"), None)?;
    let camera = load_camera(&folder.join(files::CAMERA))?;
    let joints = files::read_joints(&folder.join("joints_measured.csv"))?;
    let arm = MeasuredArm::new(&joints.times_s, &joints.q, Pole::default())?;
    let images = read_film(&mut video)?;
    let tracked = track(images.film(), &camera, &arm, USUAL_KEYPOINTS);
    Ok(tracked.map(|result| result.track))
}

/// The true curve of each frame in a folder (raw px of the left image).
fn truth(folder: &Path) -> anyhow::Result<Vec<Vec<[f64; 2]>>> {
    let path = folder.join("truth_nodes_left_px.npy");
    let fail = || format!("`{}`", path.display());
    let array = npy::read(std::fs::File::open(&path).with_context(fail)?).with_context(fail)?;
    let [_, points, 2] = array.shape[..] else {
        anyhow::bail!(
            "{}: shape {:?} is not (frames, points, 2)",
            fail(),
            array.shape
        );
    };
    let pairs = array.values.as_chunks::<2>().0;
    Ok(pairs.chunks(points.max(1)).map(<[_]>::to_vec).collect())
}

/// Renders a film where there is none yet, tracks it and scores it.
fn judge(folder: &Path, seed: u64, kind: Kind) -> anyhow::Result<Tracked> {
    let scene = match folder::scene(folder)? {
        Some(scene) => scene,
        None => folder::write(folder, seed, kind)?,
    };
    ensure!(
        scene.seed == seed && scene.kind == kind.name(),
        "`{}` has the film of {} seed {}",
        folder.display(),
        scene.kind,
        scene.seed
    );
    let (fate, unconfirmed) = match follow(folder)? {
        Ok(track) => {
            let fate = Score::of(&track, &truth(folder)?).map_or_else(
                || Fate::Refused("the rope is lost in all frames".to_owned()),
                Fate::Tracked,
            );
            (fate, track.unconfirmed)
        }
        Err(refusal) => {
            let reason = format!("{:#}", anyhow::Error::new(refusal));
            (Fate::Refused(reason), Vec::new())
        }
    };
    Ok(Tracked {
        program: program()?,
        scene,
        fate,
        unconfirmed,
    })
}

/// The result kept for a seed, or a new one.
fn result(args: &TrackRoomsArgs, seed: u64, kind: Kind) -> anyhow::Result<Tracked> {
    let kept = args
        .out
        .as_deref()
        .map(|out| out.join(format!("{}-{seed}.json", kind.name())));
    if let Some(path) = kept.as_deref().filter(|path| path.exists()) {
        let fail = || format!("result `{}`", path.display());
        let found: Tracked = serde_json::from_str(&files::read_text(path)?).with_context(fail)?;
        ensure!(
            found.program == program()?,
            "{} is of program {}: name another folder with --out, or remove it",
            fail(),
            found.program
        );
        return Ok(found);
    }
    let tracked = match &args.films {
        Some(films) => judge(&folder_of(films, kind, seed), seed, kind)?,
        None => judge(tempfile::tempdir()?.path(), seed, kind)?,
    };
    if let Some(path) = kept {
        std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))?;
        files::write_json(&path, &tracked)?;
    }
    Ok(tracked)
}

/// Tracks films. The value is what `--json` prints.
pub fn run(args: &TrackRoomsArgs) -> Outcome<Option<Value>> {
    let kind = Kind::from(args.which.kind);
    let stage = Stage::begin("track-rooms");
    let all = each(&args.which, |seed| {
        let tracked = result(args, seed, kind)?;
        stage.say(format!("seed {seed}"));
        Ok(tracked)
    })
    .or_input()?;
    let seconds = stage.done(&format!("{} films", all.len()));
    let rows = rows(&all);
    print_table(&rows, 0, TABLE);
    println!(
        "in brackets: 95 % limits (Wilson); wrong: 5 frames or more with a trusted keypoint more than 10 px off"
    );
    for (from, n, near) in reliability(&all) {
        println!(
            "confidence {from:.1} to {:.1}: {n} keypoints, {:.1} % within 3 px",
            from + 0.1,
            100.0 * near
        );
    }
    for film in all.iter().filter(|f| !f.is_followed()) {
        println!("{}", film.said());
    }
    Ok(Some(json!({
        "ok": true, "command": "track-rooms", "kind": kind, "films": all,
        "table": rows, "reliability": reliability(&all), "seconds": seconds,
    })))
}
