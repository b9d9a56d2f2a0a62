//! What a motion of an arm stands on before it is brought up: which arm answers, how it follows,
//! who operates it, and that somebody says that the area is clear.

use super::dry_run::interface_to;
use crate::cli::ArmArgs;
use crate::config;
use crate::pipeline::{ArmAddress, Service};
use anyhow::Context;
use arm_model::{ArmResponse, Limits};
use cli_output::{OrInput, Outcome, output};
use rt_controller::config::measured_lags;
use rt_controller::session::ArmSession;
use run_log::files;
use shared_types::CommandInterface;
use std::io::{BufRead, IsTerminal, Write, stdin, stdout};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Longest wait for an arm that is asked whether it is simulated.
const WAIT: Duration = Duration::from_secs(2);

/// The arm that will move; `None` for a dry run. It is real unless it proves that it is
/// simulated: its address may be a tunnel's.
///
/// # Errors
/// Nobody is there.
pub fn reach(arm: &ArmArgs) -> Outcome<Option<ArmAddress>> {
    if let Some(domain) = &arm.controller {
        let service = Service::find(domain).or_failed()?;
        if let Some(fault) = service.stopped.filter(|_| !arm.acknowledge) {
            return Err(failed!("{}", session::has_stopped(fault)));
        }
        if service.config.pole != config::cell().or_input()?.pole {
            return Err(bad_input!(
                "the controller of `{domain}` watches the end of another pole than the cell has (`wag config show cell`): bring `pole` in its configuration in line and start it again"
            ));
        }
        return Ok(Some(service.into()));
    }
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
        arm_response: None,
        service: None,
    }))
}

/// The limits that a motion must keep: those of the controller that runs, else those that hold
/// here.
pub fn limits(arm: &ArmArgs, address: Option<&ArmAddress>) -> Outcome<Limits> {
    match address.and_then(|address| address.service.as_ref()) {
        Some(service) => service.config.resolve_limits().or_failed(),
        None => config::here::<Limits>(arm.limits.as_deref()).or_input(),
    }
}

/// The same, and how its joints follow their setpoints, for motions that are fast enough for a
/// lag to look like a jammed joint.
///
/// # Errors
/// Nobody is there, or the arm is real and was not measured.
pub fn reach_measured(arm: &ArmArgs) -> Outcome<Option<ArmAddress>> {
    if let Some(named) = &arm.arm_response {
        response_of(named)?;
    }
    let Some(address) = reach(arm)? else {
        return Ok(None);
    };
    let named = match &address.service {
        Some(service) => service.config.arm_response_file.clone(),
        None => arm.arm_response.clone(),
    };
    let places: Vec<PathBuf> = config::arm_response_files().or_input()?.collect();
    let here = || {
        let mut places = places.iter();
        let there = places.find(|file| file.try_exists().unwrap_or(true));
        let may = !address.simulated && address.service.is_none();
        there.cloned().filter(|_| may)
    };
    let Some(path) = named.clone().or_else(here) else {
        if address.simulated {
            return Ok(Some(address));
        }
        if let Some(domain) = &arm.controller {
            return Err(bad_input!(
                "how this arm follows its setpoints was not measured, and its lag could look like a jammed joint: run `wag latency --controller {domain} --response FILE`, name that file as `arm_response_file` in the controller's configuration, and start it again"
            ));
        }
        let place = places.first().map_or_else(String::new, |file| {
            format!(" --response '{}'", file.display())
        });
        return Err(bad_input!(
            "how this arm follows its setpoints was not measured, and its lag could look like a jammed joint: run `wag latency --arm {}{place}` first",
            address.ip
        ));
    };
    let response = response_of(&path)?;
    let shown = path.display();
    let of = response.source.strip_prefix("arm ");
    let of = of.and_then(|place| place.parse::<SocketAddr>().ok());
    if named.is_none() && of.is_some_and(|of| of.ip() != address.ip) {
        return Err(bad_input!(
            "`{shown}` tells of the {}, not of the arm at {}: measure this one, or name the file with --arm-response",
            response.source,
            address.ip
        ));
    }
    let path = std::path::absolute(&path).or_input()?;
    let arm_response = Some((path, response));
    Ok(Some(ArmAddress {
        arm_response,
        ..address
    }))
}

/// How an arm follows, for plans that compensate for it: it was measured by positions and tells
/// nothing of an arm that is sent velocities.
pub fn response_for_plans(address: &ArmAddress) -> Outcome<Option<ArmResponse>> {
    let by_position = interface_to(Some(address))? == CommandInterface::ServoPosition;
    let measured = address.arm_response.as_ref().filter(|_| by_position);
    Ok(measured.map(|(_, response)| response.clone()))
}

/// How an arm follows, from a file that the controller can use.
fn response_of(path: &Path) -> Outcome<ArmResponse> {
    let again = || {
        let path = path.display();
        format!("`{path}` is of no use: measure the arm again with `wag latency --arm ADDR`")
    };
    let response = files::read_arm_response(path)
        .with_context(again)
        .or_input()?;
    let usable = measured_lags(&response).map_err(anyhow::Error::from);
    usable.with_context(again).or_input()?;
    Ok(response)
}

/// Whether somebody must say that the area is clear.
pub const fn asks(arm: &ArmArgs, address: &ArmAddress) -> bool {
    arm.ask || !address.simulated
}

/// Who operates the arm.
///
/// # Errors
/// Nobody is named, and the arm is real.
pub fn operator(arm: &ArmArgs, address: &ArmAddress) -> Outcome<Option<String>> {
    let user = || {
        let mut keys = ["USER", "LOGNAME"].iter();
        keys.find_map(|key| std::env::var(key).ok())
            .filter(|_| asks(arm, address))
    };
    let named = arm.operator.clone().or_else(user);
    let named = named.filter(|name| !name.trim().is_empty());
    if named.is_none() && !address.simulated {
        return Err(bad_input!("name who operates the arm with --operator NAME"));
    }
    Ok(named)
}

/// Whether somebody is there to type the word.
const fn can_ask(terminal: bool, json: bool) -> bool {
    terminal && !json
}

/// Makes sure that the area around the arm is clear before it is brought up: by `--yes`, or by
/// the operator who types `word`. A simulated arm is in nobody's way.
pub fn require_clear_area(arm: &ArmArgs, address: &ArmAddress, word: &str) -> Outcome {
    if !asks(arm, address) {
        return Ok(());
    }
    eprintln!(
        "Board or wall of an earlier throw must be away: no move and no wiggle goes around it."
    );
    if arm.yes {
        return Ok(());
    }
    let refuse = |why: &str| {
        let (ip, port) = (address.ip, address.command);
        let asked = if address.simulated {
            "--ask asks as for a real arm".to_owned()
        } else {
            format!("{ip}:{port} does not prove that it is a simulated arm")
        };
        Err(bad_input!(
            "{asked}: clear the area, keep the emergency stop in reach, and {why}"
        ))
    };
    if !can_ask(stdin().is_terminal(), output::is_json()) {
        return refuse("add --yes, or type the word at a terminal, without --json");
    }
    print!(
        "The arm will be enabled and move to its start. Emergency stop in reach, nobody within reach of arm and rope?\n\
         Area clear: type {word} "
    );
    stdout().flush().or_failed()?;
    let mut line = String::new();
    stdin().lock().read_line(&mut line).or_failed()?;
    if line.trim() != word {
        return refuse(&format!(
            "type {word}, in capitals; `{}` moves nothing",
            line.trim()
        ));
    }
    Ok(())
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
