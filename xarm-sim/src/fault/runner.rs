//! Which faults of a script are on at a time.

use super::kind::{FaultKind, Lasts};
use super::script::{Fault, FaultScript, Trigger};
use shared_types::MonotonicNs;

/// Speed under which the arm is not being moved (rad/s).
const RESTING_RAD_S: f64 = 1e-3;
/// Rest that separates two motions (s).
const REST_S: f64 = 0.1;

/// What the triggers look at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Progress {
    /// Time since the arm was switched on (s).
    pub(crate) elapsed_s: f64,
    /// Motion commands that the arm took up.
    pub(crate) setpoints: u64,
    /// Speed that is asked of the fastest joint (rad/s).
    pub(crate) speed_rad_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Stage {
    Waiting,
    On { until: Option<MonotonicNs> },
    Over,
}

/// Runs a script.
#[derive(Debug, Clone)]
pub(crate) struct FaultRunner {
    entries: Vec<(Fault, Stage)>,
    motion: MotionWatch,
}

impl FaultRunner {
    pub(crate) fn new(script: &FaultScript) -> Self {
        let waiting = |fault: &Fault| (*fault, Stage::Waiting);
        Self {
            entries: script.faults.iter().map(waiting).collect(),
            motion: MotionWatch::default(),
        }
    }

    /// Adds a fault to the running script.
    pub(crate) fn add(&mut self, fault: Fault) {
        self.entries.push((fault, Stage::Waiting));
    }

    /// The faults that are on.
    pub(crate) fn active(&self) -> impl Iterator<Item = &FaultKind> {
        self.entries
            .iter()
            .filter(|(_, stage)| matches!(stage, Stage::On { .. }))
            .map(|(fault, _)| &fault.kind)
    }

    /// Whether a fault like that is on.
    pub(crate) fn any(&self, like: impl Fn(&FaultKind) -> bool) -> bool {
        self.active().any(like)
    }

    /// What begins (or ends) at `now`, in the order of the script: the entry's number from
    /// 1, its kind, and whether it begins.
    pub(crate) fn update(
        &mut self,
        now: MonotonicNs,
        seen: Progress,
    ) -> Vec<(usize, FaultKind, bool)> {
        self.motion.update(now, seen.speed_rad_s);
        let motion = &self.motion;
        let mut changes = Vec::new();
        for (index, (fault, stage)) in self.entries.iter_mut().enumerate() {
            let change = |begins| (index + 1, fault.kind, begins);
            if *stage == Stage::Waiting && is_due(fault.trigger, now, seen, motion) {
                changes.push(change(true));
                *stage = if fault.kind.lasts() == Lasts::Moment {
                    Stage::Over
                } else {
                    let until = fault.duration_s.map(|s| now.plus_s(s));
                    Stage::On { until }
                };
            }
            if let Stage::On { until: Some(until) } = *stage
                && now >= until
            {
                changes.push(change(false));
                *stage = Stage::Over;
            }
        }
        changes
    }
}

fn is_due(trigger: Trigger, now: MonotonicNs, seen: Progress, motion: &MotionWatch) -> bool {
    match trigger {
        Trigger::At(at_s) => seen.elapsed_s >= at_s,
        Trigger::Setpoint(count) => seen.setpoints >= count,
        Trigger::Motion {
            part,
            length_s,
            number,
        } => {
            motion.number > number
                || (motion.number == number && now.since_s(motion.began) >= part * length_s)
        }
        Trigger::Speed(speed_rad_s) => seen.speed_rad_s >= speed_rad_s,
    }
}

/// Counts motions by the speed that is asked of the joints.
#[derive(Debug, Clone, Copy, Default)]
struct MotionWatch {
    number: u32,
    began: MonotonicNs,
    last_moving: Option<MonotonicNs>,
}

impl MotionWatch {
    fn update(&mut self, now: MonotonicNs, speed_rad_s: f64) {
        if speed_rad_s < RESTING_RAD_S {
            return;
        }
        if self
            .last_moving
            .is_none_or(|last| now.since_s(last) > REST_S)
        {
            self.number += 1;
            self.began = now;
        }
        self.last_moving = Some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(text: &str, speed: impl Fn(f64) -> f64) -> Vec<(u64, usize, bool)> {
        let script: FaultScript = text.parse().unwrap();
        let mut runner = FaultRunner::new(&script);
        let mut seen = Vec::new();
        for ms in 0..3000_u64 {
            let elapsed_s = ms as f64 * 1e-3;
            let progress = Progress {
                elapsed_s,
                setpoints: ms / 4,
                speed_rad_s: speed(elapsed_s),
            };
            let changes = runner.update(MonotonicNs(ms * 1_000_000), progress);
            seen.extend(
                changes
                    .iter()
                    .map(|(entry, _, begins)| (ms, *entry, *begins)),
            );
        }
        seen
    }

    #[test]
    fn faults_begin_by_time_count_motion_and_speed() {
        let text = r#"
            [[fault]]
            at_s = 0.5
            kind = "stall"
            duration_s = 0.19
            [[fault]]
            on = "setpoint:250"
            kind = "collision"
            [[fault]]
            on = "motion:50"
            motion = 2
            motion_s = 0.4
            kind = "report_stop"
            [[fault]]
            on = "speed:2"
            kind = "collision"
        "#;
        // Two motions of 0.4 s; the second is faster towards its end.
        let speed = |t: f64| match t {
            t if (1.2..1.6).contains(&t) => 1.0,
            t if (2.0..2.4).contains(&t) => 1.0 + 4.0 * (t - 2.0),
            _ => 0.0,
        };
        let want = [
            (500, 1, true),
            (690, 1, false),
            (1000, 2, true),
            (2200, 3, true),
            (2250, 4, true),
        ];
        let got = run(text, speed);
        assert_eq!(got.len(), want.len(), "{got:?}");
        for (got, want) in got.iter().zip(want) {
            assert!(got.0.abs_diff(want.0) <= 1, "{got:?} {want:?}");
            assert_eq!((got.1, got.2), (want.1, want.2));
        }
    }
}
