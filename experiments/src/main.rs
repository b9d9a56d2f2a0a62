//! `experiments`: results of the paper and benchmarks, on simulated ropes.
//!
//! Exit codes: 0 done, 1 ran and failed, 2 bad usage or input.
#![allow(
    unreachable_pub,
    reason = "in a binary `pub` means: for the rest of the program"
)]
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

// Its macros stand for the standard ones everywhere below.
#[macro_use]
extern crate cli_output;

mod args;
mod bench;
mod figures;
mod network;
mod program;
mod report;
mod results;
mod rooms;
mod submit;
mod throws;

use std::process::ExitCode;

fn main() -> ExitCode {
    let cli: args::Cli = match cli_output::parse(std::env::args_os()) {
        Ok(cli) => cli,
        Err(e) => return cli_output::refuse_usage(&submit::with_hint(e)),
    };
    cli_output::start(cli.json, cli.verbose);
    let outcome = match &cli.command {
        args::Command::Bench(bench) => bench::run(bench),
        args::Command::Figures(command) => figures::run(command),
        args::Command::Rooms(args) => rooms::run(args),
        args::Command::Throws(args) => throws::run(args),
        args::Command::TrackRooms(args) => rooms::track::run(args),
        args::Command::Merge(args) => results::merge(args),
        args::Command::Submit(args) => submit::run(args),
        args::Command::Result(result) => results::run(result),
    };
    cli_output::finish(outcome)
}
