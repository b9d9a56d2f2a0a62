//! Stepping the core over a recording again.
//!
//! The core is a pure function of its state and its inputs: the same inputs
//! from the same state must give the same records and causes, bit for bit. At
//! every keyframe the whole state is compared as well.

use super::compare::{Unequal, cause_fields, cycle_fields, first_unequal};
use super::found::{Gap, Replay, ReplayError};
use super::item::{Item, Keyframe, RecordedCycle, Snapshot};
use super::log::{Flaw, LogError, LogReader, Read};
use crate::control::record::{RestoreError, restore_input};
use crate::control::{ControlEvent, ControlState, Motion};
use shared_types::FaultCode;
use shared_types::ipc::CauseRecord;
use std::collections::VecDeque;
use std::ops::RangeInclusive;

/// Motions remembered while reading; the running one is handed over to the core.
const MOTIONS: usize = 16;
/// A cause reaches the recording within this many cycles of its stop.
const CAUSE_WITHIN: u64 = 250;

/// Replays a recording from cycle `from_cycle` on (0 for all of it), beginning
/// at the last keyframe before.
///
/// # Errors
/// [`ReplayError`]; differences, gaps and damage are no errors but the result.
pub fn replay(bytes: &[u8], from_cycle: u64) -> Result<Replay, ReplayError> {
    let begin = last_keyframe_before(bytes, from_cycle)?;
    let mut player = Player {
        from_cycle,
        ..Player::default()
    };
    for (_, read) in LogReader::open(bytes)?
        .enumerate()
        .skip_while(|(n, _)| *n < begin)
    {
        match read {
            Read::Flaw(flaw) => player.flaw(flaw),
            Read::Item(Item::Keyframe(keyframe)) => player.keyframe(&keyframe),
            Read::Item(Item::Motion { id, motion }) => player.remember(id, motion),
            Read::Item(Item::Cycle(cycle)) => player.cycle(&cycle)?,
            Read::Item(Item::Cause(cause)) => player.recorded.push(*cause),
        }
    }
    player.finish(bytes)
}

/// Number of the read that is the last keyframe at or before `cycle`.
fn last_keyframe_before(bytes: &[u8], cycle: u64) -> Result<usize, LogError> {
    if cycle == 0 {
        return Ok(0);
    }
    let is_before =
        |read: &Read| matches!(read, Read::Item(Item::Keyframe(k)) if k.next_cycle <= cycle);
    Ok(LogReader::open(bytes)?
        .enumerate()
        .filter(|(_, read)| is_before(read))
        .map(|(n, _)| n)
        .last()
        .unwrap_or(0))
}

/// A replay under way.
#[derive(Debug, Default)]
struct Player {
    from_cycle: u64,
    state: Option<ControlState>,
    /// Newest cycle read; none where a flaw already says what is missing.
    last_read: Option<u64>,
    motions: VecDeque<(u64, Box<Motion>)>,
    recorded: Vec<CauseRecord>,
    replayed: Vec<CauseRecord>,
    stepped: Vec<RangeInclusive<u64>>,
    found: Replay,
}

impl Player {
    fn gap(&mut self, reason: String, damaged: bool) {
        self.found.gaps.push(Gap {
            after_cycle: self.stepped.last().map(|r| *r.end()),
            until_cycle: None,
            reason,
            damaged,
        });
    }

    fn flaw(&mut self, flaw: Flaw) {
        (self.state, self.last_read) = (None, None);
        self.gap(flaw.to_string(), matches!(flaw, Flaw::Damaged { .. }));
    }

    fn remember(&mut self, id: u64, motion: Box<Motion>) {
        if self.motions.len() == MOTIONS {
            self.motions.pop_front();
        }
        self.motions.push_back((id, motion));
    }

    fn keyframe(&mut self, keyframe: &Keyframe) {
        self.found.core.clone_from(&keyframe.core);
        for (id, motion) in &keyframe.motions {
            if !self.motions.iter().any(|(n, m)| n == id && m == motion) {
                self.remember(*id, motion.clone());
            }
        }
        match &self.state {
            Some(state) if state.cycle().wrapping_add(1) == keyframe.next_cycle => {
                self.compare_state(keyframe);
            }
            _ => self.state = keyframe.state(),
        }
    }

    fn compare_state(&mut self, keyframe: &Keyframe) {
        let Some(now) = self.state.as_ref().and_then(Snapshot::of) else {
            return;
        };
        self.found.states += 1;
        let (a, b) = (keyframe.state.as_slice(), now.as_bytes());
        let unequal = a.iter().zip(b).filter(|(x, y)| x != y).count() + a.len().abs_diff(b.len());
        if unequal > 0 {
            let at = a.iter().zip(b).position(|(x, y)| x != y);
            let at = at.unwrap_or(a.len().min(b.len()));
            let byte = |s: &[u8]| s.get(at).map_or("none".to_owned(), u8::to_string);
            let unequal = Unequal {
                field: format!("state before the cycle, byte {at}"),
                recorded: byte(a),
                replayed: byte(b),
                bytes: u32::try_from(unequal).unwrap_or(u32::MAX),
            };
            self.found.differs(keyframe.next_cycle, unequal);
        }
    }

