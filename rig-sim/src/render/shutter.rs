//! When each row of a frame gathers light.

use shared_types::StereoCamera;

/// Rows that gather light one after the other, or all together.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowTimes {
    /// Part of the frame's time during which one row gathers light.
    open: f64,
    /// Parts of it by which a row is later than the one above.
    per_row: f64,
    /// The frame's time (s).
    frame_s: f64,
}

impl RowTimes {
    pub(super) fn of(camera: &StereoCamera) -> Self {
        let frame_s = camera.frame_time_s();
        Self {
            open: camera.exposure_s / frame_s,
            per_row: camera.line_time_s / frame_s,
            frame_s,
        }
    }

    /// When row `v` begins to gather light (s).
    pub(super) fn opens_s(self, v: usize) -> f64 {
        self.per_row * v as f64 * self.frame_s
    }

    /// How many exposures the whole frame takes.
    pub(super) fn exposures(self) -> f64 {
        1.0 / self.open
    }

    /// Part (0 to 1) of the time of sub-frame `i` of `count` during which row `v` gathers
    /// light; they lie evenly over the frame's time.
    pub(super) fn weight(self, v: usize, i: usize, count: usize) -> f32 {
        let opens = self.per_row * v as f64 * count as f64;
        let closes = opens + self.open * count as f64;
        let (begin, end) = (i as f64, i as f64 + 1.0);
        (closes.min(end) - opens.max(begin)).clamp(0.0, 1.0) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CameraConfig;

    #[test]
    fn all_rows_of_a_global_shutter_see_every_sub_frame_whole() {
        let rows = RowTimes::of(&CameraConfig::default().stereo_camera());
        assert_eq!(rows.exposures(), 1.0);
        for (v, i) in [(0, 0), (375, 6), (100, 3)] {
            assert_eq!(rows.weight(v, i, 7), 1.0);
        }
    }

    #[test]
    fn a_row_sees_the_time_of_its_own_exposure() {
        let config = CameraConfig {
            line_time_s: 26.1e-6,
            ..CameraConfig::default()
        };
        let camera = config.stereo_camera();
        let rows = RowTimes::of(&camera);
        let count = 37;
        let step_s = camera.frame_time_s() / count as f64;
        for v in [0, 1, 99, 375] {
            let weights: Vec<f64> = (0..count)
                .map(|i| rows.weight(v, i, count).into())
                .collect();
            let sum: f64 = weights.iter().sum();
            assert!((sum * step_s - camera.exposure_s).abs() < 1e-9, "row {v}");
            let middle = |i: usize| (i as f64 + 0.5) * step_s;
            let mean_s = (0..count).map(|i| weights[i] * middle(i)).sum::<f64>() / sum;
            let want_s = camera.row_time_s(v as f64);
            // The cut pieces at both ends are taken at their sub-frame's middle.
            assert!((mean_s - want_s).abs() < step_s / 8.0, "{mean_s} {want_s}");
        }
    }
}
