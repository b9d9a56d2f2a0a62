//! Identifies random ropes from synthetic films and prints the errors; then
//! throws at random targets with the identified and judges with the true rope.
//!
//! `identify_table [--ropes 20] [--noise 1.0] [--shared 0.5] [--degrees 18]
//! [--hertz 1.1] [--generations 50] [--throw 1] [--verbose 1]`
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss,
    reason = "an example may stop with a message"
)]

use planner::filming::{FilmNoise, FilmTiming, film, side_camera};
use planner::ropes::{random_rope, random_strike_target};
use planner::sysid::{Appearance, IdentifyOptions, Observation, identify};
use planner::tasks::{StrikeConfig, StrikeOptions, StrikeRequest, ThrowSimulator, plan_strike};
use planner::wiggle::{WiggleConfig, wiggle};
use rope_sim::PlannedArm;
use shared_types::{Limits, RopeEstimate, RopeParams};
use std::ops::ControlFlow;
use std::time::Instant;

fn number<T: std::str::FromStr>(name: &str, default: T) -> T {
    std::env::args()
        .skip_while(|a| a != &format!("--{name}"))
        .nth(1)
        .map_or(default, |v| {
            v.parse()
                .unwrap_or_else(|_| panic!("--{name} {v} is not a number"))
        })
}

fn line(name: &str, mut values: Vec<f64>) {
    values.sort_by(f64::total_cmp);
    let at = |part: usize| values[(values.len() - 1) * part / 10];
    println!(
        "{name:34} median {:8.3}  p90 {:8.3}  max {:8.3}",
        at(5),
        at(9),
        at(10)
    );
}

/// Error of the strike planned for `found` and thrown with `rope` (cm).
fn strike_error_cm(rope: &RopeParams, found: &RopeParams, seed: u64) -> f64 {
    let request = StrikeRequest {
        rope: *found,
        target_m: random_strike_target(seed),
        limits: Limits::default(),
        options: StrikeOptions {
            seed,
            ..StrikeOptions::default()
        },
        config: StrikeConfig::default(),
    };
    let plan = plan_strike(&request, &mut |_| ControlFlow::Continue(()))
        .expect("targets of the table are in reach");
    ThrowSimulator::for_strike(&request)
        .run(&[(rope, &plan.trajectory)])
        .expect("a planned throw simulates")[0]
        .closest_m
        * 100.0
}

fn relative(found: &RopeParams, truth: &RopeParams, f: impl Fn(&RopeParams) -> f64) -> f64 {
    (f(found) / f(truth) - 1.0).abs() * 100.0
}

fn main() {
    let config = WiggleConfig {
        amplitude_rad: number("degrees", 18.0f64).to_radians(),
        frequency_hz: number("hertz", 1.1),
        ..WiggleConfig::default()
    };
    let motion =
        PlannedArm::new(wiggle(&config, &Limits::default()).expect("a wiggle within the limits"));
    let camera = side_camera();
    let mut columns: [Vec<f64>; 10] = Default::default();
    for seed in 0..number("ropes", 20u64) {
        let rope = random_rope(seed + 500);
        let clock_offset_s = ((seed % 9) as f64 - 4.0) * 6e-3;
        let noise = FilmNoise {
            shared_part: number("shared", 0.5),
            clock_offset_s,
            ..FilmNoise::white(number("noise", 1.0), seed)
        };
        let filmed = film(&rope, &motion, &camera, 25, &FilmTiming::default(), &noise)
            .expect("a rope of the ranges");
        let observation = Observation {
            track: &filmed.track,
            camera: &camera,
            motion: &motion,
            appearance: Appearance {
                rope_radius_m: Some(rope.radius_m),
                lead_radius_m: Some(rope.lead_radius_m * 1.05),
            },
        };
        let identify_options = IdentifyOptions {
            generations: number("generations", 50),
            seed,
            ..IdentifyOptions::default()
        };
        let start = Instant::now();
        let RopeEstimate {
            params: found,
            std_dev,
            residual_px,
            simulations,
            time_offset_s,
            ..
        } = identify(&observation, &identify_options, &mut |_| {
            ControlFlow::Continue(())
        })
        .expect("a clean film");
        let seconds = start.elapsed().as_secs_f64();
        let bending = |r: &RopeParams| {
            r.joint_stiffness_nm_per_rad * r.link_length_m() / r.mass_per_length_kg_per_m
        };
        let damping = |r: &RopeParams| {
            r.joint_damping_nms_per_rad * r.link_length_m() / r.mass_per_length_kg_per_m
        };
        let lead = |r: &RopeParams| r.lead_mass_kg / r.mass_per_length_kg_per_m;
        let length_mm = (found.length_m - rope.length_m).abs() * 1e3;
        let row = [
            length_mm,
            relative(&found, &rope, bending),
            relative(&found, &rope, damping),
            relative(&found, &rope, lead),
            (time_offset_s - clock_offset_s).abs() * 1e3,
            length_mm * 1e-3 / std_dev[1].unwrap_or(f64::NAN),
            residual_px,
            f64::from(simulations),
            seconds,
            if number("throw", 1) == 1 {
                strike_error_cm(&rope, &found, seed)
            } else {
                0.0
            },
        ];
        if number("verbose", 0) == 1 {
            println!(
                "{seed}: {row:.2?}\n  true  {:.4?}\n  found {:.4?}",
                rope.to_array(),
                found.to_array()
            );
        }
        for (column, value) in columns.iter_mut().zip(row) {
            column.push(value);
        }
    }
    let names = [
        "length (mm)",
        "bending stiffness / mass (%)",
        "damping / mass (%)",
        "lead mass / mass (%)",
        "clock offset (ms)",
        "length error / its deviation",
        "residual (px)",
        "simulations",
        "seconds",
        "strike with the identified (cm)",
    ];
    for (name, column) in names.into_iter().zip(columns) {
        line(name, column);
    }
}
