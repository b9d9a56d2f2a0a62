//! What a command tells the program that runs it: how far it is, and what it waits for.
//!
//! Each event is one line on standard error, a record separator (RFC 7464) before one JSON
//! object, so that it cannot be taken for a line that is meant for people.

use crate::output;
use serde::{Deserialize, Serialize};

/// Stands before each event.
const SEPARATOR: char = '\u{1e}';

/// One event.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// A stage began.
    Stage {
        /// Its name.
        stage: String,
    },
    /// What it does now.
    Progress {
        /// In words.
        text: String,
    },
    /// A stage is over.
    Done {
        /// Its name.
        stage: String,
        /// Its result, in words.
        result: String,
    },
    /// Somebody must write `word` to standard input before the arm moves.
    Ask {
        /// The word.
        word: String,
        /// What it confirms.
        text: String,
    },
    /// The word has come.
    Confirmed {
        /// The word.
        word: String,
    },
    /// The arm waits until empty lines keep coming, and moves only while they do.
    Hold,
    /// It has moved; no lines are needed.
    Release,
}

impl Event {
    /// The event of a line of standard error; `None` for lines that are meant for people.
    #[must_use]
    pub fn of_line(line: &str) -> Option<Self> {
        serde_json::from_str(line.strip_prefix(SEPARATOR)?).ok()
    }
}

/// Writes an event, if any are wanted; whether they are.
pub fn tell(event: &Event) -> bool {
    if output::tells_events()
        && let Ok(text) = serde_json::to_string(event)
    {
        // In one piece: other threads write there, too.
        output::aside(format_args!("{SEPARATOR}{text}\n"));
    }
    output::tells_events()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_are_told_apart_from_words_and_read_back() {
        let event = Event::Ask {
            word: "THROW".to_owned(),
            text: "at the start".to_owned(),
        };
        let text = serde_json::to_string(&event).unwrap();
        assert_eq!(
            text,
            r#"{"event":"ask","word":"THROW","text":"at the start"}"#
        );
        assert_eq!(Event::of_line(&format!("{SEPARATOR}{text}")), Some(event));
        assert_eq!(Event::of_line(&text), None);
        assert_eq!(Event::of_line("\u{1e}{}"), None);
    }
}
