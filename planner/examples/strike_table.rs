//! Plans strikes for random ropes and targets and prints how well they do.
//!
//! `strike_table [--ropes 100] [--speed 1.2] [--generations 25] [--full 0]
//! [--times 0.45,0.80,1.15] [--spread 1.0] [--seed 0] [--finalists 12]`
//!
//! `--speed` is the tool speed limit (m/s), `--spread` scales the deviations of
//! the first generation. Errors are given for the rope planned for, as the root
//! mean square over ropes off by what identification leaves open, and for an arm
//! whose joints follow with lags of 12 to 18 ms.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss,
    reason = "an example may stop with a message"
)]

use planner::ropes::{random_rope, random_strike_target};
use planner::tasks::strike::Robustness;
use planner::tasks::{StrikeConfig, StrikeOptions, StrikeRequest, ThrowSimulator, plan_strike};
use planner::trajopt::Dimensions;
use rope_sim::{Candidate, FrameTimes, MeasuredArm, Precision, SimOptions, Start, Watch, roll_out};
use shared_types::limits::LimitsSpec;
use shared_types::{JointTrajectory, JointVector, Limits};
use std::ops::ControlFlow;
use std::time::Instant;

fn argument(name: &str) -> Option<String> {
    std::env::args()
        .skip_while(|a| a != &format!("--{name}"))
        .nth(1)
}

fn number<T: std::str::FromStr>(name: &str, default: T) -> T {
    argument(name).map_or(default, |v| {
        v.parse()
            .unwrap_or_else(|_| panic!("--{name} {v} is not a number"))
    })
}

fn quantile(sorted: &[f64], part: f64) -> f64 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an index"
    )]
    let index = ((sorted.len() - 1) as f64 * part).round() as usize;
    sorted[index]
}

fn line(name: &str, mut values: Vec<f64>) {
    values.sort_by(f64::total_cmp);
    println!(
        "{name:24} median {:7.3}  p90 {:7.3}  max {:7.3}",
        quantile(&values, 0.5),
        quantile(&values, 0.9),
        quantile(&values, 1.0)
    );
}

/// Closest approach when joint j follows its command like a first-order lag of
/// 12 + j ms (cm).
fn lagging_arm_cm(request: &StrikeRequest, command: &JointTrajectory) -> f64 {
    const STEP_S: f64 = 1e-3;
    let mut q = command.start();
    let (times, joints): (Vec<f64>, Vec<JointVector>) = (0..2000)
        .map(|i| {
            let t_s = f64::from(i) * STEP_S;
            let target = command.state_at(t_s).q;
            for (j, lag_s) in (0..7).map(|j| (j, 0.012 + 1e-3 * j as f64)) {
                q[j] += (target[j] - q[j]) * (1.0 - (-STEP_S / lag_s).exp());
            }
            (t_s, q)
        })
        .step_by(4)
        .unzip();
    let arm = MeasuredArm::new(&times, &joints).expect("even samples");
    let rollouts = roll_out(
        &[Candidate::new(&request.rope, &arm)],
        &SimOptions {
            step_s: 5e-4,
            precision: Precision::F64,
            start: Start::Equilibrium,
            frames: FrameTimes::NONE,
            watch: Watch::point(request.target_m),
            horizon_s: command.duration_s() + 0.5,
            threads: 1,
        },
    )
    .expect("a planned throw simulates");
    rollouts[0]
        .watched
        .to_point
        .map_or(f64::INFINITY, |c| c.distance_m * 100.0)
}

fn config() -> StrikeConfig {
    let mut config = StrikeConfig::default();
    let spread: f64 = number("spread", 1.0);
    config.std_dev_rad = config.std_dev_rad.map(|s| s * spread);
    if let Some(times) = argument("times") {
        let parsed: Vec<f64> = times
            .split(',')
            .map(|t| t.parse().expect("--times takes three numbers"))
            .collect();
        config.waypoint_times_s = parsed.try_into().expect("--times takes three numbers");
    }
    config.robustness.finalists = number("finalists", config.robustness.finalists);
    config
}

fn main() {
    let config = config();
    let mut spec = LimitsSpec::from(Limits::default());
    spec.tcp_speed_max_m_s = number("speed", spec.tcp_speed_max_m_s);
    let limits = Limits::try_from(spec).expect("a positive speed");
    let (mut exact, mut off, mut lagging) = (vec![], vec![], vec![]);
    let (mut seconds, mut draws) = (vec![], vec![]);
    let mut refused = 0;
    for seed in 0..number("ropes", 100) {
        let seed = seed + number("seed", 0u64) * 1000;
        let request = StrikeRequest {
            rope: random_rope(seed),
            target_m: random_strike_target(seed),
            limits: limits.clone(),
            options: StrikeOptions {
                dimensions: if number("full", 0) == 1 {
                    Dimensions::Full
                } else {
                    Dimensions::Planar
                },
                generations: number("generations", 25),
                seed,
                ..StrikeOptions::default()
            },
            config: config.clone(),
        };
        let start = Instant::now();
        let plan = match plan_strike(&request, &mut |_| ControlFlow::Continue(())) {
            Ok(plan) => plan,
            Err(error) => {
                println!("rope {seed}: {error}");
                refused += 1;
                continue;
            }
        };
        seconds.push(start.elapsed().as_secs_f64());
        let ropes = Robustness::default().variants(&request.rope);
        let throws: Vec<_> = ropes.iter().map(|r| (r, &plan.trajectory)).collect();
        let outcomes = ThrowSimulator::for_strike(&request)
            .run(&throws)
            .expect("a planned throw simulates");
        let squares: f64 = outcomes.iter().map(|o| o.closest_m.powi(2)).sum();
        let rms_cm = (squares / outcomes.len() as f64).sqrt() * 100.0;
        if argument("verbose").is_some() {
            println!(
                "rope {seed:3} L {:.2} k {:.2} c {:.3} mu {:.3} lead {:.3} target {:.2?} error {:.2} cm, off {:.2} cm at {:.2} s",
                request.rope.length_m,
                request.rope.joint_stiffness_nm_per_rad,
                request.rope.joint_damping_nms_per_rad,
                request.rope.mass_per_length_kg_per_m,
                request.rope.lead_mass_kg,
                request.target_m,
                plan.predicted_error_m * 100.0,
                rms_cm,
                plan.predicted_time_s
            );
        }
        lagging.push(lagging_arm_cm(&request, &plan.trajectory));
        exact.push(plan.predicted_error_m * 100.0);
        off.push(rms_cm);
        draws.push(f64::from(plan.resampled));
    }
    if refused > 0 {
        println!("{refused} refused");
    }
    line("error (cm)", exact);
    line("error, rope off (cm)", off);
    line("error, arm lags (cm)", lagging);
    line("seconds", seconds);
    line("redraws", draws);
}
