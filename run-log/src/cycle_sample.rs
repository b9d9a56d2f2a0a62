//! A recording as a row of samples: what a person wants to know of each cycle.

use arm_model::{JOINTS, JointVector, Limits};
use rt_controller::control::ControlSettings;
use rt_controller::recording::{Item, LogError, LogReader, Read, RecordedCycle};
use serde::Serialize;
use shared_types::ipc::{CauseRecord, CommandKind, ControllerMode};
use shared_types::{MonotonicNs, OperatingMode};

/// Setpoints farther apart than this say nothing about speed (s).
const APART_MAX_S: f64 = 0.1;

/// The joint that comes closest to its limit. 0 stands for none.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct WorstJoint {
    /// Joint 1 to 7.
    pub joint: usize,
    /// Value, in the unit of the limit.
    pub value: f64,
    /// Its limit.
    pub limit: f64,
}

impl WorstJoint {
    /// Part of the limit (0 to 1 and beyond).
    pub fn fraction(&self) -> f64 {
        if self.limit > 0.0 {
            self.value.abs() / self.limit
        } else {
            0.0
        }
    }

    fn of(values: &JointVector, limits: &JointVector) -> Self {
        Self::worst((0..JOINTS).map(|j| Self {
            joint: j + 1,
            value: values[j],
            limit: limits[j],
        }))
    }

    /// The one of several that comes closest to its limit.
    pub(crate) fn worst(several: impl Iterator<Item = Self>) -> Self {
        several
            .max_by(|a, b| a.fraction().total_cmp(&b.fraction()))
            .unwrap_or_default()
    }
}

/// What is measured of a cycle against limits; or of several, each figure the worst.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Figures {
    /// Mode after it.
    pub mode: ControllerMode,
    /// Time on the motion (s), while one runs.
    pub motion_s: Option<f64>,
    /// How fast the path is followed.
    pub speed_override: f64,
    /// Commanded joint speed closest to its limit (rad/s).
    pub speed: WorstJoint,
    /// Commanded joint acceleration closest to its limit (rad/s²).
    pub acceleration: WorstJoint,
    /// Commanded tool speed (m/s).
    pub tool_m_s: f64,
    /// Tool speed that is allowed (m/s).
    pub tool_max_m_s: f64,
    /// Age of the oldest unanswered setpoint (ms).
    pub link_ms: f64,
    /// Age of the newest joint report (ms); none before the first.
    pub report_ms: Option<f64>,
    /// Cycles missed before it.
    pub missed: u32,
    /// From the planned wake-up until its setpoint was sent (ms), if one was.
    pub late_ms: Option<f64>,
}

/// One cycle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CycleSample {
    /// Number.
    pub cycle: u64,
    /// Instant its setpoint is for: the planned wake-up, or the real one where
    /// that was late (CLOCK_MONOTONIC, ns).
    pub deadline_ns: u64,
    /// Planned wake-up (CLOCK_MONOTONIC, ns).
    pub planned_ns: u64,
    /// Commanded joints (rad).
    pub q_c: JointVector,
    /// What is measured of it.
    pub figures: Figures,
    /// Error code of the arm, if it said one.
    pub arm_error: Option<u8>,
}

/// A recording, read.
#[derive(Debug)]
pub struct RunLog {
    /// Every cycle that could be read.
    pub samples: Vec<CycleSample>,
    /// Every stop.
    pub causes: Vec<CauseRecord>,
    /// Limits of the run.
    pub limits: Limits,
    /// Thresholds and the rest of the settings.
    pub settings: ControlSettings,
    /// Places where the recording does not go on as it should, in words.
    pub flaws: Vec<String>,
}

impl RunLog {
    /// Reads a recording.
    ///
    /// # Errors
    /// [`LogError`] when it is none; [`LogError::Foreign`] when it holds no
    /// keyframe this version can read.
    pub fn read(bytes: &[u8]) -> Result<Self, LogError> {
        let mut log = Self {
            samples: Vec::new(),
            causes: Vec::new(),
            limits: Limits::default(),
            settings: ControlSettings::from(rt_controller::control::Thresholds::relaxed()),
            flaws: Vec::new(),
        };
        let mut known = false;
        let mut differentiator = Differentiator::default();
        for read in LogReader::open(bytes)? {
            match read {
                Read::Flaw(flaw) => log.flaws.push(flaw.to_string()),
                Read::Item(Item::Cause(cause)) => log.causes.push(*cause),
                Read::Item(Item::Cycle(cycle)) => {
                    let sample = differentiator.sample(&cycle, &log.limits, &log.settings);
                    log.samples.push(sample);
                }
                Read::Item(Item::Keyframe(keyframe)) => {
                    let Some(state) = keyframe.state() else {
                        continue;
                    };
                    // An arming from before the recording shows only here.
                    let operating_mode = OperatingMode::from_raw(state.summary().operating_mode);
                    differentiator.operating_mode =
                        operating_mode.or(differentiator.operating_mode);
                    if !known {
                        log.limits = state.limits().clone();
                        log.settings = *state.settings();
                        known = true;
                    }
                }
                Read::Item(Item::Motion { .. }) => {}
            }
        }
        if known {
            Ok(log)
        } else {
            Err(LogError::Foreign)
        }
    }

    /// Seconds from the first cycle.
    pub fn time_s(&self, stamp_ns: u64) -> f64 {
        let first = self.samples.first().map_or(stamp_ns, |m| m.deadline_ns);
        MonotonicNs(stamp_ns).since_s(MonotonicNs(first))
    }
}

