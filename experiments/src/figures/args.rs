//! The command line of `experiments figures`.

use clap::{Args, Subcommand};
use std::path::PathBuf;

/// Figures of README and book.
#[derive(Debug, Subcommand)]
pub enum FiguresCommand {
    /// Run studies with seeds that follow from the commit, and keep their figures.
    ///
    /// Studies: strike, lob, drape, strike-loaded (throws of `wag demo`, the last with eight busy
    /// threads beside it), two-terminals (`wag run` in front of a `wag rig`), sim-pipeline,
    /// lob-drape, full-pipeline, sysid, sysid-ood, wiggle-ablation, motion-fidelity, robust,
    /// parameter-importance (the results of these names), sysid-nn, lob-drape-nn, lob-drape-cmaes
    /// (the same with `--method nn` and `cmaes`, the paper's), rope-accuracy, contact-dynamics,
    /// contact-dynamics-fine (steps of 0.1 ms; these two have no seed). Some take a minute, together they
    /// take hours; an interrupted one goes on where it was. Nothing else should run on the machine,
    /// and sources that differ from their commit are refused.
    Make(MakeFiguresArgs),
    /// Write the figures kept into documents.
    Write(FillFiguresArgs),
    /// Fail where a document says something else than the figures kept.
    Check(FillFiguresArgs),
}

/// Arguments of `experiments figures make`.
#[derive(Debug, Args)]
pub struct MakeFiguresArgs {
    /// Studies by name; default: all.
    #[arg(value_name = "STUDY")]
    pub studies: Vec<String>,
    /// Folder that keeps the report of each run, and the runs that failed.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// The program `wag`; default: the one next to this program.
    #[arg(long, value_name = "FILE")]
    pub wag: Option<PathBuf>,
    /// Runs of each study; default: 100 strikes, 30 lobs and drapes, 20 loaded strikes, 10 in two
    /// terminals, once the others.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub runs: Option<u64>,
    /// Folder of the figures.
    #[arg(long, value_name = "DIR", default_value = "docs/figures")]
    pub records: PathBuf,
}

/// Arguments of `experiments figures write` and `check`.
#[derive(Debug, Args)]
pub struct FillFiguresArgs {
    /// Documents with blocks of figures.
    #[arg(value_name = "FILE", default_values = ["README.md", "docs/src/figures.md", "docs/src/numbers.md", "docs/src/planning.md", "docs/src/contacts.md", "docs/src/simulator.md"])]
    pub documents: Vec<PathBuf>,
    /// Folder of the figures.
    #[arg(long, value_name = "DIR", default_value = "docs/figures")]
    pub records: PathBuf,
}
