//! `rope.toml`: nine parameters, with their uncertainty when they were identified.

use super::{read_text, write_atomic};
use anyhow::Context;
use shared_types::rope::{RANGES, RopeEstimate, RopeParams};
use std::fmt::Write;
use std::path::Path;

/// Reads the nine parameters; tables `[uncertainty]` and `[fit]` are allowed
/// and left alone, any other unknown key is refused.
pub fn read_rope(path: &Path) -> anyhow::Result<RopeParams> {
    let fail = || format!("rope file `{}`", path.display());
    let mut table: toml::Table = toml::from_str(&read_text(path)?).with_context(fail)?;
    table.remove("uncertainty");
    table.remove("fit");
    let rope: RopeParams = table.try_into().with_context(fail)?;
    rope.validate().with_context(fail)?;
    Ok(rope)
}

/// Writes an identified rope.
pub fn write_rope_estimate(path: &Path, estimate: &RopeEstimate) -> anyhow::Result<()> {
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
    write!(
        text,
        "\n[fit]\nmethod = \"{}\"\nresidual_px = {:.4}\nsimulations = {}\nseed = {}\ntime_offset_s = {:.6}\n",
        estimate.method,
        estimate.residual_px,
        estimate.simulations,
        estimate.seed,
        estimate.time_offset_s
    )?;
    write_atomic(path, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate() -> RopeEstimate {
        RopeEstimate {
            params: RopeParams::from_array([
                23.0, 0.55, 0.006, 0.15, 0.0055, 0.05, 0.05, 0.02, 1.0,
            ]),
            std_dev: [
                None,
                Some(0.001),
                Some(1e-4),
                None,
                None,
                None,
                None,
                None,
                None,
            ],
            residual_px: 1.25,
            method: "cmaes".parse().unwrap(),
            simulations: 3000,
            seed: 7,
            time_offset_s: -0.0012,
        }
    }

    #[test]
    fn an_identified_rope_can_be_read_as_a_rope() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("rope.toml");
        write_rope_estimate(&path, &estimate()).unwrap();
        assert_eq!(read_rope(&path).unwrap(), estimate().params);
    }

    #[test]
    fn bad_ropes_are_refused_with_file_and_field() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("rope.toml");
        let good = toml::to_string(&estimate().params).unwrap();
        let refused = |text: &str| {
            std::fs::write(&path, text).unwrap();
            format!("{:#}", read_rope(&path).unwrap_err())
        };
        let missing = refused(&good.replace("length_m = 0.55\n", ""));
        assert!(
            missing.contains("length_m") && missing.contains("rope.toml"),
            "{missing}"
        );
        let unknown = refused(&format!("{good}colour = 3\n"));
        assert!(unknown.contains("colour"), "{unknown}");
        let negative = refused(&good.replace("lead_mass_kg = 0.05", "lead_mass_kg = -1.0"));
        assert!(negative.contains("lead_mass_kg"), "{negative}");
        let nan = refused(&good.replace("radius_m = 0.0055", "radius_m = nan"));
        assert!(nan.contains("radius_m"), "{nan}");
    }
}
