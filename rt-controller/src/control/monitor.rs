//! Watches over everything that may go wrong while the arm is commanded.
//!
//! Pure: time is the cycle's planned deadline; nothing here reads a clock.

use super::exchange::{CycleInput, LinkInput};
use super::settings::Thresholds;
use shared_types::ipc::{ControllerMode, JointReport};
use shared_types::{FaultCode, JOINTS, JointVector};

/// Reports lag behind a change of mode by up to 0.2 s (field experience with
/// the vendor's SDK), so state and mode count only this long after bring-up.
const SETTLE_NS: u64 = 300_000_000;
/// Setpoints remembered for the tracking check: 0.25 s at 250 Hz.
const HISTORY: usize = 64;

/// The setpoints sent last. Fixed size, oldest overwritten. RT-safe.
#[derive(Debug, Clone, PartialEq)]
struct Commanded {
    sent: [(u64, JointVector); HISTORY],
    next: usize,
}

impl Commanded {
    const fn new() -> Self {
        Self {
            sent: [(0, JointVector::ZERO); HISTORY],
            next: 0,
        }
    }

    fn fill(&mut self, q: JointVector) {
        self.sent = [(0, q); HISTORY];
    }

    fn push(&mut self, deadline_ns: u64, q: JointVector) {
        if let Some(slot) = self.sent.get_mut(self.next) {
            *slot = (deadline_ns, q);
        }
        self.next = self.next.wrapping_add(1) % HISTORY;
    }

    /// How far `q` lies outside what was commanded between `from_ns` and
    /// `to_ns`, or just before (rad).
    fn distance(&self, q: &JointVector, from_ns: u64, to_ns: u64) -> f64 {
        let (mut low, mut high) = (
            JointVector::splat(f64::INFINITY),
            JointVector::splat(f64::NEG_INFINITY),
        );
        let mut include = |c: &JointVector| {
            low = low.zip_with(*c, f64::min);
            high = high.zip_with(*c, f64::max);
        };
        let mut before: Option<&(u64, JointVector)> = None;
        for entry in &self.sent {
            if (from_ns..=to_ns).contains(&entry.0) {
                include(&entry.1);
            } else if entry.0 < from_ns && before.is_none_or(|b| b.0 < entry.0) {
                before = Some(entry);
            }
        }
        if let Some((_, q)) = before {
            include(q);
        }
        (0..JOINTS)
            .map(|j| (low[j] - q[j]).max(q[j] - high[j]))
            .fold(0.0, f64::max)
    }
}

/// What the monitors remember from cycle to cycle. RT-safe.
#[derive(Debug, Clone, PartialEq)]
pub struct Monitor {
    thresholds: Thresholds,
    commanded: Commanded,
    adopted_ns: u64,
    beat: u64,
    beat_changed_ns: u64,
    report: Option<JointReport>,
}

impl Monitor {
    /// Nothing seen yet.
    #[must_use]
    pub const fn new(thresholds: Thresholds) -> Self {
        Self {
            thresholds,
            commanded: Commanded::new(),
            adopted_ns: 0,
            beat: 0,
            beat_changed_ns: 0,
            report: None,
        }
    }

    /// The arm was brought up and holds `q`.
    pub fn adopt(&mut self, deadline_ns: u64, q: JointVector) {
        self.adopted_ns = deadline_ns;
        self.commanded.fill(q);
    }

    /// A motion begins: the operator's time-out starts anew.
    pub fn motion_begins(&mut self, deadline_ns: u64) {
        self.beat_changed_ns = deadline_ns;
    }

    /// A setpoint was sent.
    pub fn sent(&mut self, deadline_ns: u64, q: JointVector) {
        self.commanded.push(deadline_ns, q);
    }

    /// Newest joint report.
    #[must_use]
    pub const fn report(&self) -> Option<&JointReport> {
        self.report.as_ref()
    }

    /// Takes in what came with this cycle.
    pub fn observe(&mut self, input: &CycleInput) {
        if input.operator.count != self.beat {
            self.beat = input.operator.count;
            self.beat_changed_ns = input.deadline_ns;
        }
        for report in input.reports.as_slice() {
            if report.q.is_finite() {
                self.report = Some(*report);
            }
        }
    }

    /// Whether the newest joint report is too old to move by.
    #[must_use]
    pub fn report_is_stale(&self, now_ns: u64) -> bool {
        self.report
            .is_none_or(|r| now_ns.saturating_sub(r.arrival_ns) > self.thresholds.report_stale_ns)
    }

    /// The first fault, most urgent first. Not asked in `Offline` and `Faulted`.
    #[must_use]
    pub fn fault(&self, input: &CycleInput, mode: ControllerMode) -> Option<FaultCode> {
        link_fault(&input.link)
            .or_else(|| self.mode_fault())
            .or_else(|| {
                (mode.is_moving() && input.missed > self.thresholds.missed_cycles_max)
                    .then_some(FaultCode::DeadlineMissed)
            })
            .or_else(|| (input.operator.stop != 0).then_some(FaultCode::OperatorStop))
            .or_else(|| {
                (input.link.unanswered_ns > self.thresholds.reply_stall_ns)
                    .then_some(FaultCode::ReplyStalled)
            })
            .or_else(|| {
                mode.is_moving()
                    .then(|| self.motion_fault(input.deadline_ns))
                    .flatten()
            })
    }

    /// Another program or a stop button took the arm out of servo mode.
    fn mode_fault(&self) -> Option<FaultCode> {
        let report = self.report.as_ref()?;
        let settled = report.arrival_ns.saturating_sub(self.adopted_ns) > SETTLE_NS;
        // Servo mode is 1; states 1 (moving) and 2 (ready) follow setpoints.
        let serving = report.arm_mode == 1 && matches!(report.arm_state, 1 | 2);
        (settled && !serving).then_some(FaultCode::ArmModeChanged)
    }

    fn motion_fault(&self, now_ns: u64) -> Option<FaultCode> {
        let t = &self.thresholds;
        if now_ns.saturating_sub(self.beat_changed_ns) > t.operator_timeout_ns {
            return Some(FaultCode::OperatorLost);
        }
        if self.report_is_stale(now_ns) {
            return Some(FaultCode::ReportStale);
        }
        let report = self.report.as_ref()?;
        let from_ns = report.stamp_ns.saturating_sub(t.tracking_window_ns);
        // The stamp may be early by the clock map's error; one period is plenty.
        let to_ns = report.stamp_ns.max(report.arrival_ns);
        let off_rad = self.commanded.distance(&report.q, from_ns, to_ns);
        (off_rad > t.tracking_error_max_rad).then_some(FaultCode::TrackingError)
    }
}

/// Faults the command link itself shows.
fn link_fault(link: &LinkInput) -> Option<FaultCode> {
    if link.lost {
        return Some(FaultCode::LinkLost);
    }
    let status = link.status?;
    if status.has_error() {
        Some(FaultCode::ArmError)
    } else if !status.accepts_motion() {
        Some(FaultCode::ArmNotReady)
    } else {
        None
    }
}
