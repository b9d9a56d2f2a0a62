//! The tracker on recordings to which something bad was done: it stays nearly as
//! exact as on the good ones or reports that it lost the rope, and is never wrong
//! with confidence.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

#[path = "recording/alter.rs"]
mod alter;
mod recording;

use std::sync::OnceLock;

use alter::SecondRope;
use camera_ingest::TrackError;
use recording::{Wiggle, quantile};

/// A node that is further off is wrong (px).
const WRONG_PX: f64 = 20.0;

/// A recording and how well it is tracked as it is.
struct Clean {
    name: &'static str,
    wiggle: Wiggle,
    outcome: Outcome,
}

/// Both recordings, read and tracked once; empty, with a message, where they are missing.
fn clean() -> &'static [Clean] {
    static CLEAN: OnceLock<Vec<Clean>> = OnceLock::new();
    CLEAN.get_or_init(|| {
        let read = |name| {
            let wiggle = Wiggle::read(name)?;
            Some(Clean {
                name,
                outcome: outcome(&wiggle).unwrap(),
                wiggle,
            })
        };
        ["a1", "a2"].into_iter().filter_map(read).collect()
    })
}

/// How well a recording was tracked.
#[derive(Debug)]
struct Outcome {
    /// Median and 95th percentile over the frames not lost (px).
    error_px: [f64; 2],
    lost: usize,
    /// Frame, node, error and confidence of what was wrong with confidence.
    wrong: Vec<(usize, usize, f64, f64)>,
}

fn outcome(wiggle: &Wiggle) -> Result<Outcome, TrackError> {
    let result = wiggle.track()?;
    let errors = wiggle.errors(&result);
    let frames = &result.track.frames;
    let kept: Vec<f64> = errors
        .iter()
        .zip(frames)
        .filter(|(_, frame)| !frame.lost)
        .flat_map(|(errors, _)| errors.iter().copied())
        .collect();
    let mut wrong = Vec::new();
    for (index, (errors, frame)) in errors.iter().zip(frames).enumerate() {
        for (node, (&error, &confidence)) in errors.iter().zip(&frame.confidence).enumerate() {
            if error > WRONG_PX && confidence > 0.5 {
                wrong.push((index, node, error, confidence));
            }
        }
    }
    Ok(Outcome {
        error_px: [0.5, 0.95].map(|q| quantile(&kept, q)),
        lost: frames.iter().filter(|f| f.lost).count(),
        wrong,
    })
}

/// Twice the error of the clean recording at most, or lost; nothing wrong with
/// confidence. At most so many frames may be given up.
fn assert_kept(clean: &Clean, what: &str, most_lost: usize, after: &Outcome) {
    let (name, before) = (clean.name, &clean.outcome);
    let reported = format!("{name}, {what}: {before:.2?} -> {after:.2?}");
    println!("{reported}");
    assert!(
        after.wrong.is_empty() && after.lost <= most_lost,
        "{reported}"
    );
    for (before, after) in before.error_px.iter().zip(after.error_px) {
        assert!(after <= 2.0 * before, "{reported}");
    }
}

/// Both recordings.
fn assert_bears(what: &str, most_lost: usize, alter: impl Fn(Wiggle) -> Wiggle) {
    for clean in clean() {
        let altered = outcome(&alter(clean.wiggle.clone()));
        assert_kept(clean, what, most_lost, &altered.unwrap());
    }
}

#[test]
fn a_fifth_of_the_frames_dropped() {
    assert_bears("a fifth dropped", 0, |w| w.dropped(0.2, 7));
    // A gap in the fastest motion may cost more.
    for seed in 0..6 {
        assert_bears("another fifth dropped", 32, |w| w.dropped(0.2, seed));
    }
}

#[test]
fn half_a_second_missing() {
    assert_bears("30 frames missing", 30, |w| w.without(60..90));
}

#[test]
fn brightness_drifts_down_and_up() {
    assert_bears("40 % darker", 20, |w| w.drifting(0.6));
    assert_bears("40 % brighter", 20, |w| w.drifting(1.4));
}

#[test]
fn a_hand_before_the_rope() {
    assert_bears("hand", 20, |w| w.covered(50..70));
}

/// Spread of a still pixel's luma over time; compression takes some of it away.
fn noise(wiggle: &Wiggle) -> f64 {
    let pairs = wiggle.frames[10].luma.iter().zip(&wiggle.frames[11].luma);
    let mut squares: Vec<f64> = pairs
        .map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2))
        .collect();
    squares.sort_by(f64::total_cmp);
    // What moves is less than a tenth.
    let still = &squares[..squares.len() * 9 / 10];
    (still.iter().sum::<f64>() / still.len() as f64 / 2.0).sqrt()
}

#[test]
fn twice_the_noise() {
    assert_bears("twice the noise", 0, |w| {
        let more = 3.0_f64.sqrt() * noise(&w);
        println!("noise {:.2} and {more:.2} levels", noise(&w));
        w.noisy(more, 3)
    });
}

#[test]
fn twice_the_blur() {
    assert_bears("twice the motion blur", 0, Wiggle::smeared);
    // The one with less contrast.
    if let Some(clean) = clean().last() {
        let altered = outcome(&clean.wiggle.clone().defocused(1.2));
        assert_kept(clean, "out of focus", 0, &altered.unwrap());
    }
}

#[test]
fn mirrored_and_turned_cameras() {
    assert_bears("mirrored", 0, Wiggle::mirrored);
    assert_bears("turned", 0, Wiggle::turned);
}

/// Offsets, sides and phases of the second rope.
fn second_ropes() -> Vec<SecondRope> {
    let ropes = |aways_px: &[f64], rate_hz, phase_rad| -> Vec<SecondRope> {
        let rope = |away_px: &f64| SecondRope {
            away_px: *away_px,
            rate_hz,
            phase_rad,
        };
        aways_px.iter().map(rope).collect()
    };
    let mut all = ropes(&[60.0, 80.0, 110.0, -40.0, -60.0, -90.0, -120.0], 0.9, 0.0);
    for phase_rad in [1.3, 3.6] {
        all.extend(ropes(&[45.0, 100.0, -50.0, -75.0, -105.0], 0.8, phase_rad));
    }
    all
}

/// As the others, or all of it refused.
#[test]
fn a_second_rope_moves_beside() {
    for clean in clean() {
        let rgb = if clean.name == "a1" {
            [[182, 91, 48], [243, 219, 28]]
        } else {
            [[124, 85, 60], [31, 30, 26]]
        };
        for second in &second_ropes() {
            let what = format!("{second:?}");
            let altered = clean.wiggle.clone().doubled(*second, rgb);
            match outcome(&altered) {
                Err(TrackError::NoRope { evident, .. }) => {
                    println!("{}, {what}: refused, {evident:.2?} evident", clean.name);
                    // It is seldom in the way.
                    assert!(second.away_px.abs() < 90.0, "{}, {what}", clean.name);
                }
                other => assert_kept(clean, &what, altered.frames.len(), &other.unwrap()),
            }
        }
    }
}
