//! Why the arm was stopped, or how close it came to it.

use super::cycle_sample::{CycleSample, Figures, RunLog, WorstJoint};
use super::margins::{Margin, smallest_margins};
use rt_controller::xarm::ErrorCode;
use serde::Serialize;
use shared_types::ipc::{CauseRecord, ControllerMode, RunCounts};
use shared_types::{FaultCode, MonotonicNs, OperatingMode};

/// Ends of the rows around a stop (ms); a row covers what lies between the end
/// before and its own.
const ROWS_MS: [f64; 16] = [
    -500.0, -200.0, -100.0, -50.0, -20.0, -8.0, -4.0, 0.0, 4.0, 8.0, 20.0, 50.0, 100.0, 200.0,
    500.0, 1000.0,
];
/// Begin of the first row (ms).
const BEGIN_MS: f64 = -1001.0;
/// The arm's own code may come this long after the stop (ms).
const CODE_WITHIN_MS: f64 = 1000.0;

/// What the file says about a whole run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// Whether the arm was stopped by anything but the orderly end.
    pub stopped: bool,
    /// Cycles read.
    pub cycles: usize,
    /// Time they span (s).
    pub duration_s: f64,
    /// Every stop, in order.
    pub stops: Vec<Stop>,
    /// Whether the controller was ended while the arm rested.
    pub ended_in_order: bool,
    /// How close the run came to its limits.
    pub margins: Vec<Margin>,
    /// What is missing in the recording.
    pub flaws: Vec<String>,
}

/// Which limit was broken and by how much.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LimitExceeded {
    /// Joint 1 to 7, if it is about one.
    pub joint: Option<u32>,
    /// What was found.
    pub value: f64,
    /// What is allowed.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
}

/// One stop.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stop {
    /// Cause.
    pub code: FaultCode,
    /// Its number.
    pub number: u16,
    /// What happened.
    pub what: String,
    /// What to do.
    pub remedy: String,
    /// What made the stop harder on the way.
    pub second: Option<FaultCode>,
    /// The arm's own error code, 0 for none.
    pub arm_error: u8,
    /// What that code means.
    pub arm_error_meaning: Option<String>,
    /// The arm's own warning code, 0 for none.
    pub arm_warning: u8,
    /// Cycle in which it was noticed.
    pub cycle: u64,
    /// When (s from the first cycle).
    pub time_s: f64,
    /// Mode then.
    pub mode: ControllerMode,
    /// Armed operating mode.
    pub operating_mode: Option<&'static str>,
    /// Motion that ran.
    pub motion: Option<u64>,
    /// Time on it (s).
    pub motion_s: Option<f64>,
    /// What the controller did.
    pub reaction: &'static str,
    /// Whether the arm itself was asked to stop.
    pub arm_asked_to_stop: bool,
    /// Time from the cause to setpoints at rest (s); none where they ended before.
    pub rest_after_s: Option<f64>,
    /// Which limit.
    pub limit_exceeded: Option<LimitExceeded>,
    /// The setpoint that was sent latest in the second before.
    pub latest_setpoint: Option<Late>,
    /// What happened since the arm was engaged.
    pub counts: RunCounts,
    /// The second before and the second after.
    pub cycles_around: Vec<Row>,
}

/// A setpoint that was sent late, and what the arm made of it: it takes setpoints
/// as they come, so one that covers more motion than the arm had time for breaks
/// its speed limits.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Late {
    /// Cycle of the setpoint.
    pub cycle: u64,
    /// From its planned wake-up until it was sent (ms).
    pub late_ms: f64,
    /// Motion covered by the setpoint after it (ms at full speed override).
    pub next_covered_ms: Option<f64>,
    /// Time between the two on the wire (ms).
    pub next_came_after_ms: Option<f64>,
}

/// Some cycles around a stop.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// End of the row (ms from the cause).
    pub until_ms: f64,
    /// The worst of them; mode, motion and what is allowed at its end.
    #[serde(flatten)]
    pub figures: Figures,
}

