//! The parts of a recording in which one joint moves.

use super::recording::Recording;

/// How long a joint may still follow its last setpoint (s).
const SETTLE_S: f64 = 0.5;
/// Rest kept before a motion (s).
const BEFORE_S: f64 = 0.05;
/// Setpoints that differ less than this are the same (rad).
const SAME_RAD: f64 = 1e-9;

/// One motion of one joint, from rest.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Window {
    /// Sent at (s), position (rad); the first is the one it rests in.
    pub(super) setpoints: Vec<(f64, f64)>,
    /// Measured at (s), position (rad).
    pub(super) samples: Vec<(f64, f64)>,
}

impl Window {
    /// The motions of a joint (0-based). One that was under way when the
    /// recording began is left out, since it did not start from rest.
    pub(super) fn all(recording: &Recording, joint: usize) -> Vec<Self> {
        let mut out = Vec::new();
        for (from_s, to_s) in motions(recording, joint) {
            let (setpoints, samples) = (&recording.setpoints, &recording.samples);
            // The setpoint that holds when the window opens.
            let first = setpoints.partition_point(|s| s.sent_s <= from_s);
            let first = first.saturating_sub(1);
            let end = setpoints.partition_point(|s| s.sent_s <= to_s);
            let seen = samples.partition_point(|s| s.at_s < from_s)
                ..samples.partition_point(|s| s.at_s <= to_s);
            let sent = setpoints[first..end].iter();
            let measured = samples[seen].iter();
            let window = Self {
                setpoints: sent.map(|s| (s.sent_s, s.q[joint])).collect(),
                samples: measured.map(|s| (s.at_s, s.q[joint])).collect(),
            };
            if !window.samples.is_empty() {
                out.push(window);
            }
        }
        out
    }

    /// How far the joint was told to go (rad).
    pub(super) fn travel_rad(&self) -> f64 {
        let sent = self.setpoints.iter().map(|(_, q)| *q);
        let low = sent.clone().fold(f64::MAX, f64::min);
        let high = sent.fold(f64::MIN, f64::max);
        (high - low).max(0.0)
    }
}

/// When a joint is told to move, settling included (s).
fn motions(recording: &Recording, joint: usize) -> Vec<(f64, f64)> {
    let setpoints = &recording.setpoints;
    let begin_s = setpoints.first().map_or(0.0, |s| s.sent_s);
    let mut out: Vec<(f64, f64)> = Vec::new();
    for pair in setpoints.windows(2) {
        if (pair[1].q[joint] - pair[0].q[joint]).abs() < SAME_RAD {
            continue;
        }
        let moved_s = pair[1].sent_s;
        match out.last_mut() {
            Some((_, to_s)) if moved_s - BEFORE_S <= *to_s => *to_s = moved_s + SETTLE_S,
            _ => out.push((moved_s - BEFORE_S, moved_s + SETTLE_S)),
        }
    }
    out.retain(|(from_s, _)| *from_s >= begin_s);
    out
}

/// Root mean square distance of the joint from its mean over all windows (rad).
pub(super) fn spread_rad(windows: &[Window]) -> f64 {
    let all = || windows.iter().flat_map(|w| &w.samples).map(|(_, q)| *q);
    let count = all().count().max(1) as f64;
    let mean = all().sum::<f64>() / count;
    (all().map(|q| (q - mean).powi(2)).sum::<f64>() / count).sqrt()
}
