//! `wag`: wiggle a rope, know it, throw it.
//!
//! The composition root: it starts the processes, asks them, records, and shows
//! the result. Exit codes: 0 done, 1 ran and failed, 2 bad usage or input.
#![allow(
    unreachable_pub,
    reason = "in a binary `pub` means: for the rest of the program"
)]
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

// Its macros stand for the standard ones everywhere below.
#[macro_use]
extern crate cli_output;

mod cli;
mod command;
mod config;
mod pipeline;

use std::process::ExitCode;

fn main() -> ExitCode {
    let cli: cli::Cli = match cli_output::parse(std::env::args_os()) {
        Ok(cli) => cli,
        Err(error) => return cli_output::refuse_usage(&error),
    };
    if cli.events {
        cli_output::output::tell_events();
    }
    cli_output::start(cli.json, cli.verbose);
    if let Some(file) = &cli.cell {
        config::name_cell(file);
    }
    cli_output::finish(command::run(&cli))
}