/// Explains a recording.
pub fn explain(log: &RunLog) -> Explanation {
    let (ends, stops): (Vec<_>, Vec<_>) = log.causes.iter().partition(|c| is_orderly_end(c));
    let last = log.samples.last();
    Explanation {
        stopped: !stops.is_empty(),
        cycles: log.samples.len(),
        duration_s: last.map_or(0.0, |m| log.time_s(m.deadline_ns)),
        stops: stops.into_iter().map(|c| stop(log, c)).collect(),
        ended_in_order: !ends.is_empty(),
        margins: smallest_margins(log),
        flaws: log.flaws.clone(),
    }
}

/// A controller that ends tells its loop to stop; with the arm at rest nothing
/// is stopped by that.
pub(crate) fn is_orderly_end(cause: &CauseRecord) -> bool {
    cause.fault() == FaultCode::OperatorStop && cause.mode == ControllerMode::Idle as u8
}

fn stop(log: &RunLog, cause: &CauseRecord) -> Stop {
    let code = cause.fault();
    let (what, remedy) = code
        .explain()
        .split_once("; ")
        .unwrap_or((code.explain(), ""));
    let arm_error = arm_error(log, cause);
    let rest_ns = log
        .samples
        .iter()
        .find(|m| m.cycle == cause.rest_cycle)
        .map_or(cause.stamp_ns, |m| m.deadline_ns);
    Stop {
        code,
        number: cause.code,
        what: what.to_owned(),
        remedy: remedy.to_owned(),
        second: FaultCode::from_raw(cause.second_code).filter(|c| *c != FaultCode::None),
        arm_error,
        arm_error_meaning: (arm_error != 0).then(|| ErrorCode(arm_error).to_string()),
        arm_warning: cause.arm_warning,
        cycle: cause.cycle,
        time_s: log.time_s(cause.stamp_ns),
        mode: ControllerMode::from_raw(cause.mode),
        operating_mode: OperatingMode::from_raw(cause.operating_mode).map(operating_mode_name),
        motion: Some(cause.motion_id).filter(|id| *id != 0),
        motion_s: Some(cause.trajectory_s).filter(|t| *t >= 0.0),
        reaction: reaction(cause.path),
        arm_asked_to_stop: cause.stop_arm != 0,
        rest_after_s: (cause.path < SETPOINTS_ENDED)
            .then(|| log.time_s(rest_ns) - log.time_s(cause.stamp_ns)),
        limit_exceeded: limit_exceeded(cause),
        latest_setpoint: latest_setpoint(log, cause.stamp_ns),
        counts: cause.counts,
        cycles_around: cycles_around(log, cause.stamp_ns),
    }
}

const fn operating_mode_name(operating_mode: OperatingMode) -> &'static str {
    match operating_mode {
        OperatingMode::SetUp => "set-up",
        OperatingMode::Wiggle => "wiggle",
        OperatingMode::Throw => "throw",
    }
}

/// The core knows the arm's code only if the arm had said it by then; five times
/// a second it does.
fn arm_error(log: &RunLog, cause: &CauseRecord) -> u8 {
    if cause.arm_error != 0 {
        return cause.arm_error;
    }
    log.samples
        .iter()
        .filter(|m| (0.0..=CODE_WITHIN_MS).contains(&since_ms(m, cause.stamp_ns)))
        .find_map(|m| m.arm_error)
        .unwrap_or(0)
}

/// The stop path from which setpoints end at once.
const SETPOINTS_ENDED: u8 = 3;

const fn reaction(path: u8) -> &'static str {
    match path {
        0 => "refused",
        1 => "slowed to rest along the path",
        2 => "braked, every joint by itself",
        _ => "no setpoints any more",
    }
}

fn limit_exceeded(cause: &CauseRecord) -> Option<LimitExceeded> {
    let found = &cause.limit;
    (found.value != 0.0 || found.limit != 0.0).then(|| LimitExceeded {
        joint: Some(found.joint).filter(|j| *j != 0),
        value: found.value,
        limit: found.limit,
        unit: unit(cause.fault(), found.joint),
    })
}

