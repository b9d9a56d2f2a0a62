//! Recorded control cycles.
#![no_main]

libfuzzer_sys::fuzz_target!(
    init: wag_fuzz::seeds::write("recording", wag_fuzz::recording::seeds()),
    |data: &[u8]| wag_fuzz::recording::run(data)
);
