//! Writes the recording of ten minutes of core and simulated arm with a fault every six seconds
//! (or of as many seconds and with such pauses as are named), in virtual time:
//! `flight_log FILE [SECONDS PAUSE]`.
//!
//! A build of another kind replays it: `replay_log` of the controller's crate.

#[path = "../tests/flight/mod.rs"]
mod flight;

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let path = args.next().ok_or("name a file to write")?;
    let mut seconds = |usual| args.next().map_or(Ok(usual), |text| text.parse());
    let (span_s, pause_s) = (seconds(600.0)?, seconds(6.0)?);
    let flight = flight::fly(span_s, pause_s);
    std::fs::write(&path, &flight.bytes)?;
    println!(
        "{} cycles, {} stops in {path}",
        flight.cycles, flight.causes
    );
    Ok(())
}
