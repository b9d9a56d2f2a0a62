//! One file per command.

mod area;
mod bench;
mod check;
mod demo;
mod demo_summary;
mod explain;
mod identify;
mod latency;
mod plan;
mod process;
mod record;
mod replay;
mod reproduce;
mod rig;
mod score;
mod sim;
mod throw;
mod track;
mod wiggle;
mod wiggle_design;

use crate::cli::{Cli, Command, PlanCommand, SimCommand};
use crate::failure::Outcome;
use serde_json::Value;

/// Runs a command. The value is what `--json` prints.
pub fn run(cli: &Cli) -> Outcome<Option<Value>> {
    let quiet = cli.json;
    match &cli.command {
        Command::Demo(args) => demo::run(args, quiet),
        Command::Rig(args) => rig::run(args, quiet),
        Command::Sim(SimCommand::Rope(args)) => sim::rope(args, quiet),
        Command::Sim(SimCommand::Throw(args)) => sim::throw(args, quiet),
        Command::Wiggle(args) => wiggle::run(args, quiet),
        Command::Track(args) => track::run(args, quiet),
        Command::Identify(args) => identify::run(args, quiet),
        Command::Plan(PlanCommand::Strike(args)) => plan::strike(args, quiet),
        Command::Plan(PlanCommand::Lob(_)) => Err(plan::not_there("lob")),
        Command::Plan(PlanCommand::Drape(_)) => Err(plan::not_there("drape")),
        Command::Check(args) => check::run(args, quiet),
        Command::Throw(args) => throw::run(args, quiet),
        Command::Latency(args) => latency::run(args, quiet),
        Command::Record(args) => record::run(args, quiet),
        Command::Replay(args) => replay::run(args, quiet),
        Command::Explain(args) => explain::run(args, quiet),
        Command::Score(args) => score::run(args, quiet),
        Command::Bench(args) => bench::run(args, quiet),
        Command::Reproduce(args) => reproduce::run(args, quiet),
        Command::Process(args) => process::run(args).map(|()| None),
    }
}
