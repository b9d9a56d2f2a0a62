//! `wag rope new`: a rope file from what a laboratory can measure.

use crate::cli::NewRopeArgs;
use crate::pipeline::RunFolder;
use cli_output::{OrInput, Outcome};
use run_log::files::write_new_rope;
use serde_json::{Value, json};
use shared_types::RopeParams;
use shared_types::rope::RANGES;

pub fn new(args: &NewRopeArgs) -> Outcome<Option<Value>> {
    RunFolder::refuse_existing(&args.out)?;
    let length_m = args.length;
    // What its mass is per length; the length may be a guess, but then is known.
    let middle = RANGES.map(|range| (range.min * range.max).sqrt());
    let per_length = args.rope_mass.map(|kg| kg / length_m.unwrap_or(middle[1]));
    let named = [
        None,
        length_m,
        None,
        None,
        args.radius,
        per_length,
        args.lead_mass,
        args.lead_radius,
        None,
    ];
    let mut values = middle.map(rounded);
    for (value, named) in values.iter_mut().zip(named) {
        *value = named.unwrap_or(*value);
    }
    let rope = RopeParams::from_array(values);
    rope.validate().or_input()?;
    let mut measured = named.map(|named| named.is_some());
    // A mass by a guessed length is a guess.
    measured[5] &= length_m.is_some();
    write_new_rope(&args.out, &rope, measured).or_failed()?;
    let guessed: Vec<&str> = RANGES
        .iter()
        .zip(measured)
        .filter(|(_, measured)| !measured)
        .map(|(range, _)| range.label)
        .collect();
    println!("`{}`; guessed: {}", args.out.display(), guessed.join(", "));
    Ok(Some(json!({
        "ok": true, "command": "rope new", "out": args.out, "rope": rope, "guessed": guessed,
    })))
}

/// Three digits: more would look measured.
fn rounded(value: f64) -> f64 {
    let digits = 2 - value.abs().log10().floor() as i32;
    let scale = 10_f64.powi(digits);
    (value * scale).round() / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_are_kept() {
        for (value, shown) in [
            (0.054_772, 0.0548),
            (23.04, 23.0),
            (0.5, 0.5),
            (1.2345, 1.23),
        ] {
            assert!((rounded(value) - shown).abs() < 1e-12, "{value}");
        }
    }
}
