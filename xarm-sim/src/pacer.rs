//! How often motion commands are taken up: the newest, at most once per cycle.

use serde::{Deserialize, Serialize};
use shared_types::MonotonicNs;

/// How early a command may be and still be taken at once (s).
const JITTER_S: f64 = 0.002;
/// A longer pause ends the controller's own grid (s).
const GRID_PAUSE_S: f64 = 0.1;

/// Whose clock paces the commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Intake {
    /// A command is taken when it arrives, unless that would exceed the rate.
    #[default]
    Arrival,
    /// The controller looks once per cycle of its own clock.
    Clock,
}

/// Keeps the newest command until its turn.
#[derive(Debug, Clone, Default)]
pub(super) struct Pacer<T> {
    waiting: Option<(MonotonicNs, T)>,
    /// When the next command may be taken.
    due: MonotonicNs,
    /// Commands overwritten before their turn.
    pub(super) dropped: u64,
    /// Cycles of the grid that found no new command.
    pub(super) repeated: u64,
}

impl<T: Copy> Pacer<T> {
    /// Forgets the command that waits.
    pub(super) fn clear(&mut self) {
        self.waiting = None;
    }

    /// A newer command.
    pub(super) fn offer(&mut self, at: MonotonicNs, command: T) {
        self.dropped += u64::from(self.waiting.is_some());
        self.waiting = Some((at, command));
    }

    /// The command to execute at or before `now`, if its turn has come, and
    /// when that was. A cycle takes `cycle_s`.
    pub(super) fn take(
        &mut self,
        now: MonotonicNs,
        cycle_s: f64,
        intake: Intake,
    ) -> Option<(MonotonicNs, T)> {
        let (arrived, command) = self.waiting?;
        let at = match intake {
            Intake::Arrival => arrived.max(self.due.plus_s(-JITTER_S)),
            Intake::Clock => self.next_of_grid(arrived, cycle_s),
        };
        if at > now {
            return None;
        }
        self.waiting = None;
        self.due = self.due.max(at).plus_s(cycle_s);
        Some((at, command))
    }

    /// The first point of the grid at or after `arrived`; those that passed
    /// without a command are counted.
    fn next_of_grid(&mut self, arrived: MonotonicNs, cycle_s: f64) -> MonotonicNs {
        if arrived.since_s(self.due) > GRID_PAUSE_S {
            self.due = arrived;
        }
        while self.due < arrived {
            self.due = self.due.plus_s(cycle_s);
            self.repeated += 1;
        }
        self.due
    }
}
