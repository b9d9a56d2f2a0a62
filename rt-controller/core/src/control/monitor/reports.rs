//! Watches the joint reports: whether they come, live and make sense, and
//! whether the arm is where it was commanded to be.

#![allow(
    clippy::arithmetic_side_effects,
    reason = "arithmetic of floats only; integers use saturating calls"
)]

use super::history::Commanded;
use super::prediction::{PREDICTED_WITHIN_NS, Prediction};
use crate::clock_map::CLOCK_ANEW;
use crate::control::settings::Thresholds;
use crate::control::violation::Violation;
use arm_model::{JOINTS, JointVector, Limits};
use serde::{Deserialize, Serialize};
use shared_types::ipc::JointReport;
use shared_types::{FaultCode, MonotonicNs};

/// A stamp farther than this from the arrival needs a new map of the arm's clock
/// (ns); less may be a receiver that was held up.
const CLOCK_JUMP_NS: u64 = 500_000_000;
/// Without the arm's clock, reports read at once carry one stamp; they are taken
/// to be this far apart (s).
const UNCLOCKED_SPAN_S: f64 = 0.010;
/// A joint that moves less than this stands still (rad).
const STILL_RAD: f64 = 1e-3;
/// A joint is stuck when it should have moved by this much meanwhile (rad).
const STUCK_RAD: f64 = 0.02;
/// Frozen reports are noticed when the arm should have moved by this much (rad).
const FROZEN_RAD: f64 = 5e-3;
/// Beyond twice the fastest way of a joint between two reports plus this, an
/// encoder jumped (rad).
const JUMP_RAD: f64 = 0.02;
/// Reports farther apart than this are not compared for jumps (s).
const JUMP_SPAN_MAX_S: f64 = 0.1;
/// Largest distance of the arm's own target from everything commanded within
/// the window (rad); rounding on the wire is a thousandth of that.
const TARGET_RAD: f64 = 5e-4;
/// What a report with a foreign target adds to the suspicion of a second
/// commander; one with a target of ours takes one off. Setpoints of two
/// streams alternate, so foreign ones hardly ever come in a row: this finds
/// whoever's setpoint is seen more than once in thirty-two reports.
const FOREIGN_WEIGHT: u32 = 32;
/// Suspicion that is proof: five foreign targets in a row.
const FOREIGN_PROOF: u32 = 160;

/// A joint that stands still. RT-safe to copy.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Still {
    /// Since when (stamp, ns).
    since_ns: u64,
    /// Where (rad).
    at_rad: f64,
    /// Where it should have been then (rad).
    expected_rad: f64,
}

/// What is remembered of the reports, and of what was commanded. RT-safe.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ReportWatch {
    commanded: Commanded,
    /// Where the joints should be, if the arm was measured. Whoever writes a state appends it.
    #[serde(skip)]
    pub(in crate::control) prediction: Option<Prediction>,
    newest: Option<JointReport>,
    /// Since when the values are the same, to the bit (stamp, ns).
    frozen_since_ns: u64,
    still: [Still; JOINTS],
    jump: Option<Violation>,
    broken_in_a_row: u32,
    resyncs: u32,
    suspicion: u32,
}

impl ReportWatch {
    /// Nothing seen yet; the arm holds `q` (rad).
    #[must_use]
    pub fn holding(q: JointVector) -> Self {
        Self {
            commanded: Commanded::holding(q),
            ..Self::default()
        }
    }

    /// The same of an arm that was measured.
    #[must_use]
    pub fn predicted_by(self, prediction: Option<&Prediction>, q: JointVector) -> Self {
        let prediction = prediction.map(|known| known.holding(q));
        Self { prediction, ..self }
    }

    /// A setpoint was sent.
    pub fn sent(&mut self, deadline_ns: u64, q: JointVector) {
        self.commanded.push(deadline_ns, q);
    }

    /// It is `now_ns`: what has been sent by now decides where the joints should be.
    pub fn predict(&mut self, now_ns: u64) {
        if let Some(prediction) = &mut self.prediction {
            prediction.advance(now_ns, &self.commanded);
        }
    }

    /// Where each joint should have been `window_ns` before `at_ns` (rad): by its prediction, a
    /// little before, if it was measured, else by what was commanded.
    fn expected(&self, at_ns: u64, window_ns: u64) -> JointVector {
        let commanded = self.commanded.at(at_ns.saturating_sub(window_ns));
        self.prediction.as_ref().map_or(commanded, |known| {
            let from_ns = at_ns.saturating_sub(window_ns.min(PREDICTED_WITHIN_NS));
            known.or_else(known.at(from_ns), commanded)
        })
    }

