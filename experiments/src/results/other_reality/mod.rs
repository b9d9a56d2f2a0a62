//! `experiments other-reality`: ropes that MuJoCo simulates, with physics that the planner's
//! equations leave out, are filmed, identified and thrown at a target in MuJoCo.

mod case;
mod child;

use super::experiment::{Experiment, Sequence, cm};
use super::picture::Curve;
use crate::args::{ChannelName, OtherRealityArgs};
use crate::report::Column;
use anyhow::Context;
use arm_model::{Cell, JointTrajectory};
use case::Case;
use child::Mujoco;
use clap::ValueEnum;
use cli_output::{OrInput, Outcome};
use experiments::trials::{KEYPOINTS, alone, in_parallel, mean, quantile};
use nalgebra::Vector3;
use planner::identify::IdentifyOptions;
use planner::plan::{PlanOptions, PlanRequest, PosteriorEnsemble, simulator_for};
use planner::synthetic::{FilmTiming, Filmed, RopeFilm, project};
use rope_sim::{FrameTimes, PlannedArm, Sway};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use shared_types::{ErrorForecast, Plan, RopeEstimate, Task};
use std::ops::ControlFlow;

const ROPES: u64 = 20;
/// Ropes that a forecast is made with.
const FORECAST: usize = 64;
/// Time between kept positions of a film (s).
const FILM_PERIOD_S: f64 = 1.0 / 240.0;
/// Time between positions of the tip in a throw (s); it moves straight in between.
const THROW_PERIOD_S: f64 = 1e-3;

/// One rope in one reality.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Trial {
    rope: u64,
    channel: ChannelName,
    fate: Fate,
}

/// What became of a rope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Fate {
    /// Identification or planning refused, in these words.
    Refused(String),
    /// It was thrown.
    Thrown(Thrown),
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Thrown {
    /// Closest approach of tip and target (m).
    miss_m: f64,
    /// The one that the plan predicted (m).
    predicted_m: f64,
    /// Found length minus the true one (m).
    length_error_m: f64,
    residual_px: f64,
    out_of_distribution: f64,
    outside: bool,
    forecast: Option<ErrorForecast>,
}

impl Trial {
    fn thrown(&self) -> Option<&Thrown> {
        match &self.fate {
            Fate::Thrown(thrown) => Some(thrown),
            Fate::Refused(_) => None,
        }
    }
}

/// What makes a trial.
struct Study<'a> {
    experiment: &'a Experiment<'a>,
    mujoco: Mujoco,
    channels: &'a [ChannelName],
    refinement: u32,
}

