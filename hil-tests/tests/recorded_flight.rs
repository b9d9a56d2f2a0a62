//! Core and simulated arm with faults, recorded, replay bit-exactly: ten minutes by the program
//! that recorded them, some seconds by every later one.
#![cfg(test)]

mod flight;

use flight::fly;
use rt_controller::recording::{Item, LogReader, Read, replay};
use std::collections::BTreeSet;

#[test]
fn ten_minutes_with_a_fault_every_six_seconds_replay_to_the_bit() {
    let flight = fly(600.0, 6.0);
    let found = replay(&flight.bytes, 0).unwrap();
    let kinds: BTreeSet<u16> = LogReader::open(&flight.bytes)
        .unwrap()
        .filter_map(|read| match read {
            Read::Item(Item::Cause(cause)) => Some(cause.code),
            Read::Item(_) | Read::Flaw(_) => None,
        })
        .collect();
    println!(
        "{} cycles, {} causes of kinds {kinds:?}, {:.1} MB",
        found.cycles,
        found.causes,
        flight.bytes.len() as f64 / 1e6
    );
    assert!(
        found.is_exact(),
        "{:?} {:?}",
        found.first_difference,
        found.gaps
    );
    assert_eq!((found.cycles, found.differing_bytes), (flight.cycles, 0));
    assert_eq!(found.causes, flight.causes as u64);
    assert!(found.cycles > 149_000, "{}", found.cycles);
    assert!(found.causes > 40 && kinds.len() >= 7, "{kinds:?}");
}

/// Twelve seconds as an earlier version recorded them. Who changes the core on purpose writes
/// them anew (`flight_log hil-tests/tests/flight/golden.bin 12 1.5`) and says so in `CHANGELOG.md`.
const GOLDEN: &[u8] = include_bytes!("flight/golden.bin");

#[test]
fn a_recording_of_an_earlier_version_replays_bit_exactly() {
    let found = replay(GOLDEN, 0).unwrap();
    let (difference, gaps) = (&found.first_difference, &found.gaps);
    assert!(found.is_exact(), "{difference:?} {gaps:?}");
    assert_eq!(
        (found.differing_bytes, found.cycles, found.causes),
        (0, 2995, 2)
    );
}
