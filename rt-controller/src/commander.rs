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

/// Why this process may not command an arm.
#[derive(Debug, thiserror::Error)]
pub enum CommanderError {
    /// Another process of this machine does.
    #[error(
        "the arm at {arm} already has a commander on this machine, {}: end it first", holder(*.pid)
    )]
    Taken {
        /// Arm.
        arm: ArmAddress,
        /// Process that commands it, if the system says.
        pid: Option<u32>,
    },
    /// The system gives no lock.
    #[error("cannot lock the arm at {arm} for this process: {reason}")]
    Lock {
        /// Arm.
        arm: ArmAddress,
        /// What the system said.
        reason: std::io::Error,
    },
}

fn holder(pid: Option<u32>) -> String {
    pid.map_or_else(
        || "a process that does not show itself".to_owned(),
        |pid| format!("process {pid}"),
    )
}

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
        let name = SocketAddr::from_abstract_name(format!("wiggle-and-go/commander/{arm}"))
            .map_err(|reason| CommanderError::Lock { arm, reason })?;
        match UnixListener::bind_addr(&name) {
            Ok(name) => Ok(Self { _name: name }),
            Err(reason) if reason.kind() == ErrorKind::AddrInUse => Err(CommanderError::Taken {
                arm,
                pid: UnixStream::connect_addr(&name)
                    .ok()
                    .and_then(|stream| peer_pid(&stream)),
            }),
            Err(reason) => Err(CommanderError::Lock { arm, reason }),
        }
    }
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
