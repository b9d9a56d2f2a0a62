//! Writes the recording of ten minutes of core and simulated arm with faults, in
//! virtual time, to the file named on the command line.
//!
//! A build of another kind replays it: `replay_log` of the controller's crate.

#[path = "../tests/flight/mod.rs"]
mod flight;

use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("name a file to write")?;
    let flight = flight::fly(600.0);
    std::fs::write(&path, &flight.bytes)?;
    println!(
        "{} cycles, {} stops in {path}",
        flight.cycles, flight.causes
    );
    Ok(())
}
