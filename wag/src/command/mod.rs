//! One file per command.

mod area;
mod bench_record;
mod bench_rt;
mod calib;
mod check;
mod config;
mod demo;
mod doctor;
mod dry_run;
mod film;
mod film_input;
mod identify;
mod known_rope;
mod latency;
mod learned;
mod ledger;
mod manual;
mod motion;
mod network;
mod on_arm;
mod plan;
mod plan_again;
mod process;
mod record;
mod rig;
mod rope;
mod run;
mod runs;
mod score;
mod sim;
mod studio;
mod throw;
mod track;
mod watch;
mod wiggle;
mod wiggle_design;

use crate::cli::{BenchName, CalibCommand, Cli, Command, PlanCommand, RopeCommand, SimCommand};
use cli_output::{OrInput, Outcome};
use serde_json::Value;
use shared_types::Task;
use std::path::Path;

/// Files a command is asked to write. Minutes of work must not end with the news
/// that there is no such folder.
fn results(command: &Command) -> Vec<&Path> {
    let named: &[Option<&Path>] = match command {
        Command::Sim(SimCommand::Rope(args)) => &[Some(&args.out)],
        Command::Sim(SimCommand::Throw(args)) => &[Some(&args.out)],
        Command::Wiggle(args) => &[args.csv.as_deref()],
        Command::Film(args) => &[Some(&args.out)],
        Command::Track(args) => &[Some(&args.out), args.overlay.as_deref()],
        Command::Identify(args) => &[Some(&args.out)],
        Command::Calib(CalibCommand::Extrinsics { out, .. }) => &[Some(out)],
        Command::Plan(
            PlanCommand::Strike(args) | PlanCommand::Lob(args) | PlanCommand::Drape(args),
        ) => &[Some(&args.out), args.csv.as_deref(), args.reach.as_deref()],
        Command::Plan(PlanCommand::Again(args)) => &[Some(&args.out)],
        Command::Rope(RopeCommand::New(args)) => &[Some(&args.out)],
        Command::Latency(args) => &[args.response.as_deref()],
        Command::Report { out, .. } => &[out.as_deref()],
        Command::Ledger(args) => &[args.csv.as_deref()],
        _ => &[],
    };
    named.iter().flatten().copied().collect()
}

/// Runs a command. The value is what `--json` prints.
pub fn run(cli: &Cli) -> Outcome<Option<Value>> {
    for path in results(&cli.command) {
        run_log::files::check_writable(path).or_input()?;
    }
    match &cli.command {
        Command::Demo(args) => demo::run(args),
        Command::Run(args) => run::run(args),
        Command::Rig(args) => rig::run(args),
        Command::Sim(SimCommand::Rope(args)) => sim::rope(args),
        Command::Sim(SimCommand::Throw(args)) => sim::throw(args),
        Command::Wiggle(args) => wiggle::run(args),
        Command::Film(args) => film::run(args),
        Command::Track(args) => track::run(args),
        Command::Identify(args) => identify::run(args),
        Command::Plan(PlanCommand::Strike(args)) => plan::run(Task::Strike, args),
        Command::Plan(PlanCommand::Lob(args)) => plan::run(Task::Lob, args),
        Command::Plan(PlanCommand::Drape(args)) => plan::run(Task::Drape, args),
        Command::Plan(PlanCommand::Again(args)) => plan_again::run(args),
        Command::Rope(RopeCommand::New(args)) => rope::new(args),
        Command::Check(args) => check::run(args),
        Command::Throw(args) => throw::run(args),
        Command::Latency(args) => latency::run(args),
        Command::Watch(args) => watch::run(args),
        Command::Studio(args) => studio::run(cli, args),
        Command::Record(args) => record::run(args),
        Command::Replay { run, from_cycle } => runs::replay(run, *from_cycle),
        Command::Explain { run } => runs::explain(run),
        Command::Export(command) => command.run().map(Some),
        Command::Report { run, out } => runs::report(run, out.as_deref()),
        Command::Ledger(args) => ledger::run(args),
        Command::Score(args) => score::run(args),
        Command::Calib(command) => calib::run(command),
        // Benchmarks compare with limits and do not judge: the exit code is 0 whatever they find.
        Command::Bench(args) => match args.name {
            BenchName::Rt => bench_rt::run(args),
            BenchName::Record => bench_record::run(args),
        },
        Command::Config(command) => config::run(command),
        Command::Doctor { address, ports } => doctor::run(*address, ports),
        Command::Man { folder } => manual::man(folder),
        Command::Completions { shell } => Ok(manual::completions(*shell)),
        Command::Process(args) => process::run(args).map(|()| None),
    }
}