    /// How far each joint of a report is outside its prediction if it was measured, else outside
    /// all that was commanded within `window_ns` (rad); below zero inside.
    fn outside(&self, report: &JointReport, window_ns: u64) -> JointVector {
        let (q, stamp_ns) = (&report.q, report.stamp_ns);
        let from_ns = stamp_ns.saturating_sub(window_ns);
        let until_ns = stamp_ns.max(report.arrival_ns);
        let commanded = outside(q, &self.commanded.bounds(from_ns, until_ns));
        self.prediction.as_ref().map_or(commanded, |known| {
            known.or_else(outside(q, &known.bounds(stamp_ns)), commanded)
        })
    }

    /// Newest good report.
    #[must_use]
    pub const fn newest(&self) -> Option<&JointReport> {
        self.newest.as_ref()
    }

    /// A motion begins: counts start anew.
    pub const fn motion_begins(&mut self) {
        self.resyncs = 0;
        self.jump = None;
    }

    /// Broken reports came.
    pub const fn broken(&mut self, count: u32) {
        self.broken_in_a_row = self.broken_in_a_row.saturating_add(count);
    }

    /// A report came that can be used; true when its clock had to be followed
    /// anew.
    pub fn take(&mut self, report: &JointReport, window_ns: u64, limits: &Limits) -> bool {
        self.broken_in_a_row = 0;
        let expected_rad = self.expected(report.stamp_ns, 0);
        let stands = |j: usize| Still {
            since_ns: report.stamp_ns,
            at_rad: report.q[j],
            expected_rad: expected_rad[j],
        };
        let before = self.newest.replace(*report);
        let Some(before) = before else {
            self.frozen_since_ns = report.stamp_ns;
            self.still = core::array::from_fn(stands);
            return false;
        };
        let resync = report.arm_clock == CLOCK_ANEW
            || report.stamp_ns < before.stamp_ns
            || report.stamp_ns.abs_diff(report.arrival_ns) > CLOCK_JUMP_NS;
        if resync {
            self.resyncs = self.resyncs.saturating_add(1);
            self.frozen_since_ns = report.stamp_ns;
            self.still = core::array::from_fn(stands);
            return true;
        }
        if report.q != before.q || report.qd != before.qd {
            self.frozen_since_ns = report.stamp_ns;
        }
        for (j, still) in self.still.iter_mut().enumerate() {
            if (report.q[j] - still.at_rad).abs() > STILL_RAD {
                *still = stands(j);
            }
        }
        self.jump = self.jump.or_else(|| jump(&before, report, limits));
        let from_ns = report.stamp_ns.saturating_sub(window_ns);
        // Only the report with the arm's own clock names its target; others are spared
        // the search.
        let until_ns = report.stamp_ns.max(report.arrival_ns);
        let off_rad = || {
            let bounds = self.commanded.bounds(from_ns, until_ns);
            farthest(&outside(&report.q_target, &bounds)).1
        };
        let foreign = report.arm_clock != 0 && off_rad() > TARGET_RAD;
        // A report that repeats itself says nothing new.
        let repeats =
            report.q == before.q && report.qd == before.qd && report.q_target == before.q_target;
        self.suspicion = if repeats {
            self.suspicion
        } else if foreign {
            self.suspicion
                .saturating_add(FOREIGN_WEIGHT)
                .min(FOREIGN_PROOF)
        } else {
            self.suspicion.saturating_sub(1)
        };
        false
    }

    /// Whether the arm's own target is somebody else's.
    #[must_use]
    pub fn foreign_target(&self) -> Option<Violation> {
        (self.suspicion >= FOREIGN_PROOF).then_some(Violation::plain(FaultCode::SecondCommander))
    }

    /// Age of the newest report, if it is too old to move by.
    #[must_use]
    pub fn stale(&self, now_ns: u64, t: &Thresholds) -> Option<Violation> {
        let age_ns = self
            .newest
            .map_or(now_ns, |r| now_ns.saturating_sub(r.arrival_ns));
        (age_ns > t.report_stale_ns)
            .then(|| Violation::of_time(FaultCode::ReportStale, age_ns, t.report_stale_ns))
    }

