//! `wag bench record`: what recording a run costs the controller.
//!
//! One controller streams the wiggle to a simulated arm again and again, every other
//! time with the recorder beside it (without, with, with, without, ...), while the
//! simulated camera publishes. Both see the same machine and the same load.

use crate::cli::BenchArgs;
use crate::config;
use crate::pipeline::{self, RunFolder};
use anyhow::{Context, ensure};
use arm_model::{JointTrajectory, Limits};
use cli_output::{Machine, OrInput, Outcome, Stage, table, watch_interrupts};
use planner::PlannerConfig;
use planner::wiggle::wiggle;
use rig_sim::RigConfig;
use run_log::files;
use serde_json::{Value, json};
use session::Session;
use session::arm::{self, BringUp};
use shared_types::OperatingMode;
use shared_types::ipc::message::Percentiles;
use shared_types::ipc::{ControllerMode, CycleRecord};

/// Part of the arm's speed limits used between two wiggles.
const MOVE_SPEED: f64 = 0.1;
/// Where the rig's target stands; nothing is thrown at it.
const TARGET_M: [f64; 3] = [0.9, 0.0, 0.3];

pub fn run(args: &BenchArgs) -> Outcome<Option<Value>> {
    watch_interrupts().or_failed()?;
    let room = tempfile::tempdir().or_failed()?;
    let folder = RunFolder::create(Some(&room.path().join("run")), "bench")?;
    let limits = config::built_in::<Limits>().or_failed()?;
    let planner = config::built_in::<PlannerConfig>().or_failed()?;
    let motion = wiggle(&planner.wiggle, &limits).or_failed()?;
    let rig: RigConfig = config::here(None).or_input()?;
    let rig = pipeline::rig_config(&folder, &rig, args.seed, Some(TARGET_M));
    let pairs = if args.quick {
        1
    } else {
        wiggles(f64::from(args.seconds), &motion)
    };
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    let stage = Stage::begin("wiggles");
    let measured = measure(&mut session, &folder, &limits, &rig, &motion, pairs, &stage);
    session.end(measured.is_ok());
    let (cycles, file_bytes) = measured.or_failed()?;
    stage.done(&format!("{pairs} without and {pairs} with the recorder"));
    let rows = rows(&cycles);
    let missed = |cycles: &Vec<CycleRecord>| cycles.iter().map(|c| c.missed).sum::<u32>();
    let counts = cycles.each_ref().map(Vec::len);
    let missed = cycles.each_ref().map(missed);
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    let machine = Machine::here();
    println!("{machine}; load {}", load.trim());
    let shown = rows.iter().map(|(what, part, [without, with, ratio])| {
        let name = format!("{what} {part}");
        [
            name,
            format!("{without:.1}"),
            format!("{with:.1}"),
            format!("{ratio:.2}"),
        ]
    });
    let header = ["µs", "without", "with", "ratio"];
    println!("{}", table::numbers(header, 0, shown));
    println!(
        "{} and {} cycles, {} and {} missed; the file grows by {:.2} MB a wiggle",
        counts[0],
        counts[1],
        missed[0],
        missed[1],
        file_bytes as f64 / 1e6 / f64::from(pairs)
    );
    let rows = rows.iter().map(|(what, part, [without_us, with_us, ratio])| json!({
        "what": what, "part": part, "without_us": without_us, "with_us": with_us, "ratio": ratio,
    }));
    Ok(Some(json!({
        "ok": true, "command": "bench record", "seed": args.seed, "machine": machine,
        "load": load.trim(), "wiggles": pairs, "rows": rows.collect::<Vec<_>>(),
        "missed": missed, "cycles": counts, "file_bytes": file_bytes,
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

/// Cycles of the wiggles without and with the recorder, and what it wrote (bytes).
fn measure(
    session: &mut Session,
    folder: &RunFolder,
    limits: &Limits,
    rig: &RigConfig,
    motion: &JointTrajectory,
    pairs: u32,
    stage: &Stage,
) -> anyhow::Result<([Vec<CycleRecord>; 2], u64)> {
    let (_, address) = pipeline::start_rig(session, folder, rig)?;
    let arm = pipeline::controller(session, folder, limits, &address)?;
    arm::acquire(session, &arm, &mut BringUp::default())?;
    let mut cycles = [Vec::new(), Vec::new()];
    let mut file_bytes = 0;
    for block in 0..2 * pairs {
        stage.say(format!("{} of {}", block + 1, 2 * pairs));
        arm::arm_for(session, &arm, OperatingMode::SetUp, None)?;
        arm::move_to(session, &arm, motion.start(), MOVE_SPEED)?;
        let with = matches!(block % 4, 1 | 2);
        if with {
            let camera = rig.camera.stereo_camera();
            pipeline::start_recorder(session, folder, limits, Some(&camera), rig.target_m)?;
        }
        arm::arm_simulated(session, &arm, OperatingMode::Wiggle)?;
        session.received.drain()?;
        session.received.cycles.cycles.clear();
        arm::execute(session, &arm, motion)?;
        session.received.drain()?;
        let mut seen = session.received.cycles.cycles.clone();
        seen.retain(|c| c.mode == ControllerMode::Streaming as u8);
        ensure!(!seen.is_empty(), "no cycle of the wiggle was received");
        cycles[usize::from(with)].extend(seen);
        if with {
            session.finish_run_file()?;
            let file = folder.file(files::RUN);
            file_bytes += file.metadata().context("the recorder left no file")?.len();
            std::fs::remove_file(&file)?;
        }
    }
    Ok((cycles, file_bytes))
}

/// What was measured without and with the recorder (µs), and with over without.
fn rows(cycles: &[Vec<CycleRecord>; 2]) -> Vec<(&'static str, &'static str, [f64; 3])> {
    type Figure = (&'static str, fn(&CycleRecord) -> u32);
    const FIGURES: [Figure; 3] = [
        ("wake-up latency", |c| c.wake_late_ns),
        ("compute", |c| c.compute_ns),
        ("wake-up to sent", |c| c.send_ns),
    ];
    let parts = |(what, time_ns): Figure| {
        let [without, with] = cycles
            .each_ref()
            .map(|cycles| Percentiles::of_ns(cycles.iter().map(|c| u64::from(time_ns(c)))));
        [
            ("p50", without.p50_us, with.p50_us),
            ("p99", without.p99_us, with.p99_us),
            ("p99.9", without.p999_us, with.p999_us),
            ("max", without.max_us, with.max_us),
        ]
        .map(|(part, without, with)| (what, part, [without, with, with / without.max(1e-3)]))
    };
    FIGURES.into_iter().flat_map(parts).collect()
}
