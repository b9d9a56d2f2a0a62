//! `experiments other-reality` and `experiments full-pipeline`: ropes that MuJoCo simulates, with
//! physics that the planner's equations leave out, are filmed, identified and thrown at a target
//! in MuJoCo.

mod case;
pub(super) mod child;
mod full;
mod kinds;
mod rows;
mod throwing;
mod wiggling;

pub(super) use full::run as run_full;

use super::experiment::{Experiment, Sequence};
use crate::args::{ChannelName, OtherRealityArgs};
use case::Case;
use child::Mujoco;
use clap::ValueEnum;
use cli_output::{OrInput, Outcome};
use experiments::trials::in_parallel;
use rows::{TABLE, row, with_refusals};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use throwing::Fate;
use wiggling::Reality;

const ROPES: u64 = 20;
/// Axis of the pictures.
const AXIS: &str = "distance of tip and target (cm)";

/// One rope in one reality.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Trial {
    rope: u64,
    channel: ChannelName,
    fate: Fate,
}

fn name(channel: ChannelName) -> String {
    let value = channel.to_possible_value();
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}

pub(super) fn run(args: &OtherRealityArgs) -> Outcome<Option<Value>> {
    let mujoco = Mujoco::from_environment().or_input()?;
    let experiment = Experiment::begin("other-reality", &args.mujoco.result)?;
    let channels = match args.channels.as_slice() {
        [] => ChannelName::value_variants(),
        asked => asked,
    };
    let names: Vec<String> = channels.iter().map(|c| name(*c)).collect();
    let figure = |t: &Trial| t.fate.thrown().map_or(f64::NAN, |t| 100.0 * t.miss_m);
    let requested = experiment.sequence(ROPES, 1, (figure, "throws, cm"));
    let sequence = Sequence {
        method: format!(
            "{} with {}{}",
            requested.method,
            names.join(" "),
            args.mujoco.remark()
        ),
        count: requested.count * channels.len() as u64,
        ..requested
    };
    let ropes = requested.count;
    let reality = Reality {
        experiment: &experiment,
        mujoco,
        robust: args.mujoco.robust,
        fast: args.mujoco.fast,
    };
    // Rope by rope, with each channel.
    let trial = |number: u64| {
        let each = channels.len() as u64;
        let (rope, channel) = (number / each, channels[(number % each) as usize]);
        let case = Case::draw(experiment.args.seed, rope, channel, args.mujoco.refinement);
        let [fate] = reality.identified(rope, &case)?;
        Ok(Trial {
            rope,
            channel,
            fate,
        })
    };
    let threads = experiment.options.threads;
    let made = experiment.trials(sequence, |batch| {
        in_parallel("trial", batch, threads, trial)
    })?;
    let Some(trials) = made else {
        return experiment.finish_shard();
    };
    let with = |channel: &ChannelName| {
        let with = trials.iter().filter(|t| t.channel == *channel);
        let fates: Vec<&Fate> = with.map(|t| &t.fate).collect();
        row(&name(*channel), &fates)
    };
    let rows = with_refusals(channels.iter().map(with).collect());
    let ropes = usize::try_from(ropes).unwrap_or(usize::MAX);
    experiment.finish_rows(ropes, rows, AXIS, TABLE)
}
