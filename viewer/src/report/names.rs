//! What the motions of a run are called: wiggle, settle, throw.

use serde_json::Value;

/// The throw is as long as its plan within this (s).
const SAME_DURATION_S: f64 = 0.02;

/// Names of motions of these durations (s), in order; `planned_s` is the duration of the
/// planned throw.
///
/// The cycles do not say what a motion was for. The plan tells the throw by its duration,
/// the summary whether a wiggle was filmed; what moves the arm before the throw without being
/// the wiggle damps the rope's swing. Whatever is not told by these is numbered.
pub(crate) fn names(
    durations_s: &[f64],
    planned_s: Option<f64>,
    summary: &Value,
    has_rope: bool,
) -> Vec<String> {
    let command = summary["command"].as_str();
    let planned = |s: &f64| planned_s.is_some_and(|p| (p - s).abs() < SAME_DURATION_S);
    let throw = durations_s.iter().rposition(planned).or_else(|| {
        let last = durations_s.len().checked_sub(1)?;
        (planned_s.is_none() && command == Some("throw")).then_some(last)
    });
    // A run that goes on with an earlier one has that one's rope, but no wiggle.
    let wiggled = match summary["stages"]["wiggle_s"].as_f64() {
        Some(wiggle_s) => wiggle_s > 0.0,
        None => has_rope || command == Some("wiggle"),
    };
    let span = &summary["wiggle"]["motion"];
    let filmed_s = span["end_ns"].as_u64().zip(span["start_ns"].as_u64());
    let filmed_s = filmed_s.map(|(end, start)| end.saturating_sub(start) as f64 * 1e-9);
    let filmed = |s: &f64| filmed_s.is_some_and(|f| (f - s).abs() < SAME_DURATION_S);
    let before_throw = &durations_s[..throw.unwrap_or(durations_s.len())];
    let wiggle = before_throw.iter().rposition(filmed).unwrap_or(0);
    let kind = |index: usize| match throw {
        Some(throw) if index == throw => Some("throw"),
        _ if index == wiggle && wiggled => Some("wiggle"),
        // What its film told was not relied on.
        _ if index == 0 && wiggled => Some("short wiggle"),
        Some(throw) if index < throw => Some("settle"),
        _ => None,
    };
    let kinds: Vec<_> = (0..durations_s.len()).map(kind).collect();
    let named = |(index, kind): (usize, &Option<&str>)| match kind {
        None => format!("motion {}", index + 1),
        Some(kind) if kinds.iter().filter(|k| **k == Some(kind)).count() == 1 => (*kind).to_owned(),
        Some(kind) => {
            let before = kinds[..index].iter().filter(|k| **k == Some(kind)).count();
            format!("{kind} {}", before + 1)
        }
    };
    kinds.iter().enumerate().map(named).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn named(durations_s: &[f64], planned_s: Option<f64>, summary: &Value) -> Vec<String> {
        names(durations_s, planned_s, summary, true)
    }

    #[test]
    fn what_lies_between_wiggle_and_throw_damps_the_swing() {
        let run = json!({ "command": "run", "stages": { "wiggle_s": 6.7 } });
        let found = named(&[6.7, 3.5, 1.15], Some(1.15), &run);
        assert_eq!(found, ["wiggle", "settle", "throw"]);
        let found = named(&[6.7, 3.5, 3.4, 1.15], Some(1.15), &run);
        assert_eq!(found, ["wiggle", "settle 1", "settle 2", "throw"]);
        let again = json!({
            "stages": { "wiggle_s": 10.1 },
            "wiggle": { "motion": { "start_ns": 8_000_000_000_u64, "end_ns": 14_700_000_000_u64 } },
        });
        let found = named(&[3.4, 3.5, 6.7, 3.5, 1.15], Some(1.15), &again);
        let known = ["short wiggle", "settle 1", "wiggle", "settle 2", "throw"];
        assert_eq!(found, known);
        // Nothing was thrown: what came after the wiggle is not known.
        assert_eq!(named(&[6.7, 3.5], Some(1.15), &run), ["wiggle", "motion 2"]);
    }

    #[test]
    fn a_run_that_goes_on_with_an_earlier_one_has_no_wiggle() {
        let from = json!({ "command": "run", "stages": { "wiggle_s": 0.0 } });
        assert_eq!(named(&[3.5, 1.15], Some(1.15), &from), ["settle", "throw"]);
        let throw = json!({ "command": "throw" });
        assert_eq!(named(&[1.0], None, &throw), ["throw"]);
        assert_eq!(named(&[1.0], None, &Value::Null), ["wiggle"]);
        let steps = json!({ "command": "latency", "stages": { "wiggle_s": 0.0 } });
        assert_eq!(named(&[1.0, 2.0], None, &steps), ["motion 1", "motion 2"]);
    }
}