    /// Whether the stream itself cannot be trusted.
    #[must_use]
    pub fn stream_fault(&self, t: &Thresholds) -> Option<Violation> {
        if self.broken_in_a_row >= t.report_broken_max {
            let (found, most) = (self.broken_in_a_row.into(), t.report_broken_max.into());
            return Some(Violation::new(FaultCode::ReportBroken, found, most));
        }
        if self.resyncs > t.clock_resyncs_max {
            let (found, most) = (self.resyncs.into(), t.clock_resyncs_max.into());
            return Some(Violation::new(FaultCode::ReportClock, found, most));
        }
        let report = self.newest.as_ref()?;
        let frozen_ns = report.stamp_ns.saturating_sub(self.frozen_since_ns);
        let must_show = self.expected(report.stamp_ns, t.tracking_window_ns);
        let moved_rad = (must_show - self.expected(self.frozen_since_ns, 0)).max_abs();
        (frozen_ns > t.report_frozen_ns.max(t.tracking_window_ns) && moved_rad > FROZEN_RAD)
            .then(|| Violation::of_time(FaultCode::ReportFrozen, frozen_ns, t.report_frozen_ns))
    }

    /// Whether the arm is somewhere else than commanded.
    #[must_use]
    pub fn tracking_fault(&self, t: &Thresholds) -> Option<Violation> {
        if let Some(jump) = self.jump {
            return Some(jump);
        }
        let report = self.newest.as_ref()?;
        // Reports that repeat themselves do not tell where the arm is.
        let same_ns = report.stamp_ns.saturating_sub(self.frozen_since_ns);
        if same_ns > t.report_frozen_ns.max(t.tracking_window_ns) {
            return None;
        }
        let from_ns = report.stamp_ns.saturating_sub(t.tracking_window_ns);
        let must_show = self.expected(report.stamp_ns, t.tracking_window_ns);
        for (j, still) in self.still.iter().enumerate() {
            let moved_rad = (must_show[j] - still.expected_rad).abs();
            let off_rad = (must_show[j] - still.at_rad).abs();
            if still.since_ns < from_ns && moved_rad > STUCK_RAD && off_rad > STUCK_RAD {
                let fault = FaultCode::JointStuck;
                return Some(Violation::of_joint(fault, j, off_rad, STUCK_RAD));
            }
        }
        let (joint, off_rad) = self.tracking_error(t.tracking_window_ns);
        let most = t.tracking_error_max_rad;
        (off_rad > most)
            .then(|| Violation::of_joint(FaultCode::TrackingError, joint, off_rad, most))
    }

    /// Joint (0-based) whose newest measured position is farthest outside its prediction, or
    /// outside what was commanded within `window_ns`, and how far (rad).
    #[must_use]
    pub fn tracking_error(&self, window_ns: u64) -> (usize, f64) {
        self.newest
            .map_or((0, 0.0), |r| farthest(&self.outside(&r, window_ns)))
    }

    /// How far the newest measured pose is behind what was commanded when it was
    /// measured (rad).
    #[must_use]
    pub fn deviation(&self) -> JointVector {
        self.newest
            .map_or(JointVector::ZERO, |r| self.commanded.at(r.stamp_ns) - r.q)
    }
}

/// How far each joint is outside its bounds (rad); below zero inside.
fn outside(q: &JointVector, [low, high]: &[JointVector; 2]) -> JointVector {
    JointVector(core::array::from_fn(|j| {
        (low[j] - q[j]).max(q[j] - high[j])
    }))
}

/// The joint (0-based) that is farthest off, and how far (rad).
fn farthest(off: &JointVector) -> (usize, f64) {
    (0..JOINTS)
        .map(|j| (j, off[j]))
        .fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a })
}

/// A joint that moved farther between two reports than any joint can.
fn jump(before: &JointReport, report: &JointReport, limits: &Limits) -> Option<Violation> {
    let span_s = MonotonicNs(report.stamp_ns).since_s(MonotonicNs(before.stamp_ns));
    if span_s > JUMP_SPAN_MAX_S {
        return None;
    }
    let span_s = if report.arm_clock == 0 {
        span_s.max(UNCLOCKED_SPAN_S)
    } else {
        span_s
    };
    (0..JOINTS).find_map(|j| {
        let way_rad = (report.q[j] - before.q[j]).abs();
        let most = 2.0 * limits.velocity_max_rad_s[j] * span_s + JUMP_RAD;
        (way_rad > most).then(|| Violation::of_joint(FaultCode::EncoderJump, j, way_rad, most))
    })
}
