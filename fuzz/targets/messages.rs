//! Requests and events between the processes.
#![no_main]

libfuzzer_sys::fuzz_target!(
    init: wag_fuzz::seeds::write("messages", wag_fuzz::messages::seeds()),
    |data: &[u8]| wag_fuzz::messages::run(data)
);
