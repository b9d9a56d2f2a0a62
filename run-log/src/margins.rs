//! How close a run came to its limits.

use super::cycle_sample::{CycleSample, RunLog, WorstJoint};
use arm_model::JOINTS;
use serde::Serialize;

/// How close the run came to one limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Margin {
    /// What the limit is about.
    pub what: &'static str,
    /// Unit of value and limit.
    pub unit: &'static str,
    /// Joint 1 to 7, if it is about one.
    pub joint: Option<usize>,
    /// Value that came closest.
    pub value: f64,
    /// The limit.
    pub limit: f64,
    /// Part of the limit that was used; 1 is at the limit.
    pub part: f64,
    /// When (s from the first cycle).
    pub time_s: f64,
}

/// The smallest margins of a run, in a fixed order. Speeds count always, what
/// matters only to a moving arm only while it moves.
pub(crate) fn smallest_margins(log: &RunLog) -> Vec<Margin> {
    let t = &log.settings.thresholds;
    let ms = |ns: u64| ns as f64 / 1e6;
    let moving = |m: &&CycleSample| m.figures.mode.is_moving();
    let joint = |what, unit, of: fn(&CycleSample) -> WorstJoint| {
        worst(log, what, unit, log.samples.iter(), move |m| {
            let w = of(m);
            (Some(w.joint).filter(|j| *j > 0), w.value.abs(), w.limit)
        })
    };
    let (link_ms, report_ms) = (ms(t.reply_stall_ns), ms(t.report_stale_ns));
    let missed = f64::from(t.missed_cycles_max);
    [
        joint("joint speed", "rad/s", |m| m.figures.speed),
        joint("joint acceleration", "rad/s²", |m| m.figures.acceleration),
        worst(log, "tool speed", "m/s", log.samples.iter(), |m| {
            (None, m.figures.tool_m_s, m.figures.tool_max_m_s)
        }),
        worst(
            log,
            "joint range",
            "rad from its middle",
            log.samples.iter(),
            |m| range(log, m),
        ),
        worst(
            log,
            "unanswered setpoint",
            "ms",
            log.samples.iter(),
            move |m| (None, m.figures.link_ms, link_ms),
        ),
        worst(
            log,
            "age of joint reports, moving",
            "ms",
            log.samples.iter().filter(moving),
            move |m| (None, m.figures.report_ms.unwrap_or(0.0), report_ms),
        ),
        worst(
            log,
            "cycles missed at once, moving",
            "cycles",
            log.samples.iter().filter(moving),
            move |m| (None, f64::from(m.figures.missed), missed),
        ),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn worst<'a>(
    log: &RunLog,
    what: &'static str,
    unit: &'static str,
    samples: impl Iterator<Item = &'a CycleSample>,
    measure: impl Fn(&CycleSample) -> (Option<usize>, f64, f64),
) -> Option<Margin> {
    let part = |(_, value, limit): (Option<usize>, f64, f64)| {
        if limit > 0.0 { value / limit } else { 0.0 }
    };
    let sample = samples.max_by(|a, b| part(measure(a)).total_cmp(&part(measure(b))))?;
    let (joint, value, limit) = measure(sample);
    Some(Margin {
        what,
        unit,
        joint,
        value,
        limit,
        part: part((joint, value, limit)),
        time_s: log.time_s(sample.deadline_ns),
    })
}

/// The joint nearest to an end of its range, as its distance from the middle.
fn range(log: &RunLog, sample: &CycleSample) -> (Option<usize>, f64, f64) {
    let limits = &log.limits;
    // A pose is known only when setpoints were ever sent.
    if sample.figures.speed.joint == 0 {
        return (None, 0.0, 0.0);
    }
    (0..JOINTS)
        .map(|j| {
            let (low, high) = (limits.position_min_rad[j], limits.position_max_rad[j]);
            let off = (sample.q_c[j] - (low + high) / 2.0).abs();
            (Some(j + 1), off, (high - low) / 2.0)
        })
        .max_by(|a, b| (a.1 / a.2).total_cmp(&(b.1 / b.2)))
        .unwrap_or((None, 0.0, 0.0))
}
