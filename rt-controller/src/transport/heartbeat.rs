//! The heartbeat rule of protocol 3, kept on every lasting connection: a peer
//! that was silent for 30 s is asked for its state, at most every 10 s, and
//! given up after 90 s without any reply.

/// Silence after which the arm is asked for its state (ns).
const ASK_AFTER_NS: u64 = 30_000_000_000;
/// Shortest time between two such questions (ns).
const ASK_EVERY_NS: u64 = 10_000_000_000;
/// Silence after which the connection is given up (ns).
const GIVE_UP_AFTER_NS: u64 = 90_000_000_000;

/// What to do about a silent connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Silence {
    /// Nothing: a reply came lately, or one was asked for lately.
    Fine,
    /// Ask for the state.
    Ask,
    /// Give the connection up.
    GiveUp,
}

/// Silence of one connection. RT-safe.
#[derive(Debug, Clone, Copy, Default)]
pub struct Heartbeat {
    /// `None` before the first look, from which the silence counts.
    received_ns: Option<u64>,
    requested_ns: u64,
}

impl Heartbeat {
    /// Something was received at `now_ns`.
    pub fn received(&mut self, now_ns: u64) {
        self.received_ns = self.received_ns.max(Some(now_ns));
    }

    /// What is due at `now_ns`; an answer `Ask` counts as asked.
    pub fn due(&mut self, now_ns: u64) -> Silence {
        let silent_ns = now_ns.saturating_sub(*self.received_ns.get_or_insert(now_ns));
        if silent_ns > GIVE_UP_AFTER_NS {
            return Silence::GiveUp;
        }
        let rested = now_ns.saturating_sub(self.requested_ns) >= ASK_EVERY_NS;
        if silent_ns < ASK_AFTER_NS || !rested {
            return Silence::Fine;
        }
        self.requested_ns = now_ns;
        Silence::Ask
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: u64 = 1_000_000_000;

    #[test]
    fn a_silent_arm_is_asked_from_30_s_every_10_s_and_given_up_after_90_s() {
        let begin = 5 * S;
        let mut heartbeat = Heartbeat::default();
        let mut requested = Vec::new();
        let given_up = (0..1000).map(|k| k * S / 10).find(|t| {
            let due = heartbeat.due(begin + t);
            if due == Silence::Ask {
                requested.push(t / S);
            }
            due == Silence::GiveUp
        });
        assert_eq!(requested, [30, 40, 50, 60, 70, 80, 90]);
        assert_eq!(given_up, Some(90 * S + S / 10));
    }

    #[test]
    fn an_answer_starts_the_silence_anew() {
        let mut heartbeat = Heartbeat::default();
        heartbeat.received(0);
        assert_eq!(heartbeat.due(31 * S), Silence::Ask);
        heartbeat.received(32 * S);
        assert_eq!(heartbeat.due(61 * S), Silence::Fine);
        assert_eq!(heartbeat.due(62 * S), Silence::Ask);
    }
}