/// What is remembered from cycle to cycle to see speeds and ages.
#[derive(Debug, Default)]
struct Differentiator {
    before: Option<Sent>,
    report_ns: Option<u64>,
    operating_mode: Option<OperatingMode>,
}

/// A setpoint and how it moved.
#[derive(Debug, Clone, Copy)]
struct Sent {
    q: JointVector,
    /// Mean speed since the setpoint before (rad/s) and the time between (s).
    moved: Option<(JointVector, f64)>,
    at_ns: u64,
    tool_m: nalgebra::Vector3<f64>,
}

impl Differentiator {
    fn sample(
        &mut self,
        cycle: &RecordedCycle,
        limits: &Limits,
        settings: &ControlSettings,
    ) -> CycleSample {
        let (input, record) = (&cycle.input, &cycle.record);
        if CommandKind::from_raw(input.command.kind) == Some(CommandKind::Arm) {
            self.operating_mode = OperatingMode::from_raw(input.command.operating_mode);
        }
        let newest = input.reports.as_slice().last().map(|r| r.arrival_ns);
        self.report_ns = newest.or(self.report_ns);
        let mode = ControllerMode::from_raw(record.mode);
        let armed = self
            .operating_mode
            .filter(|_| settings.arming_required)
            .unwrap_or(OperatingMode::Throw);
        // Moves the controller makes itself are never faster than a wiggle.
        let operating_mode = if mode == ControllerMode::Moving && settings.arming_required {
            armed.min(OperatingMode::Wiggle)
        } else {
            armed
        };
        let age_ms = |from_ns: u64| input.deadline_ns.saturating_sub(from_ns) as f64 / 1e6;
        let late_ms = || (f64::from(record.wake_late_ns) + f64::from(record.send_ns)) / 1e6;
        let mut sample = CycleSample {
            cycle: record.cycle,
            deadline_ns: input.deadline_ns.saturating_add(input.late_ns.into()),
            planned_ns: input.deadline_ns,
            q_c: record.q_c,
            figures: Figures {
                mode,
                motion_s: Some(record.trajectory_s).filter(|t| *t >= 0.0),
                speed_override: record.speed_override,
                tool_max_m_s: settings.speeds.of(operating_mode, limits.tcp_speed_max_m_s),
                link_ms: input.link.unanswered_ns as f64 / 1e6,
                report_ms: self.report_ns.map(age_ms),
                missed: input.missed,
                late_ms: (record.sent != 0).then(late_ms),
                ..Figures::default()
            },
            arm_error: (input.codes.present != 0 && input.codes.error != 0)
                .then_some(input.codes.error),
        };
        self.speeds(&mut sample, record.sent != 0, limits);
        sample
    }

    /// Divided differences of the setpoints that were really sent.
    fn speeds(&mut self, sample: &mut CycleSample, sent: bool, limits: &Limits) {
        if !sent {
            self.before = None;
            return;
        }
        let mut now = Sent {
            q: sample.q_c,
            moved: None,
            at_ns: sample.deadline_ns,
            tool_m: limits.tool_centre_point_m(&sample.q_c),
        };
        if let Some(before) = self.before {
            let step_s = MonotonicNs(now.at_ns).since_s(MonotonicNs(before.at_ns));
            if step_s > 0.0 && step_s < APART_MAX_S {
                let qd = (now.q - before.q) * (1.0 / step_s);
                now.moved = Some((qd, step_s));
                sample.figures.speed = WorstJoint::of(&qd, &limits.velocity_max_rad_s);
                // Two mean speeds belong to the middles of their steps. What the arm
                // did before the first setpoint is not known.
                if let Some((qd_before, step_before_s)) = before.moved {
                    let apart_s = (step_s + step_before_s) / 2.0;
                    let qdd = (qd - qd_before) * (1.0 / apart_s);
                    sample.figures.acceleration =
                        WorstJoint::of(&qdd, &limits.acceleration_max_rad_s2);
                }
                sample.figures.tool_m_s = (now.tool_m - before.tool_m).norm() / step_s;
            }
        }
        self.before = Some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sent(differentiator: &mut Differentiator, at_ms: u64, q1: f64) -> CycleSample {
        let mut q = JointVector::ZERO;
        q[0] = q1;
        let mut sample = CycleSample {
            cycle: at_ms / 4,
            deadline_ns: at_ms * 1_000_000,
            planned_ns: at_ms * 1_000_000,
            q_c: q,
            ..CycleSample::default()
        };
        differentiator.speeds(&mut sample, true, &Limits::default());
        sample
    }

    /// q = a t²/2 from a start in motion, sampled with a cycle left out: the
    /// acceleration is `a` wherever it can be known, never more.
    #[test]
    fn acceleration_is_neither_invented_at_the_begin_nor_by_missed_cycles() {
        let (a, v0) = (6.0, 1.0);
        let q = |ms: u64| {
            let t = ms as f64 * 1e-3;
            v0 * t + a * t * t / 2.0
        };
        let mut differentiator = Differentiator::default();
        let seen: Vec<CycleSample> = [0, 4, 8, 20, 24, 28]
            .iter()
            .map(|ms| sent(&mut differentiator, *ms, q(*ms)))
            .collect();
        assert_eq!(seen[0].figures.speed, WorstJoint::default());
        assert_eq!(seen[1].figures.acceleration, WorstJoint::default());
        assert!((seen[1].figures.speed.value - (v0 + a * 0.002)).abs() < 1e-9);
        for sample in &seen[2..] {
            let found = sample.figures.acceleration;
            assert!((found.value - a).abs() < 1e-6, "{sample:?}");
        }
    }
}
