//! Some of many.

/// Lets one through per period of its own time.
#[derive(Debug)]
pub(super) struct Thinned {
    period_ns: u64,
    next_ns: u64,
}

impl Thinned {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturating"
    )]
    /// So many a second.
    pub(super) fn at(rate_hz: f64) -> Self {
        Self {
            period_ns: (1e9 / rate_hz) as u64,
            next_ns: 0,
        }
    }

    /// Whether the one of this instant goes through.
    pub(super) fn takes(&mut self, stamp_ns: u64) -> bool {
        if stamp_ns < self.next_ns {
            return false;
        }
        // Keeps the rhythm, and finds it again after a pause.
        let slack_ns = self.period_ns / 4;
        let due_ns = self.next_ns + self.period_ns;
        self.next_ns = due_ns.max((stamp_ns + self.period_ns).saturating_sub(slack_ns));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_frames_of_a_jittering_camera_are_taken() {
        let mut thinned = Thinned::at(30.0);
        let taken = (0..600u64)
            .map(|n| 5_000_000_000 + n * 16_666_667 + (n * 7_919 % 3_000_000))
            .filter(|stamp| thinned.takes(*stamp))
            .count();
        assert!((295..=305).contains(&taken), "{taken}");
        assert!(thinned.takes(60_000_000_000));
        assert!(!thinned.takes(60_010_000_000));
    }
}
