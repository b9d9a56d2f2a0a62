//! Arguments of `wag ledger`.

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use cli_output::seed;
use run_log::ledger::RunResult;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct LedgerArgs {
    #[command(subcommand)]
    pub instead: Option<LedgerCommand>,
    /// Run folders, or folders of them; default: runs.
    #[arg(value_name = "FOLDER")]
    pub places: Vec<PathBuf>,
    /// Only runs with this outcome, such as `failed`: a broken one lacks a file, or one is damaged.
    #[arg(long, value_parser = results())]
    pub result: Option<RunResult>,
    /// Only runs of this command: the first word after `wag`, such as `demo`.
    #[arg(long, value_name = "NAME")]
    pub command: Option<String>,
    /// Only runs with this seed in their summary or plan, such as 17.
    #[arg(long, global = true, alias = "seed-is", value_parser = seed)]
    pub seed: Option<u64>,
    /// Only runs whose plan's `trajectory_sha256` begins like this, such as 9cc7b663.
    #[arg(long, value_name = "HASH")]
    pub plan: Option<String>,
    /// Write the list as CSV too.
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
}

fn results() -> impl TypedValueParser<Value = RunResult> {
    PossibleValuesParser::new(["ok", "failed", "broken"]).try_map(|name| name.parse())
}

#[derive(Debug, Subcommand)]
pub enum LedgerCommand {
    /// Show the values in which two runs differ.
    Compare {
        /// Run folder.
        first: PathBuf,
        /// Run folder to compare with it.
        second: PathBuf,
    },
    /// Print the command line that reruns a run into a new folder.
    Rerun {
        /// Run folder.
        run: PathBuf,
        /// Execute it. A real arm asks for confirmation again that its area is clear.
        #[arg(long)]
        go: bool,
    },
}
