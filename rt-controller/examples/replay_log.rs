//! Steps the core again over the recording named on the command line and compares
//! every bit; fails when one differs.
//!
//! Run as a debug build over a release build's recording before every change is
//! taken in.

use rt_controller::recording::replay;
use std::error::Error;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("name a recording")?;
    let found = replay(&std::fs::read(&path)?, 0)?;
    println!(
        "{} cycles, {} stops, {} differing bytes, {} gaps",
        found.cycles,
        found.causes,
        found.differing_bytes,
        found.gaps.len()
    );
    if found.is_exact() && found.cycles > 0 {
        Ok(())
    } else {
        Err(format!("not bit-exact: {:?}", found.first_difference).into())
    }
}
