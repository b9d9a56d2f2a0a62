//! `rope.toml`: nine parameters and the rope's extras, with their uncertainty when they were
//! identified.

use super::atomic::write_atomic;
use super::text::{located, read_text, read_toml};
use anyhow::{Context, Result};
use shared_types::rope::{
    ParameterRange, RANGES, ROPE_PARAMETERS, RopeEstimate, RopeParams, RopePosterior,
};
use std::fmt::Write;
use std::path::Path;

/// Tables of an identified rope beside its parameters.
const BESIDE: [&str; 4] = ["uncertainty", "interval_90", "fit", "posterior"];

/// Reads the nine parameters and the rope's `extras`; the tables of an identified rope are allowed and left
/// alone, any other unknown key is refused.
pub fn read_rope(path: &Path) -> Result<RopeParams> {
    let fail = || format!("rope file `{}`", path.display());
    let text = read_text(path)?;
    let mut table: toml::Table = toml::from_str(&text).with_context(fail)?;
    for beside in BESIDE {
        table.remove(beside);
    }
    // The tables beside come behind the rope's own.
    let end = BESIDE
        .iter()
        .filter_map(|beside| text.find(&format!("\n[{beside}")));
    let parameters = &text[..end.min().unwrap_or(text.len())];
    let rope = table.try_into::<RopeParams>();
    let rope = rope.map_err(|refusal| located(refusal, toml::from_str::<RopeParams>(parameters)));
    let rope = rope.with_context(fail)?;
    rope.validate().with_context(fail)?;
    Ok(rope.with_extras(rope.beyond()))
}

/// Reads what was left open when the rope was identified; `None` for a rope that was
/// not.
pub fn read_posterior(path: &Path) -> Result<Option<RopePosterior>> {
    let fail = || format!("rope file `{}`, table `posterior`", path.display());
    let mut table: toml::Table = toml::from_str(&read_text(path)?).with_context(fail)?;
    let posterior = table.remove("posterior");
    posterior
        .map(toml::Value::try_into)
        .transpose()
        .with_context(fail)
}

/// Reads why the track that the rope was identified from should not be relied on; empty
/// where it may be, and for a rope that was not identified.
pub fn read_unconfirmed(path: &Path) -> Result<Vec<String>> {
    let table: toml::Table = read_toml(path, "rope file")?;
    // Files of before call it `doubts`.
    let unconfirmed = |fit: &toml::Value| fit.get("unconfirmed").or(fit.get("doubts")).cloned();
    let found = table.get("fit").and_then(unconfirmed);
    found
        .map_or(Ok(Vec::new()), toml::Value::try_into)
        .with_context(|| {
            let path = path.display();
            format!("rope file `{path}`, `unconfirmed` in its table `fit`")
        })
}

/// Writes an identified rope, and why the track that it was identified from should not be
/// relied on.
pub fn write_rope_estimate(
    path: &Path,
    estimate: &RopeEstimate,
    unconfirmed: &[String],
) -> Result<()> {
    let mut text = format!(
        "# Rope parameters identified by wag {}; SI units, radians.\n",
        shared_types::VERSION
    );
    text.push_str(&toml::to_string(&estimate.params)?);
    text.push_str("\n# One standard deviation; a parameter the observation says nothing about is left out.\n[uncertainty]\n");
    for (range, std_dev) in RANGES.iter().zip(estimate.std_dev) {
        if let Some(s) = std_dev {
            writeln!(text, "{} = {s:e}", range.key)?;
        }
    }
    text.push_str("\n# Intervals that hold the truth with a probability of 90 %.\n[interval_90]\n");
    for (range, [low, high]) in RANGES.iter().zip(estimate.posterior.interval_90) {
        writeln!(text, "{} = [{low:e}, {high:e}]", range.key)?;
    }
    write!(
        text,
        "\n[fit]\nmethod = \"{}\"\nresidual_px = {:.4}\nsimulations = {}\nseed = {}\ntime_offset_s = {:.6}\nout_of_distribution = {}\nout_of_distribution_score = {:.3}\n",
        estimate.method,
        estimate.residual_px,
        estimate.simulations,
        estimate.seed,
        estimate.time_offset_s,
        estimate.out_of_distribution.is_flagged(),
        estimate.out_of_distribution.score
    )?;
    let lists = [
        ("warnings", &estimate.warnings[..]),
        ("unconfirmed", unconfirmed),
    ];
    for (key, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
        writeln!(text, "{key} = {}", toml::Value::try_from(list)?)?;
    }
    text.push_str(
        "\n# Mean and covariance in the order of the keys above; probability of 20 to 26 links.\n",
    );
    let posterior = toml::Table::from_iter([(
        "posterior".to_owned(),
        toml::Value::try_from(&estimate.posterior)?,
    )]);
    text.push_str(&toml::to_string(&posterior)?);
    write_atomic(path, text.as_bytes())
}

