//! How long a setpoint takes until the arm names it as its target.
//!
//! A report whose target is setpoint `i`, after one with an older target, says
//! that `i` was taken between the two. That bounds its delay on both sides; the
//! delay that most of these intervals hold is the answer (Marzullo's rule for
//! clocks of which some lie).

use super::recording::Recording;

/// A reported target equals a setpoint within the wire's f32 (rad).
const EQUAL_RAD: f64 = 2e-6;
/// Setpoints further apart than this can be told from one another (rad).
const DISTINCT_RAD: f64 = 1e-5;
/// Longest delay looked for (s).
const DELAY_MAX_S: f64 = 0.3;
/// Reports may be stamped early by the error of the clocks' map (s).
const EARLY_S: f64 = 0.004;
/// Fewest setpoints that are an answer.
const SEEN_MIN: usize = 50;
/// Smallest part of them that must agree.
const AGREED_MIN: f64 = 0.5;

/// Delay from command to target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetDelay {
    /// Interval that the most setpoints agree on (s); as wide as the reports'
    /// period when these keep step with the setpoints.
    pub interval_s: [f64; 2],
    /// Part of the setpoints that agree.
    pub agreed_fraction: f64,
    /// Setpoints seen as targets.
    pub seen: usize,
}

/// The delay, or `None` when reports hold no targets or the targets are not
/// the setpoints (an arm that smooths what it is told).
#[must_use]
pub fn command_to_target(recording: &Recording) -> Option<TargetDelay> {
    let brackets = brackets(recording);
    if brackets.len() < SEEN_MIN {
        return None;
    }
    let ([low_s, high_s], agreed) = most_agreed(&brackets)?;
    let agreed_fraction = agreed as f64 / brackets.len() as f64;
    (agreed_fraction >= AGREED_MIN).then_some(TargetDelay {
        // Nothing is taken before it is sent, whatever the clocks say.
        interval_s: [low_s.max(0.0), high_s.max(0.0)],
        agreed_fraction,
        seen: brackets.len(),
    })
}

/// Bounds of the delay (s), one pair for each setpoint that was seen to become
/// the target.
fn brackets(recording: &Recording) -> Vec<[f64; 2]> {
    let setpoints = &recording.setpoints;
    let mut out = Vec::new();
    let mut before: Option<(f64, usize)> = None;
    for sample in &recording.samples {
        let Some(target) = sample.q_target else {
            continue;
        };
        let newest = setpoints.partition_point(|s| s.sent_s <= sample.at_s + EARLY_S);
        let seen = setpoints[..newest]
            .iter()
            .enumerate()
            .rev()
            .take_while(|(_, s)| s.sent_s >= sample.at_s - DELAY_MAX_S)
            .find(|(_, s)| (s.q - target).max_abs() < EQUAL_RAD);
        let Some((index, setpoint)) = seen else {
            before = None;
            continue;
        };
        let distinct = index > 0
            && setpoints.get(index + 1).is_some_and(|next| {
                (next.q - setpoint.q).max_abs() > DISTINCT_RAD
                    && (setpoints[index - 1].q - setpoint.q).max_abs() > DISTINCT_RAD
            });
        if let Some((at_s, last)) = before
            && last < index
            && distinct
        {
            out.push([at_s - setpoint.sent_s, sample.at_s - setpoint.sent_s]);
        }
        before = Some((sample.at_s, index));
    }
    out
}

/// The interval that lies in most brackets, and in how many.
fn most_agreed(brackets: &[[f64; 2]]) -> Option<([f64; 2], usize)> {
    let mut ends: Vec<(f64, i32)> = brackets
        .iter()
        .flat_map(|[low, high]| [(*low, 1), (*high, -1)])
        .collect();
    // A bracket that ends where another begins shares that point with it.
    ends.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
    let (mut depth, mut deepest, mut best) = (0, 0, None);
    for pair in ends.windows(2) {
        depth += pair[0].1;
        if depth > deepest {
            deepest = depth;
            best = Some([pair[0].0, pair[1].0]);
        }
    }
    Some((best?, usize::try_from(deepest).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm_response::{Sample, Setpoint};
    use arm_model::JointVector;

    /// Setpoints every 4 ms with a ripple of 1 ms, reports every 4.1 ms, taken
    /// 2.3 ms after sending; every 20th late by 9 ms.
    fn recording(smoothed: bool) -> Recording {
        let at = |t: f64| JointVector::splat(0.1 * (3.0 * t).sin());
        let setpoints: Vec<Setpoint> = (0..800)
            .map(|k| {
                let sent_s = 0.004 * f64::from(k) + 0.001 * (f64::from(k) * 0.7).sin().abs();
                Setpoint {
                    sent_s,
                    q: at(sent_s),
                }
            })
            .collect();
        let samples = (10..700)
            .map(|k| {
                let at_s = 0.0041 * f64::from(k);
                let taken = |(i, s): &(usize, &Setpoint)| {
                    s.sent_s + if i % 20 == 0 { 0.009 } else { 0.0023 } <= at_s
                };
                let reported = setpoints.iter().enumerate().rfind(taken).unwrap().1;
                let q_target = if smoothed {
                    at(at_s - 0.01)
                } else {
                    reported.q.map(|q| f64::from(q as f32))
                };
                Sample {
                    at_s,
                    q: JointVector::ZERO,
                    q_target: Some(q_target),
                }
            })
            .collect();
        Recording {
            setpoints,
            samples,
            round_trip_s: 0.0,
        }
    }

    #[test]
    fn the_delay_most_setpoints_agree_on_is_found_between_late_ones() {
        let delay = command_to_target(&recording(false)).unwrap();
        let [low, high] = delay.interval_s;
        assert!(low <= 0.0023 && 0.0023 <= high, "{delay:?}");
        assert!(
            high - low < 3e-4 && delay.agreed_fraction > 0.85,
            "{delay:?}"
        );
    }

    #[test]
    fn targets_that_are_not_the_setpoints_give_no_delay() {
        assert_eq!(command_to_target(&recording(true)), None);
    }
}
