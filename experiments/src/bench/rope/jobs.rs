//! The two jobs the simulator exists for, on all cores.

use super::Extent;
use super::workload::{Workload, throw_options, timed};
use crate::report::Column;
use cli_output::Machine;
use rope_sim::{
    Candidate, FrameTimes, Kernel, Outcome, Precision, Scene, SimOptions, SimulateError, Watch,
};
use serde::Serialize;

/// AVX2 kernels, with half the lanes, may take this much longer.
const AVX2_FACTOR: f64 = 1.6;

/// What a job is and what it may cost.
struct Job<'a> {
    name: &'static str,
    candidates: Vec<Candidate<'a>>,
    options: SimOptions,
    /// Candidates of the whole job; fewer run in a quick benchmark.
    whole: usize,
    /// Processor time the whole job may take with AVX-512 (s).
    limit_cpu_s: f64,
}

/// One job with one kernel.
#[derive(Debug, Serialize)]
pub struct JobRow {
    /// `throw` or `wiggle`.
    job: &'static str,
    kernel: String,
    /// Candidates run.
    candidates: usize,
    /// Simulated time of each (s).
    horizon_s: f64,
    step_s: f64,
    threads: usize,
    /// Processor time of all threads (s).
    cpu_s: f64,
    wall_s: f64,
    /// Rollouts per second of wall time.
    rollouts_per_s: f64,
    /// Rollouts that blew up and were repeated at a quarter of the step.
    repeated: usize,
    /// Rollouts that blew up even then.
    diverged: usize,
    /// Processor time these candidates may take (s); none for other kernels.
    limit_cpu_s: Option<f64>,
    within_limit: Option<bool>,
}

pub const TABLE: [Column<JobRow>; 7] = [
    ("job", |row| {
        let step_ms = 1e3 * row.step_s;
        let (candidates, horizon_s) = (row.candidates, row.horizon_s);
        format!("{}: {candidates} x {horizon_s} s at {step_ms} ms", row.job)
    }),
    ("CPU (s)", |row| format!("{:.2}", row.cpu_s)),
    ("wall (s)", |row| format!("{:.2}", row.wall_s)),
    ("rollouts per s", |row| format!("{:.0}", row.rollouts_per_s)),
    ("repeated/diverged", |row| {
        format!("{}/{}", row.repeated, row.diverged)
    }),
    ("kernel", |row| row.kernel.clone()),
    ("limit", |row| match (row.limit_cpu_s, row.within_limit) {
        (Some(limit), Some(true)) => format!("{limit:.2} s kept"),
        (Some(limit), Some(false)) => format!("{limit:.2} s exceeded"),
        _ => "none".to_owned(),
    }),
];

/// Measures both jobs with the fastest single-precision kernel, and with AVX2 if that
/// is another one.
pub fn measure(
    workload: &Workload,
    extent: Extent,
    say: impl Fn(String),
) -> Result<Vec<JobRow>, SimulateError> {
    let fastest = Precision::F32.fastest_kernel();
    let mut kernels = vec![fastest];
    if Kernel::Avx2F32.is_available() && fastest != Kernel::Avx2F32 {
        kernels.push(Kernel::Avx2F32);
    }
    let jobs = [throw_job(workload, extent), wiggle_job(workload, extent)];
    let mut rows = Vec::new();
    for kernel in kernels {
        for job in &jobs {
            say(format!("{} with {kernel:?}", job.name));
            rows.push(measure_one(kernel, job, extent)?);
        }
    }
    Ok(rows)
}

/// What planning one throw takes: 25 generations of 60 candidates.
fn throw_job(workload: &Workload, extent: Extent) -> Job<'_> {
    let whole = 1500;
    Job {
        name: "throw",
        candidates: workload.throwing(extent.share(whole)),
        options: throw_options(1.5, Machine::here().cores),
        whole,
        limit_cpu_s: 1.0,
    }
}

/// What identifying one rope takes: all nodes recorded in 400 frames.
fn wiggle_job(workload: &Workload, extent: Extent) -> Job<'_> {
    let whole = 3000;
    let options = SimOptions {
        step_s: 1e-3,
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 1.0 / 60.0,
            count: 400,
        },
        watch: Watch::NOTHING,
        ..throw_options(6.67, Machine::here().cores)
    };
    Job {
        name: "wiggle",
        candidates: workload.on(&workload.wiggle, extent.share(whole)),
        options,
        whole,
        limit_cpu_s: 3.5,
    }
}

fn measure_one(kernel: Kernel, job: &Job, extent: Extent) -> Result<JobRow, SimulateError> {
    let (scene, candidates) = (&Scene::EMPTY, &job.candidates);
    let timed = timed(extent.repeats, scene, kernel, candidates, &job.options)?;
    let (spent, rollouts) = (timed.spent, timed.rollouts);
    let count = |outcome| rollouts.iter().filter(|r| r.outcome == outcome).count();
    let factor = match kernel {
        Kernel::Avx512F32 => Some(1.0),
        Kernel::Avx2F32 => Some(AVX2_FACTOR),
        _ => None,
    };
    let part = job.candidates.len() as f64 / job.whole as f64;
    let limit_cpu_s = factor.map(|f| f * part * job.limit_cpu_s);
    Ok(JobRow {
        job: job.name,
        kernel: format!("{kernel:?}"),
        candidates: rollouts.len(),
        horizon_s: job.options.horizon_s,
        step_s: job.options.step_s,
        threads: job.options.threads,
        cpu_s: spent.cpu_s,
        wall_s: spent.wall_s,
        rollouts_per_s: rollouts.len() as f64 / spent.wall_s,
        repeated: count(Outcome::RerunAtQuarterStep),
        diverged: count(Outcome::Diverged),
        limit_cpu_s,
        within_limit: limit_cpu_s.map(|limit| spent.cpu_s <= limit),
    })
}
