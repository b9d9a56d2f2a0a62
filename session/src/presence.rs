//! The operator at standard input: a switch that is held, and a word that confirms.
//!
//! As a dead-man switch it is held as long as it is open and silent: a line that nobody asked
//! for, its end or an error lets go, and so does a pipe whose other end, a button's driver, goes
//! away. As a hold-to-run control it is held while empty lines keep coming, as from the Enter key
//! that is held down; while the arm moves, their absence lets go.

use anyhow::Context;
use rt_controller::os::now_ns;
use shared_types::MonotonicNs;
use std::io;
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};

/// Longest pause between two lines of a key, or a button, that is held down (s).
const REPEATED_WITHIN_S: f64 = 0.3;
/// Lines that wait for a look; more are not read meanwhile.
const WAITING_MAX: usize = 64;

/// What the operator does to let the arm move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Switch {
    /// Nothing, but may let go.
    DeadMan,
    /// Holds Enter down.
    HoldToRun,
}

/// A line of the operator's, and when it came.
#[derive(Debug)]
struct Line {
    text: String,
    at: MonotonicNs,
}

/// A word that confirms, if it comes after `since`.
#[derive(Debug, Clone, Copy)]
struct Question {
    word: &'static str,
    since: MonotonicNs,
}

/// What was typed, and what it means; who has let go once has let go.
#[derive(Debug)]
struct Typed {
    switch: Switch,
    /// The last two empty lines.
    presses: [Option<MonotonicNs>; 2],
    moving: bool,
    question: Option<Question>,
    confirmed: Option<MonotonicNs>,
    let_go: bool,
}

impl Typed {
    const fn nothing(switch: Switch) -> Self {
        Self {
            switch,
            presses: [None; 2],
            moving: false,
            question: None,
            confirmed: None,
            let_go: false,
        }
    }

    fn take(&mut self, line: &Line) {
        let text = line.text.trim();
        let answers = |q: &Question| q.word == text && line.at > q.since;
        if self.switch == Switch::HoldToRun && text.is_empty() {
            self.presses = [self.presses[1], Some(line.at)];
        } else if self.question.as_ref().is_some_and(answers) {
            self.question = None;
            self.confirmed = Some(line.at);
        } else {
            self.let_go = true;
        }
    }

    /// Whether the switch is held as a motion needs it.
    fn is_pressed(&self, now: MonotonicNs) -> bool {
        match (self.switch, self.presses) {
            (Switch::DeadMan, _) => true,
            (Switch::HoldToRun, [Some(before), Some(last)]) => {
                last.since_s(before) <= REPEATED_WITHIN_S && now.since_s(last) <= REPEATED_WITHIN_S
            }
            (Switch::HoldToRun, _) => false,
        }
    }

    fn is_let_go(&mut self, now: MonotonicNs) -> bool {
        self.let_go |= self.moving && !self.is_pressed(now);
        self.let_go
    }

    fn lets_move(&mut self, now: MonotonicNs) -> bool {
        self.moving = !self.is_let_go(now) && self.is_pressed(now);
        self.moving
    }
}

#[derive(Debug)]
pub(crate) struct Presence {
    lines: Receiver<Line>,
    typed: Typed,
}

impl Presence {
    /// At standard input, from now on. The thread that reads it may outlive this: nothing can
    /// wake a read of standard input.
    pub(crate) fn at_standard_input(switch: Switch) -> anyhow::Result<Self> {
        Self::reading(switch, |line| io::stdin().read_line(line))
    }

    fn reading(
        switch: Switch,
        mut read_line: impl FnMut(&mut String) -> io::Result<usize> + Send + 'static,
    ) -> anyhow::Result<Self> {
        let (sender, lines) = sync_channel(WAITING_MAX);
        std::thread::Builder::new()
            .name("operator".to_owned())
            .spawn(move || {
                let mut text = String::new();
                // Its end and an error close the channel, which lets go.
                while read_line(&mut text).is_ok_and(|bytes| bytes > 0) {
                    let text = std::mem::take(&mut text);
                    let at = MonotonicNs(now_ns());
                    if sender.send(Line { text, at }).is_err() {
                        break;
                    }
                }
            })
            .context("cannot watch the operator's switch")?;
        let typed = Typed::nothing(switch);
        Ok(Self { lines, typed })
    }

    /// Takes in what was typed; the present.
    fn look(&mut self) -> MonotonicNs {
        for _ in 0..WAITING_MAX {
            match self.lines.try_recv() {
                Ok(line) => self.typed.take(&line),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => {
                    self.typed.let_go = true;
                    break;
                }
            }
        }
        MonotonicNs(now_ns())
    }

    pub(crate) const fn switch(&self) -> Switch {
        self.typed.switch
    }

    pub(crate) fn is_let_go(&mut self) -> bool {
        let now = self.look();
        self.typed.is_let_go(now)
    }

