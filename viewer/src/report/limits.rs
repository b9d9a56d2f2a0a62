//! How close the run and its plan came to each limit.

use arm_model::limits::{LimitKind, Margin};
use run_log::Explanation;
use serde::Serialize;

/// Limits of the plan that are shown.
const PLANNED_MAX: usize = 6;

/// One limit, and what came closest to it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitRow {
    /// What the limit is about.
    pub what: &'static str,
    /// The motion in which it was closest; none between motions.
    pub motion: Option<String>,
    /// Joint 1 to 7; none for what is about no joint.
    pub joint: Option<usize>,
    /// Value that came closest.
    pub value: f64,
    /// The limit.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// Part of the limit that was used; 1 is at the limit. Of a joint's range, the distance
    /// from its middle as a part of half the range.
    pub used: f64,
    /// Distance to the nearer end of a joint's range (deg); none for other limits.
    pub to_end_deg: Option<f64>,
}

/// A motion's name, and when it began and ended (s from the first cycle).
pub(crate) type Span = (String, [f64; 2]);

/// Limits used by what was commanded.
pub(crate) fn commanded(explanation: &Explanation, motions: &[Span]) -> Vec<LimitRow> {
    let row = |m: &run_log::Margin| {
        let within = |(_, [from_s, to_s]): &&Span| (*from_s..=*to_s).contains(&m.time_s);
        LimitRow {
            what: m.what,
            motion: motions.iter().find(within).map(|(name, _)| name.clone()),
            joint: m.joint,
            value: m.value,
            limit: m.limit,
            unit: m.unit,
            used: m.part,
            to_end_deg: (m.what == "joint range").then(|| (m.limit - m.value).to_degrees()),
        }
    };
    explanation.margins.iter().map(row).collect()
}

/// The tightest limits of a plan, the tightest first; of a joint's range, the nearer end.
pub(crate) fn planned(margins: &[Margin]) -> Vec<LimitRow> {
    let mut rows: Vec<LimitRow> = margins.iter().filter_map(|m| row(m, margins)).collect();
    rows.sort_by(|a, b| b.used.total_cmp(&a.used));
    rows.truncate(PLANNED_MAX);
    rows
}

fn row(margin: &Margin, all: &[Margin]) -> Option<LimitRow> {
    let range = |m: &Margin| matches!(m.kind, LimitKind::PositionMin | LimitKind::PositionMax);
    let (what, unit) = match margin.kind {
        LimitKind::PositionMin => ("joint position (lower end)", "rad"),
        LimitKind::PositionMax => ("joint position (upper end)", "rad"),
        LimitKind::Velocity => ("joint speed", "rad/s"),
        LimitKind::Acceleration => ("joint acceleration", "rad/s²"),
        LimitKind::TcpSpeed => ("tool speed", "m/s"),
    };
    let is_nearer = |m: &&Margin| range(m) && m.joint == margin.joint && m.left < margin.left;
    if range(margin) && all.iter().any(|m| is_nearer(&m)) {
        return None;
    }
    let (used, to_end_deg) = if range(margin) {
        // What is left is a part of the whole range, half of which lies on each side of
        // its middle.
        let to_end = (margin.limit - margin.value).abs().to_degrees();
        (1.0 - 2.0 * margin.left, Some(to_end.copysign(margin.left)))
    } else {
        (1.0 - margin.left, None)
    };
    Some(LimitRow {
        what,
        motion: Some("throw".to_owned()),
        joint: Some(usize::from(margin.joint)).filter(|j| *j > 0),
        value: margin.value,
        limit: margin.limit,
        unit,
        used,
        to_end_deg,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn margin(kind: LimitKind, joint: u8, [value, limit]: [f64; 2], left: f64) -> Margin {
        Margin {
            kind,
            joint,
            value,
            limit,
            time_s: 0.5,
            left,
        }
    }

    #[test]
    fn a_centred_joint_has_used_nothing_of_its_range() {
        let centred = [
            margin(LimitKind::PositionMin, 1, [-0.1, -2.0], 0.475),
            margin(LimitKind::PositionMax, 1, [0.0, 2.0], 0.5),
            margin(LimitKind::PositionMin, 2, [-0.1, -2.0], 0.475),
            margin(LimitKind::PositionMax, 2, [1.8, 2.0], 0.05),
            margin(LimitKind::TcpSpeed, 0, [0.6, 1.2], 0.5),
        ];
        let rows = planned(&centred);
        let seen: Vec<_> = rows.iter().map(|r| (r.joint, r.what)).collect();
        let ends = ["joint position (upper end)", "joint position (lower end)"];
        assert_eq!(
            seen,
            [(Some(2), ends[0]), (None, "tool speed"), (Some(1), ends[1])]
        );
        assert!((rows[0].used - 0.9).abs() < 1e-9);
        assert!((rows[0].to_end_deg.unwrap() - 0.2_f64.to_degrees()).abs() < 1e-9);
        assert!((rows[2].used - 0.05).abs() < 1e-9, "{:?}", rows[2]);
        assert_eq!(rows[1].to_end_deg, None);
    }

    #[test]
    fn a_limit_belongs_to_the_motion_in_which_it_was_closest() {
        let margin = |what, time_s| run_log::Margin {
            what,
            unit: "rad",
            joint: Some(3),
            value: 1.0,
            limit: 1.5,
            part: 2.0 / 3.0,
            time_s,
        };
        let explanation = Explanation {
            stopped: false,
            cycles: 0,
            duration_s: 9.0,
            stops: Vec::new(),
            ended_in_order: true,
            margins: vec![margin("joint range", 5.5), margin("joint speed", 1.0)],
            flaws: Vec::new(),
        };
        let motions = [
            ("wiggle".to_owned(), [2.0, 4.0]),
            ("throw".to_owned(), [5.0, 6.0]),
        ];
        let rows = commanded(&explanation, &motions);
        assert_eq!(rows[0].motion.as_deref(), Some("throw"));
        assert!((rows[0].to_end_deg.unwrap() - 0.5_f64.to_degrees()).abs() < 1e-9);
        assert_eq!(
            (rows[1].motion.as_deref(), rows[1].to_end_deg),
            (None, None)
        );
    }
}
