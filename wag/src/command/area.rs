//! The area around a real arm: nothing moves before somebody says that it is
//! clear.

use crate::cli::ArmArgs;
use crate::pipeline::ArmAddress;
use cli_output::{OrInput, Outcome, output};
use rt_controller::session::ArmSession;
use std::io::{BufRead, IsTerminal, Write, stdin, stdout};
use std::time::Duration;

/// Longest wait for an arm that is asked whether it is simulated.
const WAIT: Duration = Duration::from_secs(2);

/// The arm that will move; `None` for a dry run. It is real unless it proves that it is
/// simulated: its address may be a tunnel's.
///
/// # Errors
/// Nobody is there.
fn reach(arm: &ArmArgs) -> Outcome<Option<ArmAddress>> {
    let Some(ip) = arm.address.filter(|_| !arm.dry_run) else {
        return Ok(None);
    };
    let ports = &arm.ports;
    let mut session = ArmSession::connect((ip, ports.command_port).into(), WAIT).or_failed()?;
    let simulated = session.proves_simulated().unwrap_or_else(|error| {
        tracing::warn!(%error, "whether the arm is simulated is unknown");
        false
    });
    Ok(Some(ArmAddress {
        ip,
        command: ports.command_port,
        joints: ports.report_port,
        status: [ports.status_port; 2],
        simulated,
    }))
}

/// Whether somebody is there to type the word.
const fn can_ask(terminal: bool, json: bool) -> bool {
    terminal && !json
}

/// Makes sure that the area around the arm is clear for a motion called `word`:
/// by `--yes`, or by the operator who types the word. A simulated arm is in nobody's way.
/// Returns the arm; `None` for a dry run.
pub fn require_clear_area(arm: &ArmArgs, word: &str) -> Outcome<Option<ArmAddress>> {
    let reached = reach(arm)?;
    let Some(address) = reached.filter(|a| !a.simulated && !arm.yes) else {
        return Ok(reached);
    };
    let refuse = |why: &str| {
        Err(bad_input!(
            "{}:{} does not prove that it is a simulated arm: clear the area, keep the emergency stop in reach, and {why}",
            address.ip,
            address.command
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
    Ok(reached)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_operator_is_asked_on_a_terminal_alone() {
        assert!(can_ask(true, false) && !can_ask(false, false));
        assert!(!can_ask(true, true), "standard output is for JSON alone");
    }
}
