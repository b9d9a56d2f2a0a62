//! The area around a real arm: nothing moves before somebody says that it is
//! clear.

use crate::cli::ArmArgs;
use cli_output::{OrInput, Outcome, output};
use std::io::{BufRead, IsTerminal, Write, stdin, stdout};
use std::net::IpAddr;

/// How the area was found clear.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Declaration {
    /// The arm is simulated, or nothing will move.
    NotNeeded,
    /// On the command line.
    Given,
    /// The operator has to type it.
    ToBeTyped,
    /// There is nobody to ask.
    Missing,
}

fn declaration(address: Option<IpAddr>, dry_run: bool, yes: bool, terminal: bool) -> Declaration {
    match address {
        Some(address) if !address.is_loopback() && !dry_run => match (yes, terminal) {
            (true, _) => Declaration::Given,
            (false, true) => Declaration::ToBeTyped,
            (false, false) => Declaration::Missing,
        },
        _ => Declaration::NotNeeded,
    }
}

/// Makes sure that the area around the arm is clear for a motion called `word`:
/// by `--yes`, or by the operator who types the word. A simulated arm is in
/// nobody's way.
pub fn require_clear_area(arm: &ArmArgs, word: &str) -> Outcome {
    let terminal = stdin().is_terminal() && !output::is_json();
    let refuse = |why: &str| {
        let address = arm.address.map(|a| a.to_string()).unwrap_or_default();
        Err(bad_input!(
            "{address} is a real arm: clear the area, keep the emergency stop in reach, and {why}"
        ))
    };
    match declaration(arm.address, arm.dry_run, arm.yes, terminal) {
        Declaration::NotNeeded | Declaration::Given => Ok(()),
        Declaration::Missing => refuse("add --yes"),
        Declaration::ToBeTyped => {
            print!(
                "The arm will move. Emergency stop in reach, nobody within reach of arm and rope?\n\
                 Area clear: type {word} "
            );
            stdout().flush().or_failed()?;
            let mut line = String::new();
            stdin().lock().read_line(&mut line).or_failed()?;
            if line.trim() == word {
                Ok(())
            } else {
                refuse(&format!("type {word}; nothing has moved"))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_real_arm_that_will_move_needs_a_declaration() {
        let real = Some("192.0.2.1".parse().unwrap());
        let simulated = Some("127.0.0.1".parse().unwrap());
        let of = declaration;
        assert_eq!(of(None, false, false, false), Declaration::NotNeeded);
        assert_eq!(of(simulated, false, false, false), Declaration::NotNeeded);
        assert_eq!(of(real, true, false, false), Declaration::NotNeeded);
        assert_eq!(of(real, false, true, false), Declaration::Given);
        assert_eq!(of(real, false, false, true), Declaration::ToBeTyped);
        assert_eq!(of(real, false, false, false), Declaration::Missing);
    }
}
