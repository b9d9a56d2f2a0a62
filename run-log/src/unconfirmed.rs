//! An unconfirmed track ends the work that would rest on it, unless that is accepted.

use anyhow::{Result, bail};
use cli_output::eprintln;

/// Stops at an unconfirmed track; with `accepted` it is a warning only. `look` says where it
/// can be looked at.
///
/// # Errors
/// The track is unconfirmed, and nobody accepted that.
pub fn confirm(unconfirmed: &[String], accepted: bool, look: &str) -> Result<()> {
    if unconfirmed.is_empty() {
        return Ok(());
    }
    let unconfirmed = unconfirmed.join("; ");
    if accepted {
        eprintln!("warning: the track is unconfirmed: {unconfirmed}");
        return Ok(());
    }
    bail!(
        "the track of the rope is unconfirmed: {unconfirmed}; {look}, then mend the film or its files, or go on with --accept-unconfirmed"
    )
}
