//! Watches over everything that may go wrong while the arm is commanded.
//!
//! Pure: time is the cycle's planned deadline; nothing here reads a clock.
//! [`Monitor::violation`] is the fault table: one line per cause, the most urgent
//! first; how each is met is in [`super::reaction`].

pub mod history;
pub mod prediction;
pub mod reports;

use super::exchange::{CycleInput, LinkInput};
use super::reaction::{StopCategory, reaction};
use super::settings::ControlSettings;
use super::violation::Violation;
use arm_model::{JointVector, Limits};
use reports::ReportWatch;
use serde::{Deserialize, Serialize};
use shared_types::FaultCode;
use shared_types::ipc::{ControllerMode, RunCounts};

/// Reports lag behind a change of mode by up to 0.2 s (field experience with
/// the vendor's SDK), so state, mode and codes count only this long after
/// bring-up. No bring-up is done before.
pub const SETTLE_NS: u64 = 300_000_000;

/// A heartbeat: its count and when it last changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
struct Heartbeat {
    count: u64,
    at_ns: u64,
}

impl Heartbeat {
    fn received(&mut self, count: u64, now_ns: u64) {
        if count != self.count {
            *self = Self {
                count,
                at_ns: now_ns,
            };
        }
    }

    const fn silent_ns(&self, now_ns: u64) -> u64 {
        now_ns.saturating_sub(self.at_ns)
    }
}

/// What the monitors remember from cycle to cycle. RT-safe.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Monitor {
    settings: ControlSettings,
    pub(super) reports: ReportWatch,
    engaged_ns: u64,
    operator: Heartbeat,
    guardian: Heartbeat,
    counts: RunCounts,
    arm_error: u8,
    arm_warning: u8,
    /// The link broke or stalled since the engagement. For the guardian only, so it is no
    /// part of a recorded state.
    #[serde(skip)]
    pub(super) link_failed: bool,
}

impl Monitor {
    /// Nothing seen yet; the arm holds `q` since `now_ns`.
    #[must_use]
    pub fn new(settings: ControlSettings, now_ns: u64, q: JointVector) -> Self {
        Self {
            settings,
            reports: ReportWatch::holding(q),
            engaged_ns: now_ns,
            operator: Heartbeat::default(),
            guardian: Heartbeat::default(),
            counts: RunCounts::default(),
            arm_error: 0,
            arm_warning: 0,
            link_failed: false,
        }
    }

    /// The same for a new engagement: whose heart stopped before it is not taken to live.
    #[must_use]
    pub fn engaged(&self, now_ns: u64, q: JointVector) -> Self {
        let fresh = Self::new(self.settings, now_ns, q);
        let reports = fresh
            .reports
            .predicted_by(self.reports.prediction.as_ref(), q);
        Self {
            operator: self.operator,
            guardian: self.guardian,
            reports,
            ..fresh
        }
    }

    /// How far the arm is behind what was commanded (rad); zero where its reports are too old
    /// to tell.
    #[must_use]
    pub fn deviation(&self, now_ns: u64) -> JointVector {
        let stale = self.reports.stale(now_ns, &self.settings.thresholds);
        stale.map_or_else(|| self.reports.deviation(), |_| JointVector::ZERO)
    }

    /// A setpoint was held back: too many wait for their reply.
    pub const fn held_back(&mut self) {
        self.counts.skipped = self.counts.skipped.saturating_add(1);
    }

    /// What marked the run so far.
    #[must_use]
    pub const fn counts(&self) -> RunCounts {
        self.counts
    }

    /// The arm's error and warning codes as far as known.
    #[must_use]
    pub const fn arm_codes(&self) -> (u8, u8) {
        (self.arm_error, self.arm_warning)
    }

    /// How far the arm stands from everything commanded lately (rad).
    #[must_use]
    pub fn tracking_error_rad(&self) -> f64 {
        let window_ns = self.settings.thresholds.tracking_window_ns;
        self.reports.tracking_error(window_ns).1
    }

    /// Takes in what came with this cycle.
    pub fn observe(&mut self, input: &CycleInput, limits: &Limits) {
        let now_ns = input.deadline_ns;
        self.reports.predict(now_ns);
        self.operator.received(input.operator.count, now_ns);
        if input.guardian.guards() {
            self.guardian.received(input.guardian.count, now_ns);
        }
        let (link, counts) = (&input.link, &mut self.counts);
        self.link_failed |=
            link.lost || link.unanswered_ns > self.settings.thresholds.reply_stall_ns;
        let add = |count: &mut u32, more: u32| *count = count.saturating_add(more);
        add(&mut counts.missed, input.missed);
        add(&mut counts.duplicates, link.duplicates.into());
        add(&mut counts.out_of_order, link.out_of_order.into());
        add(&mut counts.skipped, link.skipped.into());
        add(&mut counts.broken_reports, input.broken_reports);
        let warning = link.status.is_some_and(crate::xarm::Status::has_warning);
        add(&mut counts.warnings, warning.into());
        self.reports.broken(input.broken_reports);
        let window_ns = self.settings.thresholds.tracking_window_ns;
        for report in input.reports.as_slice() {
            if report.q.is_finite() && report.qd.is_finite() {
                let resync = self.reports.take(report, window_ns, limits);
                add(&mut self.counts.clock_resyncs, resync.into());
            } else {
                self.reports.broken(1);
                add(&mut self.counts.broken_reports, 1);
            }
        }
        if let Some(codes) = input.codes
            && codes.arrival_ns.saturating_sub(self.engaged_ns) > SETTLE_NS
        {
            (self.arm_error, self.arm_warning) = (codes.error, codes.warning);
        }
    }

