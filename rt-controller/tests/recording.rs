//! A recording of ten minutes with faults replays to the bit; damage, losses
//! and a changed byte are found; a replay may begin anywhere.
#![cfg(test)]

#[path = "recording/random_run.rs"]
mod random_run;

use random_run::{record_measured_run, record_run, record_run_with};
use rt_controller::recording::{Item, LogReader, Read, RecordedCycle, replay};
use std::collections::BTreeSet;

/// Cycles of ten minutes at 250 Hz.
const TEN_MINUTES: u64 = 150_000;

#[test]
fn ten_minutes_with_faults_replay_to_the_bit_and_stay_small() {
    let run = record_run(1, TEN_MINUTES);
    let found = replay(&run, 0).unwrap();
    println!(
        "{} cycles, {} causes, {} keyframes, {:.1} MB",
        found.cycles,
        found.causes,
        found.states,
        run.len() as f64 / 1e6
    );
    assert_eq!(found.cycles, TEN_MINUTES);
    assert_eq!((found.first_cycle, found.last_cycle), (1, TEN_MINUTES));
    assert_eq!(found.differing_bytes, 0, "{:?}", found.first_difference);
    assert!(found.gaps.is_empty() && found.skipped == 0);
    assert!(found.states > 500, "{}", found.states);
    assert!(found.causes > 20, "{}", found.causes);
    assert!(run.len() < 150_000_000);
    let kinds: BTreeSet<u16> = LogReader::open(&run)
        .unwrap()
        .filter_map(|read| match read {
            Read::Item(Item::Cause(cause)) => Some(cause.code),
            Read::Item(_) | Read::Flaw(_) => None,
        })
        .collect();
    assert!(kinds.len() >= 5, "{kinds:?}");
}

/// One value changed, with a right checksum: the core itself is what differs.
#[test]
fn a_changed_value_is_named_with_its_cycle_and_field() {
    for (seed, at) in [(3, 700), (4, 1999), (5, 12)] {
        let change = |cycle: &mut RecordedCycle| {
            if cycle.input.cycle == at {
                cycle.record.q_c.0[4] = f64::from_bits(cycle.record.q_c.0[4].to_bits() ^ 1);
            }
        };
        let run = record_run_with(seed, 3000, 0..0, change);
        let found = replay(&run, 0).unwrap();
        assert_eq!(found.differing_bytes, 1);
        let first = found.first_difference.clone().unwrap();
        assert_eq!((first.cycle, first.unequal.field.as_str()), (at, "q_c[5]"));
        assert!(!found.is_exact());
        // A changed input leads to other records too.
        let change = |cycle: &mut RecordedCycle| {
            cycle.input.missed ^= u32::from(cycle.input.cycle == at);
        };
        let run = record_run_with(seed, 3000, 0..0, change);
        let first = replay(&run, 0).unwrap().first_difference.unwrap();
        assert_eq!((first.cycle, first.unequal.field.as_str()), (at, "missed"));
    }
}

#[test]
fn a_flipped_byte_on_the_disk_is_found_and_stepped_over() {
    let run = record_run(6, 5000);
    for part in 1..20 {
        let mut bytes = run.clone();
        let at = bytes.len() * part / 20;
        bytes[at] ^= 0x10;
        let found = replay(&bytes, 0).unwrap();
        assert_eq!(found.differing_bytes, 0, "{:?}", found.first_difference);
        assert!(found.gaps.iter().any(|g| g.damaged) && !found.is_exact());
        // At most the damaged chunk and what follows it up to a keyframe.
        assert!(found.cycles >= 5000 - 300, "{} of 5000", found.cycles);
    }
}

#[test]
fn a_replay_begins_at_any_cycle_and_after_any_loss() {
    let run = record_run(7, 4000);
    for from in [1, 2, 249, 250, 251, 1300, 3999, 4000] {
        let found = replay(&run, from).unwrap();
        assert_eq!((found.first_cycle, found.last_cycle), (from, 4000));
        assert_eq!(found.cycles, 4001 - from);
        assert!(found.is_exact() && found.gaps.is_empty(), "{found:?}");
    }
    let error = replay(&run, 4001).unwrap_err().to_string();
    assert!(error.contains("cycles 1 to 4000"), "{error}");

    // Cycles that the controller dropped because nobody drained its ring.
    let lossy = record_run_with(7, 4000, 1000..1100, |_| ());
    let found = replay(&lossy, 0).unwrap();
    assert!(found.is_exact(), "{:?}", found.first_difference);
    assert_eq!(found.gaps.len(), 1);
    assert!(found.gaps[0].reason.contains("100 cycle(s)"), "{found:?}");
    assert_eq!(found.gaps[0].after_cycle, Some(999));
    assert_eq!(found.cycles + found.skipped, 3900);
}

/// What is predicted is part of the state: a replay from any keyframe has it.
#[test]
fn a_run_of_a_measured_arm_replays_to_the_bit_from_anywhere() {
    for seed in [2, 3] {
        let run = record_measured_run(seed, 4000);
        for from in [1, 1300, 3999] {
            let found = replay(&run, from).unwrap();
            assert!(found.is_exact() && found.gaps.is_empty(), "{found:?}");
        }
    }
}

#[test]
fn a_recording_that_begins_late_begins_at_its_first_keyframe() {
    let run = record_run(8, 3000);
    for cut in [100_000, 250_001, 400_003] {
        let found = replay(&run[cut..], 0).unwrap();
        assert_eq!(found.differing_bytes, 0);
        assert!(found.cycles > 500 && found.first_cycle > 1, "{found:?}");
        assert_eq!(found.last_cycle, 3000);
    }
}

/// Made by commit c3b4e48: a swing that is slowed down on its path for lateness, then
/// braked by the operator, with a keyframe in each state and one at rest.
#[test]
fn a_recording_of_layout_1_replays_to_the_bit() {
    let found = replay(include_bytes!("recording/layout-1.bin"), 0).unwrap();
    assert_eq!((found.first_cycle, found.last_cycle), (150, 182));
    assert_eq!((found.cycles, found.states, found.causes), (33, 3, 1));
    assert_eq!(found.differing_bytes, 0, "{:?}", found.first_difference);
    assert!(found.gaps.is_empty() && found.skipped == 0, "{found:?}");
}
