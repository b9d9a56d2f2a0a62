//! Where moving points appear in a film: each in the middle of the exposure of the row
//! that shows it.

use nalgebra::Vector3;
use shared_types::StereoCamera;

/// Places of a moving point, evenly over a frame's time.
pub(crate) fn as_seen(camera: &StereoCamera, places_m: &[Vector3<f64>]) -> Vector3<f64> {
    let at = |t_s: f64| {
        let place = t_s / camera.frame_time_s() * places_m.len() as f64 - 0.5;
        let place = place.clamp(0.0, (places_m.len() - 1) as f64);
        let before = (place as usize).min(places_m.len().saturating_sub(2));
        let [a, b] = [before, (before + 1).min(places_m.len() - 1)].map(|i| places_m[i]);
        a + (b - a) * (place - before as f64)
    };
    let mut row = f64::from(camera.height_px) / 2.0;
    // A point moves far less than a row in a row's time.
    for _ in 0..4 {
        let seen = camera.project_left(&at(camera.row_time_s(row)));
        row = seen.map_or(row, |[_, v]| v);
    }
    at(camera.row_time_s(row))
}
