//! `experiments sensitivity-maps`: what in a film the network's answer depends on, as the
//! paper's activation maps show it: per parameter, the gradient of the answer over every
//! keypoint at every moment.

use super::experiment::{Experiment, Sequence};
use super::picture::beside;
use super::sensitivity_map::{MOMENT_FRAMES, SensitivityMap};
use super::sensitivity_picture::svg;
use crate::args::MethodName;
use crate::network::network;
use crate::report::{Column, print_table};
use cli_output::{OrInput, Outcome};
use experiments::trials::in_parallel;
use planner::ropes::trial_rope;
use run_log::files;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use shared_types::rope::RANGES;

/// Films averaged over; the paper shows one.
const ROPES: u64 = 8;
/// The paper's description of each parameter's map, order of [`RANGES`].
const PAPER: [&str; 9] = [
    "earlier", "earlier", "later", "later", "earlier", "later", "later", "earlier", "earlier",
];

/// One filmed rope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct SensitivityTrial {
    index: u64,
    /// The network's sensitivities for this film.
    map: SensitivityMap,
}

/// One parameter's map in a few numbers.
#[derive(Debug, Serialize)]
struct Row {
    parameter: &'static str,
    /// Mean over all moments (fractions of the range per metre).
    mean_per_m: f64,
    /// Middle of the most informative moment (s).
    peak_s: f64,
    /// Time before which half of it lies (s).
    half_before_s: f64,
    /// Fraction of it in the last second of the film.
    last_second: f64,
    /// Most informative keypoint, as a fraction of the rope's length from the clamp.
    place: f64,
    paper: &'static str,
}

const TABLE: [Column<Row>; 7] = [
    ("parameter", |row| row.parameter.to_owned()),
    ("range per metre", |row| format!("{:.2}", row.mean_per_m)),
    ("peak (s)", |row| format!("{:.1}", row.peak_s)),
    ("half before (s)", |row| format!("{:.1}", row.half_before_s)),
    ("last second (%)", |row| {
        format!("{:.0}", 100.0 * row.last_second)
    }),
    ("place on the rope (%)", |row| {
        format!("{:.0}", 100.0 * row.place)
    }),
    ("paper's peak", |row| row.paper.to_owned()),
];

fn rows(map: &SensitivityMap, moment_s: f64) -> Vec<Row> {
    let most = |values: &[f64]| -> usize {
        let largest = (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b]));
        largest.unwrap_or_default()
    };
    RANGES
        .iter()
        .enumerate()
        .map(|(parameter, range)| {
            let over_time = map.over_time(parameter);
            let total: f64 = over_time.iter().sum();
            let mut before = 0.0;
            let half = over_time.iter().position(|value| {
                before += value;
                before >= total / 2.0
            });
            let last = (1.0 / moment_s).round() as usize;
            let end: f64 = over_time.iter().rev().take(last).sum();
            let middle_s = |moment: usize| (moment as f64 + 0.5) * moment_s;
            Row {
                parameter: range.label,
                mean_per_m: total / over_time.len().max(1) as f64,
                peak_s: middle_s(most(&over_time)),
                half_before_s: middle_s(half.unwrap_or_default()),
                last_second: end / total.max(f64::MIN_POSITIVE),
                place: most(&map.along_rope(parameter)) as f64 / (map.keypoints - 1) as f64,
                paper: PAPER[parameter],
            }
        })
        .collect()
}

/// Mean of the films' maps.
fn mean(trials: &[SensitivityTrial]) -> Option<SensitivityMap> {
    let first = &trials.first()?.map;
    let mut map = SensitivityMap::empty(first.moments, first.keypoints);
    for trial in trials {
        map.add(&trial.map);
    }
    let count = trials.len() as f32;
    map.values.iter_mut().flatten().for_each(|v| *v /= count);
    Some(map)
}

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let args = experiment.args;
    if !matches!(args.method, MethodName::Hybrid | MethodName::Nn) {
        return Err(bad_input!(
            "these are maps of the network: leave out --method, or name nn"
        ));
    }
    let net = network(args.model.as_deref())?.for_camera().or_input()?;
    let weights = &net.metadata().graph_sha256;
    let figure = |t: &SensitivityTrial| largest(&t.map);
    let sequence = Sequence {
        method: format!("network {weights}"),
        ..experiment.sequence(ROPES, 1, (figure, "films, most per m"))
    };
    let (rig, seed) = (&experiment.rig, args.seed);
    let made = experiment.trials(sequence, |batch| {
        in_parallel("trial", batch, experiment.options.threads, |index| {
            let filmed = rig.film(&trial_rope(seed, index), seed, index)?;
            let features = net.see(&rig.observation(&filmed))?;
            let map = SensitivityMap::measure(&net, &features)?;
            Ok(SensitivityTrial { index, map })
        })
    })?;
    let Some(trials) = made else {
        return experiment.finish_shard();
    };
    let map = mean(&trials).ok_or_else(|| bad_input!("--ropes is 0, but must be 1 or more"))?;
    let moment_s = MOMENT_FRAMES as f64 / net.metadata().features.rate_hz;
    let rows = rows(&map, moment_s);
    let picture = args.out.as_deref().map(beside);
    if let Some(path) = &picture {
        let drawn = svg(&map, moment_s, trials.len(), args.seed);
        files::write_atomic(path, drawn.as_bytes()).or_failed()?;
    }
    let own = json!({
        "method": "network", "weights_sha256": weights, "films": trials.len(),
        "moment_s": moment_s, "rows": rows, "map": map,
    });
    let drawn = picture.clone();
    experiment.finish(&format!("{} films", trials.len()), picture, own, || {
        print_table(&rows, 1, TABLE);
        if let Some(path) = drawn {
            println!("drawn in `{}`", path.display());
        }
    })
}

fn largest(map: &SensitivityMap) -> f64 {
    f64::from(map.values.iter().flatten().copied().fold(0.0, f32::max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_is_summed_up_by_where_it_is_largest() {
        let mut map = SensitivityMap::empty(50, 4);
        for moment in 0..50 {
            map.values[1][moment * 4 + 2] = 1.0;
        }
        map.values[1][30 * 4 + 3] = 5.0;
        let rows = rows(&map, 0.1);
        let length = &rows[1];
        assert_eq!(length.parameter, "length");
        assert!((length.peak_s - 3.05).abs() < 1e-9, "{length:?}");
        assert!((length.half_before_s - 2.75).abs() < 0.11, "{length:?}");
        assert!((length.place - 2.0 / 3.0).abs() < 1e-9, "{length:?}");
        assert!((0.17..0.20).contains(&length.last_second), "{length:?}");
        assert!(rows[0].last_second < 1e-9, "{rows:?}");
    }
}
