//! What the operator confirms, and holds.

use super::{Confirmation, Session, TURN};
use crate::presence::{Presence, Switch};
use anyhow::bail;
use cli_output::event::{Event, tell};
use cli_output::output;
use rt_controller::control::arming::THROW_WITHIN_NS;
use rt_controller::os::now_ns;
use shared_types::MonotonicNs;
use std::time::{Duration, Instant, SystemTime};

/// Longest wait for the operator, with the arm enabled.
const CONFIRMED_WITHIN: Duration = Duration::from_secs(120);
/// From a confirmation to the begin of what it is for (s): a second before the controller would
/// refuse it.
const BEGINS_WITHIN_S: f64 = THROW_WITHIN_NS as f64 * 1e-9 - 1.0;

impl Session {
    /// Asks the operator whether the area is clear, `now` that the arm is as it is; when `word`
    /// confirmed it (CLOCK_MONOTONIC, ns).
    ///
    /// # Errors
    /// Something else was typed, or nothing, or nobody is there.
    pub fn confirm(&mut self, now: &str, word: &'static str) -> anyhow::Result<u64> {
        self.confirm_within(now, word, CONFIRMED_WITHIN)
    }

    /// [`Self::confirm`] of what takes a person longer.
    pub fn confirm_within(
        &mut self,
        now: &str,
        word: &'static str,
        within: Duration,
    ) -> anyhow::Result<u64> {
        let Some(presence) = &mut self.presence else {
            bail!("nobody is watched who could confirm");
        };
        presence.request(word);
        let question =
            format!("{now} Emergency stop in reach, nobody within reach of arm and rope?");
        let asked = tell(&Event::Ask {
            word: word.to_owned(),
            text: question.clone(),
        });
        if !asked {
            eprint!("{question}\nArea clear: type {word} ");
        }
        let began = Instant::now();
        while began.elapsed() < within {
            self.tick()?;
            let Some(presence) = &mut self.presence else {
                break;
            };
            if let Some(at) = presence.confirmed() {
                self.confirmed.push(Confirmation {
                    word,
                    at_ns: at.0,
                    at: SystemTime::now(),
                });
                let told = tell(&Event::Confirmed {
                    word: word.to_owned(),
                });
                if !told {
                    eprintln!(
                        "{}",
                        match presence.switch() {
                            Switch::DeadMan =>
                                "Confirmed; Enter, or any other input, stops from now on",
                            Switch::HoldToRun => "Confirmed",
                        }
                    );
                }
                return Ok(at.0);
            }
            if presence.is_let_go() {
                eprint!("\n");
                bail!(
                    "the area was not confirmed clear: type {word} once it is asked for, in capitals, and nothing before; run the command again"
                );
            }
            std::thread::sleep(TURN);
        }
        eprint!("\n");
        bail!(
            "nobody typed {word} within {} s; run the command again",
            within.as_secs()
        )
    }

    /// Waits until the operator holds what must be held while the arm moves, if anything.
    pub fn await_hold(&mut self) -> anyhow::Result<()> {
        let lets_move = |session: &mut Self| match &mut session.presence {
            // What is let go the controller refuses, in its own words.
            Some(presence) => presence.lets_move() || presence.is_let_go(),
            None => true,
        };
        let switch = self.presence.as_ref().map(Presence::switch);
        let told = switch == Some(Switch::HoldToRun) && tell(&Event::Hold);
        if lets_move(self) {
            return Ok(());
        }
        if !told {
            eprintln!("Hold Enter down: the arm moves while it is held");
        }
        let began = Instant::now();
        while began.elapsed() < CONFIRMED_WITHIN {
            self.tick()?;
            if lets_move(self) {
                return Ok(());
            }
            std::thread::sleep(TURN);
        }
        bail!(
            "nobody held the control, Enter, within {} s; nothing moved for it",
            CONFIRMED_WITHIN.as_secs()
        )
    }

    /// Lets the operator confirm a motion that begins at once, and waits for the hold: when it was
    /// confirmed (CLOCK_MONOTONIC, ns). What is held too late for the controller is asked again.
    /// Where nobody must be asked, it is now.
    ///
    /// # Errors
    /// As [`Self::confirm`] and [`Self::await_hold`].
    pub fn confirm_and_hold(
        &mut self,
        question: Option<(&str, &'static str)>,
    ) -> anyhow::Result<u64> {
        let Some((now, word)) = question else {
            self.await_hold()?;
            return Ok(now_ns());
        };
        loop {
            let confirmed_ns = self.confirm(now, word)?;
            self.await_hold()?;
            let since_s = MonotonicNs(now_ns()).since_s(MonotonicNs(confirmed_ns));
            // What is let go the controller refuses, in its own words.
            if since_s < BEGINS_WITHIN_S || self.is_let_go() {
                return Ok(confirmed_ns);
            }
            self.end_hold();
            self.confirmed.pop();
            output::aside(format_args!(
                "The hold came more than {BEGINS_WITHIN_S:.0} s after {word}: nothing moved, it is asked again\n"
            ));
        }
    }

    /// Waits as [`await_hold`](Self::await_hold) does, for a motion that is planned next: until it
    /// begins, nothing stops when the control is released.
    pub fn await_control(&mut self) -> anyhow::Result<()> {
        self.await_hold()?;
        if let Some(presence) = &mut self.presence {
            presence.rests();
        }
        Ok(())
    }

    /// Whether a motion may begin at this instant, as far as the operator's control lets it.
    pub fn is_held(&mut self) -> bool {
        self.presence.as_mut().is_none_or(Presence::is_held)
    }

    /// Whether the operator has let the arm go for good: nothing moves in this session any more.
    pub fn is_let_go(&mut self) -> bool {
        self.presence.as_mut().is_some_and(Presence::is_let_go)
    }

    /// The motion is over: what was held may be released.
    pub fn end_hold(&mut self) {
        if let Some(presence) = &mut self.presence {
            presence.rests();
            tell(&Event::Release);
        }
    }
}
