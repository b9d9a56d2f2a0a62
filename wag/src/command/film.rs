//! `wag film`: a stretch of a stereo camera's frames as a raw film.

use crate::cli::FilmArgs;
use camera_ingest::live::{LiveCamera, LiveError, LiveSettings, record};
use cli_output::{Failure, OrInput, Outcome, Stage, interrupted, watch_interrupts};
use serde_json::{Value, json};

pub fn run(args: &FilmArgs) -> Outcome<Option<Value>> {
    watch_interrupts().or_failed()?;
    let settings = LiveSettings {
        device: args.device.clone(),
        mode: args.mode,
        rate_hz: args.fps,
        gain: args.gain,
        exposure_raw: args.exposure_raw,
        sensor_gain_raw: args.sensor_gain_raw,
    };
    // One that cannot be had as asked is a wrong input; one that ends is a failure.
    let mut camera = LiveCamera::open(settings)
        .map_err(|error| Failure::of(matches!(error, LiveError::Unfit(_)), error))?;
    let stage = Stage::begin("film");
    let reported = |frames: u64| {
        if frames.is_multiple_of(30) {
            stage.say(format!("{frames} of {} frames", args.frames));
        }
    };
    let made = record(&mut camera, args.frames, &args.out, interrupted(), reported).or_failed()?;
    let lost = made.losses;
    let seconds = stage.done(&format!("{} frames, {} lost", made.frames, lost.total()));
    println!(
        "`{}`, times in `{}`; {} missed, {} damaged, {} short, {} out of order",
        made.film.display(),
        made.times.display(),
        lost.missed,
        lost.damaged,
        lost.short,
        lost.unordered
    );
    Ok(Some(json!({
        "ok": true, "command": "film", "film": made.film, "times": made.times,
        "frames": made.frames, "losses": lost, "seconds": seconds,
    })))
}
