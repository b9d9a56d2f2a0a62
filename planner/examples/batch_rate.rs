//! How fast a batch of ropes is simulated, beside the Python package: `benches/python/rate.py`.
//!
//! `batch_rate ROPES FRAMES_HZ THREADS`: for every line of standard input one batch, wiggled, in
//! single precision; for every batch a line with its seconds.
#![allow(clippy::expect_used, reason = "a measuring program may stop loudly")]

use planner::ropes::random_rope;
use planner::wiggle::{WiggleConfig, wiggling_arm};
use rope_sim::{Candidate, FrameTimes, Precision, SimOptions, Watch, roll_out};
use std::io::Write;
use std::time::Instant;

/// The package's own default.
const STEP_S: f64 = 5e-4;
const HORIZON_S: f64 = 4.0;
const POINT_M: [f64; 3] = [0.9, 0.0, 0.1];

fn main() {
    let mut args = std::env::args().skip(1);
    let mut number = || {
        let word = args.next().expect("batch_rate ROPES FRAMES_HZ THREADS");
        word.parse::<u32>().expect("a number")
    };
    let (ropes, frames_hz, threads) = (u64::from(number()), number(), number());
    let ropes: Vec<_> = (0..ropes).map(random_rope).collect();
    let arm = wiggling_arm(&WiggleConfig::default()).expect("the usual wiggle");
    let candidates: Vec<_> = ropes
        .iter()
        .map(|rope| Candidate::new(rope, &arm).watching(POINT_M))
        .collect();
    let frames = if frames_hz == 0 {
        FrameTimes::NONE
    } else {
        FrameTimes {
            first_s: 0.0,
            period_s: 1.0 / f64::from(frames_hz),
            count: (HORIZON_S * f64::from(frames_hz)) as usize + 1,
        }
    };
    let options = SimOptions {
        frames,
        watch: Watch::NOTHING,
        threads: threads as usize,
        ..SimOptions::new(STEP_S, Precision::F32, HORIZON_S)
    };
    for line in std::io::stdin().lines() {
        line.expect("standard input is text");
        let begin = Instant::now();
        let rollouts = roll_out(&candidates, &options).expect("ropes of the ranges");
        let seconds = begin.elapsed().as_secs_f64();
        assert_eq!(rollouts.len(), candidates.len());
        println!("{seconds}");
        std::io::stdout().flush().expect("a reader");
    }
}