    fn cycle(&mut self, cycle: &RecordedCycle) -> Result<(), ReplayError> {
        let number = cycle.input.cycle;
        let before = number.wrapping_sub(1);
        if let Some(last) = self.last_read.replace(number)
            && last != before
        {
            let lost = before.saturating_sub(last);
            self.gap(
                format!("{lost} cycle(s) before cycle {number} were dropped by the controller"),
                false,
            );
        }
        self.state = self.state.take().filter(|s| s.cycle() == before);
        let Some(state) = &mut self.state else {
            self.found.skipped += 1;
            return Ok(());
        };
        let motions = &self.motions;
        let motion_of = |id, hash| {
            let found = motions.iter().rev().find(|(n, _)| *n == id);
            found
                .filter(|(_, motion)| motion.fingerprint() == hash)
                .map(|(_, motion)| motion.clone())
        };
        let input = match restore_input(&cycle.input, motion_of) {
            Ok(input) => input,
            Err(error @ RestoreError::Version(..)) => return Err(ReplayError::Restore(error)),
            Err(error @ (RestoreError::Command { .. } | RestoreError::Motion { .. })) => {
                self.state = None;
                self.gap(error.to_string(), true);
                self.found.skipped += 1;
                return Ok(());
            }
        };
        let out = state.step(input);
        self.replayed
            .extend(out.events.iter().filter_map(|e| match e {
                ControlEvent::Latched(cause) => Some(*cause),
                _ => None,
            }));
        self.stepped_to(number);
        if number >= self.from_cycle {
            self.found.cycles += 1;
            if self.found.cycles == 1 {
                self.found.first_cycle = number;
            }
            self.found.last_cycle = number;
            let (then, now) = (cycle_fields(&cycle.record), cycle_fields(&out.record));
            if let Some(unequal) = first_unequal(&then, &now) {
                self.found.differs(number, unequal);
            }
        }
        Ok(())
    }

    /// Extends the cycles stepped; closes the gap before a new stretch.
    fn stepped_to(&mut self, number: u64) {
        if let Some(last) = self.stepped.last_mut()
            && last.end().wrapping_add(1) == number
        {
            *last = *last.start()..=number;
            return;
        }
        self.stepped.push(number..=number);
        for gap in &mut self.found.gaps {
            gap.until_cycle.get_or_insert(number);
        }
    }

    fn finish(mut self, bytes: &[u8]) -> Result<Replay, ReplayError> {
        if self.found.cycles == 0 {
            return Err(nothing_compared(bytes, self.from_cycle, self.found.core));
        }
        self.compare_causes();
        Ok(self.found)
    }

    /// Whether all cycles from `first` to `last` were stepped.
    fn is_whole(&self, first: u64, last: u64) -> bool {
        self.stepped
            .iter()
            .any(|r| r.contains(&first) && r.contains(&last))
    }

    /// Every cause of a stepped cycle must be in both, and the same.
    fn compare_causes(&mut self) {
        let from_cycle = self.from_cycle;
        for now in core::mem::take(&mut self.replayed) {
            let at = now.rest_cycle;
            let then = self.recorded.iter().position(|c| c.rest_cycle == at);
            let then = then.map(|n| self.recorded.swap_remove(n));
            if at < from_cycle {
                continue;
            }
            match then {
                Some(then) => {
                    self.found.causes += 1;
                    let unequal = first_unequal(&cause_fields(&then), &cause_fields(&now));
                    if let Some(unequal) = unequal {
                        self.found.differs(at, unequal);
                    }
                }
                // The recording may end, or have a gap, before it got there.
                None if !self.is_whole(at, at.saturating_add(CAUSE_WITHIN)) => {}
                None => self.found.differs(at, one_sided(None, Some(now.fault()))),
            }
        }
        for then in core::mem::take(&mut self.recorded) {
            let at = then.rest_cycle;
            if at >= from_cycle && self.is_whole(at, at) {
                self.found.differs(at, one_sided(Some(then.fault()), None));
            }
        }
    }
}

/// A cause that only one of the two has.
fn one_sided(recorded: Option<FaultCode>, replayed: Option<FaultCode>) -> Unequal {
    let show = |fault: Option<FaultCode>| fault.map_or("no cause".to_owned(), |f| format!("{f:?}"));
    Unequal {
        field: "cause".to_owned(),
        recorded: show(recorded),
        replayed: show(replayed),
        bytes: u32::try_from(size_of::<CauseRecord>()).unwrap_or(u32::MAX),
    }
}

fn nothing_compared(bytes: &[u8], from: u64, core: String) -> ReplayError {
    let cycles = || {
        LogReader::open(bytes)
            .into_iter()
            .flatten()
            .filter_map(|read| match read {
                Read::Item(Item::Cycle(cycle)) => Some(cycle.input.cycle),
                Read::Item(_) | Read::Flaw(_) => None,
            })
    };
    match (cycles().next(), cycles().last()) {
        (Some(first), Some(last)) if from > last => ReplayError::OutOfRange { from, first, last },
        _ => ReplayError::NoState {
            core: if core.is_empty() {
                "unknown".to_owned()
            } else {
                core
            },
        },
    }
}
