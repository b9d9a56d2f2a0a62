//! How close a run came to its limits.

use super::cycle_sample::{CycleSample, Figures, RunLog, WorstJoint};
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

/// Joint, value and limit.
type Used = (Option<usize>, f64, f64);
/// What is measured, its unit, whether it counts only while the arm moves, and how.
type Measure<'a> = (
    &'static str,
    &'static str,
    bool,
    &'a dyn Fn(&CycleSample, &Figures) -> Used,
);

/// The smallest margins of a run, in a fixed order. Speeds count always, what
/// matters only to a moving arm only while it moves.
pub(crate) fn smallest_margins(log: &RunLog) -> Vec<Margin> {
    let t = &log.settings.thresholds;
    let [link_max_ms, report_max_ms] =
        [t.reply_stall_ns, t.report_stale_ns].map(|ns| ns as f64 / 1e6);
    let missed_max = f64::from(t.missed_cycles_max);
    let joint = |w: WorstJoint| (Some(w.joint).filter(|j| *j > 0), w.value.abs(), w.limit);
    let report_ms = |f: &Figures| f.report_ms.unwrap_or(0.0);
    let limits: [Measure<'_>; 7] = [
        ("joint speed", "rad/s", false, &|_, f| joint(f.speed)),
        ("joint acceleration", "rad/s²", false, &|_, f| {
            joint(f.acceleration)
        }),
        ("tool speed", "m/s", false, &|_, f| {
            (None, f.tool_m_s, f.tool_max_m_s)
        }),
        ("joint range", "rad from its middle", false, &|m, _| {
            range(log, m)
        }),
        ("unanswered setpoint", "ms", false, &|_, f| {
            (None, f.link_ms, link_max_ms)
        }),
        ("age of joint reports, moving", "ms", true, &|_, f| {
            (None, report_ms(f), report_max_ms)
        }),
        ("cycles missed at once, moving", "cycles", true, &|_, f| {
            (None, f.missed.into(), missed_max)
        }),
    ];
    let part = |(_, value, limit): Used| if limit > 0.0 { value / limit } else { 0.0 };
    limits
        .into_iter()
        .filter_map(|(what, unit, only_moving, used)| {
            let used = |m: &CycleSample| used(m, &m.figures);
            let counts = |m: &&CycleSample| !only_moving || m.figures.mode.is_moving();
            let counted = log.samples.iter().filter(counts);
            let worst = counted.max_by(|a, b| part(used(a)).total_cmp(&part(used(b))))?;
            let (joint, value, limit) = used(worst);
            Some(Margin {
                what,
                unit,
                joint,
                value,
                limit,
                part: part((joint, value, limit)),
                time_s: log.time_s(worst.deadline_ns),
            })
        })
        .collect()
}

/// The joint nearest to an end of its range, as its distance from the middle.
fn range(log: &RunLog, sample: &CycleSample) -> Used {
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
