//! Films: AVI and the pictures inside.
#![no_main]

libfuzzer_sys::fuzz_target!(
    init: wag_fuzz::seeds::write("video", wag_fuzz::video::seeds()),
    |data: &[u8]| wag_fuzz::video::run(data)
);
