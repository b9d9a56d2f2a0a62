//! Configuration files of the controller.
#![no_main]

libfuzzer_sys::fuzz_target!(
    init: wag_fuzz::seeds::write("configs", wag_fuzz::configs::seeds()),
    |data: &[u8]| wag_fuzz::configs::run(data)
);
