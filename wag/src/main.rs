//! `wag`: wiggle a rope, know it, throw it.
//!
//! The composition root: it starts the processes, asks them, records, and shows
//! the result. Exit codes: 0 done, 1 ran and failed, 2 bad usage or input.
#![allow(
    unreachable_pub,
    reason = "in a binary `pub` means: for the rest of the program"
)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::float_cmp,
        reason = "tests may fail loudly"
    )
)]

mod cli;
mod command;
mod failure;
mod files;
mod pipeline;
mod progress;
mod recording;
mod session;
mod table;

use clap::Parser;
use std::io::IsTerminal;
use std::process::ExitCode;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::prelude::*;

fn main() -> ExitCode {
    let cli = match cli::Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            let _ = e.print();
            return ExitCode::from(if e.use_stderr() { 2 } else { 0 });
        }
    };
    start_logging(cli.verbose);
    match command::run(&cli) {
        Ok(result) => {
            if cli.json
                && let Some(value) = result
            {
                println!("{value:#}");
            }
            ExitCode::SUCCESS
        }
        Err(failure) => {
            if cli.json {
                println!(
                    "{:#}",
                    serde_json::json!({ "ok": false, "error": failure.to_string() })
                );
            }
            eprintln!("error: {failure}");
            ExitCode::from(failure.exit_code())
        }
    }
}

/// Logs to standard error; `WAG_LOG` sets the filter (`debug`, `planner=trace`).
fn start_logging(verbose: u8) {
    let default = match verbose {
        0 => "warn,iceoryx2=error",
        1 => "info,iceoryx2=error",
        _ => "debug",
    };
    let filter: Targets = std::env::var("WAG_LOG")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or_else(|| default.parse().unwrap_or_default());
    tracing_subscriber::registry()
        .with(filter)
        .with(
            tracing_subscriber::fmt::layer()
                .with_writer(std::io::stderr)
                .with_ansi(std::io::stderr().is_terminal()),
        )
        .init();
}
