//! The command line a run was made with.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::time::SystemTime;

/// How a run was made.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CommandLine {
    /// Version of the program.
    pub version: String,
    /// When (UTC, RFC 3339).
    pub started: String,
    /// Where.
    pub working_directory: PathBuf,
    /// Arguments, the program's own name left out.
    pub arguments: Vec<String>,
}

impl CommandLine {
    /// That of this very program.
    pub fn of_this_program(now: SystemTime) -> Self {
        Self {
            version: shared_types::VERSION.to_owned(),
            started: humantime::format_rfc3339_seconds(now).to_string(),
            working_directory: std::env::current_dir().unwrap_or_default(),
            arguments: std::env::args_os()
                .skip(1)
                .map(|arg| arg.to_string_lossy().into_owned())
                .collect(),
        }
    }

    /// What makes such a run once more: results go into a new folder, and whoever
    /// confirmed that the area is clear confirms it anew.
    pub fn again(&self) -> Vec<String> {
        let mut again = Vec::new();
        let mut arguments = self.arguments.iter();
        while let Some(argument) = arguments.next() {
            match argument.as_str() {
                "--out" => {
                    arguments.next();
                }
                "--yes" | "--confirm" => {}
                other if other.starts_with("--out=") => {}
                _ => again.push(argument.clone()),
            }
        }
        again
    }
}

/// Words as a shell takes them.
pub fn quoted(words: &[String]) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    words
        .iter()
        .map(|word| {
            if !word.is_empty() && word.chars().all(plain) {
                word.clone()
            } else {
                format!("'{}'", word.replace('\'', "'\\''"))
            }
        })
        .collect::<Vec<_>>()
        .join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_made_again_in_a_new_folder_and_asks_again() {
        let words = |text: &str| text.split(' ').map(str::to_owned).collect::<Vec<_>>();
        let line = CommandLine {
            version: String::new(),
            started: String::new(),
            working_directory: PathBuf::new(),
            arguments: words(
                "throw plan.json --out runs/a --arm 10.0.0.1 --yes --out=b --dead-man",
            ),
        };
        assert_eq!(
            line.again(),
            words("throw plan.json --arm 10.0.0.1 --dead-man")
        );
    }

    #[test]
    fn words_survive_a_shell() {
        let words = ["a b", "it's", "", "$HOME", "--target=1,-0.5,0"].map(str::to_owned);
        let text = format!("printf '%s\\n' {}", quoted(&words));
        let output = std::process::Command::new("sh")
            .args(["-c", &text])
            .output()
            .unwrap();
        let back: Vec<String> = String::from_utf8(output.stdout)
            .unwrap()
            .lines()
            .map(str::to_owned)
            .collect();
        assert_eq!(back, words);
    }
}