impl Study<'_> {
    /// Rope by rope, with each channel.
    fn trial(&self, number: u64) -> anyhow::Result<Trial> {
        let channels = self.channels.len() as u64;
        let (rope, channel) = (number / channels, (number % channels) as usize);
        let channel = self.channels[channel];
        let case = Case::draw(self.experiment.args.seed, rope, channel, self.refinement);
        let fate = self.fate(rope, &case)?;
        Ok(Trial {
            rope,
            channel,
            fate,
        })
    }

    fn fate(&self, index: u64, case: &Case) -> anyhow::Result<Fate> {
        // The fit hears what the joints report; the arm is where it is.
        let wiggle = self.experiment.rig.motion.trajectory();
        let reported = case.arm.reported(wiggle)?;
        let filmed = self.film(case, &reported)?;
        let found = match self.identify(index, &filmed, &reported) {
            Ok(found) => found,
            Err(refusal) => return Ok(Fate::Refused(format!("{refusal:#}"))),
        };
        let planned = match self.plan(index, case, &found) {
            Ok(planned) => planned,
            Err(refusal) => return Ok(Fate::Refused(format!("{refusal:#}"))),
        };
        Ok(Fate::Thrown(Thrown {
            miss_m: self.throw(case, &planned)?,
            predicted_m: planned.predicted_error_m,
            length_error_m: found.params.length_m - case.rope.params.length_m,
            residual_px: found.residual_px,
            out_of_distribution: found.out_of_distribution.score,
            outside: found.out_of_distribution.is_outside(),
            forecast: planned.forecast,
        }))
    }

    fn film(&self, case: &Case, reported: &JointTrajectory) -> anyhow::Result<Filmed> {
        let timing = FilmTiming::default();
        let times = FrameTimes {
            first_s: 0.0,
            period_s: FILM_PERIOD_S,
            count: ((timing.duration_s() + 0.05) / FILM_PERIOD_S).ceil() as usize,
        };
        let motion = |t_s| case.arm.attach_frame(reported, t_s);
        let points = self
            .mujoco
            .simulate(&case.rope, motion, case.seed, &times, KEYPOINTS)?;
        let positions_m = points.iter().flat_map(|p| p.cast::<f32>().data.0[0]);
        let params = case.rope.params;
        let film =
            RopeFilm::from_positions(params, FILM_PERIOD_S, KEYPOINTS, positions_m.collect())
                .context("a film without frames")?;
        let camera = &self.experiment.rig.camera;
        Ok(project(&film, camera, &timing, &case.film))
    }

    /// As `wag identify` does by default.
    fn identify(
        &self,
        index: u64,
        filmed: &Filmed,
        reported: &JointTrajectory,
    ) -> anyhow::Result<RopeEstimate> {
        let Experiment { rig, options, .. } = self.experiment;
        let motion = PlannedArm::new(*reported, Cell::default().pole);
        let observation = planner::observation::Observation {
            motion: &motion,
            ..rig.observation(filmed)
        };
        let options = IdentifyOptions {
            seed: options.seed ^ index,
            ..alone(options)
        };
        let network = rig.network.as_deref();
        let go_on = &mut |_| ControlFlow::Continue(());
        let found = planner::identify(&observation, &options, network, go_on);
        found.context("identification")
    }

    /// As `wag plan strike` does by default.
    fn plan(&self, index: u64, case: &Case, found: &RopeEstimate) -> anyhow::Result<Plan> {
        let Experiment { config, args, .. } = self.experiment;
        let seed = args.seed ^ index;
        let options = PlanOptions {
            seed,
            threads: 1,
            ..config.search
        };
        let goal = config.goal(Task::Strike, case.target_m);
        let (rope, posterior) = (&found.params, &found.posterior);
        let request = PlanRequest {
            ensemble: PosteriorEnsemble::drawn(rope, posterior, 0, FORECAST, seed),
            ..PlanRequest::new(goal, rope, options)
        };
        let planned = planner::plan(&request, &mut |_| ControlFlow::Continue(()));
        planned.context("planning")
    }

    /// Distance of tip and target at their closest (m), watched as long as a plan is.
    fn throw(&self, case: &Case, planned: &Plan) -> anyhow::Result<f64> {
        let config = &self.experiment.config;
        let goal = config.goal(Task::Strike, case.target_m);
        let (task, params) = (goal.task(), &case.rope.params);
        let simulator = simulator_for(task, params, &Cell::default(), &config.search);
        let reported = case.arm.reported(&planned.trajectory)?;
        let motion_s = reported.duration_s().max(simulator.motion_s_min);
        let watched_s = motion_s + task.config().observed_s;
        let times = FrameTimes {
            first_s: 0.0,
            period_s: THROW_PERIOD_S,
            count: (watched_s / THROW_PERIOD_S).floor() as usize + 1,
        };
        let mut rope = case.rope;
        // It was left to come to rest.
        rope.sway = Sway::NONE;
        let motion = |t_s| case.arm.attach_frame(&reported, t_s);
        // And hangs in another of the shapes that friction holds.
        let seed = case.seed.wrapping_add(1);
        let ends = self.mujoco.simulate(&rope, motion, seed, &times, 2)?;
        let tip: Vec<_> = ends.chunks_exact(2).map(|ends| ends[1]).collect();
        Ok(closest_m(&tip, &case.target_m.into()))
    }
}

/// Smallest distance of a point from the straight lines between the points of a path (m).
fn closest_m(path: &[Vector3<f64>], point: &Vector3<f64>) -> f64 {
    let to_line = |ends: &[Vector3<f64>]| {
        let (way, to) = (ends[1] - ends[0], point - ends[0]);
        let part = to.dot(&way) / way.norm_squared().max(1e-18);
        (to - way * part.clamp(0.0, 1.0)).norm()
    };
    path.windows(2).map(to_line).fold(f64::INFINITY, f64::min)
}

/// One channel.
#[derive(Debug, Serialize)]
struct Row {
    channel: ChannelName,
    ropes: usize,
    refused: usize,
    /// Each refusal once.
    refusals: Vec<String>,
    mean_m: f64,
    median_m: f64,
    max_m: f64,
    /// Mean and greatest absolute error of the length (m).
    length_error_mean_m: f64,
    length_error_max_m: f64,
    /// Medians.
    residual_px: f64,
    out_of_distribution: f64,
    /// Fraction of the ropes that were taken for ropes outside the ranges.
    outside: f64,
    /// Fraction of the misses within their forecasts' 90 % intervals.
    covered: f64,
    /// Median of those intervals' upper ends (m).
    forecast_high_m: f64,
}