    /// Why no motion may begin now, if anything speaks against it.
    #[must_use]
    pub fn refusal(&self, now_ns: u64) -> Option<FaultCode> {
        self.reports
            .stale(now_ns, &self.settings.thresholds)
            .or_else(|| self.guardian_silent(now_ns))
            .or_else(|| self.operator_silent(now_ns))
            .map(|found| found.fault)
    }

    /// The first fault whose reaction is harder than `than`, the most urgent
    /// first; `missed` cycles went by without a setpoint. Not asked in `Offline` and `Faulted`. RT-safe.
    #[must_use]
    pub fn violation(
        &self,
        input: &CycleInput,
        missed: u32,
        mode: ControllerMode,
        than: StopCategory,
    ) -> Option<Violation> {
        let harder = |found: &Violation| reaction(found.fault).path > than;
        let pick = |found: Option<Violation>| found.filter(harder);
        let (now_ns, t) = (input.deadline_ns, &self.settings.thresholds);
        pick(link_fault(&input.link))
            .or_else(|| pick(self.arm_fault()))
            .or_else(|| pick(self.commander_fault(input)))
            .or_else(|| pick(stall(&input.link, t.reply_stall_ns)))
            .or_else(|| {
                pick(
                    (input.operator.stop != 0).then_some(Violation::plain(FaultCode::OperatorStop)),
                )
            })
            .or_else(|| {
                if !mode.is_moving() {
                    return pick(self.drifting(now_ns));
                }
                pick(skipped(
                    FaultCode::DeadlineMissed,
                    missed,
                    t.missed_cycles_max,
                ))
                .or_else(|| pick(self.operator_fault(input)))
                .or_else(|| pick(skipped(FaultCode::LateCycles, missed, t.late_cycles_max)))
                .or_else(|| pick(self.reports.stream_fault(t)))
                .or_else(|| pick(self.reports.stale(now_ns, t)))
                .or_else(|| pick(self.reports.tracking_fault(t)))
                .or_else(|| pick(self.guardian_silent(now_ns)))
            })
    }

    /// An error of its own, or another program or a stop button took the arm
    /// out of its streaming mode.
    fn arm_fault(&self) -> Option<Violation> {
        if self.arm_error != 0 {
            return Some(Violation::plain(FaultCode::ArmError));
        }
        let report = self.reports.newest()?;
        let settled = report.arrival_ns.saturating_sub(self.engaged_ns) > SETTLE_NS;
        // States 1 (moving) and 2 (ready) follow setpoints.
        let serving = report.arm_mode == self.settings.interface.arm_mode()
            && matches!(report.arm_state, 1 | 2);
        let (found, expected) = (
            report.arm_mode.into(),
            self.settings.interface.arm_mode().into(),
        );
        let changed = Violation::new(FaultCode::ArmModeChanged, found, expected);
        (settled && !serving).then_some(changed)
    }

    fn commander_fault(&self, input: &CycleInput) -> Option<Violation> {
        if input.link.foreign > 0 {
            let found = f64::from(input.link.foreign);
            return Some(Violation::new(FaultCode::SecondCommander, found, 0.0));
        }
        let position = self.settings.interface == shared_types::CommandInterface::ServoPosition;
        let settled = input.deadline_ns.saturating_sub(self.engaged_ns) > SETTLE_NS;
        (position && settled)
            .then(|| self.reports.foreign_target())
            .flatten()
    }

    fn operator_fault(&self, input: &CycleInput) -> Option<Violation> {
        if input.operator.released != 0 {
            return Some(Violation::plain(FaultCode::DeadManReleased));
        }
        self.operator_silent(input.deadline_ns)
    }

    fn operator_silent(&self, now_ns: u64) -> Option<Violation> {
        let most_ns = self.settings.thresholds.operator_timeout_ns;
        let silent_ns = self.operator.silent_ns(now_ns);
        (silent_ns > most_ns)
            .then(|| Violation::of_time(FaultCode::OperatorLost, silent_ns, most_ns))
    }

    /// At rest only joint velocities need reports, once they have come: without them nothing
    /// holds the pose.
    fn drifting(&self, now_ns: u64) -> Option<Violation> {
        let holds = self.settings.interface == shared_types::CommandInterface::ServoPosition;
        self.reports.newest().filter(|_| !holds)?;
        self.reports.stale(now_ns, &self.settings.thresholds)
    }

    fn guardian_silent(&self, now_ns: u64) -> Option<Violation> {
        let most_ns = self.settings.thresholds.guardian_timeout_ns;
        let silent_ns = self.guardian.silent_ns(now_ns);
        (self.settings.guardian_required && silent_ns > most_ns)
            .then(|| Violation::of_time(FaultCode::GuardianLost, silent_ns, most_ns))
    }
}

fn stall(link: &LinkInput, most_ns: u64) -> Option<Violation> {
    (link.unanswered_ns > most_ns)
        .then(|| Violation::of_time(FaultCode::ReplyStalled, link.unanswered_ns, most_ns))
}

/// Cycles missed: some, or so many that the arm has stood still meanwhile.
fn skipped(fault: FaultCode, missed: u32, most: u32) -> Option<Violation> {
    (missed > most).then(|| Violation::new(fault, missed.into(), most.into()))
}

/// Faults the command link itself shows.
fn link_fault(link: &LinkInput) -> Option<Violation> {
    if link.lost {
        return Some(Violation::plain(FaultCode::LinkLost));
    }
    let status = link.status?;
    if status.has_error() {
        Some(Violation::plain(FaultCode::ArmError))
    } else {
        (!status.accepts_motion()).then_some(Violation::plain(FaultCode::ArmNotReady))
    }
}
