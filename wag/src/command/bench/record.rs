//! `wag bench record`: what recording a run costs the controller.
//!
//! One controller streams the wiggle to a simulated arm again and again, every other
//! time with the recorder beside it (without, with, with, without, ...), while the
//! simulated camera publishes. Both see the same machine and the same load.

use super::percentiles::Percentiles;
use crate::cli::BenchArgs;
use crate::config;
use crate::pipeline::{self, ArmLink, RunFolder};
use crate::session::Session;
use anyhow::{Context, ensure};
use arm_model::{JointTrajectory, Limits};
use cli_output::{Machine, OrInput, Outcome, Stage, table, watch_interrupts};
use planner::PlannerConfig;
use planner::wiggle::wiggle;
use rig_sim::RigConfig;
use run_log::files;
use serde::Serialize;
use serde_json::{Value, json};
use shared_types::OperatingMode;
use shared_types::ipc::{ControllerMode, CycleRecord};

/// Part of the arm's speed limits used between two wiggles.
const MOVE_SPEED: f64 = 0.1;
/// Where the rig's target stands; nothing is thrown at it.
const TARGET_M: [f64; 3] = [0.9, 0.0, 0.3];

/// One figure of the cycles, without and with the recorder (µs).
#[derive(Debug, Serialize)]
struct Row {
    what: &'static str,
    part: &'static str,
    without_us: f64,
    with_us: f64,
    /// With over without.
    ratio: f64,
}

/// Cycles of the wiggles without and with the recorder.
#[derive(Debug, Default)]
struct Cycles([Vec<CycleRecord>; 2]);

pub(super) fn run(args: &BenchArgs, quiet: bool) -> Outcome<Option<Value>> {
    watch_interrupts().or_failed()?;
    let room = tempfile::tempdir().or_failed()?;
    let folder = RunFolder::create(Some(&room.path().join("run")), "bench")?;
    let limits = config::built_in::<Limits>().or_failed()?;
    let motion = wiggle(
        &config::built_in::<PlannerConfig>().or_failed()?.wiggle,
        &limits,
    )
    .or_failed()?;
    let rig = pipeline::shipped_rig(None).or_input()?;
    let rig = pipeline::rig_config(&folder, &rig, args.seed, TARGET_M);
    let pairs = if args.quick {
        1
    } else {
        wiggles(f64::from(args.seconds), &motion)
    };
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    let stage = Stage::begin("wiggles", quiet);
    let measured = measure(&mut session, &folder, &limits, &rig, &motion, pairs, &stage);
    session.end(measured.is_ok());
    let (cycles, file_bytes) = measured.or_failed()?;
    stage.done(&format!(
        "{} without and {} with the recorder",
        pairs, pairs
    ));
    let rows = rows(&cycles);
    let missed = cycles
        .0
        .each_ref()
        .map(|c| c.iter().map(|c| c.missed).sum::<u32>());
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let machine = Machine::here();
    if !quiet {
        println!("{machine}; load {}", load.trim());
        let shown = rows.iter().map(|r| {
            let us = |v: f64| format!("{v:.1}");
            [
                format!("{} {}", r.what, r.part),
                us(r.without_us),
                us(r.with_us),
                format!("{:.2}", r.ratio),
            ]
        });
        println!(
            "{}",
            table::numbers(["µs", "without", "with", "ratio"], 0, shown)
        );
        println!(
            "{} and {} cycles, {} and {} missed; the file grows by {:.2} MB a wiggle",
            cycles.0[0].len(),
            cycles.0[1].len(),
            missed[0],
            missed[1],
            file_bytes as f64 / 1e6 / f64::from(pairs)
        );
    }
    Ok(Some(json!({
        "ok": true, "command": "bench record", "seed": args.seed, "machine": machine,
        "load": load.trim(), "wiggles": pairs, "rows": rows, "missed": missed,
        "cycles": cycles.0.each_ref().map(Vec::len), "file_bytes": file_bytes,
    })))
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a day of wiggles at most"
)]
fn wiggles(seconds: f64, motion: &JointTrajectory) -> u32 {
    (seconds / motion.duration_s()).ceil().max(1.0) as u32
}

fn measure(
    session: &mut Session,
    folder: &RunFolder,
    limits: &Limits,
    rig: &RigConfig,
    motion: &JointTrajectory,
    pairs: u32,
    stage: &Stage,
) -> anyhow::Result<(Cycles, u64)> {
    let client = pipeline::start_rig(session, folder, rig)?;
    let address = pipeline::arm_ports(session, &client)?;
    let arm = pipeline::start_controller(session, folder, limits, address)?;
    pipeline::acquire(session, &arm)?;
    let mut cycles = Cycles::default();
    let mut file_bytes = 0;
    for block in 0..2 * pairs {
        stage.say(format!("{} of {}", block + 1, 2 * pairs));
        pipeline::arm_for(session, &arm, OperatingMode::SetUp)?;
        pipeline::move_to(session, &arm, motion.start(), MOVE_SPEED)?;
        let with = matches!(block % 4, 1 | 2);
        if with {
            pipeline::start_recorder(
                session,
                folder,
                limits,
                Some(&rig.stereo_camera()),
                rig.target_m,
            )?;
        }
        let seen = stream(session, &arm, motion)?;
        ensure!(!seen.is_empty(), "no cycle of the wiggle was received");
        cycles.0[usize::from(with)].extend(seen);
        if with {
            session.finish_run_file()?;
            let file = folder.file(files::RUN);
            file_bytes += file.metadata().context("the recorder left no file")?.len();
            std::fs::remove_file(&file)?;
        }
    }
    Ok((cycles, file_bytes))
}

/// One wiggle; returns its cycles.
fn stream(
    session: &mut Session,
    arm: &ArmLink,
    motion: &JointTrajectory,
) -> anyhow::Result<Vec<CycleRecord>> {
    pipeline::arm_for(session, arm, OperatingMode::Wiggle)?;
    session.received.drain()?;
    session.received.cycles.cycles.clear();
    pipeline::execute(arm, motion)?.finish(session)?;
    session.received.drain()?;
    let streaming = |c: &CycleRecord| ControllerMode::from_raw(c.mode) == ControllerMode::Streaming;
    Ok(session
        .received
        .cycles
        .cycles
        .iter()
        .filter(|c| streaming(c))
        .copied()
        .collect())
}

fn rows(cycles: &Cycles) -> Vec<Row> {
    type Figure = (&'static str, fn(&CycleRecord) -> u32);
    const FIGURES: [Figure; 3] = [
        ("late wake-up", |c| c.wake_late_ns),
        ("compute", |c| c.compute_ns),
        ("wake-up to sent", |c| c.send_ns),
    ];
    let mut rows = Vec::new();
    for (what, figure) in FIGURES {
        let [without, with] = cycles.0.each_ref().map(|cycles| {
            let times_ns = cycles.iter().map(|c| u64::from(figure(c)));
            Percentiles::of(times_ns).values_us()
        });
        for (i, part) in Percentiles::NAMES.into_iter().enumerate() {
            rows.push(Row {
                what,
                part,
                without_us: without[i],
                with_us: with[i],
                ratio: with[i] / without[i].max(1e-3),
            });
        }
    }
    rows
}
