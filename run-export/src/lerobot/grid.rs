//! The instants of an episode's frames.

use super::samples::Samples;
use anyhow::{Context, Result, ensure};
use arm_model::JointVector;
use shared_types::MonotonicNs;

/// Most frames a second that are made of pictures; no more are recorded.
const FPS_MAX: u32 = 30;
/// A longer time without a sample is told (ns).
const GAP_NS: u64 = 250_000_000;

/// What a run recorded, each at its own times.
#[derive(Debug)]
pub(super) struct Tracks<'a> {
    /// Pictures: start of exposure, and the JPEG.
    pub(super) seen: Samples<&'a [u8]>,
    /// Measured joints (rad).
    pub(super) measured: Samples<JointVector>,
    /// Setpoints that were sent (rad).
    pub(super) sent: Samples<JointVector>,
    /// The last control cycle: until then the last setpoint holds (CLOCK_MONOTONIC, ns).
    pub(super) last_ns: u64,
}

/// Frames at a fixed rate. The first one is where all of the tracks have begun, at a picture
/// where there are any, the last one before the first of them ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Grid {
    /// The first frame (CLOCK_MONOTONIC, ns).
    begin_ns: u64,
    /// Frames a second.
    pub(super) fps: u32,
    /// Frames.
    pub(super) frames: usize,
}

impl Grid {
    /// As many frames a second as are named, or else as there are pictures.
    ///
    /// # Errors
    /// No rate is named and there are no pictures, or fewer than are named; or the tracks have no
    /// time in common.
    pub(super) fn of(tracks: &Tracks<'_>, fps: Option<u32>) -> Result<Self> {
        let Tracks {
            seen,
            measured,
            sent,
            last_ns,
        } = tracks;
        let fps = rate(seen.period_ns(), fps)?;
        let joints = measured.ends().zip(sent.ends());
        let [begin_ns, end_ns] = joints.map_or([u64::MAX, 0], |(measured, sent)| {
            [measured[0].max(sent[0]), measured[1].min(*last_ns)]
        });
        let [begin_ns, end_ns] = seen.ends().map_or([begin_ns, end_ns], |[_, last_ns]| {
            let first = seen.instants().find(|at_ns| *at_ns >= begin_ns);
            [first.unwrap_or(u64::MAX), end_ns.min(last_ns)]
        });
        ensure!(
            begin_ns < end_ns,
            "there is no time in which it has setpoints, measured joints and, if it was filmed, \
             pictures"
        );
        let frames = 1 + (end_ns - begin_ns) * u64::from(fps) / 1_000_000_000;
        Ok(Self {
            begin_ns,
            fps,
            frames: usize::try_from(frames)?,
        })
    }

    /// The instants of the frames (CLOCK_MONOTONIC, ns).
    pub(super) fn instants(self) -> impl Iterator<Item = u64> {
        (0..self.frames as u64).map(move |frame| self.at_ns(frame))
    }

    fn at_ns(self, frame: u64) -> u64 {
        self.begin_ns + frame * 1_000_000_000 / u64::from(self.fps)
    }

    /// Half the time from one frame to the next (ns): what is not farther away belongs to a frame.
    pub(super) fn half_ns(self) -> u64 {
        500_000_000 / u64::from(self.fps)
    }

    /// The times without a sample that are worth telling (s).
    pub(super) fn gaps_s<T: Copy>(self, samples: &Samples<T>) -> Vec<f64> {
        let steps = samples.steps(self.begin_ns, self.at_ns(self.frames as u64));
        let gaps = steps.filter(|gap_ns| *gap_ns > GAP_NS);
        gaps.map(|gap_ns| MonotonicNs(gap_ns).since_s(MonotonicNs(0)))
            .collect()
    }
}

/// Frames a second, by the time from picture to picture (ns) and what is named.
fn rate(period_ns: Option<u64>, named: Option<u32>) -> Result<u32> {
    let Some(period_ns) = period_ns else {
        return named.context("it has no pictures, whose rate would be taken: name one with --fps");
    };
    let seen = (1e9 / period_ns.max(1) as f64)
        .round()
        .clamp(1.0, FPS_MAX.into()) as u32;
    let fps = named.unwrap_or(seen);
    ensure!(
        fps <= seen,
        "it has {seen} pictures a second, which would have to be repeated for --fps {fps}; name a \
         lower rate, or none"
    );
    Ok(fps)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// Samples from one instant to another (ms), so many apart.
    fn every<T: Copy>(from: u64, to: u64, step: u64, value: T) -> Samples<T> {
        let times = (from..=to).step_by(usize::try_from(step).unwrap());
        Samples::new(times.map(|ms| (ms * MS, value)))
    }

    fn tracks(pictures: Samples<&'static [u8]>) -> Tracks<'static> {
        let q = JointVector::ZERO;
        Tracks {
            seen: pictures,
            measured: every(1_005, 5_000, 10, q),
            sent: every(1_100, 1_200, 4, q),
            last_ns: 4_500 * MS,
        }
    }

    #[test]
    fn frames_lie_where_everything_is_there_and_begin_at_a_picture() {
        let grid = Grid::of(&tracks(every(1_000, 4_000, 50, &[][..])), None).unwrap();
        assert_eq!((grid.fps, grid.frames), (20, 59));
        let at: Vec<u64> = grid.instants().collect();
        assert_eq!([at[0], at[58]], [1_100 * MS, 4_000 * MS]);
        let thinned = Grid::of(&tracks(every(1_000, 4_000, 50, &[][..])), Some(3)).unwrap();
        let at: Vec<u64> = thinned.instants().collect();
        assert_eq!([at[1], at[2]], [1_433_333_333, 1_766_666_666]);
        // Without pictures the setpoints begin it, and the last cycle ends it.
        let blind = Grid::of(&tracks(every(1, 0, 1, &[][..])), Some(100)).unwrap();
        let at: Vec<u64> = blind.instants().collect();
        assert_eq!([at[0], at[at.len() - 1]], [1_100 * MS, 4_500 * MS]);
    }

    #[test]
    fn a_rate_that_cannot_be_had_is_refused() {
        let refused = |tracks, fps| Grid::of(&tracks, fps).unwrap_err().to_string();
        let none = || tracks(every(1, 0, 1, &[][..]));
        assert!(refused(none(), None).contains("name one with --fps"));
        let pictures = || tracks(every(1_000, 4_000, 50, &[][..]));
        assert!(refused(pictures(), Some(21)).contains("20 pictures a second"));
        let early = || tracks(every(0, 1_000, 50, &[][..]));
        assert!(refused(early(), None).contains("there is no time"));
        let faster = Grid::of(&tracks(every(1_000, 4_000, 10, &[][..])), None);
        assert_eq!(faster.unwrap().fps, FPS_MAX);
    }

    #[test]
    fn every_long_gap_is_told() {
        let grid = Grid::of(&tracks(every(1_000, 4_000, 50, &[][..])), None).unwrap();
        let times = [1_000, 2_000, 2_400, 9_000].map(|ms| (ms * MS, ()));
        assert_eq!(
            grid.gaps_s(&Samples::new(times.into_iter())),
            [1.0, 0.4, 6.6]
        );
        assert!(grid.gaps_s(&every(0, 9_000, 250, ())).is_empty());
    }
}
