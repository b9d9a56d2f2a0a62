//! Frames, requests, replies and reports of the arm, and their streams.
#![no_main]

libfuzzer_sys::fuzz_target!(
    init: wag_fuzz::seeds::write("wire", wag_fuzz::wire::seeds()),
    |data: &[u8]| wag_fuzz::wire::run(data)
);
