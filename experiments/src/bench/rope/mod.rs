//! `experiments bench rope`: cost of the rope simulator per rope and step, of the two jobs
//! it exists for, and how cost grows with links and candidates.

mod jobs;
mod kernels;
mod report;
mod scaling;
mod workload;

use crate::args::BenchArgs;
use crate::bench;
use cli_output::{OrInput, Outcome, Stage};
use serde::Serialize;
use serde_json::Value;
use workload::Workload;

/// How much is measured.
#[derive(Debug, Clone, Copy)]
struct Extent {
    /// Times every piece of work is done; the smallest time counts.
    repeats: usize,
    /// Share of the full number of candidates, as 1 / divisor.
    divisor: usize,
}

impl Extent {
    fn of(quick: bool) -> Self {
        if quick {
            Self {
                repeats: 1,
                divisor: 20,
            }
        } else {
            Self {
                repeats: 5,
                divisor: 1,
            }
        }
    }

    /// A count of candidates at this extent, at least one.
    fn share(self, candidates: usize) -> usize {
        (candidates / self.divisor).max(1)
    }
}

/// Everything measured.
#[derive(Debug, Serialize)]
struct Report {
    repeats: usize,
    kernels: Vec<kernels::KernelRow>,
    jobs: Vec<jobs::JobRow>,
    links: scaling::LinkScaling,
    candidates: Vec<scaling::CandidateRow>,
}

pub fn run(args: &BenchArgs, quiet: bool) -> Outcome<Option<Value>> {
    let extent = Extent::of(args.quick);
    let workload = Workload::new(args.seed).or_failed()?;
    let stage = Stage::begin("kernels");
    let kernels = kernels::measure(&workload, extent, |row| stage.say(row)).or_failed()?;
    stage.done(&format!("{} measured", kernels.len()));
    let stage = Stage::begin("jobs");
    let jobs = jobs::measure(&workload, extent, |row| stage.say(row)).or_failed()?;
    stage.done(&format!("{} measured", jobs.len()));
    let stage = Stage::begin("scaling");
    let links = scaling::over_links(&workload, extent).or_failed()?;
    let candidates = scaling::over_candidates(&workload, extent).or_failed()?;
    stage.done(&format!(
        "{} link counts, {} batch sizes",
        links.rows.len(),
        candidates.len()
    ));
    let report = Report {
        repeats: extent.repeats,
        kernels,
        jobs,
        links,
        candidates,
    };
    let own = serde_json::to_value(&report).or_failed()?;
    Ok(bench::report::report(
        (args, quiet),
        "bench rope",
        own,
        || {
            println!(
                "seed {}, least processor time of {}{}",
                args.seed,
                extent.repeats,
                if args.quick {
                    "; quick: few candidates, rough figures"
                } else {
                    ""
                }
            );
            report.print();
        },
    ))
}
