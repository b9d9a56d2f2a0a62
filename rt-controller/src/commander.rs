//! One commander per arm on this machine.
//!
//! Two programs that stream to one arm make it jerk: it executes whichever
//! setpoint came last. A controller therefore takes a name in the system's
//! abstract socket space for the arm it brings up. The name goes with the
//! process however it ends, so nothing is left to clean up, and it tells who
//! holds it. Programs on other machines are noticed by their traces only.

use crate::os::process::peer_pid;
use std::io::ErrorKind;
use std::net::SocketAddr as ArmAddress;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};

/// Why this process may not command an arm: who does, or what the system said.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct CommanderError(String);

/// The right to command one arm; given up when dropped.
#[derive(Debug)]
pub struct CommanderLock {
    _name: UnixListener,
}

impl CommanderLock {
    /// Takes the arm at `arm`.
    ///
    /// # Errors
    /// [`CommanderError`], with the process that has it.
    pub fn take(arm: ArmAddress) -> Result<Self, CommanderError> {
        let name = SocketAddr::from_abstract_name(format!("wiggle-and-go/commander/{arm}"));
        let taken = name.and_then(|name| match UnixListener::bind_addr(&name) {
            Err(reason) if reason.kind() == ErrorKind::AddrInUse => Ok(Err(holder(&name))),
            bound => bound.map(Ok),
        });
        match taken {
            Ok(Ok(name)) => Ok(Self { _name: name }),
            Ok(Err(holder)) => Err(CommanderError(format!(
                "the arm at {arm} already has a commander on this machine, {holder}: end it first"
            ))),
            Err(reason) => Err(CommanderError(format!(
                "cannot lock the arm at {arm} for this process: {reason}"
            ))),
        }
    }
}

/// Who has taken a name.
fn holder(name: &SocketAddr) -> String {
    let stream = UnixStream::connect_addr(name).ok();
    stream.and_then(|stream| peer_pid(&stream)).map_or_else(
        || "a process that does not show itself".to_owned(),
        |pid| format!("process {pid}"),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_commander_hears_who_is_first_and_may_follow_it() {
        // A port that no test arm gets.
        let arm: ArmAddress = "127.0.0.1:1".parse().unwrap();
        let other: ArmAddress = "127.0.0.1:2".parse().unwrap();
        let first = CommanderLock::take(arm).unwrap();
        let refusal = CommanderLock::take(arm).unwrap_err().to_string();
        let pid = std::process::id();
        assert!(refusal.contains(&format!("process {pid}:")), "{refusal}");
        assert!(CommanderLock::take(other).is_ok(), "another arm is free");
        drop(first);
        assert!(CommanderLock::take(arm).is_ok());
    }
}