const TABLE: [Column<Row>; 11] = [
    ("miss (cm) with", |row| name(row.channel)),
    ("ropes", |row| row.ropes.to_string()),
    ("refused", |row| row.refused.to_string()),
    ("mean", |row| cm(row.mean_m)),
    ("median", |row| cm(row.median_m)),
    ("max", |row| cm(row.max_m)),
    ("length error mean, max (mm)", |row| {
        let [mean, max] = [row.length_error_mean_m, row.length_error_max_m].map(|m| 1e3 * m);
        format!("{mean:.1}, {max:.1}")
    }),
    ("residual (px)", |row| format!("{:.2}", row.residual_px)),
    ("out of distribution, score", |row| {
        format!("{:.2}", row.out_of_distribution)
    }),
    ("flagged as outside", |row| {
        format!("{:.0} %", 100.0 * row.outside)
    }),
    ("within its 90 % interval, up to (cm)", |row| {
        format!("{:.0} %, {}", 100.0 * row.covered, cm(row.forecast_high_m))
    }),
];

fn name(channel: ChannelName) -> String {
    let value = channel.to_possible_value();
    value.map_or_else(String::new, |value| value.get_name().to_owned())
}

/// A channel, with its misses as a curve.
fn row(trials: &[Trial], channel: ChannelName) -> (Row, Curve) {
    let of_channel = || trials.iter().filter(move |t| t.channel == channel);
    let thrown = || of_channel().filter_map(Trial::thrown);
    let misses_m = || thrown().map(|t| t.miss_m);
    let lengths_m = || thrown().map(|t| t.length_error_m.abs());
    let forecasts = || thrown().filter_map(|t| Some((t.miss_m, t.forecast?.interval_90_m)));
    let one = |is: bool| f64::from(u8::from(is));
    let covered = |(miss_m, [low, high]): (f64, [f64; 2])| one((low..=high).contains(&miss_m));
    let mut refusals: Vec<String> = of_channel()
        .filter_map(|t| match &t.fate {
            Fate::Refused(why) => Some(why.clone()),
            Fate::Thrown(_) => None,
        })
        .collect();
    let refused = refusals.len();
    refusals.sort();
    refusals.dedup();
    let row = Row {
        channel,
        ropes: of_channel().count(),
        refused,
        refusals,
        mean_m: mean(misses_m()),
        median_m: quantile(misses_m(), 0.5),
        max_m: quantile(misses_m(), 1.0),
        length_error_mean_m: mean(lengths_m()),
        length_error_max_m: quantile(lengths_m(), 1.0),
        residual_px: quantile(thrown().map(|t| t.residual_px), 0.5),
        out_of_distribution: quantile(thrown().map(|t| t.out_of_distribution), 0.5),
        outside: mean(thrown().map(|t| one(t.outside))),
        covered: mean(forecasts().map(covered)),
        forecast_high_m: quantile(forecasts().map(|(_, [_, high])| high), 0.5),
    };
    (row, Curve::cm(&name(channel), misses_m(), None))
}

pub(super) fn run(args: &OtherRealityArgs) -> Outcome<Option<Value>> {
    let mujoco = Mujoco::from_environment().or_input()?;
    let experiment = Experiment::begin("other-reality", &args.result)?;
    let channels = match args.channels.as_slice() {
        [] => ChannelName::value_variants(),
        asked => asked,
    };
    let names: Vec<String> = channels.iter().map(|c| name(*c)).collect();
    let figure = |t: &Trial| t.thrown().map_or(f64::NAN, |t| 100.0 * t.miss_m);
    let requested = experiment.sequence(ROPES, 1, (figure, "throws, cm"));
    let sequence = Sequence {
        method: format!(
            "{} with {}, refined {} times",
            requested.method,
            names.join(" "),
            args.refinement
        ),
        count: requested.count * channels.len() as u64,
        ..requested
    };
    let ropes = requested.count;
    let study = Study {
        experiment: &experiment,
        mujoco,
        channels,
        refinement: args.refinement,
    };
    let threads = experiment.options.threads;
    let trials = experiment.trials(sequence, |batch| {
        in_parallel("trial", batch, threads, |number| study.trial(number))
    })?;
    let rows: Vec<(Row, Curve)> = channels.iter().map(|c| row(&trials, *c)).collect();
    for (row, _) in &rows {
        for why in &row.refusals {
            println!("{}: refused: {why}", name(row.channel));
        }
    }
    let rows = rows.into_iter().unzip();
    let axis = "distance of tip and target (cm)";
    let ropes = usize::try_from(ropes).unwrap_or(usize::MAX);
    experiment.finish_rows(ropes, rows, axis, TABLE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closest_approach_lies_between_the_points_of_a_path() {
        let path = [[0.0, 1.0, 0.0], [2.0, 1.0, 0.0], [2.0, 5.0, 0.0]].map(Vector3::from);
        let from = |point: [f64; 3]| closest_m(&path, &point.into());
        assert_eq!(from([1.0, 0.0, 0.0]), 1.0);
        assert_eq!(from([-3.0, -3.0, 0.0]), 5.0);
        assert_eq!(from([2.0, 3.0, 0.5]), 0.5);
        assert_eq!(closest_m(&[], &Vector3::zeros()), f64::INFINITY);
    }
}
