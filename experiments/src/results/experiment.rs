//! What every result shares: set-up, trials that survive an interruption, report.

use super::checkpoint::{Checkpoint, Origin};
use super::picture::{self, Curve};
use crate::args::ResultArgs;
use crate::network::with_network;
use crate::report::{Column, joined, print_table};
use cli_output::{OrInput, Outcome, Stage, interrupted};
use experiments::trials::{Trial, TrialRig, run as identify_all};
use planner::PlannerConfig;
use planner::identify::{IdentifyOptions, Method};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use shared_types::RopeParams;
use shared_types::ipc::message::Progress;
use std::path::PathBuf;
use std::sync::atomic::Ordering;

/// Ropes of a result of identification.
const IDENTIFIED: u64 = 1000;

/// The planner's built-in configuration, independent of this machine's folders: results
/// must be the same everywhere. Throws are searched for at once, as in the paper.
pub(crate) fn built_in() -> Result<PlannerConfig, toml::de::Error> {
    let mut config: PlannerConfig =
        toml::from_str(include_str!("../../../configs/planner/planner.toml"))?;
    config.search.library_candidates = 0;
    Ok(config)
}

/// A number of a table; a dash where there is none.
pub(super) fn number(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "-".to_owned();
    }
    format!("{value:.digits$}")
}

/// Metres as centimetres of a table.
pub(super) fn cm(m: f64) -> String {
    number(100.0 * m, 2)
}

/// One run of a result.
pub(super) struct Experiment<'a> {
    name: &'static str,
    stage: Stage,
    pub args: &'a ResultArgs,
    pub config: PlannerConfig,
    /// Films the wiggle of the configuration.
    pub rig: TrialRig,
    /// How to identify.
    pub options: IdentifyOptions,
}

/// A sequence of trials.
pub(super) struct Sequence<T> {
    /// Distinguishes the trials of one checkpoint file from those of others, beside name
    /// and seed.
    pub method: String,
    /// Trials wanted.
    pub count: u64,
    /// Trials that each thread makes between two writes of the file.
    pub per_thread: usize,
    /// Figure of the latest trial that progress shows, and its label.
    pub figure: (fn(&T) -> f64, &'static str),
}

impl<'a> Experiment<'a> {
    pub fn begin(name: &'static str, args: &'a ResultArgs) -> Outcome<Self> {
        let method: Method = args.method.into();
        let config = built_in().or_failed()?;
        let mut rig = TrialRig::new(&config.wiggle).or_failed()?;
        with_network(&mut rig, method, args.model.as_deref())?;
        cli_output::watch_interrupts().or_failed()?;
        Ok(Self {
            name,
            stage: Stage::begin(name),
            args,
            rig,
            options: IdentifyOptions {
                method,
                seed: args.seed,
                threads: args.threads.map_or(config.identify.threads, usize::from),
                ..config.identify
            },
            config,
        })
    }

    /// The method as checkpoint files name it.
    pub fn method(&self) -> String {
        format!("{:?}", self.options.method).to_lowercase()
    }

