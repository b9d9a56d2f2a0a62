//! How far the rope swings before the arm moves.
//!
//! What is filmed before the wiggle is part of a swing, of any phase. The rope's own period
//! follows from its length; a sine of that period is fitted to the way of every keypoint of its
//! lower half.

use super::explain::median;
use nalgebra::{Matrix3, Vector3};
use rope_sim::GRAVITY_M_S2;
use shared_types::keypoints::TrackedFrame;

/// Shortest time in which a swing shows (s).
const WATCHED_S: f64 = 0.2;
/// Fewest frames in it.
const MIN_FRAMES: usize = 8;

/// The part of a film before the arm moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Before {
    /// It ends then (s).
    pub(super) until_s: f64,
    /// The rope's length from clamp to lead (m).
    pub(super) length_m: f64,
}

impl Before {
    /// Amplitude of the swing as an angle at the clamp (rad), in the middle over keypoints;
    /// `None` where too little was filmed, or the rope is not seen.
    pub(super) fn amplitude_rad(&self, frames: &[TrackedFrame]) -> Option<f64> {
        let early = frames.iter().take_while(|f| f.t_s < self.until_s);
        let seen: Vec<&TrackedFrame> = early.filter(|f| !f.lost).collect();
        let (first, last) = (seen.first()?, seen.last()?);
        if seen.len() < MIN_FRAMES || last.t_s - first.t_s < WATCHED_S {
            return None;
        }
        let rad_s = (GRAVITY_M_S2 / self.length_m).sqrt();
        let row = |f: &&TrackedFrame| {
            let (sin, cos) = (rad_s * (f.t_s - first.t_s)).sin_cos();
            Vector3::new(1.0, sin, cos)
        };
        let rows: Vec<Vector3<f64>> = seen.iter().map(row).collect();
        let normal: Matrix3<f64> = rows.iter().map(|r| r * r.transpose()).sum();
        let inverse = normal.try_inverse()?;
        let count = first.points.len();
        let amplitude_px = |k: usize, axis: usize| {
            let pairs = rows.iter().zip(&seen);
            let right: Vector3<f64> = pairs.map(|(r, f)| r * f.points[k][axis]).sum();
            let fitted = inverse * right;
            fitted[1].hypot(fitted[2])
        };
        let along_px = |k: usize| -> f64 {
            let steps = first.points[..=k].windows(2);
            steps
                .map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]))
                .sum()
        };
        let angles = (count / 2..count)
            .map(|k| amplitude_px(k, 0).hypot(amplitude_px(k, 1)) / along_px(k).max(1e-9));
        Some(median(angles))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight rope of half a metre, 130 px long, that swings about its clamp; half a pixel
    /// of noise.
    fn film(amplitude_rad: f64, phase_rad: f64, frames: usize) -> Vec<TrackedFrame> {
        let rad_s = (GRAVITY_M_S2 / 0.5).sqrt();
        let frame = |i: usize| {
            let t_s = i as f64 / 60.0;
            let angle_rad = amplitude_rad * (rad_s * t_s + phase_rad).sin();
            let point = |k: usize| {
                let noise_px = ((i * 7919 + k * 104_729) % 101) as f64 / 101.0 - 0.5;
                let along_px = 130.0 * k as f64 / 23.0;
                let (sin, cos) = angle_rad.sin_cos();
                [320.0 + along_px * sin + noise_px, 160.0 + along_px * cos]
            };
            TrackedFrame {
                t_s,
                points: (0..24).map(point).collect(),
                confidence: vec![0.9; 24],
                lost: false,
            }
        };
        (0..frames).map(frame).collect()
    }

    const ALL: Before = Before {
        until_s: 1.0,
        length_m: 0.5,
    };

    #[test]
    fn any_part_of_a_swing_shows_how_far_it_goes() {
        for frames in [15, 33, 60] {
            for phase in 0..6 {
                let phase_rad = f64::from(phase);
                let of = |amplitude_rad| {
                    let film = film(amplitude_rad, phase_rad, frames);
                    ALL.amplitude_rad(&film).unwrap()
                };
                let (still_rad, swung_rad) = (of(0.0), of(0.2));
                assert!(still_rad < 0.03, "{frames} frames: {still_rad}");
                let off_rad = (swung_rad - 0.2).abs();
                assert!(
                    off_rad < 0.03,
                    "{frames} frames, phase {phase_rad}: {swung_rad}"
                );
            }
        }
    }

    #[test]
    fn what_was_not_seen_is_not_judged_and_one_wrong_tip_decides_nothing() {
        let swinging = film(0.2, 1.0, 33);
        let short = Before {
            until_s: 0.1,
            ..ALL
        };
        assert_eq!(short.amplitude_rad(&swinging), None);
        let mut hidden = swinging;
        hidden.iter_mut().for_each(|f| f.lost = true);
        assert_eq!(ALL.amplitude_rad(&hidden), None);
        let mut still = film(0.0, 0.0, 33);
        still[5].points[23] = [600.0, 20.0];
        assert!(ALL.amplitude_rad(&still).unwrap() < 0.03);
    }
}
