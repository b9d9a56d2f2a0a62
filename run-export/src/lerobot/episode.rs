//! A run as an episode: what was seen, measured and commanded, frame by frame.

use super::grid::{Grid, Tracks};
use super::pictures::Pictures;
use super::samples::Samples;
use crate::recorded::RecordedRun;
use anyhow::{Context, Result};
use arm_model::JointVector;
use cli_output::{OrInput, Outcome};
use parquet::data_type::ByteArray;
use run_log::{Run, files};
use shared_types::{KeypointTrack, MonotonicNs, Task};
use std::fmt;
use std::path::{Path, PathBuf};

/// Stamps of the camera closer than this are of one and the same frame.
const SAME_NS: u64 = 1_000_000;

/// A run, frame by frame.
#[derive(Debug)]
pub(super) struct Episode {
    /// The run, as it was named.
    pub(super) run: PathBuf,
    /// What is done in it, in words.
    pub(super) task: String,
    /// What all episodes of a set have in common.
    pub(super) kind: Kind,
    /// How many frames it has.
    pub(super) frames: usize,
    /// Measured joints (rad), linearly interpolated between reports; seven a frame.
    pub(super) state: Vec<f32>,
    /// The newest setpoint that was sent (rad); seven a frame.
    pub(super) action: Vec<f32>,
    /// The rope's keypoints in the frame's picture (px): `u` and `v` of each, from the clamp on;
    /// NaN where the rope was not tracked.
    pub(super) keypoints: Vec<f32>,
    /// The left image.
    pub(super) pictures: Option<Pictures>,
    /// Frames that show the same picture as the frame before.
    pub(super) repeats: usize,
    /// What the run lacks or has wrong, with its name.
    pub(super) missing: Vec<String>,
}

/// What all episodes of a set have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Kind {
    /// Frames a second.
    pub(super) fps: u32,
    /// Width and height of the pictures (px).
    pub(super) picture_px: Option<[usize; 2]>,
    /// Keypoints of a frame; 0 where the rope was never tracked.
    pub(super) keypoints: usize,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} frames a second, ", self.fps)?;
        match self.picture_px {
            Some([width, height]) => write!(f, "pictures of {width}x{height} px, ")?,
            None => write!(f, "no pictures, ")?,
        }
        match self.keypoints {
            0 => write!(f, "no keypoints"),
            count => write!(f, "{count} keypoints"),
        }
    }
}

impl Episode {
    /// About how large it is (bytes): the pictures are nearly all of it.
    pub(super) fn bytes(&self) -> usize {
        let pictures = self.pictures.iter().flat_map(|pictures| &pictures.jpegs);
        pictures.map(ByteArray::len).sum()
    }

    /// Reads a run, so many frames a second, or else as many as it has pictures.
    ///
    /// # Errors
    /// It cannot be read, or cannot be had at this rate.
    pub(super) fn read(path: &Path, fps: Option<u32>) -> Outcome<Self> {
        let recorded = RecordedRun::read(path)?;
        let episode = Self::of(path, &recorded, fps);
        episode
            .with_context(|| format!("`{}`", path.display()))
            .or_input()
    }

    fn of(path: &Path, recorded: &RecordedRun, fps: Option<u32>) -> Result<Self> {
        let run = &recorded.run;
        // Runs of older versions, and those without a camera, have no film.
        let film = run.folder().join(files::RUN).is_file();
        let film = film.then(|| run.film()).transpose()?;
        let seen = film.as_ref().map(|film| film.pictures()).transpose()?;
        let tracks = tracks(recorded, seen.unwrap_or_default());
        let grid = Grid::of(&tracks, fps)?;

        // A picture that was taken a little after its frame is nearer than the one before.
        let shown = |at_ns| tracks.seen.newest(at_ns + grid.half_ns());
        let shown: Vec<(u64, &[u8])> = grid.instants().filter_map(shown).collect();
        let pictures = (!shown.is_empty()).then(|| Pictures::of(&shown));
        let pictures = pictures.transpose()?;
        // Keypoints are those of the picture's own frame of the camera, not of one near it.
        let (looked_ns, within_ns): (Vec<u64>, _) = match &pictures {
            Some(_) => (shown.iter().map(|(at_ns, _)| *at_ns).collect(), SAME_NS),
            None => (grid.instants().collect(), grid.half_ns()),
        };
        let track = run.keypoints()?;
        let (count, keypoints) = match &track {
            Some(track) => keypoints(track, recorded.epoch_ns, &looked_ns, within_ns),
            None => (0, Vec::new()),
        };

        let repeats = shown.windows(2).filter(|pair| pair[0].0 == pair[1].0);
        let repeats = repeats.count();
        let mut flaws = recorded.flaws.clone();
        flaws.extend(gaps(recorded, &tracks, grid));
        if repeats > 0 {
            let frames = grid.frames;
            flaws.push(format!(
                "{repeats} of {frames} frames repeat the picture before"
            ));
        }
        if track.is_some() && count == 0 {
            flaws.push("no keypoints, as none of those tracked are of its frames".to_owned());
        }
        if run.summary()?.unwrap_or_default()["ok"] == false {
            flaws.push("it failed (`ok` is false in its summary)".to_owned());
        }
        let named = |flaw| format!("`{}`: {flaw}", path.display());
        let sent = |at_ns| Some(tracks.sent.newest(at_ns)?.1);
        Ok(Self {
            run: path.to_owned(),
            task: in_words(run)?,
            kind: Kind {
                fps: grid.fps,
                picture_px: pictures.as_ref().map(|pictures| pictures.size_px),
                keypoints: count,
            },
            frames: grid.frames,
            state: joints(grid.instants().map(|at_ns| tracks.measured.between(at_ns))),
            action: joints(grid.instants().map(sent)),
            keypoints,
            pictures,
            repeats,
            missing: flaws.into_iter().map(named).collect(),
        })
    }
}

