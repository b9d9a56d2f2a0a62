//! The two jobs the simulator exists for, on all cores.

use super::Extent;
use super::workload::{Workload, roll_out, throw_options};
use crate::bench::spent::least;
use rope_sim::{
    Candidate, FrameTimes, Kernel, Outcome, Precision, SimOptions, SimulateError, Watch,
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
#[derive(Debug, Clone, Serialize)]
pub struct JobRow {
    /// `throw` or `wiggle`.
    pub job: &'static str,
    /// Kernel.
    pub kernel: String,
    /// Candidates run.
    pub candidates: usize,
    /// Simulated time of each (s).
    pub horizon_s: f64,
    /// Step (s).
    pub step_s: f64,
    /// Threads.
    pub threads: usize,
    /// Processor time of all threads (s).
    pub cpu_s: f64,
    /// Wall time (s).
    pub wall_s: f64,
    /// Rollouts per second of wall time.
    pub rollouts_per_s: f64,
    /// Rollouts that blew up and were repeated at a quarter of the step.
    pub repeated: usize,
    /// Rollouts that blew up even then.
    pub diverged: usize,
    /// Processor time these candidates may take (s); none for other kernels.
    pub limit_cpu_s: Option<f64>,
    /// Whether they took no more.
    pub within_limit: Option<bool>,
}

/// Measures both jobs with the fastest single-precision kernel, and with AVX2 if that
/// is another one.
///
/// # Errors
/// What the simulator refuses.
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

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// What planning one throw takes: 25 generations of 60 candidates.
fn throw_job(workload: &Workload, extent: Extent) -> Job<'_> {
    let whole = 1500;
    Job {
        name: "throw",
        candidates: workload.throwing(extent.share(whole)),
        options: throw_options(1.5, threads()),
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
        ..throw_options(6.67, threads())
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
    let (spent, (_, rollouts)) = least(extent.repeats, || {
        roll_out(kernel, &job.candidates, &job.options)
    })?;
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
