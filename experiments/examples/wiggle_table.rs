//! Clearance of random ropes, half of them of the longest kind, over a grid of
//! wiggles: `wiggle_table [ropes]`.
#![allow(clippy::expect_used, reason = "an example may stop with a message")]

use arm_model::Limits;
use planner::collide::Scene;
use planner::ropes::random_rope;
use planner::wiggle::{WiggleConfig, clearance, wiggle};
use shared_types::RopeParams;

fn main() {
    let count = std::env::args()
        .nth(1)
        .map_or(128, |a| a.parse().expect("a number of ropes"));
    let ropes: Vec<RopeParams> = (0..count)
        .map(|seed| {
            let mut rope = random_rope(seed);
            if seed % 2 == 0 {
                rope.length_m = 0.65;
            }
            rope
        })
        .collect();
    println!("amplitude  frequency  smallest gap  largest swing  median swing (m)");
    for frequency_hz in [0.5, 0.65, 0.75, 0.9, 1.1, 1.3, 1.5] {
        for degrees in [10.0_f64, 15.0, 20.0, 25.0] {
            let config = WiggleConfig {
                amplitude_rad: degrees.to_radians(),
                frequency_hz,
                ..WiggleConfig::default()
            };
            let trajectory = match wiggle(&config, &Limits::default()) {
                Ok(trajectory) => trajectory,
                Err(error) => {
                    println!("{degrees:6.0} deg {frequency_hz:7.2} Hz  {error}");
                    continue;
                }
            };
            let all = clearance(&trajectory, &ropes, &Scene::default(), 2)
                .expect("ropes of the ranges simulate");
            let gap = all.iter().map(|c| c.gap_m).fold(f64::INFINITY, f64::min);
            let mut swings: Vec<f64> = all.iter().map(|c| c.swing_m).collect();
            swings.sort_by(f64::total_cmp);
            println!(
                "{degrees:6.0} deg {frequency_hz:7.2} Hz {gap:11.3} {:14.3} {:13.3}",
                swings[swings.len() - 1],
                swings[swings.len() / 2]
            );
        }
    }
}