/// Long times without a picture, a joint report or a control cycle, in words.
fn gaps(recorded: &RecordedRun, tracks: &Tracks<'_>, grid: Grid) -> Vec<String> {
    // Where a part of the recording is lost, its cycles are, those not sent included.
    let cycles = recorded.cycles.cycles.iter();
    let cycles = Samples::new(cycles.map(|cycle| (cycle.deadline_ns, ())));
    let gaps = [
        ("pictures", grid.gaps_s(&tracks.seen)),
        ("measured joints", grid.gaps_s(&tracks.measured)),
        ("control cycles", grid.gaps_s(&cycles)),
    ];
    let there = gaps.into_iter().filter(|(_, gaps_s)| !gaps_s.is_empty());
    let in_words = |(what, gaps_s): (&str, Vec<f64>)| {
        let (count, total_s) = (gaps_s.len(), gaps_s.iter().sum::<f64>());
        let longest_s = gaps_s.into_iter().fold(0.0, f64::max);
        format!(
            "gaps over 0.25 s without {what}: {count}, {total_s:.1} s in all, the longest \
             {longest_s:.1} s"
        )
    };
    there.map(in_words).collect()
}

fn tracks<'a>(recorded: &RecordedRun, seen: Vec<(u64, &'a [u8])>) -> Tracks<'a> {
    let (reports, cycles) = (recorded.cycles.reports(), &recorded.cycles.cycles);
    let sent = cycles
        .iter()
        .filter(|cycle| cycle.sent != 0 && !cycle.held_back());
    Tracks {
        seen: Samples::new(seen.into_iter()),
        measured: Samples::new(reports.into_iter().map(|r| (r.stamp_ns, r.q))),
        sent: Samples::new(sent.map(|cycle| (cycle.deadline_ns, cycle.q_c))),
        last_ns: cycles.last().map_or(0, |cycle| cycle.deadline_ns),
    }
}

/// Seven numbers a frame.
fn joints(frames: impl Iterator<Item = Option<JointVector>>) -> Vec<f32> {
    frames
        .flatten()
        .flat_map(|q| q.0.map(|q| q as f32))
        .collect()
}

/// How many keypoints a frame has, and those of the camera's frames at these instants, as far as
/// the rope was tracked; none where it was tracked in none of them.
fn keypoints(
    track: &KeypointTrack,
    epoch_ns: u64,
    looked_ns: &[u64],
    within_ns: u64,
) -> (usize, Vec<f32>) {
    let epoch = MonotonicNs(epoch_ns);
    let tracked = track.frames.iter().filter(|frame| !frame.lost);
    let tracked = Samples::new(tracked.map(|frame| (epoch.plus_s(frame.t_s).0, &frame.points)));
    let found = looked_ns.iter();
    let found: Vec<_> = found
        .map(|at_ns| tracked.nearest(*at_ns, within_ns))
        .collect();
    if found.iter().all(Option::is_none) {
        return (0, Vec::new());
    }
    let unknown = vec![[f64::NAN; 2]; track.keypoints];
    let points = found.iter().flat_map(|points| points.unwrap_or(&unknown));
    let points = points.flatten().map(|px| *px as f32).collect();
    (track.keypoints, points)
}

/// What a run is for, in words; a learner tells episodes apart by them.
fn in_words(run: &Run) -> Result<String> {
    let earlier = run.earlier()?;
    let Some(target_m) = earlier.target_m else {
        let is_wiggle = run.summary()?.unwrap_or_default()["command"] == "wiggle";
        let words = if is_wiggle {
            "wiggle the rope"
        } else {
            "move the rope"
        };
        return Ok(words.to_owned());
    };
    // Never minus nought.
    let [x, y, z] = target_m.map(|m| (m * 1e3).round() / 1e3 + 0.0);
    let at = format!("at ({x:.3}, {y:.3}, {z:.3}) m");
    Ok(match earlier.task.unwrap_or_default() {
        Task::Strike => format!("strike the target {at} with the tip of the rope"),
        Task::Lob => format!("knock over the domino {at} with the tip of the rope"),
        Task::Drape => format!("hang the rope over the wall {at}"),
    })
}
