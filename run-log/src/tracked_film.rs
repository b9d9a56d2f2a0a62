//! The wiggle of a run as it was tracked: keypoints, and the measured joints on the same clock.

use crate::files::{self, JointsCsv};
use crate::run::Run;
use anyhow::{Context, Result, ensure};
use shared_types::{KeypointTrack, MonotonicNs};

/// Joint reports this much before and after the film belong to it (s).
const AROUND_S: f64 = 0.3;

/// What a rope can be identified from again without its film; t = 0 is the film's first frame.
#[derive(Debug)]
pub struct TrackedFilm {
    /// Keypoints of every frame, and why they should not be relied on by all that the run tells.
    pub track: KeypointTrack,
    /// Measured joints around the film.
    pub joints: JointsCsv,
    /// Radii of rope and lead as the tracker measured them (m).
    pub radii_m: [Option<f64>; 2],
}

impl Run {
    /// Its wiggle as it was tracked.
    ///
    /// # Errors
    /// It was not, or the run does not tell when its film began, or a file cannot be read.
    pub fn tracked_film(&self) -> Result<TrackedFilm> {
        let path = self.folder().join(files::KEYPOINTS);
        let name = path.display();
        let mut track = self.keypoints()?.with_context(|| {
            format!("`{name}` is not there: a rope is identified again from a run whose film was tracked; `wag track --video RUN --camera RUN/camera.toml --out {name}` tracks it")
        })?;
        let summary = self.summary()?.unwrap_or_default();
        let epoch = MonotonicNs(self.epoch_ns()?.with_context(|| {
            let folder = self.folder().display();
            format!("`{folder}` does not tell when its film began (summary.json, `epoch_ns`)")
        })?);
        // What the camera's side of the run found, which is kept in its summary.
        let found = summary["track"]["unconfirmed"].as_array();
        let found = found.into_iter().flatten().filter_map(|why| why.as_str());
        track.unconfirmed.extend(found.map(str::to_owned));
        let film_s = track.frames.last().map_or(0.0, |frame| frame.t_s);
        let (from, to) = (epoch.plus_s(-AROUND_S), epoch.plus_s(film_s + AROUND_S));
        let reported = self.recording()?.cycles()?.joints_between(from.0, to.0);
        ensure!(
            reported.len() >= 2,
            "`{}` holds no joints that the arm reported during its film",
            self.folder().display()
        );
        let on_film = |(at_ns, q): &(u64, _)| (MonotonicNs(*at_ns).since_s(epoch), *q);
        let (times_s, q) = reported.iter().map(on_film).unzip();
        let radius = |key: &str| summary["track"][key].as_f64();
        Ok(TrackedFilm {
            track,
            joints: JointsCsv { times_s, q },
            radii_m: ["rope_radius_m", "lead_radius_m"].map(radius),
        })
    }
}
