//! Sensitivity of the network's answer: how far each parameter moves when a
//! keypoint is seen elsewhere for a moment.

use planner::features::WiggleFeatures;
use planner::phi::{PhiNet, PredictError};
use serde::{Deserialize, Serialize};
use shared_types::rope::ROPE_PARAMETERS;

/// Frames moved together: two fifteenths of a second at 60 Hz.
pub(super) const MOMENT_FRAMES: usize = 8;
/// How far a keypoint is moved, each way (m): large compared with rounding, small compared with the
/// rope's sway.
const SHIFT_M: f32 = 2e-3;

/// Sensitivities of every parameter to every keypoint at every moment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct SensitivityMap {
    /// Moments of [`MOMENT_FRAMES`] frames each; frames left over are left out.
    pub moments: usize,
    /// Keypoints from the clamp to the lead.
    pub keypoints: usize,
    /// Parameter by parameter (order of [`shared_types::rope::RANGES`]), moment by moment,
    /// keypoint by keypoint: length of the parameter's gradient over the keypoint's place,
    /// in fractions of the parameter's range per metre.
    pub values: Vec<Vec<f32>>,
}

impl SensitivityMap {
    /// A map of zeros.
    pub fn empty(moments: usize, keypoints: usize) -> Self {
        Self {
            moments,
            keypoints,
            values: vec![vec![0.0; moments * keypoints]; ROPE_PARAMETERS],
        }
    }

    /// Asks `net` about `features` with every keypoint moved forward, back, up and down at
    /// every moment.
    pub fn measure(net: &PhiNet, features: &WiggleFeatures) -> Result<Self, PredictError> {
        let definition = features.definition;
        let mut map = Self::empty(definition.frames / MOMENT_FRAMES, definition.keypoints);
        for moment in 0..map.moments {
            for keypoint in 0..map.keypoints {
                let mut squares = [0.0_f32; ROPE_PARAMETERS];
                for axis in 0..2 {
                    let look = |shift_m| {
                        let mut moved = features.clone();
                        let first = moment * MOMENT_FRAMES;
                        for frame in first..first + MOMENT_FRAMES {
                            move_keypoint(&mut moved, frame, keypoint, axis, shift_m);
                        }
                        net.run(&moved)
                    };
                    let (more, less) = (look(SHIFT_M)?, look(-SHIFT_M)?);
                    for (square, (a, b)) in squares.iter_mut().zip(more.mean.iter().zip(&less.mean))
                    {
                        *square += ((a - b) / (2.0 * SHIFT_M)).powi(2);
                    }
                }
                for (values, square) in map.values.iter_mut().zip(squares) {
                    values[moment * map.keypoints + keypoint] = square.sqrt();
                }
            }
        }
        Ok(map)
    }

    /// Adds another film's sensitivities.
    pub fn add(&mut self, other: &Self) {
        for (sum, more) in self
            .values
            .iter_mut()
            .flatten()
            .zip(other.values.iter().flatten())
        {
            *sum += more;
        }
    }

    /// Root of the sum of squares over the keypoints, moment by moment.
    pub fn over_time(&self, parameter: usize) -> Vec<f64> {
        let size = |row: &[f32]| {
            row.iter()
                .map(|v| f64::from(*v).powi(2))
                .sum::<f64>()
                .sqrt()
        };
        self.values[parameter]
            .chunks(self.keypoints)
            .map(size)
            .collect()
    }

    /// The same over the moments, keypoint by keypoint.
    pub fn along_rope(&self, parameter: usize) -> Vec<f64> {
        let mut squares = vec![0.0; self.keypoints];
        for row in self.values[parameter].chunks(self.keypoints) {
            for (square, value) in squares.iter_mut().zip(row) {
                *square += f64::from(*value).powi(2);
            }
        }
        squares.into_iter().map(f64::sqrt).collect()
    }
}

/// Moves one keypoint of one frame, if the frame was seen, along `axis` (0 forward, 1 up):
/// its place, those that are given relative to it, and the angles of its segments.
fn move_keypoint(
    features: &mut WiggleFeatures,
    frame: usize,
    keypoint: usize,
    axis: usize,
    shift_m: f32,
) {
    let (keypoints, channels) = (
        features.definition.keypoints,
        features.definition.channels(),
    );
    let row = &mut features.motion[frame * channels..(frame + 1) * channels];
    if row[channels - 1] <= 0.0 {
        return;
    }
    let first = keypoint.saturating_sub(1);
    let last = (keypoint + 1).min(keypoints - 1);
    let before: Vec<f32> = (first..last).map(|s| segment_angle(row, s)).collect();
    row[2 * keypoint + axis] += shift_m;
    if keypoint == 0 {
        // The others are given relative to it, and stay.
        for other in 1..keypoints {
            row[2 * other + axis] -= shift_m;
        }
    }
    for (segment, before) in (first..last).zip(before) {
        let turn = segment_angle(row, segment) - before;
        let whole = (turn / core::f32::consts::TAU).round() * core::f32::consts::TAU;
        row[2 * keypoints + segment] += turn - whole;
    }
}

/// Angle of a segment against straight down, from its ends (rad).
fn segment_angle(row: &[f32], segment: usize) -> f32 {
    let place = |k: usize, axis: usize| if k == 0 { 0.0 } else { row[2 * k + axis] };
    let along = |axis| place(segment + 1, axis) - place(segment, axis);
    along(0).atan2(-along(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use experiments::trials::TrialRig;
    use planner::ropes::trial_rope;
    use planner::wiggle::WiggleConfig;

    fn seen() -> (PhiNet, WiggleFeatures) {
        let rig = TrialRig::new(&WiggleConfig::default()).unwrap();
        let net = PhiNet::embedded().unwrap();
        let filmed = rig.film(&trial_rope(77, 0), 77, 0).unwrap();
        let features = net.see(&rig.observation(&filmed)).unwrap();
        (net, features)
    }

    #[test]
    fn a_moved_keypoint_takes_its_segments_along_and_nothing_else() {
        let (_, features) = seen();
        let (keypoints, channels) = (
            features.definition.keypoints,
            features.definition.channels(),
        );
        let frame = 200;
        for keypoint in [0, 4, keypoints - 1] {
            let mut moved = features.clone();
            move_keypoint(&mut moved, frame, keypoint, 0, 0.03);
            move_keypoint(&mut moved, frame, keypoint, 1, -0.01);
            let row = &moved.motion[frame * channels..(frame + 1) * channels];
            let old = &features.motion[frame * channels..(frame + 1) * channels];
            for segment in 0..keypoints - 1 {
                let off = row[2 * keypoints + segment] - segment_angle(row, segment);
                let turns = off / core::f32::consts::TAU;
                assert!(
                    (turns - turns.round()).abs() < 1e-5,
                    "segment {segment}: {off}"
                );
            }
            for other in 1..keypoints {
                let way = row[2 * other] - old[2 * other];
                let expected = match (keypoint, other == keypoint) {
                    (0, _) => -0.03,
                    (_, true) => 0.03,
                    _ => 0.0,
                };
                assert!((way - expected).abs() < 1e-6, "{keypoint}, {other}: {way}");
            }
            let elsewhere = moved.motion[..frame * channels] == features.motion[..frame * channels];
            assert!(elsewhere && row[channels - 1] > 0.0);
        }
    }

    #[test]
    fn frames_that_were_not_seen_stay_unseen() {
        let (_, mut features) = seen();
        features.mask(10..20);
        let mut moved = features.clone();
        move_keypoint(&mut moved, 15, 3, 0, 0.03);
        assert_eq!(moved, features);
    }
}