/// Unit of a cause's numbers, as [`shared_types::ipc::LimitBroken`] says; `joint`
/// is 0 for the tool.
const fn unit(code: FaultCode, joint: u32) -> &'static str {
    use FaultCode as F;
    match code {
        // The speed that was nearest to its limit.
        F::ArmError if joint == 0 => "m/s",
        F::ArmError | F::SetpointVelocity => "rad/s",
        F::SetpointAcceleration => "rad/s²",
        F::SetpointJerk => "rad/s³",
        F::SetpointTcpSpeed | F::OperatingModeExceeded => "m/s",
        F::SetpointStep => "m",
        F::DeadlineMissed | F::LateCycles => "cycles",
        F::OperatorLost
        | F::GuardianLost
        | F::ReplyStalled
        | F::ReportStale
        | F::ReportFrozen
        | F::ArmingExpired
        | F::UploadTimedOut => "s",
        F::ReportBroken | F::ReportClock => "times",
        F::SetpointPosition
        | F::SetpointUnstoppable
        | F::TrackingError
        | F::JointStuck
        | F::EncoderJump
        | F::SecondCommander
        | F::StartPoseMismatch => "rad",
        _ => "",
    }
}

fn between_ms(later_ns: u64, earlier_ns: u64) -> f64 {
    MonotonicNs(later_ns).since_s(MonotonicNs(earlier_ns)) * 1e3
}

fn since_ms(sample: &CycleSample, stamp_ns: u64) -> f64 {
    between_ms(sample.deadline_ns, stamp_ns)
}

fn cycles_around(log: &RunLog, stamp_ns: u64) -> Vec<Row> {
    let mut from_ms = BEGIN_MS;
    let mut rows = Vec::new();
    for until_ms in ROWS_MS {
        // Deadlines lie on a grid of whole milliseconds, give or take rounding.
        let within = |m: &&CycleSample| {
            let at_ms = since_ms(m, stamp_ns) - 0.5;
            at_ms > from_ms && at_ms <= until_ms
        };
        let covered: Vec<&CycleSample> = log.samples.iter().filter(within).collect();
        rows.extend(row(until_ms, &covered));
        from_ms = until_ms;
    }
    rows
}

fn row(until_ms: f64, samples: &[&CycleSample]) -> Option<Row> {
    let last = samples.last()?.figures;
    let figures = || samples.iter().map(|m| &m.figures);
    let most = |of: fn(&Figures) -> Option<f64>| figures().filter_map(of).max_by(f64::total_cmp);
    Some(Row {
        until_ms,
        figures: Figures {
            speed: WorstJoint::worst(figures().map(|f| f.speed)),
            acceleration: WorstJoint::worst(figures().map(|f| f.acceleration)),
            tool_m_s: most(|f| Some(f.tool_m_s)).unwrap_or(0.0),
            link_ms: most(|f| Some(f.link_ms)).unwrap_or(0.0),
            report_ms: most(|f| f.report_ms),
            missed: figures().map(|f| f.missed).sum(),
            late_ms: most(|f| f.late_ms),
            ..last
        },
    })
}

