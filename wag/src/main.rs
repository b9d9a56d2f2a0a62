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

// First: its macros stand for the standard ones everywhere below.
#[macro_use]
mod output;

mod cli;
mod command;
mod config;
mod doctor;
mod failure;
mod files;
mod ledger;
mod mcap_file;
mod pipeline;
mod progress;
mod recording;
mod report;
mod session;
mod table;
mod watch;

use clap::Parser;
use std::io::IsTerminal;
use std::process::ExitCode;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::prelude::*;

fn main() -> ExitCode {
    let cli = match cli::Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => return refuse_usage(&e),
    };
    start_logging(cli.verbose);
    let code = match command::run(&cli) {
        Ok(result) => {
            if cli.json
                && let Some(value) = result
            {
                output::object(&value);
            }
            0
        }
        Err(failure) => {
            if cli.json {
                output::object(&serde_json::json!({ "ok": false, "error": failure.to_string() }));
            }
            eprintln!("error: {failure}");
            failure.exit_code()
        }
    };
    ExitCode::from(match output::failure() {
        Some(reason) => {
            eprintln!("error: cannot write to standard output: {reason}");
            code.max(1)
        }
        None => code,
    })
}

/// Help, version or a wrong command line; `--json` counts even there.
fn refuse_usage(error: &clap::Error) -> ExitCode {
    let text = error.render();
    if !error.use_stderr() {
        print!("{text}");
        return ExitCode::SUCCESS;
    }
    if std::env::args_os().any(|arg| arg == "--json") {
        let text = text.to_string();
        let said = text.trim().strip_prefix("error: ").unwrap_or(&text);
        output::object(&serde_json::json!({ "ok": false, "error": said }));
    }
    if std::io::stderr().is_terminal() {
        eprint!("{}", text.ansi());
    } else {
        eprint!("{text}");
    }
    ExitCode::from(2)
}

/// Logs to standard error; `WAG_LOG` sets the filter (`debug`, `planner=trace`).
fn start_logging(verbose: u8) {
    let default = match verbose {
        0 => "warn,iceoryx2=error,tract_onnx=error",
        1 => "info,iceoryx2=error,tract_onnx=error",
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
