//! Which commands wait for their reply, and what a reply that comes means.
//!
//! Replies are matched by transaction id, so they may come late, twice or in
//! another order without harm. A reply to an id that was never sent on this
//! connection is the trace of somebody else.

use crate::xarm::frame::next_transaction;

/// Commands remembered: one second of setpoints. It divides the number of ids, 1 to
/// 65 535, so that the slots of a window differ also where ids wrap.
const WINDOW: usize = 255;

#[derive(Debug, Clone, Copy, Default)]
struct Sent {
    /// 0 where nothing was sent yet.
    id: u16,
    sent_ns: u64,
    answered: bool,
}

/// What a reply means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Matched {
    /// Answers the oldest open command.
    InOrder {
        /// When the command was sent (ns).
        sent_ns: u64,
    },
    /// Answers a command that later ones overtook, or overtakes earlier ones.
    OutOfOrder {
        /// When the command was sent (ns).
        sent_ns: u64,
    },
    /// The command was answered before.
    Duplicate,
    /// No such command was sent here.
    Foreign,
}

/// The commands sent last. Fixed size, RT-safe.
///
/// A reply overtakes all commands before its own, so the open ones are always the
/// newest.
#[derive(Debug, Clone)]
pub struct InFlight {
    sent: [Sent; WINDOW],
    /// Id of the next command.
    next: u16,
    open: u16,
}

impl Default for InFlight {
    fn default() -> Self {
        Self {
            sent: [Sent::default(); WINDOW],
            next: 1,
            open: 0,
        }
    }
}

impl InFlight {
    /// Id for the next command.
    #[must_use]
    pub const fn next_id(&self) -> u16 {
        self.next
    }

    /// Commands without a reply, those overtaken left out.
    #[must_use]
    pub const fn open(&self) -> u16 {
        self.open
    }

    /// When the oldest open command was sent (ns).
    #[must_use]
    pub fn oldest_ns(&self) -> Option<u64> {
        let back = self.next.wrapping_sub(self.open);
        // Ids wrap to 1.
        let oldest = if self.open < self.next {
            back
        } else {
            back.wrapping_sub(1)
        };
        let slot = self.sent.get(place(oldest))?;
        (self.open > 0 && slot.id == oldest).then_some(slot.sent_ns)
    }

    /// How many commands ago `id` was the next one.
    const fn age(&self, id: u16) -> u16 {
        let age = self.next.wrapping_sub(id);
        if id < self.next {
            age
        } else {
            age.wrapping_sub(1)
        }
    }

    /// The command with [`next_id`](Self::next_id) was sent at `now_ns`.
    pub fn sent(&mut self, now_ns: u64) {
        let id = self.next;
        let slot = self.sent.get(place(id)).copied().unwrap_or_default();
        if slot.id != 0 {
            // A whole window without any reply: the oldest is given up.
            self.open = self.open.min(self.age(slot.id).saturating_sub(1));
        }
        if let Some(slot) = self.sent.get_mut(place(id)) {
            *slot = Sent {
                id,
                sent_ns: now_ns,
                answered: false,
            };
            self.open = self.open.saturating_add(1);
        }
        self.next = next_transaction(id);
    }

    /// A reply with transaction `id` came.
    pub fn reply(&mut self, id: u16) -> Matched {
        let (age, open) = (self.age(id), self.open);
        let slot = self.sent.get_mut(place(id));
        let Some(sent) = slot.filter(|sent| id != 0 && sent.id == id) else {
            return Matched::Foreign;
        };
        if core::mem::replace(&mut sent.answered, true) {
            return Matched::Duplicate;
        }
        let sent_ns = sent.sent_ns;
        self.open = open.min(age.saturating_sub(1));
        if age == open {
            Matched::InOrder { sent_ns }
        } else {
            Matched::OutOfOrder { sent_ns }
        }
    }
}

fn place(id: u16) -> usize {
    usize::from(id) % WINDOW
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn with_sent(count: u64) -> InFlight {
        let mut in_flight = InFlight::default();
        for k in 0..count {
            in_flight.sent(1000 * k);
        }
        in_flight
    }

    #[test]
    fn order_repetition_and_strangers_are_told_apart() {
        let mut f = with_sent(4);
        assert_eq!(f.reply(1), Matched::InOrder { sent_ns: 0 });
        assert_eq!(f.reply(1), Matched::Duplicate);
        assert_eq!(f.reply(3), Matched::OutOfOrder { sent_ns: 2000 });
        // The second one was overtaken: it holds nothing up any more.
        assert_eq!((f.open(), f.oldest_ns()), (1, Some(3000)));
        assert_eq!(f.reply(2), Matched::OutOfOrder { sent_ns: 1000 });
        assert_eq!(f.reply(2), Matched::Duplicate);
        assert_eq!(f.reply(5), Matched::Foreign);
        assert_eq!(f.reply(40_000), Matched::Foreign);
        assert_eq!(f.reply(4), Matched::InOrder { sent_ns: 3000 });
        assert_eq!((f.open(), f.oldest_ns()), (0, None));
    }

    #[test]
    fn silence_keeps_the_age_of_the_oldest_of_the_last_second() {
        for next in [1, 65_400] {
            let mut f = InFlight {
                next,
                ..InFlight::default()
            };
            for k in 0..1000 {
                f.sent(k);
                let open = WINDOW.min(k as usize + 1);
                assert_eq!(usize::from(f.open()), open, "{next} {k}");
                assert_eq!(f.oldest_ns(), Some(k + 1 - open as u64), "{next} {k}");
            }
        }
    }

    proptest! {
        /// Against a plain model: replies in any order, with repetitions.
        #[test]
        fn counts_are_right_over_the_wrap(
            begin in 65_000_u16..65_535, steps in prop::collection::vec((any::<bool>(), 0_usize..20), 1..1500),
        ) {
            let mut f = InFlight { next: begin, ..InFlight::default() };
            let mut sent: Vec<(u16, u64, bool)> = Vec::new(); // id, time, answered
            let mut answered_up_to = 0;
            for (k, (send, back)) in steps.into_iter().enumerate() {
                let now_ns = 1 + k as u64;
                if send || sent.is_empty() {
                    sent.push((f.next_id(), now_ns, false));
                    f.sent(now_ns);
                } else {
                    let at = sent.len().saturating_sub(1 + back);
                    let (id, sent_ns, before) = sent[at];
                    let matched = f.reply(id);
                    if before {
                        prop_assert_eq!(matched, Matched::Duplicate);
                    } else {
                        let (in_order, out) = (Matched::InOrder { sent_ns }, Matched::OutOfOrder { sent_ns });
                        prop_assert!([in_order, out].contains(&matched), "{:?}", matched);
                        answered_up_to = answered_up_to.max(at + 1);
                    }
                    sent[at].2 = true;
                }
                let open = (sent.len() - answered_up_to).min(WINDOW);
                prop_assert_eq!(usize::from(f.open()), open);
                let oldest = sent.get(sent.len() - open).map(|s| s.1);
                prop_assert_eq!(f.oldest_ns(), oldest);
            }
        }
    }
}
