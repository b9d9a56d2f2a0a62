//! Why a simulated arm does not start.

use std::net::IpAddr;

/// Why a simulated arm did not start.
#[derive(Debug, thiserror::Error)]
pub enum ArmStartError {
    /// A port below 1024 without the right to use it.
    #[error(
        "no permission to listen on port {port} of {bind}: run as root, set \
         net.ipv4.ip_unprivileged_port_start to {port} or less, or choose another port (`wag rig --command-port 5502`)"
    )]
    Permission {
        /// Address.
        bind: IpAddr,
        /// Port.
        port: u16,
    },
    /// Somebody listens there already.
    #[error(
        "port {port} of {bind} is in use: stop the other program, choose another port, or \
         another address such as 127.0.0.2"
    )]
    PortInUse {
        /// Address.
        bind: IpAddr,
        /// Port.
        port: u16,
    },
    /// Any other failure to listen.
    #[error("cannot listen on port {port} of {bind}; is this an address of this machine?")]
    Listen {
        /// Address.
        bind: IpAddr,
        /// Port.
        port: u16,
        /// What the system said.
        source: std::io::Error,
    },
    /// A thread could not be started.
    #[error("cannot start a thread for the simulated arm")]
    Thread(#[from] std::io::Error),
    /// A number of the set-up makes no arm.
    #[error("`{key}` of the simulated arm {why}")]
    Config {
        /// Key.
        key: &'static str,
        /// What is wrong with it.
        why: &'static str,
    },
}
