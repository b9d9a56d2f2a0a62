//! The area around a real arm: nothing moves before somebody says that it is
//! clear.

use crate::cli::ArmArgs;
use cli_output::{OrInput, Outcome, output};
use std::io::{BufRead, IsTerminal, Write, stdin, stdout};
use std::net::IpAddr;

/// The arm's address, where somebody has to declare that the area is clear: it is real and
/// will move. A simulated arm is in nobody's way.
fn undeclared(arm: &ArmArgs) -> Option<IpAddr> {
    arm.address
        .filter(|address| !address.is_loopback() && !arm.dry_run && !arm.yes)
}

/// Whether somebody is there to type the word.
const fn can_ask(terminal: bool, json: bool) -> bool {
    terminal && !json
}

/// Makes sure that the area around the arm is clear for a motion called `word`:
/// by `--yes`, or by the operator who types the word.
pub fn require_clear_area(arm: &ArmArgs, word: &str) -> Outcome {
    let Some(address) = undeclared(arm) else {
        return Ok(());
    };
    let refuse = |why: &str| {
        Err(bad_input!(
            "{address} is a real arm: clear the area, keep the emergency stop in reach, and {why}"
        ))
    };
    if !can_ask(stdin().is_terminal(), output::is_json()) {
        return refuse("add --yes");
    }
    print!(
        "The arm will move. Emergency stop in reach, nobody within reach of arm and rope?\n\
         Area clear: type {word} "
    );
    stdout().flush().or_failed()?;
    let mut line = String::new();
    stdin().lock().read_line(&mut line).or_failed()?;
    if line.trim() != word {
        return refuse(&format!("type {word}; nothing has moved"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::{Cli, Command};
    use clap::Parser;

    #[test]
    fn only_a_real_arm_that_will_move_needs_a_declaration() {
        for (args, is_needed) in [
            ("", false),
            ("--arm 127.0.0.1", false),
            ("--arm 192.0.2.1 --dry-run", false),
            ("--arm 192.0.2.1 --yes", false),
            ("--arm 192.0.2.1", true),
        ] {
            let line = format!("wag wiggle {args}");
            let Command::Wiggle(wiggle) = Cli::parse_from(line.split_whitespace()).command else {
                panic!("another command");
            };
            assert_eq!(undeclared(&wiggle.arm).is_some(), is_needed, "{args}");
        }
        assert!(can_ask(true, false) && !can_ask(false, false));
        assert!(!can_ask(true, true), "standard output is for JSON alone");
    }
}