    /// A sequence of as many trials as ropes are asked for.
    pub fn sequence<T>(
        &self,
        default_count: u64,
        per_thread: usize,
        figure: (fn(&T) -> f64, &'static str),
    ) -> Sequence<T> {
        Sequence {
            method: self.method(),
            count: self.args.ropes.unwrap_or(default_count),
            per_thread,
            figure,
        }
    }

    /// Makes the trials of a sequence, or goes on with those of an earlier run; none where only a
    /// shard of them was asked for, which is made then.
    pub fn trials<T: Serialize + DeserializeOwned>(
        &self,
        sequence: Sequence<T>,
        make: impl Fn(&[u64]) -> anyhow::Result<Vec<T>>,
    ) -> Outcome<Option<Vec<T>>> {
        let (out, shard) = (self.args.out.as_deref(), self.args.shard);
        let count = shard.len(sequence.count);
        let (name, seed, method) = (self.name, self.args.seed, sequence.method);
        let network = self.rig.network.as_ref();
        let network = network.map(|net| net.metadata().graph_sha256.clone());
        let empty = Checkpoint {
            origin: Origin::here(name, (seed, method), network, sequence.count).or_failed()?,
            shard,
            trials: Vec::new(),
        };
        let mut checkpoint = Checkpoint::open(out, empty).or_input()?;
        let trials = &mut checkpoint.trials;
        trials.truncate(usize::try_from(count).unwrap_or(usize::MAX));
        let missing = (trials.len() as u64..count).map(|place| shard.trial(place));
        let missing: Vec<u64> = missing.collect();
        if count == 0 {
            // A shard of nothing is finished when its file is there.
            checkpoint.write(out).or_failed()?;
        }
        for batch in missing.chunks(sequence.per_thread * self.options.threads.max(1)) {
            checkpoint.trials.extend(make(batch).or_failed()?);
            checkpoint.write(out).or_failed()?;
            let done = checkpoint.trials.len();
            let latest = checkpoint.trials.last().map_or(0.0, sequence.figure.0);
            let all = usize::try_from(count).unwrap_or(usize::MAX);
            self.progress(done, all, latest, sequence.figure.1);
            if interrupted().load(Ordering::SeqCst) {
                let how = match out {
                    Some(_) => "; the same command resumes from there",
                    None => "; with --out FILE it could resume from there",
                };
                return Err(failed!("interrupted after {done} of {count} ropes{how}"));
            }
        }
        Ok(shard.is_whole().then_some(checkpoint.trials))
    }

    /// Films and identifies as many ropes as are asked for, times `factor`.
    pub fn identified(
        &self,
        factor: u64,
        rope: impl Fn(u64) -> RopeParams + Sync,
    ) -> Outcome<Option<Vec<Trial>>> {
        let figure = |t: &Trial| t.residual_px;
        let requested = self.sequence(IDENTIFIED, 8, (figure, "ropes, residual px"));
        let sequence = Sequence {
            count: factor * requested.count,
            ..requested
        };
        self.trials(sequence, |batch| {
            identify_all(&self.rig, &rope, batch, &self.options)
        })
    }

    /// Shows how many trials are done, with a figure of the latest.
    pub fn progress(&self, done: usize, total: usize, value: f64, label: &str) {
        self.stage.progress(&Progress {
            done: u32::try_from(done).unwrap_or(u32::MAX),
            total: u32::try_from(total).unwrap_or(u32::MAX),
            value,
            label: label.to_owned(),
        });
    }

    /// Draws the distributions next to the result file, if there is one.
    pub fn picture(&self, axis: &str, curves: Vec<Curve>) -> Outcome<Option<PathBuf>> {
        let name = format!("{}, seed {}", self.name, self.args.seed);
        picture::write(self.args.out.as_deref(), &name, axis, &curves)
    }

    /// Ends a run of so many ropes whose result is the rows of a table, each a curve over
    /// `axis`.
    pub fn finish_rows<R: Serialize, const N: usize>(
        self,
        ropes: usize,
        (rows, curves): (Vec<R>, Vec<Curve>),
        axis: &str,
        table: [Column<R>; N],
    ) -> Outcome<Option<Value>> {
        let picture = self.picture(axis, curves)?;
        let own = json!({ "ropes": ropes, "rows": rows });
        self.finish(&format!("{ropes} ropes"), picture, own, || {
            print_table(&rows, 1, table);
        })
    }

    /// Ends the run of a shard.
    pub fn finish_shard(self) -> Outcome<Option<Value>> {
        let shard = self.args.shard;
        let seconds = self.stage.done(&format!("shard {shard}"));
        if let Some(out) = &self.args.out {
            println!(
                "shard {shard} in `{}`; `experiments merge` joins it with the others",
                out.display()
            );
        }
        Ok(Some(json!({
            "ok": true, "command": self.name, "version": shared_types::VERSION,
            "seed": self.args.seed, "shard": shard, "seconds": seconds, "out": self.args.out,
        })))
    }

    /// Ends the run: prints its tables and returns what `--json` prints:
    /// `own` fields in addition to those of every result.
    pub fn finish(
        self,
        summary: &str,
        picture: Option<PathBuf>,
        own: Value,
        print: impl FnOnce(),
    ) -> Outcome<Option<Value>> {
        let seconds = self.stage.done(summary);
        print();
        let common = json!({
            "ok": true, "command": self.name, "version": shared_types::VERSION,
            "seed": self.args.seed, "method": self.options.method, "seconds": seconds,
            "out": self.args.out, "picture": picture,
        });
        Ok(Some(joined(common, own)))
    }
}
