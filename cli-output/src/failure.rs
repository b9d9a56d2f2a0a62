//! How a command fails: its exit code and its one sentence.

use std::{fmt, io};

/// A [`Failure`] for wrong usage or input: exit code 2.
#[macro_export]
macro_rules! bad_input {
    ($($arg:tt)*) => { $crate::Failure::input($crate::anyhow!($($arg)*)) };
}
/// A [`Failure`] of the work itself: exit code 1.
#[macro_export]
macro_rules! failed {
    ($($arg:tt)*) => { $crate::Failure::failed($crate::anyhow!($($arg)*)) };
}

/// A failed command: usage or input is wrong, or the command ran and did not succeed.
#[derive(Debug)]
pub struct Failure {
    is_input: bool,
    error: anyhow::Error,
}

/// What every command returns.
pub type Outcome<T = ()> = Result<T, Failure>;

impl Failure {
    /// Usage or input is wrong: exit code 2.
    pub fn input(error: impl Into<anyhow::Error>) -> Self {
        Self::of(true, error)
    }

    /// The command ran and did not succeed: exit code 1.
    pub fn failed(error: impl Into<anyhow::Error>) -> Self {
        Self::of(false, error)
    }

    /// Bad input, or else a failure of the work.
    pub fn of(is_input: bool, error: impl Into<anyhow::Error>) -> Self {
        let error = error.into();
        Self { is_input, error }
    }

    /// This build lacks what the command needs, which a feature of `wag` brings: bad input.
    pub fn not_built(cannot: &str, feature: &str) -> Self {
        Self::input(anyhow::anyhow!(
            "this build cannot {cannot}; build it with `cargo build --release -p wag --features \
             {feature}` (the Debian package has it)"
        ))
    }

    /// A server that could not be: an address that this machine does not have is bad input.
    pub fn of_server(error: impl Into<anyhow::Error>) -> Self {
        let error = error.into();
        let of_system = error.chain().filter_map(|e| e.downcast_ref::<io::Error>());
        let mut kinds = of_system.map(io::Error::kind);
        let is_input = kinds.any(|kind| kind == io::ErrorKind::AddrNotAvailable);
        Self::of(is_input, error)
    }

    /// Process exit code: 1 for work that failed, 2 for bad input.
    pub fn exit_code(&self) -> u8 {
        if self.is_input { 2 } else { 1 }
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // The whole chain on one line: outer context first, cause last.
        let mut said = String::new();
        for (i, cause) in self.error.chain().enumerate() {
            let text = cause.to_string().replace('\n', " ");
            // Many libraries repeat their source in their own message.
            if i == 0 || !said.contains(&text) {
                if i > 0 {
                    said.push_str(": ");
                }
                said.push_str(&text);
            }
        }
        // Once: it may be made of failures that were told already.
        if !said.contains("did you mean")
            && let Some(suggestion) = suggestion(&said)
        {
            said = format!("{}; {suggestion}", said.trim_end());
        }
        f.write_str(&said)
    }
}

/// Edits up to which a name counts as a slip of another.
const SLIP: usize = 3;

/// What a refusal of an unknown key should have said too, if a known one is near.
///
/// The refusal names the key and the known ones in backticks, as serde does.
fn suggestion(refusal: &str) -> Option<String> {
    let named = refusal.split_once("unknown field ")?.1;
    let mut names = named.split('`').skip(1).step_by(2);
    let unknown = names.next()?;
    nearest(unknown, names).map(|known| format!("did you mean `{known}`?"))
}

/// The known name that `unknown` is probably a slip of.
pub fn nearest<'a>(unknown: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let known = known.into_iter();
    known
        .map(|known| (strsim::damerau_levenshtein(unknown, known), known))
        .filter(|(edits, known)| *edits <= SLIP && 2 * *edits <= known.len())
        .min()
        .map(|(_, known)| known)
}

/// Errors that are the caller's input by default.
pub trait OrInput<T> {
    /// Marks the error as bad input.
    fn or_input(self) -> Outcome<T>;
    /// Marks the error as a failure of the work itself.
    fn or_failed(self) -> Outcome<T>;
}

impl<T, E: Into<anyhow::Error>> OrInput<T> for Result<T, E> {
    fn or_input(self) -> Outcome<T> {
        self.map_err(Failure::input)
    }
    fn or_failed(self) -> Outcome<T> {
        self.map_err(Failure::failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn the_chain_is_one_line_without_repeats() {
        let error = Err::<(), _>(anyhow::anyhow!("root\ncause"))
            .context("while reading x")
            .unwrap_err();
        let failure = Failure::input(error);
        assert_eq!(failure.to_string(), "while reading x: root cause");
        assert_eq!(failure.exit_code(), 2);
    }

    #[test]
    fn what_a_build_lacks_is_told_with_its_feature() {
        let failure = Failure::not_built("write bags of ROS 2", "ros2");
        assert_eq!(failure.exit_code(), 2);
        let words = "this build cannot write bags of ROS 2; build it with `cargo build --release \
                     -p wag --features ros2` (the Debian package has it)";
        assert_eq!(failure.to_string(), words);
    }

    #[test]
    fn a_slip_is_told_and_a_stranger_is_not() {
        let refusal =
            "unknown field `populaton`, expected one of `dimensions`, `population`, `seed`";
        let told = suggestion(refusal);
        assert_eq!(told.as_deref(), Some("did you mean `population`?"));
        let stranger = "unknown field `frobnicate`, expected `dimensions` or `seed`";
        assert_eq!(suggestion(stranger), None);
        assert_eq!(suggestion("missing field `seed`"), None);
    }
}