    /// From now on `word` confirms. What was typed before does not: it lets go.
    pub(crate) fn request(&mut self, word: &'static str) {
        let since = self.look();
        self.typed.question = Some(Question { word, since });
        self.typed.confirmed = None;
    }

    /// When the requested word was typed (CLOCK_MONOTONIC).
    pub(crate) const fn confirmed(&self) -> Option<MonotonicNs> {
        self.typed.confirmed
    }

    /// Whether a motion may begin; from then on the switch must be held until
    /// [`rests`](Self::rests).
    pub(crate) fn lets_move(&mut self) -> bool {
        let now = self.look();
        self.typed.lets_move(now)
    }

    /// Whether the switch is held as a motion needs it, and was never let go.
    pub(crate) fn is_held(&mut self) -> bool {
        let now = self.look();
        !self.typed.is_let_go(now) && self.typed.is_pressed(now)
    }

    /// The motion is over: a key may be released.
    pub(crate) const fn rests(&mut self) {
        self.typed.moving = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    const AT: MonotonicNs = MonotonicNs(1_000_000_000);

    fn line(text: &str, after_s: f64) -> Line {
        Line {
            text: format!("{text}\n"),
            at: AT.plus_s(after_s),
        }
    }

    fn asked(switch: Switch) -> Typed {
        Typed {
            question: Some(Question {
                word: "THROW",
                since: AT,
            }),
            ..Typed::nothing(switch)
        }
    }

    #[test]
    fn a_dead_man_switch_is_held_by_silence_and_the_requested_word_confirms() {
        let mut typed = asked(Switch::DeadMan);
        assert!(typed.lets_move(AT.plus_s(60.0)));
        typed.take(&line(" THROW", 0.1));
        assert_eq!(typed.confirmed, Some(AT.plus_s(0.1)));
        assert!(!typed.is_let_go(AT.plus_s(60.0)));
        // Nobody asked for a second one.
        typed.take(&line("THROW", 0.2));
        assert!(typed.is_let_go(AT) && !typed.lets_move(AT));
    }

    #[test]
    fn another_word_an_early_one_and_an_empty_line_let_go() {
        for early_or_other in [line("throw", 0.1), line("THROW", -0.1), line("", 0.1)] {
            let mut typed = asked(Switch::DeadMan);
            typed.take(&early_or_other);
            assert!(typed.is_let_go(AT), "{early_or_other:?}");
            assert_eq!(typed.confirmed, None);
        }
        let mut typed = Typed::nothing(Switch::DeadMan);
        typed.take(&line("THROW", 0.0));
        assert!(typed.is_let_go(AT), "nobody asked");
    }

    #[test]
    fn a_hold_to_run_control_lets_move_only_while_lines_keep_coming() {
        let mut typed = Typed::nothing(Switch::HoldToRun);
        let at = |s: f64| AT.plus_s(s);
        assert!(!typed.lets_move(at(0.0)) && !typed.is_let_go(at(0.0)));
        typed.take(&line("", 0.0));
        assert!(!typed.lets_move(at(0.1)), "one line is no key held down");
        typed.take(&line("", 0.5));
        assert!(!typed.lets_move(at(0.5)), "nor are two apart");
        typed.take(&line("", 0.6));
        assert!(typed.lets_move(at(0.7)));
        typed.take(&line("", 0.8));
        assert!(!typed.is_let_go(at(1.0)));
        // At rest nothing needs to be held, and an answer may be typed.
        typed.moving = false;
        assert!(!typed.is_let_go(at(5.0)));
        typed.question = Some(Question {
            word: "THROW",
            since: at(5.0),
        });
        typed.take(&line("THROW", 6.0));
        assert!(typed.confirmed.is_some() && !typed.lets_move(at(6.0)));
        typed.take(&line("", 7.0));
        typed.take(&line("", 7.05));
        assert!(typed.lets_move(at(7.1)));
        assert!(typed.is_let_go(at(7.4)), "released in motion");
        typed.take(&line("", 7.5));
        typed.take(&line("", 7.55));
        assert!(!typed.lets_move(at(7.6)), "it has let go for good");
    }

    #[test]
    fn lines_are_read_and_the_end_of_the_input_lets_go() {
        let mut lines = vec!["THROW\n"].into_iter();
        let mut presence = Presence::reading(Switch::DeadMan, move |text| {
            // The question comes first.
            std::thread::sleep(Duration::from_millis(300));
            let line = lines.next().unwrap_or_default();
            text.push_str(line);
            Ok(line.len())
        });
        let presence = presence.as_mut().unwrap();
        presence.request("THROW");
        assert!(!presence.is_let_go() && presence.confirmed().is_none());
        let mut ended = false;
        let began = Instant::now();
        while !ended {
            assert!(began.elapsed() < Duration::from_secs(10));
            ended = presence.is_let_go();
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(presence.confirmed().is_some());
    }
}
