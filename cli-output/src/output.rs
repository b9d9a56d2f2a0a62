//! Everything this program writes to its standard streams.
//!
//! The macros here take the place of the standard `print!`, `println!` and
//! `eprintln!`, which panic when nobody reads any more: a command that drives an
//! arm must not end in the middle because `| head -1` had enough. SIGPIPE stays
//! ignored for the same reason.

use std::fmt;
use std::io::{self, ErrorKind, Write};
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
    ($($arg:tt)*) => { $crate::output::line(format_args!($($arg)*)) };
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

static STATE: Mutex<State> = Mutex::new(State {
    taken: false,
    closed: false,
    failed: None,
    object: false,
});

fn state() -> MutexGuard<'static, State> {
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

impl State {
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

/// Prints text for people.
pub fn text(text: fmt::Arguments<'_>) {
    let mut state = state();
    if state.taken {
        drop(state);
        aside(text);
    } else {
        state.write(&mut io::stdout(), text.to_string().as_bytes());
    }
}

/// Prints a line for people.
pub fn line(line: fmt::Arguments<'_>) {
    text(format_args!("{line}\n"));
}

/// Prints to standard error, where nothing can be done about a failure.
pub fn aside(text: fmt::Arguments<'_>) {
    let _ = io::stderr().write_all(text.to_string().as_bytes());
}

/// Writes a file the user asked for to standard output; from here on what is for
/// people goes to standard error.
pub fn data(bytes: &[u8]) {
    let mut state = state();
    state.taken = true;
    state.write(&mut io::stdout(), bytes);
}

/// Prints the one JSON object of a command, at once, unless one was printed.
pub fn object(value: &serde_json::Value) {
    let mut state = state();
    if !std::mem::replace(&mut state.object, true) {
        drop(state);
        line(format_args!("{value:#}"));
    }
}

/// Why standard output could not be written, if that matters: a reader who left
/// early has what they wanted.
pub fn failure() -> Option<String> {
    state().failed.clone()
}
