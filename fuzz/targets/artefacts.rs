//! Plans, ropes and keypoint tracks.
#![no_main]

libfuzzer_sys::fuzz_target!(
    init: wag_fuzz::seeds::write("artefacts", wag_fuzz::artefacts::seeds()),
    |data: &[u8]| wag_fuzz::artefacts::run(data)
);
