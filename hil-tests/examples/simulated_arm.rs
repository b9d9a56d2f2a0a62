//! Runs a simulated xArm 7 until it is killed.
//!
//! `simulated_arm [COMMAND_PORT REALTIME NORMAL RICH REAL]`, by default
//! 502 30000 30001 30002 30003 on 127.0.0.1.

use hil_tests::arm::{ArmConfig, ArmStartError, serve_forever};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("simulated_arm: {message}");
            ExitCode::from(2)
        }
    }
}

fn run() -> Result<(), String> {
    let ports = std::env::args()
        .skip(1)
        .map(|text| {
            text.parse::<u16>()
                .map_err(|error| format!("`{text}` is no port number: {error}"))
        })
        .collect::<Result<Vec<_>, _>>()?;
    let config = match ports.as_slice() {
        [] => ArmConfig::default(),
        [command, a, b, c, d] => ArmConfig {
            command_port: *command,
            report_ports: [*a, *b, *c, *d],
            ..ArmConfig::default()
        },
        _ => return Err("give five ports or none".to_owned()),
    };
    serve_forever(config, &AtomicBool::new(false)).map_err(|error: ArmStartError| error.to_string())
}
