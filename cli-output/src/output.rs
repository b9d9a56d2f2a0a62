//! Everything this program writes to its standard streams.
//!
//! The macros here take the place of the standard `print!`, `println!` and
//! `eprintln!`, which panic when nobody reads any more: a command that drives an
//! arm must not end in the middle because `| head -1` had enough. SIGPIPE stays
//! ignored for the same reason.

use std::fmt;
use std::io::{self, ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// As the standard one, without its panic.
#[macro_export]
macro_rules! print {
    ($($arg:tt)*) => { $crate::output::text(format_args!($($arg)*)) };
}
/// As the standard one, without its panic.
#[macro_export]
macro_rules! println {
    () => { $crate::output::text(format_args!("\n")) };
    ($($arg:tt)*) => { $crate::output::text(format_args!("{}\n", format_args!($($arg)*))) };
}
/// As the standard one, without its panic.
#[macro_export]
macro_rules! eprint {
    ($($arg:tt)*) => { $crate::output::aside(format_args!($($arg)*)) };
}
/// As the standard one, without its panic.
#[macro_export]
macro_rules! eprintln {
    ($($arg:tt)*) => { $crate::output::aside(format_args!("{}\n", format_args!($($arg)*))) };
}

/// What became of standard output.
#[derive(Debug)]
struct State {
    /// Only the JSON object is for standard output, nothing for people.
    json: bool,
    /// What is printed goes to standard error, because a file the user asked for
    /// is written to standard output.
    taken: bool,
    /// Nobody reads it any more.
    closed: bool,
    /// Why the first write failed.
    failed: Option<String>,
    /// A whole JSON object was printed.
    object: bool,
}

static STATE: Mutex<State> = Mutex::new(State::NEW);
static EVENTS: AtomicBool = AtomicBool::new(false);

fn state() -> MutexGuard<'static, State> {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

impl State {
    const NEW: Self = Self {
        json: false,
        taken: false,
        closed: false,
        failed: None,
        object: false,
    };

    /// Writes while somebody reads; keeps the first failure.
    fn write(&mut self, to: &mut dyn Write, bytes: &[u8]) {
        if self.closed || self.failed.is_some() {
            return;
        }
        if let Err(e) = to.write_all(bytes).and_then(|()| to.flush()) {
            if e.kind() == ErrorKind::BrokenPipe {
                self.closed = true;
            } else {
                self.failed = Some(e.to_string());
            }
        }
    }
}

/// With `--json`: from here on the one object is printed, and nothing for people.
pub fn set_json(json: bool) {
    state().json = json;
}

/// Whether `--json` was asked for.
pub fn is_json() -> bool {
    state().json
}

/// From here on events are told; with `--json` nothing else tells of stages.
pub fn tell_events() {
    EVENTS.store(true, Ordering::Relaxed);
}

/// Whether events are told to the program that runs this one.
pub fn tells_events() -> bool {
    EVENTS.load(Ordering::Relaxed)
}

/// Prints text for people; with `--json` nothing.
pub fn text(text: fmt::Arguments<'_>) {
    let mut state = state();
    if state.json {
        return;
    }
    if state.taken {
        drop(state);
        aside(text);
    } else {
        state.write(&mut io::stdout(), text.to_string().as_bytes());
    }
}

/// Prints to standard error, where nothing can be done about a failure.
pub fn aside(text: fmt::Arguments<'_>) {
    let _ = io::stderr().write_all(text.to_string().as_bytes());
}

/// Prints a line to standard error for people; with `--json` the object tells it, unless events
/// are told, whose reader shows it.
pub fn remark(line: fmt::Arguments<'_>) {
    if !is_json() || tells_events() {
        aside(format_args!("{line}\n"));
    }
}

/// Writes a file the user asked for to standard output; from here on what is for
/// people goes to standard error.
pub fn data(bytes: &[u8]) {
    let mut state = state();
    state.taken = true;
    state.write(&mut io::stdout(), bytes);
}

/// Prints the one JSON object of a command, at once, unless one was printed or none was
/// asked for.
pub fn object(value: &serde_json::Value) {
    let mut state = state();
    if state.json && !state.object {
        state.object = true;
        let bytes = format!("{value:#}\n");
        if state.taken {
            drop(state);
            aside(format_args!("{bytes}"));
        } else {
            state.write(&mut io::stdout(), bytes.as_bytes());
        }
    }
}

/// Why standard output could not be written, if that matters: a reader who left
/// early has what they wanted.
pub fn failure() -> Option<String> {
    state().failed.clone()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stream that fails in one way after some bytes.
    struct Ends(usize, ErrorKind);

    impl Write for Ends {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if self.0 == 0 {
                return Err(self.1.into());
            }
            let n = bytes.len().min(self.0);
            self.0 -= n;
            Ok(n)
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_reader_who_leaves_is_no_failure_and_a_full_disk_is() {
        let mut state = State::NEW;
        state.write(&mut Ends(3, ErrorKind::BrokenPipe), b"four");
        assert!(state.closed && state.failed.is_none());
        let mut kept = Vec::new();
        state.write(&mut kept, b"more");
        assert!(kept.is_empty(), "nobody reads");
        let mut state = State::NEW;
        state.write(&mut Ends(0, ErrorKind::StorageFull), b"four");
        state.write(&mut Ends(0, ErrorKind::Other), b"four");
        let full = io::Error::from(ErrorKind::StorageFull).to_string();
        assert_eq!(state.failed, Some(full));
    }
}
