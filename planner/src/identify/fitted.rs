//! Where the camera sees the rope that was identified: what residuals are taken from.

use crate::synthetic::{KeypointLayout, RecordOptions, record};
use nalgebra::{Rotation3, Vector3};
use rope_sim::{AttachMotion, SimulateError};
use shared_types::{RopeEstimate, StereoCamera};

/// Pixels of one frame's keypoints, clamp first; `None` behind the camera.
pub type SeenKeypoints = Vec<Option<[f64; 2]>>;

/// Pixels of the left image, as filmed, at which the identified rope's keypoints are seen in
/// frames that begin at `times_s`: with the clocks' offset and the place of the camera that the
/// fit found. There are `keypoints`, at least 2, uniform in arc length from the clamp to the
/// lead's centre. A rope whose simulation blows up is seen nowhere.
///
/// # Errors
/// What the rope simulator refuses.
pub fn fitted_keypoints(
    estimate: &RopeEstimate,
    camera: &StereoCamera,
    motion: &dyn AttachMotion,
    times_s: &[f64],
    keypoints: usize,
) -> Result<Vec<SeenKeypoints>, SimulateError> {
    let last_s = times_s.iter().copied().fold(0.0, f64::max);
    let end_s = last_s + camera.frame_time_s() + estimate.time_offset_s.abs();
    let options = RecordOptions {
        layout: KeypointLayout::Uniform(keypoints),
        duration_s: if motion.holds_after_end() {
            end_s
        } else {
            end_s.min(motion.duration_s())
        },
        ..RecordOptions::default()
    };
    let films = record(&[estimate.params], motion, &options)?;
    let Some(film) = films.first().filter(|film| film.is_finite) else {
        return Ok(vec![vec![None; keypoints]; times_s.len()]);
    };
    let found = estimate.circumstances;
    let turn = Rotation3::new(Vector3::from(found.camera_rotation_rad));
    let real = StereoCamera {
        r_w_cam: camera.r_w_cam * turn.matrix(),
        p_w_cam_m: camera.p_w_cam_m + Vector3::from(found.camera_position_m),
        ..camera.clone()
    };
    let seen = |time_s: f64, k: usize| {
        // A point's row tells when it is exposed, and that where it is: two rounds settle it.
        (0..3).fold(None, |seen: Option<[f64; 2]>, _| {
            let row = seen.map_or(f64::from(camera.height_px) / 2.0, |pixel| pixel[1]);
            let exposed_s = time_s + real.row_time_s(row) - estimate.time_offset_s;
            real.project_left(&film.position(exposed_s, k))
        })
    };
    let frame = |time_s: &f64| (0..keypoints).map(|k| seen(*time_s, k)).collect();
    Ok(times_s.iter().map(frame).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::{IdentifyOptions, identify};
    use crate::observation::{Appearance, Observation, ObservedPoints};
    use crate::ropes::trial_rope;
    use crate::synthetic::{FilmNoise, FilmTiming, film, side_camera};
    use crate::wiggle::{WiggleConfig, wiggling_arm};
    use std::ops::ControlFlow;

    /// A camera 1 cm aside whose clock is late: both are in what the fit sees again.
    #[test]
    fn distances_to_the_film_are_the_residual_of_the_fit() {
        let motion = wiggling_arm(&WiggleConfig::default()).unwrap();
        let camera = side_camera();
        let noise = FilmNoise {
            camera_shift_m: Vector3::new(0.01, 0.0, -0.005),
            clock_offset_s: 0.011,
            ..FilmNoise::white(0.5, 3)
        };
        let timing = FilmTiming::default();
        let filmed = film(&trial_rope(2, 8), &motion, &camera, 24, &timing, &noise).unwrap();
        let observation = Observation {
            track: &filmed.track,
            points: ObservedPoints::ArcLength,
            camera: &camera,
            motion: &motion,
            appearance: Appearance::default(),
        };
        let go_on = &mut |_| ControlFlow::Continue(());
        let options = IdentifyOptions::default();
        let estimate = identify(&observation, &options, None, go_on).unwrap();
        let frames = &filmed.track.frames;
        let times_s: Vec<f64> = frames.iter().map(|frame| frame.t_s).collect();
        let seen = fitted_keypoints(&estimate, &camera, &motion, &times_s, 24).unwrap();
        let (mut sum, mut count) = (0.0, 0.0);
        for (frame, seen) in frames.iter().zip(&seen) {
            for (point, seen) in frame.points.iter().zip(seen) {
                let [u, v] = seen.unwrap();
                sum += (point[0] - u).powi(2) + (point[1] - v).powi(2);
                count += 1.0;
            }
        }
        let rms_px = f64::sqrt(sum / count);
        assert!((0.6..0.8).contains(&rms_px), "{rms_px} px");
        let apart_px = (rms_px - estimate.residual_px).abs();
        assert!(apart_px < 0.02, "{rms_px} and {} px", estimate.residual_px);
    }
}