/// The setpoint of the second before the stop that was sent latest, and the one
/// after it.
fn latest_setpoint(log: &RunLog, stamp_ns: u64) -> Option<Late> {
    let sent: Vec<(&CycleSample, f64)> = log
        .samples
        .iter()
        .filter(|m| (BEGIN_MS..=0.5).contains(&since_ms(m, stamp_ns)))
        .filter_map(|m| Some((m, m.figures.late_ms?)))
        .collect();
    let (at, _) = sent
        .iter()
        .enumerate()
        .max_by(|(_, a), (_, b)| a.1.total_cmp(&b.1))?;
    let (sample, late_ms) = sent[at];
    let next = sent.get(at + 1);
    Some(Late {
        cycle: sample.cycle,
        late_ms,
        next_covered_ms: next.map(|(after, _)| {
            match (sample.figures.motion_s, after.figures.motion_s) {
                (Some(from_s), Some(to_s)) if to_s >= from_s => 1e3 * (to_s - from_s),
                _ => since_ms(after, sample.deadline_ns),
            }
        }),
        next_came_after_ms: next
            .map(|(after, late)| between_ms(after.planned_ns, sample.planned_ns) + late - late_ms),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::Limits;
    use rt_controller::control::{ControlSettings, Thresholds};
    use shared_types::ipc::LimitBroken;

    const PERIOD_NS: u64 = 4_000_000;

    fn sample(cycle: u64) -> CycleSample {
        CycleSample {
            cycle,
            deadline_ns: cycle * PERIOD_NS,
            planned_ns: cycle * PERIOD_NS,
            figures: Figures {
                mode: if cycle <= 300 {
                    ControllerMode::Streaming
                } else {
                    ControllerMode::Faulted
                },
                motion_s: Some(0.5),
                tool_m_s: f64::from(u8::from(cycle == 299)),
                tool_max_m_s: 1.2,
                report_ms: Some(3.0),
                missed: u32::from(cycle == 290),
                late_ms: Some(if cycle == 289 { 3.4 } else { 0.2 }),
                ..Figures::default()
            },
            arm_error: (cycle == 340).then_some(31),
            ..CycleSample::default()
        }
    }

    fn log(causes: Vec<CauseRecord>) -> RunLog {
        RunLog {
            samples: (1..=700).map(sample).collect(),
            causes,
            limits: Limits::default(),
            settings: ControlSettings::from(Thresholds::strict()),
            flaws: Vec::new(),
        }
    }

    fn cause() -> CauseRecord {
        CauseRecord {
            code: FaultCode::TrackingError as u16,
            mode: ControllerMode::Streaming as u8,
            path: 2,
            stop_arm: 1,
            cycle: 300,
            stamp_ns: 300 * PERIOD_NS,
            rest_cycle: 324,
            limit: LimitBroken {
                joint: 4,
                value: 0.071,
                limit: 0.05,
                ..LimitBroken::default()
            },
            ..CauseRecord::default()
        }
    }

    #[test]
    fn a_stop_is_told_with_its_numbers_and_its_surroundings() {
        let found = explain(&log(vec![cause()]));
        assert!(found.stopped && !found.ended_in_order);
        let stop = &found.stops[0];
        let exceeded = stop.limit_exceeded.as_ref().unwrap();
        assert_eq!((exceeded.joint, exceeded.unit), (Some(4), "rad"));
        assert_eq!(stop.arm_error, 31, "said 160 ms after the stop");
        assert!((stop.rest_after_s.unwrap() - 0.096).abs() < 1e-9);
        assert!((stop.time_s - 1.196).abs() < 1e-9);
        assert!(!stop.remedy.is_empty());
        // Every cycle from a second before to a second after is in one row.
        let missed: u32 = stop.cycles_around.iter().map(|r| r.figures.missed).sum();
        assert_eq!((stop.cycles_around.len(), missed), (ROWS_MS.len(), 1));
        let mut around = stop.cycles_around.iter();
        let before = around.find(|r| r.until_ms == -4.0).unwrap();
        assert_eq!(before.figures.tool_m_s, 1.0);
        let late = stop.latest_setpoint.as_ref().unwrap();
        assert_eq!((late.cycle, late.late_ms), (289, 3.4));
        assert!((late.next_came_after_ms.unwrap() - 0.8).abs() < 1e-9);
        let page = super::super::show(&found);
        for word in [
            "setpoint 289 was sent 3.4 ms late",
            "joint 4: 0.0710 rad",
            "+42.0 %",
            "at rest after 96 ms",
            "C31",
        ] {
            assert!(page.contains(word), "`{word}` is not in\n{page}");
        }
        let mut before_the_first_cycle = log(vec![cause()]);
        before_the_first_cycle.samples.clear();
        let page = super::super::show(&explain(&before_the_first_cycle));
        assert!(page.contains("STOPPED") && !page.contains("until ms"));
    }

    #[test]
    fn a_controller_that_is_ended_at_rest_was_not_stopped() {
        let end = CauseRecord {
            code: FaultCode::OperatorStop as u16,
            mode: ControllerMode::Idle as u8,
            cycle: 690,
            ..cause()
        };
        let found = explain(&log(vec![end]));
        assert!(!found.stopped && found.ended_in_order && found.stops.is_empty());
        let page = super::super::show(&found);
        assert!(
            page.contains("NOT STOPPED") && page.contains("tool speed"),
            "{page}"
        );
        let moving = CauseRecord {
            mode: ControllerMode::Streaming as u8,
            ..end
        };
        assert!(explain(&log(vec![moving])).stopped);
    }
}
