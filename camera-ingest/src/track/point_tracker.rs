//! Where something learned may stand in for the built-in tracker: a [`PointTracker`]
//! follows points of the rope through the film.

use super::{TrackError, TrackResult};
use crate::frame::ImageFrame;
use shared_types::keypoints::TrackedFrame;

/// Why a learned model gives no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ModelError {
    /// The file cannot be used, or gives what it must not.
    #[error("{0}")]
    Unfit(String),
    /// The runtime failed, or there is none.
    #[error("model {path}: the network runtime failed: {reason}")]
    Runtime {
        /// The file.
        path: String,
        /// The runtime's words.
        reason: String,
    },
}

/// A followed point in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenPoint {
    /// Raw pixel.
    pub pixel: [f64; 2],
    /// From 0 (hidden) to 1 (seen).
    pub visible: f64,
}

/// Follows points of the first frame through a film.
pub trait PointTracker {
    /// How many points it follows, where it cannot be asked for any number.
    fn points(&self) -> Option<usize>;

    /// Every point (raw pixel of frame 0) in every frame.
    ///
    /// # Errors
    /// No answer.
    fn follow(
        &mut self,
        frames: &[ImageFrame],
        points: &[[f64; 2]],
    ) -> Result<Vec<Vec<SeenPoint>>, ModelError>;
}

/// Points asked for where the tracker follows any number.
const POINTS: usize = 32;
/// A frame in which less than this part of the points is visible is lost.
const MIN_VISIBLE: f64 = 0.25;

impl TrackResult {
    /// The same rope as a point tracker sees it: asked for points spread evenly over the
    /// keypoints of the first frame, it says where they are in every one. `frames` are
    /// those that were tracked; visibility becomes confidence.
    ///
    /// # Errors
    /// The tracker gives no answer, or hardly sees the rope in most frames.
    pub fn by_points(
        mut self,
        frames: &[ImageFrame],
        tracker: &mut dyn PointTracker,
    ) -> Result<Self, TrackError> {
        let tracked = &mut self.track.frames;
        let count = tracker.points().unwrap_or(POINTS).max(2);
        let certain = |pixel: &[f64; 2]| SeenPoint {
            pixel: *pixel,
            visible: 1.0,
        };
        let first: Vec<SeenPoint> = tracked[0].points.iter().map(certain).collect();
        let requested: Vec<[f64; 2]> = evenly(&first, count).iter().map(|s| s.pixel).collect();
        let seen = tracker.follow(frames, &requested)?;
        check_count("frames", seen.len(), tracked.len())?;
        for (frame, seen) in tracked.iter_mut().zip(&seen) {
            check_count("points of a frame", seen.len(), count)?;
            let visible = seen.iter().map(|s| s.visible).sum::<f64>() / count as f64;
            let points = evenly(seen, self.track.keypoints);
            *frame = TrackedFrame {
                t_s: frame.t_s,
                points: points.iter().map(|s| s.pixel).collect(),
                confidence: points.iter().map(|s| s.visible.clamp(0.0, 1.0)).collect(),
                lost: visible < MIN_VISIBLE,
            };
        }
        let lost = tracked.iter().filter(|f| f.lost).count();
        if lost * 2 > tracked.len() {
            return Err(TrackError::MostlyLost {
                lost,
                frames: tracked.len(),
                first: tracked.iter().position(|f| f.lost).unwrap_or(0),
            });
        }
        self.track.unconfirmed = self.confirmation.unconfirmed(tracked);
        Ok(self)
    }
}

/// That a model gave as many values as it must.
fn check_count(what: &str, found: usize, wanted: usize) -> Result<(), ModelError> {
    if found == wanted {
        return Ok(());
    }
    Err(ModelError::Unfit(format!(
        "a learned model gave {found} {what}, it must give {wanted}"
    )))
}

/// `count` points at equal distances along some.
fn evenly(points: &[SeenPoint], count: usize) -> Vec<SeenPoint> {
    let mut along_px = vec![0.0];
    for w in points.windows(2) {
        let [a, b] = [w[0].pixel, w[1].pixel];
        along_px.push(along_px[along_px.len() - 1] + (b[0] - a[0]).hypot(b[1] - a[1]));
    }
    let last = points.len() - 1;
    let place = |k: usize| {
        let wanted_px = along_px[last] * k as f64 / (count - 1) as f64;
        let after = along_px.partition_point(|s| *s < wanted_px).clamp(1, last);
        let (a, b) = (points[after - 1], points[after]);
        let step_px = (along_px[after] - along_px[after - 1]).max(1e-9);
        let part = ((wanted_px - along_px[after - 1]) / step_px).clamp(0.0, 1.0);
        SeenPoint {
            pixel: [0, 1].map(|i| a.pixel[i] + part * (b.pixel[i] - a.pixel[i])),
            visible: a.visible + part * (b.visible - a.visible),
        }
    };
    (0..count).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_spread_evenly_along_the_rope() {
        let point = |x, y, visible| SeenPoint {
            pixel: [x, y],
            visible,
        };
        let bent = [
            point(0.0, 0.0, 1.0),
            point(3.0, 0.0, 1.0),
            point(3.0, 1.0, 0.0),
        ];
        let wanted = [
            point(0.0, 0.0, 1.0),
            point(2.0, 0.0, 1.0),
            point(3.0, 1.0, 0.0),
        ];
        assert_eq!(evenly(&bent, 3), wanted);
        // All in one place: no distance to divide by.
        assert_eq!(
            evenly(&[point(5.0, 5.0, 1.0); 4], 2),
            [point(5.0, 5.0, 1.0); 2]
        );
    }
}
