//! Shards as an array job of a Slurm cluster.

use super::engine::Engine;
use super::shards::{Shards, quoted};
use crate::args::SubmitArgs;
use anyhow::{Context, ensure};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// How often the cluster is asked; marks of shards are looked for all the time.
const ASK: Duration = Duration::from_secs(5);
/// For how long a cluster may give no answer.
const SILENCE_MAX: Duration = Duration::from_mins(5);

/// An array job. Partition, account and time limit are what Slurm's own variables say
/// (`SBATCH_PARTITION`, `SBATCH_ACCOUNT`, `SBATCH_TIMELIMIT`). Dropped, it is cancelled.
#[derive(Debug)]
pub struct Slurm {
    workers: u32,
    threads: u16,
    job: Option<Job>,
}

#[derive(Debug)]
struct Job {
    id: String,
    numbers: Vec<u64>,
    asked: Instant,
    answered: Instant,
}

impl Slurm {
    /// For shards of these arguments.
    pub fn new(args: &SubmitArgs) -> Self {
        Self {
            workers: args.workers,
            threads: args.threads,
            job: None,
        }
    }
}

impl Engine for Slurm {
    fn submit(&mut self, shards: &Shards, numbers: &[u64]) -> anyhow::Result<()> {
        let folder = shards.folder().display();
        let mut command = Command::new("sbatch");
        command.args(["--parsable", "--job-name=shards", "--open-mode=append"]);
        command.arg(format!("--array={}%{}", ranges(numbers), self.workers));
        command.arg(format!("--cpus-per-task={}", self.threads));
        command.arg(format!("--output={folder}/shard-%a.log"));
        let script = quoted(&shards.script().to_string_lossy());
        command.arg("--wrap").arg(format!(
            "exec {script} \"$SLURM_ARRAY_TASK_ID\" {}",
            shards.token()
        ));
        let printed = run(&mut command).context(
            "Slurm did not take the shards; a site may allow fewer in one array (MaxArraySize): --shards",
        )?;
        // "job" or "job;cluster".
        let id = printed.trim().split(';').next().unwrap_or_default();
        ensure!(!id.is_empty(), "sbatch told no job's number");
        self.job = Some(Job {
            id: id.to_owned(),
            numbers: numbers.to_vec(),
            asked: Instant::now(),
            answered: Instant::now(),
        });
        Ok(())
    }

    fn is_over(&mut self, shards: &Shards) -> anyhow::Result<bool> {
        let Some(job) = &mut self.job else {
            return Ok(true);
        };
        if job.numbers.iter().all(|number| shards.is_made(*number)) {
            self.job = None;
            return Ok(true);
        }
        if job.asked.elapsed() < ASK {
            return Ok(false);
        }
        job.asked = Instant::now();
        // Asked for one job, it fails where that job has been forgotten.
        match run(Command::new("squeue").args(["--noheader", "--me", "--format=%F"])) {
            Ok(jobs) => {
                job.answered = Instant::now();
                let is_there = jobs.lines().any(|line| line.trim() == job.id);
                if !is_there {
                    self.job = None;
                }
                Ok(!is_there)
            }
            // Its controller may be restarting.
            Err(_) if job.answered.elapsed() < SILENCE_MAX => Ok(false),
            Err(error) => Err(error.context(format!("job {} is not known to have ended", job.id))),
        }
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        if let Some(job) = &self.job {
            // Without it the shards that wait make nothing, and those begun end by themselves.
            let _ = run(Command::new("scancel").arg(&job.id));
        }
    }
}

/// Numbers that rise, as Slurm writes them: `1-4,7`.
fn ranges(numbers: &[u64]) -> String {
    let together = numbers.chunk_by(|a, b| a + 1 == *b);
    let written = together.map(|numbers| match numbers {
        [first, .., last] => format!("{first}-{last}"),
        one => one.iter().map(u64::to_string).collect(),
    });
    written.collect::<Vec<_>>().join(",")
}

/// What a command of Slurm prints.
fn run(command: &mut Command) -> anyhow::Result<String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let found = command.output();
    let Output {
        status,
        stdout,
        stderr,
    } = found
        .with_context(|| format!("cannot start `{name}`: is this machine one of a cluster?"))?;
    let said = String::from_utf8_lossy(&stderr);
    ensure!(status.success(), "`{name}`: {}", said.trim());
    Ok(String::from_utf8_lossy(&stdout).into_owned())
}

#[cfg(test)]
mod tests {
    use super::ranges;

    #[test]
    fn neighbours_are_written_as_ranges() {
        assert_eq!(ranges(&[1, 2, 3, 4, 7, 9, 10]), "1-4,7,9-10");
        assert_eq!(ranges(&[5]), "5");
    }
}
