//! A track in doubt ends the work that would rest on it, unless that is accepted.

use anyhow::bail;

/// Stops at what is in doubt; with `accepted` it is a warning only. `look` says where the
/// doubt can be looked at.
pub fn confirm(doubts: &[String], accepted: bool, look: &str) -> anyhow::Result<()> {
    if doubts.is_empty() {
        return Ok(());
    }
    let doubts = doubts.join("; ");
    if accepted {
        eprintln!("warning: the track is in doubt: {doubts}");
        return Ok(());
    }
    bail!(
        "the track of the rope is in doubt: {doubts}; {look}, then mend the film or its files, or go on with --accept-unconfirmed"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_doubt_stops_unless_it_is_accepted() {
        let doubts = ["the end is not confirmed".to_owned()];
        let look = "look at `wiggle.png`";
        let reason = confirm(&doubts, false, look).unwrap_err().to_string();
        for word in ["end is not confirmed", "wiggle.png", "--accept-unconfirmed"] {
            assert!(reason.contains(word), "{reason}");
        }
        assert!(confirm(&doubts, true, look).is_ok());
        assert!(confirm(&[], false, look).is_ok());
    }
}
