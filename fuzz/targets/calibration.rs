//! Camera settings and the factory's calibration.
#![no_main]

libfuzzer_sys::fuzz_target!(
    init: wag_fuzz::seeds::write("calibration", wag_fuzz::calibration::seeds()),
    |data: &[u8]| wag_fuzz::calibration::run(data)
);