/// Writes a rope that nobody has identified: every key with its unit and the range of the known
/// ropes, and whether its value was `measured` or is a guess.
pub fn write_new_rope(
    path: &Path,
    rope: &RopeParams,
    measured: [bool; ROPE_PARAMETERS],
) -> Result<()> {
    let mut text = "# A rope as `wag sim`, `wag plan` and `wag rig --rope` take it; SI units, radians. `wag identify`\n\
                    # finds these values from a filmed wiggle, and how well they are known.\n"
        .to_owned();
    for ((range, value), measured) in RANGES.iter().zip(rope.to_array()).zip(measured) {
        let ParameterRange {
            key,
            label,
            unit,
            min,
            max,
        } = range;
        let unit = if unit.is_empty() {
            String::new()
        } else {
            format!(" ({unit})")
        };
        let from = if measured { "measured" } else { "a guess" };
        writeln!(
            text,
            "\n# {label}{unit}, {from}; known ropes have {min} to {max}\n{key} = {value}"
        )?;
    }
    write_atomic(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::rope::{Ambiguity, FitCircumstances, OutOfDistribution};
    use shared_types::{BendingFriction, RopeExtras};

    fn estimate() -> RopeEstimate {
        RopeEstimate {
            params: RopeParams::from_array([
                23.0, 0.55, 0.006, 0.15, 0.0055, 0.05, 0.05, 0.02, 1.0,
            ])
            .with_extras(RopeExtras {
                rest_curvature_per_m: [0.2, -0.3, 0.0],
                friction: Some(BendingFriction {
                    moment_max_nm: 0.002,
                    slip_curvature_per_m: 0.5,
                }),
                ..RopeExtras::NONE
            }),
            std_dev: std::array::from_fn(|i| (i == 1).then_some(0.001)),
            residual_px: 1.25,
            method: "cmaes".parse().unwrap(),
            simulations: 3000,
            seed: 7,
            time_offset_s: -0.0012,
            posterior: RopePosterior {
                mean: [23.0, 0.55, 0.006, 0.15, 0.0055, 0.05, 0.05, 0.02, 0.85],
                covariance: [[1e-4; 9]; 9],
                interval_90: [[0.01, 0.6]; 9],
                links_probability: [1.0 / 7.0; 7],
                ambiguities: vec![Ambiguity {
                    direction: [1.0 / 3.0; 9],
                    kept: 0.9,
                }],
                inflation: 1.0,
                residual_m: 0.0,
                absorbed_m: 0.0,
            },
            circumstances: FitCircumstances::default(),
            out_of_distribution: OutOfDistribution {
                score: 0.5,
                limit: 4.0,
                reasons: Vec::new(),
            },
            warnings: vec!["the clocks are apart".to_owned()],
        }
    }

    #[test]
    fn a_new_rope_says_of_each_value_whether_it_was_measured() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("rope.toml");
        let measured = std::array::from_fn(|i| i == 1);
        write_new_rope(&path, &estimate().params, measured).unwrap();
        let text = read_text(&path).unwrap();
        assert!(text.contains("# length (m), measured; known ropes have 0.45 to 0.65\nlength_m"));
        assert_eq!(text.matches("a guess").count(), 8, "{text}");
        let nine = RopeParams::from_array(estimate().params.to_array());
        assert_eq!(read_rope(&path).unwrap(), nine);
        assert_eq!(read_posterior(&path).unwrap(), None);
    }

    #[test]
    fn the_example_is_a_rope_of_the_ranges() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/rope/example.toml");
        let rope = read_rope(Path::new(path)).unwrap();
        assert_eq!(rope.outside_ranges().count(), 0);
    }

    #[test]
    fn an_identified_rope_can_be_read_as_a_rope() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("rope.toml");
        let unconfirmed = ["the rope's \"end\" is not confirmed".to_owned()];
        write_rope_estimate(&path, &estimate(), &unconfirmed).unwrap();
        assert_eq!(read_unconfirmed(&path).unwrap(), unconfirmed);
        write_rope_estimate(&path, &estimate(), &[]).unwrap();
        assert!(read_unconfirmed(&path).unwrap().is_empty());
        assert_eq!(read_rope(&path).unwrap(), estimate().params);
        let posterior = read_posterior(&path).unwrap();
        assert_eq!(posterior, Some(estimate().posterior));
        let table: toml::Table = std::fs::read_to_string(&path).unwrap().parse().unwrap();
        let interval = table["interval_90"]["length_m"].as_array().unwrap();
        assert_eq!(interval[1].as_float(), Some(0.6));
        let covariance = table["posterior"]["covariance"].as_array().unwrap();
        assert_eq!(covariance.len(), 9);
        assert_eq!(table["fit"]["out_of_distribution"].as_bool(), Some(false));
        let warnings = table["fit"]["warnings"].as_array().unwrap();
        assert_eq!(warnings[0].as_str(), Some("the clocks are apart"));
    }
}
