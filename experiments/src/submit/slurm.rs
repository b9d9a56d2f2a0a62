//! Shards as array jobs of a Slurm cluster.

use super::engine::Engine;
use super::shards::{Shards, quoted};
use crate::args::SubmitArgs;
use anyhow::{Context, ensure};
use std::collections::BTreeSet;
use std::os::unix::process::CommandExt;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// How often the cluster is asked.
const ASK: Duration = Duration::from_secs(5);
/// For how long a cluster may give no answer.
const SILENCE_MAX: Duration = Duration::from_mins(5);
/// Most tasks of an array: Slurm's own default of `MaxArraySize` is one more.
const ARRAY_MAX: u64 = 1000;
/// Reasons to wait that pass by themselves.
const USUAL: [&str; 6] = [
    "None",
    "Priority",
    "Resources",
    "JobArrayTaskLimit",
    "Dependency",
    "BeginTime",
];
/// Variables that change which jobs are listed, or wait for a job's end.
const MISLEADING: [&str; 6] = [
    "SBATCH_WAIT",
    "SQUEUE_STATES",
    "SQUEUE_PARTITION",
    "SQUEUE_ACCOUNT",
    "SQUEUE_USERS",
    "SQUEUE_NAMES",
];

/// Array jobs, one after the other. Partition, account, memory and time limit are what Slurm's own
/// variables say (`SBATCH_PARTITION` and so on). Dropped, they are cancelled.
#[derive(Debug)]
pub struct Slurm {
    workers: u32,
    threads: u16,
    jobs: Vec<Job>,
    numbers: Vec<u64>,
    asked: Instant,
    answered: Instant,
    /// States that have been told.
    told: BTreeSet<String>,
}

/// A job's number, and its cluster where there are several.
#[derive(Debug)]
struct Job {
    id: String,
    cluster: Option<String>,
}

impl Job {
    /// A command about it, or about all jobs of its cluster.
    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        let cluster = self.cluster.iter();
        command.args(cluster.map(|name| format!("--clusters={name}")));
        command
    }
}

impl Slurm {
    /// For shards of these arguments.
    pub fn new(args: &SubmitArgs) -> Self {
        let now = Instant::now();
        Self {
            workers: args.workers,
            threads: args.threads,
            jobs: Vec::new(),
            numbers: Vec::new(),
            asked: now,
            answered: now,
            told: BTreeSet::new(),
        }
    }

    /// Hands over shards of one array, whose indices count from `before`.
    fn submit_array(
        &mut self,
        shards: &Shards,
        numbers: &[u64],
        before: u64,
    ) -> anyhow::Result<()> {
        let mut command = Command::new("sbatch");
        command.args(["--parsable", "--output=/dev/null", "--dependency=singleton"]);
        // One array of a submission at a time: `--workers` holds for each.
        command.arg(format!("--job-name=shards-{}", shards.token()));
        let indices: Vec<u64> = numbers.iter().map(|number| number - before).collect();
        command.arg(format!("--array={}%{}", ranges(&indices), self.workers));
        command.arg(format!("--cpus-per-task={}", self.threads));
        let script = quoted(&shards.script().to_string_lossy());
        let folder = quoted(&shards.folder().to_string_lossy());
        let token = shards.token();
        command.arg("--wrap").arg(format!(
            "n=$((SLURM_ARRAY_TASK_ID + {before})); exec {script} \"$n\" {token} >>{folder}/shard-\"$n\".log 2>&1"
        ));
        let printed = run(&mut command).context("Slurm did not take the shards")?;
        // "job" or "job;cluster".
        let mut words = printed.trim().split(';').map(str::to_owned);
        let id = words.next().filter(|id| !id.is_empty());
        self.jobs.push(Job {
            id: id.context("sbatch told no job's number")?,
            cluster: words.next(),
        });
        Ok(())
    }

    /// Whether the cluster still has one of the jobs; tells why those wait that wait for something
    /// unusual.
    fn is_listed(&mut self) -> anyhow::Result<bool> {
        let mut is_listed = false;
        for job in &self.jobs {
            // Asked for one job, it fails where that job has been forgotten.
            let mut command = job.command("squeue");
            command.args(["--noheader", "--me", "--format=%F|%T|%r"]);
            for line in run(&mut command)?.lines() {
                let mut words = line.trim().splitn(3, '|');
                let (id, state, reason) = (words.next(), words.next(), words.next());
                if id != Some(&job.id[..]) {
                    continue;
                }
                is_listed = true;
                let reason = reason.unwrap_or_default();
                if state == Some("PENDING")
                    && !USUAL.contains(&reason)
                    && self.told.insert(reason.to_owned())
                {
                    eprintln!("shards of Slurm's job {} wait: {reason}", job.id);
                }
            }
        }
        Ok(is_listed)
    }
}

impl Engine for Slurm {
    fn submit(&mut self, shards: &Shards, numbers: &[u64]) -> anyhow::Result<()> {
        self.numbers = numbers.to_vec();
        for array in numbers.chunk_by(|a, b| (a - 1) / ARRAY_MAX == (b - 1) / ARRAY_MAX) {
            let before = array
                .first()
                .map_or(0, |first| (first - 1) / ARRAY_MAX * ARRAY_MAX);
            self.submit_array(shards, array, before)?;
        }
        (self.asked, self.answered) = (Instant::now(), Instant::now());
        Ok(())
    }

    fn is_over(&mut self, shards: &Shards) -> anyhow::Result<bool> {
        if self.asked.elapsed() >= ASK {
            self.asked = Instant::now();
            match self.is_listed() {
                Ok(true) => self.answered = Instant::now(),
                Ok(false) => self.jobs.clear(),
                // Its controller may be restarting.
                Err(_) if self.answered.elapsed() < SILENCE_MAX => {}
                Err(error) => return Err(error.context("Slurm gives no answer")),
            }
        }
        // Jobs that have made everything are about to end.
        let missing = shards.missing();
        if !self.numbers.iter().any(|number| missing.contains(number)) {
            self.jobs.clear();
        }
        Ok(self.jobs.is_empty())
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        for job in &self.jobs {
            // The shards that wait make nothing then, and those begun end by themselves.
            if let Err(error) = run(job.command("scancel").arg(&job.id)) {
                eprintln!("Slurm's job {} is not cancelled: {error:#}", job.id);
            }
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

/// What a command of Slurm prints. Ctrl-C is not its to answer.
fn run(command: &mut Command) -> anyhow::Result<String> {
    let name = command.get_program().to_string_lossy().into_owned();
    for variable in MISLEADING {
        command.env_remove(variable);
    }
    let found = command.process_group(0).output();
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
