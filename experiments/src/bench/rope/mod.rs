//! `experiments bench rope`: cost of the rope simulator per rope and step, of the two jobs
//! it exists for, and how cost grows with links and candidates.

mod jobs;
mod kernels;
mod scaling;
mod workload;

use crate::args::BenchArgs;
use crate::report::{print_table, report};
use cli_output::{OrInput, Outcome, Stage};
use serde_json::{Value, json};
use workload::{LINKS, Workload};

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
        let (repeats, divisor) = if quick { (1, 20) } else { (5, 1) };
        Self { repeats, divisor }
    }

    /// A count of candidates at this extent, at least one.
    fn share(self, candidates: usize) -> usize {
        (candidates / self.divisor).max(1)
    }
}

pub fn run(args: &BenchArgs) -> Outcome<Option<Value>> {
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
    let own = json!({
        "repeats": extent.repeats, "kernels": kernels, "jobs": jobs, "links": links,
        "candidates": candidates,
    });
    Ok(report(args, "bench rope", own, || {
        let rough = if args.quick {
            "; quick: few candidates, rough figures"
        } else {
            ""
        };
        println!(
            "seed {}, least processor time of {}{rough}",
            args.seed, extent.repeats
        );
        println!("\nOne thread, {LINKS} links, processor time per rope-step:");
        print_table(&kernels, 0, kernels::TABLE);
        println!("\nJobs on all cores:");
        print_table(&jobs, 2, jobs::TABLE);
        println!("\nCost against links, one thread:");
        print_table(&links.rows, 0, scaling::LINKS_TABLE);
        println!(
            "line: {:.2} ns per link-step + {:.0} ns, R² = {:.5}",
            links.slope_ns_per_link_step, links.intercept_ns, links.r_squared
        );
        println!("\nCost against candidates, one thread, arm spline each:");
        print_table(&candidates, 0, scaling::CANDIDATES_TABLE);
    }))
}
